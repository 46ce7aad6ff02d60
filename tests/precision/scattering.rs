//! Interfaces and lobes.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use sampling::Spectrum;
use sampling::bsdf::{
    Beckmann, BsdfModel, Ggx, Lobes, RoughConductor, TransportMode, Ward, fresnel_conductor, fresnel_dielectric,
};
use statrs::function::erf::erfc;

use super::{Dice, TRIES, Worst};

/// Fresnel's equations as they are printed, with the share that is transmitted from the amplitudes of its own.
pub(super) fn dielectric(cos: f64, eta: f64) -> Option<(f64, f64)> {
    let sin2 = (1.0 - cos) * (1.0 + cos);
    let cos_t2 = 1.0 - sin2 / (eta * eta);
    if cos_t2 <= 0.0 {
        return None;
    }
    let cos_t = cos_t2.sqrt();
    let (s, p) = (cos + eta * cos_t, eta * cos + cos_t);
    let reflected = (((cos - eta * cos_t) / s).powi(2) + ((eta * cos - cos_t) / p).powi(2)) / 2.0;
    Some((reflected, 2.0 * eta * cos * cos_t * (1.0 / (s * s) + 1.0 / (p * p))))
}

#[test]
fn fresnel_of_dielectrics() {
    let mut dice = Dice::new(1);
    let [mut reflected, mut transmitted] = ["F of dielectrics", "1 - F of dielectrics"].map(Worst::of);
    let mut near = Worst::of("F near the critical angle, of 1");
    for i in 0..TRIES {
        let cos = dice.share();
        let eta = match i % 3 {
            0 => dice.magnitude(0.1, 10.0),
            1 => 1.0 + dice.magnitude(1e-5, 0.1),
            _ => 1.0 - dice.magnitude(1e-5, 0.1),
        } as f32;
        let (c, n) = (f64::from(cos), f64::from(eta));
        let Some((f, t)) = dielectric(c, n) else {
            assert_eq!(fresnel_dielectric(cos, eta).reflected, 1.0, "{cos} {eta}");
            continue;
        };
        let found = fresnel_dielectric(cos, eta);
        let at = || format!("cos {cos:e}, index {eta}");
        // There F goes with the root of what is left to the critical angle, and the rounding of that is all there is of it.
        let left = (n * n - 1.0 + c * c) / (c * c).max((n * n - 1.0).abs());
        if left > 0.01 {
            // Near Brewster's angle, where b² vanishes beside 1, F does not vanish.
            reflected.add(found.reflected, f, at);
            transmitted.add(found.transmitted, t, at);
        } else {
            near.add_in(f64::from(found.reflected), f, f64::from(f32::EPSILON) / left.sqrt(), at);
        }
    }
    reflected.finish(50.0);
    transmitted.finish(60.0);
    near.finish(8.0);
}

#[test]
fn fresnel_of_conductors() {
    let mut dice = Dice::new(2);
    let mut worst = Worst::of("F of conductors, of 1 by condition");
    for _ in 0..TRIES {
        let (cos, eta, k) = (dice.share(), dice.magnitude(0.02, 10.0) as f32, dice.magnitude(0.01, 20.0) as f32);
        let (c, n, k2) = (f64::from(cos), f64::from(eta), f64::from(k).powi(2));
        let (c2, s2) = (c * c, (1.0 - c) * (1.0 + c));
        // [Born & Wolf, 14.2], as it is printed elsewhere.
        let real = n * n - k2 - s2;
        let whole = (real * real + 4.0 * n * n * k2).sqrt();
        let a = (0.5 * (whole + real)).max(0.0).sqrt();
        let s = (whole + c2 - 2.0 * a * c) / (whole + c2 + 2.0 * a * c);
        let tail = s2 * s2;
        let p = s * (c2 * whole + tail - 2.0 * a * c * s2) / (c2 * whole + tail + 2.0 * a * c * s2);
        let found = fresnel_conductor(cos, Spectrum::splat(eta), Spectrum::splat(k)).to_array()[0];
        // Where |(η + ik)² − sin²θ| is small, F is as steep as at a critical angle.
        let unit = f64::from(f32::EPSILON) * (1.0 + 1.0 / whole);
        worst.add_in(f64::from(found), 0.5 * (s + p), unit, || format!("cos {cos:e}, {eta} + {k}i"));
    }
    worst.finish(3.0);
}

/// wo, wi and their half vector, of which wi is often that of a mirror but for a few widths of a narrow lobe.
pub(super) fn pair(dice: &mut Dice, alpha: f64) -> Option<(Vec3, Vec3, DVec3)> {
    let wo = dice.direction();
    let off = alpha * dice.magnitude(1e-3, 4.0);
    let m = (DVec3::Z + off * dice.anywhere()).normalize();
    let o = wo.as_dvec3();
    let wi = (2.0 * o.dot(m) * m - o).as_vec3();
    if wi.z <= 1e-6 || wo.z <= 1e-6 {
        return None;
    }
    let h = o + wi.as_dvec3();
    (h.z > 0.0).then(|| (wo, wi, h.normalize()))
}

