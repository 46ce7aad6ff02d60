//! Warps of the unit square, each beside its density.
//!
//! Hemispheres are about +z. All discs come from the concentric map, and caps of spheres from discs, so that strata of
//! the unit square stay compact.

mod rectangle;
mod triangle;

pub use rectangle::SphericalRectangle;
pub use triangle::SphericalTriangle;

use crate::math::elementary::{exp_m1, ln_1p};
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, TAU};

/// 1 / π.
pub const INV_PI: f32 = FRAC_1_PI;
/// 1 / 2π.
pub const INV_2PI: f32 = 0.5 * FRAC_1_PI;
/// 1 / 4π.
pub const INV_4PI: f32 = 0.25 * FRAC_1_PI;

/// Sine and cosine of an angle in [−π/4, π/4], to 1.2e-7.
#[inline]
fn sin_cos_octant(x: f32) -> (f32, f32) {
    let x2 = x * x;
    // Minimax polynomials of the Cephes library (sinf, cosf).
    let sin = x + x * x2 * (-1.666_665_5e-1 + x2 * (8.332_161e-3 + x2 * -1.951_529_6e-4));
    let cos = 1.0 - 0.5 * x2 + x2 * x2 * (4.166_664_6e-2 + x2 * (-1.388_731_6e-3 + x2 * 2.443_315_7e-5));
    (sin, cos)
}

/// Sine and cosine of 2πu for u in [0, 1], to 2e-7.
#[inline]
pub fn sin_cos_turns(u: f32) -> (f32, f32) {
    let quadrant = (4.0 * u + 0.5) as i32;
    // Exact: both are multiples of 2⁻²⁴ or finer with a difference below 1/8.
    let remainder = u - 0.25 * quadrant as f32;
    let (s, c) = sin_cos_octant(TAU * remainder);
    let (s, c) = if quadrant & 1 == 0 { (s, c) } else { (c, -s) };
    if quadrant & 2 == 0 { (s, c) } else { (-s, -c) }
}

/// The angle of a point of the plane over 2π, in [0, 1): the way back from [`sin_cos_turns`].
#[inline]
pub fn turns(y: f32, x: f32) -> f32 {
    let turns = y.atan2(x) * (0.5 * FRAC_1_PI);
    if turns < 0.0 { (turns + 1.0).min(1.0_f32.next_down()) } else { turns }
}

/// A uniform point of the unit disc and its exact radius `[Shirley97]`.
#[inline]
fn concentric_disk(u: Vec2) -> (Vec2, f32) {
    // Numbers are multiples of 2⁻²⁴ or finer, and here stand for the middles of their intervals: none lies on the rim.
    let o = 2.0 * u - Vec2::splat(1.0_f32.next_down());
    // In the wedge around x the angle is π/4 · y/x, around y it is π/2 − π/4 · x/y; a negative radius is opposite.
    let along_x = o.x.abs() > o.y.abs();
    let (r, across) = if along_x { (o.x, o.y) } else { (o.y, o.x) };
    if r == 0.0 {
        return (Vec2::ZERO, 0.0);
    }
    let (s, c) = sin_cos_octant(FRAC_PI_4 * (across / r));
    let (x, y) = if along_x { (c, s) } else { (s, c) };
    (r * vec2(x, y), r.abs())
}

/// A uniform point of the unit disc.
#[inline]
pub fn uniform_disk(u: Vec2) -> Vec2 {
    concentric_disk(u).0
}

/// The density per area of [`uniform_disk`], 1/π.
#[inline]
pub fn uniform_disk_pdf_area() -> f32 {
    INV_PI
}

/// A direction of the upper hemisphere with a density proportional to its cosine, which is above 0.
#[inline]
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let (p, r) = concentric_disk(u);
    p.extend(((1.0 - r) * (1.0 + r)).sqrt())
}

/// The density [1/sr] of [`cosine_hemisphere`] at a direction with this cosine, cos⁺θ / π.
#[inline]
pub fn cosine_hemisphere_pdf(cos: f32) -> f32 {
    cos.max(0.0) * INV_PI
}

/// A direction of the upper hemisphere with a density proportional to cosⁿθ, n ≥ 0.
#[inline(always)]
pub fn power_cosine_hemisphere(u: Vec2, n: f32) -> Vec3 {
    let (p, r) = concentric_disk(u);
    if r == 0.0 {
        return Vec3::Z;
    }
    // cos θ = (1 − r²)^(1/(n+1)), by way of 1 − cos θ, which keeps its digits where the lobe is narrow.
    let one_minus_cos = -exp_m1(ln_1p(-r * r) / (n + 1.0));
    let sin = (one_minus_cos * (2.0 - one_minus_cos)).sqrt();
    (p * (sin / r)).extend(1.0 - one_minus_cos)
}

