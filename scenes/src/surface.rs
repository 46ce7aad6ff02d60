//! What is known of surfaces beyond where they are: looked up once a ray has met one.

use crate::emitter::EmitterId;
use crate::material::MaterialId;
use sampling::{Vec2, Vec3};

/// What a triangle has of its own.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleInfo {
    /// Unit normal of its front.
    pub ng: Vec3,
    /// What rounding in `f64` may leave of the error of a point on it \[m\].
    pub residual: f32,
    /// The surface it belongs to.
    pub surface: u32,
}

/// What all of a shape has in common.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    pub material: MaterialId,
    pub emitter: Option<EmitterId>,
    /// Its place among the meshes with vertex normals or texture coordinates.
    pub attributes: Option<u32>,
}

/// Vertex normals and texture coordinates of a mesh; each may be empty.
#[derive(Clone, Debug)]
pub(crate) struct Attributes {
    /// The id of the mesh's first triangle.
    pub first: u32,
    /// Vertices of the triangles.
    pub triangles: Vec<[u32; 3]>,
    pub normals: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
}

impl Attributes {
    /// The interpolated normal of a triangle at barycentric coordinates `b`, on the side of `ng`; `ng` where it vanishes.
    #[inline]
    pub fn normal(&self, id: u32, b: Vec2, ng: Vec3) -> Vec3 {
        if self.normals.is_empty() {
            return ng;
        }
        let [n0, n1, n2] = self.triangles[(id - self.first) as usize].map(|vertex| self.normals[vertex as usize]);
        let normal = n0 * (1.0 - b.x - b.y) + n1 * b.x + n2 * b.y;
        match normal.try_normalize() {
            Some(ns) if ns.dot(ng) >= 0.0 => ns,
            Some(ns) => -ns,
            None => ng,
        }
    }

    /// The texture coordinates of a triangle at barycentric coordinates `b`; these themselves if the mesh has none.
    #[inline]
    pub fn uv(&self, id: u32, b: Vec2) -> Vec2 {
        if self.uvs.is_empty() {
            return b;
        }
        let [uv0, uv1, uv2] = self.triangles[(id - self.first) as usize].map(|vertex| self.uvs[vertex as usize]);
        uv0 * (1.0 - b.x - b.y) + uv1 * b.x + uv2 * b.y
    }
}
