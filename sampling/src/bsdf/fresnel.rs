//! Fresnel's equations for unpolarised light at a plane interface.

use crate::math::Spectrum;

/// What becomes of light at a plane interface between two transparent media.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DielectricFresnel {
    /// The share that is reflected, F.
    pub reflected: f32,
    /// The share that is transmitted, 1 − F, with its own digits where F is near 1.
    pub transmitted: f32,
    /// The cosine of the transmitted direction; 0 if nothing is transmitted.
    pub cos_t: f32,
}

/// The shares of light that a dielectric interface reflects and transmits.
///
/// `cos` in (0, 1] is the cosine on this side, `eta` > 0 the index of the other side relative to this one. With `eta` = 1
/// exactly nothing is reflected and nothing bent.
///
/// In the form of `[Walter07]`, F = ½ a² (1 + b²) with c = cos θ and g = η cos θ_t, where g − c is taken as
/// (η² − 1) / (g + c): no digit is lost as η approaches 1 or c approaches 0.
#[inline]
pub fn fresnel_dielectric(cos: f32, eta: f32) -> DielectricFresnel {
    if eta == 1.0 {
        return DielectricFresnel { reflected: 0.0, transmitted: 1.0, cos_t: cos };
    }
    let c = cos;
    let contrast = (eta - 1.0) * (eta + 1.0);
    let g2 = contrast + c * c;
    if g2 <= 0.0 {
        return DielectricFresnel { reflected: 1.0, transmitted: 0.0, cos_t: 0.0 };
    }
    let g = g2.sqrt();
    let sum = g + c;
    let difference = contrast / sum;
    let a = difference / sum;
    let b = (c * sum - 1.0) / (c * difference + 1.0);
    // Rounding may exceed 1 by an ulp at grazing angles, which no share does.
    let reflected = (0.5 * a * a * (1.0 + b * b)).min(1.0);
    // 1 − r_s² and 1 − r_p², from r_s = (c − g)/(c + g) and r_p = (ηc − cos θ_t)/(ηc + cos θ_t).
    let cos_t = g / eta;
    let p_sum = eta * c + cos_t;
    let transmitted = (2.0 * c * g * (1.0 / (sum * sum) + 1.0 / (p_sum * p_sum))).min(1.0);
    DielectricFresnel { reflected, transmitted, cos_t }
}

/// The share of light that a conductor of complex index η + i k reflects, both relative to the side of the light.
///
/// `cos` in (0, 1]; `eta` > 0 or `k` > 0 in every channel.
#[inline]
pub fn fresnel_conductor(cos: f32, eta: Spectrum, k: Spectrum) -> Spectrum {
    let cos2 = cos * cos;
    let sin2 = (1.0 - cos) * (1.0 + cos);
    let eta2_k2 = eta * eta * k * k;
    // (a + i b)² = (η + i k)² − sin²θ, with p = a² + b².
    // With sin²θ = 1 − cos²θ the real part keeps its digits where η is near 1 and cos θ near 0.
    let real = (eta - Spectrum::ONE) * (eta + Spectrum::ONE) - k * k + Spectrum::splat(cos2);
    // p ≥ |real|, also where the squares underflow.
    let p = (real * real + 4.0 * eta2_k2).sqrt().max(real.abs());
    // a² = (p + real)/2; where real < 0 that cancels, and η²k²/b² with b² = (p − real)/2 does not.
    let half = (p + real.abs()) * 0.5;
    let a = real.select_nonnegative(half, eta2_k2 / half).sqrt();
    let s_sum = p + Spectrum::splat(cos2);
    let s_difference = a * (2.0 * cos);
    let rs = (s_sum - s_difference) / (s_sum + s_difference);
    let p_sum = p * cos2 + Spectrum::splat(sin2 * sin2);
    let p_difference = s_difference * sin2;
    // A division that does not wait for the other.
    let rp = rs * ((p_sum - p_difference) / (p_sum + p_difference));
    (rs + rp) * 0.5
}

/// The share of diffuse light from outside that a dielectric interface of relative index `eta` > 0 transmits, ∫ (1 − F) 2 cos d cos.
///
/// The closed form of `[Walsh26]`, in f64. Of diffuse light from inside the share is this over η²: the flux from one side
/// reaches what it could come from on the other.
pub fn diffuse_transmittance(eta: f32) -> f32 {
    let n = f64::from(eta);
    if n < 1.0 {
        return (n * n * transmittance_of_denser(1.0 / n)) as f32;
    }
    transmittance_of_denser(n) as f32
}

