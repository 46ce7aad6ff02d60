//! The parts of a scene while it is put together.

use super::Shape;
use super::check::{check_domain, check_light, check_roughness, similarity_scale};
use super::hash::Content;
use crate::accel::FEW;
use crate::camera::Camera;
use crate::emitter::{AreaEmitter, AreaShape, Emission, Emitter, EmitterId};
use crate::error::SceneError;
use crate::material::{Material, MaterialId, Varying};
use crate::needs::{Needs, Skip};
use crate::scene::BoundingSphere;
use crate::shape::{BakedMesh, Geometry, MeshData, Parallelogram, Sphere, Triangle, bake_mesh};
use crate::subsurface::{self, Places};
use crate::surface::{Attributes, SphereInfo, Surface, TriangleInfo, tangent};
use crate::texture::Texture;
use glam::DVec3;
use sampling::Vec3;
use sampling::bsdf::{Bsdf, Lobes};
use sampling::math::Spectrum;
use std::ops::Range;

/// Coordinates beyond this would overflow when multiplied \[m\].
const FARTHEST: f32 = 1e15;

/// The scene as far as it has been put together.
#[derive(Default)]
pub(super) struct Parts {
    pub materials: Vec<Material>,
    pub triangles: Vec<Triangle>,
    pub infos: Vec<TriangleInfo>,
    pub spheres: Vec<Sphere>,
    pub sphere_infos: Vec<SphereInfo>,
    pub surfaces: Vec<Surface>,
    pub attributes: Vec<Attributes>,
    pub emitters: Vec<Emitter>,
    /// How many triangles without area were left out.
    pub degenerate: usize,
}

/// Where the surface of a shape went.
enum Placed {
    Sphere(Sphere),
    Quad { quad: Parallelogram, range: Range<usize>, along_u: Vec3 },
    Mesh(Range<usize>),
}

impl Parts {
    /// Adds a shape: its surface, and its emitter if it emits.
    pub fn add(&mut self, shape: Shape, index: usize, shift: DVec3) -> Result<(), SceneError> {
        let name = shape.name(index);
        let (material, emission) = (shape.material, shape.emission);
        let attributes_before = self.attributes.len();
        let placed = self.place(shape, &name, shift)?;
        self.check_material(material, &placed, &name)?;
        if self.materials[material.0 as usize].is_anisotropic() {
            self.add_tangents(&placed, attributes_before);
        }
        let emitter = match emission {
            None => None,
            Some(given) => {
                let emission = Emission { radiance: given.radiance.recentred(shift), ..given };
                self.check_over(&placed, &emission.radiance, |value| {
                    check_light(value, &format!("the radiance of {name}"))
                })?;
                self.emitters.push(Emitter::Area(self.area_emitter(&placed, emission, &name)?));
                Some(EmitterId((self.emitters.len() - 1) as u32))
            }
        };
        let attributes = (self.attributes.len() > attributes_before).then_some(attributes_before as u32);
        self.surfaces.push(Surface { material, emitter, attributes });
        Ok(())
    }

    fn place(&mut self, shape: Shape, name: &str, shift: DVec3) -> Result<Placed, SceneError> {
        let Shape { geometry, transform, flipped, .. } = shape;
        match geometry {
            Geometry::Sphere { center, radius } => {
                let scale = similarity_scale(&transform.matrix3).expect("checked before");
                let center = (transform.transform_point3(center) - shift).as_vec3();
                let sphere = Sphere { center, radius: (radius * scale) as f32, flipped };
                self.spheres.push(sphere);
                let pole = transform.transform_vector3(DVec3::Z).normalize_or(DVec3::Z).as_vec3();
                self.sphere_infos.push(SphereInfo { surface: self.surfaces.len() as u32, pole });
                Ok(Placed::Sphere(sphere))
            }
            Geometry::Quad { origin, edge_u, edge_v } => {
                let positions = vec![origin, origin + edge_u, origin + edge_u + edge_v, origin + edge_v];
                let mesh = MeshData { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..MeshData::default() };
                let baked = bake_mesh(mesh, &transform, flipped, shift);
                let [normal_a, normal_b] = baked.fronts[..] else {
                    return Err(SceneError::invalid(
                        format!("{name} has no area"),
                        "give two edges that are not parallel",
                    ));
                };
                let [first, second] = [baked.triangle(0).0, baked.triangle(1).0];
                let quad = parallelogram(first, second, [normal_a, normal_b]);
                let along_u = transform.transform_vector3(edge_u).normalize_or_zero().as_vec3();
                Ok(Placed::Quad { quad, range: self.add_mesh(baked), along_u })
            }
            Geometry::Mesh(mesh) => Ok(Placed::Mesh(self.add_mesh(bake_mesh(mesh, &transform, flipped, shift)))),
        }
    }

