//! Multiple importance sampling: the heuristics on densities of a path, in f64 [Veach97, chapter 9].

use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// How techniques that can generate the same path share it. Written `balance`, `power` (β = 2), `power:1.5`, `maximum`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Heuristic {
    /// w_s = p_s / Σ p_i [Veach97, section 9.2.2].
    #[default]
    Balance,
    /// w_s = p_s^β / Σ p_i^β, the power heuristic with this exponent β > 0 [Veach97, section 9.2.3].
    Power(f64),
    /// All to the technique of the highest density [Veach97, section 9.2.3]; shared by those that have it.
    Maximum,
}

/// The exponent that stands for the infinite one of the maximum heuristic: what is within a thousandth of the highest density
/// shares with it, so that ties are no matter of rounding, and weights still sum to one.
const NEARLY_INFINITE: f64 = 1e3;

/// What the other techniques that could have made a path have against the one at hand: their terms in the sum of weights, summed up
/// as far as they are known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rivals {
    /// The sum of terms; to the maximum heuristic the highest ratio of densities.
    value: f64,
    /// To the maximum heuristic, the sum of terms relative to that of the highest.
    ties: f64,
}

impl Rivals {
    /// None yet.
    pub const NONE: Self = Self { value: 0.0, ties: 0.0 };
}

impl Heuristic {
    /// The power heuristic as it is commonly used, with β = 2.
    pub const POWER: Self = Self::Power(2.0);
    /// One of every kind.
    pub const ALL: &[Self] = &[Self::Balance, Self::POWER, Self::Maximum];

    /// The term of a ratio of densities.
    #[inline]
    fn term(self, ratio: f64) -> f64 {
        match self {
            Self::Balance | Self::Maximum => ratio,
            Self::Power(2.0) => ratio * ratio,
            Self::Power(beta) => ratio.powf(beta),
        }
    }

    /// The rivals and one more, whose density is `ratio` times that of the technique they are rivals of.
    ///
    /// Ratios cancel what densities share, so that sums stay finite where products of densities would not.
    #[inline]
    pub fn join(self, rivals: Rivals, ratio: f64) -> Rivals {
        self.merge(rivals, Rivals { value: self.term(ratio), ties: 1.0 })
    }

    /// Two sets of rivals of one technique, together.
    #[inline]
    pub fn merge(self, a: Rivals, b: Rivals) -> Rivals {
        if self != Self::Maximum {
            return Rivals { value: a.value + b.value, ties: 0.0 };
        }
        let (high, low) = if a.value >= b.value { (a, b) } else { (b, a) };
        // Where both are infinite, or there are none at all, they are alike.
        let share = if low.value == high.value { 1.0 } else { (low.value / high.value).powf(NEARLY_INFINITE) };
        Rivals { value: high.value, ties: high.ties + low.ties * share }
    }

    /// The rivals of one technique as those of another, whose density the first one's is `ratio` times.
    #[inline]
    pub fn relative(self, rivals: Rivals, ratio: f64) -> Rivals {
        // Nothing comes of no rivals, nor of those that cannot make the path, even where the other factor overflows.
        if rivals.value == 0.0 || ratio == 0.0 {
            return Rivals::NONE;
        }
        Rivals { value: rivals.value * self.term(ratio), ties: rivals.ties }
    }

    /// The weight of a technique with these rivals, in [0, 1].
    #[inline]
    pub fn weight(self, rivals: Rivals) -> f64 {
        match self {
            Self::Maximum => {
                let all = self.join(rivals, 1.0);
                (1.0 / all.value).powf(NEARLY_INFINITE) / all.ties
            }
            _ => 1.0 / (1.0 + rivals.value),
        }
    }

    /// The weight of a sample of the first of two techniques; densities (in any common measure) times sample counts.
    ///
    /// `pdf_a` is positive and finite, since the sample exists. Weights of the two techniques sum to one. The ratio may
    /// overflow to infinity, where the weight is 0, as it should be.
    #[inline]
    pub fn weight2(self, pdf_a: f64, pdf_b: f64) -> f64 {
        debug_assert!(pdf_a > 0.0 && pdf_a.is_finite() && pdf_b >= 0.0, "densities {pdf_a}, {pdf_b}");
        self.weight(self.join(Rivals::NONE, pdf_b / pdf_a))
    }
}

impl fmt::Display for Heuristic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Balance => f.write_str("balance"),
            Self::Power(2.0) => f.write_str("power"),
            Self::Power(beta) => write!(f, "power:{beta}"),
            Self::Maximum => f.write_str("maximum"),
        }
    }
}

