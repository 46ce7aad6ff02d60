//! Films: a raster of pixels, and the part of a plane that it covers.

use super::{CameraSettings, Projection};
use crate::error::SceneError;
use sampling::filter::Filter;
use sampling::{Vec2, vec2};

/// What lies beyond the border of a raster.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edges {
    /// Places that no pixel's square covers, which filters reach.
    Border,
    /// The raster is the longitude and latitude of a sphere: beyond a side lies the other one, beyond a pole the opposite
    /// longitude.
    Sphere,
}

/// A raster of pixels.
#[derive(Clone, Copy, Debug)]
pub struct Raster {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// How pixels weight the light around them.
    pub filter: Filter,
    /// What lies beyond its border.
    pub edges: Edges,
    /// How far the filter reaches beyond the border \[pixels\].
    margin: f32,
}

impl Raster {
    /// A raster of at least one pixel each way.
    pub fn new(width: u32, height: u32, filter: Filter, edges: Edges) -> Self {
        Raster { width: width.max(1), height: height.max(1), filter, edges, margin: filter.radius() - 0.5 }
    }

    pub(super) fn of(settings: &CameraSettings) -> Result<Self, SceneError> {
        let CameraSettings { width, height, filter, .. } = *settings;
        if width == 0 || height == 0 {
            return Err(SceneError::invalid(
                format!("the image has a size of {width}x{height}"),
                "give a width and a height of at least 1",
            ));
        }
        let edges = match settings.projection {
            Projection::Equirectangular => Edges::Sphere,
            Projection::Pinhole { .. }
            | Projection::ThinLens { .. }
            | Projection::Orthographic { .. }
            | Projection::Irradiance(_) => Edges::Border,
        };
        Ok(Raster::new(width, height, filter, edges))
    }

    /// Width and height in pixels.
    #[inline]
    pub fn size(&self) -> Vec2 {
        vec2(self.width as f32, self.height as f32)
    }

    /// Whether a place is on the raster, or so near that some pixel's filter reaches it.
    #[inline]
    pub(super) fn reaches(&self, at: Vec2) -> bool {
        let (low, high) = (-self.margin, self.size() + self.margin);
        at.x >= low && at.y >= low && at.x < high.x && at.y < high.y
    }

    /// A place of the raster, or beyond it where some pixel's filter reaches, uniform over them; and their area over the raster's.
    #[inline]
    pub fn reached(&self, u: Vec2) -> (Vec2, f32) {
        let whole = self.size() + 2.0 * self.margin;
        (u * whole - self.margin, whole.element_product() / self.size().element_product())
    }

    /// All places within the filter's reach that are the same place of the sphere as `at`, itself among them; `at` alone on
    /// a raster with a border. A few may be beyond the reach.
    pub fn images(&self, at: Vec2) -> impl Iterator<Item = Vec2> + use<> {
        let size = self.size();
        let turns = (self.filter.radius() / size).ceil();
        let (columns, rows) = match self.edges {
            Edges::Border => (0, 0),
            Edges::Sphere => (turns.x as i32, turns.y as i32),
        };
        let whole = move |x: i32, y: i32| at + size * vec2(x as f32, 2.0 * y as f32);
        // Over a pole: the other side of the sphere, half a turn on.
        let over = move |x: i32, y: i32| vec2(at.x + size.x * (x as f32 + 0.5), size.y * 2.0 * y as f32 - at.y);
        let straight = (-columns..=columns).flat_map(move |x| (-rows..=rows).map(move |y| whole(x, y)));
        let opposite = (-columns - 1..=columns).flat_map(move |x| (-rows..=rows + 1).map(move |y| over(x, y)));
        let is_sphere = self.edges == Edges::Sphere;
        straight.chain(opposite.filter(move |_| is_sphere))
    }
}

/// A raster over a window of a plane, whose middle a shift moves away from the origin of the plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Film {
    pub raster: Raster,
    /// Half of the window's shorter side.
    half_short: f32,
    /// Half of its width and height.
    half: Vec2,
    /// Where the plane's origin is, in widths and heights from the window's upper left corner.
    origin: Vec2,
    /// Area of the window.
    pub area: f32,
}

impl Film {
    /// A film whose window has this length from its middle to the nearest side, in the units of the plane.
    pub fn new(settings: &CameraSettings, half_short: f64) -> Result<Self, SceneError> {
        let shift = settings.shift;
        if !shift.is_finite() {
            return Err(SceneError::invalid("the camera's shift is not finite", "give finite numbers"));
        }
        let mut film = Film {
            raster: Raster::of(settings)?,
            half_short: half_short as f32,
            half: Vec2::ZERO,
            origin: vec2((0.5 - shift.x) as f32, (0.5 + shift.y) as f32),
            area: 0.0,
        };
        film.cover();
        Ok(film)
    }

    pub fn set_raster(&mut self, raster: Raster) {
        self.raster = raster;
        self.cover();
    }

    fn cover(&mut self) {
        let size = self.raster.size();
        self.half = size * (self.half_short / size.min_element());
        self.area = 4.0 * self.half.x * self.half.y;
    }

    /// The place in the plane, x to the right and y up, of a raster position.
    #[inline]
    pub fn place(&self, raster: Vec2) -> Vec2 {
        let (width, height) = (self.raster.width as f32, self.raster.height as f32);
        vec2(
            (2.0 * raster.x / width - 2.0 * self.origin.x) * self.half.x,
            (2.0 * self.origin.y - 2.0 * raster.y / height) * self.half.y,
        )
    }

    /// The raster position of the place `2·scale·p` in the plane; None where no pixel's filter reaches.
    #[inline]
    pub fn raster_of(&self, p: Vec2, scale: f32) -> Option<Vec2> {
        let at = vec2(
            (self.origin.x + p.x * scale / self.half.x) * self.raster.width as f32,
            (self.origin.y - p.y * scale / self.half.y) * self.raster.height as f32,
        );
        self.raster.reaches(at).then_some(at)
    }

    /// The farthest that the window reaches from the plane's origin.
    pub fn reach(&self) -> f32 {
        (self.half + (self.origin - 0.5).abs() * 2.0 * self.half).length()
    }

    /// Half of the shorter side.
    pub fn half_short(&self) -> f32 {
        self.half_short
    }
}
