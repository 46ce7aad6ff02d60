//! Cameras: under each of them all methods estimate the same, order by order, and in enclosures what is known; a thin lens blurs
//! as its equation says; a crop of a scene file has the bits of the whole.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over methods or pairs, orders and blocks).

use crate::support::{
    ALL, Budget, COLUMNS, Entry, Estimate, Family, Rendered, agree, block, grey, lambert, measure, plain, room, shining,
};
use glam::{DVec3, dvec2, dvec3};
use integrators::{Measurement, Orders, Render, RenderSettings, Window};
use sampling::bsdf::{Bsdf, Dielectric, Mirror};
use sampling::filter::Filter;
use sampling::math::Spectrum;
use sampling::sampler::{Role, SamplerKind};
use scenes::camera::Edges;
use scenes::{CameraSettings, LoadOptions, Projection, Scene, SceneBuilder, Skip};

/// Mirrored, and with its window moved.
fn turned(settings: CameraSettings) -> CameraSettings {
    CameraSettings { mirrored: true, shift: dvec2(0.1, -0.05), ..settings }
}

fn looking(position: DVec3, target: DVec3, projection: Projection, size: (u32, u32)) -> CameraSettings {
    CameraSettings { projection, ..CameraSettings::pinhole(position, target, 40.0, size) }
}

fn built(mut builder: SceneBuilder, settings: CameraSettings) -> Scene {
    builder.camera(settings);
    builder.build(Skip::Unneeded).unwrap()
}

/// Every camera within the furnace, where order k is the same everywhere and in every direction.
fn in_the_furnace() -> Vec<(&'static str, CameraSettings)> {
    let (at, target, size) = (dvec3(-0.1, 0.2, 0.75), dvec3(0.1, -0.1, -0.5), (8, 6));
    let pinhole = looking(at, target, Projection::Pinhole { fov: 60.0 }, size);
    let lens = Projection::ThinLens { fov: 60.0, lens_radius: 0.2, focus_distance: Some(0.6) };
    let all_around = looking(at, target, Projection::Equirectangular, size);
    vec![
        ("pinhole", turned(pinhole)),
        ("thin lens", looking(at, target, lens, size)),
        ("thin lens, turned", turned(looking(at, target, lens, size))),
        ("orthographic", turned(looking(at, target, Projection::Orthographic { extent: 0.8 }, size))),
        ("all around", CameraSettings { mirrored: true, ..all_around }),
        ("all around, wide filter", CameraSettings { filter: Filter::Gaussian, ..all_around }),
    ]
}

/// Every pixel, those in corners and at poles too; of light tracing all around, whose variance is infinite at a pole, no image mean
/// must decide anything.
#[test]
fn in_a_furnace_every_camera_sees_what_is_known() {
    let mut family = Family::new("cameras in a furnace");
    for (name, settings) in in_the_furnace() {
        let scene = built(scenes::load::open("furnace", None).unwrap(), settings);
        for method in ALL {
            let budget = Budget::samples(if method == "light" { 96 } else { 16 }).up_to(4);
            let heavy = method == "light" && scene.camera.raster().edges == Edges::Sphere;
            let image = if heavy { Family::spare } else { Family::image };
            let rendered = measure(&scene, plain(method).as_ref(), &format!("{name} {method}"), budget);
            for layer in 0..rendered.measurement.layers.len() {
                let exact =
                    scenes::builtin::exact("furnace", layer, DVec3::ZERO.as_vec3(), DVec3::Z.as_vec3()).unwrap();
                let truth = Estimate::exact(grey(exact.to_array().map(f64::from)));
                let label = format!("{name}, {method}, order {layer}");
                for pixel in 0..rendered.measurement.pixels() {
                    family.block(format!("{label} pixel {pixel}"), rendered.over(layer, &[pixel]), truth);
                }
                image(&mut family, label, rendered.image(layer), truth);
            }
        }
    }
    family.finish(0.9);
}

/// A room with a lamp, a mirror ball, and a block.
fn furnished(name: &str) -> SceneBuilder {
    let mut builder = room(name);
    let black = builder.material(lambert(0.0));
    let grey = builder.material(lambert(0.5));
    let mirror = builder.material(Bsdf::from(Mirror { reflectance: Spectrum::splat(0.9) }));
    let glass = builder.material(Bsdf::from(Dielectric { eta: 1.5 }));
    builder.sphere(dvec3(0.45, -0.7, -0.5), 0.25, mirror);
    builder.sphere(dvec3(-0.6, 0.5, -0.6), 0.2, glass);
    block(&mut builder, dvec3(-0.6, -1.0, 0.0), dvec3(-0.2, -0.5, 0.3), grey);
    let lamp = builder.quad(dvec3(-0.5, 0.97, -0.5), DVec3::X, DVec3::Z, black);
    builder.emit(lamp, shining(2.0));
    builder
}

