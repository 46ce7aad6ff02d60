//! The pyramid of strategies [Veach97, fig. 10.2]: a row for every order, and in it a picture for every way to divide its paths
//! between light and camera, from the camera's walks alone on the left to the light's on the right.
//!
//! Two pyramids stand one under the other: what each strategy estimates alone, under the exposure of its order, and what is left
//! of it when all are weighted, under the same.

use super::png::{BACKGROUND, FAINT_INK, INK, Picture, exposure_of};
use super::{ExportError, lettering};
use integrators::{Measurement, Part, Quantity};
use std::path::Path;

/// Between pictures, and around the sheet [pixels].
const GAP: usize = 8;
/// Height of a line of text [pixels].
const LINE: usize = 24;
/// Pictures are made no wider than this by averaging, and no narrower than half of it by repeating pixels [pixels].
const WIDEST: usize = 160;

/// Writes the sheet of a measurement that was taken apart into strategies.
///
/// # Errors
/// If the sheet can't be encoded or the file not written.
pub fn write(path: &Path, measurement: &Measurement, title: &str) -> Result<(), ExportError> {
    sheet(measurement, title).write(path)
}

/// A strategy and where its images are among the layers.
pub struct Strategy {
    /// Vertices of the light subpath.
    pub s: usize,
    /// Vertices of the camera subpath.
    pub t: usize,
    /// The layer of its weighted image; that of its estimate alone follows.
    pub weighted: usize,
}

/// The strategies of a measurement, order by order.
pub fn rows(m: &Measurement) -> Vec<Vec<Strategy>> {
    let mut rows: Vec<Vec<Strategy>> = Vec::new();
    for (weighted, part) in m.parts() {
        let &Part::Strategy { s, t, quantity: Quantity::Weighted } = part else { continue };
        let order = s + t - 2;
        rows.resize_with(rows.len().max(order + 1), Vec::new);
        rows[order].push(Strategy { s, t, weighted });
    }
    rows
}

fn sheet(m: &Measurement, title: &str) -> Picture {
    let rows = rows(m);
    let shrink = (m.width as usize).div_ceil(WIDEST);
    let enlarge = (WIDEST / 2).div_ceil((m.width as usize).div_ceil(shrink)).max(1);
    let tile = |pixels: u32| (pixels as usize).div_ceil(shrink) * enlarge;
    let (width, height) = (tile(m.width), tile(m.height));
    // The widest row decides; a row of order k has k + 2 places.
    let columns = rows.len() + 1;
    let label = lettering::width("order 00 ") + GAP;
    let sheet_width = (label + columns * (width + GAP) + GAP).max(lettering::width(title) + 2 * GAP);
    let block = LINE + rows.len() * (height + LINE + GAP);
    let mut sheet = Picture::filled(sheet_width, LINE + 2 * (block + GAP) + GAP, BACKGROUND);
    sheet.letter(title, GAP, GAP / 2, INK);
    for (number, (raw, heading)) in [(true, "each strategy alone"), (false, "weighted")].into_iter().enumerate() {
        let top = LINE + GAP + number * (block + GAP);
        sheet.letter(heading, GAP, top, INK);
        for (order, row) in rows.iter().enumerate() {
            let exposure = m.layer_of_order(order).and_then(|layer| exposure_of(m, Some(layer))).unwrap_or_default();
            let y = top + LINE + order * (height + LINE + GAP);
            sheet.letter(&format!("order {order}"), GAP, y + height / 2, INK);
            sheet.letter(&exposure.to_string(), GAP, y + height / 2 + LINE, FAINT_INK);
            // Rows are centred, so that a strategy stands between the two that its paths grow into.
            let indent = (columns - (order + 2)) * (width + GAP) / 2;
            for Strategy { s, t, weighted } in row {
                let x = label + indent + s * (width + GAP);
                let layer = weighted + usize::from(raw);
                sheet.paste(&Picture::of(m, Some(layer), exposure, shrink).enlarged(enlarge), x, y);
                sheet.letter(&format!("s {s}  t {t}"), x, y + height, FAINT_INK);
            }
        }
    }
    sheet
}
