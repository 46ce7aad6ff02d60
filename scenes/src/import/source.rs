//! The text of an OBJ file, read line by line, many lines at a time.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;
use sampling::{Vec2, vec2};

use crate::error::SceneError;
use crate::progress::{self, Activity};

/// The largest magnitude of a coordinate.
const MAX_COORDINATE: f64 = 1e15;
/// About so many bytes are read in one go, by one thread.
const PIECE: usize = 1 << 18;

/// What an OBJ file holds, as it is written.
#[derive(Default)]
pub(super) struct Source {
    pub positions: Vec<DVec3>,
    pub uvs: Vec<Vec2>,
    pub normals: Vec<DVec3>,
    /// For each corner of each face its position and, if the file has any at all, its texture coordinate and its normal, counted from
    /// 1; 0 where the corner has none.
    pub corners: [Vec<u32>; 3],
    /// How many corners each face has.
    pub arities: Vec<u32>,
    /// What is said between faces, each with the number of faces before it.
    pub marks: Vec<(usize, Mark)>,
    /// The `mtllib` statements: line and the rest of it.
    pub libraries: Vec<(usize, String)>,
    /// The materials used: name and the line of the first use.
    pub materials: BTreeMap<String, usize>,
    /// Statements that are not read: keyword, first line, and how often.
    pub ignored: BTreeMap<String, (usize, usize)>,
}

/// What holds of the faces behind it.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Mark {
    /// The name of a group or an object.
    Group(String),
    /// The name of their material.
    Material(String),
}

/// Counts of positions, texture coordinates and normals.
#[derive(Clone, Copy, Default)]
struct Counts([usize; 3]);

const KINDS: [(&str, &str); 3] = [("v", "vertex"), ("vt", "texture coordinate"), ("vn", "normal")];

/// Decodes text: UTF-8, with `�` for what isn't; UTF-16 and binary files are refused.
pub(super) fn decode(path: &Path, bytes: Vec<u8>) -> Result<String, SceneError> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) || bytes.contains(&0) {
        let line = 1 + bytes.iter().take_while(|&&byte| byte != 0).filter(|&&byte| byte == b'\n').count();
        let error = SceneError::invalid("this is not a plain text file", "save it as UTF-8 or ASCII text");
        return Err(error.in_file(path).at_line(line));
    }
    let mut text =
        String::from_utf8(bytes).unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned());
    let marks = text.len() - text.trim_start_matches('\u{feff}').len();
    text.drain(..marks);
    Ok(text)
}

/// The statements of an OBJ or MTL text whose first line has this number: line and what it says; without comments, with continued
/// lines joined.
pub(super) fn statements(text: &str, first: usize) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = (first..).zip(text.lines());
    std::iter::from_fn(move || {
        loop {
            let (number, line) = lines.next()?;
            let mut whole = Cow::Borrowed(without_comment(line));
            while let Some(body) = whole.trim_end().strip_suffix('\\') {
                let (body, next) = (body.to_owned() + " ", lines.next());
                let Some((_, line)) = next else {
                    whole = Cow::Owned(body);
                    break;
                };
                whole = Cow::Owned(body + without_comment(line));
            }
            if !whole.trim().is_empty() {
                return Some((number, trimmed(whole)));
            }
        }
    })
}

