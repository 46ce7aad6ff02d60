//! Spectra as colours in linear sRGB.
//!
//! Since pbrt-v4 light is in photometric units: whatever spectrum an emitter is given is divided by its luminance, so that only
//! its hue counts and `scale` says how bright it is. A colour in RGB is what the film shows of it.

use super::context::Context;
use super::parameters::Parameters;
use super::parser::{Parameter, Values};
use crate::error::SceneError;
use crate::import::mitsuba::observer::{from_xyz, integrated, luminance};
use crate::import::translation::Place;
use crate::suggest::did_you_mean;

/// What a spectrum is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A share of light, from 0 to 1.
    Reflectance,
    /// A number or an index, at least 0.
    Number,
    /// Light.
    Emission,
}

const FIT: &str = "is integrated by a fit of the CIE 1931 observer";

/// Illuminants by pbrt's names, with their chromaticities x and y.
const ILLUMINANTS: [(&str, [f64; 2]); 16] = [
    ("stdillum-A", [0.447_58, 0.407_45]),
    ("stdillum-D50", [0.345_67, 0.358_50]),
    ("stdillum-D65", [0.312_71, 0.329_02]),
    ("illum-acesD60", [0.321_68, 0.337_67]),
    ("stdillum-F1", [0.313_10, 0.337_27]),
    ("stdillum-F2", [0.372_08, 0.375_29]),
    ("stdillum-F3", [0.409_10, 0.394_30]),
    ("stdillum-F4", [0.440_18, 0.403_29]),
    ("stdillum-F5", [0.313_79, 0.345_31]),
    ("stdillum-F6", [0.377_90, 0.388_35]),
    ("stdillum-F7", [0.312_92, 0.329_33]),
    ("stdillum-F8", [0.345_88, 0.358_75]),
    ("stdillum-F9", [0.374_17, 0.372_81]),
    ("stdillum-F10", [0.346_09, 0.359_86]),
    ("stdillum-F11", [0.380_52, 0.377_13]),
    ("stdillum-F12", [0.436_95, 0.404_41]),
];

/// Glasses by pbrt's names, with their indices at 589 nm.
const GLASSES: [(&str, f64); 8] = [
    ("glass-BK7", 1.5168),
    ("glass-BAF10", 1.6700),
    ("glass-FK51A", 1.4866),
    ("glass-LASF9", 1.8503),
    ("glass-F5", 1.6034),
    ("glass-SF5", 1.6727),
    ("glass-SF10", 1.7283),
    ("glass-SF11", 1.7847),
];

/// η and k in linear sRGB.
pub type Index = [[f64; 3]; 2];

const THREE: &str = "is taken at three wavelengths";

/// Metals by pbrt's names, and what is lost of them in RGB.
///
/// Of silver, aluminium, gold and copper these are, for each channel, the index whose reflectance is nearest to that of the measured
/// spectra, which SOPRA collected, integrated against the CIE 1931 observer in daylight (D65), at 0°, 45°, 70°, 80° and 85°: within 0.0003,
/// of copper within 0.004. Of the others they are samples at 630, 532 and 465 nm.
const METALS: [(&str, Index, Option<&str>); 7] = [
    ("Ag", [[0.1291, 0.1246, 0.1512], [4.1059, 3.3406, 2.4120]], None),
    ("Al", [[1.4247, 0.9288, 0.5903], [7.7274, 6.6030, 5.3585]], None),
    (
        "Au",
        [[0.2324, 0.4094, 1.5635], [17.5201, 2.3542, 1.7182]],
        Some("reflects 1.022 of red in daylight, of which 0.997 is left"),
    ),
    ("Cu", [[0.1513, 0.9760, 1.2092], [3.4523, 2.6210, 2.3646]], None),
    ("CuZn", [[0.444, 0.640, 1.17], [3.70, 2.58, 1.90]], Some(THREE)),
    ("MgO", [[1.736, 1.744, 1.752], [0.0; 3]], Some(THREE)),
    ("TiO2", [[2.87, 3.02, 3.20], [0.0; 3]], Some(THREE)),
];

/// Copper, which conductors are of when nothing is said of it.
pub const COPPER: Index = METALS[3].1;

