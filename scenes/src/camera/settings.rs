//! How a camera is described.

use super::Receiver;
use crate::error::SceneError;
use glam::{DVec2, DVec3};
use sampling::filter::Filter;

/// How a camera stands and what it sees, as a scene file says it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraSettings {
    /// Where it stands \[m\].
    pub position: DVec3,
    /// What it looks at \[m\].
    pub target: DVec3,
    /// What is up in the image, roughly.
    pub up: DVec3,
    /// Which directions it sees.
    pub projection: Projection,
    /// Width of the image in pixels.
    pub width: u32,
    /// Height of the image in pixels.
    pub height: u32,
    /// How pixels weight the light around them.
    pub filter: Filter,
    /// Whether left and right are exchanged in the image.
    pub mirrored: bool,
    /// How far the window of the film is moved to the right and up in the image, in its widths and heights; nothing to an
    /// equirectangular camera.
    pub shift: DVec2,
    /// The pixels that are rendered unless others are asked for; all of them if None.
    pub crop: Option<Crop>,
}

impl CameraSettings {
    /// A pinhole of this field of view along the shorter side of the image \[degrees\], its y axis up, with the box filter.
    pub fn pinhole(position: DVec3, target: DVec3, fov: f64, (width, height): (u32, u32)) -> Self {
        CameraSettings {
            position,
            target,
            up: DVec3::Y,
            projection: Projection::Pinhole { fov },
            width,
            height,
            filter: Filter::Box,
            mirrored: false,
            shift: DVec2::ZERO,
            crop: None,
        }
    }
}

/// Which directions a camera sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Those through a point, onto a plane.
    Pinhole {
        /// Field of view along the shorter side of the image \[degrees\], in (0, 180).
        fov: f64,
    },
    /// Those through a disc, onto a plane.
    ThinLens {
        /// Field of view along the shorter side of the image, from the middle of the lens \[degrees\], in (0, 180).
        fov: f64,
        /// Radius of the lens \[m\].
        lens_radius: f64,
        /// Distance of the plane of focus along the view \[m\]; that of the target if None.
        focus_distance: Option<f64>,
    },
    /// One, at all places of a film.
    Orthographic {
        /// Length of the film's shorter side \[m\].
        extent: f64,
    },
    /// All, by longitude and latitude.
    Equirectangular,
    /// Those that fall on a surface; it looks at the target.
    Irradiance(Receiver),
}

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Crop {
    /// What is wrong with it in an image of this size, if anything.
    pub fn fault(&self, width: u32, height: u32) -> Option<String> {
        let Crop { x, y, width: columns, height: rows } = *self;
        let end = |start: u32, length: u32| u64::from(start) + u64::from(length);
        if columns == 0 || rows == 0 {
            return Some("a crop has at least one pixel".to_owned());
        }
        let inside = end(x, columns) <= u64::from(width) && end(y, rows) <= u64::from(height);
        (!inside).then(|| format!("it must lie within the {width}x{height} pixels of the image"))
    }
}

/// Half of a field of view at distance 1, for a field of view in degrees.
pub(super) fn half_field(fov: f64) -> Result<f64, SceneError> {
    if fov > 0.0 && fov < 180.0 {
        return Ok((fov.to_radians() / 2.0).tan());
    }
    Err(SceneError::invalid(
        format!("the camera's field of view is {fov} degrees"),
        "give a `fov` between 0 and 180, both excluded",
    ))
}
