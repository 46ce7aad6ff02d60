//! A preview in the terminal: two pixels a character, in colours.

use super::Image;
use crate::export::tone::Exposure;
use console::Term;
use std::io::{self, Write};

/// Rows of the terminal that are left to the bar and to what was written before.
const MARGIN: u16 = 4;
/// The most columns: a look, not the picture.
const COLUMNS: u16 = 96;

/// A terminal with colours.
pub struct Terminal {
    term: Term,
    colours: Colours,
    /// The image shown last, and how many rows of the terminal it has.
    shown: Option<(String, usize)>,
}

/// What a terminal can show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Colours {
    /// Any of 8 bits a channel.
    True,
    /// The cube of six levels a channel.
    Cube,
}

impl Terminal {
    /// Standard error, if it is a terminal, and colours are welcome there.
    pub fn open() -> Option<Self> {
        let term = Term::stderr();
        let set = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
        if !term.is_term() || set("NO_COLOR").is_some() || set("TERM").is_some_and(|name| name == "dumb") {
            return None;
        }
        let full = set("COLORTERM").is_some_and(|value| value == "truecolor" || value == "24bit");
        let colours = if full { Colours::True } else { Colours::Cube };
        Some(Self { term, colours, shown: None })
    }

    /// Shows an image under its name, in place of the one shown last.
    pub fn show(&mut self, name: &str, image: &dyn Image) -> io::Result<()> {
        let (rows, columns) = self.term.size();
        let (rows, columns) = (rows.saturating_sub(MARGIN).max(1), columns.clamp(1, COLUMNS));
        let lines = lines(image, (u32::from(columns), 2 * u32::from(rows)), self.colours);
        let above = self.shown.take().map_or(0, |(_, rows)| rows);
        let mut text = String::new();
        // The cursor stands below what was shown last.
        if above > 0 {
            text += &format!("\x1b[{above}A\x1b[J");
        }
        text += &format!("{name}\n{}", lines.concat());
        self.shown = Some((name.to_owned(), lines.len() + 1));
        self.term.write_all(text.as_bytes())
    }
}

/// An image in characters that fits into so many columns and rows of half a character.
fn lines(image: &dyn Image, most: (u32, u32), colours: Colours) -> Vec<String> {
    let (pixels, (width, height)) = reduced(image, most);
    let exposure = Exposure::of(pixels.iter().copied()).unwrap_or_default();
    let colour = |x: u32, y: u32| exposure.apply(pixels[(y * width + x) as usize]);
    let cell = |x: u32, y: u32| {
        let below = if y + 1 < height { code(48, colour(x, y + 1), colours) } else { String::new() };
        format!("{}{below}▀", code(38, colour(x, y), colours))
    };
    let line = |y: u32| (0..width).map(|x| cell(x, y)).collect::<String>() + "\x1b[0m\n";
    (0..height).step_by(2).map(line).collect()
}

/// The sum of an image's layers in at most so many columns and rows, its proportions kept: means over the pixels that fall together.
fn reduced(image: &dyn Image, (columns, rows): (u32, u32)) -> (Vec<[f64; 3]>, (u32, u32)) {
    let (width, height) = image.size();
    let layers = image.layers().len();
    let by = width.div_ceil(columns).max(height.div_ceil(rows)).max(1);
    let size = (width.div_ceil(by), height.div_ceil(by));
    let mean = |x: u32, y: u32| {
        let (xs, ys) = (x * by..(x * by + by).min(width), y * by..(y * by + by).min(height));
        let count = f64::from(xs.end - xs.start) * f64::from(ys.end - ys.start);
        let pixels = ys.flat_map(|y| xs.clone().map(move |x| (y * width + x) as usize));
        let sum =
            pixels.map(|pixel| image.sum(layers, pixel)).fold([0.0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]]);
        sum.map(|x| x / count)
    };
    ((0..size.1).flat_map(|y| (0..size.0).map(move |x| (x, y))).map(|(x, y)| mean(x, y)).collect(), size)
}

/// What turns the terminal's foreground (38) or background (48) to a colour.
fn code(ground: u8, [r, g, b]: [u8; 3], colours: Colours) -> String {
    match colours {
        Colours::True => format!("\x1b[{ground};2;{r};{g};{b}m"),
        Colours::Cube => {
            // The levels of the cube are 0, 95, 135, 175, 215 and 255.
            let level = |x: u8| if x < 48 { 0 } else { (u32::from(x.max(75)) - 35) / 40 };
            format!("\x1b[{ground};5;{}m", 16 + 36 * level(r) + 6 * level(g) + level(b))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Left half red, right half black, in two layers.
    struct Halves;

    impl Image for Halves {
        fn size(&self) -> (u32, u32) {
            (8, 3)
        }

        fn layers(&self) -> Vec<String> {
            vec!["order00".to_owned(), "order01".to_owned()]
        }

        fn pixel(&self, layer: usize, pixel: usize) -> [f64; 3] {
            if pixel % 8 < 4 { [0.25 + 0.5 * layer as f64, 0.0, 0.0] } else { [0.0; 3] }
        }
    }

    #[test]
    fn an_image_is_reduced_to_what_fits() {
        let (pixels, size) = reduced(&Halves, (4, 100));
        assert_eq!(size, (4, 2));
        assert_eq!(pixels[..4], [[1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0; 3], [0.0; 3]]);
        assert_eq!(pixels[4..], pixels[..4]);
    }

    #[test]
    fn a_character_is_two_pixels() {
        let shown = lines(&Halves, (2, 2), Colours::True);
        assert_eq!(shown, ["\x1b[38;2;255;0;0m▀\x1b[38;2;0;0;0m▀\x1b[0m\n"]);
        let shown = lines(&Halves, (8, 3), Colours::Cube);
        assert_eq!(shown.len(), 2);
        assert!(shown[0].starts_with("\x1b[38;5;196m\x1b[48;5;196m▀"), "{:?}", shown[0]);
    }
}
