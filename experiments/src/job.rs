//! A method at work in a scene: its render, what is noted of each replicate, and the state that both are kept in.

use crate::error::Error;
use crate::observations::{ONE_BY_ONE, Observations};
use crate::plan::{PlannedMethod, PlannedScene};
use crate::reference::Judge;
use crate::result::RenderRecord;
use crate::shards::file::Place;
use crate::shards::stream::{Bytes, Taken};
use crate::states::{self, States, Unit};
use integrators::state::{Stored, damaged};
use integrators::statistics::GROUP;
use integrators::{Layer, Measurement, PartSettings, Render, RenderError, RenderSettings, Request, Window};
use std::io;

/// What the images of a method are for, other than checkpoints, references and the like.
pub const IMAGE: &str = "image";

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

    /// Whether replicates after the first [`ONE_BY_ONE`] are noted group by group: those of images that are judged by nothing, of which no more is
    /// noted than follows from moments.
    pub fn is_noted_in_groups(&self) -> bool {
        self.what == IMAGE && self.judged_by.is_empty()
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
    in_groups: bool,
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
        let (unit, content, in_groups) = (work.unit(), work.content(), work.is_noted_in_groups());
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
        Ok(Self {
            scene,
            planned,
            what,
            samples,
            layers,
            render,
            observations,
            in_groups,
            judge,
            unit,
            content,
            resumed,
            saved,
        })
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
        self.note();
        self.render.seconds() - before
    }

    /// Notes the replicate rendered last, or the group that it has ended.
    fn note(&mut self) {
        let replicates = self.replicates();
        if !self.in_groups || replicates <= ONE_BY_ONE {
            self.observations.observe(&self.render, self.judge.as_ref());
        } else if replicates.is_multiple_of(GROUP) {
            self.observations.observe_group(&self.render);
        }
    }

    /// The hash of what its images follow from, the program apart.
    pub fn content(&self) -> blake3::Hash {
        self.content
    }

    /// How it takes replicates that are kept one by one.
    pub fn taken(&self) -> Taken {
        if self.in_groups { Taken::SideBySide } else { Taken::InTurn }
    }

    /// Takes the next replicate, or group of them, from records of a shard, and notes it.
    ///
    /// # Errors
    /// If the records are of others, or damaged.
    pub fn take(&mut self, places: &[Place], from: &mut [Bytes]) -> io::Result<()> {
        let next = places.iter().zip(self.replicates()..).all(|(place, next)| place.replicate == next);
        let (render, observations) = (&mut self.render, &mut self.observations);
        match (places, from) {
            ([place], [bytes]) if next && place.gathered > 0 && self.in_groups && render.replicates() >= ONE_BY_ONE => {
                render.take_group(bytes)?;
                observations.observe_group(render);
            }
            (places, from) if next && places.iter().all(|place| place.gathered == 0) && self.in_groups => {
                let mut added = Vec::new();
                render.take_replicates(from, &mut |pixels| added.extend(observations.observe_pixels(pixels)))?;
                observations.count_in(from.len(), &added);
            }
            ([Place { gathered: 0, .. }], [bytes]) if next => {
                render.take_replicate(bytes)?;
                self.note();
            }
            _ => return Err(damaged("it is of other replicates")),
        }
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
    pub fn finish(mut self) -> (Measurement, Observations) {
        // A last group that is not full: of more replicates it would have been noted when it was.
        if self.in_groups && !self.replicates().is_multiple_of(GROUP) && self.observations.lack(self.replicates()) {
            self.render.end_group();
            self.observations.observe_group(&self.render);
        }
        (self.render.finish(), self.observations)
    }
}
