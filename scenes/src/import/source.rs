//! The text of an OBJ file, checked line by line and cut into pieces.
//!
//! `tobj` names no lines in its errors, takes `NaN` for a number, misaligns attributes where a group mixes `v/vt` with
//! `v//vn`, and does not know comments behind a statement, tabs behind a keyword, or lines continued by `\`. It also keeps every face
//! of a text in 104 bytes until its group ends, and every vertex in a table of hashes. So what it is given are small texts in the plain
//! dialect that it reads faithfully, made of the [pieces](Piece) of a file.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

use rayon::prelude::*;

use crate::error::SceneError;
use crate::progress::{self, Activity};

/// The largest magnitude of a coordinate.
const MAX_COORDINATE: f64 = 1e15;
/// About so many bytes are a piece, which one thread reads in one go.
const PIECE: usize = 1 << 18;
/// The places of every so many points are kept.
const STRIDE: usize = 4;
/// The share of the time of reading that checking takes.
pub(super) const CHECKING: f64 = 0.3;

/// A checked OBJ file: all of its text, but that faces may name vertices that there are not.
#[derive(Default)]
pub(super) struct Source<'a> {
    pub pieces: Vec<Piece<'a>>,
    /// How many of everything there are.
    pub total: Counts,
    /// What is said between faces, each with the number of faces before it.
    pub marks: Vec<(usize, Mark)>,
    /// Smoothing groups, 0 for none, each with the number of faces before it.
    pub smoothing: Vec<(usize, u32)>,
    /// The `mtllib` statements: line and the rest of it.
    pub libraries: Vec<(usize, String)>,
    /// The materials used: name and the line of the first use.
    pub materials: BTreeMap<String, usize>,
    /// Statements that are not read: keyword, first line, and how often.
    pub ignored: BTreeMap<String, (usize, usize)>,
}

/// Whole statements that follow one another.
#[derive(Default)]
pub(super) struct Piece<'a> {
    pub text: &'a str,
    /// How many lines are before it.
    pub lines: usize,
    /// How many points and faces are before it.
    pub before: Counts,
    /// How many faces it has.
    pub faces: usize,
    /// Where in the text the points of each kind are, every [`STRIDE`]th of them.
    points: [Vec<usize>; 3],
}

/// What holds of the faces behind it.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Mark {
    /// The name of a group or an object.
    Group(String),
    /// The name of their material.
    Material(String),
}

/// Counts of points, by their kind, and of faces.
#[derive(Clone, Copy, Default)]
pub(super) struct Counts {
    pub points: [usize; 3],
    pub faces: usize,
}

/// The kinds of points: keyword and name.
pub(super) const KINDS: [(&str, &str); 3] = [("v", "vertex"), ("vt", "texture coordinate"), ("vn", "normal")];

/// The kind of point that a statement of this keyword is.
pub(super) fn kind_of(keyword: &str) -> Option<usize> {
    KINDS.iter().position(|(known, _)| *known == keyword)
}

/// Decodes text: UTF-8, with `�` for what isn't; UTF-16 and binary files are refused.
pub(super) fn decode<'a>(path: &Path, bytes: &'a [u8]) -> Result<Cow<'a, str>, SceneError> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) || bytes.contains(&0) {
        let line = 1 + bytes.iter().take_while(|&&byte| byte != 0).filter(|&&byte| byte == b'\n').count();
        let error = SceneError::invalid("this is not a plain text file", "save it as UTF-8 or ASCII text");
        return Err(error.in_file(path).at_line(line));
    }
    Ok(String::from_utf8_lossy(bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes)))
}

/// A statement of an OBJ or MTL text, without comments, with continued lines joined.
pub(super) struct Statement<'a> {
    /// Where in the text it begins.
    pub at: usize,
    /// The line in which it begins, counted from 1.
    pub line: usize,
    pub text: Cow<'a, str>,
}

/// The statements of an OBJ or MTL text.
pub(super) fn statements(text: &str) -> impl Iterator<Item = Statement<'_>> {
    let mut lines = text.split_inclusive('\n');
    let (mut end, mut line) = (0, 0);
    let mut next_line = move || {
        let whole = lines.next()?;
        (end, line) = (end + whole.len(), line + 1);
        Some((end - whole.len(), line, without_comment(whole)))
    };
    std::iter::from_fn(move || {
        loop {
            let (at, line, first) = next_line()?;
            let Some(body) = continued(first) else {
                let text = first.trim();
                if text.is_empty() {
                    continue;
                }
                return Some(Statement { at, line, text: Cow::Borrowed(text) });
            };
            let mut whole = body.to_owned();
            while let Some((_, _, more)) = next_line() {
                whole.push(' ');
                whole.push_str(continued(more).unwrap_or(more));
                if continued(more).is_none() {
                    break;
                }
            }
            if !whole.trim().is_empty() {
                return Some(Statement { at, line, text: Cow::Owned(whole.trim().to_owned()) });
            }
        }
    })
}

