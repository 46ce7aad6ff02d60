//! The parts of Disney's principled model that no other model has.

use super::ClearcoatMasking;
use crate::math::elementary::{exp_m1, ln};
use crate::warp::sin_cos_turns;
use glam::{Vec2, Vec3, vec3};
use std::f32::consts::PI;

/// The density D(m) of the clearcoat's normals: Trowbridge and Reitz's with the exponent 1 `[Burley12]`, for α in (0, 1).
#[inline]
pub fn gtr1(alpha: f32, m: Vec3) -> f32 {
    let alpha2 = alpha * alpha;
    // 1 + (α² − 1) cos² with sin² = x² + y², which keeps its digits at the normal.
    let q = alpha2 * m.z * m.z + m.x * m.x + m.y * m.y;
    (alpha2 - 1.0) / (PI * 2.0 * ln(alpha) * q)
}

/// A normal with the density D(m) cos θ_m `[Burley12]`.
#[inline]
pub fn sample_gtr1(alpha: f32, u: Vec2) -> Vec3 {
    let alpha2 = alpha * alpha;
    // sin² = (α^(2(1 − u)) − α²) / (1 − α²).
    let sin2 = (alpha2 * exp_m1(-2.0 * u.y * ln(alpha)) / (1.0 - alpha2)).min(1.0);
    let (sin_phi, cos_phi) = sin_cos_turns(u.x);
    let sin = sin2.sqrt();
    vec3(sin * cos_phi, sin * sin_phi, (1.0 - sin2).sqrt())
}

impl ClearcoatMasking {
    /// G of α = 0.25, over 4 |cos θ_o| |cos θ_i| or not.
    #[inline]
    pub fn value(self, wo: Vec3, wi: Vec3) -> f32 {
        let over_cosines = 1.0 / ((wo.z + clearcoat_span(wo)) * (wi.z + clearcoat_span(wi)));
        match self {
            Self::OverCosines => over_cosines,
            Self::Shadows => over_cosines * 4.0 * wo.z * wi.z,
        }
    }
}

/// The span of a direction for the clearcoat's masking, which has α = 0.25.
#[inline]
fn clearcoat_span(w: Vec3) -> f32 {
    (0.0625 * (w.x * w.x + w.y * w.y) + w.z * w.z).sqrt()
}
