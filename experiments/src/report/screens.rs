//! Errors over a screen whose pixels all estimate the same integral, and the spatial frequencies of those errors.

use super::images::image;
use super::numbers::short;
use crate::export::markup::Markup;
use crate::export::png::Picture;
use crate::integrals::Integral;
use crate::integrals::screen::Screen;
use sampling::sampler::SamplerKind;

/// Pixels in a row.
const SIDE: u32 = 64;
/// Samples of a pixel.
const SAMPLES: u32 = 4;
/// Screens whose power is averaged.
const REPLICATES: u32 = 16;
/// How much pictures are enlarged.
const ENLARGED: usize = 2;
const PAPER: [u8; 3] = [255; 3];
const INK: [u8; 3] = [20; 3];

/// What one sampler does with one integral.
pub struct Look {
    /// The integral's name.
    pub integral: String,
    /// The sampler.
    pub sampler: SamplerKind,
    /// Errors of one replicate: grey for none, black and white for twice the first sampler's root mean square.
    pub errors: Picture,
    /// Power by frequency, zero in the middle: grey for that of white noise of the same mean square, white for four times that.
    pub power: Picture,
    /// Root mean square of the errors.
    pub rms: f64,
}

/// Every sampler on a smooth integral and on an edge; integrals in turn.
pub fn looks(samplers: &[SamplerKind]) -> Vec<Look> {
    let mut looks = Vec::new();
    for integral in [Integral::Spot, Integral::Edge] {
        let mut unit = None;
        for &sampler in samplers {
            let screens: Vec<Screen> =
                (0..REPLICATES).map(|r| Screen::new(integral, sampler, SAMPLES, SIDE, r)).collect();
            let square = screens.iter().map(|s| s.rms().powi(2)).sum::<f64>() / f64::from(REPLICATES);
            let unit = *unit.get_or_insert(square.sqrt());
            let mut power = vec![0.0; (SIDE * SIDE) as usize];
            for screen in &screens {
                power.iter_mut().zip(screen.power()).for_each(|(sum, p)| *sum += p / f64::from(REPLICATES));
            }
            let errors = grey(screens[0].errors.iter().map(|e| 0.5 + 0.25 * e / unit));
            let power = grey(power.iter().map(|p| 0.5 * (p / square).sqrt()));
            looks.push(Look { integral: integral.to_string(), sampler, errors, power, rms: square.sqrt() });
        }
    }
    looks
}

/// A square picture of values from 0, black, to 1, white; what lies beyond is cut.
fn grey(values: impl Iterator<Item = f64>) -> Picture {
    let rgb = values.flat_map(|v| [(v.clamp(0.0, 1.0) * 255.0).round() as u8; 3]).collect();
    Picture { width: SIDE as usize, height: SIDE as usize, rgb }.enlarged(ENLARGED)
}

/// A row an integral and a way to look at it, a column a sampler.
pub fn table(m: &mut Markup, looks: &[Look]) {
    let caption = format!(
        "{SIDE} × {SIDE} pixels that all estimate the same integral from {SAMPLES} samples. Errors: grey is none, black and white are \
         twice the root mean square of the first sampler. Below them their power by spatial frequency, zero in the middle: dark \
         where errors of neighbouring pixels cancel; white noise is grey."
    );
    let samplers: Vec<SamplerKind> = columns(looks);
    m.element("table", &[("class", &"screens")], |m| {
        m.line("caption", &[], caption);
        m.element("thead", &[], |m| {
            m.element("tr", &[], |m| {
                m.line("th", &[("scope", &"col")], "integral");
                samplers.iter().for_each(|s| m.line("th", &[("scope", &"col")], s));
            });
        });
        m.element("tbody", &[], |m| {
            for row in looks.chunks(samplers.len().max(1)) {
                let cells = |m: &mut Markup, what: &str, cell: &dyn Fn(&mut Markup, &Look)| {
                    m.element("tr", &[], |m| {
                        m.line("th", &[("scope", &"row")], format!("{}, {what}", row[0].integral));
                        row.iter().for_each(|look| m.element("td", &[], |m| cell(m, look)));
                    });
                };
                cells(m, "errors", &|m, look| {
                    image(m, Some(&look.errors), &format!("errors of {}", look.sampler));
                    m.line("small", &[], format!("RMSE {}", short(look.rms)));
                });
                cells(m, "power", &|m, look| image(m, Some(&look.power), &format!("power of {}", look.sampler)));
            }
        });
    });
}

fn columns(looks: &[Look]) -> Vec<SamplerKind> {
    looks.iter().take_while(|look| look.integral == looks[0].integral).map(|look| look.sampler).collect()
}

/// The same pictures on one sheet.
pub fn sheet(looks: &[Look]) -> Picture {
    const GAP: usize = 8;
    const HEAD: usize = 28;
    let samplers = columns(looks);
    let side = SIDE as usize * ENLARGED;
    let rows = looks.len() / samplers.len().max(1) * 2;
    let (width, height) = (samplers.len() * (side + GAP) + GAP, HEAD + rows * (side + GAP));
    let mut sheet = Picture::filled(width, height, PAPER);
    for (column, sampler) in samplers.iter().enumerate() {
        sheet.letter(&sampler.to_string(), GAP + column * (side + GAP), 4, INK);
    }
    for (i, look) in looks.iter().enumerate() {
        let (row, column) = (i / samplers.len() * 2, i % samplers.len());
        let x = GAP + column * (side + GAP);
        sheet.paste(&look.errors, x, HEAD + row * (side + GAP));
        sheet.paste(&look.power, x, HEAD + (row + 1) * (side + GAP));
    }
    sheet
}