/// What a line says that goes on in the next one.
fn continued(line: &str) -> Option<&str> {
    line.trim_end().strip_suffix('\\')
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

/// Checks an OBJ text, and finds where everything is.
pub(super) fn check<'a>(path: &Path, text: &'a str) -> Result<Source<'a>, SceneError> {
    let pieces = cut(text);
    let mut source = Source::default();
    for together in pieces.chunks(4 * rayon::current_num_threads()) {
        let found: Vec<_> = together.par_iter().map(|&(piece, lines)| check_piece(piece, lines)).collect();
        for found in found {
            source.join(found.map_err(|error| error.in_file(path))?);
        }
        progress::report(Activity::Reading, CHECKING * source.pieces.len() as f64 / pieces.len() as f64);
    }
    if source.total.points.iter().any(|&count| count >= u32::MAX as usize) {
        return Err(SceneError::invalid("there are more than 2³² vertices", "divide the file").in_file(path));
    }
    Ok(source)
}

/// The text in pieces of whole statements, each with the number of lines before it.
fn cut(text: &str) -> Vec<(&str, usize)> {
    let mut pieces = Vec::new();
    let (mut rest, mut lines) = (text, 0);
    while !rest.is_empty() {
        let (piece, after) = rest.split_at(end_of_piece(rest.as_bytes()));
        pieces.push((piece, lines));
        lines += piece.bytes().filter(|&byte| byte == b'\n').count();
        rest = after;
    }
    pieces
}

fn end_of_piece(rest: &[u8]) -> usize {
    if rest.len() <= PIECE {
        return rest.len();
    }
    // A statement surely ends where a line does that has no backslash.
    let mut from = rest[..PIECE].iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
    loop {
        let Some(length) = rest[from..].iter().position(|&byte| byte == b'\n') else { return rest.len() };
        let line = from..from + length;
        from = line.end + 1;
        if !rest[line].contains(&b'\\') {
            return from;
        }
    }
}

fn check_piece(text: &str, lines: usize) -> Result<Source<'_>, SceneError> {
    let mut source = Source::default();
    let mut piece = Piece { text, lines, ..Piece::default() };
    for statement in statements(text) {
        let line = lines + statement.line;
        let (keyword, rest) = split(&statement.text);
        if let Some(kind) = kind_of(keyword) {
            if source.total.points[kind] % STRIDE == 0 {
                piece.points[kind].push(statement.at);
            }
            source.total.points[kind] += 1;
            if check_point(kind, rest).map_err(|error| error.at_line(line))? {
                source.ignore("vertex colours", line);
            }
            continue;
        }
        match keyword {
            "f" => source.total.faces += 1,
            "o" | "g" => source.marks.push((source.total.faces, Mark::Group(rest.to_owned()))),
            "usemtl" => {
                source.materials.entry(rest.to_owned()).or_insert(line);
                source.marks.push((source.total.faces, Mark::Material(rest.to_owned())));
            }
            "mtllib" => source.libraries.push((line, rest.to_owned())),
            "s" => source.smoothing.push((source.total.faces, smoothing_group(rest))),
            other => source.ignore(other, line),
        }
    }
    piece.faces = source.total.faces;
    source.pieces.push(piece);
    Ok(source)
}

