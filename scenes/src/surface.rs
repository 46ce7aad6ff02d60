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
    /// Its place among the meshes with vertex normals, texture coordinates or tangents.
    pub attributes: Option<u32>,
}

/// What a sphere has of its own.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SphereInfo {
    /// The surface it belongs to.
    pub surface: u32,
    /// The axis about which its tangents run, eastwards; unit.
    pub pole: Vec3,
}

/// Vertex normals and texture coordinates of a mesh, and the tangents of its triangles; each may be empty.
#[derive(Clone, Debug, Default)]
pub(crate) struct Attributes {
    /// The id of the mesh's first triangle.
    pub first: u32,
    /// Vertices of the triangles.
    pub triangles: Vec<[u32; 3]>,
    pub normals: Vec<Vec3>,
    pub uvs: Vec<Vec2>,
    /// The direction in which u grows, of each triangle; only for anisotropic materials.
    pub tangents: Vec<Vec3>,
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

    /// The direction in which u grows on a triangle; zero where nothing is known of it.
    #[inline]
    pub fn tangent(&self, id: u32) -> Vec3 {
        self.tangents.get((id - self.first) as usize).copied().unwrap_or(Vec3::ZERO)
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

/// The direction in which u grows on a triangle of these corners and texture coordinates; zero where it doesn't grow.
pub(crate) fn tangent([p0, p1, p2]: [Vec3; 3], [uv0, uv1, uv2]: [Vec2; 3]) -> Vec3 {
    let (d1, d2) = (uv1 - uv0, uv2 - uv0);
    let scale = d1.perp_dot(d2);
    if scale == 0.0 {
        return Vec3::ZERO;
    }
    (((p1 - p0) * d2.y - (p2 - p0) * d1.y) * scale.signum()).normalize_or_zero()
}
