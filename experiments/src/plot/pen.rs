//! What drawings are made of: the sheet, colours, marks, lines.

use crate::export::markup::{Attributes, Markup};

/// Colours that stay apart for colour-blind readers and stand out from white as from black (after Okabe & Ito 2008).
const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#a87400", "#808080", "#7a5fd0"];

/// The typeface of plots.
const FONT: &str = "system-ui, 'DejaVu Sans', sans-serif";
/// The style of a plot that is a file of its own; in a page it has the page's colour.
pub const STYLE: &str = ".neumann-plot{color:#1b1d21}@media(prefers-color-scheme:dark){.neumann-plot{color:#e6e8ec}}";

/// The colour of letters and lines on paper.
pub const INK: &str = "#1b1d21";

/// Width and height of a drawing \[SVG units\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// From left to right.
    pub width: f64,
    /// From top to bottom.
    pub height: f64,
}

/// What a drawing is made on.
pub struct Sheet<'a> {
    /// What it tells those who can't see it.
    pub label: &'a str,
    /// Width and height [SVG units].
    pub size: (f64, f64),
    /// Size of letters where nothing is said of it [SVG units].
    pub font_size: u32,
    /// [`STYLE`] in a file of its own.
    pub style: Option<&'static str>,
}

impl Sheet<'_> {
    /// The drawing.
    pub fn draw(&self, content: impl FnOnce(&mut Markup)) -> Markup {
        let (width, height) = self.size;
        let view = format!("0 0 {width} {height}");
        let attributes: Attributes = &[
            ("xmlns", &"http://www.w3.org/2000/svg"),
            ("class", &"neumann-plot"),
            ("role", &"img"),
            ("aria-label", &self.label),
            ("viewBox", &view),
            ("width", &width),
            ("height", &height),
            ("font-family", &FONT),
            ("font-size", &self.font_size),
            ("fill", &"currentColor"),
        ];
        let mut m = Markup::default();
        m.element("svg", attributes, |m| {
            if let Some(style) = self.style {
                m.element("style", &[], |m| m.verbatim(style));
            }
            content(m);
        });
        m
    }
}

/// A drawing as the text of a file.
pub fn file(drawing: &Markup) -> String {
    format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{}\n", drawing.as_str())
}

/// A file of [`file()`] for paper: in the colour of ink, and as many millimetres wide.
pub fn printed(svg: &str, width: f64) -> String {
    let drawing = svg.replacen(&format!("<style>{STYLE}</style>"), "", 1);
    let drawing = drawing.split_once("?>").map_or(drawing.as_str(), |(_, drawing)| drawing);
    let size = |name: &str| drawing.split(&format!(" {name}=\"")).nth(1)?.split('"').next()?.parse::<f64>().ok();
    let (Some(w), Some(h)) = (size("width"), size("height")) else { return svg.to_owned() };
    let height = width * h / w;
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{width}mm\" height=\"{height}mm\" color=\"{INK}\">{drawing}</svg>"
    )
}

/// The colour of a series.
pub fn colour(index: usize) -> &'static str {
    COLOURS[index % COLOURS.len()]
}

/// The mark of a series: circle, square, triangle, diamond, in its colour.
pub fn mark(m: &mut Markup, index: usize, (x, y): (f64, f64)) {
    let colour = colour(index);
    let path = match index % 4 {
        0 => {
            m.leaf("circle", &[("cx", &x), ("cy", &y), ("r", &3.2), ("fill", &colour)]);
            return;
        }
        1 => format!("M{} {}h5.6v5.6h-5.6z", rounded(x - 2.8), rounded(y - 2.8)),
        2 => format!("M{} {}l3.6 6.2h-7.2z", x, rounded(y - 4.0)),
        _ => format!("M{} {}l4 4l-4 4l-4 -4z", x, rounded(y - 4.0)),
    };
    m.leaf("path", &[("d", &path), ("fill", &colour)]);
}

/// A thin line in the page's colour.
pub fn line(m: &mut Markup, from: (f64, f64), to: (f64, f64), opacity: f64) {
    let ends: Attributes = &[
        ("x1", &from.0),
        ("y1", &from.1),
        ("x2", &to.0),
        ("y2", &to.1),
        ("stroke", &"currentColor"),
        ("opacity", &opacity),
    ];
    m.leaf("line", ends);
}

/// Places as the `points` of a polyline.
pub fn coordinates(places: impl Iterator<Item = (f64, f64)>) -> String {
    places.map(|(x, y)| format!("{x},{y}")).collect::<Vec<_>>().join(" ")
}

/// A tenth of a unit is finer than any screen, and keeps files small.
pub fn rounded(x: f64) -> f64 {
    (x * 10.0).round() / 10.0
}
