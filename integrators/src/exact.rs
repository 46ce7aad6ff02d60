//! The truth, where it is known: what leaves the first surface that a camera ray meets, by the scene's closed form.
//!
//! It has no variance but that of a pixel's extent, so that comparing a method with it is a test against the exact values.

use crate::contribution::{Contribution, Sink, Technique};
use crate::integrator::{Estimator, Pixel};
use crate::request::Request;
use crate::scratch::Scratch;
use crate::start::{CameraStart, start_camera};
use sampling::Vec3;
use sampling::sampler::Sampler;
use scenes::{Needs, Scene};
use serde::{Deserialize, Serialize};

/// What the method is called: what it gives is known, and taken for the truth.
pub const NAME: &str = "exact";

/// The closed form's settings: none.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exact {}

impl Estimator for Exact {
    fn makes(&self, technique: Technique) -> bool {
        matches!(technique, Technique::Whole { .. })
    }

    fn unsupported(&self, scene: &Scene) -> Option<String> {
        let known = scene.exact(0, Vec3::ZERO, Vec3::Z).is_some();
        (!known).then(|| "it has no closed form; furnace and integrating_sphere have one".to_owned())
    }

    fn unsupported_request(&self, request: &Request) -> Option<String> {
        request.tail().then(|| "it knows single orders, not the sum of all others; leave out the tail".to_owned())
    }

    fn missing_light(&self, _: &Needs) -> Vec<String> {
        Vec::new()
    }

    fn splats(&self) -> bool {
        false
    }

    fn estimate<S: Sink>(
        &self,
        scene: &Scene,
        request: &Request,
        pixel: Pixel,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        out: &mut S,
    ) {
        let CameraStart { raster, sample } = start_camera(scene, pixel, sampler, &mut scratch.counters);
        scratch.counters.closest += 1;
        let Some(hit) = scene.intersect(&sample.ray) else { return };
        for order in request.orders().iter() {
            if let Some(radiance) = scene.exact(order, hit.point.p, -sample.ray.d) {
                let technique = Technique::Whole { order: order as u16 };
                out.add(Contribution::new(raster, technique, radiance * sample.weight, 1.0));
            }
        }
    }
}
