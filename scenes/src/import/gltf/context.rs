//! What a translation knows while it goes on: what is written so far, and what has which name.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::buffers::Asset;
use super::image::Facts;
use super::material::{Form, Written};
use super::primitive::Piece;
use crate::import::ledger::Names;
use crate::import::translation::{Attachment, Lines, NoteKind, Notes, Place, named_from};

/// The state of a translation.
pub struct Context<'a, 't> {
    /// What is translated.
    pub asset: &'a Asset<'t>,
    /// Where paths start that the text names.
    base: PathBuf,
    /// How attachments are called, but for their kind and number.
    stem: String,
    /// What is written so far.
    pub materials: Lines,
    /// What is written so far.
    pub shapes: Lines,
    /// What is written so far.
    pub emitters: Lines,
    /// What is to be told.
    pub notes: Notes,
    /// Meshes and images without a file.
    pub attachments: Vec<Attachment>,
    taken: Names,
    /// What images are called, by their number.
    pub images: HashMap<usize, String>,
    /// What embedded images are called, by where their bytes begin and how many they are.
    pub embedded: HashMap<(usize, usize), String>,
    /// What is known of images, by their names.
    pub facts: HashMap<String, Rc<Facts>>,
    /// What images with other texels are called, by their names and what was done to them.
    pub repainted: HashMap<(String, String), String>,
    /// Materials written, by their number and what the mesh has.
    pub written: HashMap<(Option<usize>, Form), Rc<Written>>,
    /// The parts of meshes that are written, by the mesh's number.
    pub pieces: HashMap<usize, Vec<Rc<Piece>>>,
    /// Whether anything emits.
    pub emits: bool,
}

impl<'a, 't> Context<'a, 't> {
    /// Before anything is written.
    pub fn new(asset: &'a Asset<'t>, base: &Path, stem: &str) -> Self {
        Self {
            asset,
            base: base.to_path_buf(),
            stem: stem.to_string(),
            materials: Lines::default(),
            shapes: Lines::default(),
            emitters: Lines::default(),
            notes: Notes::default(),
            attachments: Vec::new(),
            taken: Names::default(),
            images: HashMap::new(),
            embedded: HashMap::new(),
            facts: HashMap::new(),
            repainted: HashMap::new(),
            written: HashMap::new(),
            pieces: HashMap::new(),
            emits: false,
        }
    }

    /// Notes something that changes no light.
    pub fn ignore(&mut self, place: &Place, text: impl Into<String>) {
        self.notes.add(NoteKind::Ignored, place, text);
    }

    /// Notes that something is not quite the same.
    pub fn approximate(&mut self, place: &Place, text: impl Into<String>) {
        self.notes.add(NoteKind::Approximated, place, text);
    }

    /// Notes what became of something.
    pub fn mapped(&mut self, place: &Place, text: impl Into<String>) {
        self.notes.add(NoteKind::Mapped, place, text);
    }

    /// A name for a material that no other has.
    pub fn fresh_name(&mut self, wanted: &str) -> String {
        self.taken.fresh(wanted)
    }

    /// How the text names a file.
    pub fn named_from_base(&self, path: &Path) -> String {
        named_from(path, &self.base)
    }

    /// Keeps what has no file, and returns its name.
    pub fn attach(&mut self, kind: &str, ending: &str, bytes: Vec<u8>) -> String {
        let name = format!("{}_{kind}{:03}.{ending}", self.stem, self.attachments.len() + 1);
        self.attachments.push(Attachment { name: name.clone(), bytes });
        name
    }
}
