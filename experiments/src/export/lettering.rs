//! Small labels on pictures: an atlas of anti-aliased glyphs, and what it takes to set a line of them.
//!
//! `lettering.png` holds the characters of [`GLYPHS`], row by row, 16 cells of 18 × 22 pixels in a row, in DejaVu Sans at
//! 16 pixels (a free font; its licence allows such use). A whole font with a rasteriser would cost a hundred times as much
//! to build and to carry as these few labels are worth.

use std::sync::LazyLock;

const GLYPHS: &str = concat!(
    r##"!"#$%&'()*+,-./0123456789:;<=>?@ABCDEFGHIJKLMNOPQRSTUVWXYZ[\]^_`abcdefghijklmnopqrstuvwxyz{|}~"##,
    "⁰¹²³⁴⁵⁶⁷⁸⁹×·…−"
);
const CELL: (usize, usize) = (18, 22);
const CELLS_IN_ROW: usize = 16;
/// Between two letters, and in place of one [pixels].
const SPACING: usize = 2;
const SPACE: usize = 5;

/// Height of a line [pixels].
pub const LINE: usize = CELL.1;

/// A letter's coverage, cut to its ink.
struct Glyph {
    character: char,
    width: usize,
    /// `[0, 255]`, row by row.
    coverage: Vec<u8>,
}

/// The glyphs in the order of [`GLYPHS`]. The atlas is part of the program, so a fault in it is a broken invariant.
static ATLAS: LazyLock<Vec<Glyph>> = LazyLock::new(|| {
    let atlas = std::io::Cursor::new(include_bytes!("lettering.png"));
    let mut reader = png::Decoder::new(atlas).read_info().expect("the atlas is a PNG image");
    let mut pixels = vec![0; reader.output_buffer_size().expect("the atlas is small")];
    let info = reader.next_frame(&mut pixels).expect("the atlas is whole");
    GLYPHS
        .chars()
        .enumerate()
        .map(|(i, character)| {
            let (x0, y0) = (i % CELLS_IN_ROW * CELL.0, i / CELLS_IN_ROW * CELL.1);
            let at = |x: usize, y: usize| pixels[(y0 + y) * info.line_size + x0 + x];
            let inked = |x: &usize| (0..CELL.1).any(|y| at(*x, y) > 0);
            let first = (0..CELL.0).find(inked).unwrap_or(0);
            let last = (0..CELL.0).rev().find(inked).unwrap_or(0);
            let coverage =
                (0..CELL.1).flat_map(|y| (first..=last).map(move |x| (x, y))).map(|(x, y)| at(x, y)).collect();
            Glyph { character, width: last + 1 - first, coverage }
        })
        .collect()
});

fn glyph(character: char) -> &'static Glyph {
    let find = |c| ATLAS.iter().find(|g| g.character == c);
    find(character).or_else(|| find('?')).expect("the atlas has a question mark")
}

/// Width of a line [pixels]. Characters that the atlas lacks count, and are drawn, as question marks.
pub fn width(text: &str) -> usize {
    text.chars().map(advance).sum()
}

fn advance(character: char) -> usize {
    if character == ' ' { SPACE } else { glyph(character).width + SPACING }
}

/// Calls `ink(x, y, coverage)` for every pixel of the line that has any, coverage in (0, 1].
pub fn draw(text: &str, mut ink: impl FnMut(usize, usize, f32)) {
    let mut x0 = 0;
    for character in text.chars() {
        if character != ' ' {
            let glyph = glyph(character);
            for (i, &coverage) in glyph.coverage.iter().enumerate().filter(|(_, c)| **c > 0) {
                ink(x0 + i % glyph.width, i / glyph.width, coverage as f32 / 255.0);
            }
        }
        x0 += advance(character);
    }
}

/// The text, cut and ended by `…` where it is wider than `pixels`.
pub fn fitted(text: &str, pixels: usize) -> String {
    if width(text) <= pixels {
        return text.to_owned();
    }
    let room = pixels.saturating_sub(advance('…'));
    let mut used = 0;
    let kept = text.chars().take_while(|&c| {
        used += advance(c);
        used <= room
    });
    kept.chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_letter_has_ink_and_unknown_ones_are_question_marks() {
        assert!(ATLAS.iter().all(|g| g.coverage.iter().any(|&c| c > 128)), "a cell of the atlas is empty");
        assert_eq!(width("字"), width("?"));
    }

    #[test]
    fn long_lines_are_cut_to_the_room_there_is() {
        let long = "a".repeat(10_000);
        let cut = fitted(&long, 200);
        assert!(width(&cut) <= 200 && cut.ends_with('…'));
        assert_eq!(fitted("T²E ×4", 200), "T²E ×4");
    }
}
