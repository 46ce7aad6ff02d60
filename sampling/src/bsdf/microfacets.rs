//! The distributions of normals that rough models share, with Smith's shadowing.
//!
//! All that models need of Smith's functions is the *projected area* σ(w) = ∫ D(m) ⟨w·m⟩ dm of the facets that turn towards
//! w, shadowed or not: G₁(w) = |cos θ| / σ(w), 1 + Λ(w) = σ(w) / |cos θ| [Heitz14, section 3]. Unlike them it has no pole at
//! grazing angles.

use super::{Beckmann, Ggx, ShiftedGamma};
use glam::{Vec2, Vec3};

/// A distribution of normals D(m), with ∫ D(m) cos θ_m dm = 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Microfacets {
    /// Of Trowbridge and Reitz.
    Ggx(Ggx),
    /// Of Beckmann.
    Beckmann(Beckmann),
    /// Of Bagher, Soler and Holzschuch.
    ShiftedGamma(ShiftedGamma),
}

/// What models need of a distribution of normals.
pub(super) trait Distribution {
    /// The density D(m) of normals [1/sr], for `m` in the upper hemisphere.
    fn d(&self, m: Vec3) -> f32;

    /// The projected area σ(w), from either side.
    fn area(&self, w: Vec3) -> f32;

    /// A normal seen from `w`, which is in the upper hemisphere and sees this `area`, and what is left of `uc` for the next
    /// choice.
    ///
    /// Its density [1/sr] is D(m) ⟨w·m⟩ over the [`sampled_area`](Self::sampled_area).
    fn sample(&self, w: Vec3, area: f32, uc: f32, u: Vec2) -> (Vec3, f32);

    /// The area that the density of [`sample`](Self::sample) is over, given w·m > 0 and the projected area of `w`: that
    /// itself where visible normals are sampled.
    fn sampled_area(&self, w: Vec3, area: f32, o_m: f32, m: Vec3) -> f32;
}

/// Evaluates an expression with the distribution that there is: once for a whole sample or value, so that the common one
/// costs what it would cost alone.
macro_rules! by_distribution {
    ($microfacets:expr, $facets:ident => $value:expr) => {
        match $microfacets {
            Microfacets::Ggx($facets) => $value,
            Microfacets::Beckmann($facets) => $value,
            Microfacets::ShiftedGamma($facets) => $value,
        }
    };
}
pub(super) use by_distribution;

impl Microfacets {
    /// The projected area σ(w), from either side.
    pub fn area(&self, w: Vec3) -> f32 {
        by_distribution!(self, facets => facets.area(w))
    }

    /// The roughnesses α_x and α_y.
    pub fn alphas(&self) -> Vec2 {
        by_distribution!(self, facets => facets.alphas())
    }

    /// Whether the two roughnesses differ.
    pub fn is_anisotropic(&self) -> bool {
        let alphas = self.alphas();
        alphas.x != alphas.y
    }

    /// The density [1/area] of slopes over their roughness, given the square q of their length; ∫ … dq = 1/π.
    pub fn slopes(&self, q: f32) -> f32 {
        match self {
            Self::Ggx(_) => Ggx::slopes(q),
            Self::Beckmann(_) => Beckmann::slopes(q),
            Self::ShiftedGamma(sgd) => sgd.slopes(q),
        }
    }

    /// A typical length of slopes over their roughness.
    pub fn typical_slope(&self) -> f32 {
        match self {
            Self::Ggx(_) | Self::Beckmann(_) => 1.0,
            Self::ShiftedGamma(sgd) => sgd.quantile(0.3).sqrt(),
        }
    }
}

impl From<Ggx> for Microfacets {
    #[inline]
    fn from(ggx: Ggx) -> Self {
        Self::Ggx(ggx)
    }
}

impl From<Beckmann> for Microfacets {
    #[inline]
    fn from(beckmann: Beckmann) -> Self {
        Self::Beckmann(beckmann)
    }
}

impl From<ShiftedGamma> for Microfacets {
    #[inline]
    fn from(sgd: ShiftedGamma) -> Self {
        Self::ShiftedGamma(sgd)
    }
}

