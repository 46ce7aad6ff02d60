//! Exponentials, logarithms and angles for lobes, of about the precision of `f32`.
//!
//! They are inlined, which the standard library's are not, and have the same bits on every platform. The polynomials are those
//! of the Cephes library (expf, logf, atanf).

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, LOG2_E, PI};

/// ln 2 in two parts, of which the first has few bits: its multiples by an exponent are exact.
const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];

/// Added to a number, it rounds it to an integer, which the last bits of the sum hold.
const ROUNDER: f32 = 12_582_912.0;

/// 2ⁿ and e^r − 1 for x = n ln 2 + r with |r| ≤ ln 2 / 2.
#[inline(always)]
fn exp_parts(x: f32) -> (f32, f32) {
    let rounded = x * LOG2_E + ROUNDER;
    let n = rounded - ROUNDER;
    let r = (x - n * LN_2[0]) - n * LN_2[1];
    // Pairs of terms, which don't wait for one another.
    let r2 = r * r;
    let tail =
        (0.5 + r * 0.166_666_66) + r2 * ((4.166_579_6e-2 + r * 8.333_452e-3) + r2 * (1.398_2e-3 + r * 1.987_569_1e-4));
    (f32::from_bits((rounded.to_bits() << 23).wrapping_add(1.0_f32.to_bits())), r + r2 * tail)
}

/// The least argument whose exponential is not 0 here.
const LEAST: f32 = -87.0;

/// eˣ for x ≤ 88, to a relative error of 10⁻⁷; 0 below 10⁻³⁸.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    let (power, rest) = exp_parts(x);
    if x < LEAST { 0.0 } else { power + power * rest }
}

/// eˣ − 1 for x ≤ 88, to a relative error of 2·10⁻⁷.
#[inline(always)]
pub fn exp_m1(x: f32) -> f32 {
    let (power, rest) = exp_parts(x);
    if x < LEAST { -1.0 } else { power * rest + (power - 1.0) }
}

/// ln x for x ≥ 0, to a relative error of 2·10⁻⁷; of 0 and other numbers below 10⁻³⁸ it is about that of 10⁻³⁸, −88.
#[inline(always)]
pub fn ln(x: f32) -> f32 {
    // x = 2ⁿ m with m between √½ and √2.
    let n = (x.to_bits().wrapping_sub(std::f32::consts::FRAC_1_SQRT_2.to_bits()) as i32) >> 23;
    let f = f32::from_bits(x.to_bits().wrapping_sub((n << 23) as u32)) - 1.0;
    let n = n as f32;
    let (f2, f4) = (f * f, (f * f) * (f * f));
    let low = (0.333_333_3 + f * -0.249_999_94) + f2 * (0.200_007_15 + f * -0.166_680_58);
    let high = (0.142_493_23 + f * -0.124_201_41) + f2 * ((0.116_769_99 + f * -0.115_146_1) + f2 * 7.037_683_6e-2);
    let tail = (n * LN_2[1] - 0.5 * f2) + (f2 * f) * (low + f4 * high);
    let value = (f + tail) + n * LN_2[0];
    if x.is_nan() { x } else { value }
}

/// ln (1 + x) for x ≥ −1, to a relative error of 3·10⁻⁷; of −1 it is −88.
#[inline(always)]
pub fn ln_1p(x: f32) -> f32 {
    let sum = 1.0 + x;
    // With what rounding took from the sum.
    ln(sum) + (x - (sum - 1.0)) / sum.max(f32::MIN_POSITIVE)
}

/// The angle of a point in the first quadrant, which is not the origin, in [0, π/2], to a relative error of 3·10⁻⁷.
#[inline(always)]
pub fn atan2_of_positive(y: f32, x: f32) -> f32 {
    let (least, most) = (y.min(x), y.max(x));
    // From π/8 on, by the angle to the diagonal.
    let is_steep = least > 0.414_213_57 * most;
    let (above, below) = if is_steep { (least - most, least + most) } else { (least, most) };
    let t = above / below;
    let z = t * t;
    let tail = z * (-0.333_329_5 + z * (0.199_777_11 + z * (-0.138_776_86 + z * 8.053_745e-2)));
    let angle = (if is_steep { FRAC_PI_4 } else { 0.0 }) + (t + t * tail);
    if y > x { FRAC_PI_2 - angle } else { angle }
}

