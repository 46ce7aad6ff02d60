//! `composite`: every order of the series by a method of its own.
//!
//! Orders are disjoint, so that each may be estimated by whichever method does it best, and the sum of the estimates is an
//! estimate of the sum. A composite is a list of [runs](Run): a method, the orders that it is to estimate, and its share of the samples.
//! Of N samples per pixel, run m takes `n_m ≈ N share_m / Σ share`, at least one, with random numbers of its own; what they bring counts
//! N / n_m times. So all of the film's means are divided by N, as ever, and the mean of every order is that of its method.
//! A method that brings light to the pixels of its own samples alone may take more of them in some [regions](Regions) of the image than in others, and
//! none where another run has its orders: every pixel has an n_m of its own then.
//!
//! How shares are best chosen is told in `docs/composite.md`.

use crate::contribution::{Contribution, Technique};
use crate::film::{Block, BlockFilm, Window};
use crate::integrator::{Integrator, Pass, Replicate};
use crate::lpe::lost_in;
use crate::measurement::{Counters, Layer};
use crate::method::{MethodError, Methods};
use crate::request::Request;
use sampling::fault;
use scenes::{Needs, Scene};
use serde_json::{Map, Value, json};
use std::ops::RangeInclusive;

pub use regions::{Regions, windows};
use run::Part;
pub use run::Run;

mod regions;
mod run;

/// The name that it is registered under.
pub const NAME: &str = "composite";

/// Methods that share the orders.
pub struct Composite {
    parts: Vec<Part>,
}

impl Composite {
    /// Of settings `{"runs": [..]}`, or `{"runs": "light:0:0.2;path:1-8:0.8"}`.
    ///
    /// # Errors
    /// If a run's method cannot be made, or be a part, or two runs have an order in common.
    pub fn new(settings: &Value, methods: &Methods) -> Result<Self, MethodError> {
        let bad = |reason: String| MethodError::BadSetting { method: NAME.to_owned(), reason };
        let empty = Map::new();
        let given = match settings {
            Value::Null => &empty,
            Value::Object(given) => given,
            _ => return Err(bad("settings must be a table of names and values".to_owned())),
        };
        if let Some(key) = given.keys().find(|key| *key != "runs") {
            let mend = "did you mean `runs`? (settings: runs)".to_owned();
            return Err(MethodError::UnknownSetting { method: NAME.to_owned(), key: key.clone(), mend });
        }
        let runs: Result<Vec<Run>, String> = match given.get("runs") {
            None => Ok(Vec::new()),
            Some(Value::String(text)) if text.trim_matches([' ', ';']).is_empty() => {
                Err("it is empty; write METHOD:ORDERS:SHARE, such as path:1-3:0.5, or leave it out".to_owned())
            }
            Some(Value::String(text)) => text.split(';').filter(|run| !run.trim().is_empty()).map(Run::read).collect(),
            Some(list) => serde_json::from_value(list.clone()).map_err(|e| {
                let what = crate::with_nearest(&e.to_string());
                format!(
                    "{what}; write METHOD:ORDERS:SHARE, such as path:1-3:0.5, or, in a file, a list of tables in a list"
                )
            }),
        };
        let runs = runs.map_err(|reason| bad(format!("setting `runs`: {reason}")))?;
        let parts = runs.into_iter().map(|run| Part::new(run, methods)).collect::<Result<Vec<_>, _>>().map_err(bad)?;
        if !parts.iter().map(|part| part.run.share).sum::<f64>().is_finite() {
            return Err(bad("the shares of its runs are too large to be added up; give smaller ones".to_owned()));
        }
        for (i, part) in parts.iter().enumerate() {
            if let Some(what) = parts[..i].iter().find_map(|other| part.in_common(other)) {
                return Err(bad(format!("two runs estimate {what}; leave it to one of them, or each region to one")));
            }
        }
        Ok(Self { parts })
    }

    /// Whether a method is a composite whose runs are still to be chosen.
    pub fn is_open(method: &dyn Integrator) -> bool {
        method.name() == NAME && method.settings().get("runs").and_then(Value::as_array).is_none_or(Vec::is_empty)
    }
}

impl Integrator for Composite {
    fn name(&self) -> &str {
        NAME
    }

    fn settings(&self) -> Value {
        json!({ "runs": self.parts.iter().map(|part| &part.run).collect::<Vec<_>>() })
    }

    fn orders(&self, max_order: usize) -> RangeInclusive<usize> {
        0..=max_order
    }

    fn carries_subsurface(&self) -> bool {
        !self.parts.is_empty() && self.parts.iter().all(|part| part.method.carries_subsurface())
    }

