//! Scenes of glTF 2.0, as `.gltf` with its files and as `.glb`.
//!
//! `container` takes a file apart, `document` with `schema` and `appearance` reads its JSON object by object, `buffers` and
//! `accessor` know where numbers lie; `node` says what stands where, `mesh` with `primitive`, `material` with `model`, `texture`
//! with `image`, `light` and `camera` each write what a kind of thing becomes in the language of scene files; `context` keeps what is
//! known meanwhile. `docs/importers.md` has the table of what is exact, what is near, and what is left out.

// What the parts of a file say is named as the specification names it, which explains them.
mod accessor;
#[allow(missing_docs)]
mod appearance;
mod buffers;
mod camera;
mod container;
mod context;
mod document;
mod image;
mod keys;
mod light;
mod material;
mod mesh;
mod model;
mod node;
mod primitive;
#[allow(missing_docs)]
mod schema;
mod texture;

#[cfg(test)]
mod tests;

use std::path::Path;

use buffers::Asset;
use container::Container;
use context::Context;
use document::Document;
use keys::Unknown;
use mesh::Meshes;

use crate::builder::MeshData;
use crate::error::SceneError;
use crate::import::translation::{Lines, Place, SCENE_HEADER, Translation, quoted, unknown};
use crate::import::viewpoint;
use crate::suggest::shown;

/// Extensions that a file may require.
const EXTENSIONS: [&str; 18] = [
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
];

/// Translates the scene at `path`. Files are named from the folder `base`, and what has no file begins with `stem`.
pub fn translate(path: &Path, base: &Path, stem: &str) -> Result<Translation, SceneError> {
    let bytes = crate::file::read(path)
        .map_err(|error| SceneError::unreadable(path, error, "give the path of a .gltf or .glb file"))?;
    let container = Container::read(path, &bytes)?;
    let document = Document::read(path, container.text)?;
    let root = document.place();
    check(&document, &root)?;
    let asset = Asset::open(document, path.parent().unwrap_or(Path::new("")), container.binary)?;
    let mut context = Context::new(&asset, base, stem);
    for (place, Unknown { key, of, valid }) in asset.document.unknown() {
        let title = if of.is_empty() { "the file".to_string() } else { format!("`{of}`") };
        context.approximate(&place, unknown(&format!("`{}` of {title}", shown(&key)), &key, valid));
    }
    let (nodes, others) = node::placed(&asset)?;
    if others > 0 {
        context.ignore(&root, "other scenes than the file's first");
    }
    if !asset.document.root.animations.is_empty() {
        context.ignore(&root, "animations: the scene is at rest");
    }
    for name in &asset.document.root.extensions_used {
        if !EXTENSIONS.contains(&name.as_str()) {
            context.ignore(&root, format!("the extension `{}`", shown(name)));
        }
    }
    let mut cameras = nodes.iter().filter_map(|placed| Some((placed, placed.node.camera?)));
    let camera = match cameras.next() {
        Some((placed, index)) => Some(camera::write(index, placed, &mut context)?),
        None => None,
    };
    if cameras.next().is_some() {
        context.ignore(&root, "other cameras than the first");
    }
    let count = asset.document.root.list(schema::Kind::Node).len();
    let mut meshes = Meshes::new(&nodes, count, camera.is_none());
    for placed in &nodes {
        let place = asset.document.place_of_item(&placed.item);
        if !placed.visible {
            if placed.node.mesh.is_some() || placed.node.extensions.light.is_some() {
                context.mapped(&place, "what `KHR_node_visibility` hides is left out");
            }
            continue;
        }
        if placed.node.extensions.instancing.is_some() {
            context.approximate(&place, "`EXT_mesh_gpu_instancing` is left out: its mesh stands once");
        }
        if let Some(light) = &placed.node.extensions.light {
            light::write(light.light, placed, &mut context)?;
        }
        if let Some(mesh) = placed.node.mesh {
            meshes.write(mesh, placed, &mut context)?;
        }
    }
    if meshes.triangles == 0 {
        return Err(root.error("the scene has no triangles", "give one with meshes"));
    }
    finish(path, camera, meshes, context)
}

/// Refuses other versions, and extensions that are needed and not known.
fn check(document: &Document, root: &Place) -> Result<(), SceneError> {
    let asset = &document.root.asset;
    let newest = asset.min_version.as_deref().unwrap_or("2.0");
    if !asset.version.starts_with("2.") || newest != "2.0" {
        let version = if newest == "2.0" { &asset.version } else { newest };
        return Err(root.error(format!("this is glTF {}", shown(version)), "save it as glTF 2.0"));
    }
    let unknown = document.root.extensions_required.iter().find(|name| !EXTENSIONS.contains(&name.as_str()));
    let Some(name) = unknown else { return Ok(()) };
    let mend = match name.as_str() {
        "KHR_draco_mesh_compression" | "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
            "export the file without compression"
        }
        "KHR_texture_basisu" | "EXT_texture_webp" | "EXT_texture_avif" | "MSFT_texture_dds" => {
            "export the file with its images as PNG or JPEG"
        }
        _ => "export the file without it",
    };
    Err(root.error(format!("the file requires the extension `{}`, which is not read", shown(name)), mend))
}

/// Puts the text together; what lacks a camera or light gets those that a mesh alone would get.
fn finish(path: &Path, camera: Option<Lines>, meshes: Meshes, mut context: Context) -> Result<Translation, SceneError> {
    let root = context.asset.document.place();
    let mut head = Lines::default();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    head.push(&root, format!("{SCENE_HEADER} {}.", name.escape_default()));
    head.key(&root, "title", quoted(&path.file_stem().unwrap_or_default().to_string_lossy()));
    let camera = camera.unwrap_or_else(|| {
        let kept: Vec<&MeshData> = meshes.kept.iter().collect();
        let camera = viewpoint::choose(&kept, context.emits, (256, 256));
        viewpoint::tell_camera(&camera, &mut context.notes, &root);
        viewpoint::table(&camera, &root)
    });
    if !context.emits {
        viewpoint::tell_light(&mut context.notes, &root);
        context.emitters.append(viewpoint::light(&root));
    }
    for part in [camera, context.materials, meshes.groups, context.shapes, context.emitters] {
        head.append(part);
    }
    Ok(Translation::new(head, context.attachments, context.notes))
}
