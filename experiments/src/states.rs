//! What has been rendered so far, on the disk: an interrupted run goes on from there, and a longer one too.
//!
//! A run keeps a file for each unit of work in the folder `state/` of its results: a method's images in a scene, a checkpoint of its
//! convergence, the integrals. A file is named after its unit and the beginning of a key, the hash of all that its numbers
//! follow from, so that what was rendered by another program or of an edited scene is never taken up.
//!
//! | bytes | what |
//! |---|---|
//! | 16 | `neumann state 1` and a line feed; 1 is the format |
//! | 32 | the key |
//! | 4 | complete replicates, little-endian as all that follows |
//! | … | what [`integrators::state::Stored`] writes of the unit |
//! | 32 | BLAKE3 of all the bytes before |
//!
//! A file is written beside its place, flushed to the disk and renamed, so that whatever ends the program leaves the old or the new
//! one.

use crate::error::Error;
use crate::export::{write_atomically, write_streamed};
use crate::manifest;
use crate::result::Manifest;
use crate::shards::Shards;
use file::{read_head, read_state};
use pace::Pace;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
pub use unit::{Unit, origin};

mod file;
mod pace;
mod unit;

/// The folder of the states, in that of the results.
pub const FOLDER: &str = "state";
/// What the run at work was asked for.
const BEGUN: &str = "run.json";
/// The samples that pilots chose.
const CHOSEN: &str = "budget.json";
const MEND: &str =
    "make room there, or let it be written; the same command, without --fresh, then goes on from the last state";

const AGAIN: &str = "`neumann run`, with the same flags and folder, renders what is missing";

/// What is done with states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Keeping {
    /// They are read and written.
    All,
    /// Those of finished results are read, whichever program has rendered them, and nothing else is done.
    Finished,
    /// There are none.
    Nothing,
}

/// The states of a run.
pub struct States {
    folder: PathBuf,
    keeping: Keeping,
    /// Where replicates are taken from, if they have been rendered apart.
    shards: Option<Arc<Shards>>,
    /// The files that belong to this run.
    used: BTreeSet<String>,
    /// What pilots have chosen, by the file of the unit that it is for.
    chosen: BTreeMap<String, Value>,
    pace: Pace,
}

impl States {
    /// Those in the folder of a run's results, saved after every so many seconds of work; every 30 s or so if None.
    pub fn open(results: &Path, every: Option<f64>) -> Self {
        let folder = results.join(FOLDER);
        let chosen = scenes::file::read(&folder.join(CHOSEN)).ok().and_then(|text| serde_json::from_slice(&text).ok());
        let (used, chosen) = (BTreeSet::new(), chosen.unwrap_or_default());
        Self { folder, keeping: Keeping::All, shards: None, used, chosen, pace: Pace::new(every) }
    }

    /// Those that finished results were made from: all has been rendered, and is read again.
    ///
    /// A state of a unit is found by the unit's name alone, since another build of the program may have rendered it.
    pub fn finished(results: &Path) -> Self {
        let mut states = Self::open(results, None);
        states.keeping = Keeping::Finished;
        states
    }

    /// None at all: for runs that leave nothing behind.
    pub fn none() -> Self {
        let (used, chosen) = (BTreeSet::new(), BTreeMap::new());
        Self { folder: PathBuf::new(), keeping: Keeping::Nothing, shards: None, used, chosen, pace: Pace::new(None) }
    }

    /// None, for a run whose replicates have been rendered apart.
    pub fn of_shards(shards: Shards) -> Self {
        let mut states = Self::none();
        states.shards = Some(Arc::new(shards));
        states
    }

    /// Where replicates are taken from, if they have been rendered apart.
    pub fn shards(&self) -> Option<Arc<Shards>> {
        self.shards.clone()
    }

    /// Whether the folder of states among results holds nothing else, if it is there.
    pub fn are_alone(results: &Path) -> bool {
        let entries = fs::read_dir(results.join(FOLDER));
        entries.map_or(true, |entries| entries.flatten().all(|entry| is_ours(&entry.file_name().to_string_lossy())))
    }

