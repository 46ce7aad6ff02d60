//! The flux of every order in a scene, whatever the camera sees of it.
//!
//! `Φ_k` is the power \[W\] that leaves surfaces after k scatterings: `Φ_0` is what the emitters emit, and `Φ_k` the integral over all
//! surfaces of what `TᵏE` sends out. A walk from the emitters carries it from one scattering to the next, with the weights of light
//! tracing, so that every walk is an unbiased sample of all orders at once.

use crate::measurement::Counters;
use crate::start::start_light;
use rayon::prelude::*;
use sampling::bsdf::TransportMode;
use sampling::math::Spectrum;
use sampling::sampler::{Purpose, Sampler, SamplerKind, StreamKey, Subpath};
use scenes::{EmitterId, Region, Scene, SurfaceId};

/// The flux of every order, as estimated by one set of walks.
#[derive(Clone, Debug, PartialEq)]
pub struct Flux {
    /// What leaves all surfaces, of each order from 0 on \[W\], channel by channel.
    pub orders: Vec<[f64; 3]>,
    /// What meets no surface after that and leaves the scene \[W\].
    pub escaped: Vec<[f64; 3]>,
    /// What meters measure, one for each region.
    pub meters: Vec<Meter>,
    /// Non-finite contributions, per order. They are left out of every sum, with all that their walks would have brought after them.
    pub invalid: Vec<u64>,
}

/// What arrives at a region and what leaves it, by order \[W\], channel by channel, on both sides together.
#[derive(Clone, Debug, PartialEq)]
pub struct Meter {
    /// Light that has been scattered k times and falls on it.
    pub arriving: Vec<[f64; 3]>,
    /// Light that leaves it, having been scattered there last, or, at order 0, emitted.
    pub leaving: Vec<[f64; 3]>,
}

impl Meter {
    fn new(max_order: usize) -> Self {
        Self { arriving: vec![[0.0; 3]; max_order + 1], leaving: vec![[0.0; 3]; max_order + 1] }
    }

    fn merge(&mut self, other: &Self) {
        merge(&mut self.arriving, &other.arriving);
        merge(&mut self.leaving, &other.leaving);
    }
}

fn merge(sums: &mut [[f64; 3]], others: &[[f64; 3]]) {
    for (sum, other) in sums.iter_mut().zip(others) {
        (0..3).for_each(|c| sum[c] += other[c]);
    }
}

fn add(sum: &mut [f64; 3], beta: Spectrum) {
    beta.to_array().iter().zip(sum).for_each(|(b, sum)| *sum += f64::from(*b));
}

/// Walks that are at work together; a fixed number, so that sums have the same bits for any number of threads.
const BATCH: u64 = 1024;
/// Batches whose sums are kept at once.
const WAVE: usize = 256;

impl Flux {
    /// The flux of orders 0 to `max_order` in a scene and on these regions, by so many walks on the random numbers of a key.
    pub fn of(scene: &Scene, regions: &[Region], max_order: usize, key: StreamKey, walks: u64) -> Self {
        let some = |batch: u64| {
            let mut sums = Self::none(regions.len(), max_order);
            let mut sampler = Sampler::new(SamplerKind::Independent, key, 1, (1, 1));
            for walk in batch * BATCH..((batch + 1) * BATCH).min(walks) {
                sampler.start_sample(walk, 0);
                sums.add(scene, regions, &mut sampler);
            }
            sums
        };
        let (batches, mut all) = (walks.div_ceil(BATCH), Self::none(regions.len(), max_order));
        for first in (0..batches).step_by(WAVE) {
            let wave: Vec<Self> = (first..batches.min(first + WAVE as u64)).into_par_iter().map(some).collect();
            wave.iter().for_each(|batch| all.merge(batch));
        }
        let share = |flux: &mut Vec<[f64; 3]>| flux.as_flattened_mut().iter_mut().for_each(|s| *s /= walks as f64);
        share(&mut all.orders);
        share(&mut all.escaped);
        all.meters.iter_mut().for_each(|meter| {
            share(&mut meter.arriving);
            share(&mut meter.leaving);
        });
        all
    }

    fn none(regions: usize, max_order: usize) -> Self {
        let meters = vec![Meter::new(max_order); regions];
        let zero = || vec![[0.0; 3]; max_order + 1];
        Self { orders: zero(), escaped: zero(), meters, invalid: vec![0; max_order + 1] }
    }

