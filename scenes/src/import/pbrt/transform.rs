//! Transforms, as the directives put them.

use glam::{DMat3, DMat4, DQuat, DVec3};

use super::parser::Statement;
use crate::error::SceneError;

/// The map that a directive stands for; `Transform` and `ConcatTransform` list theirs column by column.
pub fn read(statement: &Statement) -> Result<DMat4, SceneError> {
    let n = &statement.numbers;
    let place = &statement.place;
    let map = match statement.name {
        "Translate" => DMat4::from_translation(DVec3::from_slice(n)),
        "Scale" => DMat4::from_scale(DVec3::from_slice(n)),
        "Rotate" => {
            let Some(axis) = DVec3::from_slice(&n[1..]).try_normalize() else {
                return Err(place.error("`Rotate` has no axis", "give one such as `Rotate 90 0 1 0`"));
            };
            DMat4::from_quat(DQuat::from_axis_angle(axis, n[0].to_radians()))
        }
        "LookAt" => look_at(statement)?,
        _ => DMat4::from_cols_slice(n),
    };
    check(&map, statement)?;
    Ok(map)
}

/// Refuses what is not affine.
pub fn check(map: &DMat4, statement: &Statement) -> Result<(), SceneError> {
    let place = &statement.place;
    let last = map.row(3);
    if last.x != 0.0 || last.y != 0.0 || last.z != 0.0 || last.w != 1.0 {
        return Err(place.error(format!("`{}` is not affine", statement.name), "let its last row be 0 0 0 1"));
    }
    if !map.is_finite() {
        let message = format!("`{}` has numbers that are too large", statement.name);
        return Err(place.error(message, "give smaller ones"));
    }
    Ok(())
}

/// From the world to who stands at the first point and looks at the second: x to the right of a left-handed world, y up, z ahead.
fn look_at(statement: &Statement) -> Result<DMat4, SceneError> {
    let n = &statement.numbers;
    let (eye, target, up) = (DVec3::from_slice(n), DVec3::from_slice(&n[3..]), DVec3::from_slice(&n[6..]));
    let place = &statement.place;
    let Some(ahead) = (target - eye).try_normalize() else {
        return Err(place.error("`LookAt` looks at where it stands", "let its first two points differ"));
    };
    let Some(right) = up.normalize_or_zero().cross(ahead).try_normalize() else {
        return Err(place.error("`LookAt` looks along its `up`", "give an `up` across the view"));
    };
    let column = |v: DVec3| v.extend(0.0);
    let from_camera = DMat4::from_cols(column(right), column(ahead.cross(right)), column(ahead), eye.extend(1.0));
    Ok(from_camera.inverse())
}

/// Of a map that scales evenly, by how much.
pub fn scale_of(map: &DMat4) -> f64 {
    DMat3::from_mat4(*map).determinant().abs().cbrt()
}
