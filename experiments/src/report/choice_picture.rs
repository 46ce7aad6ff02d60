//! Who does which orders, as a picture: a row a run, a column an order, the regions of the image by their samples, and beside them what each run takes
//! and leaves.

use crate::budget::file_name;
use crate::choice::ChosenRun;
use crate::export::markup::Markup;
use crate::export::notation::brief;
use crate::plot::pen::{self, STYLE, Sheet, colour, line, rounded};
use crate::result::ChoiceRow;

/// Width of a letter of the methods' names, and of the least room for these; of an order's column, of bars and of an image's map, height of a row, the room between, and width of the words above the last bars
/// \[SVG units\].
const LETTER: f64 = 7.0;
const NAMES: f64 = 72.0;
const COLUMN: f64 = 26.0;
const BARS: f64 = 130.0;
const MAP: f64 = 24.0;
const ROW: f64 = 28.0;
const GAP: f64 = 18.0;
const WORDS: f64 = 190.0;
const TOP: f64 = 40.0;

/// The picture as a file of its own. `methods` are those of the scene's plots, whose colours it has.
pub fn file(row: &ChoiceRow, methods: &[&str]) -> String {
    pen::file(&svg(row, methods, Some(STYLE)))
}

/// The picture.
pub fn svg(row: &ChoiceRow, methods: &[&str], style: Option<&'static str>) -> Markup {
    let layers = layers(row);
    let longest = row.choice.runs.iter().map(|run| run.run.label().chars().count()).max().unwrap_or(0);
    let names = NAMES.max(longest as f64 * LETTER + GAP);
    let maps = names + layers.len() as f64 * COLUMN + GAP;
    let divided = row.choice.runs.iter().any(|run| run.run.regions.is_some());
    let time = if divided { maps + MAP + 2.0 * GAP } else { maps };
    let variance = time + GAP + BARS;
    let size = (variance + WORDS, TOP + row.choice.runs.len() as f64 * ROW + 6.0);
    let label = title(row);
    let all = row.choice.runs.iter().map(|run| run.variance).chain(row.variances.iter().copied());
    let most = all.filter(|v| v.is_finite()).fold(f64::MIN_POSITIVE, f64::max);
    Sheet { label: &label, size, font_size: 12, style }.draw(|m| {
        let above_maps = if divided { "regions" } else { "" };
        for (x, words) in [
            (names, "orders"),
            (maps, above_maps),
            (time, "part of the time"),
            (variance, "variance: predicted, measured"),
        ] {
            m.line("text", &[("x", &x), ("y", &14), ("font-size", &11), ("opacity", &0.75)], words);
        }
        for (i, layer) in layers.iter().enumerate() {
            let x = names + (i as f64 + 0.5) * COLUMN;
            m.line("text", &[("x", &x), ("y", &(TOP - 8.0)), ("text-anchor", &"middle")], layer);
        }
        for (i, (run, measured)) in row.choice.runs.iter().zip(&row.variances).enumerate() {
            let y = TOP + i as f64 * ROW;
            // As the plan names methods that differ by settings.
            let planned = file_name(run.run.label().trim_end_matches(')'));
            let colour = colour(methods.iter().position(|name| *name == planned).unwrap_or(methods.len() + i));
            m.line("text", &[("x", &0), ("y", &(y + 16.0)), ("font-weight", &600)], run.run.label());
            for (j, layer) in layers.iter().enumerate() {
                let (x, has) = (names + j as f64 * COLUMN, run.layers.contains(layer));
                let opacity = if has { 1.0 } else { 0.08 };
                rectangle(
                    m,
                    (x + 2.0, y + 1.0),
                    (COLUMN - 4.0, ROW - 6.0),
                    if has { colour } else { "currentColor" },
                    opacity,
                );
            }
            map(m, run, (maps, y + 1.0), colour);
            rectangle(m, (time, y + 3.0), (BARS * run.time, ROW - 10.0), colour, 1.0);
            rectangle(m, (variance, y + 2.0), (BARS * run.variance / most, 9.0), colour, 0.45);
            rectangle(m, (variance, y + 12.0), (BARS * measured / most, 9.0), colour, 1.0);
        }
        for x in [time, variance] {
            line(m, (x, TOP), (x, size.1 - 6.0), 0.5);
        }
    })
}

/// A run's regions, the fuller the more of its samples they have.
fn map(m: &mut Markup, run: &ChosenRun, (x, y): (f64, f64), colour: &str) {
    let Some(regions) = &run.run.regions else { return };
    let ((columns, rows), weights) = (regions.size(), regions.weights());
    let most = weights.iter().copied().fold(0.0, f64::max);
    let cell = (MAP / columns as f64, MAP / rows as f64);
    rectangle(m, (x, y), (MAP, MAP), "currentColor", 0.08);
    for (i, weight) in weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0) {
        let corner = (x + (i % columns) as f64 * cell.0, y + (i / columns) as f64 * cell.1);
        rectangle(m, corner, cell, colour, rounded(0.15 + 0.85 * weight / most));
    }
}

/// What the picture shows.
pub fn title(row: &ChoiceRow) -> String {
    format!("{}: which method estimates which orders", brief(&row.label))
}

/// All layers of all runs: orders by number, the tail last.
fn layers(row: &ChoiceRow) -> Vec<String> {
    let mut layers: Vec<String> = row.choice.runs.iter().flat_map(|run| run.layers.iter().cloned()).collect();
    layers.sort_by_key(|label| label.parse().unwrap_or(usize::MAX));
    layers
}

/// A filled rectangle from a corner on; none where a size is not known.
fn rectangle(m: &mut Markup, (x, y): (f64, f64), (width, height): (f64, f64), fill: &str, opacity: f64) {
    if width.is_finite() && width > 0.0 {
        let [x, y, width, height] = [x, y, width.max(0.5), height].map(rounded);
        m.leaf(
            "rect",
            &[
                ("x", &x),
                ("y", &y),
                ("width", &width),
                ("height", &height),
                ("fill", &fill),
                ("fill-opacity", &opacity),
            ],
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::choice::Choice;
    use integrators::composite::{Regions, Run};

    #[test]
    fn every_order_has_one_run_and_what_is_unknown_has_no_bar() {
        let run = |method: &str, layers: &[&str], time: f64, regions: Option<Regions>| ChosenRun {
            run: Run {
                method: method.to_owned(),
                settings: serde_json::Map::new(),
                orders: layers[0].to_owned(),
                tail: false,
                share: 0.5,
                regions,
            },
            layers: layers.iter().map(|&layer| layer.to_owned()).collect(),
            time,
            variance: time,
            single: None,
        };
        let regions = Regions::read("1,2/0,0").ok();
        let row = ChoiceRow {
            scene: "room".to_owned(),
            label: "composite".to_owned(),
            choice: Choice {
                runs: vec![run("light", &["10", "2", "tail"], 0.25, None), run("path", &["0"], 0.75, regions)],
                single: "path".to_owned(),
                gain: None,
                gain_interval: None,
                left_out: Vec::new(),
                pilot_seconds: 1.0,
            },
            gain: None,
            variances: vec![1.0, f64::NAN],
        };
        assert_eq!(layers(&row), ["0", "2", "10", "tail"]);
        let svg = file(&row, &["path", "light"]);
        // Two runs of four cells; a map with two regions; a time and a predicted variance for each, and one measured variance.
        assert_eq!(svg.matches("<rect").count(), 2 * 4 + 3 + 2 * 2 + 1);
        assert_eq!(svg.matches("fill-opacity=\"0.08\"").count(), 5);
        assert!(!svg.contains("NaN"));
    }
}
