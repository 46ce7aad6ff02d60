//! Facets whose density falls with a power of the cosine, after Blinn.

use super::grooves::Facets;
use super::parts::{exp_of_minus, minus_ln_cos};
use crate::warp::{INV_2PI, power_cosine_hemisphere};
use glam::{Vec2, Vec3};

/// The density of normals D(m) = (n + 2)/2π cosⁿθ_m [1/sr], with ∫ D(m) cos θ_m dm = 1 `[Blinn77]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlinnNormals {
    n: f32,
}

impl BlinnNormals {
    /// Normals with the exponent n ≥ 0.
    #[inline(always)]
    pub fn new(n: f32) -> Self {
        Self { n }
    }
}

impl Facets for BlinnNormals {
    /// D(m); 0 below 10⁻³⁰ of its peak.
    #[inline(always)]
    fn d(&self, m: Vec3) -> f32 {
        (self.n + 2.0) * INV_2PI * exp_of_minus(self.n * minus_ln_cos(m))
    }

    /// A normal with the density D(m) cos θ_m.
    #[inline(always)]
    fn sample(&self, u: Vec2) -> Vec3 {
        power_cosine_hemisphere(u, self.n + 1.0)
    }
}
