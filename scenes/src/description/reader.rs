//! A TOML document whose values know their line: what every message of a scene file is made from.

use glam::DVec3;
use sampling::math::Spectrum;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::error::SceneError;
use crate::suggest::{did_you_mean, shown};

/// The largest magnitude of a coordinate \[m\]: beyond it squares of lengths no longer fit `f32`.
const MAX_COORDINATE: f64 = 1e15;
/// The largest component of a radiance or intensity: products along a path stay within `f32`.
const MAX_COLOUR: f64 = 1e30;

/// A scene file's text and the name it goes by in messages.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    /// Path or built-in name, as shown to the user.
    pub file: &'a str,
    /// The whole text.
    pub text: &'a str,
}

impl<'a> Source<'a> {
    /// Parses the text; a syntax error names its line.
    pub fn parse(&self) -> Result<Spanned<DeTable<'a>>, SceneError> {
        DeTable::parse(self.text).map_err(|error| {
            let at = error.span().map_or(0, |span| span.start);
            self.error(at, format!("this is not valid TOML: {}", error.message()), mend_of(error.message()))
        })
    }

    /// An error at byte `at` of the text.
    pub fn error(&self, at: usize, message: impl Into<String>, mend: impl Into<String>) -> SceneError {
        SceneError::invalid(message, mend).in_file(self.file).at_line(self.line(at))
    }

    /// Line of byte `at`, counted from 1.
    fn line(&self, at: usize) -> usize {
        let end = at.min(self.text.len());
        1 + self.text.as_bytes()[..end].iter().filter(|&&byte| byte == b'\n').count()
    }

    /// The text of a span, shortened to one line for a message.
    fn excerpt(&self, span: &Range<usize>) -> String {
        let text = self.text.get(span.clone()).unwrap_or("");
        let line = text.lines().next().unwrap_or("").trim();
        let short: String = line.chars().take(40).collect();
        if short.len() < text.trim().len() { format!("{short}…") } else { short }
    }
}

/// What mends a syntax error of which the parser says this.
fn mend_of(message: &str) -> &'static str {
    let is_open = message.starts_with("unclosed") || message.starts_with("invalid") && message.contains("string");
    match () {
        () if message.contains("duplicate") => "give each key once, and each table one heading",
        () if message.contains("must be quoted") => "write text in quotes: `key = \"text\"`",
        () if is_open => "close what is open: `[...]`, `{...}` or `\"...\"`",
        () => "write `key = value`, one to a line",
    }
}

/// A place of the text, and how many lines end before it.
#[derive(Clone, Copy, Default)]
pub(super) struct Line {
    at: usize,
    before: usize,
}

/// A table of the file, with the name it has in messages, such as `materials.white`.
#[derive(Clone)]
pub(super) struct Table<'a> {
    pub source: Source<'a>,
    pub name: String,
    entries: &'a DeTable<'a>,
    at: usize,
}

impl<'a> Table<'a> {
    /// The whole document.
    pub fn root(source: Source<'a>, document: &'a Spanned<DeTable<'a>>) -> Self {
        Table { source, name: String::new(), entries: document.get_ref(), at: 0 }
    }

    /// Refuses keys that are not in `valid`, naming the nearest of them.
    pub fn allow_only(&self, valid: &[&str]) -> Result<(), SceneError> {
        for (key, _) in self.entries.iter() {
            if !valid.contains(&key.get_ref().as_ref()) {
                let key_name = key.get_ref().as_ref();
                let place = if self.name.is_empty() { "a scene file".to_string() } else { format!("`{}`", self.name) };
                let message = format!("unknown key `{}` in {place}", shown(key_name));
                return Err(self.source.error(key.span().start, message, did_you_mean(key_name, valid)));
            }
        }
        Ok(())
    }

