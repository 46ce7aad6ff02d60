//! Values that vary over surfaces.

mod exr;
mod image;
mod noise;

pub use image::{Channel, Encoding, Image, ImageTexture, Wrap};
pub use noise::Noise;

use crate::builder::Similarity;
use glam::DVec3;
use sampling::math::Spectrum;
use sampling::{Vec2, Vec3, vec2};

/// Where on a surface a texture is read.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceCoordinates {
    /// The point, in the scene's coordinates.
    pub p: Vec3,
    /// Texture coordinates.
    pub uv: Vec2,
    /// The colour of the mesh's vertices, interpolated; white where they have none.
    pub colour: Spectrum,
}

impl SurfaceCoordinates {
    /// A point of which nothing more is known: what ramps and noise are read at.
    pub fn of(p: Vec3) -> Self {
        Self { p, uv: Vec2::ZERO, colour: Spectrum::ONE }
    }
}

/// A value given at every point of a surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Texture {
    /// The same everywhere.
    Constant(Spectrum),
    /// Linear in position: `base + slope·((p − origin)·axis / scale)`, in the scene's coordinates.
    ///
    /// Being linear, its mean over a triangle or a sphere is its value at the centroid, exactly, and its extremes over a
    /// triangle are at the vertices.
    Ramp {
        /// Value at the origin.
        base: Spectrum,
        /// Change per `scale` metres along the axis.
        slope: Spectrum,
        /// Direction of change.
        axis: Vec3,
        /// Where the value is `base` \[m\].
        origin: DVec3,
        /// Length over which the value changes by `slope` \[m\].
        scale: f32,
    },
    /// An image over the texture coordinates.
    Image(ImageTexture),
    /// Squares of two values over the texture coordinates, each ½ wide and high where `map` changes nothing: u and v from 0 to 1
    /// hold two rows of two.
    Checkerboard {
        /// The value of the square at the origin and of those that touch its corners, and that of the others.
        values: [Spectrum; 2],
        /// Where in the pattern a point lies.
        map: UvMap,
    },
    /// Gradient noise in position.
    Noise(Noise),
    /// The interpolated colours of the mesh's vertices.
    VertexColour,
}

/// Places a pattern on a surface: `uv · scale + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvMap {
    /// How often the pattern is repeated per unit of u and of v.
    pub scale: Vec2,
    /// Added after scaling.
    pub offset: Vec2,
}

impl Default for UvMap {
    fn default() -> Self {
        Self { scale: Vec2::ONE, offset: Vec2::ZERO }
    }
}

impl UvMap {
    /// The place in the pattern.
    #[inline]
    pub fn at(&self, uv: Vec2) -> Vec2 {
        uv * self.scale + self.offset
    }

    fn is_finite(&self) -> bool {
        self.scale.is_finite() && self.offset.is_finite()
    }
}

impl Texture {
    /// The value at a point.
    #[inline]
    pub fn at(&self, point: &SurfaceCoordinates) -> Spectrum {
        match self {
            Texture::Constant(value) => *value,
            Texture::Ramp { base, slope, axis, origin, scale } => {
                let from_origin = (point.p.as_dvec3() - *origin).as_vec3();
                *base + *slope * (from_origin.dot(*axis) / *scale)
            }
            Texture::Image(image) => image.at(point.uv),
            Texture::Checkerboard { values, map } => {
                let cell = (map.at(point.uv) * 2.0).floor();
                values[((cell.x + cell.y) as i64).rem_euclid(2) as usize]
            }
            Texture::Noise(noise) => noise.at(point.p),
            Texture::VertexColour => point.colour,
        }
    }

    /// The step in which its slope is measured: of the texture coordinates, and in metres. That of images is known.
    pub(crate) fn step(&self) -> (Vec2, f32) {
        const STEP: f32 = 1.0 / 512.0;
        match self {
            Texture::Checkerboard { map, .. } => (vec2(STEP, STEP) / map.scale, STEP),
            Texture::Noise(noise) => (vec2(STEP, STEP), noise.finest() * STEP),
            Texture::Ramp { scale, .. } => (vec2(STEP, STEP), scale.abs() * STEP),
            Texture::Constant(_) | Texture::Image(_) | Texture::VertexColour => (vec2(STEP, STEP), STEP),
        }
    }

    /// The direction in which it changes, if there is but one.
    pub fn axis(&self) -> Option<Vec3> {
        match self {
            Texture::Ramp { axis, .. } => axis.try_normalize(),
            _ => None,
        }
    }

    /// Whether it is the same everywhere.
    pub fn is_constant(&self) -> bool {
        matches!(self, Texture::Constant(_))
    }

