//! A scene, built: what integrators ask about the world.

mod masks;
mod shading;

use crate::accel::Accel;
use crate::camera::Camera;
use crate::emitter::{Emitter, EmitterChoice, EmitterId, Endpoint, EndpointKind, LeSample, LiSample};
use crate::interaction::Interaction;
use crate::material::Material;
use crate::needs::Needs;
use crate::ray::{Ray, SurfacePoint};
use crate::surface::{Attributes, SphereInfo, Surface, TriangleInfo};
use glam::DVec3;
use sampling::math::Spectrum;
use sampling::{Vec2, Vec3};

/// A scene. It is made by a [`SceneBuilder`](crate::builder::SceneBuilder) and does not change, but for its camera.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Its name.
    pub name: String,
    /// Its camera.
    pub camera: Camera,
    /// What it asks of a method; under [`Skip::Nothing`](crate::needs::Skip) more than it holds.
    pub needs: Needs,
    /// What it holds, whatever is skipped: what methods are asked about.
    pub facts: Needs,
    /// What emits light; an [`EmitterId`] is a place in this list.
    pub emitters: Vec<Emitter>,
    /// The emitter that rays meet which meet nothing else.
    pub environment: Option<EmitterId>,
    /// What was approximated or left out when it was loaded.
    pub notes: Vec<String>,
    /// How much of the series is rendered unless something else is asked for.
    pub series: Series,
    /// A hash of all that its images depend on: geometry, materials, emitters, camera as built.
    pub hash: String,
    /// Where the scene's own coordinates have their origin, in the coordinates it was given in \[m\]; zero unless it lies
    /// far from the origin.
    pub origin: DVec3,
    /// A sphere around all surfaces.
    pub bounds: BoundingSphere,
    pub(crate) accel: Accel,
    pub(crate) triangles: Vec<TriangleInfo>,
    pub(crate) spheres: Vec<SphereInfo>,
    pub(crate) surfaces: Vec<Surface>,
    pub(crate) attributes: Vec<Attributes>,
    pub(crate) materials: Vec<Material>,
    pub(crate) choice: EmitterChoice,
}

/// How much of the Neumann series a scene is meant to be rendered with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Series {
    /// The last order, if the scene names one.
    pub max_order: Option<usize>,
    /// Whether all beyond it is meant too.
    pub tail: bool,
}

/// A sphere around all surfaces of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingSphere {
    /// Centre \[m\].
    pub center: Vec3,
    /// Radius \[m\]; 1 for a scene without surfaces.
    pub radius: f32,
}

/// How many of each thing a scene holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counts {
    /// Triangles with an area.
    pub triangles: usize,
    /// Analytic spheres.
    pub spheres: usize,
    /// Shapes as given.
    pub shapes: usize,
    /// Materials as given.
    pub materials: usize,
    /// Emitters.
    pub emitters: usize,
}

impl Scene {
    /// How many of each thing the scene holds.
    pub fn counts(&self) -> Counts {
        Counts {
            triangles: self.triangles.len(),
            spheres: self.spheres.len(),
            shapes: self.surfaces.len(),
            materials: self.materials.len(),
            emitters: self.emitters.len(),
        }
    }

    /// The materials, as given.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// The first surface point on the ray's interval (0, `t_max`).
    #[inline]
    pub fn intersect(&self, ray: &Ray) -> Option<Interaction> {
        if self.needs.masks {
            return self.intersect_masked(ray);
        }
        self.accel.closest(ray).map(|hit| self.interaction(hit))
    }

