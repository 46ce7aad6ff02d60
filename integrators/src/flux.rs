//! The flux of every order in a scene, whatever the camera sees of it.
//!
//! `Φ_k` is the power \[W\] that leaves surfaces after k scatterings: `Φ_0` is what the emitters emit, and `Φ_k` the integral over all
//! surfaces of what `TᵏE` sends out. A walk from the emitters carries it from one scattering to the next, with the weights of light
//! tracing, so that every walk is an unbiased sample of all orders at once.

use crate::measurement::Counters;
use crate::start::start_light;
use rayon::prelude::*;
use sampling::bsdf::TransportMode;
use sampling::sampler::{Purpose, Sampler, SamplerKind, StreamKey, Subpath};
use scenes::Scene;

/// The flux of every order, as estimated by one set of walks.
#[derive(Clone, Debug, PartialEq)]
pub struct Flux {
    /// Of each order from 0 on \[W\], channel by channel.
    pub orders: Vec<[f64; 3]>,
    /// Non-finite contributions, per order. They are left out of every sum, with all that their walks would have brought after them.
    pub invalid: Vec<u64>,
}

/// Walks that are at work together; a fixed number, so that sums have the same bits for any number of threads.
const BATCH: u32 = 1024;

impl Flux {
    /// The flux of orders 0 to `max_order`, by so many walks on the random numbers of a key.
    pub fn of(scene: &Scene, max_order: usize, key: StreamKey, walks: u32) -> Self {
        let batches: Vec<Sums> = (0..walks.div_ceil(BATCH))
            .into_par_iter()
            .map(|batch| {
                let mut sums = Sums::new(max_order);
                let mut sampler = Sampler::new(SamplerKind::Independent, key, 1, (1, 1));
                for walk in batch * BATCH..((batch + 1) * BATCH).min(walks) {
                    sampler.start_sample(u64::from(walk), 0);
                    sums.add(scene, max_order, &mut sampler);
                }
                sums
            })
            .collect();
        let mut all = Sums::new(max_order);
        batches.iter().for_each(|batch| all.merge(batch));
        Self { orders: all.flux.iter().map(|sum| sum.map(|s| s / f64::from(walks))).collect(), invalid: all.invalid }
    }
}

struct Sums {
    flux: Vec<[f64; 3]>,
    invalid: Vec<u64>,
}

impl Sums {
    fn new(max_order: usize) -> Self {
        Self { flux: vec![[0.0; 3]; max_order + 1], invalid: vec![0; max_order + 1] }
    }

    fn merge(&mut self, other: &Self) {
        for (sum, other) in self.flux.iter_mut().zip(&other.flux) {
            (0..3).for_each(|c| sum[c] += other[c]);
        }
        self.invalid.iter_mut().zip(&other.invalid).for_each(|(sum, other)| *sum += other);
    }

    /// One walk, which ends where it escapes, is absorbed, or has been scattered often enough.
    fn add(&mut self, scene: &Scene, max_order: usize, sampler: &mut Sampler) {
        sampler.start_vertex(Subpath::Light, 0);
        let Some(start) = start_light(scene, sampler, &mut Counters::default()) else { return };
        let (mut ray, mut beta) = (start.sample.ray, start.beta());
        for order in 0..=max_order {
            if !beta.is_finite() {
                self.invalid[order] += 1;
                return;
            }
            let sum = &mut self.flux[order];
            beta.to_array().iter().zip(sum).for_each(|(b, sum)| *sum += f64::from(*b));
            if order == max_order || beta.is_zero() {
                return;
            }
            let Some(hit) = scene.intersect(&ray) else { return };
            sampler.start_vertex(Subpath::Light, order as u32 + 1);
            let uc = sampler.get_1d(Purpose::Lobe);
            let u = sampler.get_2d(Purpose::Direction);
            let Some(sample) = hit.sample(-ray.d, uc, u, TransportMode::Importance) else { return };
            beta *= sample.weight;
            ray = hit.point.spawn(sample.wi);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::sampler::Role;
    use scenes::LoadOptions;

    /// In a sphere with the same light everywhere each scattering leaves the mean albedo of it, whatever the walk.
    #[test]
    fn every_order_of_the_integrating_sphere_is_the_mean_albedo_times_the_last() {
        let scene = scenes::load("integrating_sphere", &LoadOptions::default()).unwrap();
        let replicate = |i| Flux::of(&scene, 6, StreamKey::new(1, "flux", Role::Estimate, i), 20_000);
        let flux: Vec<Flux> = (0..8).map(replicate).collect();
        let mean = |k: usize, c: usize| flux.iter().map(|f| f.orders[k][c]).sum::<f64>() / flux.len() as f64;
        let ratio = |k: usize| mean(k + 1, 1) / mean(k, 1);
        // The first scattering is of light that lamps send to places of their own.
        let spread = (1..5).map(|k| (ratio(k) / ratio(1) - 1.0).abs()).fold(0.0, f64::max);
        assert!(spread < 0.01 && ratio(1) < 1.0 && ratio(1) > 0.0, "{spread} {}", ratio(1));
        assert!((mean(0, 1) / scene.emitters.iter().map(scenes::Emitter::power).sum::<f64>() - 1.0).abs() < 1e-3);
        assert!(flux.iter().all(|f| f.invalid.iter().all(|&n| n == 0)));
    }

    #[test]
    fn threads_do_not_change_a_bit() {
        let scene = scenes::load("cornell_box", &LoadOptions::default()).unwrap();
        let key = StreamKey::new(1, "flux", Role::Estimate, 0);
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Flux::of(&scene, 5, key, 5000))
        };
        assert_eq!(on(1), on(3));
    }
}