    /// Whether it is read by texture coordinates.
    pub fn needs_uv(&self) -> bool {
        matches!(self, Texture::Image(_) | Texture::Checkerboard { .. })
    }

    /// The least and the greatest value of any channel, wherever it is read; None if that depends on the surface.
    pub fn range(&self) -> Option<(Spectrum, Spectrum)> {
        match self {
            Texture::Constant(value) => Some((*value, *value)),
            Texture::Ramp { .. } | Texture::VertexColour => None,
            Texture::Image(image) => Some(image.range()),
            Texture::Checkerboard { values: [a, b], .. } => Some((min(*a, *b), a.max(*b))),
            Texture::Noise(noise) => Some((min(noise.low, noise.high), noise.low.max(noise.high))),
        }
    }

    /// The least and the greatest value of any channel over what is symmetric about `middle` and reaches from there `reach(axis)`
    /// along an axis, to either side, in units of the axis' length.
    pub fn range_around(&self, middle: Vec3, reach: impl Fn(Vec3) -> f32) -> (f32, f32) {
        if let Some((low, high)) = self.range() {
            return (least(low), high.max_component());
        }
        let value = self.at(&SurfaceCoordinates::of(middle));
        let swing = match self {
            Texture::Ramp { slope, axis, scale, .. } => (*slope * (reach(*axis) / *scale)).abs(),
            _ => Spectrum::ZERO,
        };
        (least(value - swing), (value + swing).max_component())
    }

    /// What is wrong with it, if anything is: a number that is not finite, a scale of zero.
    pub fn fault(&self) -> Option<&'static str> {
        let ramp = "has a ramp with a scale of 0 or a number that is not finite";
        match self {
            Texture::Constant(value) => (!value.is_finite()).then_some("is not finite"),
            Texture::Ramp { base, slope, axis, origin, scale } => {
                let finite = base.is_finite() && slope.is_finite() && axis.is_finite() && origin.is_finite();
                (!finite || !scale.is_finite() || *scale == 0.0).then_some(ramp)
            }
            Texture::Image(image) => {
                (!image.map.is_finite()).then_some("has an image placed by numbers that are not finite")
            }
            Texture::Checkerboard { values: [a, b], map } => {
                let finite = a.is_finite() && b.is_finite() && map.is_finite();
                (!finite).then_some("has a checkerboard of numbers that are not finite")
            }
            Texture::Noise(noise) => noise.fault(),
            Texture::VertexColour => None,
        }
    }

    /// The same texture where the scene's coordinates are others.
    pub(crate) fn resembling(mut self, similarity: &Similarity) -> Self {
        let Similarity { scale: by, offset } = *similarity;
        match &mut self {
            Texture::Ramp { origin, scale, .. } => {
                *origin = *origin * by + offset;
                *scale *= by as f32;
            }
            Texture::Noise(noise) => {
                noise.origin = noise.origin * by + offset;
                noise.size *= by as f32;
            }
            Texture::Constant(_) | Texture::Image(_) | Texture::Checkerboard { .. } | Texture::VertexColour => {}
        }
        self
    }

    /// A texture of so many times the values; but vertices keep their colours.
    pub(crate) fn times(mut self, factor: f32) -> Self {
        match &mut self {
            Texture::Constant(value) => *value *= factor,
            Texture::Ramp { base, slope, .. } => (*base, *slope) = (*base * factor, *slope * factor),
            Texture::Image(image) => image.scale *= factor,
            Texture::Checkerboard { values, .. } => values.iter_mut().for_each(|value| *value *= factor),
            Texture::Noise(noise) => (noise.low, noise.high) = (noise.low * factor, noise.high * factor),
            Texture::VertexColour => {}
        }
        self
    }

    /// The same texture after the scene's coordinates have been shifted by `−shift`.
    pub(crate) fn recentred(mut self, shift: DVec3) -> Self {
        match &mut self {
            Texture::Ramp { origin, .. } => *origin -= shift,
            Texture::Noise(noise) => noise.origin -= shift,
            _ => {}
        }
        self
    }
}

/// The lesser of each channel.
fn min(a: Spectrum, b: Spectrum) -> Spectrum {
    let (a, b) = (a.to_array(), b.to_array());
    Spectrum::from([a[0].min(b[0]), a[1].min(b[1]), a[2].min(b[2])])
}

/// The least channel.
fn least(value: Spectrum) -> f32 {
    value.to_array().into_iter().fold(f32::INFINITY, f32::min)
}

impl From<Spectrum> for Texture {
    fn from(value: Spectrum) -> Self {
        Texture::Constant(value)
    }
}

impl From<f32> for Texture {
    fn from(value: f32) -> Self {
        Texture::Constant(Spectrum::splat(value))
    }
}

#[cfg(test)]
mod tests;
