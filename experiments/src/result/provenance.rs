//! Where results come from: the manifest.

use crate::choice::Choice;
use crate::config::Experiment;
use sampling::sampler::SamplerKind;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Where results come from: enough to make them again.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of the program and of its sources: `0.1.0+1a2b3c4d`.
    pub neumann: String,
    /// The program.
    #[serde(default)]
    pub program: Program,
    /// The experiment's name.
    #[serde(default)]
    pub name: String,
    /// Its file; `None` for a built-in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// The whole command line.
    pub command_line: Vec<String>,
    /// The experiment as it ran, changes by flags included.
    pub experiment: Experiment,
    /// Hash of all that the numbers follow from: scenes, methods, settings, seed, budget and build.
    pub key: String,
    /// Content hashes of the scenes, by name.
    pub scenes: Vec<SceneRecord>,
    /// The methods with all of their settings.
    pub methods: Vec<MethodRecord>,
    /// What was rendered, and what of it by earlier runs.
    #[serde(default)]
    pub renders: Vec<RenderRecord>,
    /// The machine.
    pub machine: Machine,
    /// Where the replicates were rendered, shard by shard; empty for a run in one piece.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shards: Vec<Origin>,
    /// Start, in UTC, as `2026-01-31T12:00:00Z`.
    pub started: String,
    /// End, likewise.
    pub ended: String,
    /// Wall time from start to end \[s\].
    pub seconds: f64,
    /// Whether everything that was asked for is there; not so after Ctrl-C.
    pub complete: bool,
}

/// What rendered a shard, or made a plan.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Origin {
    /// Version of the program and of its sources.
    pub neumann: String,
    /// The program.
    pub program: Program,
    /// The machine.
    pub machine: Machine,
}

/// A scene in the manifest.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SceneRecord {
    /// Its name in the results.
    pub name: String,
    /// What was loaded: a built-in's name or a path.
    pub source: String,
    /// Content hash.
    pub hash: String,
    /// The camera's pixel filter.
    #[serde(default)]
    pub filter: String,
    /// What the scene lets a render leave out.
    pub skipped: Vec<String>,
    /// What an importer approximated.
    pub notes: Vec<String>,
    /// Hash of what its images are judged by; empty where they are not.
    #[serde(default)]
    pub reference: String,
    /// The runs that were chosen for composites, by their labels.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub composites: BTreeMap<String, Choice>,
    /// The light that methods cannot carry in it, in words, by their labels.
    #[serde(default)]
    pub missing: BTreeMap<String, Vec<String>>,
}

/// A method in the manifest.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MethodRecord {
    /// Its label in the results.
    pub label: String,
    /// Its registered name.
    pub method: String,
    /// All of its settings.
    pub settings: Value,
    /// Where its random numbers came from.
    #[serde(default)]
    pub sampler: SamplerKind,
    /// The name under which they were drawn, beside the seed.
    #[serde(default)]
    pub instance: String,
}

/// A method at work in a scene, in the manifest.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RenderRecord {
    /// The scene's name.
    pub scene: String,
    /// The method's label.
    pub label: String,
    /// What for: `image`, or a checkpoint such as `64x64_at_4`.
    pub what: String,
    /// Samples per pixel of each replicate.
    pub samples_per_replicate: u32,
    /// Complete replicates.
    pub replicates: u32,
    /// How many of them, the first ones, an earlier run rendered.
    pub resumed: u32,
}

/// The program in the manifest.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Program {
    /// The compiler that built it.
    pub compiler: String,
    /// What it was built for.
    pub target: String,
    /// `release` or `debug`.
    pub profile: String,
    /// Instruction sets that it takes for granted.
    pub features: String,
    /// BLAKE3 hash of its file; empty where it could not be read.
    pub hash: String,
}

/// The machine in the manifest.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Machine {
    /// Operating system and architecture: `linux-x86_64`.
    pub platform: String,
    /// The processor's own name for itself; empty where it is unknown.
    pub cpu: String,
    /// Threads that rendered.
    pub threads: usize,
    /// Instruction set of the ray kernels: `avx2` or `portable`.
    pub kernels: String,
}
