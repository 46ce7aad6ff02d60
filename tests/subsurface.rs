//! Light through bodies: the BSSRDF of normalised diffusion in `path`, and the word of those that cannot follow it.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over its variants, orders and blocks).

use crate::support::{Budget, COLUMNS, Family, Truth, builtin_with, camera, measure, method, method_with, shining};
use glam::{DVec3, dvec3};
use integrators::{Orders, Render, RenderSettings};
use sampling::bsdf::{Bsdf, Plastic, fresnel_dielectric};
use sampling::math::Spectrum;
use sampling::sampler::{Role, SamplerKind};
use sampling::subsurface::Subsurface;
use scenes::{Body, Interaction, Material, MaterialId, MeshData, Ray, Scene, SceneBuilder, Skip};
use serde_json::json;
use std::f64::consts::{PI, TAU};

mod refusals;
mod searchlight;

/// Width and height of the images.
const SIZE: u32 = 8;

/// A material, as its closed forms know it.
#[derive(Clone, Copy)]
struct Stuff {
    albedo: [f64; 3],
    mean_free_path: [f64; 3],
    eta: f64,
}

const GREEN: Stuff = Stuff { albedo: [0.5, 0.9, 0.2], mean_free_path: [0.02, 0.03, 0.01], eta: 1.4 };

impl Stuff {
    fn white(mean_free_path: f64, eta: f64) -> Self {
        Stuff { albedo: [1.0; 3], mean_free_path: [mean_free_path; 3], eta }
    }

    fn material(self) -> Material {
        let colour = |c: [f64; 3]| Spectrum::from(c.map(|c| c as f32));
        let subsurface = Subsurface::new(colour(self.albedo), colour(self.mean_free_path), self.eta as f32);
        Body::new("stuff", subsurface.unwrap()).into()
    }

    /// s/l of a channel [1/m].
    fn rate(self, channel: usize) -> f64 {
        let a = self.albedo[channel];
        (1.9 - a + 3.5 * (a - 0.8).powi(2)) / self.mean_free_path[channel]
    }

    /// R(r) of a channel [1/m²].
    fn reflectance(self, channel: usize, r: f64) -> f64 {
        let rate = self.rate(channel);
        self.albedo[channel] * rate * ((-rate * r).exp() + (-rate * r / 3.0).exp()) / (8.0 * PI * r)
    }

    /// Integral of R beyond a distance on the plane: what does not come back nearer than that.
    fn beyond(self, channel: usize, r: f64) -> f64 {
        let rate = self.rate(channel);
        self.albedo[channel] * (0.25 * (-rate * r).exp() + 0.75 * (-rate * r / 3.0).exp())
    }

    fn reflected(self, cos: f64) -> f64 {
        if cos <= 0.0 { 1.0 } else { f64::from(fresnel_dielectric(cos as f32, self.eta as f32).reflected) }
    }

    /// What uniform light 1 makes, seen at this cosine, where R integrates to `share` of each channel.
    fn under_uniform_light(self, cos: f64, share: impl Fn(usize) -> f64) -> f64 {
        let f = self.reflected(cos);
        f + (1.0 - f) * (0..3).map(share).sum::<f64>() / 3.0
    }
}

fn cos_seen(hit: &Interaction, ray: &Ray) -> f64 {
    f64::from(ray.d.dot(hit.point.ng).abs())
}

/// A square of half width 4 across y; its front is above.
fn floor(builder: &mut SceneBuilder, at: DVec3, material: MaterialId) {
    builder.quad(at + dvec3(-4.0, 0.0, 4.0), DVec3::X * 8.0, DVec3::Z * -8.0, material);
}

/// A floor that is far wider than light goes, under uniform light, seen askew from above.
fn half_space(stuff: Stuff, at: DVec3, skip: Skip) -> Scene {
    let mut builder = SceneBuilder::new("half-space");
    let material = builder.material(stuff.material());
    floor(&mut builder, at, material);
    builder.environment(Spectrum::ONE);
    builder.camera(camera(at + dvec3(0.3, 1.0, 1.7), at + dvec3(0.0, 0.0, 0.1), 30.0, SIZE));
    builder.build(skip).unwrap()
}

