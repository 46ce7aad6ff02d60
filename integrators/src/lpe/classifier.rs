//! A set of expressions made ready: which of them does a path belong to, from whichever ends it was built?

use super::alphabet::Alphabet;
use super::dfa::Dfa;
use super::error::LpeError;
use super::expression::{Expression, Node, Sort};
use super::nfa::{Nfa, Predicates};
use super::vertex::{Names, kind};
use super::{Event, MAX_EXPRESSIONS, MAX_NAMES, Scattering};
use std::collections::HashMap;
use std::fmt;

/// How far a word has been read, from one end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct State(u16);

/// All expressions of a set in two automata: one reads paths from the camera on, the other from the light on.
///
/// A path that joins a walk from the camera to one from a light is the word `C x₁ … xₖ L`, of which the first has read the
/// vertices up to some place and the second the others. Two words from the light that lead to one state fit the same words from
/// the camera; so what expressions a path belongs to is a table of the two states.
#[derive(Clone, Debug)]
pub struct Classifier {
    pub(super) names: Vec<String>,
    pub(super) alphabet: Alphabet,
    pub(super) from_camera: Dfa,
    from_light: Dfa,
    /// By state from the camera and state from the light.
    classes: Vec<u64>,
    /// The number of each surface's set of names.
    surfaces: Vec<u16>,
    /// The state from the light at each light.
    lights: Vec<State>,
    unknown: Vec<UnknownName>,
}

/// The bound of the table of pairs of states.
const MAX_PAIRS: usize = 1 << 21;

impl Classifier {
    /// The classifier of a scene. `surfaces` and `lights` are the lists of names by which its surfaces and lights go; the
    /// functions that follow vertices know them by their places in these lists.
    ///
    /// # Errors
    /// If there are too many expressions or names, or an automaton grows too large.
    pub fn new(expressions: &[Expression], surfaces: &[Vec<String>], lights: &[Vec<String>]) -> Result<Self, LpeError> {
        let set = Set::of(expressions)?;
        let sets = |entries: &[Vec<String>], sort| -> Vec<Names> {
            let mentioned = set.mentioned(sort);
            entries.iter().map(|names| set.numbers(names) & mentioned).collect()
        };
        let (surface_names, light_names) = (sets(surfaces, Sort::Scattering), sets(lights, Sort::Light));
        let unknown = set.unknown(surfaces, lights);
        set.classifier(&surface_names, &light_names, unknown)
    }

    /// The classifier of any scene: surfaces and lights go by each set of up to two of the names that the expressions mention.
    /// It is made for questions about the expressions; no number is known for a surface or light.
    ///
    /// # Errors
    /// If there are too many expressions or names, or an automaton grows too large.
    pub fn for_any_scene(expressions: &[Expression]) -> Result<Self, LpeError> {
        let set = Set::of(expressions)?;
        let [surfaces, lights] = [Sort::Scattering, Sort::Light].map(|sort| up_to_two(set.mentioned(sort)));
        set.classifier(&surfaces, &lights, Vec::new())
    }

    /// How many states the automata have, the one that reads from the camera and the one that reads from the light.
    pub fn states(&self) -> (usize, usize) {
        (self.from_camera.states(), self.from_light.states())
    }

    /// The names that expressions mention and nothing in the scene has, where each is meant to be.
    pub fn unknown_names(&self) -> &[UnknownName] {
        &self.unknown
    }

    /// The state of a walk that has left the camera.
    #[inline]
    pub fn camera_start(&self) -> State {
        State(self.from_camera.start)
    }

    /// The state of a walk from the camera after a scattering at a surface.
    #[inline]
    pub fn camera_step(&self, state: State, event: Event, scattering: Scattering, surface: usize) -> State {
        let letter = self.alphabet.scattering(self.surfaces[surface], kind(event, scattering));
        State(self.from_camera.step(state.0, letter))
    }

    /// The state of a walk that has left a light.
    #[inline]
    pub fn light_start(&self, light: usize) -> State {
        self.lights[light]
    }

    /// The state of a walk from a light after a scattering at a surface.
    #[inline]
    pub fn light_step(&self, state: State, event: Event, scattering: Scattering, surface: usize) -> State {
        let letter = self.alphabet.scattering(self.surfaces[surface], kind(event, scattering));
        State(self.from_light.step(state.0, letter))
    }

