//! What an experiment says, in sentences: which method wins which order and by how much, whether methods agree, what light
//! each of them misses, and what else a reader must know before believing a number.

use super::numbers::{Numbers, factor, percent};
use super::{choices, errors};
use crate::export::notation::{brief, enumerated, listed, symbol};
use crate::plot::two_digits;
use crate::result::{AgreementRow, ExperimentResult, MethodResult, RatioRow, SlopeRow, Verdict};
use crate::statistics::Interval;
use integrators::Layer;
use sampling::tail::Variance;

/// Efficiencies closer than this factor are not ranked where no interval is known.
const AHEAD: f64 = 1.1;
/// Differences named one by one; the table has the rest.
const MAX_NAMED: usize = 4;

/// Whether a sentence is a warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// A finding.
    Plain,
    /// Something that does not hold.
    Warning,
}

/// A sentence of the summary.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sentence {
    /// Its words.
    pub text: String,
    /// Its tone.
    pub tone: Tone,
}

pub(super) fn plain(text: String) -> Sentence {
    Sentence { text, tone: Tone::Plain }
}

pub(super) fn warning(text: String) -> Sentence {
    Sentence { text, tone: Tone::Warning }
}

/// The sentences about one scene.
pub fn of_scene(result: &ExperimentResult, methods: &[&MethodResult], numbers: &Numbers) -> Vec<Sentence> {
    let scene = methods.first().map_or("", |m| m.scene.as_str());
    let rows: Vec<&AgreementRow> = result.agreement.iter().filter(|r| r.scene == scene).collect();
    let slopes: Vec<&SlopeRow> = result.slopes.iter().filter(|r| r.scene == scene).collect();
    let mut sentences = invalid(methods);
    sentences.extend(methods.iter().filter_map(|method| tails(method)));
    let composites: Vec<_> = result.choices.iter().filter(|row| row.scene == scene).collect();
    sentences.extend(choices::sentences(&composites));
    sentences.extend(efficiency(methods, numbers).into_iter().map(plain));
    sentences.extend(agreement(&rows));
    sentences.extend(errors::sentences(result, methods));
    let ratios: Vec<&RatioRow> = result.ratios.iter().filter(|r| r.scene == scene).collect();
    sentences.extend(samplers(&ratios).into_iter().map(plain));
    sentences.extend(convergence(&slopes).map(plain));
    sentences.extend(missing(methods).into_iter().map(plain));
    sentences
}

fn invalid(methods: &[&MethodResult]) -> Vec<Sentence> {
    let counts = methods.iter().map(|m| (&m.label, m.measurement.invalid.iter().sum::<u64>()));
    let sentence = |(label, count): (&String, u64)| {
        let label = brief(label);
        warning(format!(
            "{label} met {count} non-finite samples, which are left out of every sum: its means are biased."
        ))
    };
    counts.filter(|(_, count)| *count > 0).map(sentence).collect()
}

/// What to beware of where the variance of single samples looks infinite.
fn tails(method: &MethodResult) -> Option<Sentence> {
    let m = &method.measurement;
    let heavy = m.layers.iter().zip(m.fireflies.tails()).filter(|(_, tail)| tail.variance() == Variance::Infinite);
    let named: Vec<String> = heavy
        .filter_map(|(&layer, tail)| Some(format!("{} (tail index {:.1})", symbol(Some(layer)), tail.index()?.0)))
        .collect();
    (!named.is_empty()).then(|| {
        warning(format!(
            "The variance of {} looks infinite at {}: no error bar, efficiency or slope of it can be trusted there.",
            brief(&method.label),
            enumerated(named)
        ))
    })
}

/// A method that is the most efficient at some orders.
struct Leader {
    method: usize,
    columns: Vec<usize>,
    /// The least and the most that it is ahead of the next best by.
    factors: Interval,
    /// What their 95 % intervals span, where all are known.
    intervals: Option<Interval>,
}

fn hull(a: Interval, b: Interval) -> Interval {
    (a.0.min(b.0), a.1.max(b.1))
}

