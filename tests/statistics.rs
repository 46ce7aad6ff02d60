//! The statistics of a measurement are those of its replicates.
//!
//! The image has one pixel, so that every number can be worked out from the replicates' means, which are kept.
//! False-alarm rate of the last test: 0.1 %.

use crate::support::{Budget, builtin, measure, method};
use integrators::Measurement;
use statrs::distribution::{ChiSquared, ContinuousCDF};

fn one_pixel(name: &str, replicates: u32) -> Measurement {
    let mut scene = builtin("cornell_box", 8);
    scene.camera.set_size(1, 1);
    measure(&scene, method(name).as_ref(), name, Budget { samples: 4, replicates, ..Budget::samples(1).up_to(3) })
        .measurement
}

/// Sample covariance of two layers' replicate means, in the red channel.
fn covariance(m: &Measurement, i: usize, j: usize) -> f64 {
    let n = m.replicates as f64;
    let mean = |layer: usize| m.replicate_means.iter().map(|r| r[layer][0]).sum::<f64>() / n;
    let (a, b) = (mean(i), mean(j));
    m.replicate_means.iter().map(|r| (r[i][0] - a) * (r[j][0] - b)).sum::<f64>() / (n - 1.0)
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(b.abs()) + 1e-18
}

#[test]
fn variances_and_covariances_are_those_of_the_replicates() {
    for name in ["path", "light", "bdpt"] {
        // Not a whole number of groups.
        let m = one_pixel(name, 21);
        let layers = m.layers.len();
        let mut total = 0.0;
        for (i, j) in (0..layers).flat_map(|i| (0..layers).map(move |j| (i, j))) {
            let expected = covariance(&m, i, j);
            assert!(close(m.covariance[i * layers + j][0], expected), "{name}: covariance of orders {i} and {j}");
            total += expected;
        }
        for layer in 0..layers {
            let expected = covariance(&m, layer, layer);
            assert!(close(m.variance(layer, 0).unwrap()[0], expected), "{name}: variance of order {layer}");
            assert!(close(m.block_variance(layer, 0).unwrap()[0], expected), "{name}: block variance of order {layer}");
            let error = (expected / m.replicates as f64).sqrt();
            assert!(close(m.image_mean_error(layer).unwrap()[0], error), "{name}: standard error of order {layer}");
        }
        assert!(close(m.total_variance.unwrap()[0], total), "{name}: {:?} against {total}", m.total_variance);
    }
}

#[test]
fn one_replicate_has_no_variance() {
    let m = one_pixel("path", 1);
    assert_eq!((m.variance(0, 0), m.total_variance, m.image_mean_error(0)), (None, None, None));
    assert!(m.covariance.is_empty());
}

/// Replicates are independent: the variance of the mean of two halves is what the replicates' variance says.
#[test]
fn replicates_are_independent() {
    let m = one_pixel("path", 512);
    let values: Vec<f64> = m.replicate_means.iter().map(|r| r[1][0]).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    // Portmanteau test of the first 16 autocorrelations [Box & Pierce 1970].
    let correlation = |lag: usize| {
        let pairs = values.iter().zip(&values[lag..]);
        pairs.map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / ((n - 1.0) * variance)
    };
    let q: f64 = n * (1..=16).map(|lag| correlation(lag).powi(2)).sum::<f64>();
    let p = 1.0 - ChiSquared::new(16.0).unwrap().cdf(q);
    assert!(variance > 0.0 && p > 1e-3, "Q = {q}, p = {p}");
}
