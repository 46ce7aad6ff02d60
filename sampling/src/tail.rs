//! How heavy is the tail of what an estimator adds up? A histogram of magnitudes with power sums, and what follows from it.
//!
//! A mean of independent values has an error bar only if their variance is finite, and that cannot be seen from the sample variance,
//! which always is. It can be seen from the tail: where `P(X > x) ~ x^(−α)`, the variance is infinite for α ≤ 2.

use serde::{Deserialize, Serialize};

/// Bins of an octave.
const PARTS: usize = 4;
/// The exponents that have bins of their own: from 2⁻⁹⁶ to 2⁹⁶. What is smaller or larger goes to the first or last of them.
const LEAST: i32 = -96;
/// How many of them.
const OCTAVES: usize = 192;
/// Bits of a mantissa that say which part of an octave a value is in.
const PART_BITS: u32 = PARTS.trailing_zeros();

/// Magnitudes in quarters of an octave, `[2^e (1 + j/4), 2^e (1 + (j + 1)/4))`, with the power sums of all of them.
///
/// Sums are in f64 in the order of the calls: tails that are added and merged in the same order have the same bits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tail {
    /// All values, zeros included.
    pub count: u64,
    /// Σ x, Σ x², Σ x³, Σ x⁴.
    pub sums: [f64; 4],
    /// Values and their Σ x², by bin; empty before the first value, so that what is never used takes no memory.
    bins: Vec<Bin>,
}

/// What fell into a bin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Bin {
    count: u64,
    square: f64,
}

impl Bin {
    /// Mean square of the largest share f of the values in the i-th bin, if their quantiles from the largest on are
    /// `b − (b − a) f^γ`, between the squared ends a and b, with the γ that gives the bin's mean.
    fn mean_square_of_top(&self, i: usize, share: f64) -> f64 {
        let mean = self.square / self.count as f64;
        let [a, b] = [lower_end(i), lower_end(i + 1)].map(|end| end * end);
        if !(a..b).contains(&mean) {
            return mean;
        }
        let power = (b - a) / (b - mean) - 1.0;
        b - (b - mean) * share.powf(power)
    }
}

/// What the tail says of the variance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Variance {
    /// Too few large values to say anything.
    Unknown,
    /// No sign of an infinite variance.
    Finite,
    /// The tail falls so slowly that the variance looks infinite: error bars cannot be trusted.
    Infinite,
}

/// The part of the values that the upper tail is taken to be, at most.
const UPPER: f64 = 0.01;
/// The part of them that its far end is.
const FAR: f64 = 1e-4;
/// The number of values in it from which on anything is said.
const ENOUGH: u64 = 50;
/// The quantile of the normal distribution that is exceeded with the probability of a false alarm, 10⁻³.
const SURE: f64 = 3.09;

impl Default for Tail {
    fn default() -> Self {
        Self { count: 0, sums: [0.0; 4], bins: Vec::new() }
    }
}

impl Tail {
    /// The number, count and Σ x² of every bin that holds anything, to be kept.
    pub fn bins(&self) -> impl Iterator<Item = (usize, u64, f64)> {
        let full = self.bins.iter().enumerate().filter(|(_, bin)| bin.count > 0);
        full.map(|(i, bin)| (i, bin.count, bin.square))
    }

    /// The tail of which these were kept; `None` if there is no such bin.
    pub fn of(count: u64, sums: [f64; 4], bins: impl Iterator<Item = (usize, u64, f64)>) -> Option<Self> {
        let mut tail = Self { count, sums, bins: Vec::new() };
        for (i, count, square) in bins {
            if tail.bins.is_empty() {
                tail.bins = vec![Bin::default(); OCTAVES * PARTS];
            }
            *tail.bins.get_mut(i)? = Bin { count, square };
        }
        Some(tail)
    }

    /// Adds one magnitude x ≥ 0.
    #[inline]
    pub fn add(&mut self, x: f64) {
        debug_assert!(x >= 0.0 && x.is_finite(), "a magnitude, not {x}");
        self.count += 1;
        if x == 0.0 {
            return;
        }
        let square = x * x;
        self.sums[0] += x;
        self.sums[1] += square;
        self.sums[2] += square * x;
        self.sums[3] += square * square;
        if self.bins.is_empty() {
            self.bins = vec![Bin::default(); OCTAVES * PARTS];
        }
        let bin = &mut self.bins[index(x)];
        bin.count += 1;
        bin.square += square;
    }

    /// Adds so many values of zero, such as samples that brought nothing.
    #[inline]
    pub fn add_zeros(&mut self, count: u64) {
        self.count += count;
    }

