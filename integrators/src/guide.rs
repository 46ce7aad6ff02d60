//! What has a say in where a walk from the camera goes on.

use sampling::bsdf::{BsdfSample, TransportMode};
use sampling::{Vec2, Vec3};
use scenes::Interaction;

/// A density of directions at surfaces, which may be mixed with that of the BSDF.
pub(crate) trait Guide: Copy {
    /// Whether it takes a uniform number to choose by, whatever the BSDF does.
    const CHOOSES: bool;

    /// A direction to go on in, with f·cos over the density of the mixture; `wo` is where the walk comes from.
    fn sample(self, hit: &Interaction, wo: Vec3, uc: f32, u: Vec2) -> Option<BsdfSample>;

    /// The density of a direction [1/sr] by the mixture, where that of the BSDF is `pdf`.
    fn pdf(self, hit: &Interaction, wi: Vec3, pdf: f32) -> f32;
}

/// The BSDF alone.
#[derive(Clone, Copy)]
pub(crate) struct Unguided;

impl Guide for Unguided {
    const CHOOSES: bool = false;

    #[inline]
    fn sample(self, hit: &Interaction, wo: Vec3, uc: f32, u: Vec2) -> Option<BsdfSample> {
        hit.sample(wo, uc, u, TransportMode::Radiance)
    }

    #[inline]
    fn pdf(self, _: &Interaction, _: Vec3, pdf: f32) -> f32 {
        pdf
    }
}
