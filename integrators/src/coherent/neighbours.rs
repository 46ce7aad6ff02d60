//! Which pixels see much the same as their neighbours.

use crate::film::Average;
use crate::measurement::Counters;
use rayon::prelude::*;
use sampling::bsdf::{Lobes, TransportMode};
use sampling::math::Spectrum;
use sampling::{Vec3, vec2};
use scenes::{Interaction, Scene};
use std::f32::consts::PI;

/// One minus the cosine between the normals of surfaces that are not alike: 14°.
const TURN: f32 = 0.03;
/// The squared sine of the angle at which one lies off the plane of another that is not like it: 8°.
const OFF_PLANE: f32 = 0.02;
/// The part of the larger albedo by which the other differs of surfaces that are not alike.
const ALBEDO: f32 = 0.2;
/// Neighbours whose weights add up to less are too few to be shared with.
const FEWEST: f32 = 1.0;

/// A diffuse surface that neither emits nor lets light through.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    p: Vec3,
    n: Vec3,
    albedo: Spectrum,
}

impl Seen {
    /// What a ray has met, if it is such a surface.
    fn of(scene: &Scene, hit: &Interaction) -> Option<Self> {
        let diffuse = Lobes::DIFFUSE_REFLECTION.contains(hit.bsdf.lobes()) && !hit.bsdf.lobes().is_empty();
        if !diffuse || hit.emitter.is_some() || scene.body_of(hit).is_some() {
            return None;
        }
        let n = hit.ns();
        Some(Self { p: hit.point.p, n, albedo: hit.eval(n, n, TransportMode::Radiance) * PI })
    }

    /// From 1 for the same to 0.
    fn likeness(&self, other: &Self) -> f32 {
        let left = |difference: f32, limit: f32| (1.0 - difference / limit).max(0.0);
        let d = other.p - self.p;
        let off = d.dot(self.n).abs().max(d.dot(other.n).abs());
        let off_plane = off * off / d.length_squared().max(f32::MIN_POSITIVE);
        let larger = self.albedo.max_component().max(other.albedo.max_component());
        let [a, b] = [self.albedo, other.albedo].map(Spectrum::to_array);
        let albedo = (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max) / larger.max(f32::MIN_POSITIVE);
        left(1.0 - self.n.dot(other.n), TURN) * left(off_plane, OFF_PLANE) * left(albedo, ALBEDO)
    }
}

/// What pixels see, and their weights in one another's averages.
pub(super) struct Neighbours {
    width: u32,
    height: u32,
    radius: u32,
    /// By pixel; `None` where it shares no numbers.
    seen: Vec<Option<Seen>>,
    /// One over the sum of the unnormalised weights at a pixel.
    scales: Vec<f32>,
    /// Work done to find them.
    pub work: Counters,
}

impl Neighbours {
    /// Bytes for each pixel, with those for a corner of it while neighbours are found.
    pub const BYTES: u64 = (2 * size_of::<Option<Seen>>() + size_of::<f32>()) as u64;

    /// No pixel shares numbers.
    pub fn none(scene: &Scene) -> Self {
        let (width, height) = (scene.camera.width(), scene.camera.height());
        let (seen, scales) = (vec![None; width as usize * height as usize], Vec::new());
        Self { width, height, radius: 0, seen, scales, work: Counters::default() }
    }

    /// Looks at every pixel of the image.
    pub fn find(scene: &Scene, radius: u32) -> Self {
        let mut all = Self { radius, ..Self::none(scene) };
        let (width, pixels) = (all.width, all.seen.len());
        let corners = Corners::look(scene);
        all.work.closest = corners.seen.len() as u64;
        let at = |i: usize| ((i % width as usize) as u32, (i / width as usize) as u32);
        // What a filter reaches is the pixel's, too.
        let reach = (scene.camera.filter().radius() - 0.5).ceil() as u32;
        all.seen.par_iter_mut().enumerate().for_each(|(i, seen)| *seen = corners.pixel(at(i), reach));
        drop(corners);
        let sums = |all: &Self| (0..pixels).into_par_iter().map(|i| all.sum(at(i))).collect::<Vec<f32>>();
        let alone: Vec<bool> = sums(&all).iter().map(|&sum| sum < 1.0 + FEWEST).collect();
        all.seen.iter_mut().zip(&alone).filter(|(_, alone)| **alone).for_each(|(seen, _)| *seen = None);
        all.scales = sums(&all).iter().map(|sum| 1.0 / sum).collect();
        all
    }

