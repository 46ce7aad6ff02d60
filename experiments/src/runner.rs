//! Runs a plan: in every scene the methods take turns, replicate by replicate, so that the machine's drift hits all alike.
//!
//! What an earlier run has rendered of it is taken up, and what is rendered is saved from time to time.

use crate::config::Convergence;
use crate::convergence::Deviations;
use crate::error::Error;
use crate::integrals;
use crate::job::{Job, Observations};
use crate::path_class;
use crate::plan::{Plan, PlannedMethod, PlannedScene};
use crate::progress::{Progress, Verbosity};
use crate::result::{Checkpoint, IntegralResult, MethodResult, RenderRecord};
use crate::states::{States, Unit};
use crate::stop::Stop;
use integrators::{PartSettings, Render, RenderSettings, Request, Window, render};

/// What a run leaves behind.
#[derive(Debug, Default)]
pub struct Outcome {
    /// Every method in every scene.
    pub methods: Vec<MethodResult>,
    /// Integrals of known value.
    pub integrals: Vec<IntegralResult>,
    /// What was rendered, and what of it by earlier runs.
    pub renders: Vec<RenderRecord>,
}

/// Runs all of the plan in the current thread pool: integrals, then scene after scene. After an early end, what is complete.
///
/// # Errors
/// If a method cannot render a scene, or a state cannot be read or written, or holds more replicates than are asked for.
pub fn run(plan: &mut Plan, states: &mut States, verbosity: Verbosity, stop: &Stop) -> Result<Outcome, Error> {
    let samples = samples_per_replicate(plan, states, stop)?;
    check_states(plan, &samples, states)?;
    let mut runner = Runner { states, progress: Progress::new(total_work(plan, &samples), verbosity), stop };
    let mut outcome = Outcome::default();
    if let Some(asked) = &plan.experiment.integrals {
        let (samplers, seed) = (&plan.experiment.sampler.0, plan.experiment.seed);
        outcome.integrals = integrals::measure(samplers, asked, seed, runner.states, &mut runner.progress, stop)?;
    }
    for (scene, samples) in samples.iter().enumerate() {
        let first = outcome.methods.len();
        runner.compare_methods(plan, &plan.scenes[scene], samples, &mut outcome)?;
        if let (Some(convergence), None) = (plan.experiment.convergence.clone(), stop.signal()) {
            let checkpoints = with_size(plan, scene, &convergence, |plan, scene| {
                runner.measure_convergence(plan, scene, &convergence, &mut outcome.renders)
            })?;
            let of_scene = outcome.methods[first..].iter_mut();
            of_scene.zip(checkpoints).for_each(|(result, points)| result.convergence = points);
        }
        if stop.signal().is_some() {
            break;
        }
    }
    Ok(outcome)
}

/// Samples of a replicate, by scene and method.
fn samples_per_replicate(plan: &Plan, states: &mut States, stop: &Stop) -> Result<Vec<Vec<u32>>, Error> {
    let mut of = |scene: &PlannedScene, planned: &PlannedMethod| {
        let settings = plan.render_settings(planned);
        let render = |settings| Render::cropped(&scene.scene, &*planned.method, settings, Window::of(&scene.scene));
        let choose = || plan.budget.samples_per_replicate(&render, &settings, stop);
        let Some(seconds) = plan.experiment.seconds else { return choose() };
        // A pilot is asked but once: on another day it would choose another number.
        let each = seconds / f64::from(plan.budget.replicates);
        states.chosen(&Unit::of_render(scene, planned, &settings, &plan.parts, &format!("{each}_s_each")), choose)
    };
    plan.scenes.iter().map(|scene| plan.methods.iter().map(|planned| of(scene, planned)).collect()).collect()
}

/// What the images of a method in a scene are rendered by.
fn image_settings(plan: &Plan, planned: &PlannedMethod, samples_per_replicate: u32) -> RenderSettings {
    RenderSettings { samples_per_replicate, ..plan.render_settings(planned) }
}

/// Refuses a plan of fewer replicates than there are: a part of what has been rendered cannot be taken back.
fn check_states(plan: &Plan, samples: &[Vec<u32>], states: &States) -> Result<(), Error> {
    let asked = plan.budget.replicates;
    for (scene, samples) in plan.scenes.iter().zip(samples) {
        for (planned, &n) in plan.methods.iter().zip(samples) {
            let unit = Unit::of_render(scene, planned, &image_settings(plan, planned, n), &plan.parts, IMAGE);
            if let Some(more) = states.replicates(&unit).filter(|&found| found > asked) {
                return Err(Error::usage(format!(
                    "{more} replicates of {} in {} are rendered already, more than the {asked} asked for; ask for at least {more} \
                     of {n} samples each, or discard them with --fresh",
                    planned.label, scene.name
                )));
            }
        }
    }
    Ok(())
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

/// What the states of images are called.
const IMAGE: &str = "image";

/// A plan at work.
struct Runner<'r> {
    states: &'r mut States,
    progress: Progress,
    stop: &'r Stop,
}

