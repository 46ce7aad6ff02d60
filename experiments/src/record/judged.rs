//! The records of what is judged, and of budgets that are errors.

use super::{Record, Table, order_name};
use crate::config::Metric;
use crate::result::{ChoiceRow, ExperimentResult, Gain, MethodResult, Target};
use crate::statistics::Estimate;
use integrators::Layer;

/// A metric's estimate of a layer.
pub fn estimate(method: &MethodResult, metric: Metric, layer: usize) -> Option<Estimate> {
    let judged = method.judged.as_ref()?;
    let errors = judged.layers.get(layer)?;
    match metric {
        Metric::Mse => Some(errors.mse),
        Metric::Bias2 => Some(errors.bias2),
        Metric::Relmse => Some(errors.relmse),
        Metric::Smape => Some(errors.smape),
        Metric::Flip => judged.flip.get(layer).copied(),
    }
}

/// A method's layers as results have them: one by one, and `None` for their sum.
pub fn layers(method: &MethodResult) -> impl Iterator<Item = (usize, Option<Layer>)> {
    method.measurement.layers.iter().map(|&layer| Some(layer)).chain([None]).enumerate()
}

impl Table {
    /// An estimate with its interval.
    pub(super) fn add_estimate(&mut self, row: Record, estimate: &Estimate) {
        let (ci_low, ci_high) = (estimate.interval.map(|ci| ci.0), estimate.interval.map(|ci| ci.1));
        self.add(Record { value: estimate.value, ci_low, ci_high, ..row });
    }

    /// A method's distances from its reference, and the times to errors.
    pub(super) fn add_judged(&mut self, blank: &Record, method: &MethodResult, result: &ExperimentResult) {
        let Some(judged) = &method.judged else { return };
        let metrics = result.experiment.metrics().unwrap_or_default();
        for (i, layer) in layers(method) {
            let row = Record { order: order_name(layer), ..blank.clone() };
            for (quantity, metric) in Metric::ALL.iter().filter(|(_, metric)| metrics.contains(metric)) {
                if let Some(found) = estimate(method, *metric, i) {
                    self.add_estimate(Record { quantity, ..row.clone() }, &found);
                }
            }
            if let (true, Some(value)) = (metrics.contains(&Metric::Bias2), judged.layers[i].no_bias) {
                self.add(Record { quantity: "bias2_p", value, ..row.clone() });
            }
            for time in &judged.times[i] {
                let quantity = format!("time_to_error:{}", time.target);
                let (ci_low, ci_high) = (time.interval.map(|ci| ci.0), time.interval.map(|ci| ci.1));
                self.add(Record { quantity: &quantity, value: time.seconds, ci_low, ci_high, ..row.clone() });
            }
        }
    }

    /// What orders cost beside those before them.
    pub(super) fn add_marginal(&mut self, blank: &Record, method: &MethodResult) {
        for cost in &method.marginal {
            let row = Record { order: cost.order.label(), ..blank.clone() };
            self.add_estimate(Record { quantity: "marginal_seconds", ..row.clone() }, &cost.seconds);
            if let Some(efficiency) = &cost.efficiency {
                self.add_estimate(Record { quantity: "marginal_efficiency", ..row }, efficiency);
            }
        }
    }

    /// How a composite was chosen, and what it has gained.
    pub(super) fn add_choices(&mut self, blank: &Record, method: &MethodResult, result: &ExperimentResult) {
        let own = |row: &&ChoiceRow| row.scene == method.scene && row.label == method.label;
        let Some(row) = result.choices.iter().find(own) else { return };
        let total = Record { order: order_name(None), ..blank.clone() };
        if let Some(value) = row.choice.gain {
            let (ci_low, ci_high) = row.choice.gain_interval.unzip();
            self.add(Record { quantity: "gain_predicted", value, ci_low, ci_high, ..total.clone() });
        }
        if let Some(Gain { ratio, with_pilots, .. }) = &row.gain {
            self.add_estimate(Record { quantity: "gain", ..total.clone() }, ratio);
            self.add(Record { quantity: "gain_with_pilots", value: *with_pilots, ..total });
        }
        for run in &row.choice.runs {
            let quantity = format!("chosen:{}", run.run.label());
            for order in &run.layers {
                self.add(Record { order: order.clone(), quantity: &quantity, value: run.time, ..blank.clone() });
            }
        }
    }

    /// How noisy references are.
    pub(super) fn add_references(&mut self, result: &ExperimentResult) {
        for reference in &result.references {
            let truth = &reference.truth;
            let orders = truth.layers.iter().map(|&layer| Some(layer)).chain([None]);
            for (i, order) in orders.enumerate() {
                let value = truth.noise(order.map(|_| i));
                let blank = Record::blank(&result.name, &reference.scene, "reference");
                self.add(Record { order: order_name(order), quantity: "reference_noise", value, ..blank });
            }
        }
    }

    /// What confidence sequences said at the end.
    pub(super) fn add_sequences(&mut self, result: &ExperimentResult) {
        for row in &result.sequences {
            let of = |label: &str| result.methods.iter().find(|m| m.scene == row.scene && m.label == label);
            let Some(first) = of(&row.label) else { continue };
            let both: Vec<&MethodResult> =
                [Some(first), row.other.as_deref().and_then(of)].into_iter().flatten().collect();
            let method = both.iter().map(|m| m.entry.as_str()).collect::<Vec<_>>().join(" vs ");
            let sampler = first.sampler.to_string();
            let quantity = match row.target {
                Target::RelativeError => "sequential_error",
                Target::DetectableBias => "sequential_bias",
            };
            let setting = match row.differ {
                Some(true) => "differ",
                Some(false) => "agree",
                None => first.setting.as_str(),
            };
            self.add(Record {
                setting,
                sampler: &sampler,
                order: order_name(row.order),
                spp: both.iter().map(|m| m.measurement.samples()).sum(),
                replicates: row.replicates,
                seconds: both.iter().map(|m| m.measurement.seconds()).sum(),
                quantity,
                value: row.bound,
                ..Record::blank(&result.name, &row.scene, &method)
            });
        }
    }
}