/// The density [1/sr] of [`power_cosine_hemisphere`], (n + 1)/2π · cosⁿθ, given cosⁿθ.
#[inline]
pub fn power_cosine_hemisphere_pdf(power_of_cos: f32, n: f32) -> f32 {
    (n + 1.0) * INV_2PI * power_of_cos
}

/// A uniform direction of the upper hemisphere.
#[inline]
pub fn uniform_hemisphere(u: Vec2) -> Vec3 {
    uniform_cone(u, 1.0)
}

/// The density [1/sr] of [`uniform_hemisphere`] in its hemisphere, 1/2π.
#[inline]
pub fn uniform_hemisphere_pdf() -> f32 {
    INV_2PI
}

/// A uniform direction.
#[inline]
pub fn uniform_sphere(u: Vec2) -> Vec3 {
    let (p, r) = concentric_disk(u);
    let q = (1.0 - r) * (1.0 + r);
    (p * (2.0 * q.sqrt())).extend(q - r * r)
}

/// The density [1/sr] of [`uniform_sphere`], 1/4π.
#[inline]
pub fn uniform_sphere_pdf() -> f32 {
    INV_4PI
}

/// A uniform direction about +z within the angle whose 1 − cos is `one_minus_cos_max`, in (0, 2].
///
/// The argument is not the cosine, which could not tell the cone of a distant emitter from nothing; see
/// [`one_minus_cos`].
#[inline]
pub fn uniform_cone(u: Vec2, one_minus_cos_max: f32) -> Vec3 {
    let (p, r) = concentric_disk(u);
    let one_minus_cos = r * r * one_minus_cos_max;
    // sin²θ = (1 − cos θ)(1 + cos θ), and r is already in p.
    (p * (one_minus_cos_max * (2.0 - one_minus_cos)).sqrt()).extend(1.0 - one_minus_cos)
}

/// The density [1/sr] of [`uniform_cone`] inside the cone, 1 / (2π (1 − cos θ_max)).
#[inline]
pub fn uniform_cone_pdf(one_minus_cos_max: f32) -> f32 {
    INV_2PI / one_minus_cos_max
}

/// 1 − cos θ of an angle in [0, π/2] with this sin²θ in [0, 1], without cancellation for tiny angles.
#[inline]
pub fn one_minus_cos(sin2: f32) -> f32 {
    sin2 / (1.0 + (1.0 - sin2).sqrt())
}

/// A point of [0, 1] with a density that runs linearly from a value in proportion to `a` to one in proportion to `b`; both are
/// at least 0 and one is more.
#[inline(always)]
pub fn linear(u: f32, a: f32, b: f32) -> f32 {
    // The root of a x + (b − a) x²/2 = u (a + b)/2 that loses no digit as b approaches a.
    let root = (a * a + u * (b * b - a * a)).max(0.0).sqrt();
    if u > 0.0 { u * (a + b) / (a + root) } else { 0.0 }
}

/// One of several parts, of which `cumulative` has the sums of sizes up to and including each, in proportion to its size, and a number in [0, 1)
/// that is left; there must be a part, and one that has a size.
#[inline]
pub fn choose(cumulative: &[f64], u: f32) -> (usize, f32) {
    let last = cumulative.len() - 1;
    let position = f64::from(u) * cumulative[last];
    let index = cumulative.partition_point(|&sum| sum <= position).min(last);
    let before = if index == 0 { 0.0 } else { cumulative[index - 1] };
    let rest = ((position - before) / (cumulative[index] - before)) as f32;
    (index, rest.min(1.0f32.next_down()))
}

/// Barycentric coordinates (b0, b1, b2) of a uniform point of a triangle `[Heitz19]`.
#[inline]
pub fn uniform_triangle(u: Vec2) -> Vec3 {
    let (b0, b1) = if u.y > u.x {
        let b0 = 0.5 * u.x;
        (b0, u.y - b0)
    } else {
        let b1 = 0.5 * u.y;
        (u.x - b1, b1)
    };
    vec3(b0, b1, (1.0 - b0 - b1).max(0.0))
}

/// The density [1/m²] of [`uniform_triangle`] on a triangle of this area in m².
#[inline]
pub fn uniform_triangle_pdf_area(area: f32) -> f32 {
    1.0 / area
}

#[cfg(test)]
mod tests;
