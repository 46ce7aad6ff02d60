//! Smooth normals for meshes that have none: what an OBJ file's smoothing groups ask for.

use std::collections::HashMap;

use glam::DVec3;

use crate::builder::MeshData;

/// What a mesh has of smoothing groups.
#[derive(Default)]
pub(super) struct Smoothing {
    /// For each vertex the number of its position in the file.
    pub places: Vec<u32>,
    /// For each triangle its smoothing group, 0 for none.
    pub groups: Vec<u32>,
}

/// The unit normal of a triangle, zero where it has no area, and the angles at its corners.
pub(super) fn normal_and_angles(p: [DVec3; 3]) -> (DVec3, [f64; 3]) {
    let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
    let angle = |i: usize| {
        let (a, b) = (p[(i + 1) % 3] - p[i], p[(i + 2) % 3] - p[i]);
        a.cross(b).length().atan2(a.dot(b))
    };
    (normal, [angle(0), angle(1), angle(2)])
}

/// Gives meshes without normals those of their smoothing groups: at every position the mean of the normals of the group's triangles, by
/// the angles that they have there [Thürmer & Wüthrich 1998]. A group is one through all meshes; what is in none stays flat.
pub(super) fn smooth<'m>(meshes: impl Iterator<Item = (&'m mut MeshData, Smoothing)>) {
    let mut meshes: Vec<_> = meshes.filter(|(mesh, _)| mesh.normals.is_empty()).collect();
    let mut sums: HashMap<(u32, u32), DVec3> = HashMap::new();
    for (mesh, smoothing) in &meshes {
        for (corners, &group) in mesh.triangles.iter().zip(&smoothing.groups).filter(|(_, group)| **group != 0) {
            let (normal, angles) = normal_and_angles(corners.map(|i| mesh.positions[i as usize]));
            for (&i, angle) in corners.iter().zip(angles) {
                *sums.entry((smoothing.places[i as usize], group)).or_default() += normal * angle;
            }
        }
    }
    for (mesh, smoothing) in &mut meshes {
        if smoothing.groups.iter().any(|&group| group != 0) {
            give_normals(mesh, smoothing, &sums);
        }
    }
}

/// Gives each corner its normal; a vertex of several smoothing groups, or of none, is one for each.
fn give_normals(mesh: &mut MeshData, smoothing: &Smoothing, sums: &HashMap<(u32, u32), DVec3>) {
    let MeshData { positions, triangles, normals, uvs, .. } = mesh;
    let mut owners: Vec<Option<u32>> = vec![None; positions.len()];
    let mut others: HashMap<(u32, u32), u32> = HashMap::new();
    normals.resize(positions.len(), sampling::Vec3::ZERO);
    for (t, (corners, &group)) in triangles.iter_mut().zip(&smoothing.groups).enumerate() {
        let (flat, _) = normal_and_angles(corners.map(|i| positions[i as usize]));
        for corner in corners {
            let i = *corner;
            let smoothed = sums.get(&(smoothing.places[i as usize], group)).and_then(|sum| sum.try_normalize());
            // A flat corner belongs to its triangle alone.
            let owner = if group == 0 { u32::MAX - t as u32 } else { group };
            if *owners[i as usize].get_or_insert(owner) != owner {
                *corner = *others.entry((i, owner)).or_insert_with(|| {
                    positions.push(positions[i as usize]);
                    normals.push(sampling::Vec3::ZERO);
                    if !uvs.is_empty() {
                        uvs.push(uvs[i as usize]);
                    }
                    positions.len() as u32 - 1
                });
            }
            normals[*corner as usize] = smoothed.unwrap_or(flat).as_vec3();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::obj::Model;
    use glam::DVec3;
    use std::path::Path;

    /// The normals at the corners of all triangles.
    fn normals(text: &str) -> Vec<DVec3> {
        let model = Model::read(Path::new("a.obj"), text.as_bytes()).unwrap();
        let of = |mesh: &crate::builder::MeshData| {
            let normal = |&i: &u32| mesh.normals.get(i as usize).map_or(DVec3::ZERO, |n| n.as_dvec3());
            mesh.triangles.iter().flatten().map(normal).collect::<Vec<_>>()
        };
        model.groups.iter().flat_map(|group| of(&group.mesh)).collect()
    }

    /// A roof of two squares about the edge from 1 to 2.
    const ROOF: &str = "v 0 0 0\nv 1 0 0\nv 0 -1 1\nv 1 -1 1\nv 0 -1 -1\nv 1 -1 -1\nvt 0 0\nvt 1 1\n";

    fn near(found: DVec3, known: DVec3) -> bool {
        (found - known.normalize()).length() < 1e-6
    }

    #[test]
    fn groups_are_smooth_within_and_have_creases_between() {
        let (front, back, up) = (DVec3::new(0.0, 1.0, 1.0), DVec3::new(0.0, 1.0, -1.0), DVec3::Y);
        let roof = |first: &str, between: &str| normals(&format!("{ROOF}{first}\nf 1 3 4 2\n{between}\nf 1 2 6 5\n"));
        // Corners 1, 3, 4, 2 of the front, cut in two triangles, and then 1, 2, 6, 5.
        let smooth = roof("s 1", "");
        assert!(near(smooth[0], up) && near(smooth[1], front), "{smooth:?}");
        assert!(smooth.iter().filter(|n| near(**n, up)).count() >= 4 && smooth.iter().any(|n| near(*n, back)));
        // Whatever the material, the texture coordinates or the group's name are; and in words.
        for between in ["usemtl other", "g other"] {
            let found = roof("s 1", between);
            assert_eq!(found.iter().filter(|n| near(**n, up)).count(), smooth.iter().filter(|n| near(**n, up)).count());
        }
        let parted = normals(&format!("{ROOF}s on\nf 1/1 3 4 2\nf 1/2 2 6 5\n"));
        assert!(near(parted[0], up), "{parted:?}");
        for crease in [roof("s 1", "s 2"), roof("s off", "s 0")] {
            assert!(crease.iter().all(|n| near(*n, front) || near(*n, back) || *n == DVec3::ZERO), "{crease:?}");
        }
        let half = roof("s 1", "s off");
        assert!(half.iter().all(|n| near(*n, front) || near(*n, back)), "{half:?}");
        // Normals that the file has stay.
        let given = normals(&format!("{ROOF}vn 1 0 0\ns 1\nf 1//1 3//1 4//1 2//1\nf 1//1 2//1 6//1 5//1\n"));
        assert!(given.iter().all(|n| *n == DVec3::X), "{given:?}");
        assert!(normals(&format!("{ROOF}f 1 3 4 2\nf 1 2 6 5\n")).iter().all(|n| *n == DVec3::ZERO));
    }
}
