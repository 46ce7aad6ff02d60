//! The light that single scattering by microfacets loses, and a lobe that gives it back.
//!
//! After [Kulla17]: with the directional albedo E(μ) of a surface that absorbs nothing, the lobe
//! f(wo, wi) = (1 − E(μ_o)) (1 − E(μ_i)) / (π (1 − Ē)), Ē = 2 ∫ E(μ) μ dμ, is reciprocal, and its albedo is 1 − E(μ_o).

use super::fresnel::fresnel_dielectric;
use super::quadrature::integrate_towards_ends;
use super::{Masking, Microfacets, Recalled, Shared};
use crate::warp::{INV_PI, sin_cos_turns};
use glam::{Vec2, Vec3, vec3};
use std::f64::consts::PI;

/// How many pieces the table has.
const CELLS: usize = 256;

/// The share 1 − E(μ) of light that isotropic microfacets lose, by the cosine μ of its direction, in linear pieces.
///
/// Pieces are equal in t = (μ + √(μ (1 + a)/(μ + a))) / 2: half of them for all cosines alike, half for those of about the
/// roughness a and below.
#[derive(Debug)]
pub struct MissingEnergy {
    a: f32,
    /// The cosines between the pieces.
    cosines: [f32; CELLS + 1],
    missing: [f32; CELLS + 1],
    average: f32,
    /// Of directions whose density is 1 − E times the cosine: the share of those below each piece.
    cumulative: [f32; CELLS + 1],
    /// That of each piece, over the difference of μ² across it.
    density: [f32; CELLS],
}

static TABLES: Recalled<5, MissingEnergy> = Recalled::new();

/// The least that is held to be missing, far below the error of the table: it keeps averages from 0.
const LEAST: f64 = 1e-9;

impl MissingEnergy {
    /// What isotropic facets lose that reflect all light.
    pub fn of_mirrors(facets: &Microfacets, masking: Masking) -> Shared<Self> {
        Self::shared(facets, masking, None)
    }

    /// What isotropic facets lose that reflect and refract, when the light comes from the side whose other side has the
    /// index `eta` relative to it.
    pub fn of_interfaces(facets: &Microfacets, masking: Masking, eta: f32) -> Shared<Self> {
        Self::shared(facets, masking, Some(eta))
    }

    fn shared(facets: &Microfacets, masking: Masking, eta: Option<f32>) -> Shared<Self> {
        debug_assert!(!facets.is_anisotropic());
        let (kind, gamma) = match facets {
            Microfacets::Ggx(_) => (0.0, 0.0),
            Microfacets::Beckmann(_) => (1.0, 0.0),
            Microfacets::ShiftedGamma(sgd) => (2.0, sgd.gamma()),
        };
        let hiding = match masking {
            Masking::Correlated => 0.0,
            Masking::Separable => 1.0,
            Masking::CorrelatedThroughout => 2.0,
        };
        let key = [kind, facets.alphas().x, gamma, hiding, eta.unwrap_or(0.0)];
        TABLES.get(key, || Self::new(facets, masking, eta))
    }

    fn new(facets: &Microfacets, masking: Masking, eta: Option<f32>) -> Self {
        let a = facets.alphas().x * facets.typical_slope();
        let cosines: [f64; CELLS + 1] = std::array::from_fn(|i| cosine(i as f64 / CELLS as f64, f64::from(a)));
        let missing = cosines.map(|cos| (1.0 - Albedo::new(facets, masking, eta, cos.max(1e-7)).integral()).max(LEAST));
        // 2 ∫ (1 − E) μ dμ over each piece.
        let mass: [f64; CELLS] = std::array::from_fn(|i| {
            let (low, high) = (cosines[i], cosines[i + 1]);
            let mean = |from: f64, to: f64| (missing[i] * from + missing[i + 1] * to) / (from + to);
            (high - low) * (low * mean(2.0, 1.0) + high * mean(1.0, 2.0))
        });
        let average: f64 = mass.iter().sum();
        let below = |i: usize| mass[..i].iter().sum::<f64>() / average;
        let difference = |i: usize| (cosines[i + 1] - cosines[i]) * (cosines[i + 1] + cosines[i]);
        Self {
            a,
            cosines: cosines.map(|cos| cos as f32),
            missing: missing.map(|share| share as f32),
            average: average as f32,
            cumulative: std::array::from_fn(|i| below(i) as f32),
            density: std::array::from_fn(|i| (mass[i] / (average * difference(i))) as f32),
        }
    }

