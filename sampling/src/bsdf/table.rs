//! What models with tables share: large, immutable data that a small, copyable model points to.
//!
//! A table lives as long as the program, and the same content is stored once, however many materials and scenes use it. So a
//! BSDF is a plain value without a lifetime, and a hit copies no table.

use super::{Bsdf, HalfVectors, MerlTable};
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::fmt;
use std::ops::Deref;
use std::sync::Mutex;

/// Any of the tables that arguments can be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Table {
    /// Of [`Merl`](super::Merl).
    Merl(Shared<MerlTable>),
    /// A density of half vectors.
    HalfVectors(Shared<HalfVectors>),
}

/// A table and the hash of what it was made from.
struct Entry<T> {
    hash: blake3::Hash,
    table: T,
}

/// A reference to a table. Two are equal if they were made from the same bytes.
pub struct Shared<T: 'static>(&'static Entry<T>);

impl<T> Clone for Shared<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Shared<T> {}

impl<T> PartialEq for Shared<T> {
    fn eq(&self, other: &Self) -> bool {
        self.0.hash == other.0.hash
    }
}

impl<T> fmt::Debug for Shared<T> {
    /// The hash of its content, so that what is printed tells contents apart.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "Table({})", self.0.hash)
    }
}

impl<T> Deref for Shared<T> {
    type Target = T;

    #[inline]
    fn deref(&self) -> &T {
        &self.0.table
    }
}

/// The tables of one kind that there are; a `static` in the file of its model.
pub struct Tables<T: 'static>(Mutex<BTreeMap<[u8; 32], Shared<T>>>);

impl<T> Tables<T> {
    /// None yet.
    pub const fn new() -> Self {
        Self(Mutex::new(BTreeMap::new()))
    }

    /// The table of these bytes: the one that is there, or else the one that `make` makes.
    ///
    /// # Errors
    ///
    /// Those of `make`.
    pub fn get<E>(&self, bytes: &[u8], make: impl FnOnce() -> Result<T, E>) -> Result<Shared<T>, E> {
        let hash = blake3::hash(bytes);
        let mut tables = self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        if let Some(shared) = tables.get(hash.as_bytes()) {
            return Ok(*shared);
        }
        let shared = Shared(Box::leak(Box::new(Entry { hash, table: make()? })));
        tables.insert(*hash.as_bytes(), shared);
        Ok(shared)
    }
}

impl Bsdf {
    /// The same where it stays, for models that are made of others.
    pub fn kept(self) -> &'static Self {
        static KEPT: Tables<Bsdf> = Tables::new();
        let kept = KEPT.get(format!("{self:?}").as_bytes(), || Ok::<_, Infallible>(self));
        match kept {
            Ok(Shared(entry)) => &entry.table,
            Err(impossible) => match impossible {},
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_bytes_make_one_table() {
        static TABLES: Tables<Vec<u8>> = Tables::new();
        let table =
            |bytes: &[u8]| TABLES.get(bytes, || if bytes.is_empty() { Err("empty") } else { Ok(bytes.to_vec()) });
        let (a, b, c) = (table(b"one").unwrap(), table(b"one").unwrap(), table(b"two").unwrap());
        assert!(std::ptr::eq(&*a, &*b) && a == b && a != c && *c == b"two");
        assert_ne!(format!("{a:?}"), format!("{c:?}"));
        assert_eq!(table(b""), Err("empty"));
    }
}
