//! What is left to be visited, in memory that need not be cleared for every ray.

use super::lanes::WIDTH;
use super::tree::DEEPEST;
use std::mem::MaybeUninit;

/// Room for the deepest tree: at each level all children but the one that is visited.
const ROOM: usize = (WIDTH - 1) * DEEPEST + 1;

/// Entries of which the last is taken first. Those below `count` have been written.
pub(super) struct Stack<T> {
    entries: [MaybeUninit<T>; ROOM],
    count: usize,
}

impl<T: Copy + PartialOrd> Stack<T> {
    #[inline(always)]
    pub fn new() -> Self {
        Stack { entries: [const { MaybeUninit::uninit() }; ROOM], count: 0 }
    }

    #[inline(always)]
    pub fn len(&self) -> usize {
        self.count
    }

    #[inline(always)]
    pub fn push(&mut self, entry: T) {
        self.entries[self.count].write(entry);
        self.count += 1;
    }

    #[inline(always)]
    pub fn pop(&mut self) -> Option<T> {
        self.count = self.count.checked_sub(1)?;
        Some(self.get(self.count))
    }

    /// Adds an entry where it belongs among those from `start` on, of which each is at least the next one.
    #[inline(always)]
    pub fn insert(&mut self, start: usize, entry: T) {
        self.push(entry);
        let mut place = self.count - 1;
        while place > start && self.get(place - 1) < entry {
            self.entries.swap(place, place - 1);
            place -= 1;
        }
    }

    #[inline(always)]
    fn get(&self, place: usize) -> T {
        debug_assert!(place <= self.count);
        // SAFETY: entries are only looked at below `count`, or by `pop` right below what it was, and all of these have been written: by
        // `push`, or by `insert`, which only exchanges those that have been.
        unsafe { self.entries[place].assume_init() }
    }
}
