//! Phong's reflection in its physically plausible form.

use super::parts::{Parts, TwoParts, diffuse_share, lobes_of, power_of_cosine, scatters_in_two_parts, without_gain};
use super::{Arguments, Bsdf, BsdfModel, Lobes, Misfit, Parameter, Preset, survival_of};
use crate::math::{Frame, Spectrum};
use crate::warp::{INV_2PI, INV_PI, power_cosine_hemisphere, power_cosine_hemisphere_pdf};
use glam::{Vec2, Vec3};

/// f_s = kd/π + ks (n + 2)/2π cosⁿα, with α in [0, π/2] the angle between `wi` and the mirror image of `wo`
/// [Phong75; Lafortune94].
///
/// The directional albedo is kd + ks at the normal and less elsewhere: the part of the lobe below the horizon is lost, at
/// grazing angles half of it and, by the cosine, nearly all of the rest. The glossy part is sampled by its lobe
/// [Lafortune94, section 4]; samples below the horizon fail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phong {
    kd: Spectrum,
    ks: Spectrum,
    n: f32,
    diffuse_pmf: f32,
}

impl Phong {
    /// The diffuse and the glossy albedo at the normal, whose sum is at most 1, and the exponent n ≥ 0.
    pub fn new(kd: Spectrum, ks: Spectrum, n: f32) -> Self {
        Self { kd, ks, n, diffuse_pmf: diffuse_share(kd, ks) }
    }
}

impl TwoParts for Phong {
    #[inline(always)]
    fn diffuse_pmf(&self, _wo: Vec3) -> f32 {
        self.diffuse_pmf
    }

    #[inline(always)]
    fn parts(&self, wo: Vec3, wi: Vec3) -> Parts {
        // The distance from the mirror image, (−x, −y, z), says more of small angles than their cosine.
        let distance2 = Vec3::new(wo.x + wi.x, wo.y + wi.y, wo.z - wi.z).length_squared();
        let power = power_of_cosine(distance2, self.n);
        Parts {
            diffuse: self.kd * INV_PI,
            glossy: self.ks * ((self.n + 2.0) * INV_2PI * power),
            glossy_pdf: power_cosine_hemisphere_pdf(power, self.n),
        }
    }

    #[inline(always)]
    fn sample_glossy(&self, wo: Vec3, _uc: f32, u: Vec2) -> Option<Vec3> {
        let mirrored = Frame::from_z(Vec3::new(-wo.x, -wo.y, wo.z));
        let wi = mirrored.to_world(power_cosine_hemisphere(u, self.n));
        (wi.z > 0.0).then_some(wi)
    }
}

impl BsdfModel for Phong {
    const NAME: &'static str = "phong";
    const ABOUT: &'static str = "Phong's cosine lobe about the mirror direction, normalised, on a diffuse base";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("kd", "albedo of the diffuse part", 0.0, 1.0, Preset::Number(0.4)),
        Parameter::colour("ks", "albedo of the glossy part at the normal", 0.0, 1.0, Preset::Number(0.4)),
        Parameter::number("n", "exponent of the lobe", 0.0, 1e6, Preset::Number(50.0)),
    ];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [kd, ks, n] = arguments.all();
        let (kd, ks) = (kd.colour(), ks.colour());
        without_gain(["kd", "ks"], kd, ks)?;
        Ok(Self::new(kd, ks, n.number()).into())
    }

    scatters_in_two_parts!();

    #[inline]
    fn lobes(&self) -> Lobes {
        lobes_of(self.kd, self.ks)
    }

    #[inline]
    fn survival(&self) -> f32 {
        survival_of(self.kd + self.ks)
    }

    fn examples() -> Vec<Self> {
        vec![
            Self::new(Spectrum::new(0.4, 0.2, 0.1), Spectrum::splat(0.5), 50.0),
            Self::new(Spectrum::ZERO, Spectrum::ONE, 5.0),
            Self::new(Spectrum::ZERO, Spectrum::ONE, 0.0),
            Self::new(Spectrum::ZERO, Spectrum::ONE, 1e6),
            Self::new(Spectrum::ZERO, Spectrum::ZERO, 50.0),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::albedo::albedo;

    #[test]
    fn all_is_reflected_at_the_normal_and_nowhere_more() {
        for n in [0.0, 1.0, 5.0, 50.0, 1e3, 1e6] {
            let phong = Phong::new(Spectrum::ZERO, Spectrum::ONE, n);
            assert!((albedo(phong, 1.0) - 1.0).abs() < 1e-3, "{n}: {}", albedo(phong, 1.0));
            assert!(albedo(phong, 0.5) < 1.001 && albedo(phong, 0.1) < 1.001, "{n}");
        }
    }
}
