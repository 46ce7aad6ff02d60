//! What a method is, and THE LIST of methods.

use crate::bias::Bias;
use crate::block::{Block, Blocks, Window};
use crate::composite::{self, Composite};
use crate::contribution::{Contribution, Sink, Technique};
use crate::film::BlockFilm;
use crate::measurement::Counters;
use crate::metropolis::{Metropolis, Mmlt, Pssmlt};
use crate::request::Request;
use crate::sampled::Sampled;
use crate::scratch::Scratch;
use crate::settings::{nearest, parse_settings};
use sampling::filter::{Filter, FilterSample};
use sampling::sampler::{Sampler, SamplerKind, StreamKey};
use sampling::{Vec2, vec2};
use scenes::{Needs, Scene};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
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
/// An estimator *is* its settings. [`Methods::with`] makes it an [`Integrator`].
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

/// Why a method cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MethodError {
    /// No method of that name.
    #[error("there is no method `{name}`; did you mean `{nearest}`? (methods: {known})")]
    Unknown {
        /// What was asked for.
        name: String,
        /// The most similar name.
        nearest: String,
        /// All names.
        known: String,
    },
    /// No setting of that name.
    #[error("method `{method}` has no setting `{key}`; {mend}")]
    UnknownSetting {
        /// The method.
        method: String,
        /// What was set.
        key: String,
        /// What could be set instead.
        mend: String,
    },
    /// A setting's value cannot be used.
    #[error("method `{method}`: {reason}")]
    BadSetting {
        /// The method.
        method: String,
        /// What was expected.
        reason: String,
    },
}

type Factory = Box<dyn Fn(&Value, &Methods) -> Result<Box<dyn Integrator>, MethodError> + Send + Sync>;

/// A registered method.
pub struct MethodEntry {
    /// Its name.
    pub name: &'static str,
    /// What it does, in a line.
    pub summary: &'static str,
    /// The light-path expression of what it carries by default.
    pub expression: &'static str,
    /// The bias that it has by default.
    pub bias: Bias,
    /// Its settings' defaults, as a JSON object.
    pub defaults: Value,
    pub(crate) factory: Factory,
}

/// The methods that can be named in experiments.
pub struct Methods {
    entries: Vec<MethodEntry>,
}

impl Methods {
    /// THE LIST.
    pub fn standard() -> Self {
        Self { entries: Vec::new() }
            .with::<crate::classics::Emission>("emission", "order 0: what the camera sees shine")
            .with::<crate::classics::Local>(
                "local",
                "orders 0 and 1 by sampled points of emitters, with shadows or without",
            )
            .with::<crate::classics::Whitted>(
                "whitted",
                "what mirrors and glass show of emitters and of what these light",
            )
            .with::<crate::direct::Direct>("direct", "orders 0 and 1: emitter sampling, BSDF sampling, or both by MIS")
            .with::<crate::path::Path>("path", "path tracing with next-event estimation and MIS")
            .with::<crate::guided::Guided>("guided", "path tracing that learns where light comes from (SD-trees)")
            .with::<crate::light::Light>("light", "particle tracing from the emitters, connected to the camera")
            .with::<crate::bdpt::Bdpt>("bdpt", "bidirectional path tracing: every strategy (s, t), weighted by MIS")
            .with::<crate::vcm::Vcm>("vcm", "connections and merged vertices, weighted by MIS over both")
            .with::<crate::ppm::Ppm>("ppm", "progressive photon mapping: camera walks that end among photons")
            .with::<crate::radiosity::Radiosity>(
                "radiosity",
                "diffuse light on a mesh of elements, every order by application of the operator's matrix",
            )
            .with_integrator("pssmlt", "Metropolis sampling of the random numbers of `path`", Metropolis::<Pssmlt>::new)
            .with_integrator(
                "mmlt",
                "Metropolis sampling of the random numbers and strategies of `bdpt`",
                Metropolis::<Mmlt>::new,
            )
            .with::<crate::exact::Exact>(
                crate::exact::NAME,
                "the closed form of a built-in scene's orders, where it has one",
            )
            .with_composite()
    }

    /// Registers the method that is made of the others.
    fn with_composite(mut self) -> Self {
        self.entries.push(MethodEntry {
            name: composite::NAME,
            summary: "every order by the method that does it best, as a pilot finds",
            expression: "L.*E",
            bias: Bias::None,
            defaults: json!({"runs": []}),
            factory: Box::new(|settings, methods| Ok(Box::new(Composite::new(settings, methods)?))),
        });
        self
    }

    /// Registers an estimator under a name; a later one of the same name replaces the earlier.
    pub fn with<E: Estimator>(self, name: &'static str, summary: &'static str) -> Self {
        self.with_integrator(name, summary, |name, estimator: E| Sampled { name, estimator })
    }

    /// The same of an integrator that is made of its name and settings.
    pub fn with_integrator<S, I>(
        mut self,
        name: &'static str,
        summary: &'static str,
        make: fn(&'static str, S) -> I,
    ) -> Self
    where
        S: Serialize + DeserializeOwned + Default + 'static,
        I: Integrator + 'static,
    {
        self.entries.retain(|e| e.name != name);
        let factory = move |settings: &Value, _: &Methods| -> Result<Box<dyn Integrator>, MethodError> {
            Ok(Box::new(make(name, parse_settings::<S>(name, settings)?)))
        };
        let made = make(name, S::default());
        let (expression, bias, defaults) = (made.expression(), made.bias(), made.settings());
        self.entries.push(MethodEntry { name, summary, expression, bias, defaults, factory: Box::new(factory) });
        self
    }

    /// The registered methods, in order of registration.
    pub fn entries(&self) -> &[MethodEntry] {
        &self.entries
    }

    /// Their names.
    pub fn names(&self) -> Vec<&'static str> {
        self.entries.iter().map(|e| e.name).collect()
    }

    /// Makes a method from a JSON object of settings; those left out (or `null` for all) take their defaults.
    ///
    /// # Errors
    /// If there is no such method or setting, with the nearest valid name, or a value is not of the setting's kind.
    pub fn build(&self, name: &str, settings: &Value) -> Result<Box<dyn Integrator>, MethodError> {
        let Some(entry) = self.entries.iter().find(|e| e.name == name) else {
            let names = self.names();
            return Err(MethodError::Unknown {
                name: name.to_owned(),
                nearest: nearest(name, &names).unwrap_or_default().to_owned(),
                known: names.join(", "),
            });
        };
        (entry.factory)(settings, self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_of_the_list_is_made_from_nothing_and_from_its_own_defaults() {
        let methods = Methods::standard();
        for entry in methods.entries() {
            let made = methods.build(entry.name, &json!({})).unwrap();
            assert_eq!((made.name(), made.settings()), (entry.name, entry.defaults.clone()));
            assert_eq!(methods.build(entry.name, &entry.defaults).unwrap().settings(), entry.defaults);
        }
    }

    #[test]
    fn unknown_names_and_values_are_answered_with_the_mend() {
        let methods = Methods::standard();
        let message = |name: &str, settings: Value| methods.build(name, &settings).err().unwrap().to_string();
        assert!(message("bpdt", json!({})).contains("did you mean `bdpt`"));
        assert!(message("bdpt", json!({"miss": "power"})).contains("did you mean `mis`"));
        assert!(message("bdpt", json!({"mis": "powr"})).contains("setting `mis`"));
        assert!(message("bdpt", json!(3)).contains("table"));
    }
}
