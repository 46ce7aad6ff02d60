//! How much a model scatters of the light from one direction.

use sampling::Vec3;
use sampling::bsdf::{Bsdf, BsdfSample, TransportMode};
use sampling::moments::Moments;
use sampling::sampler::{Purpose, Role, Sampler, SamplerKind, StreamKey};

/// Angles of incidence that albedos are told at \[degrees\].
pub const ANGLES: [f32; 8] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0, 89.0];

const REPLICATES: u32 = 32;
const SAMPLES: u32 = 1 << 11;

/// A directional albedo.
#[derive(Clone, Copy, Debug)]
pub struct Albedo {
    /// By channel.
    pub mean: [f64; 3],
    /// The largest standard error of a channel.
    pub error: f64,
}

/// ∫ f_s |cos θ_i| dω_i over all directions, delta lobes included, for light that comes from `wo`: the mean weight of samples, as
/// importance, so that light which enters another medium is counted as power.
pub fn directional(bsdf: &Bsdf, wo: Vec3) -> Albedo {
    let mut moments = [Moments::default(); 3];
    for replicate in 0..REPLICATES {
        let mut sum = [0.0; 3];
        samples(bsdf, wo, replicate, SAMPLES, |sample| {
            sum.iter_mut().zip(sample.weight.to_array()).for_each(|(sum, weight)| *sum += weight as f64);
        });
        moments.iter_mut().zip(sum).for_each(|(moments, sum)| moments.push(sum / SAMPLES as f64));
    }
    let error = moments.iter().map(|m| m.variance_of_mean().sqrt()).fold(0.0, f64::max);
    Albedo { mean: moments.map(|m| m.mean), error }
}

/// Stratified samples of a model.
pub fn samples(bsdf: &Bsdf, wo: Vec3, replicate: u32, count: u32, mut each: impl FnMut(BsdfSample)) {
    let key = StreamKey::new(0, "albedo", Role::Estimate, replicate);
    let mut sampler = Sampler::new(SamplerKind::Stratified, key, count, (1, 1));
    for i in 0..count {
        sampler.start_sample(0, i);
        let (uc, u) = (sampler.get_1d(Purpose::Lobe), sampler.get_2d(Purpose::Direction));
        if let Some(sample) = bsdf.sample(wo, uc, u, TransportMode::Importance) {
            each(sample);
        }
    }
}

/// The delta lobes that samples find, each once.
pub fn delta_lobes(bsdf: &Bsdf, wo: Vec3) -> Vec<BsdfSample> {
    let mut lobes: Vec<BsdfSample> = Vec::new();
    samples(bsdf, wo, 0, 256, |sample| {
        if sample.lobe.is_delta() && lobes.iter().all(|other| other.wi.distance(sample.wi) > 1e-3) {
            lobes.push(sample);
        }
    });
    lobes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::incident;
    use sampling::Spectrum;
    use sampling::bsdf::{Dielectric, Lambert, fresnel_dielectric};

    #[test]
    fn albedos_are_what_is_known_of_them() {
        let grey = directional(&Lambert { albedo: Spectrum::new(0.1, 0.5, 0.9) }.into(), incident(40.0));
        grey.mean.iter().zip([0.1, 0.5, 0.9]).for_each(|(mean, exact)| assert!((mean - exact).abs() < 1e-6));
        let glass = directional(&Dielectric { eta: 1.5 }.into(), incident(60.0));
        assert!((glass.mean[0] - 1.0).abs() < 1e-6 && fresnel_dielectric(0.5, 1.5).reflected > 0.05);
    }
}
