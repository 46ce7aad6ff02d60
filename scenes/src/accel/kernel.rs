//! Which code searches: that for any processor, or that for the one at hand.

#[cfg(target_arch = "x86_64")]
use super::bare::eight::Avx2;
use super::lanes::Portable;
use super::query::Query;
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
    pub(super) fn search(&self, query: &Query, best: &mut Best) {
        match self.kernel.0 {
            Kind::Portable => self.closest_with::<Portable>((), query, best),
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2(proof) => proof.search(self, query, best),
        }
    }

    /// Whether anything is met before `t_max`.
    pub(super) fn meets(&self, query: &Query, t_max: f64) -> bool {
        match self.kernel.0 {
            Kind::Portable => self.any_with::<Portable>((), query, t_max),
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2(proof) => proof.meets(self, query, t_max),
        }
    }

    #[inline(never)]
    fn portable_closest(&self, ray: &Ray) -> Option<Hit> {
        self.closest_hit::<Portable>((), ray)
    }

    #[inline(never)]
    fn portable_any(&self, ray: &Ray) -> bool {
        self.any_with::<Portable>((), &Query::new(ray), f64::from(ray.t_max))
    }
}
