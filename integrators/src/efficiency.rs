//! Roulette for the sake of efficiency \[Rath22\]: a walk goes on as far as what it may find is worth its rays.
//!
//! Survival with probability q divides what a walk of weight β brings home from here by q with that probability. With M its second moment
//! for β = 1 and C its rays, that adds β² M / q to the variance of a sample, and q C to its cost. If V and R are the variance and the
//! rays of samples as a whole, the product of both is least at
//!
//! `q = β √(M / C) / √(V / R)`  \[Rath22, §4\].
//!
//! M and C are learned by a pilot, for cells of space and six directions. Whatever it learned, the mean stays what it is.
//! Departures: walks are ended, but never split; V is the variance of a pixel as it is, not over the square of its mean, since that is
//! what efficiency is measured by here; and what was learned is a grid, whose cells of few records lean on larger ones.

use crate::contribution::{Contribution, Sink, Wants};
use crate::integrator::{Estimator, Pixel, Replicate};
use crate::measurement::Counters;
use crate::path::Path;
use crate::request::Request;
use crate::roulette::MAX_SURVIVAL;
use crate::scratch::Scratch;
use rayon::prelude::*;
use sampling::Vec3;
use sampling::math::Spectrum;
use sampling::sampler::{Purpose, Sampler};
use scenes::Scene;
use std::ops::Range;

/// The least probability of survival: what is rare in a pilot may still be bright, and a path through glass plays three times. With the 0.05 of
/// the source, caustics become so rare and bright that intervals of 65 536 samples miss them.
const LEAST: f32 = 0.25;
/// Cells along each side of the scene, of the grid and of the larger ones that they lean on.
const FINE: usize = 8;
const COARSE: usize = 2;
/// Directions are told apart by their longest component and its sign.
const DIRECTIONS: usize = 6;
/// As many records of the larger cell stand beside a cell's own.
const LEANING: f64 = 32.0;
/// A pilot takes this part of a replicate's samples, but so many walks at the least and at the most.
const PART: u64 = 16;
const WALKS: Range<u64> = 1 << 12..1 << 16;
/// Pairs of walks that one thread takes at once.
const CHUNK: u64 = 128;

/// What a pilot learned of the worth of going on.
#[derive(Clone, Debug)]
pub struct Efficiency {
    grid: Grid,
    /// `√(M / C) / √(V / R)` of each cell: probability of survival over the walk's weight.
    worth: Vec<f32>,
    /// The highest probability.
    cap: f32,
    /// The pilot's work.
    pub(crate) work: Counters,
}

impl Efficiency {
    /// Learns from walks of a replicate's pilot. The first of them play roulette by throughput, the others by what those before found.
    pub(crate) fn learn(settings: &Path, scene: &Scene, request: &Request, replicate: &Replicate) -> Self {
        let grid = Grid::around(scene);
        let cap = if request.tail() { MAX_SURVIVAL } else { 1.0 };
        let mut known: Option<Self> = None;
        let (mut cells, mut work) = (vec![Record::default(); FINE.pow(3) * DIRECTIONS], Counters::default());
        let pixels = u64::from(scene.camera.width()) * u64::from(scene.camera.height());
        let walks = (pixels * u64::from(replicate.samples) / PART).clamp(WALKS.start, WALKS.end);
        let pairs = walks / 2;
        for pairs in [0..pairs / 7, pairs / 7..pairs * 3 / 7, pairs * 3 / 7..pairs] {
            let settings = Path { efficiency: known.take().map(Into::into), ..settings.clone() };
            let firsts: Vec<u64> = pairs.clone().step_by(CHUNK as usize).collect();
            let chunks: Vec<Chunk> = firsts
                .into_par_iter()
                .map(|first| {
                    let pairs = first..(first + CHUNK).min(pairs.end);
                    Chunk::trace(&settings, (scene, request), replicate, walks as u32, &grid, pairs)
                })
                .collect();
            let (mut variance, mut rays) = (0.0, 0.0);
            for chunk in chunks {
                chunk.records.iter().for_each(|(cell, record)| cells[*cell as usize].add(record));
                variance += chunk.variance;
                rays += chunk.rays;
                work += chunk.scratch.counters;
            }
            // A variance is one of a pair, rays are of both its walks.
            let of_image = (variance / (0.5 * rays)).sqrt();
            let worth = leaning(&cells).map(|record| (record.worth() / of_image) as f32).collect();
            known = Some(Self { grid, worth, cap, work });
        }
        known.unwrap_or(Self { grid, worth: vec![f32::INFINITY; cells.len()], cap, work })
    }

