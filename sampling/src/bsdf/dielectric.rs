//! A smooth interface between two transparent media.

use super::delta::scatters_by_delta_lobes;
use super::fresnel::{DielectricFresnel, fresnel_dielectric};
use super::{Arguments, Bsdf, BsdfModel, BsdfSample, Lobes, Misfit, Parameter, TransportMode};
use crate::math::Spectrum;
use glam::{Vec2, Vec3, vec3};

/// A delta lobe of reflection and one of refraction, chosen by Fresnel's equations. Nothing is absorbed.
///
/// The pmf of a lobe is the same from both ends of it: F is symmetric under reversal of the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// The index of the inside (z < 0) relative to the outside, > 0. At 1 light passes straight on.
    pub eta: f32,
}

impl BsdfModel for Dielectric {
    const NAME: &'static str = "dielectric";
    const ABOUT: &'static str = "a smooth interface between two transparent media, such as glass";
    const PARAMETERS: &'static [Parameter] = &[Parameter::INDEX];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [eta] = arguments.all();
        Ok(Self { eta: eta.number() }.into())
    }

    scatters_by_delta_lobes!();

    #[inline]
    fn sample(&self, wo: Vec3, uc: f32, _u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let eta = if wo.z > 0.0 { self.eta } else { 1.0 / self.eta };
        let DielectricFresnel { reflected, transmitted, cos_t } = fresnel_dielectric(wo.z.abs(), eta);
        if uc < reflected {
            let wi = vec3(-wo.x, -wo.y, wo.z);
            return Some(BsdfSample {
                wi,
                weight: Spectrum::ONE,
                pdf: reflected,
                lobe: Lobes::DELTA_REFLECTION,
                eta: 1.0,
            });
        }
        let wi = vec3(-wo.x / eta, -wo.y / eta, -cos_t.copysign(wo.z));
        let weight = Spectrum::splat(mode.transmission_scale(eta));
        Some(BsdfSample { wi, weight, pdf: transmitted, lobe: Lobes::DELTA_TRANSMISSION, eta })
    }

    fn fixed(&self) -> &'static [&'static str] {
        &["eta"]
    }

    #[inline]
    fn lobes(&self) -> Lobes {
        if self.eta == 1.0 { Lobes::DELTA_TRANSMISSION } else { Lobes::DELTA }
    }

    #[inline]
    fn survival(&self) -> f32 {
        1.0
    }

    fn examples() -> Vec<Self> {
        [1.5, 1.0 / 1.5, 2.4, 1.000_1, 1.0].map(|eta| Self { eta }).to_vec()
    }
}
