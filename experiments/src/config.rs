//! Experiment files: what is asked, in TOML.

use crate::error::{Error, unknown};
use crate::parts;
use integrators::PartSettings;
pub use method::MethodEntry;
pub use reference::{Metric, Reference};
pub use samplers::Samplers;
use sampling::filter::Filter;
use sampling::sampler::SamplerKind;
use serde::{Deserialize, Serialize};
pub use sizes::Sizes;
use std::collections::BTreeMap;
pub use until::{OrderChoice, Until};

mod method;
mod reference;
mod samplers;
mod sizes;
mod sweep;
mod until;

/// An experiment: every method in every scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// One line for the report's head.
    #[serde(default)]
    pub title: String,
    /// What the experiment is to show.
    #[serde(default)]
    pub description: String,
    /// Scenes: names of built-ins, or paths (relative to the experiment's file).
    pub scenes: Vec<String>,
    /// Methods with their settings.
    pub methods: Vec<MethodEntry>,
    /// The last order traced one by one.
    #[serde(default = "default_max_order")]
    pub max_order: usize,
    /// Whether all beyond `max_order` is estimated too, as one layer.
    #[serde(default)]
    pub tail: bool,
    /// Samples per pixel over all replicates, or over the fewest with `until`; this or `seconds`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spp: Option<u32>,
    /// Wall time for each method in each scene \[s\]; this or `spp`. With `until`, the most that it may take.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
    /// Independent images.
    #[serde(default = "default_replicates")]
    pub replicates: u32,
    /// More replicates than these, until an error is small enough.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<Until>,
    /// The most samples per pixel that `until` may take.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_spp: Option<u32>,
    /// Seed of all random numbers.
    #[serde(default)]
    pub seed: u64,
    /// Sampler, or several of them, with each of which every method is run.
    #[serde(default)]
    pub sampler: Samplers,
    /// Image size `[width, height]`, or a list of sizes, in each of which every scene is rendered; the scene's own where it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<Sizes>,
    /// What every image is taken apart into besides its orders: `"strategies"`, `"groups"`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<String>,
    /// Light-path expressions by name: each is an image of its own.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub lpe: BTreeMap<String, String>,
    /// What images are judged by; left out, they are not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<Reference>,
    /// How: all metrics but `flip` where this is left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub metrics: Vec<String>,
    /// Relative mean squared errors, the time to which is told.
    #[serde(default = "default_time_to_error")]
    pub time_to_error: Vec<f64>,
    /// Whether it is measured what every order costs beside those before it.
    #[serde(default)]
    pub marginal_cost: bool,
    /// Variance against samples; left out, it is not measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub convergence: Option<Convergence>,
    /// Integrals of known value, estimated with the samplers as [`crate::integrals`] says; left out, they are not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub integrals: Option<Convergence>,
}

/// How variance against samples is measured: separate runs, each of so many samples a replicate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Convergence {
    /// Image size `[width, height]`.
    #[serde(default = "default_convergence_size")]
    pub size: [u32; 2],
    /// Samples per pixel of a replicate, rising.
    #[serde(default = "default_checkpoints")]
    pub checkpoints: Vec<u32>,
    /// Independent images at each checkpoint: at least 32, or the intervals cannot be trusted.
    #[serde(default = "default_convergence_replicates")]
    pub replicates: u32,
}

fn default_max_order() -> usize {
    8
}

fn default_replicates() -> u32 {
    4
}

fn default_time_to_error() -> Vec<f64> {
    vec![0.01]
}

fn default_convergence_size() -> [u32; 2] {
    [64, 64]
}

fn default_checkpoints() -> Vec<u32> {
    vec![1, 2, 4, 8, 16]
}

fn default_convergence_replicates() -> u32 {
    32
}

/// The last order that a path's technique can count.
pub const HIGHEST_ORDER: usize = scenes::description::MAX_ORDER;

/// What is wrong with an experiment: the key, such as `convergence.size`, and a sentence with the mend.
pub type Fault = (String, String);

