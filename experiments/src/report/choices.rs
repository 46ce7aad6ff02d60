//! What a report says of composites: which method does which orders, why, and what that has gained.

use super::choice_picture;
use super::numbers::{percent, short};
use super::summary::{Sentence, plain};
use super::tables::{head, number_cell, scrolling};
use crate::choice::in_ranges;
use crate::export::markup::Markup;
use crate::export::notation::brief;
use crate::plot::two_digits;
use crate::result::{ChoiceRow, Gain};

/// The sentences about a scene's composites.
pub fn sentences(rows: &[&ChoiceRow]) -> Vec<Sentence> {
    let mut sentences = Vec::new();
    for row in rows {
        if let Some(Gain { over, ratio, with_pilots }) = &row.gain {
            let between = |interval: Option<(f64, f64)>| {
                let told = interval
                    .map(|(low, high)| format!(", with 95 % between {} and {}", two_digits(low), two_digits(high)));
                told.unwrap_or_default()
            };
            let interval = between(ratio.interval);
            let expected = between(row.choice.gain_interval);
            let single = &row.choice.single;
            let other = if single == over { String::new() } else { format!(" over {}", brief(single)) };
            let gain = row.choice.gain.map(two_digits);
            let predicted = gain.map_or(String::new(), |gain| format!(" predicted {gain}{other}{expected}, and"));
            sentences.push(plain(format!(
                "{} has {} times the efficiency of {} on the sum of all orders{interval}; the pilots{predicted} took {} s, which are not counted: with them it is {} times.",
                brief(&row.label),
                two_digits(ratio.value),
                brief(over),
                two_digits(row.choice.pilot_seconds),
                two_digits(*with_pilots)
            )));
        }
        sentences.extend(row.choice.left_out.iter().map(|why| plain(format!("{}: {why}.", brief(&row.label)))));
    }
    sentences
}

/// A picture and a table for each composite; `methods` are those of the scene's plots.
pub fn tables(m: &mut Markup, rows: &[&ChoiceRow], methods: &[&str]) {
    for row in rows {
        m.element("figure", &[], |m| {
            m.append(&choice_picture::svg(row, methods, None));
            m.line("figcaption", &[], choice_picture::title(row));
        });
        let caption = format!(
            "{}: who does which orders. Variances are those of the orders' sum, of one of the composite's samples and of one of {}'s, image mean",
            brief(&row.label),
            if row.choice.single.is_empty() { "no other method" } else { &row.choice.single }
        );
        scrolling(m, &caption, |m| {
            m.line("caption", &[], &caption);
            let columns = ["samples", "time", "variance predicted", "measured", "of the best alone"];
            head(m, "orders", "number", ["method"].iter().chain(&columns));
            m.element("tbody", &[], |m| {
                let runs = &row.choice.runs;
                for (i, (run, &measured)) in runs.iter().zip(&row.variances).enumerate() {
                    let told = runs[..i].iter().any(|other| other.layers == run.layers);
                    let all: f64 = row.choice.runs.iter().map(|run| run.run.share).sum();
                    m.element("tr", &[], |m| {
                        m.line("th", &[("scope", &"row")], in_ranges(&run.layers));
                        m.line("td", &[], run.run.label() + &run.regions());
                        number_cell(m, run.run.share, percent(run.run.share / all));
                        number_cell(m, run.time, percent(run.time));
                        for v in [run.variance, measured, run.single.unwrap_or(f64::NAN)] {
                            match told {
                                true => m.line("td", &[("class", &"note")], "as above"),
                                false => number_cell(m, v, short(v)),
                            }
                        }
                    });
                }
            });
        });
    }
}
