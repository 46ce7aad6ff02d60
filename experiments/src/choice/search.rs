//! Which method for which layer: what a share of the work brings, and the best assignment.
//!
//! A run of method m for its layers S takes c(S) seconds a sample, and what it brings to the image's sum has the variance V(S) a sample, the
//! covariances between its layers included. With `n` samples of each run the sum has the variance `Σ V/n` after `Σ n c` seconds. Their product is
//! least for `n ∝ √(V/c)`, and is `(Σ √(V c))²` then (Cauchy and Schwarz): that is what is made small here. A method that may take more samples in
//! some cells of the image than in others counts with the mean of its cells' `√V` for √V, by the same inequality.

use std::collections::HashMap;

/// What is known of a method.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Whether it carries all light of a layer.
    pub carries: Vec<bool>,
    /// Covariances between layers of one sample, image and channel mean, `[i · layers + j]`.
    pub covariance: Vec<f64>,
    /// The same of the cells of a grid over the image, if it may have regions: see [`super::regions`].
    pub cells: Vec<Vec<f64>>,
    /// Seconds of a sample.
    pub cost: Cost,
}

/// What layers cost: the way to the last of them, which it shares with all before, and each by itself.
#[derive(Clone, Debug)]
pub struct Cost {
    /// Of a path as far as to the vertices of this layer.
    reach: Vec<f64>,
    /// Of what is done for this layer alone.
    each: Vec<f64>,
}

impl Cost {
    /// From the work of a sample that stops with each layer: `all` of it and of those before, and of the layer `alone`. What the layers
    /// before one add to it, `all − alone`, is what is done for each of these.
    pub fn new(all: &[f64], alone: &[f64]) -> Self {
        let before: Vec<f64> = all.iter().zip(alone).map(|(all, alone)| (all - alone).max(0.0)).collect();
        let last = before.len().saturating_sub(1);
        // What is done for the last layer can be told from no later one: as much as for the one before it.
        let each: Vec<f64> = (0..before.len())
            .map(|k| if k < last { before[k + 1] - before[k] } else { before[k] - before[k.saturating_sub(1)] })
            .map(|each| each.max(0.0))
            .collect();
        let reach = alone.iter().zip(&each).map(|(alone, each)| (alone - each).max(0.0)).collect();
        Self { reach, each }
    }

    /// The same in other units.
    pub fn times(&self, factor: f64) -> Self {
        let scaled = |values: &[f64]| values.iter().map(|x| x * factor).collect();
        Self { reach: scaled(&self.reach), each: scaled(&self.each) }
    }

    /// That of some layers together.
    pub fn of(&self, layers: &[usize]) -> f64 {
        let reach = layers.iter().map(|&k| self.reach[k]).fold(0.0, f64::max);
        reach + layers.iter().map(|&k| self.each[k]).sum::<f64>()
    }
}

/// The part of a cell's variance that is taken from the image's mean: few images may have missed what is rare in a cell.
const OF_ALL: f64 = 0.1;

impl Candidate {
    /// The variance of one sample's sum over some layers.
    pub fn variance(&self, layers: &[usize]) -> f64 {
        sum(&self.covariance, layers)
    }

    /// The same cell by cell, none of them taken to be far below the mean.
    pub fn variances(&self, layers: &[usize]) -> Vec<f64> {
        let mean = OF_ALL * self.variance(layers);
        self.cells.iter().map(|cell| (1.0 - OF_ALL) * sum(cell, layers) + mean).collect()
    }

    /// The root of variance times seconds, with the best samples for each cell.
    fn burden(&self, layers: &[usize]) -> f64 {
        let deviation = match self.cells.len() {
            0 => self.variance(layers).sqrt(),
            cells => self.variances(layers).iter().map(|v| v.sqrt()).sum::<f64>() / cells as f64,
        };
        deviation * self.cost.of(layers).sqrt()
    }
}

/// The sum of some layers' entries in a matrix of covariances.
fn sum(covariance: &[f64], layers: &[usize]) -> f64 {
    let count = covariance.len().isqrt();
    let pairs = layers.iter().flat_map(|&i| layers.iter().map(move |&j| (i, j)));
    pairs.map(|(i, j)| covariance[i * count + j]).sum::<f64>().max(0.0)
}

/// The layers that an assignment leaves to each candidate.
pub fn sets(assignment: &[usize], candidates: usize) -> Vec<Vec<usize>> {
    let of = |m: usize| (0..assignment.len()).filter(|&k| assignment[k] == m).collect();
    (0..candidates).map(of).collect()
}

/// Burdens of assignments, each set's found once.
struct Burdens<'a> {
    candidates: &'a [Candidate],
    known: HashMap<(usize, Vec<usize>), f64>,
}

