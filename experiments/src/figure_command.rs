//! `neumann figure`: figures for papers, from images and records.

use crate::cli::{FigureArgs, print};
use crate::error::{Error, NO_PLACE, Status};
use crate::export::vector::{Drawing, ENDINGS};
use crate::figure::file::FigureFile;
use crate::figure::{crops, images, plots};
use crate::output;
use crate::plot::pen;
use crate::progress::Verbosity;
use crate::source::Source;
use integrators::Methods;
use std::path::{Path, PathBuf};

/// The width of a column of a paper \[mm\], which a report's plots get.
const COLUMN: f64 = 85.0;

/// Draws the figure that a file asks for, or all plots of results.
///
/// # Errors
/// If there is no such file or folder, something in it cannot be drawn, or a file not be written.
pub fn figure(args: &FigureArgs, methods: &Methods, verbosity: Verbosity) -> Result<Status, Error> {
    let files = if args.from.is_dir() { of_results(args)? } else { of_file(args, methods)? };
    if verbosity == Verbosity::Normal {
        let lines = files.iter().map(|file| format!("{}\n", file.display()));
        print(&lines.collect::<String>())?;
    }
    Ok(Status::Done)
}

/// The figure of a file, in each of the forms asked for.
fn of_file(args: &FigureArgs, methods: &Methods) -> Result<Vec<PathBuf>, Error> {
    let source = Source::file(&args.from, "give a figure's file, as docs/figures.md tells, or a folder of results")?;
    let figure = FigureFile::open(&source)?;
    let files = match args.out.is_empty() {
        true => vec![args.from.with_extension("svg")],
        false => args.out.clone(),
    };
    for file in &files {
        if !file.extension().is_some_and(|e| ENDINGS.iter().any(|ending| e == *ending)) {
            let endings = ENDINGS.join(", .");
            return Err(Error::usage(format!(
                "{}: a figure is written as .{endings}; give one of these endings",
                file.display()
            )));
        }
        output::check_file(file)?;
    }
    let svg = match &figure.plot {
        Some(plot) => plots::draw(&source, &figure, plot)?,
        None => crops::draw(&source, &figure, &images::read(&source, &figure)?, methods)?,
    };
    let drawing = Drawing::of(&svg).map_err(|e| Error::usage(format!("{}: {e}", args.from.display())))?;
    files.iter().try_for_each(|file| drawing.write(file))?;
    Ok(files)
}

/// All plots of results, each in every form, in the width of a column.
fn of_results(args: &FigureArgs) -> Result<Vec<PathBuf>, Error> {
    let plots = args.from.join("plots");
    let entries = std::fs::read_dir(&plots).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut found: Vec<PathBuf> = entries.filter(|path| path.extension().is_some_and(|e| e == "svg")).collect();
    found.sort();
    if found.is_empty() {
        let folder = args.from.display();
        return Err(Error::usage(format!(
            "{folder} holds no plots; give a folder that `neumann run` has written, or a figure's file"
        )));
    }
    let folder = match args.out.as_slice() {
        [] => args.from.join("figures"),
        [folder] => folder.clone(),
        _ => return Err(Error::usage("the plots of results go to one folder; give -o once")),
    };
    let io = |action, path: &Path, mend| {
        let path = path.to_owned();
        move |source| Error::Io { action, path, source, mend }
    };
    std::fs::create_dir_all(&folder).map_err(io("write", &folder, NO_PLACE))?;
    let mut files = Vec::new();
    for path in found {
        let svg = scenes::file::read_text(&path).map_err(io("read", &path, "`neumann report` writes it again"))?;
        let message = |e: String| Error::File {
            file: path.clone(),
            line: None,
            message: format!("{e}; `neumann report` writes it again"),
        };
        let drawing = Drawing::of(&pen::printed(&svg, COLUMN)).map_err(message)?;
        for ending in ENDINGS {
            let file = folder.join(path.with_extension(ending).file_name().unwrap_or_default());
            drawing.write(&file)?;
            files.push(file);
        }
    }
    Ok(files)
}
