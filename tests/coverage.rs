//! Intervals hold: in experiments whose truth is known, 95 % of them cover it, with 8, 16 and 32 replicates; what is looked at
//! after every replicate misses as rarely as it says; what is called detectable is detected.
//!
//! Every quantity of every kind of experiment is a check: a binomial test of the number of intervals that cover the truth against
//! 95 %, one-sided, since an interval may be too wide where its documentation says so. False-alarm rate of each test of this
//! file: 0.1 %, by Šidák's correction over its checks. There are 2000 experiments at night, fewer every day; what passes then
//! has a coverage of at least 93 %. The table is printed, and is in `docs/statistics.md`.

mod scene;
mod sequential;
mod synthetic;

use crate::support::is_night;
use neumann::statistics::multiple::sidak_level;
use neumann::statistics::{COVERAGE, Estimate};
use statrs::distribution::{Binomial, DiscreteCDF};
use std::collections::BTreeMap;
use std::fmt;

/// Replicates of the experiments.
const REPLICATES: [usize; 3] = [8, 16, 32];

/// The probability with which the checks of a test raise a false alarm.
const FALSE_ALARM_RATE: f64 = 1e-3;

/// How many experiments are made: so many every day, 2000 at night.
fn experiments(by_day: usize) -> usize {
    if is_night() { 2000 } else { by_day }
}

/// What is checked: the quantity, the kind of experiment, the replicates.
type Key = (String, String, usize);

/// How often intervals cover.
#[derive(Clone, Copy, Default)]
struct Count {
    hits: usize,
    runs: usize,
    /// The truth lies below, above.
    missed: [usize; 2],
    /// Sum of the intervals' widths, in parts of the truth.
    width: f64,
}

/// Counts of all checks.
#[derive(Default)]
struct Table(BTreeMap<Key, Count>);

impl Table {
    fn entry(&mut self, quantity: &str, kind: &str, replicates: usize) -> &mut Count {
        self.0.entry((quantity.to_owned(), kind.to_owned(), replicates)).or_default()
    }

    /// Adds a p-value where the null hypothesis is true. One that is not there, although there are enough replicates, rejects it.
    fn add_p_value(&mut self, quantity: &str, kind: &str, replicates: usize, p: Option<f64>) {
        let count = self.entry(quantity, kind, replicates);
        count.runs += 1;
        count.hits += usize::from(p.is_some_and(|p| p > 1.0 - COVERAGE));
        count.width = f64::NAN;
    }

    /// Adds an interval. One that is not there, although there are enough replicates, covers nothing.
    fn add(&mut self, quantity: &str, kind: &str, estimate: Estimate, truth: f64) {
        let count = self.entry(quantity, kind, estimate.replicates);
        let (low, high) = estimate.interval.unwrap_or((f64::NAN, f64::NAN));
        count.runs += 1;
        count.hits += usize::from(low <= truth && truth <= high);
        count.missed[0] += usize::from(truth < low);
        count.missed[1] += usize::from(truth > high);
        count.width += (high - low) / truth.abs();
    }

    fn merge(mut self, other: Self) -> Self {
        for (key, count) in other.0 {
            let sum = self.0.entry(key).or_default();
            sum.hits += count.hits;
            sum.runs += count.runs;
            (0..2).for_each(|side| sum.missed[side] += count.missed[side]);
            sum.width += count.width;
        }
        self
    }

    /// Prints the table, and fails if a coverage is too low.
    fn finish(&self) {
        println!("{self}");
        let level = sidak_level(FALSE_ALARM_RATE, self.0.len());
        let low = self.0.iter().filter(|(_, count)| count.p_value() < level);
        let low: Vec<String> =
            low.map(|(key, count)| format!("\n  {key:?}: {count}, p = {:.1e}", count.p_value())).collect();
        assert!(
            low.is_empty(),
            "of {} checks at level {level:.1e}, too few intervals cover:{}",
            self.0.len(),
            low.concat()
        );
    }
}

impl Count {
    /// The probability that so few of the intervals cover, if 95 % should.
    fn p_value(&self) -> f64 {
        Binomial::new(COVERAGE, self.runs as u64).unwrap().cdf(self.hits as u64)
    }

    fn share(&self) -> f64 {
        self.hits as f64 / self.runs as f64
    }
}

impl fmt::Display for Count {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let error = 1.96 * (self.share() * (1.0 - self.share()) / self.runs as f64).sqrt();
        write!(f, "{:.1} ± {:.1}", 100.0 * self.share(), 100.0 * error)
    }
}

impl fmt::Display for Table {
    /// A row for each quantity and kind, a column for each number of replicates.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let runs = self.0.values().map(|count| count.runs).max().unwrap_or(0);
        writeln!(
            f,
            "Coverage [%] over {runs} experiments:\n| quantity | experiment | 8 | 16 | 32 | missed below, above at 8 | width at 8, 32 |"
        )?;
        writeln!(f, "|---|---|---|---|---|---|---|")?;
        let rows: std::collections::BTreeSet<(&String, &String)> = self.0.keys().map(|(q, k, _)| (q, k)).collect();
        for (quantity, kind) in rows {
            let of = |n: usize| self.0.get(&(quantity.clone(), kind.clone(), n)).copied().unwrap_or_default();
            let counts = REPLICATES.map(of);
            let cells = counts.map(|c| if c.runs == 0 { "–".to_owned() } else { c.to_string() }).join(" | ");
            let missed =
                counts[0].missed.map(|n| format!("{:.1}", 100.0 * n as f64 / counts[0].runs as f64)).join(", ");
            let width = |c: Count| {
                Some(c.width / c.runs as f64).filter(|w| w.is_finite()).map_or("–".to_owned(), |w| format!("{w:.2}"))
            };
            let widths = [counts[0], counts[2]].map(width).join(", ");
            writeln!(f, "| {quantity} | {kind} | {cells} | {missed} | {widths} |")?;
        }
        Ok(())
    }
}
