//! When to stop: after so many replicates, or once a confidence sequence says that an error is small enough.
//!
//! Whether there is another replicate depends on the values of those before it and on nothing else, so that a run that was interrupted
//! ends where it would have ended. What is looked at is how wide intervals are, not what they hold.

use crate::config::{OrderChoice, Until};
use crate::job::Job;
use crate::path_class::{carries, missing};
use crate::result::{SequenceRow, Target};
use crate::statistics::sequential::ConfidenceSequence;
use integrators::{Bias, Layer};
use sampling::moments::Moments;

/// How many replicates jobs that take turns get.
pub enum RunLength {
    /// So many each.
    Replicates(u32),
    /// As many as it takes.
    Until(StoppingRule),
}

/// A target and its limits.
pub struct StoppingRule {
    /// The target.
    pub until: Until,
    /// The last order traced one by one.
    pub max_order: usize,
    /// Replicates before anybody looks.
    pub fewest: u32,
    /// The most that each job gets.
    pub most: Vec<u32>,
}

impl RunLength {
    /// The most replicates that a job gets.
    pub fn most(&self, job: usize) -> u32 {
        match self {
            RunLength::Replicates(replicates) => *replicates,
            RunLength::Until(rule) => rule.most[job],
        }
    }

    /// Which of the jobs get one more replicate than so many.
    pub fn wants(&self, jobs: &[Job], replicates: u32) -> Vec<bool> {
        let rule = match self {
            RunLength::Replicates(most) => return vec![replicates < *most; jobs.len()],
            RunLength::Until(rule) => rule,
        };
        let open = |job: usize| replicates < rule.most[job] && jobs[job].replicates() >= replicates;
        if replicates < rule.fewest {
            return (0..jobs.len()).map(open).collect();
        }
        let behind = rule.behind(jobs, replicates);
        (0..jobs.len()).map(|job| open(job) && behind[job]).collect()
    }
}

impl StoppingRule {
    /// Which of the jobs have not reached the target with so many replicates.
    fn behind(&self, jobs: &[Job], replicates: u32) -> Vec<bool> {
        let mut behind = vec![false; jobs.len()];
        for row in self.bounds(jobs, replicates).iter().filter(|row| row.bound > row.target) {
            row.jobs.iter().flatten().for_each(|&job| behind[job] = true);
        }
        behind
    }

    /// What is known at the end.
    pub fn rows(&self, jobs: &[Job]) -> Vec<SequenceRow> {
        let most = jobs.iter().map(Job::replicates).max().unwrap_or(0);
        let label = |job: usize| jobs[job].planned.label.clone();
        let row = |bound: Bound| SequenceRow {
            scene: jobs[bound.jobs[0].unwrap_or(0)].scene.name.clone(),
            label: label(bound.jobs[0].unwrap_or(0)),
            other: bound.jobs[1].map(label),
            order: bound.order,
            target: if bound.jobs[1].is_some() { Target::DetectableBias } else { Target::RelativeError },
            bound: bound.bound,
            asked: bound.target,
            differ: bound.differ,
            replicates: bound.replicates,
        };
        self.bounds(jobs, most).into_iter().map(row).collect()
    }

    /// All bounds after so many replicates, or as many as there are.
    fn bounds(&self, jobs: &[Job], replicates: u32) -> Vec<Bound> {
        match (self.until.relative_error, self.until.detectable_bias) {
            (Some(target), _) => (0..jobs.len()).flat_map(|job| self.errors(jobs, job, replicates, target)).collect(),
            (None, target) => self.biases(jobs, replicates, target.unwrap_or_default()),
        }
    }

    /// The orders asked for of a method; `None` is their sum.
    fn orders(&self, job: &Job) -> Vec<Option<Layer>> {
        let layers = job.layers();
        match self.until.order {
            OrderChoice::Total => vec![None],
            OrderChoice::All => layers.iter().map(|&layer| Some(layer)).collect(),
            OrderChoice::One(k) => layers.iter().filter(|layer| layer.order() == Some(k)).map(|&l| Some(l)).collect(),
        }
    }