    /// The expressions that a path belongs to, one bit each, of whose vertices a walk from the camera and one from a light have
    /// together read each once.
    #[inline]
    pub fn classes(&self, camera: State, light: State) -> u64 {
        self.classes[usize::from(camera.0) * self.from_light.states() + usize::from(light.0)]
    }

    /// The expressions that a path belongs to that ends where a walk from the camera has met a light.
    #[inline]
    pub fn emitted(&self, camera: State, light: usize) -> u64 {
        self.classes(camera, self.lights[light])
    }
}

/// The automata for some letters, and the table of their pairs.
fn automata(forward: &Nfa, backward: &Nfa, alphabet: &Alphabet) -> Result<(Dfa, Dfa, Vec<u64>), LpeError> {
    let from_camera = Dfa::of(forward, alphabet)?.minimised();
    let from_light = Dfa::of(backward, alphabet)?.minimised();
    if from_camera.states() * from_light.states() > MAX_PAIRS {
        return Err(LpeError::TooLarge { what: "pairs of states", limit: MAX_PAIRS });
    }
    let classes = pairs(&from_camera, &from_light);
    Ok((from_camera, from_light, classes))
}

/// What expressions a word belongs to of which the first letters lead to a state from the camera and the others, read from their
/// end, to one from the light.
fn pairs(from_camera: &Dfa, from_light: &Dfa) -> Vec<u64> {
    let (cameras, lights) = (from_camera.states(), from_light.states());
    let mut classes = vec![0; cameras * lights];
    let start = usize::from(from_light.start);
    (0..cameras).for_each(|camera| classes[camera * lights + start] = from_camera.accepts[camera]);
    // A state is met first by some letter from a state that was met before; the walk from the camera might read that letter.
    let mut met = vec![false; lights];
    met[start] = true;
    let mut open = vec![from_light.start];
    while let Some(before) = open.pop() {
        for letter in 0..from_light.letters {
            let light = from_light.step(before, letter);
            if std::mem::replace(&mut met[usize::from(light)], true) {
                continue;
            }
            for camera in 0..cameras {
                let read = usize::from(from_camera.step(camera as u16, letter));
                classes[camera * lights + usize::from(light)] = classes[read * lights + usize::from(before)];
            }
            open.push(light);
        }
    }
    classes
}

/// Every set of up to two of these names.
fn up_to_two(names: Names) -> Vec<Names> {
    let bits: Vec<Names> = (0..Names::BITS).map(|i| 1 << i).filter(|bit| names & bit != 0).collect();
    let pairs = bits.iter().enumerate().flat_map(|(i, a)| bits[i + 1..].iter().map(move |b| a | b));
    std::iter::once(0).chain(bits.iter().copied()).chain(pairs).collect()
}

/// A name that an expression mentions and nothing in a scene has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownName {
    /// The number of the first expression that mentions it.
    pub expression: usize,
    /// The name.
    pub name: String,
    /// Whether a light is meant to have it, rather than a surface.
    pub of_light: bool,
    /// The name that is spelled most like it, of those that there are.
    pub nearest: Option<String>,
}

impl fmt::Display for UnknownName {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let what = if self.of_light { "light" } else { "surface" };
        write!(f, "no {what} is called '{}'", self.name)?;
        match &self.nearest {
            Some(nearest) => write!(f, "; did you mean '{nearest}'?"),
            None => Ok(()),
        }
    }
}

/// Expressions with their names numbered together.
struct Set<'a> {
    expressions: &'a [Expression],
    names: Vec<String>,
    /// For each expression the numbers of its names.
    numbers: Vec<Vec<usize>>,
}

impl<'a> Set<'a> {
    fn of(expressions: &'a [Expression]) -> Result<Self, LpeError> {
        if expressions.len() > MAX_EXPRESSIONS {
            return Err(LpeError::Expressions(expressions.len()));
        }
        let mut names: Vec<String> = Vec::new();
        let mut number = |name: &str| {
            names.iter().position(|known| known == name).unwrap_or_else(|| {
                names.push(name.to_owned());
                names.len() - 1
            })
        };
        let numbers = expressions.iter().map(|e| e.names().map(&mut number).collect()).collect();
        match names.len() {
            0..=MAX_NAMES => Ok(Self { expressions, names, numbers }),
            many => Err(LpeError::Names(many)),
        }
    }

