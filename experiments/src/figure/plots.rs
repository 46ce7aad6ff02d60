//! A plot of what the records of results tell: a quantity by order, or against samples or seconds.

use super::file::{Axis, FigureFile, PlotTable};
use super::records::{StoredRecord, Told, blamed, distinct};
use crate::error::{Error, unknown};
use crate::export::markup::{Attributes, Markup};
use crate::export::notation::{brief, symbol};
use crate::plot::chart::{Chart, Horizontal, Point, Series};
use crate::plot::pen::Size;
use crate::plot::{pen, two_digits};
use crate::source::Source;
use integrators::Layer;
use std::path::Path;

/// Units of a plot in a millimetre, so that its letters are 6.7 points high.
const UNITS: f64 = 430.0 / 85.0;

/// Draws the plot that a figure's file asks for.
///
/// # Errors
/// If the results do not tell what is asked for, with the line that asks.
pub fn draw(source: &Source, figure: &FigureFile, plot: &PlotTable) -> Result<String, Error> {
    let at = |key: &str| format!("plot.{key}");
    let folder = source.path.as_deref().and_then(Path::parent).unwrap_or(Path::new(""));
    let told = Told::read(&folder.join(&plot.results)).map_err(blamed(source, at("results")))?;
    let scenes = distinct(told.records.iter().map(|row| row.scene.as_str()));
    let scene = chosen(plot.scene.as_ref(), &scenes, "scene").map_err(blamed(source, at("scene")))?;
    let rows: Vec<&StoredRecord> =
        told.records.iter().filter(|row| row.scene == scene && row.channel == "all").collect();
    let quantities = distinct(rows.iter().filter(|row| !row.order.is_empty()).map(|row| row.quantity.as_str()));
    let quantity = chosen(Some(&plot.quantity), &quantities, "quantity").map_err(blamed(source, at("quantity")))?;
    let slopes = rows.iter().filter(|row| row.quantity == slope_of(plot)).copied().collect::<Vec<_>>();
    let rows: Vec<&StoredRecord> = rows.into_iter().filter(|row| row.quantity == quantity).collect();
    let methods = distinct(rows.iter().map(|row| row.method.as_str()));
    let methods = several(plot.methods.as_deref(), &methods, "method").map_err(blamed(source, at("methods")))?;
    let known = distinct(rows.iter().map(|row| row.order.as_str()));
    let of_terms = plot.over == Axis::Order;
    let total = known.contains(&"total").then(|| vec!["total".to_owned()]).filter(|_| !of_terms);
    let orders = plot.orders.clone().or(total);
    let orders = several(orders.as_deref(), &known, "order").map_err(blamed(source, at("orders")))?;
    let drawn = Drawn { plot, rows: &rows, slopes: &slopes, orders: &orders, methods: &methods };
    let size = Size { width: figure.width * UNITS, height: plot.height * UNITS };
    let title = plot.title.clone().unwrap_or_else(|| brief(&scene.replace('_', " ")));
    let horizontal = match plot.over {
        Axis::Order => Horizontal::Terms {
            names: orders.iter().map(|order| term(order)).collect(),
            joined: orders.iter().filter(|order| order.parse::<usize>().is_ok()).count(),
        },
        Axis::Samples => Horizontal::Log("samples per pixel of a replicate".to_owned()),
        Axis::Seconds => Horizontal::Log("seconds of a replicate".to_owned()),
    };
    let chart = Chart { title, horizontal, vertical: vertical(quantity), series: drawn.series() };
    let (width, height) = (format!("{}mm", figure.width), format!("{}mm", plot.height));
    let view = format!("0 0 {} {}", size.width, size.height);
    let attributes: Attributes = &[
        ("xmlns", &"http://www.w3.org/2000/svg"),
        ("viewBox", &view),
        ("width", &width),
        ("height", &height),
        ("color", &pen::INK),
    ];
    let mut m = Markup::default();
    m.element("svg", attributes, |m| m.append(&chart.printed(size)));
    Ok(m.as_str().to_owned())
}

/// One of the names that there are: the one asked for, or the first.
fn chosen<'n>(asked: Option<&String>, names: &[&'n str], kind: &str) -> Result<&'n str, String> {
    match asked {
        Some(asked) => {
            let found = names.iter().find(|name| *name == asked).copied();
            found.ok_or_else(|| unknown(kind, asked, names))
        }
        None => names.first().copied().ok_or_else(|| format!("the records tell of no {kind}")),
    }
}

