//! Cameras: what emits importance. They mirror the emitters: `we`, `sample_we`, `sample_wi` and their densities.
//!
//! Raster coordinates are in pixels over `[0, width) × [0, height)`, x to the right and y down. The importance is
//! normalised over the whole film, ∫∫ We cosθ dω dA = 1, so that a measurement is the mean over the film (and over the lens); a
//! pixel's value is that of the film's part, times the number of pixels: the mean of radiance under the pixel's filter, whatever
//! the camera; but for an irradiance meter, whose importance is π times that, as irradiance is of radiance. A pixel filter wider than a pixel reaches beyond the film: there the density of raster positions goes on as on
//! the film, and connections count as far as the filter reaches.
//!
//! A camera walk starts at a raster position and, on a lens, at a point of it; a connection samples the lens anew, uniformly
//! too. So all ways to make a path have the same density of the lens's point, which MIS weights leave out.

mod equirectangular;
mod film;
mod irradiance;
mod orthographic;
mod pinhole;
mod settings;
mod thin_lens;
mod view;

pub use equirectangular::Equirectangular;
pub use film::{Edges, Raster};
pub use irradiance::{Irradiance, Receiver};
pub use orthographic::Orthographic;
pub use pinhole::Pinhole;
pub use settings::{CameraSettings, Crop, Projection};
pub use thin_lens::ThinLens;

use crate::error::SceneError;
use crate::ray::{Ray, SurfacePoint};
use glam::DVec3;
use sampling::filter::Filter;
use sampling::{Vec2, Vec3};
use settings::half_field;
use std::fmt;
use view::View;

/// What the rays of a camera have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rays {
    /// They leave from one point.
    FromPoint,
    /// They leave from a lens, or another surface, a point of which must be sampled.
    FromLens,
    /// They have one direction, and leave from the film: the camera is infinitely far, and densities are those of a place
    /// across that direction.
    Parallel,
}

/// The start of a camera walk.
#[derive(Clone, Copy, Debug)]
pub struct WeSample {
    /// The ray that leaves the camera.
    pub ray: Ray,
    /// The camera's end of the path; the normal is the direction of the rays if they are parallel, that of an irradiance meter's
    /// surface, and zero otherwise.
    pub at: SurfacePoint,
    /// We·cosθ / (pdf_p·pdf_d), the camera's [`weight`](Camera::weight).
    pub weight: f32,
    /// Density of the position \[1/m²\]; of the direction if the rays are parallel; 1 for either where it is certain.
    pub pdf_p: f32,
    /// Density of the direction \[1/sr\], with the raster position uniform over the whole film; of the position across the
    /// direction \[1/m²\] if the rays are parallel.
    pub pdf_d: f32,
}

/// A connection to the camera.
#[derive(Clone, Copy, Debug)]
pub struct WiSample {
    /// The camera's end of the connection, as in [`WeSample`].
    pub at: SurfacePoint,
    /// Unit direction from the reference point to the camera.
    pub wi: Vec3,
    /// Where the connection meets the film.
    pub raster: Vec2,
    /// Emitted importance towards the reference point \[1/(m²·sr)\]; without the Dirac of its direction \[1/m²\] if the rays
    /// are parallel.
    pub we: f32,
    /// Density at the reference point \[1/sr\]: d²/cosθ times that of a point of the lens \[1/m²\], or times 1 for a point that
    /// is certain; 1 for a direction that is certain.
    pub pdf: f32,
}

/// A camera.
#[derive(Clone, Copy, Debug)]
pub enum Camera {
    /// A pinhole: all rays leave from one point.
    Pinhole(Pinhole),
    /// A thin lens: rays leave from a disc and meet on a plane.
    ThinLens(ThinLens),
    /// Parallel rays.
    Orthographic(Orthographic),
    /// A point that sees all around.
    Equirectangular(Equirectangular),
    /// A surface that measures what falls on it.
    Irradiance(Irradiance),
}

