//! Deterministic automata of a set of expressions, by the construction of subsets \[Rabin59\].

use super::MAX_STATES;
use super::alphabet::Alphabet;
use super::error::LpeError;
use super::nfa::{Nfa, State};
use std::collections::HashMap;

/// A complete deterministic automaton: every state has a successor for every letter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Dfa {
    /// How many letters there are.
    pub letters: usize,
    /// The successors, by state and letter.
    pub next: Vec<u16>,
    /// The expressions of which a word ends in each state, one bit each.
    pub accepts: Vec<u64>,
    /// Where words start.
    pub start: u16,
}

/// The bound of the table of successors.
const MAX_TABLE: usize = 1 << 22;
/// The bound of what all subsets hold.
const MAX_HELD: usize = 1 << 23;
/// The bound of the steps that finding them may take.
const MAX_WORK: usize = 1 << 26;

impl Dfa {
    /// The automaton that goes through the sets of states in which the other may be.
    pub fn of(nfa: &Nfa, alphabet: &Alphabet) -> Result<Self, LpeError> {
        let letters = alphabet.letters.len();
        let mut subsets = Subsets::new(nfa);
        let start = subsets.number(&nfa.starts)?;
        let mut next = Vec::new();
        let mut seeds: Vec<Vec<u32>> = vec![Vec::new(); letters];
        let mut done = 0;
        while done < subsets.list.len() {
            for &state in &subsets.list[done] {
                let State::Step { predicate, to } = nfa.states[state as usize] else { continue };
                let fitting = &alphabet.fitting[predicate];
                fitting.iter().for_each(|&letter| seeds[usize::from(letter)].push(to));
                subsets.work += fitting.len();
            }
            for seeds in &mut seeds {
                next.push(subsets.number(seeds)?);
                seeds.clear();
            }
            if next.len() > MAX_TABLE {
                return Err(LpeError::TooLarge { what: "transitions", limit: MAX_TABLE });
            }
            done += 1;
        }
        let accepts = subsets.list.iter().map(|subset| accepts(nfa, subset)).collect();
        Ok(Self { letters, next, accepts, start })
    }

    /// How many states there are.
    pub fn states(&self) -> usize {
        self.accepts.len()
    }

    /// The state after a letter.
    #[inline]
    pub fn step(&self, state: u16, letter: usize) -> u16 {
        self.next[usize::from(state) * self.letters + letter]
    }
}

fn accepts(nfa: &Nfa, subset: &[u32]) -> u64 {
    let bit = |&state: &u32| match nfa.states[state as usize] {
        State::Accept(expression) => 1 << expression,
        _ => 0,
    };
    subset.iter().map(bit).fold(0, |all, bit| all | bit)
}

/// The subsets that were met, in that order.
struct Subsets<'a> {
    nfa: &'a Nfa,
    list: Vec<Vec<u32>>,
    known: HashMap<Vec<u32>, u16>,
    /// For each state the last search that met it.
    met: Vec<usize>,
    searches: usize,
    held: usize,
    work: usize,
}

impl<'a> Subsets<'a> {
    fn new(nfa: &'a Nfa) -> Self {
        let met = vec![0; nfa.states.len()];
        Self { nfa, list: Vec::new(), known: HashMap::new(), met, searches: 0, held: 0, work: 0 }
    }

    /// The number of the subset that these states lead to by splits alone.
    fn number(&mut self, seeds: &[u32]) -> Result<u16, LpeError> {
        let subset = self.closure(seeds);
        if let Some(&known) = self.known.get(&subset) {
            return Ok(known);
        }
        self.held += subset.len();
        for (size, what, limit) in [
            (self.list.len() + 1, "states", MAX_STATES),
            (self.held, "places in states", MAX_HELD),
            (self.work, "steps to be found", MAX_WORK),
        ] {
            if size > limit {
                return Err(LpeError::TooLarge { what, limit });
            }
        }
        let number = self.list.len() as u16;
        self.known.insert(subset.clone(), number);
        self.list.push(subset);
        Ok(number)
    }

    /// All states but splits that these lead to, in rising order.
    fn closure(&mut self, seeds: &[u32]) -> Vec<u32> {
        self.searches += 1;
        let mut open = seeds.to_vec();
        let mut reached = Vec::new();
        while let Some(state) = open.pop() {
            self.work += 1;
            if std::mem::replace(&mut self.met[state as usize], self.searches) == self.searches {
                continue;
            }
            match &self.nfa.states[state as usize] {
                State::Split(next) => open.extend(next),
                _ => reached.push(state),
            }
        }
        reached.sort_unstable();
        reached
    }
}