/// One sentence for the sum, then one for every method that leads at some orders, then those where none does.
fn efficiency(methods: &[&MethodResult], numbers: &Numbers) -> Vec<String> {
    let label = |i: usize| brief(&methods[i].label);
    let name = |column: usize| symbol(numbers.columns[column]);
    let mut sentences = Vec::new();
    let mut leaders: Vec<Leader> = Vec::new();
    let mut level: Vec<usize> = Vec::new();
    for (column, &layer) in numbers.columns.iter().enumerate() {
        let ranking = numbers.ranking(column);
        let [(best, first), (next, second), ..] = ranking[..] else { continue };
        if first.is_infinite() {
            continue;
        }
        let (lead, interval) = (first / second, lead_interval(methods, best, next, layer));
        if layer.is_none() {
            sentences.push(overall(methods, &ranking));
        } else if !is_ahead(lead, interval) {
            level.push(column);
        } else if let Some(leader) = leaders.iter_mut().find(|leader| leader.method == best) {
            leader.columns.push(column);
            leader.factors = hull(leader.factors, (lead, lead));
            leader.intervals = leader.intervals.zip(interval).map(|(all, one)| hull(all, one));
        } else {
            leaders.push(Leader { method: best, columns: vec![column], factors: (lead, lead), intervals: interval });
        }
    }
    for Leader { method, columns, factors: (least, most), intervals } in leaders {
        let by = match (factor(least), factor(most)) {
            (least, most) if least == most => least,
            (least, most) => format!("{least} to {most}"),
        };
        let (orders, sure) = (listed(&columns, name), within(intervals));
        let best = label(method);
        sentences
            .push(format!("{best} has the highest efficiency at {orders}, {by} times that of the next best{sure}."));
    }
    if !level.is_empty() {
        sentences.push(format!("At {} no method is clearly ahead of the next best.", listed(&level, name)));
    }
    let exact = numbers.columns.iter().enumerate().filter_map(|(column, &layer)| {
        let exact = (0..methods.len()).filter(|&i| numbers.rows[i][column].is_some_and(|r| r.exact));
        let names: Vec<String> = exact.map(label).collect();
        (!names.is_empty()).then(|| format!("{} ({})", symbol(layer), names.join(", ")))
    });
    let exact: Vec<String> = exact.collect();
    if !exact.is_empty() {
        sentences.push(format!("Found without any variance: {}.", exact.join("; ")));
    }
    sentences
}

/// The interval of one method's efficiency over another's.
fn lead_interval(methods: &[&MethodResult], best: usize, next: usize, layer: Option<Layer>) -> Option<Interval> {
    let place = |i: usize| methods[i].measurement.layers.iter().position(|&l| Some(l) == layer);
    let places = layer.map(|_| Some((place(best)?, place(next)?)));
    if places == Some(None) {
        return None;
    }
    methods[best].efficiency_over(methods[next], places.flatten())?.interval
}

/// Whether a lead is more than chance: by its interval, or by a good measure where there is none.
fn is_ahead(lead: f64, interval: Option<Interval>) -> bool {
    interval.map_or(lead >= AHEAD, |(low, _)| low > 1.0)
}

/// How sure a factor is, in brackets.
fn within(interval: Option<Interval>) -> String {
    interval.map_or(String::new(), |(low, high)| format!(" (95 %: {low:.2} to {high:.2})"))
}

fn overall(methods: &[&MethodResult], ranking: &[(usize, f64)]) -> String {
    let label = |i: usize| brief(&methods[i].label);
    let (best, first) = ranking[0];
    let over = |&(i, efficiency): &(usize, f64)| (i, first / efficiency, lead_interval(methods, best, i, None));
    let others: Vec<_> = ranking[1..].iter().map(over).collect();
    let (next, lead, interval) = others[0];
    if !is_ahead(lead, interval) {
        let (first, second, sure) = (label(best), label(next), within(interval));
        return format!("For the sum of all orders, {first} and {second} are about equally efficient{sure}.");
    }
    let words = |&(i, by, sure): &(usize, f64, Option<Interval>)| {
        format!("{} times{} as much as {}", factor(by), within(sure), label(i))
    };
    let others = enumerated(others.iter().map(words).collect());
    format!("For the sum of all orders, {} is the most efficient, {others}.", label(best))
}

fn agreement(rows: &[&AgreementRow]) -> Vec<Sentence> {
    if rows.is_empty() {
        return Vec::new();
    }
    let with = |verdict: Verdict| rows.iter().filter(move |r| r.verdict == verdict).copied();
    let decided = |r: &&&AgreementRow| r.verdict.is_judged() && r.verdict != Verdict::Inconclusive;
    let compared: Vec<&AgreementRow> = rows.iter().filter(decided).copied().collect();
    let differ: Vec<&AgreementRow> = with(Verdict::Differ).collect();
    let mut sentences = Vec::new();
    if !differ.is_empty() {
        let named = differ.iter().take(MAX_NAMED);
        let named = named.map(|r| {
            let (a, b, order) = (brief(&r.a), brief(&r.b), symbol(Some(r.order)));
            let by = if r.rejected > 0 {
                format!("{} of {} blocks", r.rejected, r.blocks)
            } else {
                format!("t = {:.1}", r.t)
            };
            format!("{a} and {b} at {order} ({})", by.replace('-', "−"))
        });
        let more = if differ.len() > MAX_NAMED { ", and more" } else { "" };
        let named = named.collect::<Vec<_>>().join(", ");
        sentences.push(warning(format!(
            "{} of {} comparisons between methods found a difference: {named}{more}. At least one of the two is biased there, \
             or so noisy that its standard errors cannot be trusted.",
            differ.len(),
            compared.len()
        )));
    } else if !compared.is_empty() {
        let largest = |rows: &mut dyn Iterator<Item = &AgreementRow>| {
            rows.map(|r| r.detectable_bias).filter(|b| b.is_finite()).fold(0.0, f64::max)
        };
        let low = largest(&mut with(Verdict::Agree).filter(|r| matches!(r.order, Layer::Order(0..=4))));
        let all = largest(&mut with(Verdict::Agree));
        let power = if all > 0.0 {
            format!(
                " A bias of {} up to T⁴E, and of {} at any order, would have been found nine times out of ten.",
                percent(low),
                percent(all)
            )
        } else {
            String::new()
        };
        sentences.push(plain(format!("Methods agree in all {} comparisons, order by order.{power}", compared.len())));
    }
    let open = with(Verdict::Inconclusive).count();
    if open > 0 {
        sentences.push(plain(format!("{open} comparisons decide nothing: what arrived was too little or too uneven for any difference to be significant, or what one method lacks may be bright paths that it meets by chance alone.")));
    }
    let apart = with(Verdict::Incomparable).count();
    if apart > 0 {
        sentences.push(plain(format!(
            "{apart} comparisons say nothing, because one of the two methods can't carry all of the light."
        )));
    }
    let biased = with(Verdict::Biased).count();
    if biased > 0 {
        sentences.push(plain(format!(
            "{biased} comparisons are of a method that is biased, and no test was made: its means are in the table of every comparison."
        )));
    }
    sentences
}

