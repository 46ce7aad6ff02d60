//! What can be said to be wrong with a scene before anything is computed.

use super::groups::{self, Group};
use super::{Environment, SceneBuilder, Shape};
use crate::accel::MOST_TRIANGLES;
use crate::emitter::Spot;
use crate::error::SceneError;
use crate::material::{Material, Scattering, Varying};
use crate::shape::Geometry;
use crate::texture::Texture;
use glam::{DMat3, DVec3};
use sampling::bsdf::{Bsdf, Domain};
use sampling::math::Spectrum;
use std::f64::consts::PI;

/// How far an albedo may exceed 1, for what rounding makes of exact numbers.
const ALBEDO_SLACK: f32 = 1e-6;

pub(super) fn check(builder: &SceneBuilder) -> Result<(), SceneError> {
    if builder.camera.is_none() {
        return Err(SceneError::invalid(
            "the scene has no camera",
            "add one with a position, a target and a field of view",
        ));
    }
    if let Some((crop, fault)) = builder.camera.and_then(|c| Some((c.crop?, c.crop?.fault(c.width, c.height)?))) {
        return Err(SceneError::invalid(format!("the camera's crop is {crop:?}"), fault));
    }
    for (index, material) in builder.materials.iter().enumerate() {
        let name = &builder.material_names[index];
        let sides = material.parts().iter().map(|part| &part.scattering);
        let constant = sides.filter_map(|side| if let Scattering::Same(bsdf) = side { Some(bsdf) } else { None });
        let constant = constant.chain(if let Material::Constant(bsdf) = material { Some(bsdf) } else { None });
        for bsdf in constant {
            if let Bsdf::Lambert(lambert) = bsdf {
                check_albedo(lambert.albedo, &name.to_string())?;
            }
        }
        if let Some(fault) = material.parts().iter().flat_map(Varying::all_textures).find_map(Texture::fault) {
            return Err(bad_texture(&name.to_string(), fault));
        }
    }
    for shape in &builder.shapes {
        check_shape(shape, &shape.name(&builder.groups), builder.materials.len())?;
    }
    groups::check(builder)?;
    check_emitters(builder)
}

/// Those that are not surfaces.
fn check_emitters(builder: &SceneBuilder) -> Result<(), SceneError> {
    for (position, intensity) in &builder.points {
        check_light(*intensity, "a point emitter's intensity")?;
        if !position.is_finite() {
            return Err(not_finite("a point emitter's position"));
        }
    }
    for spot in &builder.spots {
        check_light(spot.intensity, "a spot's intensity")?;
        check_direction(spot.target - spot.position, "a spot's direction, from its position to its target,")?;
        let Spot { cutoff, beam, .. } = *spot;
        if !(cutoff as f32 > 0.0 && cutoff <= PI && (0.0..=cutoff).contains(&beam)) {
            return Err(SceneError::invalid(
                format!("a spot has a cutoff of {cutoff} and a beam of {beam} radians"),
                "give a cutoff above 0 and at most π, and a beam between 0 and the cutoff",
            ));
        }
    }
    for (direction, irradiance) in &builder.directionals {
        check_light(*irradiance, "a directional emitter's irradiance")?;
        check_direction(*direction, "a directional emitter's direction")?;
    }
    for environment in &builder.environments {
        match environment {
            Environment::Constant(radiance) => check_light(*radiance, "the environment's radiance")?,
            Environment::Image(image) => {
                if let Some((message, mend)) = image.fault() {
                    return Err(SceneError::invalid(format!("the environment: {message}"), mend));
                }
            }
        }
    }
    if builder.environments.len() > 1 {
        return Err(SceneError::invalid(
            format!("the scene has {} environments", builder.environments.len()),
            "keep one, with the sum of their radiances",
        ));
    }
    Ok(())
}

impl Shape {
    /// What messages call it.
    pub(super) fn name(&self, groups: &[Group]) -> String {
        let kind = match self.geometry {
            Geometry::Quad { .. } => "quad",
            Geometry::Sphere { .. } => "sphere",
            Geometry::Disk { .. } => "disk",
            Geometry::Cylinder { .. } => "cylinder",
            Geometry::Mesh(_) => "mesh",
        };
        let name = format!("shapes[{}] (a {kind})", self.number);
        match self.group {
            Some(group) => format!("{name} of the group `{}`", groups[group.0 as usize].name),
            None => name,
        }
    }
}