/// Under uniform light a half-space gives back F + (1 − F) A at order 1, and nothing later: all of it if A = 1, wherever it is,
/// whatever the index, and however far light goes, even less than coordinates can tell apart.
#[test]
fn half_spaces_give_back_their_albedo() {
    let mut family = Family::new("half-spaces");
    let variants = [
        ("coloured", GREEN, DVec3::ZERO, json!({})),
        ("coloured without next-event estimation", GREEN, DVec3::ZERO, json!({"strategy": "bsdf"})),
        ("coloured with the balance heuristic", GREEN, DVec3::ZERO, json!({"mis": "balance"})),
        ("white", Stuff::white(0.03, 1.5), DVec3::ZERO, json!({})),
        ("white without a boundary", Stuff::white(0.03, 1.0), DVec3::ZERO, json!({})),
        ("white in glass", Stuff::white(0.03, 0.7), DVec3::ZERO, json!({})),
        ("far away", GREEN, dvec3(3e5, -2e5, 1e5), json!({})),
        ("of short ways", Stuff { mean_free_path: [1e-9, 1e-8, 1e-7], ..GREEN }, DVec3::ZERO, json!({})),
        ("black", Stuff { albedo: [0.0; 3], ..GREEN }, DVec3::ZERO, json!({})),
    ];
    for (name, stuff, at, settings) in variants {
        let scene = half_space(stuff, at, Skip::Unneeded);
        let truth = Truth::new(&scene, |hit, ray| {
            vec![0.0, stuff.under_uniform_light(cos_seen(hit, ray), |channel| stuff.albedo[channel]), 0.0, 0.0]
        });
        truth.compare(&mut family, name, method_with("path", settings).as_ref(), Budget::samples(32), COLUMNS);
    }
    family.finish(0.9);
}

/// Light goes through a plate to its other face: R of the plane there, at the distances that the thickness leaves, is added. Both
/// faces may be one mesh or two quads.
#[test]
fn plates_let_light_through() {
    let (stuff, thickness) = (GREEN, 0.02);
    let mut family = Family::new("plates");
    for (name, as_mesh) in [("quads", false), ("mesh", true)] {
        let mut builder = SceneBuilder::new(name);
        let material = builder.material(stuff.material());
        let corners = |y: f64| [(-4.0, 4.0), (4.0, 4.0), (4.0, -4.0), (-4.0, -4.0)].map(|(x, z)| dvec3(x, y, z));
        if as_mesh {
            let positions = [corners(0.0), corners(-thickness)].concat();
            let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]];
            builder.mesh(MeshData { positions, triangles, ..MeshData::default() }, material);
        } else {
            floor(&mut builder, DVec3::ZERO, material);
            floor(&mut builder, DVec3::Y * -thickness, material);
        }
        // What is not of the body does not count, wherever it is.
        let black = builder.material(crate::support::lambert(0.0));
        floor(&mut builder, DVec3::Y * (-0.5 * thickness), black);
        builder.environment(Spectrum::ONE);
        builder.camera(camera(dvec3(0.3, 1.0, 1.7), DVec3::ZERO, 30.0, SIZE));
        let scene = builder.build(Skip::Unneeded).unwrap();
        let share = |channel: usize| match as_mesh {
            // The lower face looks down, where there is light,
            true => stuff.albedo[channel] + stuff.beyond(channel, thickness),
            // or up, and the black one is in between.
            false => stuff.albedo[channel],
        };
        let truth = Truth::new(&scene, |hit, ray| vec![0.0, stuff.under_uniform_light(cos_seen(hit, ray), share), 0.0]);
        truth.compare(&mut family, name, method("path").as_ref(), Budget::samples(64), COLUMNS);
    }
    family.finish(0.9);
}

/// A ball under uniform light. On a sphere of radius a the area at distances of r to r + dr from a point is 2πr dr up to 2a, as
/// on the plane, so that R integrates to what it does on a disc of that radius.
#[test]
fn balls_give_back_what_comes_within_their_diameter() {
    let radius = 0.02;
    let mut family = Family::new("balls");
    for (name, stuff) in [("green", GREEN), ("white", Stuff::white(0.05, 1.0))] {
        let mut builder = SceneBuilder::new(name);
        let material = builder.material(stuff.material());
        builder.sphere(DVec3::ZERO, radius, material);
        builder.environment(Spectrum::ONE);
        builder.camera(camera(dvec3(0.01, 0.02, 0.1), DVec3::ZERO, 15.0, SIZE));
        let scene = builder.build(Skip::Unneeded).unwrap();
        let share = |channel: usize| stuff.albedo[channel] - stuff.beyond(channel, 2.0 * radius);
        let truth = Truth::new(&scene, |hit, ray| vec![0.0, stuff.under_uniform_light(cos_seen(hit, ray), share), 0.0]);
        truth.compare(&mut family, name, method("path").as_ref(), Budget::samples(64), COLUMNS);
    }
    family.finish(0.9);
}

