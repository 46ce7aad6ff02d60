//! The pinhole camera.

use super::{CameraSettings, WeSample, WiSample};
use crate::error::SceneError;
use crate::ray::{Ray, SurfacePoint};
use glam::DVec3;
use sampling::fault;
use sampling::filter::Filter;
use sampling::{Vec2, Vec3, vec2};

/// A pinhole with a film at distance 1, of area A = 4·half_width·half_height.
///
/// A raster position uniform over the film gives directions of density 1/(A cos³θ), and the importance that makes every
/// sample's weight 1 is We = 1/(A cos⁴θ) \[PBRT4, 5.4\].
#[derive(Clone, Copy, Debug)]
pub struct Pinhole {
    /// Where it stands \[m\].
    pub position: Vec3,
    /// Unit direction of view.
    pub forward: Vec3,
    /// Unit direction to the right in the image.
    pub right: Vec3,
    /// Unit direction up in the image.
    pub up: Vec3,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// How pixels weight the light around them.
    pub filter: Filter,
    half_short: f32,
    half: Vec2,
    film_area: f32,
    /// How far the filter reaches beyond the film \[pixels\].
    margin: f32,
}

impl Pinhole {
    /// A pinhole that stands as the settings say, in coordinates shifted by `−shift`.
    pub fn new(settings: &CameraSettings, shift: DVec3) -> Result<Self, SceneError> {
        let CameraSettings { position, target, up, fov, width, height, filter } = *settings;
        if !(position.is_finite() && target.is_finite() && up.is_finite()) {
            return Err(SceneError::invalid("the camera has a coordinate that is not finite", "give finite numbers"));
        }
        if !(fov > 0.0 && fov < 180.0) {
            return Err(SceneError::invalid(
                format!("the camera's field of view is {fov} degrees"),
                "give a `fov` between 0 and 180, both excluded",
            ));
        }
        if width == 0 || height == 0 {
            return Err(SceneError::invalid(
                format!("the image has a size of {width}x{height}"),
                "give a width and a height of at least 1",
            ));
        }
        let forward = (target - position).try_normalize().ok_or_else(|| {
            SceneError::invalid("the camera's target is its position", "move `target` to a point the camera looks at")
        })?;
        let right = up
            .try_normalize()
            .map(|up| forward.cross(up))
            .filter(|right| right.length() > 1e-9)
            .ok_or_else(|| {
                SceneError::invalid(
                    "the camera's `up` is zero or parallel to its direction of view",
                    "choose an `up` at an angle to `target - position`",
                )
            })?
            .normalize();
        let half_short = (fov.to_radians() / 2.0).tan() as f32;
        let mut camera = Pinhole {
            position: (position - shift).as_vec3(),
            forward: forward.as_vec3(),
            right: right.as_vec3(),
            up: right.cross(forward).as_vec3(),
            width,
            height,
            half_short,
            half: Vec2::ZERO,
            film_area: 0.0,
            filter,
            margin: 0.0,
        };
        camera.set_size(width, height);
        camera.set_filter(filter);
        Ok(camera)
    }

    pub(super) fn set_size(&mut self, width: u32, height: u32) {
        (self.width, self.height) = (width.max(1), height.max(1));
        let size = vec2(self.width as f32, self.height as f32);
        self.half = size * (self.half_short / size.min_element());
        self.film_area = 4.0 * self.half.x * self.half.y;
    }

    pub(super) fn set_filter(&mut self, filter: Filter) {
        self.filter = filter;
        self.margin = filter.radius() - 0.5;
    }

    #[inline]
    fn point(&self) -> SurfacePoint {
        SurfacePoint::free(self.position)
    }

    #[inline]
    pub(super) fn sample_we(&self, raster: Vec2) -> WeSample {
        let x = (2.0 * raster.x / self.width as f32 - 1.0) * self.half.x;
        let y = (1.0 - 2.0 * raster.y / self.height as f32) * self.half.y;
        let cos = (1.0 + x * x + y * y).sqrt().recip();
        let d = (self.forward + self.right * x + self.up * y) * cos;
        WeSample {
            ray: Ray::new(self.position, d),
            at: self.point(),
            weight: 1.0,
            pdf_p: 1.0,
            pdf_d: 1.0 / (self.film_area * cos * cos * cos),
        }
    }

    /// The cosine at the camera and the raster position of a direction; None where no pixel's filter reaches.
    #[inline]
    fn project(&self, d: Vec3) -> Option<(f32, Vec2)> {
        let cos = d.dot(self.forward);
        if cos <= 0.0 {
            return None;
        }
        let scale = 0.5 / cos;
        let raster = vec2(
            (0.5 + d.dot(self.right) * scale / self.half.x) * self.width as f32,
            (0.5 - d.dot(self.up) * scale / self.half.y) * self.height as f32,
        );
        let (low, high) = (-self.margin, vec2(self.width as f32, self.height as f32) + self.margin);
        let within = raster.x >= low && raster.y >= low && raster.x < high.x && raster.y < high.y;
        within.then_some((cos, raster))
    }

    #[inline]
    pub(super) fn we(&self, d: Vec3) -> Option<(f32, Vec2)> {
        let (cos, raster) = self.project(d)?;
        Some((1.0 / (self.film_area * (cos * cos) * (cos * cos)), raster))
    }

    #[inline]
    pub(super) fn pdf_direction(&self, d: Vec3) -> f32 {
        match self.project(d) {
            Some((cos, _)) => 1.0 / (self.film_area * cos * cos * cos),
            None => 0.0,
        }
    }

    #[inline]
    pub(super) fn sample_wi(&self, p_ref: Vec3) -> Option<WiSample> {
        let to_camera = self.position - p_ref;
        let squared = to_camera.length_squared();
        let wi = to_camera * squared.sqrt().recip();
        let (cos, raster) = self.project(-wi)?;
        let last = fault!("importance_with_cos_cubed", cos, 1.0);
        let we = 1.0 / (self.film_area * (cos * cos) * (cos * last));
        Some(WiSample { at: self.point(), wi, raster, we, pdf: squared / cos })
    }
}
