//! The threshold of roulette on connections.

use super::{Bdpt, Connections};
use crate::contribution::{Contribution, Sink, Wants};
use crate::integrator::{Estimator, Pixel, Replicate};
use crate::request::Request;
use crate::scratch::Scratch;
use sampling::sampler::{Purpose, Sampler};
use scenes::Scene;

/// Pixels in which a pilot takes two samples.
const PIXELS: u64 = 2048;

/// The weighted contribution, as luminance, from which a connection should always have its ray.
///
/// Roulette that survives with probability q = t / δ adds t² (1/q − 1) to the variance V of a sample and takes (1 − q) from the
/// T rays it costs; the product of variance and cost has its minimum at δ = √(V / T) [Veach97, §10.4.1]. V is taken as the mean over
/// the image, from pairs of samples of pixels; what lands elsewhere is left out.
pub(super) fn threshold(settings: &Bdpt, scene: &Scene, request: &Request, replicate: &Replicate) -> f32 {
    let settings = Bdpt { connections: Connections::All, ..settings.clone() };
    let (width, height) = (scene.camera.width(), scene.camera.height());
    let mut sampler = Sampler::new(replicate.sampler, replicate.key.of_pilot(), 2, (width, height));
    let mut scratch = Scratch::default();
    let count = PIXELS.min(u64::from(width) * u64::from(height));
    let mut sum = 0.0;
    for i in 0..count {
        let pixel = i * u64::from(width) * u64::from(height) / count;
        let (x, y) = ((pixel % u64::from(width)) as u32, (pixel / u64::from(width)) as u32);
        let mut luminances = [0.0; 2];
        for (sample, luminance) in luminances.iter_mut().enumerate() {
            sampler.start_sample(pixel, sample as u32);
            let place = Pixel::sample(x, y, scene.camera.filter(), sampler.get_2d(Purpose::Film)).0;
            let mut own = OwnPixel(0.0);
            settings.estimate(scene, request, place, &mut sampler, &mut scratch, &mut own);
            *luminance = own.0;
        }
        sum += (luminances[0] - luminances[1]).powi(2) / 2.0;
    }
    let rays = (scratch.counters.closest + scratch.counters.shadow) as f64 / (2 * count) as f64;
    (sum / count as f64 / rays.max(1.0)).sqrt() as f32
}

/// Luminance of what lands in the sample's own pixel; what is not finite is the estimate's business.
struct OwnPixel(f64);

impl Sink for OwnPixel {
    const WANTS: Wants = Wants::NOTHING;

    fn add(&mut self, c: Contribution) {
        let luminance = f64::from(c.value.luminance()) * c.weight;
        if !c.technique.splats() && luminance.is_finite() {
            self.0 += luminance;
        }
    }
}
