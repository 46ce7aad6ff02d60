//! The second pilot: what the runs that were chosen take and leave, on random numbers that they were not chosen by.

use super::pilot::{Entry, Pilot, take_turns};
use super::regions::Division;
use super::{Choice, ChosenRun, search};
use crate::error::Error;
use crate::statistics::positive::{Stratum, log_sum, recursion};
use crate::stop::Stop;
use integrators::Layer;
use integrators::composite::{Regions, Run};
use scenes::Scene;

/// The part of an undivided image's product of variance and seconds below which a divided one's must lie.
const PAYS: f64 = 0.96;

/// Layers that were left to a candidate, and the division of the image for them.
pub struct Group {
    /// The candidate.
    pub m: usize,
    /// The layers.
    pub layers: Vec<Layer>,
    /// The regions, if it may have such.
    pub division: Option<Division>,
}

/// A group as the second pilot finds it: variance and seconds of one sample, and its runs as candidate, regions, parts of samples and seconds.
struct Judged {
    found: (f64, f64),
    runs: Vec<(usize, Option<Regions>, f64, f64)>,
}

impl Group {
    /// The candidates whose pilots it needs, its own first.
    pub fn methods(&self) -> Vec<usize> {
        self.division.as_ref().map_or(vec![self.m], |division| division.methods.iter().map(|(m, _)| *m).collect())
    }

    /// What its pilots have found, in the order of [`methods`](Self::methods). The image stays undivided where a division does not pay.
    fn judge(&self, pilots: &[Pilot]) -> Judged {
        let (variance, seconds) = (pilots[0].variance(), pilots[0].seconds());
        let whole = Judged { found: (variance, seconds), runs: vec![(self.m, None, 1.0, 1.0)] };
        let Some(division) = &self.division else { return whole };
        let own: Vec<(Vec<f64>, f64)> = pilots.iter().map(|pilot| (pilot.variances(), pilot.seconds())).collect();
        let found = division.judged(&own);
        if found.0 * found.1 >= PAYS * variance * seconds {
            return whole;
        }
        let run = |(method, &(m, _)): (usize, &(usize, Vec<f64>))| {
            let (regions, part) = division.regions(method)?;
            Some((m, Some(regions), part, division.part(method, &own[method]).1 / found.1))
        };
        Judged { found, runs: division.methods.iter().enumerate().filter_map(run).collect() }
    }
}

/// Measures the runs chosen, and the methods that carry all layers: those with a pilot in `whole`, the first one, beside which a second is made, of so
/// many replicates and samples.
///
/// # Errors
/// If a method cannot render, or the user asked for an end.
pub fn confirm(
    scene: &Scene,
    entries: &[Entry],
    (layers, groups, whole): (&[Layer], &[Group], &[(usize, &Pilot)]),
    (replicates, samples): (u32, u32),
    stop: &Stop,
) -> Result<Choice, Error> {
    let mut pilots = Vec::new();
    let mut add = |m: usize, layers: &[Layer], number: u32| -> Result<(), Error> {
        pilots.push(Pilot::new(scene, entries[m].method, entries[m].of_layers(layers, number, samples))?);
        Ok(())
    };
    for group in groups {
        group.methods().into_iter().try_for_each(|m| add(m, &group.layers, 2))?;
    }
    whole.iter().try_for_each(|(m, _)| add(*m, layers, 4))?;
    take_turns(&mut pilots, replicates, stop)?;
    let mut rest = &pilots[..];
    let judged: Vec<Judged> = groups
        .iter()
        .map(|group| {
            let (own, others) = rest.split_at(group.methods().len());
            rest = others;
            group.judge(own)
        })
        .collect();
    let single = Single::best(whole, rest);
    let found: Vec<(f64, f64)> = judged.iter().map(|judged| judged.found).collect();
    let shares = search::shares(&found);
    let time: f64 = found.iter().zip(&shares).map(|((_, seconds), share)| seconds * share).sum();
    let mut runs = Vec::new();
    for (i, (group, judged)) in groups.iter().zip(judged).enumerate() {
        runs.extend(judged.runs.into_iter().map(|(m, regions, samples, seconds)| ChosenRun {
            run: Run { regions, ..run_of(&entries[m], &group.layers, shares[i] * samples) },
            layers: group.layers.iter().map(|layer| layer.label()).collect(),
            time: found[i].1 * shares[i] * seconds / time,
            variance: found[i].0 / shares[i],
            single: single.as_ref().map(|single| single.variance(&group.layers)),
        }));
    }
    let gain = single.as_ref().map(|single| single.product() / search::product(&found, &shares));
    let gain = gain.filter(|gain| gain.is_finite());
    let choice = Choice {
        gain_interval: gain
            .zip(single.as_ref())
            .and_then(|(gain, single)| interval(gain, groups, &found, &pilots, single)),
        single: single.as_ref().map_or(String::new(), |single| entries[single.m].run.label()),
        gain,
        left_out: Vec::new(),
        pilot_seconds: 0.0,
        runs,
    };
    // A division is for what it is known to win: rare bright samples in a pilot make one method look bad, and the interval wide.
    let least = choice.gain_interval.map(|(low, _)| low).or(choice.gain);
    let is_worse = least.is_some_and(|least| least < 1.0);
    let is_one = |m: usize| matches!(&choice.runs[..], [only] if only.run.regions.is_none()) && groups[0].m == m;
    match single.filter(|single| is_worse || is_one(single.m)) {
        Some(single) => {
            let runs = vec![alone_run(&entries[single.m], layers, single.variance(layers))];
            Ok(Choice { gain: Some(1.0), gain_interval: None, runs, ..choice })
        }
        None => Ok(choice),
    }
}

