//! The text of an OBJ file, checked line by line and written out again in the plain dialect that `tobj` reads
//! faithfully.
//!
//! `tobj` names no lines in its errors, takes `NaN` for a number, misaligns attributes where a group mixes `v/vt` with
//! `v//vn`, and does not know comments behind a statement, tabs behind a keyword, or lines continued by `\`.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use crate::error::SceneError;

/// The largest magnitude of a coordinate.
const MAX_COORDINATE: f64 = 1e15;

/// A checked OBJ file.
#[derive(Default)]
pub(super) struct Source {
    /// Every face's corners name a position, and a normal and a texture coordinate if the file has any at all; those
    /// that a corner lacks are the zero normal and the zero coordinate.
    pub text: String,
    /// The `mtllib` statements: line and the rest of it.
    pub libraries: Vec<(usize, String)>,
    /// The materials used: name and the line of the first use.
    pub materials: BTreeMap<String, usize>,
    /// Statements that are not read: keyword, first line, and how often.
    pub ignored: BTreeMap<String, (usize, usize)>,
    /// Number of faces.
    pub faces: usize,
}

/// Counts of positions, texture coordinates and normals.
#[derive(Clone, Copy, Default)]
struct Counts([usize; 3]);

const KINDS: [(&str, &str); 3] = [("v", "vertex"), ("vt", "texture coordinate"), ("vn", "normal")];

/// Decodes text: UTF-8, with `�` for what isn't; UTF-16 and binary files are refused.
pub(super) fn decode(path: &Path, bytes: &[u8]) -> Result<String, SceneError> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) || bytes.contains(&0) {
        let line = 1 + bytes.iter().take_while(|&&byte| byte != 0).filter(|&&byte| byte == b'\n').count();
        let error = SceneError::invalid("this is not a plain text file", "save it as UTF-8 or ASCII text");
        return Err(error.in_file(path).at_line(line));
    }
    let text = String::from_utf8_lossy(bytes);
    Ok(text.trim_start_matches('\u{feff}').to_string())
}

/// The statements of an OBJ or MTL text: line, keyword and the rest; without comments, with continued lines joined.
pub(super) fn statements(text: &str) -> Vec<(usize, String)> {
    let mut statements = Vec::new();
    let mut pending: Option<(usize, String)> = None;
    for (i, line) in text.lines().enumerate() {
        let line = without_comment(line);
        let (body, continues) = match line.trim_end().strip_suffix('\\') {
            Some(body) => (body, true),
            None => (line, false),
        };
        let (number, mut whole) = pending.take().unwrap_or((i + 1, String::new()));
        whole.push_str(body);
        if continues {
            whole.push(' ');
            pending = Some((number, whole));
        } else if !whole.trim().is_empty() {
            statements.push((number, whole.trim().to_string()));
        }
    }
    statements.extend(pending.filter(|(_, whole)| !whole.trim().is_empty()));
    statements
}

/// The line up to a `#` that begins it or follows white space.
fn without_comment(line: &str) -> &str {
    let starts = |(i, _): &(usize, &str)| *i == 0 || line[..*i].ends_with([' ', '\t']);
    let end = line.match_indices('#').find(starts).map_or(line.len(), |(i, _)| i);
    &line[..end]
}

/// Keyword and rest of a statement.
pub(super) fn split(statement: &str) -> (&str, &str) {
    match statement.split_once(char::is_whitespace) {
        Some((keyword, rest)) => (keyword, rest.trim()),
        None => (statement, ""),
    }
}

/// Checks an OBJ text and rewrites it.
pub(super) fn prepare(path: &Path, text: &str) -> Result<Source, SceneError> {
    let statements = statements(text);
    let total = count(&statements);
    let mut source = Source::default();
    let mut points = String::new();
    let mut faces = String::new();
    if total.0[1] > 0 {
        points.push_str("vt 0 0\n");
    }
    if total.0[2] > 0 {
        points.push_str("vn 0 0 0\n");
    }
    let mut so_far = Counts::default();
    for (line, statement) in &statements {
        let at_line = |error: SceneError| error.in_file(path).at_line(*line);
        let (keyword, rest) = split(statement);
        match keyword {
            "v" | "vt" | "vn" => {
                let kind = KINDS.iter().position(|(k, _)| *k == keyword).unwrap_or(0);
                so_far.0[kind] += 1;
                if write_point(&mut points, kind, rest).map_err(at_line)? {
                    source.ignore("vertex colours", *line);
                }
            }
            "f" => {
                write_face(&mut faces, rest, total, so_far).map_err(at_line)?;
                source.faces += 1;
            }
            "o" | "g" => _ = writeln!(faces, "g {rest}"),
            "usemtl" if rest.is_empty() => {
                return Err(at_line(SceneError::invalid("`usemtl` names no material", "add its name")));
            }
            "usemtl" => {
                source.materials.entry(rest.to_string()).or_insert(*line);
                _ = writeln!(faces, "usemtl {rest}");
            }
            "mtllib" => source.libraries.push((*line, rest.to_string())),
            "s" => {}
            other => source.ignore(other, *line),
        }
    }
    source.text = points + &faces;
    Ok(source)
}

