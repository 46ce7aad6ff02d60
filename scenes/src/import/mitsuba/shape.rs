//! Shapes.

use std::path::Path;

use glam::{DMat3, DMat4};

use super::context::Context;
use super::faces::{self, Faces, Part};
use super::plugin::Plugin;
use super::spectrum::Quantity;
use super::transform::steps;
use super::xml::Element;
use super::{material, mesh, round, serialized, texture};
use crate::error::SceneError;
use crate::import::obj::Model;
use crate::import::translation::{Lines, MEMBER, NoteKind, numbers, quoted};

/// A shape's geometry as it will be written.
pub struct Form {
    /// Its type in scene files.
    pub kind: &'static str,
    /// Its keys.
    pub keys: Vec<(&'static str, String)>,
    /// From its own frame to the world.
    pub transform: DMat4,
    /// Whether v of its texture coordinates is Mitsuba's turned over.
    pub turned: bool,
    /// Whether its front is the other side than Mitsuba's.
    pub other_side: bool,
    /// Whether it has texture coordinates.
    pub has_uvs: bool,
}

impl Form {
    /// Of a type, with its keys.
    pub fn new(kind: &'static str, keys: Vec<(&'static str, String)>, transform: DMat4) -> Self {
        Self { kind, keys, transform, turned: false, other_side: false, has_uvs: true }
    }
}

/// Writes a shape.
pub fn write<'a>(element: &'a Element, context: &mut Context<'a>) -> Result<(), SceneError> {
    context.enter(element)?;
    let plugin = Plugin::new(element, context)?;
    let named = plugin.named("bsdf");
    if element.kind() == "obj" && element.version < 2 && named.len() > 1 {
        // Before Mitsuba 2 faces have the materials that are called as the file has them, and others the one without a name.
        let names: Vec<&str> = named.iter().map(|(name, _)| *name).collect();
        for (name, bsdf) in &named {
            write_one(element, Some(Part { faces: Faces::Of(name), bsdfs: vec![bsdf] }), context)?;
        }
        let nameless = |bsdf: &&Element| !named.iter().any(|(_, other)| std::ptr::eq(*bsdf, *other));
        let bsdfs = plugin.tagged("bsdf").into_iter().filter(nameless).collect();
        write_one(element, Some(Part { faces: Faces::Others(&names), bsdfs }), context)?;
        context.parted = None;
    } else {
        write_one(element, None, context)?;
    }
    context.leave();
    Ok(())
}

/// Writes a shape, or a part of it.
fn write_one<'a>(
    element: &'a Element,
    part: Option<Part<'a, '_>>,
    context: &mut Context<'a>,
) -> Result<(), SceneError> {
    let plugin = Plugin::new(element, context)?;
    match plugin.kind() {
        "shapegroup" => {
            // It is seen where it is instanced.
            return Ok(());
        }
        "instance" => return instance(&plugin, context),
        "merge" => {
            for shape in plugin.tagged("shape") {
                write(shape, context)?;
            }
            plugin.finish(context);
            return Ok(());
        }
        _ => {}
    }
    let Some(to_world) = plugin.placement(context)? else { return Ok(()) };
    let flipped = plugin.boolean("flip_normals")?.unwrap_or(false);
    let Some(form) = form(&plugin, to_world, part.as_ref().map(|part| part.faces), context)? else { return Ok(()) };
    context.mapped(element, &format!("`{}`", form.kind));
    let emitters = plugin.tagged("emitter");
    let mut materials = plugin.tagged("bsdf");
    if let Some(part) = part {
        materials = part.bsdfs;
    }
    for other in materials.iter().skip(1).chain(emitters.iter().skip(1)) {
        context.approximate(
            &other.place,
            format!("{} is the second of {}, and is left out", other.title(), element.title()),
        );
    }
    let holds_medium = media(&plugin, context);
    let material = match materials.first() {
        Some(bsdf) => material::named(bsdf, form.turned, context)?,
        None if holds_medium && element.version < 2 => material::null(&element.place, context),
        None => material::usual(&element.place, !emitters.is_empty(), context),
    };
    let before = context.uv_textures;
    let emission = match emitters.first() {
        Some(emitter) => radiance(emitter, form.turned, context)?,
        None => None,
    };
    let is_mapped = context.uv_textures > before || context.mapped_materials.contains(&material);
    for sensor in plugin.tagged("sensor") {
        if context.in_group() {
            return Err(sensor.place.error("a sensor is part of a `shapegroup`", "move its shape out of the group"));
        }
        if context.camera.is_some() {
            context.note(NoteKind::Ignored, &sensor.place, "a second sensor");
            continue;
        }
        context.camera = Some(super::meter::irradiance(sensor, &plugin, &to_world, flipped, context)?);
    }
    plugin.skip(&["id"]);
    plugin.finish(context);
    let mut lines = Lines::default();
    let place = &element.place;
    lines.table(place, context.header);
    lines.key(place, "type", quoted(form.kind));
    lines.label(place, element.attribute("id"));
    for (key, value) in &form.keys {
        lines.key(place, key, value);
    }
    lines.key(place, "material", quoted(&material));
    if is_mapped && !form.has_uvs {
        let text = "triangles without texture coordinates have their barycentric ones, as in Mitsuba";
        context.note(NoteKind::Mapped, place, text);
        let turned = "[[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]";
        lines.key(place, "corner_uvs", if form.turned { turned } else { "[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]" });
    }
    if let Some((emission, emitter)) = emission {
        if context.in_group() {
            let text = "a shape of a group that emits is copied for each instance";
            context.note(NoteKind::Mapped, &emitter.place, text);
        }
        lines.key(&emitter.place, "emission", emission);
    }
    if flipped != form.other_side {
        lines.key(place, "flip", "true");
    }
    if let Some(steps) = steps(&[form.transform]) {
        let place = plugin.part("to_world").map_or(place, |part| &part.place);
        lines.key(place, "transform", steps);
    }
    context.shapes.append(lines);
    Ok(())
}

