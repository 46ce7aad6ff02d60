//! Do methods agree? Welch's t-test for every pair of methods, order by order, on blocks of pixels and on the whole image.
//!
//! Two families of tests are made in every scene: one on the means of the image, and one on the means of blocks of pixels in
//! each channel, which find what cancels over the image. Of the blocks of a pair and order it is asked first whether any differs [Simes 1986]. So in
//! each family there is one p-value for every pair and order, and the part of false ones among those that are named is controlled at
//! [`DISCOVERY_RATE`] [Benjamini & Hochberg 1995]; where all methods agree, that is the probability of any false alarm in a family. (Were all blocks
//! of all pairs one family, the thousands that differ by one wrong method would let blocks of every other pair pass.)
//! Light that a method cannot carry is no disagreement: where one of a pair loses some path class of the order, the pair is
//! marked [`Verdict::Incomparable`] and takes no part; nor do pairs of which one is biased, [`Verdict::Biased`]. Their means stand beside
//! those of the others. Where one of a pair found no light at all and the other did, nothing is decided, and the pair takes no part either: what it
//! has not met once may be rare, and says nothing of how rare. The same holds of single paths that are rare and bring much, which a method meets by chance
//! alone: see [`path_class::largest_hit`](crate::path_class::largest_hit).

use crate::path_class::carries;
use crate::result::{AgreementRow, BlockTest, MethodResult, Verdict};
use crate::statistics::multiple::benjamini_hochberg;
use crate::statistics::welch::{Sample, Welch, detectable, rounding, welch};
use integrators::{Bias, Layer};
use measured::Measured;
use statrs::distribution::{ContinuousCDF, Normal};

mod measured;

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
            let both = |layer: Layer| Some((Measured::of(a, layer)?, Measured::of(b, layer)?, layer));
            let measured = common_layers(a, b).filter_map(both);
            comparisons.extend(measured.map(|(a, b, layer)| Comparison::new(a, b, layer)));
        }
    }
    let judged: Vec<usize> = (0..comparisons.len()).filter(|&i| comparisons[i].apart.is_none()).collect();
    let image_p: Vec<f64> = judged.iter().map(|&i| comparisons[i].image.p).collect();
    let blocks: Vec<Vec<f64>> = judged.iter().map(|&i| comparisons[i].blocks_adjusted()).collect();
    // The least of p-values that are adjusted for their number is that of whether any differs.
    let blocks_p: Vec<f64> = blocks.iter().map(|adjusted| adjusted.iter().copied().fold(1.0, f64::min)).collect();
    let (image_adjusted, blocks_adjusted) = (benjamini_hochberg(&image_p), benjamini_hochberg(&blocks_p));

    let level = DISCOVERY_RATE / judged.len().max(1) as f64;
    let mut rows: Vec<AgreementRow> = comparisons.iter().map(|c| c.row(level)).collect();
    for (n, &i) in judged.iter().enumerate() {
        let adjusted = Adjusted { image: image_adjusted[n], any_block: blocks_adjusted[n], blocks: &blocks[n] };
        comparisons[i].judge(&mut rows[i], level, &adjusted);
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

/// p-values of a pair in a layer, adjusted for the number of tests.
struct Adjusted<'a> {
    /// Of the image mean, among all pairs and layers.
    image: f64,
    /// Of whether any block differs, among all pairs and layers.
    any_block: f64,
    /// Of each block, among those of this pair and layer.
    blocks: &'a [f64],
}

/// One pair in one layer.
struct Comparison<'a> {
    a: Measured<'a>,
    b: Measured<'a>,
    layer: Layer,
    /// What is known without a test.
    apart: Option<Verdict>,
    /// Whether both found light, or neither did, or it is known that there is none.
    seen: bool,
    image: Welch,
    blocks: Vec<Welch>,
    /// The least p-value, of the image or of all blocks, if no path were met by chance alone.
    unraised_p: f64,
}

