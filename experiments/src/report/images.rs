//! The pictures inside a report: every order by every method, small, for those who read it without scripts and on paper.

use crate::export::markup::Markup;
use crate::export::notation::{brief, symbol, words};
use crate::export::png::{Picture, column_exposure, layer_index};
use crate::result::{ExperimentResult, MethodResult};
use integrators::{Layer, Measurement};

/// All pixels of a report's pictures together. Noise hardly compresses: each costs up to four bytes of base64 text.
const MAX_PIXELS: usize = 660_000;

/// By what whole factor the pictures of a report must be shrunk.
pub fn shrink(result: &ExperimentResult) -> usize {
    let pixels = |factor: usize| -> usize {
        let of = |m: &Measurement| {
            let [w, h] = [m.width, m.height].map(|n| (n as usize).div_ceil(factor));
            w * h * (m.layers.len() + 1)
        };
        result.methods.iter().map(|m| of(&m.measurement)).sum()
    };
    (1..64).find(|&factor| pixels(factor) <= MAX_PIXELS).unwrap_or(64)
}

/// A table of pictures: a row a method, a column an order; the exposure of a column is in its head.
pub fn table(m: &mut Markup, methods: &[&MethodResult], columns: &[Option<Layer>], shrink: usize) {
    let measurements: Vec<&Measurement> = methods.iter().map(|m| &m.measurement).collect();
    let exposures: Vec<_> = columns.iter().map(|&column| column_exposure(&measurements, column)).collect();
    m.element("table", &[("class", &"pictures")], |m| {
        m.line(
            "caption",
            &[],
            "Every order by every method: sRGB, all pictures of a column brightened by the same factor, given above it.",
        );
        m.element("thead", &[], |m| {
            m.element("tr", &[], |m| {
                m.line("th", &[("scope", &"col")], "method");
                for (&column, exposure) in columns.iter().zip(&exposures) {
                    m.element("th", &[("scope", &"col")], |m| {
                        m.line("span", &[("title", &words(column))], symbol(column));
                        m.line("small", &[], exposure.map_or(" no light".to_owned(), |e| format!(" {e}")));
                    });
                }
            });
        });
        m.element("tbody", &[], |m| {
            for method in methods {
                m.element("tr", &[], |m| {
                    m.element("th", &[("scope", &"row")], |m| m.line("bdi", &[], method.title()));
                    for (&column, exposure) in columns.iter().zip(&exposures) {
                        let picture = layer_index(&method.measurement, column)
                            .map(|layer| Picture::of(&method.measurement, layer, exposure.unwrap_or_default(), shrink));
                        m.element("td", &[], |m| image(m, picture.as_ref(), &format!("{}, {}", brief(&method.label), words(column))));
                    }
                });
            }
        });
    });
}

/// A picture within the page; a dash for none.
pub fn image(m: &mut Markup, picture: Option<&Picture>, alternative: &str) {
    let Some((picture, bytes)) = picture.and_then(|p| Some((p, p.encode().ok()?))) else {
        m.text("—");
        return;
    };
    let source = format!("data:image/png;base64,{}", base64(&bytes));
    m.leaf(
        "img",
        &[
            ("src", &source),
            ("alt", &alternative),
            ("width", &picture.width),
            ("height", &picture.height),
            ("loading", &"lazy"),
        ],
    );
}

/// Base64 with padding [RFC 4648].
pub fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let bits = chunk.iter().enumerate().fold(0u32, |bits, (i, &b)| bits | u32::from(b) << (16 - 8 * i));
        for i in 0..4 {
            let digit = ALPHABET[(bits >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= chunk.len() { digit as char } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_has_the_standards_examples() {
        let encoded = ["", "f", "fo", "foo", "foob", "fooba", "foobar"].map(|s| base64(s.as_bytes()));
        assert_eq!(encoded, ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"]);
    }
}
