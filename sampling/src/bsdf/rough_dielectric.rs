//! A rough interface between two transparent media: microfacets that reflect and refract.
//!
//! What is on the way of every sample is always inlined: left to itself, the compiler passes samples through memory, which
//! costs up to a quarter of the time.

use super::fresnel::{DielectricFresnel, diffuse_transmittance, fresnel_dielectric};
use super::half::Half;
use super::microfacets::{Distribution, by_distribution};
use super::missing_energy::MissingEnergy;
use super::roughness::{is_compensated, masking, microfacets};
use super::{
    Arguments, Beckmann, Bsdf, BsdfModel, BsdfSample, Dielectric, Ggx, Lobes, Masking, Microfacets, Misfit, Parameter,
    Shared, ShiftedGamma, TransportMode,
};
use crate::fault;
use crate::math::{Spectrum, reflect};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Reflection `[Walter07]` and refraction [Walter07, (21)] by facets, chosen by Fresnel's equations at the facet.
///
/// D is any of [`Microfacets`]; visible normals are sampled, or nearly so ([`ShiftedGamma`]). G₂ of a reflection is Smith's,
/// with any [`Masking`], which says as well whether the two sides of a refraction are independent, G₁ G₁ [Walter07, (23)]. Light
/// scattered more than once among the facets is lost, or [compensated](Self::compensated).
///
/// What is refracted spreads over some |η − 1| α, and directions in `f32` resolve 10⁻⁶: below, value and density at a direction are
/// off by a third, though samples are right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughDielectric {
    eta: f32,
    facets: Microfacets,
    masking: Masking,
    echo: Option<Echo>,
}

/// The lobes of light that is scattered more than once.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Echo {
    outside: Beyond,
    inside: Beyond,
}

/// What is known of the light that comes from one side.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Beyond {
    missing: Shared<MissingEnergy>,
    /// The share of what is missing that is transmitted.
    transmitted: f32,
}

impl RoughDielectric {
    /// An interface whose inside (z < 0) has the index `eta` > 0 relative to the outside, with GGX roughness α_x along x, α_y
    /// along y, at least [`Ggx::MIN_ALPHA`]. With `eta` = 1 there is nothing to see: light passes straight on.
    pub fn new(eta: f32, alpha_x: f32, alpha_y: f32) -> Self {
        Self::with_facets(eta, Ggx::new(alpha_x, alpha_y).into())
    }

    /// The same with any distribution of normals.
    pub fn with_facets(eta: f32, facets: Microfacets) -> Self {
        Self { eta, facets, masking: Masking::default(), echo: None }
    }

    /// The same interface, whose facets hide one another in this way.
    #[must_use]
    pub fn masked(self, masking: Masking) -> Self {
        let other = Self { masking, ..self };
        if self.echo.is_some() { other.compensated() } else { other }
    }

    /// The same interface, isotropic, with further lobes in place of light that is scattered more than once, so that no light
    /// is lost `[Kulla17]`.
    ///
    /// With m(μ) the share that single scattering loses of light at the cosine μ, m̄ its mean and primes for the other side,
    /// the lobes are (1 − t) m(μ_o) m(μ_i) / (π m̄) in reflection and t m(μ_o) m'(μ_i) / (π m̄') in transmission. They are
    /// reciprocal if t m̄ = η² t' m̄' from the outside to the inside. Of the solutions this takes
    /// t = T̄ min(m̄, m̄') / m̄ with the share T̄ of diffuse light that a smooth interface transmits, for which T̄ = η² T̄'. The
    /// choice of t is ours: the source has another, which differs where m̄ and m̄' do.
    #[must_use]
    pub fn compensated(self) -> Self {
        if self.eta == 1.0 {
            return self;
        }
        let outside = MissingEnergy::of_interfaces(&self.facets, self.masking, self.eta);
        let inside = MissingEnergy::of_interfaces(&self.facets, self.masking, 1.0 / self.eta);
        let exchanged = diffuse_transmittance(self.eta) * outside.average().min(inside.average());
        let side = |missing: Shared<MissingEnergy>, scale: f32| Beyond {
            missing,
            transmitted: exchanged / (scale * missing.average()),
        };
        Self { echo: Some(Echo { outside: side(outside, 1.0), inside: side(inside, self.eta * self.eta) }), ..self }
    }

    /// The index on the far side of the interface relative to that on the side of `wo`.
    #[inline]
    fn relative_index(&self, wo: Vec3) -> f32 {
        if wo.z > 0.0 { self.eta } else { 1.0 / self.eta }
    }

