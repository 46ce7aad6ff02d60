//! The spot: a point that emits into a cone.

use super::{Endpoint, EndpointKind, LeSample, LiSample};
use crate::ray::SurfacePoint;
use glam::DVec3;
use sampling::fault;
use sampling::math::{Frame, Spectrum};
use sampling::{Vec2, Vec3, warp};
use std::f64::consts::PI;

/// How a spot's intensity goes from all at `beam` to nothing at `cutoff`, by the angle θ off its axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Falloff {
    /// Linear in θ.
    #[default]
    Linear,
    /// Smoothstep, 3x² − 2x³, of x = (cos θ − cos cutoff) / (cos beam − cos cutoff) \[PBRT4, 12.2.1\].
    Smooth,
}

impl Falloff {
    /// The names by which it is chosen.
    pub const NAMES: [&str; 2] = ["linear", "smooth"];
    /// All of them, in the order of their names.
    pub const ALL: [Self; 2] = [Self::Linear, Self::Smooth];
}

/// A spot as it is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Position \[m\].
    pub position: DVec3,
    /// A point on the axis \[m\].
    pub target: DVec3,
    /// Radiant intensity on the axis \[W/sr\].
    pub intensity: Spectrum,
    /// Angle off the axis beyond which it is dark \[rad\], in (0, π].
    pub cutoff: f64,
    /// Angle off the axis within which it has all its intensity \[rad\], in \[0, `cutoff`\].
    pub beam: f64,
    /// What lies between the two.
    pub falloff: Falloff,
}

/// A point that emits into a cone.
///
/// Angles are compared by their haversines, sin²(θ/2), which tell directions apart however narrow the cone is.
#[derive(Clone, Copy, Debug)]
pub struct SpotEmitter {
    /// Position \[m\].
    pub position: Vec3,
    /// Unit direction of the axis.
    pub axis: Vec3,
    /// Radiant intensity on the axis \[W/sr\].
    pub intensity: Spectrum,
    /// Angle off the axis beyond which it is dark \[rad\].
    pub cutoff: f32,
    /// Angle off the axis within which it has all its intensity \[rad\].
    pub beam: f32,
    /// What lies between the two.
    pub falloff: Falloff,
    /// The haversines of `cutoff` and `beam`.
    haversines: [f32; 2],
}

impl SpotEmitter {
    /// The spot in a scene whose origin lies at `shift`.
    pub(crate) fn new(given: &Spot, shift: DVec3) -> Self {
        SpotEmitter {
            position: (given.position - shift).as_vec3(),
            axis: (given.target - given.position).normalize().as_vec3(),
            intensity: given.intensity,
            cutoff: given.cutoff as f32,
            beam: given.beam as f32,
            falloff: given.falloff,
            haversines: [given.cutoff, given.beam].map(|angle| ((angle / 2.0).sin().powi(2)) as f32),
        }
    }

    /// Emitted power \[W\], the mean of the channels: the closed form of ∫ I(θ) 2π sin θ dθ.
    pub fn power(&self) -> f64 {
        let (beam, cutoff) = (f64::from(self.beam), f64::from(self.cutoff));
        let (middle, half) = ((cutoff + beam) / 2.0, (cutoff - beam) / 2.0);
        let sinc = if half == 0.0 { 1.0 } else { half.sin() / half };
        let share = match self.falloff {
            // 1 − (sin cutoff − sin beam) / (cutoff − beam).
            Falloff::Linear => 1.0 - middle.cos() * sinc,
            // Smoothstep's mean is ½, and what is integrated over is the cosine.
            Falloff::Smooth => 1.0 - (beam.cos() + cutoff.cos()) / 2.0,
        };
        2.0 * PI * share * f64::from(self.intensity.mean())
    }

    /// Radiant intensity in direction `d` (unit) \[W/sr\].
    #[inline]
    pub fn intensity(&self, d: Vec3) -> Spectrum {
        let (off, [cutoff, beam]) = (self.off_axis(d), self.haversines);
        if off <= fault!("penumbra_forgotten", beam, cutoff) {
            return self.intensity;
        }
        if off >= cutoff {
            return Spectrum::ZERO;
        }
        let share = match self.falloff {
            Falloff::Linear => ((self.cutoff - 2.0 * off.sqrt().asin()) / (self.cutoff - self.beam)).clamp(0.0, 1.0),
            Falloff::Smooth => {
                let x = (cutoff - off) / (cutoff - beam);
                x * x * (3.0 - 2.0 * x)
            }
        };
        self.intensity * share
    }

    /// The haversine of a direction's angle off the axis.
    #[inline]
    fn off_axis(&self, d: Vec3) -> f32 {
        ((d - self.axis).length_squared() * 0.25).min(1.0)
    }

    #[inline]
    fn endpoint(&self) -> Endpoint {
        Endpoint { at: SurfacePoint::free(self.position), kind: EndpointKind::Point }
    }

    /// The connection from a reference point; None from where it is dark, and from the very position.
    #[inline]
    pub fn sample_li(&self, p_ref: Vec3) -> Option<LiSample> {
        let to_emitter = self.position - p_ref;
        let squared = to_emitter.length_squared();
        if squared == 0.0 {
            return None;
        }
        let distance = squared.sqrt();
        let wi = to_emitter / distance;
        let intensity = self.intensity(-wi);
        if intensity.is_zero() {
            return None;
        }
        Some(LiSample { endpoint: self.endpoint(), wi, distance, li: intensity / squared, pdf: 1.0, delta: true })
    }

    /// A direction uniform over the cone.
    #[inline]
    pub fn sample_le(&self, u_d: Vec2) -> LeSample {
        let endpoint = self.endpoint();
        let d = Frame::from_z(self.axis).to_world(warp::uniform_cone(u_d, self.one_minus_cos_cutoff()));
        LeSample {
            endpoint,
            ray: endpoint.at.spawn(d),
            le: self.intensity(d),
            pdf_p: 1.0,
            pdf_d: self.cone_pdf(),
            cos: 1.0,
        }
    }

    /// The density of `sample_le`'s direction \[1/sr\]; 0 outside the cone.
    #[inline]
    pub fn pdf_le(&self, d: Vec3) -> f32 {
        if self.off_axis(d) <= self.haversines[0] { self.cone_pdf() } else { 0.0 }
    }

    #[inline]
    fn cone_pdf(&self) -> f32 {
        let pdf = warp::uniform_cone_pdf(self.one_minus_cos_cutoff());
        fault!("cone_density_of_a_sphere", pdf, warp::uniform_sphere_pdf())
    }

    #[inline]
    fn one_minus_cos_cutoff(&self) -> f32 {
        2.0 * self.haversines[0]
    }
}
