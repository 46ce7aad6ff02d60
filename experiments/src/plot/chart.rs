//! A chart on a logarithmic vertical axis, as SVG.
//!
//! Text and lines take the page's colour (`currentColor`), so that the same file serves light and dark pages; a file on
//! its own brings a style that follows the reader's preference.

use super::pen::{STYLE, Sheet, Size, colour, coordinates, file, line, mark, rounded};
use super::scale::{LogScale, drawable, label};
use crate::export::markup::{Attributes, Markup};
use crate::export::notation::{brief, listed};

/// A series of points.
#[derive(Clone, Debug)]
pub struct Series {
    /// What it is called.
    pub name: String,
    /// Written beside its last point.
    pub label: String,
    /// Which colour and mark; the same series has the same in all charts.
    pub colour: usize,
    /// From left to right.
    pub points: Vec<Point>,
    /// A fitted power law, `(slope, intercept)` of `ln y` against `ln x`, drawn instead of lines between the points.
    pub fit: Option<(f64, f64)>,
}

/// A point; left out where its value has no logarithm.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Along the horizontal axis; on [`Horizontal::Terms`] the number of the term.
    pub x: f64,
    /// The value.
    pub y: f64,
    /// The value's interval.
    pub interval: Option<(f64, f64)>,
}

/// The horizontal axis.
#[derive(Clone, Debug)]
pub enum Horizontal {
    /// Logarithmic, with this label.
    Log(String),
    /// The terms of the series by their names; lines join the first `joined` of them, the others stand apart.
    Terms {
        /// From left to right.
        names: Vec<String>,
        /// How many are joined.
        joined: usize,
    },
}

/// A chart.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Its title.
    pub title: String,
    /// The horizontal axis.
    pub horizontal: Horizontal,
    /// What the vertical axis shows.
    pub vertical: String,
    /// What is drawn.
    pub series: Vec<Series>,
}

/// What charts of reports have.
const SIZE: Size = Size { width: 430.0, height: 280.0 };
const TOP: f64 = 46.0;
const BOTTOM: f64 = 40.0;
const LEFT: f64 = 50.0;
/// Width of a character of a label, on average, and distance between two labels [SVG units].
const CHARACTER: f64 = 6.3;
const LABEL_LINE: f64 = 14.0;
const MAX_LABEL: usize = 28;

impl Chart {
    /// The chart as a file of its own.
    pub fn file(&self) -> String {
        file(&self.svg(SIZE, Some(STYLE)))
    }

    /// The chart of any size, in black, as a text of SVG.
    pub fn printed(&self, size: Size) -> Markup {
        self.svg(size, None)
    }

    /// The chart as a part of a page, in the page's colour.
    pub fn inline(&self) -> Markup {
        self.svg(SIZE, None)
    }

    /// The points that could not be drawn, by series, as `path at E and TE`; the series' name alone where it has no others.
    pub fn left_out(&self) -> Vec<String> {
        let describe = |s: &Series| {
            let name = |i: usize| match &self.horizontal {
                Horizontal::Terms { names, .. } => names.get(i).cloned().unwrap_or_default(),
                Horizontal::Log(_) => s.points[i].x.to_string(),
            };
            let out: Vec<usize> = (0..s.points.len()).filter(|&i| !drawable(s.points[i].y)).collect();
            match out.len() {
                0 => None,
                n if n == s.points.len() => Some(brief(&s.label)),
                _ => Some(format!("{} at {}", brief(&s.label), listed(&out, name))),
            }
        };
        self.series.iter().filter_map(describe).collect()
    }

    fn svg(&self, size: Size, style: Option<&'static str>) -> Markup {
        let description = format!("{}. Vertical axis: {}.", self.title, self.vertical);
        Sheet { label: &description, size: (size.width, size.height), font_size: 12, style }.draw(|m| {
            m.line("text", &[("x", &8), ("y", &17), ("font-size", &14), ("font-weight", &600)], &self.title);
            m.line("text", &[("x", &8), ("y", &34), ("font-size", &11), ("opacity", &0.75)], &self.vertical);
            match Plot::of(self, size) {
                Some(plot) => plot.draw(m),
                None => m.line(
                    "text",
                    &[("x", &8), ("y", &(size.height / 2.0))],
                    "There is nothing that a logarithmic axis could show.",
                ),
            }
        })
    }
}

