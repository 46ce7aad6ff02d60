//! A reference as an image file that any program reads.
//!
//! Its layers are those of every image of ours, `order02` the mean over both halves and `order02_var` the variance of that, and beside them
//! `order02_half`, the second half's mean; `_var` and `sum_half` are the variance of the beauty and its second half.

use super::plan::layers;
use super::{Images, Truth};
use crate::config::Experiment;
use crate::error::Error;
use crate::export::ExportError;
use crate::export::exr::{ImageLayer, LayeredImage, read_layers, write_layers};
use crate::plan::PlannedScene;
use integrators::{Layer, Window};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// What tells a reference from other images: its hash.
const HASH: &str = "neumann:reference";
const SCENE_HASH: &str = "neumann:scene_hash";

/// The names of a layer, of its variance and of its second half.
fn names(layer: Option<Layer>, max_order: usize) -> [String; 3] {
    let name = layer.map_or(String::new(), |layer| layer.name(max_order));
    let half = if name.is_empty() { "sum_half".to_owned() } else { format!("{name}_half") };
    [name.clone(), format!("{name}_var"), half]
}

/// Writes a reference of a scene.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, truth: &Truth, scene: &str, scene_hash: &str, seed: u64) -> Result<(), ExportError> {
    let max_order = truth.layers.iter().filter_map(|layer| layer.order()).max().unwrap_or(0);
    let stride = truth.layers.len() + 1;
    let mut image = LayeredImage {
        width: truth.size[0],
        height: truth.size[1],
        layers: Vec::new(),
        other_channels: Vec::new(),
        attributes: BTreeMap::new(),
    };
    for (i, layer) in truth.layers.iter().map(|&l| Some(l)).chain([None]).enumerate() {
        let at = layer.map(|_| i);
        let to_f32 = |v: [f64; 3]| v.map(|v| v as f32);
        let half = truth.images.second.iter().skip(i).step_by(stride).map(|&v| to_f32(v)).collect();
        let pixels = [truth.mean(at).map(to_f32).collect(), truth.variance(at).map(to_f32).collect(), half];
        image
            .layers
            .extend(names(layer, max_order).into_iter().zip(pixels).map(|(name, pixels)| ImageLayer { name, pixels }));
    }
    let methods: BTreeMap<&str, (u64, &[f64])> =
        truth.pooled.iter().map(|p| (p.label.as_str(), (p.samples, p.weights.as_slice()))).collect();
    for (name, value) in [
        ("neumann:scene", scene.to_owned()),
        (SCENE_HASH, scene_hash.to_owned()),
        (HASH, truth.hash.clone()),
        ("neumann:methods", serde_json::to_string(&methods).unwrap_or_default()),
        ("neumann:seed", seed.to_string()),
        ("neumann:max_order", max_order.to_string()),
    ] {
        image.attributes.insert(name.to_owned(), value);
    }
    write_layers(path, &image)
}

/// Reads the reference of a scene whose camera has its size by now.
///
/// # Errors
/// If there is no such file, or it is none of this scene, size and orders.
pub fn read(path: &Path, scene: &PlannedScene, experiment: &Experiment) -> Result<Truth, Error> {
    let image = read_layers(path)?;
    let wrong = |message: String| Error::File { file: path.to_owned(), line: None, message };
    let attribute = |name: &str| image.attributes.get(name).map(String::as_str);
    if attribute(HASH).is_none() {
        let mend = "an experiment with a section [reference] writes one";
        return Err(wrong(format!("it is no reference, for it does not tell its own noise and halves; {mend}")));
    }
    let window = Window::of(&scene.scene);
    let size = [window.width() as usize, window.height() as usize];
    if size != [image.width, image.height] {
        let [width, height] = size;
        return Err(wrong(format!(
            "the reference is {}x{} and {} is {width}x{height}; take --size {}x{}, or make another",
            image.width, image.height, scene.name, image.width, image.height
        )));
    }
    if attribute(SCENE_HASH) != Some(scene.scene.hash.as_str()) {
        return Err(wrong(format!(
            "the reference is of {}, and {} is another scene or was edited since; make another, one scene at a time",
            attribute("neumann:scene").unwrap_or("another scene"),
            scene.name
        )));
    }
    let layers = layers(experiment);
    let told = attribute("neumann:max_order").unwrap_or_default();
    let has_tail = image.layer("tail").is_some();
    if told != experiment.max_order.to_string() || has_tail != experiment.tail {
        let tail = |has: bool| if has { " and the tail" } else { "" };
        return Err(wrong(format!(
            "the reference has orders 0 to {told}{}, and 0 to {}{} are asked for; take max_order = {told} and tail = {has_tail}, \
             or make another",
            tail(has_tail),
            experiment.max_order,
            tail(experiment.tail)
        )));
    }
    let mut planes = Vec::new();
    for layer in layers.iter().map(|&l| Some(l)).chain([None]) {
        let of = |name: &String| {
            image.layer(name).ok_or_else(|| wrong(format!("the layer `{name}` is missing; make another")))
        };
        let found = names(layer, experiment.max_order).iter().map(of).collect::<Result<Vec<_>, Error>>()?;
        if found.iter().any(|layer| layer.pixels.as_flattened().iter().any(|v| !v.is_finite())) {
            return Err(wrong(format!("the layer `{}` holds what is no number; make another", found[0].name)));
        }
        planes.push(found);
    }
    let pixels = size[0] * size[1];
    let places = || (0..pixels).flat_map(|p| planes.iter().map(move |plane| (plane, p)));
    let value = |layer: &ImageLayer, p: usize| layer.pixels[p].map(f64::from);
    let first = |mean: [f64; 3], half: [f64; 3]| [0, 1, 2].map(|c| 2.0 * mean[c] - half[c]);
    let images = Images {
        first: places().map(|(plane, p)| first(value(plane[0], p), value(plane[2], p))).collect(),
        second: places().map(|(plane, p)| value(plane[2], p)).collect(),
        variance: places().map(|(plane, p)| value(plane[1], p).map(|v| 2.0 * v)).collect(),
    };
    let bytes = scenes::file::read(path).map_err(|source| ExportError::Read { path: path.to_owned(), source })?;
    let hash = blake3::hash(&bytes).to_hex().to_string();
    Ok(Truth { hash, layers, size, pooled: Vec::new(), images: Arc::new(images) })
}
