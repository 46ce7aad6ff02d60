//! A mesh as a PLY file.

use crate::builder::MeshData;

/// How the files begin that are made here, by which they are known again.
pub const HEADER: &str = "ply\nformat binary_little_endian 1.0\ncomment A mesh made by neumann convert.\n";

/// The bytes of a file that is read as this mesh, but for what `f32` rounds of its positions.
pub fn write(mesh: &MeshData) -> Vec<u8> {
    let mut header = format!("{HEADER}element vertex {}\n", mesh.positions.len());
    let mut properties = vec!["x", "y", "z"];
    let parts: [(bool, &[&str]); 3] = [
        (mesh.normals.is_empty(), &["nx", "ny", "nz"]),
        (mesh.uvs.is_empty(), &["u", "v"]),
        (mesh.colours.is_empty(), &["red", "green", "blue"]),
    ];
    for (absent, names) in parts {
        properties.extend(if absent { &[] } else { names });
    }
    for name in &properties {
        header += &format!("property float {name}\n");
    }
    header += &format!("element face {}\nproperty list uchar uint vertex_indices\nend_header\n", mesh.triangles.len());
    let mut bytes = header.into_bytes();
    bytes.reserve(4 * properties.len() * mesh.positions.len() + 13 * mesh.triangles.len());
    let mut put = |numbers: &[f32]| numbers.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    for (i, p) in mesh.positions.iter().enumerate() {
        put(&p.as_vec3().to_array());
        if let Some(n) = mesh.normals.get(i) {
            put(&n.to_array());
        }
        if let Some(uv) = mesh.uvs.get(i) {
            put(&uv.to_array());
        }
        if let Some(colour) = mesh.colours.get(i) {
            put(&colour.to_array());
        }
    }
    for triangle in &mesh.triangles {
        bytes.push(3);
        triangle.iter().for_each(|corner| bytes.extend(corner.to_le_bytes()));
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use sampling::math::Spectrum;
    use sampling::{Vec3, vec2};

    #[test]
    fn what_is_written_is_read_as_the_same() {
        let plain = MeshData {
            positions: vec![DVec3::new(0.1f32.into(), 0.0, 3.0), DVec3::X, DVec3::Y, DVec3::ONE],
            triangles: vec![[0, 1, 2], [1, 3, 2]],
            ..MeshData::default()
        };
        let whole = MeshData {
            normals: vec![Vec3::Z; 4],
            uvs: vec![vec2(0.0, 0.25), vec2(1.0, -3.0), vec2(0.1, 0.2), vec2(7.0, 0.0)],
            colours: vec![Spectrum::new(0.1, 0.2, 1.0); 4],
            ..plain.clone()
        };
        for mesh in [plain, whole] {
            let bytes = write(&mesh);
            assert!(bytes.starts_with(HEADER.as_bytes()));
            let again = crate::import::ply::read(&bytes).unwrap().mesh;
            assert_eq!((again.positions, again.triangles), (mesh.positions, mesh.triangles));
            assert_eq!((again.normals, again.uvs, again.colours), (mesh.normals, mesh.uvs, mesh.colours));
        }
    }
}
