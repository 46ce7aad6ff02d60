//! What the laws share: rendering small images, and families of comparisons with a stated false-alarm rate.

mod contributions;
mod densities;
mod estimate;
mod family;
mod pairs;
mod relief;
mod room;
mod sky;
mod truth;

pub use contributions::contributions;
pub use densities::PathDensities;
pub use estimate::Estimate;
pub use family::{Comparison, Family, POWER};
pub use pairs::{COLUMNS, Entry, agree, pixels_without_delta};
pub use relief::{bumps, in_relief};
pub use room::{block, furnished, room};
pub use sky::sky;
pub use truth::{GAUSS, Truth};

use glam::DVec3;
use integrators::{Integrator, Measurement, Methods, Orders, Render, RenderSettings};
use sampling::Vec3;
use sampling::bsdf::{Bsdf, Lambert};
use sampling::math::Spectrum;
use sampling::sampler::{Role, SamplerKind};
use scenes::{CameraSettings, Emission, LoadOptions, Scene, Skip, Texture};
use serde_json::{Value, json};

/// The methods of the list.
pub const ALL: [&str; 4] = ["direct", "path", "light", "bdpt"];

/// The same, and the composite that [`plain`] makes.
pub const ALL_AND_RUNS: [&str; 5] = ["direct", "path", "light", "bdpt", "composite"];

/// How much work the statistical tests do, relative to what fits into an everyday run: `NEUMANN_TEST_SCALE`, default 1.
pub fn scale() -> f64 {
    std::env::var("NEUMANN_TEST_SCALE").ok().and_then(|s| s.parse().ok()).unwrap_or(1.0)
}

/// The seed of all statistical tests: `NEUMANN_TEST_SEED`, default 1.
pub fn seed() -> u64 {
    std::env::var("NEUMANN_TEST_SEED").ok().and_then(|s| s.parse().ok()).unwrap_or(1)
}

/// Whether there is more time than every day.
pub fn is_night() -> bool {
    scale() > 1.0
}

/// Whether a law that takes long, and has a shorter one beside it, is not asked now; says so.
pub fn left_to_the_night() -> bool {
    if !is_night() {
        println!("skipped: it takes long; asked where NEUMANN_TEST_SCALE is more than 1, as in .ci/nightly");
    }
    !is_night()
}

/// Whether the seed is that of every day, and the budget no smaller.
pub fn is_everyday() -> bool {
    seed() == 1 && scale() >= 1.0
}

/// A method of the list with its default settings.
pub fn method(name: &str) -> Box<dyn Integrator> {
    method_with(name, json!({}))
}

/// A method of the list.
pub fn method_with(name: &str, settings: Value) -> Box<dyn Integrator> {
    Methods::standard().build(name, &settings).unwrap()
}

/// A method of the list without roulette, which makes high orders rare. A composite has [`divided`] runs.
pub fn plain(name: &str) -> Box<dyn Integrator> {
    let settings = match name {
        "direct" | "mmlt" => json!({}),
        "composite" => divided("2-8"),
        _ => json!({"roulette": "none"}),
    };
    method_with(name, settings)
}

/// A composite without roulette whose orders 0 and 1 are left to several methods, in regions with samples that differ by a factor of six, and the
/// `rest` to `bdpt`.
pub fn divided(rest: &str) -> Value {
    let none = json!({"roulette": "none"});
    json!({"runs": [
        {"method": "path", "orders": "1", "share": 1.0, "regions": [[4, 1, 0], [1, 0, 2]], "settings": none},
        {"method": "light", "orders": "0", "share": 1.0, "settings": none},
        {"method": "direct", "orders": "1", "share": 0.5, "regions": [[0, 0, 1], [0, 6, 0]]},
        {"method": "bdpt", "orders": rest, "share": 2.0, "settings": none},
    ]})
}

/// A built-in scene at a small size.
pub fn builtin(name: &str, size: u32) -> Scene {
    builtin_with(name, size, Skip::Unneeded)
}

/// So many samples, or as many as a method needs that looks ahead by a pilot.
pub fn with_pilot(name: &str, samples: u32) -> u32 {
    if name.starts_with("adaptive") { samples.max(16) } else { samples }
}

/// A built-in scene at a small size, its skips on or off.
pub fn builtin_with(name: &str, size: u32, skip: Skip) -> Scene {
    scenes::load(name, &LoadOptions { size: Some((size, size)), skip }).unwrap()
}

/// A camera with a square film.
pub fn camera(position: DVec3, target: DVec3, fov: f64, size: u32) -> CameraSettings {
    let up = if (target - position).normalize().y.abs() > 0.99 { DVec3::X } else { DVec3::Y };
    CameraSettings { up, ..CameraSettings::pinhole(position, target, fov, (size, size)) }
}

/// A grey diffuse material.
pub fn lambert(albedo: f32) -> Bsdf {
    Lambert { albedo: Spectrum::splat(albedo) }.into()
}

/// The same grey radiance everywhere, from the front alone.
pub fn shining(radiance: f32) -> Emission {
    Emission { radiance: Texture::Constant(Spectrum::splat(radiance)), two_sided: false }
}

