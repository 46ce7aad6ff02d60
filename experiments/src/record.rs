//! `records.csv` and `records.jsonl`, one row a measurement.
//!
//! The columns of the records: `experiment`, `scene`; `method`, the label, and `setting`, what differs from the method's
//! defaults; `sampler`; `order`, a number, `tail`, `total`, or the name of a
//! layer that the image was taken apart into (empty where it makes no sense); `spp`, samples per pixel over all
//! `replicates`; `seconds`, wall time of those samples; `quantity`; `channel`, one of `r`, `g`, `b`, or `all` for their mean;
//! `value`; and `ci_low`, `ci_high`, the ends of a 95 % interval where one is known.
//!
//! | quantity | value |
//! |---|---|
//! | `mean` | image mean \[W/(m²·sr)\] |
//! | `variance` | image mean of the variance of one sample: that of a replicate times its samples |
//! | `gain`, `gain_predicted`, `gain_with_pilots` | efficiency of a composite on the sum of all orders over that of the best other method, measured, as its pilots predicted, and measured with their time |
//! | `chosen:METHOD` | a composite leaves the row's order to this method, which takes this part of its time |
//! | `covariance:J` | image mean of the covariance of one sample between this row's order and order J ≥ it |
//! | `efficiency` | 1 / (variance of a replicate · its seconds) |
//! | `mse`, `bias2`, `relmse`, `smape`, `flip` | against the scene's reference: errors of a replicate, and what of `mse` no samples remove |
//! | `bias2_p` | the p-value of the test that there is no bias, not corrected for the number of tests |
//! | `time_to_error:E` | seconds to the relative mean squared error E, infinite where the bias forbids it |
//! | `marginal_seconds`, `marginal_efficiency` | what an order adds to a replicate's time, and 1 / (variance of a replicate · that) |
//! | `reference_noise` | of the reference: root of the mean variance over the mean |
//! | `sequential_error` | the largest relative error that the mean may have, at whatever time one looks |
//! | `sequential_bias` | of two methods: the relative bias that would have been found nine times out of ten, likewise |
//! | `checkpoint_variance` | image mean of the variance of a replicate of spp / replicates samples |
//! | `checkpoint_mean` | image mean of those replicates \[W/(m²·sr)\], which tells a bias that falls with their samples |
//! | `slope`, `slope_seconds` | of log `checkpoint_variance` against log samples, and log seconds; of an integral, of log `mse` |
//! | `rmse_ratio` | root mean squared error over that of the same method with the experiment's first sampler |
//! | `mse` | also of an integral of known value, whose name stands for the scene: mean squared error of spp / replicates samples |
//! | `exact`, `integral_p` | its value; the p-value of the test that the mean of `spp` samples is that |
//! | `rays_closest`, `rays_shadow`, `camera_paths`, `light_paths`, `connections`, `bsdf_samples`, `invalid` | counts |
//! | `seconds` | wall time of transport \[s\] |
//! | `agreement_t`, `agreement_p`, `agreement_detectable_bias` | two methods and samplers, `A vs B`, compared by their image means |
//! | `kurtosis`, `tail_index`, `top_share` | of what single samples bring: kurtosis, Hill's index of the tail (the variance is infinite for 2 and less; it may be `inf` itself if all of it is one value), the part of the mean square that the largest 0.01 % hold |
//! | `largest` | the largest single contribution, mean of channels \[W/(m²·sr)\] |
//! | `agreement_blocks`, `agreement_rejected`, `agreement_smallest_p` | and by their blocks: tested, different, adjusted p |

use crate::error::Error;
use crate::export::write_atomically;
use crate::result::{Checkpoint, ExperimentResult, MethodResult};
use crate::statistics::means::student_quantile;
use integrators::{Layer, Part, Quantity};
use serde::Serialize;
use std::path::Path;

pub mod judged;
mod samplers;

/// Of which part of all samples `top_share` is.
const TOP: f64 = 1e-4;

/// A row of the records.
#[derive(Clone, Debug, Serialize)]
struct Record<'a> {
    experiment: &'a str,
    scene: &'a str,
    method: &'a str,
    setting: &'a str,
    sampler: &'a str,
    order: String,
    spp: u64,
    replicates: u32,
    seconds: f64,
    quantity: &'a str,
    channel: &'a str,
    value: f64,
    ci_low: Option<f64>,
    ci_high: Option<f64>,
}

