//! `neumann bench`: how fast rays are followed and samples taken, and what that depends on; and whether any ray gets through where
//! it should not.
//!
//! `turns` measures renders in turn, by `clock`; `measured` makes what is asked for of the command line; the other modules are the
//! benches.

mod clock;
mod errors;
mod leaks;
mod measured;
mod meshes;
mod rays;
mod samples;
mod scaling;
mod skips;
mod start;
mod turns;

use crate::cli::{BenchArgs, BenchKind, print};
use crate::error::{Error, Status};
use crate::export::write_atomically;
use crate::plot::chart::Chart;
use integrators::Methods;
use serde::Serialize;
use std::path::Path;

/// Measures what was asked for.
///
/// # Errors
/// If a scene cannot be read, a method cannot render it, or standard output or a file not be written.
pub fn bench(args: &BenchArgs, methods: &Methods) -> Result<Status, Error> {
    match &args.kind {
        BenchKind::Rays { scenes, json } => rays::rays(scenes, *json),
        BenchKind::Leaks { rays, seed } => leaks::leaks(*rays, *seed),
        BenchKind::Samples(args) => samples::samples(args, methods),
        BenchKind::Scaling(args) => scaling::scaling(args, methods),
        BenchKind::Start(args) => start::start(args),
        BenchKind::Skips(args) => skips::skips(args, methods),
        BenchKind::Error(args) => errors::errors(args, methods),
    }
}

/// Prints what was measured as JSON, or as a table.
fn tell(measured: &impl Serialize, json: bool, table: impl FnOnce() -> String) -> Result<Status, Error> {
    let text = match json {
        true => serde_json::to_string_pretty(measured).unwrap_or_default() + "\n",
        false => table(),
    };
    print(&text)?;
    Ok(Status::Done)
}

/// The scenes that were named, or those of the program.
fn named(scenes: &[String]) -> Vec<&str> {
    match scenes.is_empty() {
        true => scenes::builtin_names().to_vec(),
        false => scenes.iter().map(String::as_str).collect(),
    }
}

/// Writes a plot into a folder, which is made if it is not there.
fn write_plot(folder: &Path, name: &str, chart: &Chart) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(|source| Error::Io {
        action: "write",
        path: folder.to_owned(),
        source,
        mend: "choose another folder with --out",
    })?;
    Ok(write_atomically(&folder.join(name).with_extension("svg"), chart.file().as_bytes())?)
}
