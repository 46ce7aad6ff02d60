//! What was found in a scene, for people to read.

use super::{Findings, Pair, meters};
use crate::export::notation::{enumerated, listed};
use crate::result::{AgreementRow, Verdict};
use crate::stress;
use integrators::Layer;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// What holds and what doesn't.
pub(super) fn sentence(rows: &[AgreementRow], invalid: &BTreeMap<String, u64>) -> String {
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

/// Methods that found nothing, or less than others do, where that may be chance: by order.
fn unseen_in_words(rows: &[AgreementRow]) -> String {
    let open = || rows.iter().filter(|row| row.verdict == Verdict::Inconclusive);
    let dark = open().filter_map(|row| match (row.mean_a == 0.0, row.mean_b == 0.0) {
        (true, false) => Some((row.a.as_str(), row.order)),
        (false, true) => Some((row.b.as_str(), row.order)),
        _ => None,
    });
    let dark: Vec<_> = dark.collect();
    let lacking = open().filter_map(|row| Some((row.lacking.as_deref()?, row.order)));
    let lacking: Vec<_> = lacking.filter(|case| !dark.contains(case)).collect();
    by_method(&dark, "found nothing", "where others find light")
        + &by_method(
            &lacking,
            "found less than others",
            "but meets single bright paths there by chance alone, and too seldom yet",
        )
}

fn by_method(cases: &[(&str, Layer)], found: &str, why: &str) -> String {
    let mut orders_of: BTreeMap<&str, BTreeSet<Layer>> = BTreeMap::new();
    for &(method, order) in cases {
        orders_of.entry(method).or_default().insert(order);
    }
    let each = orders_of.into_iter().map(|(method, orders)| {
        let plural = if orders.len() == 1 { "" } else { "s" };
        let labels = orders.into_iter().map(Layer::label).collect();
        format!(" {method} {found} in order{plural} {}, {why}.", enumerated(labels))
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
    let (mut tested, mut open, mut dark, mut most) = (Vec::new(), Vec::new(), Vec::new(), 0.0_f64);
    for (i, &layer) in layers.iter().enumerate() {
        let of_layer = rows.iter().filter(|row| row.order == layer);
        let found = |row: &AgreementRow| match row.verdict {
            Verdict::Agree => Some(row.detectable_bias),
            // Without any variance every bias is seen.
            Verdict::Equal => Some(0.0),
            _ => None,
        };
        if of_layer.clone().all(|row| row.mean_a == 0.0 && row.mean_b == 0.0) {
            dark.push(i);
            continue;
        }
        match of_layer.filter(|row| row.mean_a != 0.0).filter_map(found).min_by(f64::total_cmp) {
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
    let mut text = if most > 0.0 {
        format!(
            "No two methods differ in {}: in each, a bias of {:.2} % of its mean would have been found nine times out of ten by the sharpest pair.",
            named(&tested),
            100.0 * most
        )
    } else {
        format!("No two methods differ in {}: they gave the same values.", named(&tested))
    };
    text += &hidden_in_words(rows, &layers, most);
    if !open.is_empty() {
        text += &format!(" Nothing could be decided in {}.", named(&open));
    }
    if !dark.is_empty() {
        text += &format!(" No method found any light in {}.", named(&dark));
    }
    text
}

/// What paths may hide that are met by chance alone, where that is more than `found`.
fn hidden_in_words(rows: &[AgreementRow], layers: &[Layer], found: f64) -> String {
    let hidden_in = |layer: Layer| {
        let agreeing = |row: &&AgreementRow| matches!(row.verdict, Verdict::Agree | Verdict::Equal);
        let of_layer = rows.iter().filter(|row| row.order == layer);
        of_layer.filter(agreeing).map(|row| row.hidden_bias).min_by(f64::total_cmp).unwrap_or(0.0)
    };
    let hiding: Vec<String> = layers.iter().filter(|l| hidden_in(**l) > found).map(|l| l.label()).collect();
    if hiding.is_empty() {
        return String::new();
    }
    let most = layers.iter().map(|layer| hidden_in(*layer)).fold(0.0, f64::max);
    let size = if most < 1.0 { format!("up to {:.2} %", 100.0 * most) } else { "any part".to_owned() };
    let plural = if hiding.len() == 1 { "" } else { "s" };
    let orders = enumerated(hiding);
    format!(
        " In order{plural} {orders} that is of the paths that are met regularly: single bright ones, which hit an emitter by chance, may \
         make up for {size} of the mean."
    )
}

/// What stands in the table.
const LEGEND: &str = "  the bias of an order's mean that would have been found nine times out of ten; ?: nothing decided yet; dark: neither found light; \
                      —: not the same light; blank: not an order of both\n";

/// A table for people to read: a row a pair, a column an order, in each the bias that would have been found.
pub fn in_words(f: &Findings) -> String {
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
    text += LEGEND;
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
    text + "  " + &f.sentence + "\n" + &meters::in_words(&f.meters) + &stress::in_words(&f.stress) + "\n"
}

fn cell(pair: &Pair) -> String {
    match pair.verdict {
        Verdict::Agree => pair.detectable_bias.map_or("?".to_owned(), |bias| format!("{:.2} %", 100.0 * bias)),
        Verdict::Equal if pair.mean_a == 0.0 => "dark".to_owned(),
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
            lacking: None,
            hidden_bias: 0.0,
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
        assert!(
            text.contains("orders 0 to 2: in each, a bias of 1.00 %") && text.contains("decided in order 3"),
            "{text}"
        );
        // What no method has found says nothing, and is told apart.
        let dark = [AgreementRow { mean_a: 0.0, ..row(4, Verdict::Equal, f64::INFINITY, 0.0) }];
        let text = sentence(&[&rows[..], &dark].concat(), &BTreeMap::new());
        assert!(text.contains("orders 0 to 2: in each") && text.contains("any light in order 4."), "{text}");
        let equal = sentence(&rows[..1], &BTreeMap::new());
        assert!(equal.starts_with("No two methods differ in order 0: they gave the same values."), "{equal}");
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
