//! `records.csv` and `manifest.json` of results, read back.

use crate::error::Error;
use crate::manifest::{self, MANIFEST};
use crate::result::Manifest;
use serde::Deserialize;
use std::path::Path;

/// A row of the records, as far as figures need it.
#[derive(Clone, Debug, Deserialize)]
pub struct StoredRecord {
    /// The scene.
    pub scene: String,
    /// The method's label, without the sampler's.
    pub method: String,
    /// Where its random numbers came from.
    pub sampler: String,
    /// A number, `tail`, `total`, or the name of a layer; empty where it makes no sense.
    pub order: String,
    /// Samples per pixel over all replicates.
    pub spp: u64,
    /// Replicates.
    pub replicates: u32,
    /// Wall time of them \[s\].
    pub seconds: f64,
    /// What was measured.
    pub quantity: String,
    /// `r`, `g`, `b`, or `all` for their mean.
    pub channel: String,
    /// The value.
    pub value: f64,
    /// The ends of its 95 % interval, where it is known.
    pub ci_low: Option<f64>,
    /// Its upper end.
    pub ci_high: Option<f64>,
}

impl StoredRecord {
    /// The value's interval.
    pub fn interval(&self) -> Option<(f64, f64)> {
        self.ci_low.zip(self.ci_high)
    }
}

/// What a folder of results tells.
#[derive(Clone, Debug)]
pub struct Told {
    /// What was measured.
    pub records: Vec<StoredRecord>,
    /// Where it comes from.
    pub manifest: Manifest,
}

impl Told {
    /// What the results in a folder tell.
    ///
    /// # Errors
    /// A sentence, if there are none.
    pub fn read(folder: &Path) -> Result<Self, String> {
        let none =
            format!("{} holds no results of neumann; give a folder that `neumann run` has written", folder.display());
        let manifest = manifest::read_manifest(&folder.join(MANIFEST)).ok_or(none)?.manifest;
        let path = folder.join("records.csv");
        let fault =
            |e: &dyn std::fmt::Display| format!("cannot read {}: {e}; `neumann run` writes it again", path.display());
        let bytes = scenes::file::read(&path).map_err(|e| fault(&e))?;
        let rows = csv::Reader::from_reader(bytes.as_slice()).into_deserialize();
        let records = rows.collect::<Result<Vec<StoredRecord>, csv::Error>>().map_err(|e| fault(&e))?;
        Ok(Self { records, manifest })
    }

    /// The records of a method's images in a scene, by its label.
    pub fn of_label<'a>(&'a self, scene: &'a str, label: &'a str) -> impl Iterator<Item = &'a StoredRecord> {
        let method = self.manifest.methods.iter().find(|method| method.label == label);
        let sampler = method.map(|method| method.sampler.to_string()).unwrap_or_default();
        // A label has the sampler's name where there are several, alone where there is but one method.
        let called = move |row: &StoredRecord| {
            row.method == label || format!("{}_{sampler}", row.method) == label || sampler == label
        };
        let sampler = method.map(|method| method.sampler.to_string()).unwrap_or_default();
        self.records.iter().filter(move |row| row.scene == scene && row.sampler == sampler && called(row))
    }
}

/// The names, each once, in the order in which they come first.
pub fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut seen = Vec::new();
    names.for_each(|name| {
        if !seen.contains(&name) {
            seen.push(name)
        }
    });
    seen
}

/// The error of a place in a figure's file, from a sentence.
pub fn blamed(source: &crate::source::Source, key: String) -> impl FnOnce(String) -> Error {
    move |message| source.blame(&key, message)
}
