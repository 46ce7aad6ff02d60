//! Images side by side: one large, parts of all enlarged beside it, and below them what is known of their errors.

use super::POINTS;
use super::file::{FigureFile, Tone};
use super::images::{Image, Shown};
use super::numbers;
use super::records::blamed;
use crate::error::Error;
use crate::export::markup::{Attributes, Markup};
use crate::export::png::{Picture, block_mean};
use crate::export::tone::{self, Exposure};
use crate::plot::pen::{INK, rounded};
use crate::report::images::base64;
use crate::source::Source;
use integrators::Methods;

/// Frames of crops, which stay apart for colour-blind readers, and from most pictures.
const FRAMES: [&str; 5] = ["#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00"];
/// Between pictures, and between rows \[pt\].
const GAP: f64 = 3.0;
const ROW_GAP: f64 = 7.0;
/// The height of a line of letters, and their size \[pt\].
const LINE: f64 = 9.0;
const LETTERS: f64 = 7.0;
const SMALL: f64 = 6.2;
/// Width of a frame \[pt\].
const FRAME: f64 = 1.1;
/// Pixels of a point that pictures are enlarged to, so that no program smooths them.
const SHARP: f64 = 4.0;
/// Side of the blocks whose means decide the exposure \[pixels\].
const BLOCK: usize = 8;

/// Draws all rows.
///
/// # Errors
/// If an error is asked for that cannot be had, or a row is too narrow for its images.
pub fn draw(source: &Source, figure: &FigureFile, rows: &[Shown], methods: &Methods) -> Result<String, Error> {
    let width = figure.width * POINTS;
    let (mut body, mut top) = (Markup::default(), 0.0);
    for (i, shown) in rows.iter().enumerate() {
        let caption = |image: &Image| numbers::lines(shown, image, &figure.captions, methods);
        let captions = shown.images.iter().map(caption).collect::<Result<Vec<_>, String>>();
        let captions = captions.map_err(blamed(source, format!("rows.{i}.reference")))?;
        let places = Places::of(shown, width).map_err(blamed(source, format!("rows.{i}.images")))?;
        let row = DrawnRow { shown, places, captions, look: Look::of(shown), top: top + LINE };
        row.draw(&mut body, width).map_err(blamed(source, format!("rows.{i}")))?;
        top = row.bottom() + ROW_GAP;
    }
    let height = top - ROW_GAP;
    let view = format!("0 0 {} {}", rounded(width), rounded(height));
    let size = [width, height].map(|points| format!("{:.2}mm", points / POINTS));
    let mut m = Markup::default();
    let attributes: Attributes = &[
        ("xmlns", &"http://www.w3.org/2000/svg"),
        ("viewBox", &view),
        ("width", &size[0]),
        ("height", &size[1]),
        ("font-family", &"sans-serif"),
        ("font-size", &LETTERS),
        ("fill", &INK),
    ];
    m.element("svg", attributes, |m| m.append(&body));
    Ok(m.as_str().to_owned())
}

/// Where the pictures of a row stand \[pt\].
struct Places {
    /// Width and height of the large image, or of each where all are shown whole.
    whole: (f64, f64),
    /// Width and height of an enlarged part.
    part: (f64, f64),
}

impl Places {
    /// The row that fills a width: with n images and m crops below one another, `a h + n (gap + c (h − (m − 1) gap)/m)` is the width,
    /// a and c being width over height of image and crop.
    fn of(shown: &Shown, width: f64) -> Result<Self, String> {
        let aspect = shown.size.0 as f64 / shown.size.1 as f64;
        let images = shown.images.len() as f64;
        let Some(&[_, _, w, h]) = shown.row.crops.first() else {
            let each = (width - (images - 1.0) * GAP) / images;
            return Self { whole: (each, each / aspect), part: (0.0, 0.0) }.checked();
        };
        let (crops, of_crop) = (shown.row.crops.len() as f64, w as f64 / h as f64);
        let gaps = images * (GAP - of_crop * (crops - 1.0) * GAP / crops);
        let height = (width - gaps) / (aspect + images * of_crop / crops);
        let part = (height - (crops - 1.0) * GAP) / crops;
        Self { whole: (aspect * height, height), part: (of_crop * part, part) }.checked()
    }

    fn checked(self) -> Result<Self, String> {
        let narrowest = [self.whole.0, self.part.0].into_iter().filter(|&w| w != 0.0).fold(f64::INFINITY, f64::min);
        match narrowest >= 12.0 {
            true => Ok(self),
            false => {
                Err("its pictures would be narrower than 4 mm; show fewer images or crops, or make the figure wider"
                    .to_owned())
            }
        }
    }
}

/// From light to screen.
struct Look {
    factor: f64,
    tone: Tone,
}

impl Look {
    /// The row's exposure, or the one that shows its large image well: of means of small blocks, so that noise makes it no darker.
    fn of(shown: &Shown) -> Self {
        let (pixels, (w, h)) = (shown.images[shown.large].pixels(), shown.size);
        let blocks = (0..h).step_by(BLOCK).flat_map(|y| (0..w).step_by(BLOCK).map(move |x| (x, y)));
        let mean = |(x, y)| block_mean(w, x..(x + BLOCK).min(w), y..(y + BLOCK).min(h), |p| pixels[p].map(f64::from));
        let own = || f64::from(Exposure::of(blocks.map(mean)).unwrap_or_default().stops);
        let stops = shown.row.exposure.unwrap_or_else(own);
        Self { factor: stops.exp2(), tone: shown.row.tone }
    }

