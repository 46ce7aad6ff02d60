//! The parts of a scene while it is put together.

use super::check::{check_count, check_light, similarity_scale};
use super::hash::Content;
use super::varying::{Looked, check_coordinates, look};
use super::{MaterialName, Shape};
use crate::accel::{Accel, Instance, Prototype, are_few};
use crate::camera::{Camera, Rays};
use crate::emitter::{Emission, Emitter, EmitterId, PointRule, is_asked};
use crate::error::SceneError;
use crate::labels::Labels;
use crate::material::Material;
use crate::needs::{Needs, Skip, Work};
use crate::scene::BoundingSphere;
use crate::shape::{
    Analytic, BakedMesh, Cylinder, Disk, Geometry, MeshData, Parallelogram, Sphere, Triangle, bake_mesh,
};
use crate::subsurface::{self, Places};
use crate::surface::{AnalyticInfo, Attributes, Chart, SphereChart, Surface, SurfaceId, TriangleInfo, derivatives};
use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use sampling::bsdf::Lobes;
use sampling::{Vec2, Vec3};
use std::ops::Range;

/// Coordinates beyond this would overflow when multiplied \[m\].
const FARTHEST: f32 = 1e15;

/// The scene as far as it has been put together.
#[derive(Default)]
pub(super) struct Parts {
    pub materials: Vec<Material>,
    pub material_names: Vec<MaterialName>,
    /// Whether a material varies as it was given.
    pub varies: Vec<bool>,
    pub triangles: Vec<Triangle>,
    pub infos: Vec<TriangleInfo>,
    pub analytic: Vec<Analytic>,
    pub analytic_infos: Vec<AnalyticInfo>,
    pub surfaces: Vec<Surface>,
    pub attributes: Vec<Attributes>,
    pub labels: Labels,
    pub emitters: Vec<Emitter>,
    pub point_rule: PointRule,
    /// How many triangles without area were left out.
    pub degenerate: usize,
    /// What is kept once, behind all that is not.
    pub kept: Vec<Kept>,
    pub prototypes: Vec<Prototype>,
    pub instances: Vec<Instance>,
}

/// What a prototype has of the lists of a scene, in coordinates of its own.
pub(super) struct Kept {
    pub triangles: Range<usize>,
    pub analytic: Range<usize>,
    pub surfaces: Range<usize>,
    /// Where these coordinates have their origin.
    shift: DVec3,
}

/// Where the surface of a shape went.
pub(super) enum Placed {
    /// Behind all other analytic surfaces.
    Analytic,
    Quad {
        quad: Parallelogram,
        range: Range<usize>,
    },
    Mesh(Range<usize>),
}

impl Parts {
    /// Adds a shape, which messages call by its name: its surface, and its emitter if it emits.
    pub fn add(&mut self, shape: Shape, name: &str, shift: DVec3) -> Result<(), SceneError> {
        let (material, emission, label) = (shape.material, shape.emission.clone(), shape.label.clone());
        let grouped = shape.group.is_some();
        let attributes_before = self.attributes.len();
        let placed = self.place(shape, name, shift)?;
        check_count(self.infos.len())?;
        let index = material.0 as usize;
        let surface = Looked::new(self, &placed, attributes_before);
        let seen = look(&self.materials[index], &surface, &self.material_names[index], name)?;
        self.materials[index].parts_mut().iter_mut().zip(&seen).for_each(|(part, seen)| part.include(seen));
        if emission.is_some() && self.materials[material.0 as usize].is_masked() {
            return Err(SceneError::invalid(
                format!("{name} emits, but its material has an `opacity`"),
                "give what emits a material without one",
            ));
        }
        if self.materials[material.0 as usize].needs_derivatives() {
            self.add_derivatives(&placed, attributes_before);
        }
        let emitter = match emission {
            None => None,
            Some(given) => {
                let emission = Emission { radiance: given.radiance.recentred(shift), ..given };
                let surface = Looked::new(self, &placed, attributes_before);
                let named = format!("the radiance of {name}");
                check_coordinates(&[&emission.radiance], &surface, &named)?;
                let ends = surface.ends(&emission.radiance);
                ends.iter().try_for_each(|value| check_light(*value, &named))?;
                let attributes = self.attributes.get(attributes_before);
                self.emitters.push(Emitter::Area(self.area_emitter(&placed, emission, attributes, &ends, name)?));
                Some(EmitterId((self.emitters.len() - 1) as u32))
            }
        };
        let attributes = (self.attributes.len() > attributes_before).then_some(attributes_before as u32);
        let id = SurfaceId(self.surfaces.len() as u32);
        let area = (!grouped).then(|| self.area(&placed));
        self.surfaces.push(Surface { id, material, emitter, attributes, area });
        self.labels.add_surface(label, emitter.is_some());
        Ok(())
    }

