//! Values that vary over surfaces.

use sampling::Vec3;
use sampling::math::Spectrum;

/// A value given at every point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
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
        origin: Vec3,
        /// Length over which the value changes by `slope` \[m\].
        scale: f32,
    },
}

impl Texture {
    /// The value at a point.
    #[inline]
    pub fn at(&self, p: Vec3) -> Spectrum {
        match *self {
            Texture::Constant(value) => value,
            Texture::Ramp { base, slope, axis, origin, scale } => base + slope * ((p - origin).dot(axis) / scale),
        }
    }

    /// The direction in which it changes, if it does.
    pub fn axis(&self) -> Option<Vec3> {
        match self {
            Texture::Constant(_) => None,
            Texture::Ramp { axis, .. } => axis.try_normalize(),
        }
    }

    /// Whether it is the same everywhere.
    pub fn is_constant(&self) -> bool {
        matches!(self, Texture::Constant(_))
    }

    /// The least and the greatest value of any channel over a ball.
    pub fn range_in_ball(&self, center: Vec3, radius: f32) -> (f32, f32) {
        let middle = self.at(center).to_array();
        let swing = match *self {
            Texture::Constant(_) => [0.0; 3],
            Texture::Ramp { slope, axis, scale, .. } => {
                slope.to_array().map(|channel| (channel * axis.length() * radius / scale).abs())
            }
        };
        let low = (0..3).map(|i| middle[i] - swing[i]).fold(f32::INFINITY, f32::min);
        let high = (0..3).map(|i| middle[i] + swing[i]).fold(f32::NEG_INFINITY, f32::max);
        (low, high)
    }

    /// True if every number in it is finite and the scale is not zero.
    pub fn is_valid(&self) -> bool {
        match *self {
            Texture::Constant(value) => value.is_finite(),
            Texture::Ramp { base, slope, axis, origin, scale } => {
                base.is_finite()
                    && slope.is_finite()
                    && axis.is_finite()
                    && origin.is_finite()
                    && scale.is_finite()
                    && scale != 0.0
            }
        }
    }

    /// The same texture after the scene's coordinates have been shifted by `−shift`.
    pub(crate) fn recentred(mut self, shift: glam::DVec3) -> Self {
        if let Texture::Ramp { origin, .. } = &mut self {
            *origin = (origin.as_dvec3() - shift).as_vec3();
        }
        self
    }
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
mod tests {
    use super::*;
    use crate::test_support::ramp_z;
    use sampling::vec3;

    #[test]
    fn a_ramp_is_linear_and_bounded_by_its_range() {
        let ramp = ramp_z(Spectrum::splat(0.5), Spectrum::splat(0.4));
        assert!((ramp.at(vec3(9.0, 9.0, 0.5)).to_array()[0] - 0.7).abs() < 1e-6);
        let (low, high) = ramp.range_in_ball(Vec3::ZERO, 1.0);
        assert!((low - 0.1).abs() < 1e-6 && (high - 0.9).abs() < 1e-6);
    }

    #[test]
    fn recentring_moves_the_ramp_with_the_scene() {
        let ramp = ramp_z(Spectrum::ZERO, Spectrum::ONE);
        let moved = ramp.recentred(glam::dvec3(0.0, 0.0, 5.0));
        assert_eq!(ramp.at(vec3(0.0, 0.0, 7.0)), moved.at(vec3(0.0, 0.0, 2.0)));
    }
}