    /// What is known of the light that comes from the side of `wo`, and from the other side.
    #[inline]
    fn echo_from(&self, wo: Vec3) -> Option<(&Beyond, &Beyond)> {
        let Echo { outside, inside } = self.echo.as_ref()?;
        Some(if wo.z > 0.0 { (outside, inside) } else { (inside, outside) })
    }

    #[inline(always)]
    fn value_and_density(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Option<(f32, f32, Lobes)> {
        if wo.z == 0.0 || wi.z == 0.0 || self.eta == 1.0 {
            return None;
        }
        let eta = self.relative_index(wo);
        let echo = self.echo_from(wo);
        // The surface is its own mirror image: put wo above it.
        let side = 1.0_f32.copysign(wo.z);
        let (wo, wi) = (wo.with_z(wo.z.abs()), wi.with_z(wi.z * side));
        let is_reflected = wi.z > 0.0;
        let once = by_distribution!(&self.facets, facets => if is_reflected {
            self.reflection(facets, wo, wi, eta)
        } else {
            self.refraction(facets, wo, wi, eta, mode)
        });
        let Some((here, there)) = echo else { return once };
        let (lobe, table, share, scale) = if is_reflected {
            (Lobes::GLOSSY_REFLECTION, here.missing, 1.0 - here.transmitted, 1.0)
        } else {
            (Lobes::GLOSSY_TRANSMISSION, there.missing, here.transmitted, mode.transmission_scale(eta))
        };
        let (missing, cos_i) = (here.missing.at(wo.z), wi.z.abs());
        let (f, pdf) = once.map_or((0.0, 0.0), |(f, pdf, _)| (f, pdf));
        let more = share * scale * missing * table.at(cos_i) / (PI * table.average());
        Some((f + more, pdf + missing * (share * table.pdf(cos_i) - pdf), lobe))
    }

    #[inline(always)]
    fn reflection(&self, facets: &impl Distribution, wo: Vec3, wi: Vec3, eta: f32) -> Option<(f32, f32, Lobes)> {
        let Half { m, cos: o_m } = Half::of(wo, wi)?;
        let (area_o, area_i) = (facets.area(wo), facets.area(wi));
        let fd = 0.25 * fresnel_dielectric(o_m, eta).reflected * facets.d(m);
        let f = fd / self.masking.joint_area(wo.z, area_o, wi.z, area_i);
        let chosen = fault!("fresnel_missing_from_density", fd, 0.25 * facets.d(m));
        Some((f, chosen / facets.sampled_area(wo, area_o, o_m, m), Lobes::GLOSSY_REFLECTION))
    }

    #[inline(always)]
    fn refraction(
        &self,
        facets: &impl Distribution,
        wo: Vec3,
        wi: Vec3,
        eta: f32,
        mode: TransportMode,
    ) -> Option<(f32, f32, Lobes)> {
        // The facet's normal is along ±h, h = wo + η wi, taken so that wo and −wi almost cancel without loss.
        let h = (wo + wi) + (eta - 1.0) * wi;
        let length2 = h.length_squared();
        if length2 == 0.0 {
            return None;
        }
        let m = h * (1.0_f32.copysign(h.z) / length2.sqrt());
        let (o_m, i_m) = (wo.dot(m), -wi.dot(m));
        if o_m <= 0.0 || i_m <= 0.0 {
            return None;
        }
        let (area_o, area_i) = (facets.area(wo), facets.area(wi));
        // F is the same from both sides, but only from the thinner medium it keeps its digits near the critical angle.
        let (thin, index) = if eta > 1.0 { (o_m, eta) } else { (i_m, 1.0 / eta) };
        let transmitted = fresnel_dielectric(thin, index).transmitted;
        // dm/dwi = η² |wi·m| / |h|² [Walter07, (17)].
        let common = transmitted * facets.d(m) * o_m * i_m * (eta * eta / length2);
        let f = common / self.masking.joint_area_through(wo.z, area_o, -wi.z, area_i) * mode.transmission_scale(eta);
        Some((f, common / facets.sampled_area(wo, area_o, o_m, m), Lobes::GLOSSY_TRANSMISSION))
    }

    /// A sample of light that is scattered once, for `wo` above the surface.
    #[inline(always)]
    fn sample_once(
        &self,
        facets: &impl Distribution,
        wo: Vec3,
        eta: f32,
        uc: f32,
        u: Vec2,
        mode: TransportMode,
    ) -> Option<BsdfSample> {
        let area_o = facets.area(wo);
        let (m, uc) = facets.sample(wo, area_o, uc, u);
        let o_m = wo.dot(m);
        if o_m <= 0.0 {
            return None;
        }
        let DielectricFresnel { reflected, transmitted, cos_t: i_m } = fresnel_dielectric(o_m, eta);
        let sampled = facets.sampled_area(wo, area_o, o_m, m);
        let visible = facets.d(m) / sampled;
        if uc < reflected || transmitted == 0.0 {
            let wi = reflect(wo, m);
            if wi.z <= 0.0 {
                return None;
            }
            let pdf = 0.25 * reflected * visible;
            let shadowing = wi.z * sampled / self.masking.joint_area(wo.z, area_o, wi.z, facets.area(wi));
            let weight = Spectrum::splat(shadowing);
            return Some(BsdfSample { wi, weight, pdf, lobe: Lobes::GLOSSY_REFLECTION, eta: 1.0 });
        }
        let wi = (o_m / eta - i_m) * m - wo / eta;
        if wi.z >= 0.0 {
            return None;
        }
        // |h| = |wo·m − η |wi·m||, which by Snell's law is |η² − 1| / (wo·m + η |wi·m|).
        let length = (eta - 1.0) * (eta + 1.0) / (o_m + eta * i_m);
        let pdf = transmitted * visible * o_m * i_m * (eta * eta / (length * length));
        let joint = self.masking.joint_area_through(wo.z, area_o, -wi.z, facets.area(wi));
        let shadowing = -wi.z * sampled / joint;
        let weight = Spectrum::splat(shadowing * mode.transmission_scale(eta));
        Some(BsdfSample { wi, weight, pdf, lobe: Lobes::GLOSSY_TRANSMISSION, eta })
    }

    /// A sample of light that is scattered once, or more than once, for `wo` on either side.
    #[inline(always)]
    fn sample_any(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        let eta = self.relative_index(wo);
        let above = wo.with_z(wo.z.abs());
        let back = |wi: Vec3| wi.with_z(wi.z * 1.0_f32.copysign(wo.z));
        let Some((here, there)) = self.echo_from(wo) else {
            let once = by_distribution!(&self.facets, facets => self.sample_once(facets, above, eta, uc, u, mode))?;
            return Some(BsdfSample { wi: back(once.wi), ..once });
        };
        let missing = here.missing.at(above.z);
        let wi = if uc < missing * here.transmitted {
            -there.missing.sample(u)
        } else if uc < missing {
            here.missing.sample(u)
        } else {
            let uc = (uc - missing) / (1.0 - missing);
            by_distribution!(&self.facets, facets => self.sample_once(facets, above, eta, uc, u, mode))?.wi
        };
        let wi = back(wi);
        let (f, pdf, lobe) = self.value_and_density(wo, wi, mode)?;
        let eta = if Lobes::TRANSMISSION.contains(lobe) { eta } else { 1.0 };
        Some(BsdfSample { wi, weight: Spectrum::splat(f * (wi.z.abs() / pdf)), pdf, lobe, eta })
    }
}

impl BsdfModel for RoughDielectric {
    const NAME: &'static str = "rough_dielectric";
    const ABOUT: &'static str = "a rough interface between two transparent media, such as ground glass";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::INDEX,
        Parameter::DISTRIBUTION,
        Parameter::GAMMA,
        Parameter::ROUGHNESS,
        Parameter::ALPHA,
        Parameter::ALPHA_X,
        Parameter::ALPHA_Y,
        Parameter::MASKING,
        Parameter::MULTIPLE_SCATTERING,
    ];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [eta, distribution, gamma, roughness, alpha, alpha_x, alpha_y, hiding, multiple] = arguments.all();
        let eta = eta.number();
        let Some(facets) = microfacets([distribution, gamma, roughness, alpha, alpha_x, alpha_y])? else {
            return Ok(Dielectric { eta }.into());
        };
        let single = Self::with_facets(eta, facets).masked(masking(hiding));
        Ok(if is_compensated(multiple, &facets)? { single.compensated() } else { single }.into())
    }

    fn fixed(&self) -> &'static [&'static str] {
        if self.echo.is_some() || matches!(self.facets, Microfacets::ShiftedGamma(_)) {
            return &["eta", "roughness", "alpha", "alpha_x", "alpha_y", "gamma"];
        }
        &["eta", "gamma"]
    }

    fn is_anisotropic(&self) -> bool {
        self.facets.is_anisotropic()
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, lobes: Lobes, mode: TransportMode) -> Spectrum {
        match self.value_and_density(wo, wi, mode) {
            Some((f, _, lobe)) if lobes.contains(lobe) => Spectrum::splat(f),
            _ => Spectrum::ZERO,
        }
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
        self.value_and_density(wo, wi, mode).map_or(0.0, |(_, pdf, _)| pdf)
    }

    #[inline]
    fn eval_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Spectrum, f32) {
        self.value_and_density(wo, wi, mode).map_or((Spectrum::ZERO, 0.0), |(f, pdf, _)| (Spectrum::splat(f), pdf))
    }

    #[inline]
    fn sample(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        if self.eta == 1.0 {
            return Dielectric { eta: 1.0 }.sample(wo, uc, u, mode);
        }
        if wo.z == 0.0 {
            return None;
        }
        self.sample_any(wo, uc, u, mode)
    }

    #[inline]
    fn lobes(&self) -> Lobes {
        if self.eta == 1.0 {
            return Lobes::DELTA_TRANSMISSION;
        }
        Lobes::GLOSSY_REFLECTION | Lobes::GLOSSY_TRANSMISSION
    }

    #[inline]
    fn survival(&self) -> f32 {
        1.0
    }

    fn examples() -> Vec<Self> {
        vec![
            Self::new(1.5, 0.1, 0.1),
            Self::new(1.5, 0.5, 0.2),
            Self::new(1.0 / 1.5, 0.3, 0.3),
            Self::new(2.4, 1.0, 1.0),
            Self::new(1.5, 0.01, 0.01),
            Self::new(1.5, Ggx::MIN_ALPHA, Ggx::MIN_ALPHA),
            Self::new(1.01, 0.3, 0.3),
            Self::with_facets(1.5, Beckmann::new(0.3, 0.6).into()),
            Self::with_facets(1.5, ShiftedGamma::new(0.2, 0.2, 1.0).into()),
            Self::new(1.5, 1.0, 1.0).compensated(),
            Self::new(1.0 / 2.4, 0.3, 0.3).compensated(),
            Self::new(1.0, 0.3, 0.3),
            Self::new(1.5, 0.5, 0.2).masked(Masking::Separable),
            Self::with_facets(1.0 / 1.5, Beckmann::new(0.4, 0.4).into()).masked(Masking::Separable),
            Self::new(1.5, 0.5, 0.5).masked(Masking::Separable).compensated(),
            Self::new(1.5, 0.6, 0.3).masked(Masking::CorrelatedThroughout),
            Self::new(1.5, 0.5, 0.5).masked(Masking::CorrelatedThroughout).compensated(),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{vec2, vec3};

    /// ∫ f* |cos| dwi as the mean weight of samples from a grid.
    fn albedo(glass: &RoughDielectric, cos: f32) -> f64 {
        const SIDE: usize = 512;
        let wo = vec3((1.0 - cos * cos).sqrt(), 0.0, cos);
        let weight = |i: usize| {
            let u = (vec2((i % SIDE) as f32, (i / SIDE) as f32) + 0.5) / SIDE as f32;
            let uc = (i as f64 * 0.618_033_988_749_895).fract() as f32;
            let sample = glass.sample(wo, uc, u, TransportMode::Importance);
            sample.map_or(0.0, |sample| f64::from(sample.weight.max_component()))
        };
        (0..SIDE * SIDE).map(weight).sum::<f64>() / (SIDE * SIDE) as f64
    }

    #[test]
    fn compensated_facets_lose_nothing() {
        let cases = [
            (1.5, Masking::Correlated),
            (1.0 / 1.5, Masking::Correlated),
            (2.4, Masking::Correlated),
            (1.5, Masking::Separable),
            (1.5, Masking::CorrelatedThroughout),
        ];
        for (eta, masking) in cases {
            for alpha in [0.3, 1.0] {
                let glass = RoughDielectric::new(eta, alpha, alpha).masked(masking).compensated();
                for cos in [1.0, 0.8, 0.5, 0.1, -0.9, -0.4, -0.1] {
                    let albedo = albedo(&glass, cos);
                    assert!((albedo - 1.0).abs() < 2e-4, "{eta} {alpha} at {cos}: {albedo}");
                }
                let Some(Echo { outside, inside }) = glass.echo else { panic!("it is compensated") };
                for side in [outside, inside] {
                    assert!((0.0..=1.0).contains(&side.transmitted), "{eta} {alpha}: {side:?}");
                }
            }
        }
    }
}
