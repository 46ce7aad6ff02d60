//! Meshes that have no file as they are needed: tessellated, decoded, or with other normals than in their file.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use glam::{DMat3, DMat4, DVec3};
use sampling::{Vec2, Vec3};

use crate::builder::MeshData;
use crate::import::smoothing::normal_and_angles;

/// The first line of files that are made here, by which they are known again.
pub const HEADER: &str = "# A mesh made by neumann convert.";
/// Around a sphere or a tube.
const SEGMENTS: usize = 96;

/// The corners of a cube from −1 to 1, six faces, as keys of a scene file: vertices, faces, texture coordinates.
pub fn cube() -> [(&'static str, String); 3] {
    // Of every face the normal, and the directions in which u and v grow as Mitsuba has them.
    let faces = [
        (DVec3::NEG_Y, DVec3::Z, DVec3::X),
        (DVec3::Y, DVec3::NEG_X, DVec3::NEG_Z),
        (DVec3::X, DVec3::Y, DVec3::NEG_Z),
        (DVec3::Z, DVec3::Y, DVec3::X),
        (DVec3::NEG_X, DVec3::Y, DVec3::Z),
        (DVec3::NEG_Z, DVec3::NEG_Y, DVec3::X),
    ];
    let (mut vertices, mut indices, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
    for (i, (n, u, v)) in faces.into_iter().enumerate() {
        let corners = [(0, 0), (1, 0), (1, 1), (0, 1)];
        for (s, t) in corners {
            let p = n + u * f64::from(2 * s - 1) + v * f64::from(2 * t - 1);
            vertices.push(format!("[{}, {}, {}]", p.x as i32, p.y as i32, p.z as i32));
            uvs.push(format!("[{s}, {t}]"));
        }
        // Counter-clockwise from outside.
        let order = if u.cross(v).dot(n) > 0.0 { [0, 1, 2, 3] } else { [0, 3, 2, 1] };
        indices.push(format!("{:?}", order.map(|k| 4 * i + k)));
    }
    let list = |items: Vec<String>| format!("[{}]", items.join(", "));
    [("vertices", list(vertices)), ("faces", list(indices)), ("uvs", list(uvs))]
}

/// A sphere in triangles, with its own normals and Mitsuba's texture coordinates: longitude, and the angle from +z.
pub fn sphere(center: DVec3, radius: f64) -> MeshData {
    let rings = SEGMENTS / 2;
    grid(rings, |s, t| {
        let (phi, theta) = (s * TAU, t * TAU / 2.0);
        let n = DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        (center + n * radius, n)
    })
}

/// An open tube in triangles.
pub fn tube(from: DVec3, to: DVec3, radius: f64) -> MeshData {
    let axis = (to - from).normalize_or(DVec3::Z);
    let x = axis.any_orthonormal_vector();
    let y = axis.cross(x);
    grid(1, |s, t| {
        let n = x * (s * TAU).cos() + y * (s * TAU).sin();
        (from.lerp(to, t) + n * radius, n)
    })
}

fn grid(rings: usize, at: impl Fn(f64, f64) -> (DVec3, DVec3)) -> MeshData {
    let mut mesh = MeshData::default();
    for j in 0..=rings {
        for i in 0..=SEGMENTS {
            let (s, t) = (i as f64 / SEGMENTS as f64, j as f64 / rings as f64);
            let (p, n) = at(s, t);
            mesh.positions.push(p);
            mesh.normals.push(n.as_vec3());
            mesh.uvs.push(Vec2::new(s as f32, t as f32));
        }
    }
    let width = SEGMENTS as u32 + 1;
    for j in 0..rings as u32 {
        for i in 0..SEGMENTS as u32 {
            let [a, b, c, d] = [j * width + i, j * width + i + 1, (j + 1) * width + i + 1, (j + 1) * width + i];
            for corners in [[a, b, c], [a, c, d]] {
                let [p, q, r] = corners.map(|k| mesh.positions[k as usize]);
                let normal = (q - p).cross(r - p);
                // At the poles of a sphere a triangle has no area but for rounding.
                let longest = (q - p).length_squared().max((r - p).length_squared());
                if normal.length() > 1e-9 * longest {
                    let outwards = normal.dot(corners.map(|k| mesh.normals[k as usize].as_dvec3()).iter().sum()) > 0.0;
                    mesh.triangles.push(if outwards { corners } else { [corners[0], corners[2], corners[1]] });
                }
            }
        }
    }
    mesh
}

/// Normals of the vertices, each the mean of those of its triangles by the angles that they have there, in the frame that `map`
/// leads to, as Mitsuba computes them for meshes without normals; `None` where the surface is as flat without them.
pub fn smooth_normals(mesh: &MeshData, map: &DMat4) -> Option<Vec<Vec3>> {
    let axes = DMat3::from_mat4(*map);
    let side = axes.determinant().signum();
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    let mut bent = false;
    let faces: Vec<(DVec3, [f64; 3])> = mesh
        .triangles
        .iter()
        .map(|corners| normal_and_angles(corners.map(|i| map.transform_point3(mesh.positions[i as usize]))))
        .collect();
    for (corners, (normal, angles)) in mesh.triangles.iter().zip(&faces) {
        for (&i, angle) in corners.iter().zip(angles) {
            sums[i as usize] += *normal * *angle;
        }
    }
    for (corners, (normal, _)) in mesh.triangles.iter().zip(&faces) {
        bent |= corners
            .iter()
            .any(|&i| sums[i as usize].normalize_or_zero().dot(*normal) < 1.0 - 1e-9 && *normal != DVec3::ZERO);
    }
    let back = axes.transpose() * side;
    bent.then(|| sums.iter().map(|n| (back * *n).normalize_or_zero().as_vec3()).collect())
}

/// Several meshes in one.
pub fn joined(meshes: Vec<MeshData>) -> MeshData {
    let mut whole = MeshData::default();
    let (normals, uvs) = (meshes.iter().any(|m| !m.normals.is_empty()), meshes.iter().any(|m| !m.uvs.is_empty()));
    for mut mesh in meshes {
        let first = whole.positions.len() as u32;
        let vertices = mesh.positions.len();
        whole.positions.append(&mut mesh.positions);
        whole.triangles.extend(mesh.triangles.iter().map(|corners| corners.map(|i| i + first)));
        if normals {
            mesh.normals.resize(vertices, Vec3::ZERO);
            whole.normals.append(&mut mesh.normals);
        }
        if uvs {
            mesh.uvs.resize(vertices, Vec2::ZERO);
            whole.uvs.append(&mut mesh.uvs);
        }
    }
    whole
}

/// The mesh as an OBJ file, whose numbers are read as the same.
pub fn obj(mesh: &MeshData) -> String {
    let mut text = format!("{HEADER}\n");
    for p in &mesh.positions {
        _ = writeln!(text, "v {:?} {:?} {:?}", p.x, p.y, p.z);
    }
    for uv in &mesh.uvs {
        _ = writeln!(text, "vt {:?} {:?}", uv.x, uv.y);
    }
    for n in &mesh.normals {
        _ = writeln!(text, "vn {:?} {:?} {:?}", n.x, n.y, n.z);
    }
    for corners in &mesh.triangles {
        text.push('f');
        for i in corners.map(|i| i + 1) {
            _ = match (mesh.uvs.is_empty(), mesh.normals.is_empty()) {
                (true, true) => write!(text, " {i}"),
                (false, true) => write!(text, " {i}/{i}"),
                (true, false) => write!(text, " {i}//{i}"),
                (false, false) => write!(text, " {i}/{i}/{i}"),
            };
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::obj::Model;
    use std::path::Path;

    #[test]
    fn spheres_and_tubes_look_outwards_and_are_read_as_written() {
        let ball = sphere(DVec3::new(1.0, 2.0, 3.0), 0.5);
        let area = |mesh: &MeshData| -> f64 {
            mesh.triangles
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
                    0.5 * (b - a).cross(c - a).length()
                })
                .sum()
        };
        assert!((area(&ball) / std::f64::consts::PI - 1.0).abs() < 2e-3);
        let pipe = tube(DVec3::ZERO, DVec3::new(0.0, 0.0, 2.0), 0.5);
        assert!((area(&pipe) / TAU - 1.0).abs() < 2e-3);
        for mesh in [ball, pipe] {
            let model = Model::read(Path::new("a.obj"), obj(&mesh).as_bytes()).unwrap();
            assert!(model.notes.all().is_empty(), "{:?}", model.notes);
            let again = &model.groups[0].mesh;
            assert_eq!(again.triangles.len(), mesh.triangles.len());
            for (a, b) in again.triangles.iter().zip(&mesh.triangles) {
                for (&i, &j) in a.iter().zip(b) {
                    assert_eq!(again.positions[i as usize], mesh.positions[j as usize]);
                    assert_eq!(again.uvs[i as usize], mesh.uvs[j as usize]);
                    assert!(again.normals[i as usize].distance(mesh.normals[j as usize]) < 1e-6);
                }
            }
        }
    }

    #[test]
    fn normals_are_smoothed_where_that_changes_anything() {
        let mut roof = MeshData {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0)],
            triangles: vec![[0, 1, 2], [1, 3, 2]],
            ..MeshData::default()
        };
        assert!(smooth_normals(&roof, &DMat4::IDENTITY).is_none());
        roof.positions[3].z = 1.0;
        let normals = smooth_normals(&roof, &DMat4::IDENTITY).unwrap();
        assert!(normals[0].distance(Vec3::Z) < 1e-6 && normals[1].z < 0.99);
        // Seen through a mirror, the normals stay on the side of the corners' turn.
        let mirrored = smooth_normals(&roof, &DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0))).unwrap();
        assert!(mirrored.iter().zip(&normals).all(|(a, b)| a.distance(*b) < 1e-6));
    }
}
