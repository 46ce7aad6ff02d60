//! From what was given to what is traced.

use super::hash::hash;
use super::parts::Parts;
use super::{Environment, SceneBuilder, Shape};
use crate::accel::Accel;
use crate::camera::Camera;
use crate::emitter::{
    ChoiceRule, ConstantEnvironment, DirectionalEmitter, Emitter, EmitterChoice, EmitterId, ImageEnvironment,
    NextEventChoice, PointEmitter, SpotEmitter,
};
use crate::error::SceneError;
use crate::material::Material;
use crate::needs::Skip;
use crate::scene::{BoundingSphere, Scene};
use glam::DVec3;
use sampling::bsdf::Bsdf;
use std::sync::Arc;

pub(super) fn assemble(mut builder: SceneBuilder, skip: Skip) -> Result<Scene, SceneError> {
    let shift = recentring(&builder.shapes);
    let settings = builder.camera.expect("checked");
    let camera = Camera::new(&settings, shift)?;
    let mut parts = Parts {
        materials: materials(&builder.materials, shift, skip),
        material_names: std::mem::take(&mut builder.material_names),
        ..Parts::default()
    };
    for (index, shape) in std::mem::take(&mut builder.shapes).into_iter().enumerate() {
        parts.add(shape, index, shift)?;
    }
    parts.check_extent(&camera)?;
    let bounds = parts.bounds();
    parts.bound_bodies();
    for (position, intensity) in builder.points {
        parts.emitters.push(Emitter::Point(PointEmitter { position: (position - shift).as_vec3(), intensity }));
    }
    parts.emitters.extend(builder.spots.iter().map(|spot| Emitter::Spot(SpotEmitter::new(spot, shift))));
    parts.emitters.extend(builder.directionals.iter().map(|&(direction, irradiance)| {
        let direction = direction.normalize().as_vec3();
        Emitter::Directional(DirectionalEmitter { direction, irradiance, bounds })
    }));
    let environment = match builder.environments.first() {
        None => None,
        Some(environment) => {
            parts.emitters.push(surrounding(environment, bounds)?);
            Some(EmitterId((parts.emitters.len() - 1) as u32))
        }
    };
    if parts.degenerate > 0 {
        builder.notes.push(format!("{} triangles without area were left out", parts.degenerate));
    }
    if parts.emitters.is_empty() {
        builder.notes.push("nothing emits light, so that all is black".into());
    }
    // Skips change no image, so the hash is taken of what was given.
    let given = materials(&builder.materials, shift, Skip::Unneeded);
    let choice_rule = builder.choice_rule.unwrap_or_else(|| ChoiceRule::for_emitters(&parts.emitters));
    let hash = hash(&parts.content(&given, environment, &camera), choice_rule);
    let (needs, facts) = (parts.needs(&camera, skip), parts.needs(&camera, Skip::Unneeded));
    let accel = Accel::build(parts.triangles, parts.analytic, camera.extent(), skip);
    Ok(Scene {
        name: builder.name,
        camera,
        crop: settings.crop,
        needs,
        facts,
        choice: EmitterChoice::new(&parts.emitters, skip)?,
        next_event_choice: NextEventChoice::new(choice_rule, &parts.emitters)?,
        choice_rule,
        emitters: parts.emitters,
        environment,
        notes: builder.notes,
        series: builder.series,
        hash,
        origin: shift,
        bounds,
        accel,
        triangles: parts.infos,
        analytic: parts.analytic_infos,
        surfaces: parts.surfaces,
        attributes: parts.attributes,
        materials: parts.materials,
    })
}

fn surrounding(environment: &Environment, bounds: BoundingSphere) -> Result<Emitter, SceneError> {
    match environment {
        &Environment::Constant(radiance) => {
            let BoundingSphere { center, radius } = bounds;
            Ok(Emitter::Environment(ConstantEnvironment { radiance, center, radius }))
        }
        Environment::Image(image) => {
            let image = ImageEnvironment::new(image, bounds).map_err(|error| {
                SceneError::invalid(
                    format!("the environment's image cannot be sampled: {error}"),
                    "use a smaller image",
                )
            })?;
            Ok(Emitter::Image(Arc::new(image)))
        }
    }
}

/// Where to move the origin: nowhere, unless the scene is farther from it than it is large, so that digits would be lost.
fn recentring(shapes: &[Shape]) -> DVec3 {
    let (low, high) = shapes
        .iter()
        .map(Shape::extent)
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), (shape_low, shape_high)| {
            (low.min(shape_low), high.max(shape_high))
        });
    let (center, half) = ((low + high) / 2.0, (high - low) / 2.0);
    if center.is_finite() && center.abs().max_element() > 4.0 * half.max_element() { center } else { DVec3::ZERO }
}

fn materials(given: &[Material], shift: DVec3, skip: Skip) -> Vec<Material> {
    let build = |material: &Material| match material {
        Material::Varying(varying) => (**varying).clone().recentred(shift).into(),
        Material::Constant(Bsdf::Lambert(lambert)) if skip == Skip::Nothing => Material::lambert(lambert.albedo.into()),
        Material::Constant(_) | Material::Subsurface(_) => material.clone(),
    };
    given.iter().map(build).collect()
}
