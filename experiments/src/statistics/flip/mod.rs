//! FLIP: how different two images look when one alternates between them, from 0 to 1, pixel by pixel.
//!
//! For images of low dynamic range after [Andersson et al. 2020]: both are blurred as the eye blurs them, colours are compared, and
//! where an edge or a point is in one image alone, the difference counts for more. For radiances after [Andersson et al. 2021]: the
//! largest difference over a range of exposures that shows what is bright and what is dark. Checked against the authors' program.
//!
//! FLIP is not linear in the noise: its value for a replicate is not that of the mean image, and neither can be debiased. An interval
//! is had from the values of replicates, by [`super::means::skewed_mean`].

mod colour;
mod filter;

use crate::metrics::Pixels;
use colour::{channel, from_opponent, hunt_lab, hyab, luminance, opponent};
use filter::{Kernel, columns, filter, rows};
use rayon::prelude::*;

/// Pixels in a degree of visual angle: a screen of 0.7 m and 3840 pixels, 0.7 m away.
pub const PIXELS_PER_DEGREE: f64 = 3840.0 * std::f64::consts::PI / 180.0;

/// Parameters of the papers: exponents of colours and features, the knee of the map of colour differences, and the width of features
/// \[degrees\].
const COLOUR_POWER: f64 = 0.7;
const FEATURE_POWER: f64 = 0.5;
const KNEE: (f64, f64) = (0.4, 0.95);
const FEATURE_WIDTH: f64 = 0.082;

/// Contrast sensitivity of the three opponent channels: sums of `a √(π/b) exp(−π² d²/b)`, d in degrees \[Andersson et al. 2020, §4.1\].
const SENSITIVITY: [&[(f64, f64)]; 3] = [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];

/// What brings out highlights: luminance is taken to this value by the tone map at the first and last exposure.
const SHOWN: f64 = 0.85;
/// Numerator and denominator of the tone map, from the square term to the constant one [Narkowicz 2015], its input scaled by 0.6.
const TONE: [[f64; 3]; 2] = [[0.36 * 2.51, 0.6 * 0.03, 0.0], [0.36 * 2.43, 0.6 * 0.59, 0.14]];

/// Pixels in rows, linear sRGB.
struct Image {
    width: usize,
    pixels: Vec<[f64; 3]>,
}

impl Image {
    /// Neither negative nor infinite, and what is not a number is black.
    fn new(width: usize, pixels: Pixels) -> Self {
        let finite = |v: f32| f64::from(v.clamp(0.0, f32::MAX)).max(0.0);
        Self { width, pixels: pixels.iter().map(|p| p.map(finite)).collect() }
    }

    fn map(&self, of: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        Self { width: self.width, pixels: self.pixels.iter().map(|&p| of(p)).collect() }
    }
}

/// The exposures of a comparison of radiances, in stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposures {
    /// The first: it shows the highlights.
    pub start: f64,
    /// The last: it shows the median.
    pub stop: f64,
    /// How many, at equal distances, ends included.
    pub count: usize,
}

impl Exposures {
    /// Those that show this reference [Andersson et al. 2021]. The median counts as at least 2⁻²³.
    pub fn of(width: usize, reference: Pixels) -> Self {
        let mut luminances: Vec<f64> = Image::new(width, reference).pixels.into_iter().map(luminance).collect();
        luminances.sort_by(f64::total_cmp);
        let largest = luminances.last().copied().unwrap_or(0.0).max(f64::from(f32::EPSILON));
        let middle = luminances.len() / 2;
        let median = match luminances.len() % 2 {
            0 if middle > 0 => 0.5 * (luminances[middle - 1] + luminances[middle]),
            _ => luminances.get(middle).copied().unwrap_or(0.0),
        };
        // The input that the tone map takes to what is shown: a quadratic equation.
        let [a, b, c] = [0, 1, 2].map(|i| TONE[0][i] - SHOWN * TONE[1][i]);
        let input = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
        let (start, stop) = ((input / largest).log2(), (input / median.max(f64::from(f32::EPSILON))).log2());
        Self { start, stop, count: ((stop - start).ceil() as usize).max(2) }
    }

    fn values(self) -> impl IndexedParallelIterator<Item = f64> {
        (0..self.count)
            .into_par_iter()
            .map(move |i| self.start + (self.stop - self.start) * i as f64 / (self.count - 1) as f64)
    }
}

/// The difference of images of low dynamic range: linear sRGB from 0 to 1, rows of `width` pixels.
pub fn ldr(width: usize, reference: Pixels, test: Pixels, pixels_per_degree: f64) -> Vec<f64> {
    let [reference, test] = [reference, test].map(|pixels| Image::new(width, pixels).map(|p| p.map(|v| v.min(1.0))));
    difference(&reference, &test, pixels_per_degree)
}

