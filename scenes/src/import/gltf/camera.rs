//! Cameras: at the origin of their nodes, looking along −z, with +y above.

use glam::{DMat3, DVec3};

use super::context::Context;
use super::node::Placed;
use super::schema::{self, Kind};
use crate::error::SceneError;
use crate::import::translation::{Lines, number, numbers, quoted};

/// The shorter side of the image \[pixels\].
const SIDE: f64 = 256.0;
/// How much wider than high an image may be, or higher than wide.
const GREATEST_ASPECT: f64 = 100.0;

/// The camera of this number where its node stands.
pub fn write<'t>(index: usize, placed: &Placed<'t>, context: &mut Context<'_, 't>) -> Result<Lines, SceneError> {
    let document = &context.asset.document;
    let item = document.item(Kind::Camera, index, &placed.item)?;
    let camera: schema::Camera = document.parse(&item)?;
    let place = document.place_of_item(&item);
    let axes = DMat3::from_mat4(placed.world);
    let ahead = -axes.z_axis.normalize_or_zero();
    let Some(up) = (axes.y_axis - ahead * axes.y_axis.dot(ahead)).try_normalize().filter(|_| ahead != DVec3::ZERO)
    else {
        return Err(document.error(&placed.item, "has a camera and no direction", "give it a scale other than 0"));
    };
    let (kind, key, value, aspect) = match (camera.kind.as_str(), &camera.perspective, &camera.orthographic) {
        ("perspective", Some(lens), _) => {
            if !(lens.yfov > 0.0 && lens.yfov < std::f64::consts::PI) {
                let message = format!("has a `yfov` of {}", lens.yfov);
                return Err(document.error(&item, message, "give one above 0 and below π, in radians"));
            }
            let aspect = lens.aspect_ratio.unwrap_or(1.0);
            // Ours spans the shorter side.
            let fov = if aspect >= 1.0 { lens.yfov } else { 2.0 * ((0.5 * lens.yfov).tan() * aspect).atan() };
            ("pinhole", "fov", fov.to_degrees(), aspect)
        }
        ("orthographic", _, Some(film)) => {
            let (width, height) = (film.xmag.abs(), film.ymag.abs());
            ("orthographic", "extent", 2.0 * width.min(height), width / height)
        }
        (other, ..) => {
            let message = format!("is of type `{}`, which it does not describe", crate::suggest::shown(other));
            return Err(document.error(
                &item,
                message,
                "give `perspective` or `orthographic`, and a part of that name",
            ));
        }
    };
    if !(1.0 / GREATEST_ASPECT..=GREATEST_ASPECT).contains(&aspect) || value <= 0.0 {
        let message = format!("has an image that is {aspect} times as wide as high");
        return Err(document.error(&item, message, format!("give 1/{GREATEST_ASPECT} to {GREATEST_ASPECT}")));
    }
    let position = placed.world.w_axis.truncate();
    let mut lines = Lines::default();
    lines.table(&place, "[camera]");
    if kind != "pinhole" {
        lines.key(&place, "type", quoted(kind));
    }
    lines.key(&place, "position", numbers(&position.to_array()));
    // As far away as the position is: a point nearby would lose its digits.
    let reach = 1.0f64.max(position.length());
    lines.key(&place, "target", numbers(&(position + ahead * reach).to_array()));
    lines.key(&place, "up", numbers(&up.to_array()));
    if axes.determinant() < 0.0 {
        lines.key(&place, "mirrored", "true");
    }
    lines.key(&place, key, number(value));
    lines.key(&place, "width", (SIDE * aspect.max(1.0)).round() as u32);
    lines.key(&place, "height", (SIDE / aspect.min(1.0)).round() as u32);
    context.mapped(&place, format!("{} becomes a `{kind}` camera", item.title()));
    Ok(lines)
}
