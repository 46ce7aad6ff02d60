//! Blinn's reflection with Torrance and Sparrow's geometry and Fresnel's equations.

use super::blinn_normals::BlinnNormals;
use super::grooves::Grooves;
use super::parts::{TwoParts, lobes_of, scatters_in_two_parts, without_gain};
use super::{Arguments, Bsdf, BsdfModel, Lobes, Misfit, Parameter, Preset};
use crate::math::Spectrum;

/// f_s = kd/π + ks F(wo·m) D(m) G / (4 cos θ_o cos θ_i) with the half vector m [Torrance67; Blinn77].
///
/// D(m) = (n + 2)/2π cosⁿθ_m, G is that of V-shaped grooves, and F exact for the index η + i k, of metals or, with k = 0,
/// of dielectrics. `[Blinn77]` has F D G / cos θ_o, with a D of peak 1, for the brightness under one light; the factors 1/4
/// and (n + 2)/2π, and the cosine of the light, make of that a BRDF whose facets reflect what meets them, so that kd + ks ≤ 1
/// creates no light. Visible normals are sampled. Light scattered more than once is lost, and the diffuse part does not know
/// of the glossy part's Fresnel factor.
pub type BlinnTorrance = Grooves<BlinnNormals>;

impl BlinnTorrance {
    /// Facets of complex index `eta` + i `k` (not both 0) with the exponent n ≥ 0, scaled by `ks`, on a diffuse base of albedo
    /// `kd`; kd + ks ≤ 1.
    pub fn new(kd: Spectrum, ks: Spectrum, eta: Spectrum, k: Spectrum, n: f32) -> Self {
        Self::of(kd, ks, eta, k, BlinnNormals::new(n))
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
        without_gain(["kd", "ks"], kd, ks)?;
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
