//! The colour spaces of FLIP, from linear sRGB of D65 white [IEC 61966-2-1].

use super::Image;

/// Linear sRGB to XYZ, from the primaries' chromaticities and those of white, (0.3127, 0.3290).
const TO_XYZ: [[f64; 3]; 3] = [
    [0.412_390_799_265_959_5, 0.357_584_339_383_877_96, 0.180_480_788_401_834_3],
    [0.212_639_005_871_510_36, 0.715_168_678_767_755_9, 0.072_192_315_360_733_71],
    [0.019_330_818_715_591_85, 0.119_194_779_794_625_99, 0.950_532_152_249_660_6],
];
/// Its inverse.
const FROM_XYZ: [[f64; 3]; 3] = [
    [3.240_969_941_904_521, -1.537_383_177_570_093, -0.498_610_760_293_003_3],
    [-0.969_243_636_280_879_7, 1.875_967_501_507_720_6, 0.041_555_057_407_175_61],
    [0.055_630_079_696_993_61, -0.203_976_958_888_976_57, 1.056_971_514_242_878_6],
];

fn times(matrix: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| (0..3).map(|j| matrix[i][j] * v[j]).sum())
}

/// XYZ of white: the sums of the rows.
fn white() -> [f64; 3] {
    times(&TO_XYZ, [1.0; 3])
}

/// XYZ in parts of white.
fn relative_xyz(rgb: [f64; 3]) -> [f64; 3] {
    let (xyz, white) = (times(&TO_XYZ, rgb), white());
    [0, 1, 2].map(|i| xyz[i] / white[i])
}

/// The linear opponent space of the contrast sensitivity functions, Y Cx Cz [Andersson et al. 2020, §4.1].
pub fn opponent(rgb: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = relative_xyz(rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Back from it.
pub fn from_opponent([y, cx, cz]: [f64; 3]) -> [f64; 3] {
    let y = (y + 16.0) / 116.0;
    let (relative, white) = ([y + cx / 500.0, y, y - cz / 200.0], white());
    times(&FROM_XYZ, [0, 1, 2].map(|i| relative[i] * white[i]))
}

/// CIE L*a*b* with the Hunt effect: chroma counts in proportion to lightness, `a' = 0.01 L a` [Andersson et al. 2020, §4.1].
pub fn hunt_lab(rgb: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let root = |t: f64| if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 };
    let [x, y, z] = relative_xyz(rgb).map(root);
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// Difference of two colours, lightness and chroma apart [Abasi et al. 2020].
pub fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + ((a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)).sqrt()
}

/// Luminance of linear sRGB.
pub fn luminance(rgb: [f64; 3]) -> f64 {
    (0..3).map(|c| TO_XYZ[1][c] * rgb[c]).sum()
}

/// One channel of an image.
pub fn channel(image: &Image, c: usize) -> Vec<f64> {
    image.pixels.iter().map(|pixel| pixel[c]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_is_white_and_the_way_back_is_a_way_back() {
        assert!(opponent([1.0; 3]).iter().zip([100.0, 0.0, 0.0]).all(|(a, b): (&f64, f64)| (a - b).abs() < 1e-12));
        assert!(hunt_lab([1.0; 3]).iter().zip([100.0, 0.0, 0.0]).all(|(a, b): (&f64, f64)| (a - b).abs() < 1e-9));
        let rgb = [0.2, 0.7, 0.05];
        let back = from_opponent(opponent(rgb));
        assert!(rgb.iter().zip(back).all(|(a, b)| (a - b).abs() < 1e-12), "{back:?}");
    }
}
