//! The faces of an OBJ file as they are written: which position, texture coordinate and normal each corner has.

use std::fmt::Write as _;

use super::source::{Counts, KINDS, Mark, Piece, Source, kind_of, split, statements};
use crate::error::SceneError;

/// A corner's position, texture coordinate and normal, counted from 1; 0 where it has none.
pub(super) type Corner = [u32; 3];

/// Faces of one group and material, which follow one another.
#[derive(Debug, PartialEq)]
pub(super) struct Run<'a> {
    /// The name of the group.
    pub name: &'a str,
    pub material: Option<&'a str>,
    /// Its first face.
    pub first: usize,
}

/// The faces by group and material. To name the material again that there is already begins nothing; to name a group does.
pub(super) fn runs<'a>(source: &'a Source) -> Vec<Run<'a>> {
    let (mut name, mut material, mut first) = ("", None, 0);
    let mut runs = Vec::new();
    let marks = source.marks.iter().map(|(face, mark)| (*face, Some(mark)));
    for (face, mark) in marks.chain([(source.total.faces, None)]) {
        if face > first && !matches!(mark, Some(Mark::Material(other)) if material == Some(other.as_str())) {
            runs.push(Run { name: if name.is_empty() { "unnamed_object" } else { name }, material, first });
            first = face;
        }
        match mark {
            Some(Mark::Group(group)) => name = group,
            Some(Mark::Material(other)) => material = Some(other.as_str()),
            None => {}
        }
    }
    runs
}

/// A piece of a file as an OBJ of its own.
pub(super) struct Extract {
    /// The points that faces use, and the faces, in a group for each run, named by its number. Every corner names a position, and a
    /// texture coordinate and a normal if the file has any at all.
    pub text: String,
    /// All corners of the faces, numbered as in the file.
    pub corners: Vec<Corner>,
}

/// Extracts the faces of a piece, which has some, and checks what they name.
pub(super) fn extract(source: &Source, piece: &Piece, runs: &[Run]) -> Result<Extract, SceneError> {
    let (corners, arities) = read_faces(source, piece)?;
    let used: [Vec<u32>; 3] = std::array::from_fn(|kind| match source.total.points[kind] {
        0 => Vec::new(),
        _ => in_order(corners.iter().map(|corner| corner[kind]).collect()),
    });
    let mut text = String::new();
    for (kind, used) in used.iter().enumerate() {
        used.iter().for_each(|&number| source.write_point(&mut text, kind, number));
    }
    // Each run has a face.
    let mut run = runs.partition_point(|run| run.first <= piece.before.faces) - 1;
    _ = writeln!(text, "g {run}");
    let mut rest = corners.as_slice();
    for (face, arity) in (piece.before.faces..).zip(arities) {
        if runs.get(run + 1).is_some_and(|next| next.first <= face) {
            run += 1;
            _ = writeln!(text, "g {run}");
        }
        let (own, after) = rest.split_at(arity);
        rest = after;
        write_face(&mut text, own, &used);
    }
    Ok(Extract { text, corners })
}

/// The corners of all faces, and how many each face has.
fn read_faces(source: &Source, piece: &Piece) -> Result<(Vec<Corner>, Vec<usize>), SceneError> {
    let (mut corners, mut arities) = (Vec::new(), Vec::with_capacity(piece.faces));
    let mut so_far = piece.before;
    for statement in statements(piece.text) {
        let (keyword, rest) = split(&statement.text);
        if let Some(kind) = kind_of(keyword) {
            so_far.points[kind] += 1;
        } else if keyword == "f" {
            let first = corners.len();
            let at_line = |error: SceneError| error.at_line(piece.lines + statement.line);
            for corner in rest.split_whitespace() {
                corners.push(read_corner(corner, &source.total, &so_far).map_err(at_line)?);
            }
            let arity = corners.len() - first;
            if arity < 3 {
                let message = format!("the face `f {rest}` has {arity} corners");
                return Err(at_line(SceneError::invalid(message, "a face has at least 3")));
            }
            arities.push(arity);
        }
    }
    Ok((corners, arities))
}

fn in_order(mut numbers: Vec<u32>) -> Vec<u32> {
    numbers.sort_unstable();
    numbers.dedup();
    numbers
}

/// Writes a face whose corners are numbered by their place among the points that are used.
fn write_face(text: &mut String, corners: &[Corner], used: &[Vec<u32>; 3]) {
    text.push('f');
    for corner in corners {
        let place = |kind: usize| used[kind].partition_point(|&number| number < corner[kind]) + 1;
        _ = match (used[1].is_empty(), used[2].is_empty()) {
            (true, true) => write!(text, " {}", place(0)),
            (false, true) => write!(text, " {}/{}", place(0), place(1)),
            (true, false) => write!(text, " {}//{}", place(0), place(2)),
            (false, false) => write!(text, " {}/{}/{}", place(0), place(1), place(2)),
        };
    }
    text.push('\n');
}

