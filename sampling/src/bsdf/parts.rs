//! Models that are the sum of a diffuse and a glossy part, and sampled by a choice between the two.

use super::{BsdfSample, Lobes, Misfit};
use crate::math::elementary::{exp, ln, ln_1p};
use crate::math::{Spectrum, same_hemisphere};
use crate::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use glam::{Vec2, Vec3};

/// What a model's two parts are for a pair of directions.
#[derive(Clone, Copy, Debug)]
pub struct Parts {
    /// f_s of the diffuse part [1/sr].
    pub diffuse: Spectrum,
    /// f_s of the glossy part [1/sr].
    pub glossy: Spectrum,
    /// The density of the glossy part's samples [1/sr]; positive where the part is.
    pub glossy_pdf: f32,
}

impl Parts {
    /// No glossy part.
    pub fn diffuse(diffuse: Spectrum) -> Self {
        Self { diffuse, glossy: Spectrum::ZERO, glossy_pdf: 0.0 }
    }

    #[inline]
    fn value(&self, lobes: Lobes) -> Spectrum {
        match (lobes.contains(Lobes::DIFFUSE_REFLECTION), lobes.contains(Lobes::GLOSSY_REFLECTION)) {
            (true, true) => self.diffuse + self.glossy,
            (true, false) => self.diffuse,
            (false, true) => self.glossy,
            (false, false) => Spectrum::ZERO,
        }
    }
}

/// A model of two parts. It is told of directions above the surface, z > 0, alone: below, it is the same mirrored.
pub trait TwoParts: Copy {
    /// The probability of choosing the diffuse part for light to `wo`: 0 or 1 only where the other part is not there.
    fn diffuse_pmf(&self, wo: Vec3) -> f32;

    /// The two parts for a pair of directions.
    fn parts(&self, wo: Vec3, wi: Vec3) -> Parts;

    /// A direction with the density of the glossy part; where it is below the horizon or there is none, the sample fails.
    fn sample_glossy(&self, wo: Vec3, uc: f32, u: Vec2) -> Option<Vec3>;

    /// The parts, and the density over both.
    #[inline(always)]
    fn parts_and_density(&self, wo: Vec3, wi: Vec3) -> Option<(Parts, f32)> {
        if !same_hemisphere(wo, wi) {
            return None;
        }
        let (wo, wi) = (wo.with_z(wo.z.abs()), wi.with_z(wi.z.abs()));
        let parts = self.parts(wo, wi);
        let pmf = self.diffuse_pmf(wo);
        Some((parts, pmf * cosine_hemisphere_pdf(wi.z) + (1.0 - pmf) * parts.glossy_pdf))
    }

    /// f_s of these lobes, and the density over both.
    #[inline(always)]
    fn value_and_density(&self, wo: Vec3, wi: Vec3, lobes: Lobes) -> (Spectrum, f32) {
        let both = self.parts_and_density(wo, wi);
        both.map_or((Spectrum::ZERO, 0.0), |(parts, pdf)| (parts.value(lobes), pdf))
    }

    /// A direction by either part.
    #[inline(always)]
    fn sample_parts(&self, wo: Vec3, uc: f32, u: Vec2) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let above = wo.with_z(wo.z.abs());
        let pmf = self.diffuse_pmf(above);
        let (wi, lobe) = if uc < pmf {
            (cosine_hemisphere(u), Lobes::DIFFUSE_REFLECTION)
        } else {
            let rest = ((uc - pmf) / (1.0 - pmf)).min(1.0_f32.next_down());
            (self.sample_glossy(above, rest, u)?, Lobes::GLOSSY_REFLECTION)
        };
        let (parts, pdf) = self.parts_and_density(above, wi)?;
        if pdf == 0.0 {
            return None;
        }
        // The density has the glossy value's own factors: where the one is large or small, so is the other.
        let weight = (parts.diffuse + parts.glossy) * (wi.z / pdf);
        Some(BsdfSample { wi: wi.with_z(wi.z.copysign(wo.z)), weight, pdf, lobe, eta: 1.0 })
    }
}

