//! How an image covers all directions.

use sampling::{Vec2, Vec3, vec2, vec3, warp};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_4};

/// How an environment's image covers the directions of the environment's own frame.
///
/// Places run from 0 to 1, from left to right and from top to bottom.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mapping {
    /// Longitude and latitude. Rows run from +y, above, to −y. The left edge, which is the right one too, is −z; a quarter to
    /// the right of it is +x, the centre of the image is +z, and three quarters are −x.
    ///
    /// For pbrt's images of latitude and longitude, whose left edge is its +x, a quarter +y and the top +z, pbrt's (x, y, z) are
    /// (−z, x, y) here.
    #[default]
    Equirectangular,
    /// The same, but the first and the last row stand at the poles themselves rather than half a row from them: with h rows, row r
    /// is at the angle πr/(h − 1) from +y.
    ///
    /// That is Mitsuba's `envmap`.
    EquirectangularToPoles,
    /// Clarberg's octahedral square, on which equal areas are equal solid angles `[Clarberg08]`. The centre is +z, the four
    /// corners are −z; +x is the middle of the right edge of the diamond that is the half space of +z, the point (1, ½), −x is
    /// (0, ½), +y is the middle of the lower edge, (½, 1), and −y is (½, 0).
    ///
    /// That is pbrt-v4's image of an infinite light, in pbrt's frame of the light.
    EqualArea,
}

impl Mapping {
    /// The names by which it is chosen.
    pub const NAMES: [&str; 3] = ["equirectangular", "equirectangular_to_poles", "equal_area"];
    /// All of them, in the order of their names.
    pub const ALL: [Self; 3] = [Self::Equirectangular, Self::EquirectangularToPoles, Self::EqualArea];

    /// The place of a direction (unit, of the environment's own frame); of rows that run to the poles, on the sphere from pole to
    /// pole.
    #[inline]
    pub fn place(self, d: Vec3) -> Vec2 {
        match self {
            Self::Equirectangular | Self::EquirectangularToPoles => {
                let turn = 0.5 * FRAC_1_PI * d.x.abs().atan2(-d.z);
                let polar = FRAC_1_PI * vec2(d.x, d.z).length().atan2(d.y);
                vec2(if d.x < 0.0 { 1.0 - turn } else { turn }, polar)
            }
            Self::EqualArea => {
                let [x, y, z] = d.abs().to_array();
                // A cap's area is 2π(1 − z): the octahedron's edge at distance r has r² = 1 − z, taken without cancellation.
                let r = ((x * x + y * y) / (1.0 + z)).sqrt().min(1.0);
                let along = r * (2.0 * FRAC_1_PI) * y.atan2(x);
                let folded = if d.z < 0.0 { vec2(1.0 - along, 1.0 - (r - along)) } else { vec2(r - along, along) };
                0.5 + 0.5 * vec2(folded.x.copysign(d.x), folded.y.copysign(d.y))
            }
        }
    }

    /// The direction (unit, of the environment's own frame) of a place.
    #[inline]
    pub fn direction(self, place: Vec2) -> Vec3 {
        match self {
            Self::Equirectangular | Self::EquirectangularToPoles => {
                let polar = 0.5 * place.y;
                let (sine, cosine) = warp::sin_cos_turns(polar);
                longitude(place.x, sine, cosine)
            }
            Self::EqualArea => {
                let signed = 2.0 * place - 1.0;
                let folded = signed.abs();
                let beyond = folded.x + folded.y - 1.0;
                let r = 1.0 - beyond.abs();
                let across = if r == 0.0 { 1.0 } else { (folded.y - folded.x) / r + 1.0 };
                let (sine, cosine) = (across.clamp(0.0, 2.0) * FRAC_PI_4).sin_cos();
                let radius = r * (2.0 - r * r).max(0.0).sqrt();
                let z = (1.0 - r * r).copysign(-beyond);
                vec3((radius * cosine).copysign(signed.x), (radius * sine).copysign(signed.y), z).normalize()
            }
        }
    }

    /// Where on an image of so many rows a place is: the centre of row r is at (r + ½)/h.
    #[inline]
    pub(super) fn on_image(self, place: Vec2, height: u32) -> Vec2 {
        match self {
            Self::Equirectangular | Self::EqualArea => place,
            Self::EquirectangularToPoles => {
                let height = height as f32;
                vec2(place.x, (place.y * (height - 1.0) + 0.5) / height)
            }
        }
    }

    /// Which part of the way from pole to pole the upper edge of a row is, of images by longitude and latitude.
    pub(super) fn upper_edge(self, row: u32, height: u32) -> f64 {
        match self {
            Self::EquirectangularToPoles => ((f64::from(row) - 0.5) / (f64::from(height) - 1.0)).clamp(0.0, 1.0),
            Self::Equirectangular | Self::EqualArea => f64::from(row) / f64::from(height),
        }
    }

    /// The index of the texel that stands in this column and row, which may lie one beyond the borders.
    #[inline]
    pub(super) fn texel(self, column: i64, row: i64, (width, height): (i64, i64)) -> usize {
        let (mut column, mut row) = (column, row);
        match self {
            Self::Equirectangular | Self::EquirectangularToPoles => {
                column = column.rem_euclid(width);
                row = row.clamp(0, height - 1);
            }
            // An edge of the square meets its own mirror image.
            Self::EqualArea => {
                if column < 0 || column >= width {
                    (column, row) = (column.clamp(0, width - 1), height - 1 - row);
                }
                if row < 0 || row >= height {
                    (column, row) = (width - 1 - column, row.clamp(0, height - 1));
                }
            }
        }
        (row * width + column) as usize
    }
}

/// The direction at a turn from −z towards +x, by sine and cosine of the angle from +y.
#[inline]
pub(super) fn longitude(turn: f32, sine: f32, cosine: f32) -> Vec3 {
    let (s, c) = warp::sin_cos_turns(turn);
    vec3(sine * s, cosine, -sine * c)
}
