//! Which methods a reference is pooled from: found out before any ray is traced.

use super::Truth;
use super::file;
use crate::config::{Experiment, Reference};
use crate::error::{Error, unknown};
use crate::path_class::{carries, missing};
use crate::plan::{PlannedMethod, PlannedScene};
use crate::settings::differences;
use crate::source::Source;
use crate::subject::render_settings;
use integrators::exact::NAME as EXACT;
use integrators::{Bias, Layer, Methods, Orders, PartSettings, RenderSettings, Request, render};
use sampling::sampler::SamplerKind;
use std::path::Path;
use std::sync::Arc;

/// The references of an experiment.
pub struct PlannedReference {
    /// What was asked.
    pub asked: Reference,
    /// The methods that are pooled in one scene or another.
    pub methods: Vec<PlannedMethod>,
    /// How each scene gets its own.
    pub scenes: Vec<SceneReference>,
}

/// How a scene gets its reference.
pub enum SceneReference {
    /// By pooling.
    Made(Vec<Carrier>),
    /// From a file.
    Read(Arc<Truth>),
}

/// A method that carries some layers of a scene's reference.
pub struct Carrier {
    /// Its place among the reference's methods.
    pub method: usize,
    /// How it renders, but for samples and role.
    pub settings: RenderSettings,
    /// What it is asked for.
    pub request: Request,
    /// Whether it takes part, layer by layer of the reference.
    pub takes_part: Vec<bool>,
}

/// The layers of an experiment's references.
pub fn layers(experiment: &Experiment) -> Vec<Layer> {
    Request::new(Orders::up_to(experiment.max_order), experiment.tail).layers().to_vec()
}

impl PlannedReference {
    /// That of an experiment, if it asks for one.
    ///
    /// # Errors
    /// If a file does not fit a scene, there is no method of a name, or no method carries an order.
    pub fn new(
        source: &Source,
        experiment: &Experiment,
        registry: &Methods,
        (scenes, methods): (&[PlannedScene], &[PlannedMethod]),
    ) -> Result<Option<Self>, Error> {
        let Some(asked) = experiment.reference.clone() else { return Ok(None) };
        if let Some(file) = &asked.file {
            let path = source.scene(file);
            let read = |scene| Ok(SceneReference::Read(Arc::new(file::read(Path::new(&path), scene, experiment)?)));
            let scenes = scenes.iter().map(read).collect::<Result<_, Error>>()?;
            return Ok(Some(Self { asked, methods: Vec::new(), scenes }));
        }
        let pooled = pooled_methods(&asked, registry, methods).map_err(|m| source.blame("reference.methods", m))?;
        let of_scene = |scene| {
            let carriers = carriers(&pooled, !asked.methods.is_empty(), scene, experiment);
            carriers.map(SceneReference::Made).map_err(|m| source.blame("reference.methods", m))
        };
        let scenes = scenes.iter().map(of_scene).collect::<Result<_, Error>>()?;
        Ok(Some(Self { asked, methods: pooled, scenes }))
    }
}

/// The methods named, or all of the experiment's, and the closed form, each with independent samples.
fn pooled_methods(
    asked: &Reference,
    registry: &Methods,
    methods: &[PlannedMethod],
) -> Result<Vec<PlannedMethod>, String> {
    let mut pooled: Vec<PlannedMethod> = Vec::new();
    let mut add = |label: &str, name: &str, settings: &serde_json::Value| -> Result<(), String> {
        let method = registry.build(name, settings).map_err(|e| e.to_string())?;
        if pooled.iter().any(|p| p.method.name() == name && p.method.settings() == method.settings()) {
            return Ok(());
        }
        let defaults = registry.entries().iter().find(|e| e.name == name).map(|e| &e.defaults);
        let setting = defaults.map_or(String::new(), |defaults| differences(&method.settings(), defaults));
        let (label, entry, sampler) = (label.to_owned(), label.to_owned(), SamplerKind::Independent);
        pooled.push(PlannedMethod { label, entry, sampler, setting, method });
        Ok(())
    };
    let mut names: Vec<&str> = registry.entries().iter().map(|entry| entry.name).collect();
    if names.contains(&EXACT) {
        add(EXACT, EXACT, &serde_json::json!({}))?;
    }
    if asked.methods.is_empty() {
        for planned in methods.iter().filter(|planned| !planned.is_open()) {
            add(&planned.entry, planned.method.name(), &planned.method.settings())?;
        }
    }
    for name in &asked.methods {
        match methods.iter().find(|p| [&p.label, &p.entry].contains(&name)) {
            Some(planned) => add(name, planned.method.name(), &planned.method.settings())?,
            None if names.contains(&name.as_str()) => add(name, name, &serde_json::json!({}))?,
            None => {
                names.extend(methods.iter().map(|p| p.entry.as_str()));
                names.sort_unstable();
                names.dedup();
                return Err(unknown("method", name, &names));
            }
        }
    }
    Ok(pooled)
}