/// The functions of `BsdfModel` that follow from [`TwoParts`].
macro_rules! scatters_in_two_parts {
    () => {
        #[inline]
        fn eval(
            &self,
            wo: glam::Vec3,
            wi: glam::Vec3,
            lobes: $crate::bsdf::Lobes,
            _mode: $crate::bsdf::TransportMode,
        ) -> $crate::math::Spectrum {
            self.value_and_density(wo, wi, lobes).0
        }

        #[inline]
        fn pdf(&self, wo: glam::Vec3, wi: glam::Vec3, _mode: $crate::bsdf::TransportMode) -> f32 {
            self.value_and_density(wo, wi, $crate::bsdf::Lobes::ALL).1
        }

        #[inline]
        fn eval_pdf(
            &self,
            wo: glam::Vec3,
            wi: glam::Vec3,
            _mode: $crate::bsdf::TransportMode,
        ) -> ($crate::math::Spectrum, f32) {
            self.value_and_density(wo, wi, $crate::bsdf::Lobes::ALL)
        }

        #[inline]
        fn sample(
            &self,
            wo: glam::Vec3,
            uc: f32,
            u: glam::Vec2,
            _mode: $crate::bsdf::TransportMode,
        ) -> Option<$crate::bsdf::BsdfSample> {
            self.sample_parts(wo, uc, u)
        }
    };
}
pub(super) use scatters_in_two_parts;

/// The kinds of scattering of parts with these albedos.
pub fn lobes_of(diffuse: Spectrum, glossy: Spectrum) -> Lobes {
    match (diffuse.is_zero(), glossy.is_zero()) {
        (_, true) => Lobes::DIFFUSE_REFLECTION,
        (true, false) => Lobes::GLOSSY_REFLECTION,
        (false, false) => Lobes::DIFFUSE_REFLECTION | Lobes::GLOSSY_REFLECTION,
    }
}

/// The probability of choosing the diffuse part, in proportion to the albedos, but either part of two at least once in 16
/// times: a part that is dim on the whole may be bright in a direction or a channel.
pub fn diffuse_share(diffuse: Spectrum, glossy: Spectrum) -> f32 {
    let lobes = lobes_of(diffuse, glossy);
    if !lobes.contains(Lobes::GLOSSY_REFLECTION) {
        return 1.0;
    }
    if !lobes.contains(Lobes::DIFFUSE_REFLECTION) {
        return 0.0;
    }
    (diffuse.mean() / (diffuse.mean() + glossy.mean())).clamp(1.0 / 16.0, 15.0 / 16.0)
}

/// Refuses two parts, of these names, that scatter more than there is.
///
/// # Errors
///
/// Their sum is above 1 in some channel.
pub fn without_gain([first, second]: [&'static str; 2], a: Spectrum, b: Spectrum) -> Result<(), Misfit> {
    let sum = (a + b).max_component();
    // The decimals of a scene file sum to 1 up to their rounding.
    if sum <= 1.0 + 4.0 * f32::EPSILON {
        return Ok(());
    }
    let message = format!("`{first}` + `{second}` is {sum} and creates light: make them 1 at most in every channel");
    Err(Misfit::new(second, message))
}

/// What is below this share of a lobe's peak is neither value nor density, so that no density underflows where a value does
/// not.
const LEAST: f32 = 1e-30;

/// exp(−x) of x ≥ 0, or 0 below 10⁻³⁰.
#[inline(always)]
pub fn exp_of_minus(x: f32) -> f32 {
    let value = exp(-x);
    if value >= LEAST { value } else { 0.0 }
}

/// cosⁿθ of the angle between two unit vectors, given the square of their distance, 2 − 2 cos θ; 0 from 90° on.
#[inline(always)]
pub fn power_of_cosine(distance2: f32, n: f32) -> f32 {
    if distance2 >= 2.0 {
        return 0.0;
    }
    exp_of_minus(-n * ln_1p(-0.5 * distance2))
}

/// −ln cos θ of a direction in the upper hemisphere, exact near the pole and near the horizon.
#[inline(always)]
pub fn minus_ln_cos(w: Vec3) -> f32 {
    if w.z < 0.7 {
        return -ln(w.z);
    }
    -0.5 * ln_1p(-(w.x * w.x + w.y * w.y))
}
