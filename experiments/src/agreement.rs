//! Do methods agree? Welch's t-test for every pair of methods, order by order, on blocks of pixels and on the whole image.
//!
//! Two families of tests are made in every scene: one on the means of the image, and one on the means of blocks of pixels in
//! each channel, which find what cancels over the image. In each family the false discovery rate is controlled at
//! [`DISCOVERY_RATE`] [Benjamini & Hochberg 1995]; where all methods agree, that is the probability of any false alarm in a family.
//! Light that a method cannot carry is no disagreement: where one of a pair loses some path class of the order, the pair is
//! marked [`Verdict::Incomparable`] and takes no part; nor do pairs of which one is biased, [`Verdict::Biased`]. Their means stand beside
//! those of the others. Where one of a pair found no light at all and the other did, nothing is decided: what it has not met once may be
//! rare, and says nothing of how rare.

use crate::path_class::carries;
use crate::result::{AgreementRow, BlockTest, MethodResult, Verdict};
use crate::statistics::multiple::benjamini_hochberg;
use crate::statistics::welch::{Sample, Welch, detectable, rounding, welch};
use integrators::{Bias, Layer, Measurement, exact};
use sampling::moments::Moments;
use statrs::distribution::{ContinuousCDF, Normal};

/// The part of the differences found that may be false.
pub const DISCOVERY_RATE: f64 = 0.01;
/// The least variance that a block is taken to have, as a part of what its mean and the whole image's variance lead to expect.
///
/// Where contributions are few, replicates that have none lower mean and variance at once, and t may be anything. (Simulated
/// with contributions of exponentially distributed size and 8 replicates: of p-values below 10⁻⁵ there are 2 times too many
/// at 10 contributions in a block, 80 times at one, and none with this floor.) It is made from both methods' means and the
/// variances of all blocks, never from the block's own variance.
const FLOOR: f64 = 0.5;

/// Every pair of methods of one scene, in every layer that both have measured.
pub fn compare(results: &[&MethodResult]) -> Vec<AgreementRow> {
    let mut comparisons = Vec::new();
    for (i, a) in results.iter().enumerate() {
        for b in &results[i + 1..] {
            comparisons.extend(common_layers(a, b).map(|layer| Comparison::new(a, b, layer)));
        }
    }
    let judged: Vec<usize> = (0..comparisons.len()).filter(|&i| comparisons[i].apart.is_none()).collect();
    let image_p: Vec<f64> = judged.iter().map(|&i| comparisons[i].image.p).collect();
    let block_p: Vec<f64> = judged.iter().flat_map(|&i| comparisons[i].blocks.iter().map(|test| test.p)).collect();
    let (image_adjusted, block_adjusted) = (benjamini_hochberg(&image_p), benjamini_hochberg(&block_p));

    let level = DISCOVERY_RATE / judged.len().max(1) as f64;
    let mut adjusted_blocks = block_adjusted.as_slice();
    let mut rows: Vec<AgreementRow> = comparisons.iter().map(|c| c.row(level)).collect();
    for (&i, image_adjusted) in judged.iter().zip(image_adjusted) {
        let (mine, rest) = adjusted_blocks.split_at(comparisons[i].blocks.len());
        adjusted_blocks = rest;
        comparisons[i].judge(&mut rows[i], image_adjusted, mine);
    }
    rows
}

fn block_test(test: &Welch) -> BlockTest {
    BlockTest { t: test.t as f32, p: test.p as f32, varies: !test.exact && test.t != 0.0 }
}

/// The layers that both have measured, with a variance.
fn common_layers<'a>(a: &'a MethodResult, b: &'a MethodResult) -> impl Iterator<Item = Layer> {
    let known = a.measurement.replicates >= 2 && b.measurement.replicates >= 2;
    let layers = a.measurement.layers.iter().copied();
    layers.filter(move |layer| known && b.measurement.layers.contains(layer))
}

/// One pair in one layer.
struct Comparison<'a> {
    a: &'a MethodResult,
    b: &'a MethodResult,
    layer: Layer,
    /// What is known without a test.
    apart: Option<Verdict>,
    means: (f64, f64),
    /// Whether both found light, or neither did, or it is known that there is none.
    seen: bool,
    image: Welch,
    /// The greater skewness of the two image means.
    lean: f64,
    blocks: Vec<Welch>,
}

