//! Sizes, places, brightness and proportions.

use super::{ALBEDO, EMITTED, enclosure, is_a_furnace, is_the_same, methods};
use crate::shading_normals::coarse_sphere;
use crate::support::{ALL, Budget, COLUMNS, Family, Rendered, camera, lambert, measure, method, shining, with_pilot};
use glam::{DAffine3, DMat3, DQuat, DVec3, dvec3};
use integrators::{Integrator, Orders, Render, RenderSettings};
use sampling::bsdf::{Bsdf, Dielectric, RoughConductor};
use sampling::math::Spectrum;
use sampling::sampler::{Role, SamplerKind};
use scenes::{CameraSettings, Scene, SceneBuilder, Skip};

/// Where a scene lies, and how bright it is.
#[derive(Clone, Copy)]
struct Place {
    scale: f64,
    /// In units of the scene's own size.
    offset: DVec3,
    mirrored: bool,
    brightness: f32,
}

const HOME: Place = Place { scale: 1.0, offset: DVec3::ZERO, mirrored: false, brightness: 1.0 };

impl Place {
    fn map(self) -> DAffine3 {
        let mirror = dvec3(if self.mirrored { -1.0 } else { 1.0 }, 1.0, 1.0);
        DAffine3 { matrix3: DMat3::from_diagonal(mirror * self.scale), translation: self.offset * self.scale }
    }
}

/// A room with everything whose size may matter: an area lamp, a point, a sky behind the open front, glass, metal, and a mesh whose
/// normals are interpolated.
fn room_at(place: Place) -> Scene {
    let mut builder = SceneBuilder::new("room");
    let map = place.map();
    let point = |p: DVec3| map.transform_point3(p);
    let [white, dark, black] = [0.7, 0.3, 0.0].map(|albedo| builder.material(lambert(albedo)));
    let metal = builder.material(Bsdf::from(RoughConductor::from_reflectance(Spectrum::new(0.9, 0.7, 0.4), 0.3, 0.3)));
    let glass = builder.material(Bsdf::from(Dielectric { eta: 1.5 }));
    let (x, y, z) = (DVec3::X * 2.0, DVec3::Y * 2.0, DVec3::Z * 2.0);
    let (low, high) = (DVec3::splat(-1.0), DVec3::splat(1.0));
    let lamp = builder.quad(dvec3(-0.4, 0.95, -0.4), DVec3::X * 0.8, DVec3::Z * 0.8, black);
    builder.emit(lamp, shining(3.0 * place.brightness));
    let mut shapes = vec![
        lamp,
        builder.quad(low, z, x, white),
        builder.quad(high, -x, -z, metal),
        builder.quad(low, x, y, white),
        builder.quad(low, y, z, dark),
        builder.quad(high, -z, -y, white),
        builder.sphere(dvec3(0.5, -0.5, 0.3), 0.35, glass),
    ];
    shapes.push(coarse_sphere(&mut builder, dvec3(-0.4, -0.5, -0.2), 0.45, white));
    shapes.into_iter().for_each(|shape| builder.transform(shape, map));
    let intensity = 0.4 * place.brightness * (place.scale * place.scale) as f32;
    builder.point_emitter(point(dvec3(0.3, 0.5, 0.4)), Spectrum::splat(intensity));
    builder.environment(Spectrum::splat(0.1 * place.brightness));
    let settings = camera(point(dvec3(0.0, 0.0, 3.9)), point(DVec3::ZERO), 39.3, 8);
    builder.camera(CameraSettings { mirrored: place.mirrored, ..settings });
    builder.build(Skip::Unneeded).unwrap()
}

/// Every pixel of every order of a few replicates, over the brightness.
fn pixels(scene: &Scene, brightness: f32, method: &dyn Integrator, sampler: SamplerKind) -> Vec<[f64; 3]> {
    let settings = RenderSettings {
        orders: Orders::up_to(6),
        tail: false,
        samples_per_replicate: with_pilot(method.name(), 4),
        seed: 3,
        sampler,
        instance: String::new(),
        role: Role::Estimate,
    };
    let mut render = Render::new(scene, method, settings).unwrap();
    let mut pixels = Vec::new();
    let layers = method.orders(6).count();
    for _ in 0..2 {
        render.run_replicate(&|_| {});
        let places = (0..layers).flat_map(|layer| (0..64).map(move |pixel| (layer, pixel)));
        pixels.extend(places.map(|(l, p)| render.last_replicate(l, p).map(|v| v / f64::from(brightness))));
    }
    assert!(render.finish().invalid.iter().all(|&n| n == 0), "non-finite contributions");
    pixels
}

