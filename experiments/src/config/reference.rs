//! What an experiment is judged by, and by which metrics.

use super::{Fault, fault, samples_per_replicate};
use crate::error::unknown;
use serde::{Deserialize, Serialize};

/// A reference for every scene: images pooled from methods, or one that there is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// Whose images are pooled: labels of the experiment's methods, or names of methods; all of the experiment's if left out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub methods: Vec<String>,
    /// Samples per pixel of each of these methods in each of the reference's two halves.
    #[serde(default = "default_spp")]
    pub spp: u32,
    /// Independent images that share them.
    #[serde(default = "default_replicates")]
    pub replicates: u32,
    /// The file of a reference that was made before, instead of all that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
}

fn default_spp() -> u32 {
    1024
}

fn default_replicates() -> u32 {
    16
}

impl Reference {
    /// One in a file.
    pub fn of_file(file: String) -> Self {
        Self { methods: Vec::new(), spp: default_spp(), replicates: default_replicates(), file: Some(file) }
    }

    /// Samples of a replicate.
    pub fn samples(&self) -> u32 {
        self.spp / self.replicates
    }

    /// Checks what the types cannot.
    pub(super) fn check(&self) -> Result<(), Fault> {
        if self.file.is_some() && !self.methods.is_empty() {
            return fault("reference.file", "a file and methods are both given; leave one out");
        }
        if self.replicates < 2 {
            let message = "a reference needs at least 2 replicates, for without them its noise is not known";
            return fault("reference.replicates", message);
        }
        samples_per_replicate(self.spp, self.replicates).map(|_| ()).or_else(|e| fault("reference.spp", e))
    }
}

/// How far images are from their reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Metric {
    /// Mean squared error of a replicate.
    Mse,
    /// The part of it that no number of samples removes.
    Bias2,
    /// Relative mean squared error.
    Relmse,
    /// Symmetric mean absolute percentage error.
    Smape,
    /// What the eye sees of it.
    Flip,
}

impl Metric {
    /// All of them, by name.
    pub const ALL: [(&'static str, Metric); 5] = [
        ("mse", Metric::Mse),
        ("bias2", Metric::Bias2),
        ("relmse", Metric::Relmse),
        ("smape", Metric::Smape),
        ("flip", Metric::Flip),
    ];

    /// Those of a list; all but FLIP, which takes longer than all others together, for an empty one.
    pub(super) fn of(names: &[String]) -> Result<Vec<Metric>, String> {
        if names.is_empty() {
            return Ok(Self::ALL.iter().map(|(_, metric)| *metric).filter(|m| *m != Metric::Flip).collect());
        }
        let known = Self::ALL.map(|(name, _)| name);
        let of = |name: &String| {
            let found = Self::ALL.iter().find(|(known, _)| known == name);
            found.map(|(_, metric)| *metric).ok_or_else(|| unknown("metric", name, &known))
        };
        names.iter().map(of).collect()
    }
}
