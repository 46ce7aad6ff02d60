//! What a rough coat lets through: its facets, and tables of their transmittance.

use crate::bsdf::microfacets::{Distribution, by_distribution};
use crate::bsdf::table::Recalled;
use crate::bsdf::{Beckmann, Ggx, Masking, Microfacets, Parameter, Shared, fresnel_dielectric};
use crate::math::reflect;
use glam::{DVec2, DVec3, Vec3, Vec4, vec2, vec3};

/// A rough interface above a base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    /// Its index in (1, 10] over that outside.
    pub eta: f32,
    /// Its facets: GGX's or Beckmann's, of one roughness all round, at most 1.
    pub facets: Microfacets,
    /// How they hide one another.
    pub masking: Masking,
    /// What becomes of light that they scatter to one another.
    pub strays: Strays,
}

/// What becomes of light that the facets of a coat scatter to one another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strays {
    /// It enters the coat: T(w) = 1 − E(w), with the share E that facets reflect once. No light is lost.
    Enter,
    /// It is lost: T(w) is what facets refract once, into directions that they don't hide \[Walter07, (21)\].
    Lost,
}

impl Parameter {
    /// What becomes of light that the facets of a coat scatter to one another.
    pub const STRAYS: Self = Self::choice(
        "strays",
        "light that facets scatter to one another enters the coat, or is lost",
        &["enter", "lost"],
    );
}

impl Coat {
    /// The share E(w) of light at this cosine that the facets reflect once, as seen from within the coat.
    ///
    /// With the medium of index η on this side; total reflection is part of it.
    pub fn reflectance_within(&self, cos: f32) -> f32 {
        let inside = Self { eta: 1.0 / self.eta, strays: Strays::Enter, ..*self };
        1.0 - inside.let_in(cos, 4096).iter().sum::<f32>()
    }

    /// The largest share of the base's light that the coat may send back: what doesn't leave, 1 − T̄ / η².
    pub fn most_sent_back(&self) -> f32 {
        let axis = alpha_axis(self.facets.alphas().x);
        1.0 - Transmittances::of(self).mean_at(axis) / (self.eta * self.eta)
    }

    /// The same of another roughness.
    fn of_width(&self, alpha: f32) -> Self {
        let facets = match self.facets {
            Microfacets::Ggx(_) => Ggx::new(alpha, alpha).into(),
            _ => Beckmann::new(alpha, alpha).into(),
        };
        Self { facets, ..*self }
    }

    /// Of light that comes at this cosine, what facets that mirror would lose, where it enters, and what dielectric ones let in:
    /// means over visible normals, of which this many lie on a lattice. Their sum is T.
    fn let_in(&self, cos: f32, nodes: u32) -> [f32; 2] {
        by_distribution!(&self.facets, facets => self.let_in_by(facets, cos, nodes))
    }

    fn let_in_by(&self, facets: &impl Distribution, cos: f32, nodes: u32) -> [f32; 2] {
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let wo = vec3(((1.0 - cos) * (1.0 + cos)).sqrt(), 0.0, cos);
        // Normals are GGX's, which two numbers give without a choice between lobes; of other facets each weighs what it should.
        let alphas = self.facets.alphas();
        let ggx = Ggx::new(alphas.x, alphas.y);
        let (area_o, area_ggx) = (facets.area(wo), Distribution::area(&ggx, wo));
        let parts = |i: u32| {
            // The steep normals, at u.y near 1, are few but decide the loss.
            let left = 1.0 - (i as f32 + 0.5) / nodes as f32;
            let u = vec2((f64::from(i) * GOLDEN).fract() as f32, (1.0 - left.powi(3)).min(1.0_f32.next_down()));
            let m = ggx.sample_visible(wo, u);
            let weight = 3.0 * left * left * (facets.d(m) / ggx.d(m)) * (area_ggx / area_o);
            (self.by_facet(facets, wo, area_o, m) * f64::from(weight)).extend(f64::from(weight))
        };
        let sum: DVec3 = (0..nodes).map(parts).sum();
        (sum.truncate() / sum.z).as_vec2().to_array()
    }

    /// The same of one facet.
    fn by_facet(&self, facets: &impl Distribution, wo: Vec3, area_o: f32, m: Vec3) -> DVec2 {
        let o_m = wo.dot(m);
        if self.strays == Strays::Lost {
            let fresnel = fresnel_dielectric(o_m.clamp(f32::MIN_POSITIVE, 1.0), self.eta);
            let wi = (o_m / self.eta - fresnel.cos_t) * m - wo / self.eta;
            let is_open = o_m > 0.0 && wi.z < 0.0;
            // G₁ of the refracted direction; that of wo is in the density of visible normals.
            return if is_open {
                DVec2::Y * f64::from(fresnel.transmitted * -wi.z / facets.area(wi))
            } else {
                DVec2::ZERO
            };
        }
        let wi = reflect(wo, m);
        if wi.z <= 0.0 || o_m <= 0.0 {
            return DVec2::X;
        }
        let area_i = facets.area(wi);
        // 1 − G₂ / G₁(wo), without cancellation.
        let hidden = match self.masking {
            Masking::Correlated | Masking::CorrelatedThroughout => {
                wo.z * (area_i - wi.z) / self.masking.joint_area(wo.z, area_o, wi.z, area_i)
            }
            Masking::Separable => (area_i - wi.z) / area_i,
        };
        let passed = fresnel_dielectric(o_m.min(1.0), self.eta).transmitted;
        vec2(hidden, (1.0 - hidden) * passed).as_dvec2()
    }
}

