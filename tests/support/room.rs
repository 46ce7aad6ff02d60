//! A room for tests that bring their own lamps.

use super::{camera, lambert, shining};
use glam::{DVec3, dvec3};
use sampling::bsdf::{Bsdf, Dielectric, Mirror, Plastic, RoughConductor, RoughPlastic};
use sampling::math::Spectrum;
use scenes::{MaterialId, MeshData, Scene, SceneBuilder, ShapeId, Skip};

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
pub fn block(builder: &mut SceneBuilder, low: DVec3, high: DVec3, material: MaterialId) -> ShapeId {
    let corner = |i: usize| {
        let pick = |bit: usize, low: f64, high: f64| if i & bit == 0 { low } else { high };
        dvec3(pick(1, low.x, high.x), pick(2, low.y, high.y), pick(4, low.z, high.z))
    };
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let positions = (0..8).map(corner).collect();
    builder.mesh(MeshData { positions, triangles, ..MeshData::default() }, material)
}

/// A room with every kind of lobe, and two lamps that have labels.
pub fn furnished(lamps: [bool; 2]) -> Scene {
    let mut builder = room("furnished");
    let plastic = builder.material(Bsdf::from(Plastic::new(Spectrum::new(0.6, 0.3, 0.2), 1.5)));
    let metal = builder.material(Bsdf::from(RoughConductor::from_reflectance(Spectrum::splat(0.8), 0.4, 0.4)));
    let mirror = builder.material(Bsdf::from(Mirror { reflectance: Spectrum::splat(0.9) }));
    let glass = builder.material(Bsdf::from(Dielectric { eta: 1.5 }));
    let coated = builder.material(Bsdf::from(RoughPlastic::new(Spectrum::new(0.2, 0.5, 0.6), 1.5, 0.3)));
    let floor = builder.quad(dvec3(-1.0, -0.99, -1.0), DVec3::Z * 2.0, DVec3::X * 2.0, coated);
    builder.label(floor, "floor");
    for (centre, material) in [
        (dvec3(-0.5, -0.6, 0.2), plastic),
        (dvec3(0.5, -0.6, 0.2), metal),
        (dvec3(-0.4, 0.2, -0.5), mirror),
        (dvec3(0.4, 0.1, -0.3), glass),
    ] {
        builder.sphere(centre, 0.3, material);
    }
    let black = builder.material(lambert(0.0));
    // A lamp that is off is still there.
    for (x, label, radiance, on) in [(-0.8, "key", 3.0, lamps[0]), (0.2, "fill", 1.0, lamps[1])] {
        let lamp = builder.quad(dvec3(x, 0.97, -0.4), DVec3::X * 0.6, DVec3::Z * 0.8, black);
        builder.label(lamp, label);
        if on {
            builder.emit(lamp, shining(radiance));
        }
    }
    let mut scene = builder.build(Skip::Unneeded).unwrap();
    scene.camera.set_size(8, 8);
    scene
}
