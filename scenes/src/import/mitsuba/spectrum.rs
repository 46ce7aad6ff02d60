//! Spectra as colours in linear sRGB, as Mitsuba 3 makes them where it renders in RGB.

use super::context::Context;
use super::observer::{from_xyz, integrated};
use super::plugin::{finite, finite_list};
use super::xml::Element;
use crate::error::SceneError;
use crate::import::translation::{NoteKind, Place};

/// What a spectrum is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A share of light, from 0 to 1, seen in daylight.
    Reflectance,
    /// An index of refraction or extinction, at least 0, weighted as daylight is.
    Index,
    /// Light.
    Emission,
}

const FIT: &str = "is integrated by a fit of the CIE 1931 observer";

/// The colour that an element describes.
pub fn colour(element: &Element, quantity: Quantity, context: &mut Context) -> Result<[f64; 3], SceneError> {
    let place = &element.place;
    let value = element.attribute("value");
    let rgb = match (element.tag.as_str(), element.kind()) {
        ("rgb" | "color", _) => components(element, place)?,
        ("srgb", _) => components(element, place)?.map(from_srgb),
        ("blackbody", _) => {
            context.approximate(place, format!("a `blackbody` {FIT}"));
            black_body(element.attribute("temperature").or(value).unwrap_or(""), element.attribute("scale"), place)?
        }
        ("float" | "integer", _) => {
            constant(finite(value.unwrap_or(""), element.name(), place)?, quantity, element, context)
        }
        ("spectrum", "") => match (value, element.attribute("filename")) {
            (Some(value), _) => of_text(value, quantity, element, context)?,
            (None, Some(file)) => of_file(file, quantity, element, context)?,
            (None, None) => return Err(place.error(format!("{} has no `value`", element.title()), "add one")),
        },
        ("spectrum" | "texture", _) => plugin(element, quantity, context)?,
        _ => return Err(place.error(format!("{} is no colour", element.title()), "give `rgb` or `spectrum`")),
    };
    let most = if quantity == Quantity::Reflectance { 1.0 } else { f64::MAX };
    Ok(context.notes.bounded(rgb, most, place))
}

/// Whether an element is a colour, and not a texture that varies.
pub fn is_colour(element: &Element) -> bool {
    let constant = matches!(element.kind(), "uniform" | "d65" | "srgb" | "rgb" | "irregular" | "regular" | "blackbody");
    matches!(element.tag.as_str(), "rgb" | "color" | "srgb" | "blackbody" | "float" | "integer" | "spectrum")
        || (element.tag == "texture" && constant)
}

/// The numbers of `value` (three, or one for grey), or `#rrggbb`, or the attributes `r`, `g`, `b`.
fn components(element: &Element, place: &Place) -> Result<[f64; 3], SceneError> {
    let text = match element.attribute("value") {
        Some(text) => text.trim().to_string(),
        None => ["r", "g", "b"].map(|name| element.attribute(name).unwrap_or("")).join(" "),
    };
    let hex = text.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii());
    if let Some(digits) = hex.and_then(|digits| u32::from_str_radix(digits, 16).ok()) {
        return Ok([digits >> 16, digits >> 8, digits].map(|byte| f64::from(byte & 255) / 255.0));
    }
    match finite_list(&text, "value", place)?[..] {
        [r, g, b] => Ok([r, g, b]),
        [grey] => Ok([grey; 3]),
        _ => Err(place.error(format!("{} is `{}`", element.title(), text.trim()), "give three numbers, or one")),
    }
}

