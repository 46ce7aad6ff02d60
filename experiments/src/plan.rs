//! An experiment made ready: scenes loaded, methods built, and everything checked before any ray is traced.

use crate::budget::{Budget, file_name};
use crate::choice::{self, Choice};
use crate::config::{Experiment, MethodEntry, Metric, OrderChoice, Sizes};
use crate::error::Error;
use crate::machine::require_memory;
use crate::reference::plan::PlannedReference;
use crate::settings::{differences, table_to_json};
use crate::source::Source;
use integrators::composite::Composite;
use integrators::{
    Bias, Integrator, Methods, Orders, PartSettings, Render, RenderError, RenderSettings, Request, render,
};
use sampling::sampler::SamplerKind;
use scenes::{LoadOptions, Scene, SceneError, Skip};
use std::path::{Path, PathBuf};

/// What will be run.
pub struct Plan {
    /// The experiment's name.
    pub name: String,
    /// Its file, from the root; `None` for a built-in.
    pub file: Option<PathBuf>,
    /// What was asked, changes by flags included.
    pub experiment: Experiment,
    /// The scenes.
    pub scenes: Vec<PlannedScene>,
    /// The methods.
    pub methods: Vec<PlannedMethod>,
    /// Samples or seconds of each method in each scene.
    pub budget: Budget,
    /// What every image is taken apart into.
    pub parts: PartSettings,
    /// What images are judged by.
    pub reference: Option<PlannedReference>,
    /// And how.
    pub metrics: Vec<Metric>,
}

/// A scene of the plan.
pub struct PlannedScene {
    /// Its name in the results, unlike the others'.
    pub name: String,
    /// What was loaded.
    pub source: String,
    /// The scene.
    pub scene: Scene,
    /// The composites whose runs were chosen for it.
    pub chosen: Vec<ChosenMethod>,
}

/// A composite whose runs were chosen for a scene.
pub struct ChosenMethod {
    /// The composite, in place of the plan's of the same label.
    pub planned: PlannedMethod,
    /// How it was chosen.
    pub choice: Choice,
}

/// A method of the plan, with a sampler.
pub struct PlannedMethod {
    /// Its name in the results, unlike the others'; with the sampler's where there are several.
    pub label: String,
    /// The same without the sampler's.
    pub entry: String,
    /// Where its random numbers come from.
    pub sampler: SamplerKind,
    /// The settings that differ from the defaults.
    pub setting: String,
    /// The method.
    pub method: Box<dyn Integrator>,
}

impl PlannedMethod {
    /// Whether it is a composite whose runs are still to be chosen.
    pub fn is_open(&self) -> bool {
        Composite::is_open(&*self.method)
    }
}

