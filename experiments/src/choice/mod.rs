//! Which method for which order: the runs of a [`composite`], chosen by pilots.
//!
//! Of every [method that may take part](TAKE_PART) a first pilot measures the covariances between its orders, and renders of single orders count the
//! rays that each of them takes; from these follows [who does what](search), and [in which regions of the image](regions). Then a second pilot, on other
//! random numbers, renders the runs that were chosen and the best single methods, and from what it finds follow the shares of the samples: the first
//! pilot's variances were chosen for being small, and are too small on average. Last the composite itself is timed beside the best single
//! method, from which follows the gain that is predicted. What the composite renders shares no number with any of these.

use crate::error::Error;
use crate::statistics::positive::COLUMNS;
use crate::stop::Stop;
use crate::subject::small_size;
use budget::Budget;
use confirm::confirm;
use first::First;
use integrators::composite::{self, Run};
use integrators::{Integrator, Layer, Methods, RenderSettings, Request};
use pilot::Entry;
use scenes::Scene;
use serde::{Deserialize, Serialize};
use std::time::Instant;

pub use first::{Entrant, entrants};
pub use gain::gains;

mod budget;
mod confirm;
mod first;
mod gain;
pub mod pilot;
pub mod regions;
pub mod search;
mod timing;

/// The methods that take part, with settings.
pub const TAKE_PART: [(&str, &[(&str, &str)]); 4] =
    [("path", &[]), ("light", &[]), ("bdpt", &[]), ("path", &[("strategy", "emitter")])];
// An interval of a gain has a column for each, and one for the best by itself.
const _: () = assert!(TAKE_PART.len() < COLUMNS);

/// The runs chosen for a scene, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// The runs.
    pub runs: Vec<ChosenRun>,
    /// The best method by itself.
    pub single: String,
    /// The composite's efficiency over that one's, as predicted, on the image's sum; `None` where there is none, or nothing varies.
    pub gain: Option<f64>,
    /// Its 95 % interval, by what is known of variances and seconds; `None` where there is nothing to be predicted.
    #[serde(default)]
    pub gain_interval: Option<(f64, f64)>,
    /// Methods that take no part, and why.
    pub left_out: Vec<String>,
    /// What choosing took \[s\].
    pub pilot_seconds: f64,
}

/// One run of a choice.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChosenRun {
    /// The run.
    pub run: Run,
    /// Its layers, as tables write them.
    pub layers: Vec<String>,
    /// The part of the time that it takes.
    pub time: f64,
    /// What its layers have of the variance of one of the composite's samples, as predicted; runs with the same layers, in other regions, have the same.
    pub variance: f64,
    /// The same of one sample of the best single method, in the same orders.
    pub single: Option<f64>,
}

impl ChosenRun {
    /// ` in 12 of 64 regions`, where it is not at work in all of the image.
    pub fn regions(&self) -> String {
        let Some(regions) = &self.run.regions else { return String::new() };
        let weights = regions.weights();
        match weights.iter().filter(|weight| **weight > 0.0).count() {
            some if some < weights.len() => format!(" in {some} of {} regions", weights.len()),
            _ => " by regions".to_owned(),
        }
    }
}

impl Choice {
    /// Who does what: `path orders 1, light orders 0, 2 to 8`.
    pub fn who_does_what(&self) -> String {
        let run = |run: &ChosenRun| {
            let orders = if run.layers.len() == 1 { "order" } else { "orders" };
            format!("{} {orders} {}{}", run.run.label(), in_ranges(&run.layers), run.regions())
        };
        self.runs.iter().map(run).collect::<Vec<_>>().join(", ")
    }

    /// The setting that has the same runs again: `runs=path:1:0.2;light:0,2-3:0.8`.
    pub fn setting(&self) -> String {
        let brief: Vec<String> = self.runs.iter().map(|run| run.run.brief()).collect();
        format!("runs={}", brief.join(";"))
    }

    /// The gain that is predicted, with its interval.
    pub fn predicted(&self) -> Option<String> {
        let interval = self.gain_interval.map_or(String::new(), |(low, high)| format!(" [{low:.3}, {high:.3}]"));
        Some(format!("{:.3}{interval}", self.gain?))
    }

    /// Who does what, and how the same is had again.
    pub fn in_words(&self) -> String {
        let gain = self.predicted().map(|gain| format!("; predicted efficiency over {}: {gain}", self.single));
        let gain = gain.unwrap_or_default();
        format!("{}{gain}; the same runs again: --set '{}'", self.who_does_what(), self.setting())
    }

    /// The composite.
    ///
    /// # Errors
    /// None, unless the registry has changed.
    pub fn composite(&self, methods: &Methods) -> Result<Box<dyn Integrator>, Error> {
        let runs: Vec<&Run> = self.runs.iter().map(|chosen| &chosen.run).collect();
        Ok(methods.build(composite::NAME, &serde_json::json!({ "runs": runs }))?)
    }

