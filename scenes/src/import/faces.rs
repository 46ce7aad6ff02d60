//! The faces of an OBJ file as meshes.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;
use sampling::{Vec2, Vec3};

use super::polygon;
use super::source::{Mark, Source};
use crate::builder::MeshData;

/// Faces of one group and material, which follow one another.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Run<'a> {
    /// The name of the group.
    pub name: String,
    pub material: Option<&'a str>,
    pub faces: Range<usize>,
    pub corners: Range<usize>,
}

/// The faces by group and material, as they are written.
pub(super) fn runs(source: &Source) -> Vec<Run<'_>> {
    let end = (source.arities.len(), None);
    let marks = source.marks.iter().map(|(face, mark)| (*face, Some(mark))).chain([end]);
    let (mut name, mut material) = ("", None);
    let (mut faces, mut corners) = (0, 0);
    let mut runs = Vec::new();
    for (face, mark) in marks {
        // To name the material again that there is already begins nothing.
        if face > faces && !matches!(mark, Some(Mark::Material(other)) if material == Some(other.as_str())) {
            let count: usize = source.arities[faces..face].iter().map(|&arity| arity as usize).sum();
            let name = if name.is_empty() { "unnamed_object" } else { name }.to_owned();
            runs.push(Run { name, material, faces: faces..face, corners: corners..corners + count });
            (faces, corners) = (face, corners + count);
        }
        match mark {
            Some(Mark::Group(group)) => name = group,
            Some(Mark::Material(other)) => material = Some(other.as_str()),
            None => {}
        }
    }
    runs
}

/// What stands for no vertex.
const NONE: u32 = u32::MAX;

/// Numbers the vertices of meshes: what a corner has, a position with a texture coordinate and a normal, is one vertex however many
/// corners have it.
pub(super) struct Numbering<'a> {
    source: &'a Source,
    /// The vertex with each position that was numbered last.
    last: Vec<u32>,
    vertices: Vec<Vertex>,
}

/// Where a vertex is in the file, counted from 1, and the vertex of the same position that was numbered before.
struct Vertex {
    position: u32,
    uv: u32,
    normal: u32,
    before: u32,
}

impl<'a> Numbering<'a> {
    pub fn new(source: &'a Source) -> Self {
        Numbering { source, last: vec![NONE; source.positions.len()], vertices: Vec::new() }
    }

    /// The triangles of some faces, without those that have no area; `turned` counts the ones whose normals pointed to their back.
    pub fn mesh(&mut self, arities: &[u32], corners: Range<usize>, turned: &mut usize) -> MeshData {
        let indices: Vec<u32> = corners.map(|corner| self.number(corner)).collect();
        let vertices = std::mem::take(&mut self.vertices);
        vertices.iter().for_each(|vertex| self.last[vertex.position as usize - 1] = NONE);
        let Source { positions, uvs, normals, .. } = self.source;
        let positions = vertices.iter().map(|vertex| positions[vertex.position as usize - 1]).collect();
        let uv = |vertex: &Vertex| vertex.uv.checked_sub(1).map_or(Vec2::ZERO, |index| uvs[index as usize]);
        let uvs = if uvs.is_empty() { Vec::new() } else { vertices.iter().map(uv).collect() };
        let normal = |vertex: &Vertex| vertex.normal.checked_sub(1).map_or(DVec3::ZERO, |i| normals[i as usize]);
        let mut mesh = MeshData { positions, uvs, ..MeshData::default() };
        let (triangles, count) = cut_into_triangles(arities, &indices, &mesh.positions, |i| match normals.is_empty() {
            true => DVec3::ZERO,
            false => normal(&vertices[i as usize]),
        });
        mesh.triangles = triangles;
        *turned += count;
        if vertices.iter().any(|vertex| normal(vertex).length_squared() > 0.0) {
            mesh.normals = vertices.iter().map(|vertex| normal(vertex).normalize_or_zero().as_vec3()).collect();
            give_missing_normals(&mut mesh);
        }
        mesh
    }

    /// The number of a corner's vertex.
    fn number(&mut self, corner: usize) -> u32 {
        let [position, uv, normal] = [0, 1, 2].map(|kind| self.source.corners[kind].get(corner).copied().unwrap_or(0));
        let last = &mut self.last[position as usize - 1];
        let mut known = *last;
        while let Some(vertex) = self.vertices.get(known as usize) {
            if (vertex.uv, vertex.normal) == (uv, normal) {
                return known;
            }
            known = vertex.before;
        }
        self.vertices.push(Vertex { position, uv, normal, before: *last });
        *last = self.vertices.len() as u32 - 1;
        *last
    }
}

/// Cuts polygons into triangles on the side of their normals, and counts those that had to be turned.
fn cut_into_triangles(
    arities: &[u32],
    indices: &[u32],
    positions: &[DVec3],
    normal: impl Fn(u32) -> DVec3 + Sync,
) -> (Vec<[u32; 3]>, usize) {
    const TOGETHER: usize = 1 << 14;
    let mut rest = indices;
    let mut pieces = Vec::with_capacity(arities.len().div_ceil(TOGETHER));
    for arities in arities.chunks(TOGETHER) {
        let (piece, after) = rest.split_at(arities.iter().map(|&arity| arity as usize).sum());
        pieces.push((arities, piece));
        rest = after;
    }
    let mut triangles = Vec::with_capacity(arities.len());
    let mut turned = 0;
    for together in pieces.chunks(4 * rayon::current_num_threads()) {
        let cut = together.par_iter().map(|(arities, indices)| {
            let (mut rest, mut triangles, mut turned) = (*indices, Vec::with_capacity(arities.len()), 0);
            for &arity in *arities {
                let (face, after) = rest.split_at(arity as usize);
                rest = after;
                let mut add = |mut corners: [u32; 3]| {
                    let [a, b, c] = corners.map(|i| positions[i as usize]);
                    let ng = (b - a).cross(c - a);
                    if ng.length_squared() > 0.0 {
                        if corners.iter().map(|&i| normal(i)).sum::<DVec3>().dot(ng) < 0.0 {
                            corners.swap(1, 2);
                            turned += 1;
                        }
                        triangles.push(corners);
                    }
                };
                if let &[a, b, c] = face {
                    add([a, b, c]);
                    continue;
                }
                let points: Vec<DVec3> = face.iter().map(|&i| positions[i as usize]).collect();
                polygon::triangulate(&points).for_each(|triangle| add(triangle.map(|i| face[i])));
            }
            (triangles, turned)
        });
        for (mut more, count) in cut.collect::<Vec<_>>() {
            triangles.append(&mut more);
            turned += count;
        }
    }
    (triangles, turned)
}

/// Gives corners without a normal that of their face, at a vertex of their own.
fn give_missing_normals(mesh: &mut MeshData) {
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.triangles[t].map(|i| mesh.positions[i as usize]);
        let ng = (b - a).cross(c - a).normalize_or_zero().as_vec3();
        for corner in 0..3 {
            let i = mesh.triangles[t][corner] as usize;
            if mesh.normals[i] == Vec3::ZERO {
                mesh.triangles[t][corner] = mesh.positions.len() as u32;
                mesh.positions.push(mesh.positions[i]);
                mesh.normals.push(ng);
                if let Some(&uv) = mesh.uvs.get(i) {
                    mesh.uvs.push(uv);
                }
            }
        }
    }
}