    fn place(&mut self, shape: Shape, name: &str, shift: DVec3) -> Result<Placed, SceneError> {
        let Shape { geometry, transform, flipped, material, emission, .. } = shape;
        match geometry {
            Geometry::Sphere { center, radius } => {
                let scale = similarity_scale(&transform.matrix3).expect("checked before");
                let center = (transform.transform_point3(center) - shift).as_vec3();
                let sphere = Sphere { center, radius: (radius * scale) as f32, flipped };
                let axis = |axis: DVec3| transform.transform_vector3(axis).normalize_or(axis).as_vec3();
                let chart = SphereChart { flipped, radius: sphere.radius, axes: DVec3::AXES.map(axis) };
                Ok(self.add_analytic(Analytic::Sphere(sphere), Chart::Sphere(chart)))
            }
            Geometry::Disk { center, edge_u, edge_v } => {
                let [edge_u, edge_v] = [edge_u, edge_v].map(|edge| transform.transform_vector3(edge));
                // The front is the image of the front, and turns over against the edges where the transform mirrors.
                let flipped = flipped != (transform.matrix3.determinant() < 0.0);
                let disk = Disk::new(transform.transform_point3(center) - shift, edge_u, edge_v, flipped);
                let disk = disk.map(Box::new).ok_or_else(|| {
                    SceneError::invalid(format!("{name} has no area"), "give two edges that are not parallel")
                })?;
                Ok(self.add_analytic(Analytic::Disk(disk.clone()), Chart::Disk(disk)))
            }
            Geometry::Cylinder { from, to, radius } => {
                let scale = similarity_scale(&transform.matrix3).expect("checked before");
                let along = (to - from).normalize();
                let (x, y) = along.any_orthonormal_pair();
                let cylinder = Box::new(Cylinder {
                    from: transform.transform_point3(from) - shift,
                    axes: [x, y, along].map(|axis| transform.transform_vector3(axis).normalize()),
                    length: (to - from).length() * scale,
                    radius: radius * scale,
                    flipped,
                });
                Ok(self.add_analytic(Analytic::Cylinder(cylinder.clone()), Chart::Cylinder(cylinder)))
            }
            Geometry::Quad { origin, edge_u, edge_v } => {
                let positions = vec![origin, origin + edge_u, origin + edge_u + edge_v, origin + edge_v];
                // Whether it varies is asked of what was given, so that no skip changes what there is.
                let varies = self.varies[material.0 as usize];
                let material = &self.materials[material.0 as usize];
                let shines = emission.is_some_and(|emission| emission.radiance.needs_uv());
                let uvs = match varies || material.needs_derivatives() || shines {
                    true => vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
                    false => Vec::new(),
                };
                let mesh = MeshData { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], uvs, ..MeshData::default() };
                let baked = bake_mesh(mesh, &transform, flipped, shift);
                let [normal_a, normal_b] = baked.fronts[..] else {
                    return Err(SceneError::invalid(
                        format!("{name} has no area"),
                        "give two edges that are not parallel",
                    ));
                };
                let [first, second] = [baked.triangle(0).0, baked.triangle(1).0];
                let quad = parallelogram(first, second, [normal_a, normal_b]);
                Ok(Placed::Quad { quad, range: self.add_mesh(baked) })
            }
            Geometry::Mesh(mesh) => Ok(Placed::Mesh(self.add_mesh(bake_mesh(mesh, &transform, flipped, shift)))),
        }
    }

    fn add_analytic(&mut self, analytic: Analytic, chart: Chart) -> Placed {
        self.analytic.push(analytic);
        self.analytic_infos.push(AnalyticInfo { surface: self.surfaces.len() as u32, chart });
        Placed::Analytic
    }

    fn add_mesh(&mut self, mesh: BakedMesh) -> Range<usize> {
        let surface = self.surfaces.len() as u32;
        let first = self.triangles.len();
        let BakedMesh { positions, triangles, fronts, normals, uvs, colours, degenerate } = mesh;
        self.triangles.reserve_exact(triangles.len());
        self.triangles.par_extend(triangles.par_iter().map(|t| Triangle(t.map(|vertex| positions[vertex as usize]))));
        // Each list goes as soon as the next one holds what is needed of it: meshes are large.
        drop(positions);
        let info = |(triangle, ng): (&Triangle, Vec3)| TriangleInfo { ng, residual: triangle.residual(), surface };
        self.infos.reserve_exact(triangles.len());
        self.infos.par_extend(self.triangles[first..].par_iter().zip(fronts).map(info));
        self.degenerate += degenerate;
        if !normals.is_empty() || !uvs.is_empty() || !colours.is_empty() {
            let derivatives = Vec::new();
            self.attributes.push(Attributes { first: first as u32, triangles, normals, uvs, colours, derivatives });
        }
        first..self.triangles.len()
    }

    /// Lets the triangles of a surface know how they move with their texture coordinates, if they have any; `index` is the place of
    /// its attributes.
    fn add_derivatives(&mut self, placed: &Placed, index: usize) {
        let (Placed::Quad { range, .. } | Placed::Mesh(range)) = placed else { return };
        let Some(attributes) = self.attributes.get_mut(index).filter(|attributes| !attributes.uvs.is_empty()) else {
            return;
        };
        let corners = attributes.triangles.iter().map(|t| t.map(|vertex| attributes.uvs[vertex as usize]));
        let triangles = &self.triangles[range.clone()];
        attributes.derivatives = triangles.iter().zip(corners).map(|(t, uvs)| derivatives(t.0, uvs)).collect();
    }

    /// Begins what is kept once: all shapes that are added belong to it until it is ended.
    pub fn begin_prototype(&mut self) {
        let (triangles, analytic, surfaces) = (self.triangles.len(), self.analytic.len(), self.surfaces.len());
        self.kept.push(Kept {
            triangles: triangles..triangles,
            analytic: analytic..analytic,
            surfaces: surfaces..surfaces,
            shift: DVec3::ZERO,
        });
    }

    /// Ends it, its coordinates having their origin at `shift`, and returns its number; None if it has no surface.
    pub fn end_prototype(&mut self, shift: DVec3, skip: Skip) -> Option<u32> {
        let mut kept = self.kept.pop()?;
        kept.triangles.end = self.triangles.len();
        kept.analytic.end = self.analytic.len();
        kept.surfaces.end = self.surfaces.len();
        kept.shift = shift;
        if kept.triangles.is_empty() && kept.analytic.is_empty() {
            return None;
        }
        let first = [kept.triangles.start as u32, kept.analytic.start as u32];
        let analytic = self.analytic[kept.analytic.clone()].to_vec();
        self.prototypes.push(Prototype::new(&self.triangles[kept.triangles.clone()], analytic, first, skip));
        self.kept.push(kept);
        Some(self.prototypes.len() as u32 - 1)
    }

    /// Places a prototype by a map from the coordinates that it was given in; None if numbers cannot hold that.
    pub fn add_instance(&mut self, transform: DAffine3, prototype: u32) -> Option<()> {
        let own = DAffine3::from_translation(self.kept[prototype as usize].shift);
        self.instances.push(Instance::new(transform * own, prototype)?);
        Some(())
    }

    /// The triangles and the analytic surfaces that are where they are.
    fn direct(&self) -> (&[Triangle], &[Analytic]) {
        let ends = self
            .kept
            .first()
            .map_or((self.triangles.len(), self.analytic.len()), |kept| (kept.triangles.start, kept.analytic.start));
        (&self.triangles[..ends.0], &self.analytic[..ends.1])
    }

    /// The corners of the boxes of all instances, with the number of the prototype.
    fn corners(&self) -> impl Iterator<Item = (u32, [Vec3; 8])> {
        self.instances.iter().map(|instance| {
            let prototype = &self.prototypes[instance.prototype as usize];
            (instance.prototype, prototype.corners(&instance.to_world).map(|p| p.as_vec3()))
        })
    }

    /// Arranges everything for rays. What is where it is, is let go of.
    pub fn take_accel(&mut self, skip: Skip) -> Accel {
        let (triangles, analytic) = (self.direct().0.len(), self.direct().1.len());
        self.analytic.truncate(analytic);
        let analytic = std::mem::take(&mut self.analytic);
        let all = std::mem::take(&mut self.triangles);
        let triangles = &all[..triangles];
        let (instances, prototypes) = (std::mem::take(&mut self.instances), std::mem::take(&mut self.prototypes));
        match instances.is_empty() {
            true => Accel::build(triangles, analytic, skip),
            false => Accel::build_with(triangles, analytic, (instances, prototypes)),
        }
    }

    /// Coordinates must stay where their products are finite.
    pub fn check_extent(&self, camera: &Camera) -> Result<(), SceneError> {
        let vertices = self.triangles.iter().flat_map(|t| t.0).chain(self.corners().flat_map(|(_, corners)| corners));
        let farthest = |(low, high): (Vec3, Vec3)| low.abs().max(high.abs());
        let analytic = self.analytic.iter().map(|surface| farthest(surface.extent()));
        let largest =
            vertices.chain(analytic).chain([camera.extent()]).map(|p| p.abs().max_element()).fold(0.0, f32::max);
        let visible = |surface: &Analytic| surface.balls().iter().all(|(_, radius)| *radius > 0.0);
        if largest <= FARTHEST && self.analytic.iter().all(visible) {
            return Ok(());
        }
        Err(SceneError::invalid(
            format!("the scene reaches {largest:e} m from its middle, or has a shape too small for its place"),
            "give its coordinates in a unit that suits its size",
        ))
    }

    /// A sphere around all surfaces, rounded up.
    pub fn bounds(&self) -> BoundingSphere {
        let (triangles, analytic) = self.direct();
        let placed = || self.corners().flat_map(|(_, corners)| corners);
        let vertices = || triangles.iter().flat_map(|t| t.0).chain(placed());
        let corners = |surface: &Analytic| <[Vec3; 2]>::from(surface.extent());
        let (low, high) = vertices()
            .chain(analytic.iter().flat_map(corners))
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        if !low.is_finite() {
            return BoundingSphere { center: Vec3::ZERO, radius: 1.0 };
        }
        let center = (low + high) * 0.5;
        let reach = vertices().map(|v| v.distance(center)).fold(0.0, f32::max);
        let balls = analytic.iter().flat_map(Analytic::balls);
        let reach = balls.map(|(middle, radius)| middle.distance(center) + radius).fold(reach, f32::max);
        BoundingSphere { center, radius: reach * (1.0 + 8.0 * f32::EPSILON) }
    }

    /// Notes of every body where its surfaces are; called once all shapes are there.
    pub fn bound_bodies(&mut self) {
        let mut materials = std::mem::take(&mut self.materials);
        if materials.iter().any(|material| matches!(material, Material::Subsurface(_))) {
            let (triangles, analytic) = self.direct();
            let Parts { surfaces, infos, analytic_infos, .. } = &*self;
            let placed: Vec<_> = self
                .corners()
                .map(|(prototype, corners)| (&surfaces[self.kept[prototype as usize].surfaces.clone()], corners))
                .collect();
            let places = Places { surfaces, triangles, infos, analytic, analytic_infos, placed: &placed };
            subsurface::bound(&mut materials, &places);
        }
        self.materials = materials;
    }

    /// Whether there are surfaces that have a say in which emitter lights them.
    pub fn asks_surfaces(&self) -> bool {
        self.surfaces.iter().any(|surface| is_asked(self.materials[surface.material.0 as usize].lobes()))
    }

    /// What the scene asks of a method; called once all emitters are there.
    pub fn needs(&self, camera: &Camera, skip: Skip) -> Needs {
        let used = || self.surfaces.iter().map(|surface| &self.materials[surface.material.0 as usize]);
        let everything = skip == Skip::Nothing;
        let kept = |work: Work| !skip.leaves_out(work);
        let has = |lobes: Lobes| used().any(|material| material.lobes().intersects(lobes));
        let textured =
            |emitter: &Emitter| matches!(emitter, Emitter::Area(area) if !area.emission.radiance.is_constant());
        let bright = || self.emitters.iter().filter(|emitter| emitter.power() > 0.0);
        Needs {
            skip,
            environment: everything || self.emitters.iter().any(Emitter::is_environment),
            tangents: everything || used().any(Material::needs_derivatives),
            masks: kept(Work::Masks) || used().any(Material::is_masked),
            textures: kept(Work::Textures) || used().any(Material::is_textured) || self.emitters.iter().any(textured),
            delta_lobes: everything || has(Lobes::DELTA),
            non_delta_lobes: kept(Work::Connections) || has(Lobes::NON_DELTA),
            subsurface: kept(Work::Subsurface) || used().any(|material| matches!(material, Material::Subsurface(_))),
            only_lambertian: !kept(Work::LobeChoice) && used().all(Material::is_lambertian),
            emitters: self.emitters.len(),
            emitter_choice: kept(Work::EmitterChoice) || bright().count() > 1,
            hittable_emitters: kept(Work::EmitterHits) || bright().any(|emitter| !emitter.is_delta()),
            delta_emitters: everything || bright().any(Emitter::is_delta),
            few_primitives: !kept(Work::Bvh)
                && are_few(&self.triangles, self.analytic.len())
                && self.instances.is_empty(),
            pinhole: !kept(Work::CameraPoints) && camera.rays() == Rays::FromPoint,
            primitives: self.triangles.len() + self.analytic.len(),
        }
    }

    /// What the scene's hash is taken of.
    pub fn content<'a>(
        &'a self,
        materials: &'a [Material],
        environment: Option<EmitterId>,
        camera: &'a Camera,
    ) -> Content<'a> {
        Content {
            triangles: &self.triangles,
            infos: &self.infos,
            analytic: &self.analytic,
            analytic_infos: &self.analytic_infos,
            kept: &self.kept,
            instances: &self.instances,
            surfaces: &self.surfaces,
            attributes: &self.attributes,
            materials,
            emitters: &self.emitters,
            environment,
            camera,
        }
    }
}

/// The corners of a quad whose two triangles share the diagonal from their first vertex, whichever way they wind.
fn parallelogram(first: [Vec3; 3], second: [Vec3; 3], normals: [Vec3; 2]) -> Parallelogram {
    if first[2] == second[1] {
        return Parallelogram { corners: [first[0], first[1], first[2], second[2]], normals, turned: false };
    }
    let corners = [first[0], second[1], first[1], first[2]];
    Parallelogram { corners, normals: [normals[1], normals[0]], turned: true }
}
