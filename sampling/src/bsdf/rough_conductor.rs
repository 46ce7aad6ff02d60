//! A rough metal: microfacets that mirror.
//!
//! What is on the way of every sample is always inlined: left to itself, the compiler passes samples through memory, which
//! costs up to a quarter of the time.

use super::half::Half;
use super::metals::{complex_index, index_of_reflectance};
use super::microfacets::{Distribution, by_distribution};
use super::missing_energy::MissingEnergy;
use super::quadrature::GAUSS;
use super::roughness::{is_compensated, masking, microfacets};
use super::{
    Arguments, Beckmann, Bsdf, BsdfModel, BsdfSample, Conductor, Ggx, Lobes, Masking, Microfacets, Misfit, Parameter,
    Shared, ShiftedGamma, TransportMode, fresnel_conductor, survival_of,
};
use crate::fault;
use crate::math::{Spectrum, reflect, same_hemisphere};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// f_s = F(wo·m) D(m) G₂(wo, wi) / (4 |cos θ_o| |cos θ_i|) with the half vector m `[Walter07]`.
///
/// D is any of [`Microfacets`], G₂ is Smith's, with either [`Masking`], F exact for the complex index. Visible
/// normals are sampled, or nearly so ([`ShiftedGamma`]). Light scattered more than once among the facets is lost, at α = 1 seven tenths of it (GGX at normal
/// incidence: ln 2), or [compensated](Self::compensated).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughConductor {
    eta: Spectrum,
    k: Spectrum,
    /// F at normal incidence.
    survival: f32,
    facets: Microfacets,
    masking: Masking,
    echo: Option<Echo>,
}

/// The lobe of light that is scattered more than once.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Echo {
    missing: Shared<MissingEnergy>,
    /// What is left of it by absorption.
    tint: Spectrum,
}

impl Echo {
    /// f_s for these magnitudes of the cosines.
    #[inline]
    fn value(&self, cos_o: f32, cos_i: f32) -> Spectrum {
        let missing = self.missing;
        self.tint * (missing.at(cos_o) * missing.at(cos_i) / (PI * missing.average()))
    }
}

impl RoughConductor {
    /// A metal of complex index `eta` + i `k` relative to the medium around it (≥ 0, not both 0), with GGX roughness α_x along
    /// x, α_y along y, at least [`Ggx::MIN_ALPHA`].
    pub fn new(eta: Spectrum, k: Spectrum, alpha_x: f32, alpha_y: f32) -> Self {
        Self::with_facets(eta, k, Ggx::new(alpha_x, alpha_y).into())
    }

    /// A metal that reflects `reflectance`, in [0, 1], at normal incidence.
    ///
    /// A reflectance alone does not determine a complex index. Of the pairs that have it, this is the one with the smallest
    /// η: the map of `[Gulbrandsen14]` with an edge tint of 1, which simplifies to η = (1 − r)/(1 + r), k = 2√r/(1 + r) and
    /// is finite for all r. Its reflectance never falls towards grazing.
    pub fn from_reflectance(reflectance: Spectrum, alpha_x: f32, alpha_y: f32) -> Self {
        let (eta, k) = index_of_reflectance(reflectance);
        Self::new(eta, k, alpha_x, alpha_y)
    }

    /// A metal of complex index `eta` + i `k` (≥ 0, not both 0) with any distribution of normals.
    pub fn with_facets(eta: Spectrum, k: Spectrum, facets: Microfacets) -> Self {
        let survival = survival_of(fresnel_conductor(1.0, eta, k));
        Self { eta, k, survival, facets, masking: Masking::default(), echo: None }
    }

    /// The same metal, whose facets hide one another in this way.
    #[must_use]
    pub fn masked(self, masking: Masking) -> Self {
        let other = Self { masking, ..self };
        if self.echo.is_some() { other.compensated() } else { other }
    }

    /// The same metal, isotropic, with a second lobe in place of light that is scattered more than once `[Kulla17]`.
    ///
    /// What single scattering would lose if nothing were absorbed is given back, times F̄² Ē / (1 − F̄ (1 − Ē)): the share that
    /// survives two or more reflections, each of which absorbs 1 − F̄ and after the second of which Ē leaves. F̄ is the mean
    /// of F over directions with the density cos θ / π, to 3·10⁻⁴ of metals and reflectances, and
    /// to 0.03 of an index below 1 with next to no extinction. So a metal that absorbs nothing loses nothing.
    #[must_use]
    pub fn compensated(self) -> Self {
        let missing = MissingEnergy::of_mirrors(&self.facets, self.masking);
        // Few nodes: a texture that gives the reflectance has this done at every hit.
        let mean =
            |(cos, weight): (f64, f64)| fresnel_conductor(cos as f32, self.eta, self.k) * (2.0 * cos * weight) as f32;
        let average: Spectrum = GAUSS.into_iter().map(mean).sum();
        let lost = missing.average();
        let tint = average * average * (1.0 - lost) / (Spectrum::ONE - average * lost);
        Self { echo: Some(Echo { missing, tint }), ..self }
    }