impl Source<'_> {
    fn ignore(&mut self, what: &str, line: usize) {
        let short: String = what.chars().take(24).collect();
        self.ignored.entry(short).or_insert((line, 0)).1 += 1;
    }

    /// Whether any face is in a smoothing group.
    pub fn smooths(&self) -> bool {
        self.smoothing.iter().any(|(_, group)| *group != 0)
    }

    /// The smoothing group of a face, 0 for none.
    pub fn smoothing_of(&self, face: usize) -> u32 {
        let behind = self.smoothing.partition_point(|(before, _)| *before <= face);
        behind.checked_sub(1).map_or(0, |last| self.smoothing[last].1)
    }

    /// Writes a point of this number, counted from 1, in the plain dialect; number 0 is the zero that stands for none.
    pub fn write_point(&self, out: &mut String, kind: usize, number: u32) {
        let (keyword, words) = (KINDS[kind].0, if kind == 1 { 2 } else { 3 });
        let statement = number.checked_sub(1).map(|index| self.point(kind, index as usize));
        let given = statement.as_ref().map_or("", |statement| split(&statement.text).1);
        out.push_str(keyword);
        for word in given.split_whitespace().chain(["0"; 3]).take(words) {
            out.push(' ');
            out.push_str(word);
        }
        out.push('\n');
    }

    /// The statement of a point, counted from 0.
    fn point(&self, kind: usize, index: usize) -> Statement<'_> {
        let behind = self.pieces.partition_point(|piece| piece.before.points[kind] <= index);
        let piece = &self.pieces[behind - 1];
        let within = index - piece.before.points[kind];
        let text = &piece.text[piece.points[kind][within / STRIDE]..];
        let mut points = statements(text).filter(|statement| kind_of(split(&statement.text).0) == Some(kind));
        points.nth(within % STRIDE).expect("it was counted")
    }
}

impl<'a> Source<'a> {
    /// Adds what follows it in the file.
    fn join(&mut self, next: Source<'a>) {
        self.pieces.extend(next.pieces.into_iter().map(|piece| Piece { before: self.total, ..piece }));
        self.marks.extend(next.marks.into_iter().map(|(face, mark)| (self.total.faces + face, mark)));
        self.smoothing.extend(next.smoothing.into_iter().map(|(face, group)| (self.total.faces + face, group)));
        self.libraries.extend(next.libraries);
        for (name, line) in next.materials {
            self.materials.entry(name).or_insert(line);
        }
        for (what, (line, count)) in next.ignored {
            self.ignored.entry(what).or_insert((line, 0)).1 += count;
        }
        self.total.points.iter_mut().zip(next.total.points).for_each(|(sum, count)| *sum += count);
        self.total.faces += next.total.faces;
    }
}

/// The number of a smoothing group: 0 is `off`, and any other word is one group.
fn smoothing_group(word: &str) -> u32 {
    if word == "off" || word.is_empty() { 0 } else { word.parse().unwrap_or(1) }
}

/// Says what is wrong with a position, a texture coordinate or a normal; true if there is a colour behind it.
fn check_point(kind: usize, rest: &str) -> Result<bool, SceneError> {
    let (keyword, name) = KINDS[kind];
    let mut count = 0;
    for word in rest.split_whitespace() {
        number(word, name)?;
        count += 1;
    }
    let needed = if kind == 1 { 1 } else { 3 };
    if count < needed {
        let message = format!("`{keyword} {rest}` has {count} numbers");
        return Err(SceneError::invalid(message, format!("a {name} needs {needed}")));
    }
    Ok(kind == 0 && count >= 6)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statements_are_whole_lines() {
        let text = " v 1 # one\r\n\n#\\\nf 1 \\ \n 2\\\n# three\n 4\n\\\n \nend \\";
        let found: Vec<_> = statements(text).map(|s| (s.at, s.line, s.text.into_owned())).collect();
        let expected = [(0, 1, "v 1"), (16, 4, "f 1   2"), (35, 7, "4"), (42, 10, "end")];
        assert_eq!(found, expected.map(|(at, line, text)| (at, line, text.to_owned())));
    }

    #[test]
    fn points_are_found_in_any_piece() {
        let mut text = String::new();
        for i in 0..40_000 {
            text += &format!("v {i} 0 0 # {i}\nvt {i}\n{}", if i % 3 == 0 { "vn 0 \\\n 0 1\n" } else { "" });
        }
        let source = check(Path::new("a.obj"), &text).unwrap();
        assert!(source.pieces.len() > 3);
        assert_eq!(source.total.points, [40_000, 40_000, 13_334]);
        let mut out = String::new();
        [1, 2, 3, 4, 5, 20_000, 40_000].iter().for_each(|&i| source.write_point(&mut out, 0, i));
        [40_000, 0].iter().for_each(|&i| source.write_point(&mut out, 1, i));
        source.write_point(&mut out, 2, 13_334);
        let points = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nv 4 0 0\nv 19999 0 0\nv 39999 0 0\n";
        assert_eq!(out, format!("{points}vt 39999 0\nvt 0 0\nvn 0 0 1\n"));
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