fn convergence(slopes: &[&SlopeRow]) -> Option<String> {
    if slopes.is_empty() {
        return None;
    }
    let held = slopes.iter().filter(|s| (s.ci.0..=s.ci.1).contains(&-1.0)).count();
    let least = two_digits(slopes.iter().map(|s| s.slope).fold(f64::INFINITY, f64::min));
    let most = two_digits(slopes.iter().map(|s| s.slope).fold(f64::NEG_INFINITY, f64::max));
    let range = if least == most { format!("a slope of {least}") } else { format!("slopes of {least} to {most}") };
    let number = slopes.len();
    Some(format!(
        "Variance falls with samples by {range} (log–log); {held} of {number} intervals (95 %) hold the −1 of independent samples."
    ))
}

/// One sentence for every method with every sampler but the first.
fn samplers(rows: &[&RatioRow]) -> Vec<String> {
    let mut labels: Vec<&str> = rows.iter().map(|r| r.label.as_str()).collect();
    labels.dedup();
    let sentence = |label: &str| {
        let mine: Vec<&&RatioRow> = rows.iter().filter(|r| r.label == label).collect();
        let orders = |which: &dyn Fn(&RatioRow) -> bool| {
            let named = |r: &&&RatioRow| format!("{} ({})", symbol(r.order), two_digits(r.ratio));
            let chosen: Vec<String> = mine.iter().filter(|r| which(r)).map(named).collect();
            if chosen.is_empty() { "nowhere".to_owned() } else { format!("at {}", enumerated(chosen)) }
        };
        format!(
            "With {} samples per pixel, {} has a lower root mean squared error than {} {}, and a higher one {}.",
            mine[0].samples,
            brief(label),
            brief(&mine[0].baseline),
            orders(&|r| r.ci.1 < 1.0),
            orders(&|r| r.ci.0 > 1.0)
        )
    };
    labels.into_iter().map(sentence).collect()
}

fn missing(methods: &[&MethodResult]) -> Vec<String> {
    let some = methods.iter().filter(|m| !m.missing_light.is_empty());
    let missing = some.map(|m| format!("{} misses light here: {}.", brief(&m.label), m.missing_light.join("; ")));
    let biased = methods.iter().filter_map(|m| Some((brief(&m.label), m.bias.label()?)));
    missing.chain(biased.map(|(label, bias)| format!("{label} is {bias}."))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lead_counts_where_its_interval_lies_above_one() {
        assert!(is_ahead(1.02, Some((1.01, 1.03))) && !is_ahead(1.5, Some((0.9, 2.5))));
        assert!(is_ahead(1.2, None) && !is_ahead(1.05, None));
        assert_eq!(within(Some((1.004, 1.036))), " (95 %: 1.00 to 1.04)");
        assert_eq!(within(None), "");
    }

    #[test]
    fn a_difference_is_a_warning_that_names_who_and_where() {
        let row = |verdict, order| AgreementRow {
            scene: "s".into(),
            a: "path".into(),
            b: "bdpt".into(),
            order: Layer::Order(order),
            mean_a: 1.0,
            mean_b: 1.1,
            t: 7.0,
            p: 0.0,
            blocks: 1,
            rejected: 1,
            smallest_adjusted_p: 0.0,
            lacking: None,
            hidden_bias: 0.0,
            detectable_bias: 0.002,
            verdict,
            tests: Vec::new(),
            columns: 0,
        };
        let (same, other) = (row(Verdict::Agree, 1), row(Verdict::Differ, 2));
        let sentences = agreement(&[&same, &other]);
        assert_eq!(sentences[0].tone, Tone::Warning);
        assert!(
            sentences[0].text.contains("1 of 2") && sentences[0].text.contains("path and bdpt at T²E (1 of 1 blocks)")
        );
        let sentences = agreement(&[&same]);
        assert!(sentences[0].tone == Tone::Plain && sentences[0].text.contains("0.20 %"), "{}", sentences[0].text);
    }
}
