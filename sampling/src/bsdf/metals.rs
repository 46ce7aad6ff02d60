//! The complex index of refraction of conductors: given, tabulated by the metal's name, or guessed from a reflectance.
//!
//! The tables hold η and k at 630, 532 and 465 nm, one wavelength for each of the primaries of sRGB, interpolated linearly
//! in published measurements of clean, smooth metal. So the colours of metals whose reflectance varies within a primary's
//! band (copper and gold in the green) are only near those of a spectral rendering, by some 0.02 in the reflectance; the
//! measurements themselves differ among authors by as much, and by more for real surfaces, which tarnish.
//! Aluminium after [Rakic95], brass (70 % copper, 30 % zinc) after [Querry85], copper, gold and silver after
//! [Johnson72], chromium, cobalt, iron, nickel, palladium and titanium after [Johnson74], mercury after [Inagaki81],
//! platinum after the Lorentz-Drude fit of [Rakic98], tungsten after [Weaver75].

use super::{Argument, Domain, Misfit, Parameter, Preset};
use crate::math::Spectrum;

/// Name, η and k of the metals, in alphabetical order.
#[allow(clippy::approx_constant, reason = "a measured 2.718 is not e")]
const METALS: [(&str, Spectrum, Spectrum); 14] = [
    ("aluminium", Spectrum::new(1.430, 0.939, 0.686), Spectrum::new(7.508, 6.420, 5.635)),
    ("brass", Spectrum::new(0.445, 0.568, 0.947), Spectrum::new(3.522, 2.588, 1.920)),
    ("chromium", Spectrum::new(3.145, 3.034, 2.456), Spectrum::new(3.312, 3.330, 3.210)),
    ("cobalt", Spectrum::new(2.209, 2.001, 1.789), Spectrum::new(4.160, 3.735, 3.371)),
    ("copper", Spectrum::new(0.275, 1.116, 1.247), Spectrum::new(3.373, 2.596, 2.456)),
    ("gold", Spectrum::new(0.188, 0.544, 1.332), Spectrum::new(3.403, 2.231, 1.869)),
    ("iron", Spectrum::new(2.892, 2.895, 2.646), Spectrum::new(3.065, 2.918, 2.805)),
    ("mercury", Spectrum::new(1.965, 1.461, 1.131), Spectrum::new(5.213, 4.519, 3.990)),
    ("nickel", Spectrum::new(1.990, 1.877, 1.765), Spectrum::new(4.094, 3.495, 3.048)),
    ("palladium", Spectrum::new(1.765, 1.597, 1.445), Spectrum::new(4.275, 3.743, 3.351)),
    ("platinum", Spectrum::new(2.310, 2.046, 1.887), Spectrum::new(4.147, 3.602, 3.224)),
    ("silver", Spectrum::new(0.057, 0.054, 0.047), Spectrum::new(4.254, 3.429, 2.803)),
    ("titanium", Spectrum::new(2.698, 2.479, 2.305), Spectrum::new(3.757, 3.351, 3.082)),
    ("tungsten", Spectrum::new(3.617, 3.495, 3.325), Spectrum::new(2.910, 2.718, 2.574)),
];

const NAMES: [&str; METALS.len()] = {
    let mut names = [""; METALS.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = METALS[i].0;
        i += 1;
    }
    names
};

/// The metal when nothing is said of it, copper.
const USUAL: usize = 4;

impl Parameter {
    /// What a conductor reflects.
    pub const REFLECTANCE: Self =
        Self::colour("reflectance", "share of light reflected at normal incidence", 0.0, 1.0, Preset::Absent);
    /// The name of a metal.
    pub const METAL: Self = Self {
        name: "metal",
        about: "the metal, by its name; copper when nothing is said of it",
        domain: Domain::Choice(&NAMES),
        preset: Preset::Absent,
    };
    /// The real part of a conductor's index.
    pub const ETA: Self = Self::colour("eta", "index of refraction", 1e-3, 1e3, Preset::Absent);
    /// Its imaginary part.
    pub const K: Self = Self::colour("k", "extinction index", 0.0, 1e3, Preset::Absent);
}