    /// The piece that a cosine is in.
    #[inline]
    fn find(&self, cos: f32) -> usize {
        let t = 0.5 * (cos + (cos * (1.0 + self.a) / (cos + self.a)).sqrt());
        ((t * CELLS as f32) as i32 as usize).min(CELLS - 1)
    }

    /// 1 − E.
    #[inline]
    pub fn at(&self, cos: f32) -> f32 {
        let i = self.find(cos);
        let (low, high) = (self.cosines[i], self.cosines[i + 1]);
        self.missing[i] + (cos - low) / (high - low) * (self.missing[i + 1] - self.missing[i])
    }

    /// 1 − Ē, the integral of [`at`](Self::at) over directions with the density cos θ / π.
    #[inline]
    pub fn average(&self) -> f32 {
        self.average
    }

    /// A direction of the upper hemisphere with a density near (1 − E) cos θ / (π (1 − Ē)).
    #[inline]
    pub fn sample(&self, u: Vec2) -> Vec3 {
        let i = (self.cumulative.partition_point(|share| *share <= u.x).max(1) - 1).min(CELLS - 1);
        let s = (u.x - self.cumulative[i]) / (self.cumulative[i + 1] - self.cumulative[i]).max(f32::MIN_POSITIVE);
        let (low, high) = (self.cosines[i], self.cosines[i + 1]);
        let cos2 = (low * low + s.min(1.0) * (high * high - low * low)).min(1.0);
        let sin = (1.0 - cos2).sqrt();
        let (sin_phi, cos_phi) = sin_cos_turns(u.y);
        vec3(sin * cos_phi, sin * sin_phi, cos2.sqrt())
    }

    /// The density [1/sr] of [`sample`](Self::sample).
    #[inline]
    pub fn pdf(&self, cos: f32) -> f32 {
        self.density[self.find(cos)] * cos * INV_PI
    }
}

/// The cosine whose t, as [`MissingEnergy`] has it, is this; by bisection.
fn cosine(t: f64, a: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let cos = 0.5 * (low + high);
        let is_below = 0.5 * (cos + (cos * (1.0 + a) / (cos + a)).sqrt()) < t;
        (low, high) = if is_below { (cos, high) } else { (low, cos) };
    }
    if t < 1.0 { low } else { 1.0 }
}

/// The directional albedo of isotropic microfacets, as an integral over the slopes of those that the light meets.
struct Albedo<'f> {
    facets: &'f Microfacets,
    masking: Masking,
    eta: Option<f32>,
    /// Of the light: it comes from (sin, 0, cos).
    sin: f64,
    cos: f64,
    area: f64,
    alpha: f64,
    /// α times a typical slope.
    width: f64,
}

impl<'f> Albedo<'f> {
    fn new(facets: &'f Microfacets, masking: Masking, eta: Option<f32>, cos: f64) -> Self {
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let area = f64::from(facets.area(vec3(sin as f32, 0.0, cos as f32)));
        let alpha = f64::from(facets.alphas().x);
        Self { facets, masking, eta, sin, cos, area, alpha, width: alpha * f64::from(facets.typical_slope()) }
    }

    /// ∫ of D(m) cos θ_m dm, times what a facet scatters of the light.
    fn integral(&self) -> f64 {
        let mut ends = vec![0.0, 0.5 * PI, PI];
        if let Some(c2) = self.critical() {
            // Beyond these azimuths no slope, or every one, is met at more than the critical angle.
            let edge = ((c2 - self.cos * self.cos).max(0.0).sqrt() / self.sin).min(1.0).acos();
            ends.extend([edge, PI - edge]);
        }
        ends.sort_unstable_by(f64::total_cmp);
        let between = |ends: &[f64]| integrate_towards_ends(ends[0], ends[1], 6, |phi| self.over_slopes(phi));
        2.0 * ends.windows(2).map(between).sum::<f64>()
    }