    /// f_s and pdf for directions of one side, whichever it is.
    #[inline(always)]
    fn value_and_density(&self, wo: Vec3, wi: Vec3) -> Option<(Spectrum, f32)> {
        if !same_hemisphere(wo, wi) {
            return None;
        }
        // The surface is its own mirror image.
        let (wo, wi) = (wo.with_z(wo.z.abs()), wi.with_z(wi.z.abs()));
        let single = by_distribution!(&self.facets, facets => self.scattered_once(facets, wo, wi));
        let Some(echo) = &self.echo else { return single };
        let (f, pdf) = single.unwrap_or((Spectrum::ZERO, 0.0));
        let share = echo.missing.at(wo.z);
        Some((f + echo.value(wo.z, wi.z), pdf + share * (echo.missing.pdf(wi.z) - pdf)))
    }

    /// f_s and pdf of the first lobe, above the surface.
    #[inline(always)]
    fn scattered_once(&self, facets: &impl Distribution, wo: Vec3, wi: Vec3) -> Option<(Spectrum, f32)> {
        let Half { m, cos: o_m } = Half::of(wo, wi)?;
        let (area_o, area_i) = (facets.area(wo), facets.area(wi));
        let d = facets.d(m);
        let joint = self.masking.joint_area(wo.z, area_o, wi.z, area_i);
        let f = fresnel_conductor(o_m, self.eta, self.k) * (0.25 * d / joint);
        // The density of m is D ⟨wo·m⟩ / area; of wi, by dm/dwi, that over 4 |wo·m|, which cancels.
        let jacobian = fault!("half_vector_jacobian_missing", 0.25, 4.0 * o_m);
        Some((f, jacobian * d / facets.sampled_area(wo, area_o, o_m, m)))
    }

    /// A sample of the first lobe, above the surface.
    #[inline(always)]
    fn sample_once(&self, facets: &impl Distribution, wo: Vec3, uc: f32, u: Vec2) -> Option<BsdfSample> {
        let area_o = facets.area(wo);
        let (m, _) = facets.sample(wo, area_o, uc, u);
        let o_m = wo.dot(m);
        let wi = reflect(wo, m);
        // Below the horizon another facet is met; wo·m ≤ 0 is rounding at grazing angles.
        if wi.z <= 0.0 || o_m <= 0.0 {
            return None;
        }
        let area_i = facets.area(wi);
        let sampled = facets.sampled_area(wo, area_o, o_m, m);
        let pdf = 0.25 * facets.d(m) / sampled;
        // The density cancels D.
        let shadowing = wi.z * sampled / self.masking.joint_area(wo.z, area_o, wi.z, area_i);
        let weight = fresnel_conductor(o_m, self.eta, self.k) * shadowing;
        Some(BsdfSample { wi, weight, pdf, lobe: Lobes::GLOSSY_REFLECTION, eta: 1.0 })
    }

    /// A sample of either lobe, above the surface.
    #[inline(always)]
    fn sample_above(&self, wo: Vec3, uc: f32, u: Vec2) -> Option<BsdfSample> {
        let Some(echo) = &self.echo else {
            return by_distribution!(&self.facets, facets => self.sample_once(facets, wo, uc, u));
        };
        let share = echo.missing.at(wo.z);
        let wi = if uc < share {
            echo.missing.sample(u)
        } else {
            let uc = (uc - share) / (1.0 - share);
            by_distribution!(&self.facets, facets => self.sample_once(facets, wo, uc, u))?.wi
        };
        let (f, pdf) = self.value_and_density(wo, wi)?;
        Some(BsdfSample { wi, weight: f * (wi.z / pdf), pdf, lobe: Lobes::GLOSSY_REFLECTION, eta: 1.0 })
    }
}

