//! Parts of an OBJ: before Mitsuba 2 its faces have the materials that are called as the file has them.

use std::path::Path;

use super::context::Context;
use super::xml::Element;
use crate::builder::MeshData;
use crate::error::SceneError;
use crate::import::obj::{Group, Model};
use crate::import::translation::{NoteKind, Place};

/// Some faces of a file, and the material that they have, if any is given.
pub struct Part<'a, 'n> {
    /// The faces.
    pub faces: Faces<'n>,
    /// What their material may be; the first counts.
    pub bsdfs: Vec<&'a Element>,
}

/// Which faces of an OBJ are meant, by what the file calls their materials.
#[derive(Clone, Copy)]
pub enum Faces<'n> {
    /// Those of one name.
    Of(&'n str),
    /// Those of none of these.
    Others(&'n [&'n str]),
}

/// Some faces of an OBJ, and whether the file has smoothing groups; the file is read once for all of its parts.
pub fn read(
    path: &Path,
    faces: Faces,
    place: &Place,
    context: &mut Context,
) -> Result<(Vec<MeshData>, bool), SceneError> {
    let model = match context.parted.take() {
        Some((read, model)) if read == path => model,
        _ => Model::open_unsmoothed(path)?,
    };
    let is_meant = |group: &&Group| {
        let name = model.appearances[group.appearance].0.as_str();
        match faces {
            Faces::Of(meant) => name == meant,
            Faces::Others(named) => !named.contains(&name),
        }
    };
    let meant: Vec<MeshData> = model.groups.iter().filter(is_meant).map(|group| group.mesh.clone()).collect();
    if let (true, Faces::Of(name)) = (meant.is_empty(), faces) {
        context.note(NoteKind::Ignored, place, format!("no faces of the file have the material `{name}`"));
    }
    let has_smoothing = model.has_smoothing;
    context.parted = Some((path.to_owned(), model));
    Ok((meant, has_smoothing))
}
