//! The XML of Mitsuba scenes: parameters filled in, included files spliced in, old names made new.

use std::collections::BTreeMap;
use std::ops::Bound::{Included, Unbounded};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use roxmltree::{Document, Node, ParsingOptions};

use crate::error::SceneError;
use crate::import::translation::Place;
use crate::suggest::{did_you_mean, near_file, near_folder};

/// How deep elements may be nested, included files within those that include them.
const MAX_DEPTH: usize = 64;
/// How many elements, texts and comments a file may have.
const MAX_NODES: u32 = 8_000_000;
/// How many elements a scene may have, all files together.
const MAX_ELEMENTS: usize = 4_000_000;
/// How many attributes an element may have: the parser compares each with all others.
const MAX_ATTRIBUTES: usize = 4096;
/// How many files may be included in all.
const MAX_FILES: usize = 10_000;
/// In how many folders files may be looked for.
const MAX_FOLDERS: usize = 1000;
/// How many bytes attributes may gain, all together, when parameters are filled in.
const MAX_FILLED: usize = 1 << 26;

/// An element of a scene.
#[derive(Clone, Debug)]
pub struct Element {
    /// Its tag, such as `bsdf`.
    pub tag: String,
    /// Its attributes.
    pub attributes: Vec<(String, String)>,
    /// What it holds.
    pub children: Vec<Element>,
    /// Where it begins.
    pub place: Place,
    /// The first number of the version that its file is written for.
    pub version: u32,
}

impl Element {
    /// An attribute, if it is there.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value.as_str())
    }

    /// Its name among its parent's parts, or nothing.
    pub fn name(&self) -> &str {
        self.attribute("name").unwrap_or("")
    }

    /// The plugin that it is made by, or nothing.
    pub fn kind(&self) -> &str {
        self.attribute("type").unwrap_or("")
    }

    /// What messages call it.
    pub fn title(&self) -> String {
        match (self.kind(), self.name()) {
            ("", "") => format!("`{}`", self.tag),
            ("", name) => format!("`{}` `{name}`", self.tag),
            (kind, _) => format!("`{} {kind}`", self.tag),
        }
    }
}

/// A scene as it is written: its root element, and the folders in which its files are looked for.
pub struct Xml {
    /// The element `scene`.
    pub root: Element,
    /// The folder of the scene's own file, those of included ones, and those that it names itself.
    pub folders: Vec<PathBuf>,
}

/// Reads the scene at `path`.
pub fn read(path: &Path) -> Result<Xml, SceneError> {
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    let mut reader = Reader { folders: vec![folder], ..Default::default() };
    let bytes = crate::file::read(path)
        .map_err(|error| SceneError::unreadable(path, error, "give the path of a Mitsuba scene"))?;
    let root = reader.file(path, &bytes)?;
    Ok(Xml { root, folders: reader.folders })
}

#[derive(Default)]
struct Reader {
    /// What `$name` stands for.
    parameters: BTreeMap<String, String>,
    /// The files that are being read, each included by the one before.
    open: Vec<PathBuf>,
    folders: Vec<PathBuf>,
    elements: usize,
    /// How many elements are open, those around includes as well.
    depth: usize,
    /// How many files have been read.
    files: usize,
    /// How many bytes parameters have been filled in with.
    filled: usize,
}

/// A file that is being read.
struct File {
    path: Arc<Path>,
    version: u32,
    /// Where its lines begin.
    lines: Vec<usize>,
}

impl File {
    fn place(&self, node: &Node) -> Place {
        let line = self.lines.partition_point(|&start| start <= node.range().start);
        Place { file: self.path.clone(), line }
    }
}

impl Reader {
    /// The root element of a file.
    fn file(&mut self, path: &Path, bytes: &[u8]) -> Result<Element, SceneError> {
        let text = std::str::from_utf8(bytes).map_err(|error| {
            let line = 1 + bytes[..error.valid_up_to()].iter().filter(|&&byte| byte == b'\n').count();
            SceneError::invalid("the text is not UTF-8", "save the file as UTF-8").in_file(path).at_line(line)
        })?;
        check_attributes(path, text)?;
        let options = ParsingOptions { allow_dtd: false, nodes_limit: MAX_NODES, ..ParsingOptions::default() };
        let document = Document::parse_with_options(text, options).map_err(|error| syntax(path, text, &error))?;
        let lines = std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect();
        let root = document.root_element();
        let mut file = File { path: path.into(), version: 3, lines };
        if root.tag_name().name() != "scene" {
            let message = format!("the file holds a `{}`", root.tag_name().name());
            return Err(file.place(&root).error(message, "a Mitsuba scene begins with `<scene version=\"3.0.0\">`"));
        }
        if let Some(version) = root.attribute("version") {
            let first = version.split('.').next().and_then(|number| number.trim().parse().ok());
            file.version = first.ok_or_else(|| {
                let message = format!("the version is `{version}`");
                file.place(&root).error(message, "write the version of Mitsuba, such as `3.0.0`")
            })?;
        }
        self.open.push(path.to_path_buf());
        let element = self.element(&file, root)?;
        self.open.pop();
        Ok(element)
    }