impl Plan {
    /// The methods as they are in a scene.
    pub fn methods_in<'a>(&'a self, scene: &'a PlannedScene) -> impl Iterator<Item = &'a PlannedMethod> {
        let chosen = |planned: &'a PlannedMethod| {
            let found = scene.chosen.iter().find(|chosen| chosen.planned.label == planned.label);
            found.map_or(planned, |chosen| &chosen.planned)
        };
        self.methods.iter().map(chosen)
    }

    /// Checks an experiment and loads all it needs. `source` is blamed for faults that it holds.
    ///
    /// # Errors
    /// The first fault, with its place and mend.
    pub fn new(source: &Source, experiment: Experiment, methods: &Methods) -> Result<Self, Error> {
        let plan = Self::loaded(source, experiment, methods)?;
        plan.check_memory(&Render::bytes)?;
        Ok(plan)
    }

    /// The same of replicates that have been rendered, of which a merge holds less at once.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub fn of_shards(source: &Source, experiment: Experiment, methods: &Methods) -> Result<Self, Error> {
        let plan = Self::loaded(source, experiment, methods)?;
        let bytes = if plan.reference.is_some() { Render::bytes } else { Render::bytes_of_whole };
        plan.check_memory(&bytes)?;
        Ok(plan)
    }

    fn loaded(source: &Source, experiment: Experiment, methods: &Methods) -> Result<Self, Error> {
        experiment.check().map_err(|(key, message)| source.blame(&key, message))?;
        let metrics = experiment.metrics().map_err(|(key, message)| source.blame(&key, message))?;
        let budget = match (experiment.spp, experiment.seconds) {
            (Some(spp), _) => Budget::samples(spp, experiment.replicates),
            (None, seconds) => Budget::seconds(seconds.unwrap_or_default(), experiment.replicates),
        };
        let budget = budget.map_err(|message| source.blame("spp", message))?;
        let registry = methods;
        let methods = planned_methods(source, &experiment, registry)?;
        let scenes = planned_scenes(source, &experiment)?;
        let parts = experiment.parts().map_err(|(key, message)| source.blame(&key, message))?;
        let name = source.name.clone();
        let file = source.path.as_ref().map(|path| std::path::absolute(path).unwrap_or_else(|_| path.clone()));
        let mut plan = Self { name, file, experiment, scenes, methods, budget, parts, reference: None, metrics };
        plan.check_until().map_err(|message| source.blame("until", message))?;
        plan.check_support(registry)?;
        plan.reference = PlannedReference::new(source, &plan.experiment, registry, (&plan.scenes, &plan.methods))?;
        Ok(plan)
    }

    /// The settings of a method's renders: the orders that it carries, for the tail only if it carries the last one.
    pub fn render_settings(&self, planned: &PlannedMethod) -> RenderSettings {
        let (method, max_order) = (&*planned.method, self.experiment.max_order);
        let carried = method.orders(max_order);
        let list = format!("{}-{}", carried.start(), carried.end());
        let orders = Orders::parse(&list, max_order).unwrap_or_else(|_| Orders::up_to(max_order));
        let tail = self.experiment.tail && *carried.end() == max_order;
        crate::subject::render_settings(method, orders, tail, self.experiment.seed, planned.sampler)
    }

    /// A target must be one that some method can come near.
    fn check_until(&self) -> Result<(), String> {
        let Some(until) = &self.experiment.until else { return Ok(()) };
        let max_order = self.experiment.max_order;
        let carried = |order: usize| self.methods.iter().any(|m| m.method.orders(max_order).contains(&order));
        if let OrderChoice::One(order) = until.order
            && !carried(order)
        {
            return Err(format!("none of the methods carries order {order}; name another, or add a method that does"));
        }
        let unbiased = self.methods.iter().filter(|m| m.method.bias() == Bias::None).count();
        if until.detectable_bias.is_some() && unbiased < 2 {
            return Err("a bias is told between two methods that have none; add another, or give relative_error".into());
        }
        Ok(())
    }

    fn check_support(&self, registry: &Methods) -> Result<(), Error> {
        for (scene, method) in self.scenes.iter().flat_map(|s| self.methods.iter().map(move |m| (s, m))) {
            let settings = self.render_settings(method);
            if method.is_open() {
                choice::check(&scene.scene, registry, &settings)?;
                continue;
            }
            if let Err(error) = render::request(&scene.scene, &*method.method, &settings, &self.parts) {
                let reason = match error {
                    RenderError::Unsupported { reason, .. } => reason,
                    other => other.to_string(),
                };
                return Err(Error::usage(format!("{} cannot render {}: {reason}", method.label, scene.name)));
            }
        }
        Ok(())
    }

    /// Films of all methods of the largest scene are held at once, and the results of all.
    fn check_memory(&self, of_render: &dyn Fn(u64, u64) -> u64) -> Result<(), Error> {
        let mut largest: u128 = 0;
        let mut kept: u128 = 0;
        for scene in &self.scenes {
            let pixels = u64::from(scene.scene.camera.width()) * u64::from(scene.scene.camera.height());
            // The halves of a reference, the variance of one, and a copy for a method of fewer orders.
            let judged = self.reference.is_some();
            let orders = self.experiment.max_order as u64 + 3;
            let mut of_scene: u128 = if judged { u128::from(pixels) * u128::from(orders) * 144 } else { 0 };
            for method in &self.methods {
                let settings = self.render_settings(method);
                let request = match method.is_open() {
                    true => Request::new(settings.orders, settings.tail),
                    false => render::request(&scene.scene, &*method.method, &settings, &self.parts)?,
                };
                let layers = request.film_layers() as u64;
                of_scene += u128::from(of_render(pixels, layers)) + u128::from(method.method.bytes(pixels, &request));
                // What is noted of each replicate needs the mean image, for errors once more.
                let noted = request.layers().len() as u64 + u64::from(judged) * (request.layers().len() as u64 + 1);
                of_scene += u128::from(pixels) * u128::from(noted) * 24;
                kept += u128::from(pixels) * u128::from(layers) * 48;
            }
            largest = largest.max(of_scene);
        }
        require_memory(largest + kept, "this experiment")
    }
}

/// The longest setting that a method is labelled by \[bytes\].
const LONGEST_SETTING: usize = 100;

