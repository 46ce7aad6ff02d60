//! What a report says of samplers: on integrals of known value, and against one another in scenes.

use super::numbers::short;
use super::screens::{self, Look};
use super::summary::{Sentence, plain, warning};
use super::tables::{head, number_cell, order_head, scrolling};
use crate::agreement::DISCOVERY_RATE;
use crate::export::markup::Markup;
use crate::export::notation::{brief, enumerated};
use crate::export::{ExportError, write_atomically};
use crate::plot::{self, Figure, points, two_digits};
use crate::ratio;
use crate::result::{ExperimentResult, IntegralResult, MethodResult, RatioRow};
use crate::statistics::multiple::benjamini_hochberg;
use integrators::Layer;
use sampling::sampler::SamplerKind;
use std::path::Path;

/// The integrals of an experiment with all that is derived from them.
pub struct Integrals<'a> {
    /// The samplers, the first being what others are compared with.
    pub samplers: Vec<SamplerKind>,
    /// What their errors look like.
    pub screens: Vec<Look>,
    /// Error against samples, an integral each.
    pub charts: Vec<Figure>,
    results: &'a [IntegralResult],
}

impl<'a> Integrals<'a> {
    /// Derives what is shown; `None` where no integrals were measured.
    pub fn of(result: &'a ExperimentResult) -> Option<Self> {
        let results = result.integrals.as_slice();
        let mut samplers: Vec<SamplerKind> = results.iter().map(|r| r.sampler).collect();
        samplers.dedup();
        if results.is_empty() {
            return None;
        }
        Some(Self { screens: screens::looks(&samplers), charts: plot::integrals(results), samplers, results })
    }

    /// Writes the plots and pictures as files of their own.
    ///
    /// # Errors
    /// If one can't be written.
    pub fn write(&self, plots: &Path) -> Result<(), ExportError> {
        for figure in &self.charts {
            write_atomically(&plots.join(format!("{}.svg", figure.file)), figure.chart.file().as_bytes())?;
        }
        write_atomically(&plots.join("samplers_points.svg"), points::file(&self.samplers).as_bytes())?;
        screens::sheet(&self.screens).write(&plots.join("samplers_screens.png"))
    }

