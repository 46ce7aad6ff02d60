//! A rough clear coat over a diffuse base.

pub mod coat;

use super::coated_base::{Base, Within};
use super::half::Half;
use super::microfacets::{Distribution, by_distribution};
use super::roughness::{masking, microfacets};
use super::{
    Argument, Arguments, Beckmann, Bsdf, BsdfModel, BsdfSample, Coat, Ggx, Lambert, Lobes, Masking, Microfacets,
    Misfit, Parameter, Plastic, Preset, Shared, Strays, TransportMode, fresnel_dielectric,
};
use crate::math::{Spectrum, reflect, same_hemisphere};
use crate::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use coat::{Place, Transmittances, alpha_axis};
use glam::{Vec2, Vec3};

/// f_s = F D G₂ / (4 |cos θ_o| |cos θ_i|) + T(o) T(i) ρ / (π η² (1 − ρ F̄)): a coat of facets `[Walter07]` over a diffuse
/// base, joined as in [`Plastic`](super::Plastic).
///
/// T(w) is what the coat lets in of the light from w, tabulated; T̄ is its mean over the hemisphere, F̄ = 1 − T̄ / η². The facets
/// reflect once: what they would scatter among themselves goes to the base with the light that they let in, T(w) = 1 − E(w) in
/// the manner of `[Ashikhmin00]`, or is lost: see [`Strays`]. T is taken a thousandth too small, so that the table's error creates
/// no energy: this is lost where the base is white. A table belongs to an index and is made where that index is first met; an index
/// that varies over a surface would make many.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughPlastic {
    coat: Coat,
    alpha: f32,
    base: Base,
    survival: f32,
    /// The place of α among the columns of the table.
    column: Place,
    table: Shared<Transmittances>,
}

impl RoughPlastic {
    /// A base of this albedo in [0, 1] under a coat of index `eta` in (1, 10] relative to the medium around it, with GGX facets of
    /// roughness α in [[`Ggx::MIN_ALPHA`], 1].
    pub fn new(albedo: Spectrum, eta: f32, alpha: f32) -> Self {
        let coat =
            Coat { eta, facets: Ggx::new(alpha, alpha).into(), masking: Masking::Correlated, strays: Strays::Enter };
        Self::coated(albedo, coat, Within::default()).expect("nothing is said that could be wrong")
    }

    /// A base of this albedo under any coat, within which light goes on as is said.
    ///
    /// # Errors
    ///
    /// The coat would send back more than there is.
    pub fn coated(albedo: Spectrum, coat: Coat, within: Within) -> Result<Self, Misfit> {
        let table = Transmittances::of(&coat);
        let alpha = coat.facets.alphas().x;
        let axis = alpha_axis(alpha);
        let mean = table.mean_at(axis);
        let column = Place::among(Transmittances::ALPHAS, axis);
        let base = Base::new(albedo, coat.eta, mean, within)?;
        let survival = (1.0 - mean + base.share(mean)).min(1.0);
        Ok(Self { coat, alpha, base, survival, column, table })
    }

    #[inline]
    fn transmittance(&self, w: Vec3) -> f32 {
        self.table.at(self.coat.eta, self.alpha, self.column, w.z.abs())
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
        let (d, area_o, area_i, sampled) = by_distribution!(&self.coat.facets, facets => {
            let area_o = facets.area(wo);
            (facets.d(m), area_o, facets.area(wi), facets.sampled_area(wo, area_o, o_m, m))
        });
        let joint = self.coat.masking.joint_area(cos_o, area_o, cos_i, area_i);
        let coat = fresnel_dielectric(o_m.min(1.0), self.coat.eta).reflected * (0.25 * d / joint);
        let pmf = self.coat_pmf(t_o);
        // 1 − pmf, with its own digits where T is small.
        let base_pmf = self.base.share(t_o) / (1.0 - t_o + self.base.share(t_o));
        let pdf = pmf * 0.25 * d / sampled + base_pmf * cosine_hemisphere_pdf(cos_i);
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
        Parameter::choice("distribution", "distribution of normals", &["ggx", "beckmann"]),
        Parameter::MASKING,
        Parameter::STRAYS,
        Parameter::INTERREFLECTION,
        Parameter::INTERNAL_REFLECTANCE,
    ];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [albedo, eta, roughness, alpha, distribution, hiding, strays, interreflection, reflectance] =
            arguments.all();
        let (albedo, eta, within) = (albedo.colour(), eta.number(), Within::of([interreflection, reflectance]));
        let absent = Argument::Absent;
        let facets = microfacets([distribution, absent, roughness, alpha, absent, absent])?;
        let strays = [Strays::Enter, Strays::Lost][strays.choice()];
        Ok(match facets {
            _ if eta == 1.0 => Lambert { albedo }.into(),
            Some(facets) => {
                Self::coated(albedo, Coat { eta, facets, masking: masking(hiding), strays }, within)?.into()
            }
            None => Plastic::reflecting_within(albedo, eta, within)?.into(),
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
        let (m, o_m, wi, lobe) = if uc < self.coat_pmf(t_o) {
            let rest = (uc / self.coat_pmf(t_o)).min(1.0_f32.next_down());
            let m = by_distribution!(&self.coat.facets, facets => facets.sample(above, facets.area(above), rest, u)).0;
            (m, above.dot(m), reflect(above, m), Lobes::GLOSSY_REFLECTION)
        } else {
            let wi = cosine_hemisphere(u);
            let Half { m, cos } = Half::of(above, wi)?;
            (m, cos, wi, Lobes::DIFFUSE_REFLECTION)
        };
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
        let with = |facets: Microfacets, strays: Strays, within: Within| {
            let coat = Coat { eta: 1.5, facets, masking: Masking::Separable, strays };
            Self::coated(Spectrum::new(1.0, 0.6, 0.1), coat, within).expect("a model")
        };
        vec![
            Self::new(Spectrum::new(0.63, 0.065, 0.05), 1.5, 0.3),
            Self::new(Spectrum::ONE, 1.5, 0.3),
            Self::new(Spectrum::ONE, 1.5, 1.0),
            Self::new(Spectrum::ZERO, 1.5, 0.3),
            Self::new(Spectrum::ONE, 2.4, 0.02),
            Self::new(Spectrum::new(0.9, 0.5, 0.0), 1.5, Ggx::MIN_ALPHA),
            with(Ggx::new(0.3, 0.3).into(), Strays::Enter, Within::as_if_white(None)),
            with(Ggx::new(0.6, 0.6).into(), Strays::Lost, Within::as_if_white(Some(0.2))),
            with(Beckmann::new(0.1, 0.1).into(), Strays::Lost, Within::default()),
            with(Beckmann::new(1.0, 1.0).into(), Strays::Enter, Within::default()),
        ]
    }
}