impl Burdens<'_> {
    /// The root of variance times seconds.
    fn of(&mut self, assignment: &[usize]) -> f64 {
        let mut burden = 0.0;
        for (m, set) in sets(assignment, self.candidates.len()).into_iter().enumerate().filter(|(_, s)| !s.is_empty()) {
            let candidate = &self.candidates[m];
            burden += *self.known.entry((m, set)).or_insert_with_key(|(_, set)| candidate.burden(set));
        }
        burden
    }
}

/// The best candidate for every layer, and the best of those that carry all; `Err` of a layer that none carries.
///
/// From every assignment of the lower layers to one candidate and the higher ones to another it goes down, by giving a stretch of layers to another candidate, until no such change is for the
/// better. (That finds what trying all assignments finds in nearly all cases: see the tests.)
pub fn best(candidates: &[Candidate]) -> Result<(Vec<usize>, Option<usize>), usize> {
    let layers = candidates.first().map_or(0, |c| c.carries.len());
    let carriers = |k: usize| (0..candidates.len()).filter(move |&m| candidates[m].carries[k]);
    if let Some(lost) = (0..layers).find(|&k| carriers(k).next().is_none()) {
        return Err(lost);
    }
    let whole = |m: &usize| candidates[*m].carries.iter().all(|&c| c);
    let all: Vec<usize> = (0..layers).collect();
    let alone = |m: usize| candidates[m].variance(&all) * candidates[m].cost.of(&all);
    let single = (0..candidates.len()).filter(whole).min_by(|&a, &b| alone(a).total_cmp(&alone(b)));
    // One candidate as far as to a layer, another from there on; where they do not carry it, the first that does.
    let start = |(first, second, cut): (usize, usize, usize)| -> Vec<usize> {
        let of = |k: usize| if k < cut { first } else { second };
        (0..layers)
            .map(|k| if candidates[of(k)].carries[k] { of(k) } else { carriers(k).next().unwrap_or(of(k)) })
            .collect()
    };
    let every = 0..candidates.len();
    let pairs = every.clone().flat_map(|first| every.clone().map(move |second| (first, second)));
    let starts = pairs.flat_map(|(first, second)| (0..layers.max(1)).map(move |cut| (first, second, cut)));
    let mut burdens = Burdens { candidates, known: HashMap::new() };
    let found = starts.map(|of| descend(&mut burdens, start(of))).min_by(|a, b| a.1.total_cmp(&b.1));
    Ok((found.unwrap_or_default().0, single))
}

/// Changes an assignment for the better until it is the best of all that differ from it by one change; gives it with its burden.
fn descend(burdens: &mut Burdens, mut assignment: Vec<usize>) -> (Vec<usize>, f64) {
    let (layers, candidates) = (assignment.len(), burdens.candidates);
    let mut least = burdens.of(&assignment);
    loop {
        let mut better = None;
        for (first, last) in (0..layers).flat_map(|first| (first..layers).map(move |last| (first, last))) {
            for (m, candidate) in candidates.iter().enumerate() {
                if !(first..=last).all(|k| candidate.carries[k]) {
                    continue;
                }
                let mut changed = assignment.clone();
                changed[first..=last].fill(m);
                let burden = burdens.of(&changed);
                // Not by rounding alone.
                if burden < least * (1.0 - 1e-12) {
                    (least, better) = (burden, Some(changed));
                }
            }
        }
        match better {
            Some(changed) => assignment = changed,
            None => return (assignment, least),
        }
    }
}

/// Shares of the samples: `n ∝ √(V/c)`, at least a thousandth of the greatest, for a variance that a pilot did not see is none that is known
/// to be zero. They add up to one.
pub fn shares(runs: &[(f64, f64)]) -> Vec<f64> {
    const LEAST: f64 = 1e-3;
    let raw: Vec<f64> = runs.iter().map(|(variance, cost)| (variance / cost.max(1e-12)).sqrt()).collect();
    let most = raw.iter().copied().fold(0.0, f64::max);
    let kept: Vec<f64> = raw.iter().map(|x| if most > 0.0 { x.max(LEAST * most) } else { 1.0 }).collect();
    let sum: f64 = kept.iter().sum();
    kept.into_iter().map(|x| x / sum).collect()
}