/// Who carries which layers in a scene. A closed form leaves nothing for others to do.
fn carriers(
    methods: &[PlannedMethod],
    named: bool,
    scene: &PlannedScene,
    experiment: &Experiment,
) -> Result<Vec<Carrier>, String> {
    let layers = layers(experiment);
    let mut carriers: Vec<Carrier> = Vec::new();
    for (i, planned) in methods.iter().enumerate() {
        let is_exact = planned.method.name() == EXACT;
        let (settings, request) = match request(planned, scene, experiment) {
            Ok(found) => found,
            Err(reason) if named && !is_exact => {
                return Err(format!("{} cannot render {}: {reason}", planned.label, scene.name));
            }
            Err(_) => continue,
        };
        if planned.method.bias() != Bias::None {
            if named {
                return Err(format!("{} is biased, and no reference; name a method that is not", planned.label));
            }
            continue;
        }
        let lost = missing(&*planned.method, &scene.scene);
        let carries =
            |layer: &Layer| request.layers().contains(layer) && carries(&lost, Some(*layer), experiment.max_order);
        let mut takes_part: Vec<bool> = layers.iter().map(carries).collect();
        if let Some(exact) = carriers.first().filter(|first| methods[first.method].method.name() == EXACT) {
            takes_part.iter_mut().zip(&exact.takes_part).for_each(|(mine, known)| *mine &= !known);
        }
        if takes_part.contains(&true) {
            carriers.push(Carrier { method: i, settings, request, takes_part });
        }
    }
    match (0..layers.len()).find(|&i| carriers.iter().all(|c| !c.takes_part[i])) {
        Some(i) => Err(nobody(layers[i], methods, scene)),
        None => Ok(carriers),
    }
}

/// The sentence about a layer that none of the methods carries.
fn nobody(layer: Layer, methods: &[PlannedMethod], scene: &PlannedScene) -> String {
    let names: Vec<&str> = methods.iter().map(|p| p.label.as_str()).filter(|name| *name != EXACT).collect();
    let (what, mend) = match layer {
        Layer::Order(k) if k > 0 => (format!("order {k}"), format!(", or take max_order = {}", k - 1)),
        Layer::Order(k) => (format!("order {k}"), String::new()),
        Layer::Tail => ("the tail".to_owned(), ", or leave out the tail".to_owned()),
    };
    format!(
        "no reference of {}: none of {} carries all light of {what} there; name a method that does{mend}",
        scene.name,
        names.join(", ")
    )
}

/// How a method renders in a scene; without the tail where it cannot have that.
fn request(
    planned: &PlannedMethod,
    scene: &PlannedScene,
    experiment: &Experiment,
) -> Result<(RenderSettings, Request), String> {
    let max_order = experiment.max_order;
    let method = &*planned.method;
    let carried = method.orders(max_order);
    let of = |tail: bool| {
        let orders = Orders::up_to(max_order).within(carried.clone());
        let settings = render_settings(method, orders, tail, experiment.seed, planned.sampler);
        let request = render::request(&scene.scene, method, &settings, &PartSettings::default());
        request.map(|request| (settings, request)).map_err(|error| error.to_string())
    };
    let tail = experiment.tail && *carried.end() == max_order;
    if tail { of(true).or_else(|_| of(false)) } else { of(false) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Plan;

    fn plan(table: &str) -> Result<Plan, Error> {
        let experiment: Experiment = toml::from_str(table).unwrap();
        Plan::new(&Source::of_command("x"), experiment, &Methods::standard())
    }

    fn carried(table: &str) -> Vec<(String, Vec<bool>)> {
        let reference = plan(table).unwrap().reference.unwrap();
        let SceneReference::Made(carriers) = &reference.scenes[0] else { panic!("it is made") };
        carriers.iter().map(|c| (reference.methods[c.method].label.clone(), c.takes_part.clone())).collect()
    }

    const TWO: &str = "methods = [{ name = \"direct\" }, { name = \"path\" }]\nspp = 8\nmax_order = 2\n[reference]\n";

    #[test]
    fn methods_take_part_where_they_carry_all_light_and_the_closed_form_leaves_nothing_to_them() {
        let box_ = carried(&format!("scenes = [\"cornell_box\"]\n{TWO}"));
        assert_eq!(box_, [("direct".to_owned(), vec![true, true, false]), ("path".to_owned(), vec![true; 3])]);
        assert_eq!(carried(&format!("scenes = [\"furnace\"]\n{TWO}")), [("exact".to_owned(), vec![true; 3])]);
        let tail = carried(&format!("tail = true\nscenes = [\"furnace\"]\n{TWO}"));
        assert_eq!(tail[1], ("path".to_owned(), vec![false, false, false, true]));
    }

    #[test]
    fn an_order_that_nobody_carries_is_told_with_the_mend() {
        let message = |rest: &str| plan(&format!("scenes = [\"cornell_box\"]\n{TWO}{rest}")).err().unwrap().to_string();
        let told = message("methods = [\"direct\"]");
        assert!(told.contains("order 2") && told.contains("max_order = 1"), "{told}");
        assert!(message("methods = [\"bpdt\"]").contains("did you mean `bdpt`"));
        assert!(message("methods = [\"vcm\"]").contains("vcm is biased"));
    }
}
