//! What `neumann run` says of its results on the console.

use crate::report::errors;
use crate::report::summary::Sentence;
use crate::result::{AgreementRow, ExperimentResult, RatioRow, Verdict};
use std::collections::BTreeMap;
use std::path::Path;

/// A line for every pair of methods that differ in an order.
pub fn differences(result: &ExperimentResult) -> String {
    let line = |row: &AgreementRow| {
        format!(
            "warning: {} and {} differ in {}, order {}: {:.6e} and {:.6e}, {:.1} standard errors, {} of {} blocks\n",
            row.a,
            row.b,
            row.scene,
            row.order.label(),
            row.mean_a,
            row.mean_b,
            row.t.abs(),
            row.rejected,
            row.blocks
        )
    };
    result.agreement.iter().filter(|row| row.verdict == Verdict::Differ).map(line).collect()
}

/// What is found of errors in each scene: against a reference, and of a target that was to be reached.
pub fn judgements(result: &ExperimentResult) -> Vec<(&str, Sentence)> {
    let of_scene = |scene| {
        let methods: Vec<_> = result.of_scene(scene).collect();
        let sentences = errors::sentences(result, &methods).into_iter();
        sentences.map(|sentence| (scene, sentence)).collect::<Vec<_>>()
    };
    result.scenes().into_iter().flat_map(of_scene).collect()
}

/// What a run says at its end.
pub fn summary(result: &ExperimentResult, judged: &[(&str, Sentence)], path: &Path) -> String {
    let mut text = String::new();
    let tested =
        || result.agreement.iter().filter(|row| !matches!(row.verdict, Verdict::Biased | Verdict::Incomparable));
    if tested().next().is_some() && tested().all(|row| row.verdict != Verdict::Differ) {
        text += "no two methods differ in any order\n";
    }
    let biases: BTreeMap<&str, &str> =
        result.methods.iter().filter_map(|m| Some((&*m.label, m.bias.label()?))).collect();
    for (label, bias) in biases {
        text += &format!("{label} is {bias}: it takes no part in the tests\n");
    }
    for (scene, sentence) in judged {
        text += &format!("{scene}: {}\n", sentence.text);
    }
    text += &ratios(&result.ratios);
    text + &format!("{:.1} s; see {}\n", result.manifest.seconds, path.join("report.html").display())
}

/// A line for every scene and sampler: its errors order by order, relative to the first sampler's.
fn ratios(rows: &[RatioRow]) -> String {
    let mut text = String::new();
    let heads: Vec<(&str, &str)> = rows.iter().map(|row| (row.scene.as_str(), row.label.as_str())).collect();
    for (i, row) in rows.iter().enumerate() {
        if !heads[..i].contains(&heads[i]) {
            let end = if i == 0 { "" } else { "\n" };
            let RatioRow { scene, label, baseline, samples, .. } = row;
            text += &format!("{end}{scene}, {label} against {baseline}, {samples} samples per pixel: RMSE");
        }
        let order = row.order.map_or("sum".to_owned(), |layer| format!("order {}", layer.label()));
        text += &format!(" · {order} {:.3} [{:.3}, {:.3}]", row.ratio, row.ci.0, row.ci.1);
    }
    if rows.is_empty() { text } else { text + "\n" }
}
