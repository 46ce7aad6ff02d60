//! Photons: the vertices of the light subpaths of one iteration, found by where they are.
//!
//! An iteration traces one light subpath for every pixel and keeps its vertices at surfaces that scatter by other than delta
//! lobes. They lie in a grid of cells twice as wide as the radius, so that all within the radius of a point lie in 8 cells; cells
//! are found by a hash \[Teschner03\] and their photons put together by counting, in the order of the subpaths. So sums over them
//! have the same bits for any number of threads.
//!
//! The radius falls from iteration to iteration, `r_i = r_1 i^((α−1)/2)`, slowly enough for the variance to vanish and fast enough for
//! the bias to \[Knaus11; Georgiev12\].

use crate::bdpt::{Bdpt, trace_light};
use crate::connect::{LightEnd, Strategies};
use crate::integrator::Replicate;
use crate::measurement::Counters;
use crate::request::Request;
use crate::roulette::SubpathRoulette;
use crate::scratch::Scratch;
use crate::trail::Share;
use crate::vertex::{PathVertex, Site};
use rayon::prelude::*;
use sampling::Vec3;
use sampling::bsdf::Lobes;
use sampling::fault;
use sampling::sampler::{Sampler, Subpath};
use scenes::{EmitterId, Scene};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The first radius, as a part of that of the scene's bounding sphere: between 10⁻⁶, below which positions are too coarse to be near one
/// another, and 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Radius(f64);

/// The exponent α of the radius' fall, between 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Alpha(f64);

impl Default for Radius {
    fn default() -> Self {
        Self(0.003)
    }
}

impl Default for Alpha {
    fn default() -> Self {
        Self(0.75)
    }
}

impl TryFrom<f64> for Radius {
    type Error = String;
    fn try_from(radius: f64) -> Result<Self, String> {
        if (1e-6..=1.0).contains(&radius) {
            return Ok(Self(radius));
        }
        Err(format!(
            "within {radius} times the scene's radius no vertices can be merged; give a number from 0.000001 to 1, such as 0.003, or use \
             bdpt, which merges none"
        ))
    }
}

impl TryFrom<f64> for Alpha {
    type Error = String;
    fn try_from(alpha: f64) -> Result<Self, String> {
        if alpha > 0.0 && alpha < 1.0 {
            return Ok(Self(alpha));
        }
        Err(format!(
            "{alpha} lies outside 0 to 1: at 1 and above the radius never falls and the bias stays, at 0 and below it falls so fast that the \
             variance stays; give a number between, such as 0.75"
        ))
    }
}

impl From<Radius> for f64 {
    fn from(radius: Radius) -> Self {
        radius.0
    }
}

impl From<Alpha> for f64 {
    fn from(alpha: Alpha) -> Self {
        alpha.0
    }
}

/// The radius of every iteration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Schedule {
    /// That of the first.
    pub radius: Radius,
    /// How it falls.
    pub alpha: Alpha,
}

impl Schedule {
    /// The radius \[m\] of an iteration, counted from 0.
    pub fn radius(&self, scene: &Scene, number: u32) -> f32 {
        let number = fault!("radius_does_not_fall", number, 0);
        let fall = (f64::from(number) + 1.0).powf((self.alpha.0 - 1.0) / 2.0);
        (self.radius.0 * f64::from(scene.bounds.radius) * fall) as f32
    }
}

/// A vertex of a light subpath.
#[derive(Clone, Debug)]
pub struct Photon {
    /// Where.
    pub p: Vec3,
    /// Towards where the light came from.
    pub wo: Vec3,
    /// |wo·ng|, of its own surface; positive.
    pub slant: f32,
    /// The subpath's weight: flux \[W\], of all of its iteration's subpaths together.
    pub flux: [f32; 3],
    /// The vertices of the subpath up to this one.
    pub vertices: u16,
    /// Whether no walk from the camera can meet the emitter, nor any surface on the way have a diffuse lobe that scattered.
    pub bare: bool,
    /// Whose light it is.
    pub emitter: EmitterId,
    /// The number of the subpath, which is that of its pixel.
    path: u32,
    /// Its place among the shares of path classes.
    shares: (u32, u32),
    /// What weights need.
    pub end: LightEnd,
}

