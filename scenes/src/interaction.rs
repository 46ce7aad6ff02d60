//! A point of a surface where light scatters.

use crate::emitter::EmitterId;
use crate::ray::SurfacePoint;
use crate::surface::SurfaceId;
use crate::tilt::{Face, Tilt, same_side};
use sampling::bsdf::{Bsdf, BsdfSample, Lobes, TransportMode};
use sampling::fault;
use sampling::math::{Frame, Spectrum};
use sampling::{Vec2, Vec3};

/// A point on a surface, with its frame and its BSDF resolved. Directions are in world space and point away from it.
///
/// The geometric normal is the surface's own front; it is never turned towards `wo`. Which side a direction is on is decided
/// by the geometric normal; where the normal that light scatters about disagrees, nothing scatters, so that light neither leaks
/// through a surface nor reflects off its back \[Veach97, 5.3\].
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
    /// A map tilts them against the shading normal, whether or not that differs as well.
    Tilted(Tilt),
}

/// Two directions as the normal has them that light scatters about.
struct Passage {
    wo: Vec3,
    wi: Vec3,
    /// What the model's value is multiplied by.
    factor: f32,
    /// The probability with which a walk from `wo` is scattered about that normal.
    probability: f32,
    /// Which of the normals of a tilt that is.
    face: Face,
}

impl Interaction {
    /// The shading normal, to which cosines are taken; where a map has tilted it, the value of the BSDF makes up for the difference.
    #[inline]
    pub fn ns(&self) -> Vec3 {
        self.frame.z
    }

    /// The normal that light scatters about towards `wo`: what a map turns to who sees it from there.
    pub(crate) fn normal_seen_from(&self, wo: Vec3) -> Vec3 {
        match &self.normals {
            Normals::Tilted(tilt) => self.frame.to_world(tilt.normal_of(tilt.seen_from(self.frame.to_local(wo)))),
            Normals::Flat | Normals::Smooth => self.ns(),
        }
    }

    /// True if it has a lobe that a connection can use, one that isn't a Dirac delta.
    #[inline]
    pub fn is_connectable(&self) -> bool {
        self.bsdf.lobes().intersects(Lobes::NON_DELTA)
    }

    /// f_s(wo, wi) \[1/sr\] without the cosine, times the adjoint factor where importance is carried.
    #[inline(always)]
    pub fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Spectrum {
        self.eval_lobes(wo, wi, Lobes::ALL, mode)
    }

    /// The part of [`eval`](Self::eval) that these lobes have.
    #[inline(always)]
    pub fn eval_lobes(&self, wo: Vec3, wi: Vec3, lobes: Lobes, mode: TransportMode) -> Spectrum {
        match self.passage(wo, wi, mode) {
            Some(p) => self.bsdf.eval(p.wo, p.wi, lobes, mode) * p.factor,
            None => Spectrum::ZERO,
        }
    }