impl<'a> Record<'a> {
    /// A row about a scene that says nothing yet.
    fn blank(experiment: &'a str, scene: &'a str, method: &'a str) -> Self {
        Self {
            experiment,
            scene,
            method,
            setting: "",
            sampler: "",
            order: String::new(),
            spp: 0,
            replicates: 0,
            seconds: 0.0,
            quantity: "",
            channel: "all",
            value: 0.0,
            ci_low: None,
            ci_high: None,
        }
    }

    /// The same row about these checkpoints together: what was spent on them.
    fn over<'p>(&self, points: impl IntoIterator<Item = &'p Checkpoint>) -> Self {
        let mut row = Self { spp: 0, replicates: 0, seconds: 0.0, ..self.clone() };
        for point in points {
            row.spp += u64::from(point.samples) * u64::from(point.replicates);
            row.replicates += point.replicates;
            row.seconds += point.seconds * f64::from(point.replicates);
        }
        row
    }
}

/// Writes all records into a folder: as a table, and as lines of JSON.
///
/// # Errors
/// If a file cannot be written.
pub fn write_records(folder: &Path, result: &ExperimentResult) -> Result<(), Error> {
    let mut table = Table { writer: csv::Writer::from_writer(Vec::new()), lines: Vec::new(), failure: None };
    for method in &result.methods {
        let sampler = method.sampler.to_string();
        let blank = Record {
            setting: &method.setting,
            sampler: &sampler,
            spp: method.measurement.samples(),
            replicates: method.measurement.replicates,
            seconds: method.measurement.seconds(),
            ..Record::blank(&result.name, &method.scene, &method.entry)
        };
        table.add_moments(&blank, method);
        table.add_parts(&blank, method);
        table.add_covariances(&blank, method);
        table.add_judged(&blank, method, result);
        table.add_marginal(&blank, method);
        table.add_choices(&blank, method, result);
        table.add_counters(&blank, method);
        table.add_convergence(&blank, method, result);
        table.add_ratios(&blank, method, result);
    }
    table.add_references(result);
    table.add_sequences(result);
    table.add_agreement(result);
    table.add_integrals(result);
    let lines = std::mem::take(&mut table.lines);
    let path = folder.join("records.csv");
    let bytes = table.finish().map_err(|e| Error::usage(format!("{}: {e}", path.display())))?;
    write_atomically(&path, &bytes)?;
    Ok(write_atomically(&folder.join("records.jsonl"), &lines)?)
}

/// The order as a record has it; `None` is the sum of all.
fn order_name(order: Option<Layer>) -> String {
    order.map_or("total".to_owned(), Layer::label)
}

/// A mean's 95 % interval from its standard error over so many replicates.
fn t_interval(mean: f64, error: f64, replicates: u32) -> (f64, f64) {
    let t = student_quantile(f64::from(replicates) - 1.0);
    (mean - t * error, mean + t * error)
}

/// The records written so far.
struct Table {
    writer: csv::Writer<Vec<u8>>,
    /// The same as lines of JSON, what is not finite being `null`.
    lines: Vec<u8>,
    failure: Option<csv::Error>,
}

impl Table {
    fn add(&mut self, record: Record) {
        self.lines.extend(serde_json::to_vec(&record).unwrap_or_default());
        self.lines.push(b'\n');
        if let Err(e) = self.writer.serialize(record) {
            self.failure.get_or_insert(e);
        }
    }

    fn finish(self) -> Result<Vec<u8>, String> {
        match self.failure {
            Some(e) => Err(e.to_string()),
            None => self.writer.into_inner().map_err(|e| e.to_string()),
        }
    }

    /// One row for each channel, and one for their mean, whose interval may be known.
    fn add_channels(&mut self, blank: &Record, value: [f64; 3], ci: Option<(f64, f64)>) {
        for (channel, value) in ["r", "g", "b"].into_iter().zip(value) {
            self.add(Record { channel, value, ..blank.clone() });
        }
        let (ci_low, ci_high) = (ci.map(|ci| ci.0), ci.map(|ci| ci.1));
        self.add(Record { value: value.iter().sum::<f64>() / 3.0, ci_low, ci_high, ..blank.clone() });
    }

