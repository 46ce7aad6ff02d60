//! Which emitter to sample: in proportion to power.

use super::{Emitter, EmitterId};
use crate::error::SceneError;
use crate::needs::Skip;
use sampling::alias::AliasTable;
use sampling::fault;

/// The choice among a scene's emitters, in proportion to their power. An emitter without power is never chosen.
#[derive(Clone, Debug)]
pub(crate) enum EmitterChoice {
    /// No emitter has power.
    None,
    /// One emitter has it all.
    One(EmitterId),
    /// A table.
    Table(AliasTable),
}

impl EmitterChoice {
    /// The choice among these emitters.
    ///
    /// # Errors
    /// If the table cannot be made: there are too many emitters, or their powers overflow.
    pub fn new(emitters: &[Emitter], skip: Skip) -> Result<Self, SceneError> {
        let powers: Vec<f64> = emitters.iter().map(Emitter::power).collect();
        let mut bright = powers.iter().enumerate().filter(|(_, power)| **power > 0.0);
        Ok(match (bright.next(), bright.next()) {
            (None, _) => EmitterChoice::None,
            (Some((index, _)), None) if skip == Skip::Unneeded => EmitterChoice::One(EmitterId(index as u32)),
            _ => EmitterChoice::Table(AliasTable::new(&powers).map_err(|error| {
                let message = format!("there is no choosing among its {} emitters: {error}", emitters.len());
                SceneError::invalid(message, "use fewer emitters, or radiances of a smaller range")
            })?),
        })
    }

    /// An emitter and the probability of choosing it.
    #[inline]
    pub fn sample(&self, uc: f32) -> Option<(EmitterId, f32)> {
        match self {
            EmitterChoice::None => None,
            EmitterChoice::One(id) => Some((*id, 1.0)),
            EmitterChoice::Table(table) => {
                let (index, pmf, _) = table.sample(uc);
                Some((EmitterId(index as u32), fault!("power_weights_wrong", pmf, 0.5)))
            }
        }
    }

    /// The probability of choosing an emitter.
    #[inline]
    pub fn pmf(&self, id: EmitterId) -> f32 {
        match self {
            EmitterChoice::None => 0.0,
            EmitterChoice::One(one) => f32::from(u8::from(*one == id)),
            EmitterChoice::Table(table) => fault!("power_weights_wrong", table.pmf(id.0 as usize), 0.5),
        }
    }
}
