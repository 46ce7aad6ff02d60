//! A path's densities, worked out anew from its vertices alone.

use super::Found;
use crate::support::PathDensities;
use integrators::bdpt::{Bdpt, Weighting};
use integrators::connect::{EmitterEnd, Strategies};
use integrators::vertex::{PathVertex, Site, density_at};
use integrators::{Orders, Request};
use sampling::bsdf::{Bsdf, TransportMode, fresnel_dielectric};
use sampling::mis::Heuristic;
use sampling::{Vec2, Vec3, vec3};
use scenes::interaction::Normals;
use scenes::{EmitterId, Endpoint, Interaction, Rays, Scene, Tilt};

/// A path taken apart: what is needed to divide it anew.
pub struct Whole<'a> {
    pub scene: &'a Scene,
    pub vertices: &'a [PathVertex],
    pub emitter: EmitterId,
    pub endpoint: Endpoint,
    factors: &'a [f32],
    settings: &'a Bdpt,
    pub strategies: Strategies,
}

impl<'a> Whole<'a> {
    pub fn new(scene: &'a Scene, found: &'a Found, settings: &'a Bdpt) -> Self {
        let vertices = &found.vertices[..];
        let factors = if settings.mis == Weighting::VarianceAware { &found.learnt[..] } else { &[] };
        let (emitter, endpoint) = match &vertices[0].site {
            Site::Emitter(emitter, endpoint) => (*emitter, *endpoint),
            Site::Surface(hit) => (hit.emitter.unwrap(), scene.endpoint_of(hit)),
            Site::Camera(_) => panic!("a path starts at an emitter"),
        };
        let strategies = settings.strategies(scene, &Request::new(Orders::up_to(6), false));
        Self { scene, vertices, emitter, endpoint, factors, settings, strategies }
    }

    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    fn is_infinite(&self, i: usize) -> bool {
        let camera = i == self.len() - 1 && self.scene.camera.rays() == Rays::Parallel;
        camera || i == 0 && self.endpoint.kind.is_infinite()
    }

    /// By how much of themselves the densities of all vertices together may be off here, where directions are worked out of points:
    /// these are rounded, rays start beside them, and what that turns a direction by is divided by the cosine where it is grazing.
    /// Without what narrow lobes make of it. NaN where two points are one, and where light comes from the border of an environment's pixels.
    pub fn rounding(&self) -> f64 {
        if self.is_at_a_border() {
            return f64::NAN;
        }
        let cosine = |i: usize, w: Vec3| match &self.vertices[i].site {
            _ if self.is_infinite(i) => 1.0,
            Site::Surface(hit) => w.dot(self.vertices[i].at.ng).abs().min(w.dot(hit.ns()).abs()),
            Site::Emitter(..) if self.endpoint.kind.is_delta() => 1.0,
            Site::Emitter(..) => w.dot(self.vertices[i].at.ng).abs(),
            Site::Camera(_) => 1.0,
        };
        let edge = |i: usize, j: usize| {
            let w = self.direction(i, j);
            let slants = 2.0 + 1.0 / f64::from(cosine(i, w)) + 1.0 / f64::from(cosine(j, w));
            if self.is_infinite(i) || self.is_infinite(j) {
                return f64::from(f32::EPSILON) * slants;
            }
            let [p, q] = [i, j].map(|i| self.vertices[i].at.p);
            let size = p.abs().max(q.abs()).max_element();
            4.0 * f64::from(f32::EPSILON * size / p.distance(q)) * slants
        };
        (1..self.len()).map(|i| edge(i - 1, i)).sum()
    }

    /// Whether rounding turns the way from what is infinitely far into another piece of it, of another density.
    fn is_at_a_border(&self) -> bool {
        let pdf = |d: Vec3| self.scene.pdf_le(self.emitter, &self.endpoint, d).0;
        let d = self.direction(0, 1);
        let here = pdf(d);
        let turned = Vec3::AXES.into_iter().flat_map(|axis| [-2.0, 2.0].map(|steps| d + steps * f32::EPSILON * axis));
        self.is_infinite(0) && turned.into_iter().any(|d| (pdf(d.normalize()) - here).abs() > 0.1 * here)
    }