/// Those of the names that are asked for, as they are asked for; all where none is.
fn several<'n>(asked: Option<&[String]>, names: &[&'n str], kind: &str) -> Result<Vec<&'n str>, String> {
    let Some(asked) = asked else { return Ok(names.to_vec()) };
    asked.iter().map(|asked| chosen(Some(asked), names, kind)).collect()
}

/// An order of the records as figures write it.
fn term(order: &str) -> String {
    match (order, order.parse()) {
        ("total", _) => symbol(None),
        ("tail", _) => symbol(Some(Layer::Tail)),
        (_, Ok(order)) => symbol(Some(Layer::Order(order))),
        (other, _) => brief(other),
    }
}

/// What the vertical axis shows.
fn vertical(quantity: &str) -> String {
    match quantity {
        "variance" => "variance of one sample, image mean".to_owned(),
        "efficiency" => "1 / (variance of a replicate × its seconds) [1/s]".to_owned(),
        "checkpoint_variance" => "variance of a replicate, with 95 % interval".to_owned(),
        "mse" => "mean squared error of a replicate, with 95 % interval".to_owned(),
        "relmse" => "relative mean squared error of a replicate, with 95 % interval".to_owned(),
        other => other.replace('_', " "),
    }
}

/// The quantity of the slopes that belong to a plot.
fn slope_of(plot: &PlotTable) -> &'static str {
    match (plot.over, plot.quantity.as_str()) {
        (Axis::Samples, "checkpoint_variance") => "slope",
        (Axis::Seconds, "checkpoint_variance") => "slope_seconds",
        _ => "",
    }
}

/// What is drawn.
struct Drawn<'a> {
    plot: &'a PlotTable,
    rows: &'a [&'a StoredRecord],
    slopes: &'a [&'a StoredRecord],
    orders: &'a [&'a str],
    methods: &'a [&'a str],
}

impl Drawn<'_> {
    /// A line for every method, and against samples or seconds for every order of it.
    fn series(&self) -> Vec<Series> {
        let samplers = distinct(self.rows.iter().map(|row| row.sampler.as_str()));
        let (mut series, mut colour) = (Vec::new(), 0);
        for (&method, &sampler) in self.methods.iter().flat_map(|m| samplers.iter().map(move |s| (m, s))) {
            let name = if samplers.len() > 1 { format!("{method}, {sampler}") } else { method.to_owned() };
            let of = |order: &str| {
                let own = |row: &&&StoredRecord| row.method == method && row.sampler == sampler && row.order == order;
                (self.rows.iter().filter(own).copied().collect::<Vec<_>>(), self.slopes.iter().find(own).copied())
            };
            let lines: Vec<(String, Vec<Point>)> = match self.plot.over {
                Axis::Order => {
                    let point = |(x, order): (usize, &&str)| {
                        let row = of(order).0.first().copied();
                        Point {
                            x: x as f64,
                            y: row.map_or(0.0, |row| row.value),
                            interval: row.and_then(StoredRecord::interval),
                        }
                    };
                    vec![(name, self.orders.iter().enumerate().map(point).collect())]
                }
                axis => self.orders.iter().map(|order| self.against(axis, &name, order, of(order))).collect(),
            };
            for (label, points) in lines.into_iter().filter(|(_, points)| points.iter().any(|point| point.y != 0.0)) {
                series.push(Series { name: label.clone(), label, colour, points, fit: None });
                colour += 1;
            }
        }
        series
    }

    /// A method's order against samples or seconds, with the slope that was fitted.
    fn against(
        &self,
        axis: Axis,
        name: &str,
        order: &str,
        (rows, slope): (Vec<&StoredRecord>, Option<&StoredRecord>),
    ) -> (String, Vec<Point>) {
        let mut parts = Vec::new();
        if self.methods.len() > 1 || self.orders.len() == 1 {
            parts.push(name.to_owned());
        }
        if self.orders.len() > 1 {
            parts.push(term(order));
        }
        if let Some(slope) = slope {
            parts.push(two_digits(slope.value));
        }
        let point = |row: &&StoredRecord| {
            let replicates = f64::from(row.replicates.max(1));
            let x = if axis == Axis::Samples { row.spp as f64 / replicates } else { row.seconds / replicates };
            Point { x, y: row.value, interval: row.interval() }
        };
        let mut points: Vec<Point> = rows.iter().map(point).collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        (parts.join(" "), points)
    }
}
