//! Questions about expressions that their automaton answers exactly: what paths do they have, share, and leave out?

use super::classifier::Classifier;
use super::vertex::{Names, of_kind};
use super::{Event, Scattering};
use std::fmt;

/// A path, by what happens at its vertices from the camera on. Displayed as an expression that it belongs to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Example {
    /// The scatterings, with the names of their surfaces.
    pub scatterings: Vec<(Event, Scattering, Vec<String>)>,
    /// The names of the light.
    pub light: Vec<String>,
}

impl fmt::Display for Example {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let quoted = |names: &[String]| -> String {
            let quote = |name: &String| if name.contains('\'') { format!("\"{name}\"") } else { format!("'{name}'") };
            names.iter().map(quote).collect()
        };
        f.write_str("C ")?;
        for (event, scattering, names) in &self.scatterings {
            write!(f, "<{}{}{}> ", event.letter(), scattering.letter(), quoted(names))?;
        }
        match self.light.as_slice() {
            [] | [_] => write!(f, "L{}", quoted(&self.light)),
            names => write!(f, "<L{}>", quoted(names)),
        }
    }
}

impl Classifier {
    /// A shortest path of an expression; `None` where it has none, since nothing has the names that it asks for.
    pub fn example(&self, expression: usize) -> Option<Example> {
        self.examples(expression, 1).pop()
    }

    /// Up to `count` paths of an expression, the shortest first. Where many vertices fit the same parts of all expressions of the
    /// set, one stands for all.
    pub fn examples(&self, expression: usize, count: usize) -> Vec<Example> {
        self.shortest(count, |classes| classes & (1 << expression) != 0)
    }

    /// Two expressions that share a path, and a shortest path of those that any two share; `None` where all are disjoint.
    pub fn overlap(&self) -> Option<(usize, usize, Example)> {
        let (classes, example) = self.shortest_with_classes(1, |classes| classes.count_ones() > 1).pop()?;
        let first = classes.trailing_zeros();
        let second = (classes & (classes - 1)).trailing_zeros();
        Some((first as usize, second as usize, example))
    }

    /// A shortest path that belongs to no expression; `None` where every path belongs to one.
    pub fn gap(&self) -> Option<Example> {
        self.shortest(1, |classes| classes == 0).pop()
    }

    fn shortest(&self, count: usize, wanted: impl Fn(u64) -> bool) -> Vec<Example> {
        self.shortest_with_classes(count, wanted).into_iter().map(|(_, example)| example).collect()
    }

    /// The shortest words of wanted classes, by a search in breadth. The `count` shortest words go through no state that as many
    /// words have led to before, so no state is met more often than that.
    fn shortest_with_classes(&self, count: usize, wanted: impl Fn(u64) -> bool) -> Vec<(u64, Example)> {
        let dfa = &self.from_camera;
        let mut met = vec![0; dfa.states()];
        met[usize::from(dfa.start)] = 1;
        let mut trail = vec![Trail { state: dfa.start, step: None }];
        let mut found = Vec::new();
        let mut done = 0;
        while done < trail.len() && found.len() < count {
            let state = trail[done].state;
            for light in self.alphabet.lights..dfa.letters {
                let classes = dfa.accepts[usize::from(dfa.step(state, light))];
                if wanted(classes) && found.len() < count {
                    found.push((classes, self.word(&trail, done, light)));
                }
            }
            for letter in 0..self.alphabet.lights {
                let to = dfa.step(state, letter);
                if met[usize::from(to)] < count {
                    met[usize::from(to)] += 1;
                    trail.push(Trail { state: to, step: Some((done, letter)) });
                }
            }
            done += 1;
        }
        found
    }

    fn word(&self, trail: &[Trail], end: usize, light: usize) -> Example {
        let mut scatterings = Vec::new();
        let mut place = end;
        while let Some((before, letter)) = trail[place].step {
            let letter = self.alphabet.letters[letter];
            let (event, scattering) = of_kind(letter.kind);
            scatterings.push((event, scattering, self.names_of(letter.names)));
            place = before;
        }
        scatterings.reverse();
        Example { scatterings, light: self.names_of(self.alphabet.letters[light].names) }
    }

    fn names_of(&self, names: Names) -> Vec<String> {
        let named = self.names.iter().enumerate().filter(|(i, _)| names & (1 << i) != 0);
        named.map(|(_, name)| name.clone()).collect()
    }
}

/// A word that a search has met: where it leads, and how it was made.
struct Trail {
    state: u16,
    /// The place of the word before in the search, and the letter after it.
    step: Option<(usize, usize)>,
}
