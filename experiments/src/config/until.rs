//! Budgets without a number of samples: until an error is small enough.

use super::{Fault, fault};
use crate::settings::Assignment;
use integrators::with_nearest;
use serde::{Deserialize, Serialize};
use std::str::FromStr;
use toml::Value;

/// More replicates until a bound is under its target, at whatever time one looks: see [`crate::statistics::sequential`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Until {
    /// Of which orders.
    #[serde(default)]
    pub order: OrderChoice,
    /// The relative error that an image mean may have; of each method by itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_error: Option<f64>,
    /// The relative bias between any two methods that would be found nine times out of ten; of all methods together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detectable_bias: Option<f64>,
}

impl FromStr for Until {
    type Err = String;

    /// As flags have it: `relative_error=0.01,order=all`.
    fn from_str(text: &str) -> Result<Self, String> {
        let mut table = toml::Table::new();
        for part in text.split(',') {
            let Assignment { path, value } = part.parse()?;
            table.insert(path.join("."), value);
        }
        table.try_into().map_err(|e: toml::de::Error| with_nearest(e.message()))
    }
}

impl Until {
    /// Checks what the types cannot.
    pub(super) fn check(&self, max_order: usize, methods: usize) -> Result<(), Fault> {
        let target = match (self.relative_error, self.detectable_bias) {
            (Some(error), None) => error,
            (None, Some(bias)) => bias,
            _ => {
                return fault(
                    "until",
                    "give either relative_error or detectable_bias, such as { relative_error = 0.01 }",
                );
            }
        };
        if !(target > 0.0 && target < 1.0) {
            return fault("until", format!("{target:?} is no target; give a part of the mean, such as 0.01 for 1 %"));
        }
        if let OrderChoice::One(order) = self.order
            && order > max_order
        {
            let message = format!("order {order} is above max_order {max_order}; raise that, or name a lower one");
            return fault("until", message);
        }
        if self.detectable_bias.is_some() && methods < 2 {
            return fault("until", "a bias is told between two methods; add another, or give relative_error");
        }
        Ok(())
    }
}

/// Which orders a target is for. In a file `"total"`, `"all"` or a number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Value", into = "Value")]
pub enum OrderChoice {
    /// The sum of all orders.
    #[default]
    Total,
    /// Every order by itself.
    All,
    /// One order.
    One(usize),
}

impl TryFrom<Value> for OrderChoice {
    type Error = String;

    fn try_from(value: Value) -> Result<Self, String> {
        match (value.as_str(), value.as_integer().and_then(|k| usize::try_from(k).ok())) {
            (Some("total"), _) => Ok(Self::Total),
            (Some("all"), _) => Ok(Self::All),
            (_, Some(order)) => Ok(Self::One(order)),
            _ => {
                Err(format!("{value} is no order; give a number, \"all\" for every order, or \"total\" for their sum"))
            }
        }
    }
}

impl From<OrderChoice> for Value {
    fn from(choice: OrderChoice) -> Value {
        match choice {
            OrderChoice::Total => Value::from("total"),
            OrderChoice::All => Value::from("all"),
            OrderChoice::One(order) => Value::from(order as i64),
        }
    }
}