/// The best method by itself, by the variances of both of its pilots, so that it is not chosen for what one of them finds, and by the seconds of the
/// second alone: times of day differ in speed, and these were taken by turns with the runs'.
struct Single<'p> {
    m: usize,
    pilots: [&'p Pilot<'p>; 2],
}

impl<'p> Single<'p> {
    /// The best of those with a first and a second pilot.
    fn best(first: &'p [(usize, &'p Pilot<'p>)], second: &'p [Pilot<'p>]) -> Option<Self> {
        let all = first.iter().zip(second).map(|((m, first), second)| Self { m: *m, pilots: [first, second] });
        all.min_by(|a, b| a.product().total_cmp(&b.product()))
    }

    /// Variance times seconds.
    fn product(&self) -> f64 {
        self.pooled(|pilot| pilot.variance()) * self.pilots[1].seconds()
    }

    /// The variance of one sample's sum over some layers.
    fn variance(&self, layers: &[Layer]) -> f64 {
        self.pooled(|pilot| pilot.variance_over(layers))
    }

    /// A variance by both pilots, each of which counts by the degrees of freedom that its images have.
    fn pooled(&self, variance: impl Fn(&Pilot) -> f64) -> f64 {
        let freedom = self.pilots.map(|pilot| pilot.times().len() as f64 - 1.0);
        let sum: f64 = self.pilots.iter().zip(freedom).map(|(pilot, freedom)| variance(pilot) * freedom).sum();
        sum / freedom.iter().sum::<f64>()
    }
}

/// What the gain may be, as far as the pilots' variances and seconds are known: that of the best method by itself over those of the groups, to the power
/// of the parts of Σ √(V c) that they have.
fn interval(
    gain: f64,
    groups: &[Group],
    found: &[(f64, f64)],
    pilots: &[Pilot],
    single: &Single,
) -> Option<(f64, f64)> {
    let whole: f64 = found.iter().map(|(variance, seconds)| (variance * seconds).sqrt()).sum();
    let mut first = 0;
    let mut squares = Vec::new();
    // What slows a turn slows all images of it, so that seconds are in doubt together.
    let mut seconds: Vec<f64> = single.pilots[1].times().to_vec();
    for (group, (variance, time)) in groups.iter().zip(found) {
        let part = (variance * time).sqrt() / whole;
        squares.push((-part, pilots[first].squares()));
        seconds.iter_mut().zip(pilots[first].times()).for_each(|(product, time)| *product /= time.powf(part));
        first += group.methods().len();
    }
    squares.push((1.0, single.pilots.iter().flat_map(|pilot| pilot.squares()).collect()));
    // What does not vary has no part of the doubt.
    squares.retain(|(_, squares)| squares.iter().sum::<f64>() > 0.0);
    squares.push((1.0, seconds));
    let strata: Vec<Stratum> = squares.iter().map(|(power, own)| Stratum::new(vec![(*power, own)])).collect();
    let (_, (below, above)) = log_sum(&strata, recursion(single.pilots[1].times().len() - 1), 0)?;
    Some((gain * (-below).exp(), gain * above.exp()))
}

/// The best method by itself, where no division is better.
fn alone_run(entry: &Entry, layers: &[Layer], variance: f64) -> ChosenRun {
    let run = run_of(entry, layers, 1.0);
    ChosenRun { run, layers: layers.iter().map(|l| l.label()).collect(), time: 1.0, variance, single: Some(variance) }
}

fn run_of(entry: &Entry, layers: &[Layer], share: f64) -> Run {
    let orders: Vec<String> = layers.iter().filter(|layer| **layer != Layer::Tail).map(|layer| layer.label()).collect();
    Run { orders: orders.join(","), tail: layers.contains(&Layer::Tail), share, ..entry.run.clone() }
}