impl Runner<'_> {
    /// Every method's replicates in one scene. Methods of which no replicate is complete are left out.
    fn compare_methods(
        &mut self,
        plan: &Plan,
        scene: &PlannedScene,
        samples: &[u32],
        outcome: &mut Outcome,
    ) -> Result<(), Error> {
        let mut jobs = Vec::new();
        for (planned, &n) in plan.methods.iter().zip(samples) {
            let settings = image_settings(plan, planned, n);
            let request = render::request(&scene.scene, &*planned.method, &settings, &plan.parts)?.with_fireflies();
            let noted = Observations::default();
            jobs.push(Job::open(
                scene,
                planned,
                (settings, request, &plan.parts),
                IMAGE.to_owned(),
                noted,
                self.states,
            )?);
        }
        self.take_turns(&mut jobs, plan.budget.replicates)?;
        outcome.renders.extend(jobs.iter().map(Job::record));
        outcome.methods.extend(jobs.into_iter().filter(|job| job.replicates() > 0).map(result));
        Ok(())
    }

    /// Every method's checkpoints in one scene, whose camera has the right size already. A checkpoint that the user's early end
    /// leaves incomplete is left out.
    fn measure_convergence(
        &mut self,
        plan: &Plan,
        scene: &PlannedScene,
        convergence: &Convergence,
        renders: &mut Vec<RenderRecord>,
    ) -> Result<Vec<Vec<Checkpoint>>, Error> {
        let mut points: Vec<Vec<Checkpoint>> = vec![Vec::new(); plan.methods.len()];
        for &samples in &convergence.checkpoints {
            let mut jobs = Vec::new();
            for planned in &plan.methods {
                jobs.push(checkpoint(plan, scene, planned, samples, self.states)?);
            }
            self.take_turns(&mut jobs, convergence.replicates)?;
            renders.extend(jobs.iter().map(Job::record));
            if jobs.iter().any(|job| job.replicates() < convergence.replicates) {
                return Ok(points);
            }
            points.iter_mut().zip(jobs).for_each(|(points, job)| points.extend(checkpoints(plan, job, samples)));
        }
        Ok(points)
    }

    /// Has all jobs render up to so many replicates, or until the user asks for an end; their states are saved then.
    fn take_turns(&mut self, jobs: &mut [Job], replicates: u32) -> Result<(), Error> {
        for job in jobs.iter() {
            self.progress.skip(f64::from(job.replicates()) * job.work());
        }
        for replicate in 0..replicates {
            for turn in 0..jobs.len() {
                let job = &mut jobs[turn];
                if job.replicates() > replicate {
                    continue;
                }
                let (scene, label, what) = (&job.scene.name, &job.planned.label, &job.what);
                let of = if what == IMAGE { String::new() } else { format!(", {what}") };
                self.progress.say(format!("{scene}, {label}{of}, {} of {replicates}", replicate + 1));
                let seconds = self.progress.during(job.work(), |report| job.run_replicate(report));
                let ended = self.stop.signal().is_some();
                if self.states.due(seconds) || ended {
                    jobs.iter_mut().try_for_each(|job| job.save(self.states))?;
                }
                if ended {
                    return Ok(());
                }
            }
        }
        jobs.iter_mut().try_for_each(|job| job.save(self.states))
    }
}

/// What a method has measured in a scene.
fn result(job: Job) -> MethodResult {
    let (scene, planned) = (job.scene, job.planned);
    MethodResult {
        scene: scene.name.clone(),
        method: planned.method.name().to_owned(),
        label: planned.label.clone(),
        entry: planned.entry.clone(),
        sampler: planned.sampler,
        settings: planned.method.settings(),
        setting: planned.setting.clone(),
        measurement: job.finish().0,
        convergence: Vec::new(),
        missing_light: path_class::missing(&*planned.method, &scene.scene),
        bias: planned.method.bias(),
        skipped: scene.scene.needs.skipped().into_iter().map(str::to_owned).collect(),
    }
}

/// A method at one number of samples. Every checkpoint draws numbers of its own, so that they are independent of one another and
/// of the images.
fn checkpoint<'a>(
    plan: &Plan,
    scene: &'a PlannedScene,
    planned: &'a PlannedMethod,
    samples: u32,
    states: &mut States,
) -> Result<Job<'a>, Error> {
    let (width, height) = (scene.scene.camera.width(), scene.scene.camera.height());
    let settings = image_settings(plan, planned, samples);
    let instance = format!("{} {width}x{height} at {samples}", settings.instance);
    let layers = Request::new(settings.orders.clone(), settings.tail).layers().len();
    let deviations = Deviations::new(width as usize * height as usize, layers);
    let settings = RenderSettings { instance, ..settings };
    let noted = Observations { deviations: Some(deviations) };
    let parts = PartSettings::default();
    let request = render::request(&scene.scene, &*planned.method, &settings, &parts)?;
    Job::open(scene, planned, (settings, request, &parts), format!("{width}x{height}_at_{samples}"), noted, states)
}

/// What a checkpoint has measured, layer by layer.
fn checkpoints(plan: &Plan, job: Job, samples: u32) -> Vec<Checkpoint> {
    let settings = plan.render_settings(job.planned);
    let request = Request::new(settings.orders, settings.tail);
    let seconds = job.seconds_of_replicate();
    let deviations = job.finish().1.deviations;
    deviations.map(|d| d.checkpoints(samples, seconds, request.layers())).unwrap_or_default()
}
