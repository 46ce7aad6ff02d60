//! A plugin's parameters, each looked up by its name; what nobody asked for is told.

use std::cell::RefCell;
use std::collections::BTreeSet;

use glam::{DMat4, DVec3};

use super::context::Context;
use super::transform;
use super::xml::Element;
use crate::error::SceneError;
use crate::import::translation::{NoteKind, Place, unknown};

/// An element with its parts, references resolved.
pub struct Plugin<'a> {
    /// The element.
    pub element: &'a Element,
    parts: Vec<(&'a str, &'a Element)>,
    used: RefCell<Vec<bool>>,
    /// The names that were asked for.
    asked: RefCell<BTreeSet<String>>,
}

impl<'a> Plugin<'a> {
    /// The parts of an element.
    pub fn new(element: &'a Element, context: &Context<'a>) -> Result<Self, SceneError> {
        let mut parts = Vec::new();
        for child in &element.children {
            let part = context.resolved(child)?;
            let name = if child.name().is_empty() && child.tag != "ref" { part.name() } else { child.name() };
            parts.push((name, part));
        }
        let used = RefCell::new(vec![false; parts.len()]);
        Ok(Self { element, parts, used, asked: RefCell::default() })
    }

    /// Where it begins.
    pub fn place(&self) -> &'a Place {
        &self.element.place
    }

    /// The name of the plugin.
    pub fn kind(&self) -> &'a str {
        self.element.kind()
    }

    /// The parameter of this name.
    pub fn part(&self, name: &str) -> Option<&'a Element> {
        // Of two, the last holds, and both are used.
        self.asked.borrow_mut().insert(name.to_owned());
        let mut found = None;
        for (i, (own, part)) in self.parts.iter().enumerate() {
            if *own == name {
                self.used.borrow_mut()[i] = true;
                found = Some(*part);
            }
        }
        found
    }

    /// Marks a parameter as of no matter to the light.
    pub fn skip(&self, names: &[&str]) {
        names.iter().for_each(|name| _ = self.part(name));
    }

    /// All parts with this tag, whatever their name.
    pub fn tagged(&self, tag: &str) -> Vec<&'a Element> {
        let mut found = Vec::new();
        for (i, (_, part)) in self.parts.iter().enumerate() {
            if part.tag == tag && !self.used.borrow()[i] {
                self.used.borrow_mut()[i] = true;
                found.push(*part);
            }
        }
        found
    }

    /// The parts with this tag that have a name, with it.
    pub fn named(&self, tag: &str) -> Vec<(&'a str, &'a Element)> {
        self.parts.iter().filter(|(name, part)| part.tag == tag && !name.is_empty()).copied().collect()
    }

    /// The texts of these parts are values.
    fn value(&self, name: &str) -> Result<Option<(&'a str, &'a Place)>, SceneError> {
        let Some(part) = self.part(name) else { return Ok(None) };
        match part.attribute("value") {
            Some(value) => Ok(Some((value.trim(), &part.place))),
            None => Err(part.place.error(format!("{} has no `value`", part.title()), "add one")),
        }
    }

    /// A number.
    pub fn float(&self, name: &str) -> Result<Option<f64>, SceneError> {
        self.value(name)?.map(|(value, place)| finite(value, name, place)).transpose()
    }

    /// A number, or what it is by default.
    pub fn float_or(&self, name: &str, otherwise: f64) -> Result<f64, SceneError> {
        Ok(self.float(name)?.unwrap_or(otherwise))
    }

    /// A whole number.
    pub fn integer(&self, name: &str) -> Result<Option<i64>, SceneError> {
        let Some((value, place)) = self.value(name)? else { return Ok(None) };
        let wrong = || place.error(format!("`{name}` is `{value}`"), "it must be a whole number");
        value.parse().map(Some).map_err(|_| wrong())
    }

    /// True or false.
    pub fn boolean(&self, name: &str) -> Result<Option<bool>, SceneError> {
        let Some((value, place)) = self.value(name)? else { return Ok(None) };
        // Python writes them with a capital, which Mitsuba takes.
        match value.to_ascii_lowercase().as_str() {
            "true" => Ok(Some(true)),
            "false" => Ok(Some(false)),
            _ => Err(place.error(format!("`{name}` is `{value}`"), "it must be `true` or `false`")),
        }
    }

    /// A text.
    pub fn text(&self, name: &str) -> Result<Option<&'a str>, SceneError> {
        Ok(self.value(name)?.map(|(value, _)| value))
    }

    /// A point or a vector.
    pub fn vector(&self, name: &str) -> Result<Option<DVec3>, SceneError> {
        self.part(name).map(|part| transform::vector(part, 0.0)).transpose()
    }

    /// A transform that flattens nothing; the identity where there is none.
    pub fn transform(&self, name: &str, context: &mut Context<'a>) -> Result<DMat4, SceneError> {
        let Some(part) = self.part(name) else { return Ok(DMat4::IDENTITY) };
        let map = transform::read(part, context)?;
        if crate::import::flattens(&map) {
            let mend = "let every direction keep some length";
            return Err(part.place.error("the transform flattens what it is applied to", mend));
        }
        Ok(map)
    }

    /// Where a shape is; `None`, and a note, where its transform leaves nothing of it.
    pub fn placement(&self, context: &mut Context<'a>) -> Result<Option<DMat4>, SceneError> {
        let Some(part) = self.part("to_world") else { return Ok(Some(DMat4::IDENTITY)) };
        let map = transform::read(part, context)?;
        if crate::import::flattens(&map) {
            let text = format!("{} that its transform flattens is left out", self.element.title());
            context.approximate(self.place(), text);
            return Ok(None);
        }
        Ok(Some(map))
    }

    /// Tells which parts nobody asked for, and which there are two of.
    pub fn finish(&self, context: &mut Context<'a>) {
        let (asked, title) = (self.asked.borrow(), self.element.title());
        let asked: Vec<&str> = asked.iter().map(String::as_str).collect();
        let mut seen = BTreeSet::new();
        for ((name, part), used) in self.parts.iter().zip(&*self.used.borrow()) {
            let again = !name.is_empty() && !seen.insert(*name);
            let text = match (*used, again) {
                (true, false) => continue,
                (true, true) => format!("there is more than one `{name}` in {title}: the last holds"),
                (false, _) if name.is_empty() => format!("{} of {title} is left out", part.title()),
                (false, _) => unknown(&format!("`{name}` of {title}"), name, &asked),
            };
            context.note(NoteKind::Approximated, &part.place, text);
        }
    }
}

/// A finite number.
pub fn finite(text: &str, name: &str, place: &Place) -> Result<f64, SceneError> {
    match text.trim().parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err(place.error(format!("`{name}` holds `{}`", short(text)), "it must be a finite number")),
    }
}

/// The finite numbers of a text, separated by spaces or commas.
pub fn finite_list(text: &str, name: &str, place: &Place) -> Result<Vec<f64>, SceneError> {
    let words = text.split(|c: char| c == ',' || c.is_whitespace()).filter(|word| !word.is_empty());
    words.map(|word| finite(word, name, place)).collect()
}

fn short(text: &str) -> String {
    let start: String = text.chars().take(40).collect();
    if start.len() < text.len() { start + "…" } else { start }
}
