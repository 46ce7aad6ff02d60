//! Where light comes from in every part of a scene: a binary tree over space, of quadtrees over directions [Müller et al. 2017, §3].

use super::quadtree::Quadtree;
use rayon::prelude::*;
use sampling::{Vec2, Vec3};

/// Shares of samples that a part may take from its quadtree, of which it learns the best.
const SHARES: [f32; 5] = [0.0, 0.1, 0.25, 0.5, 0.75];
/// The share before anything is known of others.
const FIRST_SHARE: f32 = 0.5;

/// What a walk found in one direction.
#[derive(Clone, Copy, Debug)]
pub struct Record {
    /// The part of space that learns of it.
    pub part: u32,
    /// The direction, in the square of quadtrees.
    pub place: Vec2,
    /// Estimate of the radiance from there over the density [1/sr] that the direction was sampled with.
    pub light: f32,
    /// The same of what the surface makes of it, over its density.
    pub scattered: f32,
    /// Density of the direction by the BSDF alone [1/sr].
    pub pdf_bsdf: f32,
}

/// A part of space.
#[derive(Clone, Debug, Default)]
pub struct Part {
    /// The density that walks are sampled by.
    known: Quadtree,
    /// The share of samples that it gets.
    share: f32,
    /// What is being learned, and from how many records of light.
    learned: Quadtree,
    records: f64,
    /// How good each of [`SHARES`] would have been: the mean logarithm of the mixture's density where light was scattered from, so
    /// that the best has the least Kullback–Leibler divergence from what it should be [Müller 2019, §10.5].
    scores: [f64; SHARES.len()],
}

impl Part {
    /// The share of samples that should be taken from the quadtree.
    #[inline]
    pub fn share(&self) -> f32 {
        self.share
    }

    /// The density by which it is sampled.
    #[inline]
    pub fn density(&self) -> &Quadtree {
        &self.known
    }

    /// The density of a direction by the mixture of both [1/sr], where that of the BSDF is `pdf`.
    #[inline]
    pub fn mixed(&self, wi: Vec3, pdf: f32) -> f32 {
        self.share * self.known.pdf(wi) + (1.0 - self.share) * pdf
    }

    /// `scores` tells whether enough was learned for the record to say how good that is: before it is learned itself.
    fn learn(&mut self, record: &Record, scores: bool) {
        if record.light <= 0.0 {
            return;
        }
        self.records += 1.0;
        if scores && !self.learned.is_dark() {
            let guided = self.learned.pdf(super::quadtree::from_square(record.place));
            for (score, share) in self.scores.iter_mut().zip(SHARES) {
                let pdf = share * guided + (1.0 - share) * record.pdf_bsdf;
                *score += f64::from(record.scattered) * f64::from(pdf.max(f32::MIN_POSITIVE)).ln();
            }
        }
        self.learned.add(record.place, record.light);
    }

    /// Samples by what was learned from here on.
    fn conclude(&mut self) {
        if self.learned.is_dark() {
            return;
        }
        let best = (0..SHARES.len()).max_by(|&a, &b| self.scores[a].total_cmp(&self.scores[b]));
        self.share = best.filter(|_| self.scores != [0.0; SHARES.len()]).map_or(FIRST_SHARE, |best| SHARES[best]);
        let finer = self.learned.refined();
        self.known = std::mem::replace(&mut self.learned, finer);
        (self.records, self.scores) = (0.0, [0.0; SHARES.len()]);
    }
}

/// Either half of a box: a box that is divided further, or a part.
#[derive(Clone, Copy, Debug)]
enum Half {
    Divided(u32),
    Part(u32),
}

/// The tree. Boxes are divided in the middle, across x, y and z in turn.
#[derive(Clone, Debug)]
pub struct Tree {
    /// Where the cube begins that holds the scene, and how wide it is \[m\].
    corner: Vec3,
    width: f32,
    root: Half,
    boxes: Vec<[Half; 2]>,
    parts: Vec<Part>,
}

impl Tree {
    /// One part that knows nothing.
    pub fn new(corner: Vec3, width: f32) -> Self {
        Self { corner, width, root: Half::Part(0), boxes: Vec::new(), parts: vec![Part::default()] }
    }

    /// The part that a point lies in.
    #[inline]
    pub fn part(&self, p: Vec3) -> &Part {
        &self.parts[self.find(p).0 as usize]
    }

    /// Its number, and the size of its box \[m\].
    #[inline]
    pub fn find(&self, p: Vec3) -> (u32, Vec3) {
        let mut place = (p - self.corner) / self.width;
        let (mut half, mut size, mut axis) = (self.root, Vec3::splat(self.width), 0);
        loop {
            match half {
                Half::Part(part) => return (part, size),
                Half::Divided(at) => {
                    let high = place[axis] >= 0.5;
                    place[axis] = 2.0 * place[axis] - f32::from(u8::from(high));
                    size[axis] /= 2.0;
                    half = self.boxes[at as usize][usize::from(high)];
                    axis = (axis + 1) % 3;
                }
            }
        }
    }

    /// Learns from records, which it puts in order; what it has learned does not depend on threads.
    pub fn learn(&mut self, records: &mut [Record], scores: bool) {
        records.par_sort_by_key(|record| record.part);
        let records = &*records;
        self.parts.par_iter_mut().enumerate().for_each(|(number, part)| {
            let first = records.partition_point(|record| (record.part as usize) < number);
            records[first..]
                .iter()
                .take_while(|record| record.part as usize == number)
                .for_each(|record| part.learn(record, scores));
        });
    }

    /// Samples by what was learned from here on, and divides the parts that learned from more than `most` records.
    pub fn conclude(&mut self, most: f64) {
        self.root = self.conclude_half(self.root, most);
    }

    fn conclude_half(&mut self, half: Half, most: f64) -> Half {
        match half {
            Half::Divided(at) => {
                let halves = self.boxes[at as usize].map(|half| self.conclude_half(half, most));
                self.boxes[at as usize] = halves;
                half
            }
            Half::Part(number) => {
                let records = self.parts[number as usize].records;
                self.parts[number as usize].conclude();
                self.divide(number, records, most)
            }
        }
    }

    /// What stands for a part once it is divided until each has at most so many records; the halves are taken to have as many.
    fn divide(&mut self, number: u32, records: f64, most: f64) -> Half {
        if records <= most {
            return Half::Part(number);
        }
        let other = self.parts.len() as u32;
        self.parts.push(self.parts[number as usize].clone());
        let halves = [number, other].map(|half| self.divide(half, records / 2.0, most));
        self.boxes.push(halves);
        Half::Divided(self.boxes.len() as u32 - 1)
    }
}