    /// Unit direction of flight from a vertex that is infinitely far.
    fn flight(&self, i: usize) -> Vec3 {
        if i == 0 { self.endpoint.at.ng } else { self.scene.camera.sample_we(Vec2::ZERO, Vec2::ZERO).ray.d }
    }

    /// Unit direction from vertex `i` to its neighbour `j`.
    fn direction(&self, i: usize, j: usize) -> Vec3 {
        if self.is_infinite(j) {
            return -self.flight(j);
        }
        if self.is_infinite(i) {
            return self.flight(i);
        }
        (self.vertices[j].at.p - self.vertices[i].at.p).normalize()
    }

    /// Density per solid angle at vertex `i` of going on to `to`, having come from `from`.
    fn scattering(&self, i: usize, from: usize, to: usize, mode: TransportMode) -> f32 {
        let vertex = &self.vertices[i];
        let Site::Surface(hit) = &vertex.site else { panic!("vertex {i} scatters") };
        let (wo, wi) = (self.direction(i, from), self.direction(i, to));
        let pdf = if vertex.delta { delta_density(hit, wo, wi, mode) } else { hit.pdf(wo, wi, mode) };
        pdf * self.strategies.camera.survival(hit)
    }

    fn density(&self, i: usize, pdf: f32, from: usize) -> f64 {
        if self.is_infinite(i) {
            return pdf as f64;
        }
        if self.is_infinite(from) {
            return (pdf * self.vertices[i].at.ng.dot(self.flight(from)).abs()) as f64;
        }
        density_at(&self.vertices[i].at, pdf, self.vertices[from].at.p)
    }

    /// Density of vertex `i` from the light's end.
    fn light_density(&self, i: usize) -> f64 {
        match i {
            0 => {
                let (pdf_p, _) = self.scene.pdf_le(self.emitter, &self.endpoint, self.direction(0, 1));
                (pdf_p * self.scene.emitter_pmf(self.emitter)) as f64
            }
            1 => {
                let (_, pdf_d) = self.scene.pdf_le(self.emitter, &self.endpoint, self.direction(0, 1));
                self.density(1, pdf_d, 0)
            }
            _ => self.density(i, self.scattering(i - 1, i - 2, i, TransportMode::Importance), i - 1),
        }
    }

    /// Density of vertex `i` from the camera's end.
    fn camera_density(&self, i: usize) -> f64 {
        let last = self.len() - 1;
        if i == last {
            return 1.0;
        }
        if i == last - 1 {
            let (_, pdf) = self.scene.camera.pdf_we(&self.vertices[last].at, self.direction(last, i));
            return self.density(i, pdf, last);
        }
        self.density(i, self.scattering(i + 1, i + 2, i, TransportMode::Radiance), i + 1)
    }

    /// The path as strategy `s` would have stored it.
    pub fn divide(&self, s: usize) -> (Vec<PathVertex>, Vec<PathVertex>) {
        let vertex = |i: usize, from: Option<usize>, fwd: f64, rev: f64| {
            let mut vertex = self.vertices[i];
            if i == 0 && s > 0 {
                vertex.site = Site::Emitter(self.emitter, self.endpoint);
                vertex.at = self.endpoint.at;
            }
            vertex.wo = from.map_or(Vec3::ZERO, |from| self.direction(i, from));
            (vertex.pdf_fwd, vertex.pdf_rev) = (fwd, rev);
            vertex.delta &= i > 0;
            vertex
        };
        let light = |i: usize| {
            let rev = if i + 2 < s { self.camera_density(i) } else { f64::NAN };
            vertex(i, i.checked_sub(1), self.light_density(i), rev)
        };
        let camera = |i: usize| {
            let rev = if i > s + 1 && i + 1 < self.len() { self.light_density(i) } else { f64::NAN };
            vertex(i, Some(i + 1).filter(|&j| j < self.len()), self.camera_density(i), rev)
        };
        ((0..s).map(light).collect(), (s..self.len()).rev().map(camera).collect())
    }

