//! `[[shapes]]` of scene files.

use std::path::Path;

use super::Origin;
use glam::{DAffine3, DVec3};
use sampling::vec2;

use super::materials::Materials;
use super::reader::{Table, Value};
use super::{kind, tables, textures, transform};
use crate::builder::{Emission, MeshData, SceneBuilder, ShapeId};
use crate::error::SceneError;
use crate::import::{obj, polygon};
use crate::texture::{SurfaceCoordinates, Texture};

/// Keys that every shape understands.
const COMMON: [&str; 6] = ["type", "material", "emission", "two_sided", "flip", "transform"];

/// Reads the shapes: `quad { origin, edge_u, edge_v }`, whose front is the side of `edge_u × edge_v`; `sphere { center,
/// radius }`, with its front outside; `mesh` with `file` (OBJ) or with `vertices` and `faces` (indices from 0, three or
/// more a face, the front counter-clockwise), `uvs` and `colours` of the vertices.
///
/// Every shape has a `material`, which only a mesh file can lack: then the file's own materials hold, with what they
/// emit. `emission` \[W/(m²·sr)\] is what its front emits, and its back too where `two_sided = true`; `flip = true`
/// turns front and back over; `transform` is a list of steps.
pub(super) fn read(
    root: &Table,
    materials: &Materials,
    origin: &Origin,
    builder: &mut SceneBuilder,
) -> Result<(), SceneError> {
    let shapes = tables(root, "shapes")?;
    if shapes.is_empty() {
        return Err(root.error("the scene has no shapes", "add a table `[[shapes]]`"));
    }
    for table in &shapes {
        match kind(table, &["quad", "sphere", "mesh"])? {
            "quad" => read_quad(table, materials, builder)?,
            "sphere" => read_sphere(table, materials, builder)?,
            _ if table.get("file").is_some() => read_mesh_file(table, materials, origin, builder)?,
            _ => read_mesh(table, materials, builder)?,
        }
    }
    Ok(())
}

/// The points where a ramp over a shape is smallest and largest.
enum Extent {
    Points(Vec<DVec3>),
    Sphere { center: DVec3, radius: f64 },
}

fn allow(table: &Table, own: &[&str]) -> Result<(), SceneError> {
    let keys: Vec<&str> = COMMON.iter().chain(own).copied().collect();
    table.allow_only(&keys)
}

fn read_quad(table: &Table, materials: &Materials, builder: &mut SceneBuilder) -> Result<(), SceneError> {
    allow(table, &["origin", "edge_u", "edge_v"])?;
    let origin = table.need("origin", "[0, 0, 0]")?.vec3()?;
    let u = table.need("edge_u", "[1, 0, 0]")?.vec3()?;
    let edge_v = table.need("edge_v", "[0, 1, 0]")?;
    let v = edge_v.vec3()?;
    if u.cross(v).length() <= 1e-12 * u.length() * v.length() {
        return Err(edge_v.error("`edge_u` and `edge_v` must span an area: neither zero nor parallel"));
    }
    let material = materials.named(table)?;
    let shape = builder.quad(origin, u, v, material);
    let extent = Extent::Points(vec![origin, origin + u, origin + v, origin + u + v]);
    finish(table, materials, shape, extent, builder)
}

fn read_sphere(table: &Table, materials: &Materials, builder: &mut SceneBuilder) -> Result<(), SceneError> {
    allow(table, &["center", "radius"])?;
    let center = table.need("center", "[0, 0, 0]")?.vec3()?;
    let radius = table.need("radius", "1")?.positive()?;
    let material = materials.named(table)?;
    let shape = builder.sphere(center, radius, material);
    finish(table, materials, shape, Extent::Sphere { center, radius }, builder)
}

fn read_mesh(table: &Table, materials: &Materials, builder: &mut SceneBuilder) -> Result<(), SceneError> {
    allow(table, &["vertices", "faces", "uvs", "colours"])?;
    let Some(vertices) = table.get("vertices") else {
        return Err(table.error(
            "a mesh has neither `file` nor `vertices`",
            "add `file = \"mesh.obj\"`, or `vertices` and `faces`",
        ));
    };
    let positions: Vec<DVec3> = vertices.array()?.iter().map(Value::vec3).collect::<Result<_, _>>()?;
    let faces = table.need("faces", "[[0, 1, 2]]")?;
    let mut triangles = Vec::new();
    for face in faces.array()? {
        let corners = read_face(&face, positions.len())?;
        let points: Vec<DVec3> = corners.iter().map(|&c| positions[c as usize]).collect();
        triangles.extend(polygon::triangulate(&points).map(|t| t.map(|i| corners[i])));
    }
    if triangles.is_empty() {
        return Err(faces.error("a mesh needs at least one face that spans an area"));
    }
    let material = materials.named(table)?;
    let extent = Extent::Points(positions.clone());
    let uvs = vertex_list(table, "uvs", positions.len(), |value| {
        let uv = value.numbers(2, "a pair")?;
        Ok(vec2(uv[0] as f32, uv[1] as f32))
    })?;
    let colours = vertex_list(table, "colours", positions.len(), |value| value.colour())?;
    let shape = builder.mesh(MeshData { positions, triangles, uvs, colours, ..MeshData::default() }, material);
    finish(table, materials, shape, extent, builder)
}

