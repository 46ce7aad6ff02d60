//! Surfaces in relief.

use glam::DVec3;
use sampling::bsdf::Bsdf;
use sampling::math::Spectrum;
use scenes::material::{Scattering, Varying};
use scenes::relief::{Relief, ReliefMap};
use scenes::texture::{Noise, Texture};
use scenes::{Material, Remedies};

/// Noise of so many metres in size and height.
pub fn bumps(size: f32, height: f32, seed: u64) -> ReliefMap {
    let (low, high) = (Spectrum::ZERO, Spectrum::splat(height));
    ReliefMap::Heights(Texture::Noise(Noise { low, high, size, octaves: 2, seed, origin: DVec3::ZERO }))
}

/// A model about normals that a map tilts.
pub fn in_relief(bsdf: Bsdf, map: ReliefMap, remedies: Remedies) -> Material {
    let mut varying = Varying::of(Scattering::Same(bsdf));
    varying.relief = Some(Relief { map, remedies });
    varying.into()
}
