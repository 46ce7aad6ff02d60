//! Blinn's reflection with Torrance and Sparrow's geometry and Fresnel's equations.

use super::blinn_normals::BlinnNormals;
use super::parts::{Parts, TwoParts, diffuse_share, lobes_of, scatters_in_two_parts, without_gain};
use super::v_cavities::{Half, visible_side};
use super::{Arguments, Bsdf, BsdfModel, Lobes, Misfit, Parameter, Preset, fresnel_conductor, survival_of};
use crate::math::{Spectrum, reflect};
use crate::warp::INV_PI;
use glam::{Vec2, Vec3};

/// f_s = kd/π + ks F(wo·m) D(m) G / (4 cos θ_o cos θ_i) with the half vector m [Torrance67; Blinn77].
///
/// D(m) = (n + 2)/2π cosⁿθ_m, G is that of V-shaped grooves, and F exact for the index η + i k, of metals or, with k = 0,
/// of dielectrics. `[Blinn77]` has F D G / cos θ_o, with a D of peak 1, for the brightness under one light; the factors 1/4
/// and (n + 2)/2π, and the cosine of the light, make of that a BRDF whose facets reflect what meets them, so that kd + ks ≤ 1
/// creates no light. Visible normals are sampled. Light scattered more than once is lost, and the diffuse part does not know
/// of the glossy part's Fresnel factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlinnTorrance {
    kd: Spectrum,
    ks: Spectrum,
    eta: Spectrum,
    k: Spectrum,
    normals: BlinnNormals,
    /// The albedo of the glossy part at normal incidence, but at least a 16th of what it may be.
    glossy: Spectrum,
    survival: f32,
}

impl BlinnTorrance {
    /// Facets of complex index `eta` + i `k` (not both 0) with the exponent n ≥ 0, scaled by `ks`, on a diffuse base of albedo
    /// `kd`; kd + ks ≤ 1.
    pub fn new(kd: Spectrum, ks: Spectrum, eta: Spectrum, k: Spectrum, n: f32) -> Self {
        let glossy = ks * fresnel_conductor(1.0, eta, k);
        Self {
            kd,
            ks,
            eta,
            k,
            normals: BlinnNormals::new(n),
            glossy: glossy.max(ks * (1.0 / 16.0)),
            survival: survival_of(kd + glossy),
        }
    }
}

impl TwoParts for BlinnTorrance {
    /// In proportion to the albedos with Schlick's factor of smooth facets, which rises towards grazing angles.
    #[inline]
    fn diffuse_pmf(&self, wo: Vec3) -> f32 {
        let c = (1.0 - wo.z).max(0.0);
        diffuse_share(self.kd, self.glossy + (self.ks - self.glossy) * (c * c * c * c * c))
    }

    #[inline]
    fn parts(&self, wo: Vec3, wi: Vec3) -> Parts {
        let diffuse = self.kd * INV_PI;
        let Some(half) = Half::of(wo, wi) else { return Parts::diffuse(diffuse) };
        let d = self.normals.d(half.m);
        let fresnel = fresnel_conductor(half.cos, self.eta, self.k);
        Parts {
            diffuse,
            glossy: self.ks * fresnel * (0.25 * d * half.g_over_cosines(wo.z, wi.z)),
            glossy_pdf: half.visible_pdf(d, wo.z, wi.z),
        }
    }

    #[inline]
    fn sample_glossy(&self, wo: Vec3, uc: f32, u: Vec2) -> Option<Vec3> {
        let wi = reflect(wo, visible_side(wo, self.normals.sample(u), uc));
        (wi.z > 0.0).then_some(wi)
    }
}

impl BsdfModel for BlinnTorrance {
    const NAME: &'static str = "blinn_torrance";
    const ABOUT: &'static str = "Blinn's lobe with the grooves of Torrance and Sparrow and Fresnel's equations";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("kd", "albedo of the diffuse part", 0.0, 1.0, Preset::Number(0.5)),
        Parameter::colour("ks", "scale of the glossy part", 0.0, 1.0, Preset::Number(0.5)),
        Parameter::colour("eta", "index of refraction of the facets", 1e-3, 1e3, Preset::Number(1.5)),
        Parameter::colour("k", "extinction index of the facets; 0 of dielectrics", 0.0, 1e3, Preset::Number(0.0)),
        Parameter::number("n", "exponent of the facets' density", 0.0, 1e6, Preset::Number(200.0)),
    ];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [kd, ks, eta, k, n] = arguments.all();
        let (kd, ks) = (kd.colour(), ks.colour());
        without_gain(kd, ks)?;
        Ok(Self::new(kd, ks, eta.colour(), k.colour(), n.number()).into())
    }

    scatters_in_two_parts!();

    #[inline]
    fn lobes(&self) -> Lobes {
        lobes_of(self.kd, self.ks)
    }

    #[inline]
    fn survival(&self) -> f32 {
        self.survival
    }

    fn examples() -> Vec<Self> {
        let copper = (Spectrum::new(0.27, 0.68, 1.32), Spectrum::new(3.61, 2.63, 2.29));
        let (half, glass) = (Spectrum::splat(0.5), Spectrum::splat(1.5));
        vec![
            Self::new(half, half, glass, Spectrum::ZERO, 200.0),
            Self::new(half, half, glass, Spectrum::ZERO, 2.0),
            Self::new(Spectrum::ZERO, Spectrum::ONE, copper.0, copper.1, 20.0),
            Self::new(Spectrum::ZERO, Spectrum::ONE, Spectrum::ONE, Spectrum::splat(1e3), 0.0),
            Self::new(Spectrum::ZERO, Spectrum::ONE, copper.0, copper.1, 1e6),
            Self::new(Spectrum::ZERO, Spectrum::ONE, Spectrum::ONE, Spectrum::ZERO, 20.0),
        ]
    }
}