/// How far the value of a lobe moves, of itself, when a part in 2²⁴ of the half vector's components does: what any code has to
/// bear that rounds a half vector to single precision, in ulp.
fn condition(m: DVec3, alpha: f64) -> f64 {
    1.0 + (m.x * m.x + m.y * m.y) / (m.z * m.z * alpha * alpha)
}

#[test]
fn lobes_of_ggx() {
    let mut dice = Dice::new(3);
    let [mut density, mut area, mut value] =
        ["D of GGX", "projected area of GGX", "rough conductor of GGX, by condition"].map(Worst::of);
    for _ in 0..TRIES {
        let (ax, ay) = (dice.magnitude(1e-4, 1.0) as f32, dice.magnitude(1e-4, 1.0) as f32);
        let (x, y) = (f64::from(ax), f64::from(ay));
        let (ggx, w) = (Ggx::new(ax, ay), dice.direction());
        let v = w.as_dvec3();
        let at = || format!("{w}, widths {ax} and {ay}");
        let q = (v.x / x).powi(2) + (v.y / y).powi(2) + v.z * v.z;
        density.add(ggx.d(w), 1.0 / (PI * x * y * q * q), at);
        area.add(ggx.area(w), 0.5 * (v.z + ((x * v.x).powi(2) + (y * v.y).powi(2) + v.z * v.z).sqrt()), at);
        let Some((wo, wi, m)) = pair(&mut dice, x) else { continue };
        let lambda = |w: DVec3| 0.5 * ((x * w.truncate().length() / w.z).hypot(1.0) - 1.0);
        let (o, i) = (wo.as_dvec3(), wi.as_dvec3());
        let d = 1.0 / (PI * x * x * ((m.x * m.x + m.y * m.y) / (x * x) + m.z * m.z).powi(2));
        let exact = d / (4.0 * o.z * i.z * (1.0 + lambda(o) + lambda(i)));
        let metal = RoughConductor::from_reflectance(Spectrum::ONE, ax, ax);
        let found = metal.eval(wo, wi, Lobes::ALL, TransportMode::Radiance).to_array()[0];
        let unit = super::single(exact) * condition(m, x);
        value.add_in(f64::from(found), exact, unit, || format!("{wo} to {wi}, width {ax}"));
    }
    density.finish(12.0);
    area.finish(3.0);
    value.finish(15.0);
}

#[test]
fn lobes_of_beckmann() {
    let mut dice = Dice::new(4);
    let [mut value, mut ward] = ["rough conductor of Beckmann, by condition", "Ward, by condition"].map(Worst::of);
    for _ in 0..TRIES {
        let alpha = dice.magnitude(2e-4, 1.0) as f32;
        let a = f64::from(alpha);
        let Some((wo, wi, m)) = pair(&mut dice, a) else { continue };
        let (o, i) = (wo.as_dvec3(), wi.as_dvec3());
        let tan2 = (m.x * m.x + m.y * m.y) / (m.z * m.z);
        // What is fainter is nothing.
        if tan2 > 40.0 * a * a {
            continue;
        }
        let d = (-tan2 / (a * a)).exp() / (PI * a * a * m.z.powi(4));
        let lambda = |w: DVec3| {
            let slope = w.z / (a * w.truncate().length());
            (((-slope * slope).exp() / (slope * PI.sqrt())) - erfc(slope)) / 2.0
        };
        let at = || format!("{wo} to {wi}, width {alpha}");
        let exact = d / (4.0 * o.z * i.z * (1.0 + lambda(o) + lambda(i)));
        let facets = Beckmann::new(alpha, alpha).into();
        let metal = RoughConductor::with_facets(Spectrum::ZERO, Spectrum::ONE, facets);
        let found = metal.eval(wo, wi, Lobes::ALL, TransportMode::Radiance).to_array()[0];
        let bear = condition(m, a);
        value.add_in(f64::from(found), exact, super::single(exact) * bear, at);
        // The cosine at the facet, of which the product with `m` would know nothing where both graze: no unit vector is one exactly.
        let o_m = 0.5 * (o + i).length();
        let glossy = Ward::new(Spectrum::ZERO, Spectrum::ONE, alpha, alpha);
        let exact = d / (4.0 * o_m * o_m);
        let found = glossy.eval(wo, wi, Lobes::ALL, TransportMode::Radiance).to_array()[0];
        ward.add_in(f64::from(found), exact, super::single(exact) * bear, at);
    }
    value.finish(15.0);
    ward.finish(15.0);
}
