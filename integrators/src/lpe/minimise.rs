//! The smallest automaton of the same languages \[Hopcroft71\].

use super::dfa::Dfa;

impl Dfa {
    /// The automaton with the fewest states, numbered in the order in which a search from the start meets them: two automata over
    /// the same letters have the same languages if and only if these are equal.
    ///
    /// Every state must be reachable.
    pub fn minimised(&self) -> Self {
        let partition = Partition::of(self);
        // Any state of a block stands for it.
        let mut number = vec![None; partition.blocks.len()];
        let mut order = vec![partition.block_of[usize::from(self.start)]];
        number[order[0]] = Some(0);
        let mut next = Vec::new();
        let mut done = 0;
        while done < order.len() {
            let state = partition.elements[partition.blocks[order[done]].start];
            for letter in 0..self.letters {
                let block = partition.block_of[usize::from(self.step(state, letter))];
                next.push(*number[block].get_or_insert_with(|| {
                    order.push(block);
                    order.len() as u16 - 1
                }));
            }
            done += 1;
        }
        let accepts = |&block: &usize| self.accepts[usize::from(partition.elements[partition.blocks[block].start])];
        Self { letters: self.letters, next, accepts: order.iter().map(accepts).collect(), start: 0 }
    }

    /// The states that a letter leads from, by letter and the state that it leads to.
    fn predecessors(&self) -> Predecessors {
        let states = self.states();
        let mut ends = vec![0; self.letters * states + 1];
        let place = |letter: usize, to: u16| letter * states + usize::from(to);
        let transitions = || (0..states).flat_map(|from| (0..self.letters).map(move |letter| (from as u16, letter)));
        for (from, letter) in transitions() {
            ends[place(letter, self.step(from, letter)) + 1] += 1;
        }
        for i in 1..ends.len() {
            ends[i] += ends[i - 1];
        }
        let mut list = vec![0; self.next.len()];
        let mut free = ends.clone();
        for (from, letter) in transitions() {
            let next = &mut free[place(letter, self.step(from, letter))];
            list[*next] = from;
            *next += 1;
        }
        Predecessors { states, starts: ends, list }
    }
}

struct Predecessors {
    states: usize,
    starts: Vec<usize>,
    list: Vec<u16>,
}

impl Predecessors {
    fn of(&self, letter: usize, to: u16) -> &[u16] {
        let i = letter * self.states + usize::from(to);
        &self.list[self.starts[i]..self.starts[i + 1]]
    }
}

/// A block of states, `elements[start..end]`; those before `marked` are marked.
#[derive(Clone, Copy)]
struct Block {
    start: usize,
    marked: usize,
    end: usize,
}

/// States in blocks, which are split until no letter tells two states of a block apart.
struct Partition {
    /// The states, block by block.
    elements: Vec<u16>,
    /// Where each state stands among them.
    place: Vec<usize>,
    block_of: Vec<usize>,
    blocks: Vec<Block>,
}

impl Partition {
    fn of(dfa: &Dfa) -> Self {
        let mut partition = Self::by_acceptance(dfa);
        let predecessors = dfa.predecessors();
        let mut waiting: Vec<usize> = (0..partition.blocks.len()).collect();
        let mut is_waiting = vec![true; waiting.len()];
        while let Some(splitter) = waiting.pop() {
            is_waiting[splitter] = false;
            let Block { start, end, .. } = partition.blocks[splitter];
            let states = partition.elements[start..end].to_vec();
            for letter in 0..dfa.letters {
                let mut touched = Vec::new();
                for &from in states.iter().flat_map(|&to| predecessors.of(letter, to)) {
                    partition.mark(from, &mut touched);
                }
                for block in touched {
                    let Some(new) = partition.split(block) else { continue };
                    // The smaller part does, unless both are due anyway.
                    let size = |b: usize| partition.blocks[b].end - partition.blocks[b].start;
                    is_waiting.push(false);
                    let due = if is_waiting[block] || size(new) <= size(block) { new } else { block };
                    is_waiting[due] = true;
                    waiting.push(due);
                }
            }
        }
        partition
    }

    /// States that accept the same are in a block.
    fn by_acceptance(dfa: &Dfa) -> Self {
        let mut elements: Vec<u16> = (0..dfa.states() as u16).collect();
        elements.sort_by_key(|&state| dfa.accepts[usize::from(state)]);
        let mut partition =
            Self { place: vec![0; elements.len()], block_of: vec![0; elements.len()], blocks: Vec::new(), elements };
        for (i, &state) in partition.elements.iter().enumerate() {
            let accepts = |state: u16| dfa.accepts[usize::from(state)];
            if i == 0 || accepts(state) != accepts(partition.elements[i - 1]) {
                partition.blocks.push(Block { start: i, marked: i, end: i });
            }
            let block = partition.blocks.len() - 1;
            partition.blocks[block].end = i + 1;
            partition.place[usize::from(state)] = i;
            partition.block_of[usize::from(state)] = block;
        }
        partition
    }

    /// Marks a state, and notes its block if that is the first.
    fn mark(&mut self, state: u16, touched: &mut Vec<usize>) {
        let number = self.block_of[usize::from(state)];
        let block = &mut self.blocks[number];
        let (from, to) = (self.place[usize::from(state)], block.marked);
        if from < to {
            return;
        }
        if to == block.start {
            touched.push(number);
        }
        block.marked += 1;
        self.elements.swap(from, to);
        self.place[usize::from(self.elements[from])] = from;
        self.place[usize::from(self.elements[to])] = to;
    }

    /// Takes the marks away, and the marked states into a block of their own, if others are left.
    fn split(&mut self, block: usize) -> Option<usize> {
        let Block { start, marked, end } = self.blocks[block];
        self.blocks[block].marked = start;
        if marked == end {
            return None;
        }
        let new = self.blocks.len();
        self.blocks[block] = Block { start: marked, marked, end };
        self.blocks.push(Block { start, marked: start, end: marked });
        self.elements[start..marked].iter().for_each(|&state| self.block_of[usize::from(state)] = new);
        Some(new)
    }
}
