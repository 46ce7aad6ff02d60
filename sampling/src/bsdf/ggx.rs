//! The microfacet distribution of Trowbridge and Reitz, known as GGX, with Smith's shadowing.
//!
//! All functions are written without a division by a cosine, so that grazing directions lose nothing. The quantity
//! that makes this possible is the *span* s(w) = √(α_x² x² + α_y² y² + z²): in Smith's terms 1 + Λ = (1 + s/|z|) / 2.

use super::microfacets::Distribution;
use crate::warp::sin_cos_turns;
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::PI;

/// GGX with roughness α_x along x and α_y along y [Trowbridge75; Walter07, (33); Heitz14, section 5].
///
/// α in (0, ∞), usually 10⁻⁴ … 1; see [`Ggx::MIN_ALPHA`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    alpha_x: f32,
    alpha_y: f32,
}

impl Ggx {
    /// The smallest roughness for which directions in `f32` resolve the lobe; 10⁻⁴.
    ///
    /// The lobe is about α wide and directions are exact to 10⁻⁷: below this bound values at a given direction have errors
    /// of a per cent and more (not their mean, and not the weights of samples). Use a smooth model instead.
    pub const MIN_ALPHA: f32 = 1e-4;

    /// The distribution with these roughnesses.
    #[inline]
    pub fn new(alpha_x: f32, alpha_y: f32) -> Self {
        debug_assert!(alpha_x > 0.0 && alpha_y > 0.0, "roughness {alpha_x}, {alpha_y}");
        Self { alpha_x, alpha_y }
    }

    /// The two roughnesses.
    #[inline]
    pub fn alphas(&self) -> Vec2 {
        vec2(self.alpha_x, self.alpha_y)
    }

    /// Whether the two roughnesses differ.
    pub fn is_anisotropic(&self) -> bool {
        self.alpha_x != self.alpha_y
    }

    /// The density [1/area] of slopes over their roughness, given the square q of their length.
    #[inline]
    pub fn slopes(q: f32) -> f32 {
        1.0 / (PI * (1.0 + q) * (1.0 + q))
    }

    /// The density D(m) of normals [1/sr], for `m` in the upper hemisphere; ∫ D(m) cos θ_m dm = 1.
    #[inline]
    pub fn d(&self, m: Vec3) -> f32 {
        let (x, y) = (m.x / self.alpha_x, m.y / self.alpha_y);
        let q = x * x + y * y + m.z * m.z;
        1.0 / (PI * self.alpha_x * self.alpha_y * q * q)
    }

    /// The span s(w) of a direction.
    #[inline]
    pub fn span(&self, w: Vec3) -> f32 {
        let (x, y) = (self.alpha_x * w.x, self.alpha_y * w.y);
        (x * x + y * y + w.z * w.z).sqrt()
    }

    /// The projected area σ(w) = ∫ D(m) ⟨w·m⟩ dm = (|z| + s) / 2 of the facets seen from `w`; Smith's G₁ is |z| / σ.
    #[inline]
    pub fn area(&self, w: Vec3) -> f32 {
        0.5 * (w.z.abs() + self.span(w))
    }

    /// Smith's masking G₁(w) / |cos θ| = 2 / (|z| + s) `[Heitz14]`, given the magnitude of the cosine and the span.
    #[inline]
    pub fn g1_over_cos(cos: f32, span: f32) -> f32 {
        2.0 / (cos + span)
    }

    /// The density [1/sr] of visible normals D(m) G₁(w) |w·m| / |cos θ_w| `[Heitz14]`, less its factor |w·m|.
    #[inline]
    pub fn visible_over_cos(&self, cos: f32, span: f32, m: Vec3) -> f32 {
        Self::g1_over_cos(cos, span) * self.d(m)
    }

    /// A normal visible from `wo`, which is in the upper hemisphere: the distribution of `[Heitz18]`, by the spherical caps
    /// of `[Dupuy23]`.
    #[inline]
    pub fn sample_visible(&self, wo: Vec3, u: Vec2) -> Vec3 {
        // Where the roughness is 1 the visible normals are the halves between `wo` and a uniform direction of the cap
        // that is reflected above the horizon.
        let w = vec3(self.alpha_x * wo.x, self.alpha_y * wo.y, wo.z).normalize();
        let (sin_phi, cos_phi) = sin_cos_turns(u.x);
        let height = (1.0 - u.y) * (1.0 + w.z);
        // sin²θ = (1 − z)(1 + z) with z = height − w.z and (1 − w.z)(1 + w.z) = w.x² + w.y²: nothing is subtracted.
        let sin = (u.y * (height * (1.0 + w.z) + (w.x * w.x + w.y * w.y))).sqrt();
        // z + w.z = height > 0, so the half vector is never zero.
        let half = vec3(sin * cos_phi + w.x, sin * sin_phi + w.y, height);
        vec3(self.alpha_x * half.x, self.alpha_y * half.y, half.z).normalize()
    }
}

