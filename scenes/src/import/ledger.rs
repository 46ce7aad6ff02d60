//! What importers keep account of while they translate: names that are taken, files that are nowhere, meshes without a file, references.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::hash::{DefaultHasher, Hash, Hasher};

use super::translation::{Attachment, Place};
use crate::error::SceneError;
use crate::suggest::shown;

/// The most missing files that an error lists.
const MOST_LISTED: usize = 20;

/// The most things of a kind that refer to one another in turn.
const MAX_NESTING: usize = 32;
/// The most references that are followed.
const MAX_VISITS: usize = 4_000_000;

/// Things that refer to others of their kind, while they are read.
#[derive(Clone, Copy, Debug, Default)]
pub struct Nesting {
    /// How many are being read, each for the sake of the one before.
    depth: usize,
    /// How many have been read, each as often as it was referred to.
    visits: usize,
}

impl Nesting {
    /// Begins to read one of them: none may contain itself, or be repeated without end.
    pub fn enter(&mut self, title: impl FnOnce() -> String, place: &Place) -> Result<(), SceneError> {
        (self.depth, self.visits) = (self.depth + 1, self.visits + 1);
        if self.depth > MAX_NESTING {
            let message = format!("{} contains itself, or more than {MAX_NESTING} others", title());
            return Err(place.error(message, "take one of the references out"));
        }
        if self.visits > MAX_VISITS {
            let message = format!("more than {MAX_VISITS} materials, textures and shapes are referred to");
            return Err(place.error(message, "let references repeat less"));
        }
        Ok(())
    }

    /// Ends what [`enter`](Self::enter) began.
    pub fn leave(&mut self) {
        self.depth -= 1;
    }
}

/// Names that are taken.
#[derive(Clone, Debug, Default)]
pub struct Names {
    /// By what number the next one that is called so is told apart.
    next: BTreeMap<String, usize>,
}

impl Names {
    /// A name that no other has: the one that is wanted, or that with a number.
    pub fn fresh(&mut self, wanted: &str) -> String {
        let Some(&number) = self.next.get(wanted) else {
            self.next.insert(wanted.to_string(), 2);
            return wanted.to_string();
        };
        // Names are never given back, so that the search goes on where the last one ended.
        let mut number = number;
        let name = loop {
            let name = format!("{wanted}_{number}");
            number += 1;
            if !self.next.contains_key(&name) {
                break name;
            }
        };
        self.next.insert(wanted.to_string(), number);
        self.next.insert(name.clone(), 2);
        name
    }
}

/// Files that are named and are nowhere.
#[derive(Clone, Debug, Default)]
pub struct Missing {
    list: Vec<(Place, String)>,
    known: BTreeSet<String>,
}

impl Missing {
    /// Adds a file, once, and where it is named.
    pub fn add(&mut self, name: &str, place: &Place) {
        if self.known.insert(name.to_string()) {
            self.list.push((place.clone(), name.to_string()));
        }
    }

    /// Tells of all of them in one error; `folders` are those in which they were looked for.
    pub fn check(&self, folders: &str) -> Result<(), SceneError> {
        let Some((place, _)) = self.list.first() else { return Ok(()) };
        let one = |(at, name): &(Place, String)| {
            let name = shown(name);
            if at.file == place.file { format!("`{name}` (line {})", at.line) } else { format!("`{name}` ({at})") }
        };
        let mut shown: Vec<String> = self.list.iter().take(MOST_LISTED).map(one).collect();
        if self.list.len() > MOST_LISTED {
            shown.push(format!("and {} more", self.list.len() - MOST_LISTED));
        }
        let message = match self.list.len() {
            1 => format!("a file is not there: {}", shown[0]),
            n => format!("{n} files are not there: {}", shown.join(", ")),
        };
        Err(place.error(message, format!("they were looked for in {folders}")))
    }
}

/// Meshes that have no file.
#[derive(Clone, Debug, Default)]
pub struct Meshes {
    /// How they are called, but for their number.
    stem: String,
    list: Vec<Attachment>,
    by_hash: HashMap<u64, Vec<usize>>,
}

impl Meshes {
    /// None so far.
    pub fn new(stem: &str) -> Self {
        Self { stem: stem.to_string(), ..Self::default() }
    }

    /// Keeps the text of an OBJ, once, and returns its name.
    pub fn keep(&mut self, text: String) -> String {
        let mut hasher = DefaultHasher::new();
        text.hash(&mut hasher);
        let alike = self.by_hash.entry(hasher.finish()).or_default();
        if let Some(&same) = alike.iter().find(|&&i| self.list[i].bytes == text.as_bytes()) {
            return self.list[same].name.clone();
        }
        alike.push(self.list.len());
        let name = format!("{}_mesh{:03}.obj", self.stem, self.list.len() + 1);
        self.list.push(Attachment { name: name.clone(), bytes: text.into_bytes() });
        name
    }

    /// All of them.
    pub fn all(self) -> Vec<Attachment> {
        self.list
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn names_are_told_apart_by_numbers() {
        let mut names = Names::default();
        let given = ["a", "a_3", "a", "a", "a", "a_2"].map(|wanted| names.fresh(wanted));
        assert_eq!(given, ["a", "a_3", "a_2", "a_4", "a_5", "a_2_2"]);
        // One search for each would take hours.
        assert_eq!((0..300_000).map(|_| names.fresh("b")).last().unwrap(), "b_300000");
    }

    #[test]
    fn files_are_missed_once_and_not_all_are_listed() {
        let mut missing = Missing::default();
        assert!(missing.check(".").is_ok());
        let place = |line| Place { file: Path::new("a.xml").into(), line };
        [3, 5].into_iter().for_each(|line| missing.add("a.obj", &place(line)));
        let told = |missing: &Missing| missing.check(".").unwrap_err().to_string();
        let text = "a.xml:3: a file is not there: `a.obj` (line 3); they were looked for in .";
        assert_eq!(told(&missing), text);
        (0..1000).for_each(|i| missing.add(&format!("{i}.obj"), &place(9)));
        assert!(told(&missing).contains("1001 files are not there") && told(&missing).contains("and 981 more;"));
    }

    #[test]
    fn a_mesh_is_kept_once() {
        let mut meshes = Meshes::new("a");
        let names = ["v 0 0 0", "v 1 0 0", "v 0 0 0"].map(|text| meshes.keep(text.to_string()));
        assert_eq!(names, ["a_mesh001.obj", "a_mesh002.obj", "a_mesh001.obj"]);
        assert_eq!(meshes.all().len(), 2);
    }
}
