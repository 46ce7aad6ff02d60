//! What the laws share: rendering small images, and families of comparisons with a stated false-alarm rate.

use integrators::{Integrator, Measurement, Methods, Orders, Render, RenderSettings};
use sampling::Vec3;
use sampling::sampler::{Role, SamplerKind};
use scenes::{LoadOptions, Scene, Skip};
use serde_json::{Value, json};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// The probability with which a family of comparisons raises a false alarm, if all its null hypotheses hold.
pub const FALSE_ALARM_RATE: f64 = 1e-3;

/// How much work the statistical tests do, relative to what fits into an everyday run: `NEUMANN_TEST_SCALE`, default 1.
pub fn scale() -> f64 {
    std::env::var("NEUMANN_TEST_SCALE").ok().and_then(|s| s.parse().ok()).unwrap_or(1.0)
}

/// The seed of all statistical tests: `NEUMANN_TEST_SEED`, default 1.
pub fn seed() -> u64 {
    std::env::var("NEUMANN_TEST_SEED").ok().and_then(|s| s.parse().ok()).unwrap_or(1)
}

/// A method of the list with its default settings.
pub fn method(name: &str) -> Box<dyn Integrator> {
    method_with(name, json!({}))
}

/// A method of the list.
pub fn method_with(name: &str, settings: Value) -> Box<dyn Integrator> {
    Methods::standard().build(name, &settings).unwrap()
}

/// A built-in scene at a small size.
pub fn builtin(name: &str, size: u32) -> Scene {
    builtin_with(name, size, Skip::Unneeded)
}

/// A built-in scene at a small size, its skips on or off.
pub fn builtin_with(name: &str, size: u32, skip: Skip) -> Scene {
    scenes::load(name, &LoadOptions { size: Some((size, size)), skip }).unwrap()
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
}

impl Budget {
    /// Orders 0 to 8 without tail in 32 replicates of so many samples per pixel.
    pub fn samples(samples: u32) -> Self {
        Self { max_order: 8, samples, replicates: 32, tail: false }
    }
}

/// Renders with the independent sampler. `instance` keys the random numbers.
pub fn measure(scene: &Scene, method: &dyn Integrator, instance: &str, budget: Budget) -> Measurement {
    let settings = RenderSettings {
        orders: Orders::up_to(budget.max_order),
        tail: budget.tail,
        samples_per_replicate: ((budget.samples as f64 * scale()) as u32).max(1),
        seed: seed(),
        sampler: SamplerKind::Independent,
        instance: instance.to_owned(),
        role: Role::Estimate,
    };
    let mut render = Render::new(scene, method, settings).unwrap();
    (0..budget.replicates).for_each(|_| render.run_replicate(&|_| {}));
    let measurement = render.finish();
    assert!(measurement.invalid.iter().all(|&n| n == 0), "{instance}: non-finite contributions {:?}", measurement.invalid);
    measurement
}

/// The closed form of a built-in scene: radiance of an order that a camera ray of direction `d` brings from `p`.
pub fn exact(scene: &Scene, order: usize, p: Vec3, d: Vec3) -> [f64; 3] {
    scenes::builtin::exact(&scene.name, order, p, -d).expect("a scene with a closed form").to_array().map(f64::from)
}

/// Mean over channels.
pub fn grey(x: [f64; 3]) -> f64 {
    x.iter().sum::<f64>() / 3.0
}

/// An estimate with its standard error, from replicates.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// The mean over replicates.
    pub mean: f64,
    /// Its standard error.
    pub error: f64,
    /// Replicates.
    pub replicates: u32,
}

impl Estimate {
    /// The channel mean of a block of a layer. Channels are as correlated as they can be, which errs on the safe side
    /// by at most the factor that a perfect correlation gives.
    pub fn of_block(m: &Measurement, layer: usize, block: usize) -> Self {
        let deviation: f64 = m.block_variance(layer, block).unwrap().iter().map(|v| v.sqrt()).sum::<f64>() / 3.0;
        let error = deviation / (m.replicates as f64).sqrt();
        Self { mean: grey(m.block_mean(layer, block)), error, replicates: m.replicates }
    }

