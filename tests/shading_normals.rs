//! Shading normals: what is carried from the camera equals what is carried from the lamps.
//!
//! Interpolated normals make scattering non-symmetric; without the adjoint factor [Veach97, (5.19)], light tracing and every
//! connection of the bidirectional method would differ from path tracing by many percent here.
//!
//! The factor is unbounded where light grazes the true surface and not the interpolated one: with 1/c at a cosine c that has
//! density c, the variance of light tracing is infinite, if only logarithmically.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over pairs, orders and blocks).

use crate::support::{Entry, agree, lambert, room, shining};
use glam::{DVec3, dvec3};
use sampling::bsdf::{Bsdf, RoughConductor};
use sampling::math::Spectrum;
use scenes::{LoadOptions, MaterialId, MeshData, SceneBuilder, ShapeId, Skip};
use std::f64::consts::{PI, TAU};
use std::path::PathBuf;

/// A sphere of few triangles with the normals of a real one.
pub fn coarse_sphere(builder: &mut SceneBuilder, centre: DVec3, radius: f64, material: MaterialId) -> ShapeId {
    const RINGS: u32 = 4;
    const SECTORS: u32 = 6;
    let towards = |ring: u32, sector: u32| {
        let (sin, cos) = (PI * ring as f64 / RINGS as f64).sin_cos();
        let (y, x) = (TAU * sector as f64 / SECTORS as f64).sin_cos();
        dvec3(sin * x, cos, -sin * y)
    };
    let grid = (0..=RINGS).flat_map(|ring| (0..SECTORS).map(move |sector| towards(ring, sector)));
    let directions: Vec<DVec3> = grid.collect();
    let vertex = |ring: u32, sector: u32| ring * SECTORS + sector % SECTORS;
    let mut triangles = Vec::new();
    for (ring, sector) in (0..RINGS).flat_map(|ring| (0..SECTORS).map(move |sector| (ring, sector))) {
        let [a, b] = [vertex(ring, sector), vertex(ring, sector + 1)];
        let [c, d] = [vertex(ring + 1, sector), vertex(ring + 1, sector + 1)];
        if ring > 0 {
            triangles.push([a, d, b]);
        }
        if ring + 1 < RINGS {
            triangles.push([a, c, d]);
        }
    }
    let positions = directions.iter().map(|d| centre + *d * radius).collect();
    let normals = directions.iter().map(|d| d.as_vec3()).collect();
    builder.mesh(MeshData { positions, triangles, normals, ..MeshData::default() }, material)
}

/// Compares all methods in a room to which a lamp is added, by so many samples of direct, path, light and bdpt.
pub fn agree_under_a_lamp(title: &str, mut builder: SceneBuilder, max_order: usize, samples: [u32; 4]) {
    let black = builder.material(lambert(0.0));
    let lamp = builder.quad(dvec3(-0.4, 0.95, -0.4), DVec3::X * 0.8, DVec3::Z * 0.8, black);
    builder.emit(lamp, shining(3.0));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let [direct, path, light, bdpt] = samples;
    let entries = [
        Entry::new("direct", direct).by_night(4),
        Entry::new("path", path).by_night(4).without_roulette(),
        Entry::new("light", light).by_night(4).without_roulette().of_infinite_variance(),
        Entry::new("bdpt", bdpt).by_night(4).without_roulette(),
    ];
    agree(title, &scene, max_order, &entries, 0.9);
}

#[test]
fn coarse_spheres_with_smooth_normals() {
    let mut builder = room("coarse spheres");
    let white = builder.material(lambert(0.8));
    let metal = builder.material(Bsdf::from(RoughConductor::from_reflectance(Spectrum::new(0.9, 0.7, 0.4), 0.4, 0.4)));
    coarse_sphere(&mut builder, dvec3(-0.4, -0.4, -0.2), 0.5, white);
    coarse_sphere(&mut builder, dvec3(0.5, -0.5, 0.2), 0.45, metal);
    agree_under_a_lamp("coarse spheres with smooth normals", builder, 5, [32, 64, 64, 16]);
}

/// A Cornell box that others made, with a tessellated sphere; skipped where the file is missing.
#[test]
fn glossy_cornell_box() {
    let folder = std::env::var("NEUMANN_SCENES").unwrap_or_else(|_| "../shared/scenes".to_owned());
    let path = PathBuf::from(folder).join("cornell-obj/CornellBox-Glossy.obj");
    if !path.exists() {
        println!("skipped: no {}; set NEUMANN_SCENES to the folder of scenes", path.display());
        return;
    }
    let options = LoadOptions { size: Some((16, 16)), skip: Skip::Unneeded };
    let scene = scenes::load(path.to_str().unwrap(), &options).unwrap();
    let entries = [
        Entry::new("direct", 64).by_night(2),
        Entry::new("path", 160).by_night(2).without_roulette(),
        // What the adjoint of a shading normal weighs a light walk's directions by has no bound.
        Entry::new("light", 128).by_night(2).without_roulette().of_infinite_variance(),
        Entry::new("bdpt", 48).by_night(2).without_roulette(),
    ];
    agree("glossy Cornell box", &scene, 5, &entries, 0.9);
}