/// Whether an event of this probability happens by the uniform `uc`, and what is left of it: uniform, whatever happened.
#[inline]
pub(super) fn happens(probability: f32, uc: f32) -> (bool, f32) {
    let happened = uc < probability;
    // One division of what is chosen, which needs no branch.
    let (over, under) = if happened { (uc, probability) } else { (uc - probability, 1.0 - probability) };
    (happened, over / under)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::{uniform_hemisphere, uniform_hemisphere_pdf};
    use glam::{vec2, vec3};

    const SIDE: usize = 512;

    fn grid() -> impl Iterator<Item = Vec2> {
        (0..SIDE * SIDE).map(|i| (vec2((i % SIDE) as f32, (i / SIDE) as f32) + 0.5) / SIDE as f32)
    }

    fn d(facets: &Microfacets, m: Vec3) -> f32 {
        by_distribution!(facets, f => f.d(m))
    }

    fn sample(facets: &Microfacets, w: Vec3, uc: f32, u: Vec2) -> (Vec3, f32) {
        by_distribution!(facets, f => f.sample(w, f.area(w), uc, u))
    }

    fn all() -> Vec<Microfacets> {
        vec![
            Ggx::new(0.4, 0.8).into(),
            Beckmann::new(1.0, 1.0).into(),
            Beckmann::new(0.3, 0.6).into(),
            ShiftedGamma::new(0.3, 0.3, 1.0).into(),
            ShiftedGamma::new(1.0, 0.5, 0.3).into(),
            ShiftedGamma::new(0.7, 0.7, 3.0).into(),
        ]
    }

    fn directions() -> Vec<Vec3> {
        let angles = [(0.0, 0.0), (0.3, 0.7), (0.9, 0.0), (1.3, 1.571), (1.55, 0.7), (1.57, 0.2)];
        angles.map(|(t, p): (f32, f32)| vec3(t.sin() * p.cos(), t.sin() * p.sin(), t.cos())).to_vec()
    }

    #[test]
    fn the_projected_area_is_that_of_the_distribution() {
        for facets in all() {
            for w in directions() {
                let mut sums = [0.0_f64; 2];
                for u in grid() {
                    let m = uniform_hemisphere(u);
                    let d = d(&facets, m) / uniform_hemisphere_pdf();
                    sums[0] += f64::from(d * m.z);
                    sums[1] += f64::from(d * w.dot(m).max(0.0));
                }
                let [whole, area] = sums.map(|sum| sum / (SIDE * SIDE) as f64);
                assert!((whole - 1.0).abs() < 2e-3, "{facets:?}: {whole}");
                assert!((area / f64::from(facets.area(w)) - 1.0).abs() < 3e-3, "{facets:?} {w}: {area}");
            }
        }
    }

    #[test]
    fn sampled_normals_have_their_density() {
        // The mean of g over samples is ∫ g pdf, for a g that separates errors of shape.
        for facets in all() {
            for w in directions() {
                let (mut sampled, mut exact) = ([0.0_f64; 4], [0.0_f64; 4]);
                let area = facets.area(w);
                for (i, u) in grid().enumerate() {
                    // Low discrepancy in the third dimension, to keep the noise below the error that is looked for.
                    let uc = (i as f64 * 0.618_033_988_749_895).fract() as f32;
                    let (m, rest) = sample(&facets, w, uc, u);
                    assert!((0.0..=1.0).contains(&rest), "{facets:?} {w}: {rest}");
                    let n = uniform_hemisphere(u);
                    let o_n = w.dot(n);
                    let pdf = if o_n > 0.0 {
                        d(&facets, n) * o_n / by_distribution!(facets, f => f.sampled_area(w, area, o_n, n))
                    } else {
                        0.0
                    };
                    let g = |m: Vec3| [1.0, m.z, m.x, m.y * m.y];
                    for j in 0..4 {
                        sampled[j] += f64::from(g(m)[j]);
                        exact[j] += f64::from(g(n)[j] * pdf / uniform_hemisphere_pdf());
                    }
                }
                for (s, e) in sampled.iter().zip(exact) {
                    assert!((s - e).abs() / ((SIDE * SIDE) as f64) < 3e-3, "{facets:?} {w}: {s} {e}");
                }
            }
        }
    }

    #[test]
    fn extremes_stay_finite() {
        let edge = [0.0, 5.96e-8, 0.5, 1.0_f32.next_down()];
        let thin = Ggx::MIN_ALPHA;
        let extremes: [Microfacets; 6] = [
            Beckmann::new(thin, thin).into(),
            Beckmann::new(thin, 1.0).into(),
            ShiftedGamma::new(thin, thin, 0.0).into(),
            ShiftedGamma::new(thin, 1.0, 1.0).into(),
            ShiftedGamma::new(thin, thin, 4.0).into(),
            ShiftedGamma::new(1.0, 1.0, 4.0).into(),
        ];
        for facets in extremes {
            for z in [1.0_f32, 0.5, 1e-4, 1e-7, 1e-20] {
                for w in [vec3((1.0 - z * z).sqrt(), 0.0, z), vec3(0.0, -(1.0 - z * z).sqrt(), z)] {
                    let area = facets.area(w);
                    assert!(area.is_finite() && area > 0.0 && area >= 0.999 * z, "{facets:?} {w}: {area}");
                    for (ux, uy, uc) in edge.iter().flat_map(|x| edge.iter().flat_map(|y| edge.map(|c| (*x, *y, c)))) {
                        let (m, rest) = sample(&facets, w, uc, vec2(ux, uy));
                        let what = format!("{facets:?} {w} {ux} {uy} {uc}: {m} {rest}");
                        assert!((m.length() - 1.0).abs() < 1e-6 && m.z >= 0.0 && (0.0..=1.0).contains(&rest), "{what}");
                        assert!(d(&facets, m).is_finite() && d(&facets, m) > 0.0, "{what}");
                        assert!(w.dot(m) > -1e-6, "{what}");
                    }
                }
            }
        }
    }
}
