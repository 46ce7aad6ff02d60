//! Kinds of scattering.

use std::ops::{BitAnd, BitOr, BitOrAssign};

/// A set of kinds of scattering: reflection or transmission; diffuse, glossy or delta.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Lobes(u8);

impl Lobes {
    /// The empty set.
    pub const NONE: Self = Self(0);
    /// Reflection into the whole hemisphere.
    pub const DIFFUSE_REFLECTION: Self = Self(1);
    /// Reflection into a lobe.
    pub const GLOSSY_REFLECTION: Self = Self(1 << 1);
    /// Reflection into a single direction.
    pub const DELTA_REFLECTION: Self = Self(1 << 2);
    /// Transmission into the whole hemisphere.
    pub const DIFFUSE_TRANSMISSION: Self = Self(1 << 3);
    /// Transmission into a lobe.
    pub const GLOSSY_TRANSMISSION: Self = Self(1 << 4);
    /// Transmission into a single direction.
    pub const DELTA_TRANSMISSION: Self = Self(1 << 5);
    /// Every kind of reflection.
    pub const REFLECTION: Self = Self(0b000_111);
    /// Every kind of transmission.
    pub const TRANSMISSION: Self = Self(0b111_000);
    /// Both kinds into a single direction.
    pub const DELTA: Self = Self(0b100_100);
    /// Both diffuse lobes.
    pub const DIFFUSE: Self = Self(0b001_001);
    /// All that is not delta.
    pub const NON_DELTA: Self = Self(0b011_011);
    /// Every kind.
    pub const ALL: Self = Self(0b111_111);

    /// Whether all of `other` is in this set.
    #[inline]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether the two sets share a kind.
    #[inline]
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    /// Whether the set is empty.
    #[inline]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether there is something in the set and all of it is delta.
    #[inline]
    pub const fn is_delta(self) -> bool {
        self.0 != 0 && self.0 & Self::NON_DELTA.0 == 0
    }
}

impl BitOr for Lobes {
    type Output = Self;
    #[inline]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for Lobes {
    #[inline]
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

impl BitAnd for Lobes {
    type Output = Self;
    #[inline]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_named_sets_partition_the_kinds() {
        for (a, b) in [(Lobes::REFLECTION, Lobes::TRANSMISSION), (Lobes::DELTA, Lobes::NON_DELTA)] {
            assert_eq!(a | b, Lobes::ALL);
            assert_eq!(a & b, Lobes::NONE);
        }
        assert_eq!(Lobes::DELTA | Lobes::DELTA_REFLECTION, Lobes::DELTA);
        assert_eq!(Lobes::DELTA & Lobes::REFLECTION, Lobes::DELTA_REFLECTION);
        assert!(Lobes::DELTA.is_delta() && Lobes::DELTA_REFLECTION.is_delta());
        assert!(!Lobes::ALL.is_delta() && !Lobes::NONE.is_delta());
        assert!(Lobes::REFLECTION.contains(Lobes::GLOSSY_REFLECTION));
        assert!(!Lobes::GLOSSY_REFLECTION.contains(Lobes::REFLECTION));
        assert!(Lobes::GLOSSY_REFLECTION.intersects(Lobes::REFLECTION));
    }
}
