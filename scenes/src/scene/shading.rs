//! From a hit to an interaction: the normal, the frame and the BSDF of a point.

use super::Scene;
use crate::accel::Hit;
use crate::emitter::Emitter;
use crate::interaction::{Interaction, Normals};
use crate::material::{Material, Scattering, Side, Varying};
use crate::ray::SurfacePoint;
use crate::relief::Derivatives;
use crate::surface::Surface;
use crate::texture::{SurfaceCoordinates, Texture};
use crate::tilt::Tilt;
use sampling::bsdf::Bsdf;
use sampling::math::{Frame, Spectrum};
use sampling::{Vec3, vec3};

/// What a hit says of its surface, before anything of its material is read.
///
/// Where it is looked at by address it is a copy, so that it stays in registers on the way that most hits take.
#[derive(Clone, Copy)]
pub(super) struct Found<'a> {
    pub point: SurfacePoint,
    pub t: f32,
    /// The shading normal, without a map.
    ns: Vec3,
    surface: &'a Surface,
}

impl Scene {
    /// The surface at a hit of a ray of direction `d`, its material read.
    #[inline(always)]
    pub(crate) fn interaction(&self, hit: Hit, d: Vec3) -> Interaction {
        let found = self.found(&hit);
        self.shaded(&hit, found, &self.materials[found.surface.material.0 as usize], d)
    }

    /// The same where there is an interaction or none; where the material is constant it is not copied, but put where it stays.
    #[inline(never)]
    pub(super) fn met(&self, hit: &Hit, d: Vec3) -> Option<Interaction> {
        let found = self.found(hit);
        match &self.materials[found.surface.material.0 as usize] {
            Material::Constant(bsdf) => {
                let (frame, emitted) = (self.frame(hit, found, bsdf), self.emitted(hit, found));
                Some(found.finish(*bsdf, frame, emitted))
            }
            varying => Some(self.shaded(hit, found, varying, d)),
        }
    }

    #[inline(never)]
    fn shaded(&self, hit: &Hit, found: Found, material: &Material, d: Vec3) -> Interaction {
        let emitted = self.emitted(hit, found);
        match material {
            Material::Constant(bsdf) => found.finish(*bsdf, self.frame(hit, found, bsdf), emitted),
            Material::Varying(varying) => self.varying_interaction(hit, &found, emitted, varying, Side::Front),
            Material::Subsurface(body) => found.finish(body.boundary(), Frame::from_z(found.ns), emitted),
            Material::Sided(sided) => {
                let (varying, side) = sided.met(d, found.point.ng);
                self.varying_interaction(hit, &found, emitted, varying, side)
            }
        }
    }

    /// How much of a ray that comes here is met.
    pub(super) fn opacity(&self, hit: &Hit, found: &Found) -> f32 {
        let Some(opacity) = self.materials[found.surface.material.0 as usize].opacity() else { return 1.0 };
        opacity.at(&self.coordinates(hit, found)).mean()
    }

