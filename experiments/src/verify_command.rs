//! `neumann verify`: do the methods agree with one another, and with the truth where it is known?
//!
//! Every method that can render a scene is run on random numbers of its own, and every pair is compared order by order, as
//! [`crate::agreement`] does; where a scene has a closed form, that is one of the methods. A pass says little without what it would
//! have found: so the bias that each comparison finds nine times out of ten is beside it.

use crate::agreement;
use crate::cli::{VerifyArgs, print};
use crate::config::{Experiment, MethodEntry, Sizes};
use crate::error::{Error, Status};
use crate::export::notation::{enumerated, listed};
use crate::plan::Plan;
use crate::progress::{Progress, Verbosity, while_loading};
use crate::result::{AgreementRow, MethodResult, Verdict};
use crate::source::Source;
use crate::states::States;
use crate::stop::Stop;
use crate::stress::{self, Amount, Stressed};
use crate::{budget, runner};
use integrators::{Layer, Methods};
use scenes::{LoadOptions, Skip};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The longer side of the images \[pixels\]; more would tell no more, since blocks are compared.
const LONGER_SIDE: u32 = 96;
/// The last order where neither the command line nor the scene names one.
const MAX_ORDER: usize = 8;

/// What was found in a scene, and what `--json` prints of it.
#[derive(Serialize)]
struct Findings {
    scene: String,
    methods: Vec<String>,
    /// Methods that cannot render the scene, each with the reason.
    left_out: Vec<String>,
    size: [u32; 2],
    spp: u64,
    replicates: u32,
    /// What single methods cannot carry here.
    missing_light: BTreeMap<String, Vec<String>>,
    /// What bias single methods have.
    biases: BTreeMap<String, &'static str>,
    /// Non-finite samples of each method.
    invalid: BTreeMap<String, u64>,
    pairs: Vec<Pair>,
    /// What other units and places do to it; only if that was asked for.
    stress: Vec<Stressed>,
    holds: bool,
    sentence: String,
}

/// A comparison of two methods in one order.
#[derive(Serialize)]
struct Pair {
    a: String,
    b: String,
    order: String,
    verdict: Verdict,
    /// The bias of the order's mean that would have been found nine times out of ten; `null` where none would.
    detectable_bias: Option<f64>,
    mean_a: f64,
    mean_b: f64,
    t: f64,
    p: f64,
    blocks: usize,
    rejected: usize,
}

/// Verifies a scene, or all built-in ones.
///
/// # Errors
/// If a scene cannot be loaded, or fewer than two methods can render it.
pub fn verify(args: &VerifyArgs, methods: &Methods, verbosity: Verbosity, stop: &Stop) -> Result<Status, Error> {
    let scenes: Vec<&str> = match &args.scene {
        Some(scene) => vec![scene],
        None => scenes::builtin_names().to_vec(),
    };
    let pool = budget::pool(args.threads)?;
    let mut all = Vec::new();
    for scene in scenes {
        let findings = pool.install(|| one(scene, args, methods, verbosity, stop))?;
        if !args.json {
            print(&in_words(&findings))?;
        }
        all.push(findings);
        if let Some(signal) = stop.signal() {
            return Ok(Status::Interrupted(signal));
        }
    }
    if args.json {
        print(&(serde_json::to_string_pretty(&all).unwrap_or_default() + "\n"))?;
    }
    Ok(if all.iter().all(|findings| findings.holds) { Status::Done } else { Status::Failed })
}

fn one(
    scene: &str,
    args: &VerifyArgs,
    methods: &Methods,
    verbosity: Verbosity,
    stop: &Stop,
) -> Result<Findings, Error> {
    let (mut plan, left_out) = while_loading(verbosity, || plan(scene, args, methods))?;
    let results = runner::run(&mut plan, &mut States::none(), verbosity, stop)?.methods;
    let rows = agreement::compare(&results.iter().collect::<Vec<_>>());
    let stress = if args.stress { stressed(scene, args, plan, &results, verbosity, stop)? } else { Vec::new() };
    Ok(findings(&results, &rows, left_out, stress))
}