    /// What an unfinished run in a folder of results was asked for, if there is one.
    pub fn begun(results: &Path) -> Option<Manifest> {
        Some(manifest::read_manifest(&results.join(FOLDER).join(BEGUN))?.manifest)
    }

    /// Makes the folder, where it is missing, and removes what was left half-written.
    ///
    /// # Errors
    /// If that is not possible.
    pub fn create(&self) -> Result<(), Error> {
        fs::create_dir_all(&self.folder).map_err(|source| self.failed("write", &self.folder, source))?;
        self.remove(|name| name.ends_with(".tmp"))
    }

    /// Forgets what is there.
    ///
    /// # Errors
    /// If a file cannot be removed.
    pub fn clear(&mut self) -> Result<(), Error> {
        self.chosen.clear();
        self.remove(|_| true)
    }

    /// Notes what this run is asked for, until it is complete.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn begin(&self, manifest: &Manifest) -> Result<(), Error> {
        Ok(manifest::write_manifest(&self.folder.join(BEGUN), manifest, Vec::new())?)
    }

    /// After a complete run, removes all that belongs to others.
    ///
    /// # Errors
    /// If a file cannot be removed.
    pub fn end(mut self) -> Result<(), Error> {
        let used = std::mem::take(&mut self.used);
        self.chosen.retain(|file, _| used.contains(file));
        self.write_chosen()?;
        self.remove(|name| !used.contains(name) && name != CHOSEN)
    }

    /// Removes those of our files that are `unwanted`.
    fn remove(&self, unwanted: impl Fn(&str) -> bool) -> Result<(), Error> {
        for entry in fs::read_dir(&self.folder).map_err(|source| self.failed("read", &self.folder, source))?.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if is_ours(&name) && unwanted(&name) {
                fs::remove_file(entry.path()).map_err(|source| self.failed("remove", &entry.path(), source))?;
            }
        }
        Ok(())
    }

    /// Complete replicates of a unit, if there is a state of it.
    pub fn replicates(&self, unit: &Unit) -> Option<u32> {
        if self.keeping != Keeping::All {
            return None;
        }
        let mut file = File::open(self.folder.join(&unit.file)).ok()?;
        read_head(&mut file, Some(&unit.key)).ok()
    }

    /// Takes up the state of a unit, if there is one. A damaged one is set aside, and its unit rendered anew.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn load<T>(
        &mut self,
        unit: &Unit,
        read: impl FnOnce(&mut dyn Read) -> io::Result<T>,
    ) -> Result<Option<T>, Error> {
        match self.keeping {
            Keeping::All => {}
            Keeping::Finished => return self.load_finished(unit, read).map(Some),
            Keeping::Nothing => return Ok(None),
        }
        self.used.insert(unit.file.clone());
        let path = self.folder.join(&unit.file);
        match read_state(&path, Some(&unit.key), read) {
            Ok(state) => Ok(Some(state)),
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(e) if [io::ErrorKind::InvalidData, io::ErrorKind::UnexpectedEof].contains(&e.kind()) => {
                let aside = path.with_extension("state.damaged");
                fs::rename(&path, &aside).map_err(|source| self.failed("rename", &path, source))?;
                let (path, aside) = (path.display(), aside.display());
                tell!("warning: {path} is damaged ({e}): it is set aside as {aside}, and its work done anew");
                Ok(None)
            }
            Err(source) => Err(self.failed("read", &path, source)),
        }
    }

    /// The state of a unit of finished results.
    fn load_finished<T>(&self, unit: &Unit, read: impl FnOnce(&mut dyn Read) -> io::Result<T>) -> Result<T, Error> {
        let files = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let own = |entry: fs::DirEntry| unit.is_of(&entry.file_name().to_string_lossy()).then(|| entry.path());
        let Some(path) = files.filter_map(own).next() else { return Err(self.lacks(&unit.name)) };
        read_state(&path, None, read).map_err(|source| Error::Io { action: "read", path, source, mend: AGAIN })
    }

    /// Refuses to render where results are finished.
    ///
    /// # Errors
    /// If they are, with what they lack.
    pub fn check_renders(&self, what: &str) -> Result<(), Error> {
        if self.keeping == Keeping::Finished { Err(self.lacks(what)) } else { Ok(()) }
    }

    fn lacks(&self, what: &str) -> Error {
        Error::usage(format!("{} lacks what was rendered of {what}; {AGAIN}", self.folder.display()))
    }

    /// Saves the state of a unit that has so many complete replicates.
    ///
    /// # Errors
    /// If it cannot be written; the state before is intact then.
    pub fn save(
        &mut self,
        unit: &Unit,
        replicates: u32,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), Error> {
        if self.keeping != Keeping::All {
            return Ok(());
        }
        let start = Instant::now();
        let path = self.folder.join(&unit.file);
        let written = write_streamed(&path, |file| file::write_state(file, (&unit.key, replicates), write));
        written.map_err(|source| self.failed("write", &path, source))?;
        self.pace.saved(start.elapsed().as_secs_f64());
        Ok(())
    }

    /// Whether it is time to save what has been rendered, after so many more seconds of work.
    pub fn due(&mut self, seconds: f64) -> bool {
        self.keeping == Keeping::All && self.pace.due(seconds)
    }

    /// What a pilot has chosen for a unit, such as the samples of a replicate; if none has, what `pilot` chooses now.
    ///
    /// # Errors
    /// Those of the pilot, and if its choice cannot be written.
    pub fn chosen<T: Serialize + DeserializeOwned>(
        &mut self,
        unit: &Unit,
        pilot: impl FnOnce() -> Result<T, Error>,
    ) -> Result<T, Error> {
        if self.keeping == Keeping::Nothing {
            return pilot();
        }
        self.used.insert(unit.file.clone());
        let finished = self.keeping == Keeping::Finished;
        let mut kept =
            self.chosen.iter().filter(|(file, _)| if finished { unit.is_of(file) } else { **file == unit.file });
        let kept = kept.next().map(|(_, kept)| kept.clone());
        if let Some(chosen) = kept.and_then(|kept| serde_json::from_value(kept).ok()) {
            return Ok(chosen);
        }
        self.check_renders(&unit.name)?;
        let chosen = pilot()?;
        self.chosen.insert(unit.file.clone(), serde_json::to_value(&chosen).unwrap_or_default());
        self.write_chosen()?;
        Ok(chosen)
    }

    fn write_chosen(&self) -> Result<(), Error> {
        let path = self.folder.join(CHOSEN);
        if self.chosen.is_empty() {
            return match fs::remove_file(&path) {
                Err(e) if e.kind() != io::ErrorKind::NotFound => Err(self.failed("remove", &path, e)),
                _ => Ok(()),
            };
        }
        let text = serde_json::to_string_pretty(&self.chosen).unwrap_or_default() + "\n";
        Ok(write_atomically(&path, text.as_bytes())?)
    }

    /// Whether the folder holds work.
    fn hold_work(&self) -> bool {
        let kept = |entry: fs::DirEntry| entry.file_name().to_string_lossy() != BEGUN;
        fs::read_dir(&self.folder).is_ok_and(|entries| entries.flatten().any(kept))
    }

    fn failed(&self, action: &'static str, path: &Path, source: io::Error) -> Error {
        Error::Io { action, path: path.to_owned(), source, mend: MEND }
    }
}

/// Whether a file in the folder of states is of that name because we made it.
fn is_ours(name: &str) -> bool {
    name == BEGUN || name == CHOSEN || [".state", ".damaged", ".tmp"].iter().any(|end| name.ends_with(end))
}

impl Drop for States {
    /// Removes a folder in which no work was saved.
    fn drop(&mut self) {
        if self.keeping == Keeping::All && !self.hold_work() {
            // What cannot be removed does no harm.
            let _ = fs::remove_file(self.folder.join(BEGUN));
            let _ = fs::remove_dir(&self.folder);
        }
    }
}

#[cfg(test)]
mod tests;
