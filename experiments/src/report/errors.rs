//! What a report says of errors against a reference, of the times to an error, and of what orders cost and share.

use super::numbers::{percent, short};
use super::summary::{Sentence, plain, warning};
use super::tables::{head, number_cell, order_head, scrolling, with_interval};
use crate::agreement::DISCOVERY_RATE;
use crate::config::{Experiment, Metric};
use crate::export::markup::Markup;
use crate::export::notation::{brief, enumerated, symbol};
use crate::path_class::carries;
use crate::record::judged::{estimate, layers};
use crate::reference::Truth;
use crate::result::{ExperimentResult, MethodResult, SequenceRow, Target};
use crate::statistics::multiple::benjamini_hochberg;
use crate::statistics::time::TimeToError;
use crate::statistics::{Estimate, Interval};
use integrators::Layer;

/// What a table of each metric is called.
fn caption(metric: Metric) -> &'static str {
    match metric {
        Metric::Mse => {
            "Mean squared error of a replicate: its variance and the square of its bias. The reference's noise is taken out"
        }
        Metric::Bias2 => {
            "bias²: the part of the mean squared error that no number of samples removes. Without a bias it is as often below 0 as above"
        }
        Metric::Relmse => {
            "Relative mean squared error of a replicate: the squared error over the reference's square and 0.01"
        }
        Metric::Smape => "SMAPE: the difference over the sum of both, from 0 to 1. The reference's noise is part of it",
        Metric::Flip => "FLIP: what the eye sees of the difference when one image replaces the other, from 0 to 1",
    }
}

/// The sentences about errors in a scene.
pub fn sentences(result: &ExperimentResult, methods: &[&MethodResult]) -> Vec<Sentence> {
    let scene = methods.first().map_or("", |m| m.scene.as_str());
    let mut sentences = Vec::new();
    if let Some(reference) = result.references.iter().find(|r| r.scene == scene) {
        sentences.push(plain(told(&reference.truth)));
        sentences.extend(biases(methods));
    }
    let rows: Vec<&SequenceRow> = result.sequences.iter().filter(|row| row.scene == scene).collect();
    sentences.extend(ends(&rows));
    sentences
}

/// What a reference is, and how much it can be trusted.
fn told(truth: &Truth) -> String {
    let noise = percent(truth.noise(None));
    if truth.pooled.is_empty() {
        return format!("Errors are taken against a reference that was given; its noise is {noise} of its mean.");
    }
    let part = |p: &crate::reference::Pooled| {
        let shares: Vec<String> = truth
            .layers
            .iter()
            .zip(&p.weights)
            .filter(|(_, weight)| **weight > 0.0)
            .map(|(&layer, weight)| format!("{} {}", percent(*weight), symbol(Some(layer))))
            .collect();
        format!("{} ({})", brief(&p.label), shares.join(", "))
    };
    let parts: Vec<String> = truth.pooled.iter().map(part).collect();
    let samples = truth.pooled.iter().map(|p| p.samples).max().unwrap_or(0);
    format!(
        "Errors are taken against a reference of {}, {samples} samples per pixel of each in each of two halves; \
         its noise is {noise} of its mean.",
        enumerated(parts)
    )
}

