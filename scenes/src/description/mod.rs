//! Scene files: TOML, in metres and degrees.
//!
//! ```toml
//! title = "A lit ball"
//! max_order = 4           # the last order that is rendered unless the command line says otherwise
//! tail = false            # whether all beyond it is rendered as well
//! [camera]
//! position = [0, 0, 3]
//! target = [0, 0, 0]
//! up = [0, 1, 0]          # default
//! fov = 40                # degrees along the shorter side of the image; default 40
//! width = 256             # default 256, as is height
//! height = 256
//! filter = "box"          # default; or triangle, gaussian, gaussian_full, mitchell, blackman_harris
//! # type = "pinhole"      # default; or thin_lens, orthographic, equirectangular, irradiance, each with keys of its own
//! [materials.white]
//! type = "lambert"        # the name of a model, as `neumann list bsdfs` has them
//! albedo = 0.7            # a number, [r, g, b], or { ramp = { base = 0.5, slope = 0.4, axis = [0, 0, 1] } }
//! [[shapes]]
//! type = "sphere"         # sphere, quad, disk, cylinder, mesh, instance
//! center = [0, 0, 0]
//! radius = 1
//! material = "white"
//! [[emitters]]
//! type = "constant"       # constant, environment, point, spot, directional
//! radiance = 1
//! ```
//!
//! `[[groups]]` have a `name` and `[[groups.shapes]]`, which are kept once and seen wherever a shape `type = "instance"` with `group =
//! "name"` places them, by any `transform` that can be undone.
//!
//! `emitter_choice`, at the top, says how next-event estimation chooses among emitters: one of
//! [`ChoiceRule::NAMES`](crate::ChoiceRule::NAMES); `emitter_points`, how it places points on them: one of
//! [`PointRule::NAMES`](crate::PointRule::NAMES). Cameras, materials, shapes and emitters are described key by key where they are read, in
//! `camera.rs`, `materials.rs`, `shapes.rs`, `groups.rs` and `emitters.rs`; the keys of a
//! material are the parameters of its model, [`ModelEntry::parameters`](sampling::bsdf::ModelEntry::parameters). An unknown key,
//! name or type is an error with the nearest valid one; every error names the file, the line and the mend.

mod camera;
mod emitters;
mod groups;
mod materials;
mod reader;
mod shapes;
mod subsurface;
mod textures;
mod transform;

#[cfg(test)]
mod tests;

use std::path::Path;

use crate::builder::SceneBuilder;
use crate::error::SceneError;
use crate::import::translation::Attachment;
use crate::scene::Series;
use crate::suggest::did_you_mean;
use reader::{Source, Table, Value};
use sampling::bsdf::Bsdf;

/// The longest side of an image \[pixels\].
pub const MAX_SIDE: u32 = 65_536;
/// The highest order that a scene file may ask for.
pub const MAX_ORDER: usize = 65_000;
/// The largest number of pixels of an image.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Where a description comes from.
#[derive(Clone, Copy, Debug)]
pub struct Origin<'a> {
    /// The name of the scene.
    pub scene: &'a str,
    /// The file as messages name it.
    pub file: &'a str,
    /// The folder that meshes are looked for in; `None` where a description cannot name files.
    pub folder: Option<&'a Path>,
    /// Meshes and images that the description names and that are in no folder.
    pub attachments: &'a [Attachment],
}

/// Reads a scene file into a builder, which still can be changed; `size` replaces the width and height of the file.
pub fn read(text: &str, origin: Origin, size: Option<(u32, u32)>) -> Result<SceneBuilder, SceneError> {
    let source = Source { file: origin.file, text };
    let document = source.parse()?;
    let root = Table::root(source, &document);
    root.allow_only(&[
        "title",
        "description",
        "max_order",
        "tail",
        "camera",
        "materials",
        "groups",
        "shapes",
        "emitters",
        "emitter_choice",
        "emitter_points",
    ])?;
    for key in ["title", "description"] {
        root.get(key).map(|value| value.text()).transpose()?;
    }
    let mut builder = SceneBuilder::new(origin.scene);
    builder.series(read_series(&root)?);
    let materials = materials::read(&root, &origin, &mut builder)?;
    shapes::read(&root, &materials, &origin, &mut builder)?;
    emitters::read(&root, &origin, &mut builder)?;
    let table = root
        .get("camera")
        .ok_or_else(|| root.error("the scene has no camera", "add a table `[camera]` with `position` and `target`"))?;
    let (camera, note) = camera::read(&table.table()?, size)?;
    builder.camera(camera);
    if let Some(note) = note {
        builder.note(note);
    }
    Ok(builder)
}

/// `max_order` and `tail`.
fn read_series(root: &Table) -> Result<Series, SceneError> {
    let max_order = match root.get("max_order") {
        None => None,
        Some(value) => match usize::try_from(value.whole()?) {
            Ok(order) if order <= MAX_ORDER => Some(order),
            _ => return Err(value.error(format!("it must be from 0 to {MAX_ORDER}"))),
        },
    };
    Ok(Series { max_order, tail: root.get("tail").map_or(Ok(false), |value| value.boolean())? })
}

/// One material of a text that has materials as a scene file has them, and nothing else; it may not vary.
pub fn read_material(text: &str, file: &str, name: &str) -> Result<Bsdf, SceneError> {
    let source = Source { file, text };
    let document = source.parse()?;
    let root = Table::root(source, &document);
    materials::constant(&root, name)
}

/// The title of a scene file, or nothing where it has none.
pub fn title(text: &str) -> Option<String> {
    let document = Source { file: "", text }.parse().ok()?;
    let title = Table::root(Source { file: "", text }, &document).get("title")?;
    title.text().ok().map(str::to_string)
}

/// The members of an array of tables, such as `[[shapes]]`.
fn tables<'a>(root: &Table<'a>, key: &str) -> Result<Vec<Table<'a>>, SceneError> {
    let Some(value) = root.get(key) else { return Ok(Vec::new()) };
    if !value.is_array() {
        return Err(value.error(format!("it must be a list of tables: write `[[{key}]]` with two brackets")));
    }
    value.array()?.iter().map(Value::table).collect()
}

/// The `type` of a table, one of `valid`.
fn kind<'a>(table: &Table<'a>, valid: &[&str]) -> Result<&'a str, SceneError> {
    let value = table.need("type", &format!("\"{}\"", valid[0]))?;
    let kind = value.text()?;
    if valid.contains(&kind) { Ok(kind) } else { Err(value.error(did_you_mean(kind, valid))) }
}

/// Refuses image sizes of 0 and absurd ones.
pub(crate) fn check_size(width: u32, height: u32) -> Result<(), SceneError> {
    if width == 0 || height == 0 {
        return Err(SceneError::invalid(format!("the image size {width}x{height} is empty"), "give at least 1x1"));
    }
    if width > MAX_SIDE || height > MAX_SIDE || u64::from(width) * u64::from(height) > MAX_PIXELS {
        let mend = format!("give sides of at most {MAX_SIDE} and at most {MAX_PIXELS} pixels in all");
        return Err(SceneError::invalid(format!("the image size {width}x{height} is too large"), mend));
    }
    Ok(())
}
