//! Blinn's form of Phong's reflection: a lobe about the half vector.

use super::blinn_normals::BlinnNormals;
use super::grooves::Facets;
use super::half::Half;
use super::parts::{Parts, TwoParts, diffuse_share, lobes_of, scatters_in_two_parts, without_gain};
use super::v_cavities::reflect_visibly;
use super::{Arguments, Bsdf, BsdfModel, Lobes, Misfit, Parameter, Preset, survival_of};
use crate::math::Spectrum;
use crate::warp::INV_PI;
use glam::{Vec2, Vec3};

/// f_s = kd/π + ks C D(m), with D(m) = (n + 2)/2π cosⁿθ_m for the half vector m `[Blinn77]`.
///
/// D is normalised as a density of facets, ∫ D cos θ dm = 1, and the factor C = (n + 4) / (4 (n + 2^(−n/2))) makes the albedo
/// at the normal kd + ks: there ∫ cosⁿ(θ/2) cos θ dω = 8π (n + 2^(−n/2)) / ((n + 2)(n + 4)). The albedo is less elsewhere.
/// Towards large n, C is 1/4: next to the microfacet form F D G / (4 cos θ_o cos θ_i) the geometric factor is
/// G = cos θ_o cos θ_i, which is reciprocal and darkens grazing angles. There is no Fresnel factor either; for both see
/// [`BlinnTorrance`](super::BlinnTorrance).
///
/// Sampled by the normals that are visible among V-shaped grooves, as that model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlinnPhong {
    kd: Spectrum,
    /// ks C.
    ks_c: Spectrum,
    normals: BlinnNormals,
    diffuse_pmf: f32,
    survival: f32,
}

impl BlinnPhong {
    /// The diffuse and the glossy albedo at the normal, whose sum is at most 1, and the exponent n ≥ 0.
    pub fn new(kd: Spectrum, ks: Spectrum, n: f32) -> Self {
        let c = (n + 4.0) / (4.0 * (n + (-0.5 * n).exp2()));
        Self {
            kd,
            ks_c: ks * c,
            normals: BlinnNormals::new(n),
            diffuse_pmf: diffuse_share(kd, ks),
            survival: survival_of(kd + ks),
        }
    }
}

impl TwoParts for BlinnPhong {
    #[inline(always)]
    fn diffuse_pmf(&self, _wo: Vec3) -> f32 {
        self.diffuse_pmf
    }

    #[inline(always)]
    fn parts(&self, wo: Vec3, wi: Vec3) -> Parts {
        let diffuse = self.kd * INV_PI;
        let Some(half) = Half::of(wo, wi) else { return Parts::diffuse(diffuse) };
        let d = self.normals.d(half.m);
        Parts { diffuse, glossy: self.ks_c * d, glossy_pdf: half.visible_pdf(d, wo.z, wi.z) }
    }

    #[inline(always)]
    fn sample_glossy(&self, wo: Vec3, uc: f32, u: Vec2) -> Option<Vec3> {
        reflect_visibly(wo, self.normals.sample(u), uc)
    }
}

impl BsdfModel for BlinnPhong {
    const NAME: &'static str = "blinn_phong";
    const ABOUT: &'static str = "Blinn's cosine lobe about the half vector, normalised, on a diffuse base";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("kd", "albedo of the diffuse part", 0.0, 1.0, Preset::Number(0.4)),
        Parameter::colour("ks", "albedo of the glossy part at the normal", 0.0, 1.0, Preset::Number(0.4)),
        Parameter::number("n", "exponent of the lobe, some 4 times that of Phong's", 0.0, 1e6, Preset::Number(200.0)),
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
        lobes_of(self.kd, self.ks_c)
    }

    #[inline]
    fn survival(&self) -> f32 {
        self.survival
    }

    fn examples() -> Vec<Self> {
        vec![
            Self::new(Spectrum::new(0.4, 0.2, 0.1), Spectrum::splat(0.5), 200.0),
            Self::new(Spectrum::ZERO, Spectrum::ONE, 10.0),
            Self::new(Spectrum::ZERO, Spectrum::ONE, 0.0),
            Self::new(Spectrum::ZERO, Spectrum::ONE, 1e6),
            Self::new(Spectrum::ZERO, Spectrum::ZERO, 200.0),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::albedo::albedo;

    #[test]
    fn all_is_reflected_at_the_normal_and_nowhere_more() {
        for n in [0.0, 0.3, 1.0, 2.0, 5.0, 50.0, 1e3, 1e6] {
            let blinn = BlinnPhong::new(Spectrum::ZERO, Spectrum::ONE, n);
            assert!((albedo(blinn, 1.0) - 1.0).abs() < 1e-3, "{n}: {}", albedo(blinn, 1.0));
            for i in 1..20 {
                assert!(albedo(blinn, i as f32 * 0.05) < 1.004, "{n} {i}: {}", albedo(blinn, i as f32 * 0.05));
            }
        }
    }
}
