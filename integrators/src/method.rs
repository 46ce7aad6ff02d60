//! THE LIST of methods.

use crate::bdpt::Bdpt;
use crate::bias::Bias;
use crate::coherent::{Coherent, CoherentBdpt, Sharing};
use crate::composite::{self, Composite};
use crate::integrator::{Estimator, Integrator};
use crate::metropolis::{Metropolis, Mmlt, Pssmlt};
use crate::path::Path;
use crate::sampled::Sampled;
use crate::settings::{nearest, parse_settings};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

/// Why a method cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MethodError {
    /// No method of that name.
    #[error("there is no method `{name}`; did you mean `{nearest}`? (methods: {known})")]
    Unknown {
        /// What was asked for.
        name: String,
        /// The most similar name.
        nearest: String,
        /// All names.
        known: String,
    },
    /// No setting of that name.
    #[error("method `{method}` has no setting `{key}`; {mend}")]
    UnknownSetting {
        /// The method.
        method: String,
        /// What was set.
        key: String,
        /// What could be set instead.
        mend: String,
    },
    /// A setting's value cannot be used.
    #[error("method `{method}`: {reason}")]
    BadSetting {
        /// The method.
        method: String,
        /// What was expected.
        reason: String,
    },
}

type Factory = Box<dyn Fn(&Value, &Methods) -> Result<Box<dyn Integrator>, MethodError> + Send + Sync>;

/// A registered method.
pub struct MethodEntry {
    /// Its name.
    pub name: &'static str,
    /// What it does, in a line.
    pub summary: &'static str,
    /// The light-path expression of what it carries by default.
    pub expression: &'static str,
    /// The bias that it has by default.
    pub bias: Bias,
    /// Its settings' defaults, as a JSON object.
    pub defaults: Value,
    pub(crate) factory: Factory,
}

/// The methods that can be named in experiments.
pub struct Methods {
    entries: Vec<MethodEntry>,
}

impl Methods {
    /// THE LIST.
    pub fn standard() -> Self {
        Self { entries: Vec::new() }
            .with::<crate::classics::Emission>("emission", "order 0: what the camera sees shine")
            .with::<crate::classics::Local>(
                "local",
                "orders 0 and 1 by sampled points of emitters, with shadows or without",
            )
            .with::<crate::classics::Whitted>(
                "whitted",
                "what mirrors and glass show of emitters and of what these light",
            )
            .with::<crate::direct::Direct>("direct", "orders 0 and 1: emitter sampling, BSDF sampling, or both by MIS")
            .with::<Path>("path", "path tracing with next-event estimation and MIS")
            .with_integrator(
                "adaptive",
                "path tracing with the most samples where a pilot errs most",
                |name, estimator: Path| Sampled { name, estimator, adapts: true },
            )
            .with::<crate::guided::Guided>("guided", "path tracing that learns where light comes from (SD-trees)")
            .with_integrator(
                "coherent",
                "path tracing with the same numbers in many pixels, whose common error neighbours take off",
                |name, settings: Coherent| Sharing { name, settings },
            )
            .with::<crate::light::Light>("light", "particle tracing from the emitters, connected to the camera")
            .with::<Bdpt>("bdpt", "bidirectional path tracing: every strategy (s, t), weighted by MIS")
            .with_integrator(
                "adaptive_bdpt",
                "bidirectional path tracing with the most samples where a pilot errs most",
                |name, estimator: Bdpt| Sampled { name, estimator, adapts: true },
            )
            .with_integrator(
                "coherent_bdpt",
                "bidirectional path tracing without splats, with light subpaths that many pixels share",
                |name, settings: CoherentBdpt| Sharing { name, settings },
            )
            .with::<crate::vcm::Vcm>("vcm", "connections and merged vertices, weighted by MIS over both")
            .with::<crate::ppm::Ppm>("ppm", "progressive photon mapping: camera walks that end among photons")
            .with::<crate::radiosity::Radiosity>(
                "radiosity",
                "diffuse light on a mesh of elements, every order by application of the operator's matrix",
            )
            .with_integrator("pssmlt", "Metropolis sampling of the random numbers of `path`", Metropolis::<Pssmlt>::new)
            .with_integrator(
                "mmlt",
                "Metropolis sampling of the random numbers and strategies of `bdpt`",
                Metropolis::<Mmlt>::new,
            )
            .with::<crate::exact::Exact>(
                crate::exact::NAME,
                "the closed form of a built-in scene's orders, where it has one",
            )
            .with_composite()
    }

