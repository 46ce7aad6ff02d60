//! Albedos, indices and roughnesses at the ends of their ranges, and paths of ten thousand scatterings.

use super::{EMITTED, EQUILIBRIUM, enclosure, furnace, is_a_furnace, is_in_equilibrium};
use crate::support::{ALL, Estimate, Family, camera, grey, lambert, method, plain, seed, shining};
use glam::{DVec3, dvec3};
use integrators::{Orders, Render, RenderSettings};
use sampling::bsdf::{Bsdf, Dielectric, RoughConductor, RoughDielectric};
use sampling::math::Spectrum;
use sampling::sampler::{Role, SamplerKind};
use scenes::{Scene, SceneBuilder, Skip};

/// A uniform enclosure of another albedo.
pub(super) fn enclosure_of(albedo: f32, size: u32) -> Scene {
    let mut builder = SceneBuilder::new("enclosure");
    let wall = builder.material(lambert(albedo));
    enclosure(&mut builder, wall, EMITTED);
    builder.camera(camera(dvec3(0.1, 0.2, 0.85), dvec3(0.0, 0.0, -1.0), 70.0, size));
    builder.build(Skip::Unneeded).unwrap()
}

#[test]
fn albedos_from_nothing_to_all() {
    let mut family = Family::new("albedos");
    for albedo in [0.0, 1e-6, 1.0 - 1e-6, 1.0] {
        is_a_furnace(&mut family, &enclosure_of(albedo, 4), &format!("albedo {albedo}"), &ALL, 32, (albedo, EMITTED));
    }
    family.finish(0.9);
}

/// In a ball of albedo 0.999 every order to the ten thousandth is ρᵏ e, and together they are e (1 − ρ¹⁰⁰⁰¹)/(1 − ρ). What is seen from any
/// point of a ball's wall is the same, so that path tracing has hardly any variance: what would show is rounding.
#[test]
fn ten_thousand_scatterings() {
    const LAST: usize = 10_000;
    let albedo = 0.999_f32;
    let mut builder = SceneBuilder::new("ball from within");
    let wall = builder.material(lambert(albedo));
    let ball = builder.sphere(DVec3::ZERO, 1.0, wall);
    builder.flip(ball);
    builder.emit(ball, shining(EMITTED));
    builder.camera(camera(dvec3(0.1, 0.2, 0.3), dvec3(0.0, 0.0, -1.0), 70.0, 1));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let mut family = Family::new("ten thousand scatterings");
    for (name, samples) in [("path", 1), ("light", 16)] {
        let method = plain(name);
        let settings = RenderSettings {
            orders: Orders::up_to(LAST),
            tail: false,
            samples_per_replicate: samples,
            seed: seed(),
            sampler: SamplerKind::Independent,
            instance: name.to_owned(),
            role: Role::Estimate,
        };
        let mut render = Render::new(&scene, method.as_ref(), settings).unwrap();
        let looked_at: Vec<usize> = (0..=LAST).step_by(1000).collect();
        let (mut orders, mut sums) = (vec![Vec::new(); looked_at.len()], Vec::new());
        for _ in 0..128 {
            render.run_replicate(&|_| {});
            let value = |layer: usize| grey(render.last_replicate(layer, 0));
            looked_at.iter().zip(&mut orders).for_each(|(&order, values)| values.push(value(order)));
            sums.push((0..=LAST).map(value).sum::<f64>());
        }
        let power = |k: usize| f64::from(albedo).powi(k as i32);
        for (&order, values) in looked_at.iter().zip(&orders) {
            let exact = f64::from(EMITTED) * power(order);
            family.block(format!("{name}, order {order}"), Estimate::of(values), Estimate::exact(exact));
        }
        let all = f64::from(EMITTED) * (1.0 - power(LAST + 1)) / (1.0 - f64::from(albedo));
        family.image(format!("{name}, all orders"), Estimate::of(&sums), Estimate::exact(all));
    }
    // Of the single orders of `light` few decide; all together they do.
    family.finish(0.5);
}

/// What each of a million samples brings adds up to a million times that: sums do not stop growing where a sample is small beside them.
#[test]
fn a_million_samples_of_one_value() {
    let scene = enclosure_of(0.5, 1);
    let method = method("emission");
    let settings = RenderSettings {
        orders: Orders::up_to(0),
        tail: false,
        samples_per_replicate: 1 << 20,
        seed: seed(),
        sampler: SamplerKind::Independent,
        instance: "emission".to_owned(),
        role: Role::Estimate,
    };
    let mut render = Render::new(&scene, method.as_ref(), settings).unwrap();
    render.run_replicate(&|_| {});
    let value = grey(render.last_replicate(0, 0));
    assert!((value / f64::from(EMITTED) - 1.0).abs() < 1e-9, "{value}");
}

/// An enclosure with a ball that absorbs nothing.
fn with_ball(material: Bsdf) -> Scene {
    let mut builder = furnace("enclosure with a ball", 8);
    let material = builder.material(material);
    builder.sphere(dvec3(0.0, 0.1, -0.2), 0.6, material);
    builder.build(Skip::Unneeded).unwrap()
}

/// Glass of any index is in equilibrium with what is around it: at 1, where it is not there, a millionth beside that, where reflections
/// and total reflection begin, and at 10 and a tenth, where nearly nothing leaves it.
#[test]
fn glass_of_any_index() {
    let mut family = Family::new("indices");
    for eta in [1.0, 1.0 + 1e-6, 1.0 - 1e-6, 1.5, 1.0 / 1.5, 10.0, 0.1] {
        is_in_equilibrium(&mut family, &with_ball(Dielectric { eta }.into()), &format!("index {eta}"), 96, EQUILIBRIUM);
    }
    family.finish(0.9);
}

/// Nearly smooth metal and glass lose nothing but what facets hide from one another, of the order of the roughness' square: they are
/// in equilibrium as a mirror and smooth glass are.
#[test]
fn roughness_down_to_nothing() {
    let mut family = Family::new("roughness");
    for alpha in [1e-4, 3e-4, 1e-3] {
        let metal = RoughConductor::from_reflectance(Spectrum::ONE, alpha, alpha);
        let glass = RoughDielectric::new(1.5, alpha, alpha);
        let label = |name: &str| format!("{name} of roughness {alpha:e}");
        is_in_equilibrium(&mut family, &with_ball(metal.into()), &label("metal"), 16, EQUILIBRIUM);
        is_in_equilibrium(&mut family, &with_ball(glass.into()), &label("glass"), 32, EQUILIBRIUM);
    }
    family.finish(0.9);
}

/// A slab of glass, and one of air in glass, seen under every angle: what is inside it is reflected totally again and again.
#[test]
fn the_threshold_of_total_reflection() {
    let mut family = Family::new("total reflection");
    for eta in [1.5_f32, 1.0 / 1.5] {
        let mut builder = furnace("block of glass", 8);
        let glass = builder.material(Bsdf::from(Dielectric { eta }));
        crate::support::block(&mut builder, DVec3::splat(-0.7), dvec3(0.7, -0.4, 0.7), glass);
        let scene = builder.build(Skip::Unneeded).unwrap();
        is_in_equilibrium(&mut family, &scene, &format!("slab of {eta}"), 48, EQUILIBRIUM);
    }
    family.finish(0.9);
}
