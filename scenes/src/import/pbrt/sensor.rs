//! What the sensor of a film makes of light. Being the same in every pixel, it is given to what emits.

use glam::{DMat3, DVec3, dvec3};

use super::camera::Options;
use super::context::Context;
use super::parameters::Parameters;
use super::spectrum::planck;
use crate::error::SceneError;
use crate::import::mitsuba::observer::{integrated, matrix_to_rgb};
use crate::import::translation::NoteKind;

/// The chromaticity of the white of linear sRGB.
const WHITE: [f64; 2] = [0.312_7, 0.329_0];

/// From XYZ to the responses of Bradford's cones [Lam 1985].
const CONES: DMat3 =
    DMat3::from_cols_array(&[0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296]);

/// What a sensor makes of light.
pub struct Sensor {
    /// By what it multiplies it.
    exposure: f64,
    /// What it makes of its colour, if anything.
    balance: Option<DMat3>,
}

impl Sensor {
    /// A sensor that shows light as it is.
    pub const PLAIN: Self = Self { exposure: 1.0, balance: None };

    /// As the options before the world have it: the time of exposure, times the film's speed over 100, and its white.
    pub fn read(options: &Options, context: &mut Context) -> Result<Self, SceneError> {
        let Some(film) = &options.film else { return Ok(Self::PLAIN) };
        let time = match &options.camera {
            Some((camera, _)) => camera.float_or("shutterclose", 1.0)? - camera.float_or("shutteropen", 0.0)?,
            None => 1.0,
        };
        // v3 has a `scale` of its film.
        let exposure = time * film.float_or("iso", 100.0)? / 100.0 * film.float_or("scale", 1.0)?;
        if exposure <= 0.0 {
            return Err(film
                .place
                .error(format!("the film multiplies light by {exposure}"), "give a time and a speed above 0"));
        }
        if exposure != 1.0 {
            let text = format!("the film multiplies light by {exposure}; every emitter is so much brighter");
            context.note(NoteKind::Mapped, &film.place, text);
        }
        Ok(Self { exposure, balance: balance(film, context)? })
    }

    /// The light of a colour.
    pub fn shows(&self, rgb: [f64; 3]) -> [f64; 3] {
        let rgb = DVec3::from(rgb);
        (self.balance.map_or(rgb, |balance| (balance * rgb).max(DVec3::ZERO)) * self.exposure).to_array()
    }

    /// By what the light of an image is multiplied: that of white, channel by channel.
    pub fn factor(&self) -> [f64; 3] {
        self.shows([1.0; 3])
    }
}

/// What is done to linear sRGB so that daylight of the film's `whitebalance` is white; where a film has the curves of a real sensor, which
/// are made to show D65 as it is, by 6500 K if it doesn't say.
fn balance(film: &Parameters, context: &mut Context) -> Result<Option<DMat3>, SceneError> {
    if let Some(sensor) = film.text("sensor")?.filter(|sensor| *sensor != "cie1931") {
        let sensor = super::lexer::shown(sensor);
        context.approximate(film.place_of("sensor"), format!("the `sensor` `{sensor}` is taken as `cie1931`"));
    }
    let kelvin = film.float_or("whitebalance", 0.0)?;
    if kelvin == 0.0 {
        return Ok(None);
    }
    let place = film.place_of("whitebalance");
    if !(1000.0..=25_000.0).contains(&kelvin) {
        return Err(place.error(format!("the `whitebalance` is {kelvin} K"), "give one from 1000 to 25000 K"));
    }
    let text = format!("the `whitebalance` of {kelvin} K is given to what emits: exact for what is white and grey");
    context.approximate(place, text);
    let to_rgb = matrix_to_rgb();
    let cones = |[x, y]: [f64; 2]| CONES * dvec3(x / y, 1.0, (1.0 - x - y) / y);
    let gains = DMat3::from_diagonal(cones(WHITE) / cones(daylight(kelvin)));
    Ok(Some(to_rgb * CONES.inverse() * gains * CONES * to_rgb.inverse()))
}

/// The chromaticity of daylight of a correlated colour temperature (CIE 15:2004, equations 3.3 and 3.4), and of a black body below 4000 K.
fn daylight(kelvin: f64) -> [f64; 2] {
    // The constant of Planck's law has been measured better since the series was laid down.
    let t = kelvin * 1.4388 / 1.4380;
    if t < 4000.0 {
        let rgb = integrated(|wavelength| planck(wavelength, kelvin), false);
        let xyz = matrix_to_rgb().inverse() * DVec3::from(rgb);
        return [xyz.x / xyz.element_sum(), xyz.y / xyz.element_sum()];
    }
    let [a, b, c, d] = if t <= 7000.0 {
        [-4.6070e9, 2.9678e6, 0.099_11e3, 0.244_063]
    } else {
        [-2.0064e9, 1.9018e6, 0.247_48e3, 0.237_040]
    };
    let x = ((a / t + b) / t + c) / t + d;
    [x, (-3.0 * x + 2.870) * x - 0.275]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn daylight_has_its_known_chromaticities() {
        for (kelvin, known) in [(5000.0, [0.3457, 0.3585]), (6500.0, [0.3127, 0.3290]), (7500.0, [0.2990, 0.3149])] {
            let found = daylight(kelvin);
            assert!(found.iter().zip(known).all(|(a, b)| (a - b).abs() < 4e-4), "{kelvin}: {found:?}");
        }
        // A black body's, by the fit of the observer.
        let found = daylight(2856.0);
        assert!(found.iter().zip([0.4476, 0.4074]).all(|(a, b)| (a - b).abs() < 4e-3), "{found:?}");
    }
}
