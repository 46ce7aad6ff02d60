//! Eight numbers in one AVX2 register: the only unsafe code of the project.
//!
//! What makes it sound is [`Avx2`]: there is a value of it only where the processor has been asked, and all eight numbers come of one.
//! The feature FMA is not enabled, so that no product and sum are ever fused.

use super::lanes::{Lanes, WIDTH};
use super::query::Query;
use super::{Accel, Best, Hit};
use crate::ray::Ray;
use std::arch::x86_64::*;
use std::ops::{Add, Mul, Sub};

/// Says that the processor has AVX2, and BMI1, which all with AVX2 have so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Avx2(());

impl Avx2 {
    /// Asks the processor.
    pub fn detect() -> Option<Self> {
        (is_x86_feature_detected!("avx2") && is_x86_feature_detected!("bmi1")).then_some(Avx2(()))
    }

    /// [`Accel::closest_hit`], compiled for AVX2.
    #[inline]
    pub fn closest(self, accel: &Accel, ray: &Ray) -> Option<Hit> {
        // SAFETY: there is an `Avx2`, so the processor has what the function is compiled for.
        unsafe { closest(self, accel, ray) }
    }

    /// Whether any surface is on the ray's interval, compiled for AVX2.
    #[inline]
    pub fn any(self, accel: &Accel, ray: &Ray) -> bool {
        // SAFETY: as above.
        unsafe { any(self, accel, ray) }
    }

    /// [`Accel::closest_with`], compiled for AVX2.
    pub fn search(self, accel: &Accel, query: &Query, best: &mut Best) {
        // SAFETY: as above.
        unsafe { search(self, accel, query, best) }
    }

    /// [`Accel::any_with`], compiled for AVX2.
    pub fn meets(self, accel: &Accel, query: &Query, t_max: f64) -> bool {
        // SAFETY: as above.
        unsafe { meets(self, accel, query, t_max) }
    }
}

#[target_feature(enable = "avx2,bmi1")]
fn closest(proof: Avx2, accel: &Accel, ray: &Ray) -> Option<Hit> {
    accel.closest_hit::<Eight>(proof, ray)
}

#[target_feature(enable = "avx2,bmi1")]
fn any(proof: Avx2, accel: &Accel, ray: &Ray) -> bool {
    accel.any_with::<Eight>(proof, &Query::new(ray), f64::from(ray.t_max))
}

#[target_feature(enable = "avx2,bmi1")]
fn search(proof: Avx2, accel: &Accel, query: &Query, best: &mut Best) {
    accel.closest_with::<Eight>(proof, query, best);
}

#[target_feature(enable = "avx2,bmi1")]
fn meets(proof: Avx2, accel: &Accel, query: &Query, t_max: f64) -> bool {
    accel.any_with::<Eight>(proof, query, t_max)
}

/// Eight numbers in a register. There are none without an [`Avx2`], since only functions that are given one, or other numbers, make them.
#[derive(Clone, Copy)]
pub(super) struct Eight(__m256);

impl Add for Eight {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // SAFETY: where there are numbers, there is AVX2.
        Eight(unsafe { _mm256_add_ps(self.0, other.0) })
    }
}

impl Sub for Eight {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        // SAFETY: where there are numbers, there is AVX2.
        Eight(unsafe { _mm256_sub_ps(self.0, other.0) })
    }
}

impl Mul for Eight {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // SAFETY: where there are numbers, there is AVX2.
        Eight(unsafe { _mm256_mul_ps(self.0, other.0) })
    }
}

impl Lanes for Eight {
    type Proof = Avx2;

    #[inline(always)]
    fn splat(_: Avx2, x: f32) -> Self {
        // SAFETY: there is an `Avx2`.
        Eight(unsafe { _mm256_set1_ps(x) })
    }

    #[inline(always)]
    fn load(_: Avx2, from: &[f32; WIDTH]) -> Self {
        // SAFETY: there is an `Avx2`; the reference is to eight numbers, which need not be aligned.
        Eight(unsafe { _mm256_loadu_ps(from.as_ptr()) })
    }

    #[inline(always)]
    fn load_twice(_: Avx2, from: &[f32; WIDTH / 2]) -> Self {
        // SAFETY: there is an `Avx2`; the reference is to four numbers, which need not be aligned.
        Eight(unsafe {
            let four = _mm_loadu_ps(from.as_ptr());
            _mm256_set_m128(four, four)
        })
    }

    #[inline(always)]
    fn to_array(self) -> [f32; WIDTH] {
        let mut numbers = [0.0; WIDTH];
        // SAFETY: where there are numbers, there is AVX2; there is room for eight, which need not be aligned.
        unsafe { _mm256_storeu_ps(numbers.as_mut_ptr(), self.0) };
        numbers
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: where there are numbers, there is AVX2.
        Eight(unsafe { _mm256_min_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: where there are numbers, there is AVX2.
        Eight(unsafe { _mm256_max_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> u32 {
        // SAFETY: where there are numbers, there is AVX2.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) as u32 }
    }

    #[inline(always)]
    fn equal_to(self, other: Self) -> u32 {
        // SAFETY: where there are numbers, there is AVX2.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, other.0)) as u32 }
    }

    #[inline(always)]
    fn prefetch<T>(what: &T) {
        let start: *const i8 = std::ptr::from_ref(what).cast();
        for line in 0..size_of::<T>().div_ceil(64) {
            // SAFETY: prefetching reads nothing, whatever the address.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(start.wrapping_add(64 * line)) };
        }
    }
}
