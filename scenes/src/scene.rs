//! A scene, built: what integrators ask about the world.

mod facets;
mod masks;
mod shading;

pub use facets::{Facet, FacetHit};
use sampling::fault;

use crate::accel::{Accel, Kernel};
use crate::builtin;
use crate::camera::{Camera, Crop};
use crate::emitter::{
    ChoiceRule, Emitter, EmitterChoice, EmitterId, EmitterOdds, Endpoint, EndpointKind, LeSample, LiSample,
    NextEventChoice, PointRule,
};
use crate::interaction::Interaction;
use crate::labels::Labels;
use crate::material::Material;
use crate::needs::Needs;
use crate::ray::{Ray, SurfacePoint};
use crate::surface::{AnalyticInfo, Attributes, Chart, Surface, TriangleInfo};
use glam::DVec3;
use sampling::math::{Frame, Spectrum};
use sampling::{Vec2, Vec3, warp};

/// A scene. It is made by a [`SceneBuilder`](crate::builder::SceneBuilder) and does not change, but for its camera.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Its name.
    pub name: String,
    /// Its camera.
    pub camera: Camera,
    /// The pixels that are rendered unless others are asked for; all of them if None.
    pub crop: Option<Crop>,
    /// What it asks of a method; under [`Skip::Nothing`](crate::needs::Skip) more than it holds.
    pub needs: Needs,
    /// What it holds, whatever is skipped: what methods are asked about.
    pub facts: Needs,
    /// What emits light; an [`EmitterId`] is a place in this list.
    pub emitters: Vec<Emitter>,
    /// The emitter that rays meet which meet nothing else.
    pub environment: Option<EmitterId>,
    /// How next-event estimation chooses among emitters.
    pub choice_rule: ChoiceRule,
    /// How it places points on surfaces that emit.
    pub point_rule: PointRule,
    /// What was approximated or left out when it was loaded.
    pub notes: Vec<String>,
    /// How much of the series is rendered unless something else is asked for.
    pub series: Series,
    /// The built-in scene that it is, if it is one.
    pub(crate) closed_form: Option<&'static str>,
    /// A hash of all that its images depend on: geometry, materials, emitters, camera as built; not the number of
    /// pixels and the crop.
    pub hash: String,
    /// Where the scene's own coordinates have their origin, in the coordinates it was given in \[m\]; zero unless it lies
    /// far from the origin.
    pub origin: DVec3,
    /// A sphere around all surfaces.
    pub bounds: BoundingSphere,
    pub(crate) accel: Accel,
    pub(crate) triangles: Vec<TriangleInfo>,
    pub(crate) analytic: Vec<AnalyticInfo>,
    pub(crate) surfaces: Vec<Surface>,
    pub(crate) attributes: Vec<Attributes>,
    pub(crate) materials: Vec<Material>,
    /// What its surfaces and emitters go by.
    pub labels: Labels,
    pub(crate) choice: EmitterChoice,
    pub(crate) next_event_choice: NextEventChoice,
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

impl BoundingSphere {
    /// Where it ends in direction `d` (unit): what stands for light that arrives from there.
    #[inline]
    pub(crate) fn far_point(&self, d: Vec3) -> SurfacePoint {
        SurfacePoint { p: self.center + d * self.radius, ng: -d, p_error: 0.0 }
    }

    /// A ray that flies in from direction `d` (unit), uniform over the disc across the sphere, which meets all of the scene.
    #[inline]
    pub(crate) fn ray_in(&self, d: Vec3, u: Vec2) -> Ray {
        let frame = Frame::from_z(d);
        let disc = warp::uniform_disk(u);
        Ray::new(self.far_point(d).p + (frame.x * disc.x + frame.y * disc.y) * self.radius, -d)
    }

    /// Area of the disc across it \[m²\].
    pub(crate) fn disc_area(&self) -> f64 {
        std::f64::consts::PI * f64::from(self.radius) * f64::from(self.radius)
    }

    /// The density of [`BoundingSphere::ray_in`]'s position \[1/m²\].
    #[inline]
    pub(crate) fn disc_pdf_area(&self) -> f32 {
        let area = std::f32::consts::PI * self.radius * self.radius;
        1.0 / fault!("disc_of_another_radius", area, 1.1 * area)
    }
}

