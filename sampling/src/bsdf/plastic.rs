//! A smooth clear coat over a diffuse base.

use super::coated_base::{Base, Within};
use super::fresnel::{DielectricFresnel, diffuse_transmittance, fresnel_dielectric};
use super::{Arguments, Bsdf, BsdfModel, BsdfSample, Lambert, Lobes, Misfit, Parameter, Preset, TransportMode};
use crate::math::{Spectrum, same_hemisphere};
use crate::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use glam::{Vec2, Vec3, vec3};

/// A delta lobe of reflection by the coat, and f_d = T(o) T(i) ρ / (π η² (1 − ρ F̄)) of the base beneath it [Ashikhmin00;
/// PBRT4, section 14.3].
///
/// T = 1 − F is exact for each direction. Light that the base scatters is diffuse, and of that the coat reflects F̄ back
/// onto it, again and again: the geometric series 1 / (1 − ρ F̄), which makes colours deeper where ρ is low. With
/// T̄ = η² (1 − F̄), the transmittance for diffuse light from outside, the albedo is F(o) + T(o) ρ T̄ / (η² (1 − ρ F̄)): all
/// light is accounted for, and none is lost where ρ = 1. The coat absorbs nothing, and has no thickness by which light
/// would leave elsewhere. Light within may go on otherwise, as other programs have it: see [`Within`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plastic {
    eta: f32,
    base: Base,
}

impl Plastic {
    /// A base of this albedo in [0, 1] under a coat of index `eta` > 0 relative to the medium around it.
    pub fn new(albedo: Spectrum, eta: f32) -> Self {
        Self::reflecting_within(albedo, eta, Within::default()).expect("nothing is said that could be wrong")
    }

    /// The same with something else than usual going on within the coat.
    ///
    /// # Errors
    ///
    /// The coat would send back more than there is.
    pub fn reflecting_within(albedo: Spectrum, eta: f32, within: Within) -> Result<Self, Misfit> {
        Ok(Self { eta, base: Base::new(albedo, eta, diffuse_transmittance(eta), within)? })
    }

    #[inline]
    fn fresnel(&self, w: Vec3) -> DielectricFresnel {
        fresnel_dielectric(w.z.abs(), self.eta)
    }

    /// The pmf of the mirror lobe: its share of what is reflected. The angle of its other end is the same, and so is the pmf.
    #[inline]
    fn mirror_pmf(&self, fresnel: DielectricFresnel) -> f32 {
        if fresnel.reflected == 0.0 {
            return 0.0;
        }
        fresnel.reflected / (fresnel.reflected + self.base.share(fresnel.transmitted))
    }

    /// The probability of the base's lobe, which is not black; with its own digits where it is small.
    #[inline]
    fn base_pmf(&self, fresnel: DielectricFresnel) -> f32 {
        let share = self.base.share(fresnel.transmitted);
        share / (fresnel.reflected + share)
    }

    #[inline]
    fn value_and_density(&self, wo: Vec3, wi: Vec3) -> Option<(Spectrum, f32)> {
        if !same_hemisphere(wo, wi) || self.base.is_black() {
            return None;
        }
        let fresnel = self.fresnel(wo);
        let f = self.base.value(fresnel.transmitted, self.fresnel(wi).transmitted);
        Some((f, self.base_pmf(fresnel) * cosine_hemisphere_pdf(wi.z.abs())))
    }
}