    fn add_moments(&mut self, blank: &Record, method: &MethodResult) {
        let m = &method.measurement;
        let seconds = m.seconds() / f64::from(m.replicates);
        let layers = (0..m.layers.len()).map(Some).chain([None]);
        for layer in layers {
            let order = order_name(layer.map(|i| m.layers[i]));
            let (mean, error, variance) = match layer {
                Some(i) => (m.image_mean(i), m.image_mean_error(i), m.image_variance(i)),
                None => (m.total_image_mean(), m.total_image_mean_error(), m.total_variance),
            };
            let row = Record { order, ..blank.clone() };
            for (c, channel) in ["r", "g", "b"].into_iter().enumerate() {
                let ci = error.map(|error| t_interval(mean[c], error[c], m.replicates));
                let (ci_low, ci_high) = (ci.map(|ci| ci.0), ci.map(|ci| ci.1));
                self.add(Record { quantity: "mean", channel, value: mean[c], ci_low, ci_high, ..row.clone() });
            }
            if let Some(variance) = variance {
                let n = f64::from(m.samples_per_replicate);
                let place = layer.unwrap_or(m.layers.len());
                let known = method.intervals.as_ref();
                let ci = known.and_then(|known| known.variance[place].interval).map(|(low, high)| (low * n, high * n));
                self.add_channels(&Record { quantity: "variance", ..row.clone() }, variance.map(|v| v * n), ci);
                let value = 3.0 / (variance.iter().sum::<f64>() * seconds);
                let ci = known.and_then(|known| known.efficiency[place].interval);
                let (ci_low, ci_high) = (ci.map(|ci| ci.0), ci.map(|ci| ci.1));
                self.add(Record { quantity: "efficiency", value, ci_low, ci_high, ..row });
            }
        }
    }

    /// The means and variances of what the image was taken apart into, the layer's name standing for the order.
    fn add_parts(&mut self, blank: &Record, method: &MethodResult) {
        let m = &method.measurement;
        let is_light = |part: &Part| !matches!(part, Part::Strategy { quantity: Quantity::Weights, .. });
        for (i, part) in m.parts().filter(|(_, part)| is_light(part)) {
            let row = Record { order: part.name(m.max_order), ..blank.clone() };
            let (mean, error) = (m.image_mean(i), m.image_mean_error(i));
            for (c, channel) in ["r", "g", "b"].into_iter().enumerate() {
                let ci = error.map(|error| t_interval(mean[c], error[c], m.replicates));
                let (ci_low, ci_high) = (ci.map(|ci| ci.0), ci.map(|ci| ci.1));
                self.add(Record { quantity: "mean", channel, value: mean[c], ci_low, ci_high, ..row.clone() });
            }
            if let Some(variance) = m.image_variance(i) {
                let of_sample = variance.map(|v| v * f64::from(m.samples_per_replicate));
                self.add_channels(&Record { quantity: "variance", ..row }, of_sample, None);
            }
        }
    }

    fn add_covariances(&mut self, blank: &Record, method: &MethodResult) {
        let m = &method.measurement;
        let layers = m.layers.len();
        if m.covariance.is_empty() {
            return;
        }
        for (i, j) in (0..layers).flat_map(|i| (i + 1..layers).map(move |j| (i, j))) {
            let quantity = format!("covariance:{}", m.layers[j].label());
            let n = f64::from(m.samples_per_replicate);
            let value = m.covariance[i * layers + j].iter().sum::<f64>() / 3.0 * n;
            let ci = method.intervals.as_ref().and_then(|known| known.covariance[j * (j + 1) / 2 + i].interval);
            let (ci_low, ci_high) = (ci.map(|ci| ci.0 * n), ci.map(|ci| ci.1 * n));
            self.add(Record {
                order: m.layers[i].label(),
                quantity: &quantity,
                value,
                ci_low,
                ci_high,
                ..blank.clone()
            });
        }
    }

