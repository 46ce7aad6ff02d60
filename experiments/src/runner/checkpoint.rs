//! Variance against samples: checkpoints, each of them a render of its own.

use super::{RunLength, Runner, image_settings};
use crate::config::Convergence;
use crate::convergence::Deviations;
use crate::error::Error;
use crate::job::{Job, Work};
use crate::observations::Observations;
use crate::plan::{Plan, PlannedMethod, PlannedScene};
use crate::result::{Checkpoint, RenderRecord};
use integrators::{PartSettings, RenderSettings, Request, render};

impl Runner<'_> {
    /// Every method's checkpoints in one scene, whose camera has the right size already. A checkpoint that the user's early end
    /// leaves incomplete is left out.
    pub(super) fn measure_convergence(
        &mut self,
        plan: &Plan,
        scene: &PlannedScene,
        convergence: &Convergence,
        renders: &mut Vec<RenderRecord>,
    ) -> Result<Vec<Vec<Checkpoint>>, Error> {
        let mut points: Vec<Vec<Checkpoint>> = vec![Vec::new(); plan.methods.len()];
        for &samples in &convergence.checkpoints {
            let mut jobs = Vec::new();
            for planned in plan.methods_in(scene) {
                let work = work(plan, scene, planned, samples)?;
                let deviations = Some(Deviations::new(work.pixels(), work.request.layers().len()));
                let noted = Observations { deviations, ..Observations::default() };
                jobs.push(Job::open(work, noted, None, self.states)?);
            }
            self.take_turns(&mut jobs, &RunLength::Replicates(convergence.replicates))?;
            renders.extend(jobs.iter().map(Job::record));
            if jobs.iter().any(|job| job.replicates() < convergence.replicates) {
                return Ok(points);
            }
            points.iter_mut().zip(jobs).for_each(|(points, job)| points.extend(checkpoints(plan, job, samples)));
        }
        Ok(points)
    }
}

/// A method at one number of samples, in a scene whose camera has the right size already. Every checkpoint draws numbers of its own, so
/// that they are independent of one another and of the images.
pub fn work<'a>(
    plan: &Plan,
    scene: &'a PlannedScene,
    planned: &'a PlannedMethod,
    samples: u32,
) -> Result<Work<'a>, Error> {
    let (width, height) = (scene.scene.camera.width(), scene.scene.camera.height());
    let settings = image_settings(plan, planned, samples);
    let instance = format!("{} {width}x{height} at {samples}", settings.instance);
    let settings = RenderSettings { instance, ..settings };
    let parts = PartSettings::default();
    let request = render::request(&scene.scene, &*planned.method, &settings, &parts)?;
    let (what, judged_by) = (format!("{width}x{height}_at_{samples}"), String::new());
    Ok(Work { scene, planned, settings, request, parts, what, judged_by })
}

/// Does something with a scene while its camera has the size of the convergence checkpoints, or its own where that is smaller.
pub fn with_size<T>(
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

/// What a checkpoint has measured, layer by layer.
fn checkpoints(plan: &Plan, job: Job, samples: u32) -> Vec<Checkpoint> {
    let settings = plan.render_settings(job.planned);
    let request = Request::new(settings.orders, settings.tail);
    let (measurement, noted) = job.finish();
    let seconds = &measurement.replicate_seconds;
    noted.deviations.map(|d| d.checkpoints(samples, seconds, request.layers())).unwrap_or_default()
}
