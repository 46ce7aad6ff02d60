//! Agreement of methods: every pair of them in a scene, order by order, on the image and on blocks of it.

use super::{Budget, Family, Rendered, is_night, measure, method_with};
use sampling::bsdf::Lobes;
use sampling::sampler::SamplerKind;
use sampling::vec2;
use scenes::Scene;
use serde_json::{Value, json};

/// Blocks in a row of an image.
pub const COLUMNS: usize = 4;

/// A method that takes part.
pub struct Entry {
    label: &'static str,
    name: &'static str,
    settings: Value,
    samples: u32,
    by_night: u32,
    last: usize,
    decides: bool,
}

impl Entry {
    /// A method of the list with its default settings and 64 times so many stratified samples per pixel.
    pub fn new(name: &'static str, samples: u32) -> Self {
        Self { label: name, name, settings: json!({}), samples, by_night: 1, last: usize::MAX, decides: true }
    }

    /// The same with settings of its own, and what to call it then.
    pub fn with(self, label: &'static str, settings: Value) -> Self {
        Self { label, settings, ..self }
    }

    /// The same without roulette, if it plays any: roulette triples the noise of high orders, and has a test of its own.
    pub fn without_roulette(self) -> Self {
        match self.name {
            "direct" => self,
            _ => Self { settings: json!({"roulette": "none"}), ..self },
        }
    }

    /// The same with so many times more samples where `NEUMANN_TEST_SCALE` asks for more than every day.
    pub fn by_night(self, factor: u32) -> Self {
        Self { by_night: factor, ..self }
    }

    /// The same, compared up to this order alone: beyond, it is too noisy to say anything.
    pub fn up_to(self, last: usize) -> Self {
        Self { last, ..self }
    }

    fn samples(&self) -> u32 {
        if is_night() { self.samples * self.by_night } else { self.samples }
    }

    /// The same, of which nothing is asked but that it does not differ significantly: its variance is infinite, so that some
    /// seeds show a contribution which leaves everything open.
    pub fn of_infinite_variance(self) -> Self {
        Self { decides: false, ..self }
    }
}

/// Fails unless all entries agree, on the paths that both of a pair carry, and at least the share `conclusive` of the
/// comparisons of blocks decides something.
pub fn agree(title: &str, scene: &Scene, max_order: usize, entries: &[Entry], conclusive: f64) {
    let rendered: Vec<(&Entry, usize, Rendered)> = entries
        .iter()
        .map(|entry| {
            let method = method_with(entry.name, entry.settings.clone());
            let last = *method.orders(max_order).end().min(&entry.last);
            let budget = Budget { sampler: SamplerKind::Stratified, ..Budget::samples(entry.samples()) };
            (entry, last, measure(scene, method.as_ref(), entry.label, budget.up_to(last)))
        })
        .collect();
    let mut family = Family::new(title);
    for (i, (a, last_a, rendered_a)) in rendered.iter().enumerate() {
        for (b, last_b, rendered_b) in &rendered[..i] {
            let pixels = pixels_of_both(scene, a, b);
            let blocks = blocks_of(rendered_a, &pixels);
            for order in 0..=*last_a.min(last_b) {
                let label = format!("{} and {} order {order}", a.label, b.label);
                let pair = |pixels: &[usize]| [rendered_a, rendered_b].map(|r| r.over(order, pixels));
                let decides = a.decides && b.decides;
                let [of_a, of_b] = pair(&pixels);
                let add = if decides { Family::image } else { Family::spare };
                add(&mut family, label.clone(), of_a, of_b);
                let add = if decides { Family::block } else { Family::spare };
                for (block, pixels) in blocks.iter().enumerate() {
                    let [of_a, of_b] = pair(pixels);
                    add(&mut family, format!("{label} block {block}"), of_a, of_b);
                }
            }
        }
    }
    family.finish(conclusive);
}

/// The blocks of an image, without the pixels that are not among `pixels`.
fn blocks_of(rendered: &Rendered, pixels: &[usize]) -> Vec<Vec<usize>> {
    let mut blocks = rendered.blocks(COLUMNS);
    blocks.iter_mut().for_each(|block| block.retain(|p| pixels.contains(p)));
    blocks.retain(|block| !block.is_empty());
    blocks
}

/// The pixels whose light both methods carry. Light tracing loses the paths whose last scattering is by a delta lobe.
fn pixels_of_both(scene: &Scene, a: &Entry, b: &Entry) -> Vec<usize> {
    if [a, b].iter().any(|entry| entry.name == "light") {
        return pixels_without_delta(scene);
    }
    (0..(scene.camera.width() * scene.camera.height()) as usize).collect()
}

/// The pixels in which every camera ray first meets a surface without delta lobes, or nothing.
pub fn pixels_without_delta(scene: &Scene) -> Vec<usize> {
    const RAYS: usize = 32;
    let (width, height) = (scene.camera.width() as usize, scene.camera.height() as usize);
    let meets_delta = |pixel: usize| {
        (0..RAYS * RAYS).any(|i| {
            let within = vec2((i % RAYS) as f32, (i / RAYS) as f32) / (RAYS as f32 - 0.5);
            let corner = vec2((pixel % width) as f32, (pixel / width) as f32);
            // A sequence that covers a lens evenly, whichever part of the pixels is looked at.
            let lens = vec2(i as f32 * 0.754_877_7, i as f32 * 0.569_840_3).fract();
            let hit = scene.intersect(&scene.camera.sample_we(corner + within, lens).ray);
            hit.is_some_and(|hit| hit.bsdf.lobes().intersects(Lobes::DELTA))
        })
    };
    (0..width * height).filter(|&pixel| !(scene.needs.delta_lobes && meets_delta(pixel))).collect()
}