    /// The probability with which a walk of this weight should go on from a point in direction `wi`.
    #[inline]
    pub fn survival(&self, beta: Spectrum, p: Vec3, wi: Vec3) -> f32 {
        let survival = beta.luminance() * self.worth[self.grid.cell(p, wi)];
        // What is no number goes on, so that it is counted; and all does where nothing varies.
        if survival < self.cap { survival.max(LEAST) } else { self.cap }
    }
}

/// Cells of the cube around a scene.
#[derive(Clone, Copy, Debug)]
struct Grid {
    low: Vec3,
    /// Cells per metre.
    scale: f32,
}

impl Grid {
    fn around(scene: &Scene) -> Self {
        let radius = scene.bounds.radius;
        Self { low: scene.bounds.center - Vec3::splat(radius), scale: FINE as f32 / (2.0 * radius) }
    }

    /// The cell of a point and a direction.
    #[inline]
    fn cell(&self, p: Vec3, wi: Vec3) -> usize {
        // Conversion to integers is saturating.
        let at = ((p - self.low) * self.scale).to_array().map(|x| (x as usize).min(FINE - 1));
        let axis = wi.abs().max_position();
        ((at[0] * FINE + at[1]) * FINE + at[2]) * DIRECTIONS + 2 * axis + usize::from(wi[axis] < 0.0)
    }
}

/// Sums over scatterings.
#[derive(Clone, Copy, Debug, Default)]
struct Record {
    count: f64,
    /// Squares of the luminance that walks of weight 1 brought home from there.
    squares: f64,
    /// Rays that they took.
    rays: f64,
}

impl Record {
    fn add(&mut self, other: &Self) {
        self.count += other.count;
        self.squares += other.squares;
        self.rays += other.rays;
    }

    /// Together with a number of records of a larger cell.
    fn leaning_on(&self, larger: &Self) -> Self {
        let share = LEANING / larger.count.max(1.0);
        Self {
            count: self.count + LEANING,
            squares: self.squares + share * larger.squares,
            rays: self.rays + share * larger.rays,
        }
    }

    /// `√(M / C)`; a walk that goes on takes one ray at the least.
    fn worth(&self) -> f64 {
        (self.squares / self.rays.max(self.count)).sqrt()
    }
}

/// The cells' records, those of few of their own filled up from larger cells, and these from all.
fn leaning(cells: &[Record]) -> impl Iterator<Item = Record> {
    let larger = |cell: usize| {
        let (at, direction) = (cell / DIRECTIONS, cell % DIRECTIONS);
        let part = |index: usize| index % FINE * COARSE / FINE;
        ((part(at / (FINE * FINE)) * COARSE + part(at / FINE)) * COARSE + part(at)) * DIRECTIONS + direction
    };
    let (mut all, mut coarse) = (Record::default(), vec![Record::default(); COARSE.pow(3) * DIRECTIONS]);
    for (cell, record) in cells.iter().enumerate() {
        all.add(record);
        coarse[larger(cell)].add(record);
    }
    let coarse: Vec<Record> = coarse.iter().map(|record| record.leaning_on(&all)).collect();
    cells.iter().enumerate().map(move |(cell, record)| record.leaning_on(&coarse[larger(cell)]))
}

/// Some pairs of a pilot's walks.
#[derive(Default)]
struct Chunk {
    records: Vec<(u32, Record)>,
    /// Sum over pairs of the variance of a sample that they show.
    variance: f64,
    rays: f64,
    scratch: Scratch,
}

impl Chunk {
    fn trace(
        settings: &Path,
        (scene, request): (&Scene, &Request),
        replicate: &Replicate,
        walks: u32,
        grid: &Grid,
        pairs: Range<u64>,
    ) -> Self {
        let (width, height) = (scene.camera.width(), scene.camera.height());
        let mut sampler = Sampler::new(replicate.sampler, replicate.key.of_pilot(), walks, (width, height));
        let mut chunk = Chunk::default();
        let mut witness = Witness { grid, walk: Vec::new(), luminance: 0.0 };
        for pair in pairs {
            // Multiples of the golden ratio fill the image evenly.
            let share = pair.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
            let pixel = (share * u64::from(width) * u64::from(height)) >> 32;
            let (x, y) = ((pixel % u64::from(width)) as u32, (pixel / u64::from(width)) as u32);
            let mut luminances = [0.0; 2];
            for (i, luminance) in luminances.iter_mut().enumerate() {
                sampler.start_sample(pixel, 2 * pair as u32 + i as u32);
                let place = Pixel::sample(x, y, scene.camera.filter(), sampler.get_2d(Purpose::Film)).0;
                settings.estimate(scene, request, place, &mut sampler, &mut chunk.scratch, &mut witness);
                *luminance = std::mem::take(&mut witness.luminance);
                chunk.rays += 1.0 + witness.walk.len() as f64;
                witness.finish(&mut chunk.records);
            }
            chunk.variance += 0.5 * (luminances[0] - luminances[1]).powi(2);
        }
        chunk
    }
}

