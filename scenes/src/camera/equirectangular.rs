//! The camera that sees all around.

use super::film::Raster;
use super::view::View;
use super::{CameraSettings, WeSample, WiSample};
use crate::error::SceneError;
use crate::ray::{Ray, SurfacePoint};
use glam::DVec3;
use sampling::fault;
use sampling::{Vec2, Vec3, vec2};
use std::f32::consts::{FRAC_1_PI, PI, TAU};

/// A point that sees all directions, by their longitude along x and their latitude along y.
///
/// The middle of the image looks at the target, longitudes grow to the right, and the upper border is straight up in the image.
/// A pixel's value is the mean of radiance over its square of longitudes and latitudes, so that directions near the poles count
/// for more than their solid angle, dω = cos φ dφ dλ. A raster position uniform over the image gives directions of density
/// 1/(2π² cos φ), which is the importance that makes every sample's weight 1, with no cosine at a point without a normal. Towards
/// a pole it grows without bound, and the variance of what light walks splat into its row of pixels with it, as a logarithm.
#[derive(Clone, Copy, Debug)]
pub struct Equirectangular {
    pub(super) view: View,
    pub(super) raster: Raster,
}

impl Equirectangular {
    pub(super) fn new(settings: &CameraSettings, shift: DVec3) -> Result<Self, SceneError> {
        Ok(Equirectangular { raster: Raster::of(settings)?, view: View::new(settings, shift)? })
    }

    /// Density \[1/sr\] of a direction of this cosine of the latitude, in either sense.
    #[inline]
    fn pdf(cos: f32) -> f32 {
        let cos = fault!("solid_angle_of_latitude_left_out", cos.abs(), 1.0);
        1.0 / (2.0 * PI * PI * cos)
    }

    /// Places beyond the poles lie on the other side.
    #[inline]
    pub(super) fn sample_we(&self, raster: Vec2) -> WeSample {
        let View { position, forward, right, up } = self.view;
        let place = raster / self.raster.size();
        let (sin_longitude, cos_longitude) = (TAU * (place.x - 0.5)).sin_cos();
        let (sin, cos) = (PI * (0.5 - place.y)).sin_cos();
        let d = (forward * cos_longitude + right * sin_longitude) * cos + up * sin;
        WeSample {
            ray: Ray::new(position, d),
            at: SurfacePoint::free(position),
            weight: 1.0,
            pdf_p: 1.0,
            pdf_d: Self::pdf(cos),
        }
    }

    /// The cosine of a direction's latitude.
    #[inline]
    fn cos_latitude(&self, d: Vec3) -> f32 {
        let (forward, right) = (d.dot(self.view.forward), d.dot(self.view.right));
        (forward * forward + right * right).sqrt()
    }

    #[inline]
    pub(super) fn we(&self, d: Vec3) -> (f32, Vec2) {
        let cos = self.cos_latitude(d);
        let longitude = d.dot(self.view.right).atan2(d.dot(self.view.forward));
        let latitude = d.dot(self.view.up).atan2(cos);
        let size = self.raster.size();
        let x = (longitude * (0.5 * FRAC_1_PI) + 0.5) * size.x;
        let y = (0.5 - latitude * FRAC_1_PI) * size.y;
        // Half a turn to the right is half a turn to the left; the pole below belongs to the last row.
        let raster = vec2(if x >= 0.0 && x < size.x { x } else { 0.0 }, y.clamp(0.0, size.y.next_down()));
        (Self::pdf(cos), raster)
    }

    #[inline]
    pub(super) fn pdf_we(&self, d: Vec3) -> (f32, f32) {
        (1.0, Self::pdf(self.cos_latitude(d)))
    }

    #[inline]
    pub(super) fn sample_wi(&self, p_ref: Vec3) -> Option<WiSample> {
        let to_camera = self.view.position - p_ref;
        let squared = to_camera.length_squared();
        if squared == 0.0 {
            return None;
        }
        let wi = to_camera * squared.sqrt().recip();
        let (we, raster) = self.we(-wi);
        Some(WiSample { at: SurfacePoint::free(self.view.position), wi, raster, we, pdf: squared })
    }
}
