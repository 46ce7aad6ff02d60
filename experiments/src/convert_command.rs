//! `neumann convert`: another program's scene as a scene file.

use crate::cli::{ConvertArgs, print};
use crate::error::{Error, Status};
use crate::export::write_atomically;
use crate::output;
use scenes::import::mitsuba::MESH_HEADER;
use scenes::import::translation::SCENE_HEADER;
use std::path::{Path, PathBuf};

/// Translates a scene and writes it, with the meshes that have no file of their own beside it.
///
/// # Errors
/// If the scene cannot be read as it is translated, or a mesh would replace a file that this command did not write.
pub fn convert(args: &ConvertArgs) -> Result<Status, Error> {
    let has_ending = |path: &Path, ending: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
    let source = Path::new(&args.scene);
    if has_ending(source, "toml") || scenes::builtin_names().contains(&args.scene.as_str()) {
        let message = format!("{}: this is a scene file already; give a .xml, .pbrt or .obj file", args.scene);
        return Err(Error::usage(message));
    }
    if !has_ending(&args.output, "toml") {
        let name = args.output.with_extension("toml");
        let message = format!("{}: scene files are TOML; call it {}", args.output.display(), name.display());
        return Err(Error::usage(message));
    }
    output::check_file(&args.output)?;
    check_own(&args.output, SCENE_HEADER)?;
    let folder = args.output.parent().unwrap_or(Path::new(""));
    let translation = scenes::load::translation(&args.scene, folder)?;
    // What cannot be read again is not written.
    translation.read("converted", folder, None)?;
    let meshes: Vec<(PathBuf, &str)> = translation
        .attachments
        .iter()
        .map(|attachment| (folder.join(&attachment.name), attachment.text.as_str()))
        .collect();
    for (path, _) in &meshes {
        output::check_file(path)?;
        check_own(path, MESH_HEADER)?;
    }
    for (path, text) in &meshes {
        write_atomically(path, text.as_bytes())?;
    }
    write_atomically(&args.output, translation.text.as_bytes())?;
    let mut text = format!("{}: made of {}, {} meshes beside it\n", args.output.display(), args.scene, meshes.len());
    for note in &translation.notes {
        text += &format!("  {note}\n");
    }
    print(&text)?;
    Ok(Status::Done)
}

/// Refuses to replace a file that is not known by its first line.
fn check_own(path: &Path, header: &str) -> Result<(), Error> {
    let Ok(bytes) = std::fs::read(path) else { return Ok(()) };
    if bytes.starts_with(header.as_bytes()) {
        return Ok(());
    }
    let message = format!("{}: this file is in the way, and was not made by neumann", path.display());
    Err(Error::usage(format!("{message}; move it, or write the scene to another folder")))
}
