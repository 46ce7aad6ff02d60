//! `neumann verify --stress`: a scene in other units, and elsewhere, is the same scene.
//!
//! A scene whose lengths are all 2ᵏ times as large is the same to the bit, by every method and sampler: nothing is rounded
//! differently. Other sizes and places round otherwise, but the same random numbers give nearly all paths again, so that the means of
//! differences between replicates have far smaller errors than those means themselves. What differs by more than chance and more than
//! 10⁻⁵ is a fault of the program, or detail of the scene that is finer than `f32` resolves.

use crate::error::Error;
use crate::progress::Progress;
use crate::statistics::multiple::sidak_level;
use crate::statistics::welch::{Sample, welch};
use crate::stop::Stop;
use glam::{DVec3, dvec3};
use integrators::{Integrator, Layer, Measurement, Orders, Render, RenderSettings};
use sampling::moments::Moments;
use sampling::sampler::SamplerKind;
use scenes::{Scene, SceneBuilder, Similarity, Skip};
use serde::Serialize;

/// The relative difference of an order that rounding in `f32` is allowed.
const ROUNDING: f64 = 1e-5;
/// The probability that any comparison of a scene raises a false alarm.
const RATE: f64 = 1e-3;
/// Powers of two that lengths are multiplied by, and powers of ten.
const POWERS_OF_TWO: [i32; 3] = [-20, 7, 20];
const POWERS_OF_TEN: [i32; 4] = [-6, -3, 3, 6];
/// How far the scene is moved, in its own radii.
const FAR: f64 = 1e5;
/// How images are rendered of which the bits are compared.
const FEW: Amount = Amount { samples: 4, replicates: 2 };

/// What a change of units or place has done to a method's image.
#[derive(Clone, Debug, Serialize)]
pub struct Stressed {
    /// The change.
    pub change: String,
    /// The method.
    pub method: String,
    /// The order that differs most significantly; `null` where bits are compared.
    pub order: Option<String>,
    /// By how much it differs, relative to its mean; where bits are compared, the share of image means that differ.
    pub difference: f64,
    /// Non-finite samples of the changed scene.
    pub invalid: u64,
    /// Whether it is the same, as far as that can be told, and all of it finite.
    pub holds: bool,
}

/// A scene as its file has it, ready to be changed.
pub struct Subject<'a> {
    /// Where it comes from.
    pub scene: &'a str,
    /// Size of the image.
    pub size: (u32, u32),
    /// The methods that can render it.
    pub methods: &'a [Box<dyn Integrator>],
    /// The last order.
    pub max_order: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// What images are rendered of which the means are compared.
    pub amount: Amount,
}

/// How much is rendered.
#[derive(Clone, Copy, Debug)]
pub struct Amount {
    /// Samples per pixel of an image.
    pub samples: u32,
    /// Independent images.
    pub replicates: u32,
}

impl Subject<'_> {
    /// Renders the scene as it is and changed, by all methods. Nothing is told if the user asks for an end.
    ///
    /// # Errors
    /// If it cannot be loaded or rendered.
    pub fn stress(&self, progress: &mut Progress, stop: &Stop) -> Result<Vec<Stressed>, Error> {
        let builder = scenes::load::open(self.scene, Some(self.size))?;
        let home = self.built(builder.clone())?;
        let far = dvec3(1.0, 0.3, -0.7) * FAR * f64::from(home.bounds.radius);
        let scaled = |scale: f64| Similarity { scale, offset: DVec3::ZERO };
        let changed = |similarity: &Similarity| self.built(builder.clone().resembling(similarity));
        let mut found = Vec::new();
        let mut bits = Vec::new();
        for method in self.methods {
            if stop.signal().is_some() {
                return Ok(Vec::new());
            }
            bits.push(self.by_every_sampler(&home, &**method)?);
        }
        for exponent in POWERS_OF_TWO {
            if stop.signal().is_some() {
                return Ok(Vec::new());
            }
            let scene = changed(&scaled(f64::from(exponent).exp2()))?;
            for (method, base) in self.methods.iter().zip(&bits) {
                let other = progress.during(1.0, |_| self.by_every_sampler(&scene, &**method))?;
                found.push(differing_bits(format!("2^{exponent} times as large"), method.name(), base, &other));
            }
        }
        let resized = POWERS_OF_TEN.map(|k| (format!("10^{k} times as large"), scaled(10f64.powi(k))));
        let moved = (format!("moved by {FAR:e} times its radius"), Similarity { scale: 1.0, offset: far });
        let changes: Vec<(String, Similarity)> = resized.into_iter().chain([moved]).collect();
        let mut means = Vec::new();
        for method in self.methods {
            if stop.signal().is_some() {
                return Ok(Vec::new());
            }
            means.push(self.render(&home, &**method, SamplerKind::default(), self.amount)?);
        }
        let level = sidak_level(RATE, changes.len() * means.iter().map(|m| m.layers.len()).sum::<usize>());
        for (change, similarity) in &changes {
            let scene = changed(similarity)?;
            for (method, base) in self.methods.iter().zip(&means) {
                if stop.signal().is_some() {
                    return Ok(Vec::new());
                }
                let sampler = SamplerKind::default();
                let other = progress.during(1.0, |_| self.render(&scene, &**method, sampler, self.amount))?;
                found.push(most_different(change, method.name(), base, &other, level));
            }
        }
        Ok(found)
    }

    /// How many renders [`Self::stress`] tells of.
    pub fn work(&self) -> f64 {
        ((POWERS_OF_TWO.len() + POWERS_OF_TEN.len() + 1) * self.methods.len()) as f64
    }

    fn built(&self, builder: SceneBuilder) -> Result<Scene, Error> {
        Ok(builder.build(Skip::Unneeded).map_err(|error| scenes::load::placed(error, self.scene))?)
    }

    /// A few images by each sampler, of which the bits are compared.
    fn by_every_sampler(&self, scene: &Scene, method: &dyn Integrator) -> Result<Vec<Measurement>, Error> {
        SamplerKind::ALL.iter().map(|&sampler| self.render(scene, method, sampler, FEW)).collect()
    }

    fn render(
        &self,
        scene: &Scene,
        method: &dyn Integrator,
        sampler: SamplerKind,
        amount: Amount,
    ) -> Result<Measurement, Error> {
        let orders = Orders::up_to(*method.orders(self.max_order).end());
        let settings = crate::subject::render_settings(method, orders, false, self.seed, sampler);
        let settings = RenderSettings { samples_per_replicate: amount.samples, ..settings };
        let mut render = Render::new(scene, method, settings)?;
        (0..amount.replicates).for_each(|_| render.run_replicate(&|_| {}));
        Ok(render.finish())
    }
}

