//! Ideal diffuse reflection and transmission.

use super::parts::{diffuse_share, without_gain};
use super::{Arguments, Bsdf, BsdfModel, BsdfSample, Lobes, Misfit, Parameter, Preset, TransportMode, survival_of};
use crate::math::{Spectrum, same_hemisphere};
use crate::warp::{INV_PI, cosine_hemisphere, cosine_hemisphere_pdf};
use glam::{Vec2, Vec3};

/// A thin sheet, such as paper or a leaf: f_s = reflectance / π where both directions are on one side, transmittance / π where they
/// are not. There is the same medium on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiffuseTransmission {
    reflectance: Spectrum,
    transmittance: Spectrum,
    reflection_pmf: f32,
}

impl DiffuseTransmission {
    /// The shares of light that are reflected and that pass, whose sum is at most 1.
    pub fn new(reflectance: Spectrum, transmittance: Spectrum) -> Self {
        Self { reflectance, transmittance, reflection_pmf: diffuse_share(reflectance, transmittance) }
    }
}

impl BsdfModel for DiffuseTransmission {
    const NAME: &'static str = "diffuse_transmission";
    const ABOUT: &'static str = "a thin sheet that reflects and lets pass into all directions alike";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("reflectance", "share of light that is reflected", 0.0, 1.0, Preset::Number(0.4)),
        Parameter::colour("transmittance", "share of light that passes", 0.0, 1.0, Preset::Number(0.4)),
    ];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [reflectance, transmittance] = arguments.all();
        let (reflectance, transmittance) = (reflectance.colour(), transmittance.colour());
        without_gain(["reflectance", "transmittance"], reflectance, transmittance)?;
        Ok(Self::new(reflectance, transmittance).into())
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, lobes: Lobes, _mode: TransportMode) -> Spectrum {
        let (share, lobe) = if same_hemisphere(wo, wi) {
            (self.reflectance, Lobes::DIFFUSE_REFLECTION)
        } else {
            (self.transmittance, Lobes::DIFFUSE_TRANSMISSION)
        };
        if wo.z * wi.z == 0.0 || !lobes.contains(lobe) { Spectrum::ZERO } else { share * INV_PI }
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> f32 {
        let pmf = if same_hemisphere(wo, wi) { self.reflection_pmf } else { 1.0 - self.reflection_pmf };
        if wo.z == 0.0 { 0.0 } else { pmf * cosine_hemisphere_pdf(wi.z.abs()) }
    }

    #[inline]
    fn sample(&self, wo: Vec3, uc: f32, u: Vec2, _mode: TransportMode) -> Option<BsdfSample> {
        let (share, pmf, side, lobe) = if uc < self.reflection_pmf {
            (self.reflectance, self.reflection_pmf, wo.z, Lobes::DIFFUSE_REFLECTION)
        } else {
            (self.transmittance, 1.0 - self.reflection_pmf, -wo.z, Lobes::DIFFUSE_TRANSMISSION)
        };
        let up = cosine_hemisphere(u);
        let pdf = pmf * cosine_hemisphere_pdf(up.z);
        if side == 0.0 || pdf == 0.0 {
            return None;
        }
        Some(BsdfSample { wi: up.with_z(up.z.copysign(side)), weight: share / pmf, pdf, lobe, eta: 1.0 })
    }

    #[inline]
    fn lobes(&self) -> Lobes {
        match (self.reflectance.is_zero(), self.transmittance.is_zero()) {
            (_, true) => Lobes::DIFFUSE_REFLECTION,
            (true, false) => Lobes::DIFFUSE_TRANSMISSION,
            (false, false) => Lobes::DIFFUSE_REFLECTION | Lobes::DIFFUSE_TRANSMISSION,
        }
    }

    #[inline]
    fn survival(&self) -> f32 {
        survival_of(self.reflectance + self.transmittance)
    }

    fn examples() -> Vec<Self> {
        let green = (Spectrum::new(0.05, 0.2, 0.02), Spectrum::new(0.1, 0.4, 0.05));
        let only = (Spectrum::ZERO, Spectrum::ONE);
        [green, only, (Spectrum::splat(0.5), Spectrum::splat(0.5))].map(|(r, t)| Self::new(r, t)).to_vec()
    }
}
