//! `neumann convert`: another program's scene as a scene file.

use crate::cli::{ConvertArgs, print};
use crate::error::{Error, Status};
use crate::export::write_atomically;
use crate::output;
use scenes::import::mitsuba::MESH_HEADER;
use scenes::import::ply::write;
use scenes::import::translation::SCENE_HEADER;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Translates a scene and writes it, with the meshes and images that have no file of their own beside it.
///
/// # Errors
/// If the scene cannot be read as it is translated, or a mesh or an image would replace a file that this command did not write.
pub fn convert(args: &ConvertArgs) -> Result<Status, Error> {
    let source = Path::new(&args.scene);
    if output::has_ending(source, "toml") || scenes::builtin_names().contains(&args.scene.as_str()) {
        let message =
            format!("{}: this is a scene file already; give a .xml, .pbrt, .gltf, .glb or .obj file", args.scene);
        return Err(Error::usage(message));
    }
    if !output::has_ending(&args.output, "toml") {
        let name = args.output.with_extension("toml");
        let message = format!("{}: scene files are TOML; call it {}", args.output.display(), name.display());
        return Err(Error::usage(message));
    }
    output::check_file(&args.output)?;
    check_own(&args.output, SCENE_HEADER.as_bytes())?;
    let folder = args.output.parent().unwrap_or(Path::new(""));
    let translation = scenes::load::translation(&args.scene, folder)?;
    // What cannot be read again is not written.
    translation.read("converted", folder, None)?;
    let beside: Vec<(PathBuf, &[u8])> = translation
        .attachments
        .iter()
        .map(|attachment| (folder.join(&attachment.name), attachment.bytes.as_slice()))
        .collect();
    for (path, bytes) in &beside {
        output::check_file(path)?;
        // An image says nowhere who made it: only the same one is replaced.
        let header = [MESH_HEADER, write::HEADER].into_iter().find(|header| bytes.starts_with(header.as_bytes()));
        check_own(path, header.map_or(bytes, str::as_bytes))?;
    }
    for (path, bytes) in &beside {
        write_atomically(path, bytes)?;
    }
    write_atomically(&args.output, translation.text.as_bytes())?;
    let mut text = format!("{}: made of {}, {} files beside it\n", args.output.display(), args.scene, beside.len());
    for note in &translation.notes {
        text += &format!("  {note}\n");
    }
    print(&text)?;
    Ok(Status::Done)
}

/// Refuses to replace a file that is not known by its first line.
fn check_own(path: &Path, header: &[u8]) -> Result<(), Error> {
    let Ok(file) = scenes::file::open(path) else { return Ok(()) };
    let mut start = Vec::with_capacity(header.len());
    if file.take(header.len() as u64).read_to_end(&mut start).is_ok() && start == header {
        return Ok(());
    }
    let message = format!("{}: this file is in the way, and was not made by neumann", path.display());
    Err(Error::usage(format!("{message}; move it, or write the scene to another folder")))
}
