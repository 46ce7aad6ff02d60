//! `--max-order auto`: how many orders an image needs.
//!
//! A pilot render, on random numbers of its own, measures the image mean of many orders; the tail beyond them follows from how they fall. So
//! the choice depends on no sample of the image, and all that it costs in accuracy is what is said to be left out.

use crate::error::Error;
use crate::machine::require_memory;
use crate::report::numbers::percent;
use crate::statistics::series::Series;
use crate::stop::Stop;
use integrators::{Integrator, Measurement, Orders, Render, RenderSettings};
use sampling::sampler::Role;
use scenes::Scene;
use serde::Serialize;

/// The part of an image that may be left out where none is named.
pub const DEFAULT_PART: f64 = 1e-3;
/// The last order that the pilot measures.
const LAST: usize = 64;
/// Its independent images.
const REPLICATES: u32 = 8;
/// Samples of all of them together, at the least.
const SAMPLES: u64 = 1 << 18;

/// The last order that an image needs, and what is left out beyond it.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Truncation {
    /// The order.
    pub max_order: usize,
    /// The part of the image's mean that was allowed to be left out.
    pub allowed: f64,
    /// The part that is, as estimated; `None` where orders do not fall.
    pub left_out: Option<f64>,
    /// The upper end of its 95 % interval.
    pub at_most: Option<f64>,
    /// What the pilot took \[s\].
    pub pilot_seconds: f64,
}

impl Truncation {
    /// The lowest order beyond which no more than this part of the image's mean is left.
    ///
    /// # Errors
    /// If the method cannot render the scene, there is not enough memory for so many orders, or the user asked for an end.
    pub fn choose(
        scene: &Scene,
        method: &dyn Integrator,
        settings: &RenderSettings,
        allowed: f64,
        stop: &Stop,
    ) -> Result<Self, Error> {
        let last = *method.orders(LAST).end();
        if last < LAST {
            // It has a last order anyway.
            return Ok(Self { max_order: last, allowed, left_out: Some(0.0), at_most: Some(0.0), pilot_seconds: 0.0 });
        }
        let pixels = u64::from(scene.camera.width()) * u64::from(scene.camera.height());
        require_memory(u128::from(Render::bytes(pixels, LAST as u64 + 1)), "the pilot of --max-order auto")?;
        let samples_per_replicate = SAMPLES.div_ceil(pixels * u64::from(REPLICATES)) as u32;
        let orders = Orders::up_to(LAST);
        let settings =
            RenderSettings { orders, tail: false, samples_per_replicate, role: Role::Pilot, ..settings.clone() };
        let mut pilot = Render::new(scene, method, settings)?;
        for _ in 0..REPLICATES {
            pilot.run_replicate(&|_| {});
            stop.check()?;
        }
        let measurement = pilot.finish();
        let series = series_of(&measurement);
        let max_order = series.order_for(allowed).unwrap_or(LAST);
        let all = series.total().map(|total| total.value).filter(|total| *total > 0.0);
        let beyond = series.beyond(max_order);
        let part = |value: f64| all.map(|all| (value / all).max(0.0));
        Ok(Self {
            max_order,
            allowed,
            left_out: beyond.and_then(|b| part(b.value)),
            at_most: beyond.and_then(|b| part(b.interval?.1)),
            pilot_seconds: measurement.seconds(),
        })
    }

    /// What was chosen, in a line.
    pub fn in_words(&self) -> String {
        let left = match (self.left_out, self.at_most) {
            (Some(left), Some(most)) => {
                format!("about {} of the image's mean is left out, at most {}", percent(left), percent(most))
            }
            (Some(left), None) => {
                format!("about {} of the image's mean is left out, but the pilot was too noisy to be certain", percent(left))
            }
            (None, _) => "how much is left out is not known: the image is black, or too noisy in the pilot, or orders do not fall".to_owned(),
        };
        if self.at_most == Some(0.0) {
            return format!("orders 0 to {}, which are all that it carries", self.max_order);
        }
        let missed = self.at_most.is_none_or(|most| most > self.allowed);
        let why = if missed { format!(": {} was asked for", percent(self.allowed)) } else { String::new() };
        format!("orders 0 to {}; {left}{why}", self.max_order)
    }
}

/// The image means of all orders, replicate by replicate.
pub fn series_of(measurement: &Measurement) -> Series {
    Series::new(measurement.replicate_means.clone())
}
