//! Spectra, frames, and directions in the local frame.

pub(crate) mod elementary;
mod frame;
mod spectrum;

pub use frame::Frame;
pub use spectrum::Spectrum;

use glam::Vec3;

/// Whether two local directions leave the same side of the surface; `false` if either lies in it.
#[inline]
pub fn same_hemisphere(a: Vec3, b: Vec3) -> bool {
    // Signs are compared, not multiplied: the product of two grazing cosines may underflow.
    (a.z > 0.0 && b.z > 0.0) || (a.z < 0.0 && b.z < 0.0)
}

/// The mirror image of `wo` about `n`; both are unit and point away from the surface, as does the result.
#[inline]
pub fn reflect(wo: Vec3, n: Vec3) -> Vec3 {
    2.0 * wo.dot(n) * n - wo
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    #[test]
    fn sides_are_told_apart_where_products_underflow() {
        let grazing = vec3(1.0, 0.0, 1e-30);
        assert!(same_hemisphere(grazing, grazing));
        assert!(same_hemisphere(-grazing, -grazing));
        assert!(!same_hemisphere(grazing, -grazing) && !same_hemisphere(-grazing, grazing));
        assert!(!same_hemisphere(Vec3::X, -grazing) && !same_hemisphere(-grazing, Vec3::X));
        assert!(!same_hemisphere(Vec3::X, Vec3::X));
    }

    #[test]
    fn a_reflection_mirrors_about_the_normal() {
        assert_eq!(reflect(vec3(0.6, 0.0, 0.8), Vec3::Z), vec3(-0.6, 0.0, 0.8));
    }
}
