//! What `neumann run` says of its results on the console.

use crate::cli::print;
use crate::error::Error;
use crate::parts;
use crate::progress::Verbosity;
use crate::report::errors;
use crate::report::summary::{Sentence, Tone};
use crate::result::{AgreementRow, ChoiceRow, ExperimentResult, Gain, RatioRow, Verdict};
use std::collections::BTreeMap;
use std::path::Path;

/// Says what was found.
///
/// # Errors
/// If it cannot be printed.
pub fn tell(result: &ExperimentResult, path: &Path, verbosity: Verbosity) -> Result<(), Error> {
    let (judged, warnings): (Vec<_>, Vec<_>) =
        judgements(result).into_iter().partition(|(_, sentence)| sentence.tone == Tone::Plain);
    // Warnings are what no one asked to be quiet about.
    differences(result).lines().for_each(|line| tell!("{line}"));
    warnings.iter().for_each(|(scene, sentence)| tell!("warning: {scene}: {}", sentence.text));
    if verbosity == Verbosity::Normal {
        print(&summary(result, &judged, path))?;
    }
    Ok(())
}

/// A line for every pair of methods that differ in an order.
fn differences(result: &ExperimentResult) -> String {
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
fn judgements(result: &ExperimentResult) -> Vec<(&str, Sentence)> {
    let of_scene = |scene| {
        let methods: Vec<_> = result.of_scene(scene).collect();
        let sentences = errors::sentences(result, &methods).into_iter();
        sentences.map(|sentence| (scene, sentence)).collect::<Vec<_>>()
    };
    result.scenes().into_iter().flat_map(of_scene).collect()
}

fn summary(result: &ExperimentResult, judged: &[(&str, Sentence)], path: &Path) -> String {
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
    for m in &result.methods {
        if let Some(words) = parts::unbounded_in_words(&m.measurement) {
            text += &format!("{}, {}: {words}\n", m.scene, m.label);
        }
    }
    text += &compositions(&result.choices);
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

/// A line for every composite: who does what, and what that has gained.
fn compositions(rows: &[ChoiceRow]) -> String {
    let line = |row: &ChoiceRow| {
        let gain = row.gain.as_ref().map_or(String::new(), |Gain { over, ratio, with_pilots }| {
            let interval = ratio.interval.map_or(String::new(), |(low, high)| format!(" [{low:.3}, {high:.3}]"));
            let (of, single) = (row.choice.predicted(), &row.choice.single);
            let other = if single == over { String::new() } else { format!(" over {single}") };
            let predicted = of.map_or(String::new(), |gain| format!("predicted {gain}{other}, "));
            format!(
                "; efficiency over {over}: {predicted}measured {:.3}{interval}, {with_pilots:.3} with the pilots' time",
                ratio.value
            )
        });
        format!("{}, {}: {}{gain}\n", row.scene, row.label, row.choice.who_does_what())
    };
    rows.iter().map(line).collect()
}