/// η and k from [`Parameter::REFLECTANCE`], [`Parameter::METAL`], [`Parameter::ETA`] and [`Parameter::K`], of which one way
/// is given, or none.
///
/// # Errors
///
/// More than one way is given, or half of one.
pub fn complex_index([reflectance, metal, eta, k]: [Argument; 4]) -> Result<(Spectrum, Spectrum), Misfit> {
    match (reflectance.given_colour(), metal.given_choice(), eta.given_colour(), k.given_colour()) {
        (None, None, None, None) => Ok((METALS[USUAL].1, METALS[USUAL].2)),
        (Some(reflectance), None, None, None) => Ok(index_of_reflectance(reflectance)),
        (None, Some(metal), None, None) => Ok((METALS[metal].1, METALS[metal].2)),
        (None, None, Some(eta), Some(k)) => Ok((eta, k)),
        (None, None, Some(_), None) => Err(Misfit::new("eta", "give `k` as well")),
        (None, None, None, Some(_)) => Err(Misfit::new("k", "give `eta` as well")),
        (Some(_), ..) => {
            Err(Misfit::new("reflectance", "give either `reflectance`, or `metal`, or both `eta` and `k`"))
        }
        (None, Some(_), ..) => Err(Misfit::new("metal", "give either `metal`, or both `eta` and `k`")),
    }
}

/// η and k of a conductor that reflects `reflectance`, in [0, 1], at normal incidence.
///
/// A reflectance alone does not determine a complex index. Of the pairs that have it, this is the one with the smallest
/// η: the map of `[Gulbrandsen14]` with an edge tint of 1, which simplifies to η = (1 − r)/(1 + r), k = 2√r/(1 + r) and is
/// finite for all r. Its reflectance never falls towards grazing.
pub fn index_of_reflectance(reflectance: Spectrum) -> (Spectrum, Spectrum) {
    let sum = Spectrum::ONE + reflectance;
    ((Spectrum::ONE - reflectance) / sum, 2.0 * reflectance.sqrt() / sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::fresnel_conductor;

    #[test]
    fn a_reflectance_is_met_at_the_normal_and_never_falls_towards_grazing() {
        for r in [0.0, 0.01, 0.3, 0.5, 0.9, 0.99, 1.0] {
            let (eta, k) = index_of_reflectance(Spectrum::splat(r));
            let mut last = r;
            for i in 0..=100 {
                let cos = 1.0 - i as f32 * 0.009_99;
                let f = fresnel_conductor(cos, eta, k).max_component();
                assert!(i > 0 || (f - r).abs() < 1e-6, "{r}: {f}");
                assert!(f >= last - 1e-6 && f <= 1.0 + 1e-6, "{r} at {cos}: {f} after {last}");
                last = f;
            }
        }
    }

    #[test]
    fn metals_have_the_colours_that_they_are_known_for() {
        let colour = |name: &str| {
            let (_, eta, k) = METALS.iter().find(|metal| metal.0 == name).expect("a metal of the list");
            fresnel_conductor(1.0, *eta, *k).to_array()
        };
        // Handbook reflectances at normal incidence of clean metal, to 0.03.
        let near = |name: &str, known: [f32; 3]| {
            let found = colour(name);
            assert!(found.iter().zip(known).all(|(a, b)| (a - b).abs() < 0.03), "{name}: {found:?} against {known:?}");
        };
        near("aluminium", [0.91, 0.92, 0.92]);
        near("silver", [0.99, 0.98, 0.98]);
        near("gold", [0.94, 0.71, 0.41]);
        near("copper", [0.91, 0.60, 0.55]);
        near("chromium", [0.55, 0.56, 0.55]);
        near("platinum", [0.67, 0.63, 0.60]);
        assert_eq!(METALS[USUAL].0, "copper");
        assert!(METALS.is_sorted_by(|a, b| a.0 < b.0));
    }

    #[test]
    fn one_way_of_saying_it_is_enough() {
        let (absent, r) = (Argument::Absent, Argument::Colour(Spectrum::splat(0.5)));
        assert_eq!(complex_index([absent; 4]), complex_index([absent, Argument::Choice(USUAL), absent, absent]));
        assert!(complex_index([r, absent, absent, absent]).is_ok() && complex_index([absent, absent, r, r]).is_ok());
        for wrong in [
            [r, Argument::Choice(0), absent, absent],
            [r, absent, r, absent],
            [absent, absent, r, absent],
            [absent, absent, absent, r],
            [absent, Argument::Choice(0), r, r],
        ] {
            assert!(complex_index(wrong).is_err(), "{wrong:?}");
        }
    }
}