    /// Registers the method that is made of the others.
    fn with_composite(mut self) -> Self {
        self.entries.push(MethodEntry {
            name: composite::NAME,
            summary: "every order by the method that does it best, as a pilot finds",
            expression: "L.*E",
            bias: Bias::None,
            defaults: json!({"runs": []}),
            factory: Box::new(|settings, methods| Ok(Box::new(Composite::new(settings, methods)?))),
        });
        self
    }

    /// Registers an estimator under a name; a later one of the same name replaces the earlier.
    pub fn with<E: Estimator>(self, name: &'static str, summary: &'static str) -> Self {
        self.with_integrator(name, summary, |name, estimator: E| Sampled { name, estimator, adapts: false })
    }

    /// The same of an integrator that is made of its name and settings.
    pub fn with_integrator<S, I>(
        mut self,
        name: &'static str,
        summary: &'static str,
        make: fn(&'static str, S) -> I,
    ) -> Self
    where
        S: Serialize + DeserializeOwned + Default + 'static,
        I: Integrator + 'static,
    {
        self.entries.retain(|e| e.name != name);
        let factory = move |settings: &Value, _: &Methods| -> Result<Box<dyn Integrator>, MethodError> {
            Ok(Box::new(make(name, parse_settings::<S>(name, settings)?)))
        };
        let made = make(name, S::default());
        let (expression, bias, defaults) = (made.expression(), made.bias(), made.settings());
        self.entries.push(MethodEntry { name, summary, expression, bias, defaults, factory: Box::new(factory) });
        self
    }

    /// The registered methods, in order of registration.
    pub fn entries(&self) -> &[MethodEntry] {
        &self.entries
    }

    /// Their names.
    pub fn names(&self) -> Vec<&'static str> {
        self.entries.iter().map(|e| e.name).collect()
    }

    /// Makes a method from a JSON object of settings; those left out (or `null` for all) take their defaults.
    ///
    /// # Errors
    /// If there is no such method or setting, with the nearest valid name, or a value is not of the setting's kind.
    pub fn build(&self, name: &str, settings: &Value) -> Result<Box<dyn Integrator>, MethodError> {
        let Some(entry) = self.entries.iter().find(|e| e.name == name) else {
            let names = self.names();
            return Err(MethodError::Unknown {
                name: name.to_owned(),
                nearest: nearest(name, &names).unwrap_or_default().to_owned(),
                known: names.join(", "),
            });
        };
        (entry.factory)(settings, self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_of_the_list_is_made_from_nothing_and_from_its_own_defaults() {
        let methods = Methods::standard();
        for entry in methods.entries() {
            let made = methods.build(entry.name, &json!({})).unwrap();
            assert_eq!((made.name(), made.settings()), (entry.name, entry.defaults.clone()));
            assert_eq!(methods.build(entry.name, &entry.defaults).unwrap().settings(), entry.defaults);
        }
    }

    #[test]
    fn unknown_names_and_values_are_answered_with_the_mend() {
        let methods = Methods::standard();
        let message = |name: &str, settings: Value| methods.build(name, &settings).err().unwrap().to_string();
        assert!(message("bpdt", json!({})).contains("did you mean `bdpt`"));
        assert!(message("bdpt", json!({"miss": "power"})).contains("did you mean `mis`"));
        assert!(message("bdpt", json!({"mis": "powr"})).contains("setting `mis`"));
        assert!(message("bdpt", json!(3)).contains("table"));
    }
}
