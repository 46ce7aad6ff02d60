//! The viewer: linear values of every layer with their standard errors, to be looked at in the page.
//!
//! [`packing`] makes a layer small; this file gathers the layers of all scenes at a size that leaves the page below 15 MB, and writes
//! them into the page as texts that `viewer.js` reads. Without scripts nothing of it is seen.

pub mod packing;

use super::SceneReport;
use super::images::base64;
use crate::export::markup::Markup;
use crate::export::notation::{symbol, words};
use crate::export::png::{block_mean, column_exposure, exposure_of};
use crate::export::tone::Exposure;
use crate::reference::Truth;
use crate::result::{ExperimentResult, MethodResult};
use crate::statistics::means::student_quantile;
use integrators::{Layer, Measurement, Part, Quantity};
use packing::{Packed, pack};
use rayon::prelude::*;
use serde::Serialize;

/// All packed layers of a report together [bytes]; the text that they are embedded as is a third longer.
const MOST_BYTES: usize = 9_400_000;
/// Lit pixels beyond which packing need not be tried.
const MOST_PIXELS: usize = 8_000_000;
/// By how much images may be shrunk.
const MOST_SHRINK: usize = 64;
/// The 97.5 % quantile of the normal distribution, for a reference, whose replicates are too many to matter.
const NORMAL: f64 = 1.96;

/// The images of all scenes.
pub struct Images {
    /// So many pixels each way are averaged into one.
    pub shrink: usize,
    scenes: Vec<SceneImages>,
}

/// What `viewer.js` is told of a scene's images; it finds the layers' texts by their places.
#[derive(Serialize)]
struct SceneImages {
    scene: String,
    width: usize,
    height: usize,
    shrink: usize,
    columns: Vec<Column>,
    /// Which column is the sum.
    sum: usize,
    methods: Vec<MethodImages>,
    /// The methods shown first: the most efficient on the sum before the others.
    first: [usize; 2],
    /// Which of `methods` is none, but the reference.
    reference: Option<usize>,
    #[serde(skip)]
    packed: Vec<Packed>,
}

/// A layer that some method has: an order, the rest, the sum, or a part.
#[derive(Serialize)]
struct Column {
    symbol: String,
    words: String,
    /// What kind of part it is; empty for a term of the series or their sum.
    group: &'static str,
    /// The exposure that all methods share here; `None` where there is no light.
    stops: Option<i32>,
}

/// The images of a method, or of the reference.
#[derive(Serialize)]
struct MethodImages {
    label: String,
    /// Half the width of a 95 % interval in standard errors.
    quantile: f64,
    layers: Vec<LayerImage>,
}

#[derive(Serialize)]
struct LayerImage {
    column: usize,
    scale: f64,
    largest_error: Option<f64>,
    /// Which text holds it; `None` where all is black.
    at: Option<usize>,
}

/// A layer before it is packed.
struct Raw {
    means: Vec<[f64; 3]>,
    errors: Option<Vec<[f64; 3]>>,
}

impl Raw {
    fn of(m: &Measurement, layer: usize, shrink: usize) -> Self {
        let size = [m.width, m.height].map(|n| n as usize);
        let replicates = f64::from(m.replicates);
        let error = |pixel| m.variance(layer, pixel).unwrap_or_default().map(|v| (v / replicates).sqrt());
        Self {
            means: shrunk(size, shrink, |pixel| m.mean(layer, pixel)),
            errors: (m.replicates >= 2).then(|| shrunk(size, shrink, error)),
        }
    }

    fn of_truth(truth: &Truth, layer: Option<Layer>, shrink: usize) -> Self {
        let (means, variances) = truth.image(layer).unwrap_or_default();
        Self {
            means: shrunk(truth.size, shrink, |pixel| means[pixel]),
            errors: Some(shrunk(truth.size, shrink, |pixel| variances[pixel].map(f64::sqrt))),
        }
    }

