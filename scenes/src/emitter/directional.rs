//! The directional emitter: parallel light.

use super::{Endpoint, EndpointKind, LeSample, LiSample};
use crate::ray::SurfacePoint;
use crate::scene::BoundingSphere;
use sampling::Vec2;
use sampling::Vec3;
use sampling::math::Spectrum;

/// Light that flies in one direction, evenly over all of the scene, as the sun's nearly does.
///
/// Its light walks start on a disc across the scene's bounding sphere.
#[derive(Clone, Copy, Debug)]
pub struct DirectionalEmitter {
    /// Unit direction of flight.
    pub direction: Vec3,
    /// Irradiance of a surface across the light \[W/m²\].
    pub irradiance: Spectrum,
    /// The scene's bounding sphere.
    pub bounds: BoundingSphere,
}

impl DirectionalEmitter {
    /// Power that passes the bounding sphere's disc \[W\], the mean of the channels.
    pub fn power(&self) -> f64 {
        self.bounds.disc_area() * f64::from(self.irradiance.mean())
    }

    /// The light end of all its paths.
    #[inline]
    fn endpoint(&self) -> Endpoint {
        let at: SurfacePoint = self.bounds.far_point(-self.direction);
        Endpoint { at, kind: EndpointKind::Direction }
    }

    /// The connection from any reference point; `li` is the irradiance across the light \[W/m²\].
    #[inline]
    pub fn sample_li(&self) -> LiSample {
        LiSample {
            endpoint: self.endpoint(),
            wi: -self.direction,
            distance: f32::INFINITY,
            li: self.irradiance,
            pdf: 1.0,
            delta: true,
        }
    }

    /// A position uniform over the disc across the scene; the direction is certain, and `le` is the irradiance.
    #[inline]
    pub fn sample_le(&self, u: Vec2) -> LeSample {
        LeSample {
            endpoint: self.endpoint(),
            ray: self.bounds.ray_in(-self.direction, u),
            le: self.irradiance,
            pdf_p: 1.0,
            pdf_d: self.bounds.disc_pdf_area(),
            cos: 1.0,
        }
    }

    /// The densities of a light walk: 1 for its direction, and that of its position on the disc \[1/m²\].
    #[inline]
    pub fn pdf_le(&self) -> (f32, f32) {
        (1.0, self.bounds.disc_pdf_area())
    }
}