/// Where the light in a hollow sphere comes from.
#[derive(Clone, Copy, PartialEq)]
enum Light {
    /// The inside of the sphere, its front, emits uniformly.
    Wall,
    /// A point emitter of intensity 1 in the middle of a sphere whose front is outside.
    Point,
}

/// Hollow spheres: a chord meets a sphere at equal angles, so that radiance depends on the angle θ alone, and
/// L_{k+1}(θ) = F L_k(θ) + (1 − F) A' ∫ Sw L_k cos, with A' what R integrates to on the sphere. What the boundary reflects of a
/// point emitter is not carried.
#[test]
fn hollow_spheres_order_by_order() {
    let mut family = Family::new("hollow spheres");
    let (long, grey) = (Stuff { mean_free_path: [1.0, 0.4, 3.0], ..GREEN }, Stuff { albedo: [0.8; 3], ..GREEN });
    let plain = json!({"roulette": "none"});
    let variants = [
        ("path", "white, of short ways", Light::Wall, Stuff::white(1e-3, 1.5), plain.clone()),
        ("path", "coloured, of long ways", Light::Wall, long, plain.clone()),
        ("path", "with roulette", Light::Wall, grey, json!({"roulette_start": 1})),
        ("path", "without next event", Light::Wall, grey, json!({"roulette": "none", "strategy": "bsdf"})),
        ("path", "round a point emitter", Light::Point, long, plain.clone()),
        ("guided", "guided", Light::Wall, long, plain),
    ];
    for (method, name, light, stuff, settings) in variants {
        let scene = hollow_sphere(name, light, stuff);
        let truth = Truth::new(&scene, |hit, ray| in_hollow_sphere(light, stuff, cos_seen(hit, ray), 6));
        truth.compare(&mut family, method, method_with(method, settings).as_ref(), Budget::samples(32), 2);
    }
    family.finish(0.9);
}

fn hollow_sphere(name: &str, light: Light, stuff: Stuff) -> Scene {
    let mut builder = SceneBuilder::new(name);
    let material = builder.material(stuff.material());
    let sphere = builder.sphere(DVec3::ZERO, 1.0, material);
    match light {
        Light::Wall => {
            builder.emit(sphere, shining(1.0));
            builder.flip(sphere);
        }
        Light::Point => builder.point_emitter(DVec3::ZERO, Spectrum::ONE),
    }
    builder.camera(camera(dvec3(0.4, 0.3, 0.6), dvec3(0.1, 0.0, -1.0), 80.0, SIZE));
    builder.build(Skip::Unneeded).unwrap()
}

/// The orders 0 to `last` seen at this cosine in a hollow sphere of radius 1.
fn in_hollow_sphere(light: Light, stuff: Stuff, cos: f64, last: usize) -> Vec<f64> {
    // Cosines x² at the middles of equal parts of x; the last is the one asked for.
    const NODES: usize = 400;
    let nodes: Vec<f64> = (0..NODES).map(|i| ((i as f64 + 0.5) / NODES as f64).powi(2)).chain([cos]).collect();
    let reflected: Vec<f64> = nodes.iter().map(|&c| stuff.reflected(c)).collect();
    let entering = |l: &[f64]| (0..NODES).map(|i| (1.0 - reflected[i]) * nodes[i].powf(1.5) * l[i]).sum::<f64>();
    let norm = entering(&[1.0; NODES]);
    let transmittance = f64::from(sampling::bsdf::diffuse_transmittance(stuff.eta as f32));
    let mut orders = vec![0.0; last + 1];
    for channel in 0..3 {
        let share = stuff.albedo[channel] - stuff.beyond(channel, 2.0);
        let mut radiance = vec![if light == Light::Wall { 1.0 } else { 0.0 }; NODES + 1];
        for (k, order) in orders.iter_mut().enumerate() {
            *order += radiance[NODES] / 3.0;
            let mut diffuse = share * entering(&radiance) / norm;
            if k == 0 && light == Light::Point {
                diffuse = share * (1.0 - stuff.reflected(1.0)) / (transmittance * PI);
            }
            radiance.iter_mut().zip(&reflected).for_each(|(l, f)| *l = f * *l + (1.0 - f) * diffuse);
        }
    }
    orders
}

