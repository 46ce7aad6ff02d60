//! `composite`: every order of the series by a method of its own.
//!
//! Orders are disjoint, so that each may be estimated by whichever method does it best, and the sum of the estimates is an
//! estimate of the sum. A composite is a list of [runs](Run): a method, the orders that it is to estimate, and its share of the samples.
//! Of N samples per pixel, run m takes `n_m ≈ N share_m / Σ share`, at least one, with random numbers of its own; what they bring counts
//! N / n_m times. So all of the film's means are divided by N, as ever, and the mean of every order is that of its method.
//!
//! How shares are best chosen is told in `docs/composite.md`.

use crate::bias::Bias;
use crate::contribution::{Contribution, Technique};
use crate::film::{Block, BlockFilm};
use crate::lpe::least_order;
use crate::measurement::{Counters, Layer};
use crate::method::{Integrator, MethodError, Methods, Pass, Replicate};
use crate::request::{Orders, Request};
use sampling::fault;
use scenes::{Needs, Scene};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use std::ops::RangeInclusive;

/// The name that it is registered under.
pub const NAME: &str = "composite";

/// A method at work on some of the orders.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run {
    /// The method's name.
    pub method: String,
    /// Its settings; those left out take their defaults.
    #[serde(default, skip_serializing_if = "Map::is_empty")]
    pub settings: Map<String, Value>,
    /// The orders: a list such as `0,2-4`; of what lies beyond the last order asked for, see `tail`.
    pub orders: String,
    /// Whether it estimates the tail too.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub tail: bool,
    /// Samples, in parts of those of all runs; runs with no order that is asked for apart.
    pub share: f64,
}

impl Run {
    /// As [`Run::read`] takes it, without the settings.
    pub fn brief(&self) -> String {
        let tail = if self.tail { "+tail" } else { "" };
        format!("{}:{}{tail}:{}", self.method, self.orders, self.share)
    }

    /// From `METHOD:ORDERS:SHARE`, such as `path:1-3:0.5`, with `+tail` behind the orders for a run that has it.
    ///
    /// # Errors
    /// If it is written in another way.
    pub fn read(text: &str) -> Result<Self, String> {
        let parts: Vec<&str> = text.split(':').map(str::trim).collect();
        let read = match parts[..] {
            [method, orders, share] => share.parse::<f64>().ok().map(|share| (method, orders, share)),
            _ => None,
        };
        let no_run = || format!("`{text}` is no run; write METHOD:ORDERS:SHARE, such as path:1-3:0.5");
        let (method, orders, share) = read.ok_or_else(no_run)?;
        let (orders, tail) = match orders.strip_suffix("tail") {
            Some(orders) => (orders.trim_end_matches('+'), true),
            None => (orders, false),
        };
        Ok(Self { method: method.to_owned(), settings: Map::new(), orders: orders.to_owned(), tail, share })
    }
}

/// A run that can be made.
struct Part {
    run: Run,
    orders: Orders,
    method: Box<dyn Integrator>,
}

/// Methods that share the orders.
pub struct Composite {
    parts: Vec<Part>,
}

impl Part {
    fn new(run: Run, methods: &Methods) -> Result<Self, String> {
        let Run { method: name, orders, share, settings, .. } = &run;
        if name == NAME {
            return Err("a composite cannot be made of composites; name the methods".to_owned());
        }
        if !(*share > 0.0 && share.is_finite()) {
            return Err(format!("the share {share:?} of {name} is no part of the samples; give a positive number"));
        }
        let all = scenes::description::MAX_ORDER;
        let orders = match orders.as_str() {
            "" if run.tail => Orders::up_to(all).only(|_| false),
            list => Orders::parse(list, all).map_err(|reason| format!("orders of {name}: {reason}"))?,
        };
        let method = methods.build(name, &Value::Object(settings.clone())).map_err(|e| e.to_string())?;
        let why_not = match method.bias() {
            Bias::None if method.iterates() => Some("its samples work in iterations"),
            Bias::None if !method.samples_are_independent() => Some("its samples are those of chains"),
            Bias::None => None,
            _ => Some("it is biased"),
        };
        match why_not {
            Some(why) => Err(format!("{name} cannot be a part: {why}; take path, light or bdpt")),
            None => Ok(Self { run, orders, method }),
        }
    }

