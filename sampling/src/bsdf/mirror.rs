//! Ideal specular reflection.

use super::delta::scatters_by_delta_lobes;
use super::{Arguments, Bsdf, BsdfModel, BsdfSample, Lobes, Misfit, Parameter, Preset, TransportMode, survival_of};
use crate::math::Spectrum;
use glam::{Vec2, Vec3, vec3};

/// A delta lobe about the mirror direction; its reflectance does not depend on the angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// The share of light that is reflected, in [0, 1].
    pub reflectance: Spectrum,
}

impl BsdfModel for Mirror {
    const NAME: &'static str = "mirror";
    const ABOUT: &'static str = "ideal specular reflection, alike at every angle";
    const PARAMETERS: &'static [Parameter] =
        &[Parameter::colour("reflectance", "share of light that is reflected", 0.0, 1.0, Preset::Number(1.0))];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [reflectance] = arguments.all();
        Ok(Self { reflectance: reflectance.colour() }.into())
    }

    scatters_by_delta_lobes!();

    #[inline]
    fn sample(&self, wo: Vec3, _uc: f32, _u: Vec2, _mode: TransportMode) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let wi = vec3(-wo.x, -wo.y, wo.z);
        Some(BsdfSample { wi, weight: self.reflectance, pdf: 1.0, lobe: Lobes::DELTA_REFLECTION, eta: 1.0 })
    }

    #[inline]
    fn lobes(&self) -> Lobes {
        Lobes::DELTA_REFLECTION
    }

    #[inline]
    fn survival(&self) -> f32 {
        survival_of(self.reflectance)
    }

    fn examples() -> Vec<Self> {
        [Spectrum::ONE, Spectrum::new(0.95, 0.5, 0.1), Spectrum::ZERO].map(|reflectance| Self { reflectance }).to_vec()
    }
}