impl Camera {
    /// The camera that stands so, in coordinates shifted by `−shift`.
    pub fn new(settings: &CameraSettings, shift: DVec3) -> Result<Self, SceneError> {
        Ok(match settings.projection {
            Projection::Pinhole { fov } => Camera::Pinhole(Pinhole::new(settings, fov, shift)?),
            Projection::ThinLens { fov, lens_radius, focus_distance } => {
                Camera::ThinLens(ThinLens::new(settings, (fov, lens_radius, focus_distance), shift)?)
            }
            Projection::Orthographic { extent } => Camera::Orthographic(Orthographic::new(settings, extent, shift)?),
            Projection::Equirectangular => Camera::Equirectangular(Equirectangular::new(settings, shift)?),
            Projection::Irradiance(receiver) => Camera::Irradiance(Irradiance::new(settings, receiver, shift)?),
        })
    }

    /// The name of its type, as scene files have it.
    pub fn name(&self) -> &'static str {
        match self {
            Camera::Pinhole(_) => "pinhole",
            Camera::ThinLens(_) => "thin_lens",
            Camera::Orthographic(_) => "orthographic",
            Camera::Equirectangular(_) => "equirectangular",
            Camera::Irradiance(_) => "irradiance",
        }
    }

    /// The pixels.
    #[inline]
    pub fn raster(&self) -> &Raster {
        match self {
            Camera::Pinhole(camera) => &camera.film.raster,
            Camera::ThinLens(camera) => &camera.film.raster,
            Camera::Orthographic(camera) => &camera.film.raster,
            Camera::Equirectangular(camera) => &camera.raster,
            Camera::Irradiance(camera) => &camera.raster,
        }
    }

    /// Width of the film in pixels.
    #[inline]
    pub fn width(&self) -> u32 {
        self.raster().width
    }

    /// Height of the film in pixels.
    #[inline]
    pub fn height(&self) -> u32 {
        self.raster().height
    }

    /// How pixels weight the light around them.
    #[inline]
    pub fn filter(&self) -> Filter {
        self.raster().filter
    }

    /// Gives the pixels another filter; an irradiance meter keeps its box, beyond which there are no directions.
    pub fn set_filter(&mut self, filter: Filter) {
        if matches!(self, Camera::Irradiance(_)) {
            return;
        }
        let Raster { width, height, edges, .. } = *self.raster();
        self.set_raster(Raster::new(width, height, filter, edges));
    }

    /// Gives the film another size, at least one pixel each way; what it covers along its shorter side stays.
    pub fn set_size(&mut self, width: u32, height: u32) {
        let Raster { filter, edges, .. } = *self.raster();
        self.set_raster(Raster::new(width, height, filter, edges));
    }

    fn set_raster(&mut self, raster: Raster) {
        match self {
            Camera::Pinhole(camera) => camera.film.set_raster(raster),
            Camera::ThinLens(camera) => camera.film.set_raster(raster),
            Camera::Orthographic(camera) => camera.film.set_raster(raster),
            Camera::Equirectangular(camera) => camera.raster = raster,
            Camera::Irradiance(camera) => camera.raster = raster,
        }
    }

    /// What its rays have in common.
    #[inline]
    pub fn rays(&self) -> Rays {
        match self {
            Camera::Pinhole(_) | Camera::Equirectangular(_) => Rays::FromPoint,
            Camera::ThinLens(_) => Rays::FromLens,
            Camera::Orthographic(_) => Rays::Parallel,
            Camera::Irradiance(camera) if camera.is_point() => Rays::FromPoint,
            Camera::Irradiance(_) => Rays::FromLens,
        }
    }

    /// What all samples weigh: the measurement over a mean of radiance.
    #[inline]
    pub fn weight(&self) -> f32 {
        if matches!(self, Camera::Irradiance(_)) { Irradiance::WEIGHT } else { 1.0 }
    }

    #[inline]
    fn view(&self) -> &View {
        match self {
            Camera::Pinhole(camera) => &camera.view,
            Camera::ThinLens(camera) => &camera.view,
            Camera::Orthographic(camera) => &camera.view,
            Camera::Equirectangular(camera) => &camera.view,
            Camera::Irradiance(camera) => &camera.view,
        }
    }

    /// Where the camera stands: the middle of a lens, and of an orthographic camera's film if it is not shifted.
    #[inline]
    pub fn position(&self) -> Vec3 {
        self.view().position
    }

    /// The magnitudes that the coordinates of its rays' origins may reach \[m\].
    pub(crate) fn extent(&self) -> Vec3 {
        let around = match self {
            Camera::Pinhole(_) | Camera::Equirectangular(_) => 0.0,
            Camera::ThinLens(camera) => camera.radius,
            Camera::Orthographic(camera) => camera.film.reach(),
            Camera::Irradiance(camera) => camera.reach(),
        };
        self.position().abs() + around
    }

    /// The ray through a raster position on the film; `u_lens` counts where rays leave from a lens.
    #[inline]
    pub fn sample_we(&self, raster: Vec2, u_lens: Vec2) -> WeSample {
        match self {
            Camera::Pinhole(camera) => camera.sample_we(raster),
            Camera::ThinLens(camera) => camera.sample_we(raster, u_lens),
            Camera::Orthographic(camera) => camera.sample_we(raster),
            Camera::Equirectangular(camera) => camera.sample_we(raster),
            Camera::Irradiance(camera) => camera.sample_we(raster, u_lens),
        }
    }

    /// The importance emitted at a point of the camera in direction `d` \[1/(m²·sr)\] and where it meets the film; None off the
    /// film, and from a camera of parallel rays, whose direction no other is.
    #[inline]
    pub fn we(&self, at: &SurfacePoint, d: Vec3) -> Option<(f32, Vec2)> {
        match self {
            Camera::Pinhole(camera) => camera.we(d),
            Camera::ThinLens(camera) => camera.we(at, d),
            Camera::Orthographic(_) => None,
            Camera::Equirectangular(camera) => Some(camera.we(d)),
            Camera::Irradiance(camera) => camera.we(at, d),
        }
    }

    /// The densities of starting a walk at a point of the camera in direction `d`, as in [`WeSample`]; 0 off the film. Of a
    /// camera of parallel rays the point must be one of its film, and the direction is taken to be theirs.
    #[inline]
    pub fn pdf_we(&self, at: &SurfacePoint, d: Vec3) -> (f32, f32) {
        match self {
            Camera::Pinhole(camera) => camera.pdf_we(d),
            Camera::ThinLens(camera) => camera.pdf_we(at, d),
            Camera::Orthographic(camera) => camera.pdf_we(),
            Camera::Equirectangular(camera) => camera.pdf_we(d),
            Camera::Irradiance(camera) => camera.pdf_we(at, d),
        }
    }

    /// A connection from a reference point to the camera; None if it misses the film. `u` counts where rays leave from a lens.
    #[inline]
    pub fn sample_wi(&self, p_ref: Vec3, u: Vec2) -> Option<WiSample> {
        match self {
            Camera::Pinhole(camera) => camera.sample_wi(p_ref),
            Camera::ThinLens(camera) => camera.sample_wi(p_ref, u),
            Camera::Orthographic(camera) => camera.sample_wi(p_ref),
            Camera::Equirectangular(camera) => camera.sample_wi(p_ref),
            Camera::Irradiance(camera) => camera.sample_wi(p_ref, u),
        }
    }
}

impl fmt::Display for Camera {
    /// Its type, and what is its own.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let degrees = |half_short: f32| 2.0 * half_short.atan().to_degrees();
        match self {
            Camera::Pinhole(camera) => write!(f, "pinhole, {:.4} degrees", degrees(camera.film.half_short())),
            Camera::ThinLens(camera) => write!(
                f,
                "thin_lens, {:.4} degrees, radius {} m, focused at {} m",
                degrees(camera.film.half_short()),
                camera.radius,
                camera.focus_distance
            ),
            Camera::Orthographic(camera) => write!(f, "orthographic, {} m", 2.0 * camera.film.half_short()),
            Camera::Equirectangular(_) => write!(f, "equirectangular"),
            Camera::Irradiance(_) => write!(f, "irradiance"),
        }
    }
}

#[cfg(test)]
mod tests;
