//! Interfaces.

use sampling::Spectrum;
use sampling::bsdf::{fresnel_conductor, fresnel_dielectric};

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
    let mut near = Worst::of("F near the critical angle, by condition");
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
        let (left, whole) = (n * n - 1.0 + c * c, (c * c).max((n * n - 1.0).abs()));
        if left > 0.05 * whole {
            // Near Brewster's angle, where b² vanishes beside 1, F does not vanish.
            reflected.add(found.reflected, f, at);
            transmitted.add(found.transmitted, t, at);
        } else {
            // F is the mean of the squares of (1 − x) / (1 + x) and (n² − x) / (n² + x).
            let x = left.sqrt() / c;
            let slope = [1.0, n * n].map(|a| 2.0 * a * (a - x).abs() / (a + x).powi(3)).iter().sum::<f64>();
            near.add_in(
                f64::from(found.reflected),
                f,
                f64::from(f32::EPSILON) * (1.0 + slope * whole / (c * c * x)),
                at,
            );
        }
    }
    reflected.finish(40.0);
    transmitted.finish(20.0);
    near.finish(1.2);
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
