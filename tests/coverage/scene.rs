//! The same in a real scene: the integrating sphere in 4×4 pixels, by `path` and `bdpt`, every order known.

use super::{REPLICATES, Table, experiments};
use crate::support::{GAUSS, builtin, exact, grey, method};
use integrators::integrator::Pixel;
use integrators::scratch::Scratch;
use integrators::{
    Contribution, Estimator, Integrator, Methods, Orders, Render, RenderSettings, Request, Sink, Technique, Wants,
};
use neumann::statistics::errors::{Errors, Reference};
use neumann::statistics::multiple::sidak_level;
use neumann::statistics::slopes::{Point, slope};
use neumann::statistics::welch::{POWER, Sample, Welch, detectable, rounding, welch};
use neumann::statistics::{Estimate, uniformity};
use rayon::prelude::*;
use sampling::moments::Moments;
use sampling::sampler::{Role, Sampler, SamplerKind};
use sampling::{Vec2, vec2};
use scenes::Scene;
use serde::{Deserialize, Serialize};
use serde_json::json;

/// Columns and rows.
const SIZE: u32 = 4;
/// The last order; the layers are 0 to this, and behind them their sum.
const LAST: usize = 3;
/// Samples of a replicate at the checkpoints; the first is where all else is measured.
const CHECKPOINTS: [u32; 3] = [2, 4, 8];
/// Replicates of a run.
const MOST: usize = REPLICATES[2];

/// Pixel means of every order and of their sum, `[pixel][layer]`, by quadrature.
fn truth(scene: &Scene) -> Vec<[f64; 3]> {
    let mut means = Vec::new();
    for (y, x) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (y, x))) {
        let mut layers = [[0.0; 3]; LAST + 2];
        for ((u, weight_u), (v, weight_v)) in GAUSS.iter().flat_map(|a| GAUSS.iter().map(move |b| (a, b))) {
            let ray = scene.camera.sample_we(vec2(x as f32 + *u as f32, y as f32 + *v as f32), Vec2::ZERO).ray;
            let hit = scene.intersect(&ray).expect("the sphere is closed");
            for order in 0..=LAST {
                for (c, value) in exact(scene, order, hit.point.p, ray.d).into_iter().enumerate() {
                    layers[order][c] += weight_u * weight_v * value;
                    layers[LAST + 1][c] += weight_u * weight_v * value;
                }
            }
        }
        means.extend(layers);
    }
    means
}

fn render<'a>(scene: &'a Scene, method: &'a dyn Integrator, samples: u32, seed: u64) -> Render<'a> {
    let settings = RenderSettings {
        orders: Orders::up_to(LAST),
        tail: false,
        samples_per_replicate: samples,
        seed,
        sampler: SamplerKind::Independent,
        instance: format!("{} at {samples}", method.name()),
        role: Role::Estimate,
    };
    Render::new(scene, method, settings).unwrap()
}

/// What one seed says of a method: errors at each number of replicates, and recursive squares of every layer at each checkpoint.
struct Run {
    errors: Vec<Vec<neumann::statistics::errors::LayerErrors>>,
    squares: Vec<Vec<Vec<f64>>>,
    /// By layer, the sum last: image means.
    means: Vec<Moments>,
}

fn run(scene: &Scene, method: &dyn Integrator, reference: Reference, seed: u64) -> Run {
    let pixels = (SIZE * SIZE) as usize;
    let (mut errors, mut squares) = (Vec::new(), Vec::new());
    let mut means = vec![Moments::default(); LAST + 2];
    for (i, samples) in CHECKPOINTS.into_iter().enumerate() {
        let mut render = render(scene, method, samples, seed);
        let mut of = Errors::new(pixels, LAST + 1);
        for replicate in 1..=MOST {
            render.run_replicate(&|_| {});
            of.push(reference, |layer, pixel| render.last_replicate(layer, pixel));
            if i > 0 {
                continue;
            }
            if REPLICATES.contains(&replicate) {
                errors.push(of.finish(reference, seed));
            }
            let image =
                |layer: usize| (0..pixels).map(|p| grey(render.last_replicate(layer, p))).sum::<f64>() / pixels as f64;
            let layers: Vec<f64> = (0..=LAST).map(image).collect();
            means.iter_mut().zip(&layers).for_each(|(moments, x)| moments.push(*x));
            means[LAST + 1].push(layers.iter().sum());
        }
        squares.push((0..LAST + 2).map(|layer| of.recursive_squares(layer).to_vec()).collect());
    }
    Run { errors, squares, means }
}

