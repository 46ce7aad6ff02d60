//! Ideal diffuse reflection.

use super::{Arguments, Bsdf, BsdfModel, BsdfSample, Lobes, Misfit, Parameter, Preset, TransportMode, survival_of};
use crate::fault;
use crate::math::{Spectrum, same_hemisphere};
use crate::warp::{INV_PI, cosine_hemisphere, cosine_hemisphere_pdf};
use glam::{Vec2, Vec3};

/// f_s = albedo / π where both directions are on one side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lambert {
    /// The share of light that is reflected, in [0, 1].
    pub albedo: Spectrum,
}

impl BsdfModel for Lambert {
    const NAME: &'static str = "lambert";
    const ABOUT: &'static str = "ideal diffuse reflection";
    const PARAMETERS: &'static [Parameter] =
        &[Parameter::colour("albedo", "share of light that is reflected", 0.0, 1.0, Preset::Number(0.5))];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [albedo] = arguments.all();
        Ok(Self { albedo: albedo.colour() }.into())
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, lobes: Lobes, _mode: TransportMode) -> Spectrum {
        if !same_hemisphere(wo, wi) || !lobes.contains(Lobes::DIFFUSE_REFLECTION) {
            return Spectrum::ZERO;
        }
        self.albedo * fault!("lambert_without_pi", INV_PI, 1.0)
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> f32 {
        if !same_hemisphere(wo, wi) {
            return 0.0;
        }
        cosine_hemisphere_pdf(wi.z.abs())
    }

    #[inline]
    fn sample(&self, wo: Vec3, _uc: f32, u: Vec2, _mode: TransportMode) -> Option<BsdfSample> {
        let up = cosine_hemisphere(u);
        let pdf = cosine_hemisphere_pdf(up.z);
        if wo.z == 0.0 || pdf == 0.0 {
            return None;
        }
        let wi = up.with_z(up.z.copysign(wo.z));
        Some(BsdfSample { wi, weight: self.albedo, pdf, lobe: Lobes::DIFFUSE_REFLECTION, eta: 1.0 })
    }

    #[inline]
    fn lobes(&self) -> Lobes {
        Lobes::DIFFUSE_REFLECTION
    }

    #[inline]
    fn survival(&self) -> f32 {
        survival_of(self.albedo)
    }

    fn examples() -> Vec<Self> {
        [Spectrum::ONE, Spectrum::new(0.63, 0.065, 0.05), Spectrum::ZERO].map(|albedo| Self { albedo }).to_vec()
    }
}