    fn seen(&self, (x, y): (u32, u32)) -> Option<&Seen> {
        self.seen[y as usize * self.width as usize + x as usize].as_ref()
    }

    /// The sum of the unnormalised weights at a pixel; 0 where it shares no numbers.
    fn sum(&self, at: (u32, u32)) -> f32 {
        let Some(seen) = self.seen(at) else { return 0.0 };
        let around = |i: u32, size: u32| i.saturating_sub(self.radius)..(i + self.radius + 1).min(size);
        let pixels = around(at.1, self.height).flat_map(|y| around(at.0, self.width).map(move |x| (x, y)));
        pixels.map(|of| self.seen(of).map_or(0.0, |other| self.near(at, of) * seen.likeness(other))).sum()
    }

    /// The weight that the distance of two pixels leaves.
    fn near(&self, at: (u32, u32), of: (u32, u32)) -> f32 {
        let squared = |a: u32, b: u32| a.abs_diff(b).pow(2) as f32;
        let reach = (self.radius + 1) as f32;
        let left = 1.0 - (squared(at.0, of.0) + squared(at.1, of.1)) / (reach * reach);
        left.max(0.0).powi(2)
    }
}

impl Average for Neighbours {
    fn reach(&self) -> u32 {
        self.radius
    }

    #[inline]
    fn shares(&self, pixel: (u32, u32)) -> bool {
        self.seen(pixel).is_some()
    }

    #[inline]
    fn weight(&self, at: (u32, u32), of: (u32, u32)) -> f64 {
        let (Some(a), Some(b)) = (self.seen(at), self.seen(of)) else { return 0.0 };
        let scale = self.scales[at.1 as usize * self.width as usize + at.0 as usize];
        f64::from(self.near(at, of) * a.likeness(b)) * f64::from(scale)
    }
}

/// What is seen at the corners of pixels: a straight edge that crosses a pixel has a corner of it on its other side.
struct Corners {
    width: u32,
    height: u32,
    seen: Vec<Option<Seen>>,
}

impl Corners {
    fn look(scene: &Scene) -> Self {
        let (width, height) = (scene.camera.width(), scene.camera.height());
        let columns = width as usize + 1;
        let look = |i: usize| {
            let raster = vec2((i % columns) as f32, (i / columns) as f32);
            // By reference: an interaction is large.
            match &scene.intersect(&scene.camera.sample_we(raster, vec2(0.5, 0.5)).ray) {
                Some(hit) => Seen::of(scene, hit),
                None => None,
            }
        };
        let seen = (0..columns * (height as usize + 1)).into_par_iter().map(look).collect();
        Self { width, height, seen }
    }

    /// What a pixel sees, if it is the same surface at all of its corners and those so many pixels further out.
    fn pixel(&self, (x, y): (u32, u32), further: u32) -> Option<Seen> {
        let first = |i: u32| i.saturating_sub(further);
        let rows = first(y)..=(y + 1 + further).min(self.height);
        let corners = rows.flat_map(|y| {
            let row = y as usize * (self.width as usize + 1);
            let columns = first(x) as usize..=(x + 1 + further).min(self.width) as usize;
            self.seen[row + *columns.start()..=row + *columns.end()].iter()
        });
        let (mut count, mut sum) = (0.0, Seen::default());
        let one = self.seen[y as usize * (self.width as usize + 1) + x as usize]?;
        for corner in corners {
            let corner = corner.as_ref().filter(|corner| corner.likeness(&one) > 0.0)?;
            count += 1.0;
            sum = Seen { p: sum.p + corner.p, n: sum.n + corner.n, albedo: sum.albedo + corner.albedo };
        }
        Some(Seen { p: sum.p / count, n: sum.n.normalize(), albedo: sum.albedo / count })
    }
}