    fn packed(&self) -> Packed {
        pack(&self.means, self.errors.as_deref())
    }
}

impl Images {
    /// Packs all scenes, every image shrunk by the smallest whole factor at which there is room for all.
    pub fn of(result: &ExperimentResult, scenes: &[SceneReport]) -> Self {
        let lit: usize = scenes.iter().flat_map(|scene| &scene.methods).map(|m| lit_pixels(&m.measurement)).sum();
        let mut shrink = 1;
        while lit / (shrink * shrink) > MOST_PIXELS && shrink < MOST_SHRINK {
            shrink += 1;
        }
        loop {
            let packed: Vec<SceneImages> = scenes.iter().map(|scene| SceneImages::of(result, scene, shrink)).collect();
            let bytes: usize = packed.iter().flat_map(|scene| &scene.packed).map(|layer| layer.bytes.len()).sum();
            if bytes <= MOST_BYTES || shrink >= MOST_SHRINK {
                return Self { shrink, scenes: packed };
            }
            shrink += 1;
        }
    }

    /// What reads the elements, and makes plots switchable.
    pub fn script() -> [&'static str; 5] {
        [
            include_str!("pixels.js"),
            include_str!("viewer.js"),
            include_str!("controls.js"),
            include_str!("input.js"),
            include_str!("plots.js"),
        ]
    }

    /// The element that `viewer.js` fills, with the texts of its layers in it.
    pub fn write(&self, m: &mut Markup, scene: usize) {
        let images = &self.scenes[scene];
        let index = serde_json::to_string(images).unwrap_or_default();
        m.element("div", &[("class", &"viewer"), ("hidden", &""), ("data-images", &index)], |m| {
            for layer in &images.packed {
                m.line("template", &[], base64(&layer.bytes));
            }
        });
    }
}

/// The two methods that are shown first.
fn first(scene: &SceneReport) -> [usize; 2] {
    let ranked: Vec<usize> = scene.numbers.ranking(scene.numbers.columns.len() - 1).iter().map(|r| r.0).collect();
    let others = (0..scene.methods.len()).filter(|method| !ranked.contains(method));
    let mut order = ranked.iter().copied().chain(others);
    let best = order.next().unwrap_or(0);
    [best, order.next().unwrap_or(best)]
}

fn lit_pixels(m: &Measurement) -> usize {
    let layers = m.layers.len() + m.parts.len();
    m.pixels() * (0..layers).filter(|&i| m.image_mean(i) != [0.0; 3]).count()
}

impl SceneImages {
    fn of(result: &ExperimentResult, scene: &SceneReport, shrink: usize) -> Self {
        let truth = result.references.iter().find(|r| r.scene == scene.name).map(|r| &*r.truth);
        let measurements: Vec<&Measurement> = scene.methods.iter().map(|m| &m.measurement).collect();
        let mut columns: Vec<Column> =
            scene.numbers.columns.iter().map(|&layer| Column::of_series(&measurements, layer)).collect();
        for m in &measurements {
            for (layer, part) in m.parts().filter(|(_, part)| is_image(part)) {
                let name = part.name(m.max_order);
                if !columns.iter().any(|column| column.symbol == name) {
                    columns.push(Column::of_part(m, layer, part, name));
                }
            }
        }
        let [width, height] =
            measurements.first().map_or([0; 2], |m| [m.width, m.height]).map(|n| (n as usize).div_ceil(shrink));
        let mut images = Self {
            scene: scene.name.to_owned(),
            width,
            height,
            shrink,
            columns,
            sum: scene.numbers.columns.len() - 1,
            methods: Vec::new(),
            first: first(scene),
            reference: truth.map(|_| scene.methods.len()),
            packed: Vec::new(),
        };
        for method in &scene.methods {
            let (m, layers) = (&method.measurement, images.layers_of(method));
            let quantile = student_quantile(f64::from(method.measurement.replicates.max(2)) - 1.0);
            images.add(method.title(), quantile, &layers, |&(_, layer)| Raw::of(m, layer, shrink));
        }
        if let Some(truth) = truth {
            let known = scene
                .numbers
                .columns
                .iter()
                .enumerate()
                .filter(|(_, layer)| layer.is_none_or(|layer| truth.layers.contains(&layer)));
            let known: Vec<(usize, Option<Layer>)> = known.map(|(column, &layer)| (column, layer)).collect();
            images.add("reference".to_owned(), NORMAL, &known, |&(_, layer)| Raw::of_truth(truth, layer, shrink));
        }
        images
    }