    /// The square of the cosine of the critical angle; `None` where nothing is reflected totally.
    fn critical(&self) -> Option<f64> {
        self.eta.filter(|eta| *eta < 1.0).map(|eta| 1.0 - f64::from(eta * eta))
    }

    /// The integral over slopes r of this azimuth. Its steps in ln r are even beyond the width, and small towards whatever
    /// the integrand has a kink at.
    fn over_slopes(&self, phi: f64) -> f64 {
        let along = self.sin * phi.cos();
        // Slopes that mirror above the horizon have cos r² − 2 along r − cos < 0; those that are seen, cos + along r > 0.
        let root = along.hypot(self.cos);
        let mirroring = if along > 0.0 { (along + root) / self.cos } else { self.cos / (root - along) };
        let seen = if along < 0.0 { -self.cos / along } else { f64::INFINITY };
        let mut kinks = vec![0.0, mirroring];
        if self.eta.is_some() {
            kinks.push(seen);
        }
        if let Some(c2) = self.critical() {
            // Total reflection begins where (cos + along r)² = c² (1 + r²), with the cosine c of the critical angle.
            let (a, b, c) = (along * along - c2, self.cos * along, self.cos * self.cos - c2);
            let root = (b * b - a * c).sqrt();
            kinks.extend([(-b - root) / a, (-b + root) / a].into_iter().filter(|r| *r > 0.0 && *r < seen));
        }
        let mut ends: Vec<f64> = kinks.into_iter().map(|r| (r / self.width).min(1e5).asinh()).collect();
        ends.sort_unstable_by(f64::total_cmp);
        let over = |y: f64| self.width * y.cosh() * self.scattered(phi, self.width * y.sinh());
        ends.windows(2).map(|ends| integrate_towards_ends(ends[0], ends[1], 12, over)).sum()
    }

