//! The constant environment.

use super::{Endpoint, EndpointKind, LeSample, LiSample};
use crate::scene::BoundingSphere;
use sampling::fault;
use sampling::math::Spectrum;
use sampling::{Vec2, Vec3, warp};
use std::f32::consts::PI;

/// Light arriving evenly from all directions.
///
/// Its light walks start on a disc across the scene's bounding sphere, so that every ray that can meet the scene is found.
#[derive(Clone, Copy, Debug)]
pub struct ConstantEnvironment {
    /// Radiance \[W/(m²·sr)\].
    pub radiance: Spectrum,
    /// Centre of the scene's bounding sphere \[m\].
    pub center: Vec3,
    /// Radius of the scene's bounding sphere \[m\].
    pub radius: f32,
}

impl ConstantEnvironment {
    /// Power that passes the bounding sphere's discs \[W\], the mean of the channels.
    pub fn power(&self) -> f64 {
        let disc = f64::from(PI) * f64::from(self.radius) * f64::from(self.radius);
        4.0 * f64::from(PI) * disc * f64::from(self.radiance.mean())
    }

    #[inline]
    fn bounds(&self) -> BoundingSphere {
        BoundingSphere { center: self.center, radius: self.radius }
    }

    /// The light end of paths that arrive from direction `d` (unit, pointing out of the scene).
    #[inline]
    pub fn endpoint(&self, d: Vec3) -> Endpoint {
        Endpoint { at: self.bounds().far_point(d), kind: EndpointKind::Infinite }
    }

    /// A direction uniform over the sphere.
    #[inline]
    pub fn sample_li(&self, u: Vec2) -> LiSample {
        let wi = warp::uniform_sphere(u);
        LiSample {
            endpoint: self.endpoint(wi),
            wi,
            distance: f32::INFINITY,
            li: self.radiance,
            pdf: fault!("environment_density_of_a_hemisphere", 1.0, 2.0) * warp::uniform_sphere_pdf(),
            delta: false,
        }
    }

    /// A direction uniform over the sphere, and a position uniform over the disc across the scene.
    #[inline]
    pub fn sample_le(&self, u_p: Vec2, u_d: Vec2) -> LeSample {
        let outwards = warp::uniform_sphere(u_p);
        let (pdf_p, pdf_d) = self.pdf_le();
        LeSample {
            endpoint: self.endpoint(outwards),
            ray: self.bounds().ray_in(outwards, u_d),
            le: self.radiance,
            pdf_p,
            pdf_d,
            cos: 1.0,
        }
    }

    /// The densities of a light walk: of its direction \[1/sr\] and of its position on the disc \[1/m²\].
    #[inline]
    pub fn pdf_le(&self) -> (f32, f32) {
        (warp::uniform_sphere_pdf(), self.bounds().disc_pdf_area())
    }
}