/// All methods, with samples in the ratio of what they cost.
fn entries(samples: u32) -> [Entry; 4] {
    [
        Entry::new("direct", samples / 2),
        Entry::new("path", samples).without_roulette(),
        Entry::new("light", samples).without_roulette(),
        Entry::new("bdpt", samples / 4).without_roulette(),
    ]
    .map(|entry| entry.by_night(4))
}

/// The balls are in focus, the block and the walls near the lens are not.
#[test]
fn methods_agree_behind_a_wide_lens_close_to_walls() {
    let lens = Projection::ThinLens { fov: 60.0, lens_radius: 0.25, focus_distance: Some(1.3) };
    let settings = looking(dvec3(-0.5, -0.3, 0.8), dvec3(-0.1, -0.2, -0.8), lens, (16, 16));
    let scene = built(furnished("wide lens"), turned(settings));
    assert!(!scene.needs.pinhole);
    agree("wide lens", &scene, 4, &entries(32), 0.7);
}

#[test]
fn methods_agree_under_parallel_rays() {
    let film = Projection::Orthographic { extent: 1.5 };
    let settings = looking(dvec3(0.1, 0.2, 0.9), dvec3(-0.1, -0.2, -0.8), film, (16, 16));
    agree("parallel rays", &built(furnished("parallel rays"), turned(settings)), 4, &entries(32), 0.7);
}

/// Light tracing's variance is infinite at the poles, and less is asked of it.
#[test]
fn methods_agree_all_around() {
    let settings = looking(dvec3(0.1, -0.1, 0.2), dvec3(0.3, -0.3, -0.8), Projection::Equirectangular, (16, 12));
    let scene = built(furnished("all around"), CameraSettings { mirrored: true, ..settings });
    let [direct, path, light, bdpt] = entries(32);
    agree("all around", &scene, 4, &[direct, path, light.of_infinite_variance(), bdpt], 0.6);
}

#[test]
fn methods_agree_through_a_shifted_window() {
    let pinhole = Projection::Pinhole { fov: 50.0 };
    let settings = turned(looking(dvec3(0.0, -0.1, 2.2), dvec3(0.0, 0.0, -1.0), pinhole, (16, 16)));
    let scene = built(furnished("shifted window"), CameraSettings { shift: dvec2(0.3, -0.2), ..settings });
    agree("shifted window", &scene, 4, &entries(96), 0.7);
}

/// A ball on a floor under a uniform sky, part of which is in view: where light comes from no place, and cameras look to none.
#[test]
fn methods_agree_under_a_sky() {
    let mut family = Family::new("cameras under a sky");
    let lens = Projection::ThinLens { fov: 60.0, lens_radius: 0.2, focus_distance: None };
    let parallel = Projection::Orthographic { extent: 2.5 };
    for (name, projection, filter) in [
        ("lens", lens, Filter::Box),
        ("parallel", parallel, Filter::Box),
        ("parallel, wide filter", parallel, Filter::Gaussian),
        ("all around", Projection::Equirectangular, Filter::Box),
    ] {
        let mut builder = SceneBuilder::new(name);
        let grey = builder.material(lambert(0.6));
        builder.quad(dvec3(-1.0, 0.0, 1.0), DVec3::X * 2.0, DVec3::Z * -2.0, grey);
        builder.sphere(dvec3(0.2, 0.4, -0.1), 0.4, grey);
        builder.environment(Spectrum::splat(1.2));
        let settings = looking(dvec3(0.0, 0.8, 2.0), dvec3(0.0, 0.5, 0.0), projection, (8, 8));
        let scene = built(builder, CameraSettings { filter, ..settings });
        let [path, light, bdpt] = [("path", 64), ("light", 512), ("bdpt", 32)].map(|(method, samples)| {
            measure(&scene, plain(method).as_ref(), &format!("{name} {method}"), Budget::samples(samples).up_to(2))
        });
        for layer in 0..=2 {
            for (other, rendered) in [("light", &light), ("bdpt", &bdpt)] {
                let label = format!("{name}: path and {other}, order {layer}");
                // At its poles such a camera gives one over the sine of the angle to them, by light walks with a variance that is infinite.
                let poles = name == "all around" && other == "light";
                let add = if poles { Family::spare } else { Family::image };
                add(&mut family, label.clone(), path.image(layer), rendered.image(layer));
                let add = if poles { Family::spare } else { Family::block };
                for (i, pixels) in path.blocks(COLUMNS).iter().enumerate() {
                    let pair = [&path, rendered].map(|r| r.over(layer, pixels));
                    add(&mut family, format!("{label} block {i}"), pair[0], pair[1]);
                }
            }
        }
    }
    family.finish(0.6);
}

const LENS_RADIUS: f64 = 0.3;
const FOCUS: f64 = 2.0;

/// The share of the lens that sees the right of an edge, where the edge's plane lies at `depth` and a ray through the lens's
/// middle passes the edge at the distance `x` to its right. A ray from the lens's point ℓ meets that plane at
/// x + ℓ (1 − depth/focus): the circle of confusion has the radius R |1 − depth/focus|.
fn lit_share(x: f64, depth: f64) -> f64 {
    let radius = LENS_RADIUS * (1.0 - depth / FOCUS).abs();
    if x.abs() >= radius {
        return if x > 0.0 { 1.0 } else { 0.0 };
    }
    let a = x / radius;
    0.5 + (a * (1.0 - a * a).sqrt() + a.asin()) / std::f64::consts::PI
}

