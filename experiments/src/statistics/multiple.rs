//! Many tests at once.

use sampling::fault;

/// p-values adjusted for their number, so that those at most q are discoveries at the rate q [Benjamini & Hochberg 1995].
pub fn benjamini_hochberg(p: &[f64]) -> Vec<f64> {
    let rising = rising(p);
    let mut adjusted = vec![1.0; p.len()];
    let mut smallest: f64 = 1.0;
    for (rank, &i) in rising.iter().enumerate().rev() {
        let tests = fault!("many_tests_taken_for_one", p.len() as f64 / (rank + 1) as f64, 1.0);
        smallest = smallest.min(p[i] * tests);
        adjusted[i] = smallest;
    }
    adjusted
}

/// The level of each of `tests` independent tests at which all of them together raise a false alarm with probability `rate`
/// [Šidák 1967].
pub fn sidak_level(rate: f64, tests: usize) -> f64 {
    -((-rate).ln_1p() / tests.max(1) as f64).exp_m1()
}

/// Indices in the order of rising p.
fn rising(p: &[f64]) -> Vec<usize> {
    let mut rising: Vec<usize> = (0..p.len()).collect();
    rising.sort_by(|&i, &j| p[i].total_cmp(&p[j]));
    rising
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adjusted_values_are_those_of_r() {
        // p.adjust(c(0.01, 0.04, 0.03, 0.005, 0.5), "BH")
        let p = [0.01, 0.04, 0.03, 0.005, 0.5];
        let (found, expected) = (benjamini_hochberg(&p), [0.025, 0.05, 0.05, 0.025, 0.5]);
        assert!(found.iter().zip(expected).all(|(x, y)| (x - y).abs() < 1e-12), "{found:?}");
        assert!(benjamini_hochberg(&[]).is_empty());
    }

    #[test]
    fn levels_are_sidaks() {
        assert_eq!(sidak_level(0.05, 1), 0.05);
        assert!((sidak_level(0.05, 10) - 0.005_116_196_891_823_743).abs() < 1e-15);
        assert!((sidak_level(1e-12, 1000) - 1e-15).abs() < 1e-20);
    }
}
