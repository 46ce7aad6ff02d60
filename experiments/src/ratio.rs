//! Samplers against one another: every method with each sampler, by the errors that remain at the most samples measured.

use crate::convergence::rmse_ratio;
use crate::result::{IntegralResult, MethodResult, RatioRow};

/// Every method of one scene with every sampler but the first, against itself with the first; orders rising, their sum last.
/// Orders in which nothing but rounding varies have no row.
pub fn of_scene(methods: &[&MethodResult]) -> Vec<RatioRow> {
    let mut rows = Vec::new();
    for (i, method) in methods.iter().enumerate() {
        let Some(baseline) = methods[..i].iter().find(|m| m.entry == method.entry) else { continue };
        let Some(most) = method.convergence.iter().map(|point| point.samples).max() else { continue };
        for point in method.convergence.iter().filter(|point| point.samples == most) {
            let twin = baseline.convergence.iter().find(|p| p.samples == most && p.order == point.order);
            let Some((ratio, ci)) = twin.and_then(|twin| rmse_ratio(point, twin)) else { continue };
            rows.push(RatioRow {
                scene: method.scene.clone(),
                label: method.label.clone(),
                baseline: baseline.label.clone(),
                order: point.order,
                samples: most,
                ratio,
                ci,
            });
        }
    }
    rows
}

/// The root mean squared error of one sampler on an integral over that of another, at the most samples measured.
pub fn of_integral(result: &IntegralResult, baseline: &IntegralResult) -> Option<(f64, (f64, f64))> {
    rmse_ratio(result.points.last()?, baseline.points.last()?)
}