fn trimmed(text: Cow<str>) -> Cow<str> {
    match text {
        Cow::Borrowed(text) => Cow::Borrowed(text.trim()),
        Cow::Owned(text) => Cow::Owned(text.trim().to_owned()),
    }
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

/// Reads an OBJ text.
pub(super) fn prepare(path: &Path, text: &str) -> Result<Source, SceneError> {
    let pieces = cut(text);
    let counted: Vec<(usize, Counts)> = pieces.par_iter().map(|piece| count(piece)).collect();
    let total = counted.iter().fold(Counts::default(), |sum, (_, counts)| sum.plus(counts));
    let mut source = Source::default();
    source.positions.reserve_exact(total.0[0]);
    source.uvs.reserve_exact(total.0[1]);
    source.normals.reserve_exact(total.0[2]);
    let (mut line, mut so_far) = (1, Counts::default());
    let begun: Vec<_> = pieces
        .into_iter()
        .zip(counted)
        .map(|(piece, (lines, counts))| {
            let begun = (piece, line, so_far);
            (line, so_far) = (line + lines, so_far.plus(&counts));
            begun
        })
        .collect();
    let mut read = 0;
    for together in begun.chunks(4 * rayon::current_num_threads()) {
        let results: Vec<_> =
            together.par_iter().map(|&(piece, line, so_far)| read_piece(piece, line, total, so_far)).collect();
        for result in results {
            source.join(result.map_err(|error| error.in_file(path))?);
        }
        read += together.iter().map(|(piece, ..)| piece.len()).sum::<usize>();
        progress::report(Activity::Reading, read as f64 / text.len() as f64);
    }
    Ok(source)
}

/// The text in pieces of whole statements.
fn cut(text: &str) -> Vec<&str> {
    let mut pieces = Vec::new();
    let mut rest = text;
    while rest.len() > PIECE {
        // A statement surely ends where a line does that has no backslash.
        let mut from = rest.as_bytes()[..PIECE].iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
        let end = loop {
            let Some(length) = rest.as_bytes()[from..].iter().position(|&byte| byte == b'\n') else { break rest.len() };
            let line = from..from + length;
            from = line.end + 1;
            if !rest.as_bytes()[line].contains(&b'\\') {
                break from;
            }
        };
        let (piece, after) = rest.split_at(end);
        pieces.push(piece);
        rest = after;
    }
    pieces.push(rest);
    pieces
}

/// How many lines and points a piece has.
fn count(piece: &str) -> (usize, Counts) {
    let mut counts = Counts::default();
    for (_, statement) in statements(piece, 0) {
        if let Some(kind) = KINDS.iter().position(|(keyword, _)| *keyword == split(&statement).0) {
            counts.0[kind] += 1;
        }
    }
    (piece.bytes().filter(|&byte| byte == b'\n').count(), counts)
}

/// Reads a piece, before which there are so many lines and points.
fn read_piece(piece: &str, first: usize, total: Counts, mut so_far: Counts) -> Result<Source, SceneError> {
    let mut source = Source::default();
    for (line, statement) in statements(piece, first) {
        let at_line = |error: SceneError| error.at_line(line);
        let (keyword, rest) = split(&statement);
        match keyword {
            "v" | "vt" | "vn" => {
                let kind = KINDS.iter().position(|(k, _)| *k == keyword).unwrap_or(0);
                so_far.0[kind] += 1;
                if source.add_point(kind, rest).map_err(at_line)? {
                    source.ignore("vertex colours", line);
                }
            }
            "f" => source.add_face(rest, total, so_far).map_err(at_line)?,
            "o" | "g" => source.marks.push((source.arities.len(), Mark::Group(rest.to_owned()))),
            "usemtl" if rest.is_empty() => {
                return Err(at_line(SceneError::invalid("`usemtl` names no material", "add its name")));
            }
            "usemtl" => {
                source.materials.entry(rest.to_owned()).or_insert(line);
                source.marks.push((source.arities.len(), Mark::Material(rest.to_owned())));
            }
            "mtllib" => source.libraries.push((line, rest.to_owned())),
            "s" => {}
            other => source.ignore(other, line),
        }
    }
    Ok(source)
}

impl Counts {
    fn plus(&self, other: &Counts) -> Counts {
        Counts(std::array::from_fn(|kind| self.0[kind] + other.0[kind]))
    }
}

impl Source {
    fn ignore(&mut self, what: &str, line: usize) {
        let short: String = what.chars().take(24).collect();
        self.ignored.entry(short).or_insert((line, 0)).1 += 1;
    }

    /// Adds what follows it in the file.
    fn join(&mut self, mut next: Source) {
        let faces = self.arities.len();
        self.positions.append(&mut next.positions);
        self.uvs.append(&mut next.uvs);
        self.normals.append(&mut next.normals);
        self.corners.iter_mut().zip(&mut next.corners).for_each(|(all, next)| all.append(next));
        self.arities.append(&mut next.arities);
        self.marks.extend(next.marks.into_iter().map(|(face, mark)| (faces + face, mark)));
        self.libraries.append(&mut next.libraries);
        for (name, line) in next.materials {
            self.materials.entry(name).or_insert(line);
        }
        for (what, (line, count)) in next.ignored {
            self.ignored.entry(what).or_insert((line, 0)).1 += count;
        }
    }

    /// Adds a position, a texture coordinate or a normal; true if there was a colour behind it.
    fn add_point(&mut self, kind: usize, rest: &str) -> Result<bool, SceneError> {
        let (keyword, name) = KINDS[kind];
        let mut numbers = [0.0; 3];
        let mut count = 0;
        for word in rest.split_whitespace() {
            let given = number(word, name)?;
            if let Some(slot) = numbers.get_mut(count) {
                *slot = given;
            }
            count += 1;
        }
        let needed = if kind == 1 { 1 } else { 3 };
        if count < needed {
            let message = format!("`{keyword} {rest}` has {count} numbers");
            return Err(SceneError::invalid(message, format!("a {name} needs {needed}")));
        }
        let [x, y, _] = numbers;
        match kind {
            0 => self.positions.push(numbers.into()),
            1 => self.uvs.push(vec2(x as f32, y as f32)),
            _ => self.normals.push(numbers.into()),
        }
        Ok(kind == 0 && count >= 6)
    }

    fn add_face(&mut self, rest: &str, total: Counts, so_far: Counts) -> Result<(), SceneError> {
        let arity = rest.split_whitespace().count();
        if arity < 3 {
            return Err(SceneError::invalid(
                format!("the face `f {rest}` has {arity} corners"),
                "a face has at least 3",
            ));
        }
        for corner in rest.split_whitespace() {
            let wrong = |what: &str| {
                SceneError::invalid(format!("the corner `{corner}` {what}"), "write v, v/vt, v//vn or v/vt/vn")
            };
            let mut parts = corner.split('/');
            for kind in 0..KINDS.len() {
                let index = index(parts.next().unwrap_or(""), kind, total, so_far)?;
                if kind == 0 && index.is_none() {
                    return Err(wrong("names no vertex"));
                }
                if total.0[kind] > 0 {
                    self.corners[kind].push(index.unwrap_or(0));
                }
            }
            if parts.next().is_some() {
                return Err(wrong("has too many parts"));
            }
        }
        self.arities.push(arity as u32);
        Ok(())
    }
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

/// The index counted from 1, `None` where there is none; negative ones count back from the last defined so far.
fn index(word: &str, kind: usize, total: Counts, so_far: Counts) -> Result<Option<u32>, SceneError> {
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
    let beyond = |_| SceneError::invalid(format!("there are more than 2³² of a {name}"), "divide the file");
    u32::try_from(absolute).map(Some).map_err(beyond)
}

#[cfg(test)]
mod tests;