/// [`diffuse_transmittance`] for n ≥ 1.
fn transmittance_of_denser(n: f64) -> f64 {
    // The terms below cancel to n − 1 over their own magnitude; this close to 1 the first order is exact to 10⁻⁷.
    if n < 1.000_1 {
        return 1.0 - (n - 1.0) / 3.0;
    }
    let n2 = n * n;
    let (sum, n3, n4) = (n2 + 1.0, n2 * n, n2 * n2);
    let reflected = 0.5
        + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0).powi(2))
        + n2 * (n2 - 1.0).powi(2) / sum.powi(3) * ((n - 1.0) / (n + 1.0)).ln()
        - 2.0 * n3 * (n2 + 2.0 * n - 1.0) / (sum * (n4 - 1.0))
        + 8.0 * n4 * (n4 + 1.0) / (sum * (n4 - 1.0).powi(2)) * n.ln();
    1.0 - reflected
}

/// (1 − cos θ)⁵: how far Schlick's approximation has risen from the reflectance at normal incidence to 1.
#[inline]
pub fn schlick(cos: f32) -> f32 {
    let x = (1.0 - cos).max(0.0);
    let x2 = x * x;
    x2 * x2 * x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diffuse_transmittances_agree_with_quadrature() {
        for eta in
            [0.01_f32, 0.5, 1.0 / 1.5, 0.99, 1.0, 1.000_01, 1.000_09, 1.000_11, 1.001, 1.1, 1.5, 2.4, 10.0, 100.0]
        {
            // Cosines x² put nodes where F is steep, and the midpoint rule is exact to 10⁻⁷ there.
            const NODES: u32 = 20_000;
            let node = |i: u32| (f64::from(i) + 0.5) / f64::from(NODES);
            let (from, to) = (if eta < 1.0 { (1.0 - eta * eta).sqrt() } else { 0.0 }, 1.0);
            let width = f64::from(to - from);
            let sum: f64 = (0..NODES)
                .map(|i| {
                    let (x, dx) = (f64::from(from) + width * node(i) * node(i), 2.0 * node(i) * width);
                    2.0 * x * dx * (1.0 - dielectric_oracle(x, f64::from(eta)))
                })
                .sum();
            let exact = sum / f64::from(NODES);
            let closed = f64::from(diffuse_transmittance(eta));
            assert!((closed - exact).abs() < 2e-6 * exact, "{eta}: {closed} {exact}");
        }
    }

    /// The textbook form in f64: r_s and r_p by Snell's law.
    fn dielectric_oracle(cos: f64, eta: f64) -> f64 {
        let sin2_t = (1.0 - cos * cos) / (eta * eta);
        if sin2_t >= 1.0 {
            return 1.0;
        }
        let cos_t = (1.0 - sin2_t).sqrt();
        let rs = (cos - eta * cos_t) / (cos + eta * cos_t);
        let rp = (eta * cos - cos_t) / (eta * cos + cos_t);
        0.5 * (rs * rs + rp * rp)
    }

    /// The textbook form in complex f64 numbers, as pairs.
    fn conductor_oracle(cos: f64, eta: f64, k: f64) -> f64 {
        type C = (f64, f64);
        let mul = |a: C, b: C| (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0);
        let norm2 = |a: C| a.0 * a.0 + a.1 * a.1;
        let sqrt = |a: C| {
            let r = norm2(a).sqrt();
            (((r + a.0) / 2.0).sqrt(), ((r - a.0) / 2.0).sqrt().copysign(a.1))
        };
        let index: C = (eta, k);
        let index2 = mul(index, index);
        // η cos θ_t = sqrt(η² − sin²θ).
        let q = sqrt((index2.0 - (1.0 - cos * cos), index2.1));
        let rs = norm2((cos - q.0, -q.1)) / norm2((cos + q.0, q.1));
        let c2 = (index2.0 * cos, index2.1 * cos);
        let rp = norm2((c2.0 - q.0, c2.1 - q.1)) / norm2((c2.0 + q.0, c2.1 + q.1));
        0.5 * (rs + rp)
    }

    fn cosines() -> impl Iterator<Item = f32> {
        (1..=1000).map(|i| i as f32 / 1000.0).chain([1e-7, 1e-5, 1e-3, 1.0_f32.next_down()])
    }

    #[test]
    fn dielectrics_agree_with_the_textbook() {
        for eta in [1.5, 1.0 / 1.5, 1.33, 2.4, 1.0 / 2.4, 10.0, 1.01, 0.99] {
            for cos in cosines() {
                let DielectricFresnel { reflected, transmitted, cos_t } = fresnel_dielectric(cos, eta);
                let exact = dielectric_oracle(f64::from(cos), f64::from(eta));
                let what = format!("{eta} {cos}: {reflected} {transmitted} {cos_t} {exact}");
                assert!([reflected, transmitted].iter().all(|share| (0.0..=1.0).contains(share)), "{what}");
                assert!((0.0..=1.0 + 1e-6).contains(&cos_t), "{what}");
                assert!((reflected + transmitted - 1.0).abs() < 1e-6, "{what}");
                // Towards the critical angle, where g = 0, the rounding of cos² is magnified by dF/d(cos²) ~ 1/g.
                let g = (f64::from(eta).powi(2) - 1.0 + f64::from(cos).powi(2)).abs().sqrt();
                assert!((f64::from(reflected) - exact).abs() < 1e-6 + 3e-7 / g, "{what}");
            }
        }
    }

    #[test]
    fn weak_reflections_and_transmissions_keep_their_digits() {
        for eta in [1.001_f32, 0.999, 1.000_1, 1.000_001, 1.0_f32.next_up()] {
            for cos in [1.0_f32, 0.7, 0.3, 0.1] {
                let exact = dielectric_oracle(f64::from(cos), f64::from(eta));
                let f = f64::from(fresnel_dielectric(cos, eta).reflected);
                // At 45° the reflection of p-polarised light vanishes to first order, so b² needs the wider bound.
                assert!((f / exact - 1.0).abs() < 1e-4, "{eta} {cos}: {f:e} {exact:e}");
            }
        }
        for cos in [1e-3_f32, 1e-5, 1e-7, 1e-12] {
            // To first order in the cosine: 4c/√(η² − 1) for s, 4c η²/√(η² − 1) for p; halved.
            let exact = 2.0 * cos * (1.0 + 1.5 * 1.5) / 1.25_f32.sqrt();
            let t = fresnel_dielectric(cos, 1.5).transmitted;
            assert!((t / exact - 1.0).abs() < 4.0 * cos + 1e-6, "{cos:e}: {t:e} {exact:e}");
        }
    }

    #[test]
    fn matched_indices_reflect_nothing() {
        for cos in [1.0, 0.5, 1e-7, 0.0] {
            let straight = DielectricFresnel { reflected: 0.0, transmitted: 1.0, cos_t: cos };
            assert_eq!(fresnel_dielectric(cos, 1.0), straight);
        }
    }

    #[test]
    fn both_sides_see_the_same_dielectric() {
        for eta in [1.5_f32, 1.33, 1.01] {
            for cos in cosines().filter(|c| *c > 1e-3) {
                let there = fresnel_dielectric(cos, eta);
                let back = fresnel_dielectric(there.cos_t, 1.0 / eta);
                // The rounding of cos_t alone moves the way back by that much: grazing here is critical there.
                assert!((back.cos_t - cos).abs() < 1e-6 / cos, "{eta} {cos}: {back:?}");
                assert!((back.reflected - there.reflected).abs() < 1e-6 / cos, "{eta} {cos}: {there:?} {back:?}");
            }
        }
    }

    #[test]
    fn conductors_agree_with_the_textbook() {
        let metals =
            [(0.05, 4.0), (0.2, 3.4), (1.1, 6.8), (3.1, 3.3), (0.0, 1.0), (1.0, 0.0), (1.5, 0.0), (20.0, 50.0)];
        for (eta, k) in metals {
            for cos in cosines() {
                let f = fresnel_conductor(cos, Spectrum::splat(eta), Spectrum::splat(k)).to_array()[0];
                let exact = conductor_oracle(f64::from(cos), f64::from(eta), f64::from(k));
                assert!(f.is_finite() && (f64::from(f) - exact).abs() < 2e-6, "({eta}, {k}) {cos}: {f} {exact}");
            }
        }
    }
}
