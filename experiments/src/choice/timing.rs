//! What a composite's sample takes beside one of the best method by itself: its runs share a film and caches, and not even the sum of what they take apart
//! would be known to a few per cent.

use super::ChosenRun;
use super::budget::Budget;
use super::pilot::{Entry, Pilot, REPLICATES, take_turns};
use crate::error::Error;
use crate::stop::Stop;
use integrators::composite::{self, Composite};
use integrators::{Layer, Methods, RenderSettings, Request};
use scenes::Scene;
use serde_json::json;

/// The most samples of an image: where there is time for more there are more images.
const MOST: f64 = 16.0;
/// The fewest.
const FEWEST: f64 = 4.0;

/// A composite's seconds beside another method's.
pub struct Timing {
    /// Those of the other's sample over those of the composite's.
    pub ratio: f64,
    /// Seconds of the composite's images, by turns that count.
    pub own: Vec<f64>,
    /// Those of the other's.
    pub other: Vec<f64>,
}

impl Timing {
    /// Renders a composite of these runs and another method by turns; `pair` is what is known of the seconds of a sample of both.
    ///
    /// # Errors
    /// If a method cannot render, or the user asked for an end.
    pub fn new(
        scene: &Scene,
        methods: &Methods,
        (runs, other, layers): (&[ChosenRun], &Entry, &[Layer]),
        (budget, pair): (&Budget, f64),
        stop: &Stop,
    ) -> Result<Self, Error> {
        let own: Vec<_> = runs.iter().map(|chosen| &chosen.run).collect();
        let composite = Composite::new(&json!({ "runs": own }), methods)?;
        let request = Request::new(other.settings.orders.clone(), other.settings.tail);
        let size = (scene.camera.width(), scene.camera.height());
        // Few samples are not shared as many are: by how much longer an image takes for that.
        let rounded = |samples: u32| -> f64 {
            let rounding = composite.rounding(&request, samples, size);
            runs.iter().zip(rounding).map(|(run, rounding)| run.time * rounding).sum()
        };
        let left = budget.left() / pair;
        let most = (left / f64::from(REPLICATES)).clamp(FEWEST, MOST);
        let off = |samples: &u32| (rounded(*samples) - 1.0).abs();
        let samples = (FEWEST.max(0.5 * most) as u32..=most as u32).min_by(|a, b| off(a).total_cmp(&off(b)));
        let samples = samples.unwrap_or(FEWEST as u32);
        let images = (left / f64::from(samples)).max(f64::from(REPLICATES)) as u32;
        let settings = other.of_layers(layers, 5, samples);
        let instance = format!("{}, choice 5", composite::NAME);
        let of_composite = RenderSettings { instance, ..settings.clone() };
        let mut pilots = [Pilot::new(scene, &composite, of_composite)?, Pilot::new(scene, other.method, settings)?];
        take_turns(&mut pilots, images, stop)?;
        let (own, other) = undisturbed(pilots[0].times(), pilots[1].times());
        let ratio = rounded(samples) * other.iter().sum::<f64>() / own.iter().sum::<f64>();
        Ok(Self { ratio, own, other })
    }
}

/// The seconds of the three quarters of all turns that took least: what else the machine does at times only adds to some.
fn undisturbed(own: &[f64], other: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let mut turns: Vec<(f64, f64)> = own.iter().copied().zip(other.iter().copied()).collect();
    turns.sort_by(|a, b| (a.0 + a.1).total_cmp(&(b.0 + b.1)));
    turns.truncate((3 * turns.len()).div_ceil(4));
    turns.into_iter().unzip()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_that_were_disturbed_do_not_count() {
        let (own, other) = ([1.0, 1.1, 9.0, 1.2], [2.0, 2.2, 2.1, 2.5]);
        assert_eq!(undisturbed(&own, &other), (vec![1.0, 1.1, 1.2], vec![2.0, 2.2, 2.5]));
    }
}
