//! Which method for which order: the runs of a [`composite`], chosen by pilots.
//!
//! Of every method that may take part a first pilot measures the covariances between its orders, and renders of single orders count the
//! rays that each of them takes; from these follows [who does what](search). Then a second pilot, on other random numbers, renders
//! the runs that were chosen and the best single method, and from what it finds follow the shares of the samples and the gain that is predicted:
//! the first pilot's variances were chosen for being small, and are too small on average. What the composite renders shares no number with either.

use crate::error::Error;
use crate::stop::Stop;
use crate::subject::small_size;
use integrators::composite::{self, Run};
use integrators::{Integrator, Layer, Methods, RenderSettings, Request};
use pilot::{Entry, Pilot, REPLICATES};
use scenes::Scene;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::time::Instant;

pub use gain::gains;

mod gain;
pub mod pilot;
pub mod search;

/// The methods that take part.
pub const TAKE_PART: [&str; 3] = ["path", "light", "bdpt"];
/// The part of a method's time that is taken for pilots, if a sample a pixel of each takes no more.
pub const PILOT_PART: f64 = 0.05;
/// The most samples of a pilot's image.
const MOST: f64 = 1024.0;

/// The runs chosen for a scene, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// The runs.
    pub runs: Vec<ChosenRun>,
    /// The best method by itself.
    pub single: String,
    /// The composite's efficiency over that one's, as predicted, on the image's sum; `None` where there is none, or nothing varies.
    pub gain: Option<f64>,
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
    /// What it adds to the variance of one of the composite's samples, as predicted.
    pub variance: f64,
    /// The same of one sample of the best single method, in the same orders.
    pub single: Option<f64>,
}

impl Choice {
    /// Who does what: `path orders 1, light orders 0, 2 to 8`.
    pub fn who_does_what(&self) -> String {
        let run = |run: &ChosenRun| format!("{} orders {}", run.run.method, in_ranges(&run.layers));
        self.runs.iter().map(run).collect::<Vec<_>>().join(", ")
    }

    /// The setting that has the same runs again: `runs=path:1:0.2;light:0,2,3:0.8`.
    pub fn setting(&self) -> String {
        let brief: Vec<String> = self.runs.iter().map(|run| run.run.brief()).collect();
        format!("runs={}", brief.join(";"))
    }

    /// Who does what, and how the same is had again.
    pub fn in_words(&self) -> String {
        let gain = self.gain.map(|gain| format!("; predicted efficiency over {}: {gain:.3}", self.single));
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
        let chosen = choose(scene, methods, settings, &|sample| seconds(sample * parts), stop);
        scene.camera.set_size(width, height);
        Ok(Choice { pilot_seconds: start.elapsed().as_secs_f64(), ..chosen? })
    }
}

/// The methods that take part, and sentences about the others.
fn entrants(scene: &Scene, methods: &Methods, left_out: &mut Vec<String>) -> Result<Vec<Box<dyn Integrator>>, Error> {
    let mut part = Vec::new();
    for name in TAKE_PART {
        let method = methods.build(name, &Value::Null)?;
        match method.unsupported(scene) {
            Some(reason) => left_out.push(format!("{name} takes no part: {reason}")),
            None => part.push(method),
        }
    }
    Ok(part)
}

fn choose(
    scene: &Scene,
    methods: &Methods,
    settings: &RenderSettings,
    seconds: &dyn Fn(f64) -> f64,
    stop: &Stop,
) -> Result<Choice, Error> {
    let layers = Request::new(settings.orders.clone(), settings.tail).layers().to_vec();
    let mut left_out = Vec::new();
    let part = entrants(scene, methods, &mut left_out)?;
    let mut entries: Vec<Entry> = part.iter().map(|method| Entry::new(scene, &**method, settings, &layers)).collect();
    entries.retain(|entry| entry.carries.contains(&true));
    for entry in &entries {
        let lost: Vec<String> =
            layers.iter().zip(&entry.carries).filter(|(_, c)| !**c).map(|(layer, _)| layer.label()).collect();
        if !lost.is_empty() {
            left_out.push(format!("{} does not carry all light of order {}", entry.method.name(), lost.join(", ")));
        }
    }
    let no_method = |k: usize| {
        let why = if left_out.is_empty() { String::new() } else { format!(": {}", left_out.join("; ")) };
        Error::usage(format!(
            "no method carries all light of order {} here{why}; leave it out with --orders, or render by one method",
            layers[k].label()
        ))
    };
    if let Some(lost) = (0..layers.len()).find(|&k| !entries.iter().any(|entry| entry.carries[k])) {
        return Err(no_method(lost));
    }
    let samples = samples(scene, &entries, &layers, seconds, stop)?;
    let mut pilots = Vec::new();
    for entry in &entries {
        pilots.push(Pilot::new(scene, entry.method, entry.of_layers(&entry.own(&layers), 1, samples))?);
    }
    take_turns(&mut pilots, stop)?;
    let candidates = pilot::candidates(scene, &entries, &pilots, &layers, stop)?;
    let (assignment, single) = search::best(&candidates).map_err(no_method)?;
    let sets = search::sets(&assignment, entries.len());
    let first: f64 = pilots.iter().map(|pilot| pilot.seconds() * f64::from(samples * REPLICATES)).sum();
    confirm(scene, &entries, (&layers, &sets, single), samples, stop).map(|choice| Choice {
        left_out,
        pilot_seconds: choice.pilot_seconds + first,
        ..choice
    })
}

