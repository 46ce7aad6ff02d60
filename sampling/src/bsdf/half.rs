//! Half vectors.

use glam::Vec3;

/// The half vector of two directions.
#[derive(Clone, Copy, Debug)]
pub struct Half {
    /// The normal of the facet that mirrors one direction into the other.
    pub m: Vec3,
    /// wo·m = wi·m, in (0, 1].
    pub cos: f32,
}

impl Half {
    /// `None` where the directions are opposite.
    #[inline(always)]
    pub fn of(wo: Vec3, wi: Vec3) -> Option<Self> {
        let sum = wo + wi;
        let length2 = sum.length_squared();
        if length2 == 0.0 {
            return None;
        }
        let length = length2.sqrt();
        // The directions are unit, so wo·m = wi·m = |wo + wi| / 2, which does not cancel at grazing angles.
        Some(Self { m: sum / length, cos: (0.5 * length).min(1.0) })
    }
}
