//! Surfaces whose normal is tilted by a normal or bump map.
//!
//! A model is meant for directions above its own normal. Where a map tilts that normal away from the surface, directions above the
//! surface fall below it and others above it fall below the surface: silhouettes turn black, and light leaks through. So a tilted
//! normal is taken here for what it would be on a real surface: one face of a tiny groove, whose other face stands upright, is a
//! perfect mirror, and closes the surface `[Schussler17]`.
//!
//! Light is scattered by the tilted face, or by way of the upright one before or after it. What would meet the tilted face again, or
//! the upright one twice, is lost. The result is reciprocal, makes no light, and has no side of its own: both transport modes use it
//! as it is.

use crate::bsdf::{Bsdf, BsdfSample, Lobes, TransportMode};
use crate::math::{Frame, Spectrum};
use crate::{Vec2, Vec3, vec3};

/// A model that reflects only, about a normal that is tilted against the surface's.
///
/// Directions are in the surface's frame, whose z axis is the untilted normal; both sides of the surface are tilted alike.
#[derive(Clone, Copy, Debug)]
pub struct Tilted<'a> {
    bsdf: &'a Bsdf,
    /// The tilted face.
    face: Frame,
    /// Unit normal of the upright face.
    upright: Vec3,
    cos: f32,
    tan: f32,
}

/// By which faces light goes. The choice doesn't depend on directions, so that a path has the same probability from either end.
#[derive(Clone, Copy)]
enum Way {
    Face,
    FaceThenUpright,
    UprightThenFace,
}

/// One way between two directions.
struct Passage {
    /// Where light comes from and goes to as the tilted face has it, in its frame.
    wo: Vec3,
    wi: Vec3,
    /// What the face's value counts in that of the surface.
    share: f32,
    /// Of the way.
    probability: f32,
}

impl<'a> Tilted<'a> {
    /// The model about the unit vector `normal`, whose z is positive; its tangents run along the surface's x axis.
    #[inline]
    pub fn new(bsdf: &'a Bsdf, normal: Vec3) -> Self {
        let across = vec3(normal.x, normal.y, 0.0);
        let upright = -across.normalize_or(Vec3::X);
        Self { bsdf, face: Frame::from_z_x(normal, Vec3::X), upright, cos: normal.z, tan: across.length() / normal.z }
    }

    /// f_s(wo, wi) \[1/sr\] without the cosine, which is taken to the surface's normal.
    pub fn eval(&self, wo: Vec3, wi: Vec3, lobes: Lobes, mode: TransportMode) -> Spectrum {
        self.passages(wo, wi).map(|p| self.bsdf.eval(p.wo, p.wi, lobes, mode) * p.share).sum()
    }

