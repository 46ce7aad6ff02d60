//! Discrete choice in constant time by Walker's alias method, after Vose `[Vose91]`.

use crate::distribution::{DistributionError, GRID, apportion};

/// A choice among `n` with given probabilities.
///
/// Built on whole numbers of 24-bit random numbers, see [`distribution`](crate::distribution): the stated pmf is to the
/// bit the one that is sampled.
#[derive(Clone, Debug)]
pub struct AliasTable {
    buckets: Vec<Bucket>,
    /// Of the 2²⁴ random numbers, how many choose each index.
    counts: Vec<u32>,
}

/// The random numbers `start..split` choose the bucket's own index, those from `split` to the next bucket its alias.
#[derive(Clone, Copy, Debug)]
struct Bucket {
    start: u32,
    split: u32,
    alias: u32,
}

impl AliasTable {
    /// The choice with probabilities proportional to the weights.
    pub fn new(weights: &[f64]) -> Result<Self, DistributionError> {
        let counts = apportion(weights)?;
        let n = counts.len();
        // The first random number whose product with n reaches b · 2²⁴.
        let start = |b: usize| ((b as u64 * u64::from(GRID)).div_ceil(n as u64)) as u32;
        let mut left = counts.clone();
        let mut buckets: Vec<Bucket> =
            (0..n).map(|b| Bucket { start: start(b), split: start(b + 1), alias: b as u32 }).collect();
        let capacity = |b: usize| start(b + 1) - start(b);
        let mut small: Vec<usize> = (0..n).filter(|&i| counts[i] < capacity(i)).collect();
        let mut large: Vec<usize> = (0..n).filter(|&i| counts[i] > capacity(i)).collect();
        while let Some(poor) = small.pop() {
            // What the poor one lacks, a rich one gives; it has at least that, since capacities differ by one at most.
            // Sums are exact, so there is a rich one as long as there is a poor one.
            let rich = *large.last().expect("the counts sum to the capacities");
            buckets[poor].split = buckets[poor].start + left[poor];
            buckets[poor].alias = rich as u32;
            left[rich] -= capacity(poor) - left[poor];
            if left[rich] <= capacity(rich) {
                large.pop();
            }
            if left[rich] < capacity(rich) {
                small.push(rich);
            }
        }
        Ok(Self { buckets, counts })
    }

    /// The number of entries to choose from.
    #[inline]
    #[expect(clippy::len_without_is_empty, reason = "a table is never empty")]
    pub fn len(&self) -> usize {
        self.counts.len()
    }

    /// An index, its probability, and a number in [0, 1) left over, uniform given the index.
    ///
    /// The left-over number is as coarse as 1 / (2²⁴ · share of the table's bucket): good for a further choice.
    #[inline]
    pub fn sample(&self, uc: f32) -> (usize, f32, f32) {
        let position = uc * GRID as f32;
        let number = position as u32;
        let own = ((u64::from(number) * self.buckets.len() as u64) >> 24) as usize;
        let bucket = self.buckets[own];
        let end = self.buckets.get(own + 1).map_or(GRID, |next| next.start);
        let (index, from, to) = if number < bucket.split {
            (own, bucket.start, bucket.split)
        } else {
            (bucket.alias as usize, bucket.split, end)
        };
        let rest = (position - from as f32) / (to - from) as f32;
        (index, self.pmf(index), rest.min(1.0_f32.next_down()))
    }

    /// The probability of an index.
    #[inline]
    pub fn pmf(&self, index: usize) -> f32 {
        self.counts[index] as f32 / GRID as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(weights: &[f64]) {
        let table = AliasTable::new(weights).expect("good weights");
        let total: f64 = weights.iter().sum();
        let mut hits = vec![0_u32; weights.len()];
        for i in 0..GRID {
            let (index, pmf, rest) = table.sample(i as f32 / GRID as f32);
            hits[index] += 1;
            assert!(pmf > 0.0 && (0.0..1.0).contains(&rest), "{i}: {index} {pmf} {rest}");
        }
        for (i, w) in weights.iter().enumerate() {
            assert_eq!(hits[i] as f32 / GRID as f32, table.pmf(i), "what is stated is what is sampled");
            let off = (f64::from(table.pmf(i)) - w / total).abs() * f64::from(GRID);
            assert!(off < weights.len() as f64 + 1.0, "weight {i} of {}: off by {off} numbers", weights.len());
            assert_eq!(table.pmf(i) > 0.0, *w > 0.0);
        }
    }

    #[test]
    fn what_is_stated_is_what_is_sampled() {
        check(&[1.0]);
        check(&[0.0, 1.0, 0.0]);
        check(&[1.0, 2.0, 3.0, 4.0]);
        check(&[1e-12, 1.0, 1e-12]);
        check(&(0..1000).map(|i| f64::from(i % 17) * f64::from(i)).collect::<Vec<_>>());
    }

    #[test]
    fn the_number_left_over_is_uniform() {
        let table = AliasTable::new(&[0.2, 0.5, 0.3]).expect("good weights");
        let mut bins = [[0.0_f64; 8]; 3];
        let n = 1 << 20;
        for i in 0..n {
            let (index, pmf, rest) = table.sample((i as f32 + 0.5) / n as f32);
            bins[index][(rest * 8.0) as usize] += 8.0 / (f64::from(pmf) * f64::from(n));
        }
        assert!(bins.iter().flatten().all(|b| (b - 1.0).abs() < 0.01), "{bins:?}");
    }

    #[test]
    fn bad_weights_are_errors() {
        assert_eq!(AliasTable::new(&[]).err(), Some(DistributionError::Empty));
        assert_eq!(AliasTable::new(&[0.0]).err(), Some(DistributionError::AllZero));
    }
}
