//! `neumann lpe`: what light-path expressions mean, and whether each path belongs to one of them alone.

use crate::cli::{LpeArgs, print};
use crate::error::{Error, Status};
use integrators::lpe::{Classifier, Expression};
use std::fmt::Write;

/// How many paths of an expression are shown.
const EXAMPLES: usize = 3;

/// What `--json` prints.
#[derive(serde::Serialize)]
struct Report {
    expressions: Vec<Described>,
    /// States of all expressions' automaton, read from the camera and from the light.
    states: (usize, usize),
    disjoint: bool,
    overlap: Option<Overlap>,
    complete: bool,
    /// A path that belongs to none.
    gap: Option<String>,
}

/// One expression.
#[derive(serde::Serialize)]
struct Described {
    name: String,
    expression: String,
    notation: String,
    /// States of its automaton, read from the camera and from the light.
    states: (usize, usize),
    least_order: usize,
    /// Absent where there is none.
    greatest_order: Option<usize>,
    /// Shortest paths, from the camera to the light.
    paths: Vec<String>,
}

/// A path that two expressions share.
#[derive(serde::Serialize)]
struct Overlap {
    expressions: [String; 2],
    path: String,
}

/// Describes expressions.
///
/// # Errors
/// If one is none, or if they are too many or too large.
pub fn lpe(args: &LpeArgs) -> Result<Status, Error> {
    let mut named: Vec<(&str, Expression)> = Vec::new();
    for argument in &args.expressions {
        let (name, text) = split(argument);
        if named.iter().any(|(other, _)| *other == name) {
            return Err(Error::usage(format!("`{name}` is given twice; give each expression a name of its own")));
        }
        let expression = Expression::parse(text).map_err(|error| Error::usage(error.to_string()))?;
        named.push((name, expression));
    }
    let report = describe(named)?;
    let text = match args.json {
        true => serde_json::to_string_pretty(&report).unwrap_or_default() + "\n",
        false => in_words(&report),
    };
    print(&text)?;
    Ok(Status::Done)
}

/// Name and expression of `NAME=EXPR`; an expression without a name goes by its text.
fn split(argument: &str) -> (&str, &str) {
    let is_name = |text: &str| !text.is_empty() && text.chars().all(|c| c.is_alphanumeric() || c == '_' || c == '-');
    match argument.split_once('=') {
        Some((name, text)) if is_name(name) => (name, text),
        _ => (argument, argument),
    }
}

fn classifier(expressions: &[Expression]) -> Result<Classifier, Error> {
    Classifier::for_any_scene(expressions).map_err(|error| Error::usage(error.to_string()))
}

fn describe(named: Vec<(&str, Expression)>) -> Result<Report, Error> {
    let mut described = Vec::new();
    for (name, expression) in &named {
        let alone = classifier(std::slice::from_ref(expression))?;
        let (least_order, greatest_order) = expression.orders();
        described.push(Described {
            name: (*name).to_owned(),
            expression: expression.to_string(),
            notation: expression.notation().to_string(),
            states: alone.states(),
            least_order,
            greatest_order,
            paths: alone.examples(0, EXAMPLES).iter().map(ToString::to_string).collect(),
        });
    }
    let (names, expressions): (Vec<&str>, Vec<Expression>) = named.into_iter().unzip();
    let all = classifier(&expressions)?;
    let overlap = all.overlap().map(|(a, b, path)| Overlap {
        expressions: [names[a].to_owned(), names[b].to_owned()],
        path: path.to_string(),
    });
    let gap = all.gap().map(|path| path.to_string());
    let (disjoint, complete) = (overlap.is_none(), gap.is_none());
    Ok(Report { expressions: described, states: all.states(), disjoint, overlap, complete, gap })
}

fn in_words(report: &Report) -> String {
    let mut text = String::new();
    for expression in &report.expressions {
        let Described { name, notation, states, least_order, greatest_order, .. } = expression;
        let orders = match greatest_order {
            None => format!("{least_order} and above, without end"),
            Some(greatest) if greatest == least_order => least_order.to_string(),
            Some(greatest) => format!("{least_order} to {greatest}"),
        };
        let title =
            if *name == expression.expression { name.clone() } else { format!("{name} = {}", expression.expression) };
        let _ = writeln!(text, "{title}");
        let _ = writeln!(text, "  notation  {notation}");
        let _ = writeln!(text, "  states    {} from the camera, {} from the light", states.0, states.1);
        let _ = writeln!(text, "  orders    {orders}");
        let none = ["nothing in a scene where each surface and light goes by at most two names".to_owned()];
        let paths = if expression.paths.is_empty() { &none[..] } else { &expression.paths };
        for (i, path) in paths.iter().enumerate() {
            let _ = writeln!(text, "  {:<9} {path}", if i == 0 { "paths" } else { "" });
        }
        text.push('\n');
    }
    let states = report.states;
    let count = report.expressions.len();
    if count > 1 {
        let _ = writeln!(
            text,
            "All {count} together have {} states from the camera and {} from the light.",
            states.0, states.1
        );
        let _ = match &report.overlap {
            None => writeln!(text, "They are disjoint: no path belongs to two of them."),
            Some(Overlap { expressions: [a, b], path }) => {
                writeln!(text, "They are not disjoint: {a} and {b} share the path {path}.")
            }
        };
    }
    let _ = match (&report.gap, count > 1) {
        (None, true) => writeln!(text, "They are complete: every path belongs to one of them."),
        (None, false) => writeln!(text, "It is complete: every path belongs to it."),
        (Some(path), true) => writeln!(text, "They are not complete: none of them has the path {path}."),
        (Some(path), false) => writeln!(text, "It is not complete: it leaves out the path {path}."),
    };
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(arguments: &[&str]) -> String {
        let named = arguments.iter().map(|a| split(a)).map(|(name, text)| (name, Expression::parse(text).unwrap()));
        in_words(&describe(named.collect()).unwrap())
    }

    #[test]
    fn names_stand_before_an_equals_sign() {
        assert_eq!(split("caustic=CD+S+L"), ("caustic", "CD+S+L"));
        assert_eq!(split("CL"), ("CL", "CL"));
        assert_eq!(split("C'a=b'L"), ("C'a=b'L", "C'a=b'L"));
        assert_eq!(split("=CL"), ("=CL", "=CL"));
    }

    #[test]
    fn expressions_are_described() {
        let text = words(&["caustic=CD+S+L", "L(D|S)E"]);
        for line in [
            "caustic = CD+S+L",
            "  orders    2 and above, without end",
            "  paths     C <RD> <RS> L",
            "L(D|S)E\n  notation  lecture",
            "  orders    1\n",
            "They are disjoint: no path belongs to two of them.",
            "They are not complete: none of them has the path C L.",
        ] {
            assert!(text.contains(line), "{line} in:\n{text}");
        }
    }

    #[test]
    fn a_set_is_judged_as_a_whole() {
        let text = words(&["CL", "C[DG].*L", "CS.*L"]);
        assert!(
            text.ends_with("no path belongs to two of them.\nThey are complete: every path belongs to one of them.\n"),
            "{text}"
        );
        let text = words(&["a=C.L", "b=CD.*L"]);
        assert!(text.contains("not disjoint: a and b share the path C <RD> L."), "{text}");
        assert!(words(&["C.*L"]).ends_with("It is complete: every path belongs to it.\n"));
        assert!(words(&["C.L"]).ends_with("It is not complete: it leaves out the path C L.\n"));
        assert!(words(&["C<'a''b''c'>L"]).contains("nothing in a scene"));
    }
}