fn from_srgb(c: f64) -> f64 {
    if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// A spectrum of one value. Light of it is white of equal energy since Mitsuba 3, and was (1, 1, 1) before.
fn constant(value: f64, quantity: Quantity, element: &Element, context: &mut Context) -> [f64; 3] {
    if quantity != Quantity::Emission {
        return [value; 3];
    }
    let text = match element.version {
        3.. => "light of a constant `spectrum` becomes white of equal energy, (1.205, 0.948, 0.909) times its value",
        _ => {
            "light of a constant `spectrum` becomes (1, 1, 1) times its value, as Mitsuba 2 had it; Mitsuba 3 makes it \
             (1.205, 0.948, 0.909) times that"
        }
    };
    context.note(NoteKind::Mapped, &element.place, text);
    if element.version >= 3 { from_xyz([1.0; 3]).map(|c| value * c) } else { [value; 3] }
}

fn of_text(text: &str, quantity: Quantity, element: &Element, context: &mut Context) -> Result<[f64; 3], SceneError> {
    let place = &element.place;
    if !text.contains(':') {
        return match finite_list(text, "value", place)?[..] {
            [value] => Ok(constant(value, quantity, element, context)),
            [r, g, b] => Ok([r, g, b]),
            _ => {
                let message = format!("{} is `{text}`", element.title());
                Err(place.error(message, "give one number, or pairs such as `400:0.1, 500:0.2`"))
            }
        };
    }
    let words = text.split(|c: char| c == ',' || c.is_whitespace()).filter(|word| !word.is_empty());
    let pair = |word: &str| -> Result<(f64, f64), SceneError> {
        let (wavelength, value) = word.split_once(':').unwrap_or((word, ""));
        Ok((finite(wavelength, "wavelength", place)?, finite(value, "value", place)?))
    };
    let list = words.map(pair).collect::<Result<Vec<_>, _>>()?;
    of_list(&list, quantity, element, context)
}

/// A file of wavelengths and values, a pair a line.
fn of_file(name: &str, quantity: Quantity, element: &Element, context: &mut Context) -> Result<[f64; 3], SceneError> {
    let place = &element.place;
    let Some(path) = context.find(name, place) else { return Ok([0.5; 3]) };
    let text = crate::file::read_text(&path)
        .map_err(|error| place.error(format!("cannot read {}: {error}", path.display()), "name a text file"))?;
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or("").trim()).filter(|line| !line.is_empty());
    let pair = |line: &str| match finite_list(line, &path.display().to_string(), place)?[..] {
        [wavelength, value] => Ok((wavelength, value)),
        _ => {
            let message = format!("{} holds the line `{line}`", path.display());
            Err(place.error(message, "give a wavelength and a value a line"))
        }
    };
    let list = lines.map(pair).collect::<Result<Vec<_>, _>>()?;
    of_list(&list, quantity, element, context)
}

fn of_list(
    list: &[(f64, f64)],
    quantity: Quantity,
    element: &Element,
    context: &mut Context,
) -> Result<[f64; 3], SceneError> {
    if list.is_empty() || list.windows(2).any(|pair| pair[1].0 <= pair[0].0) {
        return Err(element.place.error("the wavelengths do not grow", "give one pair or more, by growing wavelength"));
    }
    context.approximate(&element.place, format!("a `spectrum` of wavelengths {FIT}"));
    Ok(integrated(|wavelength| linear(list, wavelength), quantity != Quantity::Emission))
}

/// Spectra that are written as plugins.
fn plugin(element: &Element, quantity: Quantity, context: &mut Context) -> Result<[f64; 3], SceneError> {
    let place = &element.place;
    let part = |name: &str| element.children.iter().find(|child| child.name() == name);
    let number = |name: &str, otherwise: f64| match part(name).and_then(|part| part.attribute("value")) {
        Some(text) => finite(text, name, place),
        None => Ok(otherwise),
    };
    let list = |name: &str| finite_list(part(name).and_then(|part| part.attribute("value")).unwrap_or(""), name, place);
    match element.kind() {
        "uniform" => Ok(constant(number("value", 1.0)?, quantity, element, context)),
        "d65" => Ok([number("scale", 1.0)? * number("value", 1.0)?; 3]),
        "rgb" | "srgb" => match part("color").or(part("value")) {
            Some(part) => components(part, place),
            None => Err(place.error(format!("{} has no `color`", element.title()), "add one")),
        },
        "blackbody" => {
            context.approximate(place, format!("a `blackbody` {FIT}"));
            black_body(&number("temperature", 5000.0)?.to_string(), None, place)
        }
        "irregular" | "regular" => {
            let values = list("values")?;
            let wavelengths = match element.kind() {
                "irregular" => list("wavelengths")?,
                _ => {
                    let (low, high) = (number("wavelength_min", 360.0)?, number("wavelength_max", 830.0)?);
                    let step = (high - low) / (values.len().max(2) - 1) as f64;
                    (0..values.len()).map(|i| low + step * i as f64).collect()
                }
            };
            if wavelengths.len() != values.len() {
                return Err(place.error("there are not as many wavelengths as values", "give a value for each"));
            }
            let list: Vec<(f64, f64)> = wavelengths.into_iter().zip(values).collect();
            of_list(&list, quantity, element, context)
        }
        kind => {
            context.approximate(place, format!("a spectrum of kind `{kind}` is not known, and is taken as 0.5"));
            Ok([0.5; 3])
        }
    }
}

