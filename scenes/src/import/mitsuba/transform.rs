//! Transforms: every kind of step, the first applied first.

use glam::{DMat3, DMat4, DVec3, DVec4};

use super::context::Context;
use super::plugin::{finite, finite_list};
use super::xml::Element;
use crate::error::SceneError;
use crate::import::translation::{self, NoteKind};

/// The transform that an element `transform` describes. It must be affine.
/// Of an `animation` it is the earliest.
pub fn read(element: &Element, context: &mut Context) -> Result<DMat4, SceneError> {
    if element.tag == "animation" {
        return earliest(element, context);
    }
    let mut whole = DMat4::IDENTITY;
    for step in &element.children {
        let map = match step.tag.as_str() {
            "translate" => DMat4::from_translation(vector(step, 0.0)?),
            "scale" => DMat4::from_scale(scale(step)?),
            "rotate" => rotation(step, context)?,
            "lookat" => look_at(step)?,
            "matrix" => matrix(step)?,
            _ => {
                context.note(
                    NoteKind::Approximated,
                    &step.place,
                    format!("{} in a transform is left out", step.title()),
                );
                continue;
            }
        };
        whole = map * whole;
    }
    if !whole.is_finite() {
        return Err(element.place.error("the transform has numbers that are too large", "give smaller ones"));
    }
    Ok(whole)
}

/// Where an animation begins.
fn earliest(element: &Element, context: &mut Context) -> Result<DMat4, SceneError> {
    let mut first: Option<(f64, &Element)> = None;
    for key in element.children.iter().filter(|child| child.tag == "transform") {
        let time = key.attribute("time").map_or(Ok(0.0), |time| finite(time, "time", &key.place))?;
        if first.is_none_or(|(earliest, _)| time < earliest) {
            first = Some((time, key));
        }
    }
    let Some((time, key)) = first else {
        return Err(element.place.error("the `animation` holds no `transform`", "add one"));
    };
    context.approximate(&element.place, format!("nothing moves: what the `animation` says of time {time} holds"));
    read(key, context)
}

/// `x`, `y`, `z`, or the numbers of `value`; one alone holds for all three.
pub fn vector(element: &Element, otherwise: f64) -> Result<DVec3, SceneError> {
    if let Some(value) = element.attribute("value") {
        return match finite_list(value, "value", &element.place)?[..] {
            [x, y, z] => Ok(DVec3::new(x, y, z)),
            [x] => Ok(DVec3::splat(x)),
            _ => Err(element.place.error(format!("{} is `{value}`", element.title()), "give three numbers")),
        };
    }
    let component = |name: &str| match element.attribute(name) {
        Some(text) => finite(text, name, &element.place),
        None => Ok(otherwise),
    };
    Ok(DVec3::new(component("x")?, component("y")?, component("z")?))
}

fn scale(step: &Element) -> Result<DVec3, SceneError> {
    vector(step, 1.0)
}

/// A turn about an axis. One that is not of length 1 is taken as it is since Mitsuba 2, in the formula of Rodrigues, which then shears.
fn rotation(step: &Element, context: &mut Context) -> Result<DMat4, SceneError> {
    let Some(angle) = step.attribute("angle") else {
        return Err(step.place.error("`rotate` lacks its `angle`", "give one in degrees"));
    };
    let (sine, cosine) = finite(angle, "angle", &step.place)?.to_radians().sin_cos();
    let written = vector(step, 0.0)?;
    if sine == 0.0 && cosine == 1.0 {
        return Ok(DMat4::IDENTITY);
    }
    let Some(unit) = written.try_normalize() else {
        return Err(step.place.error("`rotate` has no axis", "give an axis such as `y=\"1\"`"));
    };
    let axis = if step.version < 2 { unit } else { written };
    if (axis.length() - 1.0).abs() > 1e-3 {
        let text = "the axis of a `rotate` is not of length 1: it shears, as in Mitsuba";
        context.note(NoteKind::Mapped, &step.place, text);
    }
    let across = DMat3::from_cols(axis.cross(DVec3::X), axis.cross(DVec3::Y), axis.cross(DVec3::Z));
    let along = DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
    Ok(DMat4::from_mat3(DMat3::from_diagonal(DVec3::splat(cosine)) + across * sine + along * (1.0 - cosine)))
}

/// The frame of who stands at `origin` and looks at `target`: x to the left, y up, z ahead.
fn look_at(step: &Element) -> Result<DMat4, SceneError> {
    let named = |name: &str| -> Result<DVec3, SceneError> {
        let Some(text) = step.attribute(name) else {
            return Err(step.place.error(format!("`lookat` lacks its `{name}`"), "give three numbers"));
        };
        match finite_list(text, name, &step.place)?[..] {
            [x, y, z] => Ok(DVec3::new(x, y, z)),
            _ => Err(step.place.error(format!("`{name}` is `{text}`"), "give three numbers")),
        }
    };
    let (origin, target) = (named("origin")?, named("target")?);
    let Some(ahead) = (target - origin).try_normalize() else {
        return Err(step.place.error("`lookat` looks at where it stands", "let `origin` and `target` differ"));
    };
    let up = match step.attribute("up") {
        Some(_) => named("up")?,
        None => DVec3::ZERO,
    };
    // What is not said is chosen as Mitsuba does, by the same formula `[Duff17]`.
    let up = if up == DVec3::ZERO { ahead.any_orthonormal_pair().0 } else { up };
    let Some(left) = up.cross(ahead).try_normalize() else {
        return Err(step.place.error("`lookat` looks along its `up`", "give an `up` across the view"));
    };
    let column = |v: DVec3| v.extend(0.0);
    Ok(DMat4::from_cols(column(left), column(ahead.cross(left)), column(ahead), origin.extend(1.0)))
}

fn matrix(step: &Element) -> Result<DMat4, SceneError> {
    let numbers = finite_list(step.attribute("value").unwrap_or(""), "value", &step.place)?;
    match numbers.len() {
        16 => {
            let row = |r: usize| DVec4::from_slice(&numbers[4 * r..]);
            let map = DMat4::from_cols(row(0), row(1), row(2), row(3)).transpose();
            if row(3) != DVec4::W {
                return Err(step.place.error("the matrix is not affine", "let its last row be 0 0 0 1"));
            }
            Ok(map)
        }
        9 => {
            let row = |r: usize| DVec3::from_slice(&numbers[3 * r..]);
            Ok(DMat4::from_mat3(DMat3::from_cols(row(0), row(1), row(2)).transpose()))
        }
        n => Err(step.place.error(format!("the matrix has {n} numbers"), "give 16, row by row, or 9")),
    }
}

/// The transform as scene files write it, unless it does nothing.
pub fn steps(maps: &[DMat4]) -> Option<String> {
    let step = |map: &DMat4| format!("{{ matrix = {} }}", translation::numbers(&map.transpose().to_cols_array()));
    let steps: Vec<String> = maps.iter().filter(|map| **map != DMat4::IDENTITY).map(step).collect();
    (!steps.is_empty()).then(|| format!("[{}]", steps.join(", ")))
}

/// Whether a map only turns, mirrors, moves and scales evenly, up to a relative `tolerance`.
pub fn is_similarity(map: &DMat4, tolerance: f64) -> bool {
    let axes = DMat3::from_mat4(*map);
    let gram = axes.transpose() * axes;
    let scale = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    let off = gram - DMat3::from_diagonal(DVec3::splat(scale));
    off.to_cols_array().iter().all(|x| x.abs() <= tolerance * scale)
}
