//! Which method for which order: the runs of a [`composite`], chosen by pilots.
//!
//! Of every [method that may take part](TAKE_PART) a first pilot measures the covariances between its orders, and renders of single orders count the
//! rays that each of them takes; from these follows [who does what](search), and [in which regions of the image](regions). Then a second pilot, on other
//! random numbers, renders the runs that were chosen and the best single methods, and from what it finds follow the shares of the samples: the first
//! pilot's variances were chosen for being small, and are too small on average. Last the composite itself is timed beside the best single
//! method, from which follows the gain that is predicted. What the composite renders shares no number with any of these.

use crate::error::Error;
use crate::statistics::positive;
use crate::stop::Stop;
use crate::subject::small_size;
use confirm::{Group, confirm};
use integrators::composite::{self, Run};
use integrators::{Integrator, Layer, Methods, RenderSettings, Request};
use pilot::{Entry, Pilot, REPLICATES, take_turns};
use scenes::Scene;
use search::Candidate;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::time::Instant;

pub use gain::gains;

mod confirm;
mod gain;
pub mod pilot;
pub mod regions;
pub mod search;
mod timing;

/// The methods that take part, with settings.
pub const TAKE_PART: [(&str, &[(&str, &str)]); 4] =
    [("path", &[]), ("light", &[]), ("bdpt", &[]), ("path", &[("strategy", "emitter")])];
/// The part of a short render's time that is taken for choosing, if a sample a pixel of each pilot takes no more.
const PILOT_PART: f64 = 0.08;
/// Up to how long a render is short: samples of every pixel of the pilots' image, by the mean method, in as much time.
const SHORT: f64 = 4096.0;
/// The part of that time that the first pilot has. What it leaves to the second also pays for counting rays.
const FIRST_PART: f64 = 0.3;
/// By how much a variance may be greater than the first pilot finds it for that to be worth more than this one's root of time.
const DOUBTFUL: f64 = 1.3;
/// By how much a method's variance times seconds may be greater than that of the best for it to be in question still.
const RIVAL: f64 = 2.0;
/// The most samples of an image of the second one: where there are more than [`REPLICATES`] images of these, there are more images. They tell a
/// variance better than many samples of few do, and what slows a machine for a while hits all methods alike.
const SECOND_SAMPLES: f64 = 4.0;

/// The runs chosen for a scene, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// The runs.
    pub runs: Vec<ChosenRun>,
    /// The best method by itself.
    pub single: String,
    /// The composite's efficiency over that one's, as predicted, on the image's sum; `None` where there is none, or nothing varies.
    pub gain: Option<f64>,
    /// Its 95 % interval, by what is known of variances; `None` where there is nothing to be predicted.
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

    /// The setting that has the same runs again: `runs=path:1:0.2;light:0,2,3:0.8`.
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

/// A method that takes part, and the run of no orders yet that it would be.
pub type Entrant = (Run, Box<dyn Integrator>);

/// The methods that take part; sentences about the others go into `left_out`.
///
/// # Errors
/// None, unless the registry has changed.
pub fn entrants(scene: &Scene, methods: &Methods, left_out: &mut Vec<String>) -> Result<Vec<Entrant>, Error> {
    let mut part = Vec::new();
    for (name, settings) in TAKE_PART {
        let settings = settings.iter().map(|&(key, value)| (key.to_owned(), Value::from(value))).collect();
        let (method, orders) = (name.to_owned(), String::new());
        let run = Run { method, settings, orders, tail: false, share: 1.0, regions: None };
        let method = methods.build(name, &Value::Object(run.settings.clone()))?;
        match method.unsupported(scene) {
            Some(reason) => left_out.push(format!("{} takes no part: {reason}", run.label())),
            None => part.push((run, method)),
        }
    }
    Ok(part)
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
    let mut entries: Vec<Entry> =
        part.iter().map(|(run, method)| Entry::new(scene, run, &**method, settings, &layers)).collect();
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
    let no_method = |k: usize| {
        let why = if left_out.is_empty() { String::new() } else { format!(": {}", left_out.join("; ")) };
        Error::usage(format!(
            "{}: no method that a composite may choose carries all light of order {}{why}; leave that order out (`neumann render --orders`), name the \
             composite's runs, or render by one method",
            scene.name,
            layers[k].label()
        ))
    };
    if let Some(lost) = (0..layers.len()).find(|&k| !entries.iter().any(|entry| entry.carries[k])) {
        return Err(no_method(lost));
    }
    let sample = sample_seconds(scene, &entries, &layers, stop)?;
    let by_mean = sample / entries.len() as f64;
    let mut budget = Budget::new(start, by_mean, seconds(by_mean));
    let samples = samples_within(FIRST_PART * budget.seconds, sample);
    let mut pilots = pilot::of_all(scene, &entries, &layers, (1, samples, REPLICATES), stop)?;
    if doubt(&pilots, &layers) > DOUBTFUL {
        budget.extend();
        let more = FIRST_PART * budget.left() / (sample * f64::from(samples));
        take_turns(&mut pilots, more as u32, stop)?;
    }
    let candidates = pilot::candidates(scene, &entries, &pilots, &layers, stop)?;
    let (assignment, _) = search::best(&candidates).map_err(no_method)?;
    let rivals: Vec<(usize, &Pilot)> = rivals(&candidates).into_iter().map(|m| (m, &pilots[m])).collect();
    let mut groups = Vec::new();
    for (m, set) in search::sets(&assignment, entries.len()).into_iter().enumerate().filter(|(_, set)| !set.is_empty())
    {
        let division = regions::divide(scene, &entries, &candidates, &layers, (m, &set), stop)?;
        groups.push(Group { m, layers: set.iter().map(|&k| layers[k]).collect(), division });
    }
    let part = |m: usize, own: &[Layer]| {
        let of = |own: &[Layer]| (0..layers.len()).filter(|&k| own.contains(&layers[k])).collect::<Vec<_>>();
        let cost = &candidates[m].cost;
        cost.of(&of(own)) / cost.of(&of(&entries[m].own(&layers)))
    };
    let seconds: Vec<f64> = pilots.iter().map(Pilot::seconds).collect();
    let choice = confirm(scene, (methods, &entries), (&layers, &groups, &rivals), &part, (budget, &seconds), stop)?;
    Ok(Choice { left_out, ..choice })
}

