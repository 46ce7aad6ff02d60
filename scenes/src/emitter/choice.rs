//! Which emitter to sample: for light walks in proportion to power, for a point to be lit as the scene's rule says.

use super::gloss::{EmitterOdds, GlossChoice};
use super::tree::EmitterTree;
use super::{Emitter, EmitterId};
use crate::error::SceneError;
use crate::interaction::Interaction;
use crate::needs::{Skip, Work};
use crate::ray::SurfacePoint;
use sampling::Vec3;
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
            (Some((index, _)), None) if skip.leaves_out(Work::EmitterChoice) => {
                EmitterChoice::One(EmitterId(index as u32))
            }
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

/// How next-event estimation chooses among emitters. None of them changes a mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ChoiceRule {
    /// In proportion to power.
    #[default]
    Power,
    /// All that have power alike.
    Uniform,
    /// By a tree of emitters, in proportion to the light that they may bring to the point.
    Tree,
    /// By power, and in `path` and `direct` on glossy surfaces in proportion to what these may scatter of each.
    Gloss,
}

impl ChoiceRule {
    /// The names by which it is chosen.
    pub const NAMES: [&str; 4] = ["power", "uniform", "tree", "gloss"];
    /// All of them, in the order of their names.
    pub const ALL: [Self; 4] = [Self::Power, Self::Uniform, Self::Tree, Self::Gloss];
    /// Those that any number of emitters can have.
    pub const FOR_ANY_NUMBER: [Self; 3] = [Self::Power, Self::Uniform, Self::Tree];
    /// Up to so many emitters of some power, a tree is not worth its steps.
    const FEW: usize = 8;

    /// The rule for a scene that does not say: by a tree where there are many emitters, else by power, or by gloss where there is some and a choice.
    pub(crate) fn for_emitters(emitters: &[Emitter], glossy: bool) -> Self {
        match emitters.iter().filter(|emitter| emitter.power() > 0.0).count() {
            bright if bright > Self::FEW => Self::Tree,
            bright if bright > 1 && glossy && emitters.len() <= GlossChoice::MOST => Self::Gloss,
            _ => Self::Power,
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }
}

/// The choice among emitters for a point to be lit.
#[derive(Clone, Debug)]
pub(crate) enum NextEventChoice {
    /// As for light walks.
    Power,
    /// All alike.
    Uniform(EmitterChoice),
    /// By a tree.
    Tree(TreeChoice),
    /// As for light walks, but for light that glossy surfaces scatter.
    Gloss(GlossChoice),
}

/// A tree for the emitters that are somewhere, beside those that lie infinitely far, each of which is as likely as the whole tree.
///
/// A part of the choices is by power whatever the tree says, so that no emitter which lights the point in a way that the tree
/// doesn't know of is starved: variance is at most 1 / `BY_POWER` times that of a choice by power.
#[derive(Clone, Debug)]
pub(crate) struct TreeChoice {
    tree: EmitterTree,
    distant: Vec<EmitterId>,
}

/// The part of a tree's choices that are by power, and of those for glossy surfaces.
pub(super) const BY_POWER: f32 = 0.125;

impl NextEventChoice {
    /// The choice among these emitters.
    ///
    /// # Errors
    /// If there are too many of them for a table.
    pub fn new(rule: ChoiceRule, emitters: &[Emitter]) -> Result<Self, SceneError> {
        let bright: Vec<bool> = emitters.iter().map(|emitter| emitter.power() > 0.0).collect();
        Ok(match rule {
            _ if !bright.contains(&true) => NextEventChoice::Power,
            ChoiceRule::Power => NextEventChoice::Power,
            ChoiceRule::Uniform => {
                let weights: Vec<f64> = bright.iter().map(|&bright| f64::from(u8::from(bright))).collect();
                let table = AliasTable::new(&weights).map_err(|error| {
                    let message = format!("there is no choosing among its {} emitters: {error}", emitters.len());
                    SceneError::invalid(message, "use fewer emitters")
                })?;
                NextEventChoice::Uniform(EmitterChoice::Table(table))
            }
            ChoiceRule::Tree => {
                let is_distant = |index: &usize| bright[*index] && emitters[*index].is_distant();
                let distant = (0..emitters.len()).filter(is_distant).map(|index| EmitterId(index as u32)).collect();
                NextEventChoice::Tree(TreeChoice { tree: EmitterTree::new(emitters), distant })
            }
            ChoiceRule::Gloss if emitters.len() > GlossChoice::MOST => {
                let message = format!(
                    "`gloss` asks every glossy surface for each emitter, bright or dark, which are {} at most, and there are {}",
                    GlossChoice::MOST,
                    emitters.len()
                );
                return Err(SceneError::invalid(message, "write `emitter_choice = \"tree\"`"));
            }
            // One is chosen whatever a surface says.
            ChoiceRule::Gloss if bright.iter().filter(|bright| **bright).count() < 2 => NextEventChoice::Power,
            ChoiceRule::Gloss => NextEventChoice::Gloss(GlossChoice::new(emitters)),
        })
    }