    fn classifies(&self) -> bool {
        self.parts.iter().all(|part| part.method.classifies())
    }

    fn expression(&self) -> &'static str {
        "L.*E"
    }

    fn makes(&self, technique: Technique) -> bool {
        let order = technique.order();
        self.parts.iter().any(|part| (part.orders.contains(order) || part.run.tail) && part.method.makes(technique))
    }

    fn unsupported(&self, scene: &Scene) -> Option<String> {
        let reason = |part: &Part| Some(format!("{}: {}", part.run.method, part.method.unsupported(scene)?));
        self.parts.iter().find_map(reason)
    }

    fn unsupported_request(&self, request: &Request) -> Option<String> {
        if self.parts.is_empty() {
            return Some("it has no runs; give some, such as --set 'runs=light:0:0.2;path:1-8:0.8'".to_owned());
        }
        let requests: Vec<Request> = self.parts.iter().map(|part| part.request(request)).collect();
        let runs_of = |layer: &Layer| -> Vec<&Run> {
            let with = self.parts.iter().zip(&requests).filter(|(_, request)| request.layers().contains(layer));
            with.map(|(part, _)| &part.run).collect()
        };
        for layer in request.layers() {
            let what = match layer {
                Layer::Order(order) => format!("order {order}"),
                Layer::Tail => "the tail".to_owned(),
            };
            let runs = runs_of(layer);
            if runs.is_empty() {
                return Some(self.without(layer, &what));
            }
            if !regions::cover_all(&runs.iter().map(|run| run.regions.as_ref()).collect::<Vec<_>>()) {
                return Some(format!("no run estimates {what} in all of the image; give the regions left to a run"));
            }
        }
        let with_part = self.parts.iter().zip(&requests).filter(|(_, request)| !request.layers().is_empty());
        let mut reasons =
            with_part.filter_map(|(part, request)| Some((&part.run.method, part.method.unsupported_request(request)?)));
        reasons.next().map(|(name, reason)| format!("{name}: {reason}"))
    }

    fn counts(&self) -> f64 {
        let shares: f64 = self.parts.iter().map(|part| part.run.share).sum();
        self.parts.iter().map(|part| shares / part.run.share * part.method.counts()).fold(1.0, f64::max)
    }

    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        let mut missing = Vec::new();
        for part in &self.parts {
            let classes = part.method.missing_light(needs);
            let own = |class: &String| lost_in(class, &part.orders, part.run.tail);
            for class in classes.iter().filter_map(own) {
                if !missing.contains(&class) {
                    missing.push(class);
                }
            }
        }
        missing
    }

    fn splats(&self) -> bool {
        self.parts.iter().any(|part| part.method.splats())
    }

    fn bytes(&self, pixels: u64, request: &Request) -> u64 {
        let asked = self.parts.iter().map(|part| (part, part.request(request)));
        let busy = asked.filter(|(_, request)| !request.layers().is_empty());
        busy.map(|(part, request)| part.method.bytes(pixels, &request)).sum()
    }

    fn runs(&self, request: &Request) -> Vec<Request> {
        self.parts.iter().map(|part| part.request(request)).collect()
    }

    fn most_samples(&self, scene: &Scene, request: &Request, replicate: Replicate) -> u32 {
        let size = (scene.camera.width(), scene.camera.height());
        let at_work = self.at_work(request.runs(), replicate, size);
        at_work.iter().map(|run| run.most_samples(scene)).max().unwrap_or(replicate.samples)
    }

    fn begin<'a>(&'a self, scene: &'a Scene, request: &'a Request, replicate: Replicate) -> Box<dyn Pass + 'a> {
        let size = (scene.camera.width(), scene.camera.height());
        let begin = |run: AtWork<'a>| RunPass {
            pass: run.method.begin(scene, run.request, run.replicate),
            most_samples: run.most_samples(scene),
            run,
        };
        let runs = self.at_work(request.runs(), replicate, size).into_iter().map(begin).collect();
        Box::new(CompositePass { runs, samples: replicate.samples })
    }
}

/// A run with something to do in a replicate, in all pixels that have the same number of its samples.
struct AtWork<'a> {
    /// Its number.
    number: usize,
    method: &'a dyn Integrator,
    request: &'a Request,
    replicate: Replicate,
    /// How often what it brings counts.
    scale: f32,
    windows: Vec<Window>,
}

impl AtWork<'_> {
    /// The most samples that a pixel has of it.
    fn most_samples(&self, scene: &Scene) -> u32 {
        self.method.most_samples(scene, self.request, self.replicate)
    }
}

