//! A method at work in a scene: its render, what is noted of each replicate, and the state that both are kept in.

use crate::error::Error;
use crate::observations::Observations;
use crate::plan::{PlannedMethod, PlannedScene};
use crate::reference::Judge;
use crate::result::RenderRecord;
use crate::shards::Shards;
use crate::states::{self, States, Unit};
use integrators::state::Stored;
use integrators::{Layer, Measurement, PartSettings, Render, RenderError, RenderSettings, Request, Window};

/// What a method is to render in a scene, and what for: known before any ray is traced.
#[derive(Clone)]
pub struct Work<'a> {
    /// The scene, whose camera has its size by now.
    pub scene: &'a PlannedScene,
    /// The method.
    pub planned: &'a PlannedMethod,
    /// How.
    pub settings: RenderSettings,
    /// What it is asked for.
    pub request: Request,
    /// What its images are taken apart into.
    pub parts: PartSettings,
    /// What it is for: `image`, or a checkpoint such as `64x64_at_4`.
    pub what: String,
    /// What that which is noted follows from besides: a reference's hash, the metrics.
    pub judged_by: String,
}

impl Work<'_> {
    /// Where its state is kept.
    pub fn unit(&self) -> Unit {
        Unit::of_render(self.scene, self.planned, &self.settings, &self.parts, (&self.what, &self.judged_by))
    }

    /// The hash of what its images follow from, the program apart.
    pub fn content(&self) -> blake3::Hash {
        let origin = states::origin(self.scene, self.planned, &self.settings, &self.parts);
        blake3::hash(format!("{}\n{origin}", self.name()).as_bytes())
    }

    /// What it is called: scene, label, what for.
    pub fn name(&self) -> String {
        format!("{}-{}-{}", self.scene.name, self.planned.label, self.what)
    }

    /// Pixels of its image.
    pub fn pixels(&self) -> usize {
        let window = Window::of(&self.scene.scene);
        window.width() as usize * window.height() as usize
    }
}

impl<'a> Work<'a> {
    /// Gets ready; no ray is traced yet.
    ///
    /// # Errors
    /// If the method cannot render the scene.
    pub fn render(&self) -> Result<Render<'a>, RenderError> {
        let (scene, method) = (&self.scene.scene, &*self.planned.method);
        Render::of_request(scene, method, self.settings.clone(), Window::of(scene), self.request.clone())
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
    layers: Vec<Layer>,
    render: Render<'a>,
    observations: Observations,
    judge: Option<Judge>,
    unit: Unit,
    content: blake3::Hash,
    /// Replicates that an earlier run has rendered.
    resumed: u32,
    /// Replicates that its state holds.
    saved: u32,
}

impl<'a> Job<'a> {
    /// A method at work in a scene, from the state that an earlier run left, if there is one. What is noted of every replicate is told to
    /// `observations`, and errors are taken against the judge.
    ///
    /// # Errors
    /// If the method cannot render the scene, or the state cannot be read.
    pub fn open(
        work: Work<'a>,
        observations: Observations,
        judge: Option<Judge>,
        states: &mut States,
    ) -> Result<Self, Error> {
        let (unit, content) = (work.unit(), work.content());
        let mut render = work.render()?;
        let found = states.load(&unit, |from| {
            render.resume(from)?;
            Observations::read(from)
        })?;
        if found.is_none() && render.replicates() > 0 {
            render = work.render()?;
        }
        let resumed = render.replicates();
        let observations = found.unwrap_or(observations);
        let Work { scene, planned, settings, request, what, .. } = work;
        let (samples, layers) = (settings.samples_per_replicate, request.layers().to_vec());
        let saved = resumed;
        Ok(Self { scene, planned, what, samples, layers, render, observations, judge, unit, content, resumed, saved })
    }

    /// Complete replicates.
    pub fn replicates(&self) -> u32 {
        self.render.replicates()
    }

    /// Its image so far.
    pub fn image(&self) -> &Render<'a> {
        &self.render
    }

    /// Image means of the layers, replicate by replicate.
    pub fn means(&self) -> Vec<&[[f64; 3]]> {
        self.render.replicate_means().collect()
    }

    /// The layers that make up its image.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
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
        self.observations.observe(&self.render, self.judge.as_ref());
        self.render.seconds() - before
    }

    /// Takes the next replicate from where shards keep it, and notes it.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn take_replicate(&mut self, shards: &Shards) -> Result<(), Error> {
        let (place, render) = ((&self.content, self.replicates()), &mut self.render);
        shards.read(place, |from| render.take_replicate(from))?;
        self.observations.observe(&self.render, self.judge.as_ref());
        Ok(())
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

    /// What it is judged by.
    pub fn judge(&self) -> Option<Judge> {
        self.judge.clone()
    }

    /// Ends it: what was measured, and what was noted.
    pub fn finish(self) -> (Measurement, Observations) {
        (self.render.finish(), self.observations)
    }
}
