//! The records of samplers: against one another, and on integrals of known value.

use super::{Record, Table, order_name};
use crate::ratio;
use crate::result::{ExperimentResult, IntegralResult, MethodResult};

impl Table {
    /// A method with a sampler against the same method with the first one.
    pub(super) fn add_ratios(&mut self, blank: &Record, method: &MethodResult, result: &ExperimentResult) {
        let mine = |row: &&crate::result::RatioRow| row.scene == method.scene && row.label == method.label;
        for row in result.ratios.iter().filter(mine) {
            let Some(point) = method.convergence.iter().find(|p| p.samples == row.samples && p.order == row.order)
            else {
                continue;
            };
            self.add(Record {
                order: order_name(row.order),
                quantity: "rmse_ratio",
                value: row.ratio,
                ci_low: Some(row.ci.0),
                ci_high: Some(row.ci.1),
                ..blank.over([point])
            });
        }
    }

    /// Every integral by every sampler.
    pub(super) fn add_integrals(&mut self, result: &ExperimentResult) {
        for integral in &result.integrals {
            let sampler = integral.sampler.to_string();
            let blank = Record { sampler: &sampler, ..Record::blank(&result.name, &integral.integral, "") };
            self.add(Record { quantity: "exact", value: integral.exact, ..blank.clone() });
            self.add_integral(&blank, integral);
            let (first, last) =
                (result.integrals.iter().find(|i| i.integral == integral.integral), integral.points.last());
            let ratio = first.filter(|first| first.sampler != integral.sampler);
            if let (Some((value, ci)), Some(last)) = (ratio.and_then(|first| ratio::of_integral(integral, first)), last)
            {
                let (spp, replicates) = (u64::from(last.samples) * u64::from(last.replicates), last.replicates);
                let (ci_low, ci_high) = (Some(ci.0), Some(ci.1));
                self.add(Record { quantity: "rmse_ratio", value, ci_low, ci_high, spp, replicates, ..blank });
            }
        }
    }

    fn add_integral(&mut self, blank: &Record, integral: &IntegralResult) {
        for (point, &p) in integral.points.iter().zip(&integral.p) {
            let row = blank.over([point]);
            let (ci_low, ci_high) = (Some(point.ci.0), Some(point.ci.1));
            self.add(Record { quantity: "mean", value: point.mean, ..row.clone() });
            self.add(Record { quantity: "mse", value: point.variance, ci_low, ci_high, ..row.clone() });
            self.add(Record { quantity: "integral_p", value: p, ..row });
        }
        if let Some(line) = integral.slope {
            let (ci_low, ci_high) = (Some(line.ci.0), Some(line.ci.1));
            let row = blank.over(&integral.points);
            self.add(Record { quantity: "slope", value: line.slope, ci_low, ci_high, ..row });
        }
    }
}
