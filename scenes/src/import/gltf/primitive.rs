//! Parts of meshes: triangles with what lies over them.

use glam::DVec3;
use sampling::math::Spectrum;
use sampling::{Vec2, Vec3};

use super::accessor::Accessor;
use super::buffers::Asset;
use super::document::Item;
use super::material::Tint;
use super::schema::Primitive;
use super::texture::UvPlan;
use crate::builder::MeshData;
use crate::error::SceneError;

/// The largest magnitude of a coordinate.
const MAX_COORDINATE: f64 = 1e15;
/// How many triangles a file may have in all, those of a mesh that stands in several places once.
pub const MOST_TRIANGLES: usize = 1 << 26;

/// A part of a mesh that is written.
pub struct Piece {
    /// Its file.
    pub file: String,
    /// Its material.
    pub material: String,
    /// What it emits, as TOML, and whether on both sides.
    pub emission: Option<(String, bool)>,
    /// How many triangles it has.
    pub triangles: usize,
    /// Its triangles where they are asked for, to choose a camera.
    pub mesh: Option<MeshData>,
}

/// A part of a mesh as it is described.
pub struct Part<'p, 't> {
    /// The mesh.
    pub item: &'p Item<'t>,
    /// What messages call the part.
    pub title: String,
    /// What it says.
    pub primitive: &'p Primitive,
}

/// What was read of a part.
pub struct Geometry {
    /// Its triangles, without colours.
    pub mesh: MeshData,
    /// The colours of its vertices, if they differ, and their opacity.
    pub colours: Vec<[f64; 4]>,
    /// The colour that they all have.
    pub tint: Tint,
    /// How many numbers of texture coordinates were none.
    pub bad_uvs: usize,
}

