//! Scenes of pbrt-v4, and of v3 by the names that v4 has given to its parts.
//!
//! `lexer` and `parser` read the text, `parameters` looks values up, `state` carries directives out, `context` keeps what is
//! known meanwhile; `transform`, `spectrum`, `texture`, `material` with `model`, `shape` with `triangles`, `object`, `light` and
//! `camera` with `sensor` each write what a kind of thing becomes in the language of scene files. `docs/importers.md` has the table of what is exact, what
//! is near, and what is left out.

mod camera;
mod context;
mod lexer;
mod light;
mod material;
mod model;
mod names;
mod object;
mod parameters;
mod parser;
mod sensor;
mod shape;
mod spectrum;
mod state;
mod texture;
mod transform;
mod triangles;

#[cfg(test)]
mod tests;

use std::path::Path;

use context::Context;
use state::State;

use crate::error::SceneError;
use crate::import::translation::{Lines, Place, SHAPE, Translation, quoted};

/// Translates the scene at `path`. Files are named from the folder `base`, and meshes without a file begin with `stem`.
pub fn translate(path: &Path, base: &Path, stem: &str) -> Result<Translation, SceneError> {
    let root = Place { file: path.into(), line: 1 };
    let mut context = Context::new(path, base, stem);
    let mut state = State::new(&mut context);
    state.file(path, None)?;
    let unfinished = state.finish(&root);
    let State { options, records, objects, .. } = state;
    // What is missing tells of itself before what comes of its being missing.
    context.check_files()?;
    unfinished?;
    let mut head = Lines::default();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    head.push(&root, format!("# Made of {}.", name.escape_default()));
    head.key(&root, "title", quoted(&path.file_stem().unwrap_or_default().to_string_lossy()));
    let camera = camera::write(&options, &root, &mut context)?;
    for record in &records {
        let shape = shape::written(record, SHAPE, &mut context)?;
        context.shapes.append(shape);
    }
    let groups = objects.write(&mut context)?;
    camera::series(&options, &root, &mut head, &mut context)?;
    context.check_files()?;
    for part in [camera, context.materials, groups, context.shapes, context.emitters] {
        head.append(part);
    }
    Ok(Translation::new(head, context.meshes.all(), context.notes))
}