/// The colour that a parameter gives; not of a texture.
pub fn colour(parameter: &Parameter, quantity: Quantity, context: &mut Context) -> Result<[f64; 3], SceneError> {
    let place = &parameter.place;
    let rgb = match (parameter.kind.as_str(), &parameter.values) {
        ("rgb", Values::Numbers(list)) => match list[..] {
            [r, g, b] => [r, g, b],
            [grey] => [grey; 3],
            _ => return Err(place.error(format!("`{}` is no colour", parameter.name), "give three numbers")),
        },
        ("xyz", Values::Numbers(list)) => match list[..] {
            [x, y, z] => from_xyz([x, y, z]),
            _ => return Err(place.error(format!("`{}` is no colour", parameter.name), "give three numbers")),
        },
        ("float" | "integer", Values::Numbers(list)) if list.len() == 1 => [list[0]; 3],
        ("blackbody", Values::Numbers(list)) => {
            context.approximate(place, format!("a `blackbody` {FIT}"));
            black_body(list, quantity, place)?
        }
        ("spectrum", Values::Numbers(list)) => match list[..] {
            [value] => constant(value, quantity),
            _ => of_list(list, quantity, place, context)?,
        },
        ("spectrum", Values::Texts(texts)) if texts.len() == 1 => named(&texts[0], quantity, parameter, context)?,
        _ => {
            let message = format!("`{}` is no colour", parameter.name);
            return Err(place.error(message, "give `rgb`, `spectrum` or `blackbody`"));
        }
    };
    let most = if quantity == Quantity::Reflectance { 1.0 } else { f64::MAX };
    Ok(context.notes.bounded(rgb, most, place))
}

/// The light that a parameter describes, times `scale`, as the sensor shows it; white where it is missing.
pub fn light(parameters: &Parameters, name: &str, context: &mut Context) -> Result<[f64; 3], SceneError> {
    let rgb = match parameters.find(name) {
        Some(parameter) => colour(parameter, Quantity::Emission, context)?,
        None => [1.0; 3],
    };
    let scale = own_scale(parameters, context)?;
    Ok(context.sensor.shows(std::array::from_fn(|c| rgb[c] * scale[c])))
}

/// `scale` of a light that has an image, as the sensor shows it.
pub fn scale(parameters: &Parameters, context: &mut Context) -> Result<[f64; 3], SceneError> {
    let (scale, factor) = (own_scale(parameters, context)?, context.sensor.factor());
    Ok(std::array::from_fn(|c| scale[c] * factor[c]))
}

/// `scale` of a light, a colour before v4.
fn own_scale(parameters: &Parameters, context: &mut Context) -> Result<[f64; 3], SceneError> {
    parameters.find("scale").map_or(Ok([1.0; 3]), |parameter| colour(parameter, Quantity::Emission, context))
}

/// Light of a luminance of 1, of whatever luminance it was.
fn of_luminance_one(rgb: [f64; 3]) -> [f64; 3] {
    let luminance = luminance(rgb);
    if luminance > 0.0 { rgb.map(|c| c / luminance) } else { [0.0; 3] }
}

/// A spectrum of one value: of light white of equal energy, whose luminance is 1 whatever the value.
fn constant(value: f64, quantity: Quantity) -> [f64; 3] {
    if quantity != Quantity::Emission {
        return [value; 3];
    }
    if value > 0.0 { from_xyz([1.0; 3]) } else { [0.0; 3] }
}

fn of_list(list: &[f64], quantity: Quantity, place: &Place, context: &mut Context) -> Result<[f64; 3], SceneError> {
    let wrong =
        || place.error("a spectrum is no list of pairs by growing wavelength", "give a wavelength and a value each");
    if list.is_empty() || !list.len().is_multiple_of(2) {
        return Err(wrong());
    }
    let pairs: Vec<(f64, f64)> = list.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect();
    if pairs.windows(2).any(|two| two[1].0 <= two[0].0) {
        return Err(wrong());
    }
    context.approximate(place, format!("a `spectrum` of wavelengths {FIT}"));
    if quantity == Quantity::Emission {
        return Ok(of_luminance_one(integrated(|wavelength| linear(&pairs, wavelength), false)));
    }
    Ok(integrated(|wavelength| linear(&pairs, wavelength), true))
}

