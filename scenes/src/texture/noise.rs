//! Gradient noise.

use glam::{DVec3, IVec3, dvec3};
use sampling::Vec3;
use sampling::math::Spectrum;
use sampling::rng::mix2;

/// Noise in the scene's coordinates, between two values: gradients at the points of a grid, blended by quintic curves, in octaves
/// of half the size and half the height each `[Perlin02]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// The value where it is least.
    pub low: Spectrum,
    /// The value where it is greatest.
    pub high: Spectrum,
    /// The grid's spacing \[m\], the size of the largest features; positive.
    pub size: f32,
    /// How many octaves, 1 to [`Noise::MAX_OCTAVES`].
    pub octaves: u32,
    /// Which noise.
    pub seed: u64,
    /// A point of the grid \[m\].
    pub origin: DVec3,
}

/// The directions of gradients: the middles of a cube's edges.
const GRADIENTS: [[i8; 3]; 12] = [
    [1, 1, 0],
    [-1, 1, 0],
    [1, -1, 0],
    [-1, -1, 0],
    [1, 0, 1],
    [-1, 0, 1],
    [1, 0, -1],
    [-1, 0, -1],
    [0, 1, 1],
    [0, -1, 1],
    [0, 1, -1],
    [0, -1, -1],
];

/// The greatest magnitude of one octave, found by maximising the blend over a cell and all choices of gradients.
const GREATEST: f64 = 1.036_354;

impl Noise {
    /// The most octaves: beyond, they are smaller than the grid of `f32` coordinates.
    pub const MAX_OCTAVES: u32 = 16;

    /// The value at a point.
    pub fn at(&self, p: Vec3) -> Spectrum {
        let mut place = (p.as_dvec3() - self.origin) / f64::from(self.size);
        let (mut sum, mut total, mut height) = (0.0, 0.0, 1.0);
        for octave in 0..self.octaves {
            sum += height * gradient_noise(place, mix2(self.seed, u64::from(octave)));
            total += height;
            height *= 0.5;
            place *= 2.0;
        }
        let share = (0.5 + 0.5 * sum / (total * GREATEST)) as f32;
        self.low * (1.0 - share) + self.high * share
    }

    /// The spacing of the finest grid \[m\].
    pub fn finest(&self) -> f32 {
        self.size * 0.5f32.powi(self.octaves as i32 - 1)
    }

    /// What is wrong with it, if anything is.
    pub fn fault(&self) -> Option<&'static str> {
        let finite = self.low.is_finite() && self.high.is_finite() && self.origin.is_finite() && self.size.is_finite();
        if !finite || self.size <= 0.0 {
            return Some("has noise with a size of 0 or less, or a number that is not finite");
        }
        (!(1..=Self::MAX_OCTAVES).contains(&self.octaves)).then_some("has noise of no octaves, or of more than 16")
    }
}

/// Noise on the grid of whole numbers, zero at its points.
fn gradient_noise(place: DVec3, seed: u64) -> f64 {
    let cell = place.floor();
    let within = place - cell;
    let blend = within * within * within * (within * (within * 6.0 - 15.0) + 10.0);
    let cell = cell.as_ivec3();
    let corner = |dx: i32, dy: i32, dz: i32| {
        let offset = within - dvec3(f64::from(dx), f64::from(dy), f64::from(dz));
        gradient(cell + IVec3::new(dx, dy, dz), seed).dot(offset)
    };
    let mix = |a: f64, b: f64, t: f64| a + t * (b - a);
    let along_x = |dy, dz| mix(corner(0, dy, dz), corner(1, dy, dz), blend.x);
    let along_y = |dz| mix(along_x(0, dz), along_x(1, dz), blend.y);
    mix(along_y(0), along_y(1), blend.z)
}

fn gradient(cell: IVec3, seed: u64) -> DVec3 {
    let words = (u64::from(cell.x as u32) << 32) | u64::from(cell.y as u32);
    let bits = mix2(mix2(seed, words), u64::from(cell.z as u32));
    // The upper bits times 12: a choice among twelve whose bias is below 2⁻²⁸.
    let [x, y, z] = GRADIENTS[(((bits >> 32) * 12) >> 32) as usize];
    dvec3(f64::from(x), f64::from(y), f64::from(z))
}
