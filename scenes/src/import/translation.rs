//! A foreign scene as the text of a scene file, every line of which knows where it came from.
//!
//! An importer is a translator: it writes TOML, and what becomes of the text is [`description`]'s matter.
//! So a scene that is rendered as it is and one that was converted first are the same to the bit, and whatever is wrong with a
//! line is told of the place in the foreign file that it was made of.

use std::collections::BTreeMap;
use std::fmt::{self, Write as _};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use crate::builder::SceneBuilder;
use crate::description::{self, Origin};
use crate::error::SceneError;
use crate::suggest::nearest;

/// How the scene files begin that are made of others.
pub const SCENE_HEADER: &str = "# Made of";

/// A line of a foreign file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub file: Arc<Path>,
    /// The line, counted from 1.
    pub line: usize,
}

impl Place {
    /// An error here.
    pub fn error(&self, message: impl Into<String>, mend: impl Into<String>) -> SceneError {
        SceneError::invalid(message, mend).in_file(&self.file).at_line(self.line)
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}:{}", self.file.display(), self.line)
    }
}

/// What a note is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum NoteKind {
    /// What was found, and what it became.
    Mapped,
    /// What is not quite the same as it was.
    Approximated,
    /// What was left out, and changes no light.
    Ignored,
    /// What was missing, and was made up.
    Added,
}

impl fmt::Display for NoteKind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::Mapped => "mapped",
            Self::Approximated => "approximated",
            Self::Ignored => "ignored",
            Self::Added => "added",
        })
    }
}

/// Something that the user should know, told once however often it is found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// What it is about.
    pub kind: NoteKind,
    /// What is to be said.
    pub text: String,
    /// Where it was found first.
    pub place: Place,
    /// How often it was found.
    pub count: usize,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: {}: {}", self.place, self.kind, self.text)?;
        if self.count > 1 { write!(f, " ({} times)", self.count) } else { Ok(()) }
    }
}

/// The notes of a translation, in the order in which they were first found.
#[derive(Clone, Debug, Default)]
pub struct Notes {
    list: Vec<Note>,
    places: BTreeMap<(NoteKind, String), usize>,
}

impl Notes {
    /// Notes something, or counts it where it is known already.
    pub fn add(&mut self, kind: NoteKind, place: &Place, text: impl Into<String>) {
        let text = text.into();
        let next = self.list.len();
        let index = *self.places.entry((kind, text.clone())).or_insert(next);
        match self.list.get_mut(index) {
            Some(note) => note.count += 1,
            None => self.list.push(Note { kind, text, place: place.clone(), count: 1 }),
        }
    }

    /// A colour brought to where it can be, from 0 to `most`, which is noted if it was elsewhere.
    pub fn bounded(&mut self, rgb: [f64; 3], most: f64, place: &Place) -> [f64; 3] {
        let inside = rgb.map(|c| c.clamp(0.0, most));
        if (0..3).any(|c| (rgb[c] - inside[c]).abs() > 1e-9) {
            let range = if most == 1.0 { "from 0 to 1" } else { "0 or more" };
            let text = format!("a colour whose channels are not {range} is brought there");
            self.add(NoteKind::Approximated, place, text);
        }
        inside
    }

    /// All of them.
    pub fn all(&self) -> &[Note] {
        &self.list
    }

    /// Tells a builder what its users should know: all but what was mapped.
    pub fn tell(&self, builder: &mut SceneBuilder) {
        tell(&self.list, builder);
    }
}

fn tell(notes: &[Note], builder: &mut SceneBuilder) {
    notes.iter().filter(|note| note.kind != NoteKind::Mapped).for_each(|note| builder.note(note.to_string()));
}

/// Lines of text with the places that they came from.
#[derive(Clone, Debug, Default)]
pub struct Lines(Vec<(String, Place)>);

impl Lines {
    /// Adds a line.
    pub fn push(&mut self, place: &Place, line: impl Into<String>) {
        self.0.push((line.into(), place.clone()));
    }

    /// Adds an empty line and the line that begins a table.
    pub fn table(&mut self, place: &Place, header: impl Into<String>) {
        self.push(place, "");
        self.push(place, header);
    }

    /// Adds a key and its value.
    pub fn key(&mut self, place: &Place, key: &str, value: impl fmt::Display) {
        self.push(place, format!("{key} = {value}"));
    }

