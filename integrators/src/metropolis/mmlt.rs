//! Multiplexed Metropolis sampling of bidirectional path tracing \[Hachisuka14\].

use super::{Bootstrap, Explored, LargeSteps, SmallStep};
use crate::bdpt::Bdpt;
use crate::contribution::Sink;
use crate::integrator::Pixel;
use crate::measurement::Layer;
use crate::request::Request;
use crate::roulette::SubpathRoulette;
use crate::scratch::Scratch;
use sampling::sampler::{Purpose, Sampler};
use scenes::Scene;
use serde::{Deserialize, Serialize};

/// The settings of multiplexed Metropolis light transport: a point is an order k, one of its k + 2 strategies (s, t), and the path that
/// this makes, with its MIS weight, k + 2 times.
///
/// \[Hachisuka14\] has chains for each order; here order and strategy are numbers of a point like all others. So a small step
/// may change them, and chains visit an order in proportion to the light that it brings without being told how much that is.
/// Fresh points choose an order half of the time evenly, half of the time by what a pilot has found of each.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Mmlt {
    /// Probability of large steps.
    pub large_steps: LargeSteps,
    /// The largest small step.
    pub small_step: SmallStep,
    /// Points for each mutation at which chains may begin, and by which the image's brightness is known.
    pub bootstrap: Bootstrap,
    /// Probabilities of the orders asked for, each with those before it; no setting, but what a pilot finds. Even if there are none.
    #[serde(skip)]
    pub odds: Vec<f32>,
}

impl Mmlt {
    /// The layer that a number in [0, 1) chooses, and its probability.
    pub(super) fn choose(&self, layers: usize, u: f32) -> (usize, f32) {
        if self.odds.len() != layers {
            let layer = ((u * layers as f32) as usize).min(layers - 1);
            return (layer, 1.0 / layers as f32);
        }
        let layer = self.odds.partition_point(|&up_to| up_to <= u).min(layers - 1);
        let before = if layer > 0 { self.odds[layer - 1] } else { 0.0 };
        (layer, self.odds[layer] - before)
    }
}

impl Explored for Mmlt {
    type Base = Bdpt;

    const INSTEAD: &'static str = "light or vcm";

    fn base(&self) -> Bdpt {
        // A walk that has as many vertices as its strategy must not end before.
        Bdpt { roulette: SubpathRoulette::None, ..Bdpt::default() }
    }

    fn steps(&self) -> (LargeSteps, SmallStep, Bootstrap) {
        (self.large_steps, self.small_step, self.bootstrap)
    }

    fn unsupported_request(&self, request: &Request) -> Option<String> {
        let tail =
            "it chooses one order of those asked for, and the tail has no last one; leave out the tail, or use pssmlt";
        request.tail().then(|| tail.to_owned())
    }

    fn informed(&self, sizes: &[f64]) -> Self {
        let all = sizes.iter().sum::<f64>();
        let even = 1.0 / sizes.len() as f64;
        let mut sum = 0.0;
        let up_to = |size: &f64| {
            sum += if all > 0.0 { 0.5 * (even + size / all) } else { even };
            sum as f32
        };
        let mut odds: Vec<f32> = sizes.iter().map(up_to).collect();
        // Where rounding leaves a rest, it is the last one's.
        odds.iter_mut().last().into_iter().for_each(|last| *last = 1.0);
        Self { odds, ..self.clone() }
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
        let (layer, probability) = self.choose(request.layers().len(), sampler.get_1d(Purpose::Order));
        let Layer::Order(order) = request.layers()[layer] else { return 0.0 };
        let strategies = order + 2;
        let s = ((sampler.get_1d(Purpose::Strategy) * strategies as f32) as usize).min(order + 1);
        self.base().estimate_strategy(scene, request, (s, strategies - s), pixel, sampler, scratch, out);
        strategies as f32 / probability
    }
}
