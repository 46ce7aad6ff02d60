//! `manifest.json`: what results come from, and whether they answer the same question.

use crate::config::Experiment;
use crate::export::{ExportError, write_atomically};
use crate::machine::{Began, VERSION, machine};
use crate::path_class;
use crate::plan::{Plan, PlannedMethod, PlannedScene};
use crate::program::program;
use crate::result::{Manifest, MethodRecord, RenderRecord, SceneRecord};
use crate::runner::reference_hash;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The manifest's file.
pub const MANIFEST: &str = "manifest.json";

/// The manifest with the files that belong to it.
#[derive(Debug, Serialize, Deserialize)]
pub struct StoredManifest {
    /// Where the results come from.
    #[serde(flatten)]
    pub manifest: Manifest,
    /// Every file of the results, relative to the manifest's folder.
    pub files: Vec<String>,
}

/// The manifest of a run that ends now, and has rendered this.
pub fn manifest(plan: &Plan, renders: Vec<RenderRecord>, threads: usize, began: Began, complete: bool) -> Manifest {
    let (started, ended, seconds) = began.until_now();
    let scene = |(i, s): (usize, &PlannedScene)| SceneRecord {
        name: s.name.clone(),
        source: s.source.clone(),
        hash: s.scene.hash.clone(),
        filter: s.scene.camera.filter().to_string(),
        skipped: s.scene.needs.skipped().into_iter().map(str::to_owned).collect(),
        notes: s.scene.notes.clone(),
        reference: reference_hash(plan, i).unwrap_or_default(),
        missing: plan.methods_in(s).map(|m| (m.label.clone(), path_class::missing(&*m.method, &s.scene))).collect(),
        composites: s.chosen.iter().map(|chosen| (chosen.planned.label.clone(), chosen.choice.clone())).collect(),
    };
    let method = |m: &PlannedMethod| MethodRecord {
        label: m.label.clone(),
        method: m.method.name().to_owned(),
        settings: m.method.settings(),
        sampler: m.sampler,
        instance: plan.render_settings(m).instance,
    };
    let scenes: Vec<SceneRecord> = plan.scenes.iter().enumerate().map(scene).collect();
    let methods: Vec<MethodRecord> = plan.methods.iter().map(method).collect();
    Manifest {
        neumann: VERSION.to_owned(),
        program: program().clone(),
        name: plan.name.clone(),
        file: plan.file.clone(),
        command_line: std::env::args_os().map(|arg| arg.to_string_lossy().into_owned()).collect(),
        key: key(plan, &scenes, &methods),
        experiment: plan.experiment.clone(),
        scenes,
        methods,
        renders,
        machine: machine(threads),
        shards: Vec::new(),
        started,
        ended,
        seconds,
        complete,
    }
}

/// Hash of all that the numbers follow from.
fn key(plan: &Plan, scenes: &[SceneRecord], methods: &[MethodRecord]) -> String {
    let hashes: Vec<(&str, &str)> = scenes.iter().map(|s| (s.hash.as_str(), s.reference.as_str())).collect();
    let text = serde_json::to_string(&(VERSION, &plan.experiment, hashes, methods)).unwrap_or_default();
    blake3::hash(text.as_bytes()).to_hex().to_string()
}

/// The manifest in a file, if it holds one.
pub fn read_manifest(path: &Path) -> Option<StoredManifest> {
    serde_json::from_slice(&scenes::file::read(path).ok()?).ok()
}

/// Writes the manifest with the files that belong to it.
///
/// # Errors
/// If it cannot be written.
pub fn write_manifest(path: &Path, manifest: &Manifest, files: Vec<String>) -> Result<(), ExportError> {
    let stored = StoredManifest { manifest: manifest.clone(), files };
    let text = serde_json::to_string_pretty(&stored).unwrap_or_default() + "\n";
    write_atomically(path, text.as_bytes())
}

/// How the question that earlier results answer differs from the plan's; `None` if it is the same, but for the number of replicates.
pub fn difference(former: &Manifest, plan: &Plan) -> Option<String> {
    let (old, new) = (&former.experiment, &plan.experiment);
    let tables = (table(old), table(new));
    let (Some(old_table), Some(new_table)) = tables else { return Some("it cannot be compared".to_owned()) };
    for key in Experiment::KEYS {
        if old_table.get(key) != new_table.get(key) {
            let show = |value: Option<&toml::Value>| value.map_or("none".to_owned(), ToString::to_string);
            let (old, new) = (show(old_table.get(key)), show(new_table.get(key)));
            let short = old.len() + new.len() < 80;
            return Some(if short { format!("{key} was {old}, now {new}") } else { format!("{key} changed") });
        }
    }
    let edited =
        plan.scenes.iter().find(|s| former.scenes.iter().all(|old| old.name != s.name || old.hash != s.scene.hash));
    edited.map(|scene| format!("scene {} was edited", scene.name)).or_else(|| other_replicates(old, new))
}

/// An experiment without what may be more in a later run of it.
fn table(experiment: &Experiment) -> Option<toml::Table> {
    let mut table = toml::Table::try_from(experiment).ok()?;
    for key in ["title", "description", "spp", "seconds", "replicates", "until", "max_spp"] {
        table.remove(key);
    }
    if let Some(reference) = table.get_mut("reference").and_then(toml::Value::as_table_mut) {
        for key in ["spp", "replicates"] {
            reference.remove(key);
        }
    }
    Some(table)
}

/// How a replicate differs: in its samples, or in the time that it is given.
fn other_replicates(old: &Experiment, new: &Experiment) -> Option<String> {
    let samples = |e: &Experiment| e.spp.map(|spp| spp / e.replicates);
    let seconds =
        |e: &Experiment| e.seconds.filter(|_| e.until.is_none()).map(|seconds| seconds / f64::from(e.replicates));
    if samples(old) == samples(new) && seconds(old) == seconds(new) {
        return None;
    }
    let told = |e: &Experiment| match (samples(e), seconds(e)) {
        (Some(samples), _) => format!("{samples} samples"),
        (None, seconds) => format!("{} s", seconds.unwrap_or_default()),
    };
    let replicates = new.replicates;
    let all = match (samples(old), seconds(old)) {
        (Some(samples), _) => format!("--spp {}", u64::from(samples) * u64::from(replicates)),
        (None, seconds) => format!("--seconds {}", seconds.unwrap_or_default() * f64::from(replicates)),
    };
    let (before, now) = (told(old), told(new));
    Some(format!("each replicate had {before}, now {now}; {replicates} like those are {all} --replicates {replicates}"))
}
