//! Composites without runs get those that pilots choose, scene by scene.

use crate::choice::Choice;
use crate::error::Error;
use crate::plan::{ChosenMethod, Plan, PlannedMethod};
use crate::progress::{Progress, Verbosity};
use crate::states::{States, Unit};
use crate::stop::Stop;
use integrators::{Methods, PartSettings};

/// Chooses the runs of every composite of a plan that has none, in the current thread pool. What an earlier run has chosen stays.
///
/// # Errors
/// If an order has no method in a scene, a choice cannot be kept, or the user asked for an end.
pub fn compose(
    plan: &mut Plan,
    methods: &Methods,
    states: &mut States,
    verbosity: Verbosity,
    stop: &Stop,
) -> Result<(), Error> {
    let open: Vec<usize> = (0..plan.methods.len()).filter(|&i| plan.methods[i].is_open()).collect();
    let mut progress = Progress::new((open.len() * plan.scenes.len()) as f64, verbosity);
    let scenes = plan.scenes.len();
    for (&i, scene) in open.iter().flat_map(|i| (0..scenes).map(move |scene| (i, scene))) {
        let (planned, of) = (&plan.methods[i], &plan.scenes[scene]);
        progress.say(format!("{}, {}: pilots", of.name, planned.label));
        let settings = plan.render_settings(planned);
        let unit = Unit::of_render(of, planned, &settings, &PartSettings::default(), ("runs", ""));
        let (seconds, spp) = (plan.experiment.seconds, plan.experiment.spp);
        let takes = |sample: f64| match (spp, seconds) {
            (Some(spp), _) => f64::from(spp) * sample,
            (None, seconds) => seconds.unwrap_or_default(),
        };
        let (label, entry, sampler) = (planned.label.clone(), planned.entry.clone(), planned.sampler);
        let place = &mut plan.scenes[scene].scene;
        let choice: Choice =
            progress.during(1.0, |_| states.chosen(&unit, || Choice::new(place, methods, &settings, &takes, stop)))?;
        let (setting, method) = (choice.setting(), choice.composite(methods)?);
        let planned = PlannedMethod { label, entry, sampler, setting, method };
        plan.scenes[scene].chosen.push(ChosenMethod { planned, choice });
    }
    Ok(())
}