    /// Whether means are right, and how much better each sampler is than the first.
    pub fn sentences(&self) -> Vec<Sentence> {
        let mut sentences = vec![self.bias()];
        for &sampler in self.samplers.iter().skip(1) {
            let ratios: Vec<f64> = self.of_sampler(sampler).filter_map(|r| Some(self.ratio(r)?.0)).collect();
            let Some(last) = self.of_sampler(sampler).find_map(|r| r.points.last()) else { continue };
            let (least, most) = ratios.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), &r| (a.min(r), b.max(r)));
            let worse = self.of_sampler(sampler).filter(|r| self.ratio(r).is_some_and(|(_, ci)| ci.0 > 1.0));
            let worse: Vec<String> = worse.map(|r| r.integral.clone()).collect();
            let where_worse = if worse.is_empty() { "nowhere".to_owned() } else { format!("at {}", enumerated(worse)) };
            sentences.push(plain(format!(
                "{sampler}: with {} samples, {} to {} times the root mean squared error of {}; significantly more {where_worse}.",
                last.samples,
                short(least),
                short(most),
                self.samplers[0]
            )));
        }
        sentences
    }

    fn bias(&self) -> Sentence {
        let tests = self.results.iter().flat_map(|r| r.points.iter().zip(&r.p).map(move |(point, &p)| (r, point, p)));
        let tests: Vec<_> = tests.collect();
        let adjusted = benjamini_hochberg(&tests.iter().map(|t| t.2).collect::<Vec<_>>());
        let found = tests.iter().zip(adjusted).filter(|(_, p)| *p <= DISCOVERY_RATE);
        let names: Vec<String> =
            found.map(|((r, point, _), _)| format!("{} by {} at {}", r.integral, r.sampler, point.samples)).collect();
        if names.is_empty() {
            return plain(format!("All {} means are, as far as can be told, the known values.", tests.len()));
        }
        warning(format!("Of {} means, these are not the known values: {}.", tests.len(), names.join(", ")))
    }

    fn of_sampler(&self, sampler: SamplerKind) -> impl Iterator<Item = &'a IntegralResult> {
        self.results.iter().filter(move |r| r.sampler == sampler)
    }

    fn ratio(&self, result: &IntegralResult) -> Option<(f64, (f64, f64))> {
        let first = self.of_sampler(self.samplers[0]).find(|r| r.integral == result.integral)?;
        ratio::of_integral(result, first)
    }

    /// Errors relative to the first sampler's, and slopes.
    pub fn tables(&self, m: &mut Markup) {
        let most = self.results.iter().flat_map(|r| &r.points).map(|p| p.samples).max().unwrap_or(0);
        let first = self.samplers[0];
        let caption = format!(
            "Root mean squared error with {most} samples: of {first}, and of the others relative to it, with 95 % bootstrap intervals"
        );
        self.table(m, &caption, &|m, result| match self.ratio(result).filter(|_| result.sampler != first) {
            Some((ratio, ci)) => ratio_cell(m, ratio, ci),
            None => match result.points.last() {
                Some(point) => number_cell(m, point.variance.sqrt(), short(point.variance.sqrt())),
                None => m.line("td", &[("class", &"number")], "—"),
            },
        });
        let caption = "Slope of log mean squared error against log samples: estimate and 95 % bootstrap interval. Independent samples have −1";
        self.table(m, caption, &|m, result| match result.slope {
            Some(line) => {
                let written = format!("{} [{:.2}, {:.2}]", two_digits(line.slope), line.ci.0, line.ci.1);
                number_cell(m, line.slope, written.replace('-', "−"));
            }
            None => m.line("td", &[("class", &"number")], "—"),
        });
    }

    /// A row an integral, a column a sampler.
    fn table(&self, m: &mut Markup, caption: &str, cell: &dyn Fn(&mut Markup, &IntegralResult)) {
        scrolling(m, caption, |m| {
            m.line("caption", &[], caption);
            head(m, "integral", "number", self.samplers.iter());
            m.element("tbody", &[], |m| {
                for first in self.of_sampler(self.samplers[0]) {
                    m.element("tr", &[], |m| {
                        m.line("th", &[("scope", &"row")], first.integral.replace('_', " "));
                        self.results.iter().filter(|r| r.integral == first.integral).for_each(|r| cell(m, r));
                    });
                }
            });
        });
    }
}

/// The errors of every sampler in a scene, relative to those of the first: a row an order.
pub fn ratios(m: &mut Markup, rows: &[&RatioRow], methods: &[&MethodResult], columns: &[Option<Layer>]) {
    let Some(first) = rows.first() else { return };
    let compared: Vec<&&MethodResult> = methods.iter().filter(|m| rows.iter().any(|r| r.label == m.label)).collect();
    let caption = format!(
        "Root mean squared error with {} samples per pixel relative to the same method with the first sampler ({}), with 95 % bootstrap \
         intervals",
        first.samples,
        brief(&first.baseline)
    );
    scrolling(m, "Errors of samplers", |m| {
        m.line("caption", &[], caption);
        head(m, "order", "number", compared.iter().map(|m| &m.label));
        m.element("tbody", &[], |m| {
            for &column in columns {
                m.element("tr", &[], |m| {
                    order_head(m, column);
                    for method in &compared {
                        match rows.iter().find(|r| r.label == method.label && r.order == column) {
                            Some(row) => ratio_cell(m, row.ratio, row.ci),
                            None => m.line("td", &[("class", &"number")], "—"),
                        }
                    }
                });
            }
        });
    });
}

/// A ratio of errors; marked where the interval lies below 1, or above.
fn ratio_cell(m: &mut Markup, ratio: f64, ci: (f64, f64)) {
    let class = match ci {
        (_, high) if high < 1.0 => "number agree",
        (low, _) if low > 1.0 => "number differ",
        _ => "number",
    };
    let written = format!("{} [{}, {}]", short(ratio), short(ci.0), short(ci.1));
    m.element("td", &[("class", &class)], |m| m.line("data", &[("value", &ratio)], written));
}