impl Composite {
    /// That no run estimates a layer, and the mend.
    fn without(&self, layer: &Layer, what: &str) -> String {
        let has = |part: &&Part| matches!(layer, Layer::Order(k) if part.orders.contains(*k));
        match self.parts.iter().find(has) {
            Some(part) => {
                let name = &part.run.method;
                format!("no run estimates {what}, which {name} does not carry; give it to another method")
            }
            None => format!("no run estimates {what}; add it to one"),
        }
    }

    /// By how much more samples the runs that have something to do take of an image than their shares of so many of each pixel, since they take whole
    /// ones: 1.2 where six are taken for five.
    pub fn rounding(&self, request: &Request, samples: u32, (width, height): (u32, u32)) -> Vec<f64> {
        let pixels = f64::from(width) * f64::from(height);
        let taken = |(_, part, _, average): (usize, &Part, &Request, f64)| {
            let area = |window: &Window| f64::from(window.width()) * f64::from(window.height());
            let of =
                |(samples, windows): &(u32, Vec<Window>)| f64::from(*samples) * windows.iter().map(area).sum::<f64>();
            part.samples(average, (width, height)).iter().map(of).sum::<f64>() / (pixels * average)
        };
        self.busy(&self.runs(request), samples).map(taken).collect()
    }

    /// The runs that have something to do: number, part, request, and their share of so many samples.
    fn busy<'a>(
        &'a self,
        requests: &'a [Request],
        samples: u32,
    ) -> impl Iterator<Item = (usize, &'a Part, &'a Request, f64)> {
        let all = self.parts.iter().zip(requests).enumerate();
        let busy: Vec<_> = all.filter(|(_, (_, request))| !request.layers().is_empty()).collect();
        let shares: f64 = busy.iter().map(|(_, (part, _))| part.run.share).sum();
        busy.into_iter()
            .map(move |(i, (part, request))| (i, part, request, f64::from(samples) * (part.run.share / shares)))
    }

    /// The runs that have something to do in an image of this width and height, with their samples.
    fn at_work<'a>(&'a self, requests: &'a [Request], replicate: Replicate, size: (u32, u32)) -> Vec<AtWork<'a>> {
        let mut at_work = Vec::new();
        for (i, part, request, average) in self.busy(requests, replicate.samples) {
            at_work.extend(part.samples(average, size).into_iter().map(|(samples, windows)| AtWork {
                number: i,
                method: &*part.method,
                request,
                replicate: Replicate { key: replicate.key.of_part(i as u32), samples, ..replicate },
                scale: fault!("share_of_a_run_forgotten", f64::from(replicate.samples) / f64::from(samples), 1.0)
                    as f32,
                windows,
            }));
        }
        at_work
    }
}

/// A replicate of one run.
struct RunPass<'a> {
    pass: Box<dyn Pass + 'a>,
    /// Of a pixel.
    most_samples: u32,
    run: AtWork<'a>,
}

/// A replicate of all runs.
struct CompositePass<'a> {
    runs: Vec<RunPass<'a>>,
    samples: u32,
}

impl Pass for CompositePass<'_> {
    fn pilot(&self) -> Counters {
        let mut all = Counters::default();
        self.runs.iter().for_each(|run| all += run.pass.pilot());
        all
    }

    fn run(&self, block: Block, out: &mut BlockFilm) {
        for RunPass { pass, run, .. } in &self.runs {
            // A run has got as far with its samples as all have with theirs.
            let own = u64::from(run.replicate.samples);
            let place = |sample: u32| (u64::from(sample) * own).div_ceil(u64::from(self.samples)) as u32;
            let samples = place(block.samples.start)..place(block.samples.end);
            if samples.is_empty() {
                continue;
            }
            out.set_run(run.number, run.scale);
            for tile in run.windows.iter().map(|window| block.tile.within(window)).filter(|tile| !tile.is_empty()) {
                pass.run(Block { tile, samples: samples.clone() }, out);
            }
        }
    }

    fn replay(&mut self, pixel: (u32, u32), sample: u32, show: &mut dyn FnMut(&Contribution)) -> bool {
        for RunPass { pass, most_samples, run } in &mut self.runs {
            if sample >= *most_samples || !run.windows.iter().any(|window| window.contains(pixel)) {
                continue;
            }
            let mut scaled = |c: &Contribution| {
                if run.request.wants(c.technique.order()) {
                    show(&Contribution { weight: c.weight * f64::from(run.scale), ..*c });
                }
            };
            pass.replay(pixel, sample, &mut scaled);
        }
        true
    }
}

#[cfg(test)]
mod tests;
