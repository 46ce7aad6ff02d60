//! Expressions and their trees.

use super::error::ParseError;
use super::vertex::Description;
use super::{MAX_VERTICES, parse};
use std::fmt;

/// How an expression is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notation {
    /// From the camera `C` to the light `L`, as in `C<RD>.*L'key'`.
    Production,
    /// From the light `L` to the eye `E`, as in `L(D|S)*E`: `S` is a delta scattering, `D` any other \[Heckbert90\].
    Lecture,
}

impl fmt::Display for Notation {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Notation::Production => "production",
            Notation::Lecture => "lecture",
        })
    }
}

/// A set of paths: a regular language of which every word begins at the camera, ends at a light and has neither between.
/// It has at least one word.
#[derive(Clone, Debug)]
pub struct Expression {
    text: String,
    notation: Notation,
    names: Vec<String>,
    /// From the camera to the light, whatever the notation.
    root: Node,
}

impl Expression {
    /// Reads an expression.
    ///
    /// # Errors
    /// If it is none, or has words that are no paths; with the place and the mend.
    pub fn parse(text: &str) -> Result<Self, ParseError> {
        let parse::Parsed { notation, names, root } = parse::parse(text)?;
        let (first, last) = match notation {
            Notation::Production => (Sort::Camera, Sort::Light),
            Notation::Lecture => (Sort::Light, Sort::Camera),
        };
        root.check_ends(first, last, text, notation)?;
        let vertices = root.vertices();
        if vertices > MAX_VERTICES {
            let message = format!(
                "with its repetitions written out this expression has {vertices} vertices, and at most {MAX_VERTICES} are \
                 allowed; use smaller numbers in {{ }}"
            );
            return Err(ParseError::new(text, 0, message));
        }
        let root = if notation == Notation::Lecture { root.reversed() } else { root };
        Ok(Self { text: text.to_owned(), notation, names, root })
    }

    /// How it was written.
    pub fn notation(&self) -> Notation {
        self.notation
    }

    /// The names of surfaces and lights that it mentions, in the order of their first mention.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }

    /// The lowest and the highest order of its paths, that is, their scatterings; `None` where there is no highest.
    pub fn orders(&self) -> (usize, Option<usize>) {
        self.root.orders()
    }

    pub(super) fn root(&self) -> &Node {
        &self.root
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// What a vertex is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Sort {
    Camera,
    Scattering,
    Light,
}

/// One vertex; some vertex fits its description.
#[derive(Clone, Debug)]
pub(super) struct Vertex {
    pub sort: Sort,
    pub what: Description,
    /// The byte where it stands in the text.
    pub at: usize,
}

/// The tree of an expression. Every node has a word, because every vertex is possible.
#[derive(Clone, Debug)]
pub(super) enum Node {
    Vertex(Vertex),
    Sequence(Vec<Node>),
    Choice(Vec<Node>),
    Repeat {
        body: Box<Node>,
        least: usize,
        /// At least 1; `None` without end.
        most: Option<usize>,
    },
}

impl Node {
    /// The reversed language.
    pub fn reversed(&self) -> Self {
        match self {
            Node::Vertex(vertex) => Node::Vertex(vertex.clone()),
            Node::Sequence(parts) => Node::Sequence(parts.iter().rev().map(Node::reversed).collect()),
            Node::Choice(parts) => Node::Choice(parts.iter().map(Node::reversed).collect()),
            Node::Repeat { body, least, most } => {
                Node::Repeat { body: Box::new(body.reversed()), least: *least, most: *most }
            }
        }
    }

    /// The fewest and the most scatterings of a word.
    fn orders(&self) -> (usize, Option<usize>) {
        let sum = |a: usize, b: usize| a.saturating_add(b);
        match self {
            Node::Vertex(vertex) => {
                let order = usize::from(vertex.sort == Sort::Scattering);
                (order, Some(order))
            }
            Node::Sequence(parts) => parts
                .iter()
                .map(Node::orders)
                .fold((0, Some(0)), |(least, most), (l, m)| (sum(least, l), most.zip(m).map(|(a, b)| sum(a, b)))),
            Node::Choice(parts) => {
                parts.iter().map(Node::orders).fold((usize::MAX, Some(0)), |(least, most), (l, m)| {
                    (least.min(l), most.zip(m).map(|(a, b)| a.max(b)))
                })
            }
            Node::Repeat { body, least, most } => {
                let (l, m) = body.orders();
                (l.saturating_mul(*least), m.zip(*most).map(|(m, most)| m.saturating_mul(most)))
            }
        }
    }