/// Variance times seconds of runs of `(variance, seconds)` a sample, with these shares of the samples.
pub fn product(runs: &[(f64, f64)], shares: &[f64]) -> f64 {
    let variance: f64 = runs.iter().zip(shares).map(|((v, _), share)| v / share).sum();
    let seconds: f64 = runs.iter().zip(shares).map(|((_, c), share)| c * share).sum();
    variance * seconds
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::rng::{Stream, mix2};

    fn candidate(variances: &[f64], cost: Cost) -> Candidate {
        let n = variances.len();
        let covariance = (0..n * n).map(|i| if i / n == i % n { variances[i / n] } else { 0.0 }).collect();
        Candidate { carries: vec![true; n], covariance, cells: Vec::new(), cost }
    }

    #[test]
    fn a_shared_way_is_paid_for_once() {
        // Four rays to reach a layer more, one for the layer itself.
        let all: Vec<f64> = (1..=4).map(|k| f64::from(5 * k)).collect();
        let alone: Vec<f64> = (1..=4).map(|k| f64::from(4 * k + 1)).collect();
        let cost = Cost::new(&all, &alone);
        for (layers, expected) in [(vec![0], 5.0), (vec![3], 17.0), (vec![0, 1, 2, 3], 20.0), (vec![1, 3], 18.0)] {
            assert!((cost.of(&layers) - expected).abs() < 1e-12, "{layers:?}: {}", cost.of(&layers));
        }
        assert!((cost.times(2.0).of(&[0]) - 10.0).abs() < 1e-12);
    }

    #[test]
    fn shares_are_those_of_least_variance_at_equal_time() {
        let runs = [(4.0, 1.0), (1.0, 4.0), (0.3, 0.2)];
        let best = shares(&runs);
        let expected = runs.iter().map(|(v, c)| (v * c).sqrt()).sum::<f64>().powi(2);
        assert!((product(&runs, &best) / expected - 1.0).abs() < 1e-12);
        for i in 0..3 {
            let mut other = best.clone();
            other[i] *= 1.1;
            assert!(product(&runs, &other) > product(&runs, &best));
        }
        assert_eq!(shares(&[(0.0, 1.0), (0.0, 1.0)]), [0.5, 0.5]);
    }

    #[test]
    fn each_layer_goes_to_the_candidate_that_is_best_at_it() {
        let cost = || Cost::new(&[1.0, 2.0, 3.0], &[1.0, 1.5, 2.0]);
        let found = best(&[candidate(&[100.0, 1e-4, 1.0], cost()), candidate(&[1e-4, 100.0, 1.0], cost())]).unwrap();
        assert_eq!((&found.0[..2], found.1), (&[1, 0][..], Some(0)));
        let mut lacks = candidate(&[0.0; 3], cost());
        lacks.carries[2] = false;
        assert_eq!(best(&[lacks.clone()]), Err(2));
        assert_eq!(best(&[lacks, candidate(&[1.0; 3], cost())]), Ok((vec![0, 0, 1], Some(1))));
    }

    /// Two candidates with the same mean variance: the one whose variance lies in half of the cells is worth more, by nearly √2 in deviation, yet not
    /// as a method by itself.
    #[test]
    fn samples_where_they_are_needed_are_worth_more() {
        let even = candidate(&[1.0], Cost::new(&[1.0], &[1.0]));
        let half = Candidate { cells: vec![vec![0.0], vec![2.0]], ..even.clone() };
        let expected = 0.5 * (0.1_f64.sqrt() + (0.9 * 2.0 + 0.1_f64).sqrt());
        assert!((half.burden(&[0]) - expected).abs() < 1e-12 && even.burden(&[0]) == 1.0);
        assert_eq!(best(&[even, half]), Ok((vec![1], Some(0))));
    }

    /// Random candidates, against all 4⁶ assignments: of 200 the same burden in all but a few, and never 2 % more.
    #[test]
    fn going_down_finds_the_best_of_all_assignments() {
        let mut missed = 0;
        for case in 0..200 {
            let mut random = Stream::new(mix2(7, case), 0);
            let mut positive = || (4.0 * f64::from(random.next_f32()) - 2.0).exp();
            let candidates: Vec<Candidate> = (0..4)
                .map(|_| {
                    let variances: Vec<f64> = (0..6).map(|_| positive()).collect();
                    let steps: Vec<(f64, f64)> = (0..6).map(|_| (positive(), positive())).collect();
                    let sum = |k: usize, of: &dyn Fn(&(f64, f64)) -> f64| steps[..=k].iter().map(of).sum::<f64>();
                    let all: Vec<f64> = (0..6).map(|k| sum(k, &|s| s.0 + s.1)).collect();
                    let alone: Vec<f64> = (0..6).map(|k| sum(k, &|s| s.0) + steps[k].1).collect();
                    candidate(&variances, Cost::new(&all, &alone))
                })
                .collect();
            let mut burdens = Burdens { candidates: &candidates, known: HashMap::new() };
            let found = burdens.of(&best(&candidates).unwrap().0);
            let every = (0..4_usize.pow(6)).map(|code| (0..6).map(|k| code / 4_usize.pow(k) % 4).collect::<Vec<_>>());
            let least = every.map(|assignment| burdens.of(&assignment)).fold(f64::INFINITY, f64::min);
            assert!(found < 1.02 * least, "case {case}: {found} instead of {least}");
            missed += usize::from(found > least * (1.0 + 1e-9));
        }
        assert!(missed <= 10, "{missed} of 200");
    }
}