/// The difference of radiances, at the exposures that the reference asks for.
pub fn hdr(width: usize, reference: Pixels, test: Pixels, pixels_per_degree: f64) -> Vec<f64> {
    let exposures = Exposures::of(width, reference);
    let images = [reference, test].map(|pixels| Image::new(width, pixels));
    let at = |stops: f64| {
        let [reference, test] = images.each_ref().map(|image| image.map(|p| p.map(|v| tone_mapped(v * stops.exp2()))));
        difference(&reference, &test, pixels_per_degree)
    };
    let largest = |mut a: Vec<f64>, b: Vec<f64>| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a = a.max(b));
        a
    };
    exposures.values().map(at).reduce_with(largest).unwrap_or_default()
}

/// The mean over pixels.
pub fn mean(map: &[f64]) -> f64 {
    map.iter().sum::<f64>() / map.len() as f64
}

fn tone_mapped(x: f64) -> f64 {
    let [over, under] = TONE.map(|[a, b, c]| (a * x + b) * x + c);
    (over / under).clamp(0.0, 1.0)
}

/// Colours compared, and raised to a power that is the smaller the more their edges and points differ.
fn difference(reference: &Image, test: &Image, pixels_per_degree: f64) -> Vec<f64> {
    let [a, b] = [reference, test].map(|image| image.map(opponent));
    let [seen_a, seen_b] = [&a, &b].map(|image| seen(image, pixels_per_degree));
    let [features_a, features_b] = [&a, &b].map(|image| features(image, pixels_per_degree));
    let colours = seen_a.pixels.iter().zip(&seen_b.pixels).map(|(&a, &b)| colour_difference(a, b));
    let features = features_a.iter().zip(&features_b).map(|(a, b)| {
        let largest = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
        (largest / 2.0_f64.sqrt()).powf(FEATURE_POWER).min(1.0)
    });
    colours.zip(features).map(|(colour, feature): (f64, f64)| colour.powf(1.0 - feature)).collect()
}

/// What the eye sees of an opponent image, in the space that differences are taken in.
fn seen(image: &Image, pixels_per_degree: f64) -> Image {
    use std::f64::consts::PI;
    let widest = SENSITIVITY.iter().flat_map(|terms| terms.iter()).map(|(_, b)| *b).fold(0.0, f64::max);
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as usize;
    let blurred = [0, 1, 2].map(|c| {
        let plane = channel(image, c);
        let mut sum = vec![0.0; plane.len()];
        // Each term is a product of two Gaussians; its part of all is the square of the sum along one of them.
        let gaussian = |b: f64| move |x: f64| (-PI * PI * (x / pixels_per_degree).powi(2) / b).exp();
        let parts = SENSITIVITY[c].iter().map(|&(a, b)| a * (PI / b).sqrt() * Kernel::sum(radius, gaussian(b)).powi(2));
        let parts: Vec<f64> = parts.collect();
        for (&(_, b), part) in SENSITIVITY[c].iter().zip(&parts) {
            let kernel = Kernel::new(radius, gaussian(b));
            let share = part / parts.iter().sum::<f64>();
            sum.iter_mut().zip(filter(&plane, image.width, &kernel, &kernel)).for_each(|(s, v)| *s += share * v);
        }
        sum
    });
    let pixel = |i: usize| hunt_lab(from_opponent([0, 1, 2].map(|c| blurred[c][i])).map(|v| v.clamp(0.0, 1.0)));
    Image { width: image.width, pixels: (0..image.pixels.len()).map(pixel).collect() }
}

/// From 0 to 1: small differences take most of the range [Andersson et al. 2020, §4.1].
fn colour_difference(a: [f64; 3], b: [f64; 3]) -> f64 {
    let largest = hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])).powf(COLOUR_POWER);
    let (difference, knee) = (hyab(a, b).powf(COLOUR_POWER), KNEE.0 * largest);
    if difference < knee {
        return KNEE.1 / knee * difference;
    }
    KNEE.1 + (difference - knee) / (largest - knee) * (1.0 - KNEE.1)
}

/// Strength of edges and of points in an opponent image's luminance: its first and second derivatives [Andersson et al. 2020, §4.2].
fn features(image: &Image, pixels_per_degree: f64) -> Vec<[f64; 2]> {
    let deviation = 0.5 * FEATURE_WIDTH * pixels_per_degree;
    let radius = (3.0 * deviation).ceil() as usize;
    let gaussian = move |x: f64| (-0.5 * (x / deviation).powi(2)).exp();
    let smooth = Kernel::gaussian(radius, deviation);
    let edge = Kernel::new(radius, |x| -x * gaussian(x));
    let point = Kernel::new(radius, |x| ((x / deviation).powi(2) - 1.0) * gaussian(x));
    let plane: Vec<f64> = image.pixels.iter().map(|p| (p[0] + 16.0) / 116.0).collect();
    let (smooth_rows, smooth_columns) = (rows(&plane, image.width, &smooth), columns(&plane, image.width, &smooth));
    let strength = |kernel: &Kernel| -> Vec<f64> {
        let (x, y) = (rows(&smooth_columns, image.width, kernel), columns(&smooth_rows, image.width, kernel));
        x.iter().zip(y).map(|(x, y)| (x * x + y * y).sqrt()).collect()
    };
    strength(&edge).into_iter().zip(strength(&point)).map(|(edge, point)| [edge, point]).collect()
}

#[cfg(test)]
mod tests;
