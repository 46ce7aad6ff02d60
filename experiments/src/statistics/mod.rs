//! The statistics of an experiment: pure functions of numbers, each with the conditions under which it holds.
//!
//! In reading order:
//!
//! - [`Estimate`]: a number with its interval; [`bootstrap`]: resampling by seeded streams;
//! - [`means`]: Student's interval, and one for skewed values; [`positive`]: variances, ratios and efficiencies, on a logarithmic
//!   scale; [`slopes`]: lines through them, and the time to a given error;
//! - [`covariances`]: between orders; [`groups`]: of replicates, as that on which intervals rest; [`errors`]: MSE, relative MSE and SMAPE against a noisy reference, streamed replicate by replicate;
//!   [`bias`]: bias² apart from variance; [`time`]: the seconds to a given error, or never;
//! - [`welch`]: do two means differ, and what difference would have been found; [`multiple`]: many tests at once;
//!   [`uniformity`]: are p-values uniform; [`sequential`]: intervals that may be looked at after every replicate;
//! - [`series`]: how the orders of a series fall, and what is left beyond the last;
//! - [`flip`]: how different two images look.
//!
//! What every interval assumes, its source and its measured coverage are in `docs/statistics.md`; `tests/coverage.rs` measures it.

pub mod bias;
pub mod bootstrap;
pub mod covariances;
pub mod errors;
pub mod flip;
pub mod groups;
pub mod means;
pub mod multiple;
pub mod positive;
pub mod sequential;
pub mod series;
pub mod slopes;
pub mod time;
pub mod uniformity;
pub mod welch;

/// Coverage of every interval.
pub const COVERAGE: f64 = 0.95;

/// Both ends of an interval.
pub type Interval = (f64, f64);

/// A number with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its 95 % interval; `None` for fewer replicates than it holds for, or where nothing bounds the number.
    pub interval: Option<Interval>,
    /// The independent replicates that it rests on.
    pub replicates: usize,
    /// The number of replicates from which on the interval has the coverage that it states, as `tests/coverage.rs` measures it.
    pub valid_from: usize,
}

impl Estimate {
    /// An estimate whose interval is kept only if there are enough replicates for it.
    pub fn new(value: f64, interval: Option<Interval>, replicates: usize, valid_from: usize) -> Self {
        let finite = interval.filter(|(low, high)| low.is_finite() && high.is_finite());
        Self { value, interval: finite.filter(|_| replicates >= valid_from), replicates, valid_from }
    }
}