    /// Whether any surface is on the ray's interval (0, `t_max`).
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        if self.needs.masks { self.occluded_masked(ray) } else { self.accel.any(ray) }
    }

    /// Radiance emitted at a surface point in direction `w` (unit, away from it); zero if it doesn't emit that way.
    #[inline]
    pub fn le(&self, it: &Interaction, w: Vec3) -> Spectrum {
        match it.emitter.map(|id| self.emitter(id)) {
            Some(Emitter::Area(area)) => area.le(&it.point, w),
            _ => Spectrum::ZERO,
        }
    }

    /// Radiance that an emitter's surface point emits in direction `w` (unit, away from it); zero for other emitters.
    #[inline]
    pub fn le_at(&self, id: EmitterId, endpoint: &Endpoint, w: Vec3) -> Spectrum {
        match self.emitter(id) {
            Emitter::Area(area) => area.le(&endpoint.at, w),
            Emitter::Point(_) | Emitter::Environment(_) => Spectrum::ZERO,
        }
    }

    /// Radiance arriving from infinity out of direction `d` (unit, away from the scene).
    #[inline]
    pub fn environment_le(&self, d: Vec3) -> Spectrum {
        let _ = d;
        match self.environment.map(|id| self.emitter(id)) {
            Some(Emitter::Environment(environment)) => environment.radiance,
            _ => Spectrum::ZERO,
        }
    }

    /// An emitter in proportion to its power, and the probability of choosing it; None if nothing emits.
    #[inline]
    pub fn choose_emitter(&self, uc: f32) -> Option<(EmitterId, f32)> {
        self.choice.sample(uc)
    }

    /// The probability that [`Scene::choose_emitter`] chooses this emitter.
    #[inline]
    pub fn emitter_pmf(&self, id: EmitterId) -> f32 {
        self.choice.pmf(id)
    }

    /// An endpoint on an emitter for the point `p_ref` to be lit by; None if the sampled one cannot light it.
    #[inline]
    pub fn sample_li(&self, id: EmitterId, p_ref: Vec3, u: Vec2) -> Option<LiSample> {
        match self.emitter(id) {
            Emitter::Area(area) => area.sample_li(p_ref, u),
            Emitter::Point(point) => point.sample_li(p_ref),
            Emitter::Environment(environment) => Some(environment.sample_li(u)),
        }
    }

    /// The density \[1/sr\] with which [`Scene::sample_li`] finds an endpoint in direction `wi`, given the emitter;
    /// 0 for a point emitter, which no other technique finds.
    #[inline]
    pub fn pdf_li(&self, id: EmitterId, p_ref: Vec3, at: &Endpoint, wi: Vec3) -> f32 {
        match self.emitter(id) {
            Emitter::Area(area) => area.pdf_li(p_ref, &at.at, wi),
            Emitter::Point(_) => 0.0,
            Emitter::Environment(_) => sampling::warp::uniform_sphere_pdf(),
        }
    }

    /// The start of a light walk on an emitter.
    #[inline]
    pub fn sample_le(&self, id: EmitterId, u_p: Vec2, u_d: Vec2) -> Option<LeSample> {
        match self.emitter(id) {
            Emitter::Area(area) => area.sample_le(u_p, u_d),
            Emitter::Point(point) => Some(point.sample_le(u_d)),
            Emitter::Environment(environment) => Some(environment.sample_le(u_p, u_d)),
        }
    }

    /// The two densities with which [`Scene::sample_le`] starts a walk at an endpoint in direction `d`, given the emitter;
    /// their measures are those of [`LeSample`].
    #[inline]
    pub fn pdf_le(&self, id: EmitterId, at: &Endpoint, d: Vec3) -> (f32, f32) {
        match self.emitter(id) {
            Emitter::Area(area) => area.pdf_le(&at.at, d),
            Emitter::Point(_) => (1.0, sampling::warp::uniform_sphere_pdf()),
            Emitter::Environment(environment) => environment.pdf_le(),
        }
    }

    /// The light end of a path that ends at this surface point.
    #[inline]
    pub fn endpoint_of(&self, it: &Interaction) -> Endpoint {
        Endpoint { at: it.point, kind: EndpointKind::Surface }
    }

    /// The light end of a path that leaves the scene in direction `d` (unit).
    #[inline]
    pub fn environment_endpoint(&self, d: Vec3) -> Endpoint {
        let at = SurfacePoint { p: self.bounds.center + d * self.bounds.radius, ng: -d, p_error: 0.0 };
        Endpoint { at, kind: EndpointKind::Infinite }
    }

    #[inline]
    fn emitter(&self, id: EmitterId) -> &Emitter {
        &self.emitters[id.0 as usize]
    }
}

#[cfg(test)]
mod tests;