fn black_body(temperature: &str, scale: Option<&str>, place: &Place) -> Result<[f64; 3], SceneError> {
    let kelvin = finite(temperature.trim().trim_end_matches(['K', 'k']), "temperature", place)?;
    if !(100.0..=1e6).contains(&kelvin) {
        return Err(place.error(format!("the temperature is {kelvin} K"), "give one from 100 to 1000000 K"));
    }
    let scale = scale.map_or(Ok(1.0), |scale| finite(scale, "scale", place))?;
    Ok(integrated(|wavelength| planck(wavelength, kelvin), false).map(|c| c * scale))
}

/// Planck's law: radiance by wavelength \[W/(m²·sr·nm)\].
fn planck(nanometres: f64, kelvin: f64) -> f64 {
    const H: f64 = 6.626_070_15e-34;
    const C: f64 = 299_792_458.0;
    const K: f64 = 1.380_649e-23;
    let wavelength = nanometres * 1e-9;
    2e-9 * H * C * C / (wavelength.powi(5) * (H * C / (wavelength * K * kelvin)).exp_m1())
}

/// The value of a list at a wavelength: linear between its entries, 0 beyond; one entry alone holds everywhere.
fn linear(list: &[(f64, f64)], wavelength: f64) -> f64 {
    if let [(_, value)] = list {
        return *value;
    }
    let next = list.partition_point(|(at, _)| *at < wavelength);
    match (next.checked_sub(1).map(|last| list[last]), list.get(next)) {
        (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (wavelength - a.0) / (b.0 - a.0),
        (None, Some(first)) if first.0 == wavelength => first.1,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn black_bodies_have_known_colours() {
        let [r, g, b] = integrated(|wavelength| planck(wavelength, 6500.0), false);
        assert!((r / g - 1.0).abs() < 0.06 && (b / g - 1.0).abs() < 0.06, "{r} {g} {b}");
        // CIE 1931 chromaticity of illuminant A, 2856 K: x = 0.4476, y = 0.4074.
        let [r, g, b] = integrated(|wavelength| planck(wavelength, 2856.0), false);
        let xyz = |row: [f64; 3]| row[0] * r + row[1] * g + row[2] * b;
        let x = xyz([0.412_453, 0.357_580, 0.180_423]);
        let y = xyz([0.212_671, 0.715_160, 0.072_169]);
        let z = xyz([0.019_334, 0.119_193, 0.950_227]);
        let sum = x + y + z;
        assert!((x / sum - 0.4476).abs() < 0.004 && (y / sum - 0.4074).abs() < 0.004, "{} {}", x / sum, y / sum);
        // Wien: at its brightest wavelength, 2.897771955e6 nm K / T, the radiance is stationary.
        let peak = 2.897_771_955e6 / 5000.0;
        assert!(planck(peak, 5000.0) > planck(peak - 1.0, 5000.0) && planck(peak, 5000.0) > planck(peak + 1.0, 5000.0));
    }

    #[test]
    fn lists_are_linear_and_end() {
        let list = [(400.0, 0.0), (500.0, 1.0), (600.0, 0.5)];
        let values = [399.0, 400.0, 450.0, 500.0, 550.0, 600.0, 601.0].map(|w| linear(&list, w));
        assert_eq!(values, [0.0, 0.0, 0.5, 1.0, 0.75, 0.5, 0.0]);
        assert_eq!(linear(&[(500.0, 0.3)], 700.0), 0.3);
    }

    #[test]
    fn srgb_is_decoded() {
        assert!((from_srgb(0.5) - 0.214_041).abs() < 1e-6 && from_srgb(1.0) == 1.0 && from_srgb(0.0) == 0.0);
    }
}
