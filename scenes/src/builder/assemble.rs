//! From what was given to what is traced.

use super::groups::{Expansion, expand, unplaced};
use super::hash::hash;
use super::parts::Parts;
use super::{Environment, SceneBuilder, Shape};
use crate::camera::Camera;
use crate::emitter::{
    ChoiceRule, ConstantEnvironment, DirectionalEmitter, Emitter, EmitterChoice, EmitterId, ImageEnvironment,
    NextEventChoice, PointEmitter, SpotEmitter,
};
use crate::error::SceneError;
use crate::material::Material;
use crate::needs::{Skip, Work};
use crate::scene::{BoundingSphere, Scene};
use glam::{BVec3, DAffine3, DVec3};
use sampling::bsdf::Bsdf;
use std::sync::Arc;

pub(super) fn assemble(mut builder: SceneBuilder, skip: Skip) -> Result<Scene, SceneError> {
    let Expansion { kept, instances, copies } = expand(&builder)?;
    let unplaced = unplaced(&builder).into_iter().map(|name| format!("the group `{name}` is placed nowhere"));
    builder.notes.extend(unplaced.collect::<Vec<_>>());
    let (direct, kept) = sorted_out(&mut builder, copies, &kept);
    let kept: Vec<Kept> = kept.into_iter().map(Kept::new).collect();
    let placed = instances.iter().map(|placed| under(kept[placed.kept].extent, &placed.transform));
    let shift = recentring(direct.iter().map(Shape::extent).chain(placed));
    let settings = builder.camera.expect("checked");
    let camera = Camera::new(&settings, shift)?;
    let mut parts = Parts {
        materials: materials(&builder.materials, shift, skip),
        material_names: std::mem::take(&mut builder.material_names),
        varies: builder.materials.iter().map(|material| !material.parts().is_empty()).collect(),
        point_rule: builder.point_rule,
        ..Parts::default()
    };
    for shape in direct {
        let name = shape.name(&builder.groups);
        parts.add(shape, &name, shift)?;
    }
    let numbers: Vec<Option<u32>> = kept
        .into_iter()
        .map(|Kept { shapes, shift, .. }| {
            parts.begin_prototype();
            for shape in shapes {
                let name = shape.name(&builder.groups);
                parts.add(shape, &name, shift)?;
            }
            Ok(parts.end_prototype(shift, skip))
        })
        .collect::<Result<_, SceneError>>()?;
    for placed in &instances {
        // A group may have nothing but triangles without area.
        let Some(prototype) = numbers[placed.kept] else { continue };
        let there = DAffine3::from_translation(-shift) * placed.transform;
        parts.add_instance(there, prototype).ok_or_else(|| placed.too_distorted(&builder))?;
    }
    drop(instances);
    parts.check_extent(&camera)?;
    let bounds = parts.bounds();
    parts.bound_bodies();
    for &(position, intensity) in &builder.points {
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
    let lists =
        [builder.points.len(), builder.spots.len(), builder.directionals.len(), builder.environments.len().min(1)];
    for (list, &length) in lists.iter().enumerate() {
        (0..length).for_each(|place| parts.labels.add_emitter(builder.emitter_labels.remove(&(list, place))));
    }
    parts.labels.name_materials(&parts.surfaces, &parts.material_names);
    if parts.degenerate > 0 {
        builder.notes.push(format!("{} triangles without area were left out", parts.degenerate));
    }
    if parts.emitters.is_empty() {
        builder.notes.push("nothing emits light, so that all is black".into());
    }
    // Skips change no image, so the hash is taken of what was given.
    let given = materials(&builder.materials, shift, Skip::Unneeded);
    let choice_rule =
        builder.choice_rule.unwrap_or_else(|| ChoiceRule::for_emitters(&parts.emitters, parts.asks_surfaces()));
    let hash = hash(&parts.content(&given, environment, &camera), choice_rule, parts.point_rule);
    let (needs, facts) = (parts.needs(&camera, skip), parts.needs(&camera, Skip::Unneeded));
    let accel = parts.take_accel(skip);
    Ok(Scene {
        name: builder.name,
        camera,
        crop: settings.crop,
        needs,
        facts,
        choice: EmitterChoice::new(&parts.emitters, skip)?,
        next_event_choice: NextEventChoice::new(choice_rule, &parts.emitters)?,
        choice_rule,
        point_rule: parts.point_rule,
        emitters: parts.emitters,
        environment,
        notes: builder.notes,
        series: builder.series,
        closed_form: builder.closed_form,
        hash,
        origin: shift,
        bounds,
        accel,
        triangles: parts.infos,
        analytic: parts.analytic_infos,
        surfaces: parts.surfaces,
        attributes: parts.attributes,
        labels: parts.labels,
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

impl SceneBuilder {
    /// The lowest and the highest coordinates of what was given so far \[m\]; infinite of nothing.
    ///
    /// # Errors
    /// If groups are not placed as they can be.
    pub(crate) fn extent(&self) -> Result<(DVec3, DVec3), SceneError> {
        let Expansion { kept, instances, copies } = expand(self)?;
        let groups: Vec<_> =
            kept.iter().map(|list| union(list.iter().map(|&index| self.shapes[index].extent()))).collect();
        let placed = instances.iter().map(|placed| under(groups[placed.kept], &placed.transform));
        let direct = self.shapes.iter().filter(|shape| shape.group.is_none());
        Ok(union(direct.chain(&copies).map(Shape::extent).chain(placed)))
    }
}

/// Shapes that are kept once.
struct Kept {
    shapes: Vec<Shape>,
    /// The lowest and the highest coordinates \[m\].
    extent: (DVec3, DVec3),
    /// Where their coordinates have their origin.
    shift: DVec3,
}

impl Kept {
    fn new(shapes: Vec<Shape>) -> Self {
        let extent = union(shapes.iter().map(Shape::extent));
        Kept { shapes, extent, shift: recentring([extent]) }
    }
}

/// The box of the corners of a box, elsewhere.
fn under((low, high): (DVec3, DVec3), transform: &DAffine3) -> (DVec3, DVec3) {
    union((0..8).map(|i| {
        let corner = DVec3::select(BVec3::new(i & 1 == 1, i & 2 == 2, i & 4 == 4), high, low);
        let corner = transform.transform_point3(corner);
        (corner, corner)
    }))
}

/// The shapes that are where they are, with those that are copied, and those that are kept once, by their places in the builder.
fn sorted_out(builder: &mut SceneBuilder, copies: Vec<Shape>, kept: &[Vec<usize>]) -> (Vec<Shape>, Vec<Vec<Shape>>) {
    let mut shapes: Vec<Option<Shape>> = std::mem::take(&mut builder.shapes).into_iter().map(Some).collect();
    let kept = kept.iter().map(|list| list.iter().filter_map(|&index| shapes[index].take()).collect()).collect();
    let direct = shapes.into_iter().flatten().filter(|shape| shape.group.is_none());
    (direct.chain(copies).collect(), kept)
}

fn union(extents: impl IntoIterator<Item = (DVec3, DVec3)>) -> (DVec3, DVec3) {
    extents.into_iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), (other_low, other_high)| {
        (low.min(other_low), high.max(other_high))
    })
}

/// Where to move the origin: nowhere, unless the scene is farther from it than it is large, so that digits would be lost.
fn recentring(extents: impl IntoIterator<Item = (DVec3, DVec3)>) -> DVec3 {
    let (low, high) = union(extents);
    let (center, half) = ((low + high) / 2.0, (high - low) / 2.0);
    if center.is_finite() && center.abs().max_element() > 4.0 * half.max_element() { center } else { DVec3::ZERO }
}

fn materials(given: &[Material], shift: DVec3, skip: Skip) -> Vec<Material> {
    let build = |material: &Material| match material {
        Material::Constant(Bsdf::Lambert(lambert)) if !skip.leaves_out(Work::Textures) => {
            Material::lambert(lambert.albedo.into())
        }
        _ => {
            let mut material = material.clone();
            material.parts_mut().iter_mut().for_each(|part| part.recentre(shift));
            material
        }
    };
    given.iter().map(build).collect()
}
