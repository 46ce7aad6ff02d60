//! Metropolis sampling in primary sample space \[Kelemen02\]: `pssmlt`, of `path`, and `mmlt`, of the strategies of `bdpt`
//! \[Hachisuka14\].
//!
//! A sample of a method is a function of the uniform numbers that it asks for. A point x of the space of these numbers has
//! contributions F(x), to any pixels and orders, and a size I(x): the sum over all contributions to orders asked for of their channels'
//! mean, so that I is positive wherever any channel of any order is. A Markov chain visits points with density I / b, b = ∫ I. It
//! proposes a point afresh, with the probability of *large steps*, or near its state, and goes there with probability
//! min(1, I(y) / I(x)): both proposals are symmetric, see [`Sampler::of_chain`](sampling::sampler::Sampler::of_chain).
//!
//! **What counts.** Of each proposal, the point that it leads to counts by the probability of going there, and the state by that of
//! staying. A fresh proposal is an independent sample besides, and the two are weighted by the balance heuristic: in place of
//! b F / I, what counts is `b F / (I + p b′)` of every state, and `b′ F / (I + p b′)` of every fresh proposal [Kelemen02, §5]. p is the
//! probability of large steps; b′ need not be b for that.
//!
//! **What is exact.** In every replicate anew, N independent points with numbers of their own give the estimate b̂ = Σ I(xᵢ) / N, and
//! the chains begin at some of them, each at xᵢ with probability I(xᵢ) / Σ I(xⱼ). What a chain brings after any number of steps, times b̂,
//! has the mean Σ I(xᵢ)/N · Pᵗg(xᵢ) over the choice, where g = F / (I + p b′) and P is a step; and ∫ I Pᵗg = ∫ I g, since I is stationary. So the
//! mean is the truth for any N and any length of chains: there is no bias of the start to get rid of, as in [Veach97, §11.3.1],
//! whose weight is b̂ here. It needs weights that do not depend on these points: b′ comes from a pilot of an eighth as many, or of 1024.
//! (A b′ far too small would leave the mean right in a way that no replicate shows: fresh proposals of orders that are not met in the
//! pilot count as much as b′ lets them, and the rest is left to chains, which visit an order of a millionth of the light once in a million steps.)
//! A replicate whose points all miss the light has b̂ = 0, and that is as it must be for the mean; replicates show how far b̂ errs, for it
//! differs in each, and errors are those of replicates.
//!
//! **What is counted.** A sample is a mutation: n samples per pixel are n mutations for every pixel of the image, whatever pixels
//! they visit, in one chain for every [block](crate::block) of 1024. The points at which chains may begin come on top of that,
//! `bootstrap` for every mutation, and their rays and seconds are counted with the replicate's. They are as many in proportion however
//! long a replicate is, so that its normalisation becomes exact as the rest does.
//!
//! **What it does to orders.** All orders come from the same chains, which visit an order in proportion to the light that it brings: high
//! orders get few visits. To see them by themselves, ask for them alone.
//!
//! Values that are not finite are counted and have no size, so that no chain stays with them.

mod chain;
mod mmlt;
mod point;
mod pssmlt;
mod seeds;
mod steps;

pub use mmlt::Mmlt;
pub use pssmlt::Pssmlt;
pub use steps::{Bootstrap, LargeSteps, SmallStep};

use crate::bias::Bias;
use crate::block::{Blocks, Window};
use crate::contribution::{Sink, Technique};
use crate::integrator::{Estimator, Integrator, Pass, Pixel, Replicate};
use crate::request::{Orders, Request};
use crate::sampled::unsupported_by;
use crate::scratch::Scratch;
use chain::Chains;
use point::Space;
use sampling::sampler::Sampler;
use scenes::{Needs, Scene};
use seeds::{Seeds, finds_light};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::ops::RangeInclusive;
use steps::Steps;

/// The last order to which seeds are looked for, if not more are asked for: a scene whose light takes some scatterings to arrive is black
/// before.
const SEEDS_UP_TO: usize = 8;

/// Points of the smallest pilot.
const PILOT_AT_LEAST: u64 = 1024;

