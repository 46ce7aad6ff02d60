//! From what was given to what is traced.

use super::check::similarity_scale;
use super::hash::hash;
use super::parts::Parts;
use super::{SceneBuilder, Shape};
use crate::accel::Accel;
use crate::camera::Camera;
use crate::emitter::{ConstantEnvironment, Emitter, EmitterChoice, EmitterId, PointEmitter};
use crate::error::SceneError;
use crate::material::Material;
use crate::needs::Skip;
use crate::scene::{BoundingSphere, Scene};
use crate::shape::Geometry;
use glam::DVec3;
use rayon::prelude::*;
use sampling::bsdf::Bsdf;

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
    let environment = builder.environments.first().map(|&radiance| {
        let BoundingSphere { center, radius } = bounds;
        parts.emitters.push(Emitter::Environment(ConstantEnvironment { radiance, center, radius }));
        EmitterId((parts.emitters.len() - 1) as u32)
    });
    if parts.degenerate > 0 {
        builder.notes.push(format!("{} triangles without area were left out", parts.degenerate));
    }
    if parts.emitters.is_empty() {
        builder.notes.push("nothing emits light, so that all is black".into());
    }
    // Skips change no image, so the hash is taken of what was given.
    let given = materials(&builder.materials, shift, Skip::Unneeded);
    let hash = hash(&parts.content(&given, environment, &camera));
    let (needs, facts) = (parts.needs(skip), parts.needs(Skip::Unneeded));
    let accel = Accel::build(&parts.triangles, parts.spheres, camera.position(), skip);
    Ok(Scene {
        name: builder.name,
        camera,
        needs,
        facts,
        choice: EmitterChoice::new(&parts.emitters, skip)?,
        emitters: parts.emitters,
        environment,
        notes: builder.notes,
        series: builder.series,
        hash,
        origin: shift,
        bounds,
        accel,
        triangles: parts.infos,
        spheres: parts.sphere_infos,
        surfaces: parts.surfaces,
        attributes: parts.attributes,
        materials: parts.materials,
    })
}

/// Where to move the origin: nowhere, unless the scene is farther from it than it is large, so that digits would be lost.
fn recentring(shapes: &[Shape]) -> DVec3 {
    let (low, high) = shapes
        .iter()
        .map(extent)
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), (shape_low, shape_high)| {
            (low.min(shape_low), high.max(shape_high))
        });
    let (center, half) = ((low + high) / 2.0, (high - low) / 2.0);
    if center.is_finite() && center.abs().max_element() > 4.0 * half.max_element() { center } else { DVec3::ZERO }
}

fn extent(shape: &Shape) -> (DVec3, DVec3) {
    let place = |p: DVec3| shape.transform.transform_point3(p);
    match &shape.geometry {
        &Geometry::Quad { origin, edge_u, edge_v } => {
            let corners = [origin, origin + edge_u, origin + edge_v, origin + edge_u + edge_v].map(place);
            (
                corners.into_iter().reduce(DVec3::min).unwrap_or(origin),
                corners.into_iter().reduce(DVec3::max).unwrap_or(origin),
            )
        }
        &Geometry::Sphere { center, radius } => {
            let radius = radius * similarity_scale(&shape.transform.matrix3).unwrap_or(1.0);
            (place(center) - radius, place(center) + radius)
        }
        Geometry::Mesh(mesh) => mesh
            .positions
            .par_iter()
            .map(|&p| (place(p), place(p)))
            .reduce(|| (DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), (l, h)| (low.min(l), high.max(h))),
    }
}

fn materials(given: &[Material], shift: DVec3, skip: Skip) -> Vec<Material> {
    let build = |material: &Material| match material {
        Material::Varying(varying) => (**varying).clone().recentred(shift).into(),
        Material::Constant(Bsdf::Lambert(lambert)) if skip == Skip::Nothing => Material::lambert(lambert.albedo.into()),
        Material::Constant(_) | Material::Subsurface(_) => material.clone(),
    };
    given.iter().map(build).collect()
}
