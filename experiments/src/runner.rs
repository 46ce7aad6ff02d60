//! Runs a plan: in every scene the methods take turns, replicate by replicate, so that the machine's drift hits all alike.

use crate::config::Convergence;
use crate::convergence::Deviations;
use crate::error::Error;
use crate::integrals;
use crate::path_class;
use crate::plan::{Plan, PlannedMethod, PlannedScene};
use crate::progress::{Progress, Verbosity};
use crate::result::{Checkpoint, IntegralResult, MethodResult};
use crate::stop::Stop;
use integrators::{Layer, Render, RenderSettings, Window, render};

/// Runs all of the plan in the current thread pool: integrals, then scene after scene. After an early end, what is complete.
///
/// # Errors
/// If a method cannot render a scene.
pub fn run(
    plan: &mut Plan,
    verbosity: Verbosity,
    stop: &Stop,
) -> Result<(Vec<MethodResult>, Vec<IntegralResult>), Error> {
    let samples = samples_per_replicate(plan, stop)?;
    let mut progress = Progress::new(total_work(plan, &samples), verbosity);
    let (samplers, seed) = (&plan.experiment.sampler.0, plan.experiment.seed);
    let asked = plan.experiment.integrals.as_ref();
    let integrals = asked.map(|asked| integrals::measure(samplers, asked, seed, &mut progress, stop));
    let mut results = Vec::new();
    for (scene, samples) in samples.iter().enumerate() {
        let mut of_scene = compare_methods(plan, &plan.scenes[scene], samples, &mut progress, stop)?;
        if let (Some(convergence), None) = (plan.experiment.convergence.clone(), stop.signal()) {
            let checkpoints = with_size(plan, scene, &convergence, |plan, scene| {
                measure_convergence(plan, scene, &convergence, &mut progress, stop)
            })?;
            of_scene.iter_mut().zip(checkpoints).for_each(|(result, points)| result.convergence = points);
        }
        results.extend(of_scene);
        if stop.signal().is_some() {
            break;
        }
    }
    Ok((results, integrals.unwrap_or_default()))
}

/// Samples of a replicate, by scene and method.
fn samples_per_replicate(plan: &Plan, stop: &Stop) -> Result<Vec<Vec<u32>>, Error> {
    let of = |scene: &PlannedScene| {
        let budget = |planned: &PlannedMethod| {
            let settings = plan.render_settings(planned);
            let render = |settings| Render::cropped(&scene.scene, &*planned.method, settings, Window::of(&scene.scene));
            plan.budget.samples_per_replicate(&render, &settings, stop)
        };
        plan.methods.iter().map(budget).collect()
    };
    plan.scenes.iter().map(of).collect()
}

/// Pixel samples of the whole plan.
fn total_work(plan: &Plan, samples: &[Vec<u32>]) -> f64 {
    let images = plan.scenes.iter().zip(samples).map(|(scene, samples)| {
        let samples: f64 = samples.iter().map(|&n| f64::from(n)).sum();
        pixels(scene) * samples * f64::from(plan.budget.replicates)
    });
    let checkpoints = plan.experiment.convergence.as_ref().map_or(0.0, |c| {
        let samples: f64 = c.checkpoints.iter().map(|&n| f64::from(n)).sum();
        let [width, height] = c.size.map(f64::from);
        width * height * samples * f64::from(c.replicates) * (plan.methods.len() * plan.scenes.len()) as f64
    });
    let integrals = plan.experiment.integrals.as_ref().map_or(0.0, |asked| {
        let all: f64 = asked.checkpoints.iter().map(|&samples| integrals::work(asked, samples)).sum();
        all * plan.experiment.sampler.0.len() as f64
    });
    images.sum::<f64>() + checkpoints + integrals
}

fn pixels(scene: &PlannedScene) -> f64 {
    f64::from(scene.scene.camera.width()) * f64::from(scene.scene.camera.height())
}

/// Does something with a scene while its camera has the size of the convergence checkpoints, or its own where that is smaller.
fn with_size<T>(
    plan: &mut Plan,
    scene: usize,
    convergence: &Convergence,
    work: impl FnOnce(&Plan, &PlannedScene) -> Result<T, Error>,
) -> Result<T, Error> {
    let camera = &mut plan.scenes[scene].scene.camera;
    let (width, height) = (camera.width(), camera.height());
    camera.set_size(width.min(convergence.size[0]), height.min(convergence.size[1]));
    let result = work(plan, &plan.scenes[scene]);
    plan.scenes[scene].scene.camera.set_size(width, height);
    result
}