    /// The key `label`, if there is a name that can be one.
    pub fn label(&mut self, place: &Place, name: Option<&str>) {
        if let Some(name) = name.filter(|name| can_be_label(name)) {
            self.key(place, "label", quoted(name));
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Adds a shape that is an instance of a group.
    pub fn instance(&mut self, place: &Place, header: &str, group: &str, steps: Option<String>) {
        self.table(place, header);
        self.key(place, "type", quoted("instance"));
        self.key(place, "group", quoted(group));
        if let Some(steps) = steps {
            self.key(place, "transform", steps);
        }
    }

    /// Adds a group of this name with its shapes.
    pub fn group(&mut self, place: &Place, name: &str, shapes: Lines) {
        self.table(place, "[[groups]]");
        self.key(place, "name", quoted(name));
        self.append(shapes);
    }

    /// Adds all lines of another list.
    pub fn append(&mut self, mut other: Lines) {
        self.0.append(&mut other.0);
    }
}

/// What is said of a parameter that is not known; `known` are those that were looked for.
pub fn unknown(what: &str, name: &str, known: &[&str]) -> String {
    match nearest(name, known).filter(|near| *near != name) {
        Some(near) => format!("{what} is not known, and is left out: did you mean `{near}`?"),
        None => format!("{what} is not known, and is left out"),
    }
}

/// Whether a name can be a label.
pub fn can_be_label(name: &str) -> bool {
    (1..=100).contains(&name.chars().count()) && !name.chars().any(char::is_control)
}

/// How a shape of the scene begins.
pub const SHAPE: &str = "[[shapes]]";
/// How a shape of the group that was begun last begins.
pub const MEMBER: &str = "[[groups.shapes]]";

/// A mesh or an image that has no file of its own, which the text names as if it had.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// The file's name.
    pub name: String,
    /// What the file would hold.
    pub bytes: Vec<u8>,
}

/// A foreign scene, translated.
#[derive(Clone, Debug)]
pub struct Translation {
    /// The text of a scene file.
    pub text: String,
    /// Where every line of it came from.
    pub places: Arc<[Place]>,
    /// What the text names and no file holds.
    pub attachments: Vec<Attachment>,
    /// What is to be told.
    pub notes: Vec<Note>,
}

impl Translation {
    /// What these lines say.
    pub fn new(lines: Lines, attachments: Vec<Attachment>, notes: Notes) -> Self {
        let mut text = String::new();
        let mut places = Vec::with_capacity(lines.0.len());
        for (line, place) in lines.0 {
            debug_assert!(!line.contains('\n'), "{line:?} is one line");
            _ = writeln!(text, "{line}");
            places.push(place);
        }
        Self { text, places: places.into(), attachments, notes: notes.list }
    }

    /// Reads the text into a builder; the scene is called `scene`, paths start at `folder`, and errors name foreign places.
    pub fn read(&self, scene: &str, folder: &Path, size: Option<(u32, u32)>) -> Result<SceneBuilder, SceneError> {
        let file = self.places.first().map_or_else(String::new, |place| place.file.display().to_string());
        if !self.text.contains(SHAPE) {
            let telling = |text: &str| {
                let mut approximated = self.notes.iter().filter(|note| note.kind == NoteKind::Approximated);
                approximated.find(|note| note.text.to_lowercase().contains(text))
            };
            let left_out = telling("shape").or_else(|| telling("is left out"));
            let mend = left_out.map_or("add one".to_string(), |note| format!("{} ({})", note.text, note.place));
            return Err(SceneError::invalid("the scene has no shape that can be read", mend).in_file(&file).at_line(1));
        }
        let origin = Origin { scene, file: &file, folder: Some(folder), attachments: &self.attachments };
        let mut builder = description::read(&self.text, origin, size).map_err(|error| {
            let of_text = matches!(&error, SceneError::Invalid { file: Some(at), .. } if *at == Path::new(&file));
            if of_text { carried_back(error, &self.places) } else { error }
        })?;
        builder.came_from(self.places.clone());
        tell(&self.notes, &mut builder);
        Ok(builder)
    }

    /// How many things were approximated.
    pub fn approximations(&self) -> usize {
        self.notes.iter().filter(|note| note.kind == NoteKind::Approximated).count()
    }
}

/// An error at a line of a translated text, placed where that line came from.
pub(crate) fn carried_back(error: SceneError, places: &[Place]) -> SceneError {
    let SceneError::Invalid { line: Some(number), message, mend, .. } = error else { return error };
    match places.get(number.saturating_sub(1)).or(places.last()) {
        Some(place) => place.error(message, mend),
        None => SceneError::invalid(message, mend).at_line(number),
    }
}

/// A text as TOML writes it.
pub fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => _ = write!(out, "\\u{:04X}", c as u32),
            c => out.push(c),
        }
    }
    out + "\""
}

