//! A directive's parameters, each looked up by its name; what nobody asked for is told.

use std::cell::RefCell;
use std::collections::BTreeSet;

use glam::DVec3;

use super::context::Context;
use super::parser::{Parameter, Values};
use crate::error::SceneError;
use crate::import::translation::{NoteKind, Place, unknown};

/// A directive with its parameters.
#[derive(Clone, Debug)]
pub struct Parameters {
    /// The directive, such as `Shape`.
    pub directive: &'static str,
    /// What kind of thing it makes, such as `sphere`.
    pub kind: String,
    /// Its line.
    pub place: Place,
    list: Vec<Parameter>,
    used: RefCell<Vec<bool>>,
    /// The names that were asked for.
    asked: RefCell<BTreeSet<String>>,
}

impl Parameters {
    /// Nothing is asked for yet. Of two of a name the first holds.
    pub fn new(directive: &'static str, kind: String, place: Place, list: Vec<Parameter>) -> Self {
        let used = RefCell::new(vec![false; list.len()]);
        Self { directive, kind, place, list, used, asked: RefCell::default() }
    }

    /// What it is called in notes and errors.
    pub fn title(&self) -> String {
        format!("`{} {}`", self.directive, super::lexer::shown(&self.kind))
    }

    /// The parameter of this name.
    pub fn find(&self, name: &str) -> Option<&Parameter> {
        self.asked.borrow_mut().insert(name.to_owned());
        let mut found = None;
        for (i, parameter) in self.list.iter().enumerate().rev() {
            if parameter.name == name {
                self.used.borrow_mut()[i] = true;
                found = Some(parameter);
            }
        }
        found
    }

    /// The first of these names that there is.
    pub fn any(&self, names: &[&str]) -> Option<&Parameter> {
        names.iter().filter_map(|name| self.find(name)).next()
    }

    /// Where a parameter is, or else the directive.
    pub fn place_of(&self, name: &str) -> &Place {
        self.list.iter().find(|parameter| parameter.name == name).map_or(&self.place, |parameter| &parameter.place)
    }

    /// A number.
    pub fn float(&self, name: &str) -> Result<Option<f64>, SceneError> {
        self.find(name).map(number).transpose()
    }

    /// A number, or another where there is none.
    pub fn float_or(&self, name: &str, otherwise: f64) -> Result<f64, SceneError> {
        Ok(self.float(name)?.unwrap_or(otherwise))
    }

    /// A number above 0.
    pub fn positive(&self, name: &str, otherwise: f64) -> Result<f64, SceneError> {
        let value = self.float_or(name, otherwise)?;
        if value > 0.0 {
            return Ok(value);
        }
        Err(self.place_of(name).error(format!("`{name}` is {value}"), "give a number above 0"))
    }

    /// A whole number.
    pub fn integer(&self, name: &str) -> Result<Option<i64>, SceneError> {
        let Some(value) = self.float(name)? else { return Ok(None) };
        if value.fract() == 0.0 && value.abs() < 1e15 {
            return Ok(Some(value as i64));
        }
        Err(self.place_of(name).error(format!("`{name}` is {value}"), "give a whole number"))
    }

    /// `true` or `false`.
    pub fn boolean(&self, name: &str) -> Result<Option<bool>, SceneError> {
        let Some(parameter) = self.find(name) else { return Ok(None) };
        match &parameter.values {
            Values::Texts(texts) if texts.len() == 1 && texts[0] == "true" => Ok(Some(true)),
            Values::Texts(texts) if texts.len() == 1 && texts[0] == "false" => Ok(Some(false)),
            _ => Err(parameter.place.error(format!("`{name}` is neither true nor false"), "write `true` or `false`")),
        }
    }

    /// A text.
    pub fn text(&self, name: &str) -> Result<Option<&str>, SceneError> {
        let Some(parameter) = self.find(name) else { return Ok(None) };
        match &parameter.values {
            Values::Texts(texts) if texts.len() == 1 => Ok(Some(&texts[0])),
            _ => Err(parameter.place.error(format!("`{name}` is no text"), "give one in quotation marks")),
        }
    }

    /// A list of numbers.
    pub fn numbers(&self, name: &str) -> Result<Option<&[f64]>, SceneError> {
        let Some(parameter) = self.find(name) else { return Ok(None) };
        match &parameter.values {
            Values::Numbers(list) => Ok(Some(list)),
            Values::Texts(_) => Err(parameter.place.error(format!("`{name}` holds texts"), "give numbers")),
        }
    }

    /// A list of points or vectors.
    pub fn points(&self, name: &str) -> Result<Option<Vec<DVec3>>, SceneError> {
        let Some(list) = self.numbers(name)? else { return Ok(None) };
        if list.len() % 3 != 0 {
            let message = format!("`{name}` has {} numbers, which are no points", list.len());
            return Err(self.place_of(name).error(message, "give three for each"));
        }
        Ok(Some(list.chunks_exact(3).map(DVec3::from_slice).collect()))
    }

    /// A point or vector.
    pub fn point_or(&self, name: &str, otherwise: DVec3) -> Result<DVec3, SceneError> {
        match self.points(name)?.as_deref() {
            None => Ok(otherwise),
            Some([point]) => Ok(*point),
            Some(_) => Err(self.place_of(name).error(format!("`{name}` is not one point"), "give three numbers")),
        }
    }

    /// Says that parameters of these names change nothing.
    pub fn skip(&self, names: &[&str]) {
        names.iter().for_each(|name| _ = self.find(name));
    }

    /// Notes what nobody asked for, and what there are two of.
    pub fn finish(&self, context: &mut Context) {
        let (asked, title) = (self.asked.borrow(), self.title());
        let asked: Vec<&str> = asked.iter().map(String::as_str).collect();
        let mut seen = BTreeSet::new();
        for (parameter, used) in self.list.iter().zip(&*self.used.borrow()) {
            let name = super::lexer::shown(&parameter.name);
            let again = !seen.insert(parameter.name.as_str());
            let text = match (*used, again) {
                (true, false) => continue,
                (_, true) => format!("there is more than one `{name}` in {title}: the first holds"),
                (false, false) => unknown(&format!("`{name}` of {title}"), &parameter.name, &asked),
            };
            context.note(NoteKind::Approximated, &parameter.place, text);
        }
    }
}

/// A parameter's only number.
pub fn number(parameter: &Parameter) -> Result<f64, SceneError> {
    match &parameter.values {
        Values::Numbers(list) if list.len() == 1 => Ok(list[0]),
        _ => Err(parameter.place.error(format!("`{}` is not one number", parameter.name), "give one")),
    }
}
