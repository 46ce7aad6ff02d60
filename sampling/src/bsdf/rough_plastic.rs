//! A rough clear coat over a diffuse base.

use super::fresnel::fresnel_dielectric;
use super::half::Half;
use super::plastic::Base;
use super::roughness::alphas;
use super::{
    Argument, Arguments, Bsdf, BsdfModel, BsdfSample, Ggx, Lambert, Lobes, Misfit, Parameter, Plastic, Preset,
    Recalled, Shared, TransportMode,
};
use crate::math::{Spectrum, reflect, same_hemisphere};
use crate::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use glam::{DVec2, Vec2, Vec3, Vec4, vec2, vec3};

/// f_s = F D G₂ / (4 |cos θ_o| |cos θ_i|) + T(o) T(i) ρ / (π η² (1 − ρ F̄)): a coat of GGX facets `[Walter07]` over a diffuse
/// base, joined as in [`Plastic`](super::Plastic).
///
/// T(w) = 1 − E(w) is what the facets don't reflect of the light from w, in the manner of `[Ashikhmin00]`, tabulated; T̄ is
/// its mean over the hemisphere, F̄ = 1 − T̄ / η². The facets reflect once: what they would reflect among themselves goes to the
/// base with the light that they let in. T is taken a thousandth too small, so that the table's error creates no energy: this is
/// lost where the base is white. A table belongs to an index and is made where that index is first met; an index that varies
/// over a surface would make many.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughPlastic {
    eta: f32,
    alpha: f32,
    ggx: Ggx,
    base: Base,
    survival: f32,
    /// The place of α among the columns of the table.
    column: Place,
    table: Shared<Transmittances>,
}

/// A place in a list of equally distant entries: the cubic through the four about it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Place {
    first: u32,
    weights: [f32; 4],
}

