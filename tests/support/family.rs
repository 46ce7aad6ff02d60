//! Families of comparisons of means, and when a comparison decides nothing.
//!
//! Student's and Welch's t are made for normal estimates. Those here are means of contributions that may be rare: such an
//! estimate is more often far too low than a normal one, and its standard error is too small when it is. For a mean of
//! skewness γ the law of self-normalised sums says how much more often [Shao 1997; Jing, Shao & Wang 2003]:
//!
//! `P(T < −t) ≈ Φ(−t) exp(γ t³ / 3)`,
//!
//! and less often on the other side. The p-value of every comparison carries this factor. With it, evidence −ln p ≈ t²/2 −
//! γ t³/3 grows only up to t = 1/γ, where the expansion ends; what lies beyond counts as if it lay there. (For few
//! replicates, t is the normal score of Student's or Welch's. A sample's skewness tends to be less than that of what it was
//! drawn from: half as much again is taken, which is what the law of false alarms needs for heavy tails.)
//!
//! A comparison is *inconclusive* if on one of the two sides even that would not be significant in its family, so that no
//! difference at all, however large, could have failed there: such comparisons are counted apart and are no passes. Roughly,
//! 1.5 γ must be below `(6 ln(1/level))^(−1/2)`, about 0.1. Since γ is at least the relative error, what rests on fewer than
//! some two hundred contributions is inconclusive.

use super::{Estimate, Rendered, is_everyday, seed};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// The probability with which a family of comparisons raises a false alarm, if all its null hypotheses hold. A third of it is
/// left to the image means, the blocks and what is compared beside them, each.
pub const FALSE_ALARM_RATE: f64 = 1e-3;

/// The probability with which a detectable bias is found.
pub const POWER: f64 = 0.8;

/// Normal scores beyond this count as this; their p-value is 10⁻²⁶⁸.
const FAR: f64 = 35.0;

/// Relative error of a mean for which arithmetic in `f32` is to blame, by rounding and by rays that are lost between points
/// which nearly touch: it neither shrinks with the samples nor shows in their variance. A three-hundredth of the smallest
/// bias that is looked for.
const ARITHMETIC: f64 = 1e-5;

/// What a sample's skewness is multiplied by for what it has not seen.
const UNSEEN: f64 = 1.5;

/// Comparisons that belong together: none may be significant after Šidák's correction for their number.
pub struct Family {
    name: String,
    rate: f64,
    images: Vec<Comparison>,
    blocks: Vec<Comparison>,
    spare: Vec<Comparison>,
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

    /// What [`ARITHMETIC`] may be to blame for.
    fn floor(&self) -> f64 {
        ARITHMETIC * self.a.mean.abs().max(self.b.mean.abs())
    }

    /// Standard error of the difference.
    fn error(&self) -> f64 {
        self.a.error.hypot(self.b.error).hypot(self.floor())
    }

    /// The difference in standard errors.
    fn t(&self) -> f64 {
        let difference = self.a.mean - self.b.mean;
        if difference == 0.0 { 0.0 } else { difference / self.error() }
    }

    /// Welch's degrees of freedom.
    fn freedom(&self) -> f64 {
        let share = |e: Estimate| e.error.powi(4) / e.freedom;
        self.error().powi(4) / (share(self.a) + share(self.b))
    }

    /// The skewness γ that makes it more likely that one estimate is far below the other: that of the lower towards small
    /// values, and that of the higher towards large ones, each by its share in the difference. If the two means are equal,
    /// the one nearer to zero has an error that is too small by as much as its mean.
    fn lean(&self, low: Estimate, high: Estimate) -> f64 {
        let (lean_low, lean_high) = (low.lean(), high.lean_upwards());
        if lean_low.is_infinite() || lean_high.is_infinite() || self.error() == 0.0 {
            return lean_low.max(lean_high);
        }
        let error_low = low.error * (high.mean / low.mean).max(1.0);
        let error_high = high.error * if high.mean < 0.0 { (low.mean / high.mean).max(1.0) } else { 1.0 };
        let both = error_low.hypot(error_high).hypot(self.floor());
        let (share_low, share_high) = ((error_low / both).powi(3), (error_high / both).powi(3));
        UNSEEN * (lean_low.max(0.0) * share_low + lean_high.max(0.0) * share_high)
    }