/// A chart with its scales: from values to places.
struct Plot<'a> {
    chart: &'a Chart,
    vertical: LogScale,
    horizontal: Option<LogScale>,
    size: Size,
    right: f64,
}

impl<'a> Plot<'a> {
    fn of(chart: &'a Chart, size: Size) -> Option<Self> {
        let points = || chart.series.iter().flat_map(|s| &s.points).filter(|p| drawable(p.y));
        let values = LogScale::around(points().map(|p| p.y))?;
        // Intervals widen the axis, but not beyond a decade: one that reaches down to zero would squeeze all else flat.
        let ends = points().filter_map(|p| p.interval).flat_map(|(low, high)| [low, high]);
        let ends = ends.filter(|&e| drawable(e)).map(|e| e.clamp(values.low / 10.0, values.high * 10.0));
        let vertical = LogScale::around(ends.chain(points().map(|p| p.y)))?;
        let horizontal = match chart.horizontal {
            Horizontal::Log(_) => Some(LogScale::around(points().map(|p| p.x))?),
            Horizontal::Terms { .. } => None,
        };
        let longest = chart.series.iter().map(|s| shortened(&s.label).chars().count()).max().unwrap_or(0);
        Some(Self { chart, vertical, horizontal, size, right: size.width - 26.0 - longest as f64 * CHARACTER })
    }

    fn x(&self, x: f64) -> f64 {
        let share = match (&self.chart.horizontal, self.horizontal) {
            (_, Some(scale)) => scale.position(x),
            (Horizontal::Terms { names, .. }, None) => (x + 0.5) / names.len().max(1) as f64,
            (Horizontal::Log(_), None) => 0.5,
        };
        LEFT + share * (self.right - LEFT)
    }

    fn y(&self, y: f64) -> f64 {
        let bottom = self.size.height - BOTTOM;
        bottom - self.vertical.position(y) * (bottom - TOP)
    }

    fn draw(&self, m: &mut Markup) {
        self.draw_vertical_axis(m);
        self.draw_horizontal_axis(m);
        for series in &self.chart.series {
            group(m, series, |m| self.draw_series(m, series));
        }
        self.draw_labels(m);
    }

    fn draw_vertical_axis(&self, m: &mut Markup) {
        for tick in self.vertical.ticks() {
            let y = rounded(self.y(tick.value));
            let opacity = if tick.labelled { 0.22 } else { 0.08 };
            line(m, (LEFT, y), (self.right, y), opacity);
            if tick.labelled {
                let at: Attributes =
                    &[("x", &(LEFT - 7.0)), ("y", &(y + 4.0)), ("text-anchor", &"end"), ("font-size", &11)];
                m.line("text", at, label(tick.value));
            }
        }
    }

    fn draw_horizontal_axis(&self, m: &mut Markup) {
        let bottom = self.size.height - BOTTOM;
        line(m, (LEFT, bottom), (self.right, bottom), 0.6);
        let mut tick = |x: f64, text: Option<&str>| {
            let x = rounded(x);
            line(m, (x, bottom), (x, bottom + if text.is_some() { 5.0 } else { 3.0 }), 0.6);
            if let Some(text) = text {
                let at: Attributes =
                    &[("x", &x), ("y", &(bottom + 17.0)), ("text-anchor", &"middle"), ("font-size", &11)];
                m.line("text", at, text);
            }
        };
        match (&self.chart.horizontal, self.horizontal) {
            (Horizontal::Terms { names, .. }, _) => {
                // Where the names would run into one another, every second, third, … is written.
                let room = (self.right - LEFT) / names.len().max(1) as f64;
                let every = (26.0 / room).ceil().max(1.0) as usize;
                for (i, name) in names.iter().enumerate() {
                    tick(self.x(i as f64), (i % every == 0).then_some(name));
                }
            }
            (Horizontal::Log(name), scale) => {
                for t in scale.map(LogScale::ticks).unwrap_or_default() {
                    let text = t.labelled.then(|| label(t.value));
                    tick(self.x(t.value), text.as_deref());
                }
                let middle = rounded((LEFT + self.right) / 2.0);
                let at: Attributes = &[
                    ("x", &middle),
                    ("y", &(self.size.height - 6.0)),
                    ("text-anchor", &"middle"),
                    ("font-size", &11),
                    ("opacity", &0.75),
                ];
                m.line("text", at, name);
            }
        }
    }

