//! Plots as SVG: variance, efficiency and convergence on logarithmic axes, with intervals and direct labels.
//!
//! [`scale`] places ticks, [`chart`] draws any chart, and this file says which charts an experiment has; [`points`] shows the points
//! of samplers.
//!
//! The drawing is our own: these few kinds of chart need a `viewBox`, text in the page's own colour so that light and dark
//! both work, series broken where a value can't stand on a logarithmic axis, and labels beside the lines. A plotting crate
//! would have to be corrected in each of these, and the leanest one takes longer to build than the rest of this program.

pub mod chart;
pub mod pen;
pub mod points;
pub mod scale;

use crate::export::notation::{brief, symbol};
use crate::record::judged::layers;
use crate::report::numbers::{Numbers, Row};
use crate::result::{Checkpoint, IntegralResult, MethodResult, SlopeRow};
use crate::statistics::Interval;
use chart::{Chart, Horizontal, Point, Series};
use integrators::Layer;

/// A chart and the name of its file, without ending.
pub struct Figure {
    /// Such as `cornell_box_variance`.
    pub file: String,
    /// What is drawn.
    pub chart: Chart,
}

/// A value and its interval.
type Shown = (f64, Option<Interval>);

/// The charts of one scene, order by order: variance of one sample, and efficiency, of the methods that carry all of its light.
pub fn by_order(scene: &str, methods: &[&MethodResult], numbers: &Numbers) -> Vec<Figure> {
    let joined = numbers.columns.iter().filter(|c| matches!(c, Some(Layer::Order(_)))).count();
    let chart = |name: &str, title: &str, vertical: &str, value: fn(&Row) -> Option<Shown>| {
        let series = methods.iter().zip(&numbers.rows).enumerate().map(|(colour, (method, rows))| {
            let point = |(x, row): (usize, &Option<Row>)| {
                let shown = row.as_ref().filter(|row| row.complete).and_then(value);
                let (y, interval) = shown.unwrap_or((0.0, None));
                Point { x: x as f64, y, interval }
            };
            Series {
                name: method.label.clone(),
                label: method.label.clone(),
                colour,
                points: rows.iter().enumerate().map(point).collect(),
                fit: None,
            }
        });
        Figure {
            file: format!("{scene}_{name}"),
            chart: Chart {
                title: title.to_owned(),
                horizontal: Horizontal::Terms { names: numbers.columns.iter().map(|&c| symbol(c)).collect(), joined },
                vertical: vertical.to_owned(),
                series: series.collect(),
            },
        }
    };
    vec![
        chart("variance", "Variance by order", "variance of one sample, image mean", |row| {
            row.variance.filter(|_| !row.exact).map(|v| (v, row.intervals[0]))
        }),
        chart("efficiency", "Efficiency by order", "1 / (variance of a replicate × its seconds) [1/s]", |row| {
            row.efficiency.map(|e| (e, row.intervals[1]))
        }),
    ]
}

/// The charts of the times to errors, order by order; none where nothing was judged.
pub fn times(scene: &str, methods: &[&MethodResult], numbers: &Numbers, targets: &[f64]) -> Vec<Figure> {
    let joined = numbers.columns.iter().filter(|c| matches!(c, Some(Layer::Order(_)))).count();
    let judged = methods.iter().any(|method| method.judged.is_some());
    let chart = |(place, target): (usize, &f64)| {
        let series = methods.iter().enumerate().map(|(colour, method)| {
            let point = |(x, column): (usize, &Option<Layer>)| {
                let layer = layers(method).find(|(_, layer)| layer == column).map(|(i, _)| i);
                let time = method.judged.as_ref().zip(layer).map(|(judged, i)| judged.times[i][place]);
                let (y, interval) = time.map_or((0.0, None), |time| (time.seconds, time.interval));
                Point { x: x as f64, y, interval }
            };
            let points = numbers.columns.iter().enumerate().map(point).collect();
            Series { name: method.label.clone(), label: method.label.clone(), colour, points, fit: None }
        });
        Figure {
            file: format!("{scene}_time_to_error_{}", target.to_string().replace('.', "_")),
            chart: Chart {
                title: format!("Time to a relMSE of {target}"),
                horizontal: Horizontal::Terms { names: numbers.columns.iter().map(|&c| symbol(c)).collect(), joined },
                vertical: "seconds, with 95 % interval".to_owned(),
                series: series.collect(),
            },
        }
    };
    targets.iter().enumerate().filter(|_| judged).map(chart).collect()
}

/// What variance falls against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Against {
    /// Samples per pixel.
    Samples,
    /// Seconds of a replicate, as they went by.
    Seconds,
}

/// The charts of one scene's convergence: one an order and one of the sum, a line for each method.
pub fn convergence(
    scene: &str,
    methods: &[&MethodResult],
    slopes: &[SlopeRow],
    numbers: &Numbers,
    against: Against,
) -> Vec<Figure> {
    let measured = |column| methods.iter().any(|m| checkpoints(m, column).next().is_some());
    let columns = numbers.columns.iter().copied().filter(|&c| measured(c));
    columns
        .map(|column| {
            let series = methods.iter().enumerate().map(|(colour, method)| Series {
                colour,
                ..converging(method, column, method.label.clone(), slopes, against)
            });
            let name = column.map_or("sum".to_owned(), |layer| layer.name(99));
            let of = if against == Against::Seconds { "seconds_" } else { "" };
            convergence_figure(format!("{scene}_convergence_{of}{name}"), &symbol(column), against, series)
        })
        .collect()
}

