//! A thin pane of glass.

use super::delta::scatters_by_delta_lobes;
use super::fresnel::fresnel_dielectric;
use super::{Arguments, Bsdf, BsdfModel, BsdfSample, Lobes, Misfit, Parameter, TransportMode};
use crate::math::Spectrum;
use glam::{Vec2, Vec3, vec3};

/// A slab with two parallel faces, so thin that light leaves where it came in: it is reflected, or passes straight on.
///
/// Between the faces light goes to and fro. With R and T = 1 − R of one face by Fresnel's equations, the whole reflects
/// R' = R + T² R (1 + R² + R⁴ + …) = R + T² R / (1 − R²) = 2R / (1 + R) and lets T' = (1 − R) / (1 + R) pass: the geometric
/// series of `[Stokes1862]` for unpolarised light of no coherence.
///
/// Nothing is absorbed. R is the mean over both polarisations before it is summed, as usual in rendering; summed apart, R'
/// would be up to 0.022 less at an index of 1.5. Beyond the critical angle of an index below 1 all is reflected,
/// though a gap that is thinner than a wavelength would let some pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinGlass {
    /// The index of the slab relative to the medium around it, > 0. At 1 light passes straight on.
    pub eta: f32,
}

impl BsdfModel for ThinGlass {
    const NAME: &'static str = "thin_glass";
    const ABOUT: &'static str = "a thin pane of glass, which bends nothing";
    const PARAMETERS: &'static [Parameter] = &[Parameter::INDEX];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [eta] = arguments.all();
        Ok(Self { eta: eta.number() }.into())
    }

    scatters_by_delta_lobes!();

    #[inline]
    fn sample(&self, wo: Vec3, uc: f32, _u: Vec2, _mode: TransportMode) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let face = fresnel_dielectric(wo.z.abs(), self.eta);
        let share = 1.0 / (1.0 + face.reflected);
        let (reflected, transmitted) = (2.0 * face.reflected * share, face.transmitted * share);
        if uc < reflected || transmitted == 0.0 {
            let wi = vec3(-wo.x, -wo.y, wo.z);
            let lobe = Lobes::DELTA_REFLECTION;
            return Some(BsdfSample { wi, weight: Spectrum::ONE, pdf: reflected, lobe, eta: 1.0 });
        }
        let lobe = Lobes::DELTA_TRANSMISSION;
        Some(BsdfSample { wi: -wo, weight: Spectrum::ONE, pdf: transmitted, lobe, eta: 1.0 })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_faces_are_summed_as_a_series() {
        for cos in [1.0_f32, 0.7, 0.3, 0.1, 1e-2] {
            let r = f64::from(fresnel_dielectric(cos, 1.5).reflected);
            let sum: f64 = r + (0..2000).map(|i| (1.0 - r).powi(2) * r.powi(2 * i + 1)).sum::<f64>();
            let wo = vec3((1.0 - cos * cos).sqrt(), 0.0, cos);
            let sample = ThinGlass { eta: 1.5 }.sample(wo, 0.0, Vec2::ZERO, TransportMode::Radiance);
            let pdf = f64::from(sample.expect("a reflection").pdf);
            assert!((pdf - sum).abs() < 1e-6, "{cos}: {pdf} {sum}");
        }
    }
}
