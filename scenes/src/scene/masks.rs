//! Surfaces that are not met everywhere.
//!
//! A surface of opacity α is met with probability α; otherwise the ray goes on as if nothing were there, which is no scattering. The
//! decision is a hash of the ray and the place, so that the same ray always has the same end. Both subpaths and connections meet a
//! surface with the same probability, so it stands in the value of a path and in all of its densities alike, and cancels.

use super::Scene;
use crate::accel::Hit;
use crate::interaction::Interaction;
use crate::ray::Ray;
use sampling::fault;
use sampling::rng::{mix2, unit_f32};

/// After so many surfaces passed, the next is met: a ray that does not leave a place would never end.
const MOST: u32 = 1 << 16;

impl Scene {
    /// The first surface point on the ray's interval (0, `t_max`) that the ray meets.
    #[inline(never)]
    pub(super) fn intersect_masked(&self, ray: &Ray) -> Option<Interaction> {
        let interaction = self.interaction(self.first_met(ray)?, ray.d);
        Some(Interaction { t: (interaction.point.p - ray.o).dot(ray.d) / ray.d.length_squared(), ..interaction })
    }

    /// Whether the ray meets any surface on its interval (0, `t_max`).
    #[inline(never)]
    pub(super) fn occluded_masked(&self, ray: &Ray) -> bool {
        fault!("screens_cast_whole_shadows", self.first_met(ray).is_some(), self.accel.any(ray))
    }

    /// The first hit that is met. Its `t` is that of the rest of the ray.
    fn first_met(&self, ray: &Ray) -> Option<Hit> {
        let end = ray.o + ray.d * ray.t_max;
        let mut rest = *ray;
        for count in 0..MOST {
            let hit = self.accel.closest(&rest)?;
            let found = self.found(&hit);
            if count + 1 == MOST || meets(ray, self.opacity(&hit, &found), count) {
                return Some(hit);
            }
            rest.o = found.point.offset_toward(ray.d);
            if ray.t_max.is_finite() {
                // The far end stays where it was, so that the surface there is not met by rounding.
                rest.d = end - rest.o;
                if rest.d.dot(ray.d) <= 0.0 {
                    return None;
                }
                rest.t_max = 1.0;
            }
        }
        None
    }
}

/// Whether a ray meets a surface of this opacity, having passed so many.
fn meets(ray: &Ray, opacity: f32, count: u32) -> bool {
    if opacity >= 1.0 || opacity <= 0.0 {
        return opacity > 0.0;
    }
    let words = [ray.o, ray.d].map(|v| v.to_array().map(f32::to_bits));
    let bits = words.iter().flatten().fold(u64::from(count), |bits, &word| mix2(bits, u64::from(word)));
    unit_f32((bits >> 32) as u32) < opacity
}