/// What other units and places do to a scene, by the methods that were compared and a quarter of their samples.
fn stressed(
    scene: &str,
    args: &VerifyArgs,
    plan: Plan,
    results: &[MethodResult],
    verbosity: Verbosity,
    stop: &Stop,
) -> Result<Vec<Stressed>, Error> {
    let Some(first) = results.first() else { return Ok(Vec::new()) };
    let samples = first.measurement.samples_per_replicate.div_ceil(4);
    let max_order = plan.experiment.max_order;
    // A closed form is not known of a scene that was changed.
    let methods: Vec<_> = plan.methods.into_iter().map(|p| p.method).filter(|m| m.name() != "exact").collect();
    drop(plan.scenes);
    let subject = stress::Subject {
        scene,
        size: (first.measurement.width, first.measurement.height),
        methods: &methods,
        max_order,
        seed: args.seed,
        amount: Amount { samples, replicates: args.replicates },
    };
    let mut progress = Progress::new(subject.work(), verbosity);
    subject.stress(&mut progress, stop)
}

/// The experiment that this is: every method that can render the scene, with its defaults.
fn plan(scene: &str, args: &VerifyArgs, methods: &Methods) -> Result<(Plan, Vec<String>), Error> {
    let loaded = scenes::load(scene, &LoadOptions { size: None, skip: Skip::Unneeded })?;
    let (mut able, mut left_out) = (Vec::new(), Vec::new());
    for name in methods.names() {
        match methods.build(name, &serde_json::Value::Null)?.unsupported(&loaded) {
            None => able.push(MethodEntry { name: name.to_owned(), label: None, settings: toml::Table::new() }),
            Some(reason) => left_out.push(format!("{name}: {reason}")),
        }
    }
    if able.len() < 2 {
        return Err(Error::usage(format!(
            "{scene}: only one method can render it, so there is nothing to compare it with; {}",
            left_out.join("; ")
        )));
    }
    let (width, height) = (loaded.camera.width(), loaded.camera.height());
    let scale = f64::from(LONGER_SIDE) / f64::from(width.max(height));
    let scaled = |side: u32| ((f64::from(side) * scale.min(1.0)).round() as u32).max(1);
    let (width, height) = args.size.unwrap_or((scaled(width), scaled(height)));
    let experiment = Experiment {
        title: String::new(),
        description: String::new(),
        scenes: vec![scene.to_owned()],
        methods: able,
        max_order: args.max_order.or(loaded.series.max_order).unwrap_or(MAX_ORDER),
        tail: false,
        spp: args.seconds.is_none().then_some(args.spp),
        seconds: args.seconds,
        replicates: args.replicates,
        until: None,
        max_spp: None,
        seed: args.seed,
        sampler: Default::default(),
        size: Some(Sizes(vec![[width, height]])),
        layers: Vec::new(),
        lpe: BTreeMap::new(),
        reference: None,
        metrics: Vec::new(),
        time_to_error: Vec::new(),
        marginal_cost: false,
        convergence: None,
        integrals: None,
    };
    drop(loaded);
    Ok((Plan::new(&Source::of_command("verify"), experiment, methods)?, left_out))
}

fn findings(results: &[MethodResult], rows: &[AgreementRow], left_out: Vec<String>, stress: Vec<Stressed>) -> Findings {
    let pairs: Vec<Pair> = rows.iter().map(pair).collect();
    let named = |value: &dyn Fn(&MethodResult) -> Option<Vec<String>>| {
        results.iter().filter_map(|r| Some((r.label.clone(), value(r)?))).collect::<BTreeMap<_, _>>()
    };
    let invalid: BTreeMap<String, u64> =
        results.iter().map(|r| (r.label.clone(), r.measurement.invalid.iter().sum())).collect();
    let agree = rows.iter().all(|row| row.verdict != Verdict::Differ) && invalid.values().all(|&n| n == 0);
    let holds = agree && stress.iter().all(|row| row.holds);
    let first = results.first();
    Findings {
        scene: first.map(|r| r.scene.clone()).unwrap_or_default(),
        methods: results.iter().map(|r| r.label.clone()).collect(),
        left_out,
        size: first.map_or([0, 0], |r| [r.measurement.width, r.measurement.height]),
        spp: first.map_or(0, |r| r.measurement.samples()),
        replicates: first.map_or(0, |r| r.measurement.replicates),
        missing_light: named(&|r| (!r.missing_light.is_empty()).then(|| r.missing_light.clone())),
        biases: results.iter().filter_map(|r| Some((r.label.clone(), r.bias.label()?))).collect(),
        sentence: sentence(rows, &invalid),
        invalid,
        pairs,
        stress,
        holds,
    }
}

