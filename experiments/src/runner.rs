//! Runs a plan: in every scene the methods take turns, replicate by replicate, so that the machine's drift hits all alike.
//!
//! What an earlier run has rendered of it is taken up, and what is rendered is saved from time to time.

use crate::budget::Budget;
use crate::error::Error;
use crate::integrals;
use crate::job::{IMAGE, Job, Work};
use crate::live::Display;
use crate::observations::Observations;
use crate::path_class;
use crate::plan::{Plan, PlannedMethod, PlannedScene};
use crate::progress::Progress;
use crate::reference::Truth;
use crate::result::{IntegralResult, MethodResult, RenderRecord, SceneTruth, SequenceRow};
use crate::states::{States, Unit};
use crate::stop::Stop;
use checkpoint::with_size;
pub use compose::compose;
use integrators::{Render, RenderSettings, Window, render};
use reference::Works;
pub use reference::hash as reference_hash;
use std::sync::Arc;
use until::{RunLength, StoppingRule};

mod checkpoint;
mod compose;
mod cost;
mod reference;
mod until;
pub mod works;

/// What a run leaves behind.
#[derive(Debug, Default)]
pub struct Outcome {
    /// Every method in every scene.
    pub methods: Vec<MethodResult>,
    /// What they were judged by.
    pub references: Vec<SceneTruth>,
    /// What confidence sequences said at the end.
    pub sequences: Vec<SequenceRow>,
    /// Integrals of known value.
    pub integrals: Vec<IntegralResult>,
    /// What was rendered, and what of it by earlier runs.
    pub renders: Vec<RenderRecord>,
}