fn check_shape(shape: &Shape, name: &str, materials: usize) -> Result<(), SceneError> {
    if shape.material.0 as usize >= materials {
        return Err(SceneError::invalid(
            format!("{name} has material {}, but there are {materials}", shape.material.0),
            "add the material first",
        ));
    }
    if !shape.transform.is_finite() {
        return Err(not_finite(&format!("the transform of {name}")));
    }
    match &shape.geometry {
        Geometry::Quad { origin, edge_u, edge_v } => {
            if !(origin.is_finite() && edge_u.is_finite() && edge_v.is_finite()) {
                return Err(not_finite(name));
            }
        }
        Geometry::Sphere { center, radius } => {
            if !center.is_finite() {
                return Err(not_finite(name));
            }
            check_radius(*radius, shape, name, "sphere")?;
        }
        Geometry::Disk { center, edge_u, edge_v } => {
            if !(center.is_finite() && edge_u.is_finite() && edge_v.is_finite()) {
                return Err(not_finite(name));
            }
        }
        Geometry::Cylinder { from, to, radius } => {
            if !(from.is_finite() && to.is_finite()) {
                return Err(not_finite(name));
            }
            if from == to {
                let message = format!("{name} has no length");
                return Err(SceneError::invalid(message, "give two ends that differ"));
            }
            check_radius(*radius, shape, name, "cylinder")?;
        }
        Geometry::Mesh(mesh) => mesh.check().map_err(|error| renamed(error, name))?,
    }
    let Some(radiance) = shape.emission.as_ref().map(|emission| &emission.radiance) else { return Ok(()) };
    let name = &format!("the radiance of {name}");
    if let Some(fault) = radiance.fault() {
        return Err(bad_texture(name, fault));
    }
    match radiance {
        Texture::Constant(value) => check_light(*value, name),
        // Looked at once it is known where the surface is.
        _ => Ok(()),
    }
}

/// What is round stays round only under a similarity.
fn check_radius(radius: f64, shape: &Shape, name: &str, kind: &str) -> Result<(), SceneError> {
    if !(radius.is_finite() && radius > 0.0) {
        return Err(SceneError::invalid(format!("{name} has radius {radius}"), "give a positive radius"));
    }
    similarity_scale(&shape.transform.matrix3).map(|_| ()).ok_or_else(|| {
        SceneError::invalid(
            format!("the transform of {name} does not leave it a {kind}"),
            "scale it by the same factor along all axes, or use a mesh",
        )
    })
}

/// The factor by which a similarity scales lengths; None for any other map.
pub(super) fn similarity_scale(matrix: &DMat3) -> Option<f64> {
    let scale = matrix.determinant().abs().cbrt();
    let gram = matrix.transpose() * *matrix;
    let square = DMat3::IDENTITY * (scale * scale);
    let off = (gram - square).to_cols_array().into_iter().fold(0.0f64, |off, entry| off.max(entry.abs()));
    (scale > 0.0 && off <= 1e-9 * scale * scale).then_some(scale)
}

/// An albedo must be in [0, 1] for a surface not to make light.
fn check_albedo(albedo: Spectrum, name: &str) -> Result<(), SceneError> {
    let inside = albedo.to_array().into_iter().all(|channel| (0.0..=1.0 + ALBEDO_SLACK).contains(&channel));
    if inside {
        return Ok(());
    }
    let message = format!("the albedo of {name} reaches {:?}", albedo.to_array());
    Err(SceneError::invalid(message, "keep every channel between 0 and 1"))
}

/// What a texture gives must be in the domain of its parameter.
pub(super) fn check_domain(value: Spectrum, domain: Domain, parameter: &str, name: &str) -> Result<(), SceneError> {
    let slack = Spectrum::splat(ALBEDO_SLACK);
    let holds = |value: Spectrum| value.to_array().into_iter().all(|channel| domain.holds(channel));
    if holds(value) || holds(value - slack) || holds(value + slack) {
        return Ok(());
    }
    let message = format!("the {parameter} of {name} reaches {:?}", value.to_array());
    Err(SceneError::invalid(message, format!("keep it {domain}")))
}

/// Refuses more triangles than can be told apart.
pub(super) fn check_count(triangles: usize) -> Result<(), SceneError> {
    if triangles <= MOST_TRIANGLES {
        return Ok(());
    }
    Err(SceneError::invalid(
        format!("the scene has {triangles} triangles or more, of which there may be {MOST_TRIANGLES}"),
        "make its meshes coarser, or place what is alike as instances of a group",
    ))
}

/// Emitted light must be finite and not negative.
pub(super) fn check_light(value: Spectrum, name: &str) -> Result<(), SceneError> {
    if value.to_array().into_iter().all(|channel| channel.is_finite() && channel >= 0.0) {
        return Ok(());
    }
    let message = format!("{name} reaches {:?}", value.to_array());
    Err(SceneError::invalid(message, "give finite numbers that are not negative"))
}

fn bad_texture(name: &str, fault: &str) -> SceneError {
    SceneError::invalid(format!("{name} {fault}"), "give finite numbers, and sizes above 0")
}

fn check_direction(direction: DVec3, name: &str) -> Result<(), SceneError> {
    if direction.try_normalize().is_some() {
        return Ok(());
    }
    Err(SceneError::invalid(format!("{name} is {direction}"), "give finite numbers that are not all zero"))
}

fn not_finite(name: &str) -> SceneError {
    SceneError::invalid(format!("{name} has a coordinate that is not finite"), "give finite numbers")
}

/// The same error, telling which mesh it is about.
fn renamed(mut error: SceneError, name: &str) -> SceneError {
    if let SceneError::Invalid { message, .. } = &mut error {
        *message = format!("{name}: {message}");
    }
    error
}