    /// The largest relative errors that a method's means may have. An order in which nothing has arrived has none.
    fn errors(&self, jobs: &[Job], job: usize, replicates: u32, target: f64) -> Vec<Bound> {
        let orders = self.orders(&jobs[job]);
        let sequence = shared(orders.len());
        let bound = |order: Option<Layer>| {
            let values: Moments = values(&jobs[job], order, replicates).into_iter().collect();
            let dark = values.mean == 0.0 && values.m2 == 0.0;
            let bound = if dark { 0.0 } else { sequence.relative_error(&values) };
            Bound { jobs: [Some(job), None], order, bound, target, differ: None, replicates: values.n as u32 }
        };
        orders.into_iter().map(bound).collect()
    }

    /// The relative biases that would be found between all methods that carry the same light and claim to have none.
    fn biases(&self, jobs: &[Job], replicates: u32, target: f64) -> Vec<Bound> {
        let lost: Vec<Vec<String>> = jobs.iter().map(|job| missing(&*job.planned.method, &job.scene.scene)).collect();
        let mut pairs = Vec::new();
        let unbiased = |job: usize| jobs[job].planned.method.bias() == Bias::None;
        let all = (0..jobs.len()).flat_map(|a| (a + 1..jobs.len()).map(move |b| (a, b)));
        for (a, b) in all.filter(|&(a, b)| unbiased(a) && unbiased(b)) {
            let whole = |order: Option<Layer>| {
                [a, b].iter().all(|&job| {
                    let has = order.map_or(self.has_all(&jobs[job]), |layer| jobs[job].layers().contains(&layer));
                    has && carries(&lost[job], order, self.max_order)
                })
            };
            pairs.extend(self.orders(&jobs[a]).into_iter().filter(|&order| whole(order)).map(|order| (a, b, order)));
        }
        let sequence = shared(pairs.len());
        let bound = |(a, b, order): (usize, usize, Option<Layer>)| {
            let (of_a, of_b) = (values(&jobs[a], order, replicates), values(&jobs[b], order, replicates));
            let differences: Moments = of_a.iter().zip(&of_b).map(|(a, b)| a - b).collect();
            // One of them may have been given more replicates than the other.
            let mean = of_a.iter().zip(&of_b).map(|(a, b)| 0.5 * (a + b)).sum::<f64>() / differences.n as f64;
            let dark = mean == 0.0 && differences.m2 == 0.0;
            let bound = if dark { 0.0 } else { sequence.detectable_bias(&differences) / mean.abs() };
            let differ = Some(sequence.differ(&differences));
            Bound { jobs: [Some(a), Some(b)], order, bound, target, differ, replicates: differences.n as u32 }
        };
        pairs.into_iter().map(bound).collect()
    }

    /// Whether a method has all orders, so that its sum is that of the others.
    fn has_all(&self, job: &Job) -> bool {
        job.layers().iter().filter(|layer| layer.order().is_some()).count() == self.max_order + 1
    }
}

/// What is known of a method, or of two.
struct Bound {
    jobs: [Option<usize>; 2],
    order: Option<Layer>,
    bound: f64,
    target: f64,
    differ: Option<bool>,
    replicates: u32,
}

/// A sequence for one of so many quantities, all of which hold together.
fn shared(quantities: usize) -> ConfidenceSequence {
    let alpha = ConfidenceSequence::default().alpha / quantities.max(1) as f64;
    ConfidenceSequence { alpha }
}

/// Image means, channel means, of the first so many replicates: of a layer, or of their sum.
fn values(job: &Job, order: Option<Layer>, replicates: u32) -> Vec<f64> {
    let at = order.and_then(|order| job.layers().iter().position(|&l| l == order));
    let series = job.layers().len();
    let grey = |v: &[f64; 3]| v.iter().sum::<f64>() / 3.0;
    let value = |layers: &[[f64; 3]]| match at {
        Some(at) => grey(&layers[at]),
        None => layers[..series].iter().map(grey).sum(),
    };
    job.means().into_iter().take(replicates as usize).map(value).collect()
}
