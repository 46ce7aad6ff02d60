//! Makes the references of scenes: pilots first, then one half after the other.

use super::{RunLength, Runner};
use crate::error::Error;
use crate::job::{Job, Work};
use crate::observations::{Observations, Share};
use crate::plan::Plan;
use crate::reference::plan::{Carrier, SceneReference};
use crate::reference::pool::{Half, PILOT, own_weights, weights};
use crate::reference::{Pooled, Truth};
use crate::result::RenderRecord;
use integrators::{PartSettings, RenderSettings, Window};
use sampling::sampler::Role;
use std::sync::Arc;

/// All that is rendered for a scene's reference, a work a carrier.
pub struct Works<'a> {
    /// What the weights are from; none where there is nothing to weigh.
    pub pilots: Vec<Work<'a>>,
    /// Both halves.
    pub halves: [Vec<Work<'a>>; 2],
}

impl<'a> Works<'a> {
    /// Those of a scene, if its reference is to be made.
    pub fn new(plan: &'a Plan, scene: usize) -> Option<Self> {
        let reference = plan.reference.as_ref()?;
        let SceneReference::Made(carriers) = &reference.scenes[scene] else { return None };
        let work = |carrier: &'a Carrier, (what, role, samples): (&str, Role, u32), judged_by: &str| {
            let instance = format!("{} {what}", carrier.settings.instance);
            let settings =
                RenderSettings { samples_per_replicate: samples, role, instance, ..carrier.settings.clone() };
            Work {
                scene: &plan.scenes[scene],
                planned: &reference.methods[carrier.method],
                settings,
                request: carrier.request.clone(),
                parts: PartSettings::default(),
                what: what.to_owned(),
                judged_by: judged_by.to_owned(),
            }
        };
        let layers = carriers.first().map_or(0, |carrier| carrier.takes_part.len());
        let shared = (0..layers).any(|i| carriers.iter().filter(|c| c.takes_part[i]).count() > 1);
        let piloted = if shared { carriers.as_slice() } else { &[] };
        let pilots: Vec<Work> = piloted.iter().map(|c| work(c, ("pilot", Role::Pilot, PILOT.0), "")).collect();
        let parts: Vec<&[bool]> = carriers.iter().map(|c| c.takes_part.as_slice()).collect();
        let weights_from = format!("{} {parts:?}", keys(&pilots));
        let samples = reference.asked.samples();
        let half = |what: &str| -> Vec<Work> {
            carriers.iter().map(|c| work(c, (what, Role::Reference, samples), &weights_from)).collect()
        };
        Some(Self { halves: [half("reference_1"), half("reference_2")], pilots })
    }

    /// Pixel samples of all.
    pub fn samples(&self, replicates: u32) -> f64 {
        let of = |works: &[Work], replicates: u32| -> f64 {
            let samples = |w: &Work| w.pixels() as f64 * f64::from(w.settings.samples_per_replicate);
            works.iter().map(samples).sum::<f64>() * f64::from(replicates)
        };
        of(&self.pilots, PILOT.1) + self.halves.iter().map(|half| of(half, replicates)).sum::<f64>()
    }
}

fn keys(works: &[Work]) -> String {
    works.iter().map(|work| work.unit().key()).collect::<Vec<_>>().join(" ")
}

/// The hash of a scene's reference, which is known before it is made: of all that its images follow from.
pub fn hash(plan: &Plan, scene: usize) -> Option<String> {
    let reference = plan.reference.as_ref()?;
    if let SceneReference::Read(truth) = &reference.scenes[scene] {
        return Some(truth.hash.clone());
    }
    let works = Works::new(plan, scene)?;
    let [first, second] = works.halves.each_ref().map(|half| keys(half));
    let origin = format!("{first} {second} {}", reference.asked.replicates);
    Some(blake3::hash(origin.as_bytes()).to_hex().to_string())
}

impl Runner<'_> {
    /// A scene's reference; `None` if none is asked for, or the user asked for an end before it was complete.
    pub(super) fn reference(
        &mut self,
        plan: &Plan,
        scene: usize,
        renders: &mut Vec<RenderRecord>,
    ) -> Result<Option<Arc<Truth>>, Error> {
        let Some(reference) = &plan.reference else { return Ok(None) };
        let carriers = match &reference.scenes[scene] {
            SceneReference::Read(truth) => return Ok(Some(Arc::clone(truth))),
            SceneReference::Made(carriers) => carriers,
        };
        let (Some(works), Some(hash)) = (Works::new(plan, scene), hash(plan, scene)) else { return Ok(None) };
        let none = |_: usize| Observations::default();
        let Some(pilots) = self.rendered(works.pilots, PILOT.1, none, renders)? else { return Ok(None) };
        let pilots: Vec<_> = pilots.into_iter().map(|job| job.finish().0).collect();
        let weights = weights(&plan.experiment, carriers, &pilots);

        let replicates = reference.asked.replicates;
        let window = Window::of(&plan.scenes[scene].scene);
        let size = [window.width() as usize, window.height() as usize];
        let share = |carrier: usize| {
            let own = own_weights(&carriers[carrier], &weights[carrier], &plan.experiment);
            Observations { share: Some(Share::new(size[0] * size[1], own)), ..Observations::default() }
        };
        let mut halves = Vec::new();
        for works in works.halves {
            let Some(jobs) = self.rendered(works, replicates, share, renders)? else { return Ok(None) };
            halves.push(Half::new(&plan.experiment, size[0] * size[1], jobs, &weights));
        }
        let Ok(halves) = <[Half; 2]>::try_from(halves) else { return Ok(None) };
        let pooled = carriers.iter().zip(weights).map(|(carrier, weights)| Pooled {
            label: reference.methods[carrier.method].label.clone(),
            weights,
            samples: u64::from(reference.asked.samples()) * u64::from(replicates),
        });
        Ok(Some(Arc::new(Truth::of_halves(&plan.experiment, size, hash, halves, pooled.collect()))))
    }

    /// Jobs with all their replicates; `None` if the user asked for an end before.
    fn rendered<'a>(
        &mut self,
        works: Vec<Work<'a>>,
        replicates: u32,
        noted: impl Fn(usize) -> Observations,
        renders: &mut Vec<RenderRecord>,
    ) -> Result<Option<Vec<Job<'a>>>, Error> {
        let mut jobs = Vec::new();
        for (i, work) in works.into_iter().enumerate() {
            jobs.push(Job::open(work, noted(i), None, self.states)?);
        }
        self.take_turns(&mut jobs, &RunLength::Replicates(replicates))?;
        renders.extend(jobs.iter().map(Job::record));
        Ok(jobs.iter().all(|job| job.replicates() >= replicates).then_some(jobs))
    }
}
