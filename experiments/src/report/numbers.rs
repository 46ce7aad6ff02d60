//! The numbers that plots, tables and sentences share, and how numbers are written.

use crate::export::notation::superscript;
use crate::export::png::columns;
use crate::path_class::carries;
use crate::record::judged::layers;
use crate::result::MethodResult;
use crate::statistics::Interval;
use integrators::{Bias, Layer, Measurement};

/// Variation below this part of the mean is rounding of `f32`, not variance.
const ROUNDING: f64 = 1e-6;
/// What one method found for one layer, or for the sum of all; channels are averaged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Image mean.
    pub mean: f64,
    /// Its standard error across replicates; `None` for a single replicate.
    pub error: Option<f64>,
    /// Image mean of the variance of one sample; `None` for a single replicate.
    pub variance: Option<f64>,
    /// One over (variance of a replicate × its seconds), the seconds being those of all orders together [1/s]; `None` where
    /// nothing but rounding varies, or there is no light.
    pub efficiency: Option<f64>,
    /// 95 % intervals of variance and efficiency, from as many replicates on as they hold for.
    pub intervals: [Option<Interval>; 2],
    /// Whether nothing but rounding varies.
    pub exact: bool,
    /// Whether the method carries all of this layer's light, as far as can be told.
    pub complete: bool,
}

impl Row {
    /// Whether the method found any light here.
    pub fn is_lit(&self) -> bool {
        self.mean != 0.0
    }
}

/// All rows of one scene.
#[derive(Clone, Debug)]
pub struct Numbers {
    /// What the columns show: the layers in rising order, then `None` for their sum.
    pub columns: Vec<Option<Layer>>,
    /// `[method][column]`; `None` where a method wasn't asked for that layer.
    pub rows: Vec<Vec<Option<Row>>>,
}

impl Numbers {
    /// The numbers of one scene's methods.
    pub fn of(methods: &[&MethodResult]) -> Self {
        let measurements: Vec<&Measurement> = methods.iter().map(|m| &m.measurement).collect();
        let columns = columns(&measurements);
        let row = |m: &&MethodResult| columns.iter().map(|&c| row(&m.measurement, c)).collect();
        let mut rows: Vec<Vec<Option<Row>>> = methods.iter().map(row).collect();
        for (method, rows) in methods.iter().zip(&mut rows) {
            for (&column, row) in columns.iter().zip(rows) {
                let carried =
                    carries(&method.missing_light, column, method.measurement.max_order) && method.bias == Bias::None;
                row.iter_mut().for_each(|row| {
                    row.complete &= carried;
                    row.intervals = intervals(method, column).unwrap_or_default();
                });
            }
        }
        Self { columns, rows }
    }

    /// The methods that carry all of a column's light, the most efficient first; infinitely so where there is no variance.
    pub fn ranking(&self, column: usize) -> Vec<(usize, f64)> {
        let rows = self.rows.iter().enumerate().filter_map(|(i, rows)| Some((i, rows[column]?)));
        let efficiency = |row: Row| if row.exact { Some(f64::INFINITY) } else { row.efficiency };
        let mut ranking: Vec<(usize, f64)> =
            rows.filter(|(_, row)| row.complete).filter_map(|(i, row)| Some((i, efficiency(row)?))).collect();
        ranking.sort_by(|a, b| b.1.total_cmp(&a.1));
        ranking
    }
}

/// The intervals of the variance of one sample and of the efficiency.
fn intervals(method: &MethodResult, column: Option<Layer>) -> Option<[Option<Interval>; 2]> {
    let known = method.intervals.as_ref()?;
    let (i, _) = layers(method).find(|(_, layer)| *layer == column)?;
    let n = f64::from(method.measurement.samples_per_replicate);
    let variance = known.variance[i].interval.map(|(low, high)| (low * n, high * n));
    Some([variance, known.efficiency[i].interval])
}

fn row(measurement: &Measurement, column: Option<Layer>) -> Option<Row> {
    let (mean, variance, means): (_, _, Vec<f64>) = match column {
        None => {
            let total = |layers: &Vec<[f64; 3]>| layers.iter().map(|&m| average(m)).sum();
            let means = measurement.replicate_means.iter().map(total).collect();
            (measurement.total_image_mean(), measurement.total_variance, means)
        }
        Some(layer) => {
            let index = measurement.layers.iter().position(|&l| l == layer)?;
            let means = measurement.replicate_means.iter().map(|layers| average(layers[index])).collect();
            (measurement.image_mean(index), measurement.image_variance(index), means)
        }
    };
    let mean = average(mean);
    // Of one replicate.
    let variance = variance.map(average);
    let exact = mean != 0.0 && variance.is_some_and(|v| v <= (ROUNDING * mean).powi(2));
    let seconds = measurement.seconds() / f64::from(measurement.replicates);
    Some(Row {
        mean,
        error: standard_error(&means),
        variance: variance.map(|v| v * f64::from(measurement.samples_per_replicate)),
        efficiency: variance.filter(|_| !exact).map(|v| 1.0 / (v * seconds)).filter(|e| e.is_finite()),
        intervals: [None; 2],
        exact,
        complete: mean != 0.0,
    })
}

