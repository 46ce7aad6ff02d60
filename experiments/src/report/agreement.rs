//! Where methods disagree, and whether they do so more often than chance: maps of blocks, and the histogram of all p-values.

use super::images::image;
use super::numbers::short;
use super::tables::head;
use crate::export::markup::Markup;
use crate::export::notation::{brief, symbol};
use crate::export::png::Picture;
use crate::plot::pen::{Sheet, colour};
use crate::result::{AgreementRow, BlockTest};
use crate::statistics::uniformity;
use integrators::Layer;

/// Bars of the histogram.
const BARS: usize = 20;
/// Pixels of a block in a map.
const SIDE: usize = 4;
/// Differences from here on, in standard errors, have the full colour.
const FULL: f32 = 4.0;

/// The tests that say anything: of pairs that carry the same light, in blocks where something varies.
fn judged<'r>(rows: &[&'r AgreementRow]) -> impl Iterator<Item = &'r BlockTest> {
    let judged = rows.iter().filter(|row| row.verdict.is_judged());
    judged.flat_map(|row| &row.tests).filter(|test| test.varies)
}

/// The histogram of the p-values of all block tests of a scene, and what it says; nothing where there are too few.
pub fn histogram(m: &mut Markup, rows: &[&AgreementRow]) {
    let p: Vec<f64> = judged(rows).map(|test| f64::from(test.p)).collect();
    if p.len() < 5 * BARS {
        return;
    }
    let mut bars = [0_usize; BARS];
    p.iter().for_each(|&p| bars[((p * BARS as f64) as usize).min(BARS - 1)] += 1);
    let (width, height, low, left) = (360.0, 150.0, 120.0, 30.0);
    let expected = p.len() as f64 / BARS as f64;
    let most = bars.iter().copied().max().unwrap_or(1).max(1) as f64;
    let scale = (low - 20.0) / most.max(1.5 * expected);
    let bar = (width - left - 10.0) / BARS as f64;
    let label = "Histogram of the p-values of all block tests";
    let drawing = Sheet { label, size: (width, height), font_size: 11, style: None }.draw(|m| {
        for (i, &count) in bars.iter().enumerate() {
            let tall = count as f64 * scale;
            let x = left + i as f64 * bar;
            m.leaf(
                "rect",
                &[
                    ("x", &(x + 0.5)),
                    ("y", &(low - tall)),
                    ("width", &(bar - 1.0)),
                    ("height", &tall),
                    ("fill", &colour(0)),
                ],
            );
        }
        let level = low - expected * scale;
        m.leaf(
            "line",
            &[
                ("x1", &left),
                ("x2", &(width - 10.0)),
                ("y1", &level),
                ("y2", &level),
                ("stroke", &"currentColor"),
                ("stroke-dasharray", &"4 3"),
            ],
        );
        for (x, text) in [(left, "0"), ((left + width - 10.0) / 2.0, "p-value"), (width - 10.0, "1")] {
            m.line("text", &[("x", &x), ("y", &(low + 16.0)), ("text-anchor", &"middle")], text);
        }
    });
    m.element("div", &[("class", &"figures")], |m| {
        m.element("figure", &[], |m| {
            m.append(&drawing);
            m.line("figcaption", &[], in_words(&p, &bars));
        });
    });
}

fn in_words(p: &[f64], bars: &[usize; BARS]) -> String {
    let expected = p.len() as f64 / BARS as f64;
    let distance = uniformity::distance(p);
    format!(
        "The p-values of {} block tests. Where methods have the same means they are uniform, at the dashed line, or fewer are small, since \
         blocks of few contributions are judged with care; a peak at 0 are differences. {} times as many as expected are below {}; \
         Kolmogorov and Smirnov's distance from uniform is {}. Neighbouring blocks and channels vary together.",
        p.len(),
        short(bars[0] as f64 / expected),
        1.0 / BARS as f64,
        short(distance)
    )
}

/// Maps of the differences: a row a pair, a column an order.
pub fn maps(m: &mut Markup, rows: &[&AgreementRow]) {
    let mut pairs: Vec<(&str, &str)> = Vec::new();
    let mut layers: Vec<Layer> = Vec::new();
    for row in rows.iter().filter(|row| row.verdict.is_judged() && !row.tests.is_empty()) {
        if !pairs.contains(&(&row.a, &row.b)) {
            pairs.push((&row.a, &row.b));
        }
        if !layers.contains(&row.order) {
            layers.push(row.order);
        }
    }
    m.element("table", &[("class", &"pictures")], |m| {
        m.line(
            "caption",
            &[],
            "Where the second method of a pair is brighter (orange) or darker (blue) than the first, block by block, in standard errors; the \
             full colour are four of them or more. Of three channels the one that differs most is shown.",
        );
        head(m, "methods", "", layers.iter().map(|&layer| symbol(Some(layer))));
        m.element("tbody", &[], |m| {
            for &(a, b) in &pairs {
                m.element("tr", &[], |m| {
                    m.line("th", &[("scope", &"row")], format!("{} – {}", brief(a), brief(b)));
                    for &layer in &layers {
                        let row = rows.iter().find(|r| (r.a.as_str(), r.b.as_str(), r.order) == (a, b, layer));
                        let judged = row.filter(|row| row.verdict.is_judged());
                        let words = format!("{} – {}, {}", brief(a), brief(b), symbol(Some(layer)));
                        m.element("td", &[], |m| image(m, judged.map(|row| map(row)).as_ref(), &words));
                    }
                });
            }
        });
    });
}

/// One map.
fn map(row: &AgreementRow) -> Picture {
    let (columns, blocks) = (row.columns.max(1), row.tests.len() / 3);
    let mut picture = Picture::filled(columns, blocks.div_ceil(columns).max(1), [255; 3]);
    for block in 0..blocks {
        let of_channels = (0..3).map(|channel| row.tests[channel * blocks + block].t);
        let most = of_channels.fold(0.0_f32, |most, t| if t.abs() > most.abs() { t } else { most });
        picture.rgb[block * 3..block * 3 + 3].copy_from_slice(&shade(most));
    }
    picture.enlarged(SIDE)
}

/// White for no difference, orange for more, blue for less.
fn shade(t: f32) -> [u8; 3] {
    let strength = (t.abs() / FULL).min(1.0);
    let full: [f32; 3] = if t > 0.0 { [213.0, 94.0, 0.0] } else { [0.0, 114.0, 178.0] };
    full.map(|channel| (255.0 + (channel - 255.0) * strength).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shades_are_white_between_and_full_at_both_ends() {
        assert_eq!((shade(0.0), shade(9.0), shade(-4.0)), ([255; 3], [213, 94, 0], [0, 114, 178]));
        assert!(shade(f32::INFINITY) == [213, 94, 0] && shade(2.0)[2] == 128);
    }
}
