//! The shifted-gamma distribution of normals, with Smith's shadowing.

use super::microfacets::{Distribution, happens};
use super::quadrature::integrate;
use super::{Recalled, Shared};
use crate::math::elementary::{exp, exp_m1, ln};
use crate::warp::sin_cos_turns;
use glam::{Vec2, Vec3, vec2, vec3};
use std::f32::consts::PI;

/// The shifted-gamma distribution (SGD) of [Bagher12, section 4], fitted there to measured metals and plastics: between
/// Beckmann's distribution (γ = 0, of α = √α_sgd) and one with a sharp peak and long tails.
///
/// Slopes of squared length x have P₂₂(x) = α^(γ−1) / Γ(1−γ, α) · e^(−(α² + x)/α) (α² + x)^(−γ). With x = α² q that is
/// e^(−αq) (1 + q)^(−γ) / (α² ∫₀^∞ e^(−αs) (1 + s)^(−γ) ds), in which no incomplete gamma function is left.
///
/// Departures: the paper is isotropic; here slopes are stretched by α_x along x and α_y along y, and α = √(α_x α_y).
/// The paper fits Smith's G₁ by a function with parameters of its own; here it is Smith's integral over the distribution
/// itself, tabulated by α and γ.
/// α in [2·10⁻⁴, 1], γ in [0, 4].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShiftedGamma {
    alpha_x: f32,
    alpha_y: f32,
    table: Shared<Shape>,
}

/// What is tabulated for an α and a γ, of slopes over α.
#[derive(Debug)]
struct Shape {
    alpha: f32,
    gamma: f32,
    /// ∫₀^∞ e^(−αs) (1 + s)^(−γ) ds, which is also how far slopes typically go.
    spread: f32,
    /// The scale of [`Curve::at`] for `hidden`.
    scale: f32,
    /// h(a) = ∫_a^∞ (x − a) P₂(x) dx, where a/(a + scale) goes from 0 to 1 and P₂ is the density of slopes in one direction.
    hidden: Curve,
    /// ln(1 + q/spread) of the slopes that a share e^(−v) exceeds, where v/[`MAX_LOG_SHARE`] goes from 0 to 1.
    quantiles: Curve,
}

/// A density that is never met.
const NOTHING: f32 = 1e-25;

/// −ln of the smallest share that a random number in `f32` can be, 2⁻²⁴.
const MAX_LOG_SHARE: f32 = 16.64;

static TABLES: Recalled<2, Shape> = Recalled::new();

impl ShiftedGamma {
    /// The smallest roughness for which directions in `f32` resolve the lobe for every γ, 2·10⁻⁴.
    pub const MIN_ALPHA: f32 = 2e-4;

    /// The distribution with these roughnesses and this fall-off γ.
    pub fn new(alpha_x: f32, alpha_y: f32, gamma: f32) -> Self {
        debug_assert!(alpha_x > 0.0 && alpha_y > 0.0 && gamma >= 0.0, "{alpha_x}, {alpha_y}, {gamma}");
        let alpha = (alpha_x * alpha_y).sqrt();
        Self { alpha_x, alpha_y, table: TABLES.get([alpha, gamma], || Shape::new(alpha, gamma)) }
    }

    /// The two roughnesses.
    #[inline]
    pub fn alphas(&self) -> Vec2 {
        vec2(self.alpha_x, self.alpha_y)
    }

    /// The fall-off γ.
    pub fn gamma(&self) -> f32 {
        self.table.gamma
    }

    /// The squared length q of the slopes over their roughness that this share exceeds.
    #[inline]
    pub fn quantile(&self, share: f32) -> f32 {
        self.table.spread * exp_m1(self.table.quantiles.at(-ln(share) / MAX_LOG_SHARE)).max(0.0)
    }

    /// The density [1/area] of slopes over their roughness, given the square q of their length.
    #[inline]
    pub fn slopes(&self, q: f32) -> f32 {
        let Shape { alpha, gamma, spread, .. } = *self.table;
        exp(-alpha * q - gamma * ln(1.0 + q)) / (PI * spread)
    }
}

