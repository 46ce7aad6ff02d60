//! Radiosity against Monte Carlo, order by order: in a convex room inside its intervals, in the Cornell box with an error that falls as
//! elements are added; and what it refuses.
//!
//! False-alarm rate: 0.1 % for each test that compares with estimates (Šidák over what it compares).

use crate::classics::{classes, regions};
use crate::support::{
    Budget, Estimate, Family, Rendered, builtin, camera, grey, lambert, measure, measure_seeded, method, method_with,
    seed, shining,
};
use glam::{DVec3, dvec3};
use integrators::flux::Flux;
use integrators::radiosity::Radiosity;
use integrators::{Bias, Orders, Render, RenderSettings, Request};
use sampling::sampler::{Role, SamplerKind, StreamKey};
use scenes::{Scene, SceneBuilder, Skip};
use serde_json::json;

const MAX_ORDER: usize = 4;

/// Half of a cube seen from outside through its open front, all of whose walls the camera sees whole, under a ceiling that shines.
fn open_room(emitted: f32) -> Scene {
    let mut builder = SceneBuilder::new("open room");
    let [white, grey, dark] = [0.8, 0.5, 0.3].map(|albedo| builder.material(lambert(albedo)));
    let (x, y, z) = (DVec3::X * 2.0, DVec3::Y * 2.0, DVec3::Z);
    let (low, high) = (dvec3(-1.0, -1.0, 0.0), dvec3(1.0, 1.0, 1.0));
    builder.quad(low, z, x, white);
    let ceiling = builder.quad(high, -x, -z, grey);
    builder.emit(ceiling, shining(emitted));
    builder.quad(low, x, y, white);
    builder.quad(low, y, z, dark);
    builder.quad(high, -z, -y, white);
    builder.camera(camera(dvec3(0.1, 0.2, 4.9), DVec3::ZERO, 40.0, 16));
    builder.build(Skip::Unneeded).unwrap()
}

fn radiosity(scene: &Scene, elements: u32, basis: &str, refinement: &str) -> Rendered {
    let method = method_with("radiosity", json!({"elements": elements, "basis": basis, "refinement": refinement}));
    assert_eq!((method.bias(), method.expression()), (Bias::Mesh, "LD*E"));
    let budget = Budget { samples: 64, replicates: 64, sampler: SamplerKind::Stratified, ..Budget::samples(1) };
    // The same places on the film on every mesh, so that what differs is the mesh.
    measure(scene, method.as_ref(), "radiosity", budget.up_to(MAX_ORDER))
}

/// Errors of constant elements fall by a constant factor from mesh to mesh in what the camera sees of whole walls, so that three meshes tell the
/// factor and the limit [Richardson1911]; that and the finest linear elements lie inside the intervals of path tracing, every order.
#[test]
fn in_a_convex_room_every_order_converges_to_that_of_paths() {
    let scene = open_room(2.0);
    let budget = Budget { sampler: SamplerKind::Stratified, ..Budget::samples(64) };
    let path = measure(&scene, method("path").as_ref(), "path", budget.up_to(MAX_ORDER));
    let linear = radiosity(&scene, 10 * 256, "linear", "even");
    let constant = [10 * 16, 10 * 64, 10 * 256].map(|elements| radiosity(&scene, elements, "constant", "even"));
    let all = path.all();
    let mut family = Family::new("convex room");
    for order in 0..=MAX_ORDER {
        family.image(format!("linear elements, order {order}"), linear.image(order), path.image(order));
        for (number, pixels) in path.blocks(4).iter().enumerate() {
            let label = format!("linear elements, order {order}, block {number}");
            family.block(label, linear.over(order, pixels), path.over(order, pixels));
        }
        if order == 0 {
            continue;
        }
        let values = constant.each_ref().map(|rendered| rendered.replicates_over(order, &all));
        let [coarse, middle, fine] = values.each_ref().map(|v| Estimate::of(v).mean);
        let ratio = (coarse - middle) / (middle - fine);
        println!("order {order}: {coarse:.6} {middle:.6} {fine:.6}, differences fall by {ratio:.2}");
        assert!(ratio > 2.5, "order {order}: {coarse} {middle} {fine}");
        let both = values[1].iter().zip(&values[2]);
        let limit: Vec<f64> = both.map(|(middle, fine)| fine + (fine - middle) / (ratio - 1.0)).collect();
        let limit = Estimate::of(&limit);
        family.image(format!("constant elements, extrapolated, order {order}"), limit, path.image(order));
    }
    family.finish(0.7);
}

/// What it carries is `LD*E`: what of `bdpt`'s light that expression has, order by order and column by column.
#[test]
fn it_carries_what_its_expression_says() {
    let mut scene = open_room(2.0);
    scene.camera.set_size(8, 8);
    let rendered = radiosity(&scene, 2560, "linear", "error");
    let mut family = Family::new("LD*E");
    for order in 0..=3 {
        let truth = classes(&scene, order, &["LD*E".to_owned()]);
        for (number, (pixels, truth)) in regions(&scene).iter().zip(&truth[0]).enumerate() {
            let (label, own) = (format!("order {order} region {number}"), rendered.over(order, pixels));
            if number == 0 { family.image(label, own, *truth) } else { family.block(label, own, *truth) }
        }
    }
    family.finish(0.7);
}