    /// Adds all that `other` has seen.
    pub fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.sums.iter_mut().zip(other.sums).for_each(|(sum, other)| *sum += other);
        if self.bins.is_empty() {
            self.bins.clone_from(&other.bins);
            return;
        }
        for (bin, other) in self.bins.iter_mut().zip(&other.bins) {
            bin.count += other.count;
            bin.square += other.square;
        }
    }

    /// Excess-free kurtosis `E(x − m)⁴ / Var²` of all values, 3 for normal ones; `None` where they have no variance but rounding.
    ///
    /// The sample's, which is at most n: where the fourth moment is infinite it grows with the samples and estimates nothing.
    pub fn kurtosis(&self) -> Option<f64> {
        let n = self.count as f64;
        let [m, m2, m3, m4] = self.sums.map(|sum| sum / n);
        let variance = m2 - m * m;
        let fourth = m4 - 4.0 * m * m3 + 6.0 * m * m * m2 - 3.0 * m.powi(4);
        (variance > 1e-9 * m2).then(|| fourth / (variance * variance))
    }

    /// The part of Σ x² that the largest `share` of all values hold; `None` where all are zero, or that many values are none.
    ///
    /// Within the bin that the limit lies in, the quantiles of squares are taken to fall like a power of the share from its upper
    /// end to its lower one; the answer errs by a few percent of itself.
    pub fn second_moment_of_top(&self, share: f64) -> Option<f64> {
        let mut left = share * self.count as f64;
        if left < 1.0 || self.sums[1] == 0.0 {
            return None;
        }
        let mut square = 0.0;
        for (i, bin) in self.bins.iter().enumerate().rev().filter(|(_, bin)| bin.count > 0) {
            let taken = left.min(bin.count as f64);
            square += taken * bin.mean_square_of_top(i, taken / bin.count as f64);
            left -= taken;
            if left <= 0.0 {
                break;
            }
        }
        Some((square / self.sums[1]).min(1.0))
    }

    /// Hill's estimate of the index α of the upper tail, and the number k of values that it rests on; its standard error is
    /// `α/√k` `[Hill75]`. `None` where the tail holds too few values.
    ///
    /// The tail is made of the largest values, up to a hundredth of all, down to the lower end u of a bin: the mean of `ln(x/u)`
    /// over them is 1/α. The mean logarithm m of a bin's values is r, that of their root mean square, less their variance. Between the bin's ends a
    /// and b this is at most `(m − a)(b − m)` `[BhatiaDavis00]`, and a third of that where they are spread evenly; r, which is hardly more than m,
    /// stands for it. Infinite if all of the tail is one value at a bin's lower end.
    pub fn index(&self) -> Option<(f64, u64)> {
        self.indices().last()
    }

    /// Hill's estimates from ever longer parts of the upper tail, up to a hundredth of all values.
    fn indices(&self) -> impl Iterator<Item = (f64, u64)> {
        let (mut chosen, mut logs) = (0, 0.0);
        let bins = self.bins.iter().enumerate().rev().filter(|(_, bin)| bin.count > 0);
        let hill = bins.map(move |(i, bin)| {
            chosen += bin.count;
            let [a, b] = [lower_end(i), lower_end(i + 1)].map(f64::ln);
            let r = (0.5 * (bin.square / bin.count as f64).ln()).clamp(a, b);
            logs += bin.count as f64 * (r - (r - a) * (b - r) / 3.0);
            (chosen as f64 / (logs - chosen as f64 * a).max(0.0), chosen)
        });
        let most = UPPER * self.count as f64;
        hill.take_while(move |&(_, chosen)| chosen as f64 <= most).filter(|&(_, chosen)| chosen >= ENOUGH)
    }

    /// The index of the far end of the tail: of the largest ten-thousandth of all values, or of as few as say anything.
    fn far_index(&self) -> Option<f64> {
        let far = FAR * self.count as f64;
        self.indices().find(|&(_, chosen)| chosen as f64 >= far).map(|(index, _)| index)
    }

    /// Whether the variance looks infinite: α is below 2, and would be with a probability of at most 10⁻³ if it were 2; and the far
    /// end of the tail, where values that fall slowly over a wide range may still have a bound, does not contradict it.
    ///
    /// For an exact power, `k α/α̂` is a sum of k exponential values; its quantile is that of `[WilsonHilferty31]`.
    ///
    /// False alarms: where `P(X > x)` is exactly a power of index α ≥ 2 beyond the tail's start, at most 10⁻³, and fewer the larger α
    /// is; where the tail falls faster than any power, as that of exponential values, none to speak of. A lognormal tail looks like a power
    /// of index 2.95/σ beyond its upper hundredth: for σ up to 1.4 its variance is called finite, for σ = 2 often infinite, which it is not;
    /// but error bars are as little to be trusted then.
    pub fn variance(&self) -> Variance {
        match self.index() {
            None => Variance::Unknown,
            Some((alpha, k)) => {
                let k = k as f64;
                let most = (1.0 - 1.0 / (9.0 * k) + SURE / (3.0 * k.sqrt())).powi(3);
                let bounded = self.far_index() >= Some(2.0);
                if alpha * most < 2.0 && !bounded { Variance::Infinite } else { Variance::Finite }
            }
        }
    }
}

/// The bin of a positive value: its exponent and the first bits of its mantissa.
#[inline]
fn index(x: f64) -> usize {
    let bits = (x.to_bits() >> (52 - PART_BITS)) as i64;
    let first = i64::from(1023 + LEAST) << PART_BITS;
    (bits - first).clamp(0, (OCTAVES * PARTS - 1) as i64) as usize
}

/// The least value of a bin.
fn lower_end(index: usize) -> f64 {
    let (octave, part) = (index / PARTS, index % PARTS);
    2.0_f64.powi(octave as i32 + LEAST) * (1.0 + part as f64 / PARTS as f64)
}

#[cfg(test)]
mod tests;