/// Units of length are the user's: a power of two of them changes no bit of any image by any method and sampler. Nor does a power of
/// two of the light. What learns, merges or mutates has more places where a constant could stand.
#[test]
fn powers_of_two_change_no_bit() {
    let scaled = |k: i32| Place { scale: f64::from(k).exp2(), ..HOME };
    let brighter = |k: i32| Place { brightness: (k as f32).exp2(), ..HOME };
    let places = [scaled(-20), scaled(-7), scaled(20), brighter(-40), brighter(40)];
    let home = room_at(HOME);
    let scenes = places.map(|place| (place, room_at(place)));
    let others = [
        "emission",
        "local",
        "whitted",
        "adaptive",
        "adaptive_bdpt",
        "guided",
        "coherent",
        "coherent_bdpt",
        "vcm",
        "ppm",
        "pssmlt",
        "mmlt",
    ];
    for name in ALL.into_iter().chain(others) {
        let method = method(name);
        for &sampler in SamplerKind::ALL {
            let base = pixels(&home, 1.0, method.as_ref(), sampler);
            assert!(base.iter().any(|v| v[0] > 0.0), "{name}: a black image");
            for (place, scene) in &scenes {
                let other = pixels(scene, place.brightness, method.as_ref(), sampler);
                let changed = base.iter().zip(&other).filter(|(a, b)| a != b).count();
                let (scale, brightness) = (place.scale, place.brightness);
                assert_eq!(changed, 0, "{name}, {sampler}: of {} pixels at {scale:e}, {brightness:e}", base.len());
            }
        }
    }
}

/// Other sizes, and places far from the origin, round differently: that moves no mean.
#[test]
fn sizes_and_places_move_no_mean() {
    let far = dvec3(1.0, 0.3, -0.7) * 1e5;
    let mut family = Family::new("sizes and places");
    for (name, method) in methods() {
        let at = |place: Place| -> Rendered {
            let budget = Budget { samples: 1, ..Budget::samples(1).up_to(5) };
            measure(&room_at(place), method.as_ref(), name, budget)
        };
        let base = at(HOME);
        for exponent in [-6, -3, 3, 6] {
            for offset in [DVec3::ZERO, far] {
                let place = Place { scale: 10f64.powi(exponent), offset, ..HOME };
                let label = format!("{name} at 1e{exponent}, offset {:.0e}", offset.x);
                is_the_same(&mut family, &label, &base, &at(place), 1.0);
            }
        }
        let bright = Place { brightness: 1e12, ..HOME };
        let dim = Place { brightness: 1e-12, ..HOME };
        is_the_same(&mut family, &format!("{name}, bright"), &base, &at(bright), 1e12);
        is_the_same(&mut family, &format!("{name}, dim"), &base, &at(dim), f64::from(1e-12_f32));
    }
    family.finish(0.0);
}

/// The mirror image of a scene, seen in a mirror, is the scene.
#[test]
fn the_mirror_image_is_the_scene() {
    let mut family = Family::new("mirrored room");
    let mirrored = room_at(Place { mirrored: true, ..HOME });
    let home = room_at(HOME);
    for (name, method) in methods() {
        let budget = Budget::samples(32).up_to(4);
        let [a, b] = [("", &home), (" mirrored", &mirrored)]
            .map(|(suffix, scene)| measure(scene, method.as_ref(), &format!("{name}{suffix}"), budget));
        for layer in 0..a.measurement.layers.len() {
            let label = format!("{name}, order {layer}");
            // Over interpolated normals its variance is infinite, if only logarithmically.
            if name == "light" {
                family.spare(label, a.image(layer), b.image(layer));
                continue;
            }
            family.layer(&label, layer, COLUMNS, &a, &b);
        }
    }
    family.finish(0.7);
}

/// An enclosure drawn out ten thousandfold, flattened as much, or sheared, in turn.
pub(super) fn distorted_enclosures() -> impl Iterator<Item = (&'static str, Scene)> {
    let mut shear = DMat3::IDENTITY;
    shear.y_axis = dvec3(3.0, 1.0, 0.5);
    let turn = DMat3::from_quat(DQuat::from_axis_angle(dvec3(1.0, 2.0, 3.0).normalize(), 0.7));
    let maps = [
        ("drawn out", DMat3::from_diagonal(dvec3(1.0, 1.0, 1e4))),
        ("flattened", DMat3::from_diagonal(dvec3(1.0, 1e-4, 1.0))),
        ("sheared", shear),
        ("sheared and mirrored", shear * DMat3::from_diagonal(dvec3(1.0, 1.0, -1.0))),
        ("flattened, then turned", turn * DMat3::from_diagonal(dvec3(1.0, 1e-4, 1.0))),
    ];
    maps.into_iter().map(|(label, map)| {
        let mut builder = SceneBuilder::new(label);
        let wall = builder.material(lambert(ALBEDO));
        for shape in enclosure(&mut builder, wall, EMITTED) {
            builder.transform(shape, DAffine3::from_mat3(map));
        }
        builder.camera(camera(map * dvec3(0.1, 0.2, 0.6), map * dvec3(0.0, 0.1, -1.0), 70.0, 8));
        (label, builder.build(Skip::Unneeded).unwrap())
    })
}

/// They are furnaces still. Light tracing seldom meets what the camera sees of them, and is left out.
#[test]
fn a_distorted_enclosure_is_a_furnace() {
    let mut family = Family::new("distorted enclosures");
    for (label, scene) in distorted_enclosures() {
        is_a_furnace(&mut family, &scene, label, &["direct", "path", "bdpt"], 16, (ALBEDO, EMITTED));
    }
    family.finish(0.6);
}
