//! The images of a figure's row, found and read.

use super::file::{Entry, FigureFile, Row};
use super::records::{Told, blamed};
use crate::error::{Error, unknown};
use crate::export::exr::{ImageLayer, LayeredImage, read_layers};
use crate::export::notation::symbol;
use crate::source::Source;
use integrators::Layer;
use std::path::{Path, PathBuf};

/// What the reference is called among the images of results.
pub const REFERENCE: &str = "reference";

/// A row with all that it shows.
pub struct Shown {
    /// What was asked for.
    pub row: Row,
    /// The images, in order.
    pub images: Vec<Image>,
    /// Which of them is shown whole.
    pub large: usize,
    /// What errors are taken against.
    pub reference: Option<LayeredImage>,
    /// What the results tell.
    pub told: Option<Told>,
    /// The scene in the results.
    pub scene: String,
    /// Pixels in a row, and rows.
    pub size: (usize, usize),
}

/// An image of a row.
pub struct Image {
    /// What it is called.
    pub label: String,
    /// The method's label in the results; `None` for files and for the reference.
    pub method: Option<String>,
    /// The file.
    pub file: LayeredImage,
    /// The layer that is shown, with its variance and second half beside it in the file.
    pub layer: String,
}

impl Image {
    /// The pixels shown.
    pub fn pixels(&self) -> &[[f32; 3]] {
        self.file.layer(&self.layer).map_or(&[], |layer| &layer.pixels)
    }
}

/// The layer of an order, however many digits its file gives to orders.
fn of_order(image: &LayeredImage, order: usize) -> Option<&ImageLayer> {
    let number = |name: &str| name.strip_prefix("order").and_then(|digits| digits.parse::<usize>().ok());
    image.layers.iter().find(|layer| number(&layer.name) == Some(order))
}

impl Row {
    /// The name of the layer that the row shows, in a file.
    pub fn layer_in(&self, image: &LayeredImage) -> Result<String, String> {
        let found = match (self.order, &self.layer) {
            (Some(order), _) => of_order(image, order).ok_or_else(|| format!("order {order}")),
            (None, Some(name)) => image.layer(name).ok_or_else(|| format!("layer `{name}`")),
            (None, None) => image.layer("").ok_or_else(|| "beauty of three channels R, G and B".to_owned()),
        };
        let names = || {
            let shown = image
                .layers
                .iter()
                .map(|l| l.name.as_str())
                .filter(|n| !n.is_empty() && !n.ends_with("_var") && !n.ends_with("_half"));
            shown.collect::<Vec<_>>().join(", ")
        };
        found.map(|layer| layer.name.clone()).map_err(|what| format!("has no {what}; it has the layers {}", names()))
    }

    /// What the row shows of its images, in words.
    pub fn what(&self) -> String {
        match (self.order, &self.layer) {
            (Some(order), _) => symbol(Some(Layer::Order(order))),
            (None, Some(name)) => name.clone(),
            (None, None) => String::new(),
        }
    }
}

/// Reads the images of all rows of a figure.
///
/// # Errors
/// If one cannot be found or read, or those of a row differ in size, with the line that names it.
pub fn read(source: &Source, figure: &FigureFile) -> Result<Vec<Shown>, Error> {
    let folder = source.path.as_deref().and_then(Path::parent).unwrap_or(Path::new(""));
    figure.rows.iter().enumerate().map(|(i, row)| shown(source, folder, i, row)).collect()
}

fn shown(source: &Source, folder: &Path, number: usize, row: &Row) -> Result<Shown, Error> {
    let at = |key: &str| format!("rows.{number}.{key}");
    let results = row.results.as_ref().map(|results| folder.join(results));
    let told =
        results.as_ref().map(|results| Told::read(results).map_err(blamed(source, at("results")))).transpose()?;
    let scene = scene(told.as_ref(), row).map_err(blamed(source, at("scene")))?;
    let mut images = Vec::new();
    for (i, entry) in row.images.iter().enumerate() {
        let (path, key) = path(entry, folder, results.as_deref(), (&scene, told.as_ref()))
            .map_err(blamed(source, at(&format!("images.{i}.method"))))?;
        let key = at(&format!("images.{i}.{key}"));
        let file = read_layers(&path).map_err(|e| source.blame(&key, e.to_string()))?;
        let layer = row.layer_in(&file).map_err(|why| source.blame(&key, format!("{} {why}", path.display())))?;
        let method = entry.method.clone().filter(|method| method != REFERENCE);
        images.push(Image { label: entry.label(), method, file, layer });
    }
    let size = (images[0].file.width, images[0].file.height);
    if let Some(other) = images.iter().position(|image| (image.file.width, image.file.height) != size) {
        let (first, file) = (&images[0].label, &images[other].file);
        let message = format!(
            "it is {}x{}, and {first} is {}x{}; the images of a row have one size, since the same part of all is shown",
            file.width, file.height, size.0, size.1
        );
        return Err(source.blame(&at(&format!("images.{other}")), message));
    }
    if let Some(crop) = row.crops.iter().position(|&[x, y, w, h]| x + w > size.0 || y + h > size.1) {
        let message =
            format!("it reaches beyond the image, which is {}x{}; [x, y, width, height] count pixels", size.0, size.1);
        return Err(source.blame(&at(&format!("crops.{crop}")), message));
    }
    let own = results.as_ref().map(|results| reference_file(results, &scene)).filter(|file| file.exists());
    let reference = match row.reference.as_ref().map(|file| folder.join(file)).or(own) {
        Some(file) => Some(read_layers(&file).map_err(|e| source.blame(&at("reference"), e.to_string()))?),
        None => None,
    };
    let large = row.large.as_ref().and_then(|large| images.iter().position(|image| image.label == *large));
    let large = large.unwrap_or(images.len() - 1);
    Ok(Shown { row: row.clone(), images, large, reference, told, scene, size })
}

/// The scene in a row's results; an empty name where it has none.
fn scene(told: Option<&Told>, row: &Row) -> Result<String, String> {
    let Some(told) = told else { return Ok(row.scene.clone().unwrap_or_default()) };
    let names: Vec<&str> = told.manifest.scenes.iter().map(|scene| scene.name.as_str()).collect();
    match (&row.scene, names.first()) {
        (Some(scene), _) if !names.contains(&scene.as_str()) => Err(unknown("scene", scene, &names)),
        (Some(scene), _) => Ok(scene.clone()),
        (None, first) => Ok(first.copied().unwrap_or_default().to_owned()),
    }
}

fn reference_file(results: &Path, scene: &str) -> PathBuf {
    results.join(format!("{scene}_reference.exr"))
}

/// Where an image lies, and the key that says so.
fn path(
    entry: &Entry,
    folder: &Path,
    results: Option<&Path>,
    (scene, told): (&str, Option<&Told>),
) -> Result<(PathBuf, &'static str), String> {
    let (Some(method), Some(results), Some(told)) = (&entry.method, results, told) else {
        return Ok((folder.join(entry.file.as_deref().unwrap_or(Path::new(""))), "file"));
    };
    if method == REFERENCE {
        return Ok((reference_file(results, scene), "method"));
    }
    let labels: Vec<&str> = told.manifest.methods.iter().map(|m| m.label.as_str()).chain([REFERENCE]).collect();
    match labels.contains(&method.as_str()) {
        true => Ok((results.join(scene).join(format!("{method}.exr")), "method")),
        false => Err(unknown("method", method, &labels)),
    }
}