/// The photons of a row of pixels, in the order in which they were made.
#[derive(Clone, Debug, Default)]
struct Row {
    photons: Vec<Photon>,
    shares: Vec<Share>,
    scratch: Scratch,
}

/// The photons of an iteration.
#[derive(Clone, Debug, Default)]
pub struct Photons {
    rows: Vec<Row>,
    sorted: Vec<Photon>,
    shares: Vec<Share>,
    /// Where the photons of each bucket begin; and where the last end.
    starts: Vec<u32>,
    number: u32,
    paths: u32,
    radius: f32,
    origin: Vec3,
}

impl Photons {
    /// Bytes that the photons of so many subpaths take; their number by the most scatterings that roulette leaves them on average.
    pub fn bytes(subpaths: u64, request: &Request, roulette: SubpathRoulette) -> u64 {
        // Survival of at most 0.95, which walks without a last order have, makes for 20 scatterings at the most.
        let most = match roulette {
            SubpathRoulette::Throughput => 20,
            SubpathRoulette::None | SubpathRoulette::Local => usize::MAX,
        };
        let each = request.last_order().map_or(20, |last| last.min(most)) as u64;
        subpaths * each * (2 * size_of::<Photon>() + 2 * size_of::<u32>()) as u64
    }

    /// Traces the light subpaths of an iteration, and sorts their vertices.
    pub fn trace(
        &mut self,
        (scene, request): (&Scene, &Request),
        settings: &Bdpt,
        schedule: &Schedule,
        replicate: &Replicate,
        number: u32,
    ) -> Counters {
        let (width, height) = (scene.camera.width(), scene.camera.height());
        (self.number, self.paths, self.radius) = (number, width * height, schedule.radius(scene, number));
        let strategies = Strategies { merging: self.merging(), ..settings.strategies(scene, request) };
        self.rows.resize_with(height as usize, Row::default);
        self.rows.par_iter_mut().enumerate().for_each(|(y, row)| {
            let mut sampler = Sampler::new(replicate.sampler, replicate.key, replicate.samples, (width, height));
            row.photons.clear();
            row.shares.clear();
            row.scratch.counters = Counters::default();
            for path in y as u32 * width..(y as u32 + 1) * width {
                sampler.start_sample(u64::from(path), number);
                row.trace(scene, request, &strategies, path, &mut sampler);
            }
        });
        self.sort(scene);
        let mut counters = Counters::default();
        self.rows.iter().for_each(|row| counters += row.scratch.counters);
        counters
    }

    /// η = N π r² \[m²\].
    pub fn merging(&self) -> f64 {
        f64::from(self.paths) * fault!("kernel_without_pi", std::f64::consts::PI, 1.0) * f64::from(self.radius).powi(2)
    }

    /// What makes of a photon's flux irradiance \[1/m²\].
    pub fn scale(&self) -> f32 {
        (1.0 / self.merging()) as f32
    }

    /// The photons within the radius of a point, in an order of their own.
    #[inline]
    pub fn near(&self, p: Vec3, mut visit: impl FnMut(&Photon)) {
        if self.sorted.is_empty() {
            return;
        }
        let lowest = self.cell(p - Vec3::splat(self.radius));
        for corner in 0..8 {
            let cell: [i32; 3] = std::array::from_fn(|axis| lowest[axis].wrapping_add(corner >> axis & 1));
            for photon in &self.sorted[self.bucket(self.hash(cell))] {
                // Other cells may be in the bucket.
                if photon.p.distance_squared(p) <= self.radius * self.radius && self.cell(photon.p) == cell {
                    visit(photon);
                }
            }
        }
    }

    /// The shares of path classes that a photon's subpath has, up to where it is.
    pub fn shares(&self, photon: &Photon) -> &[Share] {
        &self.shares[photon.shares.0 as usize..photon.shares.1 as usize]
    }

    /// Takes a sampler to where the subpath of a photon was traced.
    pub fn restart(&self, photon: &Photon, sampler: &mut Sampler) {
        sampler.start_sample(u64::from(photon.path), self.number);
    }

