//! `[[shapes]]` of scene files.

use std::path::Path;

use super::Origin;
use glam::DVec3;
use sampling::{Vec2, vec2};

use super::groups::{self, Groups};
use super::materials::Materials;
use super::reader::{Line, Table, Value};
use super::textures::Textures;
use super::{kind, tables, transform};
use crate::builder::{Emission, MeshData, SceneBuilder, ShapeId};
use crate::error::SceneError;
use crate::import::{obj, ply, polygon};
use crate::material::Material;
use crate::suggest::near_file;
use crate::texture::{Encoding, Texture};

/// Keys that every shape understands.
const COMMON: [&str; 7] = ["type", "label", "material", "emission", "two_sided", "flip", "transform"];

/// Reads the shapes: `quad { origin, edge_u, edge_v }` and `disk { center, edge_u, edge_v }`, whose edges run from the centre
/// to the rim, with their front on the side of `edge_u × edge_v`; `sphere { center, radius }` and the open `cylinder { from,
/// to, radius }`, with their front outside; `mesh` with `file` (OBJ or PLY; `corner_uvs` are the texture coordinates of the three corners
/// of every triangle, where the file has none) or with `vertices` and `faces` (indices from 0, three or
/// more a face, the front counter-clockwise), `uvs` and `colours` of the vertices; and `instance { group, transform }`, which has no
/// other keys.
///
/// Every shape has a `material`, which only a mesh file can lack: then the file's own materials hold, with what they
/// emit. `emission` \[W/(m²·sr)\], a colour or a texture, is what its front emits, and its back too where `two_sided = true`; `flip = true`
/// turns front and back over; `transform` is a list of steps; `label` is what light-path expressions call the shape, and the light
/// group that it belongs to if it emits.
pub(super) fn read<'a>(
    root: &Table<'a>,
    materials: &Materials<'a>,
    origin: &Origin,
    builder: &mut SceneBuilder,
) -> Result<(), SceneError> {
    let textures = Textures::new(origin.folder, origin.attachments);
    let mut shapes = Shapes { materials, textures: &textures, origin, groups: Groups::default() };
    groups::read(root, &mut shapes, builder)?;
    let list = tables(root, "shapes")?;
    if list.is_empty() {
        return Err(no_shapes(root, "the scene has no shapes", "[[shapes]]"));
    }
    shapes.read_list(&list, builder)
}

/// The error that there should be a shape.
pub(super) fn no_shapes(table: &Table, message: &str, header: &str) -> SceneError {
    table.error(message, format!("add a table `{header}`"))
}

/// Where what lists of shapes name is found.
pub(super) struct Shapes<'a, 'c> {
    materials: &'c Materials<'a>,
    textures: &'c Textures<'c>,
    origin: &'c Origin<'c>,
    pub groups: Groups<'a>,
}

impl Shapes<'_, '_> {
    /// Reads the shapes of a scene or of a group.
    pub fn read_list(&self, list: &[Table], builder: &mut SceneBuilder) -> Result<(), SceneError> {
        let mut line = Line::default();
        for table in list {
            let Shapes { materials, textures, origin, groups } = self;
            let reader = Reader { table, materials, textures, origin };
            let shapes = match kind(table, &["quad", "sphere", "disk", "cylinder", "mesh", "instance"])? {
                "quad" => vec![reader.quad(builder)?],
                "sphere" => vec![reader.sphere(builder)?],
                "disk" => vec![reader.disk(builder)?],
                "cylinder" => vec![reader.cylinder(builder)?],
                "instance" => {
                    groups.instance(table, table.line_after(&mut line), builder)?;
                    continue;
                }
                _ if table.get("file").is_some() => reader.mesh_file(builder)?,
                _ => vec![reader.mesh(builder)?],
            };
            for shape in shapes {
                reader.finish(shape, builder)?;
            }
        }
        Ok(())
    }
}

/// One table, and where what it names is found.
struct Reader<'a> {
    table: &'a Table<'a>,
    materials: &'a Materials<'a>,
    textures: &'a Textures<'a>,
    origin: &'a Origin<'a>,
}

