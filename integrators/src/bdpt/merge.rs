//! The camera subpath's vertices merged with photons, which are the vertices of all light subpaths of an iteration.
//!
//! A photon of flux Φ near the vertex stands for the irradiance Φ/(πr²): the kernel is the same everywhere within the radius.

use super::join::Join;
use super::{Bdpt, trace_camera, trace_light};
use crate::contribution::{Contribution, PathView, Sink, Technique};
use crate::integrator::{Pixel, Replicate};
use crate::measurement::Counters;
use crate::photons::{Photon, Photons, Schedule};
use crate::request::Request;
use crate::scratch::Scratch;
use crate::start::{CameraStart, start_camera};
use crate::trail::{self, Bounce, Trails};
use crate::vertex::{PathVertex, Site};
use crate::walk::{Stop, WalkRules};
use sampling::bsdf::{Lobes, TransportMode};
use sampling::math::Spectrum;
use sampling::sampler::{Sampler, Subpath};
use scenes::interaction::Normals;
use scenes::{Interaction, Scene};

impl Bdpt {
    /// Traces the photons of an iteration, where some are kept.
    pub(crate) fn trace_photons(
        &mut self,
        scene: &Scene,
        request: &Request,
        schedule: &Schedule,
        replicate: &Replicate,
        number: u32,
    ) -> Counters {
        let Some(mut photons) = self.photons.take() else { return Counters::default() };
        let counters = photons.trace((scene, request), self, schedule, replicate, number);
        self.photons = Some(photons);
        counters
    }

    /// Takes one sample that merges and does nothing else, so that no path can be made in two ways and no weight is needed.
    ///
    /// The camera's walk stops where it scatters by other than a delta lobe at a surface with a diffuse one; there a path is merged.
    /// A path that has no such vertex is met by the walk, or, if no walk can meet its emitter, merged where it first scatters by
    /// other than a delta lobe.
    pub(crate) fn gather<S: Sink>(
        &self,
        scene: &Scene,
        request: &Request,
        pixel: Pixel,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        out: &mut S,
    ) {
        let Some(photons) = &self.photons else { return };
        let mut strategies = self.strategies(scene, request);
        strategies.camera = WalkRules { stop: Stop::Diffuse, ..strategies.camera };
        let CameraStart { raster, sample } = start_camera(scene, pixel, sampler, &mut scratch.counters);
        trace_camera(scene, &strategies, &sample, sampler, scratch);
        let camera = std::mem::take(&mut scratch.camera);
        let (counters, trails) = (&mut scratch.counters, &mut scratch.trails);
        let settings = self;
        let (light, paths) = (&[][..], &[][..]);
        Join { scene, request, settings, strategies, raster, light, paths, camera: &camera, counters, trails, out }
            .gather(photons, sampler);
        scratch.camera = camera;
    }
}

impl<S: Sink> Join<'_, S> {
    /// Merges, each path in one way.
    fn gather(&mut self, photons: &Photons, sampler: &Sampler) {
        if let Some(classifier) = self.classifier() {
            self.follow(classifier);
        }
        let mut all_delta = true;
        for t in 2..=self.camera.len() {
            if self.request.wants(t - 2)
                && let Some((end, value)) = self.emitted(t)
            {
                self.add_emission(t, end.emitter, value, 1.0);
            }
            let Site::Surface(hit) = &self.camera[t - 1].site else { return };
            if hit.is_connectable() {
                let diffuse = hit.bsdf.lobes().intersects(Lobes::DIFFUSE);
                if diffuse || all_delta {
                    self.merge(t, photons, sampler, |_, photon, _| (diffuse || photon.bare).then_some(1.0));
                }
            }
            all_delta &= self.camera[t - 1].delta;
        }
    }

    /// Merges, weighted against all other strategies.
    pub(super) fn merge_weighted(&mut self, t: usize, photons: &Photons, sampler: &Sampler) {
        self.merge(t, photons, sampler, |join, photon, camera| {
            Some(join.strategies.weight_merged(&photon.end, photon.wo, camera))
        });
    }

    /// Merges the camera subpath's vertex `t − 1`, which scatters by other than delta lobes, with the photons near it; `weigh` gives
    /// their weights, `None` for what is left to other strategies.
    fn merge(
        &mut self,
        t: usize,
        photons: &Photons,
        sampler: &Sampler,
        weigh: impl Fn(&Self, &Photon, &[PathVertex]) -> Option<f64>,
    ) {
        let camera = &self.camera[..t];
        let z = &camera[t - 1];
        let Site::Surface(hit) = &z.site else { return };
        photons.near(z.at.p, |photon| {
            let s = usize::from(photon.vertices);
            if !self.request.wants(s + t - 3) {
                return;
            }
            let f = hit.eval(z.wo, photon.wo, TransportMode::Radiance);
            if f.is_zero() {
                return;
            }
            let Some(weight) = weigh(self, photon, camera) else { return };
            let scale = photons.scale() * cosines(hit, photon);
            let value = z.beta * f * Spectrum::from(photon.flux) * scale;
            self.add_merged(photons, photon, (t, hit), sampler, (value, weight));
        });
    }

    /// Hands a merged path over.
    fn add_merged(
        &mut self,
        photons: &Photons,
        photon: &Photon,
        (t, hit): (usize, &Interaction),
        sampler: &Sampler,
        (value, weight): (Spectrum, f64),
    ) {
        let camera = &self.camera[..t];
        let z = &camera[t - 1];
        if let Some(classifier) = self.classifier() {
            let Trails { camera: trail, classes, .. } = &mut *self.trails;
            trail.scatter(classifier, Subpath::Camera, t - 1, &Bounce { hit, wo: z.wo, wi: photon.wo, delta: false });
            trail::join(classifier, trail.at(trail.last()), photons.shares(photon), classes);
            trail.pop();
        }
        let mut again = Scratch::default();
        if S::WANTS.vertices {
            let mut sampler = sampler.clone();
            photons.restart(photon, &mut sampler);
            trace_light(self.scene, &self.strategies, 0, &mut sampler, &mut again);
            again.light.truncate(usize::from(photon.vertices));
        }
        let path = if S::WANTS.vertices { PathView { light: &again.light, camera } } else { PathView::default() };
        let technique = Technique::merge(usize::from(photon.vertices), t);
        let classes = if self.classifier().is_some() { &self.trails.classes[..] } else { &[] };
        let emitter = Some(photon.emitter);
        self.out.add(Contribution { raster: self.raster, technique, value, weight, path, emitter, classes });
    }
}

/// |wi·ns| / |wi·ng|: flux arrives per area of the surface, and scattering goes by the cosine to the shading normal. The former is that of the
/// facet on which the photon lies: by that of the camera's facet, photons of the next one would have a mean without bounds along the edge.
#[inline]
fn cosines(hit: &Interaction, photon: &Photon) -> f32 {
    match hit.normals {
        Normals::Flat => 1.0,
        Normals::Smooth | Normals::Tilted(_) => photon.wo.dot(hit.ns()).abs() / photon.slant,
    }
}