    /// The mentioned names among these.
    fn numbers(&self, names: &[String]) -> Names {
        let found = names.iter().filter_map(|name| self.names.iter().position(|known| known == name));
        found.fold(0, |all, i| all | 1 << i)
    }

    /// The names that are mentioned of vertices of this sort.
    fn mentioned(&self, sort: Sort) -> Names {
        (0..self.expressions.len()).fold(0, |all, i| all | self.mentioned_by(i, sort))
    }

    fn mentioned_by(&self, expression: usize, sort: Sort) -> Names {
        fn of(node: &Node, sort: Sort, numbers: &[usize]) -> Names {
            match node {
                Node::Vertex(vertex) if vertex.sort == sort => vertex.what.renamed(numbers).names(),
                Node::Vertex(_) => 0,
                Node::Sequence(parts) | Node::Choice(parts) => {
                    parts.iter().fold(0, |all, part| all | of(part, sort, numbers))
                }
                Node::Repeat { body, .. } => of(body, sort, numbers),
            }
        }
        of(self.expressions[expression].root(), sort, &self.numbers[expression])
    }

    fn unknown(&self, surfaces: &[Vec<String>], lights: &[Vec<String>]) -> Vec<UnknownName> {
        let mut unknown = Vec::new();
        for (sort, entries) in [(Sort::Scattering, surfaces), (Sort::Light, lights)] {
            let mut missing = entries.iter().fold(self.mentioned(sort), |left, names| left & !self.numbers(names));
            let mut known: Vec<&str> = entries.iter().flatten().map(String::as_str).collect();
            known.sort_unstable();
            known.dedup();
            for expression in 0..self.expressions.len() {
                let here = missing & self.mentioned_by(expression, sort);
                missing &= !here;
                for (_, name) in self.names.iter().enumerate().filter(|(i, _)| here & (1 << i) != 0) {
                    let nearest = scenes::nearest(name, &known).map(str::to_owned);
                    unknown.push(UnknownName {
                        expression,
                        name: name.clone(),
                        of_light: sort == Sort::Light,
                        nearest,
                    });
                }
            }
        }
        unknown
    }

    fn classifier(
        self,
        surfaces: &[Names],
        lights: &[Names],
        unknown: Vec<UnknownName>,
    ) -> Result<Classifier, LpeError> {
        let (mut forward, mut backward, mut predicates) = (Nfa::default(), Nfa::default(), Predicates::default());
        for (i, (expression, numbers)) in self.expressions.iter().zip(&self.numbers).enumerate() {
            forward.add(expression.root(), i, numbers, &mut predicates)?;
            backward.add(&expression.root().reversed(), i, numbers, &mut predicates)?;
        }
        let (surface_sets, surfaces) = distinct(surfaces)?;
        let (light_sets, light_numbers) = distinct(lights)?;
        let alphabet = Alphabet::new(&predicates.list, &surface_sets, &light_sets)?;
        let (from_camera, from_light, classes) = automata(&forward, &backward, &alphabet)?;
        let start = |&number: &u16| State(from_light.step(from_light.start, alphabet.light(number)));
        let lights = light_numbers.iter().map(start).collect();
        Ok(Classifier { names: self.names, alphabet, from_camera, from_light, classes, surfaces, lights, unknown })
    }
}

/// Each set once, and for every entry the number of its set.
fn distinct(entries: &[Names]) -> Result<(Vec<Names>, Vec<u16>), LpeError> {
    const LIMIT: usize = 1 << 16;
    let mut known: HashMap<Names, usize> = HashMap::new();
    let mut sets = Vec::new();
    let mut numbers = Vec::with_capacity(entries.len());
    for &names in entries {
        let new = sets.len();
        let number = *known.entry(names).or_insert(new);
        if number == new {
            sets.push(names);
        }
        let number = u16::try_from(number).map_err(|_| LpeError::TooLarge { what: "sets of names", limit: LIMIT })?;
        numbers.push(number);
    }
    Ok((sets, numbers))
}
