//! A rough interface between two transparent media: microfacets that reflect and refract.

use super::fresnel::{DielectricFresnel, fresnel_dielectric};
use super::roughness::alphas;
use super::{Arguments, Bsdf, BsdfModel, BsdfSample, Dielectric, Ggx, Lobes, Misfit, Parameter, TransportMode};
use crate::math::{Spectrum, reflect};
use glam::{Vec2, Vec3};

/// Reflection [Walter07, (20)] and refraction [Walter07, (21)] by GGX facets, chosen by Fresnel's equations at the facet.
///
/// Visible normals are sampled. G₂ of a reflection is Smith's for correlated heights [Heitz14, (99)]; the two sides of a
/// refraction are taken as independent, G₁ G₁ [Walter07, (23)]. Light scattered more than once among the facets is lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughDielectric {
    eta: f32,
    ggx: Ggx,
}

impl RoughDielectric {
    /// An interface whose inside (z < 0) has the index `eta` > 0 relative to the outside, with roughness α_x along x, α_y
    /// along y, at least [`Ggx::MIN_ALPHA`]. With `eta` = 1 there is nothing to see: light passes straight on.
    pub fn new(eta: f32, alpha_x: f32, alpha_y: f32) -> Self {
        Self { eta, ggx: Ggx::new(alpha_x, alpha_y) }
    }

    /// [`new`](Self::new) with this distribution of normals.
    #[inline]
    pub(super) fn with_ggx(eta: f32, ggx: Ggx) -> Self {
        Self { eta, ggx }
    }

    /// The index on the far side of the interface relative to that on the side of `wo`.
    #[inline]
    fn relative_index(&self, wo: Vec3) -> f32 {
        if wo.z > 0.0 { self.eta } else { 1.0 / self.eta }
    }

    #[inline]
    fn value_and_density(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Option<(f32, f32, Lobes)> {
        if wo.z == 0.0 || wi.z == 0.0 || self.eta == 1.0 {
            return None;
        }
        let eta = self.relative_index(wo);
        // The surface is its own mirror image: put wo above it.
        let side = 1.0_f32.copysign(wo.z);
        let (wo, wi) = (wo.with_z(wo.z.abs()), wi.with_z(wi.z * side));
        if wi.z > 0.0 { self.reflection(wo, wi, eta) } else { self.refraction(wo, wi, eta, mode) }
    }

    #[inline]
    fn reflection(&self, wo: Vec3, wi: Vec3, eta: f32) -> Option<(f32, f32, Lobes)> {
        let sum = wo + wi;
        let length2 = sum.length_squared();
        if length2 == 0.0 {
            return None;
        }
        let length = length2.sqrt();
        let m = sum / length;
        let (span_o, span_i) = (self.ggx.span(wo), self.ggx.span(wi));
        // The directions are unit, so wo·m = wi·m = |wo + wi| / 2, which does not cancel at grazing angles.
        let fd = fresnel_dielectric(0.5 * length, eta).reflected * self.ggx.d(m);
        let f = 0.5 * fd / (span_o * wi.z + span_i * wo.z);
        let pdf = 0.25 * fd * Ggx::g1_over_cos(wo.z, span_o);
        Some((f, pdf, Lobes::GLOSSY_REFLECTION))
    }

    #[inline]
    fn refraction(&self, wo: Vec3, wi: Vec3, eta: f32, mode: TransportMode) -> Option<(f32, f32, Lobes)> {
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
        let (cos_i, span_o, span_i) = (-wi.z, self.ggx.span(wo), self.ggx.span(wi));
        // F is the same from both sides, but only from the thinner medium it keeps its digits near the critical angle.
        let (thin, index) = if eta > 1.0 { (o_m, eta) } else { (i_m, 1.0 / eta) };
        let transmitted = fresnel_dielectric(thin, index).transmitted;
        // dm/dwi = η² |wi·m| / |h|² [Walter07, (17)].
        let common = transmitted * self.ggx.d(m) * o_m * i_m * Ggx::g1_over_cos(wo.z, span_o) * (eta * eta / length2);
        let f = common * Ggx::g1_over_cos(cos_i, span_i) * mode.transmission_scale(eta);
        Some((f, common, Lobes::GLOSSY_TRANSMISSION))
    }
}

impl BsdfModel for RoughDielectric {
    const NAME: &'static str = "rough_dielectric";
    const ABOUT: &'static str = "a rough interface between two transparent media, such as ground glass";
    const PARAMETERS: &'static [Parameter] =
        &[Parameter::INDEX, Parameter::ROUGHNESS, Parameter::ALPHA, Parameter::ALPHA_X, Parameter::ALPHA_Y];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [eta, roughness, alpha, alpha_x, alpha_y] = arguments.all();
        let eta = eta.number();
        Ok(match alphas([roughness, alpha, alpha_x, alpha_y])? {
            Some((x, y)) => Self::new(eta, x, y).into(),
            None => Dielectric { eta }.into(),
        })
    }

    fn is_anisotropic(&self) -> bool {
        self.ggx.is_anisotropic()
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
        let eta = self.relative_index(wo);
        let above = wo.with_z(wo.z.abs());
        let m = self.ggx.sample_visible(above, u);
        let o_m = above.dot(m);
        if o_m <= 0.0 {
            return None;
        }
        let DielectricFresnel { reflected, transmitted, cos_t: i_m } = fresnel_dielectric(o_m, eta);
        let span_o = self.ggx.span(above);
        let visible = self.ggx.visible_over_cos(above.z, span_o, m);
        let back = |wi: Vec3| wi.with_z(wi.z * 1.0_f32.copysign(wo.z));
        if uc < reflected {
            let wi = reflect(above, m);
            if wi.z <= 0.0 {
                return None;
            }
            let pdf = 0.25 * reflected * visible;
            let shadowing = wi.z * (above.z + span_o) / (span_o * wi.z + self.ggx.span(wi) * above.z);
            let weight = Spectrum::splat(shadowing);
            return Some(BsdfSample { wi: back(wi), weight, pdf, lobe: Lobes::GLOSSY_REFLECTION, eta: 1.0 });
        }
        let wi = (o_m / eta - i_m) * m - above / eta;
        if wi.z >= 0.0 {
            return None;
        }
        // |h| = |wo·m − η |wi·m||, which by Snell's law is |η² − 1| / (wo·m + η |wi·m|).
        let length = (eta - 1.0) * (eta + 1.0) / (o_m + eta * i_m);
        let pdf = transmitted * visible * o_m * i_m * (eta * eta / (length * length));
        let shadowing = -wi.z * Ggx::g1_over_cos(-wi.z, self.ggx.span(wi));
        let weight = Spectrum::splat(shadowing * mode.transmission_scale(eta));
        Some(BsdfSample { wi: back(wi), weight, pdf, lobe: Lobes::GLOSSY_TRANSMISSION, eta })
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
            Self::new(1.0, 0.3, 0.3),
        ]
    }
}