/// The variances are those of all seeds together: a hundredth as uncertain as the intervals.
#[test]
fn intervals_cover_the_truth_of_the_integrating_sphere() {
    let scene = builtin("integrating_sphere", SIZE);
    let truth = truth(&scene);
    let zero = vec![[0.0; 3]; truth.len()];
    let reference = Reference { mean: &truth, half: &truth, variance: &zero };
    let mut table = Table::default();
    let methods = ["path", "bdpt"].map(method);
    let runs = methods.each_ref().map(|method| -> Vec<Run> {
        (0..experiments(40) as u64).into_par_iter().map(|seed| run(&scene, method.as_ref(), reference, seed)).collect()
    });
    for (method, runs) in methods.iter().zip(&runs) {
        for layer in 0..LAST + 2 {
            let name = if layer > LAST {
                format!("sphere, {}", method.name())
            } else {
                format!("sphere, {}, order {layer}", method.name())
            };
            let mean =
                truth.iter().skip(layer).step_by(LAST + 2).map(|x| grey(*x)).sum::<f64>() / f64::from(SIZE * SIZE);
            let variance = runs.iter().map(|run| run.errors[2][layer].variance.value).sum::<f64>() / runs.len() as f64;
            for run in runs {
                for found in run.errors.iter().map(|at| &at[layer]) {
                    table.add("mean", &name, found.mean, mean);
                    table.add("variance", &name, found.variance, variance);
                    table.add("MSE", &name, found.mse, variance);
                    table.add("bias²", &name, found.bias2, 0.0);
                }
                for replicates in REPLICATES {
                    let point = |i: usize| Point {
                        samples: f64::from(CHECKPOINTS[i]),
                        squares: &run.squares[i][layer][..replicates - 1],
                        seconds: &[],
                    };
                    let slope: Estimate = slope(&[point(0), point(1), point(2)], 1).unwrap();
                    table.add("slope, samples", &name, slope, -1.0);
                }
            }
        }
    }
    table.finish();
    uniform(&runs);
}

/// Welch's p-values of the two methods are uniform: Kolmogorov and Smirnov's test says so for every layer. False-alarm rate: 1 %.
fn uniform(runs: &[Vec<Run>; 2]) {
    let level = sidak_level(0.01, LAST + 2);
    for layer in 0..LAST + 2 {
        let p = |(a, b): (&Run, &Run)| {
            welch(Sample::from(&a.means[layer]), Sample::from(&b.means[layer]), rounding(layer)).p
        };
        let p: Vec<f64> = runs[0].iter().zip(&runs[1]).map(p).collect();
        let distance = uniformity::distance(&p);
        let found = uniformity::p_value(distance, p.len());
        println!("layer {layer}: p-values of {} seeds are {distance:.4} off, p = {found:.3}", p.len());
        assert!(found > level, "layer {layer}: p-values are not uniform, {distance} off, p = {found:.1e}");
    }
}

/// What may be wrong with a method.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Fault {
    #[default]
    None,
    /// Every contribution is at most this.
    Clamp(f32),
    /// What emitters' samples bring is lost, its MIS weights are not.
    NoEmitterSamples,
    /// Order 2 is lost.
    NoOrder2,
    /// All contributions are dimmed.
    Dim(f32),
}

/// `path` with a fault.
#[derive(Serialize, Deserialize, Default)]
struct Faulty {
    fault: Fault,
    path: integrators::path::Path,
}

struct Spoiler<'s, S> {
    fault: Fault,
    out: &'s mut S,
}

