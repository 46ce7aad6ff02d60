//! A smooth metal.

use super::delta::scatters_by_delta_lobes;
use super::metals::{complex_index, index_of_reflectance};
use super::{
    Arguments, Bsdf, BsdfModel, BsdfSample, Lobes, Misfit, Parameter, TransportMode, fresnel_conductor, survival_of,
};
use crate::math::Spectrum;
use glam::{Vec2, Vec3, vec3};

/// A delta lobe about the mirror direction, with Fresnel's reflectance of a complex index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conductor {
    eta: Spectrum,
    k: Spectrum,
}

impl Conductor {
    /// A metal of complex index `eta` + i `k` relative to the medium around it; ≥ 0, not both 0.
    pub fn new(eta: Spectrum, k: Spectrum) -> Self {
        Self { eta, k }
    }

    /// A metal that reflects `reflectance`, in [0, 1], at normal incidence; see
    /// [`RoughConductor::from_reflectance`](super::RoughConductor::from_reflectance).
    pub fn from_reflectance(reflectance: Spectrum) -> Self {
        let (eta, k) = index_of_reflectance(reflectance);
        Self::new(eta, k)
    }
}

impl BsdfModel for Conductor {
    const NAME: &'static str = "conductor";
    const ABOUT: &'static str = "a smooth metal";
    const PARAMETERS: &'static [Parameter] = &[Parameter::REFLECTANCE, Parameter::METAL, Parameter::ETA, Parameter::K];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let (eta, k) = complex_index(arguments.all())?;
        Ok(Self::new(eta, k).into())
    }

    scatters_by_delta_lobes!();

    #[inline]
    fn sample(&self, wo: Vec3, _uc: f32, _u: Vec2, _mode: TransportMode) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let wi = vec3(-wo.x, -wo.y, wo.z);
        let weight = fresnel_conductor(wo.z.abs(), self.eta, self.k);
        Some(BsdfSample { wi, weight, pdf: 1.0, lobe: Lobes::DELTA_REFLECTION, eta: 1.0 })
    }

    #[inline]
    fn lobes(&self) -> Lobes {
        Lobes::DELTA_REFLECTION
    }

    #[inline]
    fn survival(&self) -> f32 {
        survival_of(fresnel_conductor(1.0, self.eta, self.k))
    }

    fn examples() -> Vec<Self> {
        let gold = (Spectrum::new(0.188, 0.544, 1.332), Spectrum::new(3.403, 2.231, 1.869));
        vec![
            Self::new(gold.0, gold.1),
            Self::from_reflectance(Spectrum::ONE),
            Self::from_reflectance(Spectrum::new(0.9, 0.5, 0.0)),
        ]
    }
}