/// One value for every vertex of a mesh, or none at all.
fn vertex_list<T>(
    table: &Table,
    key: &str,
    vertices: usize,
    read: impl Fn(&Value) -> Result<T, SceneError>,
) -> Result<Vec<T>, SceneError> {
    let Some(value) = table.get(key) else { return Ok(Vec::new()) };
    let items = value.array()?;
    if items.len() != vertices {
        return Err(
            value.error(format!("there are {} for {vertices} vertices; give one for every vertex", items.len()))
        );
    }
    items.iter().map(read).collect()
}

fn read_face(face: &Value, vertices: usize) -> Result<Vec<u32>, SceneError> {
    let items = face.array()?;
    if items.len() < 3 {
        return Err(face.error("a face has at least 3 vertices"));
    }
    let index = |item: &Value| match item.whole()? {
        i if (0..vertices as i64).contains(&i) => Ok(i as u32),
        _ => Err(item.error(format!("the mesh has {vertices} vertices, counted from 0"))),
    };
    items.iter().map(index).collect()
}

fn read_mesh_file(
    table: &Table,
    materials: &Materials,
    origin: &Origin,
    builder: &mut SceneBuilder,
) -> Result<(), SceneError> {
    allow(table, &["file"])?;
    let file = table.need("file", "\"mesh.obj\"")?;
    let name = file.text()?;
    let is_obj = Path::new(name).extension().is_some_and(|ending| ending.eq_ignore_ascii_case("obj"));
    let Some(folder) = origin.folder.filter(|_| is_obj) else {
        return Err(file.error("meshes are read from .obj files"));
    };
    let path = folder.join(name);
    let attached = origin.attachments.iter().find(|attachment| attachment.name == name);
    if attached.is_none() && !path.is_file() {
        return Err(file.error(format!("there is no file {}; paths start at the scene file's folder", path.display())));
    }
    let material = table.get("material").is_some().then(|| materials.named(table)).transpose()?;
    let model = match attached {
        Some(attachment) => obj::Model::read(&path, attachment.text.as_bytes())?,
        None => obj::Model::open(&path)?,
    };
    let overrides = obj::Overrides { material, no_emission: material.is_some() || table.get("emission").is_some() };
    for (shape, points) in model.add_to(builder, overrides) {
        finish(table, materials, shape, Extent::Points(points), builder)?;
    }
    Ok(())
}

/// Applies what all shapes share: transform, flip, emission; and checks that ramps stay in their range over the shape.
fn finish(
    table: &Table,
    materials: &Materials,
    shape: ShapeId,
    extent: Extent,
    builder: &mut SceneBuilder,
) -> Result<(), SceneError> {
    let map = match table.get("transform") {
        Some(value) => {
            let map = transform::read(&value)?;
            if matches!(extent, Extent::Sphere { .. }) && !transform::is_similarity(&map) {
                return Err(value.error("a sphere must stay a sphere: scale it alike in all directions"));
            }
            builder.transform(shape, map);
            map
        }
        None => DAffine3::IDENTITY,
    };
    let extent = extent.transformed(&map);
    if let Some(varying) = table.get("material").and_then(|m| materials.varying(m.text().ok()?)) {
        for (name, domain, texture) in varying.textures().filter(|(.., texture)| texture.axis().is_some()) {
            let (low, high) = extent.range(texture);
            if !domain.holds(low) || !domain.holds(high) {
                let message = format!("the {name} ramp runs from {low} to {high} over this shape");
                return Err(table.error(message, format!("choose `base` and `slope` so that it stays {domain}")));
            }
        }
    }
    if flag(table, "flip")? {
        builder.flip(shape);
    }
    let two_sided = flag(table, "two_sided")?;
    let Some(value) = table.get("emission") else {
        if two_sided {
            return Err(
                table.error("`two_sided` says which sides emit, but there is no `emission`", "add one, or remove it")
            );
        }
        return Ok(());
    };
    let radiance = textures::colour_or_ramp(&value)?;
    let (low, high) = extent.range(&radiance);
    if low < 0.0 && radiance.is_constant() {
        return Err(value.error("light cannot be negative; give 0 or more in every channel"));
    }
    if low < 0.0 {
        let message = format!("the emission ramp falls to {low} over this shape");
        return Err(table.error(message, "choose `base` and `slope` so that it stays at or above 0"));
    }
    if high == 0.0 {
        return Err(value.error("an emitter must emit; give a channel above 0, or leave `emission` out"));
    }
    builder.emit(shape, Emission { radiance, two_sided });
    Ok(())
}

fn flag(table: &Table, key: &str) -> Result<bool, SceneError> {
    table.get(key).map_or(Ok(false), |value| value.boolean())
}

impl Extent {
    fn transformed(self, map: &DAffine3) -> Self {
        match self {
            Extent::Points(points) => Extent::Points(points.into_iter().map(|p| map.transform_point3(p)).collect()),
            Extent::Sphere { center, radius } => {
                let scale = map.matrix3.x_axis.length();
                Extent::Sphere { center: map.transform_point3(center), radius: radius * scale }
            }
        }
    }

    /// The smallest and largest channel of a texture over the shape; a ramp is linear, so its ends are at corners or
    /// poles.
    fn range(&self, texture: &Texture) -> (f32, f32) {
        match self {
            Extent::Sphere { center, radius } => texture.range_in_ball(center.as_vec3(), *radius as f32),
            Extent::Points(points) => {
                let channels =
                    || points.iter().flat_map(|p| texture.at(&SurfaceCoordinates::of(p.as_vec3())).to_array());
                (channels().fold(f32::INFINITY, f32::min), channels().fold(f32::NEG_INFINITY, f32::max))
            }
        }
    }
}