/// Where blocks stand in the way, what a mesh misses are the borders of shadows: the error of the image, in blocks of 4 × 4 pixels, falls
/// with every refinement.
#[test]
fn in_the_cornell_box_the_error_falls_with_the_elements() {
    let scene = builtin("cornell_box", 32);
    let budget = Budget { sampler: SamplerKind::Stratified, ..Budget::samples(32) };
    let path = measure(&scene, method("path").as_ref(), "path", budget.up_to(3));
    let blocks = path.blocks(8);
    let meshes = [125, 500, 2000].map(|elements| (elements, radiosity(&scene, elements, "linear", "error")));
    for order in 1..=3 {
        let truth: Vec<Estimate> = blocks.iter().map(|pixels| path.over(order, pixels)).collect();
        let mean = truth.iter().map(|t| t.mean).sum::<f64>() / truth.len() as f64;
        let noise = truth.iter().map(|t| t.error * t.error).sum::<f64>() / truth.len() as f64;
        let [coarse, middle, fine] = meshes.each_ref().map(|(elements, rendered)| {
            let off = |(pixels, truth): (&Vec<usize>, &Estimate)| rendered.over(order, pixels).mean - truth.mean;
            let squares = blocks.iter().zip(&truth).map(|both| off(both).powi(2)).sum::<f64>() / truth.len() as f64;
            let square = (squares - noise) / (mean * mean);
            let of_mean = rendered.image(order).mean / path.image(order).mean - 1.0;
            println!(
                "order {order}, {elements} elements: mean square error {square:.2e} of the squared mean, noise {:.2e} taken off; mean off by \
                 {:+.3} %",
                noise / (mean * mean),
                100.0 * of_mean
            );
            (square, of_mean)
        });
        // Noise is taken off up to what its own chance leaves, which is less than a third of it in 64 blocks.
        let chance = 0.3 * noise / (mean * mean);
        assert!(
            middle.0 < 0.5 * coarse.0 && fine.0 < 0.1 * coarse.0 + chance,
            "order {order}: {coarse:?} {middle:?} {fine:?}"
        );
        assert!(fine.1.abs() < 0.01 && fine.1.abs() < coarse.1.abs() + 0.002, "order {order}: {coarse:?} {fine:?}");
    }
}

/// What escapes by the solution's ledger is what escapes of walks from the emitters, order by order: a ledger can add up and be wrong.
#[test]
fn what_escapes_is_what_escapes_of_walks() {
    let mut family = Family::new("escape");
    for (scene, bound) in [(open_room(2.0), 0.0), (builtin("cornell_box", 16), 0.004)] {
        let settings: Radiosity = serde_json::from_value(json!({"elements": 2560})).unwrap();
        let solution = settings.solve(&scene, &Request::new(Orders::up_to(MAX_ORDER), false)).unwrap();
        let key = |replicate| StreamKey::new(seed(), "flux", Role::Estimate, replicate);
        let walks: Vec<Flux> = (0..32).map(|r| Flux::of(&scene, &[], MAX_ORDER, key(r), 32_768)).collect();
        for (order, flux) in solution.report.flux.iter().enumerate() {
            let escaped: Vec<f64> = walks.iter().map(|walks| grey(walks.escaped[order])).collect();
            let walked = Estimate::of(&escaped);
            println!("{} order {order}: off by {:+.3e}", scene.name, flux.escaped / walked.mean - 1.0);
            // The mesh may be off by so much of it where blocks cast shadows.
            let walked = Estimate { error: walked.error.hypot(bound * walked.mean), ..walked };
            family.image(format!("{} order {order}", scene.name), walked, Estimate::exact(flux.escaped));
        }
    }
    family.finish(1.0);
}

/// Twice the light is twice every order, to the bit: the mesh and what is hidden do not depend on the light's unit.
#[test]
fn orders_are_linear_in_the_light() {
    let images = [1.0, 2.0].map(|emitted| {
        let method = method_with("radiosity", json!({"elements": 200}));
        let budget = Budget { samples: 1, replicates: 2, ..Budget::samples(1) };
        let rendered = measure_seeded(&open_room(emitted), method.as_ref(), "linear", budget.up_to(3), seed());
        (0..4 * 256).map(|i| rendered.measurement.mean(i / 256, i % 256)).collect::<Vec<_>>()
    });
    let twice: Vec<_> = images[0].iter().map(|channels| channels.map(|c| 2.0 * c)).collect();
    assert_eq!(twice, images[1]);
}

/// One solution serves all replicates, and its rays are counted with them.
#[test]
fn the_solution_is_made_once_and_counted() {
    let scene = builtin("cornell_box", 16);
    let method = method_with("radiosity", json!({"elements": 400}));
    let mut render = Render::new(&scene, method.as_ref(), settings()).unwrap();
    (0..3).for_each(|_| render.run_replicate(&|_| {}));
    let measured = render.finish();
    let pixels = 16 * 16 * 3;
    assert_eq!((measured.counters.closest, measured.counters.camera_paths), (pixels, pixels));
    assert!(measured.counters.shadow > 100_000);
}

fn settings() -> RenderSettings {
    RenderSettings {
        orders: Orders::up_to(3),
        tail: true,
        samples_per_replicate: 1,
        seed: seed(),
        sampler: SamplerKind::Independent,
        instance: "radiosity".to_owned(),
        role: Role::Estimate,
    }
}

#[test]
fn scenes_that_it_cannot_carry_are_refused_with_the_reason_and_what_would_do() {
    for (name, reason) in [
        ("glass_caustic", "does more than scatter by Lambert's law"),
        ("veach_mis", "does more than scatter by Lambert's law"),
        ("integrating_sphere", "no flat triangles"),
    ] {
        let scene = builtin(name, 4);
        let message = Render::new(&scene, method("radiosity").as_ref(), settings()).err().unwrap().to_string();
        println!("{message}");
        assert!(message.starts_with("radiosity cannot render this scene: ") && message.contains(reason), "{message}");
        assert!(message.contains("use path or bdpt"), "{message}");
    }
}
