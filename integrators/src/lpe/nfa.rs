//! Non-deterministic automata of a set of expressions \[Thompson68\]; the camera, with which every path begins, is left out.

use super::alphabet::Predicate;
use super::error::LpeError;
use super::expression::{Node, Sort};
use std::collections::HashMap;

/// A state: what may come next.
#[derive(Clone, Debug)]
pub(super) enum State {
    /// Any of these states, at once.
    Split(Vec<u32>),
    /// A vertex that fits this predicate, and then that state.
    Step { predicate: usize, to: u32 },
    /// Nothing: a word of this expression ends.
    Accept(usize),
}

/// All predicates of a set, each once.
#[derive(Default)]
pub(super) struct Predicates {
    pub list: Vec<Predicate>,
    known: HashMap<Predicate, usize>,
}

impl Predicates {
    fn number(&mut self, predicate: Predicate) -> usize {
        *self.known.entry(predicate).or_insert_with_key(|new| {
            self.list.push(new.clone());
            self.list.len() - 1
        })
    }
}

/// The bound of the states; an expression by itself stays far below.
const MAX_SIZE: usize = 1 << 16;

#[derive(Default)]
pub(super) struct Nfa {
    pub states: Vec<State>,
    /// Where the expressions start.
    pub starts: Vec<u32>,
}

impl Nfa {
    /// Adds an expression. Its names have these numbers in the set.
    pub fn add(
        &mut self,
        root: &Node,
        expression: usize,
        names: &[usize],
        predicates: &mut Predicates,
    ) -> Result<(), LpeError> {
        let end = self.push(State::Accept(expression))?;
        let start = Compiler { nfa: self, names, predicates }.compile(root, end)?;
        self.starts.push(start);
        Ok(())
    }

    fn push(&mut self, state: State) -> Result<u32, LpeError> {
        if self.states.len() == MAX_SIZE {
            return Err(LpeError::TooLarge { what: "states before they are made deterministic", limit: MAX_SIZE });
        }
        self.states.push(state);
        Ok(self.states.len() as u32 - 1)
    }
}

struct Compiler<'a> {
    nfa: &'a mut Nfa,
    names: &'a [usize],
    predicates: &'a mut Predicates,
}

impl Compiler<'_> {
    /// The state from which a word of the node leads to the state `to`.
    fn compile(&mut self, node: &Node, to: u32) -> Result<u32, LpeError> {
        match node {
            Node::Vertex(vertex) if vertex.sort == Sort::Camera => Ok(to),
            Node::Vertex(vertex) => {
                let predicate = self.predicates.number((vertex.sort, vertex.what.renamed(self.names)));
                self.nfa.push(State::Step { predicate, to })
            }
            Node::Sequence(parts) => parts.iter().rev().try_fold(to, |to, part| self.compile(part, to)),
            Node::Choice(parts) => {
                let starts = parts.iter().map(|part| self.compile(part, to)).collect::<Result<_, _>>()?;
                self.nfa.push(State::Split(starts))
            }
            Node::Repeat { body, least, most } => {
                let (start, copies) = match most {
                    None => (self.compile_loop(body, *least, to)?, least.saturating_sub(1)),
                    Some(most) => (self.compile_optional(body, most - least, to)?, *least),
                };
                (0..copies).try_fold(start, |to, _| self.compile(body, to))
            }
        }
    }

    /// Any number of turns, but one at least where `least` isn't zero.
    fn compile_loop(&mut self, body: &Node, least: usize, to: u32) -> Result<u32, LpeError> {
        let split = self.nfa.push(State::Split(Vec::new()))?;
        let start = self.compile(body, split)?;
        self.nfa.states[split as usize] = State::Split(vec![start, to]);
        Ok(if least == 0 { split } else { start })
    }

    /// Up to this many turns.
    fn compile_optional(&mut self, body: &Node, turns: usize, to: u32) -> Result<u32, LpeError> {
        (0..turns).try_fold(to, |next, _| {
            let start = self.compile(body, next)?;
            self.nfa.push(State::Split(vec![start, to]))
        })
    }
}