impl<'a> Comparison<'a> {
    fn new(a: &'a MethodResult, b: &'a MethodResult, layer: Layer) -> Self {
        let order = match layer {
            Layer::Order(k) => k,
            Layer::Tail => 2 * a.measurement.max_order + 2,
        };
        let rounding = rounding(order);
        let (image_a, image_b) = (image_means(&a.measurement, layer), image_means(&b.measurement, layer));
        // The closed form has no distribution.
        let lean_of =
            |image: &[f64], method: &MethodResult| if method.method == exact::NAME { 0.0 } else { lean(image) };
        let lean = lean_of(&image_a, a).max(lean_of(&image_b, b));
        let (image_a, image_b): (Moments, Moments) = (image_a.into_iter().collect(), image_b.into_iter().collect());
        // A closed form that is zero is no accident.
        let dark = |image: &Moments, method: &MethodResult| image.mean == 0.0 && method.method != exact::NAME;
        let seen = image_a.mean == image_b.mean || !(dark(&image_a, a) || dark(&image_b, b));
        let blocks = if seen { block_tests(&a.measurement, &b.measurement, layer, rounding) } else { Vec::new() };
        let samples = [(&image_a, a), (&image_b, b)].map(|(image, method)| {
            let sample = Sample::from(image);
            // A few replicates may have the same mean by chance alone: it is exact where the blocks are.
            if sample.variance.sqrt() > rounding * sample.mean.abs() || blocks.iter().all(|block| block.exact) {
                return sample;
            }
            sample.with_variance_from(variance_by_blocks(&method.measurement, layer))
        });
        let image = image_test(samples[0], samples[1], rounding, lean);
        let carry = |method: &&MethodResult| carries(&method.missing_light, Some(layer), method.measurement.max_order);
        let apart = match [a, b] {
            both if !both.iter().all(carry) => Some(Verdict::Incomparable),
            both if both.iter().any(|method| method.bias != Bias::None) => Some(Verdict::Biased),
            _ => None,
        };
        Self { a, b, layer, apart, means: (image_a.mean, image_b.mean), seen, image, lean, blocks }
    }

    /// All but what follows from the other comparisons.
    fn row(&self, level: f64) -> AgreementRow {
        let mean = (self.means.0.abs() + self.means.1.abs()) / 2.0;
        let detectable_bias = if mean > 0.0 && self.seen { self.detectable(level) / mean } else { f64::INFINITY };
        AgreementRow {
            scene: self.a.scene.clone(),
            a: self.a.label.clone(),
            b: self.b.label.clone(),
            order: self.layer,
            mean_a: self.means.0,
            mean_b: self.means.1,
            t: self.image.t,
            p: self.image.p,
            blocks: self.blocks.len(),
            rejected: 0,
            smallest_adjusted_p: 1.0,
            detectable_bias,
            verdict: self.apart.unwrap_or(Verdict::Incomparable),
            tests: self.blocks.iter().map(block_test).collect(),
            columns: self.a.measurement.grid.columns as usize,
        }
    }

    /// Whether no difference of the image means could have been significant, however large.
    fn is_open(&self) -> bool {
        !self.image.exact && skewed(0.0, self.lean) > DISCOVERY_RATE
    }

    /// The difference of image means that is significant at `level` with probability [`POWER`]; infinite where none is.
    fn detectable(&self, level: f64) -> f64 {
        let (mut least, mut most) = (0.0, 1.0);
        if skewed(least, self.lean) > level {
            return f64::INFINITY;
        }
        for _ in 0..200 {
            let p = (least + most) / 2.0;
            if skewed(p, self.lean) > level { most = p } else { least = p }
        }
        detectable(&self.image, least.max(f64::MIN_POSITIVE))
    }

    fn judge(&self, row: &mut AgreementRow, image_adjusted: f64, blocks_adjusted: &[f64]) {
        row.rejected = blocks_adjusted.iter().filter(|&&p| p <= DISCOVERY_RATE).count();
        row.smallest_adjusted_p = blocks_adjusted.iter().copied().fold(1.0, f64::min);
        row.verdict = match () {
            () if !self.seen => Verdict::Inconclusive,
            () if row.rejected > 0 || image_adjusted <= DISCOVERY_RATE => Verdict::Differ,
            () if self.image.exact && self.blocks.iter().all(|test| test.exact) => Verdict::Equal,
            () if self.is_open() => Verdict::Inconclusive,
            () => Verdict::Agree,
        };
    }
}

/// Tests the image means. Means of rare contributions are skewed: too low more often than normal ones, with a standard error
/// that is too small when they are. For skewness γ the law of self-normalised sums says how much more often [Shao 1997],
/// `P(T < −t) ≈ Φ(−t) exp(γ t³ / 3)`, up to t = 1/γ where the expansion ends; the p-value carries this factor.
fn image_test(a: Sample, b: Sample, rounding: f64, lean: f64) -> Welch {
    let test = welch(a, b, rounding);
    if test.exact && a.mean != 0.0 && b.mean != 0.0 {
        return test;
    }
    Welch { p: if test.p < 1.0 { skewed(test.p, lean) } else { 1.0 }, ..test }
}