/// What a test renders.
#[derive(Clone, Copy)]
pub struct Budget {
    /// Orders 0 to this.
    pub max_order: usize,
    /// Samples per pixel of each replicate, before [`scale`].
    pub samples: u32,
    /// Replicates.
    pub replicates: u32,
    /// Whether the tail is estimated.
    pub tail: bool,
    /// Where random numbers come from.
    pub sampler: SamplerKind,
}

impl Budget {
    /// Orders 0 to 8 without tail, with 64 times so many independent samples per pixel. They are divided among many
    /// replicates, because the law of comparisons needs to know the replicates' skewness.
    pub fn samples(samples: u32) -> Self {
        let replicates = 256;
        let samples = (samples * 64).div_ceil(replicates);
        Self { max_order: 8, samples, replicates, tail: false, sampler: SamplerKind::Independent }
    }

    /// The same up to another order.
    pub fn up_to(self, max_order: usize) -> Self {
        Self { max_order, ..self }
    }
}

/// What a test measured: the measurement, and the channel mean of every pixel of every replicate.
pub struct Rendered {
    /// The measurement.
    pub measurement: Measurement,
    /// `[replicate][layer][pixel]`.
    grey: Vec<f64>,
}

impl Rendered {
    /// The mean over some pixels of a layer, whatever the correlation between them.
    pub fn over(&self, layer: usize, pixels: &[usize]) -> Estimate {
        Estimate::of(&self.replicates_over(layer, pixels))
    }

    /// The same of every replicate.
    pub fn replicates_over(&self, layer: usize, pixels: &[usize]) -> Vec<f64> {
        let (all, layers) = (self.measurement.pixels(), self.measurement.layers.len());
        let replicates = self.grey.chunks(all * layers).map(|replicate| {
            let image = &replicate[layer * all..(layer + 1) * all];
            pixels.iter().map(|&p| image[p]).sum::<f64>() / pixels.len() as f64
        });
        replicates.collect()
    }

    /// The mean over some pixels of the sum of all layers.
    pub fn total(&self, pixels: &[usize]) -> Estimate {
        let all = self.measurement.pixels();
        let replicates = self.grey.chunks(all * self.measurement.layers.len()).map(|replicate| {
            let sum = |p: &usize| replicate.iter().skip(*p).step_by(all).sum::<f64>();
            pixels.iter().map(sum).sum::<f64>() / pixels.len() as f64
        });
        Estimate::of(&replicates.collect::<Vec<_>>())
    }

    /// The mean over all pixels of a layer.
    pub fn image(&self, layer: usize) -> Estimate {
        self.over(layer, &self.all())
    }

    /// All pixels.
    pub fn all(&self) -> Vec<usize> {
        (0..self.measurement.pixels()).collect()
    }

    /// The image divided into `columns` × `columns` blocks of pixels.
    pub fn blocks(&self, columns: usize) -> Vec<Vec<usize>> {
        let (width, height) = (self.measurement.width as usize, self.measurement.height as usize);
        let mut blocks = vec![Vec::new(); columns * columns];
        for pixel in 0..self.measurement.pixels() {
            let (column, row) = (pixel % width * columns / width, pixel / width * columns / height);
            blocks[row * columns + column].push(pixel);
        }
        blocks.retain(|pixels| !pixels.is_empty());
        blocks
    }
}

/// Renders. `instance` keys the random numbers, and [`seed`].
pub fn measure(scene: &Scene, method: &dyn Integrator, instance: &str, budget: Budget) -> Rendered {
    measure_seeded(scene, method, instance, budget, seed())
}

/// Renders. `instance` and `seed` key the random numbers.
pub fn measure_seeded(scene: &Scene, method: &dyn Integrator, instance: &str, budget: Budget, seed: u64) -> Rendered {
    let settings = RenderSettings {
        orders: Orders::up_to(budget.max_order),
        tail: budget.tail,
        samples_per_replicate: ((budget.samples as f64 * scale()) as u32).max(1),
        seed,
        sampler: budget.sampler,
        instance: instance.to_owned(),
        role: Role::Estimate,
    };
    let layers = method.orders(budget.max_order).count() + budget.tail as usize;
    let pixels = scene.camera.width() as usize * scene.camera.height() as usize;
    let mut render = Render::new(scene, method, settings).unwrap();
    let mut values = Vec::with_capacity(budget.replicates as usize * layers * pixels);
    for _ in 0..budget.replicates {
        render.run_replicate(&|_| {});
        let places = (0..layers).flat_map(|layer| (0..pixels).map(move |pixel| (layer, pixel)));
        values.extend(places.map(|(layer, pixel)| grey(render.last_replicate(layer, pixel))));
    }
    let measurement = render.finish();
    let invalid = &measurement.invalid;
    assert!(invalid.iter().all(|&n| n == 0), "{instance}: non-finite contributions by layer: {invalid:?}");
    Rendered { measurement, grey: values }
}

/// The closed form of a built-in scene: radiance of an order that a camera ray of direction `d` brings from `p`.
pub fn exact(scene: &Scene, order: usize, p: Vec3, d: Vec3) -> [f64; 3] {
    scenes::builtin::exact(&scene.name, order, p, -d).expect("a scene with a closed form").to_array().map(f64::from)
}

/// Mean over channels.
pub fn grey(x: [f64; 3]) -> f64 {
    x.iter().sum::<f64>() / 3.0
}
