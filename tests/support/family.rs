//! Families of comparisons of means, and when a comparison decides nothing.
//!
//! Student's and Welch's t are made for normal estimates. Those here are means of contributions that may be rare: such an
//! estimate is more often far too low than a normal one, and its standard error is too small when it is. For a mean of
//! skewness γ the law of self-normalised sums says how much more often [Shao 1997; Jing, Shao & Wang 2003]:
//!
//! `P(T < −t) ≈ Φ(−t) exp(γ t³ / 3)`,
//!
//! and less often on the other side. The p-value of every comparison carries this factor. With it, evidence −ln p ≈ t²/2 −
//! γ t³/3 grows only up to t = 1/γ, where the expansion ends; what lies beyond counts as if it lay there. A comparison is
//! *inconclusive* if even that would not be significant in its family, so that no difference at all could have failed: such
//! comparisons are counted apart and are no passes. Roughly, γ must be below `(6 ln(1/level))^(−1/2)`, about 0.1. Since γ is at
//! least the relative error, what rests on fewer than a hundred contributions is inconclusive.

use super::{Estimate, seed};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// The probability with which a family of comparisons raises a false alarm, if all its null hypotheses hold: half of it is
/// left to the image means, half to the blocks.
pub const FALSE_ALARM_RATE: f64 = 1e-3;

/// The probability with which a detectable bias is found.
pub const POWER: f64 = 0.8;

/// Comparisons that belong together: none may be significant after Šidák's correction for their number.
pub struct Family {
    name: String,
    images: Vec<Comparison>,
    blocks: Vec<Comparison>,
}

/// Two means that should be equal.
pub struct Comparison {
    label: String,
    a: Estimate,
    b: Estimate,
}

impl Comparison {
    /// Compares two means that are estimated independently, or one with the truth.
    pub fn new(label: impl Into<String>, a: Estimate, b: Estimate) -> Self {
        Self { label: label.into(), a, b }
    }

    /// Standard error of the difference.
    fn error(&self) -> f64 {
        self.a.error.hypot(self.b.error)
    }

    /// The difference in standard errors. Rounding of `f32` values neither shrinks with the samples nor shows in their
    /// variance; it is taken off.
    fn t(&self) -> f64 {
        let (a, b) = (self.a.mean, self.b.mean);
        let rounding = 4.0 * f32::EPSILON as f64 * a.abs().max(b.abs());
        let difference = ((a - b).abs() - rounding).max(0.0).copysign(a - b);
        if difference == 0.0 { 0.0 } else { difference / self.error() }
    }

    /// Welch's degrees of freedom.
    fn freedom(&self) -> f64 {
        let (va, vb) = (self.a.error.powi(2), self.b.error.powi(2));
        let freedom = (va + vb).powi(2) / (va * va / self.a.freedom + vb * vb / self.b.freedom);
        if freedom.is_finite() { freedom } else { 1.0 }
    }

    /// The skewness γ that makes the side that the difference lies on more likely: that of the smaller estimate towards
    /// small values, and that of the larger towards large ones.
    fn lean(&self) -> f64 {
        let (low, high) = if self.a.mean < self.b.mean { (self.a, self.b) } else { (self.b, self.a) };
        let share = |e: Estimate| (e.error / self.error()).powi(3);
        match low.lean() {
            lean if lean.is_infinite() => lean,
            lean => lean.max(0.0) * share(low) + (-high.skewness).max(0.0) * share(high),
        }
    }

    /// The p-value that a difference of `t` standard errors has.
    fn p_at(&self, t: f64) -> f64 {
        if t == 0.0 {
            return 1.0;
        }
        let lean = self.lean();
        let t = t.abs().min(1.0 / lean);
        (two_sided(t, self.freedom()) * (lean * t.powi(3) / 3.0).exp()).min(1.0)
    }

    /// The p-value.
    pub fn p(&self) -> f64 {
        // Where nothing can arrive, and nothing negative can, a single contribution is an error.
        if [self.a, self.b].iter().any(|e| e.is_exact() && e.mean == 0.0) {
            return if self.a.mean == self.b.mean { 1.0 } else { 0.0 };
        }
        self.p_at(self.t())
    }

    /// Whether some difference would be significant.
    fn is_conclusive(&self, level: f64) -> bool {
        self.p() < level || self.a.mean == self.b.mean || self.p_at(f64::INFINITY) < level
    }

    /// Relative difference that is significant with probability [`POWER`].
    fn detectable(&self, level: f64) -> f64 {
        let (mut low, mut high) = (0.0, f64::min(1.0 / self.lean(), 1e3));
        for _ in 0..60 {
            let middle = (low + high) / 2.0;
            if self.p_at(middle) < level { high = middle } else { low = middle }
        }
        let power = Normal::standard().inverse_cdf(POWER);
        (high + power) * self.error() / self.a.mean.abs().max(self.b.mean.abs())
    }

    /// The normal score of the difference, as Student's t has it.
    fn z(&self) -> f64 {
        let t = self.t();
        if t == 0.0 {
            return 0.0;
        }
        -Normal::standard().inverse_cdf((two_sided(t, self.freedom()) / 2.0).max(1e-300)) * t.signum()
    }

    fn line(&self, level: f64) -> String {
        let Self { label, a, b } = self;
        let (z, lean) = (self.z(), self.lean());
        let detectable = match self.is_conclusive(level) {
            true => format!("detectable {:.2} %", 100.0 * self.detectable(level)),
            false => "inconclusive".to_owned(),
        };
        format!(
            "  {label}: {:.5e} ± {:.1e} against {:.5e} ± {:.1e}, z {z:+.2}, skewness {lean:.3}, p {:.1e}, {detectable}",
            a.mean,
            a.error,
            b.mean,
            b.error,
            self.p()
        )
    }
}