impl Place {
    /// The place `x` in [0, 1].
    #[inline]
    fn among(entries: usize, x: f32) -> Self {
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
struct Transmittances {
    /// By [`angle`], then by α, the two parts of T: what mirroring facets would lose by meeting it more than once; and what
    /// they let in, over T of a smooth interface at the cosine s(w).
    parts: [[[f32; 2]; Self::ALPHAS]; Self::ANGLES],
    /// T̄, by α.
    means: [f32; Self::MEANS],
}

static TABLES: Recalled<1, Transmittances> = Recalled::new();

/// The axis of angles, cos θ (1 + α) / (cos θ + α): T changes where the cosine is near α, and this resolves it for every α.
#[inline]
fn angle(cos: f32, alpha: f32) -> f32 {
    (cos * (1.0 + alpha) / (cos + alpha)).sqrt().min(1.0)
}

/// The axis of α, from 0 at [`Ggx::MIN_ALPHA`] to 1 at 1.
#[inline]
fn alpha_axis(alpha: f32) -> f32 {
    (alpha.sqrt().sqrt() - LEAST_ROOT) / (1.0 - LEAST_ROOT)
}

/// The fourth root of [`Ggx::MIN_ALPHA`].
const LEAST_ROOT: f32 = 0.1;

impl Transmittances {
    const ALPHAS: usize = 17;
    const ANGLES: usize = 25;
    const MEANS: usize = 65;

    /// What T is less than it should be, so that the table's error creates no energy; the smallest T is eight times as much.
    const MARGIN: f32 = 5e-4;

    fn of(eta: f32) -> Shared<Self> {
        TABLES.get([eta], || Self::new(eta))
    }

    fn new(eta: f32) -> Self {
        let alpha_at = |i: usize, n: usize| (LEAST_ROOT + (1.0 - LEAST_ROOT) * i as f32 / (n - 1) as f32).powi(4);
        let parts = std::array::from_fn(|row| {
            let x = (row as f32 / (Self::ANGLES - 1) as f32).powi(2);
            std::array::from_fn(|column| {
                let alpha = alpha_at(column, Self::ALPHAS);
                // The inverse of the axis.
                let cos = (alpha * x / (1.0 + alpha - x)).min(1.0);
                let [lost, let_in] = facets(eta, alpha, cos, 1024);
                let (scale, ratio) = (1.0 - Self::MARGIN, let_in / smooth(eta, alpha, cos));
                [scale * lost - Self::MARGIN, scale * ratio]
            })
        });
        let mut table = Self { parts, means: [0.0; Self::MEANS] };
        table.means = std::array::from_fn(|i| table.mean(eta, alpha_at(i, Self::MEANS)));
        table
    }

    /// T, at the place of α.
    #[inline]
    fn at(&self, eta: f32, alpha: f32, column: Place, cos: f32) -> f32 {
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

/// Of light that comes at this cosine, what facets that mirror would lose, and what dielectric ones let in: means over visible
/// normals, of which this many lie on a lattice. Their sum is 1 − E.
fn facets(eta: f32, alpha: f32, cos: f32, nodes: u32) -> [f32; 2] {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let ggx = Ggx::new(alpha, alpha);
    let wo = vec3(((1.0 - cos) * (1.0 + cos)).sqrt(), 0.0, cos);
    let parts = |i: u32| {
        // The steep normals, at u.y near 1, are few but decide the loss.
        let left = 1.0 - (i as f32 + 0.5) / nodes as f32;
        let u = vec2((f64::from(i) * GOLDEN).fract() as f32, (1.0 - left.powi(3)).min(1.0_f32.next_down()));
        let weight = f64::from(3.0 * left * left);
        let m = ggx.sample_visible(wo, u);
        let (o_m, wi) = (wo.dot(m), reflect(wo, m));
        if wi.z <= 0.0 || o_m <= 0.0 {
            return DVec2::X * weight;
        }
        let (span_o, span_i) = (ggx.span(wo), ggx.span(wi));
        // 1 − G₂ / G₁(wo), without cancellation.
        let lost = wo.z * (span_i - wi.z) / (span_o * wi.z + span_i * wo.z);
        vec2(lost, (1.0 - lost) * fresnel_dielectric(o_m.min(1.0), eta).transmitted).as_dvec2() * weight
    };
    ((0..nodes).map(parts).sum::<DVec2>() / f64::from(nodes)).as_vec2().to_array()
}

impl RoughPlastic {
    /// A base of this albedo in [0, 1] under a coat of index `eta` in (1, 10] relative to the medium around it, of roughness α in
    /// [[`Ggx::MIN_ALPHA`], 1].
    pub fn new(albedo: Spectrum, eta: f32, alpha: f32) -> Self {
        let table = Transmittances::of(eta);
        let axis = alpha_axis(alpha);
        let mean = Place::among(Transmittances::MEANS, axis).of(&table.means);
        let column = Place::among(Transmittances::ALPHAS, axis);
        let base = Base::new(albedo, eta, mean);
        let survival = (1.0 - mean + base.share(mean)).min(1.0);
        Self { eta, alpha, ggx: Ggx::new(alpha, alpha), base, survival, column, table }
    }

    #[inline]
    fn transmittance(&self, w: Vec3) -> f32 {
        self.table.at(self.eta, self.alpha, self.column, w.z.abs())
    }

    /// The probability of the coat's lobe: its share of what is reflected.
    #[inline]
    fn coat_pmf(&self, t_o: f32) -> f32 {
        (1.0 - t_o) / (1.0 - t_o + self.base.share(t_o))
    }

    /// The values of the coat and of the base, and the density, for directions of one side with the half vector `m`, and T(wo).
    #[inline]
    fn at(&self, wo: Vec3, wi: Vec3, t_o: f32, m: Vec3, o_m: f32) -> (Spectrum, Spectrum, f32) {
        let (cos_o, cos_i) = (wo.z.abs(), wi.z.abs());
        let (span_o, span_i) = (self.ggx.span(wo), self.ggx.span(wi));
        let d = self.ggx.d(m);
        let coat = fresnel_dielectric(o_m.min(1.0), self.eta).reflected * (0.5 * d / (span_o * cos_i + span_i * cos_o));
        let pmf = self.coat_pmf(t_o);
        // 1 − pmf, with its own digits where T is small.
        let base_pmf = self.base.share(t_o) / (1.0 - t_o + self.base.share(t_o));
        let pdf = pmf * 0.25 * Ggx::g1_over_cos(cos_o, span_o) * d + base_pmf * cosine_hemisphere_pdf(cos_i);
        (Spectrum::splat(coat), self.base.value(t_o, self.transmittance(wi)), pdf)
    }

    #[inline]
    fn values_and_density(&self, wo: Vec3, wi: Vec3) -> Option<(Spectrum, Spectrum, f32)> {
        if !same_hemisphere(wo, wi) {
            return None;
        }
        let Half { m, cos } = Half::of(wo, wi)?;
        Some(self.at(wo, wi, self.transmittance(wo), m, cos))
    }
}

impl BsdfModel for RoughPlastic {
    const NAME: &'static str = "rough_plastic";
    const ABOUT: &'static str = "a rough clear coat over a diffuse base";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("albedo", "share of light that the base reflects", 0.0, 1.0, Preset::Number(0.5)),
        Parameter::number("eta", "index of the coat over that outside", 1.0, 10.0, Preset::Number(1.5)),
        Parameter::ROUGHNESS,
        Parameter::ALPHA,
    ];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [albedo, eta, roughness, alpha] = arguments.all();
        let (albedo, eta) = (albedo.colour(), eta.number());
        let alphas = alphas([roughness, alpha, Argument::Absent, Argument::Absent], Ggx::MIN_ALPHA)?;
        Ok(match alphas {
            _ if eta == 1.0 => Lambert { albedo }.into(),
            Some((alpha, _)) => Self::new(albedo, eta, alpha).into(),
            None => Plastic::new(albedo, eta).into(),
        })
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, lobes: Lobes, _mode: TransportMode) -> Spectrum {
        let Some((coat, base, _)) = self.values_and_density(wo, wi) else { return Spectrum::ZERO };
        let only = |lobe: Lobes, f: Spectrum| if lobes.contains(lobe) { f } else { Spectrum::ZERO };
        only(Lobes::GLOSSY_REFLECTION, coat) + only(Lobes::DIFFUSE_REFLECTION, base)
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> f32 {
        self.values_and_density(wo, wi).map_or(0.0, |(_, _, pdf)| pdf)
    }

    #[inline]
    fn eval_pdf(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> (Spectrum, f32) {
        self.values_and_density(wo, wi).map_or((Spectrum::ZERO, 0.0), |(coat, base, pdf)| (coat + base, pdf))
    }

    #[inline]
    fn sample(&self, wo: Vec3, uc: f32, u: Vec2, _mode: TransportMode) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        // The surface is its own mirror image, so work above it and come back.
        let above = wo.with_z(wo.z.abs());
        let t_o = self.transmittance(above);
        let (m, wi, lobe) = if uc < self.coat_pmf(t_o) {
            let m = self.ggx.sample_visible(above, u);
            (m, reflect(above, m), Lobes::GLOSSY_REFLECTION)
        } else {
            let wi = cosine_hemisphere(u);
            ((above + wi).normalize(), wi, Lobes::DIFFUSE_REFLECTION)
        };
        let o_m = above.dot(m);
        if wi.z <= 0.0 || o_m <= 0.0 {
            return None;
        }
        // With the sampled normal, not one recomputed from `wi`: D then cancels in the weight, however narrow it is.
        let (coat, base, pdf) = self.at(above, wi, t_o, m, o_m);
        let weight = (coat + base) * (wi.z / pdf);
        Some(BsdfSample { wi: wi.with_z(wi.z.copysign(wo.z)), weight, pdf, lobe, eta: 1.0 })
    }

    fn fixed(&self) -> &'static [&'static str] {
        &["eta"]
    }

    #[inline]
    fn lobes(&self) -> Lobes {
        if self.base.is_black() {
            return Lobes::GLOSSY_REFLECTION;
        }
        Lobes::GLOSSY_REFLECTION | Lobes::DIFFUSE_REFLECTION
    }

    #[inline]
    fn survival(&self) -> f32 {
        self.survival
    }

    fn examples() -> Vec<Self> {
        vec![
            Self::new(Spectrum::new(0.63, 0.065, 0.05), 1.5, 0.3),
            Self::new(Spectrum::ONE, 1.5, 0.3),
            Self::new(Spectrum::ONE, 1.5, 1.0),
            Self::new(Spectrum::ZERO, 1.5, 0.3),
            Self::new(Spectrum::ONE, 2.4, 0.02),
            Self::new(Spectrum::new(0.9, 0.5, 0.0), 1.5, Ggx::MIN_ALPHA),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::fresnel::diffuse_transmittance;

    #[test]
    fn the_table_creates_no_energy_and_loses_little() {
        let alphas = [1e-4, 3e-4, 1e-3, 0.003, 0.01, 0.02, 0.03, 0.05, 0.1, 0.15, 0.21, 0.3, 0.4, 0.5, 0.7, 0.83, 1.0];
        for eta in [1.01, 1.33, 1.5, 2.4, 10.0] {
            let table = Transmittances::of(eta);
            for alpha in alphas {
                let column = Place::among(Transmittances::ALPHAS, alpha_axis(alpha));
                for cos in (0..16).map(|i| ((i as f32 + 0.5) / 16.0).powi(3)) {
                    for cos in [cos, (cos * alpha * 4.0).min(1.0)] {
                        let exact: f32 = facets(eta, alpha, cos, 4096).iter().sum();
                        let stored = table.at(eta, alpha, column, cos);
                        let what = format!("{eta} {alpha} {cos}: {stored} for {exact}");
                        assert!(stored > 0.0 && stored <= 1.0, "{what}");
                        assert!(stored - exact < 1e-4 && exact - stored < 3e-3, "{what}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_smooth_coat_is_that_of_plastic() {
        for eta in [1.01, 1.5, 2.4] {
            let mean = Transmittances::of(eta).means[0];
            assert!((mean - diffuse_transmittance(eta)).abs() < 2e-3, "{eta}: {mean}");
        }
    }
}