    fn element(&mut self, file: &File, node: Node) -> Result<Element, SceneError> {
        let place = file.place(&node);
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            let message = format!("elements are nested more than {MAX_DEPTH} deep");
            return Err(place.error(message, "close the elements around it first"));
        }
        self.elements += 1;
        if self.elements > MAX_ELEMENTS {
            return Err(place.error(format!("the scene has more than {MAX_ELEMENTS} elements"), "divide it"));
        }
        let mut element = Element {
            tag: modern(node.tag_name().name(), file.version),
            attributes: Vec::new(),
            children: Vec::new(),
            version: file.version,
            place,
        };
        for attribute in node.attributes() {
            let value = self.filled_in(attribute.value(), &element.place)?;
            let renamed = attribute.name() == "name" && element.tag != "default";
            let value = if renamed { modern(&value, file.version) } else { value };
            element.attributes.push((attribute.name().to_string(), value));
        }
        for child in node.children().filter(Node::is_element) {
            let child = self.element(file, child)?;
            match child.tag.as_str() {
                "default" => self.default(&child)?,
                "path" => self.search_path(&child)?,
                "include" => element.children.extend(self.include(&child)?),
                _ => element.children.push(child),
            }
        }
        self.depth -= 1;
        Ok(element)
    }

    /// A text with what its `$names` stand for.
    fn filled_in(&mut self, text: &str, place: &Place) -> Result<String, SceneError> {
        let mut out = String::new();
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            out.push_str(&rest[..at]);
            rest = &rest[at + 1..];
            let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
            let Some((name, value)) = self.parameter(&rest[..end]) else {
                let names: Vec<&str> = self.parameters.keys().map(String::as_str).collect();
                let mend = if names.is_empty() {
                    format!("add `<default name=\"{}\" value=\"…\"/>` before it", &rest[..end])
                } else {
                    did_you_mean(&rest[..end], &names)
                };
                return Err(place.error(format!("there is no parameter `${}`", &rest[..end]), mend));
            };
            out.push_str(value);
            rest = &rest[name.len()..];
            self.filled += value.len();
            if self.filled > MAX_FILLED {
                return Err(place.error("attributes grow by more than 64 MB in all", "let parameters repeat less"));
            }
        }
        out.push_str(rest);
        Ok(out)
    }

    /// The parameter whose name this text begins with. A name may go on in other letters: the longest one that is known counts.
    fn parameter(&self, text: &str) -> Option<(&String, &String)> {
        let mut text = text;
        loop {
            // What `text` begins with comes before it in the order of names, and the longest last.
            let (name, value) = self.parameters.range::<str, _>((Unbounded, Included(text))).next_back()?;
            if text.starts_with(name.as_str()) {
                return Some((name, value));
            }
            let shared = text.chars().zip(name.chars()).take_while(|(a, b)| a == b).map(|(a, _)| a.len_utf8()).sum();
            text = &text[..shared];
        }
    }

    fn default(&mut self, element: &Element) -> Result<(), SceneError> {
        let (name, value) = (element.attribute("name"), element.attribute("value"));
        let (Some(name), Some(value)) = (name.filter(|name| !name.is_empty()), value) else {
            return Err(element.place.error("`default` lacks its `name` or `value`", "give both"));
        };
        self.parameters.entry(name.to_string()).or_insert_with(|| value.to_string());
        Ok(())
    }

    fn search_path(&mut self, element: &Element) -> Result<(), SceneError> {
        let Some(value) = element.attribute("value") else {
            return Err(element.place.error("`path` lacks its `value`", "name a folder"));
        };
        let own = element.place.file.parent().unwrap_or(Path::new(""));
        let candidates = std::iter::once(own).chain(self.folders.iter().map(PathBuf::as_path));
        let Some(folder) = candidates.map(|folder| folder.join(value)).find(|folder| folder.is_dir()) else {
            let folder = own.join(value);
            let near = near_folder(&folder);
            let message = format!("there is no folder {} to look for files in", folder.display());
            return Err(element.place.error(message, format!("{near}name one that is there, or take the `path` out")));
        };
        self.add_folder(folder, &element.place)
    }

    fn add_folder(&mut self, folder: PathBuf, place: &Place) -> Result<(), SceneError> {
        if self.folders.contains(&folder) {
            return Ok(());
        }
        if self.folders.len() >= MAX_FOLDERS {
            let message = format!("files are to be looked for in more than {MAX_FOLDERS} folders");
            return Err(place.error(message, "put more of them into one folder"));
        }
        self.folders.push(folder);
        Ok(())
    }

    /// What another file holds.
    fn include(&mut self, element: &Element) -> Result<Vec<Element>, SceneError> {
        let Some(name) = element.attribute("filename") else {
            return Err(element.place.error("`include` lacks its `filename`", "name a file"));
        };
        let own = element.place.file.parent().unwrap_or(Path::new(""));
        let candidates = std::iter::once(own).chain(self.folders.iter().map(PathBuf::as_path));
        let path = candidates.map(|folder| folder.join(name)).find(|path| path.is_file());
        let Some(path) = path else {
            let path = own.join(name);
            let near = near_file(&path);
            let message = format!("there is no file {} to include", path.display());
            return Err(element.place.error(message, format!("{near}paths start at the scene's folder")));
        };
        let same = |a: &Path, b: &Path| a == b || std::fs::canonicalize(a).ok() == std::fs::canonicalize(b).ok();
        if self.open.iter().any(|open| same(open, &path)) {
            let mut chain: Vec<String> = self.open.iter().map(|open| open.display().to_string()).collect();
            chain.push(path.display().to_string());
            let message = format!("a file includes itself: {}", chain.join(" → "));
            return Err(element.place.error(message, "take one of the includes out"));
        }
        self.files += 1;
        if self.files > MAX_FILES {
            return Err(element.place.error("too many files are included", "put their text together"));
        }
        let bytes = crate::file::read(&path).map_err(|error| {
            element.place.error(format!("cannot read {}: {error}", path.display()), "name a file that can be read")
        })?;
        let root = self.file(&path, &bytes)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        self.add_folder(folder, &element.place)?;
        Ok(root.children)
    }
}

