//! Triangle meshes: from what was given to what is traced.

use super::Triangle;
use crate::error::SceneError;
use glam::{DAffine3, DMat3, DVec3};
use rayon::prelude::*;
use sampling::math::Spectrum;
use sampling::{Vec2, Vec3, fault};

/// A triangle mesh as it is given.
#[derive(Clone, Debug, Default)]
pub struct MeshData {
    /// Vertex positions \[m\].
    pub positions: Vec<DVec3>,
    /// Vertices of the triangles, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Vertex normals, or empty: then the surface is flat between its edges.
    pub normals: Vec<Vec3>,
    /// Texture coordinates of the vertices, or empty.
    pub uvs: Vec<Vec2>,
    /// Colours of the vertices, or empty.
    pub colours: Vec<Spectrum>,
}

/// A mesh in the scene's coordinates, without its triangles of no area.
#[derive(Debug, Default)]
pub(crate) struct BakedMesh {
    /// Vertex positions \[m\].
    pub positions: Vec<Vec3>,
    /// Vertices of the triangles, with their front's normal to the right hand.
    pub triangles: Vec<[u32; 3]>,
    /// Unit front normals of the triangles.
    pub fronts: Vec<Vec3>,
    /// Vertex normals, or empty.
    pub normals: Vec<Vec3>,
    /// Texture coordinates of the vertices, or empty.
    pub uvs: Vec<Vec2>,
    /// Colours of the vertices, or empty.
    pub colours: Vec<Spectrum>,
    /// How many triangles without area were left out.
    pub degenerate: usize,
}

impl BakedMesh {
    /// The vertices of a triangle.
    pub fn triangle(&self, index: usize) -> Triangle {
        Triangle(self.triangles[index].map(|vertex| self.positions[vertex as usize]))
    }
}

impl MeshData {
    /// The same with these texture coordinates at the corners of every triangle, if it has none: then no triangles share vertices.
    #[must_use]
    pub(crate) fn with_corner_uvs(self, corners: [Vec2; 3]) -> Self {
        if !self.uvs.is_empty() {
            return self;
        }
        fn taken<T: Copy>(from: &[T], triangles: &[[u32; 3]]) -> Vec<T> {
            if from.is_empty() {
                return Vec::new();
            }
            triangles.iter().flatten().map(|&vertex| from[vertex as usize]).collect()
        }
        let count = self.triangles.len();
        Self {
            positions: taken(&self.positions, &self.triangles),
            normals: taken(&self.normals, &self.triangles),
            colours: taken(&self.colours, &self.triangles),
            uvs: corners.repeat(count),
            triangles: (0..count as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        }
    }

    /// Says what is wrong with the numbers, if anything is.
    pub(crate) fn check(&self) -> Result<(), SceneError> {
        let vertices = self.positions.len();
        if let Some(vertex) = self.positions.iter().position(|p| !p.is_finite()) {
            return Err(SceneError::invalid(
                format!("vertex {vertex} of a mesh has a coordinate that is not finite"),
                "give finite coordinates",
            ));
        }
        if let Some((index, triangle)) =
            self.triangles.iter().enumerate().find(|(_, t)| t.iter().any(|&vertex| vertex as usize >= vertices))
        {
            return Err(SceneError::invalid(
                format!("triangle {index} of a mesh uses the vertices {triangle:?}, but the mesh has {vertices}"),
                "use vertices from 0 to their number less one",
            ));
        }
        let lists =
            [("normals", self.normals.len()), ("texture coordinates", self.uvs.len()), ("colours", self.colours.len())];
        for (what, count) in lists {
            if count != 0 && count != vertices {
                return Err(SceneError::invalid(
                    format!("a mesh has {vertices} vertices and {count} {what}"),
                    format!("give one of the {what} for every vertex, or none"),
                ));
            }
        }
        if self.uvs.iter().any(|uv| !uv.is_finite()) || self.colours.iter().any(|colour| !colour.is_finite()) {
            return Err(SceneError::invalid(
                "a mesh has a texture coordinate or a colour that is not finite",
                "give finite numbers",
            ));
        }
        Ok(())
    }
}

/// Takes a mesh into the scene: transforms and recentres it in `f64`, rounds it, and turns its front where it belongs.
///
/// The front is the image of the front: a mirroring transform turns the winding over, which is put back here.
pub(crate) fn bake_mesh(mut mesh: MeshData, transform: &DAffine3, flipped: bool, shift: DVec3) -> BakedMesh {
    let given = std::mem::take(&mut mesh.positions);
    let positions: Vec<Vec3> = given.par_iter().map(|&p| (transform.transform_point3(p) - shift).as_vec3()).collect();
    drop(given);
    let mirrored = transform.matrix3.determinant() < 0.0;
    let turned = flipped != fault!("mirrored_meshes_inside_out", mirrored, false);
    let MeshData { mut triangles, normals, uvs, colours, .. } = mesh;
    if turned {
        triangles.par_iter_mut().for_each(|t| t.swap(1, 2));
    }
    // The normal of a triangle without area stands as zero until all are there. One with a vertex beyond `f32` has no normal either, but
    // is kept, for the check of the scene's extent to find.
    let front_of = |t: &[u32; 3]| {
        let triangle = Triangle(t.map(|vertex| positions[vertex as usize]));
        let beyond = || triangle.0.iter().any(|vertex| !vertex.is_finite());
        triangle.normal().unwrap_or_else(|| if beyond() { Vec3::X } else { Vec3::ZERO })
    };
    let mut fronts: Vec<Vec3> = triangles.par_iter().map(front_of).collect();
    let all = triangles.len();
    if fronts.par_iter().any(|front| *front == Vec3::ZERO) {
        let mut kept = fronts.iter().map(|front| *front != Vec3::ZERO);
        triangles.retain(|_| kept.next().unwrap_or(false));
        fronts.retain(|front| *front != Vec3::ZERO);
    }
    let normals = transform_normals(normals, &transform.matrix3);
    BakedMesh { degenerate: all - triangles.len(), positions, triangles, fronts, normals, uvs, colours }
}

/// Normals are covectors: they go with the inverse transpose, whose sign keeps them on the image of their side.
fn transform_normals(mut normals: Vec<Vec3>, matrix: &DMat3) -> Vec<Vec3> {
    if normals.is_empty() {
        return normals;
    }
    let cofactors = matrix.inverse().transpose();
    normals.par_iter_mut().for_each(|n| *n = (cofactors * n.as_dvec3()).normalize_or_zero().as_vec3());
    normals
}
