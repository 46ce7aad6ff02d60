//! Every method carries the path classes that its light-path expression says, and no others: order by order its image is that of
//! `bdpt` restricted to the expression.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over methods, orders and blocks).

use crate::support::{Budget, Estimate, Family, furnished, grey, lambert, measure, method_with, room, seed, shining};
use glam::{DVec3, dvec3};
use integrators::lpe::Expression;
use integrators::render::request;
use integrators::{Bias, Orders, Part, PartSettings, PathClass, Render, RenderSettings, Window};
use sampling::sampler::{Role, SamplerKind};
use scenes::{Scene, Skip};
use serde_json::{Value, json};

const MAX_ORDER: usize = 4;

/// Every method without bias, in every variant that differs in what it carries or how.
fn methods() -> Vec<(&'static str, Value)> {
    vec![
        ("emission", json!({})),
        ("local", json!({})),
        ("whitted", json!({"roulette": "none"})),
        ("direct", json!({})),
        ("direct", json!({"strategy": "emitter"})),
        ("path", json!({"roulette": "none"})),
        ("path", json!({"roulette": "none", "strategy": "emitter"})),
        ("path", json!({"roulette": "none", "strategy": "bsdf"})),
        ("light", json!({"roulette": "none"})),
        ("pssmlt", json!({"roulette": "none"})),
        ("mmlt", json!({})),
    ]
}

/// What of an order `bdpt` has of each expression: means over the replicates' images, and over columns of pixels.
pub fn classes(scene: &Scene, order: usize, expressions: &[String]) -> Vec<Vec<Estimate>> {
    let method = method_with("bdpt", json!({"roulette": "none"}));
    let settings = RenderSettings {
        orders: Orders::parse(&order.to_string(), MAX_ORDER).unwrap(),
        tail: false,
        samples_per_replicate: 128,
        seed: seed(),
        sampler: SamplerKind::Stratified,
        instance: format!("bdpt, order {order}"),
        role: Role::Estimate,
    };
    let class =
        |(i, text): (usize, &String)| PathClass { name: i.to_string(), expression: Expression::parse(text).unwrap() };
    let parts =
        PartSettings { classes: expressions.iter().enumerate().map(class).collect(), ..PartSettings::default() };
    let request = request(scene, method.as_ref(), &settings, &parts).unwrap();
    let window = Window::whole(scene.camera.width(), scene.camera.height());
    let mut render = Render::of_request(scene, method.as_ref(), settings, window, request.clone()).unwrap();
    let regions = regions(scene);
    let mut values = vec![vec![Vec::new(); regions.len()]; expressions.len()];
    for _ in 0..144 {
        render.run_replicate(&|_| {});
        for (i, of_class) in values.iter_mut().enumerate() {
            let layer = request.layers().len()
                + request.parts().list().iter().position(|part| *part == Part::Class { name: i.to_string() }).unwrap();
            for (pixels, values) in regions.iter().zip(of_class) {
                values.push(
                    pixels.iter().map(|&p| grey(render.last_replicate(layer, p))).sum::<f64>() / pixels.len() as f64,
                );
            }
        }
    }
    values.iter().map(|of_class| of_class.iter().map(|values| Estimate::of(values)).collect()).collect()
}

/// The image, and its columns two by two.
pub fn regions(scene: &Scene) -> Vec<Vec<usize>> {
    let (width, pixels) = (scene.camera.width() as usize, (scene.camera.width() * scene.camera.height()) as usize);
    let columns = (0..width / 2).map(|column| (0..pixels).filter(|p| p % width / 2 == column).collect());
    std::iter::once((0..pixels).collect()).chain(columns).collect()
}

#[test]
fn every_method_carries_what_its_expression_says() {
    let scene = furnished([true, true]);
    let methods = methods();
    let expressions: Vec<String> =
        methods.iter().map(|(name, with)| method_with(name, with.clone()).expression().to_owned()).collect();
    let regions = regions(&scene);
    let rendered: Vec<_> = methods
        .iter()
        .map(|(name, with)| {
            let method = method_with(name, with.clone());
            assert_eq!(method.bias(), Bias::None);
            let last = *method.orders(MAX_ORDER).end();
            let budget = Budget { sampler: SamplerKind::Stratified, ..Budget::samples(256) };
            (last, measure(&scene, method.as_ref(), &format!("{name} {with}"), budget.up_to(last)))
        })
        .collect();
    let mut family = Family::new("expressions");
    for order in 0..=MAX_ORDER {
        let truth = classes(&scene, order, &expressions);
        for (i, ((name, with), (last, measured))) in methods.iter().zip(&rendered).enumerate() {
            for (number, (pixels, truth)) in regions.iter().zip(&truth[i]).enumerate() {
                let label = format!("{name} {with} {} order {order} region {number}", expressions[i]);
                if order > *last {
                    assert_eq!(truth.mean, 0.0, "{label}: its expression has paths of this order");
                    continue;
                }
                let own = measured.over(order, pixels);
                if own.mean == 0.0 {
                    assert_eq!(truth.mean, 0.0, "{label}");
                }
                // Chains find what they carry, but tell small differences less well; and what four mirrors show is rare.
                if ["pssmlt", "mmlt"].contains(name) {
                    family.spare(label, own, *truth)
                } else if number == 0 && order < MAX_ORDER {
                    family.image(label, own, *truth)
                } else {
                    family.block(label, own, *truth)
                }
            }
        }
    }
    family.finish(0.7);
}

/// Under a lamp that a screen hides from half of the floor: without shadows the floor is lit as if the screen were not there, and the
/// screen is seen all the same.
#[test]
fn without_shadows_nothing_stands_between_a_point_and_the_lamp() {
    let scene = |screen: bool| {
        let mut builder = room("screened");
        let black = builder.material(lambert(0.0));
        let lamp = builder.quad(dvec3(-0.3, 0.95, -0.3), DVec3::X * 0.6, DVec3::Z * 0.6, black);
        builder.emit(lamp, shining(3.0));
        if screen {
            // Edge-on to the camera, so that it hides nothing from it.
            builder.quad(dvec3(-0.5, 0.0, -0.9), DVec3::X, DVec3::Z * 1.8, black);
        }
        builder.build(Skip::Unneeded).unwrap()
    };
    let (open, screened) = (scene(false), scene(true));
    let image = |scene: &Scene, shadows: bool| {
        let method = method_with("local", json!({"shadows": shadows}));
        assert_eq!(method.bias() == Bias::None, shadows);
        measure(scene, method.as_ref(), &format!("{} {shadows}", scene.facts.primitives), Budget::samples(64).up_to(1))
    };
    let floor: Vec<usize> = (13 * 16..15 * 16).collect();
    let [with, without, bare] =
        [image(&screened, true), image(&screened, false), image(&open, true)].map(|r| r.over(1, &floor));
    assert!(with.mean < 0.8 * bare.mean, "the screen casts a shadow: {with:?} {bare:?}");
    let mut family = Family::new("no shadows");
    family.image("the floor", without, bare);
    family.finish(1.0);
}
