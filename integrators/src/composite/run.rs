//! A method at work on some of the orders.

use super::{NAME, Regions};
use crate::bias::Bias;
use crate::block::Window;
use crate::integrator::Integrator;
use crate::method::Methods;
use crate::request::{Orders, Request};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

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
    /// Where in the image it takes them; all over it alike if there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub regions: Option<Regions>,
}

impl Run {
    /// The method, with settings that are not its defaults: `path(strategy=emitter)`.
    pub fn label(&self) -> String {
        let value = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let settings: Vec<String> = self.settings.iter().map(|(key, v)| format!("{key}={}", value(v))).collect();
        if settings.is_empty() { self.method.clone() } else { format!("{}({})", self.method, settings.join(",")) }
    }

    /// As [`Run::read`] takes it.
    pub fn brief(&self) -> String {
        let tail = if self.tail { "+tail" } else { "" };
        let regions = self.regions.as_ref().map_or(String::new(), |regions| format!(":{}", regions.brief()));
        format!("{}:{}{tail}:{}{regions}", self.label(), self.orders, self.share)
    }

    /// From `METHOD:ORDERS:SHARE`, such as `path:1-3:0.5`, with settings in parentheses behind the method, `+tail` behind the orders for a run that has
    /// it, and weights of regions behind the share: `path(strategy=emitter,roulette=none):1:0.2:1,0/2,1`.
    ///
    /// # Errors
    /// If it is written in another way.
    pub fn read(text: &str) -> Result<Self, String> {
        let no_run = || format!("`{text}` is no run; write METHOD:ORDERS:SHARE, such as path:1-3:0.5");
        let parts: Vec<&str> = text.split(':').map(str::trim).collect();
        let (method, orders, share, regions) = match parts[..] {
            [method, orders, share] => (method, orders, share, None),
            [method, orders, share, regions] => (method, orders, share, Some(regions)),
            _ => return Err(no_run()),
        };
        let share = share.parse().map_err(|_| format!("`{share}` is no share of the samples: {}", no_run()))?;
        let (orders, tail) = match orders.strip_suffix("tail") {
            Some(orders) => (orders.trim_end_matches('+'), true),
            None => (orders, false),
        };
        let (method, settings) = match method.strip_suffix(')').and_then(|inner| inner.split_once('(')) {
            Some((method, settings)) => (method, read_settings(settings).ok_or_else(no_run)?),
            None if method.contains(['(', ')']) => return Err(format!("a parenthesis has no other: {}", no_run())),
            None => (method, Map::new()),
        };
        let regions = regions.map(Regions::read).transpose()?;
        Ok(Self { method: method.to_owned(), settings, orders: orders.to_owned(), tail, share, regions })
    }
}

/// Of `strategy=emitter,roulette_start=3`: numbers and words.
fn read_settings(text: &str) -> Option<Map<String, Value>> {
    let one = |setting: &str| {
        let (key, value) = setting.split_once('=')?;
        let word = || Value::String(value.trim().to_owned());
        Some((key.trim().to_owned(), serde_json::from_str(value).unwrap_or_else(|_| word())))
    };
    text.split(',').map(one).collect()
}

/// A run that can be made.
pub(super) struct Part {
    /// The run.
    pub run: Run,
    /// Its orders.
    pub orders: Orders,
    /// Its method.
    pub method: Box<dyn Integrator>,
}

impl Part {
    /// Makes its method.
    ///
    /// # Errors
    /// If it cannot be made, or cannot be a part.
    pub fn new(run: Run, methods: &Methods) -> Result<Self, String> {
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
        if run.regions.is_some() && !method.divides() {
            return Err(format!(
                "{name} cannot be left to regions: its samples have to do with other pixels than their own; give the regions to path or direct"
            ));
        }
        match why_not {
            Some(why) => Err(format!("{name} cannot be a part: {why}; take path, light, bdpt, direct or guided")),
            None => Ok(Self { run, orders, method }),
        }
    }

    /// The numbers of samples that occur where it has so many on average, and the windows of an image that have them.
    pub fn samples(&self, average: f64, (width, height): (u32, u32)) -> Vec<(u32, Vec<Window>)> {
        match &self.run.regions {
            Some(regions) => regions.samples(average, width, height),
            None => vec![(average.round().max(1.0) as u32, vec![Window::whole(width, height)])],
        }
    }

    /// What is asked of it where this is asked for.
    pub fn request(&self, whole: &Request) -> Request {
        let of_both = |k: &usize| self.orders.contains(*k);
        let orders = whole.orders().clone().only(|k| of_both(&k) && self.method.orders(k).contains(&k));
        Request::new(orders, whole.tail() && self.run.tail).with_parts(whole.parts().clone())
    }

    /// What both it and another estimate in the same pixels.
    pub fn in_common(&self, other: &Self) -> Option<String> {
        let is_apart = self.run.regions.as_ref().zip(other.run.regions.as_ref()).is_some_and(|(a, b)| a.is_apart(b));
        let tail = (self.run.tail && other.run.tail).then(|| "the tail".to_owned());
        let both = self.orders.iter().find(|&k| other.orders.contains(k)).map(|order| format!("order {order}"));
        tail.or(both).filter(|_| !is_apart)
    }
}
