//! How expressions are read: a recursive descent, in which every fault is told at its place.
//!
//! ```text
//! choice   = sequence ('|' sequence)*
//! sequence = repeated+
//! repeated = primary ('*' | '+' | '?' | '{' n '}' | '{' n ',' '}' | '{' n ',' m '}')?
//! primary  = 'C' | 'E' | '(' choice ')' | item
//! item     = [RTVDGS.] | name | 'L' name? | '<' item+ '>' | '[' '^'? item+ ']'
//! ```

use super::error::ParseError;
use super::expression::{Node, Notation, Sort, Vertex};
use super::vertex::{Description, MAX_TERMS};
use super::{Event, MAX_DEPTH, MAX_LENGTH, MAX_NAMES, MAX_REPEAT, Scattering};

/// An expression as it was written.
pub(super) struct Parsed {
    pub notation: Notation,
    pub names: Vec<String>,
    /// In the order of the text.
    pub root: Node,
}

/// Reads the text, and leaves it open whether its words are paths.
pub(super) fn parse(text: &str) -> Result<Parsed, ParseError> {
    if text.len() > MAX_LENGTH {
        let message =
            format!("this is {} bytes long, and an expression may have {MAX_LENGTH}; write several", text.len());
        return Err(ParseError::new(text, text.floor_char_boundary(MAX_LENGTH), message));
    }
    let mut parser = Parser { text, at: 0, notation: notation(text)?, names: Vec::new(), depth: 0 };
    if parser.peek().is_none() {
        let message = "there is no expression here; write one such as `C.*L`, which is all light";
        return parser.fault(0, message);
    }
    let root = parser.choice()?;
    match parser.peek() {
        None => Ok(Parsed { notation: parser.notation, names: parser.names, root }),
        _ => parser.fault(parser.at, "this `)` closes nothing; leave it out, or write `(` where the group begins"),
    }
}

/// An `E` that stands in no name is the lecture's eye.
fn notation(text: &str) -> Result<Notation, ParseError> {
    let mut quote = None;
    let (mut eye, mut camera) = (None, None);
    for (i, c) in text.char_indices() {
        match (quote, c) {
            (None, '\'' | '"') => quote = Some(c),
            (None, 'E') => eye = eye.or(Some(i)),
            (None, 'C') => camera = camera.or(Some(i)),
            (Some(open), _) if c == open => quote = None,
            _ => {}
        }
    }
    if let (Some(eye), Some(camera)) = (eye, camera) {
        let message = "an expression runs from the camera `C` to the light `L`, or, in the lecture's notation, from `L` to the \
                       eye `E`; write one of `C` and `E`";
        return Err(ParseError::new(text, eye.max(camera), message));
    }
    Ok(if eye.is_some() { Notation::Lecture } else { Notation::Production })
}

/// What is said about one vertex; the sort is `None` where it may be a scattering's or a light's.
struct Item {
    sort: Option<Sort>,
    what: Description,
}

struct Parser<'a> {
    text: &'a str,
    at: usize,
    notation: Notation,
    names: Vec<String>,
    depth: usize,
}

const LETTERS: &str = "a vertex is a letter (`D` diffuse, `G` glossy, `S` specular, `R` reflection, `T` transmission, `V` through a body, \
                       `.` any, `L` light), a name in quotes, or more in `< >` or `[ ]`";
const LECTURE_LETTERS: &str =
    "the lecture's notation, from `L` to the eye `E`, has the vertices `D`, `S` and `.` alone";