    /// The skewness on the side that the difference lies on.
    fn lean_here(&self) -> f64 {
        if self.a.mean < self.b.mean { self.lean(self.a, self.b) } else { self.lean(self.b, self.a) }
    }

    /// The greater of the skewnesses on both sides.
    fn lean_most(&self) -> f64 {
        self.lean(self.a, self.b).max(self.lean(self.b, self.a))
    }

    /// The normal score of the difference: where it stands in a normal distribution if it is where it is in Student's.
    fn z(&self) -> f64 {
        score(self.t(), self.freedom())
    }

    /// The p-value.
    pub fn p(&self) -> f64 {
        if self.is_of_nothing() {
            return if self.a.mean == self.b.mean { 1.0 } else { 0.0 };
        }
        p_of(self.z(), self.lean_here())
    }

    /// Whether nothing can arrive at all, so that a single contribution is an error: none is negative.
    fn is_of_nothing(&self) -> bool {
        [self.a, self.b].iter().any(|e| e.is_exact() && e.mean == 0.0)
    }

    /// Whether some difference to either side would be significant.
    pub fn is_conclusive(&self, level: f64) -> bool {
        self.is_of_nothing() || self.p() < level || p_of(FAR, self.lean_most()) < level
    }

    /// Relative difference that is significant with probability [`POWER`], to either side.
    pub fn detectable(&self, level: f64) -> f64 {
        if self.is_of_nothing() {
            return 0.0;
        }
        let (lean, freedom) = (self.lean_most(), self.freedom());
        let (mut low, mut high) = (0.0, 1e3);
        for _ in 0..60 {
            let t = (low + high) / 2.0;
            if p_of(score(t, freedom), lean) < level { high = t } else { low = t }
        }
        let power = Normal::standard().inverse_cdf(POWER);
        (high + power) * self.error() / self.a.mean.abs().max(self.b.mean.abs())
    }