/// A place in a list of equally distant entries: the cubic through the four about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    first: u32,
    weights: [f32; 4],
}

impl Place {
    /// The place `x` in [0, 1].
    #[inline]
    pub(super) fn among(entries: usize, x: f32) -> Self {
        let x = x * (entries - 1) as f32;
        // Of x ≥ 0; this conversion is the cheapest.
        let first = (x as i32 - 1).clamp(0, entries as i32 - 4);
        let t = x - first as f32;
        let (t1, t2, t3) = (t - 1.0, t - 2.0, t - 3.0);
        // Lagrange's polynomials of the nodes 0, 1, 2, 3.
        let weights = [t1 * t2 * t3 / -6.0, t * t2 * t3 / 2.0, t * t1 * t3 / -2.0, t * t1 * t2 / 6.0];
        Self { first: first as u32, weights }
    }

    /// The mean of the four entries.
    #[inline]
    fn of(self, list: &[f32]) -> f32 {
        self.weights.iter().zip(&list[self.first as usize..]).map(|(weight, entry)| weight * entry).sum()
    }
}

/// T(w) of rough interfaces of one index, by α and angle.
pub(super) struct Transmittances {
    /// By [`angle`], then by α, the two parts of T: what mirroring facets would lose by meeting it more than once; and what
    /// they let in, over T of a smooth interface at the cosine s(w).
    parts: [[[f32; 2]; Self::ALPHAS]; Self::ANGLES],
    /// T̄, by α.
    means: [f32; Self::MEANS],
}

static TABLES: Recalled<2, Transmittances> = Recalled::new();

/// The axis of angles, cos θ (1 + α) / (cos θ + α): T changes where the cosine is near α, and this resolves it for every α.
#[inline]
fn angle(cos: f32, alpha: f32) -> f32 {
    (cos * (1.0 + alpha) / (cos + alpha)).sqrt().min(1.0)
}

/// The axis of α, from 0 at [`Ggx::MIN_ALPHA`] to 1 at 1.
#[inline]
pub(super) fn alpha_axis(alpha: f32) -> f32 {
    (alpha.sqrt().sqrt() - LEAST_ROOT) / (1.0 - LEAST_ROOT)
}

/// The fourth root of [`Ggx::MIN_ALPHA`].
const LEAST_ROOT: f32 = 0.1;

impl Transmittances {
    pub(super) const ALPHAS: usize = 17;
    const ANGLES: usize = 49;
    const MEANS: usize = 65;

    /// What T is less than it should be, so that the table's error creates no energy; the smallest T is eight times as much.
    const MARGIN: f32 = 5e-4;

    /// Those of coats that differ from this one by their roughness alone.
    pub(super) fn of(coat: &Coat) -> Shared<Self> {
        let kind = match coat.facets {
            Microfacets::Ggx(_) => 0.0,
            _ => 4.0,
        } + match (coat.strays, coat.masking) {
            (Strays::Enter, Masking::Correlated | Masking::CorrelatedThroughout) => 0.0,
            (Strays::Enter, Masking::Separable) => 1.0,
            (Strays::Lost, _) => 2.0,
        };
        TABLES.get([coat.eta, kind], || Self::new(coat))
    }

    fn new(coat: &Coat) -> Self {
        let eta = coat.eta;
        let alpha_at = |i: usize, n: usize| (LEAST_ROOT + (1.0 - LEAST_ROOT) * i as f32 / (n - 1) as f32).powi(4);
        let parts = std::array::from_fn(|row| {
            let x = (row as f32 / (Self::ANGLES - 1) as f32).powi(2);
            std::array::from_fn(|column| {
                let alpha = alpha_at(column, Self::ALPHAS);
                // The inverse of the axis.
                let cos = (alpha * x / (1.0 + alpha - x)).min(1.0);
                let [lost, let_in] = coat.of_width(alpha).let_in(cos, 1024);
                let (scale, ratio) = (1.0 - Self::MARGIN, let_in / smooth(eta, alpha, cos));
                let lost = if coat.strays == Strays::Lost { 0.0 } else { scale * lost - Self::MARGIN };
                [lost, scale * ratio]
            })
        });
        let mut table = Self { parts, means: [0.0; Self::MEANS] };
        table.means = std::array::from_fn(|i| table.mean(eta, alpha_at(i, Self::MEANS)));
        table
    }