impl Distribution for Ggx {
    #[inline]
    fn d(&self, m: Vec3) -> f32 {
        Self::d(self, m)
    }

    #[inline]
    fn area(&self, w: Vec3) -> f32 {
        Self::area(self, w)
    }

    #[inline]
    fn sample(&self, w: Vec3, _area: f32, uc: f32, u: Vec2) -> (Vec3, f32) {
        (self.sample_visible(w, u), uc)
    }

    #[inline]
    fn sampled_area(&self, _w: Vec3, area: f32, _o_m: f32, _m: Vec3) -> f32 {
        area
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::{uniform_hemisphere, uniform_hemisphere_pdf};

    const SIDE: usize = 1024;

    fn grid() -> impl Iterator<Item = Vec2> {
        (0..SIDE * SIDE).map(|i| (vec2((i % SIDE) as f32, (i / SIDE) as f32) + 0.5) / SIDE as f32)
    }

    fn directions() -> Vec<Vec3> {
        let mut all = vec![Vec3::Z];
        for theta in [0.3_f32, 0.9, 1.3, 1.55] {
            for phi in [0.0_f32, 0.7, 1.571] {
                all.push(vec3(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()));
            }
        }
        all
    }

    #[test]
    fn the_distribution_is_normalised() {
        for (ax, ay) in [(1.0, 1.0), (0.3, 0.3), (0.2, 0.7)] {
            let ggx = Ggx::new(ax, ay);
            let sum: f64 = grid()
                .map(|u| {
                    let m = uniform_hemisphere(u);
                    f64::from(ggx.d(m) * m.z / uniform_hemisphere_pdf())
                })
                .sum();
            assert!((sum / (SIDE * SIDE) as f64 - 1.0).abs() < 2e-3, "{ax} {ay}: {sum}");
        }
    }

    #[test]
    fn masking_is_what_is_left_of_the_projected_area() {
        // ∫ G₁ ⟨w·m⟩ D dm = cos θ_w defines G₁ [Heitz14, section 2].
        for (ax, ay) in [(1.0, 1.0), (0.4, 0.8)] {
            let ggx = Ggx::new(ax, ay);
            for w in directions() {
                let factor = Ggx::g1_over_cos(w.z, ggx.span(w));
                let sum: f64 = grid()
                    .map(|u| {
                        let m = uniform_hemisphere(u);
                        f64::from(factor * ggx.d(m) * w.dot(m).max(0.0) / uniform_hemisphere_pdf())
                    })
                    .sum();
                assert!((sum / (SIDE * SIDE) as f64 - 1.0).abs() < 3e-3, "{ax} {ay} {w}: {sum}");
            }
        }
    }

    #[test]
    fn visible_normals_have_their_density() {
        // The mean of g / pdf over samples is ∫ g, for a g that separates errors of shape: 1 and powers of m.
        for (ax, ay) in [(1.0, 1.0), (0.3, 0.6)] {
            let ggx = Ggx::new(ax, ay);
            for w in directions() {
                let (mut sampled, mut exact) = ([0.0_f64; 4], [0.0_f64; 4]);
                let span = ggx.span(w);
                for u in grid() {
                    let m = ggx.sample_visible(w, u);
                    let n = uniform_hemisphere(u);
                    let weight = ggx.visible_over_cos(w.z, span, n) * w.dot(n).max(0.0) / uniform_hemisphere_pdf();
                    for (i, g) in [|_: Vec3| 1.0, |m: Vec3| m.z, |m: Vec3| m.x, |m: Vec3| m.y * m.y].iter().enumerate()
                    {
                        sampled[i] += f64::from(g(m));
                        exact[i] += f64::from(g(n) * weight);
                    }
                }
                for (s, e) in sampled.iter().zip(exact) {
                    assert!((s - e).abs() / ((SIDE * SIDE) as f64) < 3e-3, "{ax} {ay} {w}: {s} {e}");
                }
            }
        }
    }

    #[test]
    fn extremes_stay_finite() {
        let edge = [0.0, 5.96e-8, 0.5, 1.0_f32.next_down()];
        for alpha in [1e-8, 1e-4, 1e-2, 1.0] {
            for other in [1e-4, 1.0] {
                let ggx = Ggx::new(alpha, other);
                for z in [1.0_f32, 0.5, 1e-4, 1e-7, 1e-20] {
                    let w = vec3((1.0 - z * z).sqrt(), 0.0, z);
                    for ux in edge {
                        for uy in edge {
                            let m = ggx.sample_visible(w, vec2(ux, uy));
                            assert!((m.length() - 1.0).abs() < 1e-6 && m.z >= 0.0, "{alpha} {w} {ux} {uy}: {m}");
                            let pdf = ggx.visible_over_cos(z, ggx.span(w), m);
                            assert!(pdf.is_finite() && pdf > 0.0, "{alpha} {w} {ux} {uy}: {pdf}");
                        }
                    }
                }
            }
        }
    }
}
