//! Light-path expressions: regular languages whose words are paths, read from the camera to the light.
//!
//! A path is the word `C x₁ … xₖ L` of its vertices, where k is its order. Of a scattering vertex an expression may ask what
//! happened there ([`Event`], [`Scattering`]) and by which names the surface goes; of the light, by which names it goes.
//! The notation is that of production renderers, `C<RD>.*L'key'`; the lecture's, `L(D|S)*E` from light to eye \[Heckbert90\], is
//! understood as well. Both are described in `docs/light_path_expressions.md`.
//!
//! In reading order:
//!
//! - `vertex`: what is said about one vertex; `expression`: an [`Expression`] and its tree; `parse`: how it is read; `error`: what
//!   can be wrong with it, and where;
//! - `alphabet`: the letters of a scene, as coarse as the expressions allow; `nfa`, `dfa`, `minimise`: the automata of a set of
//!   expressions, read from the camera and from the light;
//! - `classifier`: a [`Classifier`] says of a path that was built from both ends which expressions it belongs to;
//! - `algebra`: shortest paths, what two expressions share, what none has;
//! - `lost`: the light that methods lose, in words.
//!
//! Regular languages are closed under all of this, so that answers are exact. What would grow too large is refused: an expression
//! is at most [`MAX_LENGTH`] bytes long, repeats at most [`MAX_REPEAT`] times and has at most [`MAX_VERTICES`] vertices when
//! written out; a set has at most [`MAX_EXPRESSIONS`] expressions and [`MAX_STATES`] states from either end.

mod algebra;
mod alphabet;
mod classifier;
mod dfa;
mod error;
mod expression;
mod lost;
mod minimise;
mod nfa;
mod parse;
mod vertex;

#[cfg(test)]
mod tests;

pub use algebra::Example;
pub use classifier::{Classifier, State, UnknownName};
pub use error::{LpeError, ParseError};
pub use expression::{Expression, Notation};
pub use lost::{loses, lost_in, told};

/// The longest expression \[bytes\].
pub const MAX_LENGTH: usize = 4096;
/// The largest number in a repetition such as `{2,5}`.
pub const MAX_REPEAT: usize = 1000;
/// The deepest nesting of brackets.
pub const MAX_DEPTH: usize = 64;
/// The most vertices of an expression whose repetitions are written out.
pub const MAX_VERTICES: usize = 2048;
/// The most expressions of a set: one bit each.
pub const MAX_EXPRESSIONS: usize = u64::BITS as usize;
/// The most names that the expressions of a set mention.
pub const MAX_NAMES: usize = vertex::Names::BITS as usize;
/// The most states of a set's automaton, from either end.
pub const MAX_STATES: usize = 4096;

/// What happens to light at a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Event {
    /// It stays on its side of the surface: `R`.
    Reflection,
    /// It goes through the surface: `T`.
    Transmission,
    /// It goes through a body beneath the surface and comes out elsewhere: `V`.
    Volume,
}

impl Event {
    /// All of them.
    pub const ALL: [Event; 3] = [Event::Reflection, Event::Transmission, Event::Volume];

    /// Its letter.
    pub fn letter(self) -> char {
        match self {
            Event::Reflection => 'R',
            Event::Transmission => 'T',
            Event::Volume => 'V',
        }
    }
}

/// How a vertex spreads directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scattering {
    /// Into all directions: `D`.
    Diffuse,
    /// Into a lobe: `G`.
    Glossy,
    /// Into one direction, a Dirac: `S`.
    Specular,
}

impl Scattering {
    /// All of them.
    pub const ALL: [Scattering; 3] = [Scattering::Diffuse, Scattering::Glossy, Scattering::Specular];

    /// Its letter.
    pub fn letter(self) -> char {
        match self {
            Scattering::Diffuse => 'D',
            Scattering::Glossy => 'G',
            Scattering::Specular => 'S',
        }
    }
}
