//! Densities per solid angle and per area. Only these functions convert one into the other.

use glam::Vec3;

/// The density per area [1/m²] at `to` of a direction sampled at `from` with density `pdf` [1/sr].
///
/// `n_to` is the unit geometric normal at `to`; p_A = p_ω |cos θ_to| / d² [Veach97, section 8.2.2].
#[inline]
pub fn solid_angle_to_area(pdf: f32, from: Vec3, to: Vec3, n_to: Vec3) -> f32 {
    let (w, d2) = direction_and_squared_distance(from, to);
    pdf * w.dot(n_to).abs() / d2
}

/// The density per solid angle [1/sr] at `from` of a point `to` sampled with density `pdf_area` [1/m²].
///
/// The inverse of [`solid_angle_to_area`]: infinite where a positive density is seen exactly edge on.
#[inline]
pub fn area_to_solid_angle(pdf_area: f32, from: Vec3, to: Vec3, n_to: Vec3) -> f32 {
    if pdf_area == 0.0 {
        return 0.0;
    }
    let (w, d2) = direction_and_squared_distance(from, to);
    pdf_area * d2 / w.dot(n_to).abs()
}

/// The geometry term |cos θ_a| |cos θ_b| / d² [1/m²] without visibility [Veach97, (8.2)]; `na`, `nb` are unit normals.
#[inline]
pub fn geometry_term(a: Vec3, na: Vec3, b: Vec3, nb: Vec3) -> f32 {
    let (w, d2) = direction_and_squared_distance(a, b);
    w.dot(na).abs() * w.dot(nb).abs() / d2
}

#[inline]
fn direction_and_squared_distance(from: Vec3, to: Vec3) -> (Vec3, f32) {
    let v = to - from;
    let d2 = v.length_squared();
    (v / d2.sqrt(), d2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    #[test]
    fn the_two_conversions_are_inverse() {
        let (from, to, n) = (vec3(1.0, 2.0, 3.0), vec3(-1.0, 0.5, 7.0), vec3(0.6, 0.0, -0.8));
        let area = solid_angle_to_area(0.3, from, to, n);
        assert!((area_to_solid_angle(area, from, to, n) - 0.3).abs() < 1e-6);
    }

    #[test]
    fn a_sphere_seen_from_its_centre_has_density_over_r_squared() {
        let pdf = solid_angle_to_area(1.0, Vec3::ZERO, vec3(0.0, 0.0, 5.0), vec3(0.0, 0.0, -1.0));
        assert!((pdf - 1.0 / 25.0).abs() < 1e-8);
    }

    #[test]
    fn the_geometry_term_is_symmetric_at_every_scale() {
        for scale in [1e-6, 1.0, 1e6] {
            let (a, b) = (vec3(1.0, 1.0, 1.0) * scale, vec3(2.0, 3.0, 3.0) * scale);
            let (na, nb) = (Vec3::Z, vec3(0.0, -1.0, 0.0));
            let expected = (2.0 / 3.0) * (2.0 / 3.0) / (9.0 * scale * scale);
            assert!((geometry_term(a, na, b, nb) / expected - 1.0).abs() < 1e-5);
            assert_eq!(geometry_term(a, na, b, nb), geometry_term(b, nb, a, na));
        }
    }
}
