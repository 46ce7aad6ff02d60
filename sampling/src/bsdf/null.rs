//! A surface that does nothing but let light through.

use super::delta::scatters_by_delta_lobes;
use super::{Arguments, Bsdf, BsdfModel, BsdfSample, Lobes, Misfit, Parameter, Preset, TransportMode, survival_of};
use crate::math::Spectrum;
use glam::{Vec2, Vec3};

/// A delta lobe straight on, whose transmittance does not depend on the angle.
///
/// With a transmittance of 1 there is nothing to see: the surface only bounds something, such as a medium. A walk still
/// meets it, which counts as a scattering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Null {
    /// The share of light that passes, in [0, 1].
    pub transmittance: Spectrum,
}

impl BsdfModel for Null {
    const NAME: &'static str = "null";
    const ABOUT: &'static str = "a transparent surface: light passes straight on";
    const PARAMETERS: &'static [Parameter] =
        &[Parameter::colour("transmittance", "share of light that passes", 0.0, 1.0, Preset::Number(1.0))];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [transmittance] = arguments.all();
        Ok(Self { transmittance: transmittance.colour() }.into())
    }

    scatters_by_delta_lobes!();

    #[inline]
    fn sample(&self, wo: Vec3, _uc: f32, _u: Vec2, _mode: TransportMode) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        Some(BsdfSample { wi: -wo, weight: self.transmittance, pdf: 1.0, lobe: Lobes::DELTA_TRANSMISSION, eta: 1.0 })
    }

    #[inline]
    fn lobes(&self) -> Lobes {
        Lobes::DELTA_TRANSMISSION
    }

    #[inline]
    fn survival(&self) -> f32 {
        survival_of(self.transmittance)
    }

    fn examples() -> Vec<Self> {
        [Spectrum::ONE, Spectrum::new(0.9, 0.5, 0.0), Spectrum::ZERO]
            .map(|transmittance| Self { transmittance })
            .to_vec()
    }
}