/// A two-sided p-value of a symmetric law, raised for skewness.
fn skewed(p: f64, lean: f64) -> f64 {
    let normal = Normal::standard();
    let z = (-normal.inverse_cdf((p / 2.0).max(1e-300))).min(1.0 / lean);
    (2.0 * normal.cdf(-z) * (lean * z.powi(3) / 3.0).exp()).clamp(p, 1.0)
}

/// What a sample's skewness is multiplied by for what it has not seen.
const UNSEEN: f64 = 1.5;

/// From so many values on their skewness is known well enough to be used.
const MANY: f64 = 64.0;

/// Skewness of a mean of values ≥ 0: the least that a mean of rare contributions can have, its relative error, or that of many
/// values, if it is more. Infinite where nothing arrived; 0 where there is no variance.
fn lean(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    if mean == 0.0 {
        return f64::INFINITY;
    }
    let moment = |power: i32| values.iter().map(|x| (x - mean).powi(power)).sum::<f64>() / n;
    let variance = moment(2);
    if variance == 0.0 {
        return 0.0;
    }
    let skewness = if n < MANY { 0.0 } else { moment(3) / variance.powf(1.5) / n.sqrt() };
    UNSEEN * skewness.max((variance / (n - 1.0)).sqrt() / mean.abs())
}

/// The image mean, mean of channels, of every replicate.
fn image_means(measurement: &Measurement, layer: Layer) -> Vec<f64> {
    let Some(at) = index(measurement, layer) else { return Vec::new() };
    measurement.replicate_means.iter().map(|means| means[at].iter().sum::<f64>() / 3.0).collect()
}

/// Block by block and channel by channel; none where the images are not divided alike.
fn block_tests(a: &Measurement, b: &Measurement, layer: Layer, rounding: f64) -> Vec<Welch> {
    let (Some(at_a), Some(at_b)) = (index(a, layer), index(b, layer)) else { return Vec::new() };
    let blocks = if a.grid == b.grid { a.grid.count() } else { 0 };
    let mut tests = Vec::new();
    for c in 0..3 {
        let samples = |m: &Measurement, at: usize| -> Vec<Sample> {
            (0..blocks).map(|block| block_sample(m, at, block, c)).collect()
        };
        let (of_a, of_b) = (samples(a, at_a), samples(b, at_b));
        let (size_a, size_b) = (contribution_size(&of_a), contribution_size(&of_b));
        tests.extend(of_a.iter().zip(&of_b).map(|(a, b)| {
            let mean = combined_mean(a.mean, size_a, b.mean, size_b);
            welch(a.with_variance_from(FLOOR * size_a * mean), b.with_variance_from(FLOOR * size_b * mean), rounding)
        }));
    }
    tests
}

fn block_sample(m: &Measurement, layer: usize, block: usize, channel: usize) -> Sample {
    let variance = m.block_variance(layer, block).map_or(f64::NAN, |variance| variance[channel]);
    Sample { mean: m.block_mean(layer, block)[channel], variance, n: m.replicates }
}

/// The variance that the image mean of a replicate has if blocks are independent and channels are not.
fn variance_by_blocks(m: &Measurement, layer: Layer) -> f64 {
    let Some(at) = index(m, layer) else { return f64::NAN };
    let count = m.grid.count();
    let by_channel = |c: usize| (0..count).map(|block| block_sample(m, at, block, c).variance).sum::<f64>();
    (0..3).map(by_channel).sum::<f64>() / (3 * count * count) as f64
}

/// Variance divided by mean, over all blocks: were all contributions of a method of this size, and so many of them in a block
/// as chance will have it, a block of mean m would have the variance m · size.
fn contribution_size(blocks: &[Sample]) -> f64 {
    let variance: f64 = blocks.iter().map(|block| block.variance).sum();
    let mean: f64 = blocks.iter().map(|block| block.mean).sum();
    if variance > 0.0 { variance / mean } else { 0.0 }
}

/// The mean of both, each weighted by its precision.
fn combined_mean(a: f64, size_a: f64, b: f64, size_b: f64) -> f64 {
    let sum = size_a + size_b;
    if sum > 0.0 { (a * size_b + b * size_a) / sum } else { (a + b) / 2.0 }
}

fn index(measurement: &Measurement, layer: Layer) -> Option<usize> {
    measurement.layers.iter().position(|&l| l == layer)
}

#[cfg(test)]
mod tests;
