//! Facets that lie in pairs, as the sides of long V-shaped grooves.
//!
//! All functions are for directions above the surface. They divide by no product of two cosines, so that grazing
//! directions lose nothing.

use super::half::Half;
use crate::math::reflect;
use glam::Vec3;

impl Half {
    /// 2 cos θ_m / wo·m, where cos θ_m = (cos θ_o + cos θ_i) / (2 wo·m).
    #[inline(always)]
    fn groove(&self, cos_o: f32, cos_i: f32) -> f32 {
        (cos_o + cos_i) / (self.cos * self.cos)
    }

    /// Masking G₁(wo, m) / cos θ_o, with G₁(w, m) = min(1, 2 cos θ_m cos θ_w / w·m) [Torrance67; Heitz14, section 5.1].
    #[inline(always)]
    pub fn g1_over_cos(&self, cos_o: f32, cos_i: f32) -> f32 {
        self.groove(cos_o, cos_i).min(1.0 / cos_o)
    }

    /// Masking and shadowing G / (cos θ_o cos θ_i), with G = min(G₁(wo, m), G₁(wi, m)) [Blinn77; Cook82, section 2].
    #[inline(always)]
    pub fn g_over_cosines(&self, cos_o: f32, cos_i: f32) -> f32 {
        let (least, most) = (cos_o.min(cos_i), cos_o.max(cos_i));
        self.groove(cos_o, cos_i).min(1.0 / least) / most
    }

    /// The density [1/sr] of [`reflect_visibly`] for a density `d` of facets: G₁(wo, m) D(m) / (4 cos θ_o).
    #[inline(always)]
    pub fn visible_pdf(&self, d: f32, cos_o: f32, cos_i: f32) -> f32 {
        0.25 * d * self.g1_over_cos(cos_o, cos_i)
    }
}

/// The mirror image of `wo` about one of the visible sides of the groove with the side `m`; `None` below the horizon.
///
/// Its density is [`Half::visible_pdf`] if m has the density D(m) cos θ_m.
#[inline(always)]
pub fn reflect_visibly(wo: Vec3, m: Vec3, uc: f32) -> Option<Vec3> {
    let wi = reflect(wo, visible_side(wo, m, uc));
    (wi.z > 0.0).then_some(wi)
}

/// One of the two sides of the groove with the side `m`, in proportion to how much of it is visible from `wo`.
///
/// If m has the density D(m) cos θ_m, the side has that of visible normals, D(m) G₁(wo, m) wo·m / cos θ_o `[Heitz14b]`.
#[inline(always)]
fn visible_side(wo: Vec3, m: Vec3, uc: f32) -> Vec3 {
    let opposite = Vec3::new(-m.x, -m.y, m.z);
    let (this, other) = (wo.dot(m).max(0.0), wo.dot(opposite).max(0.0));
    if uc * (this + other) < this { m } else { opposite }
}