/// The edge of a shining half-plane across the view, in front of the plane of focus, in it and behind it.
#[test]
fn edges_are_blurred_by_the_circle_of_confusion() {
    const SIZE: u32 = 16;
    let mut family = Family::new("blurred edges");
    for depth in [1.0, FOCUS, 5.0] {
        let mut builder = SceneBuilder::new("edge");
        let black = builder.material(lambert(0.0));
        let (edge, reach) = (0.03 * depth, 0.6 * depth + LENS_RADIUS);
        let lamp = builder.quad(dvec3(edge, -reach, -depth), DVec3::X * reach, DVec3::Y * 2.0 * reach, black);
        builder.emit(lamp, shining(1.0));
        let lens = Projection::ThinLens { fov: 40.0, lens_radius: LENS_RADIUS, focus_distance: Some(FOCUS) };
        let scene = built(builder, looking(DVec3::ZERO, -DVec3::Z, lens, (SIZE, SIZE)));
        let half = 20f64.to_radians().tan();
        let truth = |column: u32| {
            const NODES: u32 = 4000;
            let at = |i: u32| f64::from(column) + (f64::from(i) + 0.5) / f64::from(NODES);
            let share = |i: u32| lit_share((2.0 * at(i) / f64::from(SIZE) - 1.0) * half * depth - edge, depth);
            Estimate::exact((0..NODES).map(share).sum::<f64>() / f64::from(NODES))
        };
        for (method, samples) in [("path", 64), ("light", 128), ("bdpt", 32)] {
            let budget = Budget::samples(samples).up_to(0);
            let rendered = measure(&scene, plain(method).as_ref(), &format!("{method} {depth}"), budget);
            let all = (0..SIZE).map(|column| truth(column).mean).sum::<f64>() / f64::from(SIZE);
            family.image(format!("{method}, depth {depth}"), rendered.image(0), Estimate::exact(all));
            for column in 0..SIZE {
                let of_column = over_column(&rendered, column as usize, SIZE as usize);
                family.block(format!("{method}, depth {depth}, column {column}"), of_column, truth(column));
            }
        }
    }
    family.finish(0.99);
}

fn over_column(rendered: &Rendered, column: usize, size: usize) -> Estimate {
    rendered.over(0, &(0..size).map(|row| row * size + column).collect::<Vec<_>>())
}

const CROPPED: &str = r#"
[camera]
type = "thin_lens"
position = [0.2, 0.1, 3]
target = [0, 0, 0]
lens_radius = 0.1
shift = [0.1, 0]
mirrored = true
width = 24
height = 20
filter = "mitchell"
crop = [3, 7, 17, 11]
[materials.white]
type = "lambert"
albedo = 0.5
[[shapes]]
type = "quad"
origin = [-1, -1, 0]
edge_u = [2, 0, 0]
edge_v = [0, 2, 0]
material = "white"
[[shapes]]
type = "sphere"
center = [0.3, 0.2, 0.8]
radius = 0.4
material = "white"
emission = 2
"#;

/// And is left out with a note in an image of another size.
#[test]
fn the_crop_of_a_scene_file_has_the_bits_of_the_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cropped.toml");
    std::fs::write(&path, CROPPED).unwrap();
    let load = |size| scenes::load(path.to_str().unwrap(), &LoadOptions { size, skip: Skip::Unneeded }).unwrap();
    let scene = load(None);
    let window = Window::of(&scene);
    assert_eq!(window, Window { x: 3..20, y: 7..18 });
    for name in ALL {
        let [part, whole] = [window.clone(), Window::whole(24, 20)].map(|window| rendered(&scene, name, window));
        for pixel in 0..part.pixels() {
            let place = (pixel / 17 + 7) * 24 + pixel % 17 + 3;
            for layer in 0..part.layers.len() {
                assert_eq!(part.mean(layer, pixel), whole.mean(layer, place), "{name}, pixel {pixel}, layer {layer}");
            }
        }
    }
    assert!(load(Some((24, 20))).crop.is_some() && scene.notes.is_empty());
    let other = load(Some((12, 10)));
    assert!(other.crop.is_none() && other.notes.iter().any(|note| note.contains("24x20")), "{:?}", other.notes);
}

fn rendered(scene: &Scene, name: &str, window: Window) -> Measurement {
    let method = plain(name);
    let settings = RenderSettings {
        orders: Orders::up_to(2),
        tail: false,
        samples_per_replicate: 4,
        seed: 5,
        sampler: SamplerKind::Zsobol,
        instance: name.to_owned(),
        role: Role::Estimate,
    };
    let mut render = Render::cropped(scene, method.as_ref(), settings, window).unwrap();
    (0..2).for_each(|_| render.run_replicate(&|_| {}));
    render.finish()
}
