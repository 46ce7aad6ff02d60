//! The letters of which paths are words: what can be at a vertex of a scene, as far as the expressions tell it apart.

use super::error::LpeError;
use super::expression::Sort;
use super::vertex::{Description, KINDS, Kind, Names};
use std::collections::HashMap;

/// What is said about a vertex in some expression of a set.
pub(super) type Predicate = (Sort, Description);

/// One of the vertices that a letter stands for; the others fit the same predicates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Letter {
    /// Only of a scattering.
    pub kind: Kind,
    pub names: Names,
}

/// The bound of what has to be evaluated to tell letters apart.
const MAX_EVALUATIONS: usize = 1 << 24;
/// Letters are numbered by `u16`.
const MAX_LETTERS: usize = 1 << 16;

/// The letters: first those of scatterings, then those of lights.
#[derive(Clone, Debug)]
pub(super) struct Alphabet {
    /// One vertex of each letter.
    pub letters: Vec<Letter>,
    /// The first letter of a light.
    pub lights: usize,
    /// The letters that fit each predicate.
    pub fitting: Vec<Vec<u16>>,
    /// By set of names of a surface and kind.
    scatterings: Vec<u16>,
    /// By set of names of a light.
    light_letters: Vec<u16>,
}

impl Alphabet {
    /// The letters of surfaces and lights with these sets of names, which are best distinct.
    pub fn new(predicates: &[Predicate], surfaces: &[Names], lights: &[Names]) -> Result<Self, LpeError> {
        let evaluations = (surfaces.len() * usize::from(KINDS) + lights.len()).saturating_mul(predicates.len());
        if evaluations > MAX_EVALUATIONS {
            return Err(LpeError::TooLarge { what: "comparisons of names", limit: MAX_EVALUATIONS });
        }
        let mut table = Table { predicates, letters: Vec::new(), known: HashMap::new() };
        let kinds = |&names: &Names| (0..KINDS).map(move |kind| Letter { kind, names });
        let scatterings: Vec<u16> =
            surfaces.iter().flat_map(kinds).map(|l| table.letter(Sort::Scattering, l)).collect::<Result<_, _>>()?;
        let first_light = table.letters.len();
        let mut light = |&names: &Names| table.letter(Sort::Light, Letter { kind: 0, names });
        let light_letters = lights.iter().map(&mut light).collect::<Result<_, _>>()?;
        let Table { letters, .. } = table;
        let fits = |(sort, what): &Predicate, i: usize, letter: &Letter| {
            (*sort == Sort::Light) == (i >= first_light) && what.contains(letter.kind, letter.names)
        };
        let fitting = |p: &Predicate| {
            let fitting = letters.iter().enumerate().filter(|(i, letter)| fits(p, *i, letter));
            fitting.map(|(i, _)| i as u16).collect()
        };
        let fitting = predicates.iter().map(fitting).collect();
        Ok(Self { lights: first_light, fitting, scatterings, light_letters, letters })
    }

    /// The letter of a scattering at a surface with the names of this number.
    #[inline]
    pub fn scattering(&self, names: u16, kind: Kind) -> usize {
        usize::from(self.scatterings[usize::from(names) * usize::from(KINDS) + usize::from(kind)])
    }

    /// The letter of a light with the names of this number.
    pub fn light(&self, names: u16) -> usize {
        usize::from(self.light_letters[usize::from(names)])
    }
}

/// Finds the letter of a vertex by the predicates that it fits.
struct Table<'a> {
    predicates: &'a [Predicate],
    letters: Vec<Letter>,
    known: HashMap<(Sort, Vec<u64>), u16>,
}

impl Table<'_> {
    fn letter(&mut self, sort: Sort, letter: Letter) -> Result<u16, LpeError> {
        let mut fits = vec![0; self.predicates.len().div_ceil(64)];
        for (i, (of, what)) in self.predicates.iter().enumerate() {
            fits[i / 64] |= u64::from(*of == sort && what.contains(letter.kind, letter.names)) << (i % 64);
        }
        if let Some(&known) = self.known.get(&(sort, fits.clone())) {
            return Ok(known);
        }
        let Ok(new) = u16::try_from(self.letters.len()) else {
            return Err(LpeError::TooLarge { what: "kinds of vertices", limit: MAX_LETTERS });
        };
        self.letters.push(letter);
        self.known.insert((sort, fits), new);
        Ok(new)
    }
}
