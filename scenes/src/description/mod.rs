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
//! filter = "box"          # default; or triangle, gaussian, mitchell, blackman_harris
//! [materials.white]
//! type = "lambert"        # the name of a model, as `neumann list bsdfs` has them
//! albedo = 0.7            # a number, [r, g, b], or { ramp = { base = 0.5, slope = 0.4, axis = [0, 0, 1] } }
//! [[shapes]]
//! type = "sphere"         # sphere, quad, mesh
//! center = [0, 0, 0]
//! radius = 1
//! material = "white"
//! [[emitters]]
//! type = "constant"       # constant, point
//! radiance = 1
//! ```
//!
//! Materials and shapes are described key by key where they are read, in `materials.rs` and `shapes.rs`; the keys of a
//! material are the parameters of its model, [`ModelEntry::parameters`](sampling::bsdf::ModelEntry::parameters). An unknown key,
//! name or type is an error with the nearest valid one; every error names the file, the line and the mend.

mod materials;
mod reader;
mod shapes;
mod subsurface;
mod textures;
mod transform;

#[cfg(test)]
mod tests;

use std::path::Path;

use glam::DVec3;

use crate::builder::{CameraSettings, SceneBuilder};
use crate::error::SceneError;
use crate::import::translation::Attachment;
use crate::scene::Series;
use crate::suggest::did_you_mean;
use reader::{Source, Table, Value};
use sampling::bsdf::Bsdf;
use sampling::filter::Filter;

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
    /// Meshes that the description names and that are in no folder.
    pub attachments: &'a [Attachment],
}

/// Reads a scene file into a builder, which still can be changed; `size` replaces the width and height of the file.
pub fn read(text: &str, origin: Origin, size: Option<(u32, u32)>) -> Result<SceneBuilder, SceneError> {
    let source = Source { file: origin.file, text };
    let document = source.parse()?;
    let root = Table::root(source, &document);
    root.allow_only(&["title", "description", "max_order", "tail", "camera", "materials", "shapes", "emitters"])?;
    for key in ["title", "description"] {
        root.get(key).map(|value| value.text()).transpose()?;
    }
    let mut builder = SceneBuilder::new(origin.scene);
    builder.series(read_series(&root)?);
    let materials = materials::read(&root, origin.folder, &mut builder)?;
    shapes::read(&root, &materials, &origin, &mut builder)?;
    let emitters = tables(&root, "emitters")?;
    read_emitters(&emitters, &mut builder)?;
    let camera = root
        .get("camera")
        .ok_or_else(|| root.error("the scene has no camera", "add a table `[camera]` with `position` and `target`"))?;
    builder.camera(read_camera(&camera.table()?, size)?);
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

/// `[camera]`: a pinhole at `position` that looks at `target`.
fn read_camera(table: &Table, size: Option<(u32, u32)>) -> Result<CameraSettings, SceneError> {
    table.allow_only(&["type", "position", "target", "up", "fov", "width", "height", "filter"])?;
    if table.get("type").is_some() {
        kind(table, &["pinhole"])?;
    }
    let position = table.need("position", "[0, 0, 3]")?.vec3()?;
    let target = table.need("target", "[0, 0, 0]")?;
    let Some(view) = (target.vec3()? - position).try_normalize() else {
        return Err(target.error("it must differ from the camera's `position`"));
    };
    let up = match table.get("up") {
        Some(up) => up.direction()?,
        None => DVec3::Y,
    };
    if up.cross(view).length() < 1e-6 {
        let message = format!("the camera looks along its `up`, [{}, {}, {}]", up.x, up.y, up.z);
        let across = if view.y.abs() < 0.9 { "[0, 1, 0]" } else { "[0, 0, 1]" };
        return Err(table.error(message, format!("give an `up` across the view, such as `up = {across}`")));
    }
    let fov = match table.get("fov") {
        Some(fov) => fov.number_in(0.001..=179.0, "a field of view lies between 0.001 and 179 degrees")?,
        None => 40.0,
    };
    let (width, height) = match size {
        Some(size) => size,
        None => (side(table, "width")?, side(table, "height")?),
    };
    check_size(width, height).map_err(|error| match error {
        SceneError::Invalid { message, mend, .. } => table.error(message, mend),
        other => other,
    })?;
    let filter = match table.get("filter") {
        Some(value) => value.text()?.parse().map_err(|_| {
            let names: Vec<String> = Filter::ALL.iter().map(Filter::to_string).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            value.error(did_you_mean(value.text().unwrap_or_default(), &names))
        })?,
        None => Filter::default(),
    };
    Ok(CameraSettings { position, target: target.vec3()?, up, fov, width, height, filter })
}

fn side(table: &Table, key: &str) -> Result<u32, SceneError> {
    let Some(value) = table.get(key) else { return Ok(256) };
    let pixels = value.whole()?;
    if (1..=i64::from(MAX_SIDE)).contains(&pixels) {
        return Ok(pixels as u32);
    }
    Err(value.error(format!("an image side lies between 1 and {MAX_SIDE} pixels")))
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

/// `[[emitters]]`: those that are not surfaces. `point` has `position` \[m\] and `intensity` \[W/sr\]; `constant` is an
/// environment of one `radiance` \[W/(m²·sr)\] from everywhere.
fn read_emitters(tables: &[Table], builder: &mut SceneBuilder) -> Result<(), SceneError> {
    let mut environments = 0;
    for table in tables {
        match kind(table, &["point", "constant"])? {
            "point" => {
                table.allow_only(&["type", "position", "intensity"])?;
                let position = table.need("position", "[0, 1, 0]")?.vec3()?;
                let intensity = emitted(&table.need("intensity", "[1, 1, 1]")?)?;
                builder.point_emitter(position, intensity);
            }
            _ => {
                table.allow_only(&["type", "radiance"])?;
                let radiance = emitted(&table.need("radiance", "[1, 1, 1]")?)?;
                environments += 1;
                if environments > 1 {
                    return Err(
                        table.error("there are two emitters of type `constant`", "keep one: add up their radiances")
                    );
                }
                builder.environment(radiance);
            }
        }
    }
    Ok(())
}

/// What an emitter emits: not negative, and not all zero.
fn emitted(value: &Value) -> Result<sampling::math::Spectrum, SceneError> {
    let colour = value.colour_in(0.0..=f32::MAX, "light cannot be negative; give 0 or more in every channel")?;
    if colour.is_zero() {
        return Err(value.error("an emitter must emit; give a channel above 0, or leave the emitter out"));
    }
    Ok(colour)
}