impl BsdfModel for RoughConductor {
    const NAME: &'static str = "rough_conductor";
    const ABOUT: &'static str = "a rough metal";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::REFLECTANCE,
        Parameter::METAL,
        Parameter::ETA,
        Parameter::K,
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
        let [reflectance, metal, eta, k, distribution, gamma, roughness, alpha, alpha_x, alpha_y, hiding, multiple] =
            arguments.all();
        let (eta, k) = complex_index([reflectance, metal, eta, k])?;
        let Some(facets) = microfacets([distribution, gamma, roughness, alpha, alpha_x, alpha_y])? else {
            return Ok(Conductor::new(eta, k).into());
        };
        let single = Self::with_facets(eta, k, facets).masked(masking(hiding));
        Ok(if is_compensated(multiple, &facets)? { single.compensated() } else { single }.into())
    }

    fn fixed(&self) -> &'static [&'static str] {
        if self.echo.is_some() || matches!(self.facets, Microfacets::ShiftedGamma(_)) {
            return &["roughness", "alpha", "alpha_x", "alpha_y", "gamma"];
        }
        &["gamma"]
    }

    fn is_anisotropic(&self) -> bool {
        self.facets.is_anisotropic()
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, lobes: Lobes, _mode: TransportMode) -> Spectrum {
        if !lobes.contains(Lobes::GLOSSY_REFLECTION) {
            return Spectrum::ZERO;
        }
        self.value_and_density(wo, wi).map_or(Spectrum::ZERO, |(f, _)| f)
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> f32 {
        self.value_and_density(wo, wi).map_or(0.0, |(_, pdf)| pdf)
    }

    #[inline]
    fn eval_pdf(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> (Spectrum, f32) {
        self.value_and_density(wo, wi).unwrap_or((Spectrum::ZERO, 0.0))
    }

    #[inline]
    fn sample(&self, wo: Vec3, uc: f32, u: Vec2, _mode: TransportMode) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        // The surface is its own mirror image, so work above it and come back.
        let sample = self.sample_above(wo.with_z(wo.z.abs()), uc, u)?;
        Some(BsdfSample { wi: sample.wi.with_z(sample.wi.z.copysign(wo.z)), ..sample })
    }

    #[inline]
    fn lobes(&self) -> Lobes {
        Lobes::GLOSSY_REFLECTION
    }

    #[inline]
    fn survival(&self) -> f32 {
        self.survival
    }

    fn examples() -> Vec<Self> {
        let gold = (Spectrum::new(0.188, 0.544, 1.332), Spectrum::new(3.403, 2.231, 1.869));
        let white = index_of_reflectance(Spectrum::ONE);
        let with = |facets: Microfacets| Self::with_facets(white.0, white.1, facets);
        vec![
            Self::new(gold.0, gold.1, 0.1, 0.1),
            Self::new(gold.0, gold.1, 0.05, 0.4),
            Self::new(gold.0, gold.1, 1.0, 1.0),
            Self::from_reflectance(Spectrum::new(0.9, 0.5, 0.0), 0.3, 0.3),
            Self::from_reflectance(Spectrum::ONE, Ggx::MIN_ALPHA, Ggx::MIN_ALPHA),
            with(Beckmann::new(0.1, 0.4).into()),
            with(Beckmann::new(1.0, 1.0).into()),
            with(Beckmann::new(Beckmann::MIN_ALPHA, Beckmann::MIN_ALPHA).into()),
            with(ShiftedGamma::new(0.05, 0.2, 1.0).into()),
            with(ShiftedGamma::new(1.0, 1.0, 0.3).into()),
            with(ShiftedGamma::new(ShiftedGamma::MIN_ALPHA, ShiftedGamma::MIN_ALPHA, 4.0).into()),
            with(Ggx::new(1.0, 1.0).into()).compensated(),
            Self::new(gold.0, gold.1, 0.3, 0.3).compensated(),
            with(Ggx::new(0.02, 0.02).into()).compensated(),
            with(ShiftedGamma::new(0.5, 0.5, 1.0).into()).compensated(),
            Self::new(gold.0, gold.1, 0.05, 0.4).masked(Masking::Separable),
            with(Ggx::new(1.0, 1.0).into()).masked(Masking::Separable),
            with(Beckmann::new(0.3, 0.3).into()).masked(Masking::Separable),
            with(ShiftedGamma::new(0.2, 0.2, 1.0).into()).masked(Masking::Separable),
            with(Ggx::new(0.5, 0.5).into()).masked(Masking::Separable).compensated(),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::Argument;
    use crate::bsdf::quadrature::integrate_towards_ends;
    use glam::vec3;
    use std::f64::consts::TAU;

    /// ∫ f cos dwi by quadrature over the hemisphere, in f64.
    fn albedo(metal: &RoughConductor, cos: f32) -> f64 {
        let wo = vec3((1.0 - cos * cos).sqrt(), 0.0, cos);
        let value = |theta: f64, phi: f64| {
            let (sin, cos) = theta.sin_cos();
            let wi = vec3((sin * phi.cos()) as f32, (sin * phi.sin()) as f32, cos as f32);
            let f = metal.eval(wo, wi, Lobes::ALL, TransportMode::Radiance).max_component();
            f64::from(f) * cos * sin
        };
        let theta_o = f64::from(cos).acos();
        let ring = |theta: f64| 2.0 * integrate_towards_ends(0.0, 0.5 * TAU, 32, |phi| value(theta, phi));
        let part = |from, to| integrate_towards_ends(from, to, 32, ring);
        if theta_o > 0.0 { part(0.0, theta_o) + part(theta_o, 0.25 * TAU) } else { part(0.0, 0.25 * TAU) }
    }

    #[test]
    fn compensated_facets_lose_nothing() {
        let (eta, k) = index_of_reflectance(Spectrum::ONE);
        let mut facets: Vec<Microfacets> = [0.1, 0.5, 1.0].map(|alpha| Ggx::new(alpha, alpha).into()).to_vec();
        facets.push(Beckmann::new(0.5, 0.5).into());
        facets.push(ShiftedGamma::new(0.3, 0.3, 1.0).into());
        for facets in facets {
            for masking in [Masking::Correlated, Masking::Separable] {
                let metal = RoughConductor::with_facets(eta, k, facets).masked(masking).compensated();
                for cos in [1.0, 0.9, 0.5, 0.1] {
                    let albedo = albedo(&metal, cos);
                    assert!((albedo - 1.0).abs() < 1e-4, "{facets:?} {masking:?} at {cos}: {albedo}");
                }
            }
        }
    }

    #[test]
    fn arguments_choose_the_model() {
        let from = |changes: &[(&str, Argument)]| {
            let mut arguments = Arguments::presets(RoughConductor::PARAMETERS);
            for (name, argument) in changes {
                let place = RoughConductor::PARAMETERS.iter().position(|p| p.name == *name).expect("a parameter");
                arguments.set(place, *argument);
            }
            RoughConductor::from_arguments(&arguments)
        };
        let (word, number) = (Argument::Choice, Argument::Number);
        let (alpha_x, alpha_y) = (("alpha_x", number(0.1)), ("alpha_y", number(0.2)));
        let smooth = from(&[("roughness", number(0.0))]).expect("a model");
        assert_eq!(smooth.name(), "conductor");
        for (distribution, least) in [Ggx::MIN_ALPHA, Beckmann::MIN_ALPHA, ShiftedGamma::MIN_ALPHA].iter().enumerate() {
            let of_width = |alpha| from(&[("distribution", word(distribution)), ("alpha", number(alpha))]);
            for alpha in [0.0, 1e-8, least.next_down()] {
                assert_eq!(of_width(alpha), Ok(smooth), "{distribution} {alpha}");
            }
            assert_eq!(of_width(*least).expect("a model").name(), "rough_conductor", "{distribution}");
        }
        let drawn_out = from(&[("alpha_x", number(0.3)), ("alpha_y", number(1e-8))]).expect("a model");
        let Bsdf::RoughConductor(drawn_out) = drawn_out else { panic!("{drawn_out:?}") };
        assert_eq!(drawn_out.facets.alphas(), glam::vec2(0.3, Ggx::MIN_ALPHA));
        let Ok(Bsdf::RoughConductor(rough)) = from(&[("roughness", number(0.5))]) else { panic!("a rough conductor") };
        assert_eq!(rough.facets.alphas(), glam::vec2(0.25, 0.25));
        let kind = |facets: &Microfacets| match facets {
            Microfacets::Ggx(_) => 0,
            Microfacets::Beckmann(_) => 1,
            Microfacets::ShiftedGamma(_) => 2,
        };
        let maskings = [Masking::Correlated, Masking::Separable, Masking::CorrelatedThroughout];
        for (choice, masking) in maskings.into_iter().enumerate() {
            let of_words = from(&[("distribution", word(choice)), ("masking", word(choice))]);
            let Ok(Bsdf::RoughConductor(chosen)) = of_words else { panic!("a rough conductor") };
            assert_eq!((kind(&chosen.facets), chosen.masking), (choice, masking));
        }
        assert_eq!(from(&[("metal", word(0)), alpha_x, alpha_y]).expect("a model").name(), "rough_conductor");
        assert_eq!(
            from(&[("distribution", word(2)), ("gamma", number(0.5))]).expect("a model").name(),
            "rough_conductor"
        );
        for wrong in [
            vec![("gamma", number(0.5))],
            vec![("multiple_scattering", word(1)), alpha_x, alpha_y],
            vec![("metal", word(0)), ("reflectance", Argument::Colour(Spectrum::ONE))],
        ] {
            assert!(from(&wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn absorption_is_compounded_by_more_reflections() {
        let plain = RoughConductor::from_reflectance(Spectrum::splat(0.5), 1.0, 1.0);
        let (once, all) = (albedo(&plain, 0.5), albedo(&plain.compensated(), 0.5));
        // At most what is missing, times F̄², which is above 0.25.
        assert!(all > once + 0.02 && all < once + 0.2, "{once} {all}");
    }
}