impl<S: Sink> Sink for Spoiler<'_, S> {
    const WANTS: Wants = S::WANTS;

    fn add(&mut self, mut contribution: Contribution) {
        match self.fault {
            Fault::None => {}
            Fault::Clamp(most) => {
                let most = (f64::from(most) / contribution.weight.max(1e-9)) as f32;
                contribution.value = contribution.value.map(|v| v.min(most));
            }
            Fault::NoEmitterSamples if matches!(contribution.technique, Technique::Connect { s: 1, .. }) => return,
            Fault::NoOrder2 if contribution.technique.order() == 2 => return,
            Fault::NoEmitterSamples | Fault::NoOrder2 => {}
            Fault::Dim(factor) => contribution.value *= factor,
        }
        self.out.add(contribution);
    }
}

impl Estimator for Faulty {
    fn estimate<S: Sink>(
        &self,
        scene: &Scene,
        request: &Request,
        pixel: Pixel,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        out: &mut S,
    ) {
        self.path.estimate(scene, request, pixel, sampler, scratch, &mut Spoiler { fault: self.fault, out });
    }
}

/// Image means of order 2 over 16 replicates.
fn order_2(scene: &Scene, method: &dyn Integrator, seed: u64) -> Sample {
    let mut render = render(scene, method, CHECKPOINTS[1], seed);
    let pixels = (SIZE * SIZE) as usize;
    let replicates = (0..16).map(|_| {
        render.run_replicate(&|_| {});
        (0..pixels).map(|p| grey(render.last_replicate(2, p))).sum::<f64>() / pixels as f64
    });
    Sample::from(&replicates.collect::<Moments>())
}

/// Every fault is found in all seeds, and one as small as is called detectable in the share of them that is promised; a method
/// without a fault is called faulty in 1 % of them. Each of the five counts has a false-alarm rate of 10⁻⁵.
#[test]
fn biased_methods_are_detected_with_the_promised_power() {
    const LEVEL: f64 = 0.01;
    let scene = builtin("integrating_sphere", SIZE);
    let methods = Methods::standard().with::<Faulty>("faulty", "path with a fault");
    let build = |fault: Fault| methods.build("faulty", &json!({"fault": fault})).unwrap();
    let seeds = experiments(40);
    let of = |method: &dyn Integrator| -> Vec<Sample> {
        (0..seeds as u64).into_par_iter().map(|seed| order_2(&scene, method, seed)).collect()
    };
    let right = of(method("bdpt").as_ref());
    let tests = |fault: Fault| -> Vec<Welch> {
        let wrong = of(build(fault).as_ref());
        right.iter().zip(wrong).map(|(a, b)| welch(*a, b, rounding(2))).collect()
    };
    let count = |tests: &[Welch]| tests.iter().filter(|test| test.p < LEVEL).count();
    let clean = tests(Fault::None);
    // What is detectable on average, in parts of the mean.
    let reach = clean.iter().zip(&right).map(|(test, right)| detectable(test, LEVEL) / right.mean);
    let least = reach.sum::<f64>() / seeds as f64;
    let found = |fault: Fault| count(&tests(fault));
    println!("detectable: {:.1} % of order 2, by 16 replicates at level {LEVEL}", 100.0 * least);
    let (none, small) = (count(&clean), found(Fault::Dim(1.0 - least as f32)));
    println!("of {seeds}: without a fault {none}, dimmed by the detectable bias {small}");
    for fault in [Fault::Clamp(0.02), Fault::NoEmitterSamples, Fault::NoOrder2] {
        let found = found(fault);
        println!("{fault:?}: found in {found} of {seeds}");
        assert_eq!(found, seeds, "{fault:?}");
    }
    let spread = |p: f64| 4.5 * (seeds as f64 * p * (1.0 - p)).sqrt() + 1.0;
    assert!((none as f64) < seeds as f64 * LEVEL + spread(LEVEL), "{none} false alarms of {seeds}");
    assert!(small as f64 > seeds as f64 * POWER - spread(POWER), "{small} of {seeds} found");
}