fn pair(row: &AgreementRow) -> Pair {
    Pair {
        a: row.a.clone(),
        b: row.b.clone(),
        order: row.order.label(),
        verdict: row.verdict,
        detectable_bias: row.detectable_bias.is_finite().then_some(row.detectable_bias),
        mean_a: row.mean_a,
        mean_b: row.mean_b,
        t: row.t,
        p: row.p,
        blocks: row.blocks,
        rejected: row.rejected,
    }
}

/// What holds and what doesn't.
fn sentence(rows: &[AgreementRow], invalid: &BTreeMap<String, u64>) -> String {
    let differing: Vec<&AgreementRow> = rows.iter().filter(|row| row.verdict == Verdict::Differ).collect();
    let mut text = match differing.as_slice() {
        [] => agreement_in_words(rows) + &unseen_in_words(rows),
        _ => {
            let each = differing.iter().map(|row| format!("{} and {} in order {}", row.a, row.b, row.order.label()));
            let worst = differing.iter().max_by(|a, b| relative(a).total_cmp(&relative(b)));
            let size = worst.map_or(String::new(), |row| {
                format!(
                    "; by most, {:.2} %, {} and {} in order {}",
                    100.0 * relative(row),
                    row.a,
                    row.b,
                    row.order.label()
                )
            });
            let names = each.collect::<Vec<_>>().join(", ");
            format!(
                "Methods DIFFER: {names}{size}. A bias stays with more samples; light that a method meets too seldom comes with them."
            )
        }
    };
    let broken: Vec<String> =
        invalid.iter().filter(|(_, n)| **n > 0).map(|(name, n)| format!("{n} of {name}")).collect();
    if !broken.is_empty() {
        text += &format!(" Samples were not finite: {}.", broken.join(", "));
    }
    text
}

fn relative(row: &AgreementRow) -> f64 {
    2.0 * (row.mean_a - row.mean_b).abs() / (row.mean_a.abs() + row.mean_b.abs()).max(f64::MIN_POSITIVE)
}

/// Methods that found nothing where others found light, by order.
fn unseen_in_words(rows: &[AgreementRow]) -> String {
    let mut unseen: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    for row in rows.iter().filter(|row| row.verdict == Verdict::Inconclusive) {
        let blind = match (row.mean_a == 0.0, row.mean_b == 0.0) {
            (true, false) => &row.a,
            (false, true) => &row.b,
            _ => continue,
        };
        let orders = unseen.entry(blind).or_default();
        if !orders.contains(&row.order.label()) {
            orders.push(row.order.label());
        }
    }
    let each = unseen.into_iter().map(|(method, orders)| {
        let plural = if orders.len() == 1 { "" } else { "s" };
        format!(" {method} found nothing in order{plural} {}, where others find light.", enumerated(orders))
    });
    each.collect()
}

fn agreement_in_words(rows: &[AgreementRow]) -> String {
    let mut layers: Vec<Layer> = Vec::new();
    rows.iter().for_each(|row| {
        if !layers.contains(&row.order) {
            layers.push(row.order);
        }
    });
    let (mut tested, mut open, mut most) = (Vec::new(), Vec::new(), 0.0_f64);
    for (i, &layer) in layers.iter().enumerate() {
        let of_layer = rows.iter().filter(|row| row.order == layer);
        let found = |row: &AgreementRow| match row.verdict {
            Verdict::Agree => Some(row.detectable_bias),
            // Without any variance every bias is seen, and where there is no light, all there is.
            Verdict::Equal => Some(0.0),
            _ => None,
        };
        match of_layer.filter_map(found).min_by(f64::total_cmp) {
            Some(bias) if bias.is_finite() => {
                tested.push(i);
                most = most.max(bias);
            }
            _ => open.push(i),
        }
    }
    let named = |indices: &[usize]| {
        let plural = if indices.len() == 1 { "" } else { "s" };
        format!("order{plural} {}", listed(indices, |i| layers[i].label()))
    };
    if tested.is_empty() {
        return "Nothing could be decided: no two methods carry the same light here, or too little of it arrived."
            .to_owned();
    }
    let mut text = format!(
        "No two methods differ in {}: a bias of {:.2} % of an order's mean would have been found nine times out of ten in each.",
        named(&tested),
        100.0 * most
    );
    if !open.is_empty() {
        text += &format!(" Nothing could be decided in {}.", named(&open));
    }
    text
}

