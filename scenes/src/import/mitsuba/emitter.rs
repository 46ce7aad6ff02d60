//! Emitters that are no shapes.

use glam::{DMat3, DMat4, DVec3};

use super::context::Context;
use super::plugin::Plugin;
use super::spectrum::{self, Quantity};
use super::transform::{is_similarity, steps};
use super::xml::Element;
use crate::error::SceneError;
use crate::import::translation::{Lines, NoteKind, colour, number, numbers, quoted};

/// Writes an emitter.
pub fn write<'a>(element: &'a Element, context: &mut Context<'a>) -> Result<(), SceneError> {
    let plugin = Plugin::new(element, context)?;
    let to_world = plugin.transform("to_world", context)?;
    plugin.skip(&["sampling_weight", "id"]);
    let lines = match plugin.kind() {
        "point" => point(&plugin, &to_world, context)?,
        "spot" => spot(&plugin, &to_world, context)?,
        "directional" => directional(&plugin, &to_world, context)?,
        "constant" => {
            let radiance = emitted(&plugin, "radiance", context)?;
            radiance.map(|radiance| ("constant", vec![("radiance", colour(radiance))]))
        }
        "envmap" => environment(&plugin, &to_world, context)?,
        "area" => {
            let text = "an emitter `area` that stands in no shape is left out; move it into the shape that emits";
            context.approximate(plugin.place(), text);
            return Ok(());
        }
        kind => {
            context.approximate(plugin.place(), format!("an emitter `{kind}` is not known, and is left out"));
            return Ok(());
        }
    };
    let Some((kind, keys)) = lines else { return Ok(()) };
    if matches!(kind, "constant" | "environment") {
        if context.has_environment {
            context.approximate(plugin.place(), "there is one environment; a second is left out");
            return Ok(());
        }
        context.has_environment = true;
    }
    context.mapped(element, &format!("`{kind}`"));
    plugin.finish(context);
    let mut lines = Lines::default();
    lines.table(plugin.place(), "[[emitters]]");
    lines.key(plugin.place(), "type", quoted(kind));
    lines.label(plugin.place(), element.attribute("id"));
    for (key, value) in keys {
        lines.key(plugin.place(), key, value);
    }
    context.emitters.append(lines);
    Ok(())
}

/// The type of an emitter and its keys, or nothing where it emits nothing.
type Written = Option<(&'static str, Vec<(&'static str, String)>)>;

/// The colour of light under this name, 1 where it is missing; `None`, and a note, where it is 0.
fn emitted<'a>(plugin: &Plugin<'a>, name: &str, context: &mut Context<'a>) -> Result<Option<[f64; 3]>, SceneError> {
    let rgb = match plugin.part(name) {
        Some(part) if part.tag == "texture" && !spectrum::is_colour(part) => {
            context.approximate(&part.place, format!("the texture of {} is left out", plugin.element.title()));
            [1.0; 3]
        }
        Some(part) => spectrum::colour(part, Quantity::Emission, context)?,
        None => [1.0; 3],
    };
    if rgb == [0.0; 3] {
        context.note(NoteKind::Ignored, plugin.place(), "an emitter of nothing");
        return Ok(None);
    }
    Ok(Some(rgb))
}

fn vector(v: DVec3) -> String {
    numbers(&v.to_array())
}

fn point<'a>(plugin: &Plugin<'a>, to_world: &DMat4, context: &mut Context<'a>) -> Result<Written, SceneError> {
    let Some(intensity) = emitted(plugin, "intensity", context)? else { return Ok(None) };
    let position = plugin.vector("position")?.unwrap_or_default();
    let position = to_world.transform_point3(position);
    Ok(Some(("point", vec![("position", vector(position)), ("intensity", colour(intensity))])))
}

/// It shines along +z; its fall-off from the beam to the cut-off is linear in the angle.
fn spot<'a>(plugin: &Plugin<'a>, to_world: &DMat4, context: &mut Context<'a>) -> Result<Written, SceneError> {
    let Some(intensity) = emitted(plugin, "intensity", context)? else { return Ok(None) };
    let cutoff = plugin.float_or("cutoff_angle", 20.0)?;
    let beam = plugin.float_or("beam_width", cutoff * 0.75)?;
    if plugin.part("texture").is_some() {
        context.approximate(plugin.place(), "the texture of a `spot` is left out");
    }
    let position = to_world.transform_point3(DVec3::ZERO);
    let target = position + to_world.transform_vector3(DVec3::Z).normalize();
    Ok(Some((
        "spot",
        vec![
            ("position", vector(position)),
            ("target", vector(target)),
            ("intensity", colour(intensity)),
            ("cutoff", number(cutoff)),
            ("beam", number(beam)),
        ],
    )))
}

fn directional<'a>(plugin: &Plugin<'a>, to_world: &DMat4, context: &mut Context<'a>) -> Result<Written, SceneError> {
    let Some(irradiance) = emitted(plugin, "irradiance", context)? else { return Ok(None) };
    let direction = match plugin.vector("direction")? {
        Some(direction) => direction,
        None => to_world.transform_vector3(DVec3::Z),
    };
    let Some(direction) = direction.try_normalize() else {
        return Err(plugin.place().error("the `direction` is zero", "give a direction"));
    };
    Ok(Some(("directional", vec![("direction", vector(direction)), ("irradiance", colour(irradiance))])))
}

fn environment<'a>(plugin: &Plugin<'a>, to_world: &DMat4, context: &mut Context<'a>) -> Result<Written, SceneError> {
    let Some(name) = plugin.text("filename")? else {
        return Err(plugin.place().error("`emitter envmap` has no `filename`", "name an image"));
    };
    let file = match context.find(name, plugin.place()) {
        Some(path) => context.named_from_base(&path),
        None => name.to_string(),
    };
    let scale = match plugin.part("scale") {
        Some(part) if part.tag == "float" => [plugin.float_or("scale", 1.0)?; 3],
        Some(part) => spectrum::colour(part, Quantity::Emission, context)?,
        None => [1.0; 3],
    };
    if scale == [0.0; 3] {
        context.note(NoteKind::Ignored, plugin.place(), "an emitter of nothing");
        return Ok(None);
    }
    plugin.skip(&["cache", "mis_compensation"]);
    let mut keys = vec![("image", quoted(&file)), ("mapping", quoted("equirectangular_to_poles"))];
    if scale != [1.0; 3] {
        keys.push(("scale", colour(scale)));
    }
    if !is_similarity(to_world, 1e-4) {
        context
            .approximate(plugin.place(), "the transform of an `envmap` only turns it: what else it does is left out");
    }
    let turn = DMat4::from_mat3(orthonormal(DMat3::from_mat4(*to_world)));
    if let Some(steps) = steps(&[turn]) {
        keys.push(("transform", steps));
    }
    Ok(Some(("environment", keys)))
}

/// The rotation, mirrored or not, nearest to a map's first two axes.
fn orthonormal(map: DMat3) -> DMat3 {
    let x = map.x_axis.normalize();
    let y = (map.y_axis - x * map.y_axis.dot(x)).normalize();
    let z = x.cross(y) * map.determinant().signum();
    DMat3::from_cols(x, y, z)
}