    fn merge(&mut self, other: &Self) {
        merge(&mut self.orders, &other.orders);
        merge(&mut self.escaped, &other.escaped);
        self.meters.iter_mut().zip(&other.meters).for_each(|(meter, other)| meter.merge(other));
        self.invalid.iter_mut().zip(&other.invalid).for_each(|(sum, other)| *sum += other);
    }

    /// One walk, which ends where it escapes, is absorbed, or has been scattered often enough.
    fn add(&mut self, scene: &Scene, regions: &[Region], sampler: &mut Sampler) {
        sampler.start_vertex(Subpath::Light, 0);
        let Some(start) = start_light(scene, sampler, &mut Counters::default()) else { return };
        let (mut ray, mut beta) = (start.sample.ray, start.beta());
        let mut left = Left::Emitter(start.emitter);
        for order in 0..self.orders.len() {
            if !beta.is_finite() {
                self.invalid[order] += 1;
                return;
            }
            add(&mut self.orders[order], beta);
            for (meter, region) in self.meters.iter_mut().zip(regions) {
                if left.is_on(region) {
                    add(&mut meter.leaving[order], beta);
                }
            }
            if beta.is_zero() {
                return;
            }
            let Some(hit) = scene.intersect(&ray) else {
                add(&mut self.escaped[order], beta);
                return;
            };
            for (meter, region) in self.meters.iter_mut().zip(regions) {
                if region.has(hit.surface) {
                    add(&mut meter.arriving[order], beta);
                }
            }
            if order + 1 == self.orders.len() {
                return;
            }
            sampler.start_vertex(Subpath::Light, order as u32 + 1);
            let uc = sampler.get_1d(Purpose::Lobe);
            let u = sampler.get_2d(Purpose::Direction);
            let Some(sample) = hit.sample(-ray.d, uc, u, TransportMode::Importance) else { return };
            beta *= sample.weight;
            ray = hit.point.spawn(sample.wi);
            left = Left::Surface(hit.surface);
        }
    }
}

/// What a walk has left last.
enum Left {
    Emitter(EmitterId),
    Surface(SurfaceId),
}

impl Left {
    fn is_on(&self, region: &Region) -> bool {
        match *self {
            Self::Emitter(emitter) => region.emits(emitter),
            Self::Surface(surface) => region.has(surface),
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
        let replicate = |i| Flux::of(&scene, &[], 6, StreamKey::new(1, "flux", Role::Estimate, i), 20_000);
        let flux: Vec<Flux> = (0..8).map(replicate).collect();
        let mean = |k: usize, c: usize| flux.iter().map(|f| f.orders[k][c]).sum::<f64>() / flux.len() as f64;
        let ratio = |k: usize| mean(k + 1, 1) / mean(k, 1);
        // The first scattering is of light that lamps send to places of their own.
        let spread = (1..5).map(|k| (ratio(k) / ratio(1) - 1.0).abs()).fold(0.0, f64::max);
        assert!(spread < 0.01 && ratio(1) < 1.0 && ratio(1) > 0.0, "{spread} {}", ratio(1));
        assert!((mean(0, 1) / scene.emitters.iter().map(scenes::Emitter::power).sum::<f64>() - 1.0).abs() < 1e-3);
        assert!(flux.iter().all(|f| f.invalid.iter().all(|&n| n == 0)));
    }

    /// What leaves surfaces in a closed scene falls on surfaces; what they emit and scatter leaves them.
    #[test]
    fn meters_on_all_surfaces_of_a_closed_scene_find_all_of_the_flux() {
        let scene = scenes::load("furnace", &LoadOptions::default()).unwrap();
        let names = scene.labels.surfaces();
        let regions: Vec<Region> = names.iter().map(|names| scene.region(&names[0]).unwrap()).collect();
        let flux = Flux::of(&scene, &regions[..1], 4, StreamKey::new(1, "flux", Role::Estimate, 0), 5000);
        assert!(names.iter().all(|n| n[0] == names[0][0]), "the furnace is made of one thing");
        for k in 0..=4 {
            for c in 0..3 {
                let (all, meter) = (flux.orders[k][c], &flux.meters[0]);
                assert!((meter.leaving[k][c] / all - 1.0).abs() < 1e-12);
                assert!((meter.arriving[k][c] / all - 1.0).abs() < 1e-12);
            }
        }
        assert!(scene.region("nothing").is_none());
    }

    #[test]
    fn threads_do_not_change_a_bit() {
        let scene = scenes::load("cornell_box", &LoadOptions::default()).unwrap();
        let key = StreamKey::new(1, "flux", Role::Estimate, 0);
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Flux::of(&scene, &[], 5, key, 5000))
        };
        assert_eq!(on(1), on(3));
    }
}
