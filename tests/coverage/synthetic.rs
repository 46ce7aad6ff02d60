//! Synthetic experiments with known truth, of the shapes that renders have.

use super::{REPLICATES, Table, experiments};
use crate::support::seed;
use neumann::statistics::covariances::Covariances;
use neumann::statistics::errors::{Errors, Reference};
use neumann::statistics::slopes::{Point, slope, time_to_error};
use neumann::statistics::{Estimate, means, positive, time};
use rayon::prelude::*;
use sampling::moments::Moments;
use sampling::rng::{Stream, mix2};

/// Pixels of an image.
const PIXELS: usize = 64;
/// Samples of a replicate, at the checkpoints of a line.
const CHECKPOINTS: [usize; 4] = [2, 4, 8, 16];
/// Samples of a replicate elsewhere.
const SAMPLES: usize = 16;
/// Seconds of a sample, on average.
const SECOND: f64 = 0.01;
/// Samples of a reference, in replicates of the method.
const REFERENCE: usize = 64;
/// And its replicates.
const REFERENCE_REPLICATES: usize = 16;

/// How the pixels of a replicate come about. All of them have the mean [`mean`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Independent and normal.
    Normal,
    /// Means of independent lognormal contributions (σ = 1): fireflies.
    Lognormal,
    /// Gamma-distributed, a tenth of the variance shared by all pixels, as splats do.
    Splats,
    /// One sample in five brings anything, an exponentially distributed something.
    Rare,
}

impl Kind {
    const ALL: [Kind; 4] = [Kind::Normal, Kind::Lognormal, Kind::Splats, Kind::Rare];
    /// What one sample in so many brings anything of kind `Rare`.
    const RARE: f64 = 5.0;
    /// The shared part of `Splats`.
    const SHARED: f64 = 0.25;

    /// Variance of one sample of a pixel with mean 1.
    pub fn variance(self) -> f64 {
        match self {
            Kind::Normal => 1.0,
            Kind::Lognormal => 1.0_f64.exp() - 1.0,
            Kind::Splats => (1.0 - Self::SHARED).powi(2) + Self::SHARED.powi(2),
            Kind::Rare => 2.0 * Self::RARE - 1.0,
        }
    }

    /// One replicate of so many samples.
    fn image(self, samples: usize, chance: &mut Chance) -> Vec<f64> {
        let shared = (self == Kind::Splats).then(|| chance.gamma(samples));
        (0..PIXELS).map(|p| mean(p) * self.value(samples, shared, chance)).collect()
    }

    /// A pixel of mean one of so many samples, given what pixels share, if they do.
    fn value(self, samples: usize, shared: Option<f64>, chance: &mut Chance) -> f64 {
        let n = samples as f64;
        match self {
            Kind::Normal => 1.0 + chance.normal() / n.sqrt(),
            Kind::Lognormal => (0..samples).map(|_| (chance.normal() - 0.5).exp()).sum::<f64>() / n,
            Kind::Splats => {
                let shared = shared.unwrap_or_else(|| chance.gamma(samples));
                (1.0 - Self::SHARED) * chance.gamma(samples) / n + Self::SHARED * shared / n
            }
            Kind::Rare => {
                let arrived = (0..samples).filter(|_| chance.uniform() * Self::RARE < 1.0).count();
                chance.gamma(arrived) * Self::RARE / n
            }
        }
    }
}

/// Mean of a pixel: from 1/2 to 2.
fn mean(pixel: usize) -> f64 {
    4.0_f64.powf((pixel as f64 + 0.5) / PIXELS as f64 - 0.5)
}

/// Mean over pixels.
fn over_pixels(of: impl Fn(f64) -> f64) -> f64 {
    (0..PIXELS).map(|p| of(mean(p))).sum::<f64>() / PIXELS as f64
}

/// Random numbers of an experiment.
pub struct Chance(Stream);

impl Chance {
    /// Those of one experiment of a kind.
    pub fn new(experiment: usize, kind: u64) -> Self {
        Self(Stream::new(mix2(mix2(seed(), 0xc0e), mix2(experiment as u64, kind)), kind))
    }

    /// In (0, 1].
    pub fn uniform(&mut self) -> f64 {
        1.0 - f64::from(self.0.next_f32())
    }

    /// Standard normal [Box & Muller 1958].
    pub fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }

    /// The sum of so many exponential values.
    fn gamma(&mut self, shape: usize) -> f64 {
        -(0..shape).map(|_| self.uniform().ln()).sum::<f64>()
    }

    /// Seconds of a replicate: they vary by a tenth.
    fn seconds(&mut self, samples: usize) -> f64 {
        SECOND * samples as f64 * (1.0 + 0.1 * self.normal())
    }
}

/// What the errors of one method in one experiment are measured on.
struct Run {
    errors: Vec<Vec<f64>>,
    seconds: Vec<f64>,
}

