//! Scenes of Mitsuba 3 and 2, and the common parts of Mitsuba 0.4 to 0.6, from XML.
//!
//! `xml` reads the text, `plugin` looks parameters up, `context` keeps what is known meanwhile; `transform`,
//! `spectrum` with its `observer`, `texture`, `bsdf` with `material` and `index`, `shape` with `mesh` and
//! `serialized`, `emitter`, and `sensor` with `meter` each write what a kind of thing becomes in the
//! language of scene files. `docs/importers.md` has the table of what is exact, what is near, and what is left out.

mod bsdf;
mod context;
mod emitter;
mod faces;
mod index;
mod material;
pub(super) mod mesh;
mod metals;
mod meter;
pub(super) mod observer;
mod plugin;
mod round;
mod sensor;
mod serialized;
mod shape;
mod spectrum;
mod texture;
pub(super) mod transform;
mod xml;

#[cfg(test)]
mod tests;

use std::path::Path;

use context::{Context, Counted};
pub use mesh::HEADER as MESH_HEADER;
use plugin::Plugin;
use xml::Element;

use crate::error::SceneError;
use crate::import::translation::{Lines, NoteKind, Place, SCENE_HEADER, Translation, quoted};
use crate::import::viewpoint;
use glam::DVec3;

/// The highest order that is written as it is; beyond it the rest is asked for as one sum.
pub(super) const HIGHEST_ORDER: i64 = 20;

/// Translates the scene at `path`. Files are named from the folder `base`, and meshes without a file begin with `stem`.
pub fn translate(path: &Path, base: &Path, stem: &str) -> Result<Translation, SceneError> {
    let xml = xml::read(path)?;
    let mut context = Context::new(&xml, base, stem)?;
    let mut head = Lines::default();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    head.push(&xml.root.place, format!("{SCENE_HEADER} {}.", name.escape_default()));
    head.key(&xml.root.place, "title", quoted(&path.file_stem().unwrap_or_default().to_string_lossy()));
    let mut has_integrator = false;
    for child in &xml.root.children {
        let child = context.resolved(child)?;
        match child.tag.as_str() {
            "integrator" if !std::mem::replace(&mut has_integrator, true) => {
                integrator(child, &mut head, &mut context)?;
            }
            "integrator" => context.note(NoteKind::Ignored, &child.place, "a second integrator"),
            "sensor" if context.camera.is_none() => context.camera = Some(sensor::write(child, &mut context)?),
            "sensor" => context.note(NoteKind::Ignored, &child.place, "a second sensor"),
            "shape" => shape::write(child, &mut context)?,
            "emitter" => emitter::write(child, &mut context)?,
            // What is referred to is written where it is used.
            "bsdf" | "texture" | "spectrum" | "rgb" | "alias" => {}
            _ => {
                let text = format!("{} of the scene is left out", child.title());
                context.approximate(&child.place, text);
            }
        }
    }
    context.check_files()?;
    tell_passing(&mut context);
    let camera = match context.camera.take() {
        Some(camera) => camera,
        None => missing_camera(&xml.root.place, base, &mut context)?,
    };
    for part in [camera, context.materials, context.groups, context.shapes, context.emitters] {
        head.append(part);
    }
    Ok(Translation::new(head, context.meshes.all(), context.notes))
}

/// Light that passes a mask keeps its order, and a `null` gives it one more, whatever Mitsuba's integrator counts.
fn tell_passing(context: &mut Context) {
    let mask = "light that passes a mask keeps its order here, where Mitsuba counts it towards `max_depth`";
    let null = "light that passes a `null` has an order more here, where Mitsuba does not count it towards `max_depth`";
    let (at, text) = match context.counted {
        Some(Counted::Surfaces) => (context.mask.clone(), mask),
        Some(Counted::Turns) => (context.null.clone(), null),
        None => return,
    };
    if let Some(at) = at {
        context.approximate(&at, text);
    }
}

/// The camera of a scene without one, which is read to know its bounds, and light if it has none either.
fn missing_camera(place: &Place, base: &Path, context: &mut Context) -> Result<Lines, SceneError> {
    let mut scene = Lines::default();
    let parts = [&context.materials, &context.groups, &context.shapes, &context.emitters];
    scene.append(sensor::table((DVec3::ZERO, DVec3::ONE), place));
    parts.into_iter().for_each(|part| scene.append(part.clone()));
    let scene = Translation::new(scene, context.meshes.clone().all(), context.notes.clone());
    let scene = scene.read("scene", base, None)?;
    if scene.is_dark() {
        viewpoint::tell_light(&mut context.notes, place);
        context.emitters.append(viewpoint::light(place));
    }
    Ok(sensor::missing(scene.extent()?, place, context))
}

/// How far the series goes: `max_depth` counts the vertices of a path beyond the camera's, one more than its order.
fn integrator<'a>(element: &'a Element, head: &mut Lines, context: &mut Context<'a>) -> Result<(), SceneError> {
    let mut element = element;
    // Of integrators within others, such as `aov` and `moment`, the innermost counts.
    while let Some(inner) = element.children.iter().find(|child| child.tag == "integrator") {
        element = inner;
    }
    let plugin = Plugin::new(element, context)?;
    let kind = plugin.kind();
    let place = plugin.place();
    let depth = plugin.integer("max_depth")?;
    let at = plugin.part("max_depth").map_or(place, |part| &part.place);
    let depth = if kind == "direct" { depth.or(Some(2)) } else { depth.or(Some(-1)) };
    match depth {
        Some(depth) if depth >= 1 && depth - 1 <= HIGHEST_ORDER => {
            head.key(at, "max_order", depth - 1);
            let of_volumes = element.version >= 2 && kind.starts_with("volpath");
            context.counted = Some(if of_volumes { Counted::Turns } else { Counted::Surfaces });
            context.note(NoteKind::Mapped, at, format!("`max_depth` {depth} becomes `max_order` {}", depth - 1));
        }
        Some(0) => context.approximate(at, "a `max_depth` of 0 renders nothing, and is left out"),
        Some(depth) => {
            head.key(at, "tail", "true");
            let text = match depth {
                ..0 => "a series without end is rendered with its tail".to_string(),
                _ => format!("a `max_depth` of {depth} is rendered as a series without end"),
            };
            let kind = if depth < 0 { NoteKind::Mapped } else { NoteKind::Approximated };
            context.note(kind, at, text);
        }
        None => {}
    }
    let known = ["path", "direct", "volpath", "volpathsimple", "bdpt", "ptracer", "prb", "prb_basic"];
    let text = match known.contains(&kind) {
        true => format!("the integrator `{kind}`: methods are chosen when a scene is rendered"),
        false => format!("the integrator `{kind}`, which is not known: methods are chosen when a scene is rendered"),
    };
    context.note(NoteKind::Ignored, place, text);
    if plugin.boolean("hide_emitters")? == Some(true) {
        context.approximate(place, "`hide_emitters` is left out: emitters are seen");
    }
    Ok(())
}