    /// Density \[1/sr\] of sampling `wi` given `wo`; delta lobes count as 0.
    pub fn pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
        self.passages(wo, wi).map(|p| self.bsdf.pdf(p.wo, p.wi, mode) * p.probability).sum()
    }

    /// `eval` of all lobes and `pdf` in one call.
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Spectrum, f32) {
        self.passages(wo, wi).fold((Spectrum::ZERO, 0.0), |(value, density), p| {
            let (f, pdf) = self.bsdf.eval_pdf(p.wo, p.wi, mode);
            (value + f * p.share, density + pdf * p.probability)
        })
    }

    /// The ways that are open between two directions; none if one of them is below the surface.
    #[inline]
    fn passages(&self, wo: Vec3, wi: Vec3) -> impl Iterator<Item = Passage> {
        let (o, i) = self.turned(wo, wi);
        let above = i.z > 0.0 && o.z > 0.0;
        let visible = self.visible_per_area(o) * self.visible_per_area(i);
        let passage = move |way: Way| {
            let (cos_o, cos_i, facing, area) = match way {
                Way::Face => (self.cos_face(o), self.cos_face(i), [o, i], 1.0 / self.cos),
                Way::FaceThenUpright => (self.cos_face(o), self.cos_upright(i), [o, self.mirrored(i)], self.tan),
                Way::UprightThenFace => (self.cos_upright(o), self.cos_face(i), [self.mirrored(o), i], self.tan),
            };
            let [wo, wi] = facing.map(|w| self.face.to_local(w));
            let share = cos_o * cos_i * area * visible;
            (cos_o > 0.0 && cos_i > 0.0).then(|| Passage { wo, wi, share, probability: self.probability(way) })
        };
        let ways = [Way::Face, Way::FaceThenUpright, Way::UprightThenFace].into_iter().filter(move |_| above);
        ways.filter_map(passage)
    }

    /// Samples `wi`; None if the way that `uc` chooses is closed to `wo`, or ends below the surface.
    pub fn sample(&self, wo: Vec3, uc: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        let (o, _) = self.turned(wo, wo);
        let (way, uc) = self.choose(uc);
        let open = match way {
            Way::Face | Way::FaceThenUpright => self.cos_face(o) > 0.0,
            Way::UprightThenFace => self.cos_upright(o) > 0.0,
        };
        if !open || o.z <= 0.0 {
            return None;
        }
        let entering = if matches!(way, Way::UprightThenFace) { self.mirrored(o) } else { o };
        let mut sample = self.bsdf.sample(self.face.to_local(entering), uc, u, mode)?;
        let left = self.face.to_world(sample.wi);
        let i = if matches!(way, Way::FaceThenUpright) { self.mirrored(left) } else { left };
        let leaves = match way {
            Way::Face | Way::UprightThenFace => self.cos_face(i) > 0.0,
            Way::FaceThenUpright => self.cos_upright(i) > 0.0,
        };
        if !leaves || i.z <= 0.0 {
            return None;
        }
        sample.wi = if wo.z < 0.0 { vec3(i.x, i.y, -i.z) } else { i };
        if sample.lobe.is_delta() {
            let (entry, exit) = match way {
                Way::Face => (self.cos_face(o) / self.cos, 1.0),
                Way::FaceThenUpright => (self.cos_face(o), self.cos_upright(i) * self.tan / self.cos_face(left)),
                Way::UprightThenFace => (self.cos_upright(o) * self.tan, 1.0),
            };
            sample.pdf *= self.probability(way);
            let seen = self.visible_per_area(o) * self.visible_per_area(i) * i.z;
            sample.weight *= entry * exit * seen / self.probability(way);
        } else {
            let (value, pdf) = self.eval_pdf(wo, sample.wi, mode);
            (sample.weight, sample.pdf) = (value * (i.z / pdf), pdf);
        }
        Some(sample)
    }

    /// The two directions as they are above the surface: the side of `wo` is made the upper one.
    #[inline]
    fn turned(&self, wo: Vec3, wi: Vec3) -> (Vec3, Vec3) {
        if wo.z >= 0.0 { (wo, wi) } else { (vec3(wo.x, wo.y, -wo.z), vec3(wi.x, wi.y, -wi.z)) }
    }

    #[inline]
    fn cos_face(&self, w: Vec3) -> f32 {
        w.dot(self.face.z)
    }

    #[inline]
    fn cos_upright(&self, w: Vec3) -> f32 {
        w.dot(self.upright)
    }

    /// A direction mirrored by the upright face.
    #[inline]
    fn mirrored(&self, w: Vec3) -> Vec3 {
        w - self.upright * (2.0 * self.cos_upright(w))
    }

    /// How much of the faces is seen from `w`, over the cosine: G₁(w)/cos, where G₁ is `[Schussler17, (3)]`, the same for both faces.
    #[inline]
    fn visible_per_area(&self, w: Vec3) -> f32 {
        1.0 / (self.cos_face(w).max(0.0) / self.cos + self.cos_upright(w).max(0.0) * self.tan)
    }

    /// The more upright the face is tilted, the more light goes by both.
    #[inline]
    fn probability(&self, way: Way) -> f32 {
        let both = self.tan / (self.tan + 2.0);
        match way {
            Way::Face => 1.0 / (1.0 + 2.0 * both),
            Way::FaceThenUpright | Way::UprightThenFace => both / (1.0 + 2.0 * both),
        }
    }

    /// The way that `uc` chooses, and what is left of it.
    #[inline]
    fn choose(&self, uc: f32) -> (Way, f32) {
        let (one, two) = (self.probability(Way::Face), self.probability(Way::FaceThenUpright));
        let rest = |from: f32, width: f32| ((uc - from) / width).clamp(0.0, 1.0f32.next_down());
        if uc < one {
            (Way::Face, rest(0.0, one))
        } else if uc < one + two {
            (Way::FaceThenUpright, rest(one, two))
        } else {
            (Way::UprightThenFace, rest(one + two, two))
        }
    }
}

#[cfg(test)]
mod tests;