/// Sees where walks scatter, and what they find from there on.
struct Witness<'g> {
    grid: &'g Grid,
    /// Of each scattering its cell, the luminance of the weight after it, and what was found.
    walk: Vec<(u32, f64, f64)>,
    luminance: f64,
}

impl Sink for Witness<'_> {
    const WANTS: Wants = Wants::NOTHING;

    fn add(&mut self, contribution: Contribution) {
        let luminance = f64::from(contribution.value.luminance()) * contribution.weight;
        // What is not finite is the estimate's business.
        if luminance.is_finite() {
            self.luminance += luminance;
            self.walk.iter_mut().for_each(|(_, _, found)| *found += luminance);
        }
    }

    fn goes_on(&mut self, p: Vec3, wi: Vec3, beta: Spectrum) {
        self.walk.push((self.grid.cell(p, wi) as u32, f64::from(beta.luminance()), 0.0));
    }
}

impl Witness<'_> {
    /// Makes records of a walk that has ended: of n scatterings, n − i rays were traced from the i-th on, counted from 0.
    fn finish(&mut self, records: &mut Vec<(u32, Record)>) {
        let scatterings = self.walk.len();
        for (i, (cell, beta, found)) in self.walk.drain(..).enumerate() {
            let squares = (found / beta).powi(2);
            if squares.is_finite() {
                records.push((cell, Record { count: 1.0, squares, rays: (scatterings - i) as f64 }));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_told_apart_by_place_and_direction() {
        let grid = Grid { low: Vec3::splat(-1.0), scale: FINE as f32 / 2.0 };
        let mut seen = std::collections::BTreeSet::new();
        for i in 0..FINE.pow(3) {
            let at = [i % FINE, i / FINE % FINE, i / FINE / FINE].map(|k| (k as f32 + 0.5) / (FINE as f32 / 2.0) - 1.0);
            for wi in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
                assert!(seen.insert(grid.cell(at.into(), wi)));
            }
        }
        assert_eq!(seen.len(), FINE.pow(3) * DIRECTIONS);
        assert!(seen.contains(&grid.cell(Vec3::splat(50.0), Vec3::NEG_Z)));
        assert!(seen.contains(&grid.cell(Vec3::splat(f32::NAN), Vec3::splat(f32::NAN))));
    }

    #[test]
    fn cells_without_records_are_those_around_them() {
        let mut cells = vec![Record::default(); FINE.pow(3) * DIRECTIONS];
        // One cell in a corner knows much, of little light; one in the opposite corner a little, of more light.
        cells[0] = Record { count: 1e6, squares: 4e6, rays: 1e6 };
        let last = cells.len() - 6;
        cells[last] = Record { count: LEANING, squares: LEANING * 36.0, rays: LEANING };
        let worths: Vec<f64> = leaning(&cells).map(|record| record.worth()).collect();
        let beside = DIRECTIONS;
        assert!((worths[0] - 2.0).abs() < 1e-3 && (worths[beside] - 2.0).abs() < 1e-3);
        assert!((worths[last] - 28f64.sqrt()).abs() < 1e-3, "{}", worths[last]);
        assert!(worths[last - beside] < worths[last] && worths[last - beside] > worths[beside]);
    }

    #[test]
    fn survival_is_bounded_and_lets_pass_what_is_no_number() {
        let grid = Grid { low: Vec3::splat(-1.0), scale: FINE as f32 / 2.0 };
        let all = |worth: f32, cap: f32| Efficiency {
            grid,
            worth: vec![worth; FINE.pow(3) * DIRECTIONS],
            cap,
            work: Counters::default(),
        };
        let survival = |roulette: &Efficiency, beta: f32| roulette.survival(Spectrum::splat(beta), Vec3::ZERO, Vec3::Z);
        assert!((survival(&all(2.0, 1.0), 0.25) - 0.5).abs() < 1e-6);
        assert_eq!(survival(&all(0.0, 1.0), 0.25), LEAST);
        assert_eq!(survival(&all(8.0, MAX_SURVIVAL), 0.25), MAX_SURVIVAL);
        assert_eq!(survival(&all(f32::INFINITY, 1.0), 0.25), 1.0);
        assert_eq!(survival(&all(f32::NAN, 1.0), 0.25), 1.0);
        assert_eq!(survival(&all(1.0, 1.0), f32::NAN), 1.0);
    }
}
