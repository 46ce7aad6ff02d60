//! The directional albedo, for tests.

use super::{Bsdf, TransportMode};
use glam::{vec2, vec3};

/// The mean weight of stratified samples, in the largest channel, for light from this cosine; to a few 10⁻³.
pub fn albedo(model: impl Into<Bsdf>, cos: f32) -> f64 {
    const SIDE: u32 = 384;
    let model = model.into();
    let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
    let wo = vec3(sin * 0.8, sin * 0.6, cos);
    let weight = |i: u32| {
        let u = (vec2((i % SIDE) as f32, (i / SIDE) as f32) + 0.5) / SIDE as f32;
        // The golden ratio's multiples are even along any run of cells.
        let uc = (f64::from(i) * 0.618_033_988_749_894_9).fract() as f32;
        model.sample(wo, uc, u, TransportMode::Radiance).map_or(0.0, |s| f64::from(s.weight.max_component()))
    };
    (0..SIDE * SIDE).map(weight).sum::<f64>() / f64::from(SIDE * SIDE)
}
