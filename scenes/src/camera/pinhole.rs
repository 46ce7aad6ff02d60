//! The pinhole camera.

use super::film::Film;
use super::view::View;
use super::{CameraSettings, WeSample, WiSample, half_field};
use crate::error::SceneError;
use crate::ray::{Ray, SurfacePoint};
use glam::DVec3;
use sampling::fault;
use sampling::{Vec2, Vec3};

/// A pinhole with a film at distance 1, of area A.
///
/// A raster position uniform over the film gives directions of density 1/(A cos³θ), and the importance that makes every
/// sample's weight 1 is We = 1/(A cos⁴θ) \[PBRT4, 5.4\].
#[derive(Clone, Copy, Debug)]
pub struct Pinhole {
    pub(super) view: View,
    pub(super) film: Film,
}

impl Pinhole {
    /// A pinhole of this field of view along the shorter side \[degrees\], in coordinates shifted by `−shift`.
    pub(super) fn new(settings: &CameraSettings, fov: f64, shift: DVec3) -> Result<Self, SceneError> {
        let half = half_field(fov)?;
        Ok(Pinhole { film: Film::new(settings, half)?, view: View::new(settings, shift)? })
    }

    #[inline]
    fn point(&self) -> SurfacePoint {
        SurfacePoint::free(self.view.position)
    }

    #[inline]
    pub(super) fn sample_we(&self, raster: Vec2) -> WeSample {
        let View { position, forward, right, up } = self.view;
        let Vec2 { x, y } = self.film.place(raster);
        let cos = (1.0 + x * x + y * y).sqrt().recip();
        let d = (forward + right * x + up * y) * cos;
        WeSample {
            ray: Ray::new(position, d),
            at: self.point(),
            weight: 1.0,
            pdf_p: 1.0,
            pdf_d: 1.0 / (self.film.area * cos * cos * cos),
        }
    }

    /// The cosine at the camera and the raster position of a direction; None where no pixel's filter reaches.
    #[inline]
    fn project(&self, d: Vec3) -> Option<(f32, Vec2)> {
        let cos = d.dot(self.view.forward);
        if cos <= 0.0 {
            return None;
        }
        Some((cos, self.film.raster_of(self.view.across(d), 0.5 / cos)?))
    }

    #[inline]
    pub(super) fn we(&self, d: Vec3) -> Option<(f32, Vec2)> {
        let (cos, raster) = self.project(d)?;
        Some((1.0 / (self.film.area * (cos * cos) * (cos * cos)), raster))
    }

    #[inline]
    pub(super) fn pdf_we(&self, d: Vec3) -> (f32, f32) {
        let pdf_d = self.project(d).map_or(0.0, |(cos, _)| 1.0 / (self.film.area * cos * cos * cos));
        (1.0, pdf_d)
    }

    #[inline]
    pub(super) fn sample_wi(&self, p_ref: Vec3) -> Option<WiSample> {
        let to_camera = self.view.position - p_ref;
        let squared = to_camera.length_squared();
        let wi = to_camera * squared.sqrt().recip();
        let (cos, raster) = self.project(-wi)?;
        let last = fault!("importance_with_cos_cubed", cos, 1.0);
        let we = 1.0 / (self.film.area * (cos * cos) * (cos * last));
        Some(WiSample { at: self.point(), wi, raster, we, pdf: squared / cos })
    }
}
