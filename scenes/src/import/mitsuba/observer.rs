//! How spectra look: the CIE 1931 observer, daylight, and linear sRGB.

use glam::DMat3;

/// From XYZ to linear sRGB, whose white is D65.
const TO_RGB: [[f64; 3]; 3] =
    [[3.240_479, -1.537_150, -0.498_535], [-0.969_256, 1.875_991, 0.041_556], [0.055_648, -0.204_043, 1.057_311]];

/// The linear sRGB of a colour in XYZ.
pub fn from_xyz(xyz: [f64; 3]) -> [f64; 3] {
    TO_RGB.map(|row| (0..3).map(|i| row[i] * xyz[i]).sum())
}

/// The luminance of a colour in linear sRGB; of a grey that grey.
pub fn luminance([r, g, b]: [f64; 3]) -> f64 {
    if r == g && g == b { r } else { 0.212_671 * r + 0.715_160 * g + 0.072_169 * b }
}

/// CIE's illuminant D65 from 380 to 780 nm, every 10 nm, relative to 100 at 560 nm.
const D65: [f64; 41] = [
    49.9755, 54.6482, 82.7549, 91.486, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923, 108.811, 109.354,
    107.802, 104.79, 107.689, 104.405, 104.046, 100.0, 96.3342, 95.788, 88.6856, 90.0062, 89.5991, 87.6987, 83.2886,
    83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.349, 61.604, 69.8856, 75.087, 63.5927, 46.4182,
    66.8054, 63.3828,
];

/// From XYZ to linear sRGB, as a matrix.
pub fn matrix_to_rgb() -> DMat3 {
    DMat3::from_cols_array_2d(&TO_RGB).transpose()
}

/// The fit of Wyman, Sloan and Shirley (2013, equation 4), in lobes of two halves; good to some 1 %.
fn observer(wavelength: f64) -> [f64; 3] {
    let lobe = |scale: f64, mean: f64, below: f64, above: f64| {
        let t = (wavelength - mean) / if wavelength < mean { below } else { above };
        scale * (-0.5 * t * t).exp()
    };
    [
        lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) + lobe(-0.065, 501.1, 20.4, 26.2),
        lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
        lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
    ]
}

/// The linear sRGB of a spectrum v: of light, from ∫ v x̄ dλ / ∫ ȳ dλ; where it is seen in daylight, such that 1 is white.
pub fn integrated(value: impl Fn(f64) -> f64, in_daylight: bool) -> [f64; 3] {
    let (mut sum, mut white, mut brightness) = ([0.0; 3], [0.0; 3], 0.0);
    for wavelength in (360..=830).map(f64::from) {
        let lit = if in_daylight { daylight(wavelength) } else { 1.0 };
        let xyz = observer(wavelength);
        brightness += xyz[1];
        for (c, response) in from_xyz(xyz).into_iter().enumerate() {
            let response = lit * response;
            sum[c] += response * value(wavelength);
            white[c] += response;
        }
    }
    std::array::from_fn(|c| sum[c] / if in_daylight { white[c] } else { brightness })
}

/// D65, its ends going on as they are.
fn daylight(wavelength: f64) -> f64 {
    let place = ((wavelength - 380.0) / 10.0).clamp(0.0, 40.0);
    let first = place.floor() as usize;
    D65[first] + (D65[(first + 1).min(40)] - D65[first]) * place.fract()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_is_white() {
        let near = |found: [f64; 3], known: [f64; 3]| {
            assert!(found.iter().zip(known).all(|(a, b)| (a - b).abs() < 0.015), "{found:?} against {known:?}");
        };
        near(integrated(|_| 1.0, false), TO_RGB.map(|row| row.iter().sum()));
        let reflected = integrated(|_| 1.0, true);
        assert!(reflected.iter().all(|c| (c - 1.0).abs() < 1e-12), "{reflected:?}");
        // Light of D65 has the colour of the white point, all three channels alike.
        let lit = integrated(daylight, false);
        near(lit.map(|c| c / lit[1]), [1.0; 3]);
    }
}