/// The same, one chart a method, a line for each order and their sum.
pub fn convergence_of_methods(
    scene: &str,
    methods: &[&MethodResult],
    slopes: &[SlopeRow],
    numbers: &Numbers,
) -> Vec<Figure> {
    let measured = methods.iter().filter(|method| !method.convergence.is_empty());
    measured
        .map(|method| {
            let series = numbers.columns.iter().enumerate().map(|(colour, &column)| Series {
                colour,
                ..converging(method, column, symbol(column), slopes, Against::Samples)
            });
            let file = format!("{scene}_convergence_of_{}", method.label);
            convergence_figure(file, &method.label, Against::Samples, series)
        })
        .collect()
}

fn convergence_figure(file: String, of: &str, against: Against, series: impl Iterator<Item = Series>) -> Figure {
    let horizontal = match against {
        Against::Samples => "samples per pixel of a replicate",
        Against::Seconds => "seconds of a replicate",
    };
    Figure {
        file,
        chart: Chart {
            title: format!("Convergence of {}", brief(of)),
            horizontal: Horizontal::Log(horizontal.to_owned()),
            vertical: "variance of a replicate, with 95 % interval and fitted slope".to_owned(),
            series: series.filter(|s| !s.points.is_empty()).collect(),
        },
    }
}

/// A method's variance in a column, with the slope that was fitted; in the first colour.
fn converging(
    method: &MethodResult,
    column: Option<Layer>,
    name: String,
    slopes: &[SlopeRow],
    against: Against,
) -> Series {
    let row = slopes.iter().find(|s| s.scene == method.scene && s.label == method.label && s.order == column);
    let fit = row.and_then(|row| match against {
        Against::Samples => Some((row.slope, row.ci, row.intercept)),
        Against::Seconds => row.on_seconds.map(|line| (line.slope, line.ci, line.intercept)),
    });
    let x = |c: &Checkpoint| match against {
        Against::Samples => f64::from(c.samples),
        // Those that the slope is fitted to: without the first, which warms up, where there are more.
        Against::Seconds if c.replicate_seconds.is_empty() => c.seconds,
        Against::Seconds => c.replicate_seconds.iter().sum::<f64>() / c.replicate_seconds.len() as f64,
    };
    Series {
        label: fit.map_or_else(|| name.clone(), |(value, ci, _)| format!("{name} {}", slope(value, ci))),
        name,
        colour: 0,
        points: checkpoints(method, column).map(|c| Point { x: x(c), y: c.variance, interval: Some(c.ci) }).collect(),
        fit: fit.map(|(slope, _, intercept)| (slope, intercept)),
    }
}

fn checkpoints(method: &MethodResult, column: Option<Layer>) -> impl Iterator<Item = &Checkpoint> {
    method.convergence.iter().filter(move |c| c.order == column)
}

/// The charts of integrals of known value: one an integral, a line for each sampler.
pub fn integrals(results: &[IntegralResult]) -> Vec<Figure> {
    let mut names: Vec<&str> = results.iter().map(|r| r.integral.as_str()).collect();
    let mut seen = std::collections::HashSet::new();
    names.retain(|name| seen.insert(*name));
    let chart = |name: &str| {
        let of_integral = results.iter().filter(|r| r.integral == name);
        let series = of_integral.enumerate().map(|(colour, result)| Series {
            name: result.sampler.to_string(),
            label: result.slope.map_or_else(
                || result.sampler.to_string(),
                |line| format!("{} {}", result.sampler, slope(line.slope, line.ci)),
            ),
            colour,
            points: result
                .points
                .iter()
                .map(|p| Point { x: f64::from(p.samples), y: p.variance, interval: Some(p.ci) })
                .collect(),
            fit: result.slope.map(|line| (line.slope, line.intercept)),
        });
        Figure {
            file: format!("integral_{name}"),
            chart: Chart {
                title: name.replace('_', " "),
                horizontal: Horizontal::Log("samples per pixel of a replicate".to_owned()),
                vertical: "mean squared error, with 95 % interval and fitted slope".to_owned(),
                series: series.collect(),
            },
        }
    };
    names.into_iter().map(chart).collect()
}

/// `−1.00 ± 0.03`, the half width being that of the interval.
fn slope(slope: f64, ci: (f64, f64)) -> String {
    let half = (ci.1 - ci.0) / 2.0;
    let interval = if half.is_finite() { format!(" ± {half:.2}") } else { String::new() };
    format!("{}{interval}", two_digits(slope))
}

/// Two digits after the point, with a proper minus sign.
pub fn two_digits(x: f64) -> String {
    if x.is_finite() { format!("{x:.2}").replace('-', "−") } else { "—".to_owned() }
}
