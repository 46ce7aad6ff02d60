//! What an expression says about one vertex: a union of conjunctions, closed under and, or, not.

use super::{Event, Scattering};

/// A set of names, one bit a name.
pub(super) type Names = u128;

/// What happens at a scattering vertex, one number for event and scattering.
pub(super) type Kind = u8;

/// How many kinds there are.
pub(super) const KINDS: Kind = 9;

/// The number of what happens at a vertex.
#[inline]
pub(super) fn kind(event: Event, scattering: Scattering) -> Kind {
    event as Kind * 3 + scattering as Kind
}

/// What has this number.
pub(super) fn of_kind(kind: Kind) -> (Event, Scattering) {
    (Event::ALL[usize::from(kind / 3)], Scattering::ALL[usize::from(kind % 3)])
}

const ALL_KINDS: u16 = (1 << KINDS) - 1;

/// A conjunction: the vertex is one of these kinds, has these names, and has none of those.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct Term {
    kinds: u16,
    with: Names,
    without: Names,
}

impl Term {
    const ANY: Term = Term { kinds: ALL_KINDS, with: 0, without: 0 };

    fn is_possible(self) -> bool {
        self.kinds != 0 && self.with & self.without == 0
    }

    fn and(self, other: Self) -> Self {
        let Self { kinds, with, without } = other;
        Self { kinds: self.kinds & kinds, with: self.with | with, without: self.without | without }
    }

    /// Whether all that fits `other` fits this.
    fn includes(self, other: Self) -> bool {
        self.and(other) == other
    }

    /// What doesn't fit, as a union.
    fn negated(self) -> impl Iterator<Item = Term> {
        let bits = |names: Names| (0..Names::BITS).map(|i| 1 << i).filter(move |bit| names & bit != 0);
        let kinds = Term { kinds: ALL_KINDS & !self.kinds, ..Term::ANY };
        let lacking = bits(self.with).map(|without| Term { without, ..Term::ANY });
        let having = bits(self.without).map(|with| Term { with, ..Term::ANY });
        std::iter::once(kinds).chain(lacking).chain(having)
    }
}

/// More terms than this are refused: their number can be exponential in the length of what was written.
pub(super) const MAX_TERMS: usize = 64;

/// A union of conjunctions, each of which some vertex fits and none of which lies within another.
///
/// An operation gives `None` where the union has more than [`MAX_TERMS`].
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) struct Description(Vec<Term>);

impl Description {
    /// Any vertex.
    pub fn any() -> Self {
        Self(vec![Term::ANY])
    }

    /// No vertex.
    pub fn none() -> Self {
        Self(Vec::new())
    }

    /// The vertices where this happens.
    pub fn event(event: Event) -> Self {
        Self::kinds(|e, _| e == event)
    }

    /// The vertices that scatter like this.
    pub fn scattering(scattering: Scattering) -> Self {
        Self::kinds(|_, s| s == scattering)
    }

    fn kinds(wanted: impl Fn(Event, Scattering) -> bool) -> Self {
        let bit = |k: Kind| {
            let (event, scattering) = of_kind(k);
            u16::from(wanted(event, scattering)) << k
        };
        Self(vec![Term { kinds: (0..KINDS).map(bit).sum(), ..Term::ANY }])
    }

    /// The vertices with the name of this number.
    pub fn name(index: usize) -> Self {
        Self(vec![Term { with: 1 << index, ..Term::ANY }])
    }

    /// Whether no vertex fits.
    pub fn is_none(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether a vertex of this kind with exactly these names fits.
    pub fn contains(&self, kind: Kind, names: Names) -> bool {
        let fits = |t: &Term| t.kinds & (1 << kind) != 0 && names & t.with == t.with && names & t.without == 0;
        self.0.iter().any(fits)
    }

    /// All names that it mentions.
    pub fn names(&self) -> Names {
        self.0.iter().fold(0, |names, t| names | t.with | t.without)
    }

    /// The same with other numbers for the names.
    pub fn renamed(&self, numbers: &[usize]) -> Self {
        let map = |names: Names| {
            let numbered = numbers.iter().enumerate().filter(|(i, _)| names & (1 << i) != 0);
            numbered.fold(0, |mapped, (_, number)| mapped | 1 << number)
        };
        Self(self.0.iter().map(|t| Term { with: map(t.with), without: map(t.without), ..*t }).collect())
    }

    /// What fits either.
    pub fn or(&self, other: &Self) -> Option<Self> {
        Self::of(self.0.iter().chain(&other.0).copied())
    }

    /// What fits both.
    pub fn and(&self, other: &Self) -> Option<Self> {
        Self::of(self.0.iter().flat_map(|a| other.0.iter().map(|b| a.and(*b))))
    }

    /// What doesn't fit.
    pub fn not(&self) -> Option<Self> {
        let all = |left: Self, term: &Term| left.and(&Self(term.negated().filter(|t| t.is_possible()).collect()));
        self.0.iter().try_fold(Self::any(), all)
    }

    fn of(terms: impl Iterator<Item = Term>) -> Option<Self> {
        let mut kept: Vec<Term> = Vec::new();
        for term in terms.filter(|t| t.is_possible()) {
            if kept.iter().any(|k| k.includes(term)) {
                continue;
            }
            kept.retain(|k| !term.includes(*k));
            if kept.len() == MAX_TERMS {
                return None;
            }
            kept.push(term);
        }
        Some(Self(kept))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_description_and_its_opposite_share_nothing_and_leave_nothing() {
        let [a, b] = [0, 1].map(Description::name);
        let red = Description::event(Event::Reflection).and(&Description::scattering(Scattering::Diffuse)).unwrap();
        let some = red.and(&a).unwrap().or(&b).unwrap();
        let others = some.not().unwrap();
        for kind in 0..KINDS {
            for names in 0..4 {
                let expected = (kind == 0 && names & 1 != 0) || names & 2 != 0;
                assert_eq!(some.contains(kind, names), expected);
                assert_eq!(others.contains(kind, names), !expected);
            }
        }
        assert!(some.and(&others).unwrap().is_none());
        assert_eq!(others.not().unwrap().and(&some), Some(some));
        assert!(Description::any().not().unwrap().is_none());
        assert_eq!(Description::none().not(), Some(Description::any()));
    }

    #[test]
    fn what_lies_within_another_is_not_kept() {
        let diffuse = Description::scattering(Scattering::Diffuse);
        assert_eq!(diffuse.or(&Description::any()), Some(Description::any()));
        let named = (0..100).try_fold(Description::none(), |sum, i| sum.or(&Description::name(i)));
        assert_eq!(named, None, "too many");
        // A set of names that a vertex is not to have is one conjunction.
        let unnamed = (0..100).try_fold(Description::any(), |sum, i| sum.and(&Description::name(i).not()?)).unwrap();
        assert!(unnamed.contains(0, 0) && !unnamed.contains(0, 1 << 99));
    }

    #[test]
    fn names_are_renumbered() {
        let description = Description::name(0).and(&Description::name(1).not().unwrap()).unwrap().renamed(&[5, 2]);
        assert_eq!(description.names(), 0b100100);
        assert!(description.contains(3, 0b100000) && !description.contains(3, 0b100100));
    }
}