/// How many of each thing a scene holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counts {
    /// Triangles with an area; those of a group once.
    pub triangles: usize,
    /// The same, those of a group for each of its instances.
    pub placed_triangles: u64,
    /// Instances of groups; one within a group for each instance of that.
    pub instances: usize,
    /// Analytic spheres.
    pub spheres: usize,
    /// Analytic disks.
    pub disks: usize,
    /// Analytic cylinders.
    pub cylinders: usize,
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
        let count = |kind: fn(&Chart) -> bool| self.analytic.iter().filter(|info| kind(&info.chart)).count();
        Counts {
            triangles: self.triangles.len(),
            placed_triangles: self.accel.placed_triangles(self.triangles.len()),
            instances: self.accel.instances().len(),
            spheres: count(|chart| matches!(chart, Chart::Sphere(_))),
            disks: count(|chart| matches!(chart, Chart::Disk(_))),
            cylinders: count(|chart| matches!(chart, Chart::Cylinder(_))),
            shapes: self.surfaces.len(),
            materials: self.materials.len(),
            emitters: self.emitters.len(),
        }
    }

    /// The code that follows its rays: the fastest that runs on this processor, unless another was chosen.
    pub fn kernel(&self) -> Kernel {
        self.accel.kernel()
    }

    /// Has its rays followed by other code, which finds the same hits.
    pub fn set_kernel(&mut self, kernel: Kernel) {
        self.accel.set_kernel(kernel);
    }

    /// The materials, as given.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// The largest albedo of any surface, channel by channel: no scattering leaves more of the light. `None` where that is not known for
    /// certain: where some surface is not Lambertian, or has an albedo that follows the surface.
    pub fn largest_albedo(&self) -> Option<Spectrum> {
        let largest = |most: Spectrum, material: &Material| Some(most.max(material.lambertian_albedo()?));
        self.materials.iter().try_fold(Spectrum::ZERO, largest)
    }

    /// The first surface point on the ray's interval (0, `t_max`). To be looked at where it is: it is large to be copied.
    #[inline(always)]
    pub fn intersect(&self, ray: &Ray) -> Option<Interaction> {
        if self.needs.masks {
            return self.intersect_masked(ray);
        }
        // Not by `map`, which would copy what it is given and what it gives.
        match &self.accel.closest(ray) {
            Some(hit) => self.met(hit, ray.d),
            None => None,
        }
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
            Some(Emitter::Area(area)) => area.le(it.emitted, it.point.ng, w),
            _ => Spectrum::ZERO,
        }
    }

    /// Radiance that the surface point where a light walk starts emits in another direction `w` (unit, away from it); zero for
    /// emitters that are no surfaces.
    #[inline]
    pub fn le_at(&self, id: EmitterId, start: &LeSample, w: Vec3) -> Spectrum {
        match self.emitter(id) {
            Emitter::Area(area) => area.le(start.le, start.endpoint.at.ng, w),
            _ => Spectrum::ZERO,
        }
    }

    /// The radiance of an order that leaves a point in a direction \[W/(m²·sr)\], by the scene's closed form; `None` where it has
    /// none. See [`crate::builtin::exact`].
    pub fn exact(&self, order: usize, p: Vec3, d: Vec3) -> Option<Spectrum> {
        builtin::exact(self.closed_form?, order, p, d)
    }

    /// The largest radiance, channel by channel, that a ray may meet where it hits an emitter; of textures that follow the surface
    /// the mean.
    pub fn brightest(&self) -> Spectrum {
        self.emitters.iter().fold(Spectrum::ZERO, |most, emitter| most.max(emitter.brightest()))
    }

    /// Radiance arriving from infinity out of direction `d` (unit, away from the scene).
    #[inline]
    pub fn environment_le(&self, d: Vec3) -> Spectrum {
        match self.environment.map(|id| self.emitter(id)) {
            Some(Emitter::Environment(environment)) => environment.radiance,
            Some(Emitter::Image(image)) => image.le(d),
            _ => Spectrum::ZERO,
        }
    }

    /// An emitter for a light walk, in proportion to its power, and the probability of choosing it; None if nothing emits.
    #[inline]
    pub fn choose_emitter(&self, uc: f32) -> Option<(EmitterId, f32)> {
        self.choice.sample(uc)
    }

    /// The probability that [`Scene::choose_emitter`] chooses this emitter.
    #[inline]
    pub fn emitter_pmf(&self, id: EmitterId) -> f32 {
        self.choice.pmf(id)
    }

    /// An emitter for a point to be lit by, as [`Scene::choice_rule`] says, and the probability of choosing it; None if none was
    /// found that can light it.
    #[inline]
    pub fn choose_emitter_for(&self, at: &SurfacePoint, uc: f32) -> Option<(EmitterId, f32)> {
        self.next_event_choice.sample(&self.choice, at, uc)
    }

    /// The probability that [`Scene::choose_emitter_for`] chooses this emitter for that point.
    #[inline]
    pub fn emitter_pmf_for(&self, id: EmitterId, at: &SurfacePoint) -> f32 {
        self.next_event_choice.pmf(&self.choice, at, id)
    }

    /// How likely each emitter is to be chosen for light that a surface scatters towards `wo`, in place of
    /// [`choose_emitter_for`](Self::choose_emitter_for), if the scene's rule asks surfaces and this one says more than its place does.
    #[inline]
    pub fn emitter_odds(&self, it: &Interaction, wo: Vec3) -> Option<EmitterOdds> {
        self.next_event_choice.odds(&self.choice, it, wo)
    }

    /// An endpoint on an emitter for the point `p_ref` to be lit by; None if the sampled one cannot light it.
    #[inline]
    pub fn sample_li(&self, id: EmitterId, p_ref: Vec3, u: Vec2) -> Option<LiSample> {
        match self.emitter(id) {
            Emitter::Area(area) => area.sample_li(p_ref, u),
            Emitter::Point(point) => point.sample_li(p_ref),
            Emitter::Environment(environment) => Some(environment.sample_li(u)),
            Emitter::Image(image) => Some(image.sample_li(u)),
            Emitter::Spot(spot) => spot.sample_li(p_ref),
            Emitter::Directional(directional) => Some(directional.sample_li()),
        }
    }

    /// The density \[1/sr\] with which [`Scene::sample_li`] finds an endpoint in direction `wi`, given the emitter;
    /// 0 for emitters that no other technique finds.
    #[inline]
    pub fn pdf_li(&self, id: EmitterId, p_ref: Vec3, at: &Endpoint, wi: Vec3) -> f32 {
        match self.emitter(id) {
            Emitter::Area(area) => area.pdf_li(p_ref, &at.at, wi),
            Emitter::Point(_) | Emitter::Spot(_) | Emitter::Directional(_) => 0.0,
            Emitter::Environment(_) => warp::uniform_sphere_pdf(),
            Emitter::Image(image) => image.pdf(wi),
        }
    }

    /// The start of a light walk on an emitter.
    #[inline]
    pub fn sample_le(&self, id: EmitterId, u_p: Vec2, u_d: Vec2) -> Option<LeSample> {
        match self.emitter(id) {
            Emitter::Area(area) => area.sample_le(u_p, u_d),
            Emitter::Point(point) => Some(point.sample_le(u_d)),
            Emitter::Environment(environment) => Some(environment.sample_le(u_p, u_d)),
            Emitter::Image(image) => Some(image.sample_le(u_p, u_d)),
            Emitter::Spot(spot) => Some(spot.sample_le(u_d)),
            Emitter::Directional(directional) => Some(directional.sample_le(u_p)),
        }
    }

    /// The two densities with which [`Scene::sample_le`] starts a walk at an endpoint in direction `d`, given the emitter;
    /// their measures are those of [`LeSample`].
    #[inline]
    pub fn pdf_le(&self, id: EmitterId, at: &Endpoint, d: Vec3) -> (f32, f32) {
        match self.emitter(id) {
            Emitter::Area(area) => area.pdf_le(&at.at, d),
            Emitter::Point(_) => (1.0, warp::uniform_sphere_pdf()),
            Emitter::Environment(environment) => environment.pdf_le(),
            Emitter::Image(image) => image.pdf_le(d),
            Emitter::Spot(spot) => (1.0, spot.pdf_le(d)),
            Emitter::Directional(directional) => directional.pdf_le(),
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
        Endpoint { at: self.bounds.far_point(d), kind: EndpointKind::Infinite }
    }

    #[inline]
    fn emitter(&self, id: EmitterId) -> &Emitter {
        &self.emitters[id.0 as usize]
    }
}

#[cfg(test)]
mod tests;
