//! How variance falls with samples: checkpoints, a line through them in log–log, and intervals for both.

use crate::result::{Checkpoint, MethodResult, SlopeRow};
use crate::statistics::positive::{self, Stratum, power_product, recursion};
use crate::statistics::slopes::{self, Line, Point};
use integrators::{Layer, stored};

/// Variation below this part of the mean is rounding of `f32`, and no slope is fitted to it.
const ROUNDING: f64 = 1e-6;

/// Squared deviations of independent images, one replicate at a time.
///
/// Replicate `r` adds `(r − 1)/r · (x_r − x̄_{r−1})²`, with `x̄_{r−1}` the mean of those before it: the square of a *recursive
/// residual* [Brown, Durbin & Evans 1975, (2)]. The residuals are uncorrelated between replicates, each square has the variance as
/// its expectation, and the mean of the R − 1 of them is exactly the sample variance \[Welford62\]. So an interval of the
/// variance can be made from them (see [`positive`]), and no image but the mean has to be kept.
pub struct Deviations {
    pixels: usize,
    layers: usize,
    count: usize,
    /// Mean image, `[pixel][layer][channel]`.
    mean: Vec<f64>,
    /// `[layer][replicate − 1]`, the layers' sum last: image and channel means.
    squares: Vec<Vec<f64>>,
}

stored!(Deviations { pixels, layers, count, mean, squares });

impl Deviations {
    /// No replicates yet.
    pub fn new(pixels: usize, layers: usize) -> Self {
        Self { pixels, layers, count: 0, mean: vec![0.0; pixels * layers * 3], squares: vec![Vec::new(); layers + 1] }
    }

    /// Adds a replicate's image, given by layer and pixel.
    pub fn push(&mut self, image: impl Fn(usize, usize) -> [f64; 3]) {
        self.count += 1;
        let r = self.count as f64;
        let mut sums = vec![0.0; self.layers + 1];
        for pixel in 0..self.pixels {
            let mut total = [0.0; 3];
            for (layer, sum) in sums[..self.layers].iter_mut().enumerate() {
                let value = image(layer, pixel);
                let at = (pixel * self.layers + layer) * 3;
                for (c, mean) in self.mean[at..at + 3].iter_mut().enumerate() {
                    let deviation = value[c] - *mean;
                    *mean += deviation / r;
                    *sum += deviation * deviation;
                    total[c] += deviation;
                }
            }
            sums[self.layers] += total.iter().map(|d| d * d).sum::<f64>();
        }
        if self.count < 2 {
            return;
        }
        let scale = (r - 1.0) / r / (3 * self.pixels) as f64;
        self.squares.iter_mut().zip(sums).for_each(|(squares, sum)| squares.push(sum * scale));
    }

    /// The checkpoint of every layer, and of their sum last. `seconds` is the wall time of each replicate.
    pub fn checkpoints(self, samples: u32, seconds: &[f64], layers: &[Layer]) -> Vec<Checkpoint> {
        let mut means = vec![0.0; self.layers + 1];
        for (i, value) in self.mean.iter().enumerate() {
            means[i / 3 % self.layers] += value / (3 * self.pixels) as f64;
        }
        means[self.layers] = means[..self.layers].iter().sum();
        let orders = layers.iter().map(|&layer| Some(layer)).chain([None]);
        let rows = orders.zip(self.squares).zip(means).enumerate();
        rows.map(|(i, ((order, squares), mean))| Checkpoint {
            samples,
            replicates: self.count as u32,
            seconds: average(seconds),
            replicate_seconds: seconds.get(1..).unwrap_or_default().to_vec(),
            order,
            variance: average(&squares),
            ci: interval(&squares, recursion(squares.len()), u64::from(samples) << 32 | i as u64),
            mean,
            replicate_variances: squares,
        })
        .collect()
    }
}

/// A checkpoint of one integral of known value, from every replicate's mean squared error.
pub fn checkpoint_of_squares(samples: u32, seconds: f64, mean: f64, squares: Vec<f64>) -> Checkpoint {
    Checkpoint {
        samples,
        replicates: squares.len() as u32,
        seconds,
        replicate_seconds: Vec::new(),
        order: None,
        variance: average(&squares),
        ci: interval(&squares, 1.0, u64::from(samples) << 32),
        mean,
        replicate_variances: squares,
    }
}

