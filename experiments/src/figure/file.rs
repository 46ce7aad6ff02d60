//! A figure's file: what stands side by side, and what is said of it.

use crate::error::{Error, unknown};
use crate::source::Source;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// The width of a page of two columns \[mm\].
const PAGE: f64 = 178.0;
/// Widths that can be printed \[mm\].
const WIDTHS: std::ops::RangeInclusive<f64> = 40.0..=1000.0;

/// A figure: rows of images, or a plot.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FigureFile {
    /// Its width \[mm\].
    #[serde(default = "page")]
    pub width: f64,
    /// What stands below each image, line by line.
    #[serde(default)]
    pub captions: Vec<Caption>,
    /// Rows of images, from the top.
    #[serde(default)]
    pub rows: Vec<Row>,
    /// A plot instead.
    pub plot: Option<PlotTable>,
}

/// A line below an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Caption {
    /// Samples per pixel.
    Samples,
    /// Seconds of rendering.
    Seconds,
    /// Mean squared error against the row's reference.
    Mse,
    /// Its root.
    Rmse,
    /// Relative mean squared error.
    Relmse,
}

/// Images of one scene, side by side.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// The folder of results that `method`s are from, relative to the figure's file.
    pub results: Option<PathBuf>,
    /// The scene in these results.
    pub scene: Option<String>,
    /// The order of the Neumann series that is shown; the sum of all where neither this nor `layer` is given.
    pub order: Option<usize>,
    /// A layer of the images by its name, such as `lpe_caustics`.
    pub layer: Option<String>,
    /// What is written above the large image; the scene and what is shown of it where it is left out.
    pub title: Option<String>,
    /// Brightness in powers of two; one that shows the large image well where it is left out.
    pub exposure: Option<f64>,
    /// From light to screen.
    #[serde(default)]
    pub tone: Tone,
    /// Parts that are enlarged: column and row of the first pixel, width and height. Without any, all images are shown whole.
    #[serde(default)]
    pub crops: Vec<[usize; 4]>,
    /// The label of the image that is shown whole; the last one where it is left out.
    pub large: Option<String>,
    /// The image that errors are taken against; the reference of the results where it is left out.
    pub reference: Option<PathBuf>,
    /// The images.
    pub images: Vec<Entry>,
}

/// An image: a method's in the row's results, or a file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// The method's label in the results, or `reference`.
    pub method: Option<String>,
    /// An OpenEXR file, relative to the figure's file.
    pub file: Option<PathBuf>,
    /// What it is called.
    pub label: Option<String>,
}

impl Entry {
    /// What it is called.
    pub fn label(&self) -> String {
        let file = || self.file.as_deref().and_then(Path::file_stem).map(|stem| stem.to_string_lossy().into_owned());
        self.label.clone().or_else(|| self.method.clone()).or_else(file).unwrap_or_default()
    }
}

/// A curve from light to screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Tone {
    /// That of the sRGB standard; what is brighter than the screen is cut.
    #[default]
    Srgb,
    /// Narkowicz's fit to the curve of ACES.
    Filmic,
    /// Reinhard's x / (1 + x).
    Reinhard,
}

/// A plot of what records tell.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlotTable {
    /// The folder of results, relative to the figure's file.
    pub results: PathBuf,
    /// The scene; the first one where it is left out.
    pub scene: Option<String>,
    /// A quantity of `records.csv`, such as `variance`.
    pub quantity: String,
    /// The horizontal axis.
    #[serde(default)]
    pub over: Axis,
    /// The orders shown, as records write them: `0`, `1`, …, `tail`, `total`; all, or `total` alone over samples or seconds, where it is
    /// left out.
    pub orders: Option<Vec<String>>,
    /// The methods shown; all where it is left out.
    pub methods: Option<Vec<String>>,
    /// What is written above it.
    pub title: Option<String>,
    /// Its height \[mm\].
    #[serde(default = "height")]
    pub height: f64,
}

/// A plot's horizontal axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// The orders of the Neumann series.
    #[default]
    Order,
    /// Samples per pixel of a replicate.
    Samples,
    /// Seconds of a replicate.
    Seconds,
}

fn page() -> f64 {
    PAGE
}

fn height() -> f64 {
    55.0
}

