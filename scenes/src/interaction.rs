//! A point of a surface where light scatters.

use crate::emitter::EmitterId;
use crate::ray::SurfacePoint;
use sampling::bsdf::{Bsdf, BsdfModel, BsdfSample, Lobes, TransportMode};
use sampling::math::{Frame, Spectrum};
use sampling::{Vec2, Vec3};

/// A point on a surface, with its frame and its BSDF resolved. Directions are in world space and point away from it.
///
/// The geometric normal is the surface's own front; it is never turned towards `wo`. Which side a direction is on is decided
/// by the geometric normal; where the shading normal disagrees, nothing scatters, so that light neither leaks through a
/// surface nor reflects off its back \[Veach97, 5.3\].
#[derive(Clone, Copy, Debug)]
pub struct Interaction {
    /// Where it is, and how rays leave it.
    pub point: SurfacePoint,
    /// Parameter along the ray that found it.
    pub t: f32,
    /// Shading frame; its z axis is the shading normal, on the geometric normal's side.
    pub frame: Frame,
    /// True if the shading normal may differ from the geometric one.
    pub smooth: bool,
    /// The mesh's own texture coordinates, or the triangle's barycentric ones; zero on spheres.
    pub uv: Vec2,
    /// The scattering model at this point.
    pub bsdf: Bsdf,
    /// The emitter this surface belongs to.
    pub emitter: Option<EmitterId>,
}

impl Interaction {
    /// The shading normal.
    #[inline]
    pub fn ns(&self) -> Vec3 {
        self.frame.z
    }

    /// True if it has a lobe that a connection can use, one that isn't a Dirac delta.
    #[inline]
    pub fn is_connectable(&self) -> bool {
        self.bsdf.lobes().intersects(Lobes::NON_DELTA)
    }

    /// f_s(wo, wi) \[1/sr\] without the cosine, times the adjoint factor where importance is carried.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Spectrum {
        let (local_o, local_i) = (self.frame.to_local(wo), self.frame.to_local(wi));
        match self.agreement(wo, wi, local_o, local_i, mode) {
            Some(factor) => self.bsdf.eval(local_o, local_i, Lobes::ALL, mode) * factor,
            None => Spectrum::ZERO,
        }
    }

    /// Density \[1/sr\] of sampling `wi` given `wo`; delta lobes count as 0.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
        let (local_o, local_i) = (self.frame.to_local(wo), self.frame.to_local(wi));
        match self.agreement(wo, wi, local_o, local_i, mode) {
            Some(_) => self.bsdf.pdf(local_o, local_i, mode),
            None => 0.0,
        }
    }

    /// `eval` and `pdf` in one call.
    #[inline]
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Spectrum, f32) {
        let (local_o, local_i) = (self.frame.to_local(wo), self.frame.to_local(wi));
        match self.agreement(wo, wi, local_o, local_i, mode) {
            Some(factor) => {
                let (value, pdf) = self.bsdf.eval_pdf(local_o, local_i, mode);
                (value * factor, pdf)
            }
            None => (Spectrum::ZERO, 0.0),
        }
    }

    /// Samples a direction `wi`, in world space; the weight includes the adjoint factor.
    ///
    /// None if the model failed to sample or the two normals disagree about a side.
    #[inline]
    pub fn sample(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        let local_o = self.frame.to_local(wo);
        let mut sample = self.bsdf.sample(local_o, uc, u, mode)?;
        let local_i = sample.wi;
        sample.wi = self.frame.to_world(local_i);
        let factor = self.agreement(wo, sample.wi, local_o, local_i, mode)?;
        sample.weight = sample.weight * factor;
        Some(sample)
    }

    /// None if the shading and the geometric normal disagree about the side of a direction; else the adjoint factor,
    /// |wo·ns| |wi·ng| / (|wo·ng| |wi·ns|) where importance is carried \[Veach97, (5.19)\], 1 for radiance.
    #[inline]
    fn agreement(&self, wo: Vec3, wi: Vec3, local_o: Vec3, local_i: Vec3, mode: TransportMode) -> Option<f32> {
        if !self.smooth {
            return Some(1.0);
        }
        let (o_ng, i_ng) = (wo.dot(self.point.ng), wi.dot(self.point.ng));
        if !same_side(o_ng, local_o.z) || !same_side(i_ng, local_i.z) {
            return None;
        }
        match mode {
            TransportMode::Radiance => Some(1.0),
            TransportMode::Importance => Some((local_o.z * i_ng / (o_ng * local_i.z)).abs()),
        }
    }
}

/// True if both cosines are positive or both negative; their product might underflow.
#[inline]
fn same_side(a: f32, b: f32) -> bool {
    (a > 0.0 && b > 0.0) || (a < 0.0 && b < 0.0)
}
