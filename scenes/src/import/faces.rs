//! The faces of an OBJ file as meshes: read by `tobj` piece by piece, and put together again.

use glam::DVec3;
use rayon::prelude::*;
use sampling::{Vec2, Vec3, vec2};

use super::corners::{Corner, Extract, Run, extract, runs};
use super::polygon;
use super::smoothing::{Smoothing, smooth};
use super::source::{CHECKING, Piece, Source};
use crate::builder::MeshData;
use crate::error::SceneError;
use crate::progress::{self, Activity};

/// A vertex is looked for among so many of the same position, and stands in the mesh once more if it is not among them.
const ALIKE: usize = 64;
const NONE: u32 = u32::MAX;

/// What the faces of a file are.
pub(super) struct Faces<'a> {
    /// The runs and their meshes.
    pub meshes: Vec<(Run<'a>, MeshData)>,
    /// How many triangles had normals that pointed to their back.
    pub turned: usize,
}

/// Reads all faces; where `smooths`, what is in smoothing groups gets the normals that it lacks.
pub(super) fn read<'a>(source: &'a Source, smooths: bool) -> Result<Faces<'a>, SceneError> {
    let runs = runs(source);
    let smooths = smooths && source.smooths();
    let mut meshes = Vec::with_capacity(runs.len());
    let (mut turned, mut done) = (0, 0);
    let mut joint = Joint { last: vec![NONE; source.total.points[0]], smooths, ..Joint::default() };
    let pieces: Vec<&Piece> = source.pieces.iter().filter(|piece| piece.faces > 0).collect();
    for together in pieces.chunks(4 * rayon::current_num_threads()) {
        let found: Vec<_> = together.par_iter().map(|piece| read_piece(source, piece, &runs, smooths)).collect();
        for part in found.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter().flatten() {
            while meshes.len() < part.run {
                meshes.push(joint.finish());
            }
            turned += part.turned;
            joint.add(part)?;
        }
        done += together.iter().map(|piece| piece.faces).sum::<usize>();
        let share = done as f64 / source.total.faces as f64;
        progress::report(Activity::Reading, CHECKING + (1.0 - CHECKING) * share);
    }
    meshes.push(joint.finish());
    let (mut meshes, smoothing): (Vec<MeshData>, Vec<Smoothing>) = meshes.into_iter().unzip();
    if smooths {
        smooth(meshes.iter_mut().zip(smoothing));
    }
    Ok(Faces { meshes: runs.into_iter().zip(meshes).collect(), turned })
}

/// What a piece has of a run.
struct Part {
    run: usize,
    /// What is left of the mesh; corners without a normal have zero.
    mesh: MeshData,
    /// The number of each vertex's position in the file, counted from 0.
    places: Vec<u32>,
    /// The smoothing group of each triangle, if they matter.
    smoothing: Vec<u32>,
    turned: usize,
}

/// Lets `tobj` read the faces of a piece.
fn read_piece(source: &Source, piece: &Piece, runs: &[Run], smooths: bool) -> Result<Vec<Part>, SceneError> {
    let Extract { text, corners } = extract(source, piece, runs)?;
    let options = tobj::LoadOptions { single_index: true, ..Default::default() };
    let no_library = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, no_library)
        .map_err(|error| SceneError::invalid(error.to_string(), "mend the file, or save it again"))?;
    drop(text);
    let (mut rest, mut face) = (corners.as_slice(), piece.before.faces);
    let part = |model: tobj::Model| {
        let (own, after) = rest.split_at(model.mesh.indices.len());
        rest = after;
        let first = face;
        let smoothing = |within: usize| smooths.then(|| source.smoothing_of(first + within));
        let (part, faces) = Part::of(model.name.parse().expect("the name is a number"), &model.mesh, own, smoothing);
        face += faces;
        part
    };
    Ok(models.into_iter().map(part).collect())
}

