//! Multiple importance sampling: the heuristics on densities of a path, in f64 [Veach97, chapter 9].

use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// How techniques that can generate the same path share it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Heuristic {
    /// w_s = p_s / Σ p_i [Veach97, section 9.2.2].
    #[default]
    Balance,
    /// w_s = p_s² / Σ p_i², the power heuristic with β = 2 [Veach97, section 9.2.3].
    Power,
}

impl Heuristic {
    /// Every heuristic.
    pub const ALL: &[Self] = &[Self::Balance, Self::Power];

    /// The term of a technique in the sum of weights, of the ratio of its density to the chosen technique's.
    ///
    /// The weight is w_s = 1 / Σ_i term(p_i / p_s), where the chosen technique's own term is 1. Ratios cancel what
    /// densities share, so the sum stays finite where products of densities would not.
    #[inline]
    pub fn term(self, ratio: f64) -> f64 {
        match self {
            Self::Balance => ratio,
            Self::Power => ratio * ratio,
        }
    }

    /// The weight of a sample of the first of two techniques; densities (in any common measure) times sample counts.
    ///
    /// `pdf_a` is positive and finite, since the sample exists. Weights of the two techniques sum to one. The ratio may
    /// overflow to infinity, where the weight is 0, as it should be.
    #[inline]
    pub fn weight2(self, pdf_a: f64, pdf_b: f64) -> f64 {
        debug_assert!(pdf_a > 0.0 && pdf_a.is_finite() && pdf_b >= 0.0, "densities {pdf_a}, {pdf_b}");
        1.0 / (1.0 + self.term(pdf_b / pdf_a))
    }
}

impl fmt::Display for Heuristic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Balance => "balance",
            Self::Power => "power",
        })
    }
}

impl FromStr for Heuristic {
    type Err = String;
    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL
            .iter()
            .copied()
            .find(|h| h.to_string() == name)
            .ok_or_else(|| format!("`{name}` is not an MIS heuristic; there are balance and power"))
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
        assert_eq!(Heuristic::Power.weight2(1.0, 3.0), 0.1);
    }

    #[test]
    fn names_read_back() {
        for &h in Heuristic::ALL {
            assert_eq!(h.to_string().parse(), Ok(h));
        }
        assert!("Balance!".parse::<Heuristic>().is_err());
    }
}