    fn draw_series(&self, m: &mut Markup, series: &Series) {
        let colour = colour(series.colour);
        let place = |p: &Point| (rounded(self.x(p.x)), rounded(self.y(p.y)));
        let joined = |b: &Point| match self.chart.horizontal {
            Horizontal::Terms { joined, .. } => b.x < joined as f64,
            Horizontal::Log(_) => true,
        };
        let runs = series.points.chunk_by(|a, b| drawable(a.y) && drawable(b.y) && joined(b));
        for run in runs.filter(|run| drawable(run[0].y)) {
            if run.iter().all(|p| p.interval.is_some()) {
                let edge = |p: &Point, end: f64| (rounded(self.x(p.x)), rounded(self.y(end)));
                let upper = run.iter().map(|p| edge(p, p.interval.map_or(p.y, |i| finite_or(i.1, p.y))));
                let lower = run.iter().rev().map(|p| edge(p, p.interval.map_or(p.y, |i| finite_or(i.0, p.y))));
                let band = coordinates(upper.chain(lower));
                // The band of a point that stands alone has no width: it is an upright line.
                let stroke = if run.len() == 1 { 5 } else { 0 };
                m.leaf(
                    "polygon",
                    &[
                        ("points", &band),
                        ("fill", &colour),
                        ("stroke", &colour),
                        ("stroke-width", &stroke),
                        ("opacity", &0.18),
                    ],
                );
            }
            if series.fit.is_none() {
                let points = coordinates(run.iter().map(place));
                m.leaf(
                    "polyline",
                    &[("points", &points), ("fill", &"none"), ("stroke", &colour), ("stroke-width", &1.6)],
                );
            }
            for p in run {
                mark(m, series.colour, place(p));
            }
        }
        self.draw_fit(m, series);
    }

    /// The fitted power law over the points that are drawn; it takes the place of the line that would join them.
    fn draw_fit(&self, m: &mut Markup, series: &Series) {
        let Some((slope, intercept)) = series.fit else { return };
        let drawn: Vec<f64> = series.points.iter().filter(|p| drawable(p.y)).map(|p| p.x).collect();
        let [Some(&first), Some(&last)] = [drawn.first(), drawn.last()] else { return };
        let value = |x: f64| (intercept + slope * x.ln()).exp();
        if !drawable(value(first)) || !drawable(value(last)) {
            return;
        }
        let [a, b] = [first, last].map(|x| (rounded(self.x(x)), rounded(self.y(value(x)))));
        let ends: Attributes = &[
            ("x1", &a.0),
            ("y1", &a.1),
            ("x2", &b.0),
            ("y2", &b.1),
            ("stroke", &colour(series.colour)),
            ("stroke-width", &1.6),
        ];
        m.leaf("line", ends);
    }

    /// Labels beside the last points, moved apart where they would overlap, with their marks.
    fn draw_labels(&self, m: &mut Markup) {
        let last = |s: &'a Series| s.points.iter().rev().find(|p| drawable(p.y)).map(|p| (self.y(p.y), p, s));
        let mut labels: Vec<_> = self.chart.series.iter().filter_map(last).collect();
        labels.sort_by(|a, b| a.0.total_cmp(&b.0));
        let ys =
            spread(&labels.iter().map(|l| l.0).collect::<Vec<_>>(), LABEL_LINE, TOP + 4.0, self.size.height - BOTTOM);
        for ((from, point, series), y) in labels.into_iter().zip(ys) {
            let (x, y) = (rounded(self.right + 6.0), rounded(y));
            let start = rounded(self.x(point.x) + 4.0);
            let leader = coordinates([(start, rounded(from)), (x, y)].into_iter());
            group(m, series, |m| {
                m.leaf(
                    "polyline",
                    &[("points", &leader), ("fill", &"none"), ("stroke", &"currentColor"), ("opacity", &0.25)],
                );
                mark(m, series.colour, (x + 5.0, y));
                m.line("text", &[("x", &(x + 12.0)), ("y", &(y + 4.0))], shortened(&series.label));
            });
        }
    }
}

