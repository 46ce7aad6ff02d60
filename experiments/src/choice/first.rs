//! The first pilot: what is known of every method that may take part, and which of them does what.

use super::budget::Budget;
use super::confirm::Group;
use super::pilot::{self, Entry, Pilot, REPLICATES, take_turns};
use super::search::{self, Candidate};
use super::{TAKE_PART, regions};
use crate::error::Error;
use crate::statistics::positive;
use crate::stop::Stop;
use integrators::composite::Run;
use integrators::{Integrator, Layer, Methods};
use scenes::Scene;
use serde_json::Value;

/// By how much a variance may be greater than the first pilot finds it for that to be worth more than the budget of a benign scene.
const DOUBTFUL: f64 = 1.3;
/// By how much a method's variance times seconds may be greater than that of the best for it to be in question still.
const RIVAL: f64 = 2.0;

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

/// What the first pilot has found.
pub struct First<'a> {
    /// The methods.
    pub entries: &'a [Entry<'a>],
    /// The layers asked for.
    pub layers: &'a [Layer],
    /// A pilot of each method.
    pub pilots: Vec<Pilot<'a>>,
    /// What is known of each.
    pub candidates: Vec<Candidate>,
}

impl<'a> First<'a> {
    /// Renders it, for longer where that leaves much in doubt.
    ///
    /// # Errors
    /// If a method cannot render, or the user asked for an end.
    pub fn new(
        scene: &'a Scene,
        entries: &'a [Entry<'a>],
        layers: &'a [Layer],
        (budget, sample): (&mut Budget, f64),
        stop: &Stop,
    ) -> Result<Self, Error> {
        let samples = budget.first_samples(sample);
        let mut pilots = pilot::of_all(scene, entries, layers, (1, samples, REPLICATES), stop)?;
        if doubt(&pilots, layers) > DOUBTFUL {
            budget.extend();
            take_turns(&mut pilots, budget.first_images(sample * f64::from(samples)), stop)?;
        }
        let candidates = pilot::candidates(scene, entries, &pilots, layers, stop)?;
        Ok(Self { entries, layers, pilots, candidates })
    }

    /// The layers of each candidate that has some; `Err` of a layer that none carries.
    ///
    /// # Errors
    /// Within, if a method cannot render, or the user asked for an end.
    pub fn groups(&self, scene: &Scene, stop: &Stop) -> Result<Result<Vec<Group>, Error>, usize> {
        let (assignment, _) = search::best(&self.candidates)?;
        let sets = search::sets(&assignment, self.entries.len()).into_iter().enumerate();
        let group = |(m, set): (usize, Vec<usize>)| {
            let division = regions::divide(scene, self.entries, &self.candidates, self.layers, (m, &set), stop)?;
            Ok(Group { m, layers: set.iter().map(|&k| self.layers[k]).collect(), set, division })
        };
        Ok(sets.filter(|(_, set)| !set.is_empty()).map(group).collect())
    }

    /// The methods that carry all layers, but for those that are surely far from the best of these.
    pub fn rivals(&self) -> Vec<usize> {
        let all: Vec<usize> = (0..self.layers.len()).collect();
        let is_whole = |m: &usize| self.candidates[*m].carries.iter().all(|&carries| carries);
        let whole: Vec<usize> = (0..self.candidates.len()).filter(is_whole).collect();
        let at_most = |m: usize| self.candidates[m].variance(&all) * self.candidates[m].cost.of(&all);
        let found = |m: usize| self.pilots[m].variance(self.layers) * self.candidates[m].cost.of(&all);
        let least = whole.iter().map(|&m| at_most(m)).fold(f64::INFINITY, f64::min);
        whole.into_iter().filter(|&m| found(m) <= RIVAL * least).collect()
    }

    /// What a candidate's layers of this set take of the seconds of all that it carries.
    pub fn part(&self, m: usize, set: &[usize]) -> f64 {
        let own: Vec<usize> = (0..self.layers.len()).filter(|&k| self.entries[m].carries[k]).collect();
        let cost = &self.candidates[m].cost;
        let part = cost.of(set) / cost.of(&own);
        // In the dark, a light subpath costs nothing.
        if part.is_finite() { part } else { 1.0 }
    }
}

/// By how much the variance of a method may be greater than it is found to be, of those that may be the best by themselves.
fn doubt(pilots: &[Pilot], layers: &[Layer]) -> f64 {
    let whole: Vec<&Pilot> = pilots.iter().filter(|pilot| pilot.has(layers)).collect();
    let product = |pilot: &Pilot| pilot.variance(layers) * pilot.seconds();
    let least = whole.iter().map(|pilot| product(pilot)).fold(f64::INFINITY, f64::min);
    let rivals = whole.into_iter().filter(|pilot| product(pilot) <= RIVAL * least);
    let of = |pilot: &Pilot| {
        let found = positive::variance(&pilot.squares(layers), 0);
        found.interval.map_or(1.0, |(_, high)| high / found.value)
    };
    rivals.map(of).filter(|doubt| doubt.is_finite()).fold(1.0, f64::max)
}

/// Seconds of a sample of every pixel by each of the methods.
pub fn sample_seconds(scene: &Scene, entries: &[Entry], layers: &[Layer], stop: &Stop) -> Result<f64, Error> {
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