impl Part {
    /// The triangles of a mesh of polygons, without those that have no area, and how many polygons there are; each is in the smoothing
    /// group that is given for its number, if they matter.
    fn of(run: usize, mesh: &tobj::Mesh, corners: &[Corner], group: impl Fn(usize) -> Option<u32>) -> (Self, usize) {
        let positions: Vec<DVec3> = mesh.positions.chunks_exact(3).map(|p| DVec3::new(p[0], p[1], p[2])).collect();
        let normals: Vec<DVec3> = mesh.normals.chunks_exact(3).map(|n| DVec3::new(n[0], n[1], n[2])).collect();
        let uvs: Vec<Vec2> = mesh.texcoords.chunks_exact(2).map(|t| vec2(t[0] as f32, t[1] as f32)).collect();
        let mut places = Vec::with_capacity(positions.len());
        for (&index, corner) in mesh.indices.iter().zip(corners) {
            // Vertices are numbered in the order in which corners have them first.
            if index as usize == places.len() {
                places.push(corner[0] - 1);
            }
        }
        let (mut triangles, mut smoothing, mut turned) = (Vec::with_capacity(mesh.indices.len() / 3), Vec::new(), 0);
        let mut add = |mut corners: [u32; 3], group: Option<u32>| {
            let [a, b, c] = corners.map(|i| positions[i as usize]);
            let ng = (b - a).cross(c - a);
            if ng.length_squared() > 0.0 {
                if corners.iter().filter_map(|&i| normals.get(i as usize)).sum::<DVec3>().dot(ng) < 0.0 {
                    corners.swap(1, 2);
                    turned += 1;
                }
                triangles.push(corners);
                smoothing.extend(group);
            }
        };
        let (mut rest, mut faces) = (mesh.indices.as_slice(), 0);
        // Where all are triangles there is no list of arities.
        while let Some((face, after)) = rest
            .split_at_checked(mesh.face_arities.get(faces).map_or(3, |&arity| arity as usize))
            .filter(|(face, _)| !face.is_empty())
        {
            rest = after;
            let group = group(faces);
            faces += 1;
            if let &[a, b, c] = face {
                add([a, b, c], group);
                continue;
            }
            let points: Vec<DVec3> = face.iter().map(|&i| positions[i as usize]).collect();
            polygon::triangulate(&points).for_each(|triangle| add(triangle.map(|i| face[i]), group));
        }
        let normals = normals.iter().map(|n| n.normalize_or_zero().as_vec3()).collect();
        let mesh = MeshData { positions, triangles, normals, uvs, ..MeshData::default() };
        (Part { run, mesh, places, smoothing, turned }, faces)
    }
}

/// The mesh of a run while it is put together. What corners have alike is one vertex.
#[derive(Default)]
struct Joint {
    mesh: MeshData,
    /// For each position of the file the vertex that has it and was met last. Vertices are counted through all runs.
    last: Vec<u32>,
    /// For each vertex of this run another one of the same position, met before.
    before: Vec<u32>,
    /// The first vertex of this run.
    first: u32,
    /// Whether smoothing groups matter, and those of this run.
    smooths: bool,
    smoothing: Smoothing,
}

impl Joint {
    fn add(&mut self, part: Part) -> Result<(), SceneError> {
        if self.first as usize + self.before.len() + part.places.len() >= NONE as usize {
            return Err(SceneError::invalid("there are more than 2³² vertices", "divide the file"));
        }
        let numbers: Vec<u32> = (0..part.places.len()).map(|vertex| self.number(&part, vertex)).collect();
        self.smoothing.groups.extend(&part.smoothing);
        self.mesh.triangles.extend(part.mesh.triangles.iter().map(|t| t.map(|vertex| numbers[vertex as usize])));
        Ok(())
    }

    /// The number of a vertex of a part in the mesh of the run.
    fn number(&mut self, part: &Part, vertex: usize) -> u32 {
        let (mesh, place) = (&mut self.mesh, part.places[vertex] as usize);
        let (uv, normal) = (part.mesh.uvs.get(vertex), part.mesh.normals.get(vertex));
        let mut known = self.last[place];
        for _ in 0..ALIKE {
            let Some(number) = known.checked_sub(self.first).filter(|_| known != NONE) else { break };
            if mesh.uvs.get(number as usize) == uv && mesh.normals.get(number as usize) == normal {
                return number;
            }
            known = self.before[number as usize];
        }
        let number = self.before.len() as u32;
        mesh.positions.push(part.mesh.positions[vertex]);
        mesh.uvs.extend(uv);
        mesh.normals.extend(normal);
        if self.smooths {
            self.smoothing.places.push(place as u32);
        }
        self.before.push(self.last[place]);
        self.last[place] = self.first + number;
        number
    }

    /// Ends the run, and begins another.
    fn finish(&mut self) -> (MeshData, Smoothing) {
        self.first += self.before.len() as u32;
        self.before.clear();
        let mut mesh = std::mem::take(&mut self.mesh);
        if mesh.normals.iter().all(|&normal| normal == Vec3::ZERO) {
            mesh.normals = Vec::new();
        } else {
            give_missing_normals(&mut mesh);
        }
        (mesh, std::mem::take(&mut self.smoothing))
    }
}

