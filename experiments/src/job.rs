//! A method at work in a scene: its render, what is noted of each replicate, and the state that both are kept in.

use crate::convergence::Deviations;
use crate::error::Error;
use crate::plan::{PlannedMethod, PlannedScene};
use crate::result::RenderRecord;
use crate::states::{States, Unit};
use integrators::state::Stored;
use integrators::{Measurement, PartSettings, Render, RenderSettings, Request, Window, stored};

/// What is noted of every replicate while its image is at hand.
#[derive(Default)]
pub struct Observations {
    /// Squared deviations, at the checkpoints of convergence.
    pub deviations: Option<Deviations>,
}

stored!(Observations { deviations });

impl Observations {
    /// Looks at the replicate rendered last.
    fn observe(&mut self, render: &Render) {
        if let Some(deviations) = &mut self.deviations {
            deviations.push(|layer, pixel| render.last_replicate(layer, pixel));
        }
    }
}

/// A method at work in a scene.
pub struct Job<'a> {
    /// The scene.
    pub scene: &'a PlannedScene,
    /// The method.
    pub planned: &'a PlannedMethod,
    /// What it is for: `image`, or a checkpoint such as `64x64_at_4`.
    pub what: String,
    samples: u32,
    render: Render<'a>,
    observations: Observations,
    unit: Unit,
    /// Replicates that an earlier run has rendered.
    resumed: u32,
    /// Replicates that its state holds.
    saved: u32,
}

impl<'a> Job<'a> {
    /// A method at work in a scene whose camera has its size by now, from the state that an earlier run left, if there is one.
    ///
    /// # Errors
    /// If the method cannot render the scene, or the state cannot be read.
    pub fn open(
        scene: &'a PlannedScene,
        planned: &'a PlannedMethod,
        (settings, request, parts): (RenderSettings, Request, &PartSettings),
        what: String,
        observations: Observations,
        states: &mut States,
    ) -> Result<Self, Error> {
        let (unit, samples) =
            (Unit::of_render(scene, planned, &settings, parts, &what), settings.samples_per_replicate);
        let new = || {
            let window = Window::of(&scene.scene);
            Render::of_request(&scene.scene, &*planned.method, settings.clone(), window, request.clone())
        };
        let mut render = new()?;
        let found = states.load(&unit, |from| {
            render.resume(from)?;
            Observations::read(from)
        })?;
        if found.is_none() && render.replicates() > 0 {
            render = new()?;
        }
        let resumed = render.replicates();
        let observations = found.unwrap_or(observations);
        Ok(Self { scene, planned, what, samples, render, observations, unit, resumed, saved: resumed })
    }

    /// Complete replicates.
    pub fn replicates(&self) -> u32 {
        self.render.replicates()
    }

    /// Pixel samples of a replicate.
    pub fn work(&self) -> f64 {
        let camera = &self.scene.scene.camera;
        f64::from(camera.width()) * f64::from(camera.height()) * f64::from(self.samples)
    }

    /// Renders and notes the next replicate; gives the seconds that it took.
    pub fn run_replicate(&mut self, progress: &(dyn Fn(f64) + Sync)) -> f64 {
        let before = self.render.seconds();
        self.render.run_replicate(progress);
        self.observations.observe(&self.render);
        self.render.seconds() - before
    }

    /// Saves its state, unless that is saved already.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn save(&mut self, states: &mut States) -> Result<(), Error> {
        if self.saved == self.replicates() {
            return Ok(());
        }
        states.save(&self.unit, self.replicates(), |to| {
            self.render.save(to)?;
            self.observations.write(to)
        })?;
        self.saved = self.replicates();
        Ok(())
    }

    /// What has been done, for the manifest.
    pub fn record(&self) -> RenderRecord {
        RenderRecord {
            scene: self.scene.name.clone(),
            label: self.planned.label.clone(),
            what: self.what.clone(),
            samples_per_replicate: self.samples,
            replicates: self.replicates(),
            resumed: self.resumed,
        }
    }

    /// Seconds of transport of a replicate, on average.
    pub fn seconds_of_replicate(&self) -> f64 {
        self.render.seconds() / f64::from(self.replicates())
    }

    /// Ends it: what was measured, and what was noted.
    pub fn finish(self) -> (Measurement, Observations) {
        (self.render.finish(), self.observations)
    }
}
