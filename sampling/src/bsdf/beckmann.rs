//! The microfacet distribution of Beckmann, whose slopes are normally distributed, with Smith's shadowing.

use super::grooves::Facets;
use super::microfacets::{Distribution, happens};
use crate::math::elementary::{exp, ln, ln_1p};
use crate::warp::{INV_PI, sin_cos_turns};
use glam::{Vec2, Vec3, vec2, vec3};

/// 1/√π.
const INV_SQRT_PI: f32 = 0.564_189_6;

/// A density that is never met: of slopes beyond seven times the roughness.
const NOTHING: f32 = 1e-25;

/// The slope a of stretched directions from which on Λ is less than rounding.
const SEES_ALL: f32 = 3.7;

/// Beckmann's distribution with roughness α_x along x and α_y along y [Beckmann63; Walter07; Heitz14, section 5].
///
/// Slopes over their roughness have the density e^(−x² − y²)/π: α is √2 times their standard deviation.
/// α in (0, ∞), usually 10⁻⁴ … 1; see [`Beckmann::MIN_ALPHA`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beckmann {
    alpha_x: f32,
    alpha_y: f32,
}

impl Beckmann {
    /// The smallest roughness for which directions in `f32` resolve the lobe, 2·10⁻⁴: twice [`Ggx::MIN_ALPHA`](super::Ggx::MIN_ALPHA),
    /// as its flanks are steeper.
    pub const MIN_ALPHA: f32 = 2e-4;

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
        exp(-q) * INV_PI
    }
}

impl Distribution for Beckmann {
    /// The density D(m) of normals [1/sr], for `m` in the upper hemisphere; ∫ D(m) cos θ_m dm = 1.
    #[inline(always)]
    fn d(&self, m: Vec3) -> f32 {
        let (x, y, z2) = (m.x / self.alpha_x, m.y / self.alpha_y, m.z * m.z);
        let slopes = Self::slopes((x * x + y * y) / z2);
        // Before the density underflows, or cos⁴ does.
        if slopes > NOTHING { slopes / (self.alpha_x * self.alpha_y * z2 * z2) } else { 0.0 }
    }

    /// The projected area σ(w) = ∫ D(m) ⟨w·m⟩ dm = |z| (1 + Λ) of the facets seen from `w`; Smith's G₁ is |z| / σ.
    ///
    /// With the stretched direction, whose slope is a = |z| / √(α_x² x² + α_y² y²), this is Λ = (e^(−a²)/(a√π) − erfc a)/2
    /// `[Walter07]`, exact but for an error of 1.5·10⁻⁷ in erfc. The rational fit of G₁ in [Walter07, (27)], which other renderers
    /// have, is off by −0.30 to 0.32 %.
    #[inline(always)]
    fn area(&self, w: Vec3) -> f32 {
        let (z, sin) = (w.z.abs(), vec2(self.alpha_x * w.x, self.alpha_y * w.y).length());
        if z > SEES_ALL * sin {
            return z;
        }
        let (erfc, gauss) = erfc(z, sin);
        z + 0.5 * (INV_SQRT_PI * sin * gauss - z * erfc)
    }

    /// A normal visible from `w`, which is in the upper hemisphere, with the density D(m) ⟨w·m⟩ / σ(w).
    ///
    /// Slopes x along the stretched direction are visible with the density (a + x) e^(−x²)/(√π (a + h)), x > −a, where
    /// a + h is the projected area over the sine [Heitz14b; Jakob14]. They invert its distribution by iteration;
    /// here it is taken apart into ones with inverses: of the mass a, a normal slope, which if it is turned from `w` is
    /// turned towards it with the probability |x|/a, or where |x| > a is drawn anew from the rest; the rest is x e^(−x²)
    /// beyond a.
    #[inline(always)]
    fn sample(&self, w: Vec3, area: f32, uc: f32, u: Vec2) -> (Vec3, f32) {
        let stretched = vec2(self.alpha_x * w.x, self.alpha_y * w.y);
        let sin = stretched.length();
        let towards = if sin > 0.0 { stretched / sin } else { Vec2::X };
        let a = w.z / sin;
        let (is_beyond, mut uc) = happens((area - w.z) / area, uc);
        // Minus the logarithm of a share of slopes.
        let v = -ln_1p(-u.x);
        let (x, y) = if is_beyond {
            ((a * a + v).sqrt(), erfc_inverse((2.0 * u.y).max(f32::EPSILON)))
        } else {
            let (sin_phi, cos_phi) = sin_cos_turns(u.y);
            let length = v.sqrt();
            let (x, y) = (length * cos_phi, length * sin_phi);
            if x < -a {
                // Given that |x| > a, erfc |x| is uniform up to erfc a.
                let share = erfc(-x, 1.0).0 / erfc(w.z, sin).0;
                ((a * a - ln(share.clamp(f32::MIN_POSITIVE, 1.0))).sqrt(), y)
            } else {
                let (is_turned, rest) = happens((-x / a).max(0.0), uc);
                uc = rest;
                (if is_turned { -x } else { x }, y)
            }
        };
        let slope = x * towards + y * towards.perp();
        (vec3(self.alpha_x * slope.x, self.alpha_y * slope.y, 1.0).normalize(), uc)
    }