    /// Chooses for a scene, of which a render with these settings takes about so many seconds.
    ///
    /// # Errors
    /// If a layer has no method, memory does not suffice, or the user asked for an end.
    pub fn new(
        scene: &mut Scene,
        methods: &Methods,
        settings: &RenderSettings,
        seconds: &dyn Fn(f64) -> f64,
        stop: &Stop,
    ) -> Result<Self, Error> {
        let (width, height) = (scene.camera.width(), scene.camera.height());
        // A crop is one of the image as it is.
        if scene.crop.is_none() {
            let (small_width, small_height) = small_size(&scene.camera);
            scene.camera.set_size(small_width, small_height);
        }
        let parts =
            f64::from(width) * f64::from(height) / (f64::from(scene.camera.width()) * f64::from(scene.camera.height()));
        let start = Instant::now();
        let chosen = choose(scene, methods, settings, (start, &|sample| seconds(sample * parts)), stop);
        scene.camera.set_size(width, height);
        Ok(Choice { pilot_seconds: start.elapsed().as_secs_f64(), ..chosen? })
    }
}

fn choose(
    scene: &Scene,
    methods: &Methods,
    settings: &RenderSettings,
    (start, seconds): (Instant, &dyn Fn(f64) -> f64),
    stop: &Stop,
) -> Result<Choice, Error> {
    let layers = Request::new(settings.orders.clone(), settings.tail).layers().to_vec();
    let mut left_out = Vec::new();
    let part = entrants(scene, methods, &mut left_out)?;
    let entries = entries(scene, &part, (settings, &layers), &mut left_out)?;
    let sample = first::sample_seconds(scene, &entries, &layers, stop)?;
    let by_mean = sample / entries.len() as f64;
    let mut budget = Budget::new(start, by_mean, seconds(by_mean));
    let first = First::new(scene, &entries, &layers, (&mut budget, sample), stop)?;
    let groups = first.groups(scene, stop).map_err(|lost| no_method(scene, &layers, &[lost], &left_out))??;
    Ok(Choice { left_out, ..confirm(scene, methods, (&first, &groups), budget, stop)? })
}

/// That every layer has a method: what choosing would find out first.
///
/// # Errors
/// If one has none.
pub fn check(scene: &Scene, methods: &Methods, settings: &RenderSettings) -> Result<(), Error> {
    let layers = Request::new(settings.orders.clone(), settings.tail).layers().to_vec();
    let mut left_out = Vec::new();
    let part = entrants(scene, methods, &mut left_out)?;
    entries(scene, &part, (settings, &layers), &mut left_out).map(|_| ())
}

/// The methods with some of the layers; sentences about what they lack go into `left_out`.
fn entries<'m>(
    scene: &Scene,
    part: &'m [Entrant],
    (settings, layers): (&RenderSettings, &[Layer]),
    left_out: &mut Vec<String>,
) -> Result<Vec<Entry<'m>>, Error> {
    let mut entries: Vec<Entry> =
        part.iter().map(|(run, method)| Entry::new(scene, run, &**method, settings, layers)).collect();
    entries.retain(|entry| entry.carries.contains(&true));
    for entry in &entries {
        let lost: Vec<String> =
            layers.iter().zip(&entry.carries).filter(|(_, c)| !**c).map(|(layer, _)| layer.label()).collect();
        if !lost.is_empty() {
            let (label, orders) = (entry.run.label(), lost.join(", "));
            let light = entry.lost.join(", and ");
            let light = if light.is_empty() { light } else { format!(" (it lacks {light})") };
            left_out.push(format!("{label} does not carry all light of order {orders}{light}"));
        }
    }
    let lost: Vec<usize> = (0..layers.len()).filter(|&k| !entries.iter().any(|entry| entry.carries[k])).collect();
    if lost.is_empty() { Ok(entries) } else { Err(no_method(scene, layers, &lost, left_out)) }
}

/// That layers have no method, why, and what to do.
fn no_method(scene: &Scene, layers: &[Layer], lost: &[usize], left_out: &[String]) -> Error {
    let why = if left_out.is_empty() { String::new() } else { format!(": {}", left_out.join("; ")) };
    let lost: Vec<String> = lost.iter().map(|&k| layers[k].label()).collect();
    Error::usage(format!(
        "{}: no method that a composite may choose carries all light of order {}{why}; leave out what none carries (`neumann render --orders`), name the \
         composite's runs, or render by one method",
        scene.name,
        in_ranges(&lost)
    ))
}

/// Labels of orders as a list of ranges: `0, 2 to 4, tail`.
pub fn in_ranges(labels: &[String]) -> String {
    let mut ranges: Vec<(String, String)> = Vec::new();
    for label in labels {
        let number = |label: &str| label.parse::<usize>().ok();
        let follows = |last: &str| number(last).is_some_and(|last| number(label) == Some(last + 1));
        match ranges.last_mut().filter(|(_, last)| follows(last)) {
            Some((_, last)) => last.clone_from(label),
            None => ranges.push((label.clone(), label.clone())),
        }
    }
    let told = |(first, last): &(String, String)| match first == last {
        true => first.clone(),
        false => format!("{first} to {last}"),
    };
    ranges.iter().map(told).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_that_follow_one_another_are_told_as_a_range() {
        let labels = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(in_ranges(&labels("0 2 3 4 7 tail")), "0, 2 to 4, 7, tail");
    }
}