impl Experiment {
    /// The keys of its file.
    pub const KEYS: [&'static str; 22] = [
        "title",
        "description",
        "scenes",
        "methods",
        "max_order",
        "tail",
        "spp",
        "seconds",
        "replicates",
        "until",
        "max_spp",
        "seed",
        "sampler",
        "size",
        "layers",
        "lpe",
        "reference",
        "metrics",
        "time_to_error",
        "marginal_cost",
        "convergence",
        "integrals",
    ];

    /// Checks what the types cannot.
    ///
    /// # Errors
    /// The first fault found.
    pub fn check(&self) -> Result<(), Fault> {
        if self.scenes.is_empty() {
            return fault("scenes", "no scenes; name at least one, such as scenes = [\"cornell_box\"]");
        }
        if self.methods.is_empty() {
            return fault("methods", "no methods; add at least one [[methods]] with a name");
        }
        if self.max_order > HIGHEST_ORDER {
            return fault("max_order", format!("max_order {} is above {HIGHEST_ORDER}", self.max_order));
        }
        self.size.as_ref().map_or(Ok(()), Sizes::check).or_else(|message| fault("size", message))?;
        self.parts().map(|_| ())?;
        self.sampler.check().or_else(|message| fault("sampler", message))?;
        self.check_budget()?;
        self.check_reference()?;
        for (key, measured) in [("convergence", &self.convergence), ("integrals", &self.integrals)] {
            let checked = measured.as_ref().map_or(Ok(()), Convergence::check);
            checked.or_else(|(inner, message)| fault(&format!("{key}.{inner}"), message))?;
        }
        Ok(())
    }

    /// What every image is taken apart into.
    ///
    /// # Errors
    /// If there is no such layer, or an expression cannot be read.
    pub fn parts(&self) -> Result<PartSettings, Fault> {
        let known = ["strategies", "groups"];
        if let Some(other) = self.layers.iter().find(|layer| !known.contains(&layer.as_str())) {
            return Err(("layers".to_owned(), unknown("layer", other, &known)));
        }
        let class = |(name, expression): (&String, &String)| {
            parts::class(&format!("{name}={expression}")).map_err(|message| {
                let key = format!("lpe.{name}");
                (key.clone(), format!("{key}: {message}"))
            })
        };
        let asked = |layer: &str| self.layers.iter().any(|asked| asked == layer);
        let classes = self.lpe.iter().map(class).collect::<Result<_, _>>()?;
        Ok(PartSettings { strategies: asked("strategies"), groups: asked("groups"), classes })
    }

    fn check_budget(&self) -> Result<(), Fault> {
        if self.replicates < 2 {
            let message = "an experiment needs at least 2 replicates, for without them there is no variance";
            return fault("replicates", message);
        }
        if let Some(until) = &self.until {
            return self.check_until(until);
        }
        match (self.spp, self.seconds) {
            _ if self.max_spp.is_some() => {
                fault("max_spp", "max_spp is the end of `until`; give that too, or leave it out")
            }
            (None, None) => fault("spp", "no budget; give spp (samples per pixel) or seconds"),
            (Some(_), Some(_)) => fault("seconds", "spp and seconds are both given; leave one out"),
            (Some(spp), None) => samples_per_replicate(spp, self.replicates).map(|_| ()).or_else(|e| fault("spp", e)),
            (None, Some(seconds)) => check_seconds(seconds).or_else(|e| fault("seconds", e)),
        }
    }

    fn check_until(&self, until: &Until) -> Result<(), Fault> {
        let Some(spp) = self.spp else {
            return fault("until", "no samples to begin with; give spp, the samples per pixel of the first replicates");
        };
        until.check(self.max_order, self.methods.len() * self.sampler.0.len())?;
        samples_per_replicate(spp, self.replicates).map(|_| ()).or_else(|e| fault("spp", e))?;
        match (self.max_spp, self.seconds) {
            (None, None) => fault("until", "it might never end; give max_spp or seconds, the most that it may take"),
            (Some(most), _) if most < spp => fault(
                "max_spp",
                format!("max_spp {most} is below the {spp} samples to begin with; give more, or a lower spp"),
            ),
            (_, Some(seconds)) => check_seconds(seconds).or_else(|e| fault("seconds", e)),
            _ => Ok(()),
        }
    }

