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
//! | … | what [`Stored`] writes of the unit |
//! | 32 | BLAKE3 of all the bytes before |
//!
//! A file is written beside its place, flushed to the disk and renamed, so that whatever ends the program leaves the old or the new
//! one.

use crate::error::Error;
use crate::export::{write_atomically, write_streamed};
use crate::machine::{VERSION, machine};
use crate::manifest;
use crate::plan::{PlannedMethod, PlannedScene};
use crate::program::program;
use crate::result::Manifest;
use crate::shards::Shards;
use integrators::state::{Stored, damaged};
use integrators::{PartSettings, RenderSettings, Window};
use pace::Pace;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

mod pace;

/// The folder of the states, in that of the results.
pub const FOLDER: &str = "state";
/// What the run at work was asked for.
const BEGUN: &str = "run.json";
/// The samples that pilots chose.
const CHOSEN: &str = "budget.json";
const HEAD: &[u8; 16] = b"neumann state 1\n";
const HASH: usize = blake3::OUT_LEN;
/// Bytes that are hashed, read and written at once.
const BUFFER: usize = 1 << 20;
const MEND: &str =
    "make room there, or let it be written; the same command, without --fresh, then goes on from the last state";

/// What a state is of: its file's name, and the hash of all that its numbers follow from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unit {
    file: String,
    key: blake3::Hash,
}

impl Unit {
    /// A unit of work of this name, whose numbers follow from this program and `origin`.
    pub fn new(name: &str, origin: &str) -> Self {
        let machine = machine(0);
        let key = format!("{VERSION} {:?}\n{} {}\n{name}\n{origin}", program(), machine.platform, machine.kernels);
        let key = blake3::hash(key.as_bytes());
        Self { file: format!("{name}-{}.state", &key.to_hex()[..8]), key }
    }

    /// A method at work in a scene whose camera has its size by now, to make `what` of it: images taken apart like this, or a
    /// checkpoint's. What is noted of them follows from `judged_by` too.
    pub fn of_render(
        scene: &PlannedScene,
        planned: &PlannedMethod,
        settings: &RenderSettings,
        parts: &PartSettings,
        (what, judged_by): (&str, &str),
    ) -> Self {
        let origin = format!("{}\n{judged_by}", origin(scene, planned, settings, parts));
        let name = format!("{}-{}-{what}", scene.name, planned.label);
        Self::new(&name, &origin)
    }

    /// The hash of all that its numbers follow from.
    pub fn key(&self) -> String {
        self.key.to_hex().to_string()
    }
}

/// All that the images of a method in a scene follow from, the program apart.
pub fn origin(
    scene: &PlannedScene,
    planned: &PlannedMethod,
    settings: &RenderSettings,
    parts: &PartSettings,
) -> String {
    // The scene's hash knows nothing of its pixels.
    let (width, height) = (scene.scene.camera.width(), scene.scene.camera.height());
    let pixels = format!("{width}x{height} {:?}", Window::of(&scene.scene));
    let method = format!("{} {}", planned.method.name(), planned.method.settings());
    format!("{} {pixels}\n{method}\n{settings:?}\n{parts:?}", scene.scene.hash)
}

