//! Ashikhmin and Shirley's anisotropic Phong model.

use super::fresnel::schlick;
use super::half::Half;
use super::parts::{Parts, TwoParts, exp_of_minus, minus_ln_cos, scatters_in_two_parts};
use super::{Arguments, Bsdf, BsdfModel, Lobes, Misfit, Parameter, Preset, survival_of};
use crate::math::elementary::{exp_m1, ln_1p};
use crate::math::{Spectrum, reflect};
use crate::warp::{INV_2PI, INV_PI, sin_cos_turns};
use glam::{Vec2, Vec3, vec3};

/// A glossy part over a diffuse one that takes what the glossy part leaves `[Ashikhmin00]`, with the half vector m:
///
/// - glossy: √((n_u + 1)(n_v + 1))/8π cos θ_m^e / (wo·m max(cos θ_o, cos θ_i)) F(wo·m), where
///   e = (n_u m_x² + n_v m_y²) / (1 − m_z²) and F = Rs + (1 − Rs)(1 − wo·m)⁵ is Schlick's;
/// - diffuse: 28 Rd/23π (1 − Rs)(1 − (1 − cos θ_o/2)⁵)(1 − (1 − cos θ_i/2)⁵).
///
/// Half vectors are sampled by their density `[Ashikhmin00]`, with a weight of the glossy part of
/// F cos θ_i / max(cos θ_o, cos θ_i); where they mirror below the horizon samples fail. What the source leaves out: the
/// glossy part darkens at grazing angles for small exponents, and the diffuse one knows of an ideal mirror above it only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AshikhminShirley {
    /// 28 Rd (1 − Rs) / 23π.
    diffuse: Spectrum,
    rs: Spectrum,
    n_u: f32,
    n_v: f32,
    /// √(n_u + 1).
    root_u: f32,
    /// √(n_v + 1).
    root_v: f32,
    /// √((n_u + 1)(n_v + 1)) / 2π.
    peak: f32,
    survival: f32,
}

impl AshikhminShirley {
    /// The diffuse and the glossy reflectance, each in [0, 1], and the exponents n ≥ 0 along x and y.
    pub fn new(rd: Spectrum, rs: Spectrum, n_u: f32, n_v: f32) -> Self {
        let base = rd * (Spectrum::ONE - rs);
        let (root_u, root_v) = ((n_u + 1.0).sqrt(), (n_v + 1.0).sqrt());
        let (diffuse, peak) = (base * (28.0 / 23.0 * INV_PI), root_u * root_v * INV_2PI);
        Self { diffuse, rs, n_u, n_v, root_u, root_v, peak, survival: survival_of(base + rs) }
    }

    /// Schlick's reflectance for this cosine.
    #[inline]
    fn fresnel(&self, cos: f32) -> Spectrum {
        self.rs + (Spectrum::ONE - self.rs) * schlick(cos)
    }

    /// The density of half vectors [1/sr].
    #[inline(always)]
    fn density(&self, m: Vec3) -> f32 {
        let sin2 = m.x * m.x + m.y * m.y;
        if sin2 == 0.0 {
            return self.peak;
        }
        let exponent = (self.n_u * m.x * m.x + self.n_v * m.y * m.y) / sin2;
        self.peak * exp_of_minus(exponent * minus_ln_cos(m))
    }
}

/// 1 − (1 − cos/2)⁵, without cancellation at the horizon.
#[inline]
fn let_in(cos: f32) -> f32 {
    // 1 − (1 − x)⁵ = x (1 + y + y² + y³ + y⁴) with y = 1 − x.
    let y = 1.0 - 0.5 * cos;
    0.5 * cos * (1.0 + y * (1.0 + y * (1.0 + y * (1.0 + y))))
}