    /// The value of `key`, if it is there.
    pub fn get(&self, key: &str) -> Option<Value<'a>> {
        let (_, value) = self.entries.iter().find(|(k, _)| k.get_ref().as_ref() == key)?;
        Some(self.value(key, value))
    }

    /// The value of `key`; its absence is an error that shows an `example`.
    pub fn need(&self, key: &str, example: &str) -> Result<Value<'a>, SceneError> {
        self.get(key).ok_or_else(|| {
            self.error(format!("`{}` lacks `{key}`", self.name), format!("add for example `{key} = {example}`"))
        })
    }

    /// All keys and values, in the order of the file.
    pub fn entries(&self) -> Vec<(&'a str, Value<'a>)> {
        let mut entries: Vec<_> =
            self.entries.iter().map(|(key, value)| (key.span().start, key.get_ref().as_ref(), value)).collect();
        entries.sort_by_key(|&(at, ..)| at);
        entries.into_iter().map(|(_, key, value)| (key, self.value(key, value))).collect()
    }

    /// Where it begins, counted from 1 and on from an earlier table: there may be many.
    pub fn line_after(&self, earlier: &mut Line) -> usize {
        let from = if self.at < earlier.at { Line::default() } else { *earlier };
        let between = self.source.text.as_bytes().get(from.at..self.at).unwrap_or_default();
        let lines = between.iter().filter(|&&byte| byte == b'\n').count();
        *earlier = Line { at: self.at, before: from.before + lines };
        earlier.before + 1
    }

    /// An error at this table.
    pub fn error(&self, message: impl Into<String>, mend: impl Into<String>) -> SceneError {
        self.source.error(self.at, message, mend)
    }

    fn value(&self, key: &str, value: &'a Spanned<DeValue<'a>>) -> Value<'a> {
        let name = if self.name.is_empty() { key.to_string() } else { format!("{}.{key}", self.name) };
        Value { source: self.source, name, value }
    }
}

/// A value of the file, with its name for messages.
#[derive(Clone)]
pub(super) struct Value<'a> {
    pub source: Source<'a>,
    pub name: String,
    value: &'a Spanned<DeValue<'a>>,
}

impl<'a> Value<'a> {
    /// An error at this value: what it is, and what it must be.
    pub fn error(&self, mend: impl Into<String>) -> SceneError {
        let found = self.source.excerpt(&self.value.span());
        let found = if found.is_empty() { self.value.get_ref().type_str().to_string() } else { format!("`{found}`") };
        self.source.error(self.value.span().start, format!("`{}` is {found}", self.name), mend)
    }

    pub fn is_table(&self) -> bool {
        self.value.get_ref().is_table()
    }

    pub fn is_array(&self) -> bool {
        self.value.get_ref().is_array()
    }