fn read_corner(text: &str, total: &Counts, so_far: &Counts) -> Result<Corner, SceneError> {
    let wrong =
        |what: &str| Err(SceneError::invalid(format!("the corner `{text}` {what}"), "write v, v/vt, v//vn or v/vt/vn"));
    let mut parts = text.split('/');
    let mut corner = [0; 3];
    for (kind, number) in corner.iter_mut().enumerate() {
        *number = index(parts.next().unwrap_or(""), kind, total, so_far)?;
        if kind == 0 && *number == 0 {
            return wrong("names no vertex");
        }
    }
    if parts.next().is_some() { wrong("has too many parts") } else { Ok(corner) }
}

/// The index counted from 1, 0 where there is none; negative ones count back from the last defined so far.
fn index(word: &str, kind: usize, total: &Counts, so_far: &Counts) -> Result<u32, SceneError> {
    if word.is_empty() {
        return Ok(0);
    }
    let name = KINDS[kind].1;
    let Ok(given) = word.parse::<i64>() else {
        return Err(SceneError::invalid(format!("the {name} index `{word}` is not a whole number"), "give one"));
    };
    let absolute = if given < 0 { so_far.points[kind] as i64 + 1 + given } else { given };
    if absolute < 1 || absolute > total.points[kind] as i64 {
        let message = format!("there is no {name} {given}");
        let mend = match total.points[kind] {
            0 => format!("the file defines none; add `{}` lines or leave the index out", KINDS[kind].0),
            n if given < 0 => {
                format!(
                    "{} of {n} are defined before this line, so -{} is the lowest",
                    so_far.points[kind], so_far.points[kind]
                )
            }
            n => format!("the file defines {n}, counted from 1"),
        };
        return Err(SceneError::invalid(message, mend));
    }
    Ok(absolute as u32)
}

#[cfg(test)]
mod tests {
    use super::super::obj::Model;
    use super::super::source::check;
    use super::*;
    use std::path::Path;

    fn fault(text: &str) -> String {
        match Model::read(Path::new("a.obj"), text.as_bytes()) {
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
        ];
        for (bad, expected) in cases {
            let message = fault(&format!("{vertices}{bad}\nf 1 2 3\n"));
            assert!(message.starts_with(expected), "{bad}: {message}");
        }
    }

    #[test]
    fn the_dialect_is_plain() {
        let text = "\tv 0 0 0 1 0 0 # red\nv 9 9 9\nv 1 0 0\nv 0 1 \\\n 0\nvn 0 0 1\nf -4 -2//1 \\\n -1\nusemtl\ta b\ng x\nf 1 3 4 2\nl 1 2\n";
        let source = check(Path::new("a.obj"), text).unwrap();
        assert_eq!(source.materials["a b"], 9);
        assert_eq!(source.ignored["l"], (12, 1));
        assert_eq!(source.ignored["vertex colours"], (1, 1));
        let runs = runs(&source);
        let expected = [("unnamed_object", None, 0), ("x", Some("a b"), 1)];
        assert_eq!(runs, expected.map(|(name, material, first)| Run { name, material, first }));
        let extracted = extract(&source, &source.pieces[0], &runs).unwrap();
        let points = "v 0 0 0\nv 9 9 9\nv 1 0 0\nv 0 1 0\nvn 0 0 0\nvn 0 0 1\n";
        assert_eq!(extracted.text, format!("{points}g 0\nf 1//1 3//2 4//1\ng 1\nf 1//1 3//1 4//1 2//1\n"));
        assert_eq!(extracted.corners[..3], [[1, 0, 0], [3, 0, 1], [4, 0, 0]]);
    }

    #[test]
    fn groups_and_materials_divide_faces() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\ng a\ng b\nusemtl m\nf 1 2 3\nusemtl m\nf 1 2 3\ng b\nf 1 2 3\nusemtl n\nusemtl m\nf 1 2 3\nusemtl n\nf 1 2 3\no\n";
        let source = check(Path::new("a.obj"), text).unwrap();
        let found: Vec<_> = runs(&source).iter().map(|run| (run.name, run.material.unwrap(), run.first)).collect();
        // tobj divides likewise: a change of material and back, with no face between, begins a group too.
        assert_eq!(found, [("b", "m", 0), ("b", "m", 2), ("b", "m", 3), ("b", "n", 4)]);
    }
}