    fn add_counters(&mut self, blank: &Record, method: &MethodResult) {
        let c = method.measurement.counters;
        let counts = [
            ("rays_closest", c.closest),
            ("rays_shadow", c.shadow),
            ("camera_paths", c.camera_paths),
            ("light_paths", c.light_paths),
            ("connections", c.connections),
            ("bsdf_samples", c.bsdf_samples),
        ];
        for (quantity, count) in counts {
            self.add(Record { quantity, value: count as f64, ..blank.clone() });
        }
        for (layer, &count) in method.measurement.layers.iter().zip(&method.measurement.invalid) {
            self.add(Record { order: layer.label(), quantity: "invalid", value: count as f64, ..blank.clone() });
        }
        for (layer, found) in method.measurement.layers.iter().zip(method.measurement.fireflies.layers()) {
            if let Some(largest) = found.first() {
                let value = f64::from(largest.size());
                self.add(Record { order: layer.label(), quantity: "largest", value, ..blank.clone() });
            }
        }
        let m = &method.measurement;
        let series = m.layers.iter().map(|layer| Some(layer.label()));
        let raw = |part: &Part| matches!(part, Part::Strategy { quantity: Quantity::Raw, .. });
        let parts = m.parts.iter().map(|part| raw(part).then(|| part.name(m.max_order)));
        for (name, tail) in series.chain(parts).zip(m.fireflies.tails()) {
            let Some(order) = name else { continue };
            let index = tail.index().map(|(index, _)| index);
            let numbers =
                [("kurtosis", tail.kurtosis()), ("top_share", tail.second_moment_of_top(TOP)), ("tail_index", index)];
            for (quantity, value) in numbers {
                if let Some(value) = value {
                    self.add(Record { order: order.clone(), quantity, value, ..blank.clone() });
                }
            }
        }
        self.add(Record { quantity: "seconds", value: method.measurement.seconds(), ..blank.clone() });
    }

    fn add_convergence(&mut self, blank: &Record, method: &MethodResult, result: &ExperimentResult) {
        for point in &method.convergence {
            self.add(Record {
                order: order_name(point.order),
                quantity: "checkpoint_mean",
                value: point.mean,
                ..blank.over([point])
            });
            self.add(Record {
                order: order_name(point.order),
                quantity: "checkpoint_variance",
                value: point.variance,
                ci_low: Some(point.ci.0),
                ci_high: Some(point.ci.1),
                ..blank.over([point])
            });
        }
        let mine = |row: &&crate::result::SlopeRow| row.scene == method.scene && row.label == method.label;
        for row in result.slopes.iter().filter(mine) {
            let points = method.convergence.iter().filter(|p| p.order == row.order);
            let (ci_low, ci_high) = (Some(row.ci.0), Some(row.ci.1));
            let order = order_name(row.order);
            let (quantity, value) = ("slope", row.slope);
            let on_samples = Record { order, quantity, value, ci_low, ci_high, ..blank.over(points) };
            if let Some(line) = &row.on_seconds {
                let (ci_low, ci_high) = (Some(line.ci.0), Some(line.ci.1));
                let (quantity, value) = ("slope_seconds", line.slope);
                self.add(Record { quantity, value, ci_low, ci_high, ..on_samples.clone() });
            }
            self.add(on_samples);
        }
    }

    fn add_agreement(&mut self, result: &ExperimentResult) {
        for row in &result.agreement {
            let of = |label: &str| result.methods.iter().find(|m| m.scene == row.scene && m.label == label);
            let (Some(a), Some(b)) = (of(&row.a), of(&row.b)) else { continue };
            let pair = format!("{} vs {}", a.entry, b.entry);
            let samplers = match a.sampler == b.sampler {
                true => a.sampler.to_string(),
                false => format!("{} vs {}", a.sampler, b.sampler),
            };
            let blank = Record {
                setting: row.verdict.name(),
                sampler: &samplers,
                order: row.order.label(),
                spp: a.measurement.samples() + b.measurement.samples(),
                replicates: a.measurement.replicates + b.measurement.replicates,
                seconds: a.measurement.seconds() + b.measurement.seconds(),
                ..Record::blank(&result.name, &row.scene, &pair)
            };
            for (quantity, value) in [
                ("agreement_t", row.t),
                ("agreement_p", row.p),
                ("agreement_blocks", row.blocks as f64),
                ("agreement_rejected", row.rejected as f64),
                ("agreement_smallest_p", row.smallest_adjusted_p),
                ("agreement_detectable_bias", row.detectable_bias),
            ] {
                self.add(Record { quantity, value, ..blank.clone() });
            }
        }
    }
}