/// Every method with every sampler, methods in turn.
fn planned_methods(source: &Source, experiment: &Experiment, registry: &Methods) -> Result<Vec<PlannedMethod>, Error> {
    let samplers = &experiment.sampler.0;
    let blame = |i: usize, key: &str, message: String| source.blame(&format!("methods.{i}.{key}"), message);
    // With the place of each in the file.
    let mut entries: Vec<(usize, MethodEntry)> = Vec::new();
    for (i, entry) in experiment.methods.iter().enumerate() {
        let swept = entry.swept().map_err(|message| blame(i, "settings", message))?;
        entries.extend(swept.into_iter().map(|entry| (i, entry)));
    }
    let mut planned: Vec<PlannedMethod> = Vec::new();
    for (i, entry) in &entries {
        let blame = |key: &str, message: String| blame(*i, key, message);
        let known = registry.entries().iter().any(|known| known.name == entry.name);
        // The setting that a message is about, where it is about one.
        let at_fault = |message: &str| match message.split_once("setting `").and_then(|(_, rest)| rest.split_once('`'))
        {
            Some((key, _)) => format!("settings.{key}"),
            None if known => "settings".to_owned(),
            None => "name".to_owned(),
        };
        let (method, setting) = built(entry, registry).map_err(|message| blame(&at_fault(&message), message))?;
        if let Some(twin) = planned.iter().find(|p| p.method.name() == entry.name && p.setting == setting) {
            return Err(blame("name", format!("{} is listed twice with the same settings; leave one out", twin.entry)));
        }
        let alone = entries.iter().filter(|(_, other)| other.name == entry.name).count() == 1;
        let name = match (&entry.label, alone || setting.is_empty()) {
            (Some(label), _) => file_name(label),
            (None, true) => entry.name.clone(),
            (None, false) if setting.len() <= LONGEST_SETTING => file_name(&format!("{} {setting}", entry.name)),
            // What no file could be called tells methods apart by its hash.
            (None, false) => format!("{}_{}", entry.name, &blake3::hash(setting.as_bytes()).to_hex()[..8]),
        };
        let mut method = Some(method);
        for &sampler in samplers {
            let label = match (samplers.len(), entries.len()) {
                (1, _) => name.clone(),
                (_, 1) => sampler.to_string(),
                _ => format!("{name}_{sampler}"),
            };
            if planned.iter().any(|p| p.label == label) {
                return Err(blame("label", format!("two methods are labelled {label}; give them different labels")));
            }
            // The first sampler takes the method that was built to look at it, the others one like it.
            let method = method.take().map_or_else(|| built(entry, registry).map(|b| b.0), Ok);
            let method = method.map_err(|message| blame(&at_fault(&message), message))?;
            planned.push(PlannedMethod { label, entry: name.clone(), sampler, setting: setting.clone(), method });
        }
    }
    Ok(planned)
}

/// A method, and the settings in which it differs from its defaults.
fn built(entry: &MethodEntry, registry: &Methods) -> Result<(Box<dyn Integrator>, String), String> {
    let method = registry.build(&entry.name, &table_to_json(&entry.settings)).map_err(|e| e.to_string())?;
    let defaults = registry.entries().iter().find(|e| e.name == entry.name).map(|e| &e.defaults);
    let setting = defaults.map_or(String::new(), |defaults| differences(&method.settings(), defaults));
    Ok((method, setting))
}