    /// Whether by the balance heuristic the best of the others has nearly the weight of strategy `s`, or that nearly the best's, where
    /// densities are off by a part of themselves.
    pub fn nearly_tied(&self, s: usize, off: f64) -> bool {
        let weights: Vec<f64> = (0..self.len()).map(|i| self.weight_by(i, Heuristic::Balance).unwrap_or(0.0)).collect();
        let best = (0..self.len()).filter(|&i| i != s).map(|i| weights[i]).fold(0.0, f64::max);
        (best / weights[s]).ln().abs() < 0.05 + 2.0 * off
    }

    /// The weight that strategy `s` would have, if it is possible.
    pub fn weight(&self, s: usize) -> Option<f64> {
        self.weight_by(s, self.settings.mis.heuristic())
    }

    pub fn weight_by(&self, s: usize, mis: Heuristic) -> Option<f64> {
        let Strategies {
            camera_connections,
            emitter_to_camera,
            light_paths,
            light: light_rules,
            camera: camera_rules,
            ..
        } = self.strategies;
        let (light, camera) = self.divide(s);
        let factors = self.factors.iter().copied().map(f64::from).collect();
        let mut densities =
            PathDensities { camera_connections, emitter_to_camera, light_paths, factors, ..PathDensities::default() };
        let end = EmitterEnd { emitter: self.emitter, endpoint: self.endpoint };
        if s == 0 {
            densities.set_emission(self.scene, &camera, &end);
        } else {
            let next_event = end.next_event_density(self.scene, &self.vertices[1].at);
            densities.set_connected(self.scene, (&light_rules, &camera_rules), &light, &camera, next_event);
        }
        let hittable = !self.endpoint.kind.is_delta();
        let connectable = |i: usize| !self.vertices[i].delta;
        let possible = match s {
            0 => hittable,
            1 if self.len() == 2 => emitter_to_camera && hittable,
            s if s == self.len() - 1 && !camera_connections => false,
            _ => connectable(s - 1) && connectable(s),
        };
        possible.then(|| densities.weight(s, mis))
    }
}

/// A delta lobe's density in the measure that scattering preserves, from the equations alone.
fn delta_density(hit: &Interaction, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
    let (normal, probability) = face(hit, wo, wi, mode);
    let (cos_o, cos_i) = (wo.dot(normal), wi.dot(normal));
    let density = match hit.bsdf {
        Bsdf::Mirror(_) => cos_i.abs(),
        Bsdf::Dielectric(glass) => {
            let eta = if cos_o > 0.0 { glass.eta } else { 1.0 / glass.eta };
            let reflected = fresnel_dielectric(cos_o.abs(), eta).reflected;
            if cos_o * cos_i > 0.0 { reflected * cos_i.abs() } else { (1.0 - reflected) * eta * eta * cos_i.abs() }
        }
        other => panic!("{} has no delta lobe", other.name()),
    };
    density * probability
}

/// The normal that light scatters about, and the probability with which a walk in this mode takes it.
fn face(hit: &Interaction, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Vec3, f32) {
    let Normals::Tilted(Tilt { normal, remedies }) = hit.normals else { return (hit.ns(), 1.0) };
    let mapped = hit.frame.to_world(normal);
    let turned = hit.frame.to_world(vec3(-normal.x, -normal.y, normal.z));
    let level = |w: Vec3, n: Vec3| w.dot(n) * w.dot(hit.ns()) > 0.0;
    let viewer = if mode == TransportMode::Radiance { wo } else { wi };
    let is_mapped = !remedies.turning || level(viewer, mapped);
    let share = match (level(wo, mapped), level(wo, turned)) {
        _ if mode == TransportMode::Radiance || !remedies.turning => 1.0,
        (true, true) => {
            let [one, two] = [1.0 + normal.z, (1.0 - normal.z) * (1.0 + 2.0 * normal.z)];
            (if is_mapped { one } else { two }) / (one + two)
        }
        _ => 1.0,
    };
    (if is_mapped { mapped } else { turned }, share)
}
