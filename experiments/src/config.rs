//! Experiment files: what is asked, in TOML.

use crate::error::{Error, nearest, unknown};
use sampling::filter::Filter;
use sampling::sampler::SamplerKind;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

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
    /// Samples per pixel over all replicates; this or `seconds`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spp: Option<u32>,
    /// Wall time for each method in each scene \[s\]; this or `spp`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
    /// Independent images.
    #[serde(default = "default_replicates")]
    pub replicates: u32,
    /// Seed of all random numbers.
    #[serde(default)]
    pub seed: u64,
    /// Sampler.
    #[serde(default = "default_sampler")]
    pub sampler: SamplerKind,
    /// Image size `[width, height]`; the scene's own where it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[u32; 2]>,
    /// Variance against samples; left out, it is not measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub convergence: Option<Convergence>,
}

/// One method of an experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MethodEntry {
    /// Registered name.
    pub name: String,
    /// What the results call it; its name, with the settings where a name occurs twice, if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
    /// The settings that differ from the defaults.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub settings: toml::Table,
}

/// How variance against samples is measured: separate runs of `samples` samples a replicate each.
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

fn default_sampler() -> SamplerKind {
    SamplerKind::Independent
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

/// The experiments embedded in the program: names and files.
pub const LIBRARY: [(&str, &str); 3] = [
    ("comparison", include_str!("../library/comparison.toml")),
    ("convergence", include_str!("../library/convergence.toml")),
    ("furnace", include_str!("../library/furnace.toml")),
];

/// The last order that a path's technique can count.
pub const HIGHEST_ORDER: usize = 65_000;

/// An experiment's file, as found.
#[derive(Clone, Debug)]
pub struct Source {
    /// The experiment's name: the built-in's, or the file's without its ending.
    pub name: String,
    /// The file; `None` for a built-in.
    pub path: Option<PathBuf>,
    text: String,
}

impl Source {
    /// A built-in experiment's name, or a path (anything with a `/` or ending in `.toml`).
    ///
    /// # Errors
    /// If there is no such experiment or file.
    pub fn open(name_or_path: &str) -> Result<Self, Error> {
        if let Some((name, text)) = LIBRARY.iter().find(|(name, _)| *name == name_or_path) {
            return Ok(Self { name: (*name).to_owned(), path: None, text: (*text).to_owned() });
        }
        let path = Path::new(name_or_path);
        if path.extension().is_none_or(|e| e != "toml") && !name_or_path.contains('/') {
            let names: Vec<&str> = LIBRARY.iter().map(|(name, _)| *name).collect();
            return Err(Error::usage(format!("{}; or give a .toml file", unknown("experiment", name_or_path, &names))));
        }
        let mend = "give an experiment's file, or one of the names that `neumann list experiments` shows";
        let failed = |source| Error::Io { action: "read", path: path.to_owned(), source, mend };
        let text = std::fs::read_to_string(path).map_err(failed)?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { name, path: Some(path.to_owned()), text })
    }

    /// Reads the file; what it asks for is not checked yet, see [`Experiment::check`].
    ///
    /// # Errors
    /// If it is no TOML or no experiment, with the line and, for unknown keys, the nearest valid one.
    pub fn parse(&self) -> Result<Experiment, Error> {
        toml::from_str(&self.text).map_err(|e| {
            let line = e.span().map(|span| 1 + self.text[..span.start.min(self.text.len())].matches('\n').count());
            self.fault(line, with_nearest(e.message()))
        })
    }

    /// Blames a key of the file.
    pub fn blame(&self, key: &str, message: String) -> Error {
        let sets =
            |line: &str| line.trim_start().strip_prefix(key).is_some_and(|rest| rest.trim_start().starts_with('='));
        let line = self.text.lines().position(sets).map(|n| n + 1);
        self.fault(line, message)
    }

    fn fault(&self, line: Option<usize>, message: String) -> Error {
        let file = self.path.clone().unwrap_or_else(|| PathBuf::from(format!("experiment {}", self.name)));
        Error::File { file, line, message }
    }

    /// A scene of the experiment as [`scenes::load()`] takes it: paths are relative to the experiment's file.
    pub fn scene(&self, name_or_path: &str) -> String {
        let is_path = name_or_path.contains('/') || Path::new(name_or_path).extension().is_some();
        match self.path.as_deref().and_then(Path::parent) {
            Some(folder) if is_path => folder.join(name_or_path).to_string_lossy().into_owned(),
            _ => name_or_path.to_owned(),
        }
    }
}

/// Adds the nearest valid name to serde's message about an unknown one: "unknown field `spb`, expected one of `spp`, …".
pub fn with_nearest(message: &str) -> String {
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    match quoted.split_first() {
        Some((given, valid)) if message.starts_with("unknown ") && !valid.is_empty() => {
            format!("{message}; did you mean `{}`?", nearest(given, valid).unwrap_or_default())
        }
        _ => message.to_owned(),
    }
}

