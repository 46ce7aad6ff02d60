//! Transforms of scene files: a list of steps, the first applied first.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::reader::Value;
use crate::error::SceneError;
use crate::suggest::did_you_mean;

/// `transform = [ … ]` with the steps `{ translate = [x, y, z] }`, `{ rotate = { axis = [x, y, z], angle = degrees }
/// }`, `{ scale = s }` or `{ scale = [x, y, z] }`, and `{ matrix = [12 or 16 numbers, row by row] }`, whose fourth row is 0, 0, 0, 1.
pub(super) fn read(value: &Value) -> Result<DAffine3, SceneError> {
    let mut whole = DAffine3::IDENTITY;
    for step in value.array()? {
        whole = read_step(&step)? * whole;
    }
    let spread = whole.matrix3.x_axis.length() * whole.matrix3.y_axis.length() * whole.matrix3.z_axis.length();
    if !whole.is_finite() || whole.matrix3.determinant().abs() <= 1e-9 * spread {
        return Err(value.error("it flattens the shape; every direction must keep some length"));
    }
    Ok(whole)
}

fn read_step(step: &Value) -> Result<DAffine3, SceneError> {
    let valid = ["translate", "rotate", "scale", "matrix"];
    let table = step.table()?;
    table.allow_only(&valid)?;
    let entries = table.entries();
    let [(name, argument)] = entries.as_slice() else {
        return Err(step.error(format!("a step has exactly one key; {}", did_you_mean("", &valid))));
    };
    Ok(match *name {
        "translate" => DAffine3::from_translation(argument.vec3()?),
        "rotate" => rotation(argument)?,
        "scale" if argument.is_array() => DAffine3::from_scale(argument.vec3()?),
        "scale" => DAffine3::from_scale(DVec3::splat(argument.coordinate()?)),
        _ => matrix(argument)?,
    })
}

fn rotation(value: &Value) -> Result<DAffine3, SceneError> {
    let table = value.table()?;
    table.allow_only(&["axis", "angle"])?;
    let axis = table.need("axis", "[0, 1, 0]")?.direction()?;
    let angle = table.need("angle", "30")?.coordinate()?;
    Ok(DAffine3::from_quat(DQuat::from_axis_angle(axis, angle.to_radians())))
}

fn matrix(value: &Value) -> Result<DAffine3, SceneError> {
    // The fourth row says nothing, and may be left out.
    let count = if value.is_array() { value.array()?.len() } else { 0 };
    if !matches!(count, 12 | 16) {
        return Err(value.error("it must be a matrix, row by row: 12 or 16 numbers in [ ]"));
    }
    let m = value.numbers(count, "a matrix, row by row")?;
    if count == 16 && m[12..] != [0.0, 0.0, 0.0, 1.0] {
        return Err(value.error("its last row must be 0, 0, 0, 1"));
    }
    let column = |c: usize| DVec3::new(m[c], m[4 + c], m[8 + c]);
    Ok(DAffine3::from_mat3_translation(DMat3::from_cols(column(0), column(1), column(2)), column(3)))
}

/// Whether a map only turns, mirrors, moves and scales evenly, so that spheres stay spheres.
pub(super) fn is_similarity(map: &DAffine3) -> bool {
    let gram = map.matrix3.transpose() * map.matrix3;
    let scale = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    let off = gram - DMat3::from_diagonal(DVec3::splat(scale));
    off.to_cols_array().iter().all(|x| x.abs() <= 1e-9 * scale)
}