    fn add_mesh(&mut self, mesh: BakedMesh) -> Range<usize> {
        let surface = self.surfaces.len() as u32;
        let first = self.triangles.len();
        self.triangles.extend((0..mesh.triangles.len()).map(|index| mesh.triangle(index)));
        let residuals = self.triangles[first..].iter().map(Triangle::residual);
        self.infos.extend(mesh.fronts.iter().zip(residuals).map(|(&ng, residual)| TriangleInfo {
            ng,
            residual,
            surface,
        }));
        self.degenerate += mesh.degenerate;
        if !mesh.normals.is_empty() || !mesh.uvs.is_empty() {
            let BakedMesh { triangles, normals, uvs, .. } = mesh;
            self.attributes.push(Attributes { first: first as u32, triangles, normals, uvs, tangents: Vec::new() });
        }
        first..self.triangles.len()
    }

    /// Gives the triangles of a surface their tangents, if anything is known of them; `index` is the place of its attributes.
    fn add_tangents(&mut self, placed: &Placed, index: usize) {
        match placed {
            Placed::Sphere(_) => {}
            Placed::Quad { range, along_u, .. } => {
                let tangents = vec![*along_u; range.len()];
                self.attributes.push(Attributes { first: range.start as u32, tangents, ..Attributes::default() });
            }
            Placed::Mesh(range) => {
                let triangles = &self.triangles[range.clone()];
                if let Some(attributes) = self.attributes.get_mut(index).filter(|attributes| !attributes.uvs.is_empty())
                {
                    let corners = attributes.triangles.iter().map(|t| t.map(|vertex| attributes.uvs[vertex as usize]));
                    attributes.tangents = triangles.iter().zip(corners).map(|(t, uvs)| tangent(t.0, uvs)).collect();
                }
            }
        }
    }

    fn area_emitter(&self, placed: &Placed, emission: Emission, name: &str) -> Result<AreaEmitter, SceneError> {
        let radiance = &emission.radiance;
        let (shape, area, mean_radiance) = match placed {
            // A ramp is linear, so that its mean over a sphere or a triangle is its value in the middle.
            Placed::Sphere(sphere) => {
                (AreaShape::Sphere(*sphere), f64::from(sphere.area()), radiance.at(sphere.center))
            }
            Placed::Quad { quad, range, .. } => {
                let (area, mean) = area_and_mean(&self.triangles[range.clone()], radiance);
                (AreaShape::Quad(*quad), area, mean)
            }
            Placed::Mesh(range) => {
                let (area, mean) = area_and_mean(&self.triangles[range.clone()], radiance);
                (self.emitting_mesh(range.clone()), area, mean)
            }
        };
        if area.is_nan() || area <= 0.0 {
            return Err(SceneError::invalid(
                format!("{name} emits but has no area"),
                "give it at least one triangle with an area",
            ));
        }
        Ok(AreaEmitter { shape, emission, area: area as f32, mean_radiance })
    }

