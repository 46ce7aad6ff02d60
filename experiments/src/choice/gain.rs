//! What composites have gained.

use super::Choice;
use crate::plan::Plan;
use crate::result::{ChoiceRow, Gain, MethodResult};
use integrators::Bias;

/// Every composite whose runs were chosen, against the best of the experiment's other methods that carry all of the light and are not biased.
pub fn gains(plan: &Plan, results: &[MethodResult]) -> Vec<ChoiceRow> {
    let mut rows = Vec::new();
    for scene in &plan.scenes {
        let of_scene: Vec<&MethodResult> = results.iter().filter(|result| result.scene == scene.name).collect();
        for chosen in &scene.chosen {
            let label = &chosen.planned.label;
            let Some(own) = of_scene.iter().find(|result| result.label == *label) else { continue };
            let rivals = of_scene.iter().filter(|result| is_rival(result, own));
            let best = rivals.max_by(|a, b| efficiency(a).total_cmp(&efficiency(b)));
            rows.push(ChoiceRow {
                scene: scene.name.clone(),
                label: label.clone(),
                choice: chosen.choice.clone(),
                gain: best.and_then(|best| gain(own, best, &chosen.choice)),
                variances: chosen.choice.runs.iter().map(|run| variance(own, &run.layers)).collect(),
            });
        }
    }
    rows
}

/// Over another method; `None` where nothing varies.
fn gain(own: &MethodResult, best: &MethodResult, choice: &Choice) -> Option<Gain> {
    let ratio = own.efficiency_over(best, None).filter(|ratio| ratio.value.is_finite())?;
    let seconds = own.measurement.seconds();
    let rendering = seconds / (seconds + choice.pilot_seconds).max(f64::MIN_POSITIVE);
    Some(Gain { over: best.label.clone(), with_pilots: ratio.value * rendering, ratio })
}

/// Whether a method estimates all that a composite does, with the same numbers of replicates.
fn is_rival(result: &MethodResult, own: &MethodResult) -> bool {
    result.label != own.label
        && result.bias == Bias::None
        && result.missing_light.is_empty()
        && result.sampler == own.sampler
        && result.measurement.replicates == own.measurement.replicates
        && result.measurement.layers == own.measurement.layers
}

/// Of the sum of all orders.
fn efficiency(result: &MethodResult) -> f64 {
    let of_sum = result.intervals.as_ref().and_then(|known| known.efficiency.last());
    of_sum.map(|estimate| estimate.value).filter(|value| value.is_finite()).unwrap_or(0.0)
}

/// The variance of one sample of the sum of some layers, image and channel mean.
fn variance(result: &MethodResult, labels: &[String]) -> f64 {
    let m = &result.measurement;
    let count = m.layers.len();
    let own: Vec<usize> = (0..count).filter(|&i| labels.contains(&m.layers[i].label())).collect();
    if m.covariance.is_empty() {
        return f64::NAN;
    }
    let pairs = own.iter().flat_map(|&i| own.iter().map(move |&j| i * count + j));
    let channels: f64 = pairs.map(|at| m.covariance[at].iter().sum::<f64>()).sum();
    channels / 3.0 * f64::from(m.samples_per_replicate)
}
