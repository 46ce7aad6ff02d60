//! Points of the primary sample space, and what they contribute.

use super::Explored;
use crate::contribution::{Contribution, PathView, Sink, Technique, Wants};
use crate::film::PixelSink;
use crate::integrator::Pixel;
use crate::request::Request;
use crate::scratch::Scratch;
use crate::trail::ClassShare;
use sampling::math::Spectrum;
use sampling::sampler::{Purpose, Sampler};
use sampling::{Vec2, vec2};
use scenes::{EmitterId, Scene};

/// A method's samples as a function of the numbers that they ask for.
pub(super) struct Space<'a, E> {
    pub explored: E,
    pub scene: &'a Scene,
    pub request: &'a Request,
}

impl<E: Explored> Space<'_, E> {
    /// Looks at the sample that the sampler has turned to.
    pub fn look<const CLASSES: bool>(
        &self,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        point: &mut Point<'_, CLASSES>,
    ) {
        let Self { explored, scene, request } = self;
        point.clear();
        let camera = &scene.camera;
        let size = vec2(camera.width() as f32, camera.height() as f32);
        let place = sampler.get_2d(Purpose::Film) * size;
        let first = place.floor().min(size - 1.0);
        let within = (place - first).min(Vec2::splat(1.0_f32.next_down()));
        let (pixel, weight) = Pixel::sample(first.x as u32, first.y as u32, camera.filter(), within);
        let factor = explored.explore(scene, request, pixel, sampler, scratch, point);
        (point.pixel, point.weight, point.factor) = (pixel, weight, factor);
        point.size *= f64::from(factor);
    }
}

/// A contribution without its path.
#[derive(Clone, Copy, Debug)]
struct Kept {
    raster: Vec2,
    technique: Technique,
    value: Spectrum,
    weight: f64,
    emitter: Option<EmitterId>,
    /// Where its classes end.
    classes: usize,
}

/// What a point contributes; with `CLASSES`, of which path classes.
#[derive(Clone, Debug)]
pub(super) struct Point<'r, const CLASSES: bool> {
    request: &'r Request,
    pixel: Pixel,
    /// What the pixel's filter gives it.
    weight: f32,
    /// How many times it is to be counted if points are independent.
    factor: f32,
    contributions: Vec<Kept>,
    classes: Vec<ClassShare>,
    /// I: the sum of all contributions' mean channels.
    pub size: f64,
    /// How many times it counts.
    pub share: f64,
    /// Contributions that are not finite, by layer, of all points looked at here.
    pub invalid: Vec<u64>,
}

impl<'r, const CLASSES: bool> Point<'r, CLASSES> {
    /// One that contributes nothing.
    pub fn new(request: &'r Request) -> Self {
        Self {
            request,
            pixel: Pixel { x: 0, y: 0, raster: Vec2::ZERO },
            weight: 0.0,
            factor: 0.0,
            contributions: Vec::new(),
            classes: Vec::new(),
            size: 0.0,
            share: 0.0,
            invalid: vec![0; request.layers().len()],
        }
    }

    fn clear(&mut self) {
        self.contributions.clear();
        self.classes.clear();
        (self.size, self.share) = (0.0, 0.0);
    }

    /// Adds what is added to its size, layer by layer.
    pub fn add_sizes(&self, layers: &mut [f64]) {
        for kept in &self.contributions {
            if let Some(layer) = self.request.layer(kept.technique.order()) {
                layers[layer] += f64::from(self.factor) * size(kept.value * kept.weight as f32);
            }
        }
    }

    /// Hands over what it contributes, by its share.
    pub fn give<S: PixelSink>(&self, out: &mut S) {
        if self.share == 0.0 || self.contributions.is_empty() {
            return;
        }
        out.start_point(self.pixel, self.weight, (self.share * f64::from(self.factor)) as f32);
        let mut first = 0;
        for &Kept { raster, technique, value, weight, emitter, classes } in &self.contributions {
            let of_path = &self.classes[first..classes];
            first = classes;
            let path = PathView::default();
            out.add(Contribution { raster, technique, value, weight, path, emitter, classes: of_path });
        }
    }
}

/// What a contribution adds to a point's size: positive where any channel is.
#[inline]
fn size(value: Spectrum) -> f64 {
    value.to_array().iter().map(|x| f64::from(x.abs())).sum::<f64>() / 3.0
}

impl<const CLASSES: bool> Sink for Point<'_, CLASSES> {
    const WANTS: Wants = Wants { vertices: false, classes: CLASSES };

    fn add(&mut self, c: Contribution) {
        let Some(layer) = self.request.layer(c.technique.order()) else { return };
        // As the film has it.
        let weighted = c.value * c.weight as f32;
        if !weighted.is_finite() {
            self.invalid[layer] += 1;
            return;
        }
        self.size += size(weighted);
        if CLASSES {
            self.classes.extend_from_slice(c.classes);
        }
        let Contribution { raster, technique, value, weight, emitter, .. } = c;
        self.contributions.push(Kept { raster, technique, value, weight, emitter, classes: self.classes.len() });
    }
}
