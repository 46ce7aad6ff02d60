//! Emitters that are no shapes.

use std::f64::consts::PI;

use glam::{DMat3, DMat4, DVec3};

use super::context::Context;
use super::parameters::Parameters;
use super::spectrum;
use crate::error::SceneError;
use crate::import::mitsuba::transform::{is_similarity, steps};
use crate::import::translation::{Lines, NoteKind, colour, number, numbers, quoted};

/// The type of an emitter and its keys, or nothing where it emits nothing.
type Written = Option<(&'static str, Vec<(&'static str, String)>)>;

/// Writes an emitter that stands where `map` leads to.
pub fn write(parameters: &Parameters, map: &DMat4, context: &mut Context) -> Result<(), SceneError> {
    let written = match parameters.kind.as_str() {
        "point" => point(parameters, map, context)?,
        "spot" => spot(parameters, map, context)?,
        "distant" => distant(parameters, map, context)?,
        "infinite" => infinite(parameters, map, context)?,
        _ => {
            let text = format!("{} is not known, and is left out", parameters.title());
            context.approximate(&parameters.place, text);
            return Ok(());
        }
    };
    let Some((kind, keys)) = written else {
        context.note(NoteKind::Ignored, &parameters.place, "an emitter of nothing");
        return Ok(());
    };
    if matches!(kind, "constant" | "environment") {
        if context.has_environment {
            context.approximate(&parameters.place, "there is one environment; a second is left out");
            return Ok(());
        }
        context.has_environment = true;
    }
    context.mapped(parameters, &format!("`{kind}`"));
    parameters.skip(&["samples", "nsamples"]);
    parameters.finish(context);
    let mut lines = Lines::default();
    lines.table(&parameters.place, "[[emitters]]");
    lines.key(&parameters.place, "type", quoted(kind));
    for (key, value) in keys {
        lines.key(&parameters.place, key, value);
    }
    context.emitters.append(lines);
    Ok(())
}

fn vector(v: DVec3) -> String {
    numbers(&v.to_array())
}

/// The light under this name, brought to the `power` that is asked for by what it would be otherwise.
fn powered(
    parameters: &Parameters,
    name: &str,
    flux: f64,
    context: &mut Context,
) -> Result<Option<[f64; 3]>, SceneError> {
    let mut rgb = spectrum::light(parameters, name, context)?;
    let goal = parameters.float(if name == "I" { "power" } else { "illuminance" })?;
    if let Some(goal) = goal.filter(|goal| *goal > 0.0) {
        rgb = rgb.map(|c| c * goal / flux);
    }
    Ok((rgb != [0.0; 3]).then_some(rgb))
}

fn point(parameters: &Parameters, map: &DMat4, context: &mut Context) -> Result<Written, SceneError> {
    let Some(intensity) = powered(parameters, "I", 4.0 * PI, context)? else { return Ok(None) };
    let position = map.transform_point3(parameters.point_or("from", DVec3::ZERO)?);
    Ok(Some(("point", vec![("position", vector(position)), ("intensity", colour(intensity))])))
}

fn ends(parameters: &Parameters, map: &DMat4) -> Result<(DVec3, DVec3), SceneError> {
    let (from, to) = (parameters.point_or("from", DVec3::ZERO)?, parameters.point_or("to", DVec3::Z)?);
    if (to - from).try_normalize().is_none() {
        return Err(parameters.place_of("to").error("`from` and `to` are the same", "let them differ"));
    }
    Ok((map.transform_point3(from), map.transform_point3(to)))
}

fn spot(parameters: &Parameters, map: &DMat4, context: &mut Context) -> Result<Written, SceneError> {
    let cutoff = parameters.positive("coneangle", 30.0)?;
    let edge = parameters.float_or("conedeltaangle", 5.0)?;
    let beam = (cutoff - edge).clamp(0.0, cutoff);
    let (inner, outer) = (beam.to_radians().cos(), cutoff.to_radians().cos());
    let flux = 2.0 * PI * ((1.0 - inner) + 0.5 * (inner - outer));
    let Some(intensity) = powered(parameters, "I", flux, context)? else { return Ok(None) };
    let (from, to) = ends(parameters, map)?;
    Ok(Some((
        "spot",
        vec![
            ("position", vector(from)),
            ("target", vector(to)),
            ("intensity", colour(intensity)),
            ("cutoff", number(cutoff)),
            ("beam", number(beam)),
            ("falloff", quoted("smooth")),
        ],
    )))
}

fn distant(parameters: &Parameters, map: &DMat4, context: &mut Context) -> Result<Written, SceneError> {
    let Some(irradiance) = powered(parameters, "L", 1.0, context)? else { return Ok(None) };
    let (from, to) = ends(parameters, map)?;
    let direction = (to - from).normalize();
    Ok(Some(("directional", vec![("direction", vector(direction)), ("irradiance", colour(irradiance))])))
}

fn infinite(parameters: &Parameters, map: &DMat4, context: &mut Context) -> Result<Written, SceneError> {
    if parameters.find("portal").is_some() {
        context.note(
            NoteKind::Ignored,
            parameters.place_of("portal"),
            "the `portal` of a light, which changes noise alone",
        );
    }
    // Before v4 the image is named otherwise, and lies by longitude and latitude.
    let (name, is_old) = match (parameters.text("filename")?, parameters.text("mapname")?) {
        (Some(name), _) => (name, false),
        (None, Some(name)) => (name, true),
        (None, None) => {
            let radiance = powered(parameters, "L", PI, context)?;
            return Ok(radiance.map(|radiance| ("constant", vec![("radiance", colour(radiance))])));
        }
    };
    let place = parameters.place_of(if is_old { "mapname" } else { "filename" });
    let file = context.file_name(name, place);
    if parameters.float("illuminance")?.is_some_and(|goal| goal > 0.0) {
        context.approximate(place, "the `illuminance` of an image is left out: it is as bright as it is");
    }
    let mut scale = spectrum::scale(parameters, context)?;
    if is_old && parameters.find("L").is_some() {
        // Before v4 the image is multiplied by it.
        scale = spectrum::light(parameters, "L", context)?;
    }
    if scale == [0.0; 3] {
        return Ok(None);
    }
    let mut keys = vec![("image", quoted(&file))];
    if !is_old {
        keys.push(("mapping", quoted("equal_area")));
    }
    if scale != [1.0; 3] {
        keys.push(("scale", colour(scale)));
    }
    if !is_similarity(map, 1e-4) {
        context.approximate(
            &parameters.place,
            "the transform of an environment only turns it: what else it does is left out",
        );
    }
    let axes = DMat3::from_mat4(*map);
    let x = axes.x_axis.normalize();
    let y = (axes.y_axis - x * axes.y_axis.dot(x)).normalize();
    let turn = DMat3::from_cols(x, y, x.cross(y) * axes.determinant().signum());
    // v3 has +z at the upper edge and −x in the centre, where we have +y and +z.
    let turn = if is_old { turn * DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::NEG_X) } else { turn };
    if let Some(steps) = steps(&[DMat4::from_mat3(turn)]) {
        keys.push(("transform", steps));
    }
    Ok(Some(("environment", keys)))
}
