//! Radiosity against Monte Carlo, order by order: in convex enclosures inside its intervals, in the Cornell box with an error that falls as
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

/// A closed octahedron, all of whose faces have albedos of their own and two of which shine: an integrating sphere of polygons.
fn octahedron() -> Scene {
    let mut text = "[camera]\nposition = [0.1, 0, 0]\ntarget = [0, 0, 1]\n".to_owned();
    for face in 0..8u32 {
        let sign = |axis: u32| if face >> axis & 1 == 0 { 1.0 } else { -1.0 };
        let turned = if sign(0) * sign(1) * sign(2) > 0.0 { [0, 2, 1] } else { [0, 1, 2] };
        let albedo = 0.2 + 0.1 * f64::from(face);
        let emission = [3.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0][face as usize];
        let shines = if emission > 0.0 { format!("emission = {emission}\n") } else { String::new() };
        text += &format!(
            "[materials.face{face}]\ntype = \"lambert\"\nalbedo = {albedo:.1}\n[[shapes]]\ntype = \"mesh\"\nmaterial = \"face{face}\"\n{shines}\
             vertices = [[{:?}, 0, 0], [0, {:?}, 0], [0, 0, {:?}]]\nfaces = [{turned:?}]\n",
            sign(0),
            0.7 * sign(1),
            1.2 * sign(2)
        );
    }
    let origin =
        scenes::description::Origin { scene: "octahedron", file: "octahedron.toml", folder: None, attachments: &[] };
    scenes::description::read(&text, origin, None).unwrap().build(Skip::Unneeded).unwrap()
}

/// What arrives at each face \[W\], order by order, with no camera in between: constant elements of three meshes, extrapolated, and linear
/// ones lie inside the intervals of walks from the emitters; the largest change falls by a constant factor from mesh to mesh.
#[test]
fn in_a_closed_octahedron_every_order_converges_on_every_face() {
    let scene = octahedron();
    let arriving = |elements: u32, basis: &str| -> Vec<[f64; 8]> {
        let settings = json!({"elements": elements, "basis": basis, "refinement": "even"});
        let settings: Radiosity = serde_json::from_value(settings).unwrap();
        let solution = settings.solve(&scene, &Request::new(Orders::up_to(MAX_ORDER), false)).unwrap();
        assert_eq!((solution.mesh().elements().len(), solution.mesh().is_convex()), (elements as usize, true));
        assert!(solution.report.imbalance < 1e-6);
        let of_order = |order: usize| {
            let mut sums = [0.0; 8];
            for (element, irradiance) in solution.mesh().elements().iter().zip(solution.irradiance(order).unwrap()) {
                let face = (0..3).map(|axis| usize::from(element.panel.centre[axis] < 0.0) << axis).sum::<usize>();
                sums[face] += element.panel.area * irradiance[0].iter().sum::<f64>() / 3.0;
            }
            sums
        };
        (1..=MAX_ORDER).map(of_order).collect()
    };
    let [coarse, middle, fine] = [512, 2048, 8192].map(|elements| arriving(elements, "constant"));
    let linear = arriving(2048, "linear");
    let regions: Vec<_> = (0..8).map(|face| scene.region(&format!("face{face}")).unwrap()).collect();
    let key = |replicate| StreamKey::new(seed(), "octahedron", Role::Estimate, replicate);
    let walks: Vec<Flux> = (0..256).map(|r| Flux::of(&scene, &regions, MAX_ORDER, key(r), 16_384)).collect();
    let mut family = Family::new("closed octahedron");
    for order in 1..=MAX_ORDER {
        let at = order - 1;
        let change = |a: &[[f64; 8]], b: &[[f64; 8]]| (0..8).map(|f| (a[at][f] - b[at][f]).abs()).fold(0.0, f64::max);
        // Of what is emitted, the same all over a face, nothing depends on the mesh: order 1 is form factors alone.
        let ratio = if order == 1 { f64::INFINITY } else { change(&coarse, &middle) / change(&middle, &fine) };
        println!("order {order}: the largest change falls by {ratio:.2}");
        assert!(ratio > 2.5, "order {order}: {coarse:?} {middle:?} {fine:?}");
        let all = |of: &[[f64; 8]]| of[at].iter().sum::<f64>();
        let arrived = walks.iter().map(|walks| walks.meters.iter().map(|meter| grey(meter.arriving[at])).sum());
        family.image(
            format!("linear elements, order {order}"),
            Estimate::of(&arrived.collect::<Vec<_>>()),
            Estimate::exact(all(&linear)),
        );
        for face in 0..8 {
            let arrived: Vec<f64> = walks.iter().map(|walks| grey(walks.meters[face].arriving[at])).collect();
            let limit = fine[at][face] + (fine[at][face] - middle[at][face]) / (ratio - 1.0);
            let [limit, linear] = [limit, linear[at][face]];
            println!("  face {face}: fine {:.6}, extrapolated {limit:.6}, linear {linear:.6}", fine[at][face]);
            for (basis, found) in [("constant elements, extrapolated", limit), ("linear elements", linear)] {
                let label = format!("{basis}, order {order}, face {face}");
                family.block(label, Estimate::of(&arrived), Estimate::exact(found));
            }
        }
    }
    family.finish(0.7);
}

