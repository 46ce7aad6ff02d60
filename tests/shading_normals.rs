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
use sampling::bsdf::{Bsdf, Mirror, RoughConductor};
use sampling::math::Spectrum;
use scenes::material::{Scattering, Varying};
use scenes::texture::{Noise, Texture, UvMap};
use scenes::{LoadOptions, Material, MaterialId, MeshData, Relief, SceneBuilder, Skip};
use std::f64::consts::{PI, TAU};
use std::path::PathBuf;

/// A sphere of few triangles with the normals of a real one.
fn coarse_sphere(builder: &mut SceneBuilder, centre: DVec3, radius: f64, material: MaterialId) {
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
    builder.mesh(MeshData { positions, triangles, normals, ..MeshData::default() }, material);
}

/// Compares all methods in a room to which a lamp is added.
fn agree_under_a_lamp(title: &str, mut builder: SceneBuilder) {
    let black = builder.material(lambert(0.0));
    let lamp = builder.quad(dvec3(-0.4, 0.95, -0.4), DVec3::X * 0.8, DVec3::Z * 0.8, black);
    builder.emit(lamp, shining(3.0));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let entries = [
        Entry::new("direct", 32).by_night(4),
        Entry::new("path", 64).by_night(4).without_roulette(),
        Entry::new("light", 64).by_night(4).without_roulette().of_infinite_variance(),
        Entry::new("bdpt", 16).by_night(4).without_roulette(),
    ];
    agree(title, &scene, 5, &entries, 0.9);
}

#[test]
fn coarse_spheres_with_smooth_normals() {
    let mut builder = room("coarse spheres");
    let white = builder.material(lambert(0.8));
    let metal = builder.material(Bsdf::from(RoughConductor::from_reflectance(Spectrum::new(0.9, 0.7, 0.4), 0.4, 0.4)));
    coarse_sphere(&mut builder, dvec3(-0.4, -0.4, -0.2), 0.5, white);
    coarse_sphere(&mut builder, dvec3(0.5, -0.5, 0.2), 0.45, metal);
    agree_under_a_lamp("coarse spheres with smooth normals", builder);
}

/// Coarse spheres and a wall whose normals are tilted far, by bumps and by a normal map: what is carried from either end is the same,
/// and reciprocal models stay so.
#[test]
fn strong_relief_over_smooth_normals() {
    let mut builder = room("strong relief");
    let tilts = [Spectrum::new(0.8, 0.6, 0.8), Spectrum::new(0.3, 0.4, 0.8)];
    let map = Relief::Normals(Texture::Checkerboard { values: tilts, map: UvMap::default() });
    let white = builder.material(in_relief(lambert(0.8), bumps(0.25, 0.3, 1)));
    let rough = RoughConductor::from_reflectance(Spectrum::new(0.9, 0.7, 0.4), 0.4, 0.4);
    let metal = builder.material(in_relief(rough.into(), bumps(0.2, 0.15, 2)));
    let tiles = builder.material(in_relief(lambert(0.7), map));
    coarse_sphere(&mut builder, dvec3(-0.4, -0.4, -0.2), 0.5, white);
    coarse_sphere(&mut builder, dvec3(0.5, -0.5, 0.2), 0.45, metal);
    builder.quad(dvec3(-1.0, -0.6, -0.99), DVec3::X * 2.0, DVec3::Y * 1.5, tiles);
    agree_under_a_lamp("strong relief over smooth normals", builder);
}

/// A bumpy mirror, whose directions are chosen with the same probability from either end.
#[test]
fn a_mirror_in_relief() {
    let mut builder = room("mirror in relief");
    let black = builder.material(lambert(0.0));
    let mirror = Mirror { reflectance: Spectrum::splat(0.8) };
    let mirror = builder.material(in_relief(mirror.into(), bumps(0.5, 0.2, 3)));
    builder.sphere(dvec3(0.1, -0.2, -0.2), 0.5, mirror);
    let lamp = builder.quad(dvec3(-0.7, 0.95, -0.7), DVec3::X * 1.4, DVec3::Z * 1.4, black);
    builder.emit(lamp, shining(1.0));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let entries = [
        Entry::new("direct", 16).by_night(4),
        Entry::new("path", 32).by_night(4).without_roulette(),
        Entry::new("light", 32).by_night(4).without_roulette(),
        Entry::new("bdpt", 16).by_night(4).without_roulette(),
    ];
    agree("mirror in relief", &scene, 4, &entries, 0.9);
}

fn bumps(size: f32, height: f32, seed: u64) -> Relief {
    let (low, high) = (Spectrum::ZERO, Spectrum::splat(height));
    Relief::Heights(Texture::Noise(Noise { low, high, size, octaves: 2, seed, origin: DVec3::ZERO }))
}

fn in_relief(bsdf: Bsdf, relief: Relief) -> Material {
    let mut varying = Varying::of(Scattering::Same(bsdf));
    varying.relief = Some(relief);
    varying.into()
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
        Entry::new("path", 128).by_night(2).without_roulette(),
        Entry::new("light", 128).by_night(2).without_roulette(),
        Entry::new("bdpt", 32).by_night(2).without_roulette(),
    ];
    agree("glossy Cornell box", &scene, 5, &entries, 0.9);
}
