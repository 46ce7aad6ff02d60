//! Meshes: lists of triangles, patches between four points, control meshes, and files.

use std::io::Read as _;

use glam::DVec3;
use sampling::Vec2;

use super::context::Context;
use super::parameters::Parameters;
use super::shape::Geometry;
use crate::builder::MeshData;
use crate::error::SceneError;
use crate::import::mitsuba::mesh;
use crate::import::ply;
use crate::import::translation::NoteKind;

/// How many pieces a side of a curved patch is cut into.
const PIECES: usize = 8;
/// How many triangles curved patches may be cut into, all of one mesh together.
const MOST_PIECES: usize = 10_000_000;

/// `trianglemesh`, `bilinearmesh` or `loopsubdiv`.
pub fn read(parameters: &Parameters, context: &mut Context) -> Result<MeshData, SceneError> {
    let place = &parameters.place;
    let Some(positions) = parameters.points("P")? else {
        return Err(place.error(format!("{} has no `P`", parameters.title()), "give its vertices"));
    };
    let count = positions.len();
    let normals = parameters.points("N")?.unwrap_or_default();
    if !normals.is_empty() && normals.len() != count {
        let message = format!("there are {} normals for {count} vertices", normals.len());
        return Err(parameters.place_of("N").error(message, "give one for each"));
    }
    let uvs = match parameters.any(&["uv", "st"]) {
        Some(parameter) => parameters.numbers(&parameter.name)?.unwrap_or_default(),
        None => &[],
    };
    if !uvs.is_empty() && uvs.len() != 2 * count {
        let message = format!("there are {} numbers of texture coordinates for {count} vertices", uvs.len());
        return Err(place.error(message, "give two for each"));
    }
    let uvs: Vec<Vec2> = uvs.chunks_exact(2).map(|uv| Vec2::new(uv[0] as f32, uv[1] as f32)).collect();
    let is_patch = parameters.kind == "bilinearmesh";
    let corners = if is_patch { 4 } else { 3 };
    let indices: Vec<u32> = match parameters.numbers("indices")? {
        Some(list) => {
            if list.len() % corners != 0 {
                let message = format!("there are {} indices", list.len());
                return Err(parameters.place_of("indices").error(message, format!("give {corners} for each face")));
            }
            let index = |&x: &f64| {
                let valid = x >= 0.0 && x.fract() == 0.0 && x < count as f64;
                valid.then_some(x as u32).ok_or_else(|| {
                    let message = format!("the index {x} is of none of {count} vertices");
                    parameters.place_of("indices").error(message, "count from 0")
                })
            };
            list.iter().map(index).collect::<Result<_, _>>()?
        }
        None if count == corners => (0..corners as u32).collect(),
        None => return Err(place.error(format!("{} has no `indices`", parameters.title()), "give them")),
    };
    if parameters.kind == "loopsubdiv" {
        context.approximate(place, "a `loopsubdiv` is left as its control mesh");
        parameters.skip(&["levels", "nlevels", "scheme"]);
    }
    parameters.skip(&["S", "faceIndices", "emissionfilename"]);
    let normals = normals.iter().map(|n| n.normalize_or_zero().as_vec3()).collect();
    let mut mesh = MeshData { positions, normals, uvs, ..MeshData::default() };
    if !is_patch {
        mesh.triangles = indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        return Ok(mesh);
    }
    let patches: Vec<[u32; 4]> = indices.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]).collect();
    patches_of(mesh, &patches, parameters, context)
}

