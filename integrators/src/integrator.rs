//! What a method is: an integrator of the rendering equation.

use crate::bias::Bias;
use crate::block::{Block, Blocks, Window};
use crate::contribution::{Contribution, Sink, Technique};
use crate::film::BlockFilm;
use crate::measurement::Counters;
use crate::request::Request;
use crate::scratch::Scratch;
use sampling::filter::{Filter, FilterSample};
use sampling::sampler::{Sampler, SamplerKind, StreamKey};
use sampling::{Vec2, vec2};
use scenes::{Needs, Scene};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::ops::RangeInclusive;

/// A pixel of the image, row 0 at the top, and where on the film its sample is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel {
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
    /// Where \[pixels\]; within reach of the pixel's filter, which may be off the film.
    pub raster: Vec2,
}

impl Pixel {
    /// A place that the filter samples in a pixel, and its weight, which is the pixel's business and not that of paths.
    #[inline]
    pub fn sample(x: u32, y: u32, filter: Filter, u: Vec2) -> (Self, f32) {
        if filter == Filter::Box {
            // It stays in its pixel where `f32` would round it into the next one.
            let within = |first: u32, u: f32| (first as f32 + u).min(((first + 1) as f32).next_down());
            return (Self { x, y, raster: vec2(within(x, u.x), within(y, u.y)) }, 1.0);
        }
        let FilterSample { offset, weight } = filter.sample(u);
        (Self { x, y, raster: vec2(x as f32 + 0.5, y as f32 + 0.5) + offset }, weight)
    }
}

/// Which independent estimate of the image is made, and of how many samples per pixel.
#[derive(Clone, Copy, Debug)]
pub struct Replicate {
    /// Which of the render's, from 0 on.
    pub number: u32,
    /// Key of its random numbers.
    pub key: StreamKey,
    /// Where they come from.
    pub sampler: SamplerKind,
    /// Samples per pixel.
    pub samples: u32,
}

/// A method that estimates the image by independent samples: one call takes one sample of a pixel and, if the method
/// traces light paths, one light path, whose contributions may land anywhere.
///
/// An estimator *is* its settings. [`Methods::with`](crate::Methods::with) makes it an [`Integrator`].
pub trait Estimator: Serialize + DeserializeOwned + Default + Send + Sync + 'static {
    /// The orders that it can carry, of those up to `max_order`.
    fn orders(&self, max_order: usize) -> RangeInclusive<usize> {
        0..=max_order
    }

    /// Whether it follows light through bodies, from where it leaves them to where it came in.
    const SUBSURFACE: bool = false;

    /// Whether it names the emitter and the classes of every path, so that light groups and path classes can be kept apart.
    const CLASSIFIES: bool = false;

    /// The light-path expression, in the lecture's notation, of the path classes that it carries where no emitter is a point or a
    /// direction.
    fn expression(&self) -> &'static str {
        "L.*E"
    }

    /// How the mean of its images stands to the truth about those classes.
    fn bias(&self) -> Bias {
        Bias::None
    }

    /// Whether it has paths of this technique.
    fn makes(&self, technique: Technique) -> bool {
        matches!(technique, Technique::Connect { .. })
    }

    /// Why it cannot work in a scene, if so.
    fn unsupported(&self, _scene: &Scene) -> Option<String> {
        None
    }

    /// Why it cannot estimate what is asked for, if so.
    fn unsupported_request(&self, _request: &Request) -> Option<String> {
        None
    }

    /// The light that it loses in a scene that needs this, a path class a line.
    fn missing_light(&self, _needs: &Needs) -> Vec<String> {
        Vec::new()
    }

    /// Whether a sample may bring light to other pixels than its own.
    fn splats(&self) -> bool {
        true
    }

    /// The same with what it must know before a replicate's first sample, found by a pilot; `None` where it need know nothing.
    fn prepare(&self, _scene: &Scene, _request: &Request, _replicate: &Replicate) -> Option<Self> {
        None
    }

    /// The work of that pilot, of which [`prepare`](Self::prepare) gave this.
    fn pilot(&self) -> Counters {
        Counters::default()
    }

    /// Whether it works in iterations: whether a sample needs to know something of all samples of its number.
    const ITERATES: bool = false;

    /// Learns what the samples of this number need to know; called on what [`prepare`](Self::prepare) gave, before any of them is
    /// taken and when no other is.
    fn iterate(&mut self, _scene: &Scene, _request: &Request, _replicate: &Replicate, _number: u32) -> Counters {
        Counters::default()
    }

    /// Bytes that it keeps besides the film.
    fn bytes(&self, _pixels: u64, _request: &Request) -> u64 {
        0
    }

    /// Takes one sample of `pixel`. `sampler` stands at that sample; every estimate it gives is of the whole image's
    /// radiance, to be divided by the number of samples per pixel.
    fn estimate<S: Sink>(
        &self,
        scene: &Scene,
        request: &Request,
        pixel: Pixel,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        out: &mut S,
    );
}

