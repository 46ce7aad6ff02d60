//! A model whose mirror images and highlights are coloured.

use super::{
    Arguments, Bsdf, BsdfModel, BsdfSample, Dielectric, Domain, Ggx, Lambert, Lobes, Misfit, Parameter, Plastic,
    Preset, RoughConductor, RoughDielectric, RoughPlastic, TransportMode,
};
use crate::math::{Spectrum, same_hemisphere};
use glam::{Vec2, Vec3};

/// f_s times one colour where a delta or glossy lobe reflects and another where it transmits; diffuse lobes stay as they are.
///
/// Nature has no such factors: what a metal or glass reflects follows from its index. But other programs do (`specular_reflectance`),
/// and colours that are at most 1 create no light. Lobes are sampled as they would be without.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tinted {
    of: &'static Bsdf,
    reflection: Spectrum,
    transmission: Spectrum,
}

impl Tinted {
    /// The model `of`, with factors in [0, 1].
    pub fn new(of: &'static Bsdf, reflection: Spectrum, transmission: Spectrum) -> Self {
        Self { of, reflection, transmission }
    }

    #[inline]
    fn factor(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        if same_hemisphere(wo, wi) { self.reflection } else { self.transmission }
    }
}

/// What has no colour of its own from here.
const DIFFUSE: [Lobes; 2] = [Lobes::DIFFUSE_REFLECTION, Lobes::DIFFUSE_TRANSMISSION];

impl BsdfModel for Tinted {
    const NAME: &'static str = "tinted";
    const ABOUT: &'static str = "another material with coloured mirror images and highlights";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter {
            name: "of",
            about: "the other material",
            domain: Domain::Model,
            preset: Preset::Required("\"glass\""),
        },
        Parameter::colour(
            "reflection",
            "factor of what is reflected, but not diffusely",
            0.0,
            1.0,
            Preset::Number(1.0),
        ),
        Parameter::colour("transmission", "factor of what passes, but not diffusely", 0.0, 1.0, Preset::Number(1.0)),
    ];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [of, reflection, transmission] = arguments.all();
        Ok(Self::new(of.model(), reflection.colour(), transmission.colour()).into())
    }

    fn eval(&self, wo: Vec3, wi: Vec3, lobes: Lobes, mode: TransportMode) -> Spectrum {
        let only = |kind: Lobes| if lobes.contains(kind) { self.of.eval(wo, wi, kind, mode) } else { Spectrum::ZERO };
        let glossy = only(Lobes::GLOSSY_REFLECTION) + only(Lobes::GLOSSY_TRANSMISSION);
        DIFFUSE.map(only).into_iter().sum::<Spectrum>() + glossy * self.factor(wo, wi)
    }

    fn pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
        self.of.pdf(wo, wi, mode)
    }

    fn sample(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        let sample = self.of.sample(wo, uc, u, mode)?;
        let factor = self.factor(wo, sample.wi);
        let weight = sample.weight * factor;
        if sample.lobe.is_delta() || !DIFFUSE.into_iter().any(|kind| self.of.lobes().intersects(kind)) {
            return Some(BsdfSample { weight, ..sample });
        }
        // The diffuse part of the weight gets back what the factor has taken.
        let diffuse: Spectrum = DIFFUSE.map(|kind| self.of.eval(wo, sample.wi, kind, mode)).into_iter().sum();
        let given_back = diffuse * (Spectrum::ONE - factor) * (sample.wi.z.abs() / sample.pdf);
        Some(BsdfSample { weight: weight + given_back, ..sample })
    }

    fn fixed(&self) -> &'static [&'static str] {
        self.of.fixed()
    }

    fn lobes(&self) -> Lobes {
        self.of.lobes()
    }

    fn survival(&self) -> f32 {
        self.of.survival()
    }

    fn is_anisotropic(&self) -> bool {
        self.of.is_anisotropic()
    }

    fn examples() -> Vec<Self> {
        static RED: Bsdf = Bsdf::Lambert(Lambert { albedo: Spectrum::new(0.63, 0.065, 0.05) });
        static GLASS: Bsdf = Bsdf::Dielectric(Dielectric { eta: 1.5 });
        let (green, blue) = (Spectrum::new(0.2, 1.0, 0.3), Spectrum::new(0.1, 0.0, 0.9));
        let kept = |model: Bsdf| model.kept();
        vec![
            Self::new(kept(RoughPlastic::new(Spectrum::new(0.9, 0.5, 0.0), 1.5, 0.3).into()), green, blue),
            Self::new(&RED, green, blue),
            Self::new(&GLASS, green, blue),
            Self::new(kept(RoughConductor::from_reflectance(Spectrum::splat(0.9), 0.05, 0.2).into()), green, blue),
            Self::new(kept(RoughDielectric::new(1.5, 0.3, 0.3).into()), green, blue),
            Self::new(kept(Plastic::new(Spectrum::new(0.9, 0.5, 0.0), 1.5).into()), green, blue),
            Self::new(kept(RoughPlastic::new(Spectrum::ONE, 1.5, Ggx::MIN_ALPHA).into()), Spectrum::ZERO, blue),
        ]
    }
}