    /// A table.
    pub fn table(&self) -> Result<Table<'a>, SceneError> {
        let entries = self.value.get_ref().as_table().ok_or_else(|| self.error("it must be a table"))?;
        Ok(Table { source: self.source, name: self.name.clone(), entries, at: self.value.span().start })
    }

    /// The elements of an array.
    pub fn array(&self) -> Result<Vec<Value<'a>>, SceneError> {
        let array = self.value.get_ref().as_array().ok_or_else(|| self.error("it must be an array, written in [ ]"))?;
        Ok(array
            .iter()
            .enumerate()
            .map(|(i, value)| Value { source: self.source, name: format!("{}[{i}]", self.name), value })
            .collect())
    }

    /// A text.
    pub fn text(&self) -> Result<&'a str, SceneError> {
        self.value.get_ref().as_str().ok_or_else(|| self.error("it must be a text in quotes"))
    }

    /// What a surface or an emitter goes by: a text of 1 to 100 characters that can be shown.
    pub fn label(&self) -> Result<&'a str, SceneError> {
        let text = self.text()?;
        match (1..=100).contains(&text.chars().count()) && !text.chars().any(char::is_control) {
            true => Ok(text),
            false => Err(self.error("a label has 1 to 100 characters, none of them a control character")),
        }
    }

    /// `true` or `false`.
    pub fn boolean(&self) -> Result<bool, SceneError> {
        self.value.get_ref().as_bool().ok_or_else(|| self.error("it must be true or false"))
    }

    /// A finite number.
    pub fn number(&self) -> Result<f64, SceneError> {
        let number = match self.value.get_ref() {
            DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64),
            DeValue::Float(float) => float.as_str().parse().ok(),
            _ => return Err(self.error("it must be a number")),
        };
        number.filter(|x: &f64| x.is_finite()).ok_or_else(|| self.error("it must be a finite number"))
    }

    /// A number within `range`, described by `what`.
    pub fn number_in(&self, range: std::ops::RangeInclusive<f64>, what: &str) -> Result<f64, SceneError> {
        let x = self.number()?;
        if range.contains(&x) { Ok(x) } else { Err(self.error(what)) }
    }

    /// A number above 0.
    pub fn positive(&self) -> Result<f64, SceneError> {
        let x = self.coordinate()?;
        if x > 0.0 && x as f32 > 0.0 { Ok(x) } else { Err(self.error("it must be above 0")) }
    }

    /// A length or coordinate \[m\].
    pub fn coordinate(&self) -> Result<f64, SceneError> {
        let range = -MAX_COORDINATE..=MAX_COORDINATE;
        self.number_in(range, &format!("its magnitude must be at most {MAX_COORDINATE:e}"))
    }

    /// A whole number.
    pub fn whole(&self) -> Result<i64, SceneError> {
        let DeValue::Integer(integer) = self.value.get_ref() else {
            return Err(self.error("it must be a whole number"));
        };
        i64::from_str_radix(integer.as_str(), integer.radix()).map_err(|_| self.error("it is too large"))
    }

    /// The `n` numbers of an array, each a coordinate.
    pub fn numbers(&self, n: usize, what: &str) -> Result<Vec<f64>, SceneError> {
        let expected = || self.error(format!("it must be {what}: {n} numbers in [ ]"));
        if !self.is_array() {
            return Err(expected());
        }
        let items = self.array()?;
        if items.len() != n {
            return Err(expected());
        }
        items.iter().map(Value::coordinate).collect()
    }

    /// A point or vector \[m\].
    pub fn vec3(&self) -> Result<DVec3, SceneError> {
        let xyz = self.numbers(3, "a vector")?;
        Ok(DVec3::new(xyz[0], xyz[1], xyz[2]))
    }

    /// A vector that is not zero, scaled to length 1.
    pub fn direction(&self) -> Result<DVec3, SceneError> {
        self.vec3()?.try_normalize().ok_or_else(|| self.error("it must not be zero: it gives a direction"))
    }

    /// A colour: a number for grey, or `[r, g, b]` in linear sRGB. Any finite sign.
    pub fn colour(&self) -> Result<Spectrum, SceneError> {
        let channels = if self.is_array() {
            let items = self.array()?;
            if items.len() != 3 {
                return Err(self.error("a colour is a number or three of them, [r, g, b]"));
            }
            [items[0].channel()?, items[1].channel()?, items[2].channel()?]
        } else if matches!(self.value.get_ref(), DeValue::Integer(_) | DeValue::Float(_)) {
            [self.channel()?; 3]
        } else {
            return Err(self.error("a colour is a number or three of them, [r, g, b]"));
        };
        Ok(Spectrum::from(channels))
    }

    fn channel(&self) -> Result<f32, SceneError> {
        let what = format!("its magnitude must be at most {MAX_COLOUR:e}");
        Ok(self.number_in(-MAX_COLOUR..=MAX_COLOUR, &what)? as f32)
    }

    /// A colour whose channels all lie in `range`.
    pub fn colour_in(&self, range: std::ops::RangeInclusive<f32>, what: &str) -> Result<Spectrum, SceneError> {
        let colour = self.colour()?;
        if colour.to_array().iter().all(|channel| range.contains(channel)) { Ok(colour) } else { Err(self.error(what)) }
    }
}
