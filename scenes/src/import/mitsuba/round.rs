//! Spheres and cylinders.

use glam::{DMat3, DMat4, DVec3};

use super::context::Context;
use super::mesh;
use super::plugin::Plugin;
use super::shape::Form;
use super::transform::is_similarity;
use crate::error::SceneError;
use crate::import::translation::{number, numbers, quoted};

fn radius_of(plugin: &Plugin) -> Result<f64, SceneError> {
    let radius = plugin.float_or("radius", 1.0)?;
    if radius <= 0.0 {
        return Err(plugin.place().error(format!("the radius is {radius}"), "give one above 0"));
    }
    Ok(radius)
}

/// A sphere; one that is stretched becomes a mesh.
pub fn sphere<'a>(plugin: &Plugin<'a>, transform: DMat4, context: &mut Context<'a>) -> Result<Form, SceneError> {
    let center = plugin.vector("center")?.unwrap_or_default();
    let radius = radius_of(plugin)?;
    let keys = |center: DVec3, radius: f64| vec![("center", numbers(&center.to_array())), ("radius", number(radius))];
    // Mitsuba turns a sphere inside out that its transform mirrors.
    let other_side = DMat3::from_mat4(transform).determinant() < 0.0;
    if is_similarity(&transform, 1e-9) {
        return Ok(Form { turned: true, other_side, ..Form::new("sphere", keys(center, radius), transform) });
    }
    // The matrices of exporters have six digits.
    if is_similarity(&transform, 1e-4) {
        context.approximate(
            plugin.place(),
            "a transform that scales a sphere unevenly by less than 0.0001 is taken as even",
        );
        let scale = DMat3::from_mat4(transform).determinant().abs().cbrt();
        return Ok(Form {
            turned: true,
            other_side,
            ..Form::new("sphere", keys(transform.transform_point3(center), radius * scale), DMat4::IDENTITY)
        });
    }
    context.approximate(plugin.place(), "a sphere that its transform stretches becomes a mesh");
    let file = context.meshes.keep(mesh::obj(&mesh::sphere(center, radius)));
    Ok(Form::new("mesh", vec![("file", quoted(&file))], transform))
}

/// A cylinder; one that is stretched becomes a mesh.
pub fn cylinder<'a>(plugin: &Plugin<'a>, transform: DMat4, context: &mut Context<'a>) -> Result<Form, SceneError> {
    let from = plugin.vector("p0")?.unwrap_or_default();
    let to = plugin.vector("p1")?.unwrap_or(DVec3::Z);
    let radius = radius_of(plugin)?;
    if is_similarity(&transform, 1e-9) {
        let ends = [("from", from), ("to", to)].map(|(key, p)| (key, numbers(&p.to_array())));
        let keys = ends.into_iter().chain([("radius", number(radius))]).collect();
        return Ok(Form::new("cylinder", keys, transform));
    }
    context.approximate(plugin.place(), "a cylinder that its transform stretches becomes a mesh");
    let file = context.meshes.keep(mesh::obj(&mesh::tube(from, to, radius)));
    Ok(Form::new("mesh", vec![("file", quoted(&file))], transform))
}
