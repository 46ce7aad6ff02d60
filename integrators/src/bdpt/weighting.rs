//! How strategies are weighted.

use sampling::mis::Heuristic;
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// How strategies share a path. Written as a heuristic, or `variance_aware`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Weighting {
    /// By their densities alone.
    Heuristic(Heuristic),
    /// By the balance heuristic on densities that are multiplied by what each strategy gains from being many samples of little variance, as a pilot
    /// finds \[Grittmann19\].
    VarianceAware,
}

/// How [`Weighting::VarianceAware`] is written.
const VARIANCE_AWARE: &str = "variance_aware";

impl Weighting {
    /// The heuristic for paths of which no factors are known.
    pub fn heuristic(self) -> Heuristic {
        match self {
            Self::Heuristic(heuristic) => heuristic,
            Self::VarianceAware => Heuristic::Balance,
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
        }
    }
}

impl FromStr for Weighting {
    type Err = String;
    fn from_str(name: &str) -> Result<Self, String> {
        if name == VARIANCE_AWARE {
            return Ok(Self::VarianceAware);
        }
        let heuristic = name.parse().map_err(|reason| format!("{reason}, `{VARIANCE_AWARE}`"))?;
        Ok(Self::Heuristic(heuristic))
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
        for weighting in Heuristic::ALL.iter().map(|&h| h.into()).chain([Weighting::VarianceAware]) {
            assert_eq!(weighting.to_string().parse(), Ok(weighting));
        }
        let reason = "variance".parse::<Weighting>().unwrap_err();
        assert!(reason.contains("`maximum`, `variance_aware`"), "{reason}");
    }
}