/// Gives corners without a normal that of their face, at a vertex of their own.
fn give_missing_normals(mesh: &mut MeshData) {
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.triangles[t].map(|i| mesh.positions[i as usize]);
        let ng = (b - a).cross(c - a).normalize_or_zero().as_vec3();
        for corner in 0..3 {
            let i = mesh.triangles[t][corner] as usize;
            if mesh.normals[i] == sampling::Vec3::ZERO {
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

#[cfg(test)]
mod tests {
    use super::super::source;
    use super::*;
    use std::fmt::Write as _;
    use std::path::Path;

    /// A corner with all that it has, as bits.
    type Full = ([u64; 3], [u32; 3], [u32; 2]);

    fn corners(mesh: &MeshData) -> Vec<Full> {
        let full = |&i: &u32| {
            let i = i as usize;
            let normal = mesh.normals.get(i).map_or([0; 3], |n| n.to_array().map(f32::to_bits));
            let uv = mesh.uvs.get(i).map_or([0; 2], |uv| uv.to_array().map(f32::to_bits));
            (mesh.positions[i].to_array().map(f64::to_bits), normal, uv)
        };
        mesh.triangles.iter().flatten().map(full).collect()
    }

    /// A grid of triangles in disorder, divided in groups by one statement between any two faces.
    fn grid(side: usize, smooth: bool, groups: &dyn Fn(usize) -> String) -> String {
        let mut text = String::new();
        for i in 0..(side + 1) * (side + 1) {
            let (x, y) = (i % (side + 1), i / (side + 1));
            _ = writeln!(text, "v {x} {y} {}", (0.37 * x as f64).sin());
            if smooth {
                _ = writeln!(text, "vn {} 0 1\nvt 0.{x} 0.{y}", -0.37 * (0.37 * x as f64).cos());
            }
        }
        let count = 2 * side * side;
        for face in 0..count {
            text += &groups(face);
            let index = face * 7919 % count;
            let a = index / 2 / side * (side + 1) + index / 2 % side + 1;
            let [b, c, d] = [a + 1, a + side + 2, a + side + 1];
            let corners = if index.is_multiple_of(2) { [a, b, c] } else { [a, c, d] };
            _ = match smooth {
                true => writeln!(text, "f{}", corners.map(|i| format!(" {i}/{i}/{i}")).concat()),
                false => writeln!(text, "f{}", corners.map(|i| format!(" {i}")).concat()),
            };
        }
        text
    }

    #[test]
    fn pieces_do_not_show() {
        let side = 120;
        let rare = |face: usize| if face % 9001 == 5 { format!("g part {face}\n") } else { String::new() };
        let often =
            |face: usize| if face.is_multiple_of(50) { format!("usemtl m{}\n", face / 50 % 3) } else { String::new() };
        for (smooth, groups) in [(false, &rare as &dyn Fn(usize) -> String), (true, &rare), (true, &often)] {
            let text = grid(side, smooth, groups);
            let source = source::check(Path::new("a.obj"), &text).unwrap();
            assert!(source.pieces.len() > 2);
            let Faces { meshes, turned } = read(&source, false).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(turned, 0);
            let options = tobj::LoadOptions { single_index: true, ..Default::default() };
            let libraries = |_: &Path| {
                let named = |i: usize| tobj::Material { name: format!("m{i}"), ..Default::default() };
                Ok(((0..3).map(named).collect(), (0..3).map(|i| (format!("m{i}"), i)).collect()))
            };
            let whole = format!("mtllib all\n{text}");
            let (models, _) = tobj::load_obj_buf(&mut whole.as_bytes(), &options, libraries).unwrap();
            assert_eq!(meshes.len(), models.len());
            for ((run, mesh), model) in meshes.iter().zip(&models) {
                assert_eq!(run.name, model.name);
                assert_eq!(run.material.map(str::to_owned), model.mesh.material_id.map(|i| format!("m{i}")));
                assert_eq!(mesh.positions.len(), model.mesh.positions.len() / 3);
                let expected = Part::of(0, &model.mesh, &[], |_| None).0.mesh;
                assert_eq!(corners(mesh), corners(&expected));
            }
        }
    }

    #[test]
    fn many_vertices_of_one_position_take_no_quadratic_time() {
        let count = 300_000;
        let mut text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned();
        (0..count).for_each(|i| text += &format!("vt {i} 0\n"));
        (1..=count).for_each(|i| text += &format!("f 1/{i} 2/{i} 3/{i}\n"));
        let source = source::check(Path::new("a.obj"), &text).unwrap();
        let Faces { meshes, .. } = read(&source, true).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((meshes[0].1.triangles.len(), meshes[0].1.positions.len()), (count, 3 * count));
    }
}