/// A body in which light goes nowhere is a plastic: a base whose albedo ρ gives A = ρ T̄ / (η² (1 − ρ F̄)) under its coat. Where
/// only the lamp's reflections arrive, contributions are rare, and more than half of the blocks may decide nothing.
#[test]
fn bodies_of_short_ways_are_plastics() {
    let stuff = Stuff { mean_free_path: [1e-7; 3], ..GREEN };
    let diffuse = f64::from(sampling::bsdf::diffuse_transmittance(stuff.eta as f32));
    let eta2 = stuff.eta * stuff.eta;
    let base = stuff.albedo.map(|a| (a * eta2 / (diffuse + a * (eta2 - diffuse))) as f32);
    let plastic: Bsdf = Plastic::new(Spectrum::from(base), stuff.eta as f32).into();
    let rendered = |name: &str, material: Material| {
        let budget = Budget::samples(256).up_to(4);
        measure(
            &bowl(material, Skip::Unneeded),
            method_with("path", json!({"roulette": "none"})).as_ref(),
            name,
            budget,
        )
    };
    let (body, plastic) = (rendered("body", stuff.material()), rendered("plastic", plastic.into()));
    let mut family = Family::new("bodies of short ways and plastics");
    for order in 0..=4 {
        family.image(format!("order {order}"), body.image(order), plastic.image(order));
        for (i, block) in body.blocks(COLUMNS).iter().enumerate() {
            family.block(format!("order {order} block {i}"), body.over(order, block), plastic.over(order, block));
        }
    }
    family.finish(0.4);
}

/// A floor and two balls of a material, a wall that is not of it, and a lamp.
fn bowl(material: Material, skip: Skip) -> Scene {
    let mut builder = SceneBuilder::new("bowl");
    let material = builder.material(material);
    let wall = builder.material(crate::support::lambert(0.6));
    floor(&mut builder, DVec3::ZERO, material);
    builder.sphere(dvec3(-0.5, 0.6, 0.0), 0.5, material);
    builder.sphere(dvec3(0.6, 0.45, 0.2), 0.4, material);
    builder.quad(dvec3(-2.0, 0.0, -1.0), DVec3::X * 4.0, DVec3::Y * 2.0, wall);
    let lamp = builder.quad(dvec3(-0.5, 2.0, 0.5), DVec3::Z, DVec3::X, wall);
    builder.flip(lamp);
    builder.emit(lamp, shining(5.0));
    builder.camera(camera(dvec3(0.2, 1.4, 3.0), dvec3(0.0, 0.4, 0.0), 45.0, SIZE));
    builder.build(skip).unwrap()
}

fn settings(samples: u32, sampler: SamplerKind) -> RenderSettings {
    RenderSettings {
        orders: Orders::up_to(4),
        tail: false,
        samples_per_replicate: samples,
        seed: 5,
        sampler,
        instance: "path".into(),
        role: Role::Estimate,
    }
}

/// Every pixel of every order of a replicate, as bits.
fn bits(scene: &Scene, sampler: SamplerKind) -> Vec<u64> {
    let method = method("path");
    let mut render = Render::new(scene, method.as_ref(), settings(8, sampler)).unwrap();
    render.run_replicate(&|_| {});
    let m = render.finish();
    let places = (0..m.layers.len()).flat_map(|layer| (0..m.pixels()).map(move |pixel| (layer, pixel)));
    places.flat_map(|(layer, pixel)| m.mean(layer, pixel).map(f64::to_bits)).collect()
}

#[test]
fn neither_threads_nor_skips_change_a_bit() {
    for &sampler in SamplerKind::ALL {
        let material = || Stuff { mean_free_path: [0.1, 0.3, 0.05], ..GREEN }.material();
        let scene = bowl(material(), Skip::Unneeded);
        let image = bits(&scene, sampler);
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert!(pool.install(|| bits(&scene, sampler)) == image, "{sampler}: {threads} threads");
        }
        assert!(bits(&bowl(material(), Skip::Nothing), sampler) == image, "{sampler}: no skips");
    }
}

#[test]
fn scenes_without_bodies_ask_for_nothing() {
    for &name in scenes::builtin_names() {
        let scene = builtin_with(name, 8, Skip::Unneeded);
        assert!(!scene.needs.subsurface && scene.needs.skipped().contains(&"subsurface"), "{name}");
        assert!(builtin_with(name, 8, Skip::Nothing).needs.subsurface);
    }
    let scene = half_space(GREEN, DVec3::ZERO, Skip::Unneeded);
    assert!(scene.needs.subsurface && scene.needs.delta_lobes && scene.needs.non_delta_lobes);
    assert!(!scene.needs.only_lambertian && !scene.needs.skipped().contains(&"subsurface"));
    let names: Vec<&str> = scene.bodies().map(|body| body.name.as_str()).collect();
    assert_eq!(names, ["stuff"]);
}
