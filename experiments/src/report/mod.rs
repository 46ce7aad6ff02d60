//! What people read of an experiment: one self-contained `report.html`, with the plots and picture sheets beside it.
//!
//! [`numbers`] takes the figures from the measurements, [`summary`] says them in sentences, [`tables`] and [`images`] show
//! them, [`page`] puts the page together. The HTML is written in Rust, through [`crate::export::markup`]: what a template
//! engine would add here is its syntax, its errors at run time and its time to build, while here a name can't become markup
//! and a missing number doesn't compile.

pub mod images;
pub mod numbers;
pub mod page;
pub mod summary;
pub mod tables;

use crate::export::{ExportError, png, write_atomically};
use crate::plot;
use crate::result::{ExperimentResult, MethodResult};
use numbers::Numbers;
use std::path::Path;

/// One scene of an experiment with all that is derived from it.
pub struct SceneReport<'a> {
    /// The scene's name.
    pub name: &'a str,
    /// Its methods, in the experiment's order.
    pub methods: Vec<&'a MethodResult>,
    /// Their numbers.
    pub numbers: Numbers,
    /// Variance and efficiency by order.
    pub by_order: Vec<plot::Figure>,
    /// Convergence of every order and of their sum; empty where it wasn't measured.
    pub convergence: Vec<plot::Figure>,
}

/// Derives what is shown of every scene.
pub fn scenes(result: &ExperimentResult) -> Vec<SceneReport<'_>> {
    let scene = |name| {
        let methods: Vec<&MethodResult> = result.of_scene(name).collect();
        let numbers = Numbers::of(&methods);
        let by_order = plot::by_order(name, &methods, &numbers);
        let convergence = plot::convergence(name, &methods, &result.slopes, &numbers);
        SceneReport { name, methods, numbers, by_order, convergence }
    };
    result.scenes().into_iter().map(scene).collect()
}

/// Writes `report.html` and `plots/` into the experiment's folder: of each scene every plot as SVG, and a sheet of pictures
/// that compares the methods. The scenes' names are taken to be fit for files.
///
/// # Errors
/// If a file can't be written.
pub fn write(dir: &Path, result: &ExperimentResult) -> Result<(), ExportError> {
    let plots = dir.join("plots");
    std::fs::create_dir_all(&plots).map_err(|source| ExportError::Write { path: plots.clone(), source })?;
    let scenes = scenes(result);
    for scene in &scenes {
        for figure in scene.by_order.iter().chain(&scene.convergence) {
            write_atomically(&plots.join(format!("{}.svg", figure.file)), figure.chart.file().as_bytes())?;
        }
        let rows: Vec<_> = scene.methods.iter().map(|m| (m.label.as_str(), &m.measurement)).collect();
        png::write_comparison_sheet(&plots.join(format!("{}_orders.png", scene.name)), &rows, scene.name)?;
    }
    write_atomically(&dir.join("report.html"), page::page(result, &scenes).as_bytes())
}