impl Reader<'_> {
    fn allow(&self, own: &[&str]) -> Result<(), SceneError> {
        let keys: Vec<&str> = COMMON.iter().chain(own).copied().collect();
        self.table.allow_only(&keys)
    }

    /// `edge_u` and `edge_v`, which must not be parallel.
    fn edges(&self) -> Result<(DVec3, DVec3), SceneError> {
        let u = self.table.need("edge_u", "[1, 0, 0]")?.vec3()?;
        let edge_v = self.table.need("edge_v", "[0, 1, 0]")?;
        let v = edge_v.vec3()?;
        if u.cross(v).length() <= 1e-12 * u.length() * v.length() {
            return Err(edge_v.error("`edge_u` and `edge_v` must span an area: neither zero nor parallel"));
        }
        Ok((u, v))
    }

    fn quad(&self, builder: &mut SceneBuilder) -> Result<ShapeId, SceneError> {
        self.allow(&["origin", "edge_u", "edge_v"])?;
        let origin = self.table.need("origin", "[0, 0, 0]")?.vec3()?;
        let (u, v) = self.edges()?;
        Ok(builder.quad(origin, u, v, self.materials.named(self.table)?))
    }

    fn sphere(&self, builder: &mut SceneBuilder) -> Result<ShapeId, SceneError> {
        self.allow(&["center", "radius"])?;
        let center = self.table.need("center", "[0, 0, 0]")?.vec3()?;
        let radius = self.table.need("radius", "1")?.positive()?;
        Ok(builder.sphere(center, radius, self.materials.named(self.table)?))
    }

    fn disk(&self, builder: &mut SceneBuilder) -> Result<ShapeId, SceneError> {
        self.allow(&["center", "edge_u", "edge_v"])?;
        let center = self.table.need("center", "[0, 0, 0]")?.vec3()?;
        let (u, v) = self.edges()?;
        Ok(builder.disk(center, u, v, self.materials.named(self.table)?))
    }

    fn cylinder(&self, builder: &mut SceneBuilder) -> Result<ShapeId, SceneError> {
        self.allow(&["from", "to", "radius"])?;
        let from = self.table.need("from", "[0, 0, 0]")?.vec3()?;
        let to = self.table.need("to", "[0, 0, 1]")?;
        if to.vec3()? == from {
            return Err(to.error("it must differ from `from`: it is the middle of the other end"));
        }
        let radius = self.table.need("radius", "1")?.positive()?;
        Ok(builder.cylinder(from, to.vec3()?, radius, self.materials.named(self.table)?))
    }

    fn mesh(&self, builder: &mut SceneBuilder) -> Result<ShapeId, SceneError> {
        let table = self.table;
        self.allow(&["vertices", "faces", "uvs", "colours"])?;
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
        let material = self.materials.named(table)?;
        let uvs = vertex_list(table, "uvs", positions.len(), pair)?;
        let colours = vertex_list(table, "colours", positions.len(), |value| value.colour())?;
        Ok(builder.mesh(MeshData { positions, triangles, uvs, colours, ..MeshData::default() }, material))
    }

    fn mesh_file(&self, builder: &mut SceneBuilder) -> Result<Vec<ShapeId>, SceneError> {
        let table = self.table;
        self.allow(&["file", "corner_uvs"])?;
        let corners = corner_uvs(table)?;
        let file = table.need("file", "\"mesh.obj\"")?;
        let name = file.text()?;
        let ending = Path::new(name).extension().and_then(|ending| ending.to_str()).map(str::to_lowercase);
        let known = matches!(ending.as_deref(), Some("obj" | "ply"));
        let Some(folder) = self.origin.folder.filter(|_| known) else {
            return Err(file.error("meshes are read from .obj and .ply files"));
        };
        let path = folder.join(name);
        let attached = self.textures.attached(name);
        if attached.is_none() && !path.is_file() {
            let near = near_file(&path);
            let place = path.display();
            return Err(file.error(format!("there is no file {place}; {near}paths start at the scene file's folder")));
        }
        if ending.as_deref() == Some("ply") {
            let material = self.materials.named(table)?;
            let ply::Model { mesh, notes } = match attached {
                Some(attachment) => ply::read(&attachment.bytes).map_err(|error| error.in_file(&path))?,
                None => ply::open(&path)?,
            };
            notes.into_iter().for_each(|(kind, text)| builder.note(format!("{}: {kind}: {text}", path.display())));
            let mesh = match corners {
                Some(corners) => mesh.with_corner_uvs(corners),
                None => mesh,
            };
            return Ok(vec![builder.mesh(mesh, material)]);
        }
        let material = table.get("material").is_some().then(|| self.materials.named(table)).transpose()?;
        let own;
        let bytes = match attached {
            Some(attachment) => &attachment.bytes,
            None => {
                own = obj::contents(&path)?;
                &own
            }
        };
        let read = if material.is_some() { obj::Model::read_bare } else { obj::Model::read };
        let mut model = read(&path, bytes)?;
        if let Some(corners) = corners {
            let meshes = model.groups.iter_mut().map(|group| &mut group.mesh);
            meshes.for_each(|mesh| *mesh = std::mem::take(mesh).with_corner_uvs(corners));
        }
        let overrides = obj::Overrides { material, no_emission: material.is_some() || table.get("emission").is_some() };
        Ok(model.add_to(builder, overrides))
    }

    /// Applies what all shapes share: transform, flip, emission; and checks that ramps stay in their range over the shape.
    fn finish(&self, shape: ShapeId, builder: &mut SceneBuilder) -> Result<(), SceneError> {
        let (table, kind) = (self.table, self.table.need("type", "\"quad\"")?.text()?);
        if let Some(value) = table.get("transform") {
            let map = transform::read(&value)?;
            if matches!(kind, "sphere" | "cylinder") && !transform::is_similarity(&map) {
                return Err(value.error(format!("a {kind} must stay a {kind}: scale it alike in all directions")));
            }
            builder.transform(shape, map);
        }
        let material = table.get("material").and_then(|m| self.materials.given(m.text().ok()?));
        for part in material.map_or(&[][..], Material::parts) {
            let textures = part.scattering.models().into_iter().flat_map(|parameters| parameters.textures());
            for (name, domain, texture) in textures.filter(|(.., texture)| texture.axis().is_some()) {
                let Some((low, high)) = builder.range(shape, texture) else { continue };
                if !domain.holds(low) || !domain.holds(high) {
                    let message = format!("the {name} ramp runs from {low} to {high} over this shape");
                    return Err(table.error(message, format!("choose `base` and `slope` so that it stays {domain}")));
                }
            }
        }
        if let Some(label) = table.get("label") {
            builder.label(shape, label.label()?);
        }
        if flag(table, "flip")? {
            builder.flip(shape);
        }
        let two_sided = flag(table, "two_sided")?;
        if table.get("emission").is_some() {
            return self.emission(shape, two_sided, builder);
        }
        if two_sided {
            return Err(
                table.error("`two_sided` says which sides emit, but there is no `emission`", "add one, or remove it")
            );
        }
        Ok(())
    }

    fn emission(&self, shape: ShapeId, two_sided: bool, builder: &mut SceneBuilder) -> Result<(), SceneError> {
        let value = self.table.need("emission", "[1, 1, 1]")?;
        let radiance = self.textures.read(&value, Encoding::Srgb)?;
        let (low, high) = builder.range(shape, &radiance).unwrap_or((0.0, 1.0));
        if low < 0.0 && matches!(radiance, Texture::Ramp { .. }) {
            let message = format!("the emission ramp falls to {low} over this shape");
            return Err(self.table.error(message, "choose `base` and `slope` so that it stays at or above 0"));
        }
        if low < 0.0 {
            return Err(value.error("light cannot be negative; give 0 or more in every channel"));
        }
        if high == 0.0 {
            return Err(value.error("an emitter must emit; give a channel above 0, or leave `emission` out"));
        }
        builder.emit(shape, Emission { radiance, two_sided });
        Ok(())
    }
}

/// The texture coordinates of every triangle's corners in a mesh that has none.
fn corner_uvs(table: &Table) -> Result<Option<[Vec2; 3]>, SceneError> {
    let Some(value) = table.get("corner_uvs") else { return Ok(None) };
    let pairs = value.array()?.iter().map(pair).collect::<Result<Vec<Vec2>, _>>()?;
    let corners = pairs.try_into();
    corners.map(Some).map_err(|_| value.error("give three pairs, such as [[0, 0], [1, 0], [0, 1]]"))
}

fn pair(value: &Value) -> Result<Vec2, SceneError> {
    let uv = value.numbers(2, "a pair")?;
    Ok(vec2(uv[0] as f32, uv[1] as f32))
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

fn flag(table: &Table, key: &str) -> Result<bool, SceneError> {
    table.get(key).map_or(Ok(false), |value| value.boolean())
}
