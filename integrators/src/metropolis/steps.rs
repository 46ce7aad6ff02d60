//! How chains step.

use serde::{Deserialize, Serialize};

/// How the chains of a method step, and where they may begin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Steps {
    /// Probability of a large step.
    pub large: f64,
    /// The largest small step in any number.
    pub small: f32,
    /// Points for each mutation at which chains may begin.
    pub bootstrap: f64,
}

/// The probability of large steps, above 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct LargeSteps(f64);

impl LargeSteps {
    /// The probability.
    pub fn probability(self) -> f64 {
        self.0
    }
}

impl Default for LargeSteps {
    fn default() -> Self {
        Self(0.3)
    }
}

impl TryFrom<f64> for LargeSteps {
    type Error = String;
    fn try_from(probability: f64) -> Result<Self, String> {
        if probability > 0.0 && probability <= 1.0 {
            return Ok(Self(probability));
        }
        Err(format!(
            "{probability} is no probability of steps that lead out of where a chain began; give a number above 0 and up to 1, such as 0.3"
        ))
    }
}

impl From<LargeSteps> for f64 {
    fn from(steps: LargeSteps) -> Self {
        steps.0
    }
}

/// The largest small step in any of a point's numbers, between 10⁻⁶ and ½; the smallest is a sixteenth of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct SmallStep(f64);

impl SmallStep {
    /// The largest.
    pub fn largest(self) -> f32 {
        self.0 as f32
    }
}

impl Default for SmallStep {
    fn default() -> Self {
        Self(1.0 / 64.0)
    }
}

impl TryFrom<f64> for SmallStep {
    type Error = String;
    fn try_from(largest: f64) -> Result<Self, String> {
        if (1e-6..=0.5).contains(&largest) {
            return Ok(Self(largest));
        }
        Err(format!(
            "numbers from 0 to 1 cannot take small steps of up to {largest}; give a number from 0.000001 to 0.5, such as 0.015625"
        ))
    }
}

impl From<SmallStep> for f64 {
    fn from(step: SmallStep) -> Self {
        step.0
    }
}

/// How many independent points are looked at for each mutation, above 0 and up to 64.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Bootstrap(f64);

impl Bootstrap {
    /// Points for each mutation.
    pub fn points(self) -> f64 {
        self.0
    }
}

impl Default for Bootstrap {
    fn default() -> Self {
        Self(0.125)
    }
}

impl TryFrom<f64> for Bootstrap {
    type Error = String;
    fn try_from(points: f64) -> Result<Self, String> {
        if points > 0.0 && points <= 64.0 {
            return Ok(Self(points));
        }
        Err(format!(
            "from {points} points for each mutation no chain can begin in due time; give a number above 0 and up to 64, such as 0.125"
        ))
    }
}

impl From<Bootstrap> for f64 {
    fn from(bootstrap: Bootstrap) -> Self {
        bootstrap.0
    }
}
