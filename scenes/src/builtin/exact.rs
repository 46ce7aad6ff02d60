//! Closed forms of whole scenes: the radiance of every order, without Monte Carlo.

use sampling::Vec3;
use sampling::math::Spectrum;

/// Albedo of every surface of `furnace`.
const FURNACE_ALBEDO: Spectrum = Spectrum::new(0.8, 0.65, 0.5);
/// Emission of every surface of `furnace` \[W/(m²·sr)\].
const FURNACE_EMISSION: Spectrum = Spectrum::new(0.15, 0.2, 0.25);

/// The radiance of order `k` that leaves point `p` \[m\], in the scene's coordinates, of a built-in scene
/// \[W/(m²·sr)\]; `None` where there is no closed form. It is the same in every direction, for both scenes are
/// Lambertian, but a scene that is not would need `direction` (unit, away from the surface).
///
/// - `furnace`: in a closed room of one albedo ρ and one emission e, order k is ρᵏ e.
/// - `integrating_sphere`: see [`integrating_sphere`].
pub fn exact(scene: &str, order: usize, p: Vec3, direction: Vec3) -> Option<Spectrum> {
    let _ = direction;
    match scene {
        "furnace" => Some(FURNACE_EMISSION * power(FURNACE_ALBEDO, order)),
        "integrating_sphere" => Some(integrating_sphere(order, p)),
        _ => None,
    }
}

/// Radiance of order `k` at point `p` of the unit sphere of the scene `integrating_sphere`.
///
/// Any two points of a sphere of radius R see one another with cos θ cos θ′ / d² = 1 / (4 R²), so a Lambertian sphere
/// gathers its mean from everywhere: with albedo ρ(x) and emission e(x), L₀ = e(x) and L_k = ρ(x) ρ̄^(k−1) ē for k ≥ 1,
/// bars for means over the area. A map that is linear in position has its value at the centre for a mean.
pub fn integrating_sphere(order: usize, p: Vec3) -> Spectrum {
    let mean_albedo = sphere_albedo(Vec3::ZERO);
    let mean_emission = sphere_emission(Vec3::ZERO);
    match order {
        0 => sphere_emission(p),
        k => sphere_albedo(p) * power(mean_albedo, k - 1) * mean_emission,
    }
}

/// ρ(x) = ½ + slope · z, with a slope for each channel.
fn sphere_albedo(p: Vec3) -> Spectrum {
    Spectrum::splat(0.5) + Spectrum::new(0.4, 0.2, -0.4) * p.z
}

/// e(x) = 0.3 + slope · x.
fn sphere_emission(p: Vec3) -> Spectrum {
    Spectrum::splat(0.3) + Spectrum::new(0.24, -0.12, 0.24) * p.x
}

/// ρᵏ in f64, rounded once.
fn power(albedo: Spectrum, k: usize) -> Spectrum {
    Spectrum::from(albedo.to_array().map(|channel| f64::from(channel).powi(k as i32) as f32))
}
