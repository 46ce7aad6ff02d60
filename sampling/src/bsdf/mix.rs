//! A blend of two models.

use super::{
    Argument, Arguments, Bsdf, BsdfModel, BsdfSample, Dielectric, Lambert, Lobes, Mirror, Misfit, Parameter, Plastic,
    Preset, RoughConductor, RoughDielectric, TransportMode,
};
use crate::distribution::GRID;
use crate::fault;
use crate::math::Spectrum;
use glam::{Vec2, Vec3};

/// f_s = (1 − a) f₁ + a f₂, as a surface looks whose share a is of the second material, in patches too small to see.
///
/// A lobe is sampled by choosing a model first, the second with probability a. Values and densities of the lobes that aren't
/// delta mix, and so it doesn't matter which model a direction is from. A delta lobe keeps its weight, and its pmf is times the
/// probability of its model. Where both models have a delta lobe in the same direction, as two mirrors have, they stay two
/// lobes, each with a pmf that is the same from both ends: a walk goes by one of them, and in the space of paths that say by
/// which, every estimator that is unbiased for one lobe is so for their sum. Models that are mixtures themselves may be mixed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mix {
    first: &'static Bsdf,
    second: &'static Bsdf,
    /// The share of the second, in (0, 1).
    amount: f32,
}

impl Mix {
    /// Of `second` the share `amount` in (0, 1), of `first` the rest.
    ///
    /// The share is rounded to a multiple of 2⁻²⁴, which a choice by a random number of 24 bits has exactly.
    pub fn new(first: &'static Bsdf, second: &'static Bsdf, amount: f32) -> Self {
        debug_assert!(amount > 0.0 && amount < 1.0, "amount {amount}");
        let grid = GRID as f32;
        Self { first, second, amount: (amount * grid).round().clamp(1.0, grid - 1.0) / grid }
    }

    /// Of how many models it is mixed that are no mixtures, each counted as often as it occurs.
    pub fn kinds(&self) -> usize {
        let kinds = |model: &Bsdf| if let Bsdf::Mix(mix) = model { mix.kinds() } else { 1 };
        kinds(self.first) + kinds(self.second)
    }

    /// Both models, each with its share.
    #[inline]
    fn parts(&self) -> [(&'static Bsdf, f32); 2] {
        [(self.first, 1.0 - self.amount), (self.second, self.amount)]
    }

    /// A sample of the first part, which has the probability `share`, joined with what the other adds in its direction.
    fn join(
        [(part, share), (other, other_share)]: [(&'static Bsdf, f32); 2],
        wo: Vec3,
        (uc, u): (f32, Vec2),
        mode: TransportMode,
    ) -> Option<BsdfSample> {
        let sample = part.sample(wo, uc.min(1.0_f32.next_down()), u, mode)?;
        if sample.lobe.is_delta() {
            return Some(BsdfSample { pdf: share * sample.pdf, ..sample });
        }
        let (f, pdf) = other.eval_pdf(wo, sample.wi, mode);
        let (own, other) = (share * sample.pdf, other_share * pdf);
        // The sample's own f cos is its weight times its pdf, which is better known than its value.
        let whole = own + other;
        let weight = sample.weight * (own / whole) + f * (other_share * sample.wi.z.abs() / whole);
        Some(BsdfSample { weight, pdf: whole, ..sample })
    }
}

impl BsdfModel for Mix {
    const NAME: &'static str = "mix";
    const ABOUT: &'static str = "a blend of two materials";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter {
            name: "first",
            about: "one material",
            domain: super::Domain::Model,
            preset: Preset::Required("\"white\""),
        },
        Parameter {
            name: "second",
            about: "the other material",
            domain: super::Domain::Model,
            preset: Preset::Required("\"white\""),
        },
        Parameter::number("amount", "share of the second", 0.0, 1.0, Preset::Number(0.5)),
    ];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [first, second, amount] = arguments.all();
        let (first, second): (&'static Bsdf, _) = (first.model(), second.model());
        Ok(match Argument::number(amount) {
            0.0 => *first,
            1.0 => *second,
            amount => Self::new(first, second, amount).into(),
        })
    }

    fn eval(&self, wo: Vec3, wi: Vec3, lobes: Lobes, mode: TransportMode) -> Spectrum {
        self.parts().map(|(model, share)| model.eval(wo, wi, lobes, mode) * share).into_iter().sum()
    }

    fn pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
        self.parts().map(|(model, share)| model.pdf(wo, wi, mode) * share).into_iter().sum()
    }

    fn eval_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Spectrum, f32) {
        let [(f, pdf), (f2, pdf2)] = self.parts().map(|(model, share)| {
            let (f, pdf) = model.eval_pdf(wo, wi, mode);
            (f * share, pdf * share)
        });
        (f + f2, fault!("density_of_one_lobe", pdf + pdf2, pdf))
    }

    fn sample(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        let [first, second] = self.parts();
        // What is left of `uc` after the choice is uniform again, to the granularity of random numbers over the share.
        if uc < first.1 {
            return Self::join([first, second], wo, (uc / first.1, u), mode);
        }
        Self::join([second, first], wo, ((uc - first.1) / second.1, u), mode)
    }

    fn lobes(&self) -> Lobes {
        self.first.lobes() | self.second.lobes()
    }

    fn survival(&self) -> f32 {
        self.parts().map(|(model, share)| model.survival() * share).into_iter().sum::<f32>().min(1.0)
    }

    fn is_anisotropic(&self) -> bool {
        self.first.is_anisotropic() || self.second.is_anisotropic()
    }

    fn examples() -> Vec<Self> {
        static RED: Bsdf = Bsdf::Lambert(Lambert { albedo: Spectrum::new(0.63, 0.065, 0.05) });
        static MIRROR: Bsdf = Bsdf::Mirror(Mirror { reflectance: Spectrum::new(0.95, 0.5, 0.1) });
        static GLASS: Bsdf = Bsdf::Dielectric(Dielectric { eta: 1.5 });
        static DENSE_GLASS: Bsdf = Bsdf::Dielectric(Dielectric { eta: 2.4 });
        static SILVERED_GLASS: Bsdf = Bsdf::Mix(Mix { first: &GLASS, second: &MIRROR, amount: 0.25 });
        let kept = |model: Bsdf| -> &'static Bsdf { Box::leak(Box::new(model)) };
        vec![
            Self::new(&RED, kept(RoughConductor::from_reflectance(Spectrum::splat(0.9), 0.2, 0.2).into()), 0.3),
            Self::new(&RED, &MIRROR, 0.5),
            // Delta lobes of both in the same direction, and of one transmission in two.
            Self::new(&MIRROR, kept(Plastic::new(Spectrum::splat(0.7), 1.5).into()), 0.4),
            Self::new(&GLASS, &DENSE_GLASS, 0.3),
            // A mixture of a mixture, of all that there is.
            Self::new(&SILVERED_GLASS, kept(RoughDielectric::new(1.33, 0.2, 0.3).into()), 0.6),
            Self::new(&RED, &SILVERED_GLASS, 1e-6),
        ]
    }
}