impl<'t> Part<'_, 't> {
    fn error(&self, asset: &Asset<'t>, message: impl AsRef<str>, mend: &str) -> SceneError {
        let message = format!("{} {}", self.title, message.as_ref());
        asset.document.place_of_item(self.item).error(message, mend)
    }

    /// The accessor of an attribute, which has an element for each of `vertices`.
    fn attribute<'a>(
        &self,
        asset: &'a Asset<'t>,
        name: &str,
        components: std::ops::RangeInclusive<usize>,
        vertices: Option<usize>,
    ) -> Result<Option<Accessor<'a, 't>>, SceneError> {
        let Some(&index) = self.primitive.attributes.get(name) else { return Ok(None) };
        let accessor = Accessor::open(asset, index, self.item)?;
        if !components.contains(&accessor.components) {
            let message = format!("has a `{name}` of {} numbers each", accessor.components);
            return Err(self.error(asset, message, "export the file again"));
        }
        if let Some(vertices) = vertices.filter(|&vertices| vertices != accessor.count) {
            let message = format!("has {} of `{name}` for {vertices} of `POSITION`", accessor.count);
            return Err(self.error(asset, message, "give one for each"));
        }
        Ok(Some(accessor))
    }

    /// The triangles, and what lies over them; `None` where there are none. `left` is how many more there may be.
    pub fn read(&self, asset: &Asset<'t>, plan: &UvPlan, left: usize) -> Result<Option<Geometry>, SceneError> {
        let Some(positions) = self.attribute(asset, "POSITION", 3..=3, None)? else {
            return Err(self.error(asset, "has no `POSITION`", "give its vertices"));
        };
        let triangles = self.corners(asset, &positions, left)?;
        if triangles.is_empty() {
            return Ok(None);
        }
        let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let place = |index: u32| used.binary_search(&index).expect("all are there") as u32;
        let triangles = triangles.iter().map(|corners| corners.map(place)).collect();
        let points = used.iter().map(|&index| DVec3::from(positions.get::<3>(index as usize))).collect();
        let count = Some(positions.count);
        let normals = match self.attribute(asset, "NORMAL", 3..=3, count)? {
            // What is no number stands for none.
            Some(list) => {
                let normal = |&i: &u32| DVec3::from(list.get::<3>(i as usize)).normalize_or_zero().as_vec3();
                used.iter().map(normal).collect()
            }
            None => Vec::new(),
        };
        let mut bad_uvs = 0;
        let uvs = match self.attribute(asset, &format!("TEXCOORD_{}", plan.set), 2..=2, count)? {
            Some(list) => {
                let mut read = |&i: &u32| {
                    let uv = plan.apply(list.get::<2>(i as usize));
                    let usable = uv.abs().max_element() <= MAX_COORDINATE;
                    bad_uvs += usize::from(!usable);
                    if usable { uv.as_vec2() } else { Vec2::ZERO }
                };
                used.iter().map(&mut read).collect()
            }
            None => Vec::new(),
        };
        let (colours, tint) = self.colours(asset, &used, positions.count)?;
        let mesh = MeshData { positions: points, triangles, normals, uvs, ..MeshData::default() };
        Ok(Some(Geometry { mesh, colours, tint, bad_uvs }))
    }

    /// The colours of the vertices that are used, and whether they are all one.
    fn colours(&self, asset: &Asset<'t>, used: &[u32], vertices: usize) -> Result<(Vec<[f64; 4]>, Tint), SceneError> {
        let white = Tint::Same([1.0f64.to_bits(); 4]);
        let Some(list) = self.attribute(asset, "COLOR_0", 3..=4, Some(vertices))? else {
            return Ok((Vec::new(), white));
        };
        let opaque = list.components == 3;
        let colour = |&index: &u32| {
            let [r, g, b, a] = list.get::<4>(index as usize);
            let channel = |x: f64| if x.is_nan() { 1.0 } else { x.clamp(0.0, 1.0) };
            [channel(r), channel(g), channel(b), if opaque { 1.0 } else { channel(a) }]
        };
        let colours: Vec<[f64; 4]> = used.iter().map(colour).collect();
        match colours.first() {
            Some(&first) if colours.iter().any(|colour| *colour != first) => Ok((colours, Tint::Varying)),
            Some(first) => Ok((Vec::new(), Tint::Same(first.map(f64::to_bits)))),
            None => Ok((Vec::new(), white)),
        }
    }

    /// The corners of the triangles that have an area.
    fn corners(
        &self,
        asset: &Asset<'t>,
        positions: &Accessor<'_, 't>,
        left: usize,
    ) -> Result<Vec<[u32; 3]>, SceneError> {
        let list = match self.primitive.indices {
            Some(index) => Some(Accessor::open(asset, index, self.item)?),
            None => None,
        };
        let count = list.as_ref().map_or(positions.count, |list| list.count);
        let faces = if self.primitive.mode == 4 { count / 3 } else { count.saturating_sub(2) };
        if faces > left {
            let message = format!("has {faces} triangles, with which there are more than {MOST_TRIANGLES} in all");
            return Err(self.error(asset, message, "simplify the meshes"));
        }
        asset.document.spend(self.item, faces.saturating_mul(12))?;
        if let Some(list) = list.as_ref().filter(|list| !list.is_whole()) {
            let message = "has indices that are no whole numbers of 0 or more";
            return Err(asset.document.error(&list.item, message, "give 5121, 5123 or 5125, SCALAR"));
        }
        let vertex = |place: usize| -> Result<u32, SceneError> {
            let Some(list) = &list else { return Ok(place as u32) };
            let [index] = list.get::<1>(place);
            let index = index as u32;
            if (index as usize) < positions.count {
                return Ok(index);
            }
            let mut message = format!("has the index {index} at {place}, of {} vertices", positions.count);
            if index == list.restart() {
                message += ", which would begin another strip";
            }
            Err(asset.document.error(&list.item, message, "count vertices from 0"))
        };
        let point = |index: u32| -> Result<DVec3, SceneError> {
            let p = DVec3::from(positions.get::<3>(index as usize));
            if p.abs().max_element() <= MAX_COORDINATE && p.is_finite() {
                return Ok(p);
            }
            let message = format!("has {p} as its element {index}, a vertex");
            let mend = format!("give finite numbers, at most {MAX_COORDINATE:e} in magnitude");
            Err(asset.document.error(&positions.item, message, mend))
        };
        // Nothing is kept in advance: a list without bytes may be as long as it likes.
        let mut corners = Vec::new();
        for face in 0..faces {
            let places = match self.primitive.mode {
                4 => [3 * face, 3 * face + 1, 3 * face + 2],
                // Every other triangle of a strip is wound the other way.
                5 => [face, face + 1 + face % 2, face + 2 - face % 2],
                _ => [face + 1, face + 2, 0],
            };
            let [a, b, c] = [vertex(places[0])?, vertex(places[1])?, vertex(places[2])?];
            let [p, q, r] = [point(a)?, point(b)?, point(c)?];
            if (q - p).cross(r - p).length_squared() > 0.0 {
                corners.push([a, b, c]);
            }
        }
        Ok(corners)
    }
}

/// The colours as a mesh has them, times those of a material.
pub fn tinted(colours: &[[f64; 4]], [r, g, b]: [f64; 3]) -> Vec<Spectrum> {
    let colour =
        |[x, y, z, _]: &[f64; 4]| Spectrum::from(Vec3::new((x * r) as f32, (y * g) as f32, (z * b) as f32).to_array());
    colours.iter().map(colour).collect()
}
