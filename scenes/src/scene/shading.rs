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
pub(super) struct Found<'a> {
    pub point: SurfacePoint,
    pub t: f32,
    /// The shading normal, without a map.
    ns: Vec3,
    surface: &'a Surface,
    /// What the surface emits here, on the sides that do.
    emitted: Spectrum,
}

impl Scene {
    /// The surface at a hit of a ray of direction `d`, its material read.
    #[inline(always)]
    pub(crate) fn interaction(&self, hit: Hit, d: Vec3) -> Interaction {
        let found = self.found(&hit);
        match &self.materials[found.surface.material.0 as usize] {
            Material::Constant(bsdf) => found.finish(*bsdf, self.frame(&hit, &found, bsdf)),
            Material::Varying(varying) => self.varying_interaction(&hit, &found, varying, Side::Front),
            Material::Subsurface(body) => found.finish(body.boundary(), Frame::from_z(found.ns)),
            Material::Sided(sided) => {
                let (varying, side) = sided.met(d, found.point.ng);
                self.varying_interaction(&hit, &found, varying, side)
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
        let mut found = match *hit {
            Hit::Analytic { t, id, at } => {
                let surface = &self.surfaces[self.analytic[id as usize].surface as usize];
                Found { point: at, t, ns: at.ng, surface, emitted: Spectrum::ZERO }
            }
            Hit::Triangle { t, id, p, b } => {
                let info = &self.triangles[id as usize];
                let surface = &self.surfaces[info.surface as usize];
                let ns = match surface.attributes {
                    None => info.ng,
                    Some(index) => self.attributes[index as usize].normal(id, b, info.ng),
                };
                let point = SurfacePoint::on_surface(p, info.ng, info.residual);
                Found { point, t, ns, surface, emitted: Spectrum::ZERO }
            }
            // Nothing that is kept once emits.
            Hit::PlacedTriangle { .. } | Hit::PlacedAnalytic { .. } => return self.found_placed(hit),
        };
        if let Some(Emitter::Area(area)) = found.surface.emitter.map(|id| self.emitter(id)) {
            found.emitted = match &area.emission.radiance {
                Texture::Constant(radiance) => *radiance,
                varying => self.read(varying, hit, &found),
            };
        }
        found
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
        Found { point: SurfacePoint { p, ng, p_error }, t, ns, surface, emitted: Spectrum::ZERO }
    }

    #[inline(never)]
    fn read(&self, texture: &Texture, hit: &Hit, found: &Found) -> Spectrum {
        texture.at(&self.coordinates(hit, found))
    }

    #[inline(never)]
    fn varying_interaction(&self, hit: &Hit, found: &Found, varying: &Varying, side: Side) -> Interaction {
        if let (Scattering::Same(bsdf), None) = (&varying.scattering, &varying.relief) {
            return found.finish(*bsdf, self.frame(hit, found, bsdf));
        }
        let at = self.coordinates(hit, found);
        let bsdf = varying.scattering.at(&at);
        let Some(relief) = &varying.relief else { return found.finish(bsdf, self.frame(hit, found, &bsdf)) };
        let derivatives = self.derivatives(hit, found);
        let frame = Frame::from_z_x(found.ns, derivatives.dpdu.normalize_or_zero());
        let normal = relief.map.normal(&frame, &at, &derivatives);
        // What rises out of a back of its own would be a dent of the front.
        let normal = if side == Side::Front { normal } else { vec3(-normal.x, -normal.y, normal.z) };
        let normals = Normals::Tilted(Tilt { normal, remedies: relief.remedies });
        Interaction { normals, ..found.finish(bsdf, frame) }
    }

    /// The frame of a surface without relief: turned along growing u where that changes something.
    #[inline(always)]
    fn frame(&self, hit: &Hit, found: &Found, bsdf: &Bsdf) -> Frame {
        if bsdf.is_anisotropic() {
            Frame::from_z_x(found.ns, self.derivatives(hit, found).dpdu.normalize_or_zero())
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
    fn finish(&self, bsdf: Bsdf, frame: Frame) -> Interaction {
        let normals = if self.ns == self.point.ng { Normals::Flat } else { Normals::Smooth };
        Interaction {
            point: self.point,
            t: self.t,
            frame,
            normals,
            bsdf,
            emitter: self.surface.emitter,
            emitted: self.emitted,
            surface: self.surface.id,
        }
    }
}
