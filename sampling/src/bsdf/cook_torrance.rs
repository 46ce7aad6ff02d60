//! Cook and Torrance's reflection.

use super::grooves::Grooves;
use super::parts::{TwoParts, lobes_of, scatters_in_two_parts, without_gain};
use super::roughness::lobe_alphas;
use super::{Argument, Arguments, Beckmann, Bsdf, BsdfModel, Lobes, Misfit, Parameter, Preset};
use crate::math::Spectrum;

/// f_s = kd/π + ks F(wo·m) D(m) G / (4 cos θ_o cos θ_i) with the half vector m [Cook82, section 2].
///
/// D is Beckmann's with slopes of root mean square α (the source's m), G that of V-shaped grooves, and F exact for the
/// index η + i k, of metals or, with k = 0, of dielectrics.
///
/// The source divides by π where this divides by 4, and prints D = exp(−tan²θ/α²) / (α² cos⁴θ), without the 1/π by which
/// ∫ D cos θ dm = 1. Taken together the facets reflect four times what meets them (with D normalised and π kept, 4/π times).
/// The 4 of `[Torrance67]` has them reflect just that, and then kd + ks ≤ 1, the source's d + s = 1, creates no light.
///
/// Visible normals are sampled. Light scattered more than once among the facets is lost, and the diffuse part does not know
/// of the glossy part's Fresnel factor.
pub type CookTorrance = Grooves<Beckmann>;

impl CookTorrance {
    /// Facets of complex index `eta` + i `k` (not both 0) and roughness `alpha`, at least 10⁻⁴, scaled by `ks`, on a diffuse base
    /// of albedo `kd`; kd + ks ≤ 1.
    pub fn new(kd: Spectrum, ks: Spectrum, eta: Spectrum, k: Spectrum, alpha: f32) -> Self {
        Self::of(kd, ks, eta, k, Beckmann::new(alpha, alpha))
    }
}

impl BsdfModel for CookTorrance {
    const NAME: &'static str = "cook_torrance";
    const ABOUT: &'static str =
        "rough metals and plastics after Cook and Torrance: Beckmann's facets in V-shaped grooves";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("kd", "albedo of the diffuse part", 0.0, 1.0, Preset::Number(0.5)),
        Parameter::colour("ks", "scale of the glossy part", 0.0, 1.0, Preset::Number(0.5)),
        Parameter::colour("eta", "index of refraction of the facets", 1e-3, 1e3, Preset::Number(1.5)),
        Parameter::colour("k", "extinction index of the facets; 0 of dielectrics", 0.0, 1e3, Preset::Number(0.0)),
        Parameter::LOBE_ROUGHNESS,
        Parameter::LOBE_ALPHA,
    ];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [kd, ks, eta, k, roughness, alpha] = arguments.all();
        let (kd, ks, eta, k) = (kd.colour(), ks.colour(), eta.colour(), k.colour());
        without_gain(["kd", "ks"], kd, ks)?;
        let (alpha, _) = lobe_alphas([roughness, alpha, Argument::Absent, Argument::Absent])?;
        Ok(Self::new(kd, ks, eta, k, alpha).into())
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
            Self::new(half, half, glass, Spectrum::ZERO, 0.15),
            Self::new(half, half, glass, Spectrum::ZERO, 0.8),
            Self::new(Spectrum::ZERO, Spectrum::ONE, copper.0, copper.1, 0.3),
            Self::new(Spectrum::ZERO, Spectrum::ONE, Spectrum::ONE, Spectrum::splat(1e3), 1.0),
            Self::new(Spectrum::ZERO, Spectrum::ONE, copper.0, copper.1, 1e-4),
            Self::new(half, Spectrum::ZERO, glass, Spectrum::ZERO, 0.3),
        ]
    }
}