impl Distribution for ShiftedGamma {
    /// The density D(m) of normals [1/sr], for `m` in the upper hemisphere; ∫ D(m) cos θ_m dm = 1.
    #[inline(always)]
    fn d(&self, m: Vec3) -> f32 {
        let (x, y, z2) = (m.x / self.alpha_x, m.y / self.alpha_y, m.z * m.z);
        let slopes = self.slopes((x * x + y * y) / z2);
        // Before the density underflows, or cos⁴ does.
        if slopes > NOTHING { slopes / (self.alpha_x * self.alpha_y * z2 * z2) } else { 0.0 }
    }

    /// The projected area σ(w) = ∫ D(m) ⟨w·m⟩ dm = |z| (1 + Λ) of the facets seen from `w`; Smith's G₁ is |z| / σ.
    #[inline(always)]
    fn area(&self, w: Vec3) -> f32 {
        let (z, sin) = (w.z.abs(), vec2(self.alpha_x * w.x, self.alpha_y * w.y).length());
        // a/(a + scale) with a = z/sin, also where sin = 0.
        z + sin * self.table.hidden.at(z / (z + self.table.scale * sin))
    }

    /// The area to which normals are sampled: the density of [`sample`](Self::sample) is D(m) ⟨w·m⟩ over this.
    ///
    /// It is exact where the mirror image of `m` about the z axis is visible as well, and 2 D(m) cos θ_m elsewhere.
    #[inline(always)]
    fn sampled_area(&self, w: Vec3, _area: f32, o_m: f32, m: Vec3) -> f32 {
        w.z.abs().max(0.5 * o_m / m.z)
    }

    /// A normal seen from `w`, which is in the upper hemisphere.
    ///
    /// Visible normals would need a table of three dimensions. So m is sampled by D(m) cos θ_m, with tabulated quantiles of its
    /// slope, and turned by half a turn about z with the probability that makes it and its image as likely as they are large
    /// when seen from `w`.
    #[inline(always)]
    fn sample(&self, w: Vec3, _area: f32, uc: f32, u: Vec2) -> (Vec3, f32) {
        let slope = self.quantile(1.0 - u.x).sqrt();
        let (sin, cos) = sin_cos_turns(u.y);
        let m = vec3(self.alpha_x * slope * cos, self.alpha_y * slope * sin, 1.0).normalize();
        let image = vec3(-m.x, -m.y, m.z);
        let (seen, seen_of_image) = (w.dot(m).max(0.0), w.dot(image).max(0.0));
        // One of them is seen, since they are so far apart that their sum points along z.
        let (is_first, uc) = happens(seen / (seen + seen_of_image), uc);
        (if is_first { m } else { image }, uc)
    }
}

impl Shape {
    fn new(alpha: f32, gamma: f32) -> Self {
        let (a, g) = (f64::from(alpha), f64::from(gamma));
        let spread = decay(a, g);
        // The density of slopes by their squared length, and the logarithm of where it ends.
        let slopes = |q: f64| (-a * q - g * q.ln_1p()).exp() / (std::f64::consts::PI * spread);
        let end = (45.0 / a).sqrt().asinh();
        // With the slope's length r = √(b² + ρ²), the parts of the circle of radius r beyond b have
        // ∫ (r cos φ − b) r dφ dr = 2 (ρ − b atan(ρ/b)) ρ dρ; its derivative by b is −2 atan(ρ/b) ρ dρ.
        let over = |b: f64, of: fn(f64, f64) -> f64| {
            integrate(0.0, end, 32, |y| {
                let rho = y.sinh();
                2.0 * slopes(b * b + rho * rho) * of(rho, b) * rho * y.cosh()
            })
        };
        let scale = (4.0 * over(0.0, |rho, _| rho)).max(1.0);
        let hidden = Curve::new(|t| {
            if t == 1.0 {
                return (0.0, 0.0);
            }
            let b = scale * t / (1.0 - t);
            let slope = -over(b, |rho, b| rho.atan2(b));
            (over(b, |rho, b| rho - b * rho.atan2(b)), slope * scale / (1.0 - t).powi(2))
        });
        // With q = spread (e^L − 1), of which a share e^(−v) is beyond: dq/dv = (1 + q) ∫ e^(−α(1 + q)s) (1 + s)^(−γ) ds. It is
        // followed from L = 0 by Runge and Kutta's rule.
        const STEPS: usize = 4;
        let step = f64::from(MAX_LOG_SHARE) / (CELLS * STEPS) as f64;
        let rate = |l: f64| {
            let q = spread * l.exp_m1();
            (1.0 + q) * decay(a * (1.0 + q), g) / (spread + q)
        };
        let mut l = 0.0;
        let mut nodes = Vec::new();
        for _ in 0..=CELLS {
            nodes.push((l, rate(l)));
            for _ in 0..STEPS {
                let k1 = rate(l);
                let k2 = rate(l + 0.5 * step * k1);
                let k3 = rate(l + 0.5 * step * k2);
                let k4 = rate(l + step * k3);
                l += step * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0;
            }
        }
        let quantiles = Curve::new(|t| {
            let (l, rate) = nodes[(t * CELLS as f64).round() as usize];
            (l, rate * f64::from(MAX_LOG_SHARE))
        });
        Self { alpha, gamma, spread: spread as f32, scale: scale as f32, hidden, quantiles }
    }
}