/// Whether a shape has a medium to a side of it; there are none here, which is told.
fn media<'a>(plugin: &Plugin<'a>, context: &mut Context<'a>) -> bool {
    let mut media: Vec<&Element> = ["interior", "exterior"].iter().filter_map(|side| plugin.part(side)).collect();
    media.extend(plugin.tagged("medium"));
    for medium in &media {
        context.approximate(
            &medium.place,
            format!("{} is left out: light goes through it as through a vacuum", medium.title()),
        );
    }
    !media.is_empty()
}

/// What a shape emits, as TOML, and its element.
fn radiance<'a>(
    emitter: &'a Element,
    turned: bool,
    context: &mut Context<'a>,
) -> Result<Option<(String, &'a Element)>, SceneError> {
    let plugin = Plugin::new(emitter, context)?;
    if plugin.kind() != "area" {
        context.approximate(plugin.place(), format!("{} of a shape is left out", emitter.title()));
        return Ok(None);
    }
    // Older files call it intensity.
    let name = if plugin.part("radiance").is_some() { "radiance" } else { "intensity" };
    let radiance = match plugin.part(name) {
        Some(part) => texture::read(part, Quantity::Emission, context)?,
        None => texture::Texture::grey(1.0),
    };
    plugin.skip(&["sampling_weight", "id"]);
    plugin.finish(context);
    if radiance.constant() == Some([0.0; 3]) {
        context.note(NoteKind::Ignored, plugin.place(), "an emitter of radiance 0");
        return Ok(None);
    }
    context.mapped(emitter, "`emission`");
    Ok(Some((radiance.toml(turned), emitter)))
}

/// A group of shapes, somewhere.
fn instance<'a>(plugin: &Plugin<'a>, context: &mut Context<'a>) -> Result<(), SceneError> {
    let Some(to_world) = plugin.placement(context)? else { return Ok(()) };
    let group = plugin.tagged("shape").into_iter().find(|shape| shape.kind() == "shapegroup");
    let Some(group) = group else {
        return Err(plugin.place().error("`shape instance` refers to no `shapegroup`", "add `<ref id=\"…\"/>`"));
    };
    plugin.skip(&["id"]);
    plugin.finish(context);
    if let Some(name) = written(group, context)? {
        context.mapped(plugin.element, "`instance`");
        context.shapes.instance(plugin.place(), context.header, &name, steps(&[to_world]));
    }
    Ok(())
}

/// The name of a group, which is written where it is placed first; `None`, and a note, where it has no shapes.
fn written<'a>(group: &'a Element, context: &mut Context<'a>) -> Result<Option<String>, SceneError> {
    if let Some(known) = context.group_names.get(&std::ptr::from_ref(group)) {
        return Ok(known.clone());
    }
    let outer = (std::mem::take(&mut context.shapes), std::mem::replace(&mut context.header, MEMBER));
    for shape in Plugin::new(group, context)?.tagged("shape") {
        write(shape, context)?;
    }
    let shapes = std::mem::replace(&mut context.shapes, outer.0);
    context.header = outer.1;
    let name = if shapes.is_empty() {
        context.approximate(&group.place, "a `shapegroup` without shapes is left out with its instances");
        None
    } else {
        let name = context.fresh_name(group.attribute("id").unwrap_or("group"));
        context.mapped(group, "`groups`");
        context.groups.group(&group.place, &name, shapes);
        Some(name)
    };
    context.group_names.insert(group, name.clone());
    Ok(name)
}

/// What becomes of a shape; `None`, and a note, where that is nothing.
fn form<'a>(
    plugin: &Plugin<'a>,
    transform: DMat4,
    only: Option<Faces>,
    context: &mut Context<'a>,
) -> Result<Option<Form>, SceneError> {
    let text = |vector: [f64; 3]| numbers(&vector);
    Ok(Some(match plugin.kind() {
        "rectangle" => {
            let keys = [("origin", [-1.0, -1.0, 0.0]), ("edge_u", [2.0, 0.0, 0.0]), ("edge_v", [0.0, 2.0, 0.0])];
            Form::new("quad", keys.map(|(key, vector)| (key, text(vector))).to_vec(), transform)
        }
        "disk" => {
            let keys = [("center", [0.0; 3]), ("edge_u", [1.0, 0.0, 0.0]), ("edge_v", [0.0, 1.0, 0.0])];
            Form::new("disk", keys.map(|(key, vector)| (key, text(vector))).to_vec(), transform)
        }
        "cube" => Form::new("mesh", mesh::cube().to_vec(), transform),
        "sphere" => round::sphere(plugin, transform, context)?,
        "cylinder" => round::cylinder(plugin, transform, context)?,
        "obj" | "ply" | "serialized" => return mesh_file(plugin, transform, only, context),
        kind => {
            context.approximate(plugin.place(), format!("a shape `{kind}` is not known, and is left out"));
            return Ok(None);
        }
    }))
}