impl Source {
    fn ignore(&mut self, what: &str, line: usize) {
        let short: String = what.chars().take(24).collect();
        self.ignored.entry(short).or_insert((line, 0)).1 += 1;
    }
}

fn count(statements: &[(usize, String)]) -> Counts {
    let mut counts = Counts::default();
    for (_, statement) in statements {
        if let Some(kind) = KINDS.iter().position(|(keyword, _)| *keyword == split(statement).0) {
            counts.0[kind] += 1;
        }
    }
    counts
}

/// Writes the position, texture coordinate or normal; true if there was a colour behind it.
fn write_point(out: &mut String, kind: usize, rest: &str) -> Result<bool, SceneError> {
    let (keyword, name) = KINDS[kind];
    let mut numbers = Vec::with_capacity(8);
    for word in rest.split_whitespace() {
        numbers.push(number(word, name)?);
    }
    let (needed, written) = if kind == 1 { (1, 2) } else { (3, 3) };
    if numbers.len() < needed {
        let message = format!("`{keyword} {rest}` has {} numbers", numbers.len());
        return Err(SceneError::invalid(message, format!("a {name} needs {needed}")));
    }
    let coloured = kind == 0 && numbers.len() >= 6;
    numbers.resize(written, 0.0);
    out.push_str(keyword);
    for x in numbers {
        _ = write!(out, " {x:e}");
    }
    out.push('\n');
    Ok(coloured)
}

/// A finite number of a statement.
pub(super) fn number(word: &str, what: &str) -> Result<f64, SceneError> {
    match word.parse::<f64>() {
        Ok(x) if x.abs() <= MAX_COORDINATE => Ok(x),
        Ok(_) => {
            let mend = format!("give a finite number, at most {MAX_COORDINATE:e} in magnitude");
            Err(SceneError::invalid(format!("a {what} holds `{word}`"), mend))
        }
        Err(_) => Err(SceneError::invalid(format!("a {what} holds `{word}`"), "give a number")),
    }
}

fn write_face(out: &mut String, rest: &str, total: Counts, so_far: Counts) -> Result<(), SceneError> {
    let corners = rest.split_whitespace().count();
    if corners < 3 {
        return Err(SceneError::invalid(format!("the face `f {rest}` has {corners} corners"), "a face has at least 3"));
    }
    out.push('f');
    for corner in rest.split_whitespace() {
        let mut parts = corner.split('/');
        let position = index(parts.next().unwrap_or(""), 0, total, so_far)?;
        let Some(position) = position else {
            return Err(SceneError::invalid(
                format!("the corner `{corner}` names no vertex"),
                "write v, v/vt, v//vn or v/vt/vn",
            ));
        };
        let uv = index(parts.next().unwrap_or(""), 1, total, so_far)?;
        let normal = index(parts.next().unwrap_or(""), 2, total, so_far)?;
        if parts.next().is_some() {
            return Err(SceneError::invalid(
                format!("the corner `{corner}` has too many parts"),
                "write v, v/vt, v//vn or v/vt/vn",
            ));
        }
        // The first texture coordinate and the first normal written are the zeros that stand for none.
        let [_, uvs, normals] = total.0;
        let uv = if uvs > 0 { uv.map_or(1, |i| i + 1).to_string() } else { String::new() };
        _ = match normals {
            0 if uvs == 0 => write!(out, " {position}"),
            0 => write!(out, " {position}/{uv}"),
            _ => write!(out, " {position}/{uv}/{}", normal.map_or(1, |i| i + 1)),
        };
    }
    out.push('\n');
    Ok(())
}