    /// What is asked of it where this is asked for.
    fn request(&self, whole: &Request) -> Request {
        let of_both = |k: &usize| self.orders.contains(*k);
        let orders = whole.orders().clone().only(|k| of_both(&k) && self.method.orders(k).contains(&k));
        Request::new(orders, whole.tail() && self.run.tail).with_parts(whole.parts().clone())
    }
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
            Some(Value::String(text)) => text.split(';').map(Run::read).collect(),
            Some(list) => serde_json::from_value(list.clone()).map_err(|e| crate::in_plain_words(&e.to_string())),
        };
        let runs = runs.map_err(|reason| bad(format!("setting `runs`: {reason}")))?;
        let parts = runs.into_iter().map(|run| Part::new(run, methods)).collect::<Result<Vec<_>, _>>().map_err(bad)?;
        for (i, part) in parts.iter().enumerate() {
            for other in &parts[..i] {
                let tail = part.run.tail && other.run.tail;
                let both = part.orders.iter().find(|&k| other.orders.contains(k));
                if tail || both.is_some() {
                    let what = both.map_or("the tail".to_owned(), |order| format!("order {order}"));
                    return Err(bad(format!("two runs estimate {what}; leave it to one of them")));
                }
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
        let lost = |layer: &&Layer| !requests.iter().any(|request| request.layers().contains(layer));
        if let Some(layer) = request.layers().iter().find(lost) {
            let what = match layer {
                Layer::Order(order) => format!("order {order}"),
                Layer::Tail => "the tail".to_owned(),
            };
            return Some(format!("no run estimates {what}; add it to a run whose method can"));
        }
        let with_part = self.parts.iter().zip(&requests).filter(|(_, request)| !request.layers().is_empty());
        let mut reasons =
            with_part.filter_map(|(part, request)| Some((&part.run.method, part.method.unsupported_request(request)?)));
        reasons.next().map(|(name, reason)| format!("{name}: {reason}"))
    }

    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        let mut missing = Vec::new();
        for part in &self.parts {
            let last = part.orders.iter().last();
            let lost = |class: &String| part.run.tail || last.is_some_and(|last| least_order(class) <= last);
            missing.extend(part.method.missing_light(needs).into_iter().filter(lost));
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

    fn begin<'a>(&'a self, scene: &'a Scene, request: &'a Request, replicate: Replicate) -> Box<dyn Pass + 'a> {
        let begin = |run: AtWork<'a>| RunPass {
            pass: run.method.begin(scene, run.request, run.replicate),
            request: run.request,
            samples: run.replicate.samples,
            scale: run.scale,
        };
        let runs = self.at_work(request.runs(), replicate).into_iter().map(begin).collect();
        Box::new(CompositePass { runs, samples: replicate.samples })
    }
}

/// A run with something to do in a replicate.
struct AtWork<'a> {
    method: &'a dyn Integrator,
    request: &'a Request,
    replicate: Replicate,
    /// How often what it brings counts.
    scale: f32,
}

impl Composite {
    /// The runs that have something to do, with their samples.
    fn at_work<'a>(&'a self, requests: &'a [Request], replicate: Replicate) -> Vec<AtWork<'a>> {
        let busy = self.parts.iter().zip(requests).enumerate().filter(|(_, (_, r))| !r.layers().is_empty());
        let busy: Vec<_> = busy.collect();
        let shares: f64 = busy.iter().map(|(_, (part, _))| part.run.share).sum();
        let all = f64::from(replicate.samples);
        let run = |(i, (part, request)): (usize, (&'a Part, &'a Request))| {
            let samples = (all * part.run.share / shares).round().max(1.0);
            let replicate = Replicate { key: replicate.key.of_part(i as u32), samples: samples as u32, ..replicate };
            AtWork {
                method: &*part.method,
                request,
                replicate,
                scale: fault!("share_of_a_run_forgotten", all / samples, 1.0) as f32,
            }
        };
        busy.into_iter().map(run).collect()
    }
}

/// A replicate of one run.
struct RunPass<'a> {
    pass: Box<dyn Pass + 'a>,
    request: &'a Request,
    samples: u32,
    scale: f32,
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
        for run in &self.runs {
            // A run has got as far with its samples as all have with theirs.
            let place = |sample: u32| (u64::from(sample) * u64::from(run.samples)).div_ceil(u64::from(self.samples));
            let samples = place(block.samples.start) as u32..place(block.samples.end) as u32;
            if !samples.is_empty() {
                out.set_scale(run.scale);
                run.pass.run(Block { samples, ..block.clone() }, out);
            }
        }
    }

    fn replay(&mut self, pixel: (u32, u32), sample: u32, show: &mut dyn FnMut(&Contribution)) -> bool {
        for run in self.runs.iter_mut().filter(|run| sample < run.samples) {
            let mut scaled = |c: &Contribution| {
                if run.request.wants(c.technique.order()) {
                    show(&Contribution { weight: c.weight * f64::from(run.scale), ..*c });
                }
            };
            run.pass.replay(pixel, sample, &mut scaled);
        }
        true
    }
}

#[cfg(test)]
mod tests;