impl Parser<'_> {
    fn fault<T>(&self, at: usize, message: impl Into<String>) -> Result<T, ParseError> {
        Err(ParseError::new(self.text, at, message))
    }

    /// The next character that is no white space, which becomes the place.
    fn peek(&mut self) -> Option<char> {
        let rest = self.text[self.at..].trim_start();
        self.at = self.text.len() - rest.len();
        rest.chars().next()
    }

    fn take(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(wanted);
        self.at += if found { wanted.len_utf8() } else { 0 };
        found
    }

    fn nested<T>(&mut self, inner: impl FnOnce(&mut Self) -> Result<T, ParseError>) -> Result<T, ParseError> {
        if self.depth == MAX_DEPTH {
            return self.fault(self.at - 1, format!("brackets may be nested {MAX_DEPTH} deep; write this with fewer"));
        }
        self.depth += 1;
        let result = inner(self)?;
        self.depth -= 1;
        Ok(result)
    }

    fn choice(&mut self) -> Result<Node, ParseError> {
        let mut parts = vec![self.sequence()?];
        while self.take('|') {
            parts.push(self.sequence()?);
        }
        Ok(if parts.len() == 1 { parts.remove(0) } else { Node::Choice(parts) })
    }

    fn sequence(&mut self) -> Result<Node, ParseError> {
        let mut parts = Vec::new();
        while self.peek().is_some_and(|c| c != '|' && c != ')') {
            parts.push(self.repeated()?);
        }
        match parts.len() {
            0 => self
                .fault(self.at, "a vertex is missing here; what may be left out is written with `?`, as in `(D|S)?`"),
            1 => Ok(parts.remove(0)),
            _ => Ok(Node::Sequence(parts)),
        }
    }

    fn repeated(&mut self) -> Result<Node, ParseError> {
        let body = self.primary()?;
        let (least, most) = match self.peek() {
            Some('*') => (0, None),
            Some('+') => (1, None),
            Some('?') => (0, Some(1)),
            Some('{') => self.counts()?,
            _ => return Ok(body),
        };
        self.at += 1;
        if matches!(self.peek(), Some('*' | '+' | '?' | '{')) {
            return self.fault(
                self.at,
                "here one repetition follows another; put what the first one repeats in ( ), as in `(D+)?`",
            );
        }
        Ok(Node::Repeat { body: Box::new(body), least, most })
    }

    /// The numbers after `{`, up to the closing bracket.
    fn counts(&mut self) -> Result<(usize, Option<usize>), ParseError> {
        const FORMS: &str = "a repetition is `{2}`, `{2,}` or `{2,5}`";
        let open = self.at;
        self.at += 1;
        let Some(least) = self.number()? else {
            return self.fault(self.at, format!("a number is missing here: {FORMS}"));
        };
        let most = if self.take(',') { self.number()? } else { Some(least) };
        if self.peek() != Some('}') {
            return self.fault(self.at, format!("here `{{` should be closed: {FORMS}"));
        }
        match most {
            Some(0) => self.fault(open, "nothing is left of what is repeated no times; leave it out"),
            Some(most) if most < least => {
                self.fault(open, format!("from {least} to {most} is backwards; write `{{{most},{least}}}`"))
            }
            _ => Ok((least, most)),
        }
    }

    fn number(&mut self) -> Result<Option<usize>, ParseError> {
        self.peek();
        let rest = &self.text[self.at..];
        let digits = &rest[..rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len())];
        if digits.is_empty() {
            return Ok(None);
        }
        match digits.parse() {
            Ok(number) if number <= MAX_REPEAT => {
                self.at += digits.len();
                Ok(Some(number))
            }
            _ => self.fault(
                self.at,
                format!("a repetition counts to {MAX_REPEAT} at most; for more write `{{{MAX_REPEAT},}}`"),
            ),
        }
    }

    fn primary(&mut self) -> Result<Node, ParseError> {
        let next = self.peek();
        let at = self.at;
        match next {
            Some('(') => {
                self.at += 1;
                let inner = self.nested(Self::choice)?;
                match self.take(')') {
                    true => Ok(inner),
                    false => self.fault(at, "this `(` is never closed; write `)` where the group ends"),
                }
            }
            Some('C' | 'E') => {
                self.at += 1;
                Ok(Node::Vertex(Vertex { sort: Sort::Camera, what: Description::any(), at }))
            }
            _ => {
                let Item { sort, what } = self.item()?;
                Ok(Node::Vertex(Vertex { sort: sort.unwrap_or(Sort::Scattering), what, at }))
            }
        }
    }

    fn item(&mut self) -> Result<Item, ParseError> {
        let next = self.peek();
        let at = self.at;
        if self.notation == Notation::Lecture && matches!(next, Some('R' | 'T' | 'V' | 'G' | '<' | '[' | '\'' | '"')) {
            return self
                .fault(at, format!("{LECTURE_LETTERS}; for more, write the expression from the camera `C` to `L`"));
        }
        self.at += next.map_or(0, char::len_utf8);
        let of = |what| Ok(Item { sort: Some(Sort::Scattering), what });
        match next {
            Some('R') => of(Description::event(Event::Reflection)),
            Some('T') => of(Description::event(Event::Transmission)),
            Some('V') => of(Description::event(Event::Volume)),
            Some('G') => of(Description::scattering(Scattering::Glossy)),
            Some('S') => of(Description::scattering(Scattering::Specular)),
            Some('D') if self.notation == Notation::Lecture => {
                let rough = Description::scattering(Scattering::Specular).not();
                of(self.bounded(rough, at)?)
            }
            Some('D') => of(Description::scattering(Scattering::Diffuse)),
            Some('.') => Ok(Item { sort: None, what: Description::any() }),
            Some('L') => self.light(),
            Some('\'' | '"') => Ok(Item { sort: None, what: self.name(at)? }),
            Some('<') => self.nested(|parser| parser.conjunction(at)),
            Some('[') => self.nested(|parser| parser.set(at)),
            other => self.unexpected(other, at),
        }
    }

    fn unexpected<T>(&self, found: Option<char>, at: usize) -> Result<T, ParseError> {
        let message = match found {
            None => "a vertex is missing here".to_owned(),
            Some('C' | 'E') => "the camera stands alone: it is the end of a path and in no `< >` or `[ ]`".to_owned(),
            Some(c @ ('*' | '+' | '?' | '{')) => format!("`{c}` repeats what stands before it, and here nothing does"),
            Some(c @ ('>' | ']' | '}')) => format!("this `{c}` closes nothing; leave it out"),
            Some('^') => "`^` stands only at the beginning of a set, as in `[^'floor']`".to_owned(),
            Some(c @ ('(' | ')' | '|')) => {
                format!("in `< >` and `[ ]`, which are one vertex, there is no `{c}`; write `[ ]` for a choice")
            }
            Some(c) if c.is_lowercase() && "cdgslertv".contains(c) => {
                format!("`{c}` is no vertex; letters are capitals: write `{}`", c.to_uppercase())
            }
            Some(c) => {
                let letters = if self.notation == Notation::Lecture { LECTURE_LETTERS } else { LETTERS };
                format!("`{}` is no vertex; {letters}", c.escape_debug())
            }
        };
        self.fault(at, message)
    }

    fn light(&mut self) -> Result<Item, ParseError> {
        let mut what = Description::any();
        if self.notation == Notation::Production && matches!(self.peek(), Some('\'' | '"')) {
            let at = self.at;
            self.at += 1;
            what = self.name(at)?;
        }
        Ok(Item { sort: Some(Sort::Light), what })
    }

    /// A name whose opening quote stands at `open` and was read.
    fn name(&mut self, open: usize) -> Result<Description, ParseError> {
        let quote = &self.text[open..self.at];
        let Some(length) = self.text[self.at..].find(quote) else {
            return self.fault(open, format!("this name is never closed; write {quote} where it ends"));
        };
        let name = &self.text[self.at..self.at + length];
        if name.is_empty() {
            return self.fault(open, "a name has at least one character; for any vertex write `.`");
        }
        self.at += length + quote.len();
        let known = self.names.iter().position(|n| n == name);
        let index = known.unwrap_or(self.names.len());
        if known.is_none() {
            if index == MAX_NAMES {
                return self
                    .fault(open, format!("an expression may mention {MAX_NAMES} names; write several expressions"));
            }
            self.names.push(name.to_owned());
        }
        Ok(Description::name(index))
    }

    /// What stands in `< >`: all of it holds.
    fn conjunction(&mut self, open: usize) -> Result<Item, ParseError> {
        let mut all = Item { sort: None, what: Description::any() };
        let mut empty = true;
        while !self.take('>') {
            let (at, item) = self.part(open)?;
            if item.sort.is_some() && all.sort.is_some() && item.sort != all.sort {
                return self
                    .fault(at, "a light is a vertex of its own, which scatters nothing; write it after the `>`");
            }
            all.sort = all.sort.or(item.sort);
            all.what = self.bounded(all.what.and(&item.what), open)?;
            if all.what.is_none() {
                let message =
                    "no vertex is this and also what stands before it; for a choice write `[ ]`, as in `<[RT]S>`";
                return self.fault(at, message);
            }
            empty = false;
        }
        match empty {
            true => self.fault(open, "nothing is said here about the vertex; for any write `.`"),
            false => Ok(all),
        }
    }

    /// What stands in `[ ]`: any of it holds, or none after `^`.
    fn set(&mut self, open: usize) -> Result<Item, ParseError> {
        let negated = self.take('^');
        let mut any: Option<Item> = None;
        while !self.take(']') {
            let (at, item) = self.part(open)?;
            let before = any.unwrap_or(Item { sort: item.sort, what: Description::none() });
            let light = |sort| sort == Some(Sort::Light);
            if light(before.sort) != light(item.sort) {
                return self
                    .fault(at, "a set holds lights, or what is no light, but not both; write a choice, as in `(D|L)`");
            }
            let what = self.bounded(before.what.or(&item.what), open)?;
            any = Some(Item { sort: before.sort.or(item.sort), what });
        }
        let Some(any) = any else { return self.fault(open, "this set is empty; for any vertex write `.`") };
        if !negated {
            return Ok(any);
        }
        let what = self.bounded(any.what.not(), open)?;
        match what.is_none() {
            true => self.fault(open, "this set leaves no vertex; leave something out of it"),
            false => Ok(Item { what, ..any }),
        }
    }

    /// The next item of a bracket that opened at `open`, and where it stands.
    fn part(&mut self, open: usize) -> Result<(usize, Item), ParseError> {
        let bracket = &self.text[open..=open];
        match self.peek() {
            None => self.fault(open, format!("this `{bracket}` is never closed")),
            Some(_) => Ok((self.at, self.item()?)),
        }
    }

    fn bounded(&self, what: Option<Description>, at: usize) -> Result<Description, ParseError> {
        let message = || {
            format!(
                "this vertex amounts to more than {MAX_TERMS} alternatives; write it with fewer names, or several expressions"
            )
        };
        what.ok_or_else(|| ParseError::new(self.text, at, message()))
    }
}