    /// T, at the place of α.
    #[inline]
    pub(super) fn at(&self, eta: f32, alpha: f32, column: Place, cos: f32) -> f32 {
        let row = Place::among(Self::ANGLES, angle(cos, alpha));
        let [a, b, c, d] = column.weights;
        let (first, last) = (Vec4::new(a, a, b, b), Vec4::new(c, c, d, d));
        let mut sum = Vec4::ZERO;
        for (weight, parts) in row.weights.into_iter().zip(&self.parts[row.first as usize..]) {
            // Both parts at two α in four lanes.
            let parts = parts[column.first as usize..][..4].as_flattened();
            sum += weight * (first * Vec4::from_slice(&parts[..4]) + last * Vec4::from_slice(&parts[4..]));
        }
        (sum.x + sum.z) + (sum.y + sum.w) * smooth(eta, alpha, cos)
    }

    /// T̄, at this place on the axis of α.
    pub(super) fn mean_at(&self, axis: f32) -> f32 {
        Place::among(Self::MEANS, axis).of(&self.means)
    }

    /// ∫ T 2 cos d cos of the table's own T.
    fn mean(&self, eta: f32, alpha: f32) -> f32 {
        const NODES: u32 = 512;
        let column = Place::among(Self::ALPHAS, alpha_axis(alpha));
        // The nodes are dense where the cosine is small.
        let node = |i: u32| (f64::from(i) + 0.5) / f64::from(NODES);
        let sum: f64 = (0..NODES)
            .map(|i| 4.0 * node(i).powi(3) * f64::from(self.at(eta, alpha, column, node(i).powi(2) as f32)))
            .sum();
        (sum / f64::from(NODES)) as f32
    }
}

/// T of a smooth interface at the span of a direction, which is nowhere below α.
#[inline]
fn smooth(eta: f32, alpha: f32, cos: f32) -> f32 {
    let span2 = alpha * alpha * (1.0 - cos) * (1.0 + cos) + cos * cos;
    fresnel_dielectric(span2.sqrt().min(1.0), eta).transmitted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::diffuse_transmittance;

    /// Every kind of coat of this index and roughness.
    fn coats(eta: f32, alpha: f32) -> Vec<Coat> {
        let facets: [Microfacets; 2] = [Ggx::new(alpha, alpha).into(), Beckmann::new(alpha, alpha).into()];
        let kinds = [
            (Masking::Correlated, Strays::Enter),
            (Masking::Separable, Strays::Enter),
            (Masking::Separable, Strays::Lost),
        ];
        let of = |facets| kinds.map(|(masking, strays)| Coat { eta, facets, masking, strays });
        facets.into_iter().flat_map(of).collect()
    }

    #[test]
    fn the_table_creates_no_energy_and_loses_little() {
        let alphas = [2e-4, 3e-4, 1e-3, 0.003, 0.01, 0.02, 0.03, 0.05, 0.1, 0.15, 0.21, 0.3, 0.4, 0.5, 0.7, 0.83, 1.0];
        let mut worst = (0.0_f32, 0.0_f32);
        for (eta, alpha) in [1.01, 1.33, 1.5, 2.4, 10.0].into_iter().flat_map(|eta| alphas.map(|alpha| (eta, alpha))) {
            for coat in coats(eta, alpha) {
                let table = Transmittances::of(&coat);
                let column = Place::among(Transmittances::ALPHAS, alpha_axis(alpha));
                for cos in (0..16).map(|i| ((i as f32 + 0.5) / 16.0).powi(3)) {
                    for cos in [cos, (cos * alpha * 4.0).min(1.0)] {
                        let exact: f32 = coat.let_in(cos, 4096).iter().sum();
                        let stored = table.at(eta, alpha, column, cos);
                        // No more enters than is not reflected; of what is lost there is none to create energy with.
                        let most = match coat.strays {
                            Strays::Enter => exact,
                            Strays::Lost => Coat { strays: Strays::Enter, ..coat }.let_in(cos, 4096).iter().sum(),
                        };
                        worst = (worst.0.max(stored - most), worst.1.max(exact - stored));
                        let what = format!("{coat:?} {cos}: {stored} for {exact}");
                        assert!(stored > 0.0 && stored <= 1.0, "{what}");
                        assert!(stored - most < 1e-4 && (exact - stored).abs() < 3e-3, "{what}");
                    }
                }
            }
        }
        println!("{worst:?}");
    }

    #[test]
    fn a_smooth_coat_is_that_of_plastic() {
        for coat in [1.01, 1.5, 2.4].into_iter().flat_map(|eta| coats(eta, 2e-4)) {
            let mean = Transmittances::of(&coat).mean_at(alpha_axis(2e-4));
            assert!((mean - diffuse_transmittance(coat.eta)).abs() < 2e-3, "{coat:?}: {mean}");
            let sent_back = 1.0 - mean / (coat.eta * coat.eta);
            const NODES: u32 = 2000;
            let node = |i: u32| (f64::from(i) + 0.5) / f64::from(NODES);
            let within = |i: u32| 2.0 * node(i) * f64::from(coat.reflectance_within(node(i) as f32));
            let reflected = (0..NODES).map(within).sum::<f64>() / f64::from(NODES);
            assert!((reflected - f64::from(sent_back)).abs() < 3e-3, "{coat:?}: {reflected} {sent_back}");
        }
    }
}