/// A method as the renderer sees it. Methods whose replicates share work between samples implement it directly.
pub trait Integrator: Send + Sync {
    /// The name it is registered under.
    fn name(&self) -> &str;

    /// Its settings, defaults included.
    fn settings(&self) -> Value;

    /// The orders that it can carry, of those up to `max_order`.
    fn orders(&self, max_order: usize) -> RangeInclusive<usize>;

    /// Whether it follows light through bodies, from where it leaves them to where it came in.
    fn carries_subsurface(&self) -> bool {
        false
    }

    /// Whether it names the emitter and the classes of every path.
    fn classifies(&self) -> bool {
        false
    }

    /// The light-path expression of what it carries, see [`Estimator::expression`].
    fn expression(&self) -> &'static str;

    /// How the mean of its images stands to the truth about those classes.
    fn bias(&self) -> Bias {
        Bias::None
    }

    /// Whether it has paths of this technique.
    fn makes(&self, technique: Technique) -> bool {
        matches!(technique, Technique::Connect { .. })
    }

    /// Why it cannot work in a scene, if so.
    fn unsupported(&self, scene: &Scene) -> Option<String>;

    /// Why it cannot estimate what is asked for, if so.
    fn unsupported_request(&self, request: &Request) -> Option<String>;

    /// Whether samples are independent, and contributions no larger than their paths' own; chains' are not.
    fn samples_are_independent(&self) -> bool {
        true
    }

    /// How often a sample counts in the mean of the image, at most: more than once where only some of a pixel's samples tell it.
    fn counts(&self) -> f64 {
        1.0
    }

    /// Why it finds nothing to begin with, where it supports scene and request, if so. Asked once, before long work.
    fn seedless(&self, _scene: &Scene, _request: &Request) -> Option<String> {
        None
    }

    /// The light that it loses in a scene that needs this, a path class a line.
    fn missing_light(&self, needs: &Needs) -> Vec<String>;

    /// Whether a sample may bring light to other pixels than its own.
    fn splats(&self) -> bool {
        true
    }

    /// Whether regions of an image can be left to it, with samples of their pixels alone.
    fn divides(&self) -> bool {
        !self.splats()
    }

    /// Whether it works in iterations: whether its passes are told before the samples of each number.
    fn iterates(&self) -> bool {
        false
    }

    /// How so many samples of each of an image's pixels are cut into blocks.
    fn blocks(&self, image: Window, request: &Request, samples: u32) -> Blocks {
        match self.iterates() {
            true => Blocks::of_iterations(image, samples),
            false => Blocks::new(image, samples, request.runs().len() as u32),
        }
    }

    /// Bytes that it keeps besides the film.
    fn bytes(&self, _pixels: u64, _request: &Request) -> u64 {
        0
    }

    /// The most samples that a pixel has of a replicate.
    fn most_samples(&self, _scene: &Scene, _request: &Request, replicate: Replicate) -> u32 {
        replicate.samples
    }

    /// What each of its runs is asked for, where it is [made of other methods](crate::composite).
    fn runs(&self, _request: &Request) -> Vec<Request> {
        Vec::new()
    }

    /// Starts a replicate.
    fn begin<'a>(&'a self, scene: &'a Scene, request: &'a Request, replicate: Replicate) -> Box<dyn Pass + 'a>;
}

/// A replicate at work.
pub trait Pass: Sync {
    /// The work of its estimators' [pilots](Estimator::pilot), which are done when it begins.
    fn pilot(&self) -> Counters {
        Counters::default()
    }

    /// Gets ready for the samples of a number, where the method [iterates](Integrator::iterates); none is at work meanwhile.
    fn begin_iteration(&mut self, _number: u32) -> Counters {
        Counters::default()
    }

    /// Does one block's work. Called once for every block, from any thread.
    fn run(&self, block: Block, out: &mut BlockFilm);

    /// Takes one sample again, of the pixel in this column and row, and shows all that it contributes, with the vertices of every
    /// path. False where the method has no samples that stand alone.
    fn replay(&mut self, _pixel: (u32, u32), _sample: u32, _show: &mut dyn FnMut(&Contribution)) -> bool {
        false
    }
}
