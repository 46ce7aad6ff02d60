//! How far one image is from another.

use serde::Serialize;

/// What keeps the denominator of the relative error from vanishing.
pub const RELATIVE_FLOOR: f64 = 0.01;

/// The distances of one layer of an image `x` from the reference `ref`, over all pixels and channels.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Distances {
    /// The layer's name; empty for the beauty.
    pub layer: String,
    /// Mean of `(x − ref)²`.
    pub mse: f64,
    /// Mean of `(x − ref)² / (ref² + 0.01)`.
    pub relmse: f64,
    /// Mean of `|x − ref| / (|x| + |ref|)`, 0 where both are black: between 0 and 1.
    pub smape: f64,
    /// Mean of the image.
    pub mean: f64,
    /// Mean of the reference.
    pub reference_mean: f64,
    /// Mean of `x − ref`.
    pub bias: f64,
    /// `bias` relative to the reference's mean; `None` where that is 0.
    pub relative_bias: Option<f64>,
    /// What `mse` would be by noise alone: the mean of both variances, where both files hold them.
    pub noise: Option<f64>,
    /// Pixels that are not finite in one or both: they are left out of all else.
    pub non_finite: u64,
}

/// The pixels of an image.
pub type Pixels<'a> = &'a [[f32; 3]];

/// Compares two images of the same size. `variances` are those of their pixels, in the same order.
pub fn distances(layer: &str, x: Pixels, reference: Pixels, variances: Option<(Pixels, Pixels)>) -> Distances {
    let mut sums = Sums::default();
    for (x, reference) in x.iter().zip(reference) {
        if !x.iter().chain(reference).all(|v| v.is_finite()) {
            sums.non_finite += 1;
            continue;
        }
        x.iter().zip(reference).for_each(|(&x, &r)| sums.add(f64::from(x), f64::from(r)));
    }
    let n = sums.count as f64;
    let bias = (sums.x - sums.reference) / n;
    let reference_mean = sums.reference / n;
    Distances {
        layer: layer.to_owned(),
        mse: sums.square / n,
        relmse: sums.relative / n,
        smape: sums.symmetric / n,
        mean: sums.x / n,
        reference_mean,
        bias,
        relative_bias: (reference_mean != 0.0).then(|| bias / reference_mean),
        noise: variances.map(|(a, b)| average(a) + average(b)),
        non_finite: sums.non_finite,
    }
}

#[derive(Default)]
struct Sums {
    count: u64,
    non_finite: u64,
    x: f64,
    reference: f64,
    square: f64,
    relative: f64,
    symmetric: f64,
}

impl Sums {
    fn add(&mut self, x: f64, reference: f64) {
        let difference = x - reference;
        self.count += 1;
        self.x += x;
        self.reference += reference;
        self.square += difference * difference;
        self.relative += difference * difference / (reference * reference + RELATIVE_FLOOR);
        if difference != 0.0 {
            self.symmetric += difference.abs() / (x.abs() + reference.abs());
        }
    }
}

fn average(image: Pixels) -> f64 {
    let values = image.as_flattened();
    values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_is_at_no_distance_from_itself() {
        let image = [[0.0, 1.0, 2.0], [0.5, 0.0, 3.0]];
        let d = distances("", &image, &image, None);
        assert_eq!((d.mse, d.relmse, d.smape, d.bias), (0.0, 0.0, 0.0, 0.0));
    }

    #[test]
    fn distances_are_those_computed_by_hand() {
        let d = distances("order01", &[[2.0, 0.0, 1.0]], &[[1.0, 0.0, 3.0]], Some((&[[0.1; 3]], &[[0.2; 3]])));
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-7, "{a} {b}");
        close(d.mse, (1.0 + 4.0) / 3.0);
        close(d.relmse, (1.0 / 1.01 + 4.0 / 9.01) / 3.0);
        close(d.smape, (1.0 / 3.0 + 2.0 / 4.0) / 3.0);
        close(d.bias, -1.0 / 3.0);
        close(d.relative_bias.unwrap(), -0.25);
        close(d.noise.unwrap(), 0.3);
    }

    #[test]
    fn pixels_that_are_not_finite_are_counted_and_left_out() {
        let d = distances("", &[[f32::NAN, 0.0, 0.0], [1.0; 3]], &[[1.0; 3], [1.0; 3]], None);
        assert_eq!((d.non_finite, d.mse, d.mean), (1, 0.0, 1.0));
    }
}
