//! The tables of a report. A number's full value stands in its cell's `data` element, its shortened one is what is read.

use super::numbers::{Numbers, Row, percent, short, with_error};
use crate::export::markup::Markup;
use crate::export::notation::{symbol, words};
use crate::plot;
use crate::result::{AgreementRow, MethodResult, SlopeRow, Verdict};
use crate::statistics::Interval;
use integrators::Layer;

/// A quantity that has a table: a row an order, a column a method.
pub struct Quantity {
    caption: &'static str,
    cell: fn(&mut Markup, &Row),
    /// Whether the best method of each order is marked.
    ranked: bool,
}

/// The quantities of every scene.
pub const QUANTITIES: [Quantity; 3] = [
    Quantity { caption: "Image mean ± standard error across replicates [W/(m²·sr)]", cell: mean, ranked: false },
    Quantity { caption: "Variance of one sample, image mean, with its 95 % interval", cell: variance, ranked: false },
    Quantity {
        caption: "Efficiency [1/s] with its 95 % interval: 1 / (variance of a replicate × its seconds, all orders together)",
        cell: efficiency,
        ranked: true,
    },
];

fn mean(m: &mut Markup, row: &Row) {
    if !row.is_lit() {
        return m.text("—");
    }
    m.line("data", &[("value", &row.mean)], with_error(row.mean, row.error));
}

fn variance(m: &mut Markup, row: &Row) {
    match row.variance {
        Some(variance) if row.is_lit() => with_interval(m, variance, row.intervals[0]),
        _ => m.text("—"),
    }
}

fn efficiency(m: &mut Markup, row: &Row) {
    match row.efficiency {
        Some(efficiency) => with_interval(m, efficiency, row.intervals[1]),
        None if row.exact => m.text("exact"),
        None => m.text("—"),
    }
}

/// A value, and below it its interval.
pub(super) fn with_interval(m: &mut Markup, value: f64, interval: Option<Interval>) {
    m.line("data", &[("value", &value)], short(value));
    if let Some((low, high)) = interval {
        m.line("small", &[], format!("[{}, {}]", short(low), short(high)));
    }
}

/// One quantity of one scene.
pub fn quantity(m: &mut Markup, quantity: &Quantity, methods: &[&MethodResult], numbers: &Numbers) {
    scrolling(m, quantity.caption, |m| {
        m.line("caption", &[], quantity.caption);
        head(m, "order", "number", methods.iter().map(|m| m.title()));
        m.element("tbody", &[], |m| {
            for (column, &layer) in numbers.columns.iter().enumerate() {
                let ranking = if quantity.ranked { numbers.ranking(column) } else { Vec::new() };
                // Several only where several have no variance at all.
                let best: Vec<usize> = ranking.iter().filter(|r| r.1 >= ranking[0].1).map(|r| r.0).collect();
                m.element("tr", &[], |m| {
                    order_head(m, layer);
                    for (i, rows) in numbers.rows.iter().enumerate() {
                        let class = if best.contains(&i) { "number best" } else { "number" };
                        m.element("td", &[("class", &class)], |m| {
                            let Some(row) = &rows[column] else { return m.text("—") };
                            (quantity.cell)(m, row);
                            if row.is_lit() && !row.complete {
                                m.line(
                                    "span",
                                    &[("title", &"does not carry all of this light, or is biased")],
                                    "\u{2009}†",
                                );
                            }
                        });
                    }
                });
            }
        });
    });
}

/// Which methods agree: a row a pair, a column an order.
pub fn agreement(m: &mut Markup, rows: &[&AgreementRow]) {
    let mut pairs: Vec<(&str, &str)> = Vec::new();
    let mut layers: Vec<Layer> = Vec::new();
    for row in rows {
        let pair = (row.a.as_str(), row.b.as_str());
        if !pairs.contains(&pair) {
            pairs.push(pair);
        }
        if !layers.contains(&row.order) {
            layers.push(row.order);
        }
    }
    let caption = "Agreement of means (Welch's t-test on pixel blocks). Below each verdict: the relative bias of the image mean that \
                   the test finds nine times out of ten, or where methods differ";
    scrolling(m, "Agreement", |m| {
        m.line("caption", &[], caption);
        head(m, "methods", "", layers.iter().map(|&l| symbol(Some(l))));
        m.element("tbody", &[], |m| {
            for (a, b) in pairs {
                m.element("tr", &[], |m| {
                    m.element("th", &[("scope", &"row")], |m| pair_name(m, a, b));
                    for &layer in &layers {
                        let row = rows.iter().find(|r| (r.a.as_str(), r.b.as_str()) == (a, b) && r.order == layer);
                        verdict_cell(m, row.copied());
                    }
                });
            }
        });
    });
}

fn pair_name(m: &mut Markup, a: &str, b: &str) {
    m.line("bdi", &[], a);
    m.text(" – ");
    m.line("bdi", &[], b);
}

