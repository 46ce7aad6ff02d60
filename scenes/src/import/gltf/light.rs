//! `KHR_lights_punctual`: points, spots and parallel light, along −z of their nodes.
//!
//! Candela and lux are taken one to one as W/sr and W/m², as nits are as W/(m²·sr): the parts of a file keep their proportions,
//! and a surface whose emission is 1, as in most files, is as bright as one of radiance 1. The image is then in nits.
//! A file made with 683 lm/W for its lights, such as Blender's of physical units, means watts by 1/683 of these numbers.

use glam::DVec3;

use super::context::Context;
use super::node::Placed;
use super::schema::{Kind, Light};
use crate::error::SceneError;
use crate::import::translation::{Lines, colour, number, numbers, quoted};

/// Writes the light of this number where its node stands.
pub fn write<'t>(index: usize, placed: &Placed<'t>, context: &mut Context<'_, 't>) -> Result<(), SceneError> {
    let document = &context.asset.document;
    let item = document.item(Kind::Light, index, &placed.item)?;
    let light: Light = document.parse(&item)?;
    let place = document.place_of_item(&item);
    let strength = light.color.map(|channel| channel * light.intensity);
    if strength.iter().any(|&channel| channel < 0.0 || !channel.is_finite()) {
        return Err(document.error(&item, "has a negative colour or intensity", "give 0 or more"));
    }
    if strength == [0.0; 3] {
        context.ignore(&place, "a light of intensity 0");
        return Ok(());
    }
    let position = placed.world.w_axis.truncate();
    let Some(ahead) = placed.world.transform_vector3(DVec3::NEG_Z).try_normalize() else {
        return Err(document.error(&placed.item, "has a light and no direction", "give it a scale other than 0"));
    };
    let mut lines = Lines::default();
    lines.table(&place, "[[emitters]]");
    let kind = match light.kind.as_str() {
        "directional" => {
            lines.key(&place, "type", quoted("directional"));
            lines.key(&place, "direction", numbers(&ahead.to_array()));
            lines.key(&place, "irradiance", colour(strength));
            "directional"
        }
        "point" => {
            lines.key(&place, "type", quoted("point"));
            lines.key(&place, "position", numbers(&position.to_array()));
            lines.key(&place, "intensity", colour(strength));
            "point"
        }
        "spot" => {
            let Some(cone) = &light.spot else {
                return Err(document.error(&item, "is a spot without `spot`", "add its `outerConeAngle`"));
            };
            let (inner, outer) = (cone.inner_cone_angle.to_degrees(), cone.outer_cone_angle.to_degrees());
            if !(0.0..=90.0 + 1e-6).contains(&outer) || outer < 0.001 || !(0.0..=outer).contains(&inner) {
                let message = format!("has cones of {inner} and {outer} degrees");
                return Err(document.error(&item, message, "give 0 ≤ inner ≤ outer ≤ π/2, in radians"));
            }
            if inner < outer {
                context.approximate(&place, "between a spot's cones intensity falls as a smoothstep of the cosine");
            }
            lines.key(&place, "type", quoted("spot"));
            lines.key(&place, "position", numbers(&position.to_array()));
            // As far away as the position is: a point nearby would lose its digits.
            let target = position + ahead * 1.0f64.max(position.length());
            lines.key(&place, "target", numbers(&target.to_array()));
            lines.key(&place, "intensity", colour(strength));
            lines.key(&place, "cutoff", number(outer));
            lines.key(&place, "beam", number(inner));
            lines.key(&place, "falloff", quoted("smooth"));
            "spot"
        }
        other => {
            let message = format!("has the type `{}`", crate::suggest::shown(other));
            return Err(document.error(&item, message, "give directional, point or spot"));
        }
    };
    if light.range.is_some() && kind != "directional" {
        context.approximate(&place, "the `range` of a light is left out: light goes on without end");
    }
    context.mapped(&place, format!("{} becomes `{kind}`", item.title()));
    context.emits = true;
    context.emitters.append(lines);
    Ok(())
}
