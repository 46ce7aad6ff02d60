//! Methods that merge vertices: their bias is what the kernel makes of it, falls as it must, and leaves what `bdpt` has.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over what it compares). A bias that is known is part of the truth that an image is
//! held against; one that is not is bounded, and the bound falls with the radius.

use crate::support::{
    Budget, Estimate, Family, Rendered, builtin, camera, lambert, measure, method, method_with, pixels_without_delta,
    room, shining,
};
use glam::{DVec3, dvec3};
use integrators::Bias;
use sampling::bsdf::{Bsdf, Dielectric, Mirror};
use sampling::math::Spectrum;
use scenes::{Scene, SceneBuilder, Skip};
use serde_json::{Value, json};

const METHODS: [&str; 2] = ["vcm", "ppm"];

/// Iterations in a replicate, and so many replicates.
fn iterations(samples: u32, replicates: u32, max_order: usize) -> Budget {
    Budget { samples, replicates, ..Budget::samples(1) }.up_to(max_order)
}

fn merging(scene: &Scene, name: &str, settings: Value, label: &str, budget: Budget) -> Rendered {
    let method = method_with(name, settings);
    assert_eq!(method.bias(), Bias::Consistent);
    measure(scene, method.as_ref(), &format!("{name}, {label}"), budget)
}

/// `a` may be off by this part of itself.
fn within(a: Estimate, bound: f64) -> Estimate {
    Estimate { error: a.error.hypot(bound * a.mean.abs()), ..a }
}

/// On a sphere the ball around a point cuts out exactly πr², so that merging estimates the mean of a disc of it, and all is uniform. What
/// photons come from below the horizon of where they are merged is lost, and the weights of a merge's two vertices differ: both
/// less than a part of r², in units of the sphere's radius.
#[test]
fn in_a_sphere_the_bias_is_below_the_square_of_the_radius() {
    let (albedo, emitted) = (0.6f32, 0.8f32);
    let mut builder = SceneBuilder::new("sphere");
    let wall = builder.material(lambert(albedo));
    let sphere = builder.sphere(DVec3::ZERO, 1.0, wall);
    builder.flip(sphere);
    builder.emit(sphere, shining(emitted));
    builder.camera(camera(dvec3(0.4, 0.3, 0.3), dvec3(0.1, 0.0, -1.0), 80.0, 8));
    let scene = builder.build(Skip::Unneeded).unwrap();
    for (radius, samples) in [(0.3, 8), (0.1, 16)] {
        let mut family = Family::new(format!("sphere, radius {radius}"));
        for name in METHODS {
            let settings = json!({"radius": radius, "roulette": "none"});
            let rendered = merging(&scene, name, settings, &radius.to_string(), iterations(samples, 256, 6));
            for order in 0..=6 {
                let truth = f64::from(emitted * albedo.powi(order));
                let estimate = rendered.image(order as usize);
                println!("{name} {radius} {order}: {} ± {}", estimate.mean / truth - 1.0, estimate.error / truth);
                let label = format!("{name} order {order}");
                family.image(label, within(estimate, radius * radius / 3.0), Estimate::exact(truth));
            }
        }
        family.finish(1.0);
    }
}

/// Height of a point emitter above a floor \[m\].
const HEIGHT: f64 = 0.5;

/// A floor under a point, seen from above. What the camera sees is 0.004 wide, nearly one point.
fn floor() -> Scene {
    let mut builder = SceneBuilder::new("floor");
    let white = builder.material(lambert(0.8));
    builder.quad(dvec3(-2.0, 0.0, 2.0), DVec3::X * 4.0, DVec3::Z * -4.0, white);
    builder.point_emitter(dvec3(0.0, HEIGHT, 0.0), Spectrum::ONE);
    builder.camera(camera(dvec3(0.0, 1.0, 0.0), DVec3::ZERO, 0.23, 16));
    builder.build(Skip::Unneeded).unwrap()
}

/// ρ/π times the irradiance h/(h²+x²)^(3/2), averaged over the disc of a radius around x = 0: ρ/π · 2 (1 − h/√(h²+r²)) / r².
fn seen_by_merging(radius: f64) -> f64 {
    0.8 / std::f64::consts::PI * 2.0 * (1.0 - HEIGHT / HEIGHT.hypot(radius)) / (radius * radius)
}

/// What merging sees on average over the first so many iterations.
fn expected(first_radius: f64, alpha: f64, iterations: u32) -> f64 {
    let seen = |i: u32| seen_by_merging(first_radius * f64::from(i).powf((alpha - 1.0) / 2.0));
    (1..=iterations).map(seen).sum::<f64>() / f64::from(iterations)
}