impl FromStr for Heuristic {
    type Err = String;
    fn from_str(name: &str) -> Result<Self, String> {
        if let Some(heuristic) = Self::ALL.iter().copied().find(|h| h.to_string() == name) {
            return Ok(heuristic);
        }
        let beta = name.strip_prefix("power:").map(|beta| beta.trim().parse::<f64>());
        match beta {
            Some(Ok(beta)) if beta > 0.0 && beta.is_finite() => Ok(Self::Power(beta)),
            Some(_) => {
                Err(format!("`{name}`: the exponent of the power heuristic must be a number above 0, as in power:1.5"))
            }
            None => Err(format!(
                "unknown heuristic `{name}`, expected one of `balance`, `power`, `power:EXPONENT`, `maximum`"
            )),
        }
    }
}

impl TryFrom<String> for Heuristic {
    type Error = String;
    fn try_from(name: String) -> Result<Self, String> {
        name.parse()
    }
}

impl From<Heuristic> for String {
    fn from(heuristic: Heuristic) -> Self {
        heuristic.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_weights_sum_to_one() {
        for &h in Heuristic::ALL {
            for (a, b) in [(1.0, 1.0), (1e-40, 1e40), (1e-300, 1e300), (3.0, 0.25), (5e-324, 1e308)] {
                let (wa, wb) = (h.weight2(a, b), h.weight2(b, a));
                assert!((wa + wb - 1.0).abs() < 1e-15, "{h}: {a} {b}: {wa} + {wb}");
            }
            assert_eq!(h.weight2(2.0, 0.0), 1.0);
            assert_eq!(h.weight2(2.0, f64::INFINITY), 0.0);
        }
    }

    #[test]
    fn known_values() {
        assert_eq!(Heuristic::Balance.weight2(1.0, 3.0), 0.25);
        assert_eq!(Heuristic::POWER.weight2(1.0, 3.0), 0.1);
        assert!((Heuristic::Power(3.0).weight2(1.0, 2.0) - 1.0 / 9.0).abs() < 1e-15);
        assert_eq!(Heuristic::Maximum.weight2(1.0, 3.0), 0.0);
        assert_eq!(Heuristic::Maximum.weight2(3.0, 1.0), 1.0);
    }

    /// Of rivals 3 and 2 that another technique has ten times, the larger one's density is what counts.
    #[test]
    fn the_larger_of_two_sets_of_rivals_decides_in_the_maximum() {
        let h = Heuristic::Maximum;
        let [three, two] = [3.0, 2.0].map(|ratio| h.join(Rivals::NONE, ratio));
        for both in [h.merge(three, two), h.merge(two, three)] {
            assert_eq!((both.value, both.ties), (3.0, 1.0));
            assert_eq!(h.weight(h.relative(both, 0.1)), 1.0);
        }
    }

    #[test]
    fn names_read_back() {
        for &h in Heuristic::ALL {
            assert_eq!(h.to_string().parse(), Ok(h));
        }
        assert_eq!("power:1.5".parse(), Ok(Heuristic::Power(1.5)));
        assert_eq!(Heuristic::Power(1.5).to_string(), "power:1.5");
        for bad in ["Balance!", "power:", "power:0", "power:-1", "power:inf"] {
            assert!(bad.parse::<Heuristic>().is_err(), "{bad}");
        }
    }

    /// Rivals added one by one or by groups, and moved from technique to technique, give the weights of their densities; these
    /// sum to one.
    #[test]
    fn partial_sums_give_the_weights_of_the_whole() {
        let densities = [3.0, 1e-3, 0.0, 7.0, 7.0, 0.25, 2.0];
        for h in [Heuristic::Balance, Heuristic::POWER, Heuristic::Power(1.5), Heuristic::Maximum] {
            let mut sum = 0.0;
            for (own, &p) in densities.iter().enumerate().filter(|(_, p)| **p > 0.0) {
                let (below, above) = (&densities[..own], &densities[own + 1..]);
                let all = |ps: &[f64]| ps.iter().fold(Rivals::NONE, |r, q| h.join(r, q / p));
                let plain = h.weight(h.merge(all(below), all(above)));
                let moved = ps_relative(h, below, p);
                let weight = h.weight(h.merge(moved, all(above)));
                assert!((weight - plain).abs() < 1e-12, "{h}");
                sum += weight;
            }
            assert!((sum - 1.0).abs() < 1e-12, "{h}: {sum}");
        }
        assert_eq!(Heuristic::POWER.relative(Rivals { value: f64::INFINITY, ties: 0.0 }, 0.0), Rivals::NONE);
    }

    /// The rivals of a technique of density `p`, moved there from one of density 5.
    fn ps_relative(h: Heuristic, rivals: &[f64], p: f64) -> Rivals {
        h.relative(rivals.iter().fold(Rivals::NONE, |r, q| h.join(r, q / 5.0)), 5.0 / p)
    }
}