    /// An emitter for a point to be lit by, and the probability of choosing it; None if none can light it.
    #[inline]
    pub fn sample(&self, by_power: &EmitterChoice, at: &SurfacePoint, uc: f32) -> Option<(EmitterId, f32)> {
        match self {
            NextEventChoice::Power | NextEventChoice::Gloss(_) => by_power.sample(uc),
            NextEventChoice::Uniform(table) => table.sample(uc),
            NextEventChoice::Tree(tree) => tree.sample(by_power, at, uc),
        }
    }

    /// The probability of choosing an emitter for a point.
    #[inline]
    pub fn pmf(&self, by_power: &EmitterChoice, at: &SurfacePoint, id: EmitterId) -> f32 {
        match self {
            NextEventChoice::Power | NextEventChoice::Gloss(_) => by_power.pmf(id),
            NextEventChoice::Uniform(table) => table.pmf(id),
            NextEventChoice::Tree(tree) => tree.pmf(by_power, at, id),
        }
    }

    /// How likely each emitter is to be chosen for light that a surface scatters towards `wo`, if that says more than its place does.
    #[inline]
    pub fn odds(&self, by_power: &EmitterChoice, it: &Interaction, wo: Vec3) -> Option<EmitterOdds> {
        match self {
            NextEventChoice::Gloss(gloss) => gloss.odds(by_power, it, wo),
            _ => None,
        }
    }
}

impl TreeChoice {
    /// The probability of each emitter that lies infinitely far, and of the tree if there is one.
    #[inline]
    fn share(&self) -> f32 {
        let slots = self.distant.len() + usize::from(!self.tree.is_empty());
        (1.0 - BY_POWER) / slots as f32
    }

    fn sample(&self, by_power: &EmitterChoice, at: &SurfacePoint, uc: f32) -> Option<(EmitterId, f32)> {
        if uc < BY_POWER {
            let (id, _) = by_power.sample(uc / BY_POWER)?;
            return Some((id, self.pmf(by_power, at, id)));
        }
        let share = self.share();
        let (slot, rest) = (((uc - BY_POWER) / share) as usize, ((uc - BY_POWER) / share).fract());
        let (id, pmf) = match self.distant.get(slot) {
            Some(id) => (*id, 1.0),
            // Rounding may lead one slot too far.
            None if self.tree.is_empty() => (*self.distant.last()?, 1.0),
            None => self.tree.sample(at, rest)?,
        };
        Some((id, BY_POWER * by_power.pmf(id) + share * pmf))
    }

    fn pmf(&self, by_power: &EmitterChoice, at: &SurfacePoint, id: EmitterId) -> f32 {
        let within = if self.distant.contains(&id) { 1.0 } else { self.tree.pmf(at, id) };
        BY_POWER * by_power.pmf(id) + self.share() * within
    }
}
