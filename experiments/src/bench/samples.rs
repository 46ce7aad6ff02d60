//! `neumann bench samples`: processor time of a sample, by scene and method.

use super::turns::{Middle, Timed, in_turns};
use super::{named, tell};
use crate::cli::SamplesArgs;
use crate::error::{Error, Status};
use integrators::{Integrator, Methods};
use scenes::{LoadOptions, Scene, Skip};
use serde::Serialize;
use serde_json::Value;

/// What was measured of a method in a scene.
#[derive(Clone, Debug, Serialize)]
struct Row {
    scene: String,
    method: String,
    settings: Value,
    sampler: String,
    size: [u32; 2],
    max_order: usize,
    /// Samples of a round.
    samples: f64,
    nanoseconds_per_sample: Middle,
    rays_per_sample: f64,
    nanoseconds_per_ray: f64,
}

/// Measures, and prints a table or JSON.
pub(super) fn samples(args: &SamplesArgs, methods: &Methods) -> Result<Status, Error> {
    let built = args.measured.build(methods, &["direct", "path", "light", "bdpt"])?;
    let mut rows = Vec::new();
    for name in named(&args.scenes) {
        let scene = scenes::load(name, &LoadOptions { size: Some(args.size), skip: Skip::Unneeded })?;
        rows.extend(of_scene(&scene, &built, args)?);
    }
    tell(&rows, args.measured.json, || table(&rows))
}

fn of_scene(scene: &Scene, methods: &[Box<dyn Integrator>], args: &SamplesArgs) -> Result<Vec<Row>, Error> {
    let timed = methods.iter().map(|method| args.measured.timed(scene, &**method, args.spp));
    let mut list = timed.collect::<Result<Vec<_>, Error>>()?;
    in_turns(&mut list, args.measured.rounds, |_, _| {})?;
    let row = |method: &dyn Integrator, timed: Timed| {
        let (nanoseconds, samples) = (timed.nanoseconds(), timed.samples());
        let measured = timed.render.finish();
        let rays = (measured.counters.closest + measured.counters.shadow) as f64;
        let rays_per_sample = rays / (samples * f64::from(measured.replicates));
        Row {
            scene: scene.name.clone(),
            method: method.name().to_owned(),
            settings: method.settings(),
            sampler: args.measured.sampler.clone(),
            size: [args.size.0, args.size.1],
            max_order: measured.max_order,
            samples,
            nanoseconds_per_sample: nanoseconds,
            rays_per_sample,
            nanoseconds_per_ray: nanoseconds.median / rays_per_sample,
        }
    };
    Ok(methods.iter().zip(list).map(|(method, timed)| row(&**method, timed)).collect())
}

fn table(rows: &[Row]) -> String {
    let header = format!(
        "{:<20} {:<10} {:>10} {:>10} {:>10} {:>8} {:>8}\n",
        "scene", "method", "ns/sample", "from", "to", "rays", "ns/ray"
    );
    let line = |row: &Row| {
        let Row { scene, method, nanoseconds_per_sample, rays_per_sample, nanoseconds_per_ray, .. } = row;
        let Middle { median, low, high } = nanoseconds_per_sample;
        format!(
            "{scene:<20} {method:<10} {median:>10.0} {low:>10.0} {high:>10.0} {rays_per_sample:>8.2} {nanoseconds_per_ray:>8.1}\n"
        )
    };
    header + &rows.iter().map(line).collect::<String>()
}
