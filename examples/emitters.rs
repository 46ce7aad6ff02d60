//! What sampling emitters by where they are is worth: the table in `docs/estimators.md`.
//!
//! ```console
//! $ cargo run --release --example emitters
//! ```
//!
//! Two tables, of scenes of many emitters, or of few above a glossy plate, by how next-event estimation chooses among them (`emitter_choice`), and
//! of single emitters near a floor by how it places points on them (`emitter_points`). Cells are the first rule's value over that of the other, with 95 % intervals:
//! the variance of `path` at order 1, the time of a sample to order 2 on one thread, and the efficiency of both at order 1. Rules take turns,
//! batch by batch, each batch with a seed of its own for all.

use glam::{DVec3, dvec3};
use integrators::{Layer, Methods, Orders, Render, RenderSettings};
use sampling::bsdf::{Bsdf, Lambert, RoughConductor};
use sampling::math::Spectrum;
use sampling::moments::Moments;
use sampling::sampler::{Role, SamplerKind};
use scenes::{
    CameraSettings, ChoiceRule, Emission, MaterialId, MeshData, PointRule, Scene, SceneBuilder, SceneError, ShapeId,
    Skip,
};
use serde_json::json;
use std::time::Instant;

type Failure = Box<dyn std::error::Error + Send + Sync>;

const SIZE: (u32, u32) = (64, 64);
const BATCHES: u64 = 8;
const REPLICATES: u32 = 16;
const SAMPLES: u32 = 16;
/// The 97.5 % quantile of Student's distribution of 7 degrees of freedom.
const QUANTILE: f64 = 2.365;

type Lamps = fn(&mut SceneBuilder, MaterialId);
type Lamp = fn(&mut SceneBuilder, MaterialId) -> ShapeId;

const MANY: [(&str, Lamps); 4] = [
    ("16 lamps above a floor", |builder, black| grid(builder, black, 4, |_| 1.0)),
    ("1024 lamps above a floor", |builder, black| grid(builder, black, 32, |_| 1.0)),
    ("1024, each tenth a hundred times as bright", |builder, black| {
        grid(builder, black, 32, |i| if i % 10 == 0 { 100.0 } else { 1.0 });
    }),
    ("1024 that shine to one side", |builder, black| {
        for (i, place) in places(32).enumerate() {
            let towards = [DVec3::X, DVec3::Z, -DVec3::X, -DVec3::Z][i % 4];
            let side = towards.cross(DVec3::Y) * 0.04;
            let lamp = builder.quad(place + DVec3::Y * 0.6 - side / 2.0, DVec3::Y * 0.04, side, black);
            builder.emit(lamp, Emission { radiance: 1.0.into(), two_sided: false });
        }
    }),
];

/// Plates by their roughness.
const GLOSSY: [(&str, f32); 3] = [
    ("4 lamps in a plate of roughness 0.01", 0.01),
    ("4 lamps in a plate of roughness 0.05", 0.05),
    ("4 lamps in a plate of roughness 0.3", 0.3),
];

