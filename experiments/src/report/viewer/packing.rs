//! How a layer of an image is packed into a page: means as half floats, standard errors as eighths of octaves, both deflated.
//!
//! A half float has 11 bits, so that what is read back is within a part in 2048 of what was measured. Before it is made, a layer is
//! divided by a power of two that puts its largest value just below the largest half, so that no layer overflows, and only
//! what is less than 2⁻²⁷ of its brightest pixel has fewer digits. A standard error of R replicates is uncertain by 1/√(2R − 2) itself; a byte with eight
//! steps an octave is within 4.5 % of it.
//!
//! Noise hardly compresses, but a pixel's channels are noisy together: each is stored as its difference from the channel before, and
//! high bytes apart from low ones. In the default experiment that takes 3.9 bytes for each pixel of a layer, where half floats of
//! both would take 12.

use flate2::Compression;
use flate2::write::DeflateEncoder;
use half::f16;
use std::io::Write;

/// Steps of a standard error in an octave.
pub const STEPS: f64 = 8.0;
/// Exponent of the power of two above all half floats.
const LARGEST: i32 = 16;

/// A layer as it is embedded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Packed {
    /// What the half floats are to be multiplied with; 0 where all is black.
    pub scale: f64,
    /// The base-two logarithm of the standard error whose code is 255; `None` where none is known.
    pub largest_error: Option<f64>,
    /// Codes of means, low bytes and high bytes, then those of standard errors, plane by plane; deflated. Empty where all is black.
    pub bytes: Vec<u8>,
}

/// Means `[pixel][channel]` of a layer and their standard errors, packed.
pub fn pack(means: &[[f64; 3]], errors: Option<&[[f64; 3]]>) -> Packed {
    let largest = |values: &[[f64; 3]]| {
        values.iter().flatten().filter(|x| x.is_finite()).fold(0.0, |most: f64, x| most.max(x.abs()))
    };
    let most = largest(means);
    let uncertain = errors.map_or(0.0, largest);
    if most == 0.0 && uncertain == 0.0 && means.iter().flatten().all(|x| x.is_finite()) {
        return Packed { largest_error: errors.map(|_| 0.0), ..Packed::default() };
    }
    let scale = if most > 0.0 { (most.log2().floor() + 2.0 - f64::from(LARGEST)).exp2() } else { 1.0 };
    let largest_error = if uncertain > 0.0 { uncertain.log2() } else { 0.0 };
    let codes = planes(means, |x| f16::from_f64(x / scale).to_bits(), |a, b| a.wrapping_sub(b));
    let mut raw: Vec<u8> = codes.iter().map(|code| code.to_le_bytes()[0]).collect();
    raw.extend(codes.iter().map(|code| code.to_le_bytes()[1]));
    if let Some(errors) = errors {
        raw.extend(planes(errors, |x| error_code(x, largest_error), |a, b| a.wrapping_sub(b)));
    }
    Packed { scale, largest_error: errors.map(|_| largest_error), bytes: deflated(&raw) }
}

/// The code of every value, red ones first, then those of green less red, then those of blue less green.
fn planes<T: Copy>(values: &[[f64; 3]], code: impl Fn(f64) -> T, less: impl Fn(T, T) -> T) -> Vec<T> {
    let mut planes = Vec::with_capacity(values.len() * 3);
    planes.extend(values.iter().map(|v| code(v[0])));
    planes.extend(values.iter().map(|v| less(code(v[1]), code(v[0]))));
    planes.extend(values.iter().map(|v| less(code(v[2]), code(v[1]))));
    planes
}

/// 0 is none at all; what is smaller than a step of 1 is one.
fn error_code(error: f64, largest: f64) -> u8 {
    if error == 0.0 {
        return 0;
    }
    (255.0 + (STEPS * (error.log2() - largest)).round()).clamp(1.0, 255.0) as u8
}

fn deflated(raw: &[u8]) -> Vec<u8> {
    let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
    // Writing to a vector succeeds.
    let written = encoder.write_all(raw).and_then(|()| encoder.finish());
    written.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    /// What a browser does, step by step.
    fn unpack(packed: &Packed, pixels: usize) -> Vec<([f64; 3], [f64; 3])> {
        let mut raw = Vec::new();
        flate2::read::DeflateDecoder::new(&*packed.bytes).read_to_end(&mut raw).unwrap();
        let n = 3 * pixels;
        let mut value = |pixel: usize| {
            let mut code = 0u16;
            let mut error = 0u8;
            let mut both = ([0.0; 3], [0.0; 3]);
            for c in 0..3 {
                let at = c * pixels + pixel;
                code = code.wrapping_add(u16::from_le_bytes([raw[at], raw[n + at]]));
                both.0[c] = f16::from_bits(code).to_f64() * packed.scale;
                if let Some(largest) = packed.largest_error {
                    error = error.wrapping_add(raw[2 * n + at]);
                    both.1[c] = if error == 0 { 0.0 } else { (largest + (f64::from(error) - 255.0) / STEPS).exp2() };
                }
            }
            both
        };
        (0..pixels).map(&mut value).collect()
    }

    #[test]
    fn values_come_back_to_a_part_in_2048_and_errors_to_a_sixteenth_of_an_octave() {
        for brightness in [1e-20, 1.0, 3.7e18] {
            let mean = |i: usize| [0.9, -0.013, 1.0 / (1.0 + i as f64)].map(|x| x * brightness);
            let error = |i: usize| [1e-4, 0.0, 1e-6 * (1.0 + i as f64)].map(|x| x * brightness);
            let means: Vec<_> = (0..500).map(mean).collect();
            let errors: Vec<_> = (0..500).map(error).collect();
            let packed = pack(&means, Some(&errors));
            for (i, (m, e)) in unpack(&packed, 500).into_iter().enumerate() {
                for c in 0..3 {
                    assert!((m[c] - means[i][c]).abs() <= means[i][c].abs() / 2048.0, "{m:?} for {:?}", means[i]);
                    let octaves = if errors[i][c] == 0.0 { e[c] } else { (e[c] / errors[i][c]).log2() };
                    assert!(octaves.abs() <= 0.5 / STEPS + 1e-9, "{e:?} for {:?}", errors[i]);
                }
            }
        }
    }

    #[test]
    fn black_takes_no_room_and_what_is_no_number_stays_none() {
        assert!(pack(&[[0.0; 3]; 9], Some(&[[0.0; 3]; 9])).bytes.is_empty());
        let packed = pack(&[[f64::NAN, 1.0, f64::INFINITY]], None);
        let (mean, _) = unpack(&packed, 1)[0];
        assert!(mean[0].is_nan() && mean[1] == 1.0 && mean[2].is_infinite());
    }
}
