//! The statistics of the other laws: they raise no more false alarms than they say, whatever the tails of what is estimated,
//! and they find what they say they would find.
//!
//! False-alarm rate of each test: below 10⁻⁴ (binomial bounds of five standard deviations and more).

use crate::support::{Budget, Comparison, Estimate, Family, POWER, builtin, measure_seeded, method};
use sampling::rng::{Stream, mix2};

/// Replicates of an estimate.
const REPLICATES: usize = 256;

/// Uniform, normal, exponential numbers in f64.
struct Chance(Stream);

impl Chance {
    fn new(case: usize) -> Self {
        Self(Stream::new(mix2(7, case as u64), case as u64))
    }

    /// In (0, 1].
    fn uniform(&mut self) -> f64 {
        1.0 - self.0.next_f32() as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
    }

    fn poisson(&mut self, mean: f64) -> usize {
        let (limit, mut product, mut count) = ((-mean).exp(), self.uniform(), 0);
        while product > limit {
            (product, count) = (product * self.uniform(), count + 1);
        }
        count
    }
}

/// The size of a contribution that does arrive.
#[derive(Clone, Copy, Debug)]
enum Size {
    Constant,
    Exponential,
    /// The exponential of a normal number of this standard deviation.
    LogNormal(f64),
    /// Of this index: its third moment is infinite if it is at most 3.
    Pareto(f64),
}

impl Size {
    const ALL: [Size; 5] =
        [Size::Constant, Size::Exponential, Size::LogNormal(1.5), Size::LogNormal(2.0), Size::Pareto(2.5)];

    fn draw(self, chance: &mut Chance) -> f64 {
        match self {
            Size::Constant => 1.0,
            Size::Exponential => -chance.uniform().ln(),
            Size::LogNormal(sigma) => (sigma * chance.normal()).exp(),
            Size::Pareto(index) => chance.uniform().powf(-1.0 / index),
        }
    }

    fn mean(self) -> f64 {
        match self {
            Size::Constant | Size::Exponential => 1.0,
            Size::LogNormal(sigma) => (sigma * sigma / 2.0).exp(),
            Size::Pareto(index) => index / (index - 1.0),
        }
    }

    /// An estimate of 1 that rests on some `contributions`, each of which arrives with a small probability.
    fn estimate(self, contributions: f64, chance: &mut Chance) -> Estimate {
        let per_replicate = contributions / REPLICATES as f64;
        let scale = 1.0 / (per_replicate * self.mean());
        let mut replicate = || {
            let count = chance.poisson(per_replicate);
            (0..count).map(|_| self.draw(chance)).sum::<f64>() * scale
        };
        Estimate::of(&std::array::from_fn::<f64, REPLICATES, _>(|_| replicate()))
    }
}

/// How many of so many comparisons may have a p-value below `level`.
fn most(trials: usize, level: f64) -> usize {
    let expected = trials as f64 * level;
    (expected + 6.0 * expected.sqrt() + 3.0) as usize
}

#[test]
fn p_values_are_not_too_small_however_rare_and_uneven_contributions_are() {
    let (levels, trials) = ([1e-2, 1e-3, 1e-4], 20_000);
    for (case, size) in Size::ALL.into_iter().enumerate() {
        for (contributions, trials) in [(10.0, trials), (100.0, trials), (1000.0, trials / 4)] {
            let mut chance = Chance::new(case);
            let (mut truth, mut pair, mut open) = ([0; 3], [0; 3], 0);
            for _ in 0..trials {
                let estimate = size.estimate(contributions, &mut chance);
                let other = Size::Exponential.estimate(200.0, &mut chance);
                let against_truth = Comparison::new("", estimate, Estimate::exact(1.0));
                open += usize::from(!against_truth.is_conclusive(1e-6));
                let against_other = Comparison::new("", estimate, other).p();
                for (i, level) in levels.into_iter().enumerate() {
                    truth[i] += usize::from(against_truth.p() < level);
                    pair[i] += usize::from(against_other < level);
                }
            }
            println!(
                "{size:?}, {contributions} contributions: of {trials} p-values below {levels:?}: {truth:?} against the truth, \
                 {pair:?} against another estimate; {open} inconclusive"
            );
            for (i, level) in levels.into_iter().enumerate() {
                let (most, counts) = (most(trials, level), [truth[i], pair[i]]);
                assert!(
                    counts.iter().all(|&n| n <= most),
                    "{size:?}, {contributions}, level {level}: {counts:?} of {most}"
                );
            }
        }
    }
}

