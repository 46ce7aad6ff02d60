//! Which code searches: that for any processor, or that for the one at hand.

#[cfg(target_arch = "x86_64")]
use super::bare::eight::Avx2;
use super::lanes::{Lanes, Portable};
use super::query::{Line, Query};
use super::{Accel, Best, Hit};
use crate::ray::Ray;
use std::fmt;

/// The code that follows rays. All of them find the same hits, to the bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Kernel(Kind);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
}

impl Kernel {
    /// The one that runs on any processor.
    pub const PORTABLE: Self = Kernel(Kind::Portable);

    /// Those that run on this processor, the fastest first.
    pub fn available() -> Vec<Self> {
        #[cfg(target_arch = "x86_64")]
        let special = Avx2::detect().map(|proof| Kernel(Kind::Avx2(proof)));
        #[cfg(not(target_arch = "x86_64"))]
        let special = None;
        special.into_iter().chain([Self::PORTABLE]).collect()
    }
}

/// The fastest that runs on this processor.
impl Default for Kernel {
    fn default() -> Self {
        Self::available()[0]
    }
}

impl fmt::Display for Kernel {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self.0 {
            Kind::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2(_) => "avx2",
        })
    }
}

impl Accel {
    /// The first surface on the ray's interval.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        match self.kernel.0 {
            Kind::Portable => self.portable_closest(ray),
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2(proof) => proof.closest(self, ray),
        }
    }

    /// Whether any surface is on the ray's interval.
    #[inline]
    pub fn any(&self, ray: &Ray) -> bool {
        match self.kernel.0 {
            Kind::Portable => self.portable_any(ray),
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2(proof) => proof.any(self, ray),
        }
    }

    /// Offers what is met.
    pub(super) fn search(&self, line: Line, best: &mut Best) {
        match self.kernel.0 {
            Kind::Portable => self.closest_with::<Portable>((), line, best),
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2(proof) => proof.search(self, line, best),
        }
    }

    /// Whether anything is met before `t_max`.
    pub(super) fn meets(&self, line: Line, t_max: f64) -> bool {
        match self.kernel.0 {
            Kind::Portable => self.any_with::<Portable>((), line, t_max),
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2(proof) => proof.meets(self, line, t_max),
        }
    }

    /// Offers what is met in the list or the tree.
    #[inline(always)]
    pub(super) fn closest_with<L: Lanes>(&self, proof: L::Proof, line: Line, best: &mut Best) {
        match self.is_list() {
            true => self.closest_in_list::<L>(proof, line, best),
            false => self.closest_in_tree::<L>(proof, &Query::of(line), best),
        }
    }

    /// Whether anything is met before `t_max`, in the list or the tree.
    #[inline(always)]
    pub(super) fn any_with<L: Lanes>(&self, proof: L::Proof, line: Line, t_max: f64) -> bool {
        match self.is_list() {
            true => self.any_in_list::<L>(proof, line, t_max),
            false => self.any_in_tree::<L>(proof, &Query::of(line), t_max),
        }
    }

    #[inline(never)]
    fn portable_closest(&self, ray: &Ray) -> Option<Hit> {
        match self.is_list() {
            true => self.closest_hit_in_list::<Portable>((), ray),
            false => self.closest_hit_in_tree::<Portable>((), ray),
        }
    }

    #[inline(never)]
    fn portable_any(&self, ray: &Ray) -> bool {
        self.any_with::<Portable>((), Line { ray, exact: None }, f64::from(ray.t_max))
    }
}
