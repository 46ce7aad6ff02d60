//! Scenes by name or path.

use std::path::Path;

use crate::builder::SceneBuilder;
use crate::description::{self, Origin};
use crate::error::SceneError;
use crate::import::translation::{Note, Translation};
use crate::import::{gltf, mitsuba, obj, pbrt, ply};
use crate::needs::Skip;
use crate::scene::Scene;
use crate::suggest::did_you_mean;
use crate::{builtin, suggest};

/// How a scene is loaded.
#[derive(Clone, Copy, Debug, Default)]
pub struct LoadOptions {
    /// Width and height of the image \[pixels\], in place of the scene's own.
    pub size: Option<(u32, u32)>,
    /// Whether work that the scene doesn't need is left out.
    pub skip: Skip,
}

/// The names of the scenes that come with the program.
pub fn builtin_names() -> &'static [&'static str] {
    builtin::NAMES
}

/// Loads a built-in scene by its name, or a file by its path: `.toml` (see [`description`]), `.obj` (see [`obj`]), `.ply` (see
/// [`ply`]), `.xml` (see [`mitsuba`]), `.pbrt` (see [`pbrt`]), `.gltf` or `.glb` (see [`gltf`]).
///
/// A path is told from a name by its ending or a separator; a file never hides a built-in.
pub fn load(name_or_path: &str, options: &LoadOptions) -> Result<Scene, SceneError> {
    open(name_or_path, options.size)?.build(options.skip).map_err(|error| placed(error, name_or_path))
}

/// An error of building what [`open`] read, placed in its file.
pub fn placed(error: SceneError, name_or_path: &str) -> SceneError {
    match builtin::source(name_or_path) {
        Some(_) => error,
        None => error.in_file(name_or_path),
    }
}

/// Loads a scene into a builder, which still can be changed.
pub fn open(name_or_path: &str, size: Option<(u32, u32)>) -> Result<SceneBuilder, SceneError> {
    open_with_notes(name_or_path, size).map(|(builder, _)| builder)
}

/// The same with all that its translation noted, if it had one.
pub fn open_with_notes(name_or_path: &str, size: Option<(u32, u32)>) -> Result<(SceneBuilder, Vec<Note>), SceneError> {
    let path = Path::new(name_or_path);
    let has_ending = |wanted: &str| path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(wanted));
    let is_foreign = ["xml", "pbrt", "gltf", "glb"].into_iter().any(has_ending);
    if !is_foreign {
        return open_own(name_or_path, size);
    }
    if let Some((width, height)) = size {
        description::check_size(width, height)?;
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let translation = translation(name_or_path, folder)?;
    let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or("scene");
    Ok((translation.read(stem, folder, size)?, translation.notes))
}

/// Opens what is read as it is.
fn open_own(name_or_path: &str, size: Option<(u32, u32)>) -> Result<(SceneBuilder, Vec<Note>), SceneError> {
    if let Some((width, height)) = size {
        description::check_size(width, height)?;
    }
    if let Some(text) = builtin::source(name_or_path) {
        let file = format!("{name_or_path}.toml");
        let origin = Origin { scene: name_or_path, file: &file, folder: None, attachments: &[] };
        let mut builder = description::read(text, origin, size)?;
        builder.built_in(name_or_path);
        return Ok((builder, Vec::new()));
    }
    let path = Path::new(name_or_path);
    let ending = path.extension().and_then(|ending| ending.to_str()).map(str::to_lowercase);
    let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or("scene");
    let folder = path.parent().unwrap_or(Path::new(""));
    match ending.as_deref() {
        Some("toml") => {
            let bytes = crate::file::read(path).map_err(|error| unreadable(path, error))?;
            let text = String::from_utf8(bytes).map_err(|error| not_utf8(path, &error))?;
            let origin = Origin { scene: stem, file: name_or_path, folder: Some(folder), attachments: &[] };
            Ok((description::read(&text, origin, size)?, Vec::new()))
        }
        Some(mesh @ ("obj" | "ply")) => {
            crate::file::check(path).map_err(|error| unreadable(path, error))?;
            if mesh == "ply" { ply::scene(path, stem, size) } else { obj::scene(path, stem, size) }
        }
        _ => Err(unknown(name_or_path, path)),
    }
}

/// A foreign scene as the text of a scene file whose paths start at the folder `base`: `.xml` (see [`mitsuba`]), `.pbrt` (see
/// [`pbrt`]), `.gltf` or `.glb` (see [`gltf`]), or `.obj`.
pub fn translation(path: &str, base: &Path) -> Result<Translation, SceneError> {
    let path = Path::new(path);
    crate::file::check(path).map_err(|error| unreadable(path, error))?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    match path.extension() {
        Some(ending) if ending.eq_ignore_ascii_case("xml") => mitsuba::translate(path, base, &stem),
        Some(ending) if ending.eq_ignore_ascii_case("pbrt") => pbrt::translate(path, base, &stem),
        Some(ending) if ending.eq_ignore_ascii_case("gltf") || ending.eq_ignore_ascii_case("glb") => {
            gltf::translate(path, base, &stem)
        }
        Some(ending) if ending.eq_ignore_ascii_case("obj") => obj::translate(path, base),
        _ => Err(SceneError::invalid(
            "this kind of file is not translated",
            "give a .xml, .pbrt, .gltf, .glb or .obj file",
        )
        .in_file(path)),
    }
}

fn unknown(name: &str, path: &Path) -> SceneError {
    if path.exists() {
        let mend =
            "scenes are read from `.toml`, `.obj`, `.ply`, `.gltf`, `.glb`, Mitsuba's `.xml` and pbrt's `.pbrt` files";
        return SceneError::invalid("this kind of file is not read", mend).in_file(path);
    }
    let mend = format!(
        "{}; or give the path of a .toml, .obj, .ply, .gltf, .glb, .xml or .pbrt file",
        did_you_mean(name, builtin::NAMES)
    );
    SceneError::Unknown { name: name.to_string(), mend }
}

/// A missing file, with the nearest name of its folder.
fn unreadable(path: &Path, error: std::io::Error) -> SceneError {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or("");
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut siblings: Vec<String> = std::fs::read_dir(folder)
        .map(|entries| entries.flatten().filter_map(|entry| entry.file_name().into_string().ok()).collect())
        .unwrap_or_default();
    siblings.sort();
    let siblings: Vec<&str> = siblings.iter().map(String::as_str).collect();
    let mend = match suggest::nearest(name, &siblings) {
        Some(near) if near != name => format!("did you mean `{}`?", path.with_file_name(near).display()),
        _ => "give the path of a .toml, .obj, .ply, .gltf, .glb, .xml or .pbrt file".to_string(),
    };
    SceneError::unreadable(path, error, mend)
}

fn not_utf8(path: &Path, error: &std::string::FromUtf8Error) -> SceneError {
    let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
    let line = 1 + valid.iter().filter(|&&byte| byte == b'\n').count();
    SceneError::invalid("the text is not UTF-8", "save the file as UTF-8").in_file(path).at_line(line)
}