/// What belongs to a series, so that a page can show it or not.
fn group(m: &mut Markup, series: &Series, content: impl FnOnce(&mut Markup)) {
    m.element("g", &[("data-series", &series.colour), ("data-name", &brief(&series.name))], content);
}

/// Values at least `distance` apart, in order, within `[low, high]` as far as there is room, close to the wanted ones (rising).
fn spread(wanted: &[f64], distance: f64, low: f64, high: f64) -> Vec<f64> {
    let mut places = wanted.to_vec();
    let mut least = low;
    for y in &mut places {
        *y = y.max(least);
        least = *y + distance;
    }
    let mut most = high;
    for y in places.iter_mut().rev() {
        *y = y.min(most);
        most = *y - distance;
    }
    places
}

fn finite_or(value: f64, otherwise: f64) -> f64 {
    if value.is_nan() { otherwise } else { value }
}

fn shortened(label: &str) -> String {
    if label.chars().count() <= MAX_LABEL {
        return label.to_owned();
    }
    label.chars().take(MAX_LABEL - 1).chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(points: &[(f64, f64, (f64, f64))]) -> Chart {
        let points = points.iter().map(|&(x, y, interval)| Point { x, y, interval: Some(interval) }).collect();
        Chart {
            title: "<b>T²E</b>".to_owned(),
            horizontal: Horizontal::Log("samples".to_owned()),
            vertical: "variance".to_owned(),
            series: vec![Series {
                name: "a".to_owned(),
                label: "a\"b".to_owned(),
                colour: 0,
                points,
                fit: Some((-1.0, 0.0)),
            }],
        }
    }

    fn is_sound(svg: &str) -> bool {
        !svg.contains("NaN") && !svg.contains("inf") && svg.contains("viewBox") && !svg.contains("<b>")
    }

    #[test]
    fn values_without_a_logarithm_break_the_line_and_nothing_else() {
        let broken = chart(&[
            (1.0, 4.0, (3.0, f64::INFINITY)),
            (2.0, 0.0, (0.0, 0.0)),
            (4.0, 1.0, (-1.0, 2.0)),
            (8.0, f64::NAN, (f64::NAN, f64::NAN)),
            (16.0, 0.25, (f64::NAN, 0.5)),
        ]);
        let svg = broken.file();
        assert!(is_sound(&svg), "{svg}");
        assert_eq!(svg.matches("<polygon").count(), 3);
        assert_eq!(broken.left_out(), ["a\"b at 2 and 8"]);
    }

    #[test]
    fn one_point_no_point_and_no_series_are_charts_too() {
        let mut empty = chart(&[]);
        assert!(is_sound(&chart(&[(1.0, 1.0, (1.0, 1.0))]).file()) && is_sound(&empty.file()));
        empty.series.clear();
        empty.horizontal = Horizontal::Terms { names: Vec::new(), joined: 0 };
        assert!(is_sound(&empty.file()));
    }

    #[test]
    fn extreme_values_stay_on_the_chart() {
        let svg = chart(&[(1.0, 1e308, (1e-300, f64::MAX)), (2.0, 1e-307, (0.0, 1.0))]).file();
        assert!(is_sound(&svg), "{svg}");
    }

    #[test]
    fn labels_are_moved_apart_and_stay_inside() {
        let places = spread(&[10.0, 11.0, 12.0, 99.0, 99.5], 10.0, 0.0, 100.0);
        assert!(places.windows(2).all(|w| w[1] - w[0] >= 10.0 - 1e-9) && places[4] <= 100.0 && places[0] >= 0.0);
    }
}