/// Patches of four points each, (0, 0), (1, 0), (0, 1), (1, 1), in triangles.
fn patches_of(
    mesh: MeshData,
    patches: &[[u32; 4]],
    parameters: &Parameters,
    context: &mut Context,
) -> Result<MeshData, SceneError> {
    let mut out = MeshData::default();
    let curved = |patch: &[u32; 4]| {
        let [a, b, c, d] = patch.map(|i| mesh.positions[i as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        (d - a).dot(normal).abs() > 1e-6 * ((b - a).length() + (c - a).length() + (d - a).length())
    };
    // Two triangles have no other coordinates and normals than those that are linear over the patch.
    let linear = |patch: &[u32; 4]| {
        let uv = |k: usize| mesh.uvs.get(patch[k] as usize).copied();
        let n = |k: usize| mesh.normals.get(patch[k] as usize).copied();
        let flat = match [0, 1, 2, 3].map(uv) {
            [Some(a), Some(b), Some(c), Some(d)] => (a + d - b - c).length() < 1e-5,
            _ => true,
        };
        flat && [1, 2, 3].iter().all(|&k| n(k) == n(0))
    };
    let bent = patches.iter().filter(|patch| curved(patch) || !linear(patch)).count();
    if patches.iter().any(curved) {
        context.approximate(&parameters.place, format!("a curved patch becomes {PIECES} by {PIECES} flat ones"));
    } else if bent > 0 {
        let text = format!("a patch whose texture coordinates or normals bend becomes {PIECES} by {PIECES} pieces");
        context.approximate(&parameters.place, text);
    }
    if bent * 2 * PIECES * PIECES > MOST_PIECES {
        return Err(parameters.place.error(format!("there are {bent} curved patches"), "use a mesh of triangles"));
    }
    for patch in patches {
        let n = if curved(patch) || !linear(patch) { PIECES } else { 1 };
        let first = out.positions.len() as u32;
        let weights = |i: usize, j: usize| {
            let (s, t) = (i as f64 / n as f64, j as f64 / n as f64);
            [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t]
        };
        for (j, i) in (0..=n).flat_map(|j| (0..=n).map(move |i| (j, i))) {
            let weights = weights(i, j);
            let blend = |at: &dyn Fn(usize) -> DVec3| (0..4).map(|k| at(patch[k] as usize) * weights[k]).sum::<DVec3>();
            out.positions.push(blend(&|k| mesh.positions[k]));
            if !mesh.normals.is_empty() {
                out.normals.push(blend(&|k| mesh.normals[k].as_dvec3()).normalize_or_zero().as_vec3());
            }
            let corner = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE];
            let uv = |k: usize| if mesh.uvs.is_empty() { corner[k] } else { mesh.uvs[patch[k] as usize] };
            out.uvs.push((0..4).map(|k| uv(k) * weights[k] as f32).sum());
        }
        let at = |i: usize, j: usize| first + (j * (n + 1) + i) as u32;
        for (j, i) in (0..n).flat_map(|j| (0..n).map(move |i| (j, i))) {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            out.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    Ok(out)
}

/// A PLY file, named as it is; a packed one is unpacked.
pub fn ply(parameters: &Parameters, keep: bool, context: &mut Context) -> Result<Geometry, SceneError> {
    let Some(name) = parameters.text("filename")? else {
        return Err(parameters.place.error("a `plymesh` has no `filename`", "name a file"));
    };
    let place = parameters.place_of("filename");
    if parameters.any(&["displacement"]).is_some() {
        context.approximate(place, "the `displacement` of a `plymesh` is left out");
        parameters.skip(&["displacement.edgelength"]);
    }
    let Some(path) = context.find(name, place) else {
        // It is told of with the others that are missing.
        return Ok(Geometry::Mesh { file: name.to_string(), has_normals: false, has_uvs: true, triangles: None });
    };
    let unreadable = |error| SceneError::unreadable(&path, error, "name a file that can be read");
    if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("gz")) {
        let bytes = crate::file::read_unpacked(&path).map_err(unreadable)?;
        let data = ply::read(&bytes).map_err(|error| error.in_file(&path))?.mesh;
        context.note(NoteKind::Mapped, place, "a packed PLY becomes an OBJ");
        let (has_normals, has_uvs) = (!data.normals.is_empty(), !data.uvs.is_empty());
        let file = context.meshes.keep(mesh::obj(&data));
        return Ok(Geometry::Mesh { file, has_normals, has_uvs, triangles: keep.then_some(data) });
    }
    let triangles = if keep { Some(ply::open(&path)?.mesh) } else { None };
    let mut start = Vec::new();
    crate::file::open(&path).map_err(unreadable)?.take(65_536).read_to_end(&mut start).map_err(unreadable)?;
    let [has_normals, has_uvs] = ply::properties(&start);
    Ok(Geometry::Mesh { file: context.named_from_base(&path), has_normals, has_uvs, triangles })
}
