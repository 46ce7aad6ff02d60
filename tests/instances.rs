//! Instances of groups: what they show is what copies show, by every method and order.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over its methods, orders and blocks).

use crate::support::{Budget, COLUMNS, Entry, Family, agree, block, lambert, measure, method, room, shining};
use glam::{DAffine3, DMat3, DVec3, dvec3};
use scenes::{MaterialId, Scene, SceneBuilder, ShapeId, Skip};

/// What stands in the room, and where: as instances, or written out.
#[derive(Clone, Copy, PartialEq)]
enum Made {
    Placed,
    Copied,
}

/// A ball, a tube and a small lamp on a table; only similarities leave them what they are.
fn table(builder: &mut SceneBuilder, [grey, shiny]: [MaterialId; 2]) -> Vec<ShapeId> {
    let before = builder.quad(dvec3(-0.3, -0.2, 0.2), dvec3(0.6, 0.0, 0.0), dvec3(0.0, 0.0, -0.4), grey);
    let ball = builder.sphere(dvec3(-0.15, -0.08, 0.0), 0.12, shiny);
    let tube = builder.cylinder(dvec3(0.18, -0.2, 0.05), dvec3(0.2, 0.05, 0.0), 0.06, grey);
    let lamp = builder.disk(dvec3(0.0, 0.25, 0.0), dvec3(0.15, 0.0, 0.0), dvec3(0.0, 0.02, 0.1), grey);
    builder.emit(lamp, shining(9.0));
    vec![before, ball, tube, lamp]
}

/// A block and a leaning disk, which any affine map leaves what they are.
fn blocks(builder: &mut SceneBuilder, [grey, shiny]: [MaterialId; 2]) -> Vec<ShapeId> {
    block(builder, dvec3(-0.2, -0.3, -0.1), dvec3(0.1, 0.2, 0.15), grey);
    // The block is the shape before.
    let disk = builder.disk(dvec3(0.2, 0.0, 0.1), dvec3(0.2, 0.05, 0.0), dvec3(0.0, 0.1, 0.2), shiny);
    vec![ShapeId(disk.0 - 1), disk]
}

fn tables() -> [DAffine3; 3] {
    let at = |x: f64, y: f64, z: f64| DAffine3::from_translation(dvec3(x, y, z));
    let mirror = DAffine3::from_scale(dvec3(-1.2, 1.2, 1.2));
    [at(-0.5, -0.7, 0.3), at(0.5, -0.6, 0.0) * DAffine3::from_rotation_y(0.7), at(-0.2, 0.3, -0.4) * mirror]
}

fn stretched() -> [DAffine3; 3] {
    let shear = DMat3::from_cols(dvec3(1.0, 0.3, 0.0), dvec3(0.0, -0.7, 0.2), dvec3(0.4, 0.0, 1.4));
    let at = |x: f64, y: f64, z: f64, map: DMat3| DAffine3::from_mat3_translation(map, dvec3(x, y, z));
    [
        at(0.6, 0.4, 0.1, DMat3::from_diagonal(dvec3(0.5, 1.5, 1.0))),
        at(-0.6, 0.1, -0.5, shear),
        at(0.0, -0.8, 0.6, DMat3::from_diagonal(dvec3(1.5, 0.4, -0.8))),
    ]
}

fn furnished(made: Made) -> Scene {
    let mut builder = room(if made == Made::Placed { "instances" } else { "copies" });
    let materials = [0.6, 0.3].map(|albedo| builder.material(lambert(albedo)));
    type Add = fn(&mut SceneBuilder, [MaterialId; 2]) -> Vec<ShapeId>;
    let groups: [(&str, Add, [DAffine3; 3]); 2] = [("table", table, tables()), ("blocks", blocks, stretched())];
    for (name, add, maps) in groups {
        match made {
            Made::Placed => {
                let group = builder.begin_group(name);
                add(&mut builder, materials);
                builder.end_group();
                // The last of them by way of a group of its own.
                let outer = builder.begin_group(&format!("{name} within"));
                builder.instance(group, maps[2]);
                builder.end_group();
                builder.instance(group, maps[0]);
                builder.instance(group, maps[1]);
                builder.instance(outer, DAffine3::IDENTITY);
            }
            Made::Copied => {
                for map in maps {
                    let shapes = add(&mut builder, materials);
                    shapes.into_iter().for_each(|shape| builder.transform(shape, map));
                }
            }
        }
    }
    let scene = builder.build(Skip::Unneeded).unwrap();
    let counts = scene.counts();
    assert_eq!((counts.emitters, counts.instances), (3, if made == Made::Placed { 6 } else { 0 }));
    scene
}