/// How many of the image means have other bits.
fn differing_bits(change: String, method: &str, base: &[Measurement], other: &[Measurement]) -> Stressed {
    let bits = |m: &[Measurement]| -> Vec<u64> {
        m.iter().flat_map(|m| m.replicate_means.concat().concat()).map(f64::to_bits).collect()
    };
    let (a, b) = (bits(base), bits(other));
    let differing = a.iter().zip(&b).filter(|(a, b)| a != b).count();
    let invalid: u64 = other.iter().flat_map(|m| &m.invalid).sum();
    Stressed {
        change,
        method: method.to_owned(),
        order: None,
        difference: differing as f64 / a.len().max(1) as f64,
        invalid,
        holds: differing == 0 && invalid == 0,
    }
}

/// The order whose mean has changed most significantly.
fn most_different(change: &str, method: &str, base: &Measurement, other: &Measurement, level: f64) -> Stressed {
    let of = |layer: usize, label: Layer| {
        let mut differences = Moments::default();
        let grey = |m: &Measurement, replicate: usize| m.replicate_means[replicate][layer].iter().sum::<f64>() / 3.0;
        let replicates = base.replicate_means.len();
        (0..replicates).for_each(|r| differences.push(grey(other, r) - grey(base, r)));
        let mean = (0..replicates).map(|r| grey(base, r)).sum::<f64>() / replicates as f64;
        let certain = Sample { mean, variance: 0.0, n: replicates as u32 };
        let moved = Sample { mean: mean + differences.mean, ..Sample::from(&differences) };
        (label, differences.mean / mean.abs().max(f64::MIN_POSITIVE), welch(certain, moved, ROUNDING).p)
    };
    let layers = base.layers.iter().enumerate().map(|(layer, &label)| of(layer, label));
    let worst = layers.min_by(|a, b| a.2.total_cmp(&b.2).then(b.1.abs().total_cmp(&a.1.abs())));
    let (order, difference, p) = worst.map_or((None, 0.0, 1.0), |(label, d, p)| (Some(label.label()), d, p));
    let invalid: u64 = other.invalid.iter().sum();
    Stressed {
        change: change.to_owned(),
        method: method.to_owned(),
        order,
        difference,
        invalid,
        holds: p >= level && invalid == 0,
    }
}

/// What was found, a line a change.
pub fn in_words(found: &[Stressed]) -> String {
    let mut text = String::new();
    for row in found.iter().filter(|row| !row.holds) {
        let how = match &row.order {
            None => format!("{:.1} % of its image means have other bits", 100.0 * row.difference),
            Some(order) => format!("order {order} differs by {:.2e} of its mean", row.difference),
        };
        let finite = if row.invalid > 0 { format!("; {} samples are not finite", row.invalid) } else { String::new() };
        text += &format!("  {}, {}: {how}{finite}\n", row.change, row.method);
    }
    if text.is_empty() && !found.is_empty() {
        let most = found.iter().filter(|row| row.order.is_some()).map(|row| row.difference.abs()).fold(0.0, f64::max);
        text = format!(
            "  The scene is the same to the bit when it is 2^-20, 2^7 or 2^20 times as large; 10^-6 to 10^6 times as large, or {FAR:e} of its \
             radii away, no order's mean moves by more than chance and {ROUNDING:e}: by {most:.1e} at the most.\n"
        );
    }
    text
}