impl<'a> Comparison<'a> {
    fn new(a: Measured<'a>, b: Measured<'a>, layer: Layer) -> Self {
        let order = match layer {
            Layer::Order(k) => k,
            Layer::Tail => 2 * a.of.measurement.max_order + 2,
        };
        let rounding = rounding(order);
        let seen = a.image.mean == b.image.mean || !(a.is_dark() || b.is_dark());
        let mut blocks = if seen { block_tests(&a, &b, rounding) } else { Vec::new() };
        let samples = [&a, &b].map(|of| {
            let sample = Sample::from(&of.image);
            // A few replicates may have the same mean by chance alone: it is exact where the blocks are.
            if sample.variance.sqrt() > rounding * sample.mean.abs() || blocks.iter().all(|block| block.exact) {
                return sample;
            }
            sample.with_variance_from(of.variance_by_blocks())
        });
        let mut image = image_test(samples[0], samples[1], rounding, a.lean.max(b.lean));
        let least = blocks.iter().map(|test| test.p).fold(1.0, f64::min);
        let unraised_p = image.p.min(blocks.len() as f64 * least);
        raise_for_hits(&mut image, &mut blocks, &a, &b);
        let carry = |m: &&Measured| carries(&m.of.missing_light, Some(layer), m.of.measurement.max_order);
        let apart = match [&a, &b] {
            both if !both.iter().all(carry) => Some(Verdict::Incomparable),
            both if both.iter().any(|m| m.of.bias != Bias::None) => Some(Verdict::Biased),
            // Among the discoveries of a family it would let others pass for some.
            _ if !seen => Some(Verdict::Inconclusive),
            _ => None,
        };
        Self { a, b, layer, apart, seen, image, blocks, unraised_p }
    }

    /// The greater skewness of the two image means.
    fn lean(&self) -> f64 {
        self.a.lean.max(self.b.lean)
    }

