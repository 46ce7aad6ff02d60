//! Normals that maps tilt: a facet under a uniform sky has the light that quadrature gives it, and what is carried from the camera
//! equals what is carried from the lamps.
//!
//! A walk from a lamp leaves a tilted face by the cosine to its own normal, while the flux that it carries goes by that to the true one:
//! as with interpolated normals, the variance of light tracing is infinite, if only logarithmically.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over methods or pairs, orders and blocks).

use crate::shading_normals::{agree_under_a_lamp, coarse_sphere};
use crate::support::{
    ALL, Budget, COLUMNS, Entry, Family, Truth, agree, bumps, camera, in_relief, lambert, plain, room, shining,
};
use glam::{DVec3, dvec3};
use sampling::bsdf::{Bsdf, Mirror, RoughConductor, RoughDielectric};
use sampling::math::Spectrum;
use scenes::relief::ReliefMap;
use scenes::texture::{Texture, UvMap};
use scenes::{LoadOptions, Remedies, SceneBuilder, Skip};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// What a white Lambertian facet, tilted by so much, reflects of the light of a uniform sky, by its midpoint rule: the integral of
/// (l·n′)/π S(l) over what is above the surface and the facet.
fn albedo(tilt: f64, remedies: Remedies) -> f64 {
    let (rings, sectors) = (1500, 1500);
    let (normal, step) = (dvec3(tilt.sin(), 0.0, tilt.cos()), FRAC_PI_2 / f64::from(rings));
    let alpha_squared = (tilt.tan().powi(2) / 8.0).min(1.0);
    let mut sum = 0.0;
    for (ring, sector) in (0..rings).flat_map(|ring| (0..sectors).map(move |sector| (ring, sector))) {
        let (theta, phi) = ((f64::from(ring) + 0.5) * step, (f64::from(sector) + 0.5) * TAU / f64::from(sectors));
        let light = dvec3(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        let shadowing = 2.0 / (1.0 + (1.0 + alpha_squared * theta.tan().powi(2)).sqrt());
        let reaching = if remedies.shadowing { shadowing } else { 1.0 };
        sum += light.dot(normal).max(0.0) * reaching * theta.sin();
    }
    sum * step * TAU / f64::from(sectors) / PI
}

#[test]
fn a_tilted_facet_under_a_uniform_sky() {
    for degrees in [10.0, 25.0, 40.0_f64] {
        let tilt = degrees.to_radians();
        // What is below the surface of the hemisphere about the facet is left out.
        assert!((albedo(tilt, Remedies::NONE) - 0.5 * (1.0 + tilt.cos())).abs() < 1e-5);
        let colour = Spectrum::new(tilt.sin() as f32, 0.0, tilt.cos() as f32) * 0.5 + Spectrum::splat(0.5);
        let map = || ReliefMap::Normals(Texture::Constant(colour));
        // From above, and from so low that the facet is turned away.
        let views = [("above", dvec3(0.1, 0.2, 3.0)), ("behind", dvec3(-3.0, 0.1, 0.3))];
        for (remedies, (place, position)) in Remedies::ALL.into_iter().flat_map(|r| views.map(|view| (r, view))) {
            if place == "behind" && degrees < 20.0 {
                continue;
            }
            let is_seen = place == "above" || remedies.turning;
            let mut builder = SceneBuilder::new(&format!("{degrees} degrees, {}, from {place}", remedies.name()));
            let material = builder.material(in_relief(lambert(0.7), map(), remedies));
            builder.quad(dvec3(-4.0, -4.0, 0.0), DVec3::X * 8.0, DVec3::Y * 8.0, material);
            builder.environment(Spectrum::ONE);
            builder.camera(camera(position, DVec3::ZERO, if place == "above" { 50.0 } else { 4.0 }, 8));
            let scene = builder.build(Skip::Unneeded).unwrap();
            let expected = if is_seen { 0.7 * albedo(tilt, remedies) } else { 0.0 };
            let truth = Truth::new(&scene, |_, _| vec![0.0, expected, 0.0]);
            let mut family = Family::new(truth.name());
            // From the side next to no light is splatted into the narrow view, and where the facet is steep the infinite variance of
            // light tracing decides nothing.
            let by_light = place == "above" && degrees < 30.0;
            for name in ALL.into_iter().filter(|name| *name != "light" || by_light) {
                let budget = Budget::samples(if name == "light" { 128 } else { 8 });
                truth.compare(&mut family, name, plain(name).as_ref(), budget, COLUMNS);
            }
            family.finish(if is_seen { 0.9 } else { 0.0 });
        }
    }
}

/// Matte, glossy and transmitting surfaces whose normals are tilted far, over normals that are interpolated and over such as are not.
#[test]
fn methods_agree_on_strong_relief() {
    for remedies in [Remedies::default(), Remedies::NONE] {
        let title = format!("strong relief, {}", remedies.name());
        let mut builder = room(&title);
        let tilts = [Spectrum::new(0.8, 0.6, 0.8), Spectrum::new(0.3, 0.4, 0.8)];
        let map = ReliefMap::Normals(Texture::Checkerboard { values: tilts, map: UvMap::default() });
        let white = builder.material(in_relief(lambert(0.8), bumps(0.25, 0.3, 1), remedies));
        let rough = RoughConductor::from_reflectance(Spectrum::new(0.9, 0.7, 0.4), 0.4, 0.4);
        let metal = builder.material(in_relief(rough.into(), bumps(0.2, 0.15, 2), remedies));
        let glass = RoughDielectric::new(1.4, 0.5, 0.5);
        let glass = builder.material(in_relief(glass.into(), bumps(0.3, 0.15, 3), remedies));
        let tiles = builder.material(in_relief(lambert(0.7), map, remedies));
        coarse_sphere(&mut builder, dvec3(-0.4, -0.4, -0.2), 0.5, white);
        builder.sphere(dvec3(0.5, -0.5, 0.0), 0.45, metal);
        builder.sphere(dvec3(0.0, 0.3, 0.2), 0.35, glass);
        builder.quad(dvec3(-1.0, -0.6, -0.99), DVec3::X * 2.0, DVec3::Y * 1.5, tiles);
        agree_under_a_lamp(&title, builder, 3, [32, 96, 64, 24]);
    }
}

/// Smooth surfaces in relief, whose directions are chosen with other probabilities from a lamp than from the camera.
#[test]
fn a_mirror_and_glass_in_relief() {
    let mut builder = room("mirror and glass in relief");
    let black = builder.material(lambert(0.0));
    let mirror = Bsdf::from(Mirror { reflectance: Spectrum::splat(0.8) });
    let mirror = builder.material(in_relief(mirror, bumps(0.5, 0.2, 3), Remedies::default()));
    let glass = Bsdf::from(sampling::bsdf::Dielectric { eta: 1.4 });
    let glass = builder.material(in_relief(glass, bumps(0.5, 0.1, 4), Remedies::default()));
    builder.sphere(dvec3(0.3, -0.4, -0.3), 0.45, mirror);
    builder.sphere(dvec3(-0.4, -0.5, 0.2), 0.4, glass);
    let lamp = builder.quad(dvec3(-0.7, 0.95, -0.7), DVec3::X * 1.4, DVec3::Z * 1.4, black);
    builder.emit(lamp, shining(1.0));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let entries = [
        Entry::new("direct", 16).by_night(4),
        Entry::new("path", 32).by_night(4).without_roulette(),
        Entry::new("light", 32).by_night(4).without_roulette(),
        Entry::new("bdpt", 16).by_night(4).without_roulette(),
    ];
    agree("mirror and glass in relief", &scene, 4, &entries, 0.9);
}

/// Matte walls, metal and rough glass with bump maps and a normal map under a sky and a lamp, as Mitsuba's format has them; the
/// same file serves `neumann verify`.
#[test]
fn methods_agree_on_an_imported_scene() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/relief/scene.xml");
    let scene = scenes::load(file, &LoadOptions { size: Some((16, 16)), skip: Skip::Unneeded }).unwrap();
    let entries = [
        Entry::new("direct", 32).by_night(4),
        Entry::new("path", 64).by_night(4).without_roulette(),
        Entry::new("light", 64).by_night(4).without_roulette().of_infinite_variance(),
        Entry::new("bdpt", 24).by_night(4).without_roulette(),
    ];
    agree("imported relief", &scene, 3, &entries, 0.9);
}