/// Of 100 families at a false-alarm rate of 10 %, at most 24 may fail, which has a probability of 10⁻⁵.
#[test]
fn families_of_a_scene_fail_as_often_as_they_say() {
    let scene = builtin("cornell_box", 4);
    let failing = (0..100).filter(|&seed| {
        let budget = Budget::samples(4).up_to(4);
        let [path, light] =
            ["path", "light"].map(|name| measure_seeded(&scene, method(name).as_ref(), name, budget, seed));
        let mut family = Family::with_rate(format!("seed {seed}"), 0.1);
        for order in 0..=4 {
            family.spare(format!("order {order}"), path.image(order), light.image(order));
            for (i, block) in path.blocks(4).iter().enumerate() {
                family.spare(format!("order {order} block {i}"), path.over(order, block), light.over(order, block));
            }
        }
        family.significant() > 0
    });
    let failing = failing.count();
    println!("{failing} of 100 families fail");
    assert!(failing <= 24);
}

#[test]
fn a_detectable_bias_is_found() {
    let (level, trials) = (1e-5, 2000);
    for (case, size) in [Size::Constant, Size::Exponential].into_iter().enumerate() {
        let mut chance = Chance::new(100 + case);
        for side in [-1.0, 1.0] {
            let mut found = 0;
            for _ in 0..trials {
                let [a, b] = [20_000.0, 10_000.0].map(|n| size.estimate(n / 4.0, &mut chance));
                let detectable = Comparison::new("", a, b).detectable(level);
                let biased = Estimate { mean: a.mean * (1.0 + side * detectable), ..a };
                found += usize::from(Comparison::new("", biased, b).p() < level);
            }
            println!("{size:?}, side {side}: {found} of {trials} detectable biases found");
            // The skewness that a sample happens to have moves the power by a few percent.
            assert!(found as f64 > trials as f64 * (POWER - 0.1), "{size:?}: {found} of {trials}");
        }
    }
}

/// What a family says of an order that one method loses or gets wrong, in the image and in a block.
#[test]
fn lost_and_wrong_orders_fail_and_unseen_blocks_decide_nothing() {
    let mut chance = Chance::new(200);
    let good = Size::Exponential.estimate(1e4, &mut chance);
    let scaled = |e: Estimate, factor: f64| Estimate { mean: factor * e.mean, error: factor * e.error, ..e };
    let nothing = Estimate::of(&[0.0; REPLICATES]);
    let image = |a, b| {
        let mut family = Family::new("image");
        family.image("order", a, b);
        family.verdict(1.0)
    };
    assert_eq!(image(good, Estimate::exact(good.mean)), Ok(()));
    for wrong in [nothing, scaled(good, 0.5), scaled(good, 2.0), scaled(good, 0.9)] {
        assert!(image(wrong, good).is_err() && image(good, wrong).is_err(), "{wrong:?}");
        assert!(image(wrong, Estimate::exact(good.mean)).is_err(), "{wrong:?}");
    }
    assert!(image(good, Estimate::exact(0.0)).is_err(), "light where there is none");
    let rare = Size::Exponential.estimate(5.0, &mut chance);
    for open in [nothing, rare] {
        let mut family = Family::new("block");
        family.image("image", good, Estimate::exact(good.mean));
        family.block("block", open, good);
        family.block("block", good, Estimate::exact(good.mean));
        assert_eq!(family.verdict(0.5), Ok(()), "{open:?}");
        assert!(family.verdict(0.6).is_err(), "{open:?}");
    }
}
