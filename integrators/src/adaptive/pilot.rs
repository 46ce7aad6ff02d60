//! A first look at an image: what its pixels err by.

use super::smoothing::{Size, Smoothing};
use crate::contribution::{Contribution, Sink, Wants};
use crate::integrator::{Estimator, Pixel, Replicate};
use crate::measurement::Counters;
use crate::request::Request;
use crate::scratch::Scratch;
use rayon::prelude::*;
use sampling::sampler::{Purpose, Sampler};
use scenes::Scene;

/// The radiance beside which a pixel's own counts for little where errors are relative, in the image's mean: units of light are the user's.
const DARK: f64 = 0.8;
/// The standard deviation by which means are smoothed, beside which errors are judged \[pixels\].
const SMOOTHING_OF_MEANS: f64 = 1.0;

/// Adds up what a sample brings to its own pixel.
struct OwnPixel<'r> {
    request: &'r Request,
    weight: f32,
    sum: [f64; 3],
}

impl Sink for OwnPixel<'_> {
    const WANTS: Wants = Wants::NOTHING;

    fn add(&mut self, c: Contribution) {
        let value = c.value * (c.weight as f32 * self.weight);
        // What is not finite is counted when it is met again, by the samples that are kept.
        let own = !c.technique.splats() && value.is_finite();
        if own && self.request.layer(c.technique.order()).is_some() {
            self.sum.iter_mut().zip(value.to_array()).for_each(|(sum, x)| *sum += f64::from(x));
        }
    }
}

/// The mean of samples of a pilot, pixel by pixel, and the rays of one.
pub fn image<E: Estimator>(
    estimator: &E,
    scene: &Scene,
    request: &Request,
    replicate: &Replicate,
    work: &mut Counters,
) -> Vec<[f64; 4]> {
    let size @ (width, height) = (scene.camera.width(), scene.camera.height());
    let rows: Vec<(Vec<[f64; 4]>, Counters)> = (0..height)
        .into_par_iter()
        .map(|y| {
            let mut sampler = Sampler::new(replicate.sampler, replicate.key, replicate.samples, size);
            let mut scratch = Scratch::default();
            let row = (0..width).map(|x| {
                let mut out = OwnPixel { request, weight: 1.0, sum: [0.0; 3] };
                let before = scratch.counters;
                for sample in 0..replicate.samples {
                    sampler.start_sample(u64::from(y) * u64::from(width) + u64::from(x), sample);
                    let at = sampler.get_2d(Purpose::Film);
                    let (pixel, weight) = Pixel::sample(x, y, scene.camera.filter(), at);
                    out.weight = weight;
                    estimator.estimate(scene, request, pixel, &mut sampler, &mut scratch, &mut out);
                }
                let Counters { closest, shadow, .. } = scratch.counters;
                let [r, g, b] = out.sum;
                let rays = (closest + shadow - before.closest - before.shadow) as f64;
                [r, g, b, rays].map(|sum| sum / f64::from(replicate.samples))
            });
            (row.collect(), scratch.counters)
        })
        .collect();
    rows.iter().for_each(|(_, of_row)| *work += *of_row);
    rows.into_iter().flat_map(|(row, _)| row).collect()
}

/// What each pixel errs by, squared and relative, and the time that a sample of it takes, in that of a ray: as two images tell.
pub fn errors_and_times(a: &[[f64; 4]], b: &[[f64; 4]], size: Size) -> (Vec<[f64; 1]>, Vec<f64>) {
    let means: Vec<[f64; 4]> = a.iter().zip(b).map(|(a, b)| [0, 1, 2, 3].map(|c| (a[c] + b[c]) / 2.0)).collect();
    let whole: f64 = means.iter().map(|[r, g, b, _]| r + g + b).sum::<f64>() / (3.0 * means.len() as f64);
    let dark = (DARK * whole).powi(2);
    let means = Smoothing::new(SMOOTHING_OF_MEANS).smoothed(&means, size);
    let error = |((a, b), mean): ((&[f64; 4], &[f64; 4]), &[f64; 4])| {
        let of = |c: usize| match (a[c] - b[c]).powi(2) {
            0.0 => 0.0,
            squared => squared / (mean[c].powi(2) + dark),
        };
        [of(0) + of(1) + of(2)]
    };
    (a.iter().zip(b).zip(&means).map(error).collect(), means.iter().map(|[.., rays]| rays + 1.0).collect())
}