/// Refuses elements of too many attributes, by their quotes.
fn check_attributes(path: &Path, text: &str) -> Result<(), SceneError> {
    let mut line = 1;
    for part in text.split('<') {
        if part.bytes().filter(|byte| matches!(byte, b'"' | b'\'')).count() > 2 * MAX_ATTRIBUTES {
            let message = format!("an element has more than {MAX_ATTRIBUTES} attributes");
            return Err(SceneError::invalid(message, "divide it").in_file(path).at_line(line));
        }
        line += part.bytes().filter(|&byte| byte == b'\n').count();
    }
    Ok(())
}

/// What is wrong with the text of a file; what has no place is told of its end.
fn syntax(path: &Path, text: &str, error: &roxmltree::Error) -> SceneError {
    use roxmltree::Error::{NoRootNode, UnclosedRootNode, UnexpectedEndOfStream};
    let line = match error {
        NoRootNode | UnclosedRootNode | UnexpectedEndOfStream => text.lines().count(),
        _ => error.pos().row as usize,
    };
    let (message, mend) = match error {
        roxmltree::Error::DtdDetected => {
            ("the file declares a document type".to_string(), "remove `<!DOCTYPE …>` and its entities".to_string())
        }
        roxmltree::Error::NodesLimitReached => {
            (format!("the file has more than {MAX_NODES} parts"), "divide it".to_string())
        }
        other => (format!("this is not valid XML: {other}"), "close every element, and quote every attribute".into()),
    };
    SceneError::invalid(message, mend).in_file(path).at_line(line.max(1))
}

/// The name that Mitsuba 2 and later give to what older ones called `name`.
fn modern(name: &str, version: u32) -> String {
    if version >= 2 {
        return name.to_string();
    }
    match name {
        "lookAt" => return "lookat".to_string(),
        "luminaire" => return "emitter".to_string(),
        "camera" => return "sensor".to_string(),
        _ => {}
    }
    let mut out = String::new();
    let mut after_small = false;
    for c in name.chars() {
        if c.is_ascii_uppercase() && after_small {
            out.push('_');
        }
        after_small = c.is_ascii_lowercase() || c.is_ascii_digit();
        out.push(c.to_ascii_lowercase());
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_names_become_new_ones() {
        let pairs = [
            ("toWorld", "to_world"),
            ("intIOR", "int_ior"),
            ("lookAt", "lookat"),
            ("cropOffsetX", "crop_offset_x"),
            ("fov", "fov"),
            ("alphaU", "alpha_u"),
            ("sigmaT", "sigma_t"),
            ("luminaire", "emitter"),
        ];
        for (old, new) in pairs {
            assert_eq!(modern(old, 0), new);
            assert_eq!(modern(old, 3), old);
        }
    }
}
