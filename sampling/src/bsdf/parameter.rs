//! What can be said of a model in words: its parameters, their domains, and the arguments given for them.
//!
//! Scene files, `neumann bsdf` and the documentation all read a model's list of parameters, so that a new model needs no
//! line anywhere else.

use super::{Bsdf, Table};
use crate::math::Spectrum;
use std::fmt;

/// The most parameters that a model can have.
pub const MAX_PARAMETERS: usize = 16;

/// A parameter of a model.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// What scene files call it.
    pub name: &'static str,
    /// What it is, in a few words, with its unit in brackets.
    pub about: &'static str,
    /// What it may be.
    pub domain: Domain,
    /// What it is when nothing is said.
    pub preset: Preset,
}

impl Parameter {
    /// The index of refraction of a dielectric.
    pub const INDEX: Self = Self::number("eta", "index inside over index outside", 0.01, 100.0, Preset::Number(1.5));

    /// A number.
    pub const fn number(name: &'static str, about: &'static str, from: f32, to: f32, preset: Preset) -> Self {
        Self { name, about, domain: Domain::Number(from, to), preset }
    }

    /// A colour.
    pub const fn colour(name: &'static str, about: &'static str, from: f32, to: f32, preset: Preset) -> Self {
        Self { name, about, domain: Domain::Colour(from, to), preset }
    }

    /// One of some words; the first is meant when nothing is said.
    pub const fn choice(name: &'static str, about: &'static str, words: &'static [&'static str]) -> Self {
        Self { name, about, domain: Domain::Choice(words), preset: Preset::Choice(words[0]) }
    }
}

/// What a parameter may be.
#[derive(Clone, Copy, Debug)]
pub enum Domain {
    /// A number in a range, ends included.
    Number(f32, f32),
    /// A colour whose channels are in a range, ends included.
    Colour(f32, f32),
    /// One of these words.
    Choice(&'static [&'static str]),
    /// A list of at least `least` numbers that are not negative, from which a table is made; the error says what is wrong with them.
    Numbers {
        /// How many there must be.
        least: usize,
        /// Makes the table.
        read: fn(&[f32]) -> Result<Table, String>,
    },
    /// The path of a file, from whose bytes a table is made; the error says what is wrong with them.
    File {
        /// Makes the table.
        read: fn(&[u8]) -> Result<Table, String>,
    },
    /// The name of another material, which doesn't vary.
    Model,
}

/// What a parameter is when nothing is said of it.
#[derive(Clone, Copy, Debug)]
pub enum Preset {
    /// It must be given; an example of what to write.
    Required(&'static str),
    /// It is absent: another parameter takes its place.
    Absent,
    /// A number, or a grey of that number.
    Number(f32),
    /// A word.
    Choice(&'static str),
}

/// What is given for a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Argument {
    /// Nothing.
    Absent,
    /// A number.
    Number(f32),
    /// A colour.
    Colour(Spectrum),
    /// The place of the word among those of the domain.
    Choice(usize),
    /// A table.
    Table(Table),
    /// Another model.
    Model(&'static Bsdf),
}

impl Argument {
    /// The number, if one was given.
    ///
    /// This and its likes panic if what was given is of another kind than the domain's.
    #[inline]
    pub fn given_number(self) -> Option<f32> {
        match self {
            Self::Absent => None,
            Self::Number(x) => Some(x),
            other => panic!("not a number: {other:?}"),
        }
    }

    /// The colour, if one was given.
    #[inline]
    pub fn given_colour(self) -> Option<Spectrum> {
        match self {
            Self::Absent => None,
            Self::Colour(colour) => Some(colour),
            other => panic!("not a colour: {other:?}"),
        }
    }

    /// The place of the chosen word in its list, if one was given.
    #[inline]
    pub fn given_choice(self) -> Option<usize> {
        match self {
            Self::Absent => None,
            Self::Choice(place) => Some(place),
            other => panic!("not a choice: {other:?}"),
        }
    }

    /// The number of a parameter that is never absent.
    #[inline]
    pub fn number(self) -> f32 {
        self.given_number().expect("a number")
    }

    /// The colour of a parameter that is never absent.
    #[inline]
    pub fn colour(self) -> Spectrum {
        self.given_colour().expect("a colour")
    }

    /// The place of the chosen word in its list; of a parameter that is never absent.
    #[inline]
    pub fn choice(self) -> usize {
        match self {
            Self::Choice(place) => place,
            other => panic!("not a choice: {other:?}"),
        }
    }

    /// The table of a parameter that is never absent.
    #[inline]
    pub fn table(self) -> Table {
        match self {
            Self::Table(table) => table,
            other => panic!("not a table: {other:?}"),
        }
    }

    /// The model of a parameter that is never absent.
    #[inline]
    pub fn model(self) -> &'static Bsdf {
        match self {
            Self::Model(model) => model,
            other => panic!("not a model: {other:?}"),
        }
    }
}

/// One argument for every parameter of a model, in the order of its list.
#[derive(Clone, Copy, Debug)]
pub struct Arguments([Argument; MAX_PARAMETERS]);

impl Arguments {
    /// What holds when nothing is said; what is required is absent.
    pub fn presets(parameters: &[Parameter]) -> Self {
        let mut all = [Argument::Absent; MAX_PARAMETERS];
        for (argument, parameter) in all.iter_mut().zip(parameters) {
            *argument = match (parameter.preset, parameter.domain) {
                (Preset::Number(x), Domain::Colour(..)) => Argument::Colour(Spectrum::splat(x)),
                (Preset::Number(x), _) => Argument::Number(x),
                (Preset::Choice(word), Domain::Choice(words)) => {
                    Argument::Choice(words.iter().position(|w| *w == word).expect("the preset is among the words"))
                }
                _ => Argument::Absent,
            };
        }
        Self(all)
    }

    /// Sets the argument of the parameter at `place` in the list.
    #[inline]
    pub fn set(&mut self, place: usize, argument: Argument) {
        self.0[place] = argument;
    }

    /// The arguments of the first `N` parameters, to be taken apart by name: `let [albedo, sigma] = arguments.all();`.
    #[inline]
    pub fn all<const N: usize>(&self) -> [Argument; N] {
        std::array::from_fn(|i| self.0[i])
    }
}

/// Why there is no model with these arguments, each of which is in its domain.
#[derive(Clone, Debug, PartialEq)]
pub struct Misfit {
    /// The parameter to change.
    pub parameter: &'static str,
    /// What is wrong, and how to mend it.
    pub mend: String,
}

impl Misfit {
    /// The parameter to change, and what is wrong and how to mend it.
    pub fn new(parameter: &'static str, mend: impl Into<String>) -> Self {
        Self { parameter, mend: mend.into() }
    }
}

impl fmt::Display for Misfit {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "`{}`: {}", self.parameter, self.mend)
    }
}

impl Domain {
    /// Whether a number is in it.
    pub fn holds(&self, x: f32) -> bool {
        match *self {
            Self::Number(from, to) | Self::Colour(from, to) => (from..=to).contains(&x),
            _ => false,
        }
    }
}

impl fmt::Display for Domain {
    /// What messages and the documentation say of it, such as "a number from 0 to 1".
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Number(from, to) => write!(f, "a number from {from} to {to}"),
            Self::Colour(from, to) => write!(f, "a colour with channels from {from} to {to}"),
            Self::Choice(words) => write!(f, "one of {}", words.join(", ")),
            Self::Numbers { least, .. } => write!(f, "a list of at least {least} numbers that are not negative"),
            Self::File { .. } => write!(f, "the path of a file"),
            Self::Model => write!(f, "the name of another material"),
        }
    }
}