/// The value of a list at a wavelength: linear between its entries, 0 beyond.
fn linear(list: &[(f64, f64)], wavelength: f64) -> f64 {
    let next = list.partition_point(|(at, _)| *at < wavelength);
    match (next.checked_sub(1).map(|last| list[last]), list.get(next)) {
        (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (wavelength - a.0) / (b.0 - a.0),
        (None, Some(first)) if first.0 == wavelength => first.1,
        _ => 0.0,
    }
}

fn named(name: &str, quantity: Quantity, parameter: &Parameter, context: &mut Context) -> Result<[f64; 3], SceneError> {
    let place = &parameter.place;
    if let Some((_, [x, y])) = ILLUMINANTS.iter().find(|(known, _)| *known == name) {
        return Ok(from_xyz([x / y, 1.0, (1.0 - x - y) / y]));
    }
    if let Some((_, index)) = GLASSES.iter().find(|(known, _)| *known == name) {
        context.approximate(place, format!("`{name}` has the index {index} at all wavelengths"));
        return Ok([*index; 3]);
    }
    for (metal, [eta, k], lost) in METALS {
        let found = match name.strip_prefix("metal-").and_then(|rest| rest.strip_prefix(metal)) {
            Some("-eta") => eta,
            Some("-k") => k,
            _ => continue,
        };
        if let Some(lost) = lost {
            context.approximate(place, format!("`{name}` {lost}"));
        }
        return Ok(found);
    }
    let of_table = ["metal-", "glass-", "stdillum-", "illum-"].iter().any(|start| name.starts_with(start));
    if of_table {
        let metals = METALS.iter().flat_map(|(metal, ..)| [format!("metal-{metal}-eta"), format!("metal-{metal}-k")]);
        let known = ILLUMINANTS.iter().map(|(name, _)| name.to_string());
        let known: Vec<String> = known.chain(GLASSES.iter().map(|(name, _)| name.to_string())).chain(metals).collect();
        let known: Vec<&str> = known.iter().map(String::as_str).collect();
        let message = format!("there is no spectrum `{}`", super::lexer::shown(name));
        return Err(place.error(message, did_you_mean(name, &known)));
    }
    let Some(path) = context.find(name, place) else { return Ok([0.5; 3]) };
    let text = crate::file::read_text(&path)
        .map_err(|error| place.error(format!("cannot read {}: {error}", path.display()), "name a text file"))?;
    let words = text.lines().flat_map(|line| line.split('#').next().unwrap_or("").split_whitespace());
    let list: Option<Vec<f64>> = words.map(|word| word.parse().ok().filter(|x: &f64| x.is_finite())).collect();
    let Some(list) = list else {
        let message = format!("{} holds what is no number", path.display());
        return Err(place.error(message, "give a wavelength and a value a line"));
    };
    of_list(&list, quantity, place, context)
}

/// Planck's law; of v3's two numbers the second scales what is 1 at its brightest.
fn black_body(list: &[f64], quantity: Quantity, place: &Place) -> Result<[f64; 3], SceneError> {
    let (kelvin, scale) = match *list {
        [kelvin] => (kelvin, None),
        [kelvin, scale] => (kelvin, Some(scale)),
        _ => return Err(place.error("a `blackbody` has not one temperature", "give one in kelvin")),
    };
    if !(100.0..=1e6).contains(&kelvin) {
        return Err(place.error(format!("the temperature is {kelvin} K"), "give one from 100 to 1000000 K"));
    }
    // 1 at the brightest wavelength, by Wien's law.
    let peak = planck(2.897_771_955e6 / kelvin, kelvin);
    let rgb = integrated(|wavelength| planck(wavelength, kelvin) / peak, quantity != Quantity::Emission);
    Ok(match scale {
        Some(scale) => rgb.map(|c| c * scale),
        None if quantity == Quantity::Emission => of_luminance_one(rgb),
        None => rgb,
    })
}

/// Planck's law, up to a factor.
pub fn planck(nanometres: f64, kelvin: f64) -> f64 {
    let wavelength = nanometres * 1e-9;
    1e-33 / (wavelength.powi(5) * (0.014_387_768_77 / (wavelength * kelvin)).exp_m1())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn illuminants_have_a_luminance_of_one() {
        let near = |found: [f64; 3], known: [f64; 3]| found.iter().zip(known).all(|(a, b)| (a - b).abs() < 0.01);
        let d65 = from_xyz([0.312_71 / 0.329_02, 1.0, 0.358_27 / 0.329_02]);
        assert!(near(d65, [1.0; 3]), "{d65:?}");
        assert!(near(constant(7.0, Quantity::Emission), [1.205, 0.948, 0.909]));
        let warm = of_luminance_one(integrated(|w| planck(w, 2856.0), false));
        let a = from_xyz([0.447_58 / 0.407_45, 1.0, 0.144_97 / 0.407_45]);
        assert!(warm.iter().zip(a).all(|(x, y)| (x - y).abs() < 0.05), "{warm:?} {a:?}");
    }

    #[test]
    fn black_bodies_are_one_at_their_brightest() {
        let kelvin = 5000.0;
        let peak = 2.897_771_955e6 / kelvin;
        assert!(planck(peak, kelvin) > planck(peak - 1.0, kelvin) && planck(peak, kelvin) > planck(peak + 1.0, kelvin));
    }
}