    /// The columns of a method's layers, and which layers these are.
    fn layers_of(&self, method: &MethodResult) -> Vec<(usize, usize)> {
        let m = &method.measurement;
        let column = |name: &str| self.columns.iter().position(|column| column.symbol == name);
        let series = m.layers.iter().enumerate().map(|(i, &layer)| (column(&symbol(Some(layer))), i));
        let parts = m.parts().filter(|(_, part)| is_image(part)).map(|(i, part)| (column(&part.name(m.max_order)), i));
        series.chain(parts).filter_map(|(column, layer)| Some((column?, layer))).collect()
    }

    /// Adds layers, each with its column first. As many as there are threads are in memory at once before they are packed.
    fn add<L: Sync>(
        &mut self,
        label: String,
        quantile: f64,
        layers: &[(usize, L)],
        raw: impl Fn(&(usize, L)) -> Raw + Sync,
    ) {
        let packed: Vec<Packed> = layers.par_iter().map(|layer| raw(layer).packed()).collect();
        let mut method = MethodImages { label, quantile, layers: Vec::new() };
        for (&(column, _), packed) in layers.iter().zip(packed) {
            let at = (!packed.bytes.is_empty()).then_some(self.packed.len());
            let (scale, largest_error) = (packed.scale, packed.largest_error);
            method.layers.push(LayerImage { column, scale, largest_error, at });
            self.packed.extend(at.map(|_| packed));
        }
        self.methods.push(method);
    }
}

impl Column {
    fn of_series(measurements: &[&Measurement], layer: Option<Layer>) -> Self {
        let stops = column_exposure(measurements, layer).map(|exposure: Exposure| exposure.stops);
        Self { symbol: symbol(layer), words: words(layer), group: "", stops }
    }

    fn of_part(m: &Measurement, layer: usize, part: &Part, name: String) -> Self {
        let (group, words) = match part {
            Part::Strategy { s, t, quantity: Quantity::Raw } => {
                ("strategies alone", format!("{s} light and {t} camera vertices, alone"))
            }
            Part::Strategy { s, t, .. } => ("weighted strategies", format!("{s} light and {t} camera vertices")),
            Part::Merged { order } => ("weighted strategies", format!("merged, order {order}")),
            Part::Group { .. } => ("light groups", name.clone()),
            Part::Class { .. } => ("path classes", name.clone()),
        };
        Self { symbol: name, words, group, stops: exposure_of(m, Some(layer)).map(|exposure| exposure.stops) }
    }
}

/// Whether a part is an image of light.
fn is_image(part: &Part) -> bool {
    !matches!(part, Part::Strategy { quantity: Quantity::Weights, .. })
}

/// Means of blocks of pixels. Of standard errors that is the largest which the block's mean may have, whatever the correlation of its
/// pixels.
fn shrunk([w, h]: [usize; 2], shrink: usize, value: impl Fn(usize) -> [f64; 3]) -> Vec<[f64; 3]> {
    let (width, height) = (w.div_ceil(shrink), h.div_ceil(shrink));
    let block = |x: usize, y: usize| {
        let (xs, ys) = (x * shrink..((x + 1) * shrink).min(w), y * shrink..((y + 1) * shrink).min(h));
        block_mean(w, xs, ys, &value)
    };
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| block(x, y)).collect()
}