/// The index counted from 1, `None` where there is none; negative ones count back from the last defined so far.
fn index(word: &str, kind: usize, total: Counts, so_far: Counts) -> Result<Option<usize>, SceneError> {
    if word.is_empty() {
        return Ok(None);
    }
    let name = KINDS[kind].1;
    let Ok(given) = word.parse::<i64>() else {
        return Err(SceneError::invalid(format!("the {name} index `{word}` is not a whole number"), "give one"));
    };
    let absolute = if given < 0 { so_far.0[kind] as i64 + 1 + given } else { given };
    if absolute < 1 || absolute > total.0[kind] as i64 {
        let message = format!("there is no {name} {given}");
        let mend = match total.0[kind] {
            0 => format!("the file defines none; add `{}` lines or leave the index out", KINDS[kind].0),
            n if given < 0 => {
                format!("{} of {n} are defined before this line, so -{} is the lowest", so_far.0[kind], so_far.0[kind])
            }
            n => format!("the file defines {n}, counted from 1"),
        };
        return Err(SceneError::invalid(message, mend));
    }
    Ok(Some(absolute as usize))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(text: &str) -> String {
        match prepare(Path::new("a.obj"), text) {
            Ok(_) => panic!("no error for {text:?}"),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn errors_name_file_line_and_mend() {
        let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
        let cases = [
            ("f 1 2 7", "a.obj:4: there is no vertex 7; the file defines 3, counted from 1"),
            ("f 1 2 0", "a.obj:4: there is no vertex 0; the file defines 3, counted from 1"),
            ("f 1 2 -4", "a.obj:4: there is no vertex -4; 3 of 3 are defined before this line, so -3 is the lowest"),
            (
                "f 1/1 2/1 3/1",
                "a.obj:4: there is no texture coordinate 1; the file defines none; add `vt` lines or leave the index out",
            ),
            ("f 1//2 2//2 3//2\nvn 0 0 1", "a.obj:4: there is no normal 2; the file defines 1, counted from 1"),
            ("f 1 2", "a.obj:4: the face `f 1 2` has 2 corners; a face has at least 3"),
            ("f 1 2 x", "a.obj:4: the vertex index `x` is not a whole number; give one"),
            (
                "f 1 2 99999999999999999999",
                "a.obj:4: the vertex index `99999999999999999999` is not a whole number; give one",
            ),
            ("f 1 2 3/1/1/1", "a.obj:4: there is no texture coordinate 1"),
            ("f 1 2 /1", "a.obj:4: the corner `/1` names no vertex"),
            ("v 0 NaN 0", "a.obj:4: a vertex holds `NaN`; give a finite number, at most 1e15 in magnitude"),
            ("v 0 1e999 0", "a.obj:4: a vertex holds `1e999`; give a finite number"),
            ("v 0 zero 0", "a.obj:4: a vertex holds `zero`; give a number"),
            ("v 0 1", "a.obj:4: `v 0 1` has 2 numbers; a vertex needs 3"),
            ("usemtl", "a.obj:4: `usemtl` names no material; add its name"),
        ];
        for (bad, expected) in cases {
            let message = fault(&format!("{vertices}{bad}\n"));
            assert!(message.starts_with(expected), "{bad}: {message}");
        }
    }

    #[test]
    fn the_dialect_is_plain() {
        let text = "\tv 0 0 0 1 0 0 # red\nv 1 0 0\nv 0 1 \\\n 0\nvn 0 0 1\nf -3 -2//1 \\\n -1\nusemtl\ta b\nl 1 2\n";
        let source = prepare(Path::new("a.obj"), text).unwrap();
        let expected =
            "vn 0 0 0\nv 0e0 0e0 0e0\nv 1e0 0e0 0e0\nv 0e0 1e0 0e0\nvn 0e0 0e0 1e0\nf 1//1 2//2 3//1\nusemtl a b\n";
        assert_eq!(source.text, expected);
        assert_eq!(source.materials["a b"], 8);
        assert_eq!(source.ignored["l"], (9, 1));
        assert_eq!(source.ignored["vertex colours"], (1, 1));
    }

    #[test]
    fn other_encodings() {
        let latin = decode(Path::new("a.obj"), b"# caf\xe9\nv 0 0 0\n").unwrap();
        assert!(latin.ends_with("v 0 0 0\n"));
        for bytes in [&b"\xff\xfev\0 \0"[..], b"v 0 0 0\n\0\0"] {
            let message = decode(Path::new("a.obj"), bytes).unwrap_err().to_string();
            assert!(message.contains("this is not a plain text file; save it as UTF-8"), "{message}");
        }
    }
}