    /// The method of the lower mean, if there are paths that it meets by chance alone.
    fn lacking(&self) -> Option<&'a str> {
        let lower = if self.a.image.mean < self.b.image.mean { &self.a } else { &self.b };
        (lower.hit != [0.0; 3]).then_some(lower.of.label.as_str())
    }

    /// All but what follows from the other comparisons.
    fn row(&self, level: f64) -> AgreementRow {
        let (a, b) = (self.a.of, self.b.of);
        let (mean_a, mean_b) = (self.a.image.mean, self.b.image.mean);
        let mean = (mean_a.abs() + mean_b.abs()) / 2.0;
        let detectable_bias = if mean > 0.0 && self.seen { self.detectable(level) / mean } else { f64::INFINITY };
        AgreementRow {
            scene: a.scene.clone(),
            a: a.label.clone(),
            b: b.label.clone(),
            order: self.layer,
            mean_a,
            mean_b,
            t: self.image.t,
            p: self.image.p,
            blocks: self.blocks.len(),
            rejected: 0,
            smallest_adjusted_p: 1.0,
            detectable_bias,
            hidden_bias: if mean > 0.0 { self.hidden(level) / mean } else { 0.0 },
            lacking: None,
            verdict: self.apart.unwrap_or(Verdict::Incomparable),
            tests: self.blocks.iter().map(block_test).collect(),
            columns: a.measurement.grid.columns as usize,
        }
    }

    /// Whether no difference of the image means could have been significant, however large.
    fn is_open(&self) -> bool {
        !self.image.exact && skewed(0.0, self.lean()) > DISCOVERY_RATE
    }

    /// The difference of image means that is significant at `level` with probability [`POWER`]; infinite where none is.
    fn detectable(&self, level: f64) -> f64 {
        let (mut least, mut most) = (0.0, 1.0);
        let lean = self.lean();
        if skewed(least, lean) > level {
            return f64::INFINITY;
        }
        for _ in 0..200 {
            let p = (least + most) / 2.0;
            if skewed(p, lean) > level { most = p } else { least = p }
        }
        detectable(&self.image, least.max(f64::MIN_POSITIVE))
    }

    /// What paths that are met by chance alone may hide at `level`: the light that one of the methods lacks if none was met.
    fn hidden(&self, level: f64) -> f64 {
        let of = |m: &Measured| -level.ln() * m.mean_hit() / m.samples();
        of(&self.a).max(of(&self.b))
    }

    /// The blocks' p-values, adjusted for the number of blocks.
    fn blocks_adjusted(&self) -> Vec<f64> {
        benjamini_hochberg(&self.blocks.iter().map(|test| test.p).collect::<Vec<_>>())
    }

    fn judge(&self, row: &mut AgreementRow, level: f64, adjusted: &Adjusted) {
        if adjusted.any_block <= DISCOVERY_RATE {
            row.rejected = adjusted.blocks.iter().filter(|&&p| p <= DISCOVERY_RATE).count();
        }
        row.smallest_adjusted_p = adjusted.any_block;
        row.verdict = match () {
            () if row.rejected > 0 || adjusted.image <= DISCOVERY_RATE => Verdict::Differ,
            () if self.image.exact && self.blocks.iter().all(|test| test.exact) => Verdict::Equal,
            () if self.is_open() || self.unraised_p < level => Verdict::Inconclusive,
            () => Verdict::Agree,
        };
        if row.verdict == Verdict::Inconclusive && self.unraised_p < level {
            row.lacking = self.lacking().map(str::to_owned);
        }
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

/// Raises p-values to the probability that the method of the lower mean has met none of the paths that are met by chance alone.
fn raise_for_hits(image: &mut Welch, blocks: &mut [Welch], a: &Measured, b: &Measured) {
    let raise = |test: &mut Welch, (a_mean, a_hit): (f64, f64), (b_mean, b_hit): (f64, f64), count: usize| {
        let (lower, hit) = if a_mean < b_mean { (a, a_hit) } else { (b, b_hit) };
        test.p = test.p.max(lower.chance_of_missing((a_mean - b_mean).abs(), count, hit)).min(1.0);
    };
    raise(image, (a.image.mean, a.mean_hit()), (b.image.mean, b.mean_hit()), a.blocks());
    let count = a.blocks();
    for (i, test) in blocks.iter_mut().enumerate() {
        let (c, block) = (i / count, i % count);
        raise(test, (a.block(block, c).mean, a.hit[c]), (b.block(block, c).mean, b.hit[c]), 1);
    }
}

/// Block by block and channel by channel; none where the images are not divided alike.
fn block_tests(a: &Measured, b: &Measured, rounding: f64) -> Vec<Welch> {
    let blocks = if a.of.measurement.grid == b.of.measurement.grid { a.blocks() } else { 0 };
    let mut tests = Vec::new();
    for c in 0..3 {
        let samples = |m: &Measured| -> Vec<Sample> { (0..blocks).map(|block| m.block(block, c)).collect() };
        let (of_a, of_b) = (samples(a), samples(b));
        let (size_a, size_b) = (contribution_size(&of_a), contribution_size(&of_b));
        tests.extend(of_a.iter().zip(&of_b).map(|(a, b)| {
            let mean = combined_mean(a.mean, size_a, b.mean, size_b);
            welch(a.with_variance_from(FLOOR * size_a * mean), b.with_variance_from(FLOOR * size_b * mean), rounding)
        }));
    }
    tests
}

/// Variance divided by mean, over all blocks: were all contributions of a method of this size, and so many of them in a block
/// as chance will have it, a block of mean m would have the variance |m| · size. (Negative lobes of a filter make means below zero.)
fn contribution_size(blocks: &[Sample]) -> f64 {
    let variance: f64 = blocks.iter().map(|block| block.variance).sum();
    let mean: f64 = blocks.iter().map(|block| block.mean.abs()).sum();
    if variance > 0.0 { variance / mean } else { 0.0 }
}

/// The magnitude of the mean of both, each weighted by its precision.
fn combined_mean(a: f64, size_a: f64, b: f64, size_b: f64) -> f64 {
    let sum = size_a + size_b;
    if sum > 0.0 { (a * size_b + b * size_a).abs() / sum } else { (a + b).abs() / 2.0 }
}

#[cfg(test)]
mod tests;
