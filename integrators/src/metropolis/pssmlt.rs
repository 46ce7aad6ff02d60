//! Metropolis sampling of path tracing \[Kelemen02\].

use super::{Bootstrap, Explored, LargeSteps, SmallStep};
use crate::contribution::Sink;
use crate::integrator::{Estimator, Pixel};
use crate::path::Path;
use crate::request::Request;
use crate::roulette::Roulette;
use crate::scratch::Scratch;
use sampling::sampler::Sampler;
use scenes::Scene;
use serde::{Deserialize, Serialize};

/// The settings of primary-sample-space Metropolis light transport: a point is a camera walk with its next-event estimates, all orders
/// at once.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pssmlt {
    /// Probability of large steps.
    pub large_steps: LargeSteps,
    /// The largest small step.
    pub small_step: SmallStep,
    /// Points for each mutation at which chains may begin, and by which the image's brightness is known.
    pub bootstrap: Bootstrap,
    /// How walks end.
    pub roulette: Roulette,
}

impl Default for Pssmlt {
    fn default() -> Self {
        Self {
            large_steps: LargeSteps::default(),
            small_step: SmallStep::default(),
            bootstrap: Bootstrap::default(),
            roulette: Roulette::Throughput,
        }
    }
}

impl Explored for Pssmlt {
    type Base = Path;

    const INSTEAD: &'static str = "light or bdpt";

    fn base(&self) -> Path {
        Path { roulette: self.roulette.into(), ..Path::default() }
    }

    fn steps(&self) -> (LargeSteps, SmallStep, Bootstrap) {
        (self.large_steps, self.small_step, self.bootstrap)
    }

    fn explore<S: Sink>(
        &self,
        scene: &Scene,
        request: &Request,
        pixel: Pixel,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        out: &mut S,
    ) -> f32 {
        self.base().estimate(scene, request, pixel, sampler, scratch, out);
        1.0
    }
}