/// The mean of `ppm` after any number of iterations is that of the kernel, so that the bias is known exactly; and it falls as
/// n^(α−1), between one iteration and 64 by what the sum of the squared radii says.
#[test]
fn the_bias_is_the_kernels_and_falls_at_its_rate() {
    let scene = floor();
    let radius = 0.05 * f64::from(scene.bounds.radius);
    let truth = 0.8 / std::f64::consts::PI / (HEIGHT * HEIGHT);
    let mut family = Family::new("kernel");
    for alpha in [0.5, 0.75] {
        for (samples, replicates) in [(1, 8192), (16, 512), (64, 128)] {
            let settings = json!({"radius": 0.05, "alpha": alpha});
            let rendered =
                merging(&scene, "ppm", settings, &format!("α {alpha} {samples}"), iterations(samples, replicates, 1));
            let expected = expected(radius, alpha, rendered.measurement.samples_per_replicate);
            let estimate = rendered.image(1);
            let [bias, known] = [estimate.mean, expected].map(|mean| mean / truth - 1.0);
            println!("α {alpha} {samples}: bias {bias} ± {}, expected {known}", estimate.error / truth);
            family.image(format!("α {alpha}, {samples} iterations"), estimate, Estimate::exact(expected));
        }
        let bias = |iterations| expected(radius, alpha, iterations) / truth - 1.0;
        // r² to leading order: Σ i^(α−1) / n.
        let rate = (1..=64).map(|i| f64::from(i).powf(alpha - 1.0)).sum::<f64>() / 64.0;
        assert!((bias(64) / bias(1) / rate - 1.0).abs() < 0.1, "α {alpha}: {} {} {rate}", bias(64), bias(1));
    }
    family.finish(1.0);
}

/// A method held against `bdpt` order by order, in the pixels that show no mirror or glass: what these show of caustics `bdpt` hardly
/// finds. The bias is bounded by a part of the image.
fn agree(scene: &Scene, (radius, bound): (f64, f64), (samples, of_bdpt): (u32, u32)) {
    let pixels = pixels_without_delta(scene);
    let bdpt = measure(scene, method("bdpt").as_ref(), "bdpt", Budget::samples(of_bdpt).up_to(4));
    let mut family = Family::new(format!("merging and bdpt, {}", scene.name));
    for name in METHODS {
        let merged = merging(scene, name, json!({"radius": radius}), &scene.name, iterations(samples, 256, 4));
        for order in 0..=4 {
            let (a, b) = (merged.over(order, &pixels), bdpt.over(order, &pixels));
            println!("{name} order {order}: {} ± {}", a.mean / b.mean - 1.0, a.error.hypot(b.error) / b.mean);
            family.image(format!("{name} order {order}"), within(a, bound), b);
        }
    }
    family.finish(1.0);
}

#[test]
fn in_the_cornell_box_it_is_bdpt() {
    let scene = builtin("cornell_box", 16);
    agree(&scene, (0.02, 0.004), (16, 8));
}

#[test]
fn in_a_room_with_glass_it_is_bdpt() {
    let scene = builtin("glass_caustic", 16);
    agree(&scene, (0.02, 0.01), (16, 32));
}

/// A point lamp above a mirror and a floor: light that no walk from the camera can meet is merged.
#[test]
fn what_mirrors_send_from_a_point_is_merged() {
    let mut builder = room("point by mirror");
    let mirror = builder.material(Bsdf::from(Mirror { reflectance: Spectrum::splat(0.9) }));
    let glass = builder.material(Bsdf::from(Dielectric { eta: 1.5 }));
    builder.quad(dvec3(-0.98, -0.6, 0.6), DVec3::Z * -1.2, DVec3::Y * 1.2, mirror);
    builder.sphere(dvec3(0.4, -0.5, 0.1), 0.3, glass);
    builder.point_emitter(dvec3(0.3, 0.6, 0.2), Spectrum::ONE);
    let scene = builder.build(Skip::Unneeded).unwrap();
    // Vertices that the camera sees without a mirror: there light tracing has everything.
    let pixels = pixels_without_delta(&scene);
    let light = measure(&scene, method("light").as_ref(), "light", Budget::samples(64).up_to(4));
    let mut family = Family::new("a point by mirrors");
    for name in METHODS {
        let merged = merging(&scene, name, json!({"radius": 0.01}), "point", iterations(16, 256, 4));
        for order in 1..=4 {
            let (a, b) = (merged.over(order, &pixels), light.over(order, &pixels));
            println!("{name} order {order}: {} ± {}", a.mean / b.mean - 1.0, a.error.hypot(b.error) / b.mean);
            family.image(format!("{name} order {order}"), within(a, 0.004), b);
        }
    }
    family.finish(1.0);
}

#[test]
fn settings_that_cannot_be_are_refused_with_the_mend() {
    let refused = |name: &str, settings: Value| {
        integrators::Methods::standard().build(name, &settings).err().expect("refused").to_string()
    };
    for name in METHODS {
        for radius in [0.0, -1.0, 1.5] {
            let message = refused(name, json!({"radius": radius}));
            assert!(message.contains("setting `radius`") && message.contains("such as 0.003"), "{message}");
        }
        for alpha in [0.0, 1.0] {
            let message = refused(name, json!({"alpha": alpha}));
            assert!(message.contains("setting `alpha`") && message.contains("such as 0.75"), "{message}");
        }
    }
}

/// Photons are told of before they are kept.
#[test]
fn memory_is_bounded_and_told() {
    let request = integrators::Request::new(integrators::Orders::up_to(8), false);
    let bytes = method("vcm").bytes(1 << 16, &request);
    assert!((1 << 16..1 << 29).contains(&bytes), "{bytes}");
    assert_eq!(method("bdpt").bytes(1 << 16, &request), 0);
}