/// The biases found, at a false discovery rate, where a method should have none.
fn biases(methods: &[&MethodResult]) -> Option<Sentence> {
    let mut tests = Vec::new();
    for method in methods {
        let Some(judged) = &method.judged else { continue };
        let max_order = method.measurement.max_order;
        let whole = method.measurement.layer_of_order(max_order).is_some();
        let carried =
            |layer: Option<Layer>| (layer.is_some() || whole) && carries(&method.missing_light, layer, max_order);
        let own = layers(method).filter(|&(_, layer)| carried(layer));
        tests.extend(own.filter_map(|(i, layer)| Some((method, layer, judged.layers[i], judged.layers[i].no_bias?))));
    }
    let adjusted = benjamini_hochberg(&tests.iter().map(|(.., p)| *p).collect::<Vec<_>>());
    let found = tests.iter().zip(adjusted).filter(|(_, p)| *p <= DISCOVERY_RATE);
    let named: Vec<String> = found
        .map(|((method, layer, errors, _), _)| {
            let part = percent(errors.bias2.value.max(0.0).sqrt() / errors.mean.value.abs());
            format!("{} at {} ({part} of the mean)", brief(&method.label), symbol(*layer))
        })
        .collect();
    if named.is_empty() {
        let number = tests.len();
        return (number > 0).then(|| plain(format!("No bias was found in {number} comparisons with the reference.")));
    }
    Some(warning(format!("Biased, against the reference: {}.", named.join(", "))))
}

/// Which methods have reached what was asked for, and which have not.
fn ends(rows: &[&SequenceRow]) -> Vec<Sentence> {
    let name = |row: &SequenceRow| match &row.other {
        Some(other) => format!("{} and {} at {}", brief(&row.label), brief(other), symbol(row.order)),
        None => format!("{} at {}", brief(&row.label), symbol(row.order)),
    };
    let Some(first) = rows.first() else { return Vec::new() };
    let what = match first.target {
        Target::RelativeError => "a relative error of the mean",
        Target::DetectableBias => "a bias that would be found nine times out of ten",
    };
    let behind: Vec<String> = rows.iter().filter(|row| row.bound > row.asked).map(|&row| name(row)).collect();
    let (asked, number) = (percent(first.asked), rows.len());
    let mut sentences = vec![match behind.is_empty() {
        true => plain(format!(
            "Rendered until {what} is below {asked}, which all {number} bounds are, at whatever time one looks."
        )),
        false => warning(format!(
            "Rendered until {what} is below {asked}, or to the limit of the budget, which came first for {}.",
            behind.join(", ")
        )),
    }];
    let differ: Vec<String> = rows.iter().filter(|row| row.differ == Some(true)).map(|&row| name(row)).collect();
    if !differ.is_empty() {
        sentences.push(warning(format!("Found to differ while rendering: {}.", differ.join(", "))));
    }
    sentences
}

/// A table of estimates: a row a layer, a column a method.
fn table(
    m: &mut Markup,
    caption: &str,
    (methods, columns): (&[&MethodResult], &[Option<Layer>]),
    cell: &dyn Fn(&mut Markup, &MethodResult, usize),
) {
    scrolling(m, caption, |m| {
        m.line("caption", &[], caption);
        head(m, "order", "number", methods.iter().map(|m| &m.label));
        m.element("tbody", &[], |m| {
            for &column in columns {
                m.element("tr", &[], |m| {
                    order_head(m, column);
                    for method in methods {
                        match layers(method).find(|(_, layer)| *layer == column) {
                            Some((i, _)) => cell(m, method, i),
                            None => m.line("td", &[("class", &"number")], "—"),
                        }
                    }
                });
            }
        });
    });
}

/// A value with its interval.
fn estimate_cell(m: &mut Markup, value: f64, interval: Option<Interval>) {
    m.element("td", &[("class", &"number")], |m| match value.is_finite() {
        true => with_interval(m, value, interval),
        false => m.text("—"),
    });
}

fn optional_cell(m: &mut Markup, estimate: Option<Estimate>) {
    match estimate {
        Some(found) => estimate_cell(m, found.value, found.interval),
        None => m.line("td", &[("class", &"number")], "—"),
    }
}

