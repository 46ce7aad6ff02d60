//! What a composite's sample takes beside one of the best method by itself: its runs share a film and caches, and not even the sum of what they take apart
//! would be known to a few per cent.

use super::pilot::{Entry, Pilot, REPLICATES, take_turns};
use super::{Budget, ChosenRun};
use crate::error::Error;
use crate::stop::Stop;
use integrators::composite::{self, Composite};
use integrators::{Layer, Methods, RenderSettings, Request};
use scenes::Scene;
use serde_json::json;

/// The most samples of an image: as many as a block of a long render has.
const MOST: f64 = 16.0;
/// The fewest.
const FEWEST: f64 = 4.0;

/// A composite's seconds beside another method's.
pub struct Timing {
    /// Those of the other's sample over those of the composite's.
    pub ratio: f64,
    /// The same turn by turn, but for a factor.
    pub turns: Vec<f64>,
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
        let samples = (budget.left() / (f64::from(REPLICATES) * pair)).clamp(FEWEST, MOST) as u32;
        let settings = other.of_layers(layers, 5, samples);
        let instance = format!("{}, choice 5", composite::NAME);
        let of_composite = RenderSettings { instance, ..settings.clone() };
        let request = Request::new(settings.orders.clone(), settings.tail);
        let mut pilots = [Pilot::new(scene, &composite, of_composite)?, Pilot::new(scene, other.method, settings)?];
        take_turns(&mut pilots, REPLICATES, stop)?;
        // Few samples are not shared as many are.
        let rounding = composite.rounding(&request, samples, (scene.camera.width(), scene.camera.height()));
        let rounded: f64 = runs.iter().zip(rounding).map(|(run, rounding)| run.time * rounding).sum();
        let [composite, other] = pilots;
        let turns = other.times().iter().zip(composite.times()).map(|(other, own)| other / own).collect();
        Ok(Self { ratio: rounded * other.seconds() / composite.seconds(), turns })
    }
}
