//! The methods and renders that a bench is asked for.

use super::turns::Timed;
use crate::cli::MeasuredArgs;
use crate::config;
use crate::error::Error;
use crate::settings;
use crate::subject::render_settings;
use integrators::{Integrator, Methods, Orders, Render, RenderSettings};
use scenes::Scene;

impl MeasuredArgs {
    /// The methods asked for, with their settings; those of `default` where none is.
    pub(super) fn build(&self, methods: &Methods, default: &[&str]) -> Result<Vec<Box<dyn Integrator>>, Error> {
        let names: Vec<&str> = match self.methods.is_empty() {
            true => default.to_vec(),
            false => self.methods.iter().map(String::as_str).collect(),
        };
        if let Some(foreign) = self.set.iter().find(|a| a.path.len() > 1 && !names.contains(&a.path[0].as_str())) {
            let (name, all) = (&foreign.path[0], names.join(", "));
            return Err(Error::usage(format!("--set {foreign}: `{name}` is not measured; those that are: {all}")));
        }
        let build = |name: &&str| {
            let own: Vec<_> = self.set.iter().filter(|a| a.path.len() == 1 || a.path[0] == *name).cloned().collect();
            Ok(methods.build(name, &settings::of_method(&own, name)?)?)
        };
        names.iter().map(build).collect()
    }

    /// A render of all orders with so many samples per pixel in a round.
    pub(super) fn timed<'a>(
        &self,
        scene: &'a Scene,
        method: &'a dyn Integrator,
        samples: u32,
    ) -> Result<Timed<'a>, Error> {
        Ok(Timed::new(Render::new(scene, method, self.settings(method, samples)?)?))
    }

    /// How a method renders all orders with so many samples per pixel in a round.
    pub(super) fn settings(&self, method: &dyn Integrator, samples: u32) -> Result<RenderSettings, Error> {
        let sampler = config::sampler(&self.sampler)?;
        let settings = render_settings(method, Orders::up_to(self.max_order), false, self.seed, sampler);
        Ok(RenderSettings { samples_per_replicate: samples, ..settings })
    }
}
