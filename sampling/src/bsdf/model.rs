//! What a scattering model is.

use super::{Arguments, Bsdf, Lobes, Misfit, Parameter};
use crate::fault;
use crate::math::Spectrum;
use glam::{Vec2, Vec3};

/// What the quantity carried along a walk is.
///
/// A walk from the camera carries radiance backwards; one from an emitter carries importance backwards. The two differ
/// where light crosses into another medium: radiance is scaled by the square of the index [Veach97, section 5.2].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TransportMode {
    /// Of walks from the camera; `eval(wo, wi)` is f_s(wi → wo).
    Radiance,
    /// Of walks from an emitter; `eval(wo, wi)` is the adjoint f_s*(wi → wo) = f_s(wo → wi).
    Importance,
}

impl TransportMode {
    /// Both modes.
    pub const ALL: &[Self] = &[Self::Radiance, Self::Importance];

    /// What a walk from the other end carries.
    #[inline]
    pub fn reversed(self) -> Self {
        match self {
            Self::Radiance => Self::Importance,
            Self::Importance => Self::Radiance,
        }
    }

    /// What a transmitted walk is scaled by, for the relative index η_wi-side / η_wo-side that it crosses.
    #[inline]
    pub fn transmission_scale(self, eta: f32) -> f32 {
        match self {
            Self::Radiance => fault!("radiance_without_eta_squared", 1.0 / (eta * eta), 1.0),
            Self::Importance => 1.0,
        }
    }
}

/// A sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// The direction, unit, away from the surface.
    pub wi: Vec3,
    /// f_s |cos θ_i| / pdf. Of a delta lobe: its share of the energy / pmf.
    pub weight: Spectrum,
    /// The density of `wi` [1/sr] over all lobes, as [`BsdfModel::pdf`] has it, and positive. Of a delta lobe: the pmf
    /// of choosing it, which is the same when seen from `wi`.
    pub pdf: f32,
    /// The one lobe that `wi` belongs to.
    pub lobe: Lobes,
    /// η_wi-side / η_wo-side; 1 for reflection.
    pub eta: f32,
}

/// A scattering model; `wo` and `wi` are unit and in the local frame.
pub trait BsdfModel: Copy {
    /// What scene files call it.
    const NAME: &'static str;

    /// What it is, in one line.
    const ABOUT: &'static str;

    /// What scene files may say of it, at most [`MAX_PARAMETERS`](super::MAX_PARAMETERS).
    const PARAMETERS: &'static [Parameter];

    /// The largest albedo that the model itself has in any direction: 1, unless its source says otherwise.
    const MAX_ALBEDO: f32 = 1.0;

    /// The model with these arguments of [`PARAMETERS`](Self::PARAMETERS), each in its domain. It may be another model of the
    /// list, such as a smooth one where the roughness is zero.
    ///
    /// Where a texture gives an argument this is called at every hit. So, once the tables of the arguments that are
    /// [`fixed`](Self::fixed) have been made, it takes no lock, integrates nothing and allocates nothing.
    ///
    /// # Errors
    ///
    /// Arguments that don't go together, or together create energy.
    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit>;

    /// f_s of the non-delta lobes among `lobes` [1/sr], without the cosine.
    fn eval(&self, wo: Vec3, wi: Vec3, lobes: Lobes, mode: TransportMode) -> Spectrum;

    /// The density with which [`sample`](Self::sample) finds `wi` by a non-delta lobe [1/sr].
    ///
    /// Its integral over all `wi` and the pmfs of the delta lobes sum to 1, less the probability of `None`.
    fn pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32;

    /// [`eval`](Self::eval) of all lobes and [`pdf`](Self::pdf) at once.
    #[inline]
    fn eval_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Spectrum, f32) {
        (self.eval(wo, wi, Lobes::ALL, mode), self.pdf(wo, wi, mode))
    }

    /// A direction to go on in. `uc` chooses the lobe, `u` the direction.
    ///
    /// `None`: nothing is scattered this way. It counts as a sample of value zero.
    fn sample(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample>;

    /// Every lobe that it can have with these parameters.
    fn lobes(&self) -> Lobes;

    /// The probability, in (0, 1], with which a roulette local to the vertex lets a walk go on.
    ///
    /// The largest channel of the model's albedo, or a figure near it that depends on no direction, so that it is the
    /// same for a walk in either sense.
    fn survival(&self) -> f32;

    /// Whether turning both directions about the normal changes something.
    fn is_anisotropic(&self) -> bool {
        false
    }

    /// The parameters that cannot vary over a surface: those that its tables were made for, and the index of what light goes
    /// through, which it leaves as it entered.
    fn fixed(&self) -> &'static [&'static str] {
        &[]
    }

    /// Parameters to try the laws on: usual ones, extremes, and whatever has a code path of its own. Never empty.
    fn examples() -> Vec<Self>;
}

/// A positive albedo as a probability of survival. An albedo of zero ends the walk by its weight, not by roulette.
#[inline]
pub fn survival_of(albedo: Spectrum) -> f32 {
    let largest = albedo.max_component();
    if largest > 0.0 { largest.min(1.0) } else { 1.0 }
}