impl Run {
    fn new(kind: Kind, samples: usize, replicates: usize, chance: &mut Chance) -> Self {
        let errors = (0..replicates).map(|_| kind.image(samples, chance)).collect();
        Self { errors, seconds: (0..replicates).map(|_| chance.seconds(samples)).collect() }
    }

    /// Recursive squares.
    fn squares(&self) -> Vec<f64> {
        let mut mean = vec![0.0; PIXELS];
        let replicates = self.errors.iter().enumerate().map(|(i, image)| {
            let r = (i + 1) as f64;
            let mut sum = 0.0;
            for (mean, x) in mean.iter_mut().zip(image) {
                let deviation = x - *mean;
                *mean += deviation / r;
                sum += deviation * deviation;
            }
            sum * (r - 1.0) / r / PIXELS as f64
        });
        replicates.collect::<Vec<f64>>().split_off(1)
    }
}

/// A reference whose pixels are independent values of the kind, and which knows of their noise what its replicates say: means, a half
/// that is exact, variances.
fn made_reference(kind: Kind, chance: &mut Chance) -> [Vec<[f64; 3]>; 3] {
    let of_pixels =
        |of: &dyn Fn(usize) -> f64| -> Vec<[f64; 3]> { (0..PIXELS).flat_map(|p| [[of(p); 3]; 2]).collect() };
    let mut made = vec![Moments::default(); PIXELS];
    for (p, pixel) in made.iter_mut().enumerate() {
        for _ in 0..REFERENCE_REPLICATES {
            pixel.push(mean(p) * kind.value(REFERENCE * SAMPLES / REFERENCE_REPLICATES, None, chance));
        }
    }
    let variance = |p: usize| made[p].variance() / REFERENCE_REPLICATES as f64;
    [of_pixels(&|p| made[p].mean), of_pixels(&mean), of_pixels(&variance)]
}

/// Errors against a noisy reference, with a bias that is this part of every pixel's mean.
fn errors(
    table: &mut Table,
    (kind, replicates): (Kind, usize),
    bias: f64,
    made: &[Vec<[f64; 3]>; 3],
    chance: &mut Chance,
) {
    let run = Run::new(kind, SAMPLES, replicates, chance);
    let variance = kind.variance() / SAMPLES as f64;
    let reference = Reference { mean: &made[0], half: &made[1], variance: &made[2] };
    let mut errors = Errors::new(PIXELS, 1);
    run.errors.iter().for_each(|image| errors.push(reference, |_, p| [image[p] + bias * mean(p); 3]));
    let found = errors.finish(reference, 7).swap_remove(0);
    let second = over_pixels(|m| m * m);
    let weighted = over_pixels(|m| m * m / (m * m + 0.01));
    let name = format!("{kind:?}");
    if bias == 0.0 {
        table.add("mean", &name, found.mean, over_pixels(|m| m));
        table.add("variance", &name, found.variance, variance * second);
        table.add("relMSE", &name, found.relmse, variance * weighted);
        table.add_p_value("no bias, p > 5 %", &name, replicates, found.no_bias);
    }
    let name = if bias == 0.0 { name } else { format!("{name}, bias {bias}") };
    table.add("MSE", &name, found.mse, (variance + bias * bias) * second);
    table.add("bias²", &name, found.bias2, bias * bias * second);
    // To an error that is four times as large as what the bias leaves of it.
    let (left, work) = (bias * bias * weighted, variance * weighted * SECOND * SAMPLES as f64);
    let target = 4.0 * left.max(variance * weighted / 64.0);
    let time = time::time_to_error(errors.relative_squares(0), &run.seconds[1..], &found.relbias2, target, 11);
    let estimate = Estimate { interval: time.interval, replicates, ..Estimate::new(time.seconds, None, replicates, 8) };
    table.add("time to relMSE", &name, estimate, work / (target - left));
}

/// Errors of a few values, by hand: none has a sign, and relative ones are over the square of what is right.
#[test]
fn errors_of_known_values() {
    let (right, part) = (2.0, 0.25);
    let made = vec![[right; 3]; 4];
    let exact = vec![[0.0; 3]; 4];
    let reference = Reference { mean: &made, half: &made, variance: &exact };
    let mut errors = Errors::new(2, 1);
    (0..2).for_each(|_| errors.push(reference, |_, p| [right * [1.0 + part, 1.0 - part][p]; 3]));
    let found = errors.finish(reference, 7).swap_remove(0);
    let is =
        |estimate: Estimate, truth: f64| assert!((estimate.value / truth - 1.0).abs() < 1e-12, "{estimate:?} {truth}");
    let square = (right * part).powi(2);
    is(found.mse, square);
    is(found.relmse, square / (right * right + 0.01));
    is(found.smape, (part / (2.0 + part) + part / (2.0 - part)) / 2.0);
}