    fn apply(&self, linear: [f32; 3]) -> [u8; 3] {
        if linear.iter().any(|x| !x.is_finite()) {
            return Exposure::default().apply(linear.map(f64::from));
        }
        linear.map(|x| {
            let x = (f64::from(x) * self.factor).max(0.0);
            tone::srgb(match self.tone {
                Tone::Srgb => x,
                Tone::Filmic => x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14),
                Tone::Reinhard => x / (1.0 + x),
            })
        })
    }

    /// A part of an image, every pixel repeated until the picture is sharp at this width \[pt\].
    fn picture(&self, shown: &Shown, image: &Image, [x, y, w, h]: [usize; 4], width: f64) -> Picture {
        let pixels = (y..y + h).flat_map(|row| image.pixels()[row * shown.size.0 + x..][..w].iter());
        let rgb = pixels.flat_map(|&pixel| self.apply(pixel)).collect();
        Picture { width: w, height: h, rgb }.enlarged(((width * SHARP / w as f64).ceil() as usize).clamp(1, 32))
    }
}

/// A row at its place.
struct DrawnRow<'a> {
    shown: &'a Shown,
    places: Places,
    /// Lines below each image.
    captions: Vec<Vec<String>>,
    look: Look,
    /// Where pictures begin \[pt\].
    top: f64,
}

impl DrawnRow<'_> {
    fn bottom(&self) -> f64 {
        let lines = self.captions.iter().map(Vec::len).max().unwrap_or(0);
        self.top + self.places.whole.1 + if lines > 0 { 2.0 + LINE * lines as f64 } else { 0.0 }
    }

    fn draw(&self, m: &mut Markup, width: f64) -> Result<(), String> {
        let (shown, row) = (self.shown, &self.shown.row);
        let all = [0, 0, shown.size.0, shown.size.1];
        let (whole_width, whole_height) = self.places.whole;
        if row.crops.is_empty() {
            for (i, image) in shown.images.iter().enumerate() {
                let x = i as f64 * (whole_width + GAP);
                self.picture(m, image, all, (x, self.top, whole_width, whole_height))?;
                self.words(m, i, x, whole_width);
            }
            return Ok(());
        }
        let title = row.title.clone().unwrap_or_else(|| self.title());
        text(m, (0.0, self.top - 2.5), "start", true, LETTERS, &title);
        self.picture(m, &shown.images[shown.large], all, (0.0, self.top, whole_width, whole_height))?;
        let scale = whole_width / shown.size.0 as f64;
        for (crop, colour) in row.crops.iter().zip(FRAMES.iter().cycle()) {
            let [x, y, w, h] = crop.map(|n| n as f64 * scale);
            frame(m, (x, self.top + y, w, h), colour);
        }
        let (w, h) = self.places.part;
        for (i, image) in shown.images.iter().enumerate() {
            // The last column ends where the figure does.
            let x = width - (shown.images.len() - i) as f64 * (w + GAP) + GAP;
            for ((number, &crop), colour) in row.crops.iter().enumerate().zip(FRAMES.iter().cycle()) {
                let place = (x, self.top + number as f64 * (h + GAP), w, h);
                self.picture(m, image, crop, place)?;
                frame(m, (place.0 + FRAME / 2.0, place.1 + FRAME / 2.0, w - FRAME, h - FRAME), colour);
            }
            self.words(m, i, x, w);
        }
        Ok(())
    }

    /// The scene, what is shown of it, and how bright.
    fn title(&self) -> String {
        let exposure = self.look.factor.log2();
        let brightness = match exposure == exposure.round() {
            true if exposure == 0.0 => String::new(),
            true => Exposure { stops: exposure as i32 }.to_string(),
            false => format!("2^{exposure}"),
        };
        let parts = [self.shown.scene.replace('_', " "), self.shown.row.what(), brightness];
        parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" · ")
    }

    /// An image's label above, and its lines below.
    fn words(&self, m: &mut Markup, image: usize, x: f64, width: f64) {
        let middle = x + width / 2.0;
        text(m, (middle, self.top - 2.5), "middle", true, LETTERS, &self.shown.images[image].label);
        let below = self.top + self.places.whole.1 + 1.0;
        for (i, line) in self.captions[image].iter().enumerate() {
            text(m, (middle, below + LINE * (i as f64 + 0.85)), "middle", false, SMALL, line);
        }
    }

    fn picture(
        &self,
        m: &mut Markup,
        image: &Image,
        part: [usize; 4],
        (x, y, w, h): (f64, f64, f64, f64),
    ) -> Result<(), String> {
        let bytes = self.look.picture(self.shown, image, part, w).encode()?;
        let source = format!("data:image/png;base64,{}", base64(&bytes));
        let attributes: Attributes = &[
            ("x", &x),
            ("y", &y),
            ("width", &w),
            ("height", &h),
            ("preserveAspectRatio", &"none"),
            ("image-rendering", &"optimizeSpeed"),
            ("href", &source),
        ];
        m.leaf("image", attributes);
        Ok(())
    }
}

fn frame(m: &mut Markup, (x, y, w, h): (f64, f64, f64, f64), colour: &str) {
    let attributes: Attributes = &[
        ("x", &x),
        ("y", &y),
        ("width", &w),
        ("height", &h),
        ("fill", &"none"),
        ("stroke", &colour),
        ("stroke-width", &FRAME),
    ];
    m.leaf("rect", attributes);
}

fn text(m: &mut Markup, (x, y): (f64, f64), anchor: &str, bold: bool, size: f64, words: &str) {
    let weight = if bold { 700 } else { 400 };
    let attributes: Attributes =
        &[("x", &x), ("y", &y), ("text-anchor", &anchor), ("font-weight", &weight), ("font-size", &size)];
    m.line("text", attributes, words);
}
