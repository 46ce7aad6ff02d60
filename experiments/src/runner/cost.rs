//! What every order costs beside those before it: renders that end with each of them, by turns.

use super::{RunLength, Runner};
use crate::error::Error;
use crate::job::{Job, Work};
use crate::observations::Observations;
use crate::plan::{Plan, PlannedMethod};
use crate::result::{MarginalCost, MethodResult};
use crate::statistics::positive::{Stratum, VALID_FROM, power_product, recursion};
use crate::statistics::{Estimate, means};
use integrators::{Layer, Orders, PartSettings, RenderSettings, render};
use sampling::sampler::Role;

/// Replicates of each.
pub const REPLICATES: u32 = 8;

/// Renders of a method in a scene that end with each of its orders.
pub fn works<'a>(
    plan: &'a Plan,
    scene: usize,
    planned: &'a PlannedMethod,
    samples: u32,
) -> Result<Vec<Work<'a>>, Error> {
    let whole = plan.render_settings(planned);
    let work = |order: usize| {
        let settings = RenderSettings {
            orders: Orders::up_to(order),
            tail: false,
            samples_per_replicate: samples,
            role: Role::Pilot,
            instance: format!("{} up to {order}", whole.instance),
            ..whole.clone()
        };
        let (of, parts) = (&plan.scenes[scene], PartSettings::default());
        let request = render::request(&of.scene, &*planned.method, &settings, &parts)?;
        let (what, judged_by) = (format!("cost_{order}"), String::new());
        Ok(Work { scene: of, planned, settings, request, parts, what, judged_by })
    };
    whole.orders.iter().map(work).collect()
}

impl Runner<'_> {
    /// Measures what the orders of a method's result cost in a replicate of so many samples. Nothing where the user asks for an end before
    /// that is known.
    pub(super) fn measure_costs(
        &mut self,
        (plan, scene, planned): (&Plan, usize, &PlannedMethod),
        samples: u32,
        result: &mut MethodResult,
    ) -> Result<(), Error> {
        let mut jobs = Vec::new();
        for work in works(plan, scene, planned, samples)? {
            jobs.push(Job::open(work, Observations::default(), None, self.states)?);
        }
        if self.stop.signal().is_some() {
            return Ok(());
        }
        self.take_turns(&mut jobs, &RunLength::Replicates(REPLICATES))?;
        if jobs.iter().any(|job| job.replicates() < REPLICATES) {
            return Ok(());
        }
        let seconds: Vec<(usize, Vec<f64>)> = jobs
            .into_iter()
            .map(|job| job.finish().0)
            .map(|measurement| (measurement.max_order, measurement.replicate_seconds))
            .collect();
        for (i, (order, with)) in seconds.iter().enumerate() {
            let without = |r: usize| if i > 0 { seconds[i - 1].1[r] } else { 0.0 };
            let added: Vec<f64> = with.iter().enumerate().map(|(r, seconds)| seconds - without(r)).collect();
            let layer = Layer::Order(*order);
            let place = result.measurement.layers.iter().position(|&l| l == layer);
            let squares = result.intervals.as_ref().zip(place).map(|(known, place)| known.squares[place].as_slice());
            result.marginal.push(MarginalCost {
                order: layer,
                seconds: means::mean(&added),
                efficiency: squares.and_then(|squares| efficiency(squares, &added, *order as u64)),
            });
        }
        Ok(())
    }
}

/// `1 / (variance · seconds)` from recursive squares and seconds of other replicates.
fn efficiency(squares: &[f64], seconds: &[f64], salt: u64) -> Option<Estimate> {
    let strata = [Stratum::new(vec![(-1.0, squares)]), Stratum::new(vec![(-1.0, seconds)])];
    let (value, interval) = power_product(&strata, recursion(squares.len()), salt)?;
    // Where the time may be none, the efficiency has no upper end.
    let known = means::mean(seconds).interval.is_some_and(|(low, _)| low > 0.0);
    Some(Estimate::new(value, Some(interval).filter(|_| known), (squares.len() + 1).min(seconds.len()), VALID_FROM))
}
