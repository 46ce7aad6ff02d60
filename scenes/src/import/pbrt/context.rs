//! What a translation knows while it goes on: what has which name, where files are, and what is written so far.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::parameters::Parameters;
use super::sensor::Sensor;
use crate::error::SceneError;
use crate::import::ledger::{Meshes, Missing, Names, Nesting};
use crate::import::translation::{Lines, NoteKind, Notes, Place, named_from};

/// The state of a translation.
pub struct Context {
    /// The folder of the scene's own file.
    folder: PathBuf,
    /// Where paths start that the text names.
    base: PathBuf,
    /// What is written so far.
    pub materials: Lines,
    /// What is written so far.
    pub shapes: Lines,
    /// What is written so far.
    pub emitters: Lines,
    /// What is to be told.
    pub notes: Notes,
    /// Meshes without a file.
    pub meshes: Meshes,
    missing: Missing,
    /// Textures of numbers, by name.
    pub float_textures: BTreeMap<String, Rc<Parameters>>,
    /// Textures of colours, by name.
    pub colour_textures: BTreeMap<String, Rc<Parameters>>,
    /// Materials by name.
    pub named_materials: BTreeMap<String, Rc<Parameters>>,
    /// How many textures have been read that need texture coordinates.
    pub uv_textures: usize,
    /// The materials written that do.
    pub mapped_materials: BTreeSet<String>,
    /// Materials written, by what they are and by their mask.
    pub written: BTreeMap<(String, String), String>,
    taken: Names,
    nesting: Nesting,
    /// Whether there is an environment.
    pub has_environment: bool,
    /// The first surface that light passes as if it were not there.
    pub interface: Option<Place>,
    /// What the film's sensor makes of light.
    pub sensor: Sensor,
}

impl Context {
    /// Before anything is written.
    pub fn new(path: &Path, base: &Path, stem: &str) -> Self {
        Self {
            folder: path.parent().unwrap_or(Path::new("")).to_path_buf(),
            base: base.to_path_buf(),
            materials: Lines::default(),
            shapes: Lines::default(),
            emitters: Lines::default(),
            notes: Notes::default(),
            meshes: Meshes::new(stem),
            missing: Missing::default(),
            float_textures: BTreeMap::new(),
            colour_textures: BTreeMap::new(),
            named_materials: BTreeMap::new(),
            uv_textures: 0,
            mapped_materials: BTreeSet::new(),
            written: BTreeMap::new(),
            taken: Names::default(),
            nesting: Nesting::default(),
            has_environment: false,
            interface: None,
            sensor: Sensor::PLAIN,
        }
    }

    /// Begins to read a thing that may refer to others of its kind: none may contain itself, or be repeated without end.
    pub fn enter(&mut self, parameters: &Parameters) -> Result<(), SceneError> {
        self.nesting.enter(|| parameters.title(), &parameters.place)
    }

    /// Ends what [`enter`](Self::enter) began.
    pub fn leave(&mut self) {
        self.nesting.leave();
    }

    /// Notes something.
    pub fn note(&mut self, kind: NoteKind, place: &Place, text: impl Into<String>) {
        self.notes.add(kind, place, text);
    }

    /// Notes that something is not quite the same.
    pub fn approximate(&mut self, place: &Place, text: impl Into<String>) {
        self.note(NoteKind::Approximated, place, text);
    }

    /// Notes what became of something.
    pub fn mapped(&mut self, parameters: &Parameters, what: &str) {
        let text = format!("{} becomes {what}", parameters.title());
        self.note(NoteKind::Mapped, &parameters.place, text);
    }

    /// A name for a material that no other has.
    pub fn fresh_name(&mut self, wanted: &str) -> String {
        self.taken.fresh(wanted)
    }

    /// Where a file is, from the folder of the file that names it or from the scene's; `None`, and it is told later, where it is
    /// nowhere.
    pub fn find(&mut self, name: &str, place: &Place) -> Option<PathBuf> {
        let own = place.file.parent().unwrap_or(Path::new("")).to_path_buf();
        let plain = name.replace('\\', "/");
        for name in [name, plain.as_str()] {
            for folder in [&own, &self.folder] {
                let path = folder.join(name);
                if !name.contains('\0') && path.is_file() {
                    return Some(path);
                }
            }
        }
        self.missing.add(name, place);
        None
    }

    /// How the text names a file, which is missed if it is nowhere.
    pub fn file_name(&mut self, name: &str, place: &Place) -> String {
        match self.find(name, place) {
            Some(path) => self.named_from_base(&path),
            None => name.to_string(),
        }
    }

    /// How the text names a file.
    pub fn named_from_base(&self, path: &Path) -> String {
        named_from(path, &self.base)
    }

    /// Tells of all files that were not found, in one error.
    pub fn check_files(&self) -> Result<(), SceneError> {
        let folder = if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder };
        self.missing.check(&folder.display().to_string())
    }
}

/// A path without its folder.
pub fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
