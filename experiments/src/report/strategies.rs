//! The pyramid of strategies in the page [Veach97, fig. 10.2]: a row for every order, a picture for every way to divide its paths.

use super::images::image;
use crate::export::markup::Markup;
use crate::export::notation::symbol;
use crate::export::png::{Picture, exposure_of};
use crate::export::pyramid::{Strategy, rows};
use crate::result::{ExperimentResult, MethodResult};
use integrators::{Layer, Measurement};

/// All pixels of a report's pyramids together; each costs up to four bytes of text.
const MOST_PIXELS: usize = 500_000;
/// Pictures are no wider than this [pixels].
const WIDEST: usize = 96;

/// By what whole factor the pictures of a report's pyramids must be shrunk.
pub fn shrink(result: &ExperimentResult) -> usize {
    let measurements = || result.methods.iter().map(|method| &method.measurement);
    let pixels = |factor: usize| -> usize {
        let of = |m: &Measurement| {
            let strategies: usize = rows(m).iter().map(Vec::len).sum();
            2 * strategies * (m.width as usize).div_ceil(factor) * (m.height as usize).div_ceil(factor)
        };
        measurements().map(of).sum()
    };
    let widest = measurements().map(|m| m.width as usize).max().unwrap_or(0);
    (1..64).find(|&factor| pixels(factor) <= MOST_PIXELS && widest.div_ceil(factor) <= WIDEST).unwrap_or(64)
}

/// What a pyramid is.
pub const WORDS: &str = "A row an order, brightened by the factor beside it; in it a picture for every strategy, from s = 0 on the left: s vertices are \
                         of the light's walk, and t = order + 2 − s of the camera's.";

/// Both pyramids of a method: each strategy alone, and all of them weighted.
pub fn pyramids(m: &mut Markup, method: &MethodResult, shrink: usize) {
    let measurement = &method.measurement;
    let rows = rows(measurement);
    for (raw, title) in [(true, "each strategy alone"), (false, "weighted: these add up to the image")] {
        m.element("figure", &[("data-method", &method.title())], |m| {
            m.element("figcaption", &[], |m| {
                m.line("bdi", &[], method.title());
                m.text(format!(", {title}"));
            });
            let label = format!("Pyramid of strategies, {title}");
            m.element(
                "div",
                &[("class", &"scroll"), ("role", &"group"), ("tabindex", &0), ("aria-label", &label)],
                |m| {
                    m.element("div", &[("class", &"pyramid")], |m| {
                        for (order, row) in rows.iter().enumerate().filter(|(_, row)| !row.is_empty()) {
                            pyramid_row(m, measurement, (order, row), raw, shrink);
                        }
                    });
                },
            );
        });
    }
}

fn pyramid_row(
    m: &mut Markup,
    measurement: &Measurement,
    (order, row): (usize, &[Strategy]),
    raw: bool,
    shrink: usize,
) {
    let exposure = measurement.layer_of_order(order).and_then(|layer| exposure_of(measurement, Some(layer)));
    m.element("div", &[], |m| {
        m.element("span", &[], |m| {
            m.text(symbol(Some(Layer::Order(order))));
            m.line("small", &[], exposure.map_or(" no light".to_owned(), |exposure| format!(" {exposure}")));
        });
        for Strategy { s, t, weighted } in row {
            let layer = weighted + usize::from(raw);
            let picture = Picture::of(measurement, Some(layer), exposure.unwrap_or_default(), shrink);
            let words = format!("order {order}, s = {s}, t = {t}, {}", if raw { "alone" } else { "weighted" });
            let part = measurement.parts[layer - measurement.layers.len()].name(measurement.max_order);
            m.element("span", &[("data-part", &part)], |m| image(m, Some(&picture), &words));
        }
    });
}