/// Errors by every metric asked for, and the times to errors.
pub fn tables(m: &mut Markup, experiment: &Experiment, methods: &[&MethodResult], columns: &[Option<Layer>]) {
    m.element("div", &[("class", &"side-by-side")], |m| {
        for metric in experiment.metrics().unwrap_or_default() {
            table(m, caption(metric), (methods, columns), &|m, method, i| optional_cell(m, estimate(method, metric, i)));
        }
        for (place, target) in experiment.time_to_error.iter().enumerate() {
            let caption = format!(
                "Seconds to a relative mean squared error of {target}, by more replicates like these; never where the bias forbids it"
            );
            table(m, &caption, (methods, columns), &|m, method, i| {
                let time = method.judged.as_ref().and_then(|judged| judged.times[i].get(place));
                m.element("td", &[("class", &"number")], |m| match time {
                    Some(time) => in_time(m, time),
                    None => m.text("—"),
                });
            });
        }
    });
}

/// Seconds with their interval; `never`, or what they are at least.
fn in_time(m: &mut Markup, time: &TimeToError) {
    match time.interval {
        _ if time.is_never() => m.text("never"),
        Some((low, high)) if high.is_infinite() => {
            m.text(short(time.seconds));
            m.line("small", &[], format!("at least {}", short(low)));
        }
        interval => with_interval(m, time.seconds, interval),
    }
}

/// What every order costs by itself.
pub fn marginal(m: &mut Markup, methods: &[&MethodResult], columns: &[Option<Layer>]) {
    let of = |method: &MethodResult, i: usize| {
        let layer = method.measurement.layers.get(i).copied();
        method.marginal.iter().find(|cost| Some(cost.order) == layer).cloned()
    };
    m.element("div", &[("class", &"side-by-side")], |m| {
        let caption = "Seconds that an order adds to a replicate of those before it, by renders that end with each";
        table(m, caption, (methods, columns), &|m, method, i| optional_cell(m, of(method, i).map(|cost| cost.seconds)));
        let caption = "Efficiency [1/s] with these seconds: 1 / (variance of a replicate × what the order adds)";
        table(m, caption, (methods, columns), &|m, method, i| {
            optional_cell(m, of(method, i).and_then(|c| c.efficiency))
        });
    });
}

/// The covariances between all orders of one sample, a table for each method.
pub fn covariances(m: &mut Markup, methods: &[&MethodResult]) {
    for method in methods {
        let (Some(known), measured) = (&method.intervals, &method.measurement) else { continue };
        let caption = format!("{}: covariance between orders of one sample, image mean", brief(&method.label));
        let n = f64::from(measured.samples_per_replicate);
        scrolling(m, &caption, |m| {
            m.line("caption", &[], &caption);
            head(m, "", "number", measured.layers.iter().map(|&layer| symbol(Some(layer))));
            m.element("tbody", &[], |m| {
                for (i, &layer) in measured.layers.iter().enumerate() {
                    m.element("tr", &[], |m| {
                        order_head(m, Some(layer));
                        for j in 0..=i {
                            let found = known.covariance[i * (i + 1) / 2 + j];
                            estimate_cell(m, n * found.value, found.interval.map(|(low, high)| (n * low, n * high)));
                        }
                    });
                }
            });
        });
    }
}

/// What confidence sequences said at the end.
pub fn sequences(m: &mut Markup, rows: &[&SequenceRow]) {
    let caption = "Bounds that hold together at whatever time one looks, with a probability of 95 %";
    scrolling(m, "Bounds at the end", |m| {
        m.line("caption", &[], caption);
        head(m, "methods", "number", ["order", "bound", "asked for", "replicates", "found to differ"].iter());
        m.element("tbody", &[], |m| {
            for row in rows {
                let names = row.other.as_ref().map_or(row.label.clone(), |other| format!("{} – {other}", row.label));
                m.element("tr", &[], |m| {
                    m.element("th", &[("scope", &"row")], |m| m.line("bdi", &[], &names));
                    m.line("td", &[("class", &"number")], symbol(row.order));
                    number_cell(m, row.bound, percent(row.bound));
                    number_cell(m, row.asked, percent(row.asked));
                    m.line("td", &[("class", &"number")], row.replicates);
                    m.line("td", &[], row.differ.map_or("", |differ| if differ { "yes" } else { "no" }));
                });
            }
        });
    });
}