    fn check_reference(&self) -> Result<(), Fault> {
        let metrics = self.metrics()?;
        if self.reference.is_none() && !self.metrics.is_empty() {
            let message = "metrics need what to judge by; add a section [reference], or --reference FILE.exr";
            return fault("metrics", message);
        }
        if let Some(i) = (1..metrics.len()).find(|&i| metrics[..i].contains(&metrics[i])) {
            return fault("metrics", format!("{} is listed twice; leave one out", self.metrics[i]));
        }
        if let Some(target) = self.time_to_error.iter().find(|target| !(**target > 0.0 && target.is_finite())) {
            let message = format!("{target:?} is no error; give relative mean squared errors, such as [0.01, 0.001]");
            return fault("time_to_error", message);
        }
        self.reference.as_ref().map_or(Ok(()), Reference::check)
    }

    /// The metrics of images that are judged.
    ///
    /// # Errors
    /// If there is none of a name, with the nearest one.
    pub fn metrics(&self) -> Result<Vec<Metric>, Fault> {
        Metric::of(&self.metrics).map_err(|message| ("metrics".to_owned(), message))
    }
}

fn fault(key: &str, message: impl Into<String>) -> Result<(), Fault> {
    Err((key.to_owned(), message.into()))
}

impl Convergence {
    fn check(&self) -> Result<(), Fault> {
        if self.size.contains(&0) {
            return fault("size", "width and height must be at least 1, such as size = [64, 64]");
        }
        let rising = self.checkpoints.windows(2).all(|pair| pair[0] < pair[1]);
        if !rising || self.checkpoints.first().is_none_or(|&first| first == 0) {
            return fault("checkpoints", "checkpoints must be positive and rise, such as [1, 2, 4, 8]");
        }
        if self.replicates < 32 {
            let message = "at least 32 replicates are needed, or the bootstrap's intervals would be too narrow";
            return fault("replicates", message);
        }
        Ok(())
    }
}

/// Samples per pixel of each replicate.
///
/// # Errors
/// If `spp` samples cannot be divided evenly among the replicates, with the nearest numbers that can.
pub fn samples_per_replicate(spp: u32, replicates: u32) -> Result<u32, String> {
    if spp > 0 && replicates > 0 && spp.is_multiple_of(replicates) {
        return Ok(spp / replicates);
    }
    if spp == 0 || replicates == 0 {
        return Err("samples and replicates must be at least 1".to_owned());
    }
    let below = spp / replicates * replicates;
    let above = (u64::from(spp) / u64::from(replicates) + 1) * u64::from(replicates);
    // Divisors come in pairs.
    let pairs = (1..=spp.isqrt()).filter(|&small| spp.is_multiple_of(small)).flat_map(|small| [small, spp / small]);
    let divisor = pairs.filter(|divisor| (2..=replicates).contains(divisor)).max();
    let fewer = divisor.map_or(String::new(), |divisor| format!(", or {divisor} replicates"));
    let samples = if below == 0 { above.to_string() } else { format!("{below} or {above}") };
    Err(format!(
        "{spp} samples per pixel cannot be divided evenly among {replicates} replicates; take {samples} samples{fewer}"
    ))
}

/// The longest time budget \[s\]: ten years, which no one waits for, and few enough for a clock to count.
const LONGEST: f64 = 3.2e8;

/// Checks a time budget.
///
/// # Errors
/// If it is not positive, or beyond all patience.
pub fn check_seconds(seconds: f64) -> Result<(), String> {
    if seconds > 0.0 && seconds <= LONGEST {
        return Ok(());
    }
    Err(format!("{seconds:?} is no budget; give a positive number of seconds, at most {LONGEST:e} (ten years)"))
}

/// A sampler by its name.
///
/// # Errors
/// If there is none of that name, with the nearest one.
pub fn sampler(name: &str) -> Result<SamplerKind, Error> {
    let names: Vec<String> = SamplerKind::ALL.iter().map(ToString::to_string).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    name.parse().map_err(|_| Error::usage(unknown("sampler", name, &names)))
}

/// A pixel filter by its name.
///
/// # Errors
/// If there is none of that name, with the nearest one.
pub fn filter(name: &str) -> Result<Filter, Error> {
    let names: Vec<String> = Filter::ALL.iter().map(ToString::to_string).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    name.parse().map_err(|_| Error::usage(unknown("filter", name, &names)))
}

#[cfg(test)]
mod tests;