impl FigureFile {
    /// Reads a figure's file.
    ///
    /// # Errors
    /// If it is no figure, with the line and the mend.
    pub fn open(source: &Source) -> Result<Self, Error> {
        let figure: Self = source.parse_as()?;
        let fault = |key: &str, message: &str| Err(source.blame(key, message.to_owned()));
        if !WIDTHS.contains(&figure.width) {
            return fault(
                "width",
                "a figure is from 40 to 1000 mm wide; a column of a paper has about 85, its page 178",
            );
        }
        match (figure.rows.is_empty(), &figure.plot) {
            (true, None) => return fault("", "a figure has [[rows]] of images, or a [plot]; give one of them"),
            (false, Some(_)) => {
                return fault("plot", "a figure has [[rows]] of images or a [plot], not both; make two of it");
            }
            (true, Some(plot)) if !WIDTHS.contains(&plot.height) => {
                return fault("plot.height", "a plot is from 40 to 1000 mm high");
            }
            _ => {}
        }
        for (i, row) in figure.rows.iter().enumerate() {
            row.check().map_err(|(key, message)| source.blame(&format!("rows.{i}.{key}"), message))?;
        }
        Ok(figure)
    }
}

impl Row {
    /// What can be known without its images: the key and what is wrong with it.
    fn check(&self) -> Result<(), (String, String)> {
        let fault = |key: &str, message: &str| Err((key.to_owned(), message.to_owned()));
        if self.images.is_empty() {
            return fault("images", "a row needs an image; give images = [{ method = \"path\" }]");
        }
        if self.order.is_some() && self.layer.is_some() {
            return fault("layer", "`order` names a layer already; leave out one of them");
        }
        if self.crops.iter().any(|c| c[2] == 0 || c[3] == 0 || (c[2], c[3]) != (self.crops[0][2], self.crops[0][3])) {
            return fault(
                "crops",
                "the crops of a row have one width and height, at least a pixel, since they are shown in a grid",
            );
        }
        if self.exposure.is_some_and(|stops| !(-64.0..=64.0).contains(&stops)) {
            return fault("exposure", "an exposure is a power of two, from -64 to 64");
        }
        for (i, image) in self.images.iter().enumerate() {
            let key = format!("images.{i}");
            match (&image.method, &image.file) {
                (None, None) => {
                    return fault(&key, "an image is a method of the results, or a file; give one of both keys");
                }
                (Some(_), Some(_)) => {
                    return fault(&key, "an image is a method of the results or a file; leave out one of both keys");
                }
                (Some(_), None) if self.results.is_none() => {
                    return fault(
                        &format!("{key}.method"),
                        "a method is one of results; give the row's `results`, or a `file`",
                    );
                }
                _ => {}
            }
        }
        let labels: Vec<String> = self.images.iter().map(Entry::label).collect();
        if let Some(large) = self.large.as_ref().filter(|large| !labels.contains(large)) {
            let names: Vec<&str> = labels.iter().map(String::as_str).collect();
            return Err(("large".to_owned(), unknown("image", large, &names)));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(text: &str) -> String {
        let source = Source::known("fig", Some(PathBuf::from("fig.toml")), text);
        FigureFile::open(&source).map_or_else(|e| e.to_string(), |_| String::new())
    }

    const ROW: &str =
        "width = 85\n[[rows]]\nresults = \"r\"\nimages = [{ method = \"path\" }]\ncrops = [[0, 0, 4, 4]]\n";

    #[test]
    fn faults_have_file_line_and_mend() {
        assert_eq!(told(ROW), "");
        let message = told(&ROW.replace("results", "resluts"));
        assert!(message.starts_with("fig.toml:3: ") && message.contains("did you mean `results`"), "{message}");
        for (from, to, line, words) in [
            ("85", "8", 1, "40 to 1000 mm"),
            ("results = \"r\"\n", "", 3, "give the row's `results`"),
            ("method = \"path\" }", "}", 4, "give one of both keys"),
            ("{ method = \"path\" }", "", 4, "a row needs an image"),
            ("[[0, 0, 4, 4]]", "[[0, 0, 4, 4], [1, 1, 4, 5]]", 5, "one width and height"),
            ("[[0, 0, 4, 4]]", "[]\nlarge = \"pth\"", 6, "did you mean `path`"),
            ("[[0, 0, 4, 4]]", "[]\ntone = \"filmc\"", 6, "did you mean `filmic`"),
            ("[[0, 0, 4, 4]]", "[]\norder = 1\nlayer = \"tail\"", 7, "leave out one"),
            ("width = 85", "captions = [\"relmes\"]", 1, "did you mean `relmse`"),
        ] {
            let message = told(&ROW.replace(from, to));
            assert!(message.starts_with(&format!("fig.toml:{line}: ")) && message.contains(words), "{to}: {message}");
        }
        assert!(
            told("width = 85\n").contains("[[rows]]")
                && told(&format!("{ROW}[plot]\nresults = \"r\"\nquantity = \"mse\"\n")).contains("not both")
        );
    }
}
