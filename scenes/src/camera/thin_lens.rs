//! The camera with a thin lens.

use super::film::Film;
use super::view::View;
use super::{CameraSettings, WeSample, WiSample, half_field};
use crate::error::SceneError;
use crate::ray::{Ray, SurfacePoint};
use glam::DVec3;
use sampling::fault;
use sampling::{Vec2, Vec3, warp};
use std::f32::consts::PI;

/// A thin lens: a disc of radius R across the view, of which every point sees the plane of focus alike.
///
/// A raster position means the place of the plane of focus that a pinhole at the middle of the lens would see there. From a
/// point ℓ of the lens that place lies in the direction of `x − ℓ/F` in the plane at distance 1, `x` being the place on the film
/// of the pinhole and F the distance of focus: the film as this point sees it is the pinhole's, moved by −ℓ/F. So the density
/// of directions from a point of the lens is the pinhole's, 1/(A cos³θ), and with points uniform over the lens, of area πR²,
/// the importance that makes every sample's weight 1 is We = 1/(πR² A cos⁴θ) \[PBRT4, 5.2.3; Veach97, §8.1\]. What a pixel
/// measures is a mean of radiances, which a wider lens does not darken.
#[derive(Clone, Copy, Debug)]
pub struct ThinLens {
    pub(super) view: View,
    pub(super) film: Film,
    /// Radius of the lens \[m\].
    pub radius: f32,
    /// Distance of the plane of focus along the view \[m\].
    pub focus_distance: f32,
    lens_area: f32,
}

impl ThinLens {
    pub(super) fn new(
        settings: &CameraSettings,
        (fov, radius, focus): (f64, f64, Option<f64>),
        shift: DVec3,
    ) -> Result<Self, SceneError> {
        let half = half_field(fov)?;
        let focus = focus.unwrap_or(settings.position.distance(settings.target));
        for (length, name) in [(radius, "lens_radius"), (focus, "focus_distance")] {
            if !(length.is_finite() && length > 0.0) {
                return Err(SceneError::invalid(
                    format!("the camera's `{name}` is {length}"),
                    format!("give a `{name}` above 0"),
                ));
            }
        }
        let (film, view) = (Film::new(settings, half)?, View::new(settings, shift)?);
        let (radius, focus_distance) = (radius as f32, focus as f32);
        Ok(ThinLens { view, film, radius, focus_distance, lens_area: PI * radius * radius })
    }

    /// A point uniform over the lens, in the frame of the view.
    #[inline]
    fn sample_lens(&self, u: Vec2) -> Vec2 {
        warp::uniform_disk(u) * self.radius
    }

    #[inline]
    pub(super) fn sample_we(&self, raster: Vec2, u: Vec2) -> WeSample {
        let lens = self.sample_lens(u);
        let Vec2 { x, y } = self.film.place(raster) - lens / self.focus_distance;
        let cos = (1.0 + x * x + y * y).sqrt().recip();
        let d = (self.view.forward + self.view.right * x + self.view.up * y) * cos;
        let p = self.view.point(lens);
        WeSample {
            ray: Ray::new(p, d),
            at: SurfacePoint::free(p),
            weight: 1.0,
            pdf_p: 1.0 / self.lens_area,
            pdf_d: 1.0 / (self.film.area * cos * cos * cos),
        }
    }

    /// The cosine at the lens and the raster position of a direction from a point of the lens; None where no pixel's filter
    /// reaches.
    #[inline]
    fn project(&self, lens: Vec2, d: Vec3) -> Option<(f32, Vec2)> {
        let cos = d.dot(self.view.forward);
        if cos <= 0.0 {
            return None;
        }
        let focused = fault!("lens_does_not_focus", lens / self.focus_distance, Vec2::ZERO);
        Some((cos, self.film.raster_of(self.view.across(d) / cos + focused, 0.5)?))
    }

    /// Where a point of the lens is, in the frame of the view.
    #[inline]
    fn on_lens(&self, at: &SurfacePoint) -> Vec2 {
        self.view.across(at.p - self.view.position)
    }

    #[inline]
    fn importance(&self, cos: f32) -> f32 {
        1.0 / (self.lens_area * self.film.area * (cos * cos) * (cos * cos))
    }

    #[inline]
    pub(super) fn we(&self, at: &SurfacePoint, d: Vec3) -> Option<(f32, Vec2)> {
        let (cos, raster) = self.project(self.on_lens(at), d)?;
        Some((self.importance(cos), raster))
    }

    #[inline]
    pub(super) fn pdf_we(&self, at: &SurfacePoint, d: Vec3) -> (f32, f32) {
        let projected = self.project(self.on_lens(at), d);
        let pdf_d = projected.map_or(0.0, |(cos, _)| 1.0 / (self.film.area * cos * cos * cos));
        (1.0 / self.lens_area, pdf_d)
    }

    #[inline]
    pub(super) fn sample_wi(&self, p_ref: Vec3, u: Vec2) -> Option<WiSample> {
        let lens = self.sample_lens(u);
        let p = self.view.point(lens);
        let to_camera = p - p_ref;
        let squared = to_camera.length_squared();
        let wi = to_camera * squared.sqrt().recip();
        let (cos, raster) = self.project(lens, -wi)?;
        let area = fault!("lens_area_left_out", self.lens_area, 1.0);
        Some(WiSample { at: SurfacePoint::free(p), wi, raster, we: self.importance(cos), pdf: squared / (cos * area) })
    }
}
