//! A point of a surface where light scatters.

use crate::emitter::EmitterId;
use crate::ray::SurfacePoint;
use crate::surface::SurfaceId;
use sampling::bsdf::{Bsdf, BsdfSample, Lobes, TransportMode};
use sampling::fault;
use sampling::math::{Frame, Spectrum};
use sampling::tilted::Tilted;
use sampling::{Vec2, Vec3};

/// A point on a surface, with its frame and its BSDF resolved. Directions are in world space and point away from it.
///
/// The geometric normal is the surface's own front; it is never turned towards `wo`. Which side a direction is on is decided
/// by the geometric normal; where the shading normal disagrees, nothing scatters, so that light neither leaks through a
/// surface nor reflects off its back \[Veach97, 5.3\].
#[derive(Clone, Copy, Debug)]
pub struct Interaction {
    /// Where it is, and how rays leave it.
    pub point: SurfacePoint,
    /// Parameter along the ray that found it.
    pub t: f32,
    /// Shading frame; its z axis is the shading normal, on the geometric normal's side.
    pub frame: Frame,
    /// How the normals that light scatters about differ from the geometric one.
    pub normals: Normals,
    /// The scattering model at this point.
    pub bsdf: Bsdf,
    /// The emitter this surface belongs to.
    pub emitter: Option<EmitterId>,
    /// Radiance \[W/(m²·sr)\] that it emits here where it emits at all, whatever the side; [`Scene::le`](crate::Scene::le) has the
    /// sides.
    pub emitted: Spectrum,
    /// The surface it is on.
    pub surface: SurfaceId,
}

/// How the normals that light scatters about differ from the geometric one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Normals {
    /// Not at all.
    Flat,
    /// The shading normal does.
    Smooth,
    /// A map has tilted the normal of what reflects only.
    Tilted {
        /// The tilted normal, unit, in the shading frame; its z is positive.
        normal: Vec3,
        /// Whether the shading normal differs from the geometric one as well.
        smooth: bool,
    },
}

impl Interaction {
    /// The shading normal, to which cosines are taken; where a map has tilted it, [`Tilted`] knows by how much.
    #[inline]
    pub fn ns(&self) -> Vec3 {
        self.frame.z
    }

    /// True if it has a lobe that a connection can use, one that isn't a Dirac delta.
    #[inline]
    pub fn is_connectable(&self) -> bool {
        self.bsdf.lobes().intersects(Lobes::NON_DELTA)
    }

    /// f_s(wo, wi) \[1/sr\] without the cosine, times the adjoint factor where importance is carried.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Spectrum {
        self.eval_lobes(wo, wi, Lobes::ALL, mode)
    }

    /// The part of [`eval`](Self::eval) that these lobes have.
    #[inline]
    pub fn eval_lobes(&self, wo: Vec3, wi: Vec3, lobes: Lobes, mode: TransportMode) -> Spectrum {
        let (local_o, local_i) = (self.frame.to_local(wo), self.frame.to_local(wi));
        match self.agreement(wo, wi, local_o, local_i, mode) {
            Some(factor) => match self.tilted() {
                None => self.bsdf.eval(local_o, local_i, lobes, mode) * factor,
                Some(tilted) => tilted.eval(local_o, local_i, lobes, mode) * factor,
            },
            None => Spectrum::ZERO,
        }
    }

    /// Density \[1/sr\] of sampling `wi` given `wo`; delta lobes count as 0.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
        let (local_o, local_i) = (self.frame.to_local(wo), self.frame.to_local(wi));
        match self.agreement(wo, wi, local_o, local_i, mode) {
            Some(_) => match self.tilted() {
                None => self.bsdf.pdf(local_o, local_i, mode),
                Some(tilted) => tilted.pdf(local_o, local_i, mode),
            },
            None => 0.0,
        }
    }

    /// `eval` and `pdf` in one call.
    #[inline]
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Spectrum, f32) {
        let (local_o, local_i) = (self.frame.to_local(wo), self.frame.to_local(wi));
        match self.agreement(wo, wi, local_o, local_i, mode) {
            Some(factor) => {
                let (value, pdf) = match self.tilted() {
                    None => self.bsdf.eval_pdf(local_o, local_i, mode),
                    Some(tilted) => tilted.eval_pdf(local_o, local_i, mode),
                };
                (value * factor, pdf)
            }
            None => (Spectrum::ZERO, 0.0),
        }
    }

    /// Samples a direction `wi`, in world space; the weight includes the adjoint factor.
    ///
    /// None if the model failed to sample or the two normals disagree about a side.
    #[inline]
    pub fn sample(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        let local_o = self.frame.to_local(wo);
        let mut sample = match self.tilted() {
            None => self.bsdf.sample(local_o, uc, u, mode)?,
            Some(tilted) => tilted.sample(local_o, uc, u, mode)?,
        };
        let local_i = sample.wi;
        sample.wi = self.frame.to_world(local_i);
        let factor = self.agreement(wo, sample.wi, local_o, local_i, mode)?;
        sample.weight *= factor;
        Some(sample)
    }

    #[inline]
    fn tilted(&self) -> Option<Tilted<'_>> {
        match self.normals {
            Normals::Flat | Normals::Smooth => None,
            Normals::Tilted { normal, .. } => Some(Tilted::new(&self.bsdf, normal)),
        }
    }

    /// None if the shading and the geometric normal disagree about the side of a direction; else the adjoint factor,
    /// |wo·ns| |wi·ng| / (|wo·ng| |wi·ns|) where importance is carried \[Veach97, (5.19)\], 1 for radiance.
    #[inline]
    fn agreement(&self, wo: Vec3, wi: Vec3, local_o: Vec3, local_i: Vec3, mode: TransportMode) -> Option<f32> {
        match self.normals {
            Normals::Flat | Normals::Tilted { smooth: false, .. } => return Some(1.0),
            Normals::Smooth | Normals::Tilted { smooth: true, .. } => {}
        }
        let (o_ng, i_ng) = (wo.dot(self.point.ng), wi.dot(self.point.ng));
        if !same_side(o_ng, local_o.z) || !same_side(i_ng, local_i.z) {
            return None;
        }
        match mode {
            TransportMode::Radiance => Some(1.0),
            TransportMode::Importance => {
                Some(fault!("adjoint_factor_missing", (local_o.z * i_ng / (o_ng * local_i.z)).abs(), 1.0))
            }
        }
    }
}