/// Every scene in every size.
fn planned_scenes(source: &Source, experiment: &Experiment) -> Result<Vec<PlannedScene>, Error> {
    let sizes: Vec<Option<(u32, u32)>> = match &experiment.size {
        Some(Sizes(sizes)) => sizes.iter().map(|&[width, height]| Some((width, height))).collect(),
        None => vec![None],
    };
    let mut planned: Vec<PlannedScene> = Vec::new();
    for (i, name) in experiment.scenes.iter().enumerate() {
        let path = source.scene(name);
        for &size in &sizes {
            let scene =
                scenes::load(&path, &LoadOptions { size, skip: Skip::Unneeded }).map_err(|error| match &error {
                    // What is wrong in a scene's own files is told of them, and what names no scene of the experiment.
                    SceneError::Invalid { .. } => error.into(),
                    SceneError::Unreadable { file, .. } if file != Path::new(&path) => error.into(),
                    _ => source.blame(&format!("scenes.{i}"), error.to_string()),
                })?;
            let name = match size.filter(|_| sizes.len() > 1) {
                Some((width, height)) => file_name(&format!("{}_{width}x{height}", scene.name)),
                None => file_name(&scene.name),
            };
            if planned.iter().any(|p| p.name == name) {
                return Err(source.blame("scenes", format!("two scenes are called {name}; leave one out or rename it")));
            }
            planned.push(PlannedScene { name, source: path.clone(), scene, chosen: Vec::new() });
        }
    }
    Ok(planned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{Assignment, change_experiment};

    fn plan(changes: &[&str]) -> Result<Plan, Error> {
        let source = Source::open("comparison")?;
        let changes: Vec<Assignment> = changes.iter().map(|text| text.parse().unwrap()).collect();
        Plan::new(&source, change_experiment(source.parse()?, &changes)?, &Methods::standard())
    }

    fn message(changes: &[&str]) -> String {
        plan(changes).err().unwrap().to_string()
    }

    #[test]
    fn every_embedded_experiment_can_be_run() {
        for (name, _) in crate::source::LIBRARY {
            let source = Source::open(name).unwrap();
            let plan = Plan::new(&source, source.parse().unwrap(), &Methods::standard()).unwrap();
            let experiment = &plan.experiment;
            let methods: usize = experiment.methods.iter().map(|entry| entry.swept().unwrap().len()).sum();
            assert_eq!(plan.methods.len(), methods * experiment.sampler.0.len(), "{name}");
        }
    }

    #[test]
    fn the_same_method_twice_is_told_apart_by_its_settings() {
        let methods = |second: &str| format!("methods=[{{name=\"bdpt\"}}, {{name=\"bdpt\"{second}}}]");
        let planned = plan(&[&methods(", settings={mis=\"balance\"}")]).unwrap().methods;
        assert_eq!(planned.iter().map(|m| m.label.as_str()).collect::<Vec<_>>(), ["bdpt", "bdpt_mis_balance"]);
        assert!(message(&[&methods("")]).contains("twice"));
    }

    #[test]
    fn lists_of_settings_and_sizes_are_swept() {
        let plan =
            plan(&["methods=[{name=\"bdpt\", settings={mis=[\"balance\", \"power\"]}}]", "size=[[4, 4], [8, 6]]"]);
        let plan = plan.unwrap();
        let labels: Vec<&str> = plan.methods.iter().map(|m| m.label.as_str()).collect();
        let scenes: Vec<&str> = plan.scenes.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(labels, ["bdpt_mis_balance", "bdpt"]);
        assert_eq!(scenes, ["cornell_box_4x4", "cornell_box_8x6"]);
        assert_eq!(plan.scenes[1].scene.camera.height(), 6);
        assert!(message(&["bdpt.mis=[]"]).contains("empty list"));
        assert!(message(&["size=[[4, 4], [4, 4]]"]).contains("twice"));
    }

    #[test]
    fn every_method_is_run_with_every_sampler_and_draws_numbers_of_its_own() {
        let labels =
            |changes: &[&str]| -> Vec<String> { plan(changes).unwrap().methods.into_iter().map(|m| m.label).collect() };
        let samplers = "sampler=[\"independent\", \"sobol\"]";
        assert_eq!(labels(&[samplers, "methods=[{name=\"path\"}]"]), ["independent", "sobol"]);
        assert_eq!(
            labels(&[samplers, "methods=[{name=\"path\"}, {name=\"bdpt\"}]"]),
            ["path_independent", "path_sobol", "bdpt_independent", "bdpt_sobol"]
        );
        let plan = plan(&[samplers]).unwrap();
        let mut instances: Vec<String> = plan.methods.iter().map(|m| plan.render_settings(m).instance).collect();
        instances.sort();
        instances.dedup();
        assert_eq!(instances.len(), 8);
    }

    #[test]
    fn a_method_is_asked_only_for_orders_that_it_carries() {
        let plan = plan(&["tail=true", "bdpt.roulette=local"]).unwrap();
        let settings = |i: usize| plan.render_settings(&plan.methods[i]);
        assert_eq!((settings(0).orders.iter().count(), settings(0).tail), (2, false));
        assert_eq!((settings(1).orders.iter().count(), settings(1).tail), (9, true));
    }

    #[test]
    fn impossible_plans_are_refused_with_a_mend() {
        assert!(message(&["tail=true", "bdpt.roulette=none"]).contains("bdpt cannot render cornell_box"));
        assert!(message(&["spp=100"]).contains("96 or 112 samples"));
        assert!(message(&["bdpt.miss=\"power\""]).contains("did you mean `mis`"));
        assert!(message(&["max_ordr=3"]).contains("did you mean `max_order`"));
        assert!(message(&["scenes=[\"cornel\"]"]).contains("did you mean `cornell_box`"));
        assert!(message(&["size=[10000, 10000]", "max_order=5000"]).contains("--size"));
        assert!(message(&["sampler=\"stratifed\""]).contains("did you mean `stratified`"));
        assert!(message(&["sampler=[\"sobol\", \"sobol\"]"]).contains("sobol is listed twice"));
    }
}