    #[inline(always)]
    pub(super) fn found(&self, hit: &Hit) -> Found<'_> {
        match *hit {
            Hit::Analytic { t, id, at } => {
                let surface = &self.surfaces[self.analytic[id as usize].surface as usize];
                Found { point: at, t, ns: at.ng, surface }
            }
            Hit::Triangle { t, id, p, b } => {
                let info = &self.triangles[id as usize];
                let surface = &self.surfaces[info.surface as usize];
                let ns = match surface.attributes {
                    None => info.ng,
                    Some(index) => self.attributes[index as usize].normal(id, b, info.ng),
                };
                let point = SurfacePoint::on_surface(p, info.ng, info.residual);
                Found { point, t, ns, surface }
            }
            Hit::PlacedTriangle { .. } | Hit::PlacedAnalytic { .. } => self.found_placed(hit),
        }
    }

    /// What a surface emits, on the sides that do.
    #[inline(always)]
    fn emitted(&self, hit: &Hit, found: Found) -> Spectrum {
        match found.surface.emitter.map(|id| self.emitter(id)) {
            Some(Emitter::Area(area)) => match &area.emission.radiance {
                Texture::Constant(radiance) => *radiance,
                varying => self.read(varying, hit, &found),
            },
            _ => Spectrum::ZERO,
        }
    }

    /// The same in an instance.
    #[inline(never)]
    fn found_placed(&self, hit: &Hit) -> Found<'_> {
        let (index, t, p, ng, ns, residual, surface) = match *hit {
            Hit::PlacedAnalytic { t, id, instance, p, ng } => {
                let info = &self.analytic[id as usize];
                (instance, t, p, ng, ng, info.chart.residual(), info.surface)
            }
            Hit::PlacedTriangle { t, id, instance: index, p, b } => {
                let info = &self.triangles[id as usize];
                let instance = self.accel.instance(index);
                let ng = instance.normal_to_world(info.ng);
                let ns = match self.surfaces[info.surface as usize].attributes {
                    None => ng,
                    Some(attributes) => {
                        let own = self.attributes[attributes as usize].normal(id, b, info.ng);
                        if own == info.ng { ng } else { instance.normal_to_world(own) }
                    }
                };
                (index, t, p, ng, ns, info.residual, info.surface)
            }
            Hit::Analytic { .. } | Hit::Triangle { .. } => unreachable!("it is in no instance"),
        };
        let p_error = self.accel.instance(index).p_error(p, ng, residual);
        let surface = &self.surfaces[surface as usize];
        Found { point: SurfacePoint { p, ng, p_error }, t, ns, surface }
    }

    #[inline(never)]
    fn read(&self, texture: &Texture, hit: &Hit, found: &Found) -> Spectrum {
        texture.at(&self.coordinates(hit, found))
    }

    #[inline(never)]
    fn varying_interaction(
        &self,
        hit: &Hit,
        found: &Found,
        emitted: Spectrum,
        varying: &Varying,
        side: Side,
    ) -> Interaction {
        if let (Scattering::Same(bsdf), None) = (&varying.scattering, &varying.relief) {
            return found.finish(*bsdf, self.frame(hit, *found, bsdf), emitted);
        }
        let at = self.coordinates(hit, found);
        let bsdf = varying.scattering.at(&at);
        let Some(relief) = &varying.relief else {
            return found.finish(bsdf, self.frame(hit, *found, &bsdf), emitted);
        };
        let derivatives = self.derivatives(hit, found);
        let frame = Frame::from_z_x(found.ns, derivatives.dpdu.normalize_or_zero());
        let normal = relief.map.normal(&frame, &at, &derivatives);
        // What rises out of a back of its own would be a dent of the front.
        let normal = if side == Side::Front { normal } else { vec3(-normal.x, -normal.y, normal.z) };
        let normals = Normals::Tilted(Tilt { normal, remedies: relief.remedies });
        Interaction { normals, ..found.finish(bsdf, frame, emitted) }
    }

    /// The frame of a surface without relief: turned along growing u where that changes something.
    #[inline(always)]
    fn frame(&self, hit: &Hit, found: Found, bsdf: &Bsdf) -> Frame {
        if bsdf.is_anisotropic() {
            Frame::from_z_x(found.ns, self.derivatives(hit, &found).dpdu.normalize_or_zero())
        } else {
            Frame::from_z(found.ns)
        }
    }

    /// Where textures are read at a hit.
    fn coordinates(&self, hit: &Hit, found: &Found) -> SurfaceCoordinates {
        let p = found.point.p;
        match *hit {
            Hit::Analytic { id, at, .. } => self.analytic[id as usize].chart.coordinates(p, at.ng),
            Hit::Triangle { id, b, .. } | Hit::PlacedTriangle { id, b, .. } => match found.surface.attributes {
                None => SurfaceCoordinates { uv: b, ..SurfaceCoordinates::of(p) },
                Some(index) => self.attributes[index as usize].coordinates(p, id, b),
            },
            Hit::PlacedAnalytic { id, instance, ng, .. } => {
                let instance = self.accel.instance(instance);
                let chart = &self.analytic[id as usize].chart;
                // Its coordinates are its own, but what is read by place is read in the scene.
                let own = chart.coordinates(instance.to_local(p), instance.normal_to_local(ng));
                SurfaceCoordinates { p, ..own }
            }
        }
    }

    /// How the point moves with its texture coordinates.
    #[inline(never)]
    fn derivatives(&self, hit: &Hit, found: &Found) -> Derivatives {
        match *hit {
            Hit::Analytic { id, at, .. } => self.analytic[id as usize].chart.derivatives(at.p, at.ng),
            Hit::Triangle { id, .. } | Hit::PlacedTriangle { id, .. } => {
                let own = match found.surface.attributes {
                    None => Derivatives::default(),
                    Some(index) => self.attributes[index as usize].derivatives(id),
                };
                match *hit {
                    Hit::PlacedTriangle { instance, .. } => self.placed_derivatives(instance, own),
                    _ => own,
                }
            }
            Hit::PlacedAnalytic { id, instance, p, ng, .. } => {
                let placed = self.accel.instance(instance);
                let chart = &self.analytic[id as usize].chart;
                self.placed_derivatives(instance, chart.derivatives(placed.to_local(p), placed.normal_to_local(ng)))
            }
        }
    }

    fn placed_derivatives(&self, instance: u32, own: Derivatives) -> Derivatives {
        let instance = self.accel.instance(instance);
        Derivatives { dpdu: instance.vector_to_world(own.dpdu), dpdv: instance.vector_to_world(own.dpdv) }
    }
}

impl Found<'_> {
    #[inline(always)]
    fn finish(&self, bsdf: Bsdf, frame: Frame, emitted: Spectrum) -> Interaction {
        let normals = if self.ns == self.point.ng { Normals::Flat } else { Normals::Smooth };
        Interaction {
            point: self.point,
            t: self.t,
            frame,
            normals,
            bsdf,
            emitter: self.surface.emitter,
            emitted,
            surface: self.surface.id,
        }
    }
}