/// What is wrong with an experiment: the key, and a sentence with the mend.
pub type Fault = (&'static str, String);

impl Experiment {
    /// The keys of its file.
    pub const KEYS: [&'static str; 13] = [
        "title",
        "description",
        "scenes",
        "methods",
        "max_order",
        "tail",
        "spp",
        "seconds",
        "replicates",
        "seed",
        "sampler",
        "size",
        "convergence",
    ];

    /// Checks what the types cannot.
    ///
    /// # Errors
    /// The first fault found.
    pub fn check(&self) -> Result<(), Fault> {
        if self.scenes.is_empty() {
            return Err(("scenes", "no scenes; name at least one, such as scenes = [\"cornell_box\"]".to_owned()));
        }
        if self.methods.is_empty() {
            return Err(("methods", "no methods; add at least one [[methods]] with a name".to_owned()));
        }
        if self.max_order > HIGHEST_ORDER {
            return Err(("max_order", format!("max_order {} is above {HIGHEST_ORDER}", self.max_order)));
        }
        if self.size.is_some_and(|size| size.contains(&0)) {
            return Err(("size", "width and height must be at least 1, such as size = [256, 256]".to_owned()));
        }
        self.check_budget()?;
        self.convergence.as_ref().map_or(Ok(()), Convergence::check)
    }

    fn check_budget(&self) -> Result<(), Fault> {
        if self.replicates < 2 {
            return Err((
                "replicates",
                "an experiment needs at least 2 replicates, for without them there is no variance".to_owned(),
            ));
        }
        match (self.spp, self.seconds) {
            (None, None) => Err(("spp", "no budget; give spp (samples per pixel) or seconds".to_owned())),
            (Some(_), Some(_)) => Err(("seconds", "spp and seconds are both given; leave one out".to_owned())),
            (Some(spp), None) => samples_per_replicate(spp, self.replicates).map(|_| ()).map_err(|e| ("spp", e)),
            (None, Some(seconds)) => check_seconds(seconds).map_err(|e| ("seconds", e)),
        }
    }
}

impl Convergence {
    fn check(&self) -> Result<(), Fault> {
        if self.size.contains(&0) {
            return Err(("size", "width and height must be at least 1, such as size = [64, 64]".to_owned()));
        }
        let rising = self.checkpoints.windows(2).all(|pair| pair[0] < pair[1]);
        if !rising || self.checkpoints.first().is_none_or(|&first| first == 0) {
            return Err(("checkpoints", "checkpoints must be positive and rise, such as [1, 2, 4, 8]".to_owned()));
        }
        if self.replicates < 32 {
            return Err((
                "replicates",
                "convergence needs at least 32 replicates, or its bootstrap intervals would be too narrow".to_owned(),
            ));
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
    let divisor = (1..=replicates).rev().find(|r| spp.is_multiple_of(*r)).unwrap_or(1);
    let samples = if below == 0 { above.to_string() } else { format!("{below} or {above}") };
    Err(format!(
        "{spp} samples per pixel cannot be divided evenly among {replicates} replicates; \
         take {samples} samples, or {divisor} replicates"
    ))
}

/// Checks a time budget.
///
/// # Errors
/// If it is not positive.
pub fn check_seconds(seconds: f64) -> Result<(), String> {
    if seconds > 0.0 && seconds.is_finite() {
        return Ok(());
    }
    Err(format!("{seconds} is no budget; give a positive number of seconds"))
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
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Experiment, Error> {
        Source { name: "x".into(), path: Some("dir/x.toml".into()), text: text.into() }.parse()
    }

    const SMALL: &str = "scenes = [\"furnace\"]\nspp = 8\n[[methods]]\nname = \"path\"\n";

    #[test]
    fn every_embedded_experiment_is_valid_and_survives_being_written() {
        for (name, _) in LIBRARY {
            let experiment = Source::open(name).unwrap().parse().unwrap();
            experiment.check().unwrap();
            let written = toml::to_string(&experiment).unwrap();
            assert_eq!(toml::from_str::<Experiment>(&written).unwrap(), experiment, "{name}");
        }
    }

    #[test]
    fn the_listed_keys_are_those_of_the_struct() {
        let mut experiment = Source::open("comparison").unwrap().parse().unwrap();
        (experiment.seconds, experiment.size) = (Some(1.0), Some([4, 4]));
        let mut known = Experiment::KEYS.to_vec();
        known.sort_unstable();
        let mut table: Vec<String> = toml::Table::try_from(&experiment).unwrap().keys().cloned().collect();
        table.sort_unstable();
        assert_eq!(table, known);
    }

    #[test]
    fn faults_have_file_line_and_mend() {
        let message = parse(&SMALL.replace("spp", "spb")).unwrap_err().to_string();
        assert!(message.starts_with("dir/x.toml:2: ") && message.contains("did you mean `spp`"), "{message}");
        let message = parse("scenes = [").unwrap_err().to_string();
        assert!(message.starts_with("dir/x.toml:1: "), "{message}");
        let experiment = parse(&SMALL.replace('8', "7")).unwrap();
        assert_eq!(experiment.check().unwrap_err().0, "spp");
    }

    #[test]
    fn uneven_budgets_name_the_even_ones() {
        assert_eq!(samples_per_replicate(64, 4), Ok(16));
        assert!(samples_per_replicate(10, 4).unwrap_err().contains("8 or 12 samples, or 2 replicates"));
        assert!(samples_per_replicate(1, 4).unwrap_err().contains("4 samples, or 1 replicates"));
        assert!(samples_per_replicate(u32::MAX, 4).unwrap_err().contains("4294967296"));
        assert!(samples_per_replicate(0, 4).is_err() && check_seconds(f64::NAN).is_err());
    }

    #[test]
    fn scenes_given_by_path_are_found_beside_the_experiment() {
        let source = Source { name: "x".into(), path: Some("dir/x.toml".into()), text: String::new() };
        assert_eq!(source.scene("furnace"), "furnace");
        assert_eq!(source.scene("room.obj"), "dir/room.obj");
    }
}