/// What it carries is `LD*E`: what of `bdpt`'s light that expression has, order by order and column by column.
#[test]
fn it_carries_what_its_expression_says() {
    let mut scene = open_room(2.0);
    scene.camera.set_size(8, 8);
    let rendered = radiosity(&scene, 1280, "linear", "error");
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
    let meshes = [80, 200, 480].map(|elements| (elements, radiosity(&scene, elements, "linear", "error")));
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
        let settings: Radiosity = serde_json::from_value(json!({"elements": 800})).unwrap();
        let solution = settings.solve(&scene, &Request::new(Orders::up_to(MAX_ORDER), false)).unwrap();
        let key = |replicate| StreamKey::new(seed(), "flux", Role::Estimate, replicate);
        let walks: Vec<Flux> = (0..256).map(|r| Flux::of(&scene, &[], MAX_ORDER, key(r), 4_096)).collect();
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

/// Scene files of a floor under a lamp and one more thing each: textures are carried, all else is refused, with what is to blame, why, and what
/// would do instead.
#[test]
fn scenes_that_it_cannot_carry_are_refused_with_the_reason_and_what_would_do() {
    let quad = |y: f32, material: &str, more: &str| {
        format!(
            "[[shapes]]\ntype = \"quad\"\norigin = [-1, {y}, 1]\nedge_u = [2, 0, 0]\nedge_v = [0, 0, -2]\nmaterial = \"{material}\"\n{more}\n"
        )
    };
    let room =
        "[camera]\nposition = [0, 0.5, 3]\ntarget = [0, 0.5, 0]\n[materials.grey]\ntype = \"lambert\"\nalbedo = 0.5\n"
            .to_owned()
            + &quad(0.0, "grey", "")
            + &quad(1.0, "grey", "emission = 1\nflip = true");
    let made_of = |words: &str| format!("[materials.other]\n{words}\n") + &quad(0.5, "other", "");
    let shape = |words: &str| format!("[[shapes]]\n{words}\nmaterial = \"grey\"\n");
    let lit_by = |words: &str| format!("[[emitters]]\n{words}\n");
    let directions = "the material `other` does more than scatter by Lambert's law, and a radiosity knows no directions; use path or bdpt, or make \
                      the material lambert";
    let beneath = "the material `other` lets light through beneath the surface (subsurface), which it cannot follow; use a method that can (path, ";
    let holes = "the material `other` has an opacity, and its elements are met everywhere; use path or bdpt";
    let curved = "that are no flat triangles (spheres, disks, cylinders, instances, or meshes with vertex normals); use path or bdpt, or give them \
                  as meshes without normals";
    let no_surface = "lit by a point, a spot, a direction or the sky, and only surfaces are elements; use path or bdpt, or let a surface shine";
    let instance = "[[groups]]\nname = \"tile\"\n".to_owned()
        + &quad(0.5, "grey", "").replace("[[shapes]]", "[[groups.shapes]]")
        + "[[shapes]]\ntype = \"instance\"\ngroup = \"tile\"\ntransform = [{ translate = [0, 0.1, 0] }]\n";
    let cases = [
        ("glass", made_of("type = \"dielectric\"\neta = 1.5"), directions),
        (
            "glossy",
            made_of("type = \"rough_conductor\"\nmetal = \"aluminium\"\nalpha_x = 0.1\nalpha_y = 0.3"),
            directions,
        ),
        ("mirror", made_of("type = \"conductor\"\nmetal = \"silver\""), directions),
        (
            "bumps",
            made_of("type = \"lambert\"\nalbedo = 0.5\nbump_map = { noise = { low = 0, high = 0.01, size = 0.1 } }"),
            directions,
        ),
        ("skin", made_of("type = \"subsurface\"\nalbedo = 0.5\nmean_free_path = 0.01"), beneath),
        ("holes", made_of("type = \"lambert\"\nalbedo = 0.5\nopacity = 0.5"), holes),
        ("sphere", shape("type = \"sphere\"\ncenter = [0, 0.5, 0]\nradius = 0.1"), curved),
        ("instance", instance, curved),
        ("point", lit_by("type = \"point\"\nposition = [0, 0.5, 0]\nintensity = 1"), no_surface),
        (
            "spot",
            lit_by(
                "type = \"spot\"\nposition = [0, 0.9, 0]\ntarget = [0, 0, 0]\nintensity = 1\ncutoff = 30\nbeam = 20",
            ),
            no_surface,
        ),
        ("sun", lit_by("type = \"directional\"\ndirection = [0.2, -1, 0]\nirradiance = 3"), no_surface),
        ("sky", lit_by("type = \"constant\"\nradiance = 1"), no_surface),
        (
            "texture",
            made_of("type = \"lambert\"\nalbedo = { ramp = { base = 0.5, slope = 0.3, axis = [1, 0, 0] } }"),
            "",
        ),
    ];
    for (name, words, reason) in cases {
        let file = format!("{name}.toml");
        let origin = scenes::description::Origin { scene: name, file: &file, folder: None, attachments: &[] };
        let read = scenes::description::read(&(room.clone() + &words), origin, None);
        let scene =
            read.and_then(|builder| builder.build(Skip::Unneeded)).unwrap_or_else(|error| panic!("{name}: {error}"));
        let message =
            Render::new(&scene, method("radiosity").as_ref(), settings()).err().map(|error| error.to_string());
        println!("{name}: {message:?}");
        match message {
            None => assert_eq!(reason, "", "{name}"),
            Some(message) => {
                assert!(message.starts_with("radiosity cannot render this scene: "), "{name}: {message}");
                assert!(!reason.is_empty() && message.contains(reason), "{name}: {message}");
            }
        }
    }
}
