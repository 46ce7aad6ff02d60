//! Weights, moments and the tails of distributions, in double precision against more of it.

use std::f64::consts::PI;

use neumann::statistics::means::student_quantile;
use neumann::statistics::welch::{Sample, welch};
use sampling::mis::{Heuristic, Rivals};
use sampling::moments::Moments;

use super::{Dice, TRIES, Worst, double};

/// A sum without rounding to speak of: what is lost of each addition is added at the end [Neumaier 1974].
fn sum(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut lost) = (0.0_f64, 0.0);
    for x in values {
        let next = sum + x;
        lost += if sum.abs() >= x.abs() { (sum - next) + x } else { (x - next) + sum };
        sum = next;
    }
    sum + lost
}

/// Densities that span 10⁶⁰, from one end of a path to the other.
#[test]
fn partial_sums_of_weights() {
    let mut dice = Dice::new(9);
    let mut worst = Worst::of("weight by partial sums");
    for _ in 0..TRIES / 10 {
        let densities: Vec<f64> = (0..12).map(|_| dice.magnitude(1e-30, 1e30)).collect();
        for heuristic in [Heuristic::Balance, Heuristic::Power(2.0)] {
            let beta = if heuristic == Heuristic::Balance { 1 } else { 2 };
            let chosen = (dice.unit() * 12.0) as usize;
            // As a path's are: from both of its ends to the strategy that made it, each relative to the one before.
            let side = |far: &[f64]| {
                let step =
                    |rivals: Rivals, pair: &[f64]| heuristic.relative(heuristic.join(rivals, 1.0), pair[0] / pair[1]);
                far.windows(2).fold(Rivals::NONE, step)
            };
            let backwards: Vec<f64> = densities[chosen..].iter().rev().copied().collect();
            let all = heuristic.merge(side(&densities[..=chosen]), side(&backwards));
            let found = heuristic.weight(all);
            let own = densities[chosen];
            let exact = 1.0 / sum(densities.iter().map(|p| (p / own).powi(beta)));
            worst.add_in(found, exact, double(exact), || format!("{heuristic:?} of strategy {chosen}"));
        }
    }
    worst.finish(24.0);
}

/// Values with a mean far larger than their spread.
#[test]
fn means_and_variances() {
    let mut dice = Dice::new(10);
    let [mut mean, mut variance] = ["mean, of mean magnitude", "variance, by condition"].map(Worst::of);
    for _ in 0..TRIES / 100 {
        let (offset, spread) = (dice.magnitude(1e-6, 1e9), dice.magnitude(1e-6, 1e3));
        let values: Vec<f64> = (0..1000).map(|_| offset + spread * (dice.unit() - 0.5)).collect();
        let (first, second) = values.split_at(300);
        let of = |values: &[f64]| values.iter().copied().collect::<Moments>();
        let mut moments = of(first);
        moments.merge(&of(second));
        let exact = sum(values.iter().copied()) / 1000.0;
        let at = || format!("{offset:e} ± {spread:e}");
        mean.add_in(moments.mean, exact, double(sum(values.iter().map(|x| x.abs())) / 1000.0), at);
        let squares =
            sum(values.iter().map(|x| (x - exact).powi(2))) - sum(values.iter().map(|x| x - exact)).powi(2) / 1000.0;
        let exact = squares / 999.0;
        // By the condition of variances [Chan, Golub & LeVeque 1983].
        let condition = (1.0 + offset * offset / exact).sqrt();
        variance.add_in(moments.variance(), exact, double(exact) * condition, at);
    }
    mean.finish(24.0);
    variance.finish(24.0);
}

/// Where Student's distribution has a closed form; Welch's p-value is that of F(1, ν) at t².
#[test]
fn tails_of_students_distribution() {
    let mut dice = Dice::new(11);
    let mut worst = Worst::of("p-value of Welch's test");
    for _ in 0..TRIES / 100 {
        let t = dice.magnitude(1e-3, 1e3);
        // Two samples of n with the same variance have 2n − 2 degrees of freedom: of n = 2 there are two, of n = 3 four.
        for n in [2_usize, 3] {
            let freedom = (2 * n - 2) as f64;
            let x2 = t * t / freedom;
            // 1 − x/√(1 + x²) without its cancellation, and A&S 26.7.4.
            let two = |y2: f64| 1.0 / ((1.0 + y2).sqrt() * ((1.0 + y2).sqrt() + y2.sqrt()));
            let exact = match n {
                2 => two(x2),
                // 1 − s (1 + c²/2) with s² = 1 − c², times and over the sum in place of the difference.
                _ => {
                    let c2 = 1.0 / (1.0 + x2);
                    c2 * c2 * (3.0 + c2) / (4.0 * (1.0 + (x2 * c2).sqrt() * (1.0 + c2 / 2.0)))
                }
            };
            if exact < 1e-12 {
                continue;
            }
            let of = |mean: f64| Sample { mean, variance: 1.0, n: n as u32 };
            let found = welch(of(0.0), of(t * (2.0 / n as f64).sqrt()), 0.0);
            // What is left of 1 beside ν / (ν + t²) is rounded to that of 1.
            worst.add_in(found.p, exact, double(exact) * (1.0 + 1.0 / t), || {
                format!("t {t}, freedom {}", found.freedom)
            });
        }
    }
    worst.finish(150.0);
    let mut quantile = Worst::of("quantile of Student's t");
    quantile.add_in(student_quantile(1.0), (0.475 * PI).tan(), double(10.0), || "freedom 1".into());
    let q: f64 = 0.95;
    quantile.add_in(student_quantile(2.0), q * (2.0 / (1.0 - q * q)).sqrt(), double(4.0), || "freedom 2".into());
    quantile.finish(16.0);
}
