//! Facets whose slopes are normally distributed, after Beckmann.

use super::grooves::Facets;
use super::parts::exp_of_minus;
use crate::warp::sin_cos_turns;
use glam::{Vec2, Vec3, vec3};
use std::f32::consts::PI;

/// Normally distributed slopes, of root mean square α_x/√2 along x and α_y/√2 along y [Beckmann63; Walter07, (25)].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slopes {
    alpha_x: f32,
    alpha_y: f32,
}

impl Slopes {
    /// Slopes of these widths, which are positive.
    #[inline]
    pub fn new(alpha_x: f32, alpha_y: f32) -> Self {
        debug_assert!(alpha_x > 0.0 && alpha_y > 0.0, "roughness {alpha_x}, {alpha_y}");
        Self { alpha_x, alpha_y }
    }

    /// Whether the two widths differ.
    pub fn is_anisotropic(&self) -> bool {
        self.alpha_x != self.alpha_y
    }
}

impl Facets for Slopes {
    /// The density of normals D(m) = exp(−(x²/α_x² + y²/α_y²)/z²) / (π α_x α_y z⁴) [1/sr], with ∫ D(m) cos θ_m dm = 1; 0
    /// below 10⁻³⁰ of the exponential.
    #[inline]
    fn d(&self, m: Vec3) -> f32 {
        let (x, y) = (m.x / (self.alpha_x * m.z), m.y / (self.alpha_y * m.z));
        let share = exp_of_minus(x * x + y * y);
        if share == 0.0 {
            return 0.0;
        }
        let z2 = m.z * m.z;
        share / (PI * self.alpha_x * self.alpha_y * z2 * z2)
    }

    /// A normal with the density D(m) cos θ_m.
    #[inline]
    fn sample(&self, u: Vec2) -> Vec3 {
        let (sin, cos) = sin_cos_turns(u.x);
        let slope = (-(-u.y).ln_1p()).sqrt();
        vec3(self.alpha_x * slope * cos, self.alpha_y * slope * sin, 1.0).normalize()
    }
}
