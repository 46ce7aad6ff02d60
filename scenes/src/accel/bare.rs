//! The only unsafe code of the project: memory that need not be cleared for every ray, and eight numbers in one AVX2 register.

use super::lanes::WIDTH;
use super::tree::DEEPEST;
use std::mem::MaybeUninit;

/// Room for the deepest tree: at each level all children but the one that is visited.
const ROOM: usize = (WIDTH - 1) * DEEPEST + 1;

/// Entries of which the last is taken first. Those below `count` have been written.
pub(super) struct Stack<T> {
    entries: [MaybeUninit<T>; ROOM],
    count: usize,
}

impl<T: Copy + PartialOrd> Stack<T> {
    #[inline(always)]
    pub fn new() -> Self {
        Stack { entries: [const { MaybeUninit::uninit() }; ROOM], count: 0 }
    }

    #[inline(always)]
    pub fn len(&self) -> usize {
        self.count
    }

    #[inline(always)]
    pub fn push(&mut self, entry: T) {
        self.entries[self.count].write(entry);
        self.count += 1;
    }

    #[inline(always)]
    pub fn pop(&mut self) -> Option<T> {
        self.count = self.count.checked_sub(1)?;
        Some(self.get(self.count))
    }

    /// Adds an entry where it belongs among those from `start` on, of which each is at least the next one.
    #[inline(always)]
    pub fn insert(&mut self, start: usize, entry: T) {
        self.push(entry);
        let mut place = self.count - 1;
        while place > start && self.get(place - 1) < entry {
            self.entries.swap(place, place - 1);
            place -= 1;
        }
    }

    #[inline(always)]
    fn get(&self, place: usize) -> T {
        debug_assert!(place <= self.count);
        // SAFETY: entries are only looked at below `count`, or by `pop` right below what it was, and all of these have been written: by
        // `push`, or by `insert`, which only exchanges those that have been.
        unsafe { self.entries[place].assume_init() }
    }
}

/// Eight numbers in one AVX2 register.
///
/// What makes it sound is [`Avx2`](eight::Avx2): there is a value of it only where the processor has been asked, and all eight numbers
/// come of one. Products and sums are fused where that is asked for, and nowhere else.
#[cfg(target_arch = "x86_64")]
pub(super) mod eight {
    use super::super::lanes::{Lanes, WIDTH};
    use super::super::query::Line;
    use super::super::{Accel, Best, Hit};
    use crate::ray::Ray;
    use sampling::vec3;
    use std::arch::x86_64::*;
    use std::ops::{Add, Div, Mul, Sub};

    /// Says that the processor has AVX2, and BMI1 and FMA, which all with AVX2 have so far.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct Avx2(());

    impl Avx2 {
        /// Asks the processor.
        pub fn detect() -> Option<Self> {
            let all =
                is_x86_feature_detected!("avx2") && is_x86_feature_detected!("bmi1") && is_x86_feature_detected!("fma");
            all.then_some(Avx2(()))
        }

        /// The first surface on the ray's interval, by code compiled for AVX2.
        #[inline]
        pub fn closest(self, accel: &Accel, ray: &Ray) -> Option<Hit> {
            let Ray { o, d, t_max } = *ray;
            // SAFETY: there is an `Avx2`, so the processor has what the functions are compiled for.
            match accel.is_list() {
                true => unsafe { closest_in_list(self, accel, o.x, o.y, o.z, d.x, d.y, d.z, t_max) },
                false => unsafe { closest_in_tree(self, accel, o.x, o.y, o.z, d.x, d.y, d.z, t_max) },
            }
        }

        /// Whether any surface is on the ray's interval, by code compiled for AVX2.
        #[inline]
        pub fn any(self, accel: &Accel, ray: &Ray) -> bool {
            let Ray { o, d, t_max } = *ray;
            // SAFETY: as above.
            match accel.is_list() {
                true => unsafe { any_in_list(self, accel, o.x, o.y, o.z, d.x, d.y, d.z, t_max) },
                false => unsafe { any_in_tree(self, accel, o.x, o.y, o.z, d.x, d.y, d.z, t_max) },
            }
        }

        /// [`Accel::closest_with`], compiled for AVX2.
        pub fn search(self, accel: &Accel, line: Line, best: &mut Best) {
            // SAFETY: as above.
            unsafe { search(self, accel, line, best) }
        }

        /// [`Accel::any_with`], compiled for AVX2.
        pub fn meets(self, accel: &Accel, line: Line, t_max: f64) -> bool {
            // SAFETY: as above.
            unsafe { meets(self, accel, line, t_max) }
        }
    }

    // A ray comes number by number, in registers: one that has just been stored so would be waited for if it were loaded in larger
    // pieces. List and tree have functions of their own, since the stack of the tree is no small matter.
    macro_rules! following {
        ($function:ident, $found:ty, $follow:ident) => {
            #[allow(clippy::too_many_arguments)]
            #[target_feature(enable = "avx2,bmi1,fma")]
            fn $function(
                proof: Avx2,
                accel: &Accel,
                o_x: f32,
                o_y: f32,
                o_z: f32,
                d_x: f32,
                d_y: f32,
                d_z: f32,
                t_max: f32,
            ) -> $found {
                accel.$follow::<Eight>(proof, &Ray { o: vec3(o_x, o_y, o_z), d: vec3(d_x, d_y, d_z), t_max })
            }
        };
    }

    following!(closest_in_list, Option<Hit>, closest_hit_in_list);
    following!(closest_in_tree, Option<Hit>, closest_hit_in_tree);
    following!(any_in_list, bool, any_hit_in_list);
    following!(any_in_tree, bool, any_hit_in_tree);

    #[target_feature(enable = "avx2,bmi1,fma")]
    fn search(proof: Avx2, accel: &Accel, line: Line, best: &mut Best) {
        accel.closest_with::<Eight>(proof, line, best);
    }

    #[target_feature(enable = "avx2,bmi1,fma")]
    fn meets(proof: Avx2, accel: &Accel, line: Line, t_max: f64) -> bool {
        accel.any_with::<Eight>(proof, line, t_max)
    }

    /// Eight numbers in a register. There are none without an [`Avx2`], since only functions that are given one, or other numbers, make them.
    #[derive(Clone, Copy)]
    pub struct Eight(__m256);

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

    impl Div for Eight {
        type Output = Self;

        #[inline(always)]
        fn div(self, other: Self) -> Self {
            // SAFETY: where there are numbers, there is AVX2.
            Eight(unsafe { _mm256_div_ps(self.0, other.0) })
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
        fn plus(self, a: Self, b: Self) -> Self {
            // SAFETY: where there are numbers, there is FMA.
            Eight(unsafe { _mm256_fmadd_ps(a.0, b.0, self.0) })
        }

        #[inline(always)]
        fn minus(self, a: Self, b: Self) -> Self {
            // SAFETY: where there are numbers, there is FMA.
            Eight(unsafe { _mm256_fnmadd_ps(a.0, b.0, self.0) })
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
        fn abs(self) -> Self {
            // SAFETY: where there are numbers, there is AVX2.
            Eight(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
        }

        #[inline(always)]
        fn at_most(self, other: Self) -> u32 {
            // SAFETY: where there are numbers, there is AVX2.
            unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) as u32 }
        }

        #[inline(always)]
        fn differs_in_sign(self, other: Self) -> u32 {
            // SAFETY: where there are numbers, there is AVX2.
            unsafe { _mm256_movemask_ps(_mm256_xor_ps(self.0, other.0)) as u32 }
        }
    }
}