/// The 95 % interval of a checkpoint's variance; NaN where nothing varies.
fn interval(squares: &[f64], scale: f64, salt: u64) -> (f64, f64) {
    power_product(&[Stratum::new(vec![(1.0, squares)])], scale, salt).map_or((f64::NAN, f64::NAN), |(_, ci)| ci)
}

/// Root of the ratio of two checkpoints' variances, the first over the second, with its 95 % interval, for which replicates are
/// drawn in pairs. `None` where either has no variance but rounding.
pub fn rmse_ratio(point: &Checkpoint, baseline: &Checkpoint) -> Option<(f64, (f64, f64))> {
    let (a, b) = (&point.replicate_variances, &baseline.replicate_variances);
    if !has_variance(point) || !has_variance(baseline) || a.len() != b.len() {
        return None;
    }
    let ratio = positive::rmse_ratio(a, b, u64::from(point.samples));
    Some((ratio.value, ratio.interval?))
}

/// Whether more than rounding varies, in two values or more.
fn has_variance(point: &Checkpoint) -> bool {
    point.variance > (ROUNDING * point.mean).powi(2) && point.replicate_variances.len() >= 2
}

/// The lines through the checkpoints of a method: one per layer, and the layers' sum last. Layers without variance have none.
pub fn slopes(result: &MethodResult) -> Vec<SlopeRow> {
    let layers = result.measurement.layers.iter().map(|&layer| Some(layer)).chain([None]);
    let fitted = layers.filter_map(|order| {
        let points: Vec<&Checkpoint> = result.convergence.iter().filter(|point| point.order == order).collect();
        let (line, on_seconds) = (fit(&points)?, fit_on_seconds(&points));
        Some(SlopeRow {
            scene: result.scene.clone(),
            label: result.label.clone(),
            order,
            slope: line.slope,
            ci: line.ci,
            intercept: line.intercept,
            points: line.points,
            on_seconds,
        })
    });
    fitted.collect()
}

/// The line through the checkpoints that have any variance; `None` for fewer than two of them.
pub fn fit(points: &[&Checkpoint]) -> Option<Line> {
    let points = points.iter().filter(|p| has_variance(p));
    let points: Vec<Point> = points
        .map(|p| Point { samples: f64::from(p.samples), squares: &p.replicate_variances, seconds: &[] })
        .collect();
    slopes::line(&points, points.len() as u64)
}

/// The same against seconds; `None` too where those were not measured.
fn fit_on_seconds(points: &[&Checkpoint]) -> Option<Line> {
    let timed = points.iter().filter(|p| has_variance(p) && p.replicate_seconds.len() == p.replicate_variances.len());
    let points: Vec<Point> = timed
        .map(|p| Point {
            samples: f64::from(p.samples),
            squares: &p.replicate_variances,
            seconds: &p.replicate_seconds,
        })
        .collect();
    slopes::line(&points, points.len() as u64)
}