/// A method whose samples a chain can take.
pub trait Explored: Serialize + DeserializeOwned + Default + Clone + Send + Sync + 'static {
    /// The method of independent samples of the same light.
    type Base: Estimator;

    /// What would find light where this does not.
    const INSTEAD: &'static str;

    /// The method of independent samples of the same light.
    fn base(&self) -> Self::Base;

    /// Probability of large steps, size of small ones, points for each mutation at which chains may begin.
    fn steps(&self) -> (LargeSteps, SmallStep, Bootstrap);

    /// Why it cannot estimate what is asked for, if so.
    fn unsupported_request(&self, request: &Request) -> Option<String> {
        self.base().unsupported_request(request)
    }

    /// The same once a pilot has found how much light each layer has, more or less.
    fn informed(&self, _sizes: &[f64]) -> Self {
        self.clone()
    }

    /// Takes one sample, whose camera walk is in this pixel if it has one. It is to be counted so many times.
    fn explore<S: Sink>(
        &self,
        scene: &Scene,
        request: &Request,
        pixel: Pixel,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        out: &mut S,
    ) -> f32;
}

/// A method whose samples chains take, under a name.
pub struct Metropolis<E> {
    name: &'static str,
    explored: E,
}

impl<E: Explored> Metropolis<E> {
    /// Of a name and settings.
    pub fn new(name: &'static str, explored: E) -> Self {
        Self { name, explored }
    }

    fn steps(&self) -> Steps {
        let (large, small, bootstrap) = self.explored.steps();
        Steps { large: large.probability(), small: small.largest(), bootstrap: bootstrap.points() }
    }
}

impl<E: Explored> Integrator for Metropolis<E> {
    fn name(&self) -> &str {
        self.name
    }

    fn settings(&self) -> Value {
        serde_json::to_value(&self.explored).unwrap_or(Value::Null)
    }

    fn orders(&self, max_order: usize) -> RangeInclusive<usize> {
        self.explored.base().orders(max_order)
    }

    fn blocks(&self, image: Window, _request: &Request, samples: u32) -> Blocks {
        Blocks::of_chains(image, samples)
    }

    fn carries_subsurface(&self) -> bool {
        E::Base::SUBSURFACE
    }

    fn classifies(&self) -> bool {
        E::Base::CLASSIFIES
    }

    fn expression(&self) -> &'static str {
        self.explored.base().expression()
    }

    fn bias(&self) -> Bias {
        self.explored.base().bias()
    }

    fn makes(&self, technique: Technique) -> bool {
        self.explored.base().makes(technique)
    }

    fn unsupported(&self, scene: &Scene) -> Option<String> {
        unsupported_by(&self.explored.base(), scene)
    }

    fn unsupported_request(&self, request: &Request) -> Option<String> {
        self.explored.unsupported_request(request)
    }

    fn samples_are_independent(&self) -> bool {
        false
    }

    fn bytes(&self, pixels: u64, _: &Request) -> u64 {
        // A sum for each group of seeds, of a sample per pixel; more samples need more.
        (self.steps().bootstrap * pixels as f64) as u64 / seeds::GROUP * 8
    }

    fn seedless(&self, scene: &Scene, request: &Request) -> Option<String> {
        // Where nothing emits, black is the truth.
        if scene.emitters.is_empty() {
            return None;
        }
        let last = request.orders().max_order().max(SEEDS_UP_TO);
        let request = Request::new(Orders::up_to(last), false);
        let space = Space { explored: self.explored.clone(), scene, request: &request };
        let reason = format!(
            "a chain has no path to begin with: none of {} independent samples finds any light up to order {last}; use {}, which need none, \
             or make what emits easier to meet",
            seeds::SCOUTS,
            E::INSTEAD
        );
        (!finds_light(&space)).then_some(reason)
    }

    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        self.explored.base().missing_light(needs)
    }

    fn begin<'a>(&'a self, scene: &'a Scene, request: &'a Request, replicate: Replicate) -> Box<dyn Pass + 'a> {
        let steps = self.steps();
        let mutations =
            u64::from(scene.camera.width()) * u64::from(scene.camera.height()) * u64::from(replicate.samples);
        let points = (steps.bootstrap * mutations as f64).ceil() as u64;
        let space = Space { explored: self.explored.clone(), scene, request };
        let pilot = Seeds::find(&space, replicate.key.of_pilot(), points.div_ceil(8).max(PILOT_AT_LEAST));
        let space = Space { explored: self.explored.informed(&pilot.sizes), ..space };
        let mut seeds = Seeds::find(&space, replicate.key, points);
        seeds.add_work(&pilot);
        Box::new(Chains { space, steps, replicate, seeds, rough: pilot.mean() })
    }
}

#[cfg(test)]
mod tests;
