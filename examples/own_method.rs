//! A method of one's own, registered from outside: path tracing that waits for its walks to meet an emitter.
//!
//! Every command knows it like the others:
//!
//! ```text
//! cargo run --release --example own_method -- list methods
//! cargo run --release --example own_method -- render cornell_box -i naive --set survival=0.9
//! cargo run --release --example own_method -- run comparison --set 'methods=["path","naive"]'
//! ```

use integrators::integrator::Pixel;
use integrators::scratch::Scratch;
use integrators::start::start_camera;
use integrators::{Contribution, Estimator, Methods, Request, Sink, Technique};
use sampling::bsdf::TransportMode;
use sampling::math::Spectrum;
use sampling::sampler::{Purpose, Sampler, Subpath};
use scenes::{Needs, Scene};
use serde::{Deserialize, Serialize};
use std::process::ExitCode;

/// The method *is* its settings.
#[derive(Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Naive {
    /// Probability with which a walk goes on at every scattering.
    survival: f32,
}

impl Default for Naive {
    fn default() -> Self {
        Self { survival: 0.8 }
    }
}

impl Estimator for Naive {
    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        let class = "L.*E from points, spots and directional emitters: no walk meets them";
        if needs.delta_emitters { vec![class.to_owned()] } else { Vec::new() }
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
        let start = start_camera(scene, pixel, sampler, &mut scratch.counters);
        let (mut ray, mut beta) = (start.sample.ray, Spectrum::splat(start.sample.weight));
        for order in 0.. {
            scratch.counters.closest += 1;
            let hit = scene.intersect(&ray);
            let le = hit.map_or_else(|| scene.environment_le(ray.d), |hit| scene.le(&hit, -ray.d));
            // A walk of `order` scatterings that met an emitter is strategy (0, order + 2).
            out.add(Contribution::new(start.raster, Technique::connect(0, order + 2), beta * le, 1.0));
            let Some(hit) = hit.filter(|_| request.wants_from(order + 1)) else { return };
            sampler.start_vertex(Subpath::Camera, order as u32 + 1);
            if sampler.get_1d(Purpose::Roulette) >= self.survival {
                return;
            }
            let (uc, u) = (sampler.get_1d(Purpose::Lobe), sampler.get_2d(Purpose::Direction));
            let Some(sample) = hit.sample(-ray.d, uc, u, TransportMode::Radiance) else { return };
            beta *= sample.weight / self.survival;
            ray = hit.point.spawn(sample.wi);
        }
    }
}

/// The methods of the list and this one.
pub fn methods() -> Methods {
    Methods::standard().with::<Naive>("naive", "path tracing without next-event estimation")
}

fn main() -> ExitCode {
    neumann::cli::main_with(&methods())
}
