//! What is looked at after every replicate errs as rarely as it says, and finds what it calls detectable.

use super::experiments;
use super::synthetic::Chance;
use neumann::statistics::means::student;
use neumann::statistics::sequential::ConfidenceSequence;
use neumann::statistics::welch::POWER;
use rayon::prelude::*;
use sampling::moments::Moments;
use statrs::distribution::{Binomial, DiscreteCDF};

/// Replicates after which an experiment ends.
const MOST: usize = 256;
/// The fewest after which anybody looks.
const LEAST: usize = 4;

/// How the image means of replicates are distributed about a mean of 1.
#[derive(Clone, Copy, Debug)]
enum Law {
    Normal(f64),
    Lognormal(f64),
}

impl Law {
    const ALL: [Law; 3] = [Law::Normal(0.1), Law::Lognormal(0.1), Law::Lognormal(0.2)];

    fn draw(self, chance: &mut Chance) -> f64 {
        match self {
            Law::Normal(deviation) => 1.0 + deviation * chance.normal(),
            Law::Lognormal(sigma) => (sigma * chance.normal() - sigma * sigma / 2.0).exp(),
        }
    }
}

/// How many of the experiments hold. Each is given a value of the law at will.
fn count(runs: usize, kind: u64, law: Law, experiment: impl Fn(&mut dyn FnMut() -> f64) -> bool + Sync) -> usize {
    let holds = |run: &usize| {
        let mut chance = Chance::new(*run, kind);
        experiment(&mut || law.draw(&mut chance))
    };
    (0..runs).into_par_iter().filter(holds).count()
}

/// Fails if so many of the runs have a probability below 10⁻⁴ where each has at most the probability p.
fn assert_at_most(what: &str, found: usize, runs: usize, p: f64) {
    println!("{what}: {found} of {runs}, at most {:.1} % promised", 100.0 * p);
    let tail = Binomial::new(p, runs as u64).unwrap().sf(found.saturating_sub(1) as u64);
    assert!(found == 0 || tail > 1e-4, "{what}: {found} of {runs}, where {p} is promised: p = {tail:.1e}");
}

/// Of 95 % intervals that are looked at 253 times, those of Student miss the truth in far more than 5 % of experiments.
#[test]
fn peeking_after_every_replicate_keeps_the_error_rate() {
    let runs = experiments(500);
    let sequence = ConfidenceSequence::default();
    for law in Law::ALL {
        let misses = |reach: &(dyn Fn(&Moments) -> f64 + Sync)| {
            count(runs, 1, law, |draw| {
                let mut seen = Moments::default();
                (0..MOST).any(|_| {
                    seen.push(draw());
                    seen.n >= LEAST as u64 && (seen.mean - 1.0).abs() > reach(&seen)
                })
            })
        };
        let naive = misses(&|seen| student(seen).map_or(f64::INFINITY, |(_, high)| high - seen.mean));
        assert_at_most(
            &format!("{law:?}: sequences that miss the mean"),
            misses(&|seen| sequence.reach(seen)),
            runs,
            sequence.alpha,
        );
        println!("{law:?}: Student's intervals, looked at as often: {naive} of {runs}");
        assert!(naive * 4 > runs, "peeking does no harm? {naive} of {runs}");
    }
}

/// To stop at a relative error leaves an error above it at most as often as is said.
#[test]
fn a_render_that_stops_at_a_relative_error_has_it() {
    let runs = experiments(500);
    let sequence = ConfidenceSequence::default();
    for (law, target) in Law::ALL.into_iter().flat_map(|law| [0.1, 0.05].map(|target| (law, target))) {
        let wrong = count(runs, 2, law, |draw| {
            let mut seen = Moments::default();
            while seen.n < 10_000 && sequence.relative_error(&seen) > target {
                seen.push(draw());
            }
            (seen.mean - 1.0).abs() > target
        });
        assert_at_most(&format!("{law:?}: relative errors above {target}"), wrong, runs, sequence.alpha);
    }
}

/// Two methods take turns until a bias is detectable. One of that size is found with the promised power, and none where there is
/// none.
#[test]
fn a_comparison_that_stops_at_a_detectable_bias_finds_it() {
    let runs = experiments(500);
    let sequence = ConfidenceSequence::default();
    for (law, target) in Law::ALL.into_iter().flat_map(|law| [0.1, 0.05].map(|target| (law, target))) {
        let found = |bias: f64| {
            count(runs, 3, law, |draw| {
                let mut seen = Moments::default();
                while seen.n < 10_000 && sequence.detectable_bias(&seen) > target {
                    let (a, b) = (draw(), draw());
                    seen.push(a * (1.0 + bias) - b);
                    if sequence.differ(&seen) {
                        return true;
                    }
                }
                false
            })
        };
        assert_at_most(&format!("{law:?}: false alarms at {target}"), found(0.0), runs, sequence.alpha);
        let missed = runs - found(target);
        assert_at_most(&format!("{law:?}: biases of {target} missed"), missed, runs, 1.0 - POWER);
    }
}