/// The samples of a pilot's image, by the time that one takes.
fn samples(
    scene: &Scene,
    entries: &[Entry],
    layers: &[Layer],
    seconds: &dyn Fn(f64) -> f64,
    stop: &Stop,
) -> Result<u32, Error> {
    let mut all = 0.0;
    for entry in entries {
        let mut first = Pilot::new(scene, entry.method, entry.of_layers(&entry.own(layers), 0, 1))?;
        // What is done once is not to count.
        first.step(stop)?;
        let begun = first.seconds();
        first.step(stop)?;
        all += 2.0 * first.seconds() - begun;
    }
    // Both pilots are about as long.
    let budget = PILOT_PART * seconds(all / entries.len() as f64);
    Ok((budget / (2.0 * f64::from(REPLICATES) * all.max(1e-9))).clamp(1.0, MOST) as u32)
}

/// By turns, so that the machine's drift hits all alike.
fn take_turns(pilots: &mut [Pilot], stop: &Stop) -> Result<(), Error> {
    for _ in 0..REPLICATES {
        pilots.iter_mut().try_for_each(|pilot| pilot.step(stop))?;
    }
    Ok(())
}

/// Measures the runs chosen, and what the best single method does in the same layers and in all.
fn confirm(
    scene: &Scene,
    entries: &[Entry],
    (layers, sets, single): (&[Layer], &[Vec<usize>], Option<usize>),
    samples: u32,
    stop: &Stop,
) -> Result<Choice, Error> {
    let busy: Vec<usize> = (0..entries.len()).filter(|&m| !sets[m].is_empty()).collect();
    let of = |m: usize| -> Vec<Layer> { sets[m].iter().map(|&k| layers[k]).collect() };
    let mut pilots = Vec::new();
    for &m in &busy {
        pilots.push(Pilot::new(scene, entries[m].method, entries[m].of_layers(&of(m), 2, samples))?);
    }
    let runs = busy.len();
    // Where none carries all by itself, there is nothing to be compared with.
    if let Some(single) = single {
        let mut alone = |layers: &[Layer]| -> Result<(), Error> {
            pilots.push(Pilot::new(scene, entries[single].method, entries[single].of_layers(layers, 4, samples))?);
            Ok(())
        };
        alone(layers)?;
        busy.iter().try_for_each(|&m| alone(&of(m)))?;
    }
    take_turns(&mut pilots, stop)?;
    let found: Vec<(f64, f64)> = pilots.iter().map(|pilot| (pilot.variance(), pilot.seconds())).collect();
    let shares = search::shares(&found[..runs]);
    let time: f64 = found.iter().zip(&shares).map(|((_, seconds), share)| seconds * share).sum();
    let own = found.get(runs).map(|(variance, seconds)| variance * seconds);
    let chosen = busy.iter().enumerate().map(|(i, &m)| {
        let layers = of(m);
        ChosenRun {
            run: run_of(&entries[m], &layers, shares[i]),
            layers: layers.iter().map(|layer| layer.label()).collect(),
            time: found[i].1 * shares[i] / time,
            variance: found[i].0 / shares[i],
            single: found.get(runs + 1 + i).map(|(variance, _)| *variance),
        }
    });
    let choice = Choice {
        runs: chosen.collect(),
        single: single.map_or(String::new(), |m| entries[m].method.name().to_owned()),
        gain: own.map(|own| own / search::product(&found[..runs], &shares)).filter(|gain| gain.is_finite()),
        left_out: Vec::new(),
        pilot_seconds: 0.0,
    };
    // Nothing is won by a division that the second pilot finds worse, or that is none.
    let is_worse = choice.gain.is_some_and(|gain| gain < 1.0);
    match single.filter(|single| is_worse || busy == [*single]) {
        Some(single) => {
            Ok(Choice { gain: Some(1.0), runs: vec![alone_run(&entries[single], layers, found[runs].0)], ..choice })
        }
        None => Ok(choice),
    }
}

/// The best method by itself, where no division is better.
fn alone_run(entry: &Entry, layers: &[Layer], variance: f64) -> ChosenRun {
    let run = run_of(entry, layers, 1.0);
    ChosenRun { run, layers: layers.iter().map(|l| l.label()).collect(), time: 1.0, variance, single: Some(variance) }
}

fn run_of(entry: &Entry, layers: &[Layer], share: f64) -> Run {
    let orders: Vec<String> = layers.iter().filter(|layer| **layer != Layer::Tail).map(|layer| layer.label()).collect();
    Run {
        method: entry.method.name().to_owned(),
        settings: serde_json::Map::new(),
        orders: orders.join(","),
        tail: layers.contains(&Layer::Tail),
        share,
    }
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