    /// Density \[1/sr\] of sampling `wi` given `wo`; delta lobes count as 0.
    #[inline(always)]
    pub fn pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
        match self.passage(wo, wi, mode) {
            Some(p) => self.bsdf.pdf(p.wo, p.wi, mode) * p.probability,
            None => 0.0,
        }
    }

    /// `pdf` of `wi` given `wo`, and that of `wo` given `wi` for a walk from the other end.
    #[inline(always)]
    pub fn pdfs(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (f32, f32) {
        if let Normals::Tilted(_) = &self.normals {
            return (self.pdf(wo, wi, mode), self.pdf(wi, wo, mode.reversed()));
        }
        match self.passage(wo, wi, mode) {
            Some(p) => (self.bsdf.pdf(p.wo, p.wi, mode), self.bsdf.pdf(p.wi, p.wo, mode.reversed())),
            None => (0.0, 0.0),
        }
    }

    /// `eval` and `pdf` in one call.
    #[inline(always)]
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Spectrum, f32) {
        match self.passage(wo, wi, mode) {
            Some(p) => {
                let (value, pdf) = self.bsdf.eval_pdf(p.wo, p.wi, mode);
                (value * p.factor, pdf * p.probability)
            }
            None => (Spectrum::ZERO, 0.0),
        }
    }

    /// Samples a direction `wi`, in world space; the weight includes the adjoint factor.
    ///
    /// None if the model failed to sample or the normals disagree about a side.
    #[inline]
    pub fn sample(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        if let Normals::Tilted(tilt) = &self.normals {
            return self.sample_tilted(tilt, wo, uc, u, mode);
        }
        let local_o = self.frame.to_local(wo);
        let mut sample = self.bsdf.sample(local_o, uc, u, mode)?;
        let local_i = sample.wi;
        sample.wi = self.frame.to_world(local_i);
        sample.weight *= self.untilted_factor(wo, sample.wi, local_o, local_i, mode)?;
        Some(sample)
    }

    #[inline(never)]
    fn sample_tilted(&self, tilt: &Tilt, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        let o = self.frame.to_local(wo);
        let (face, uc) = tilt.choose(uc, o, mode);
        let frame = tilt.frame(face);
        let mut sample = self.bsdf.sample(frame.to_local(o), uc, u, mode)?;
        let i = frame.to_world(sample.wi);
        // The model's weight has the cosine to the tilted normal, and the factor is for that to the shading normal.
        let cosines = (i.z / sample.wi.z).abs();
        sample.wi = self.frame.to_world(i);
        let passage = self.tilted_passage(tilt, wo, sample.wi, mode)?;
        if passage.face != face {
            return None;
        }
        sample.weight *= passage.factor * cosines / passage.probability;
        sample.pdf *= passage.probability;
        Some(sample)
    }

    /// The densities of a sample of a delta lobe, of `wi` from `wo` and back, in units of a Dirac in the measure that scattering
    /// preserves.
    ///
    /// In that measure the two are the same number \[Veach97, 5.2\] but for the probabilities of choosing a tilted face, which only
    /// walks from lights do. It is solid angle where it reflects, about whatever normal, and projected solid angle times η² where it
    /// refracts.
    #[inline]
    pub fn delta_densities(&self, wo: Vec3, sample: &BsdfSample, mode: TransportMode) -> (f32, f32) {
        let (mut forward, mut back) = (sample.pdf, sample.pdf);
        let mut normal = self.ns();
        if let Normals::Tilted(tilt) = &self.normals {
            let [o, i] = [wo, sample.wi].map(|w| self.frame.to_local(w));
            let face = tilt.seen_from(viewer_and_light(o, i, mode).0);
            back *= tilt.probability(face, i, mode.reversed()) / tilt.probability(face, o, mode);
            normal = self.frame.to_world(tilt.normal_of(face));
        }
        if sample.lobe.intersects(Lobes::TRANSMISSION) {
            forward *= sample.eta * sample.eta * sample.wi.dot(normal).abs();
            back *= wo.dot(normal).abs();
        }
        (forward, back)
    }

    /// None if the normals disagree about the side of a direction.
    #[inline(always)]
    fn passage(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Option<Passage> {
        if let Normals::Tilted(tilt) = &self.normals {
            return self.tilted_passage(tilt, wo, wi, mode);
        }
        let (local_o, local_i) = (self.frame.to_local(wo), self.frame.to_local(wi));
        let factor = self.untilted_factor(wo, wi, local_o, local_i, mode)?;
        Some(Passage { wo: local_o, wi: local_i, factor, probability: 1.0, face: Face::Mapped })
    }

    /// What the model's value is multiplied by where no map tilts the normal: 1, or the adjoint factor.
    #[inline]
    fn untilted_factor(&self, wo: Vec3, wi: Vec3, local_o: Vec3, local_i: Vec3, mode: TransportMode) -> Option<f32> {
        if self.normals == Normals::Flat {
            return Some(1.0);
        }
        let geometric = self.geometric_cosines(wo, wi, local_o.z, local_i.z)?;
        Some(match mode {
            TransportMode::Radiance => 1.0,
            TransportMode::Importance => {
                fault!("adjoint_factor_missing", adjoint_factor(local_o.z, local_i.z, geometric), 1.0)
            }
        })
    }

    /// Radiance is scattered by f |wi·n′| S(wi), importance by the adjoint; what is returned is over |wi·ns|, which callers multiply
    /// by.
    #[inline(never)]
    fn tilted_passage(&self, tilt: &Tilt, wo: Vec3, wi: Vec3, mode: TransportMode) -> Option<Passage> {
        let [o, i] = [wo, wi].map(|w| self.frame.to_local(w));
        let (viewer, light) = viewer_and_light(o, i, mode);
        let face = tilt.seen_from(viewer);
        let frame = tilt.frame(face);
        let (about_o, about_i) = (frame.to_local(o), frame.to_local(i));
        if !same_side(o.z, about_o.z) || !same_side(i.z, about_i.z) {
            return None;
        }
        let geometric = self.geometric_cosines(wo, wi, about_o.z, about_i.z)?;
        let of_radiance = (about_i.z / i.z).abs();
        let cosines = match mode {
            TransportMode::Radiance => of_radiance,
            TransportMode::Importance => {
                fault!("adjoint_factor_missing", adjoint_factor(about_o.z, i.z, geometric), of_radiance)
            }
        };
        let (factor, probability) = (cosines * tilt.shadowing(light), tilt.probability(face, o, mode));
        Some(Passage { wo: about_o, wi: about_i, factor, probability, face })
    }

    /// The cosines of `wo` and `wi` to the geometric normal; None if the normal that light scatters about, to which they are `cos_o`
    /// and `cos_i`, disagrees about a side.
    #[inline]
    fn geometric_cosines(&self, wo: Vec3, wi: Vec3, cos_o: f32, cos_i: f32) -> Option<(f32, f32)> {
        let (o, i) = (wo.dot(self.point.ng), wi.dot(self.point.ng));
        (same_side(o, cos_o) && same_side(i, cos_i)).then_some((o, i))
    }
}

/// What makes the adjoint of a kernel with |wi·n|, over dσ⊥ of the geometric normal: |wo·n| |wi·ng| / (|wo·ng| |wi·ns|), for the shading
/// normal to which callers take the cosine \[Veach97, (5.19)\].
#[inline]
fn adjoint_factor(cos_o: f32, cos_s: f32, (o_ng, i_ng): (f32, f32)) -> f32 {
    (cos_o * i_ng / (o_ng * cos_s)).abs()
}

/// Which of two directions light goes to, and which it comes from.
#[inline]
fn viewer_and_light(o: Vec3, i: Vec3, mode: TransportMode) -> (Vec3, Vec3) {
    match mode {
        TransportMode::Radiance => (o, i),
        TransportMode::Importance => (i, o),
    }
}

#[cfg(test)]
mod tests;
