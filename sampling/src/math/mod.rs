//! Spectra, frames, and the trigonometry of the local frame.

pub(crate) mod elementary;
mod frame;
mod spectrum;

pub use frame::Frame;
pub use spectrum::Spectrum;

use glam::Vec3;

/// The cosine of the angle between a local direction and the normal.
#[inline]
pub fn cos_theta(w: Vec3) -> f32 {
    w.z
}

/// The magnitude of [`cos_theta`].
#[inline]
pub fn abs_cos_theta(w: Vec3) -> f32 {
    w.z.abs()
}

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

/// The cosine, inside the other medium, of the refracted direction; `None` at total internal reflection.
///
/// `cos` > 0 is the cosine on this side, `eta` = η_other / η_this. With `eta` = 1 it is `cos` itself, to the bit.
#[inline]
pub fn refracted_cosine(cos: f32, eta: f32) -> Option<f32> {
    // η² cos²θ_t = η² − 1 + cos²θ_i, without the cancellation of 1 − sin²θ_i / η².
    let g2 = (eta - 1.0) * (eta + 1.0) + cos * cos;
    (g2 >= 0.0).then(|| if eta == 1.0 { cos } else { g2.sqrt() / eta })
}

/// The refraction of `wo` at an interface with normal `n`, and the relative index η_wi-side / η_wo-side it crossed.
///
/// `eta` is the index of the side that `n` points away from (inside), relative to the side it points into (outside);
/// `wo` may lie on either side. Both point away from the surface, as does the result. `None` is total internal
/// reflection.
#[inline]
pub fn refract(wo: Vec3, n: Vec3, eta: f32) -> Option<(Vec3, f32)> {
    let cos_o = wo.dot(n);
    let (n, eta) = if cos_o < 0.0 { (-n, 1.0 / eta) } else { (n, eta) };
    let cos_o = cos_o.abs();
    let cos_i = refracted_cosine(cos_o, eta)?;
    Some((-wo / eta + (cos_o / eta - cos_i) * n, eta))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    #[test]
    fn sides_are_told_apart_where_products_underflow() {
        let grazing = vec3(1.0, 0.0, 1e-30);
        assert!(same_hemisphere(grazing, grazing));
        assert!(!same_hemisphere(grazing, -grazing));
        assert!(!same_hemisphere(Vec3::X, Vec3::X));
    }

    #[test]
    fn refraction_obeys_snell_and_inverts_itself() {
        let n = vec3(0.36, -0.48, 0.8);
        for eta in [1.5, 1.0 / 1.5, 1.001, 0.999, 2.4] {
            for wo in [vec3(0.0, 0.6, 0.8), vec3(0.8, 0.0, 0.6), vec3(-0.6, 0.0, -0.8), n, -n] {
                let Some((wi, eta_rel)) = refract(wo, n, eta) else { continue };
                assert!((wi.length() - 1.0).abs() < 1e-6);
                assert!(wo.dot(n) * wi.dot(n) < 0.0);
                assert!((wo.cross(n) + eta_rel * wi.cross(n)).length() < 1e-6);
                let (back, eta_back) = refract(wi, n, eta).expect("the way back exists");
                assert!((back - wo).length() < 1e-5, "{back} {wo}");
                assert!((eta_back * eta_rel - 1.0).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn an_index_of_one_does_not_bend_grazing_light() {
        let wo = vec3(1.0, 0.0, 1e-7);
        let (wi, eta) = refract(wo, Vec3::Z, 1.0).expect("nothing is reflected");
        assert_eq!((wi, eta), (-wo, 1.0));
    }

    #[test]
    fn total_internal_reflection_is_none() {
        assert!(refract(vec3(0.8, 0.0, -0.6), Vec3::Z, 1.5).is_none());
    }

    #[test]
    fn a_reflection_mirrors_about_the_normal() {
        assert_eq!(reflect(vec3(0.6, 0.0, 0.8), Vec3::Z), vec3(-0.6, 0.0, 0.8));
    }
}
