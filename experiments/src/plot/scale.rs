//! A logarithmic axis: its range, its ticks, and how they are written.

use crate::export::notation::superscript;

/// A logarithmic axis from `low` to `high`, both positive and finite, `low < high`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogScale {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// A place on an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Where.
    pub value: f64,
    /// Whether it has a label.
    pub labelled: bool,
}

/// The most labels that an axis takes.
const MAX_LABELS: i32 = 7;

impl LogScale {
    /// The axis that holds all values that can stand on one, with a margin of a few per cent of its length at both ends;
    /// a decade around a single one. `None` if there is none.
    pub fn around(values: impl Iterator<Item = f64>) -> Option<Self> {
        let mut range: Option<(f64, f64)> = None;
        for v in values.filter(|v| drawable(*v)) {
            range = Some(range.map_or((v, v), |(low, high)| (low.min(v), high.max(v))));
        }
        let (low, high) = range?;
        let decades = (high / low).log10();
        let margin = if decades < 0.3 { 0.5 - decades / 2.0 } else { decades * 0.04 };
        let factor = 10f64.powf(margin);
        Some(Self { low: (low / factor).max(f64::MIN_POSITIVE), high: (high * factor).min(f64::MAX) })
    }

    /// Where a value stands, 0 at the lower end and 1 at the upper; clamped to the axis.
    pub fn position(self, value: f64) -> f64 {
        ((value.max(f64::MIN_POSITIVE).ln() - self.low.ln()) / (self.high.ln() - self.low.ln())).clamp(0.0, 1.0)
    }

    /// The ticks: decades labelled (every few where there are many); between them 2 to 9, of which 2 and 5 are labelled
    /// where an axis is so short that decades alone would leave it bare. No minor ticks beyond 12 decades.
    pub fn ticks(self) -> Vec<Tick> {
        let (first, last) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
        let decades_inside = (first..=last).filter(|&e| self.holds(power(e))).count() as i32;
        let every = ((decades_inside - 1).max(0) / MAX_LABELS + 1).max(1);
        let mut ticks = Vec::new();
        for exponent in first..=last {
            ticks.push(Tick { value: power(exponent), labelled: exponent.rem_euclid(every) == 0 });
            if decades_inside <= 12 {
                let between = |digit: i32| Tick {
                    value: digit as f64 * power(exponent),
                    labelled: decades_inside <= 2 && (digit == 2 || digit == 5),
                };
                ticks.extend((2..=9).map(between));
            }
        }
        ticks.retain(|t| self.holds(t.value));
        ticks
    }

    fn holds(self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

/// Whether a value can stand on a logarithmic axis.
pub fn drawable(value: f64) -> bool {
    value.is_finite() && value >= f64::MIN_POSITIVE
}

fn power(exponent: i32) -> f64 {
    10f64.powi(exponent)
}

/// A tick's value: `0.05`, `20`, `10⁻⁷`, `2·10⁵`.
pub fn label(value: f64) -> String {
    if (0.001..10_000.0).contains(&value) {
        return format!("{}", (value * 1e6).round() / 1e6);
    }
    let exponent = value.log10().floor() as i32;
    let digit = (value / power(exponent)).round();
    let factor = if digit == 1.0 { String::new() } else { format!("{digit}·") };
    format!("{factor}10{}", superscript(exponent as i64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_range_leaves_out_what_has_no_logarithm() {
        let values = [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-320, 0.1, 10.0];
        let scale = LogScale::around(values.into_iter()).unwrap();
        assert!(scale.low > 0.05 && scale.low < 0.1 && scale.high > 10.0 && scale.high < 20.0, "{scale:?}");
        assert_eq!(LogScale::around([0.0, f64::NAN].into_iter()), None);
    }

    #[test]
    fn a_single_value_stands_in_the_middle_of_a_decade() {
        let scale = LogScale::around([3.0].into_iter()).unwrap();
        assert!((scale.high / scale.low - 10.0).abs() < 1e-9 && (scale.position(3.0) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn every_axis_has_some_labels_and_not_too_many() {
        for decades in [0.01, 0.3, 1.0, 2.0, 5.0, 17.0, 300.0, 600.0] {
            for start in [-300.0, -7.5, 0.0, 0.45] {
                let range = [start, start + decades].map(|e: f64| 10f64.powf(e.min(307.0)));
                let scale = LogScale::around(range.into_iter()).unwrap();
                let labels = scale.ticks().iter().filter(|t| t.labelled).count();
                assert!((1..=9).contains(&labels), "{labels} labels for {decades} decades from 10^{start}");
            }
        }
    }

    #[test]
    fn ticks_are_written_shortly() {
        let written = [1.0, 0.05, 2000.0, 1e-7, 2e5, 1e4].map(label);
        assert_eq!(written, ["1", "0.05", "2000", "10⁻⁷", "2·10⁵", "10⁴"]);
    }
}