/// True if both cosines are positive or both negative; their product might underflow.
#[inline]
fn same_side(a: f32, b: f32) -> bool {
    (a > 0.0 && b > 0.0) || (a < 0.0 && b < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Random;
    use sampling::bsdf::Lambert;
    use sampling::vec3;

    fn tilted(bsdf: Bsdf, ns: Vec3) -> Interaction {
        Interaction {
            point: SurfacePoint::on_surface(Vec3::ZERO, Vec3::Z, 0.0),
            t: 1.0,
            frame: Frame::from_z(ns.normalize()),
            normals: Normals::Smooth,
            bsdf,
            emitter: None,
            emitted: Spectrum::ZERO,
            surface: SurfaceId(0),
        }
    }

    #[test]
    fn importance_is_adjoint_to_radiance_whatever_the_shading_normal() {
        // f*(wo → wi) |wi·ns| = f(wi → wo) |wo·ns| |wi·ng| / |wo·ng|, which makes K and its adjoint agree over dσ⊥ of ng.
        let mut random = Random::new(1);
        for (name, bsdf) in Bsdf::all_examples() {
            let it = tilted(bsdf, vec3(0.4, -0.2, 1.0));
            for _ in 0..2000 {
                let (wo, wi) = (random.direction(), random.direction());
                let adjoint =
                    it.eval(wo, wi, TransportMode::Importance) * wi.dot(it.ns()).abs() * wo.dot(Vec3::Z).abs();
                let direct = it.eval(wi, wo, TransportMode::Radiance) * wo.dot(it.ns()).abs() * wi.dot(Vec3::Z).abs();
                for (a, b) in adjoint.to_array().into_iter().zip(direct.to_array()) {
                    assert!((a - b).abs() <= 2e-3 * a.max(b) + 1e-7, "{name}: {wo} {wi}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn sides_on_which_the_normals_disagree_are_dark() {
        let it = tilted(Lambert { albedo: Spectrum::ONE }.into(), vec3(1.0, 0.0, 0.3));
        let above = vec3(0.3, 0.1, 0.9).normalize();
        let between = vec3(-0.9, 0.0, 0.1).normalize();
        assert!(between.dot(Vec3::Z) > 0.0 && between.dot(it.ns()) < 0.0);
        for mode in [TransportMode::Radiance, TransportMode::Importance] {
            assert!(!it.eval(above, above, mode).is_zero());
            assert!(it.eval(above, between, mode).is_zero() && it.eval(between, above, mode).is_zero());
            assert_eq!(it.pdf(above, between, mode), 0.0);
            assert!(it.sample(between, 0.5, Vec2::splat(0.5), mode).is_none());
        }
    }

    #[test]
    fn samples_carry_what_eval_and_pdf_say() {
        let mut random = Random::new(2);
        for (name, bsdf) in Bsdf::all_examples() {
            let it = tilted(bsdf, vec3(0.2, 0.3, 1.0));
            for mode in [TransportMode::Radiance, TransportMode::Importance] {
                for _ in 0..500 {
                    let wo = random.direction();
                    let Some(sample) = it.sample(wo, random.next_1d(), random.next_2d(), mode) else { continue };
                    if sample.lobe.is_delta() {
                        continue;
                    }
                    let (value, pdf) = it.eval_pdf(wo, sample.wi, mode);
                    let expected = value * (sample.wi.dot(it.ns()).abs() / pdf);
                    for (a, b) in expected.to_array().into_iter().zip(sample.weight.to_array()) {
                        assert!(
                            (a - b).abs() <= 2e-2 * a.max(b) + 1e-4,
                            "{name} {mode:?}: {wo} {sample:?} {expected:?}"
                        );
                    }
                    assert_eq!(pdf, it.pdf(wo, sample.wi, mode));
                    assert_eq!(value, it.eval(wo, sample.wi, mode));
                }
            }
        }
    }
}