const NEAR: [(&str, Lamp); 5] = [
    ("a rectangle near it", |builder, black| {
        builder.quad(dvec3(-0.5, 0.3, -0.4), dvec3(1.0, 0.0, 0.0), dvec3(0.0, 0.0, 0.8), black)
    }),
    ("a triangle near it", |builder, black| {
        let positions = vec![dvec3(-0.6, 0.3, -0.4), dvec3(0.6, 0.3, -0.4), dvec3(0.0, 0.3, 0.7)];
        builder.mesh(MeshData { positions, triangles: vec![[0, 1, 2]], ..MeshData::default() }, black)
    }),
    ("a slanting triangle on it", |builder, black| {
        let positions = vec![dvec3(-0.6, 0.02, -0.4), dvec3(0.6, 0.02, -0.4), dvec3(0.0, 0.7, -0.1)];
        builder.mesh(MeshData { positions, triangles: vec![[0, 1, 2]], ..MeshData::default() }, black)
    }),
    ("a tetrahedron near it", |builder, black| {
        let positions = vec![dvec3(-0.5, 0.2, -0.4), dvec3(0.5, 0.2, -0.4), dvec3(0.0, 0.2, 0.5), dvec3(0.0, 0.9, 0.0)];
        let triangles = vec![[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
        builder.mesh(MeshData { positions, triangles, ..MeshData::default() }, black)
    }),
    ("a ball near it", |builder, black| builder.sphere(dvec3(0.0, 0.5, 0.0), 0.35, black)),
];

fn main() -> Result<(), Failure> {
    rayon::ThreadPoolBuilder::new().num_threads(1).build()?.install(|| {
        println!("| scene | `emitter_choice` | variance | time | efficiency |\n|---|---|---:|---:|---:|");
        for (name, add) in MANY {
            let scene = |rule| {
                let mut builder = floor(6.0);
                builder.emitter_choice(rule);
                let black = builder.material(lambert(0.0));
                add(&mut builder, black);
                builder.build(Skip::Unneeded)
            };
            compare(name, &ChoiceRule::FOR_ANY_NUMBER.map(|rule| (rule.name(), rule)), scene)?;
        }
        for (name, alpha) in GLOSSY {
            compare(name, &[ChoiceRule::Power, ChoiceRule::Gloss].map(|rule| (rule.name(), rule)), |rule| {
                let metal = RoughConductor::from_reflectance(Spectrum::splat(0.6), alpha, alpha);
                let mut builder = floor_of(metal.into(), 4.0);
                builder.emitter_choice(rule);
                let black = builder.material(lambert(0.0));
                for (x, radius, radiance) in
                    [(-3.0, 0.6, 1.0), (-1.0, 0.2, 9.0), (1.0, 0.06, 100.0), (3.0, 0.02, 900.0)]
                {
                    let ball = builder.sphere(dvec3(x, 1.2, -2.0), radius, black);
                    builder.emit(ball, Emission { radiance: f32::into(radiance), two_sided: false });
                }
                builder.build(Skip::Unneeded)
            })?;
        }
        println!("\n| scene | `emitter_points` | variance | time | efficiency |\n|---|---|---:|---:|---:|");
        for (name, add) in NEAR {
            let scene = |rule| {
                let mut builder = floor(1.0);
                builder.emitter_points(rule);
                let black = builder.material(lambert(0.0));
                let shape = add(&mut builder, black);
                builder.emit(shape, Emission { radiance: 1.0.into(), two_sided: false });
                builder.build(Skip::Unneeded)
            };
            compare(name, &[PointRule::Area, PointRule::SolidAngle].map(|rule| (rule.name(), rule)), scene)?;
        }
        Ok(())
    })
}

fn lambert(albedo: f32) -> Bsdf {
    Lambert { albedo: Spectrum::splat(albedo) }.into()
}

/// A grey square of this half side, seen from above one of its edges.
fn floor(half: f64) -> SceneBuilder {
    floor_of(lambert(0.5), half)
}

/// A square of this half side, seen from above one of its edges.
fn floor_of(bsdf: Bsdf, half: f64) -> SceneBuilder {
    let mut builder = SceneBuilder::new("floor");
    let material = builder.material(bsdf);
    builder.quad(dvec3(-half, 0.0, half), dvec3(2.0 * half, 0.0, 0.0), dvec3(0.0, 0.0, -2.0 * half), material);
    let (eye, target) = (dvec3(0.0, 1.6, 1.8) * half, DVec3::ZERO);
    builder.camera(CameraSettings::pinhole(eye, target, 40.0, SIZE));
    builder
}

/// Places above the floor, so many in each direction, none above another's row.
fn places(count: usize) -> impl Iterator<Item = DVec3> {
    let at = move |i: usize| 10.0 * (i as f64 + 0.5) / count as f64 - 5.0;
    (0..count * count).map(move |i| dvec3(at(i % count), 0.0, at(i / count)))
}

/// Small square lamps that shine down.
fn grid(builder: &mut SceneBuilder, black: MaterialId, count: usize, radiance: fn(usize) -> f32) {
    for (i, place) in places(count).enumerate() {
        let lamp = builder.quad(place + DVec3::Y * 0.5, DVec3::X * 0.04, DVec3::Z * 0.04, black);
        builder.emit(lamp, Emission { radiance: radiance(i).into(), two_sided: false });
    }
}

/// A row for each rule but the first, of the scene that is made with it.
fn compare<Rule: Copy>(
    name: &str,
    rules: &[(&str, Rule)],
    scene: impl Fn(Rule) -> Result<Scene, SceneError>,
) -> Result<(), Failure> {
    let scenes = rules.iter().map(|(_, rule)| scene(*rule)).collect::<Result<Vec<_>, _>>()?;
    let mut found = vec![[Moments::default(); 3]; rules.len()];
    for batch in 0..BATCHES {
        for (found, scene) in found.iter_mut().zip(&scenes) {
            let (variance, seconds) = variance(scene, batch)?;
            let values = [variance, seconds, variance * seconds];
            found.iter_mut().zip(values).for_each(|(moments, value)| moments.push(value));
        }
    }
    for ((rule, _), own) in rules.iter().zip(&found).skip(1) {
        let cells: Vec<String> = found[0].iter().zip(own).map(|(first, own)| gain(first, own)).collect();
        println!("| {name} | `{rule}` | {} |", cells.join(" | "));
    }
    Ok(())
}

/// The image's variance of order 1 in a batch, and the seconds that it takes.
fn variance(scene: &Scene, batch: u64) -> Result<(f64, f64), Failure> {
    let method = Methods::standard().build("path", &json!({}))?;
    let settings = RenderSettings {
        orders: Orders::up_to(2),
        tail: false,
        samples_per_replicate: SAMPLES,
        seed: batch,
        sampler: SamplerKind::Independent,
        instance: "path".to_owned(),
        role: Role::Estimate,
    };
    let begun = Instant::now();
    let mut render = Render::new(scene, method.as_ref(), settings)?;
    (0..REPLICATES).for_each(|_| render.run_replicate(&|_| {}));
    let measured = render.finish();
    let seconds = begun.elapsed().as_secs_f64();
    let layer = measured.layers.iter().position(|layer| *layer == Layer::Order(1)).ok_or("there is no order 1")?;
    let variance = (0..measured.pixels()).filter_map(|pixel| measured.variance(layer, pixel)).flatten().sum();
    Ok((variance, seconds))
}

/// The ratio of two means, with its interval.
fn gain(first: &Moments, own: &Moments) -> String {
    let squared = |m: &Moments| m.variance_of_mean() / m.mean.powi(2);
    let (ratio, spread) = (first.mean / own.mean, QUANTILE * (squared(first) + squared(own)).sqrt());
    format!("{ratio:.2} [{:.2}, {:.2}]", ratio * (-spread).exp(), ratio * spread.exp())
}
