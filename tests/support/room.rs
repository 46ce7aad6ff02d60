//! A room for tests that bring their own lamps.

use super::{camera, lambert};
use glam::{DVec3, dvec3};
use scenes::{MaterialId, MeshData, SceneBuilder};

/// A white room of ±1, open in front, as its camera sees it: 16 × 16 pixels.
pub fn room(name: &str) -> SceneBuilder {
    let mut builder = SceneBuilder::new(name);
    let [white, dark] = [0.7, 0.3].map(|albedo| builder.material(lambert(albedo)));
    let (x, y, z) = (DVec3::X * 2.0, DVec3::Y * 2.0, DVec3::Z * 2.0);
    let (low, high) = (dvec3(-1.0, -1.0, -1.0), dvec3(1.0, 1.0, 1.0));
    builder.quad(low, z, x, white);
    builder.quad(high, -x, -z, white);
    builder.quad(low, x, y, white);
    builder.quad(low, y, z, dark);
    builder.quad(high, -z, -y, white);
    builder.camera(camera(dvec3(0.0, 0.0, 3.9), DVec3::ZERO, 39.3, 16));
    builder
}

/// A closed block, its front outside.
pub fn block(builder: &mut SceneBuilder, low: DVec3, high: DVec3, material: MaterialId) {
    let corner = |i: usize| {
        let pick = |bit: usize, low: f64, high: f64| if i & bit == 0 { low } else { high };
        dvec3(pick(1, low.x, high.x), pick(2, low.y, high.y), pick(4, low.z, high.z))
    };
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let positions = (0..8).map(corner).collect();
    builder.mesh(MeshData { positions, triangles, ..MeshData::default() }, material);
}
