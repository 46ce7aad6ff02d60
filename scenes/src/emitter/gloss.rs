//! The choice among few emitters for light that a glossy surface scatters: by what the surface makes of each.

use super::bounds::{Bounds, Outline, strongest};
use super::choice::{BY_POWER, EmitterChoice};
use super::{Emitter, EmitterId};
use crate::interaction::Interaction;
use sampling::Vec3;
use sampling::bsdf::{Lobes, TransportMode};
use sampling::fault;
use sampling::math::reflect;
use std::f32::consts::PI;

/// The number of random numbers of 24 bits.
const GRID: u32 = 1 << 24;

/// How likely each of a few emitters is to be chosen: how many of all random numbers choose it, so that what is stated is what is chosen.
#[derive(Clone, Copy, Debug)]
pub struct EmitterOdds([u32; GlossChoice::MOST]);

impl EmitterOdds {
    /// In proportion to weights that add up to one but for rounding; no positive one is rounded to zero.
    #[inline]
    fn new(weights: [f32; GlossChoice::MOST]) -> Self {
        let positive = weights.map(|weight| u32::from(weight > 0.0));
        let shared = (GRID - positive.iter().sum::<u32>()) as f32;
        let mut counts = weights.map(|weight| (weight * shared) as u32);
        counts.iter_mut().zip(positive).for_each(|(count, one)| *count += one);
        // What rounding leaves over, or takes too much, is the largest's.
        let sum: u32 = counts.iter().sum();
        if let Some(largest) = counts.iter_mut().max() {
            *largest = largest.wrapping_add(GRID.wrapping_sub(sum));
        }
        Self(counts)
    }

    /// An emitter and the probability of choosing it.
    #[inline]
    pub fn choose(&self, uc: f32) -> (EmitterId, f32) {
        let (mut left, mut chosen) = ((uc * GRID as f32) as u32, 0);
        while chosen + 1 < self.0.len() && left >= self.0[chosen] {
            left -= self.0[chosen];
            chosen += 1;
        }
        let id = EmitterId(chosen as u32);
        (id, fault!("odds_taken_for_even", self.pmf(id), 0.5))
    }

    /// The probability of choosing an emitter.
    #[inline]
    pub fn pmf(&self, id: EmitterId) -> f32 {
        self.0[id.0 as usize] as f32 / GRID as f32
    }
}

/// What a point is told of an emitter.
#[derive(Clone, Debug)]
enum Seen {
    /// It is dark.
    Nowhere,
    /// It is somewhere, with the mean radiance of its outline where that has an area.
    Somewhere(Outline, f32),
    /// It lies infinitely far in a direction, with this irradiance across the light.
    Towards(Vec3, f32),
    /// It is all around, with this mean radiance.
    Around(f32),
}

/// What glossy surfaces are told of each emitter. Strengths, irradiances and radiances are relative to the strongest emitter.
///
/// As with a tree, a part of the choices is by power whatever the surface makes of an emitter.
#[derive(Clone, Debug)]
pub(crate) struct GlossChoice(Vec<Seen>);

impl GlossChoice {
    /// The most emitters; with more, to ask the surface for each would take more time than it is worth.
    pub const MOST: usize = 8;

    /// For these emitters, [`MOST`](Self::MOST) of them at most.
    pub fn new(emitters: &[Emitter]) -> Self {
        let somewhere = emitters.iter().filter(|emitter| !emitter.is_distant());
        let unit = match strongest(somewhere) {
            // All of them lie infinitely far.
            0.0 => 1.0,
            strongest => strongest,
        };
        let seen = |emitter: &Emitter| match emitter {
            dark if dark.power() <= 0.0 => Seen::Nowhere,
            Emitter::Environment(environment) => Seen::Around((f64::from(environment.radiance.mean()) / unit) as f32),
            Emitter::Image(image) => Seen::Around((image.mean_radiance() / unit) as f32),
            Emitter::Directional(directional) => {
                Seen::Towards(-directional.direction, (f64::from(directional.irradiance.mean()) / unit) as f32)
            }
            somewhere => Bounds::of(somewhere, unit).map_or(Seen::Nowhere, |bounds| {
                let outline = Outline::of(&bounds);
                let radiance = outline.strength / (PI * outline.reach2);
                Seen::Somewhere(outline, radiance)
            }),
        };
        Self(emitters.iter().map(seen).collect())
    }

    /// The odds for light that a surface scatters towards `wo`; `None` of one that is not glossy or lets light through, and where nothing is known of
    /// any emitter.
    #[inline]
    pub fn odds(&self, by_power: &EmitterChoice, it: &Interaction, wo: Vec3) -> Option<EmitterOdds> {
        if is_asked(it.bsdf.lobes()) { self.odds_of_glossy(by_power, it, wo) } else { None }
    }

    #[inline(never)]
    fn odds_of_glossy(&self, by_power: &EmitterChoice, it: &Interaction, wo: Vec3) -> Option<EmitterOdds> {
        let mirrored = reflect(wo, it.normal_seen_from(wo));
        let mut weights = [0.0; Self::MOST];
        weights.iter_mut().zip(&self.0).for_each(|(weight, seen)| *weight = seen.scattered(it, wo, mirrored));
        let share = (1.0 - BY_POWER) / weights.iter().sum::<f32>();
        if !(share.is_finite() && share > 0.0) {
            return None;
        }
        for (number, weight) in weights.iter_mut().enumerate().take(self.0.len()) {
            *weight = BY_POWER * by_power.pmf(EmitterId(number as u32)) + share * *weight;
        }
        Some(EmitterOdds::new(weights))
    }
}

/// Whether a surface with these lobes is asked: it mirrors more or less, and lets nothing through.
pub(crate) fn is_asked(lobes: Lobes) -> bool {
    lobes.intersects(Lobes::GLOSSY_REFLECTION) && !lobes.intersects(Lobes::TRANSMISSION)
}

impl Seen {
    /// About the radiance that a surface scatters towards `wo` of what the emitter sends, unless something is in its way.
    ///
    /// The irradiance that arrives is taken to come from the direction within the emitter's outline that is nearest to the mirror's, as
    /// representative points are \[Karis13\]. A lobe narrower than the outline makes no more of it than its radiance.
    #[inline]
    fn scattered(&self, it: &Interaction, wo: Vec3, mirrored: Vec3) -> f32 {
        let f = |wi: Vec3| it.eval(wo, wi, TransportMode::Radiance).mean();
        match self {
            Self::Nowhere => 0.0,
            Self::Around(radiance) => *radiance,
            Self::Towards(wi, irradiance) => irradiance * wi.dot(it.ns()).abs() * f(*wi),
            Self::Somewhere(outline, radiance) => {
                let irradiance = outline.importance(&it.point);
                if irradiance == 0.0 {
                    return 0.0;
                }
                let wi = outline.direction_nearest(it.point.p, mirrored);
                (1.0 / (irradiance * f(wi)) + 1.0 / radiance).recip()
            }
        }
    }
}
