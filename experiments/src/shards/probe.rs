//! What work probably costs, from short renders.

use super::plan::UnitOfWork;
use crate::error::Error;
use crate::integrals;
use crate::job::Work;
use crate::plan::Plan;
use crate::runner::works::{self, Task};
use crate::stop::Stop;
use integrators::RenderSettings;
use sampling::sampler::Role;
use std::collections::HashMap;

/// A render that takes so long \[s\] tells how long others take.
const LONG_ENOUGH: f64 = 0.05;
/// What a replicate takes in a file beside its film \[bytes\], roughly.
const BESIDE: u64 = 4096;

/// All units of work of a plan, with what they cost.
///
/// # Errors
/// If a method cannot render a scene, or the user asks for an end.
pub fn units(plan: &mut Plan, stop: &Stop) -> Result<Vec<UnitOfWork>, Error> {
    let mut units = Vec::new();
    // By scene and its size, method, and orders: seconds for one sample of all pixels.
    let mut known: HashMap<String, f64> = HashMap::new();
    works::visit(plan, &mut |task: Task| {
        stop.check()?;
        let (seconds, bytes) = match &task {
            Task::Render(work, _) => {
                let RenderSettings { orders, tail, .. } = &work.settings;
                let (scene, label, pixels) = (&work.scene.name, &work.planned.label, work.pixels());
                let kind = format!("{scene} {pixels} {label} {orders:?} {tail}");
                let per_sample = match known.get(&kind) {
                    Some(&seconds) => seconds,
                    None => *known.entry(kind).or_insert(seconds_per_sample(work, stop)?),
                };
                let bytes = 24 * (pixels * work.request.film_layers()) as u64 + BESIDE;
                (per_sample * f64::from(work.settings.samples_per_replicate), bytes)
            }
            Task::Integrals { sampler, settings, samples, seed } => {
                let per_sample = integrals::seconds_per_sample(*sampler, settings, *seed);
                (per_sample * integrals::work(settings, *samples), 512 * u64::from(settings.replicates))
            }
        };
        let (name, content) = (task.name(), task.content().to_hex().to_string());
        let (replicates, one_by_one) = (task.replicates(), task.one_by_one());
        units.push(UnitOfWork { name, content, replicates, one_by_one, seconds, bytes });
        Ok(())
    })?;
    Ok(units)
}

/// Seconds for one sample of all pixels, by renders on random numbers of their own.
fn seconds_per_sample(work: &Work, stop: &Stop) -> Result<f64, Error> {
    let most = work.settings.samples_per_replicate;
    let mut samples = 1;
    loop {
        let settings = RenderSettings { samples_per_replicate: samples, role: Role::Pilot, ..work.settings.clone() };
        let seconds = Work { settings, ..work.clone() }.render()?.run_apart(0, &|_| {});
        stop.check()?;
        if seconds >= LONG_ENOUGH || samples >= most {
            return Ok(seconds / f64::from(samples));
        }
        samples = (samples * 2).min(most);
    }
}
