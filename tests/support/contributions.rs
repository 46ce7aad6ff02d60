//! What a method contributes, path by path.

use integrators::integrator::Pixel;
use integrators::scratch::Scratch;
use integrators::{Estimator, Orders, Request, Sink};
use sampling::sampler::{Purpose, Sampler, SamplerKind, StreamKey};
use scenes::Scene;

/// Hands all that some samples of every pixel contribute to orders up to `max_order` to a sink.
pub fn contributions(
    scene: &Scene,
    method: &impl Estimator,
    max_order: usize,
    (key, samples): (StreamKey, u32),
    sink: &mut impl Sink,
) {
    let request = Request::new(Orders::up_to(max_order), false);
    let (width, height) = (scene.camera.width(), scene.camera.height());
    let mut sampler = Sampler::new(SamplerKind::Independent, key, samples, (width, height));
    let mut scratch = Scratch::default();
    for (x, y, sample) in (0..width).flat_map(|x| (0..height).flat_map(move |y| (0..samples).map(move |s| (x, y, s)))) {
        sampler.start_sample(u64::from(y * width + x), sample);
        let (pixel, _) = Pixel::sample(x, y, scene.camera.filter(), sampler.get_2d(Purpose::Film));
        method.estimate(scene, &request, pixel, &mut sampler, &mut scratch, sink);
    }
}
