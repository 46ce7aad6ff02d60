//! `fireflies.json`: the largest contributions of every method, each with its path and the command that traces it again.

use crate::error::Error;
use crate::plan::{Plan, PlannedMethod, PlannedScene};
use crate::replay::{Retracing, Shown};
use crate::result::MethodResult;
use integrators::{Firefly, RenderSettings};
use serde::Serialize;

/// One of the largest contributions to an order.
#[derive(Clone, Debug, Serialize)]
pub struct FireflyRecord {
    /// The scene's name.
    pub scene: String,
    /// The method's label.
    pub method: String,
    /// The order, or `tail`.
    pub layer: String,
    /// From 0, the largest.
    pub rank: usize,
    /// Mean of channels of what the image gets; `null` where it is not finite.
    pub size: f32,
    /// The part of the order's whole light that it is: a contribution of the average size would be one over their number.
    pub share: f64,
    /// Which independent image.
    pub replicate: u32,
    /// Column and row of the pixel whose sample it is of.
    pub pixel: (u32, u32),
    /// Number of the sample in its pixel and replicate.
    pub sample: u32,
    /// The command that traces it again.
    pub replay: String,
    /// The path; `null` where the method has no samples that stand alone.
    pub path: Option<Shown>,
}

/// The records of a method in a scene, whose camera must be as it was.
///
/// # Errors
/// If a sample cannot be traced again.
pub fn records(
    plan: &Plan,
    scene: &PlannedScene,
    planned: &PlannedMethod,
    result: &MethodResult,
) -> Result<Vec<FireflyRecord>, Error> {
    let m = &result.measurement;
    let settings = RenderSettings { samples_per_replicate: m.samples_per_replicate, ..plan.render_settings(planned) };
    let retracing = Retracing::new(&scene.scene, &*planned.method, &settings)?;
    let largest: Vec<&Firefly> = m.fireflies.layers().iter().flatten().collect();
    let (mut paths, mut records) = (retracing.find(&largest)?.into_iter(), Vec::with_capacity(largest.len()));
    for (index, (layer, found)) in m.layers.iter().zip(m.fireflies.layers()).enumerate() {
        let mean = m.image_mean(index).iter().sum::<f64>() / 3.0;
        let all = mean * m.pixels() as f64 * m.samples() as f64;
        for (rank, firefly) in found.iter().enumerate() {
            records.push(FireflyRecord {
                scene: result.scene.clone(),
                method: result.label.clone(),
                layer: layer.label(),
                rank,
                size: firefly.size(),
                share: f64::from(firefly.size()) / all,
                replicate: firefly.replicate,
                pixel: firefly.pixel,
                sample: firefly.sample,
                replay: command(plan, scene, planned, &settings, firefly),
                path: paths.next().flatten(),
            });
        }
    }
    Ok(records)
}

/// A JSON array with a record a line.
pub fn in_lines(records: &[FireflyRecord]) -> String {
    let lines: Vec<String> = records.iter().map(|r| serde_json::to_string(r).unwrap_or_default()).collect();
    format!("[\n{}\n]\n", lines.join(",\n"))
}

fn command(
    plan: &Plan,
    scene: &PlannedScene,
    planned: &PlannedMethod,
    settings: &RenderSettings,
    firefly: &Firefly,
) -> String {
    let quoted = |text: &str| match text.chars().all(|c| c.is_ascii_alphanumeric() || "._-/=:,".contains(c)) {
        true => text.to_owned(),
        false => format!("'{}'", text.replace('\'', r"'\''")),
    };
    let (replicates, camera) = (plan.budget.replicates, &scene.scene.camera);
    let mut words = vec![
        format!("neumann replay {} -i {}", quoted(&scene.source), planned.method.name()),
        format!("--size {}x{}", camera.width(), camera.height()),
        format!(
            "--spp {} --replicates {replicates}",
            u64::from(settings.samples_per_replicate) * u64::from(replicates)
        ),
        format!("--max-order {}", plan.experiment.max_order),
    ];
    words.extend(settings.tail.then(|| "--tail".to_owned()));
    words.push(format!("--seed {} --sampler {}", plan.experiment.seed, planned.sampler));
    words.extend(planned.setting.split_whitespace().map(|setting| format!("--set {}", quoted(setting))));
    let Firefly { replicate, pixel: (x, y), sample, technique, .. } = firefly;
    words.push(format!("--replicate {replicate} --pixel {x},{y} --sample {sample}"));
    if let integrators::Technique::Connect { s, t } = technique {
        words.push(format!("--strategy {s},{t}"));
    }
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::{Cli, Command};
    use crate::progress::Verbosity;
    use crate::settings::change_experiment;
    use crate::source::Source;
    use crate::states::States;
    use crate::stop::Stop;
    use clap::Parser;
    use integrators::Methods;

    /// What the file says to type gives the very contribution, also where settings, samplers and sizes are not the usual ones.
    #[test]
    fn the_command_of_each_traces_it_again_to_the_bit() {
        let source = Source::open("comparison").unwrap();
        let changes = [
            "scenes=[\"glass_caustic\"]",
            "size=[12, 10]",
            "spp=8",
            "replicates=2",
            "seed=7",
            "sampler=\"sobol\"",
            "tail=true",
            "max_order=3",
            "methods=[{name=\"path\", settings={roulette=\"throughput\", mis=\"balance\"}}, {name=\"bdpt\"}]",
        ];
        let changes: Vec<_> = changes.iter().map(|text| text.parse().unwrap()).collect();
        let mut experiment = change_experiment(source.parse().unwrap(), &changes).unwrap();
        experiment.convergence = None;
        let mut plan = Plan::new(&source, experiment, &Methods::standard()).unwrap();
        let (states, quiet) = (&mut States::none(), Verbosity::Quiet);
        let results = crate::runner::run(&mut plan, states, quiet, &Stop::never()).unwrap().methods;
        for (planned, result) in plan.methods.iter().zip(&results) {
            let records = records(&plan, &plan.scenes[0], planned, result).unwrap();
            assert!(records.len() > 20, "{}", records.len());
            for record in records {
                let path = record.path.expect("the sample gives its contribution again");
                let words = record.replay.split_whitespace();
                let Some(Command::Replay(args)) = Cli::try_parse_from(words).unwrap().command else { panic!() };
                let again = crate::replay_command::contributions(&args, &Methods::standard()).unwrap().1;
                let same = |other: &&Shown| other.raw == path.raw && other.raster == path.raster;
                assert!(again.iter().find(same).is_some_and(|other| other.weight == path.weight), "{}", record.replay);
            }
        }
    }
}
