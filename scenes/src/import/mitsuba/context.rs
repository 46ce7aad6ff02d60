//! What a translation knows while it goes on: who is referred to by which name, where files are, and what is written so far.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::xml::{Element, Xml};
use crate::error::SceneError;
use crate::import::ledger::{Meshes, Missing, Names, Nesting};
use crate::import::obj::Model;
use crate::import::translation::{Lines, MEMBER, NoteKind, Notes, Place, SHAPE, named_from};
use crate::suggest::did_you_mean;

/// What an integrator counts towards its `max_depth`.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Counted {
    /// Every surface that a path meets.
    Surfaces,
    /// Those where light is turned.
    Turns,
}

/// The state of a translation.
pub struct Context<'a> {
    /// The elements that have an `id`, by it.
    ids: BTreeMap<&'a str, &'a Element>,
    folders: &'a [PathBuf],
    /// Where paths start that the text names.
    base: PathBuf,
    /// The camera, once it is found.
    pub camera: Option<Lines>,
    /// What counts towards the end of the series, if it ends.
    pub counted: Option<Counted>,
    /// Where the first mask is.
    pub mask: Option<Place>,
    /// Where the first `null` is.
    pub null: Option<Place>,
    /// The material of shapes that are nothing but borders of media, once it is written.
    pub null_name: Option<String>,
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
    /// The OBJ whose parts are being written.
    pub parted: Option<(PathBuf, Model)>,
    /// Files that are not there.
    missing: Missing,
    /// The materials written, by their element and by whether v runs the other way.
    pub material_names: BTreeMap<(*const Element, bool), String>,
    /// How many textures have been read that need texture coordinates.
    pub uv_textures: usize,
    /// The materials written that do.
    pub mapped_materials: BTreeSet<String>,
    taken: Names,
    nesting: Nesting,
    /// Whether there is an environment.
    pub has_environment: bool,
    /// The groups that are written so far.
    pub groups: Lines,
    /// What they are called, by their element; `None` where nothing is left of one.
    pub group_names: BTreeMap<*const Element, Option<String>>,
    /// How shapes begin that are written now: [`SHAPE`] or [`MEMBER`].
    pub header: &'static str,
}

impl<'a> Context<'a> {
    /// Before anything is written.
    pub fn new(xml: &'a Xml, base: &Path, stem: &str) -> Result<Self, SceneError> {
        let mut context = Self {
            ids: BTreeMap::new(),
            folders: &xml.folders,
            base: base.to_path_buf(),
            camera: None,
            counted: None,
            mask: None,
            null: None,
            null_name: None,
            materials: Lines::default(),
            shapes: Lines::default(),
            emitters: Lines::default(),
            notes: Notes::default(),
            meshes: Meshes::new(stem),
            parted: None,
            missing: Missing::default(),
            material_names: BTreeMap::new(),
            uv_textures: 0,
            mapped_materials: BTreeSet::new(),
            taken: Names::default(),
            nesting: Nesting::default(),
            has_environment: false,
            groups: Lines::default(),
            group_names: BTreeMap::new(),
            header: SHAPE,
        };
        context.fresh_name(super::bsdf::BLACK);
        context.collect_ids(&xml.root)?;
        Ok(context)
    }

    fn collect_ids(&mut self, element: &'a Element) -> Result<(), SceneError> {
        for child in &element.children {
            match child.tag.as_str() {
                "ref" => {}
                "alias" => {
                    let (id, new) = (child.attribute("id"), child.attribute("as"));
                    let (Some(id), Some(new)) = (id, new) else {
                        return Err(child.place.error("`alias` lacks its `id` or `as`", "give both"));
                    };
                    self.ids.insert(new, self.by_id(id, &child.place)?);
                }
                _ => {
                    if let Some(id) = child.attribute("id")
                        && let Some(first) = self.ids.insert(id, child)
                    {
                        let message = format!("there are two elements `{id}`, the first at line {}", first.place.line);
                        return Err(child.place.error(message, "give one of them another `id`"));
                    }
                    self.collect_ids(child)?;
                }
            }
        }
        Ok(())
    }

    fn by_id(&self, id: &str, place: &Place) -> Result<&'a Element, SceneError> {
        let found = self.ids.get(id).copied();
        found.ok_or_else(|| {
            let names: Vec<&str> = self.ids.keys().copied().collect();
            place.error(format!("there is no element `{id}` to refer to"), did_you_mean(id, &names))
        })
    }

    /// The element itself, or what it refers to.
    pub fn resolved(&self, element: &'a Element) -> Result<&'a Element, SceneError> {
        if element.tag != "ref" {
            return Ok(element);
        }
        match element.attribute("id") {
            Some(id) => self.by_id(id, &element.place),
            None => Err(element.place.error("`ref` lacks its `id`", "name an element")),
        }
    }

    /// Begins to read a thing that may refer to others of its kind: none may contain itself, or be repeated without end.
    pub fn enter(&mut self, element: &Element) -> Result<(), SceneError> {
        self.nesting.enter(|| element.title(), &element.place)
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
    pub fn mapped(&mut self, element: &Element, what: &str) {
        self.note(NoteKind::Mapped, &element.place, format!("`{} {}` becomes {what}", element.tag, element.kind()));
    }

    /// Whether the shapes that are written now are those of a group.
    pub fn in_group(&self) -> bool {
        self.header == MEMBER
    }

    /// A name for a material or a group that no other has.
    pub fn fresh_name(&mut self, wanted: &str) -> String {
        self.taken.fresh(wanted)
    }

    /// Where a file is; `None`, and it is told later, where it is nowhere.
    pub fn find(&mut self, name: &str, place: &Place) -> Option<PathBuf> {
        let plain = name.replace('\\', "/");
        for name in [name, &plain] {
            let found = self.folders.iter().map(|folder| folder.join(name)).find(|path| path.is_file());
            if found.is_some() {
                return found;
            }
        }
        self.missing.add(name, place);
        None
    }

    /// How the text names a file.
    pub fn named_from_base(&self, path: &Path) -> String {
        named_from(path, &self.base)
    }

    /// Tells of all files that were not found, in one error.
    pub fn check_files(&self) -> Result<(), SceneError> {
        let folders: Vec<String> = self.folders.iter().map(|folder| shown(folder)).collect();
        self.missing.check(&folders.join(", "))
    }
}

fn shown(folder: &Path) -> String {
    if folder.as_os_str().is_empty() { ".".to_string() } else { folder.display().to_string() }
}
