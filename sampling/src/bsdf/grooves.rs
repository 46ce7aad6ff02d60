//! Facets in V-shaped grooves over a diffuse base: what the models of Blinn and of Cook and Torrance share.

use super::fresnel::schlick;
use super::half::Half;
use super::parts::{Parts, TwoParts, diffuse_share};
use super::v_cavities::reflect_visibly;
use super::{fresnel_conductor, survival_of};
use crate::math::Spectrum;
use crate::warp::INV_PI;
use glam::{Vec2, Vec3};

/// A distribution of facets that is sampled by D(m) cos θ_m.
pub trait Facets: Copy {
    /// The density D(m) of normals [1/sr]; ∫ D(m) cos θ_m dm = 1.
    fn d(&self, m: Vec3) -> f32;

    /// A normal with the density D(m) cos θ_m.
    fn sample(&self, u: Vec2) -> Vec3;
}

/// f_s = kd/π + ks F(wo·m) D(m) G / (4 cos θ_o cos θ_i) with the half vector m; visible normals are sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grooves<D> {
    pub(super) kd: Spectrum,
    pub(super) ks: Spectrum,
    eta: Spectrum,
    k: Spectrum,
    facets: D,
    /// The albedo of the glossy part at normal incidence, but at least a 16th of what it may be.
    glossy: Spectrum,
    pub(super) survival: f32,
}

impl<D: Facets> Grooves<D> {
    /// Facets of complex index `eta` + i `k` (not both 0), scaled by `ks`, on a diffuse base of albedo `kd`; kd + ks ≤ 1.
    pub(super) fn of(kd: Spectrum, ks: Spectrum, eta: Spectrum, k: Spectrum, facets: D) -> Self {
        let glossy = ks * fresnel_conductor(1.0, eta, k);
        Self { kd, ks, eta, k, facets, glossy: glossy.max(ks * (1.0 / 16.0)), survival: survival_of(kd + glossy) }
    }
}

impl<D: Facets> TwoParts for Grooves<D> {
    /// In proportion to the albedos with Schlick's factor of smooth facets, which rises towards grazing angles.
    #[inline(always)]
    fn diffuse_pmf(&self, wo: Vec3) -> f32 {
        diffuse_share(self.kd, self.glossy + (self.ks - self.glossy) * schlick(wo.z))
    }

    #[inline(always)]
    fn parts(&self, wo: Vec3, wi: Vec3) -> Parts {
        let diffuse = self.kd * INV_PI;
        let Some(half) = Half::of(wo, wi) else { return Parts::diffuse(diffuse) };
        let d = self.facets.d(half.m);
        let fresnel = fresnel_conductor(half.cos, self.eta, self.k);
        Parts {
            diffuse,
            glossy: self.ks * fresnel * (0.25 * d * half.g_over_cosines(wo.z, wi.z)),
            glossy_pdf: half.visible_pdf(d, wo.z, wi.z),
        }
    }

    #[inline(always)]
    fn sample_glossy(&self, wo: Vec3, uc: f32, u: Vec2) -> Option<Vec3> {
        reflect_visibly(wo, self.facets.sample(u), uc)
    }
}
