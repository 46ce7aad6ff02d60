//! Cameras: what emits importance. They mirror the emitters: `we`, `sample_we`, `sample_wi` and their densities.
//!
//! Raster coordinates are in pixels over `[0, width) × [0, height)`, x to the right and y down. The importance is
//! normalised over the whole film, ∫ We cosθ dω = 1, so that a measurement is the mean over the film; a pixel's value is that
//! of the film's part, times the number of pixels. A pixel filter wider than a pixel reaches beyond the film: there the density of
//! raster positions goes on as on the film, and connections count as far as the filter reaches.

mod pinhole;

pub use pinhole::Pinhole;

use crate::error::SceneError;
use crate::ray::{Ray, SurfacePoint};
use glam::DVec3;
use sampling::filter::Filter;
use sampling::{Vec2, Vec3};

/// How a camera stands, as a scene file says it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraSettings {
    /// Where it stands \[m\].
    pub position: DVec3,
    /// What it looks at \[m\].
    pub target: DVec3,
    /// What is up in the image, roughly.
    pub up: DVec3,
    /// Field of view along the shorter side of the image \[degrees\], in (0, 180).
    pub fov: f64,
    /// Width of the image in pixels.
    pub width: u32,
    /// Height of the image in pixels.
    pub height: u32,
    /// How pixels weight the light around them.
    pub filter: Filter,
}

/// The start of a camera walk.
#[derive(Clone, Copy, Debug)]
pub struct WeSample {
    /// The ray that leaves the camera.
    pub ray: Ray,
    /// The camera's end of the path.
    pub at: SurfacePoint,
    /// We·cosθ / (pdf_p·pdf_d).
    pub weight: f32,
    /// Density of the position \[1/m²\]; 1 for a pinhole, whose position is certain.
    pub pdf_p: f32,
    /// Density of the direction \[1/sr\], with the raster position uniform over the whole film.
    pub pdf_d: f32,
}

/// A connection to the camera.
#[derive(Clone, Copy, Debug)]
pub struct WiSample {
    /// The camera's end of the connection.
    pub at: SurfacePoint,
    /// Unit direction from the reference point to the camera.
    pub wi: Vec3,
    /// Where the connection meets the film.
    pub raster: Vec2,
    /// Emitted importance towards the reference point \[1/(m²·sr)\].
    pub we: f32,
    /// Density at the reference point \[1/sr\]; d²/cosθ for a pinhole.
    pub pdf: f32,
}

/// A camera.
#[derive(Clone, Copy, Debug)]
pub enum Camera {
    /// A pinhole: all rays leave from one point.
    Pinhole(Pinhole),
}

impl Camera {
    /// The camera that stands so, in coordinates shifted by `−shift`.
    pub fn new(settings: &CameraSettings, shift: DVec3) -> Result<Self, SceneError> {
        Pinhole::new(settings, shift).map(Camera::Pinhole)
    }

    /// Width of the film in pixels.
    #[inline]
    pub fn width(&self) -> u32 {
        let Camera::Pinhole(pinhole) = self;
        pinhole.width
    }

    /// Height of the film in pixels.
    #[inline]
    pub fn height(&self) -> u32 {
        let Camera::Pinhole(pinhole) = self;
        pinhole.height
    }

    /// How pixels weight the light around them.
    #[inline]
    pub fn filter(&self) -> Filter {
        let Camera::Pinhole(pinhole) = self;
        pinhole.filter
    }

    /// Gives the pixels another filter.
    pub fn set_filter(&mut self, filter: Filter) {
        let Camera::Pinhole(pinhole) = self;
        pinhole.set_filter(filter);
    }

    /// Gives the film another size, at least one pixel each way; the field of view along the shorter side stays.
    pub fn set_size(&mut self, width: u32, height: u32) {
        let Camera::Pinhole(pinhole) = self;
        pinhole.set_size(width, height);
    }

    /// True if all rays leave from one point, which no ray can meet.
    #[inline]
    pub fn is_delta(&self) -> bool {
        true
    }

    /// Where the camera stands.
    #[inline]
    pub fn position(&self) -> Vec3 {
        let Camera::Pinhole(pinhole) = self;
        pinhole.position
    }

    /// The ray through a raster position on the film.
    #[inline]
    pub fn sample_we(&self, raster: Vec2, u_lens: Vec2) -> WeSample {
        let Camera::Pinhole(pinhole) = self;
        let _ = u_lens;
        pinhole.sample_we(raster)
    }

    /// The importance emitted in direction `d` \[1/(m²·sr)\] and where it meets the film; None off the film.
    #[inline]
    pub fn we(&self, at: &SurfacePoint, d: Vec3) -> Option<(f32, Vec2)> {
        let Camera::Pinhole(pinhole) = self;
        let _ = at;
        pinhole.we(d)
    }

    /// The densities of starting a walk at `at` in direction `d`: (position, direction \[1/sr\]); 0 off the film.
    #[inline]
    pub fn pdf_we(&self, at: &SurfacePoint, d: Vec3) -> (f32, f32) {
        let Camera::Pinhole(pinhole) = self;
        let _ = at;
        (1.0, pinhole.pdf_direction(d))
    }

    /// A connection from a reference point to the camera; None if it misses the film.
    #[inline]
    pub fn sample_wi(&self, p_ref: Vec3, u: Vec2) -> Option<WiSample> {
        let Camera::Pinhole(pinhole) = self;
        let _ = u;
        pinhole.sample_wi(p_ref)
    }
}

#[cfg(test)]
mod tests;