/// Every method's replicates in one scene. Methods of which no replicate is complete are left out.
fn compare_methods(
    plan: &Plan,
    scene: &PlannedScene,
    samples: &[u32],
    progress: &mut Progress,
    stop: &Stop,
) -> Result<Vec<MethodResult>, Error> {
    let mut renders = Vec::new();
    for (planned, &samples_per_replicate) in plan.methods.iter().zip(samples) {
        let settings = RenderSettings { samples_per_replicate, ..plan.render_settings(planned) };
        let request = render::request(&scene.scene, &*planned.method, &settings, &plan.parts)?;
        let request = request.with_fireflies();
        renders.push(Render::of_request(&scene.scene, &*planned.method, settings, Window::of(&scene.scene), request)?);
    }
    'replicates: for replicate in 0..plan.budget.replicates {
        for ((render, planned), &n) in renders.iter_mut().zip(&plan.methods).zip(samples) {
            progress.say(format!("{}, {}, {} of {}", scene.name, planned.label, replicate + 1, plan.budget.replicates));
            progress.during(pixels(scene) * f64::from(n), |report| render.run_replicate(report));
            if stop.signal().is_some() {
                break 'replicates;
            }
        }
    }
    let complete = renders.into_iter().zip(&plan.methods).filter(|(render, _)| render.replicates() > 0);
    let results = complete.map(|(render, planned)| MethodResult {
        scene: scene.name.clone(),
        method: planned.method.name().to_owned(),
        label: planned.label.clone(),
        entry: planned.entry.clone(),
        sampler: planned.sampler,
        settings: planned.method.settings(),
        setting: planned.setting.clone(),
        measurement: render.finish(),
        convergence: Vec::new(),
        missing_light: path_class::missing(&*planned.method, &scene.scene),
        skipped: scene.scene.needs.skipped().into_iter().map(str::to_owned).collect(),
    });
    Ok(results.collect())
}

/// Every method's checkpoints in one scene, whose camera has the right size already. A checkpoint that the user's early end
/// leaves incomplete is left out.
fn measure_convergence(
    plan: &Plan,
    scene: &PlannedScene,
    convergence: &Convergence,
    progress: &mut Progress,
    stop: &Stop,
) -> Result<Vec<Vec<Checkpoint>>, Error> {
    let mut points: Vec<Vec<Checkpoint>> = vec![Vec::new(); plan.methods.len()];
    for &samples in &convergence.checkpoints {
        let mut runs = Vec::new();
        for planned in &plan.methods {
            let settings = checkpoint_settings(plan, scene, planned, samples);
            runs.push(CheckpointRun::new(
                scene,
                Render::new(&scene.scene, &*planned.method, settings.clone())?,
                &settings,
            ));
        }
        for replicate in 0..convergence.replicates {
            for (run, planned) in runs.iter_mut().zip(&plan.methods) {
                progress.say(format!(
                    "{}, {} at {samples} samples, {} of {}",
                    scene.name,
                    planned.label,
                    replicate + 1,
                    convergence.replicates
                ));
                progress.during(pixels(scene) * f64::from(samples), |report| run.next(report));
                if stop.signal().is_some() {
                    return Ok(points);
                }
            }
        }
        points.iter_mut().zip(runs).for_each(|(points, run)| points.extend(run.finish(samples)));
    }
    Ok(points)
}

/// Every checkpoint draws numbers of its own, so that they are independent of one another and of the images.
fn checkpoint_settings(plan: &Plan, scene: &PlannedScene, planned: &PlannedMethod, samples: u32) -> RenderSettings {
    let (width, height) = (scene.scene.camera.width(), scene.scene.camera.height());
    let settings = plan.render_settings(planned);
    let instance = format!("{} {width}x{height} at {samples}", settings.instance);
    RenderSettings { samples_per_replicate: samples, instance, ..settings }
}

/// One method at one number of samples.
struct CheckpointRun<'a> {
    render: Render<'a>,
    layers: Vec<Layer>,
    deviations: Deviations,
}

impl<'a> CheckpointRun<'a> {
    fn new(scene: &PlannedScene, render: Render<'a>, settings: &RenderSettings) -> Self {
        let layers = integrators::Request::new(settings.orders.clone(), settings.tail).layers().to_vec();
        let pixels = scene.scene.camera.width() as usize * scene.scene.camera.height() as usize;
        Self { render, deviations: Deviations::new(pixels, layers.len()), layers }
    }

    fn next(&mut self, report: &(dyn Fn(f64) + Sync)) {
        self.render.run_replicate(report);
        let render = &self.render;
        self.deviations.push(|layer, pixel| render.last_replicate(layer, pixel));
    }

    fn finish(self, samples: u32) -> Vec<Checkpoint> {
        let seconds = self.render.seconds() / f64::from(self.render.replicates());
        self.deviations.checkpoints(samples, seconds, &self.layers)
    }
}
