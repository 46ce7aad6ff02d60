//! What models with tables share: large, immutable data that a small, copyable model points to.
//!
//! A table lives as long as the program, and the same content is stored once, however many materials and scenes use it. So a
//! BSDF is a plain value without a lifetime, and a hit copies no table.

use super::{Bsdf, HalfVectors, MerlTable};
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::fmt;
use std::ops::Deref;
use std::sync::{Mutex, OnceLock};

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

/// Tables that are made from `N` numbers, such as a roughness and an index; a `static` in the file of its model.
///
/// Where a texture gives a colour, a model is made at every hit, in all threads. So a table that is there is found without a
/// lock and without a hash of its content, and nothing is ever removed.
pub struct Recalled<const N: usize, T: 'static>([OnceLock<Box<Link<N, T>>>; LISTS]);

/// How many lists there are, a power of two.
const LISTS: usize = 64;

/// A table in the list of those whose numbers fall together.
struct Link<const N: usize, T: 'static> {
    /// Their bits.
    numbers: [u32; N],
    table: Shared<T>,
    next: OnceLock<Box<Link<N, T>>>,
}

impl<const N: usize, T: 'static> Recalled<N, T> {
    /// None yet.
    pub const fn new() -> Self {
        Self([const { OnceLock::new() }; LISTS])
    }

    /// The table of these numbers: the one that is there, or else the one that `make` makes.
    #[inline]
    pub fn get(&self, numbers: [f32; N], make: impl FnOnce() -> T) -> Shared<T> {
        let numbers = numbers.map(f32::to_bits);
        // Odd multiples of 2³² over the golden ratio, of which the first bits are well mixed.
        let mixed = numbers.iter().fold(0_u32, |mixed, bits| (mixed ^ bits).wrapping_mul(0x9e37_79b9));
        let mut next = &self.0[(mixed >> 26) as usize];
        while let Some(link) = next.get() {
            if link.numbers == numbers {
                return link.table;
            }
            next = &link.next;
        }
        Self::append(next, numbers, make)
    }

    /// At the end of a list. Another thread may have come first, with these numbers or with others.
    #[cold]
    fn append(mut end: &OnceLock<Box<Link<N, T>>>, numbers: [u32; N], make: impl FnOnce() -> T) -> Shared<T> {
        let mut make = Some(make);
        loop {
            let link = end.get_or_init(|| {
                let make = make.take().expect("the loop ends with what was made");
                let bytes: Vec<u8> = numbers.iter().flat_map(|bits| bits.to_le_bytes()).collect();
                let table = Shared(Box::leak(Box::new(Entry { hash: blake3::hash(&bytes), table: make() })));
                Box::new(Link { numbers, table, next: OnceLock::new() })
            });
            if link.numbers == numbers {
                return link.table;
            }
            end = &link.next;
        }
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

    #[test]
    fn the_same_numbers_make_one_table() {
        static TABLES: Recalled<2, f32> = Recalled::new();
        let made = |i: u16| TABLES.get([f32::from(i), 0.5], || f32::from(i) + 0.5);
        // From several threads, more than there are lists.
        let all = || (0..500).map(made).collect::<Vec<_>>();
        let (first, second) = std::thread::scope(|scope| {
            let other = scope.spawn(all);
            (all(), other.join().expect("no panic"))
        });
        for (i, (a, b)) in first.iter().zip(&second).enumerate() {
            assert!(std::ptr::eq(&**a, &**b) && **a == i as f32 + 0.5, "{i}");
        }
        assert!(first[3] != first[4]);
    }
}
