//! A rectangle as it is seen from a point: places on it, uniform over the solid angle that it fills `[Urena13]`.

use glam::{Vec2, vec2};

/// The rectangle `x[0] ≤ x ≤ x[1]`, `y[0] ≤ y ≤ y[1]` of the plane at height z > 0, seen from the origin.
///
/// The part of it from 0 to `x` fills the solid angle `Ω(x) = A(x, y[1]) − A(x, y[0])`, with the
/// `A(x, y) = atan(x y / (z √(x² + y² + z²)))` that the rectangle from 0 to `x` and 0 to `y` fills. Places are found by the way back from Ω,
/// and then along y by that from the sine of the angle at which y is seen, in proportion to which a thin strip's solid angle grows.
#[derive(Clone, Copy, Debug)]
pub struct SphericalRectangle {
    x: [f64; 2],
    y: [f64; 2],
    z: f64,
    /// Ω at `x[0]` [sr], negative where that is.
    before: f64,
    solid_angle: f64,
}

impl SphericalRectangle {
    /// The rectangle of these sides, each in rising order, at a height above 0; all of any one unit of length.
    #[inline]
    pub fn new(x: [f64; 2], y: [f64; 2], z: f64) -> Self {
        let [before, after] = x.map(|x| filled(x, y, z));
        Self { x, y, z, before, solid_angle: after - before }
    }

    /// The solid angle that it fills \[sr\], below 2π; rounding costs it some 10⁻¹⁵ sr.
    #[inline]
    pub fn solid_angle(&self) -> f64 {
        self.solid_angle
    }

    /// A place on it, as shares of its sides in [0, 1), whose direction is uniform over the solid angle.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Vec2 {
        let Self { x, y, z, .. } = *self;
        let px = self.column(f64::from(u.x));
        let squared = px * px + z * z;
        let [low, high] = y.map(|y| y / (y * y + squared).sqrt());
        let py = squared.sqrt() * tangent(low + f64::from(u.y) * (high - low));
        let share = |p: f64, [from, to]: [f64; 2]| ((p - from) / (to - from)).clamp(0.0, 1.0) as f32;
        vec2(share(px, x), share(py, y)).min(Vec2::splat(1.0_f32.next_down()))
    }

    /// The density [1/sr] of [`sample`](Self::sample) in directions that meet it.
    #[inline]
    pub fn pdf(&self) -> f32 {
        (1.0 / self.solid_angle) as f32
    }

    /// The x up to which it fills this share of its solid angle.
    ///
    /// With `s = x / √(x² + z²)` and `b` the same of y, `A = asin(s b)`, so that from `c = asin(s b₁) − asin(s b₀)` follows
    /// `s² = sin²c / (b₀² + b₁² − 2 b₀ b₁ cos c)`, the law of cosines.
    #[inline]
    fn column(&self, share: f64) -> f64 {
        let [b0, b1] = self.y.map(|y| y / (y * y + self.z * self.z).sqrt());
        let (sin, cos) = (0.5 * (self.before + share * self.solid_angle)).sin_cos();
        // Of the two ways to write the root, that of which both terms are positive.
        let squared = match b0 * b1 {
            product if product >= 0.0 => (b1 - b0) * (b1 - b0) + 4.0 * product * sin * sin,
            product => (b0 + b1) * (b0 + b1) - 4.0 * product * cos * cos,
        };
        self.z * tangent(2.0 * sin * cos / squared.sqrt())
    }
}

/// The solid angle of the strip from 0 to `x`, between two ys, in (−π, π): the difference of two arcus tangents as one.
#[inline]
fn filled(x: f64, y: [f64; 2], z: f64) -> f64 {
    let [(p0, q0), (p1, q1)] = y.map(|y| (x * y, z * (x * x + y * y + z * z).sqrt()));
    (p1 * q0 - p0 * q1).atan2(q0 * q1 + p0 * p1)
}

/// The tangent of the angle with this sine.
#[inline]
fn tangent(sin: f64) -> f64 {
    sin / ((1.0 - sin) * (1.0 + sin)).max(0.0).sqrt()
}

#[cfg(test)]
mod tests;
