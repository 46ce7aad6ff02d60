//! One strategy alone.

use super::join::Join;
use super::{Bdpt, trace_camera, trace_light};
use crate::contribution::Sink;
use crate::integrator::Pixel;
use crate::request::Request;
use crate::scratch::Scratch;
use crate::start::{CameraStart, start_camera};
use sampling::sampler::Sampler;
use scenes::Scene;

impl Bdpt {
    /// Takes one sample of the strategy of `s` light vertices and `t ≥ 1` camera vertices, with the weight that it has among all.
    /// The subpaths are as long as it needs; one light subpath is traced and no vertices are merged, whatever the settings say.
    #[expect(clippy::too_many_arguments, reason = "an estimator's, and the strategy")]
    pub fn estimate_strategy<S: Sink>(
        &self,
        scene: &Scene,
        request: &Request,
        (s, t): (usize, usize),
        pixel: Pixel,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        out: &mut S,
    ) {
        let mut strategies = self.strategies(scene, request);
        (strategies.light.max_vertices, strategies.camera.max_vertices) = (Some(s), Some(t));
        scratch.camera.clear();
        scratch.light.clear();
        scratch.light_paths.clear();
        // A light subpath that is connected to the camera finds its point there itself.
        if t >= 2 || s == 1 {
            let CameraStart { sample, .. } = start_camera(scene, pixel, sampler, &mut scratch.counters);
            trace_camera(scene, &strategies, &sample, sampler, scratch);
            if scratch.camera.len() < t {
                return;
            }
        }
        if s >= 2 {
            trace_light(scene, &strategies, 0, sampler, scratch);
            if scratch.light.len() < s {
                return;
            }
        }
        let light = std::mem::take(&mut scratch.light);
        let camera = std::mem::take(&mut scratch.camera);
        let paths = std::mem::take(&mut scratch.light_paths);
        Join {
            scene,
            request,
            settings: self,
            strategies,
            raster: pixel.raster,
            light: &light,
            paths: &paths,
            camera: &camera,
            counters: &mut scratch.counters,
            trails: &mut scratch.trails,
            out,
        }
        .run_strategy((s, t), sampler);
        (scratch.light, scratch.camera, scratch.light_paths) = (light, camera, paths);
    }
}
