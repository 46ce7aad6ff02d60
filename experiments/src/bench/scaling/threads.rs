//! How well threads share the work, and how much of it they do not share.

use super::super::turns::Middle;
use crate::budget;
use crate::cli::ScalingArgs;
use crate::error::Error;
use crate::export::exr::{ImageMeta, LayerSelection, encode};
use crate::machine::VERSION;
use integrators::{Integrator, Render};
use scenes::Scene;
use serde::Serialize;
use std::time::Instant;

/// Samples per pixel in each round.
const SAMPLES: u32 = 4;

/// What was measured of a method on so many threads.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Row {
    method: String,
    threads: usize,
    /// Seconds (wall time) of a round.
    seconds: Middle,
    /// The time on one thread over the threads' time together, each round by itself.
    efficiency: Middle,
    /// The parts of the time in which blocks are put together, and in which replicates are added up for means and variances.
    merging: f64,
    moments: f64,
    /// Seconds in which an image of all orders is encoded; once in a render, by one thread.
    output_seconds: f64,
}

/// A render on so many threads.
struct Run<'a> {
    pool: rayon::ThreadPool,
    render: Render<'a>,
    seconds: Vec<f64>,
}

/// Renders the same replicates on one thread, on two, on four … and on all, in turn.
pub(super) fn by_threads(
    scene: &Scene,
    methods: &[Box<dyn Integrator>],
    args: &ScalingArgs,
) -> Result<Vec<Row>, Error> {
    let most = args.threads.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from));
    let doubled = std::iter::successors(Some(1), |n| Some(2 * n)).take_while(|&n| n < most);
    let counts: Vec<usize> = doubled.chain([most]).collect();
    let mut rows = Vec::new();
    for method in methods {
        let run = |&threads: &usize| {
            let render = Render::new(scene, &**method, args.measured.settings(&**method, SAMPLES)?)?;
            Ok(Run { pool: budget::pool(Some(threads))?, render, seconds: Vec::new() })
        };
        let mut runs = counts.iter().map(run).collect::<Result<Vec<_>, Error>>()?;
        for round in 0..=args.measured.rounds {
            for turn in 0..runs.len() {
                let index = if round.is_multiple_of(2) { turn } else { runs.len() - 1 - turn };
                let Run { pool, render, seconds } = &mut runs[index];
                let start = Instant::now();
                pool.install(|| render.run_replicate(&|_| {}));
                seconds.push(start.elapsed().as_secs_f64());
            }
        }
        let alone = runs[0].seconds.clone();
        rows.extend(runs.into_iter().map(|run| row(scene, &**method, run, &alone, args)));
    }
    Ok(rows)
}

fn row(scene: &Scene, method: &dyn Integrator, run: Run, alone: &[f64], args: &ScalingArgs) -> Row {
    let Run { pool, render, seconds } = run;
    let threads = pool.current_num_threads();
    let (all, transport, merging) = (seconds.iter().sum::<f64>(), render.seconds(), render.merging_seconds());
    let meta = ImageMeta {
        software: format!("neumann {VERSION}"),
        scene: scene.name.clone(),
        scene_hash: scene.hash.clone(),
        method: method.name().to_owned(),
        settings: method.settings(),
        sampler: args.measured.sampler.clone(),
        filter: scene.camera.filter().to_string(),
        seed: args.measured.seed,
    };
    let measurement = render.finish();
    let start = Instant::now();
    let encoded = pool.install(|| encode(&measurement, &meta, LayerSelection::default()));
    let output_seconds = if encoded.is_ok() { start.elapsed().as_secs_f64() } else { f64::NAN };
    // The first round warms up.
    let pairs = alone.iter().zip(&seconds).skip(1);
    Row {
        method: method.name().to_owned(),
        threads,
        seconds: Middle::of(seconds.iter().skip(1).copied()),
        efficiency: Middle::of(pairs.map(|(alone, own)| alone / (threads as f64 * own))),
        merging: merging / all,
        moments: (all - transport) / all,
        output_seconds,
    }
}

pub(super) fn table(rows: &[Row]) -> String {
    let header = format!(
        "{:<10} {:>7} {:>9} {:>10} {:>7} {:>7} {:>9} {:>9} {:>10}\n",
        "method", "threads", "seconds", "efficiency", "from", "to", "merging", "moments", "output [s]"
    );
    let line = |row: &Row| {
        let Row { method, threads, seconds, efficiency, merging, moments, output_seconds } = row;
        let Middle { median, low, high } = efficiency;
        let [merging, moments] = [merging, moments].map(|part| format!("{:.2} %", part * 100.0));
        format!(
            "{method:<10} {threads:>7} {:>9.4} {median:>10.3} {low:>7.3} {high:>7.3} {merging:>9} {moments:>9} {output_seconds:>10.4}\n",
            seconds.median
        )
    };
    header + &rows.iter().map(line).collect::<String>()
}