/// The angle of a point of the upper half plane, y ≥ 0, in [0, π].
#[inline(always)]
pub fn atan2_of_upper(y: f32, x: f32) -> f32 {
    let angle = atan2_of_positive(y, x.abs());
    if x < 0.0 { PI - angle } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest relative error over these arguments.
    fn error(arguments: impl Iterator<Item = f32>, f: fn(f32) -> f32, exact: fn(f64) -> f64) -> f64 {
        let relative = |x: f32| (f64::from(f(x)) / exact(f64::from(x)) - 1.0).abs();
        let worst = arguments.max_by(|a, b| relative(*a).total_cmp(&relative(*b))).expect("arguments");
        println!("{:.2e} at {worst:e}", relative(worst));
        relative(worst)
    }

    /// Steps over a range, ends included.
    fn even(from: f32, to: f32) -> impl Iterator<Item = f32> {
        (0..=1_000_000).map(move |i| from + (to - from) * (i as f32 / 1e6))
    }

    /// Every 997th positive number from one to another.
    fn all(from: f32, to: f32) -> impl Iterator<Item = f32> {
        (from.to_bits()..to.to_bits()).step_by(997).map(f32::from_bits)
    }

    #[test]
    fn exponentials_are_exact_to_rounding() {
        assert!(error(even(-87.0, 88.0), exp, f64::exp) < 1.2e-7);
        assert!(error(even(-30.0, 30.0).filter(|x| *x != 0.0), exp_m1, f64::exp_m1) < 2.2e-7);
        assert!(error(all(1e-30, 1.0), exp_m1, f64::exp_m1) < 2.2e-7);
        assert!(error(all(1e-30, 87.0).map(|x| -x), exp_m1, f64::exp_m1) < 2.2e-7);
        assert_eq!((exp(0.0), exp_m1(0.0), exp(-100.0), exp_m1(-1e30)), (1.0, 0.0, 0.0, -1.0));
        assert_eq!(exp(f32::NEG_INFINITY), 0.0);
        assert!(exp(f32::NAN).is_nan() && exp_m1(f32::NAN).is_nan() && exp_m1(f32::NEG_INFINITY) == -1.0);
    }

    #[test]
    fn logarithms_are_exact_to_rounding() {
        assert!(error(all(1.2e-38, 1e38).filter(|x| *x != 1.0), ln, f64::ln) < 1.5e-7);
        assert!(error(all(1e-37, 1e6), ln_1p, f64::ln_1p) < 2.5e-7);
        assert!(error(all(1e-37, 1.0).map(|x| -x), ln_1p, f64::ln_1p) < 2.5e-7);
        assert_eq!((ln(1.0), ln_1p(0.0)), (0.0, 0.0));
        assert!(ln(f32::NAN).is_nan() && ln_1p(f32::NAN).is_nan());
        assert!([ln(0.0), ln(1e-45), ln_1p(-1.0)].iter().all(|ln| (-89.0..-87.0).contains(ln)));
    }

    #[test]
    fn angles_are_exact_to_rounding() {
        assert!(error(all(1e-20, 1e20), |x| atan2_of_positive(x, 1.0), f64::atan) < 2.5e-7);
        assert!(error(even(-10.0, 10.0), |x| atan2_of_upper(0.5, x), |x| 0.5_f64.atan2(x)) < 2.5e-7);
        assert_eq!((atan2_of_positive(0.0, 2.0), atan2_of_positive(2.0, 0.0)), (0.0, FRAC_PI_2));
        assert_eq!((atan2_of_upper(0.0, -1.0), atan2_of_upper(0.0, 1.0)), (PI, 0.0));
    }
}
