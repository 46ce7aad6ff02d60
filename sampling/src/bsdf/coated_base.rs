//! The diffuse base under a clear coat, and what becomes of its light within the coat.

use super::{Argument, Misfit, Parameter, Preset};
use crate::fault;
use crate::math::Spectrum;
use crate::warp::INV_PI;

impl Parameter {
    /// What colour light within a coat takes.
    pub const INTERREFLECTION: Self = Self::choice(
        "interreflection",
        "what the coat sends back is scattered anew by the albedo of the base, or as if that were white",
        &["coloured", "white"],
    );
    /// What a coat reflects from within.
    pub const INTERNAL_REFLECTANCE: Self = Self::number(
        "internal_reflectance",
        "share of the base's light that the coat sends back to it; as Fresnel's equations have it when nothing is said",
        0.0,
        1.0,
        Preset::Absent,
    );
}

/// What becomes of the base's light within the coat.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Within {
    /// F̄, the share that the coat sends back to the base; all that doesn't leave, where nothing is said.
    pub reflectance: Option<f32>,
    /// What the base does with it.
    pub interreflection: Interreflection,
}

/// What a base does with light that the coat sends back to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interreflection {
    /// It scatters it by its albedo again: 1 / (1 − ρ F̄).
    #[default]
    Coloured,
    /// It scatters it as if it were white: 1 / (1 − F̄). Colours are then what they were made as, and less light is absorbed than
    /// there should be; none is gained.
    White,
}

impl Within {
    /// What [`Parameter::INTERREFLECTION`] and [`Parameter::INTERNAL_REFLECTANCE`] say.
    pub fn of([interreflection, reflectance]: [Argument; 2]) -> Self {
        let interreflection = [Interreflection::Coloured, Interreflection::White][interreflection.choice()];
        Self { reflectance: reflectance.given_number(), interreflection }
    }

    /// Interreflection without colours.
    pub fn as_if_white(reflectance: Option<f32>) -> Self {
        Self { reflectance, interreflection: Interreflection::White }
    }
}

/// A diffuse base under an interface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Base {
    /// ρ / (η² (1 − ρ F̄)), or ρ / (η² (1 − F̄)).
    reach: Spectrum,
    /// The largest channel of the albedo for light that is inside the coat: that, times T̄.
    albedo: f32,
}

impl Base {
    /// A base of albedo ρ under an interface of index `eta` whose transmittance for diffuse light from outside is T̄.
    ///
    /// # Errors
    ///
    /// The interface is said to send back more than doesn't leave, 1 − T̄ / η².
    #[inline]
    pub fn new(albedo: Spectrum, eta: f32, transmittance: f32, within: Within) -> Result<Self, Misfit> {
        let eta2 = eta * eta;
        // η² (1 − F̄).
        let leaving = match within.reflectance {
            None => transmittance,
            Some(reflectance) => {
                let leaving = (1.0 - reflectance) * eta2;
                // A reflectance that was computed elsewhere may be more by its rounding.
                if leaving < transmittance - 8.0 * f32::EPSILON * eta2 {
                    let most = 1.0 - transmittance / eta2;
                    let mend = format!("the coat sends back {reflectance} of the base's light: make it {most} at most");
                    return Err(Misfit::new("internal_reflectance", mend));
                }
                leaving.max(transmittance)
            }
        };
        let reach = match within.interreflection {
            // η² (1 − ρ F̄) = η² (1 − ρ) + ρ η² (1 − F̄) loses no digit as ρ and F̄ approach 1.
            Interreflection::Coloured => albedo / ((Spectrum::ONE - albedo) * eta2 + albedo * leaving),
            Interreflection::White => albedo / leaving,
        };
        Ok(Self { reach, albedo: reach.max_component() * transmittance })
    }

    /// f_d, given the transmittances for the two directions.
    #[inline]
    pub fn value(&self, t_o: f32, t_i: f32) -> Spectrum {
        self.reach * (t_o * fault!("reciprocity_broken", t_i, t_o) * INV_PI)
    }

    /// What the base sends back, at most, of the light that the coat lets in, T(o).
    #[inline]
    pub fn share(&self, t_o: f32) -> f32 {
        t_o * self.albedo
    }

    /// f_d cos θ_i over the density cos θ_i / π and over the [`share`](Self::share), for the transmittance of `wi`.
    #[inline]
    pub fn weight(&self, t_i: f32) -> Spectrum {
        self.reach * (t_i / self.albedo)
    }

    /// Whether it reflects nothing.
    #[inline]
    pub fn is_black(&self) -> bool {
        self.albedo == 0.0
    }
}