    fn emitting_mesh(&self, range: Range<usize>) -> AreaShape {
        let triangles: Vec<(Triangle, Vec3)> =
            range.map(|index| (self.triangles[index], self.infos[index].ng)).collect();
        let cumulative = triangles
            .iter()
            .scan(0.0, |sum, (triangle, _)| {
                *sum += triangle.area();
                Some(*sum)
            })
            .collect();
        AreaShape::Mesh { triangles, cumulative }
    }

    /// Checks a material that varies where its textures are largest and smallest on a surface, and notes its lobes there.
    fn check_material(&mut self, id: MaterialId, placed: &Placed, name: &str) -> Result<(), SceneError> {
        let Material::Varying(mut varying) = self.materials[id.0 as usize].clone() else { return Ok(()) };
        for (parameter, domain, texture) in varying.textures() {
            self.check_over(placed, texture, |value| check_domain(value, domain, parameter, name))?;
            self.check_over(placed, texture, |value| check_roughness(value, parameter, name))?;
        }
        let ramps: Vec<Vec3> = varying.textures().filter_map(|(.., texture)| texture.axis()).collect();
        let mut try_with = |value: &dyn Fn(&Texture) -> Spectrum| match varying.with(value) {
            Ok(bsdf) => {
                varying.include(&bsdf);
                check_fixed(&varying, &bsdf, name)
            }
            Err(misfit) => Err(SceneError::invalid(
                format!("the material of {name} has a bad `{}`", misfit.parameter),
                misfit.mend,
            )),
        };
        match placed {
            Placed::Sphere(sphere) => {
                let axes = ramps.into_iter().chain([Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE.normalize()]);
                let points = axes.flat_map(|axis| [axis, -axis]).map(|axis| sphere.center + axis * sphere.radius);
                points.into_iter().try_for_each(|point| try_with(&|texture| texture.at(point)))?;
            }
            Placed::Quad { range, .. } | Placed::Mesh(range) => {
                let vertices = self.triangles[range.clone()].iter().flat_map(|t| t.0);
                vertices.into_iter().try_for_each(|vertex| try_with(&|texture| texture.at(vertex)))?;
            }
        }
        self.materials[id.0 as usize] = Material::Varying(varying);
        Ok(())
    }

    /// Checks a texture where it is largest and smallest on a surface: it is linear.
    fn check_over(
        &self,
        placed: &Placed,
        texture: &Texture,
        check: impl Fn(Spectrum) -> Result<(), SceneError>,
    ) -> Result<(), SceneError> {
        match placed {
            Placed::Sphere(sphere) => {
                let (low, high) = texture.range_in_ball(sphere.center, sphere.radius);
                check(Spectrum::splat(low)).and_then(|()| check(Spectrum::splat(high)))
            }
            Placed::Quad { range, .. } | Placed::Mesh(range) => match texture {
                Texture::Constant(value) => check(*value),
                Texture::Ramp { .. } => self.triangles[range.clone()]
                    .iter()
                    .flat_map(|t| t.0)
                    .try_for_each(|vertex| check(texture.at(vertex))),
            },
        }
    }

    /// Coordinates must stay where their products are finite.
    pub fn check_extent(&self, camera: &Camera) -> Result<(), SceneError> {
        let vertices = self.triangles.iter().flat_map(|t| t.0);
        let spheres = self.spheres.iter().map(|s| s.center.abs() + Vec3::splat(s.radius));
        let largest =
            vertices.chain(spheres).chain([camera.position()]).map(|p| p.abs().max_element()).fold(0.0, f32::max);
        if largest <= FARTHEST && self.spheres.iter().all(|s| s.radius > 0.0) {
            return Ok(());
        }
        Err(SceneError::invalid(
            format!("the scene reaches {largest:e} m from its middle, or has a sphere too small for its place"),
            "give its coordinates in a unit that suits its size",
        ))
    }

