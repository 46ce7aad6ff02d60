//! Surfaces whose front and back are made of different things: closed forms, and the agreement of methods.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over methods or pairs, orders and blocks).

use crate::support::{
    ALL, Budget, COLUMNS, Entry, Family, Truth, agree, camera, lambert, method, plain, room, shining,
};
use glam::{DAffine3, DVec3, dvec3};
use sampling::bsdf::{Bsdf, Lambert, Mirror};
use sampling::math::Spectrum;
use scenes::material::{Scattering, Sided, Varying};
use scenes::texture::{Noise, Texture};
use scenes::{Emission, Material, SceneBuilder, Skip};

/// A material of two sides.
fn sided(front: impl Into<Bsdf>, back: impl Into<Bsdf>) -> Material {
    let side = |bsdf| Varying::of(Scattering::Same(bsdf));
    Sided::new([side(front.into()), side(back.into())], None).into()
}

/// A sphere that shines on both sides, seen from within, where one of its sides is: L_k = ρ^k e of that side alone.
fn sphere(name: &str, wall: Material, flip: bool, mirrored: bool) {
    let emitted = 0.8f32;
    let mut builder = SceneBuilder::new(name);
    let wall = builder.material(wall);
    let sphere = builder.sphere(dvec3(3.0, 1.0, -2.0), 1.0, wall);
    if flip {
        builder.flip(sphere);
    }
    if mirrored {
        builder.transform(sphere, DAffine3::from_scale(dvec3(1.0, -1.0, 1.0)));
    }
    let y = if mirrored { -1.0 } else { 1.0 };
    builder.emit(sphere, Emission { two_sided: true, ..shining(emitted) });
    builder.camera(camera(dvec3(3.4, 1.3 * y, -1.4), dvec3(3.1, y, -3.0), 80.0, 8));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let truth = Truth::new(&scene, |_, _| (0..=4).map(|order| f64::from(emitted * 0.6f32.powi(order))).collect());
    let mut family = Family::new(truth.name());
    for name in ALL {
        // Of `path` so many that its errors, which are rounding's, are no larger than rounding may be.
        let budget = Budget::samples(if ["path", "light"].contains(&name) { 128 } else { 32 });
        truth.compare(&mut family, name, plain(name).as_ref(), budget, COLUMNS);
    }
    family.finish(0.9);
}

#[test]
fn a_sphere_from_within_has_its_back() {
    sphere("back of a sphere", sided(lambert(0.1), lambert(0.6)), false, false);
    sphere("back of a mirrored sphere", sided(lambert(0.1), lambert(0.6)), false, true);
    sphere("front of a sphere turned over", sided(lambert(0.6), lambert(0.1)), true, false);
}

/// A plate in a furnace, from behind: its back reflects ρ of all light once, and its front is not seen.
#[test]
fn a_plate_in_a_furnace_from_behind() {
    for (name, distance, albedo) in [("plate from before", 2.0, 0.3), ("plate from behind", -2.0, 0.8)] {
        let mut builder = SceneBuilder::new(name);
        let wall = builder.material(sided(lambert(0.3), lambert(0.8)));
        builder.quad(dvec3(-2.0, -2.0, 0.0), DVec3::X * 4.0, DVec3::Y * 4.0, wall);
        builder.environment(Spectrum::ONE);
        builder.camera(camera(dvec3(0.2, 0.1, distance), dvec3(0.0, 0.1, 0.0), 50.0, 8));
        let scene = builder.build(Skip::Unneeded).unwrap();
        let truth = Truth::new(&scene, |_, _| vec![0.0, f64::from(albedo as f32), 0.0]);
        let mut family = Family::new(&scene.name);
        for name in ALL {
            let budget = Budget::samples(if name == "light" { 512 } else { 64 });
            truth.compare(&mut family, name, method(name).as_ref(), budget, COLUMNS);
        }
        family.finish(0.9);
    }
}

/// Screens with a colour on each side, with black behind, with a mirror behind, with noise, and with holes, in all positions to the
/// lamp and the camera.
#[test]
fn methods_agree_among_surfaces_of_two_sides() {
    let mut builder = room("two sides");
    let coloured = |r, g, b| Bsdf::from(Lambert { albedo: Spectrum::new(r, g, b) });
    let (red, blue, black) = (coloured(0.8, 0.2, 0.1), coloured(0.1, 0.3, 0.9), lambert(0.0));
    let screen = |builder: &mut SceneBuilder, at: DVec3, u: DVec3, v: DVec3, material: Material| {
        let material = builder.material(material);
        builder.quad(at, u, v, material)
    };
    let (side, up) = (dvec3(0.5, 0.0, 0.35), dvec3(0.1, 0.8, 0.1));
    screen(&mut builder, dvec3(-0.85, -0.9, 0.0), side, up, sided(red, blue));
    let turned = screen(&mut builder, dvec3(-0.25, -0.9, 0.1), side, up, sided(red, black));
    builder.flip(turned);
    screen(&mut builder, dvec3(0.35, -0.8, -0.5), side, up, sided(blue, black));
    let mirror = Bsdf::from(Mirror { reflectance: Spectrum::splat(0.9) });
    screen(&mut builder, dvec3(-0.8, 0.05, -0.6), side, up, sided(mirror, red));
    let noise = Texture::Noise(Noise {
        low: Spectrum::splat(0.2),
        high: Spectrum::splat(0.9),
        size: 0.2,
        octaves: 2,
        seed: 4,
        origin: DVec3::ZERO,
    });
    let Material::Varying(varying) = Material::lambert(noise.clone()) else { unreachable!("it varies") };
    let flat = Varying::of(Scattering::Same(blue));
    let holes = Sided::new([*varying, flat], Some(noise));
    screen(&mut builder, dvec3(0.3, -0.1, 0.2), dvec3(0.5, 0.1, -0.3), up, holes.into());
    let lamp = screen(&mut builder, dvec3(-0.4, 0.9, -0.4), DVec3::X * 0.8, DVec3::Z * 0.8, sided(red, blue));
    builder.emit(lamp, shining(2.0));
    let entries = [
        Entry::new("direct", 32).by_night(4),
        Entry::new("path", 64).without_roulette().by_night(4),
        Entry::new("light", 64).without_roulette().by_night(4),
        Entry::new("bdpt", 16).without_roulette().by_night(4),
    ];
    agree("two sides", &builder.build(Skip::Unneeded).unwrap(), 4, &entries, 0.9);
}