/// ∫₀^∞ e^(−ts) (1 + s)^(−γ) ds = e^t t^(γ−1) Γ(1 − γ, t).
fn decay(t: f64, gamma: f64) -> f64 {
    // 1 + s = e^y, up to where the exponential is 10⁻²⁰.
    integrate(0.0, (45.0 / t).ln_1p(), 24, |y| (-t * y.exp_m1() + (1.0 - gamma) * y).exp())
}

/// How many pieces a curve has.
const CELLS: usize = 256;

/// A function on [0, 1] in cubic pieces.
#[derive(Debug)]
struct Curve([[f32; 2]; CELLS + 1]);

impl Curve {
    /// The curve through the values, with the derivatives, that `f` has at the ends of the pieces.
    fn new(f: impl Fn(f64) -> (f64, f64)) -> Self {
        Self(std::array::from_fn(|i| {
            let (value, derivative) = f(i as f64 / CELLS as f64);
            [value as f32, (derivative / CELLS as f64) as f32]
        }))
    }

    #[inline(always)]
    fn at(&self, t: f32) -> f32 {
        let x = t * CELLS as f32;
        let i = (x as i32 as usize).min(CELLS - 1);
        let s = x - i as f32;
        let ([a, a_slope], [b, b_slope]) = (self.0[i], self.0[i + 1]);
        let rise = b - a;
        a + s * (a_slope + s * (3.0 * rise - 2.0 * a_slope - b_slope + s * (a_slope + b_slope - 2.0 * rise)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// α and γ to try.
    const SHAPES: [(f32, f32); 7] =
        [(1e-4, 1.0), (0.01, 0.0), (0.1, 0.5), (0.1, 1.0), (1.0, 1.5), (0.3, 4.0), (1e-4, 4.0)];

    #[test]
    fn quantiles_are_those_of_the_density() {
        for (alpha, gamma) in SHAPES {
            let sgd = ShiftedGamma::new(alpha, alpha, gamma);
            for share in [1.0_f32, 0.999, 0.7, 0.2, 0.03, 1e-3, 1e-6] {
                let q = f64::from(sgd.quantile(share));
                let (a, g) = (f64::from(alpha), f64::from(gamma));
                // Substituting (1 + s) for (1 + q)(1 + s) in the integral from q on.
                let beyond = (-a * q).exp() * (1.0 + q).powf(1.0 - g) * decay(a * (1.0 + q), g) / decay(a, g);
                assert!((beyond / f64::from(share) - 1.0).abs() < 3e-5, "{alpha} {gamma} {share}: {beyond}");
            }
        }
    }

    #[test]
    fn without_a_fall_off_it_is_beckmann() {
        let (sgd, beckmann) = (ShiftedGamma::new(0.09, 0.09, 0.0), super::super::Beckmann::new(0.3, 0.3));
        for z in [1.0_f32, 0.9, 0.5, 0.1, 1e-3] {
            let w = vec3((1.0 - z * z).sqrt(), 0.0, z);
            assert!((sgd.d(w) - beckmann.d(w)).abs() <= 2e-5 * beckmann.d(w), "{z}: {} {}", sgd.d(w), beckmann.d(w));
            assert!((sgd.area(w) - beckmann.area(w)).abs() < 1e-6, "{z}: {} {}", sgd.area(w), beckmann.area(w));
        }
    }
}