/// The states of a run.
pub struct States {
    folder: PathBuf,
    /// Whether anything is kept.
    kept: bool,
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
        Self { folder, kept: true, shards: None, used, chosen, pace: Pace::new(every) }
    }

    /// None at all: for runs that leave nothing behind.
    pub fn none() -> Self {
        let (used, chosen) = (BTreeSet::new(), BTreeMap::new());
        Self { folder: PathBuf::new(), kept: false, shards: None, used, chosen, pace: Pace::new(None) }
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
        if !self.kept {
            return None;
        }
        let mut file = File::open(self.folder.join(&unit.file)).ok()?;
        read_head(&mut file, unit).ok()
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
        if !self.kept {
            return Ok(None);
        }
        self.used.insert(unit.file.clone());
        let path = self.folder.join(&unit.file);
        match read_state(&path, unit, read) {
            Ok(state) => Ok(Some(state)),
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(e) if [io::ErrorKind::InvalidData, io::ErrorKind::UnexpectedEof].contains(&e.kind()) => {
                let aside = path.with_extension("state.damaged");
                fs::rename(&path, &aside).map_err(|source| self.failed("rename", &path, source))?;
                let (path, aside) = (path.display(), aside.display());
                eprintln!("warning: {path} is damaged ({e}): it is set aside as {aside}, and its work done anew");
                Ok(None)
            }
            Err(source) => Err(self.failed("read", &path, source)),
        }
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
        if !self.kept {
            return Ok(());
        }
        let start = Instant::now();
        let path = self.folder.join(&unit.file);
        let written = write_streamed(&path, |file| {
            let mut body = BufWriter::with_capacity(BUFFER, Hashed { inner: file, hasher: blake3::Hasher::new() });
            body.write_all(HEAD)?;
            body.write_all(unit.key.as_bytes())?;
            replicates.write(&mut body)?;
            write(&mut body)?;
            let Hashed { inner, hasher } = body.into_inner()?;
            inner.write_all(hasher.finalize().as_bytes())
        });
        written.map_err(|source| self.failed("write", &path, source))?;
        self.pace.saved(start.elapsed().as_secs_f64());
        Ok(())
    }

    /// Whether it is time to save what has been rendered, after so many more seconds of work.
    pub fn due(&mut self, seconds: f64) -> bool {
        self.kept && self.pace.due(seconds)
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
        if !self.kept {
            return pilot();
        }
        self.used.insert(unit.file.clone());
        let kept = self.chosen.get(&unit.file).cloned();
        if let Some(chosen) = kept.and_then(|kept| serde_json::from_value(kept).ok()) {
            return Ok(chosen);
        }
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
        if self.kept && !self.hold_work() {
            // What cannot be removed does no harm.
            let _ = fs::remove_file(self.folder.join(BEGUN));
            let _ = fs::remove_dir(&self.folder);
        }
    }
}

/// Reads a state, once all of its bytes have been found to be what was written.
fn read_state<T>(path: &Path, unit: &Unit, read: impl FnOnce(&mut dyn Read) -> io::Result<T>) -> io::Result<T> {
    let file = File::open(path)?;
    let length = file.metadata()?.len().checked_sub(HASH as u64).ok_or_else(|| damaged("it ends too early"))?;
    let mut hasher = blake3::Hasher::new();
    io::copy(&mut (&file).take(length), &mut hasher)?;
    let mut hash = [0; HASH];
    (&file).read_exact(&mut hash)?;
    if hasher.finalize() != blake3::Hash::from_bytes(hash) {
        return Err(damaged("its hash does not fit its bytes"));
    }
    let mut body = BufReader::with_capacity(BUFFER, File::open(path)?).take(length);
    read_head(&mut body, unit)?;
    let state = read(&mut body)?;
    match body.limit() {
        0 => Ok(state),
        _ => Err(damaged("it is longer than it should be")),
    }
}

/// Reads what stands before a unit's own bytes; gives the number of replicates.
fn read_head(from: &mut dyn Read, unit: &Unit) -> io::Result<u32> {
    let (mut head, mut key) = ([0; HEAD.len()], [0; HASH]);
    from.read_exact(&mut head)?;
    from.read_exact(&mut key)?;
    if head != *HEAD || key != *unit.key.as_bytes() {
        return Err(damaged("it is no state of this format and key"));
    }
    u32::read(from)
}

/// Passes bytes on, and hashes them.
struct Hashed<'a> {
    inner: &'a mut File,
    hasher: blake3::Hasher,
}

impl Write for Hashed<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.hasher.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

#[cfg(test)]
mod tests;