/// Two-sided p-value of Student's t.
fn two_sided(t: f64, freedom: f64) -> f64 {
    if t.is_infinite() { 0.0 } else { 2.0 * StudentsT::new(0.0, 1.0, freedom).unwrap().cdf(-t.abs()) }
}

impl Family {
    /// An empty family.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), images: Vec::new(), blocks: Vec::new() }
    }

    /// Compares two means over images (or of other things that must be conclusive).
    pub fn image(&mut self, label: impl Into<String>, a: Estimate, b: Estimate) {
        push(&mut self.images, Comparison::new(label, a, b));
    }

    /// Compares two means over blocks of an image, which may be inconclusive.
    pub fn block(&mut self, label: impl Into<String>, a: Estimate, b: Estimate) {
        push(&mut self.blocks, Comparison::new(label, a, b));
    }

    /// What does not hold, if anything: a comparison is significant, one of image means is inconclusive, less than the
    /// share `conclusive` of the blocks is conclusive, or nothing was compared.
    pub fn verdict(&self, conclusive: f64) -> Result<(), String> {
        let (images, blocks) = (Part::new(&self.images), Part::new(&self.blocks));
        println!("{}:\n  images: {images}\n  blocks: {blocks}", self.name);
        self.images.iter().for_each(|c| println!("{}", c.line(images.level)));
        if self.images.is_empty() {
            return Err(format!("{}: nothing was compared", self.name));
        }
        let significant = [&images, &blocks].map(|part| part.significant());
        if significant.iter().any(|lines| !lines.is_empty()) {
            let rate = FALSE_ALARM_RATE;
            let count = significant.iter().map(Vec::len).sum::<usize>();
            let lines = significant.map(|lines| lines[..lines.len().min(12)].concat()).concat();
            return Err(format!("{}: {count} differ, at a false-alarm rate of {rate} (seed {}):{lines}", self.name, seed()));
        }
        let open: Vec<String> = images.inconclusive().map(|c| format!("\n{}", c.line(images.level))).collect();
        if !open.is_empty() {
            return Err(format!("{}: image means that decide nothing:{}", self.name, open.concat()));
        }
        let share = 1.0 - blocks.inconclusive().count() as f64 / blocks.comparisons.len().max(1) as f64;
        if share < conclusive {
            return Err(format!("{}: only {share:.3} of the blocks decide anything, not {conclusive}", self.name));
        }
        Ok(())
    }

    /// Fails if the [`verdict`](Self::verdict) is that something does not hold.
    pub fn finish(self, conclusive: f64) {
        if let Err(message) = self.verdict(conclusive) {
            panic!("{message}");
        }
    }
}

/// Adds a comparison, unless both means are 0 by estimates, which says nothing.
fn push(comparisons: &mut Vec<Comparison>, c: Comparison) {
    let nothing = |e: Estimate| e.mean == 0.0 && !e.is_exact();
    if !(nothing(c.a) && nothing(c.b)) {
        comparisons.push(c);
    }
}

/// The image means of a family, or the blocks.
struct Part<'a> {
    comparisons: &'a [Comparison],
    /// The p-value below which one comparison is significant.
    level: f64,
}

impl<'a> Part<'a> {
    fn new(comparisons: &'a [Comparison]) -> Self {
        let level = 1.0 - (1.0 - FALSE_ALARM_RATE / 2.0).powf(1.0 / comparisons.len().max(1) as f64);
        Self { comparisons, level }
    }

    fn inconclusive(&self) -> impl Iterator<Item = &'a Comparison> {
        let level = self.level;
        self.comparisons.iter().filter(move |c| !c.is_conclusive(level))
    }

    /// A line for each significant comparison, the worst first.
    fn significant(&self) -> Vec<String> {
        let mut found: Vec<_> = self.comparisons.iter().filter(|c| c.p() < self.level).collect();
        found.sort_by(|a, b| a.p().total_cmp(&b.p()));
        found.iter().map(|c| format!("\n{}", c.line(self.level))).collect()
    }
}

impl std::fmt::Display for Part<'_> {
    /// Numbers, and the distribution of the normal scores of what is conclusive.
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let (count, open) = (self.comparisons.len(), self.inconclusive().count());
        write!(f, "{count} comparisons, {open} inconclusive, level {:.1e}", self.level)?;
        let conclusive = self.comparisons.iter().filter(|c| c.is_conclusive(self.level) && c.error() > 0.0);
        let mut z: Vec<f64> = conclusive.map(Comparison::z).collect();
        if z.is_empty() {
            return Ok(());
        }
        z.sort_by(f64::total_cmp);
        let quantile = |q: f64| z[((z.len() - 1) as f64 * q).round() as usize];
        let beyond = |x: f64| 100.0 * z.iter().filter(|z| z.abs() > x).count() as f64 / z.len() as f64;
        let p = self.comparisons.iter().map(Comparison::p).fold(1.0, f64::min);
        let [least, low, middle, high, greatest] = [0.0, 0.25, 0.5, 0.75, 1.0].map(quantile);
        write!(f, ", smallest p {p:.1e}; z from {least:+.2} to {greatest:+.2}, quartiles {low:+.2} {middle:+.2} {high:+.2}, ")?;
        let [one, two, three] = [1.0, 2.0, 3.0].map(beyond);
        write!(f, "|z| > 1, 2, 3: {one:.1} %, {two:.1} %, {three:.2} % (normal: 31.7 %, 4.6 %, 0.27 %)")
    }
}