/// The seconds that choosing may take.
struct Budget {
    start: Instant,
    /// What is meant to be taken.
    seconds: f64,
    /// The most, where there is a reason.
    most: f64,
}

impl Budget {
    /// Of a render that takes `whole` seconds, where a sample of every pixel of the pilots' image takes `sample` by the mean method.
    ///
    /// Those of long renders grow by the root of their length: what pilots of n samples leave unknown costs a part of it in proportion to 1/n, and they
    /// cost n.
    fn new(start: Instant, sample: f64, whole: f64) -> Self {
        let most = PILOT_PART * whole;
        Self { start, seconds: most * (SHORT * sample / whole.max(1e-9)).sqrt().min(1.0), most }
    }

    /// What is left; negative if more has been taken.
    fn left(&self) -> f64 {
        self.seconds - self.start.elapsed().as_secs_f64()
    }

    /// Lets all be taken that may be.
    fn extend(&mut self) {
        self.seconds = self.most;
    }
}

/// Seconds of a sample of every pixel by each of the methods.
fn sample_seconds(scene: &Scene, entries: &[Entry], layers: &[Layer], stop: &Stop) -> Result<f64, Error> {
    let mut all = 0.0;
    for entry in entries {
        let mut first = Pilot::new(scene, entry.method, entry.of_layers(&entry.own(layers), 0, 1))?;
        // What is done once is not to count.
        first.step(stop)?;
        let begun = first.seconds();
        first.step(stop)?;
        all += 2.0 * first.seconds() - begun;
    }
    Ok(all)
}

/// By how much the variance of the method that seems best by itself may be greater than it is found to be.
fn doubt(pilots: &[Pilot], layers: &[Layer]) -> f64 {
    let whole = pilots.iter().filter(|pilot| pilot.has(layers));
    let product = |pilot: &Pilot| pilot.variance(layers) * pilot.seconds();
    let best = whole.min_by(|a, b| product(a).total_cmp(&product(b)));
    let found = best.map(|best| positive::variance(&best.squares(layers), 0));
    found.and_then(|found| Some(found.interval?.1 / found.value)).unwrap_or(1.0)
}

/// The methods that carry all layers, but for those that are far from the best of these.
fn rivals(candidates: &[Candidate]) -> Vec<usize> {
    let all: Vec<usize> = candidates.first().map_or(Vec::new(), |first| (0..first.carries.len()).collect());
    let product = |m: usize| candidates[m].variance(&all) * candidates[m].cost.of(&all);
    let whole: Vec<usize> = (0..candidates.len()).filter(|&m| candidates[m].carries.iter().all(|&c| c)).collect();
    let least = whole.iter().map(|&m| product(m)).fold(f64::INFINITY, f64::min);
    whole.into_iter().filter(|&m| product(m) <= RIVAL * least).collect()
}

/// The samples of a pilot's image, by the seconds that all of its images may take, and those of one sample.
fn samples_within(budget: f64, sample: f64) -> u32 {
    (budget / (f64::from(REPLICATES) * sample.max(1e-9))).max(1.0) as u32
}

/// The images of the second pilot, and the samples of each, by the seconds that all may take, and those of one sample.
fn second_size(budget: f64, sample: f64) -> (u32, u32) {
    let samples = budget / sample.max(1e-9);
    let replicates = (samples / SECOND_SAMPLES).max(f64::from(REPLICATES)).floor();
    (replicates as u32, (samples / replicates).clamp(1.0, SECOND_SAMPLES) as u32)
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
    fn the_second_pilot_takes_what_it_may_in_many_images_of_few_samples() {
        assert_eq!(
            [0.0, 2.0, 40.0, 400.0].map(|budget| second_size(budget, 1.0)),
            [(16, 1), (16, 1), (16, 2), (100, 4)]
        );
    }

    #[test]
    fn pilots_of_four_times_as_long_a_render_take_twice_as_long() {
        let of = |samples: f64| Budget::new(Instant::now(), 0.01, 0.01 * samples).seconds;
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} is not {b}");
        close(of(1024.0), 0.08 * 10.24);
        close(of(4096.0), 0.08 * 40.96);
        close(of(4.0 * 4096.0), 2.0 * of(4096.0));
    }

    #[test]
    fn orders_that_follow_one_another_are_told_as_a_range() {
        let labels = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(in_ranges(&labels("0 2 3 4 7 tail")), "0, 2 to 4, 7, tail");
    }
}