    fn line(&self, level: f64) -> String {
        let Self { label, a, b } = self;
        let (z, lean) = (self.z(), self.lean_most());
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

/// The number that is as unlikely in a normal distribution as `t` is in Student's.
fn score(t: f64, freedom: f64) -> f64 {
    // Student's distribution is the normal one by then, and its tails are hard to compute.
    if t == 0.0 || freedom > 1e6 {
        return t.clamp(-FAR, FAR);
    }
    let tail = StudentsT::new(0.0, 1.0, freedom).unwrap().cdf(-t.abs());
    Normal::standard().inverse_cdf(tail.max(1e-300)).abs().min(FAR).copysign(t)
}

/// The p-value of a normal score on a side of this skewness.
fn p_of(z: f64, lean: f64) -> f64 {
    let z = z.abs().min(1.0 / lean).min(FAR);
    (2.0 * Normal::standard().cdf(-z) * (lean * z.powi(3) / 3.0).exp()).min(1.0)
}

impl Family {
    /// An empty family.
    pub fn new(name: impl Into<String>) -> Self {
        Self::with_rate(name, FALSE_ALARM_RATE)
    }

    /// An empty family with another false-alarm rate.
    pub fn with_rate(name: impl Into<String>, rate: f64) -> Self {
        Self { name: name.into(), rate, images: Vec::new(), blocks: Vec::new(), spare: Vec::new() }
    }

    /// Compares two means over images (or of other things that must be conclusive).
    pub fn image(&mut self, label: impl Into<String>, a: Estimate, b: Estimate) {
        push(&mut self.images, Comparison::new(label, a, b));
    }

    /// Compares two means over blocks of an image; a share of them may be inconclusive.
    pub fn block(&mut self, label: impl Into<String>, a: Estimate, b: Estimate) {
        push(&mut self.blocks, Comparison::new(label, a, b));
    }

    /// Compares two means of which nothing is expected but that they do not differ significantly.
    pub fn spare(&mut self, label: impl Into<String>, a: Estimate, b: Estimate) {
        push(&mut self.spare, Comparison::new(label, a, b));
    }

    /// Compares a layer over two images, and over `columns` × `columns` blocks of them.
    pub fn layer(&mut self, label: &str, layer: usize, columns: usize, a: &Rendered, b: &Rendered) {
        for (block, pixels) in a.blocks(columns).iter().enumerate() {
            self.block(format!("{label} block {block}"), a.over(layer, pixels), b.over(layer, pixels));
        }
        self.image(label, a.image(layer), b.image(layer));
    }

    /// How many comparisons are significant.
    pub fn significant(&self) -> usize {
        let parts = [&self.images, &self.blocks, &self.spare];
        parts.iter().map(|comparisons| Part::new(comparisons, self.rate).significant().len()).sum()
    }

    /// What does not hold, if anything: a comparison is significant, nothing was compared, or, with the seed and at least the budget of every
    /// day, an image mean is inconclusive or less than the share `conclusive` of the blocks is conclusive.
    ///
    /// What a sample's skewness leaves open is itself a matter of chance, of which no rate is stated: budgets are made so that with one seed enough
    /// is decided, and other seeds are asked for false alarms alone.
    pub fn verdict(&self, conclusive: f64) -> Result<(), String> {
        let parts = [&self.images, &self.blocks, &self.spare].map(|comparisons| Part::new(comparisons, self.rate));
        let [images, blocks, _] = &parts;
        println!("{}", self.name);
        for (part, name) in
            parts.iter().zip(["images", "blocks", "spare"]).filter(|(part, _)| !part.comparisons.is_empty())
        {
            println!("  {name}: {part}");
        }
        self.images.iter().for_each(|c| println!("{}", c.line(images.level)));
        if self.images.is_empty() {
            return Err(format!("{}: nothing was compared", self.name));
        }
        let significant: Vec<String> = parts.iter().flat_map(Part::significant).collect();
        if !significant.is_empty() {
            let (count, worst) = (significant.len(), significant[..significant.len().min(24)].concat());
            let Self { name, rate, .. } = self;
            return Err(format!("{name}: {count} differ, at a false-alarm rate of {rate} (seed {}):{worst}", seed()));
        }
        if !is_everyday() {
            return Ok(());
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

/// The image means of a family, the blocks, or the rest.
struct Part<'a> {
    comparisons: &'a [Comparison],
    /// The p-value below which one comparison is significant.
    level: f64,
}

impl<'a> Part<'a> {
    fn new(comparisons: &'a [Comparison], rate: f64) -> Self {
        let level = 1.0 - (1.0 - rate / 3.0).powf(1.0 / comparisons.len().max(1) as f64);
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
        let conclusive = self.comparisons.iter().filter(|c| c.is_conclusive(self.level) && c.error() > 1.1 * c.floor());
        let mut z: Vec<f64> = conclusive.map(Comparison::z).collect();
        if z.is_empty() {
            return Ok(());
        }
        z.sort_by(f64::total_cmp);
        let quantile = |q: f64| z[((z.len() - 1) as f64 * q).round() as usize];
        let beyond = |x: f64| 100.0 * z.iter().filter(|z| z.abs() > x).count() as f64 / z.len() as f64;
        let p = self.comparisons.iter().map(Comparison::p).fold(1.0, f64::min);
        let [least, low, middle, high, greatest] = [0.0, 0.25, 0.5, 0.75, 1.0].map(quantile);
        write!(
            f,
            ", smallest p {p:.1e}; z from {least:+.2} to {greatest:+.2}, quartiles {low:+.2} {middle:+.2} {high:+.2}, "
        )?;
        let [one, two, three] = [1.0, 2.0, 3.0].map(beyond);
        write!(f, "|z| > 1, 2, 3: {one:.1} %, {two:.1} %, {three:.2} % (normal: 31.7 %, 4.6 %, 0.27 %)")
    }
}