impl BsdfModel for Plastic {
    const NAME: &'static str = "plastic";
    const ABOUT: &'static str = "a smooth clear coat over a diffuse base";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("albedo", "share of light that the base reflects", 0.0, 1.0, Preset::Number(0.5)),
        Parameter::INDEX,
        Parameter::INTERREFLECTION,
        Parameter::INTERNAL_REFLECTANCE,
    ];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [albedo, eta, interreflection, reflectance] = arguments.all();
        let (albedo, eta, within) = (albedo.colour(), eta.number(), Within::of([interreflection, reflectance]));
        Ok(if eta == 1.0 { Lambert { albedo }.into() } else { Self::reflecting_within(albedo, eta, within)?.into() })
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, lobes: Lobes, _mode: TransportMode) -> Spectrum {
        if !lobes.contains(Lobes::DIFFUSE_REFLECTION) {
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
        let fresnel = self.fresnel(wo);
        let pmf = self.mirror_pmf(fresnel);
        // All that is reflected; a lobe's share of it is the lobe's probability.
        let whole = fresnel.reflected + self.base.share(fresnel.transmitted);
        if uc < pmf {
            let wi = vec3(-wo.x, -wo.y, wo.z);
            let weight = Spectrum::splat(whole);
            return Some(BsdfSample { wi, weight, pdf: pmf, lobe: Lobes::DELTA_REFLECTION, eta: 1.0 });
        }
        if self.base.is_black() {
            return None;
        }
        let up = cosine_hemisphere(u);
        let pdf = self.base_pmf(fresnel) * cosine_hemisphere_pdf(up.z);
        if pdf == 0.0 {
            return None;
        }
        let wi = up.with_z(up.z.copysign(wo.z));
        let weight = self.base.weight(self.fresnel(wi).transmitted) * whole;
        Some(BsdfSample { wi, weight, pdf, lobe: Lobes::DIFFUSE_REFLECTION, eta: 1.0 })
    }

    #[inline]
    fn lobes(&self) -> Lobes {
        match (self.eta == 1.0, self.base.is_black()) {
            (true, _) => Lobes::DIFFUSE_REFLECTION,
            (false, true) => Lobes::DELTA_REFLECTION,
            (false, false) => Lobes::DELTA_REFLECTION | Lobes::DIFFUSE_REFLECTION,
        }
    }

    #[inline]
    fn survival(&self) -> f32 {
        // The albedo at normal incidence; a black base under no coat ends the walk by its weight.
        let DielectricFresnel { reflected, transmitted, .. } = fresnel_dielectric(1.0, self.eta);
        let albedo = reflected + self.base.share(transmitted);
        if albedo > 0.0 { albedo.min(1.0) } else { 1.0 }
    }

    fn examples() -> Vec<Self> {
        vec![
            Self::new(Spectrum::new(0.63, 0.065, 0.05), 1.5),
            Self::new(Spectrum::ONE, 1.5),
            Self::new(Spectrum::ZERO, 1.5),
            Self::new(Spectrum::new(0.9, 0.5, 0.0), 1.0 / 1.33),
            Self::new(Spectrum::splat(0.8), 2.4),
            Self::new(Spectrum::splat(0.8), 1.0),
            Self::reflecting_within(Spectrum::new(1.0, 0.5, 0.1), 1.5, Within::as_if_white(None)).expect("a model"),
            Self::reflecting_within(Spectrum::new(1.0, 0.5, 0.1), 1.5, Within::as_if_white(Some(0.5)))
                .expect("a model"),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coat_sends_back_no_more_than_there_is() {
        let kept = 1.0 - diffuse_transmittance(1.5) / 2.25;
        let with = |reflectance: f32| {
            Plastic::reflecting_within(
                Spectrum::ONE,
                1.5,
                Within { reflectance: Some(reflectance), ..Within::default() },
            )
        };
        assert_eq!(with(kept), Ok(Plastic::new(Spectrum::ONE, 1.5)));
        assert!(with(kept + 1e-4).is_err());
    }

    #[test]
    fn a_white_base_loses_nothing() {
        for eta in [1.0 / 1.5, 1.001, 1.33, 1.5, 2.4, 20.0, 100.0] {
            let white = Plastic::new(Spectrum::ONE, eta);
            for cos in [1.0_f32, 0.5, 0.1, 1e-3, 1e-7] {
                let wo = vec3((1.0 - cos * cos).sqrt(), 0.0, cos);
                const NODES: u32 = 100_000;
                let diffuse: f64 = (0..NODES)
                    .map(|i| {
                        // With cosines x² the integrand is smooth at the horizon: d cos = 2 x dx, and sin is in the measure.
                        let x = (i as f32 + 0.5) / NODES as f32;
                        let wi = vec3((1.0 - x.powi(4)).sqrt(), 0.0, x * x);
                        let f = white.eval(wo, wi, Lobes::ALL, TransportMode::Radiance).mean();
                        std::f64::consts::TAU * f64::from(f) * f64::from(x).powi(3) * 2.0
                    })
                    .sum();
                let albedo = diffuse / f64::from(NODES) + f64::from(white.fresnel(wo).reflected);
                assert!((albedo - 1.0).abs() < 2e-5, "{eta} {cos}: {albedo}");
            }
        }
    }
}
