//! The memory of the blocks in flight, kept from replicate to replicate: pages that are new cost more than what is written to them.
//!
//! All renders of the process share it, since they trace by turns, and each by itself would hold as much.

use crate::splats::Splats;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What no block uses now.
static SPARE: Mutex<Vec<BlockStore>> = Mutex::new(Vec::new());

/// The memory of a block's film.
#[derive(Clone, Debug, Default)]
pub struct BlockStore {
    pub(super) sums: Vec<f64>,
    pub(super) splats: Splats,
}

impl BlockStore {
    /// So many of them; what they hold has no meaning.
    pub fn take(count: usize) -> Vec<Self> {
        let mut spare = spare();
        let kept = spare.len().saturating_sub(count);
        let mut stores = spare.split_off(kept);
        stores.resize(count, Self::default());
        stores
    }

    /// Keeps memory for whoever takes it next.
    pub fn give_back(stores: impl Iterator<Item = Self>) {
        spare().extend(stores);
    }
}

fn spare() -> MutexGuard<'static, Vec<BlockStore>> {
    SPARE.lock().unwrap_or_else(PoisonError::into_inner)
}