fn average(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::moments::Moments;
    use sampling::rng::{Stream, mix2};

    /// A standard normal value [Box & Muller 1958].
    fn normal(stream: &mut Stream) -> f64 {
        let mut uniform = || f64::from(stream.next_u32()) / f64::from(u32::MAX);
        let (u, v) = (uniform().max(1e-12), uniform());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    fn checkpoint(samples: u32, variance: f64, stream: &mut Stream) -> Checkpoint {
        let mut deviations = Deviations::new(4, 1);
        (0..32).for_each(|_| {
            let image: Vec<[f64; 3]> = (0..4).map(|_| [0; 3].map(|_| 1.0 + variance.sqrt() * normal(stream))).collect();
            deviations.push(|_, pixel| image[pixel]);
        });
        deviations.checkpoints(samples, &[1.0], &[Layer::Order(0)]).swap_remove(0)
    }

    fn run(exponent: f64, seed: u64) -> Line {
        let mut stream = Stream::new(mix2(seed, 3), 1);
        let points: Vec<Checkpoint> =
            [1, 2, 4, 8, 16].iter().map(|&n| checkpoint(n, f64::from(n).powf(exponent), &mut stream)).collect();
        fit(&points.iter().collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn squares_average_to_the_sample_variance_of_every_layer_and_of_the_sum() {
        let value = |r: usize, layer: usize, pixel: usize| ((r * 7 + layer * 3 + pixel) as f64 * 12.9898).sin();
        let mut deviations = Deviations::new(5, 2);
        (0..9).for_each(|r| deviations.push(|layer, pixel| [value(r, layer, pixel); 3]));
        let rows = deviations.checkpoints(4, &[1.0], &[Layer::Order(0), Layer::Tail]);
        let variance = |x: &dyn Fn(usize, usize) -> f64| {
            let of_pixel = |p: usize| (0..9).map(|r| x(r, p)).collect::<Moments>().variance();
            (0..5).map(of_pixel).sum::<f64>() / 5.0
        };
        let expected = [
            variance(&|r, p| value(r, 0, p)),
            variance(&|r, p| value(r, 1, p)),
            variance(&|r, p| value(r, 0, p) + value(r, 1, p)),
        ];
        for (row, expected) in rows.iter().zip(expected) {
            assert!((row.variance - expected).abs() < 1e-12 * expected, "{} {expected}", row.variance);
            assert_eq!((row.replicate_variances.len(), row.replicates), (8, 9));
        }
        assert_eq!(rows.iter().map(|r| r.order).collect::<Vec<_>>(), [Some(Layer::Order(0)), Some(Layer::Tail), None]);
    }

    #[test]
    fn slopes_are_found_and_their_intervals_cover_them() {
        // 95 % intervals in 400 runs: fewer than 360 hits have a probability below 10⁻⁵ at the nominal coverage.
        for exponent in [-1.0, -0.5] {
            let covered = (0..400).filter(|&seed| {
                let line = run(exponent, seed);
                assert!((line.slope - exponent).abs() < 0.25, "seed {seed}: {}", line.slope);
                line.ci.0 <= exponent && exponent <= line.ci.1
            });
            let covered = covered.count();
            assert!(covered >= 360, "slope {exponent}: {covered} of 400 intervals cover it");
        }
    }

    #[test]
    fn the_same_data_give_the_same_interval() {
        assert_eq!(run(-1.0, 5), run(-1.0, 5));
    }

    #[test]
    fn where_there_is_no_variance_there_is_no_slope() {
        let mut deviations = Deviations::new(2, 1);
        (0..8).for_each(|r| deviations.push(|_, _| [1.0 + 1e-8 * f64::from(r % 2); 3]));
        let rows = deviations.checkpoints(1, &[1.0], &[Layer::Order(0)]);
        assert_eq!(fit(&[&rows[0], &rows[0]]), None);
    }

    #[test]
    fn ratios_of_errors_are_found_and_their_intervals_cover_them() {
        // As above: 360 hits of 400.
        let covered = (0..400).filter(|&seed| {
            let mut stream = Stream::new(mix2(seed, 5), 1);
            let [a, b] = [0.25, 1.0].map(|variance| checkpoint(16, variance, &mut stream));
            let (ratio, ci) = rmse_ratio(&a, &b).unwrap();
            assert!((0.3..0.8).contains(&ratio), "seed {seed}: {ratio}");
            ci.0 <= 0.5 && 0.5 <= ci.1
        });
        let covered = covered.count();
        assert!(covered >= 360, "{covered} of 400 intervals cover the ratio");
    }

    #[test]
    fn what_varies_together_has_a_narrow_ratio() {
        let point = |scale: f64| {
            let squares = (1..=32).map(|r| scale * f64::from(r * r)).collect();
            checkpoint_of_squares(4, 0.0, 1.0, squares)
        };
        let (ratio, ci) = rmse_ratio(&point(4.0), &point(1.0)).unwrap();
        assert!((ratio - 2.0).abs() < 1e-12 && ci.1 - ci.0 < 1e-12, "{ratio} {ci:?}");
        assert_eq!(rmse_ratio(&point(0.0), &point(1.0)), None);
    }
}