/// Runs all of the plan in the current thread pool: integrals, then scene after scene. After an early end, what is complete.
///
/// # Errors
/// If a method cannot render a scene, or a state cannot be read or written, or holds more replicates than are asked for.
pub fn run(plan: &mut Plan, states: &mut States, display: impl Into<Display>, stop: &Stop) -> Result<Outcome, Error> {
    let samples = samples_per_replicate(plan, states, stop)?;
    check_states(plan, &samples, states)?;
    let lengths = lengths(plan, &samples, states, stop)?;
    let mut runner = Runner { states, progress: Progress::new(total_work(plan, &samples, &lengths), display), stop };
    let mut outcome = Outcome::default();
    if let Some(asked) = &plan.experiment.integrals {
        let (samplers, seed) = (&plan.experiment.sampler.0, plan.experiment.seed);
        outcome.integrals = integrals::measure(samplers, asked, seed, runner.states, &mut runner.progress, stop)?;
    }
    for (scene, (samples, length)) in samples.iter().zip(&lengths).enumerate() {
        let first = outcome.methods.len();
        let truth = runner.reference(plan, scene, &mut outcome.renders)?;
        if plan.reference.is_some() && stop.signal().is_some() {
            break;
        }
        runner.compare_methods(plan, scene, (samples, length), truth.as_ref(), &mut outcome)?;
        let truth = truth.map(|truth| SceneTruth { scene: plan.scenes[scene].name.clone(), truth });
        outcome.references.extend(truth);
        if plan.experiment.marginal_cost && stop.signal().is_none() {
            for result in &mut outcome.methods[first..] {
                let with_samples = plan
                    .methods_in(&plan.scenes[scene])
                    .zip(samples)
                    .find(|(planned, _)| planned.label == result.label);
                if let Some((planned, &samples)) = with_samples {
                    runner.measure_costs((plan, scene, planned), samples, result)?;
                }
            }
        }
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

/// What the user's seconds are turned into.
enum Pilot {
    /// Samples of each of the replicates.
    Each,
    /// The most samples of all of them.
    Most,
}

/// Samples of a replicate, by scene and method.
fn samples_per_replicate(plan: &Plan, states: &mut States, stop: &Stop) -> Result<Vec<Vec<u32>>, Error> {
    let mut of =
        |scene: &PlannedScene, planned: &PlannedMethod| by_pilot(plan, scene, planned, Pilot::Each, states, stop);
    plan.scenes.iter().map(|scene| plan.methods_in(scene).map(|planned| of(scene, planned)).collect()).collect()
}

/// Samples that a budget gives a method in a scene. A pilot is asked but once: on another day it would choose another number.
fn by_pilot(
    plan: &Plan,
    scene: &PlannedScene,
    planned: &PlannedMethod,
    pilot: Pilot,
    states: &mut States,
    stop: &Stop,
) -> Result<u32, Error> {
    let settings = plan.render_settings(planned);
    let render = |settings| Render::cropped(&scene.scene, &*planned.method, settings, Window::of(&scene.scene));
    let (budget, what) = match (pilot, plan.experiment.seconds) {
        (Pilot::Most, Some(seconds)) => {
            (Budget::seconds(seconds, 1).map_err(Error::usage)?, format!("{seconds}_s_at_most"))
        }
        (Pilot::Each, Some(seconds)) if plan.experiment.until.is_none() => {
            (plan.budget, format!("{}_s_each", seconds / f64::from(plan.budget.replicates)))
        }
        _ => return plan.budget.samples_per_replicate(&render, &settings, stop),
    };
    let unit = Unit::of_render(scene, planned, &settings, &plan.parts, (&what, ""));
    states.chosen(&unit, || budget.samples_per_replicate(&render, &settings, stop))
}

/// When each scene's methods have replicates enough.
fn lengths(plan: &Plan, samples: &[Vec<u32>], states: &mut States, stop: &Stop) -> Result<Vec<RunLength>, Error> {
    let fewest = plan.budget.replicates;
    let Some(until) = plan.experiment.until else {
        return Ok(plan.scenes.iter().map(|_| RunLength::Replicates(fewest)).collect());
    };
    let mut length = |(scene, samples): (&PlannedScene, &Vec<u32>)| {
        let mut most = Vec::new();
        for (planned, &n) in plan.methods_in(scene).zip(samples) {
            let mut all = plan.experiment.max_spp.unwrap_or(u32::MAX);
            if plan.experiment.seconds.is_some() {
                all = all.min(by_pilot(plan, scene, planned, Pilot::Most, states, stop)?);
            }
            most.push((all / n).max(fewest));
        }
        Ok(RunLength::Until(StoppingRule { until, max_order: plan.experiment.max_order, fewest, most }))
    };
    plan.scenes.iter().zip(samples).map(&mut length).collect()
}

/// What the images of a method in a scene are rendered by.
fn image_settings(plan: &Plan, planned: &PlannedMethod, samples_per_replicate: u32) -> RenderSettings {
    RenderSettings { samples_per_replicate, ..plan.render_settings(planned) }
}

/// The images of a method in a scene, of so many samples a replicate.
fn image_work<'a>(plan: &'a Plan, scene: usize, planned: &'a PlannedMethod, samples: u32) -> Result<Work<'a>, Error> {
    let settings = image_settings(plan, planned, samples);
    let of = &plan.scenes[scene];
    let request = render::request(&of.scene, &*planned.method, &settings, &plan.parts)?.with_fireflies();
    let judged_by = reference_hash(plan, scene).map_or(String::new(), |hash| format!("{hash} {:?}", plan.metrics));
    Ok(Work { scene: of, planned, settings, request, parts: plan.parts.clone(), what: IMAGE.to_owned(), judged_by })
}

/// Refuses a plan of fewer replicates than there are: a part of what has been rendered cannot be taken back.
fn check_states(plan: &Plan, samples: &[Vec<u32>], states: &States) -> Result<(), Error> {
    let check = |work: &Work, asked: u32| {
        let Some(more) = states.replicates(&work.unit()).filter(|&found| found > asked) else { return Ok(()) };
        let (label, scene, n) = (&work.planned.label, &work.scene.name, work.settings.samples_per_replicate);
        let of = if work.what == IMAGE { "" } else { ", for its reference," };
        Err(Error::usage(format!(
            "{more} replicates of {label} in {scene}{of} are rendered already, more than the {asked} asked for; ask for at least \
             {more} of {n} samples each, or discard them with --fresh"
        )))
    };
    for (scene, samples) in samples.iter().enumerate() {
        let methods = plan.methods_in(&plan.scenes[scene]);
        for (planned, &n) in methods.zip(samples).filter(|_| plan.experiment.until.is_none()) {
            check(&image_work(plan, scene, planned, n)?, plan.budget.replicates)?;
        }
        let asked = plan.reference.as_ref().map_or(0, |reference| reference.asked.replicates);
        for work in Works::new(plan, scene).iter().flat_map(|works| works.halves.iter().flatten()) {
            check(work, asked)?;
        }
    }
    Ok(())
}

/// Pixel samples of the whole plan, at most.
fn total_work(plan: &Plan, samples: &[Vec<u32>], lengths: &[RunLength]) -> f64 {
    let images = plan.scenes.iter().zip(samples.iter().zip(lengths)).map(|(scene, (samples, length))| {
        let of = |(i, &n): (usize, &u32)| f64::from(n) * f64::from(length.most(i));
        pixels(scene) * samples.iter().enumerate().map(of).sum::<f64>()
    });
    let asked = plan.reference.as_ref().map_or(0, |reference| reference.asked.replicates);
    let references: f64 =
        (0..plan.scenes.len()).filter_map(|scene| Some(Works::new(plan, scene)?.samples(asked))).sum();
    let costs = plan.scenes.iter().zip(samples).map(|(scene, samples)| {
        let of = |(planned, &n): (&PlannedMethod, &u32)| {
            f64::from(n) * plan.render_settings(planned).orders.iter().count() as f64 * f64::from(cost::REPLICATES)
        };
        pixels(scene) * plan.methods_in(scene).zip(samples).map(of).sum::<f64>()
    });
    let costs = if plan.experiment.marginal_cost { costs.sum() } else { 0.0 };
    let checkpoints = plan.experiment.convergence.as_ref().map_or(0.0, |c| {
        let samples: f64 = c.checkpoints.iter().map(|&n| f64::from(n)).sum();
        let [width, height] = c.size.map(f64::from);
        width * height * samples * f64::from(c.replicates) * (plan.methods.len() * plan.scenes.len()) as f64
    });
    let integrals = plan.experiment.integrals.as_ref().map_or(0.0, |asked| {
        let all: f64 = asked.checkpoints.iter().map(|&samples| integrals::work(asked, samples)).sum();
        all * plan.experiment.sampler.0.len() as f64
    });
    images.sum::<f64>() + references + costs + checkpoints + integrals
}

fn pixels(scene: &PlannedScene) -> f64 {
    f64::from(scene.scene.camera.width()) * f64::from(scene.scene.camera.height())
}

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
        scene: usize,
        (samples, length): (&[u32], &RunLength),
        truth: Option<&Arc<Truth>>,
        outcome: &mut Outcome,
    ) -> Result<(), Error> {
        let mut jobs = Vec::new();
        for (planned, &n) in plan.methods_in(&plan.scenes[scene]).zip(samples) {
            let work = image_work(plan, scene, planned, n)?;
            let layers = work.request.layers();
            let judge = truth.map(|truth| truth.judge(layers, &plan.metrics));
            let noted = Observations::of_images(work.pixels(), layers.len(), judge.as_ref());
            jobs.push(Job::open(work, noted, judge, self.states)?);
        }
        self.take_turns(&mut jobs, length)?;
        outcome.renders.extend(jobs.iter().map(Job::record));
        jobs.retain(|job| job.replicates() > 0);
        if let RunLength::Until(rule) = length {
            outcome.sequences.extend(rule.rows(&jobs));
        }
        let targets = &plan.experiment.time_to_error;
        outcome.methods.extend(jobs.into_iter().map(|job| result(job, targets)));
        Ok(())
    }

    /// Has all jobs render until they have replicates enough, or until the user asks for an end; their states are saved then.
    fn take_turns(&mut self, jobs: &mut [Job], length: &RunLength) -> Result<(), Error> {
        if let Some(shards) = self.states.shards() {
            return self.gather(&shards, jobs, length);
        }
        for job in jobs.iter() {
            self.progress.skip(f64::from(job.replicates()) * job.work());
        }
        for replicate in 0.. {
            let wanted = length.wants(jobs, replicate);
            check_excess(jobs, &wanted, replicate)?;
            if !wanted.contains(&true) {
                break;
            }
            for turn in (0..jobs.len()).filter(|&turn| wanted[turn]) {
                let job = &mut jobs[turn];
                if job.replicates() > replicate {
                    continue;
                }
                let (scene, label, what) = (&job.scene.name, &job.planned.label, &job.what);
                let of = if what == IMAGE { String::new() } else { format!(", {what}") };
                self.states.check_renders(&format!("{label} in {scene}{of}"))?;
                let most = length.most(turn);
                self.progress.say(format!("{scene}, {label}{of}, {} of {most}", replicate + 1));
                let seconds = self.progress.during(job.work(), |report| job.run_replicate(report));
                if job.what == IMAGE {
                    self.progress.show(&format!("{label} in {scene}"), job.image(), job.replicates() == most);
                }
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

/// Refuses replicates beyond those that a budget asks for, which an earlier run with another one has left.
fn check_excess(jobs: &[Job], wanted: &[bool], replicates: u32) -> Result<(), Error> {
    let beyond = |(job, wanted): &(&Job, &bool)| !**wanted && job.replicates() > replicates;
    let Some((job, _)) = jobs.iter().zip(wanted).find(beyond) else { return Ok(()) };
    Err(Error::usage(format!(
        "{} replicates of {} in {} are rendered already, more than the {replicates} that reach the target; ask for more, or discard \
         them with --fresh",
        job.replicates(),
        job.planned.label,
        job.scene.name
    )))
}

/// What a method has measured in a scene, and the times to these errors.
fn result(job: Job, targets: &[f64]) -> MethodResult {
    let (scene, planned, judge) = (job.scene, job.planned, job.judge());
    let (measurement, noted) = job.finish();
    let seconds = &measurement.replicate_seconds;
    MethodResult {
        scene: scene.name.clone(),
        method: planned.method.name().to_owned(),
        label: planned.label.clone(),
        entry: planned.entry.clone(),
        sampler: planned.sampler,
        settings: planned.method.settings(),
        setting: planned.setting.clone(),
        intervals: noted.intervals(seconds),
        marginal: Vec::new(),
        judged: judge.and_then(|judge| noted.judged(&judge, seconds, targets)),
        largest_hits: path_class::largest_hits(&*planned.method, &scene.scene, &measurement.layers),
        measurement,
        convergence: Vec::new(),
        missing_light: path_class::missing(&*planned.method, &scene.scene),
        bias: planned.method.bias(),
        skipped: scene.scene.needs.skipped().into_iter().map(str::to_owned).collect(),
    }
}
