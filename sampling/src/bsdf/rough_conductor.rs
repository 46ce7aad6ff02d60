//! A rough metal: microfacets that mirror.

use super::roughness::alphas;
use super::{
    Arguments, Bsdf, BsdfModel, BsdfSample, Ggx, Lobes, Mirror, Misfit, Parameter, Preset, TransportMode,
    fresnel_conductor, survival_of,
};
use crate::fault;
use crate::math::{Spectrum, reflect, same_hemisphere};
use glam::{Vec2, Vec3};

/// f_s = F(wo·m) D(m) G₂(wo, wi) / (4 |cos θ_o| |cos θ_i|) with the half vector m [Walter07, (20)].
///
/// D is GGX, G₂ is Smith's for correlated heights [Heitz14, (99)], F exact for the complex index. Visible normals are
/// sampled. Light scattered more than once among the facets is lost: at α = 1 about half of it in the worst direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughConductor {
    eta: Spectrum,
    k: Spectrum,
    /// F at normal incidence.
    survival: f32,
    ggx: Ggx,
}

impl RoughConductor {
    /// A metal of complex index `eta` + i `k` relative to the medium around it (≥ 0, not both 0), with roughness α_x along
    /// x, α_y along y, at least [`Ggx::MIN_ALPHA`].
    pub fn new(eta: Spectrum, k: Spectrum, alpha_x: f32, alpha_y: f32) -> Self {
        let survival = survival_of(fresnel_conductor(1.0, eta, k));
        Self { eta, k, survival, ggx: Ggx::new(alpha_x, alpha_y) }
    }

    /// A metal that reflects `reflectance`, in [0, 1], at normal incidence.
    ///
    /// A reflectance alone does not determine a complex index. Of the pairs that have it, this is the one with the smallest
    /// η: the map of `[Gulbrandsen14]` with an edge tint of 1, which simplifies to η = (1 − r)/(1 + r), k = 2√r/(1 + r) and
    /// is finite for all r. Its reflectance never falls towards grazing.
    pub fn from_reflectance(reflectance: Spectrum, alpha_x: f32, alpha_y: f32) -> Self {
        let sum = Spectrum::ONE + reflectance;
        Self::new((Spectrum::ONE - reflectance) / sum, 2.0 * reflectance.sqrt() / sum, alpha_x, alpha_y)
    }

    /// f_s and pdf for directions of one side, whichever it is.
    #[inline]
    fn value_and_density(&self, wo: Vec3, wi: Vec3) -> Option<(Spectrum, f32)> {
        let sum = wo + wi;
        let length2 = sum.length_squared();
        if !same_hemisphere(wo, wi) || length2 == 0.0 {
            return None;
        }
        let length = length2.sqrt();
        let m = sum / length;
        let (cos_o, cos_i) = (wo.z.abs(), wi.z.abs());
        let (span_o, span_i) = (self.ggx.span(wo), self.ggx.span(wi));
        // D depends on squares only, so the side does not matter to it.
        let d = self.ggx.d(m);
        // G₂ / (4 cos cos) = 1 / (2 (s_o cos_i + s_i cos_o)).
        // The directions are unit, so wo·m = wi·m = |wo + wi| / 2, which does not cancel at grazing angles.
        let f = fresnel_conductor(0.5 * length, self.eta, self.k) * (0.5 * d / (span_o * cos_i + span_i * cos_o));
        // The density of m is D_visible; of wi, by dm/dwi, that over 4 |wo·m|, which cancels.
        let jacobian = fault!("half_vector_jacobian_missing", 0.25, 2.0 * length);
        let pdf = jacobian * Ggx::g1_over_cos(cos_o, span_o) * d;
        Some((f, pdf))
    }
}