impl TwoParts for AshikhminShirley {
    #[inline(always)]
    fn diffuse_pmf(&self, wo: Vec3) -> f32 {
        if self.diffuse.is_zero() {
            return 0.0;
        }
        // The lobe spreads over other angles than that of wo: the share of the glossy part is at least that of its mean, for
        // which Schlick's (1 − cos)⁵ is 1/21.
        let rs = self.rs.mean();
        let glossy = rs + (1.0 - rs) * schlick(wo.z).max(1.0 / 21.0);
        let diffuse = 2.0 * self.diffuse.mean() * let_in(wo.z);
        (diffuse / (diffuse + glossy)).clamp(1.0 / 16.0, 15.0 / 16.0)
    }

    #[inline(always)]
    fn parts(&self, wo: Vec3, wi: Vec3) -> Parts {
        let diffuse = self.diffuse * (let_in(wo.z) * let_in(wi.z));
        let Some(half) = Half::of(wo, wi) else { return Parts::diffuse(diffuse) };
        // dm/dwi = 1 / (4 wo·m).
        let glossy_pdf = self.density(half.m) * (0.25 / half.cos);
        Parts { diffuse, glossy: self.fresnel(half.cos) * (glossy_pdf / wo.z.max(wi.z)), glossy_pdf }
    }

    #[inline(always)]
    fn sample_glossy(&self, wo: Vec3, _uc: f32, u: Vec2) -> Option<Vec3> {
        // tan φ = √((n_u + 1)/(n_v + 1)) tan 2πu in whichever quadrant 2πu is in.
        let (sin, cos) = sin_cos_turns(u.x);
        let (x, y) = (cos * self.root_v, sin * self.root_u);
        let (x2, y2) = (x * x, y * y);
        let exponent = (self.n_u * x2 + self.n_v * y2) / (x2 + y2);
        let one_minus_cos = -exp_m1(ln_1p(-u.y) / (exponent + 1.0));
        let sin_over_length = (one_minus_cos * (2.0 - one_minus_cos) / (x2 + y2)).sqrt();
        let m = vec3(x * sin_over_length, y * sin_over_length, 1.0 - one_minus_cos);
        let wi = reflect(wo, m);
        (wo.dot(m) > 0.0 && wi.z > 0.0).then_some(wi)
    }
}

impl BsdfModel for AshikhminShirley {
    const NAME: &'static str = "ashikhmin_shirley";
    const ABOUT: &'static str = "Ashikhmin and Shirley's anisotropic Phong lobe over a diffuse base";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("rd", "reflectance of the diffuse base", 0.0, 1.0, Preset::Number(0.5)),
        Parameter::colour("rs", "reflectance of the glossy part at normal incidence", 0.0, 1.0, Preset::Number(0.05)),
        Parameter::number("n_u", "exponent along the tangent", 0.0, 1e6, Preset::Number(100.0)),
        Parameter::number("n_v", "exponent across the tangent", 0.0, 1e6, Preset::Number(100.0)),
    ];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [rd, rs, n_u, n_v] = arguments.all();
        Ok(Self::new(rd.colour(), rs.colour(), n_u.number(), n_v.number()).into())
    }

    fn is_anisotropic(&self) -> bool {
        self.n_u != self.n_v
    }

    scatters_in_two_parts!();

    #[inline]
    fn lobes(&self) -> Lobes {
        if self.diffuse.is_zero() {
            return Lobes::GLOSSY_REFLECTION;
        }
        Lobes::DIFFUSE_REFLECTION | Lobes::GLOSSY_REFLECTION
    }

    #[inline]
    fn survival(&self) -> f32 {
        self.survival
    }

    fn examples() -> Vec<Self> {
        vec![
            Self::new(Spectrum::new(0.7, 0.4, 0.2), Spectrum::splat(0.05), 20.0, 20.0),
            Self::new(Spectrum::splat(0.3), Spectrum::new(0.9, 0.7, 0.3), 10.0, 1000.0),
            Self::new(Spectrum::ONE, Spectrum::ZERO, 0.0, 0.0),
            Self::new(Spectrum::ONE, Spectrum::splat(0.5), 2.0, 2.0),
            Self::new(Spectrum::ZERO, Spectrum::ONE, 1e6, 1e6),
            Self::new(Spectrum::ZERO, Spectrum::ZERO, 100.0, 100.0),
        ]
    }
}
