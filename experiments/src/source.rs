//! Where experiments come from: the library, or a file; and the place in it that is to blame for a fault.

use crate::config::Experiment;
use crate::error::{Error, unknown};
use integrators::with_nearest;
use scenes::SceneError;
use serde::de::DeserializeOwned;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, DeValue};

/// The experiments embedded in the program: names and files.
pub const LIBRARY: [(&str, &str); 18] = [
    ("bdpt_options", include_str!("../library/bdpt_options.toml")),
    ("best_per_order", include_str!("../library/best_per_order.toml")),
    ("comparison", include_str!("../library/comparison.toml")),
    ("consistency", include_str!("../library/consistency.toml")),
    ("convergence", include_str!("../library/convergence.toml")),
    ("default_sampler", include_str!("../library/default_sampler.toml")),
    ("default_settings", include_str!("../library/default_settings.toml")),
    ("furnace", include_str!("../library/furnace.toml")),
    ("guided", include_str!("../library/guided.toml")),
    ("light_vs_path", include_str!("../library/light_vs_path.toml")),
    ("metropolis", include_str!("../library/metropolis.toml")),
    ("mis_heuristics", include_str!("../library/mis_heuristics.toml")),
    ("radiosity", include_str!("../library/radiosity.toml")),
    ("roulette", include_str!("../library/roulette.toml")),
    ("samplers", include_str!("../library/samplers.toml")),
    ("sobol", include_str!("../library/sobol.toml")),
    ("time_to_error", include_str!("../library/time_to_error.toml")),
    ("unbiasedness", include_str!("../library/unbiasedness.toml")),
];

/// Keys that every experiment has, and no scene.
const OF_EXPERIMENTS: [&str; 2] = ["methods", "scenes"];
/// Keys that scenes have, one or the other, and no experiment.
const OF_SCENES: [&str; 4] = ["camera", "shapes", "emitters", "materials"];

/// What to say of a scene that cannot be loaded if its name is that of an experiment.
pub fn no_scene(name_or_path: &str, error: SceneError) -> Error {
    match Source::open(name_or_path) {
        Ok(source) if source.has_any(&OF_EXPERIMENTS) => {
            Error::usage(format!("{name_or_path} is an experiment, no scene; `neumann run {name_or_path}` runs it"))
        }
        _ => error.into(),
    }
}

/// What to say of an experiment whose name is that of a scene.
fn no_experiment(scene: impl Display) -> Error {
    Error::usage(format!("{scene} is a scene, no experiment; `neumann render {scene}` renders it"))
}

/// An experiment's file, as found.
#[derive(Clone, Debug)]
pub struct Source {
    /// The experiment's name: the built-in's, or the file's without its ending.
    pub name: String,
    /// The file; `None` for a built-in.
    pub path: Option<PathBuf>,
    text: String,
    /// Keys that the command line changed, and how it did: they are no fault of the file.
    flags: Vec<(String, String)>,
}

/// What is blamed where it alone was changed: a fault of the first key may as well be one of the second.
const TOGETHER: [(&str, &str); 4] =
    [("spp", "replicates"), ("until", "max_order"), ("until", "spp"), ("max_spp", "spp")];

impl Source {
    /// A built-in experiment's name, or a path (anything with a `/` or ending in `.toml`).
    ///
    /// # Errors
    /// If there is no such experiment or file.
    pub fn open(name_or_path: &str) -> Result<Self, Error> {
        if let Some((name, text)) = LIBRARY.iter().find(|(name, _)| *name == name_or_path) {
            return Ok(Self { name: (*name).to_owned(), path: None, text: (*text).to_owned(), flags: Vec::new() });
        }
        if Path::new(name_or_path).extension().is_none_or(|e| e != "toml") && !name_or_path.contains('/') {
            if scenes::builtin_names().contains(&name_or_path) {
                return Err(no_experiment(name_or_path));
            }
            let names: Vec<&str> = LIBRARY.iter().map(|(name, _)| *name).collect();
            return Err(Error::usage(format!("{}; or give a .toml file", unknown("experiment", name_or_path, &names))));
        }
        Self::file(
            Path::new(name_or_path),
            "give an experiment's file, or one of the names that `neumann list experiments` shows",
        )
    }