impl BsdfModel for RoughConductor {
    const NAME: &'static str = "rough_conductor";
    const ABOUT: &'static str = "a rough metal";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("reflectance", "share of light reflected at normal incidence", 0.0, 1.0, Preset::Absent),
        Parameter::colour("eta", "index of refraction", 1e-3, 1e3, Preset::Absent),
        Parameter::colour("k", "extinction index", 0.0, 1e3, Preset::Absent),
        Parameter::ROUGHNESS,
        Parameter::ALPHA,
        Parameter::ALPHA_X,
        Parameter::ALPHA_Y,
    ];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [reflectance, eta, k, roughness, alpha, alpha_x, alpha_y] = arguments.all();
        let alphas = alphas([roughness, alpha, alpha_x, alpha_y])?;
        match (reflectance.given_colour(), eta.given_colour(), k.given_colour()) {
            (Some(reflectance), None, None) => Ok(match alphas {
                Some((x, y)) => Self::from_reflectance(reflectance, x, y).into(),
                None => Mirror { reflectance }.into(),
            }),
            (None, Some(eta), Some(k)) => Ok(match alphas {
                Some((x, y)) => Self::new(eta, k, x, y).into(),
                None => Mirror { reflectance: fresnel_conductor(1.0, eta, k) }.into(),
            }),
            _ => Err(Misfit::new("reflectance", "give either `reflectance`, or both `eta` and `k`")),
        }
    }

    fn is_anisotropic(&self) -> bool {
        self.ggx.is_anisotropic()
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
    fn sample(&self, wo: Vec3, _uc: f32, u: Vec2, _mode: TransportMode) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        // The surface is its own mirror image, so work above it and come back.
        let above = wo.with_z(wo.z.abs());
        let m = self.ggx.sample_visible(above, u);
        let o_m = above.dot(m);
        let wi = reflect(above, m);
        // Below the horizon another facet is met; wo·m ≤ 0 is rounding at grazing angles.
        if wi.z <= 0.0 || o_m <= 0.0 {
            return None;
        }
        let (span_o, span_i) = (self.ggx.span(above), self.ggx.span(wi));
        let pdf = 0.25 * self.ggx.visible_over_cos(above.z, span_o, m);
        // F G₂ / G₁(wo): the density cancels all else.
        let shadowing = wi.z * (above.z + span_o) / (span_o * wi.z + span_i * above.z);
        let weight = fresnel_conductor(o_m, self.eta, self.k) * shadowing;
        let wi = wi.with_z(wi.z.copysign(wo.z));
        Some(BsdfSample { wi, weight, pdf, lobe: Lobes::GLOSSY_REFLECTION, eta: 1.0 })
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
        let gold = (Spectrum::new(0.143, 0.375, 1.442), Spectrum::new(3.983, 2.386, 1.603));
        vec![
            Self::new(gold.0, gold.1, 0.1, 0.1),
            Self::new(gold.0, gold.1, 0.05, 0.4),
            Self::new(gold.0, gold.1, 1.0, 1.0),
            Self::from_reflectance(Spectrum::ONE, 0.5, 0.5),
            Self::from_reflectance(Spectrum::new(0.9, 0.5, 0.0), 0.3, 0.3),
            Self::from_reflectance(Spectrum::ONE, 0.01, 0.01),
            Self::from_reflectance(Spectrum::ONE, Ggx::MIN_ALPHA, Ggx::MIN_ALPHA),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reflectance_is_met_at_the_normal_and_never_falls_towards_grazing() {
        for r in [0.0, 0.01, 0.3, 0.5, 0.9, 0.99, 1.0] {
            let metal = RoughConductor::from_reflectance(Spectrum::splat(r), 0.1, 0.1);
            let mut last = r;
            for i in 0..=100 {
                let cos = 1.0 - i as f32 * 0.009_99;
                let f = fresnel_conductor(cos, metal.eta, metal.k).max_component();
                assert!(i > 0 || (f - r).abs() < 1e-6, "{r}: {f}");
                assert!(f >= last - 1e-6 && f <= 1.0 + 1e-6, "{r} at {cos}: {f} after {last}");
                last = f;
            }
        }
    }
}