/// A mesh of a file: the file itself if it can be, and what its loader makes of it otherwise.
/// Of an OBJ it may be `only` some faces.
fn mesh_file<'a>(
    plugin: &Plugin<'a>,
    transform: DMat4,
    only: Option<Faces>,
    context: &mut Context<'a>,
) -> Result<Option<Form>, SceneError> {
    let Some(name) = plugin.text("filename")? else {
        return Err(plugin.place().error(format!("{} has no `filename`", plugin.element.title()), "name a file"));
    };
    let flat = plugin.boolean("face_normals")?.unwrap_or(false);
    let is_obj = plugin.kind() == "obj";
    let index = plugin.integer("shape_index")?.unwrap_or(0);
    if plugin.float("max_smooth_angle")?.is_some() {
        context.approximate(plugin.place(), "a `max_smooth_angle` is left out: normals are smooth everywhere");
    }
    let turned = plugin.boolean("flip_tex_coords")?.unwrap_or(is_obj);
    plugin.skip(&["shape_name"]);
    let Some(path) = context.find(name, plugin.place()) else {
        // It is told of with the others that are missing.
        return Ok(Some(Form { turned, ..Form::new("mesh", vec![("file", quoted(name))], transform) }));
    };
    let mirrored = DMat3::from_mat4(transform).determinant() < 0.0;
    let form = |file: &str, has_normals: bool| Form {
        turned,
        // A mesh without normals has its front where its corners turn, after the transform.
        other_side: mirrored && !has_normals,
        ..Form::new("mesh", vec![("file", quoted(file))], transform)
    };
    if plugin.kind() == "ply" {
        return Ok(Some(ply(plugin, &path, flat, form, context)?));
    }
    let (data, has_normals, of_faces, nameable) = if is_obj {
        let (groups, has_smoothing) = match only {
            Some(faces) => faces::read(&path, faces, plugin.place(), context)?,
            None => {
                let model = Model::open_unsmoothed(&path)?;
                (model.groups.into_iter().map(|group| group.mesh).collect(), model.has_smoothing)
            }
        };
        if only.is_some() && groups.is_empty() {
            return Ok(None);
        }
        let has_normals = groups.iter().any(|mesh| !mesh.normals.is_empty());
        (groups, has_normals, flat, !has_smoothing && only.is_none())
    } else {
        let bytes = crate::file::read(&path)
            .map_err(|error| SceneError::unreadable(&path, error, "name a file that can be read"))?;
        let index = usize::try_from(index)
            .map_err(|_| plugin.place().error("the `shape_index` is negative", "count from 0"))?;
        let found = serialized::read(&path, &bytes, index)?;
        let has_normals = !found.mesh.normals.is_empty();
        (vec![found.mesh], has_normals, flat || found.face_normals, false)
    };
    let mut data = mesh::joined(data);
    let has_uvs = !data.uvs.is_empty();
    let smoothed = if has_normals || of_faces { None } else { mesh::smooth_normals(&data, &transform) };
    if nameable && smoothed.is_none() && !(has_normals && of_faces) {
        return Ok(Some(Form { has_uvs, ..form(&context.named_from_base(&path), has_normals) }));
    }
    if of_faces {
        data.normals.clear();
    }
    if let Some(normals) = smoothed {
        context.note(
            NoteKind::Mapped,
            plugin.place(),
            "a mesh without normals gets those of Mitsuba, smooth between its faces",
        );
        data.normals = normals;
    }
    let file = context.meshes.keep(mesh::obj(&data));
    Ok(Some(Form { has_uvs, ..form(&file, has_normals && !of_faces) }))
}

/// A PLY file, named as it is.
fn ply<'a>(
    plugin: &Plugin<'a>,
    path: &Path,
    flat: bool,
    form: impl Fn(&str, bool) -> Form,
    context: &mut Context<'a>,
) -> Result<Form, SceneError> {
    let bytes =
        crate::file::read(path).map_err(|error| SceneError::unreadable(path, error, "name a file that can be read"))?;
    let [has_normals, has_uvs] = crate::import::ply::properties(&bytes);
    match (has_normals, flat) {
        (true, true) => {
            context.approximate(plugin.place(), "`face_normals` of a `ply` are left out: the file's own hold")
        }
        (false, false) => {
            context
                .approximate(plugin.place(), "a `ply` without normals is flat between its edges; Mitsuba smooths it");
        }
        _ => {}
    }
    Ok(Form { has_uvs, ..form(&context.named_from_base(path), has_normals) })
}