    /// A file; `mend` is what would help where it cannot be read.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn file(path: &Path, mend: &'static str) -> Result<Self, Error> {
        let failed = |source| Error::Io { action: "read", path: path.to_owned(), source, mend };
        let text = scenes::file::read_text(path).map_err(failed)?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { name, path: Some(path.to_owned()), text, flags: Vec::new() })
    }

    /// What was read before.
    pub fn known(name: &str, path: Option<PathBuf>, text: &str) -> Self {
        Self { name: name.to_owned(), path, text: text.to_owned(), flags: Vec::new() }
    }

    /// What the file holds.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// What a command makes up itself.
    pub fn of_command(name: &str) -> Self {
        Self { name: name.to_owned(), path: None, text: String::new(), flags: Vec::new() }
    }

    /// Reads the file; what it asks for is not checked yet, see [`Experiment::check`].
    ///
    /// # Errors
    /// If it is no TOML or no experiment, with the line and, for unknown keys, the nearest valid one.
    pub fn parse(&self) -> Result<Experiment, Error> {
        self.parse_as().map_err(|error| match &self.path {
            Some(path) if self.has_any(&OF_SCENES) && !self.has_any(&OF_EXPERIMENTS) => no_experiment(path.display()),
            _ => error,
        })
    }

    /// Whether it is TOML that has any of these keys.
    fn has_any(&self, keys: &[&str]) -> bool {
        DeTable::parse(&self.text).is_ok_and(|table| keys.iter().any(|key| table.get_ref().contains_key(*key)))
    }

    /// Reads a file of another kind.
    ///
    /// # Errors
    /// The same, if it is none of that kind.
    pub fn parse_as<T: DeserializeOwned>(&self) -> Result<T, Error> {
        toml::from_str(&self.text).map_err(|e| {
            let line = e.span().map(|span| self.line_at(span.start));
            self.fault(line, with_nearest(e.message()))
        })
    }

    /// Notes that the command line changed a key, by a flag written like this: `--spp 7`.
    pub fn changed_by(&mut self, key: &str, flag: String) {
        self.flags.push((key.to_owned(), flag));
    }

    /// Blames a key, such as `size`, `convergence.size` or `methods.1.name` (the second method's): the flag that changed it, or else
    /// its place in the file.
    pub fn blame(&self, key: &str, message: String) -> Error {
        match self.flag_of(key) {
            Some(flag) => Error::usage(format!("{flag}: {message}")),
            None => self.fault(self.line_of(key), message),
        }
    }

    /// The flag that changed a key, a part of it, or what is told together with it.
    fn flag_of(&self, key: &str) -> Option<&str> {
        let within = |inner: &str, outer: &str| {
            inner.strip_prefix(outer).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        let changed = |key: &str| {
            let flag = self.flags.iter().rev().find(|(own, _)| within(own, key) || within(key, own));
            flag.map(|(_, flag)| flag.as_str())
        };
        let others = TOGETHER.iter().filter(|(first, _)| *first == key).map(|(_, second)| *second);
        changed(key).or_else(|| others.into_iter().find_map(changed))
    }

    /// The line of a key, or of the innermost part of it that the file has.
    fn line_of(&self, key: &str) -> Option<usize> {
        let root = DeValue::Table(DeTable::parse(&self.text).ok()?.into_inner());
        let (mut value, mut line) = (&root, None);
        for part in key.split('.') {
            let found = match part.parse::<usize>() {
                Ok(index) => value.get(index),
                Err(_) => value.get(part),
            };
            let Some(found) = found else { break };
            line = Some(self.line_at(found.span().start));
            value = found.get_ref();
        }
        line
    }

    /// The line, from 1, of a place in the text.
    fn line_at(&self, place: usize) -> usize {
        1 + self.text[..place.min(self.text.len())].matches('\n').count()
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

#[cfg(test)]
mod tests {
    use super::*;

    fn source(text: &str) -> Source {
        Source { name: "x".into(), path: Some("dir/x.toml".into()), text: text.into(), flags: Vec::new() }
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
    fn every_file_of_the_library_is_embedded() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/library");
        let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let mut names: Vec<String> =
            files.map(|file| file.file_stem().unwrap().to_string_lossy().into_owned()).collect();
        names.sort();
        assert_eq!(names, LIBRARY.map(|(name, _)| name));
    }

    #[test]
    fn faults_have_file_line_and_mend() {
        let parse = |text: &str| source(text).parse();
        let message = parse(&SMALL.replace("spp", "spb")).unwrap_err().to_string();
        assert!(message.starts_with("dir/x.toml:2: ") && message.contains("did you mean `spp`"), "{message}");
        let message = parse("scenes = [").unwrap_err().to_string();
        assert!(message.starts_with("dir/x.toml:1: "), "{message}");
        let experiment = parse(&SMALL.replace('8', "7")).unwrap();
        assert_eq!(experiment.check().unwrap_err().0, "spp");
    }

    #[test]
    fn the_key_blamed_is_the_one_meant_and_not_its_namesake() {
        let text = "replicates = 4\nsize = [8, 8]\n\n[[methods]]\nname = \"path\"\n\n[[methods]]\nname = \"bpdt\"\n\n\
                    [convergence]\nsize = [0, 1]\nreplicates = 3\n";
        let place = |key: &str| {
            let message = source(text).blame(key, "wrong".to_owned()).to_string();
            message.trim_start_matches("dir/x.toml").trim_end_matches("wrong").to_owned()
        };
        assert_eq!(
            ["replicates", "size", "methods.0.name", "methods.1.name"].map(place),
            [":1: ", ":2: ", ":5: ", ":8: "]
        );
        assert_eq!(["convergence.size", "convergence.replicates"].map(place), [":11: ", ":12: "]);
        // What is not there is blamed on what it belongs to.
        assert_eq!(["methods.1.label", "convergence.checkpoints", "spp"].map(place), [":7: ", ":10: ", ": "]);
    }

    #[test]
    fn what_a_flag_changed_is_no_fault_of_the_file() {
        let mut source = source(SMALL);
        source.changed_by("replicates", "--replicates 5".to_owned());
        source.changed_by("until.order", "--set until.order=9".to_owned());
        let place = |key: &str| source.blame(key, "wrong".to_owned()).to_string();
        assert_eq!(["spp", "replicates"].map(place), ["--replicates 5: wrong"; 2]);
        assert_eq!(["until", "until.order"].map(place), ["--set until.order=9: wrong"; 2]);
        assert_eq!(["scenes", "replicatesx"].map(place), ["dir/x.toml:1: wrong", "dir/x.toml: wrong"]);
    }

    #[test]
    fn scenes_given_by_path_are_found_beside_the_experiment() {
        assert_eq!(source("").scene("furnace"), "furnace");
        assert_eq!(source("").scene("room.obj"), "dir/room.obj");
    }
}