    /// The vertices when repetitions are written out.
    fn vertices(&self) -> usize {
        match self {
            Node::Vertex(_) => 1,
            Node::Sequence(parts) | Node::Choice(parts) => {
                parts.iter().map(Node::vertices).fold(0, usize::saturating_add)
            }
            // Without end, the last copy goes round in a loop.
            Node::Repeat { body, least, most } => body.vertices().saturating_mul(most.unwrap_or((*least).max(1))),
        }
    }

    /// Whether all words begin with `first`, end with `last` and have neither between.
    fn check_ends(&self, first: Sort, last: Sort, text: &str, notation: Notation) -> Result<(), ParseError> {
        let ends = Ends { first, last };
        let fault = |at: usize, fault: Fault| Err(ParseError::new(text, at, fault.message(notation)));
        match ends.after(self, BEFORE) {
            Ok(AFTER) => Ok(()),
            // A sequence without an end stops within; nothing else is left to stand before the first vertex.
            Ok(_) => fault(text.trim_end().len(), Fault::NoEnd),
            Err((at, what)) => fault(at, what),
        }
    }
}

/// How far a word has come, as a set of bits: parts of an expression may have come differently far.
type Progress = u8;
const BEFORE: Progress = 1;
const WITHIN: Progress = 2;
const AFTER: Progress = 4;

/// What is wrong about a vertex where it stands.
#[derive(Clone, Copy)]
enum Fault {
    /// A word begins with something else.
    NoStart,
    /// The first vertex comes again.
    StartAgain,
    /// Something follows the last vertex.
    Beyond,
    /// A word stops before the last vertex.
    NoEnd,
}

impl Fault {
    fn message(self, notation: Notation) -> String {
        let (from, f, to, t) = match notation {
            Notation::Production => ("the camera", 'C', "a light", 'L'),
            Notation::Lecture => ("a light", 'L', "the eye", 'E'),
        };
        match self {
            Fault::NoStart => format!("every path begins at {from}: write `{f}` before this, as the first of all"),
            Fault::StartAgain => {
                format!(
                    "a path begins at {from} and never meets it again: leave this `{f}` out, or write what happens there"
                )
            }
            Fault::Beyond => {
                format!("every path ends at {to}, and here one goes on after `{t}`: write `{t}` last of all")
            }
            Fault::NoEnd => format!("every path ends at {to}: write `{t}` at the end"),
        }
    }
}

struct Ends {
    first: Sort,
    last: Sort,
}

impl Ends {
    /// How far words have come after a node that they had come so far before. Since every node has a word, a vertex that is
    /// met in a wrong place stands in a wrong place of some whole word.
    fn after(&self, node: &Node, before: Progress) -> Result<Progress, (usize, Fault)> {
        match node {
            Node::Vertex(vertex) => self.after_vertex(vertex, before),
            Node::Sequence(parts) => parts.iter().try_fold(before, |progress, part| self.after(part, progress)),
            Node::Choice(parts) => parts.iter().try_fold(0, |all, part| Ok(all | self.after(part, before)?)),
            Node::Repeat { body, least, most } => {
                let (mut progress, mut all) = (before, if *least == 0 { before } else { 0 });
                for turn in 1..=most.unwrap_or(usize::MAX) {
                    let next = self.after(body, progress)?;
                    // From here on every turn is like this one.
                    let settled = next == progress;
                    all |= if settled || turn >= *least { next } else { 0 };
                    if settled {
                        break;
                    }
                    progress = next;
                }
                Ok(all)
            }
        }
    }

    fn after_vertex(&self, vertex: &Vertex, before: Progress) -> Result<Progress, (usize, Fault)> {
        let fault = |what| Err((vertex.at, what));
        if before & AFTER != 0 {
            return fault(Fault::Beyond);
        }
        if vertex.sort == self.first {
            return if before == BEFORE { Ok(WITHIN) } else { fault(Fault::StartAgain) };
        }
        if before & BEFORE != 0 {
            return fault(Fault::NoStart);
        }
        Ok(if vertex.sort == self.last { AFTER } else { WITHIN })
    }
}