/// Orders 0 to 3 of the instances by each method, against copies by path tracing.
#[test]
fn instances_show_what_copies_show() {
    let mut family = Family::new("instances and copies");
    let copies = measure(&furnished(Made::Copied), method("path").as_ref(), "copies", Budget::samples(32).up_to(3));
    let scene = furnished(Made::Placed);
    for (name, samples) in [("direct", 32), ("path", 32), ("light", 64), ("bdpt", 12)] {
        let method = method(name);
        let rendered =
            measure(&scene, method.as_ref(), &format!("instances {name}"), Budget::samples(samples).up_to(3));
        for order in method.orders(3) {
            let label = format!("{name} order {order}");
            family.image(&label, rendered.image(order), copies.image(order));
            for (i, block) in rendered.blocks(COLUMNS).iter().enumerate() {
                family.block(format!("{label} block {i}"), rendered.over(order, block), copies.over(order, block));
            }
        }
    }
    family.finish(0.8);
}

/// Every pair of methods, on instances under light that mirrors and glass bring.
#[test]
fn methods_agree_on_instances() {
    use sampling::bsdf::{Dielectric, Mirror};
    use sampling::math::Spectrum;
    let mut builder = room("mirrors and glass in groups");
    let mirror = builder.material(Mirror { reflectance: Spectrum::splat(0.8) });
    let glass = builder.material(Dielectric { eta: 1.5 });
    let grey = builder.material(lambert(0.5));
    let group = builder.begin_group("ornament");
    builder.sphere(DVec3::ZERO, 0.3, glass);
    block(&mut builder, dvec3(-0.4, -0.5, -0.4), dvec3(0.4, -0.35, 0.4), grey);
    builder.quad(dvec3(-0.3, -0.35, -0.38), dvec3(0.6, 0.0, 0.0), dvec3(0.0, 0.8, 0.0), mirror);
    builder.end_group();
    // A flattened ball of glass, and a tall one turned over.
    let at = |x: f64, y: f64, scale: DVec3| {
        DAffine3::from_translation(dvec3(x, y, 0.0)) * DAffine3::from_rotation_y(0.4) * DAffine3::from_scale(scale)
    };
    builder.instance(group, at(-0.5, -0.6, dvec3(1.0, 0.6, 1.0)));
    builder.instance(group, at(0.45, -0.3, dvec3(0.8, -1.1, 0.8)));
    let lamp = builder.quad(dvec3(-0.5, 0.99, -0.5), dvec3(1.0, 0.0, 0.0), dvec3(0.0, 0.0, 1.0), grey);
    builder.emit(lamp, shining(4.0));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let entries = [
        Entry::new("direct", 64).by_night(4),
        Entry::new("path", 128).without_roulette().by_night(4),
        Entry::new("light", 96).without_roulette().by_night(4),
        Entry::new("bdpt", 48).without_roulette().by_night(4),
    ];
    agree("methods on instances", &scene, 4, &entries, 0.5);
}

/// Leaving nothing out changes nothing.
#[test]
fn skips_change_no_instance() {
    let build = |skip: Skip| {
        let mut builder = room("skips");
        let grey = builder.material(lambert(0.5));
        let group = builder.begin_group("blocks");
        blocks(&mut builder, [grey, grey]);
        builder.end_group();
        stretched().into_iter().for_each(|map| builder.instance(group, map));
        builder.environment(sampling::math::Spectrum::ONE);
        builder.build(skip).unwrap()
    };
    let [skipped, whole] = [Skip::Unneeded, Skip::Nothing].map(build);
    assert_eq!(skipped.hash, whole.hash);
    let budget = Budget::samples(1).up_to(2);
    let [a, b] = [&skipped, &whole].map(|scene| measure(scene, method("path").as_ref(), "skips", budget));
    for order in 0..=2 {
        assert_eq!(a.image(order).mean, b.image(order).mean, "order {order}");
    }
}