    /// The cell of a point, 2r wide.
    #[inline]
    fn cell(&self, p: Vec3) -> [i32; 3] {
        ((p - self.origin) / (2.0 * self.radius)).floor().to_array().map(|x| x as i32)
    }

    #[inline]
    fn hash(&self, [x, y, z]: [i32; 3]) -> usize {
        let mixed = (x as u32).wrapping_mul(73_856_093)
            ^ (y as u32).wrapping_mul(19_349_663)
            ^ (z as u32).wrapping_mul(83_492_791);
        mixed as usize & (self.starts.len() - 2)
    }

    #[inline]
    fn bucket(&self, hash: usize) -> Range<usize> {
        self.starts[hash] as usize..self.starts[hash + 1] as usize
    }

    /// Puts the photons of a bucket together: counts them, finds where each bucket ends, and fills it from there backwards.
    fn sort(&mut self, scene: &Scene) {
        self.origin = scene.bounds.center - Vec3::splat(scene.bounds.radius);
        let count: usize = self.rows.iter().map(|row| row.photons.len()).sum();
        // One entry more than a power of two, so that a hash is a mask.
        self.starts.clear();
        self.starts.resize(count.next_power_of_two() + 1, 0);
        let (mut places, mut shares) = (std::mem::take(&mut self.sorted), std::mem::take(&mut self.shares));
        shares.clear();
        for row in &mut self.rows {
            let before = shares.len() as u32;
            row.photons
                .iter_mut()
                .for_each(|photon| photon.shares = (photon.shares.0 + before, photon.shares.1 + before));
            shares.extend_from_slice(&row.shares);
        }
        self.shares = shares;
        for photon in self.rows.iter().flat_map(|row| &row.photons) {
            let hash = self.hash(self.cell(photon.p));
            self.starts[hash] += 1;
        }
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        places.clear();
        let first = self.rows.iter().find_map(|row| row.photons.first()).cloned();
        places.extend(first.into_iter().cycle().take(count));
        for photon in self.rows.iter().rev().flat_map(|row| row.photons.iter().rev()) {
            let hash = self.hash(self.cell(photon.p));
            self.starts[hash] -= 1;
            places[self.starts[hash] as usize].clone_from(photon);
        }
        self.sorted = places;
    }
}

impl Row {
    /// Traces one subpath.
    fn trace(&mut self, scene: &Scene, request: &Request, strategies: &Strategies, path: u32, sampler: &mut Sampler) {
        let Self { photons, shares, scratch } = self;
        scratch.light.clear();
        scratch.light_paths.clear();
        trace_light(scene, strategies, 0, sampler, scratch);
        let Some(subpath) = scratch.light_paths.first() else { return };
        let vertices = &scratch.light;
        let Site::Emitter(emitter, endpoint) = &vertices[0].site else { return };
        let classifier = request.parts().classifier();
        if let Some(classifier) = classifier {
            let trail = &mut scratch.trails.light;
            trail.clear();
            trail.follow(classifier, Subpath::Light, classifier.light_start(emitter.0 as usize), vertices);
        }
        let mut bare = endpoint.kind.is_delta();
        for (j, y) in vertices.iter().enumerate().skip(1) {
            let Site::Surface(hit) = &y.site else { return };
            let slant = y.wo.dot(hit.point.ng).abs();
            // Along the surface nothing arrives.
            if hit.is_connectable() && slant > 0.0 {
                let first = shares.len() as u32;
                if classifier.is_some() {
                    shares.extend_from_slice(scratch.trails.light.at(j));
                }
                photons.push(Photon {
                    p: y.at.p,
                    wo: y.wo,
                    slant,
                    flux: y.beta.to_array(),
                    vertices: u16::try_from(j + 1).unwrap_or(u16::MAX),
                    bare,
                    emitter: *emitter,
                    path,
                    shares: (first, shares.len() as u32),
                    end: strategies.light_end(vertices, j, subpath.next_event),
                });
            }
            bare &= y.delta || !has_diffuse(y);
        }
    }
}

fn has_diffuse(vertex: &PathVertex) -> bool {
    matches!(&vertex.site, Site::Surface(hit) if hit.bsdf.lobes().intersects(Lobes::DIFFUSE))
}