/// A table for people to read: a row a pair, a column an order, in each the bias that would have been found.
fn in_words(f: &Findings) -> String {
    let mut orders: Vec<&str> = Vec::new();
    let mut names: Vec<(&str, &str)> = Vec::new();
    for pair in &f.pairs {
        if !orders.contains(&pair.order.as_str()) {
            orders.push(&pair.order);
        }
        if !names.contains(&(pair.a.as_str(), pair.b.as_str())) {
            names.push((&pair.a, &pair.b));
        }
    }
    let [width, height] = f.size;
    let mut text = format!("{}, {width}x{height}, {} samples in {} replicates\n", f.scene, f.spp, f.replicates);
    let widest = names.iter().map(|(a, b)| a.len() + b.len() + 3).max().unwrap_or(0);
    let _ = write!(text, "  {:<widest$}", "order");
    orders.iter().for_each(|order| text += &format!(" {order:>8}"));
    text += "\n";
    for (a, b) in names {
        let _ = write!(text, "  {:<widest$}", format!("{a} – {b}"));
        for &order in &orders {
            let pair = f.pairs.iter().find(|p| (p.a.as_str(), p.b.as_str(), p.order.as_str()) == (a, b, order));
            let _ = write!(text, " {:>8}", pair.map_or(String::new(), cell));
        }
        text += "\n";
    }
    for (method, classes) in &f.missing_light {
        classes.iter().for_each(|class| text += &format!("  {method} cannot carry here: {class}\n"));
    }
    f.biases
        .iter()
        .for_each(|(method, bias)| text += &format!("  {method} is {bias}: it may differ, and is not tested\n"));
    f.left_out
        .iter()
        .filter(|reason| !reason.starts_with("exact:"))
        .for_each(|reason| text += &format!("  left out: {reason}\n"));
    text + "  " + &f.sentence + "\n" + &stress::in_words(&f.stress) + "\n"
}

fn cell(pair: &Pair) -> String {
    match pair.verdict {
        Verdict::Agree => pair.detectable_bias.map_or("—".to_owned(), |bias| format!("{:.2} %", 100.0 * bias)),
        Verdict::Equal => "equal".to_owned(),
        Verdict::Differ => "DIFFER".to_owned(),
        Verdict::Inconclusive => "?".to_owned(),
        Verdict::Incomparable => "—".to_owned(),
        Verdict::Biased => "biased".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(order: usize, verdict: Verdict, detectable_bias: f64, mean_b: f64) -> AgreementRow {
        AgreementRow {
            scene: "room".to_owned(),
            a: "path".to_owned(),
            b: "bdpt".to_owned(),
            order: Layer::Order(order),
            mean_a: 1.0,
            mean_b,
            t: 0.0,
            p: 1.0,
            blocks: 4,
            rejected: 0,
            smallest_adjusted_p: 1.0,
            detectable_bias,
            verdict,
            tests: Vec::new(),
            columns: 0,
        }
    }

    #[test]
    fn the_sentence_names_the_weakest_order_and_those_left_open() {
        let rows = [
            row(0, Verdict::Equal, f64::INFINITY, 1.0),
            row(1, Verdict::Agree, 0.02, 1.0),
            row(1, Verdict::Agree, 0.01, 1.0),
            row(2, Verdict::Agree, 0.003, 1.0),
            row(3, Verdict::Inconclusive, f64::INFINITY, 1.0),
        ];
        let text = sentence(&rows, &BTreeMap::new());
        assert!(text.contains("orders 0 to 2: a bias of 1.00 %") && text.contains("decided in order 3"), "{text}");
        let open = sentence(&rows[4..], &BTreeMap::new());
        assert!(open.starts_with("Nothing could be decided"), "{open}");
    }

    #[test]
    fn differences_and_samples_that_are_not_finite_are_told() {
        let rows = [row(1, Verdict::Differ, 0.01, 1.2), row(2, Verdict::Differ, 0.01, 1.05)];
        let text = sentence(&rows, &BTreeMap::from([("bdpt".to_owned(), 3), ("path".to_owned(), 0)]));
        assert!(text.contains("path and bdpt in order 1, path and bdpt in order 2"), "{text}");
        assert!(text.contains("by most, 18.18 %") && text.contains("not finite: 3 of bdpt."), "{text}");
    }
}
