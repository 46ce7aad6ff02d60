//! The orthographic camera.

use super::film::Film;
use super::view::View;
use super::{CameraSettings, WeSample, WiSample};
use crate::error::SceneError;
use crate::ray::{Ray, SurfacePoint};
use glam::DVec3;
use sampling::{Vec2, Vec3};

/// A film in space from which parallel rays leave, across it: a camera infinitely far off that sees what lies before the film.
///
/// It is to cameras what a directional emitter is to emitters, and its densities are those of an environment: first of its
/// direction, which is certain, then of the place across it, 1/A. The importance We = δ(ω − forward)/A gives every sample the
/// weight 1. Since the direction of every connection to it is certain, all ways to make a path have the same Dirac in it, which
/// cancels.
#[derive(Clone, Copy, Debug)]
pub struct Orthographic {
    pub(super) view: View,
    /// Its plane's unit is a metre.
    pub(super) film: Film,
}

impl Orthographic {
    /// A film whose shorter side has the length `extent` \[m\], in coordinates shifted by `−shift`.
    pub(super) fn new(settings: &CameraSettings, extent: f64, shift: DVec3) -> Result<Self, SceneError> {
        if !(extent.is_finite() && extent > 0.0) {
            return Err(SceneError::invalid(
                format!("the camera's `extent` is {extent}"),
                "give an `extent` above 0, the length of the image's shorter side in metres",
            ));
        }
        Ok(Orthographic { film: Film::new(settings, extent / 2.0)?, view: View::new(settings, shift)? })
    }

    /// A point of the film; its normal is the direction of all rays.
    #[inline]
    fn on_film(&self, p: Vec3) -> SurfacePoint {
        SurfacePoint { p, ng: self.view.forward, p_error: 0.0 }
    }

    #[inline]
    pub(super) fn sample_we(&self, raster: Vec2) -> WeSample {
        let p = self.view.point(self.film.place(raster));
        let (pdf_p, pdf_d) = self.pdf_we();
        WeSample { ray: Ray::new(p, self.view.forward), at: self.on_film(p), weight: 1.0, pdf_p, pdf_d }
    }

    #[inline]
    pub(super) fn pdf_we(&self) -> (f32, f32) {
        (1.0, 1.0 / self.film.area)
    }

    #[inline]
    pub(super) fn sample_wi(&self, p_ref: Vec3) -> Option<WiSample> {
        let from_film = p_ref - self.view.position;
        let depth = from_film.dot(self.view.forward);
        if depth <= 0.0 {
            return None;
        }
        let across = self.view.across(from_film);
        let raster = self.film.raster_of(across, 0.5)?;
        let at = self.on_film(self.view.point(across));
        Some(WiSample { at, wi: -self.view.forward, raster, we: 1.0 / self.film.area, pdf: 1.0 })
    }
}
