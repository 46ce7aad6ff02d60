//! Sensors of a single pixel: along a ray, and of what falls on a shape.

use glam::{DMat4, DVec3};

use super::context::Context;
use super::plugin::Plugin;
use super::xml::Element;
use crate::error::SceneError;
use crate::import::translation::{Lines, NoteKind, number, numbers, quoted};

/// How wide the film of a `radiancemeter` is, over the distance of its position from the origin or over a metre: less than
/// coordinates resolve, so that all of its rays are one.
const WIDTH_OF_A_RAY: f64 = 1e-9;

/// What both have in common: one pixel, whose filter changes nothing.
fn check_film<'a>(plugin: &Plugin<'a>, context: &mut Context<'a>) -> Result<(), SceneError> {
    if let Some(element) = plugin.tagged("film").first() {
        let film = Plugin::new(element, context)?;
        for side in ["width", "height"] {
            if let Some(pixels) = film.integer(side)?.filter(|pixels| *pixels != 1) {
                let message = format!("the `{side}` of the film of a `{}` is {pixels}", plugin.kind());
                return Err(film.place().error(message, "such a sensor has one pixel: give 1"));
            }
        }
    }
    for sampler in plugin.tagged("sampler") {
        context.note(NoteKind::Ignored, &sampler.place, "a `sampler`: samples are asked for when a scene is rendered");
    }
    plugin.skip(&["srf", "id", "shutter_open", "shutter_close"]);
    plugin.finish(context);
    Ok(())
}

/// A camera of one pixel.
fn camera(plugin: &Plugin, kind: &str, [position, ahead, up]: [DVec3; 3], keys: Vec<(&str, String)>) -> Lines {
    let place = plugin.place();
    let mut lines = Lines::default();
    lines.table(place, "[camera]");
    lines.key(place, "type", quoted(kind));
    for (key, v) in [("position", position), ("target", position + ahead), ("up", up)] {
        lines.key(place, key, numbers(&v.to_array()));
    }
    for (key, value) in keys {
        lines.key(place, key, value);
    }
    lines.key(place, "width", 1);
    lines.key(place, "height", 1);
    lines
}

/// A `radiancemeter`: the radiance along one ray.
pub fn radiance<'a>(plugin: &Plugin<'a>, context: &mut Context<'a>) -> Result<Lines, SceneError> {
    let place = plugin.place();
    let to_world = plugin.transform("to_world", context)?;
    let (origin, direction) = (plugin.vector("origin")?, plugin.vector("direction")?);
    let (position, ahead) = match (plugin.part("to_world"), origin, direction) {
        (None, Some(origin), Some(direction)) => (origin, direction),
        (None, None, None) | (Some(_), ..) => (to_world.w_axis.truncate(), to_world.z_axis.truncate()),
        (None, ..) => {
            return Err(
                place.error("a `radiancemeter` has one of `origin` and `direction`", "give both, or `to_world`")
            );
        }
    };
    let Some(ahead) = ahead.try_normalize() else {
        return Err(place.error("the `direction` is zero", "give a direction"));
    };
    check_film(plugin, context)?;
    let text = "a `radiancemeter` becomes an orthographic camera too narrow for light walks to meet it: the method `light` \
                shows nothing";
    context.approximate(place, text);
    let extent = WIDTH_OF_A_RAY * position.length().max(1.0);
    Ok(camera(
        plugin,
        "orthographic",
        [position, ahead, ahead.any_orthonormal_vector()],
        vec![("extent", number(extent))],
    ))
}

/// An `irradiancemeter` in a shape, which `whole` places.
pub fn irradiance<'a>(
    element: &'a Element,
    shape: &Plugin<'a>,
    whole: &DMat4,
    is_flipped: bool,
    context: &mut Context<'a>,
) -> Result<Lines, SceneError> {
    let plugin = Plugin::new(element, context)?;
    let place = plugin.place();
    if plugin.kind() != "irradiancemeter" {
        let message = format!("a sensor `{}` is part of a shape", plugin.kind());
        return Err(place.error(message, "a shape may hold an `irradiancemeter`; move others out of it"));
    }
    let [x, y, z] = [whole.x_axis, whole.y_axis, whole.z_axis].map(|axis| axis.truncate());
    let lengths = [x, y, z].map(DVec3::length);
    let is_square =
        |pairs: &[(DVec3, DVec3)]| pairs.iter().all(|(a, b)| a.dot(*b).abs() <= 1e-4 * a.length() * b.length());
    let alike = |lengths: &[f64]| lengths.iter().all(|length| (length / lengths[0] - 1.0).abs() <= 1e-4);
    // The normal of flat shapes is carried as normals are: a map that mirrors does not turn it over.
    let normal = x.cross(y) * (x.cross(y).dot(z)).signum();
    let (center, key, value) = match shape.kind() {
        "rectangle" if is_square(&[(x, y)]) => {
            (DVec3::ZERO, "rectangle", numbers(&[2.0 * lengths[0], 2.0 * lengths[1]]))
        }
        "disk" if is_square(&[(x, y)]) && alike(&lengths[..2]) => (DVec3::ZERO, "disk", number(lengths[0])),
        "sphere"
            if !is_flipped
                && normal.dot(x.cross(y)) > 0.0
                && is_square(&[(x, y), (y, z), (z, x)])
                && alike(&lengths) =>
        {
            let radius = shape.float_or("radius", 1.0)?;
            (shape.vector("center")?.unwrap_or_default(), "sphere", number(radius * lengths[0]))
        }
        kind @ ("rectangle" | "disk" | "sphere") => {
            let message = format!("an `irradiancemeter` on a `{kind}` that is sheared, stretched or turned inside out");
            return Err(place.error(message, "attach it to one that is not"));
        }
        kind => {
            let message = format!("an `irradiancemeter` on a `{kind}` is not supported");
            return Err(place.error(message, "attach it to a `rectangle`, a `disk` or a `sphere`"));
        }
    };
    check_film(&plugin, context)?;
    context.mapped(element, "an `irradiance` camera");
    let ahead = if is_flipped { -normal } else { normal };
    Ok(camera(&plugin, "irradiance", [whole.transform_point3(center), ahead.normalize(), y], vec![(key, value)]))
}