fn verdict_cell(m: &mut Markup, row: Option<&AgreementRow>) {
    let Some(row) = row else { return m.line("td", &[], "—") };
    let (class, detail) = match row.verdict {
        Verdict::Agree => ("agree", percent(row.detectable_bias)),
        Verdict::Equal => ("agree", "no variance".to_owned()),
        Verdict::Differ if row.rejected > 0 => ("differ", format!("{} of {} blocks", row.rejected, row.blocks)),
        Verdict::Differ => ("differ", format!("t = {}", short(row.t))),
        Verdict::Inconclusive => ("inconclusive", String::new()),
        Verdict::Incomparable | Verdict::Biased => ("incomparable", String::new()),
    };
    m.element("td", &[("class", &class)], |m| {
        m.text(if row.verdict == Verdict::Incomparable { "—" } else { row.verdict.name() });
        if !detail.is_empty() {
            m.line("small", &[], detail);
        }
    });
}

/// Every comparison with all its numbers.
pub fn agreement_in_full(m: &mut Markup, rows: &[&AgreementRow]) {
    let caption = "Every comparison. p of means is not corrected for the number of comparisons; that of any block is, and blocks are told \
                   one by one, by channel, where it is at most the false discovery rate";
    let heads = [
        "order",
        "mean of first",
        "of second",
        "t",
        "p",
        "blocks rejected",
        "p of any block, corrected",
        "detectable bias",
        "verdict",
    ];
    scrolling(m, "Every comparison", |m| {
        m.line("caption", &[], caption);
        head(m, "methods", "", heads.iter());
        m.element("tbody", &[], |m| {
            for row in rows {
                m.element("tr", &[], |m| {
                    m.element("th", &[("scope", &"row")], |m| pair_name(m, &row.a, &row.b));
                    m.line("td", &[], symbol(Some(row.order)));
                    for value in [row.mean_a, row.mean_b, row.t, row.p] {
                        number_cell(m, value, short(value));
                    }
                    m.line("td", &[("class", &"number")], format!("{} of {}", row.rejected, row.blocks));
                    number_cell(m, row.smallest_adjusted_p, short(row.smallest_adjusted_p));
                    number_cell(m, row.detectable_bias, percent(row.detectable_bias));
                    m.line("td", &[], row.verdict.name());
                });
            }
        });
    });
}

pub(super) fn number_cell(m: &mut Markup, value: f64, written: String) {
    m.element("td", &[("class", &"number")], |m| match value.is_finite() {
        true => m.line("data", &[("value", &value)], written),
        false => m.text("—"),
    });
}

/// The fitted slopes, against samples and against seconds: a row an order, a column a method.
pub fn slopes(m: &mut Markup, rows: &[&SlopeRow], methods: &[&MethodResult], columns: &[Option<Layer>]) {
    let on_samples =
        "Slope of log variance against log samples: estimate and 95 % bootstrap interval. Independent samples have −1";
    let on_seconds = "The same against log seconds, which what a replicate costs whatever its samples makes steeper";
    for (caption, seconds) in [(on_samples, false), (on_seconds, true)] {
        scrolling(m, "Slopes", |m| {
            m.line("caption", &[], caption);
            head(m, "order", "number", methods.iter().map(|m| m.title()));
            m.element("tbody", &[], |m| {
                for &column in columns {
                    m.element("tr", &[], |m| {
                        order_head(m, column);
                        for method in methods {
                            let row = rows.iter().find(|r| r.label == method.label && r.order == column);
                            let line = |row: &&&SlopeRow| match seconds {
                                false => Some((row.slope, row.ci)),
                                true => row.on_seconds.map(|line| (line.slope, line.ci)),
                            };
                            slope_cell(m, row.as_ref().and_then(line));
                        }
                    });
                }
            });
        });
    }
}

fn slope_cell(m: &mut Markup, slope: Option<(f64, (f64, f64))>) {
    match slope {
        Some((slope, ci)) => {
            let written = format!("{} [{:.2}, {:.2}]", plot::two_digits(slope), ci.0, ci.1).replace('-', "−");
            number_cell(m, slope, written);
        }
        None => m.line("td", &[("class", &"number")], "—"),
    }
}

pub(super) fn order_head(m: &mut Markup, layer: Option<Layer>) {
    m.element("th", &[("scope", &"row")], |m| m.line("span", &[("title", &words(layer))], symbol(layer)));
}

pub(super) fn head(m: &mut Markup, first: &str, class: &str, others: impl Iterator<Item = impl std::fmt::Display>) {
    m.element("thead", &[], |m| {
        m.element("tr", &[], |m| {
            match first {
                "" => m.line("td", &[], ""),
                first => m.line("th", &[("scope", &"col")], first),
            }
            for name in others {
                m.element("th", &[("scope", &"col"), ("class", &class)], |m| m.line("bdi", &[], name));
            }
        });
    });
}

/// A table that scrolls by itself where the page is narrow; the keyboard reaches it.
pub fn scrolling(m: &mut Markup, label: &str, table: impl FnOnce(&mut Markup)) {
    m.element("div", &[("class", &"scroll"), ("role", &"group"), ("tabindex", &0), ("aria-label", &label)], |m| {
        m.element("table", &[], table);
    });
}