fn average(channels: [f64; 3]) -> f64 {
    channels.iter().sum::<f64>() / 3.0
}

fn standard_error(values: &[f64]) -> Option<f64> {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (values.len() >= 2).then(|| (squares / (n - 1.0) / n).sqrt())
}

/// Three significant digits: `0.0123`, `456`, `1.23·10⁻⁷`; `—` for what is no number.
pub fn short(x: f64) -> String {
    if !x.is_finite() {
        return "—".to_owned();
    }
    if x == 0.0 {
        return "0".to_owned();
    }
    let exponent = x.abs().log10().floor() as i32;
    if (-3..5).contains(&exponent) {
        // Beyond three digits before the point, the rest are zeros.
        let unit = 10f64.powi(exponent - 2);
        let rounded = if exponent > 2 { (x / unit).round() * unit } else { x };
        return format!("{:.*}", (2 - exponent).max(0) as usize, rounded).replace('-', "−");
    }
    let mantissa = format!("{:.2}", x / 10f64.powi(exponent)).replace('-', "−");
    format!("{mantissa}·10{}", superscript(exponent.into()))
}

/// A value and its standard error, to two digits of the latter: `0.2143 ± 0.0012`, `(1.234 ± 0.012)·10⁻⁶`.
pub fn with_error(value: f64, error: Option<f64>) -> String {
    let Some(error) = error.filter(|e| e.is_finite() && *e > 0.0 && value.is_finite()) else { return short(value) };
    let exponent = value.abs().max(error).log10().floor() as i32;
    let scale = if (-3..5).contains(&exponent) { 0 } else { exponent };
    let (value, error) = (value / 10f64.powi(scale), error / 10f64.powi(scale));
    let digits = (1 - error.log10().floor() as i32).clamp(0, 9) as usize;
    let both = format!("{value:.digits$} ± {error:.digits$}").replace('-', "−");
    if scale == 0 { both } else { format!("({both})·10{}", superscript(scale.into())) }
}

/// A share in per cent, to two digits: `0.21 %`, `12 %`.
pub fn percent(share: f64) -> String {
    if !share.is_finite() {
        return "—".to_owned();
    }
    let percent = share * 100.0;
    if percent != 0.0 && percent.abs() < 1e-3 {
        return format!("{} %", short(percent));
    }
    let digits = (1 - percent.abs().max(1e-3).log10().floor() as i32).clamp(0, 4) as usize;
    format!("{percent:.digits$} %").replace('-', "−")
}

/// A factor, to two digits or the nearest whole number: `1.4`, `23`.
pub fn factor(x: f64) -> String {
    if x < 9.95 { format!("{x:.1}") } else { format!("{x:.0}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_to_three_digits() {
        let written = [0.0, 0.012_345, 456.0, 12_345.0, 1.234e-7, -0.5, 9.87e12, f64::NAN].map(short);
        assert_eq!(written, ["0", "0.0123", "456", "12300", "1.23·10⁻⁷", "−0.500", "9.87·10¹²", "—"]);
    }

    #[test]
    fn an_error_says_how_many_digits_its_value_has() {
        assert_eq!(with_error(0.214_31, Some(0.001_23)), "0.2143 ± 0.0012");
        assert_eq!(with_error(1.234e-6, Some(1.2e-8)), "(1.234 ± 0.012)·10⁻⁶");
        assert_eq!(with_error(0.5, None), "0.500");
        assert_eq!(with_error(0.5, Some(0.0)), "0.500");
        assert_eq!(with_error(0.0, Some(0.25)), "0.00 ± 0.25");
    }

    #[test]
    fn shares_and_factors_have_two_digits() {
        assert_eq!([0.0021, 0.123, 1.5, f64::INFINITY].map(percent), ["0.21 %", "12 %", "150 %", "—"]);
        assert_eq!([1.44, 23.4, 1500.0].map(factor), ["1.4", "23", "1500"]);
    }

    #[test]
    fn a_standard_error_needs_two_values() {
        assert_eq!(standard_error(&[1.0]), None);
        assert_eq!(standard_error(&[1.0, 3.0]), Some(1.0));
    }
}
