//! All directions that a model scatters to, as pictures of hemispheres in false colour.

use super::{INCIDENCE, albedo, incident, transmits};
use crate::export::png::Picture;
use sampling::bsdf::{Bsdf, BsdfSample, Lobes, TransportMode};
use sampling::vec3;

/// Pixels across a hemisphere.
const SIDE: usize = 200;
/// The middle of a hemisphere in its picture, and its radius \[pixels\].
const CENTRE: f32 = SIDE as f32 / 2.0;
const RADIUS: f32 = CENTRE - 9.0;
/// Above each row, for its labels \[pixels\].
const HEAD: usize = 22;
/// The range of values that is told apart, below the largest.
const DECADES: f64 = 4.0;
const BACKGROUND: [u8; 3] = [18, 20, 24];
const INK: [u8; 3] = [236, 238, 242];

/// f_s |cos θ_i| over the hemisphere seen from above, one disc an angle of incidence (the light comes from the left), the largest channel on
/// a logarithmic scale of four decades that all discs share; a second row for what passes through. Delta lobes are rings, whose radius
/// is the larger the larger their share.
pub fn picture(bsdf: &Bsdf) -> Picture {
    let sides: &[f32] = if transmits(bsdf) { &[1.0, -1.0] } else { &[1.0] };
    let rows: Vec<Vec<Vec<f64>>> =
        sides.iter().map(|&side| INCIDENCE.iter().map(|&degrees| disc(bsdf, degrees, side)).collect()).collect();
    let most = rows.iter().flatten().flatten().copied().filter(|f| f.is_finite()).fold(0.0, f64::max);
    let mut picture = Picture::filled(SIDE * INCIDENCE.len(), (SIDE + HEAD) * sides.len(), BACKGROUND);
    for (row, discs) in rows.iter().enumerate() {
        for (column, disc) in discs.iter().enumerate() {
            let (x0, y0) = (column * SIDE, row * (SIDE + HEAD));
            let what = if row == 0 { "reflected" } else { "through" };
            picture.letter(&format!("{} deg, {what}", INCIDENCE[column]), x0 + 8, y0 + 2, INK);
            let tile = Picture { width: SIDE, height: SIDE, rgb: disc.iter().flat_map(|&f| shown(f, most)).collect() };
            picture.paste(&tile, x0, y0 + HEAD);
            let lobes = albedo::delta_lobes(bsdf, incident(INCIDENCE[column])).into_iter();
            for lobe in lobes.filter(|lobe| lobe.wi.z * sides[row] > 0.0) {
                ring(&mut picture, (x0, y0 + HEAD), &lobe);
            }
        }
    }
    picture
}

/// f_s |cos θ_i| at every pixel of the disc; NaN outside it.
fn disc(bsdf: &Bsdf, degrees: f32, side: f32) -> Vec<f64> {
    let wo = incident(degrees);
    let coordinate = |i: usize| (i as f32 + 0.5 - CENTRE) / RADIUS;
    let at = |pixel: usize| {
        let (x, y) = (coordinate(pixel % SIDE), -coordinate(pixel / SIDE));
        let z2 = 1.0 - x * x - y * y;
        if z2 <= 0.0 {
            return f64::NAN;
        }
        let wi = vec3(x, y, z2.sqrt() * side);
        (bsdf.eval(wo, wi, Lobes::ALL, TransportMode::Radiance).max_component() * wi.z.abs()) as f64
    };
    (0..SIDE * SIDE).map(at).collect()
}

/// A ring about the direction of a delta lobe, in the hemisphere whose picture begins here.
fn ring(picture: &mut Picture, (x0, y0): (usize, usize), lobe: &BsdfSample) {
    let share = lobe.weight.max_component() * lobe.pdf;
    let radius = 2.0 + 6.0 * share.cbrt();
    let (x, y) = (CENTRE + RADIUS * lobe.wi.x, CENTRE - RADIUS * lobe.wi.y);
    for pixel in 0..SIDE * SIDE {
        let (dx, dy) = ((pixel % SIDE) as f32 + 0.5 - x, (pixel / SIDE) as f32 + 0.5 - y);
        let coverage = (1.5 - (dx.hypot(dy) - radius).abs()).clamp(0.0, 1.0);
        picture.blend(x0 + pixel % SIDE, y0 + pixel / SIDE, INK, coverage);
    }
}

fn shown(f: f64, most: f64) -> [u8; 3] {
    if f.is_nan() {
        return BACKGROUND;
    }
    let share = if f > 0.0 { 1.0 + (f / most).log10() / DECADES } else { 0.0 };
    heat(share.clamp(0.0, 1.0))
}

/// From dark blue over red to pale yellow, its lightness rising evenly.
fn heat(x: f64) -> [u8; 3] {
    const STOPS: [[f64; 3]; 6] = [
        [5.0, 5.0, 30.0],
        [60.0, 15.0, 110.0],
        [145.0, 35.0, 110.0],
        [225.0, 85.0, 60.0],
        [250.0, 165.0, 30.0],
        [252.0, 250.0, 190.0],
    ];
    let at = x * (STOPS.len() - 1) as f64;
    let low = (at as usize).min(STOPS.len() - 2);
    let between = at - low as f64;
    std::array::from_fn(|c| (STOPS[low][c] + between * (STOPS[low + 1][c] - STOPS[low][c])).round() as u8)
}