    /// A sphere around all surfaces, rounded up.
    pub fn bounds(&self) -> BoundingSphere {
        let vertices = || self.triangles.iter().flat_map(|t| t.0);
        let around = |s: &Sphere| [s.center - s.radius, s.center + s.radius];
        let (low, high) = vertices()
            .chain(self.spheres.iter().flat_map(around))
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        if !low.is_finite() {
            return BoundingSphere { center: Vec3::ZERO, radius: 1.0 };
        }
        let center = (low + high) * 0.5;
        let reach = vertices().map(|v| v.distance(center)).fold(0.0, f32::max);
        let reach = self.spheres.iter().map(|s| s.center.distance(center) + s.radius).fold(reach, f32::max);
        BoundingSphere { center, radius: reach * (1.0 + 8.0 * f32::EPSILON) }
    }

    /// Notes of every body where its surfaces are; called once all shapes are there.
    pub fn bound_bodies(&mut self) {
        let Parts { materials, surfaces, triangles, infos, spheres, sphere_infos, .. } = self;
        subsurface::bound(materials, &Places { surfaces, triangles, infos, spheres, sphere_infos });
    }

    /// What the scene asks of a method; called once all emitters are there.
    pub fn needs(&self, skip: Skip) -> Needs {
        let used = || self.surfaces.iter().map(|surface| &self.materials[surface.material.0 as usize]);
        let everything = skip == Skip::Nothing;
        let has = |lobes: Lobes| used().any(|material| material.lobes().intersects(lobes));
        let textured =
            |emitter: &Emitter| matches!(emitter, Emitter::Area(area) if !area.emission.radiance.is_constant());
        let bright = || self.emitters.iter().filter(|emitter| emitter.power() > 0.0);
        let primitives = self.triangles.len() + self.spheres.len();
        Needs {
            skip,
            environment: everything || self.emitters.iter().any(|e| matches!(e, Emitter::Environment(_))),
            tangents: everything || used().any(Material::is_anisotropic),
            textures: everything || used().any(Material::is_textured) || self.emitters.iter().any(textured),
            delta_lobes: everything || has(Lobes::DELTA),
            non_delta_lobes: everything || has(Lobes::NON_DELTA),
            subsurface: everything || used().any(|material| matches!(material, Material::Subsurface(_))),
            only_lambertian: !everything && used().all(Material::is_lambertian),
            emitters: self.emitters.len(),
            emitter_choice: everything || bright().count() > 1,
            hittable_emitters: everything || bright().any(|emitter| !emitter.is_delta()),
            delta_emitters: everything || bright().any(Emitter::is_delta),
            few_primitives: !everything && primitives <= FEW,
            pinhole: true,
            primitives,
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
            spheres: &self.spheres,
            sphere_infos: &self.sphere_infos,
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
        return Parallelogram { corners: [first[0], first[1], first[2], second[2]], normals };
    }
    Parallelogram { corners: [first[0], second[1], first[1], first[2]], normals: [normals[1], normals[0]] }
}

/// What a model has tables for, and the index of what light goes through, has one value all over a surface.
fn check_fixed(varying: &Varying, bsdf: &Bsdf, name: &str) -> Result<(), SceneError> {
    let Some((parameter, ..)) = varying.textures().find(|(parameter, ..)| bsdf.fixed().contains(parameter)) else {
        return Ok(());
    };
    Err(SceneError::invalid(
        format!("the `{parameter}` of {name} varies, but must be the same all over it"),
        "give a number; a roughness may vary with the distributions ggx and beckmann, without compensation",
    ))
}

fn area_and_mean(triangles: &[Triangle], radiance: &Texture) -> (f64, Spectrum) {
    let area: f64 = triangles.iter().map(Triangle::area).sum();
    let mut mean = [0.0f64; 3];
    for triangle in triangles {
        let share = triangle.area() / area;
        for (sum, value) in mean.iter_mut().zip(radiance.at(triangle.centroid()).to_array()) {
            *sum += share * f64::from(value);
        }
    }
    (area, Spectrum::from(mean.map(|value| value as f32)))
}
