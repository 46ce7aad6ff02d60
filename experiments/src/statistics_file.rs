//! `--stats`: what a render measured, as JSON.

use crate::choice::Choice;
use crate::machine::{VERSION, peak_memory};
use crate::truncation::Truncation;
use integrators::{Bias, Layer, Measurement, Part, Quantity};
use serde::Serialize;
use serde_json::Value;

/// The file, key by key; its form is a contract with other people's scripts.
#[derive(Debug, Serialize)]
pub struct Statistics {
    neumann: &'static str,
    scene: String,
    method: String,
    settings: Value,
    width: u32,
    height: u32,
    /// First column, first row, width, height of the part of the image that was rendered; `null` for all of it.
    crop: Option<[u32; 4]>,
    max_order: usize,
    spp: u64,
    replicates: u32,
    seed: u64,
    sampler: String,
    filter: String,
    threads: usize,
    seconds: Seconds,
    rays: Rays,
    camera_paths: u64,
    light_paths: u64,
    connections: u64,
    skipped: Vec<&'static str>,
    invalid: Vec<u64>,
    orders: Vec<Entry>,
    total: Estimate,
    /// What the image was taken apart into.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    parts: Vec<PartEntry>,
    missing_light: Vec<String>,
    bias: Bias,
    /// How the last order was chosen; absent where it was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    truncation: Option<Truncation>,
    /// How the runs of a composite were chosen; absent where they were given.
    #[serde(skip_serializing_if = "Option::is_none")]
    choice: Option<Choice>,
    peak_memory_bytes: Option<u64>,
}

/// Wall time \[s\].
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    /// Reading the scene.
    pub load: f64,
    /// Building what rays are traced in.
    pub build: f64,
    /// Transport alone.
    pub render: f64,
    /// Writing the image.
    pub write: f64,
}

#[derive(Debug, Serialize)]
struct Rays {
    closest: u64,
    shadow: u64,
}

#[derive(Debug, Serialize)]
struct Entry {
    order: Value,
    #[serde(flatten)]
    estimate: Estimate,
}

#[derive(Debug, Serialize)]
struct PartEntry {
    /// Its name in the image file.
    layer: String,
    #[serde(flatten)]
    estimate: Estimate,
}

/// Image mean, image mean of the variance of one sample, and the standard error of the image mean across replicates.
#[derive(Debug, Serialize)]
struct Estimate {
    mean: [f64; 3],
    variance: Option<[f64; 3]>,
    mean_se: Option<[f64; 3]>,
}

/// What is known of a render besides its measurement.
#[derive(Clone, Debug)]
pub struct Context {
    /// The scene's name.
    pub scene: String,
    /// The method's name.
    pub method: String,
    /// All of its settings.
    pub settings: Value,
    /// The seed.
    pub seed: u64,
    /// The sampler's name.
    pub sampler: String,
    /// The pixel filter's name.
    pub filter: String,
    /// Threads that rendered.
    pub threads: usize,
    /// What the scene let the render leave out.
    pub skipped: Vec<&'static str>,
    /// The light that the method loses.
    pub missing_light: Vec<String>,
    /// How the mean of the method's images stands to the truth.
    pub bias: Bias,
    /// How the last order was chosen, if it was.
    pub truncation: Option<Truncation>,
    /// How the runs of its composite were chosen, if they were.
    pub choice: Option<Choice>,
}

impl Statistics {
    /// Gathers everything.
    pub fn new(m: &Measurement, context: Context, seconds: Seconds) -> Self {
        let of_sample = |variance: [f64; 3]| variance.map(|v| v * f64::from(m.samples_per_replicate));
        let estimate = |i: usize| Estimate {
            mean: m.image_mean(i),
            variance: m.image_variance(i).map(of_sample),
            mean_se: m.image_mean_error(i),
        };
        let entry = |(i, &layer): (usize, &Layer)| Entry {
            order: match layer {
                Layer::Order(k) => Value::from(k),
                Layer::Tail => Value::from("tail"),
            },
            estimate: estimate(i),
        };
        let part = |(i, part): (usize, &Part)| {
            // The sums that weights are made of are no light.
            let is_light = !matches!(part, Part::Strategy { quantity: Quantity::Weights, .. });
            is_light.then(|| PartEntry { layer: part.name(m.max_order), estimate: estimate(i) })
        };
        Self {
            neumann: VERSION,
            scene: context.scene,
            method: context.method,
            settings: context.settings,
            width: m.width,
            height: m.height,
            crop: (m.image_size != (m.width, m.height)).then_some([m.origin.0, m.origin.1, m.width, m.height]),
            max_order: m.max_order,
            spp: m.samples(),
            replicates: m.replicates,
            seed: context.seed,
            sampler: context.sampler,
            filter: context.filter,
            threads: context.threads,
            seconds,
            rays: Rays { closest: m.counters.closest, shadow: m.counters.shadow },
            camera_paths: m.counters.camera_paths,
            light_paths: m.counters.light_paths,
            connections: m.counters.connections,
            skipped: context.skipped,
            invalid: m.invalid.clone(),
            orders: m.layers.iter().enumerate().map(entry).collect(),
            total: Estimate {
                mean: m.total_image_mean(),
                variance: m.total_variance.map(of_sample),
                mean_se: m.total_image_mean_error(),
            },
            parts: m.parts().filter_map(part).collect(),
            missing_light: context.missing_light,
            bias: context.bias,
            truncation: context.truncation,
            choice: context.choice,
            peak_memory_bytes: peak_memory(),
        }
    }

    /// As a JSON file.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}
