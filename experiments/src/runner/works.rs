//! All that a plan renders, piece by piece: for runs that are divided among machines.

use super::reference::Works;
use super::{RunLength, Runner, checkpoint, cost, image_work};
use crate::config::Convergence;
use crate::error::Error;
use crate::integrals;
use crate::job::{IMAGE, Job, Work};
use crate::observations::ONE_BY_ONE;
use crate::plan::Plan;
use crate::reference::pool::PILOT;
use crate::shards::Shards;
use sampling::sampler::SamplerKind;
use std::ops::ControlFlow;

/// A unit of work, independent of all others.
pub enum Task<'a> {
    /// So many replicates of a method in a scene.
    Render(Box<Work<'a>>, u32),
    /// The integrals of known value by one sampler at a number of samples.
    Integrals {
        /// The sampler.
        sampler: SamplerKind,
        /// Pixels and replicates.
        settings: &'a Convergence,
        /// Samples of a replicate.
        samples: u32,
        /// The experiment's seed.
        seed: u64,
    },
}

impl Task<'_> {
    /// What it is called.
    pub fn name(&self) -> String {
        match self {
            Task::Render(work, _) => work.name(),
            Task::Integrals { sampler, samples, .. } => format!("integrals-{sampler}-at_{samples}"),
        }
    }

    /// The hash of what its numbers follow from, the program apart.
    pub fn content(&self) -> blake3::Hash {
        match self {
            Task::Render(work, _) => work.content(),
            Task::Integrals { sampler, settings, samples, seed } => {
                integrals::content(*sampler, settings, *samples, *seed)
            }
        }
    }

    /// Replicates that may be rendered apart: all of them, or one where the whole is one piece.
    pub fn replicates(&self) -> u32 {
        match self {
            Task::Render(_, replicates) => *replicates,
            Task::Integrals { .. } => 1,
        }
    }

    /// How many of them, the first, have to be kept one by one; of the others the moments of groups will do.
    pub fn one_by_one(&self) -> u32 {
        match self {
            Task::Render(work, replicates) if work.is_noted_in_groups() => ONE_BY_ONE.min(*replicates),
            _ => self.replicates(),
        }
    }
}

/// Shows all tasks of a plan, always in the same order.
///
/// # Errors
/// Those of `visit`, and if the plan says not how many samples it takes, or a method cannot render a scene.
pub fn visit(plan: &mut Plan, visit: &mut dyn FnMut(Task) -> Result<(), Error>) -> Result<(), Error> {
    if let Some(settings) = &plan.experiment.integrals {
        for &sampler in &plan.experiment.sampler.0 {
            for &samples in &settings.checkpoints {
                visit(Task::Integrals { sampler, settings, samples, seed: plan.experiment.seed })?;
            }
        }
    }
    for scene in 0..plan.scenes.len() {
        of_reference(plan, scene, visit)?;
        of_images(plan, scene, visit)?;
        let Some(convergence) = plan.experiment.convergence.clone() else { continue };
        checkpoint::with_size(plan, scene, &convergence, |plan, scene| {
            for &samples in &convergence.checkpoints {
                for planned in plan.methods_in(scene) {
                    visit(Task::Render(
                        Box::new(checkpoint::work(plan, scene, planned, samples)?),
                        convergence.replicates,
                    ))?;
                }
            }
            Ok(())
        })?;
    }
    Ok(())
}

/// Pilots and halves.
fn of_reference(plan: &Plan, scene: usize, visit: &mut dyn FnMut(Task) -> Result<(), Error>) -> Result<(), Error> {
    let Some(works) = Works::new(plan, scene) else { return Ok(()) };
    let replicates = plan.reference.as_ref().map_or(0, |reference| reference.asked.replicates);
    works.pilots.into_iter().try_for_each(|work| visit(Task::Render(Box::new(work), PILOT.1)))?;
    works.halves.into_iter().flatten().try_for_each(|work| visit(Task::Render(Box::new(work), replicates)))
}

/// Images, and what their orders cost.
fn of_images(plan: &Plan, scene: usize, visit: &mut dyn FnMut(Task) -> Result<(), Error>) -> Result<(), Error> {
    let unknown = || Error::usage("how many samples a run takes must be known before it is divided; give --spp");
    let samples = plan.budget.known_samples().ok_or_else(unknown)?;
    for planned in plan.methods_in(&plan.scenes[scene]) {
        visit(Task::Render(Box::new(image_work(plan, scene, planned, samples)?), plan.budget.replicates))?;
        if plan.experiment.marginal_cost {
            let works = cost::works(plan, scene, planned, samples)?;
            works.into_iter().try_for_each(|work| visit(Task::Render(Box::new(work), cost::REPLICATES)))?;
        }
    }
    Ok(())
}

impl Runner<'_> {
    /// Has all jobs take their replicates from where they have been rendered apart, job after job: whose turn it is changes no bit.
    pub(super) fn gather(&mut self, shards: &Shards, jobs: &mut [Job], length: &RunLength) -> Result<(), Error> {
        for (turn, job) in jobs.iter_mut().enumerate() {
            let of = if job.what == IMAGE { String::new() } else { format!(", {}", job.what) };
            self.progress.say(format!("{}, {}{of}", job.scene.name, job.planned.label));
            let work = job.work();
            shards.each(&job.content(), job.taken(), &mut |places, bytes| {
                let all = work * places.iter().map(|place| f64::from(place.replicates())).sum::<f64>();
                self.progress.during(all, |_| job.take(places, bytes))?;
                let ended = self.stop.signal().is_some() || job.replicates() >= length.most(turn);
                Ok(if ended { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
            })?;
            if self.stop.signal().is_some() {
                return Ok(());
            }
        }
        Ok(())
    }
}