/// A key as TOML writes it.
pub fn key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.chars().all(bare) { name.to_string() } else { quoted(name) }
}

/// A number as TOML writes it; what is read is the same number. One that is none is refused where it is read.
pub fn number(x: f64) -> String {
    if x.is_nan() { "nan".to_string() } else { format!("{x:?}") }
}

/// Numbers as TOML writes them.
pub fn numbers(list: &[f64]) -> String {
    format!("[{}]", list.iter().copied().map(number).collect::<Vec<_>>().join(", "))
}

/// A colour as TOML writes it: one number where it is grey.
pub fn colour(rgb: [f64; 3]) -> String {
    if rgb[0] == rgb[1] && rgb[1] == rgb[2] { number(rgb[0]) } else { numbers(&rgb) }
}

/// The name of a file in a text whose paths start at the folder `base`.
pub fn named_from(path: &Path, base: &Path) -> String {
    let within = path.strip_prefix(base).ok().filter(|_| path.is_relative() || !base.as_os_str().is_empty());
    let name = within.map_or_else(|| relative(&absolute(path), &absolute(base)), Path::to_path_buf);
    name.to_string_lossy().into_owned()
}

fn absolute(path: &Path) -> PathBuf {
    let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    std::fs::canonicalize(path).or_else(|_| std::path::absolute(path)).unwrap_or_else(|_| path.to_path_buf())
}

/// The way from one folder to a file, both absolute.
fn relative(path: &Path, from: &Path) -> PathBuf {
    let (mut to, mut start) = (path.components().peekable(), from.components().peekable());
    while to.peek().is_some() && to.peek() == start.peek() {
        to.next();
        start.next();
    }
    if matches!(to.peek(), Some(Component::Prefix(_) | Component::RootDir)) {
        return path.to_path_buf();
    }
    start.map(|_| Component::ParentDir).chain(to).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(line: usize) -> Place {
        Place { file: Path::new("a.xml").into(), line }
    }

    #[test]
    fn a_note_is_told_once() {
        let mut notes = Notes::default();
        notes.add(NoteKind::Ignored, &place(3), "a `medium`");
        notes.add(NoteKind::Ignored, &place(5), "a `medium`");
        notes.add(NoteKind::Approximated, &place(6), "a `medium`");
        let texts: Vec<String> = notes.all().iter().map(Note::to_string).collect();
        assert_eq!(texts, ["a.xml:3: ignored: a `medium` (2 times)", "a.xml:6: approximated: a `medium`"]);
    }

    #[test]
    fn what_is_written_is_read_as_the_same() {
        for x in [0.1, 1.0 / 3.0, -1e-300, 1e15, 4.37114e-8, 0.0, 123456789.125] {
            let text = format!("x = {}", number(x));
            assert_eq!(text.parse::<toml::Table>().expect(&text)["x"].as_float(), Some(x));
        }
        for text in ["a\"b\\c", "tab\there", "ünïcode", "\u{7f}\u{1}\u{85}"] {
            let written = format!("{} = {}", key(text), quoted(text));
            assert_eq!(written.parse::<toml::Table>().expect(&written)[text].as_str(), Some(text));
        }
    }

    #[test]
    fn errors_are_carried_back_to_where_the_line_came_from() {
        let mut lines = Lines::default();
        lines.push(&place(1), "[camera]");
        lines.push(&place(7), "position = [0, 0, 3]");
        lines.push(&place(9), "target = [0, 0, 3]");
        lines.table(&place(4), "[[shapes]]");
        for line in ["type = \"sphere\"", "center = [0, 0, 0]", "radius = 1", "material = \"m\""] {
            lines.push(&place(5), line);
        }
        lines.push(&place(6), "[materials.m]");
        lines.push(&place(6), "type = \"lambert\"");
        let translation = Translation::new(lines, Vec::new(), Notes::default());
        let error = translation.read("a", Path::new("."), None).unwrap_err().to_string();
        assert!(error.starts_with("a.xml:9: `camera.target` is"), "{error}");
    }

    #[test]
    fn ways_between_folders() {
        let way = |to: &str, from: &str| relative(Path::new(to), Path::new(from));
        assert_eq!(way("/a/b/c.obj", "/a/b"), Path::new("c.obj"));
        assert_eq!(way("/a/b/c.obj", "/a/d/e"), Path::new("../../b/c.obj"));
        assert_eq!(way("/a/c.obj", "/"), Path::new("a/c.obj"));
    }
}
