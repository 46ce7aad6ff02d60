//! The point emitter.

use super::{Endpoint, EndpointKind, LeSample, LiSample};
use crate::ray::SurfacePoint;
use sampling::math::Spectrum;
use sampling::{Vec2, Vec3, warp};
use std::f64::consts::PI;

/// A point that emits evenly in all directions.
#[derive(Clone, Copy, Debug)]
pub struct PointEmitter {
    /// Position \[m\].
    pub position: Vec3,
    /// Radiant intensity \[W/sr\].
    pub intensity: Spectrum,
}

impl PointEmitter {
    /// Emitted power \[W\], the mean of the channels.
    pub fn power(&self) -> f64 {
        4.0 * PI * f64::from(self.intensity.mean())
    }

    #[inline]
    fn endpoint(&self) -> Endpoint {
        Endpoint { at: SurfacePoint::free(self.position), kind: EndpointKind::Point }
    }

    /// The connection from a reference point; None from the very position.
    #[inline]
    pub fn sample_li(&self, p_ref: Vec3) -> Option<LiSample> {
        let to_emitter = self.position - p_ref;
        let squared = to_emitter.length_squared();
        if squared == 0.0 {
            return None;
        }
        let distance = squared.sqrt();
        Some(LiSample {
            endpoint: self.endpoint(),
            wi: to_emitter / distance,
            distance,
            li: self.intensity / squared,
            pdf: 1.0,
            delta: true,
        })
    }

    /// A direction uniform over the sphere.
    #[inline]
    pub fn sample_le(&self, u_d: Vec2) -> LeSample {
        let endpoint = self.endpoint();
        LeSample {
            endpoint,
            ray: endpoint.at.spawn(warp::uniform_sphere(u_d)),
            le: self.intensity,
            pdf_p: 1.0,
            pdf_d: warp::uniform_sphere_pdf(),
            cos: 1.0,
        }
    }
}