    #[inline(always)]
    fn sampled_area(&self, _w: Vec3, area: f32, _o_m: f32, _m: Vec3) -> f32 {
        area
    }
}

impl Facets for Beckmann {
    #[inline(always)]
    fn d(&self, m: Vec3) -> f32 {
        Distribution::d(self, m)
    }

    #[inline(always)]
    fn sample(&self, u: Vec2) -> Vec3 {
        let (sin, cos) = sin_cos_turns(u.x);
        let slope = (-ln_1p(-u.y)).sqrt();
        vec3(self.alpha_x * slope * cos, self.alpha_y * slope * sin, 1.0).normalize()
    }
}

/// erfc x and e^(−x²) of x = `over` / `under` ≥ 0, of which either may be 0; to an absolute error of 1.5·10⁻⁷
/// [Abramowitz64, 7.1.26].
#[inline(always)]
fn erfc(over: f32, under: f32) -> (f32, f32) {
    let (x, t) = (over / under, under / (under + 0.327_591_1 * over));
    let gauss = exp(-x * x);
    let sum = 0.254_829_6 + t * (-0.284_496_74 + t * (1.421_413_8 + t * (-1.453_152 + t * 1.061_405_4)));
    (t * sum * gauss, gauss)
}

/// The x whose erfc is `c` in [10⁻⁷, 2), to a relative error of 10⁻⁶ [Giles12].
#[inline]
fn erfc_inverse(c: f32) -> f32 {
    let horner = |w: f32, coefficients: [f32; 9]| coefficients.into_iter().fold(0.0, |sum, a| sum * w + a);
    let w = -ln(c * (2.0 - c));
    let over = if w < 5.0 {
        let coefficients = [
            2.810_226_4e-8,
            3.432_739_3e-7,
            -3.523_387_7e-6,
            -4.391_506_5e-6,
            2.185_808_7e-4,
            -1.253_725e-3,
            -4.177_681_6e-3,
            0.246_640_73,
            1.501_409_4,
        ];
        horner(w - 2.5, coefficients)
    } else {
        let coefficients = [
            -2.002_142_6e-4,
            1.009_505_6e-4,
            1.349_343_2e-3,
            -3.673_428_4e-3,
            5.739_508e-3,
            -7.622_461_3e-3,
            9.438_87e-3,
            1.001_674,
            2.832_976_8,
        ];
        horner(w.sqrt() - 3.0, coefficients)
    };
    over * (1.0 - c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_function_and_its_inverse_agree() {
        assert!((erfc(0.5, 1.0).0 - 0.479_500_1).abs() < 3e-7 && (erfc(4.0, 2.0).0 - 0.004_677_735).abs() < 3e-7);
        assert_eq!((erfc(1.0, 0.0), erfc(0.0, 1e-4).1), ((0.0, 0.0), 1.0));
        for i in 0..300 {
            let x = i as f32 * 0.01;
            // dx = √π/2 e^(x²) d(erfc).
            let slack = 4e-7 * (x * x).exp() + 3e-6 * x;
            assert!((erfc_inverse(erfc(x, 1.0).0) - x).abs() < slack, "{x}: {}", erfc_inverse(erfc(x, 1.0).0));
        }
        // Λ(3.7) by its asymptotic series.
        let a2 = 3.7_f64 * 3.7;
        assert!((-a2).exp() / (4.0 * 3.7 * a2 * std::f64::consts::PI.sqrt()) < f64::from(f32::EPSILON) / 8.0);
        assert!((erfc_inverse(2.0 - 0.479_500_1) + 0.5).abs() < 2e-6);
    }
}