    /// The channel mean of the image mean of a layer.
    pub fn of_image(m: &Measurement, layer: usize) -> Self {
        let means: Vec<f64> = m.replicate_means.iter().map(|r| grey(r[layer])).collect();
        Self::of(&means)
    }

    /// The mean of independent values.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
        Self { mean, error: (variance / n).sqrt(), replicates: values.len() as u32 }
    }
}

/// Comparisons that belong together: none may be significant after Šidák's correction for their number.
pub struct Family {
    name: String,
    comparisons: Vec<Comparison>,
}

struct Comparison {
    label: String,
    a: f64,
    b: f64,
    error: f64,
    p: f64,
}

impl Family {
    /// An empty family.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), comparisons: Vec::new() }
    }

    /// Compares an estimate with the truth, by Student's t.
    pub fn against_truth(&mut self, label: impl Into<String>, estimate: Estimate, truth: f64) {
        self.push(label.into(), estimate.mean, truth, estimate.error, (estimate.replicates - 1) as f64);
    }

    /// Compares two independent estimates, by Welch's t.
    pub fn pair(&mut self, label: impl Into<String>, a: Estimate, b: Estimate) {
        let (va, vb) = (a.error * a.error, b.error * b.error);
        let freedom = (va + vb).powi(2) / (va * va / (a.replicates - 1) as f64 + vb * vb / (b.replicates - 1) as f64);
        self.push(label.into(), a.mean, b.mean, (va + vb).sqrt(), if freedom.is_finite() { freedom } else { 1.0 });
    }

    fn push(&mut self, label: String, a: f64, b: f64, error: f64, freedom: f64) {
        // Rounding of f32 values, which neither shrinks with the samples nor shows in their variance.
        let rounding = 4.0 * f32::EPSILON as f64 * a.abs().max(b.abs());
        let difference = ((a - b).abs() - rounding).max(0.0);
        let p = match (difference, error) {
            (0.0, _) => 1.0,
            (_, 0.0) => 0.0,
            _ => 2.0 * StudentsT::new(0.0, 1.0, freedom).unwrap().cdf(-difference / error),
        };
        self.comparisons.push(Comparison { label, a, b, error, p });
    }

    /// Number of comparisons.
    pub fn len(&self) -> usize {
        self.comparisons.len()
    }

    /// The smallest p-value.
    pub fn smallest_p(&self) -> f64 {
        self.comparisons.iter().map(|c| c.p).fold(1.0, f64::min)
    }

    /// The p-value below which one comparison is significant in this family.
    pub fn threshold(&self) -> f64 {
        1.0 - (1.0 - FALSE_ALARM_RATE).powf(1.0 / self.comparisons.len() as f64)
    }

    /// Fails if any comparison is significant, or if there was none.
    pub fn finish(self) {
        assert!(!self.comparisons.is_empty(), "{}: nothing was compared", self.name);
        let threshold = self.threshold();
        let mut failures: Vec<_> = self.comparisons.iter().filter(|c| c.p < threshold).collect();
        failures.sort_by(|a, b| a.p.total_cmp(&b.p));
        let count = self.comparisons.len();
        println!("{}: {count} comparisons, smallest p {:.2e}, threshold {threshold:.2e}", self.name, self.smallest_p());
        let line = |c: &&Comparison| {
            let z = (c.a - c.b) / c.error;
            format!("  {}: {:.6e} against {:.6e}, error {:.1e}, {z:+.2} errors apart, p = {:.1e}", c.label, c.a, c.b, c.error, c.p)
        };
        let lines: Vec<String> = failures.iter().take(12).map(line).collect();
        assert!(
            failures.is_empty(),
            "{}: {} of {count} comparisons fail at a false-alarm rate of {FALSE_ALARM_RATE} (seed {}):\n{}",
            self.name,
            failures.len(),
            seed(),
            lines.join("\n")
        );
    }
}