/// The covariance between two orders, the second of which is half the first and half something of its own.
fn covariances(table: &mut Table, kind: Kind, replicates: usize, chance: &mut Chance) {
    let mut covariances = Covariances::new(PIXELS, 2);
    for _ in 0..replicates {
        let [a, b] = [0; 2].map(|_| kind.image(SAMPLES, chance));
        covariances.push(|layer, p| [if layer == 0 { a[p] } else { 0.5 * (a[p] + b[p]) }; 3]);
    }
    let truth = 0.5 * kind.variance() / SAMPLES as f64 * over_pixels(|m| m * m);
    table.add("covariance", &format!("{kind:?}"), covariances.covariance(0, 1, 9), truth);
}

/// Efficiencies and ratios of two methods, the second with four times the variance in the same time.
fn efficiencies(table: &mut Table, kind: Kind, replicates: usize, chance: &mut Chance) {
    let [a, b] = [SAMPLES, SAMPLES / 4].map(|n| Run::new(kind, n, replicates, chance));
    let (qa, qb) = (a.squares(), b.squares());
    let (sa, sb) = (&a.seconds[1..], &b.seconds[1..]);
    let variance = over_pixels(|m| m * m) * kind.variance();
    let name = format!("{kind:?}");
    table.add("efficiency", &name, positive::efficiency(&qa, sa, 1), 1.0 / (variance * SECOND));
    table.add("RMSE ratio", &name, positive::rmse_ratio(&qa, &qb, 2), 0.5);
    table.add("efficiency ratio", &name, positive::efficiency_ratio((&qa, sa), (&qb, sb), 3), 1.0);
}

/// Slopes against samples and seconds, and the time to an error that is beyond the last checkpoint.
fn lines(table: &mut Table, kind: Kind, replicates: usize, chance: &mut Chance) {
    let runs = CHECKPOINTS.map(|n| Run::new(kind, n, replicates, chance));
    let squares = runs.each_ref().map(Run::squares);
    let points = |with_seconds: bool| -> Vec<Point> {
        let point = |i: usize| Point {
            samples: CHECKPOINTS[i] as f64,
            squares: &squares[i],
            seconds: if with_seconds { &runs[i].seconds[1..] } else { &[] },
        };
        (0..CHECKPOINTS.len()).map(point).collect()
    };
    let name = format!("{kind:?}");
    table.add("slope, samples", &name, slope(&points(false), 4).unwrap(), -1.0);
    table.add("slope, seconds", &name, slope(&points(true), 5).unwrap(), -1.0);
    let error = (kind.variance() * over_pixels(|m| m * m) / 64.0).sqrt();
    table.add("time to error", &name, time_to_error(&points(true), error, 6).unwrap(), 64.0 * SECOND);
}

/// Every experiment of a kind, for each number of replicates.
fn tabulate(count: usize, experiment: impl Fn(&mut Table, Kind, usize, &mut Chance) + Sync) -> Table {
    let cases =
        Kind::ALL.into_iter().enumerate().flat_map(|(i, kind)| REPLICATES.map(|replicates| (i, kind, replicates)));
    let cases: Vec<_> = cases.collect();
    let one = |run: usize| {
        let mut table = Table::default();
        for &(i, kind, replicates) in &cases {
            experiment(&mut table, kind, replicates, &mut Chance::new(run, (i * 100 + replicates) as u64));
        }
        table
    };
    (0..count).into_par_iter().map(one).reduce(Table::default, Table::merge)
}

#[test]
fn intervals_of_errors_cover_the_truth() {
    let biases = [0.0, 0.1, 1.0];
    let experiment = |table: &mut Table, kind: Kind, replicates: usize, chance: &mut Chance| {
        let made = made_reference(kind, chance);
        biases.iter().for_each(|&bias| errors(table, (kind, replicates), bias, &made, chance));
        covariances(table, kind, replicates, chance);
    };
    tabulate(experiments(80), experiment).finish();
}

#[test]
fn intervals_of_efficiencies_cover_the_truth() {
    tabulate(experiments(80), efficiencies).finish();
}

#[test]
fn intervals_of_slopes_cover_the_truth() {
    tabulate(experiments(40), lines).finish();
}

/// A mean of lognormal replicates: as skewed as image means are where a few paths carry them.
#[test]
fn intervals_of_means_cover_the_truth() {
    let experiment = |table: &mut Table, _: Kind, replicates: usize, chance: &mut Chance| {
        for sigma in [0.2_f64, 0.5] {
            let values: Vec<f64> =
                (0..replicates).map(|_| (sigma * chance.normal() - sigma * sigma / 2.0).exp()).collect();
            let name = format!("lognormal, σ = {sigma}");
            table.add("skewed mean", &name, means::skewed_mean(&values, 8), 1.0);
            if sigma < 0.5 {
                table.add("mean", &name, means::mean(&values), 1.0);
                table.add("mean of 4", &name, Estimate { replicates, ..means::mean(&values[..4]) }, 1.0);
            }
        }
    };
    tabulate(experiments(80), experiment).finish();
}