    /// What facets of this slope, per difference of its length r and azimuth, scatter of the light.
    fn scattered(&self, phi: f64, r: f64) -> f64 {
        // Slopes over α have the density `slopes` per area.
        let density = f64::from(self.facets.slopes((r / self.alpha).powi(2) as f32)) * r / (self.alpha * self.alpha);
        let m_z = 1.0 / (1.0 + r * r).sqrt();
        let (m_x, m_y) = (r * phi.cos() * m_z, r * phi.sin() * m_z);
        let o_m = self.sin * m_x + self.cos * m_z;
        if o_m <= 0.0 {
            return 0.0;
        }
        let leaving = |along_m: f64, along_o: f64| {
            [along_m * m_x - along_o * self.sin, along_m * m_y, along_m * m_z - along_o * self.cos]
        };
        let area_of = |w: [f64; 3]| f64::from(self.facets.area(vec3(w[0] as f32, w[1] as f32, w[2] as f32)));
        let (reflected, refracted) = match self.eta {
            None => (1.0, None),
            Some(eta) => {
                let shares = fresnel_dielectric(o_m as f32, eta);
                (
                    f64::from(shares.reflected),
                    Some((f64::from(shares.transmitted), f64::from(shares.cos_t), f64::from(eta))),
                )
            }
        };
        // As `Masking::joint_area` and the other.
        let together = |cos_i: f64, area_i: f64| self.area * cos_i + (area_i - cos_i) * self.cos;
        let mut sum = 0.0;
        let wi = leaving(2.0 * o_m, 1.0);
        if wi[2] > 0.0 {
            let area_i = area_of(wi);
            let joint = match self.masking {
                Masking::Separable => self.area * area_i,
                Masking::Correlated | Masking::CorrelatedThroughout => together(wi[2], area_i),
            };
            sum += reflected * wi[2] / joint;
        }
        if let Some((transmitted, i_m, eta)) = refracted {
            let wi = leaving(o_m / eta - i_m, 1.0 / eta);
            if transmitted > 0.0 && wi[2] < 0.0 {
                let area_i = area_of(wi);
                let joint = match self.masking {
                    Masking::CorrelatedThroughout => together(-wi[2], area_i),
                    Masking::Correlated | Masking::Separable => self.area * area_i,
                };
                sum += transmitted * -wi[2] / joint;
            }
        }
        density * sum * o_m / m_z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::microfacets::{Distribution, by_distribution};
    use crate::bsdf::{Beckmann, Ggx, ShiftedGamma};
    use glam::vec2;

    #[test]
    fn albedos_agree_with_sampling() {
        const SIDE: usize = 512;
        let all: [(Microfacets, Masking); 6] = [
            (Ggx::new(0.1, 0.1).into(), Masking::Correlated),
            (Ggx::new(1.0, 1.0).into(), Masking::Correlated),
            (Ggx::new(0.4, 0.4).into(), Masking::Separable),
            (Beckmann::new(0.5, 0.5).into(), Masking::Correlated),
            (Beckmann::new(0.5, 0.5).into(), Masking::Separable),
            (ShiftedGamma::new(0.2, 0.2, 1.0).into(), Masking::Correlated),
        ];
        for (facets, masking) in all {
            let table = MissingEnergy::of_mirrors(&facets, masking);
            for cos in [1.0_f32, 0.7, 0.3, 0.05] {
                let w = vec3((1.0 - cos * cos).sqrt(), 0.0, cos);
                let area = facets.area(w);
                let mut sum = 0.0_f64;
                for i in 0..SIDE * SIDE {
                    let u = (vec2((i % SIDE) as f32, (i / SIDE) as f32) + 0.5) / SIDE as f32;
                    let uc = (i as f64 * 0.618_033_988_749_895).fract() as f32;
                    let (m, _) = by_distribution!(facets, f => f.sample(w, area, uc, u));
                    let o_m = w.dot(m);
                    let wi = crate::math::reflect(w, m);
                    if wi.z > 0.0 {
                        let sampled = by_distribution!(facets, f => f.sampled_area(w, area, o_m, m));
                        let joint = masking.joint_area(cos, area, wi.z, facets.area(wi));
                        sum += f64::from(wi.z * sampled / joint);
                    }
                }
                let missing = 1.0 - sum / (SIDE * SIDE) as f64;
                assert!(
                    (missing - f64::from(table.at(cos))).abs() < 2e-4,
                    "{facets:?} {masking:?} {cos}: {missing} {}",
                    table.at(cos)
                );
            }
        }
    }

    #[test]
    fn tables_of_other_tails_are_others() {
        let of_gamma =
            |gamma| MissingEnergy::of_mirrors(&ShiftedGamma::new(0.3, 0.3, gamma).into(), Masking::default());
        assert_ne!(of_gamma(0.5).average(), of_gamma(2.0).average());
    }

    #[test]
    fn the_lobe_is_normalised_and_sampled_by_its_density() {
        for alpha in [0.01, 0.1, 1.0] {
            let table = MissingEnergy::of_mirrors(&Ggx::new(alpha, alpha).into(), Masking::default());
            let cosines = |i: usize| (i as f32 + 0.5) / 20_000.0;
            let sum = |f: &dyn Fn(f32) -> f32| (0..20_000).map(|i| f64::from(f(cosines(i)))).sum::<f64>() / 20_000.0;
            let average = sum(&|cos| 2.0 * cos * table.at(cos));
            assert!((average / f64::from(table.average()) - 1.0).abs() < 1e-3, "{alpha}: {average}");
            assert!((sum(&|cos| std::f32::consts::TAU * table.pdf(cos)) - 1.0).abs() < 1e-3, "{alpha}");
            let mean = sum(&|cos| std::f32::consts::TAU * table.pdf(cos) * cos);
            let sampled = sum(&|u| table.sample(vec2(u, 0.3)).z);
            assert!((mean - sampled).abs() < 1e-3, "{alpha}: {mean} {sampled}");
        }
    }
}
