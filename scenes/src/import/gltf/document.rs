//! The JSON of a file: lists of objects that are read one by one, each with its line.

use std::borrow::Cow;
use std::cell::Cell;
use std::path::Path;
use std::sync::Arc;

use serde::Deserialize;
use serde_json::value::RawValue;

use super::keys::{self, Unknown};
use super::schema::{Kind, Root};
use crate::error::SceneError;
use crate::import::translation::Place;
use crate::suggest::shown;

/// How many bytes are read in all: what is small may be named often, and what is large rarely.
const MOST_WORK: usize = 1 << 32;

/// A file's JSON.
pub struct Document<'t> {
    file: Arc<Path>,
    text: &'t str,
    /// Where lines begin.
    lines: Vec<usize>,
    /// The lists and what stands beside them.
    pub root: Root<'t>,
    /// How many bytes have been read so far.
    work: Cell<usize>,
}

/// An object of the file.
#[derive(Clone, Copy)]
pub struct Item<'t> {
    raw: &'t RawValue,
    kind: Kind,
    index: usize,
}

impl<'t> Document<'t> {
    /// Reads the text of the file at `path`, but none of the objects of its lists.
    pub fn read(path: &Path, text: &'t str) -> Result<Self, SceneError> {
        let file: Arc<Path> = path.into();
        let lines = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        let root = serde_json::from_str(text).map_err(|error| {
            let (line, column) = (error.line().max(1), error.column());
            let message = format!("the JSON is not glTF 2.0: {} (column {column})", plain(&error));
            Place { file: file.clone(), line }.error(message, "mend it there, or export the file again")
        })?;
        Ok(Self { file, text, lines, root, work: Cell::new(0) })
    }

    /// The file as a whole.
    pub fn place(&self) -> Place {
        Place { file: self.file.clone(), line: 1 }
    }

    /// The object of this number in the list of its kind; `by` is who names it.
    pub fn item(&self, kind: Kind, index: usize, by: &Item) -> Result<Item<'t>, SceneError> {
        let list = self.root.list(kind);
        if let Some(raw) = list.get(index) {
            return Ok(Item { raw, kind, index });
        }
        let mend = match list.len() {
            0 => "the file has none".to_string(),
            n => format!("the file has {n}, counted from 0"),
        };
        Err(self.error(by, format!("names {} {index}, which is not there", kind.name()), mend))
    }

    /// All objects of a kind.
    pub fn all(&self, kind: Kind) -> impl Iterator<Item = Item<'t>> + use<'t> {
        let list: Vec<&'t RawValue> = self.root.list(kind).to_vec();
        list.into_iter().enumerate().map(move |(index, raw)| Item { raw, kind, index })
    }

    /// What an object says.
    pub fn parse<T: Deserialize<'t>>(&self, item: &Item<'t>) -> Result<T, SceneError> {
        self.parse_part(item, item.raw, &item.title())
    }

    /// What a part of an object says, which messages call `title`.
    pub fn parse_part<T: Deserialize<'t>>(
        &self,
        item: &Item<'t>,
        raw: &'t RawValue,
        title: &str,
    ) -> Result<T, SceneError> {
        self.spend(item, raw.get().len())?;
        serde_json::from_str(raw.get()).map_err(|error| {
            let mut place = self.place_of(raw);
            let ends = self.lines.len();
            place.line = (place.line + error.line().saturating_sub(1)).min(ends);
            let message = format!("{title} cannot be read: {}", plain(&error));
            place.error(message, format!("write {} as glTF 2.0 has it", item.kind.name()))
        })
    }

    /// Counts bytes that are read because of an object, and refuses files that name large ones over and over.
    pub fn spend(&self, item: &Item, bytes: usize) -> Result<(), SceneError> {
        self.work.set(self.work.get().saturating_add(bytes));
        if self.work.get() <= MOST_WORK {
            return Ok(());
        }
        let message = format!("is one read too many: {MOST_WORK} bytes have been read, most of them again and again");
        Err(self.error(item, message, "let large parts be named less often"))
    }

    /// The names in it that are not known, each with its place.
    pub fn unknown(&self) -> impl Iterator<Item = (Place, Unknown<'t>)> {
        keys::unknown(self.text).into_iter().map(|unknown| match unknown.key {
            Cow::Borrowed(key) => (self.place_in_text(key), unknown),
            Cow::Owned(_) => (self.place(), unknown),
        })
    }

    /// Where an object begins.
    pub fn place_of(&self, raw: &RawValue) -> Place {
        self.place_in_text(raw.get())
    }

    /// Where a part of the text begins.
    fn place_in_text(&self, part: &str) -> Place {
        let offset = (part.as_ptr() as usize).saturating_sub(self.text.as_ptr() as usize);
        let line = self.lines.partition_point(|&begin| begin <= offset).max(1);
        Place { file: self.file.clone(), line }
    }

    /// Where an object begins.
    pub fn place_of_item(&self, item: &Item) -> Place {
        self.place_of(item.raw)
    }

    /// An error about an object: `message` goes on after its title.
    pub fn error(&self, item: &Item, message: impl AsRef<str>, mend: impl Into<String>) -> SceneError {
        self.place_of_item(item).error(format!("{} {}", item.title(), message.as_ref()), mend)
    }
}

impl Item<'_> {
    /// Its number in its list.
    pub fn index(&self) -> usize {
        self.index
    }

    /// Its name, if it has one.
    pub fn name(&self) -> Option<String> {
        #[derive(Deserialize)]
        struct Named {
            name: Option<String>,
        }
        serde_json::from_str::<Named>(self.raw.get()).ok()?.name.filter(|name| !name.is_empty())
    }

    /// What messages call it: its kind, number and name.
    pub fn title(&self) -> String {
        let (kind, index) = (self.kind.name(), self.index);
        match self.name() {
            Some(name) => format!("{kind} {index} (`{}`)", shown(&name)),
            None => format!("{kind} {index}"),
        }
    }
}

/// What serde_json says, without its place.
fn plain(error: &serde_json::Error) -> String {
    let text = error.to_string();
    let end = text.rfind(" at line ").unwrap_or(text.len());
    text[..end].to_string()
}
