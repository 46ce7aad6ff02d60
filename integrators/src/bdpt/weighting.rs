//! How strategies are weighted.

use sampling::mis::Heuristic;
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// How strategies share a path. Written as a heuristic, `variance_aware` or `optimal`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Weighting {
    /// By their densities alone.
    Heuristic(Heuristic),
    /// By the balance heuristic on densities that are multiplied by what each strategy gains from being many samples of little variance, as a pilot
    /// finds \[Grittmann19\].
    VarianceAware,
    /// By the balance heuristic and what makes the variance least, as a pilot finds \[Kondapaneni19\]. Weights may be negative, or above 1.
    Optimal,
}

/// How [`Weighting::VarianceAware`] is written, and [`Weighting::Optimal`].
const VARIANCE_AWARE: &str = "variance_aware";
const OPTIMAL: &str = "optimal";

impl Weighting {
    /// The heuristic for paths of which no factors are known.
    pub fn heuristic(self) -> Heuristic {
        match self {
            Self::Heuristic(heuristic) => heuristic,
            Self::VarianceAware | Self::Optimal => Heuristic::Balance,
        }
    }
}

impl From<Heuristic> for Weighting {
    fn from(heuristic: Heuristic) -> Self {
        Self::Heuristic(heuristic)
    }
}

impl fmt::Display for Weighting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Heuristic(heuristic) => heuristic.fmt(f),
            Self::VarianceAware => f.write_str(VARIANCE_AWARE),
            Self::Optimal => f.write_str(OPTIMAL),
        }
    }
}

impl FromStr for Weighting {
    type Err = String;
    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            VARIANCE_AWARE => Ok(Self::VarianceAware),
            OPTIMAL => Ok(Self::Optimal),
            heuristic => match heuristic.parse() {
                Ok(heuristic) => Ok(Self::Heuristic(heuristic)),
                Err(reason) => Err(format!("{reason}, `{VARIANCE_AWARE}`, `{OPTIMAL}`")),
            },
        }
    }
}

impl TryFrom<String> for Weighting {
    type Error = String;
    fn try_from(name: String) -> Result<Self, String> {
        name.parse()
    }
}

impl From<Weighting> for String {
    fn from(weighting: Weighting) -> Self {
        weighting.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back() {
        for weighting in Heuristic::ALL.iter().map(|&h| h.into()).chain([Weighting::VarianceAware, Weighting::Optimal])
        {
            assert_eq!(weighting.to_string().parse(), Ok(weighting));
        }
        let reason = "variance".parse::<Weighting>().unwrap_err();
        assert!(reason.contains("`maximum`, `variance_aware`, `optimal`"), "{reason}");
    }
}
