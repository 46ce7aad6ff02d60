//! Rough diffuse reflection: V-shaped grooves whose sides are Lambert's.

use super::{Arguments, Bsdf, BsdfModel, BsdfSample, Lobes, Misfit, Parameter, Preset, TransportMode, survival_of};
use crate::math::elementary::atan2_of_positive;
use crate::math::{Spectrum, same_hemisphere};
use crate::warp::{INV_PI, cosine_hemisphere, cosine_hemisphere_pdf, uniform_hemisphere, uniform_hemisphere_pdf};
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_2_PI, PI};

/// The model of `[Oren94]` in one of its two forms, for facets of albedo ρ whose angles have the standard deviation σ.
///
/// With α the larger and β the smaller polar angle, φ the difference of azimuths, and k = 0.45 σ²/(σ² + 0.09):
///
/// - *full*: light scattered once, ρ/π (C₁ + cos φ C₂ tan β + (1 − |cos φ|) C₃ tan ((α+β)/2)), and twice,
///   0.17 ρ²/π σ²/(σ² + 0.13) (1 − cos φ (2β/π)²), where C₁ = 1 − 0.5 σ²/(σ² + 0.33), C₂ = k sin α, less k (2β/π)³ where
///   cos φ < 0, and C₃ = 0.125/0.45 k (4αβ/π²)²;
/// - *qualitative*: ρ/π (C₁ + k max(0, cos φ) sin α tan β).
///
/// Both are fits to numbers, and exceed an albedo of 1 where the surface is white and seen at grazing angles: the full form
/// by up to 5.1 % (σ = 18°), the qualitative one by up to 1.5 % (σ = 11°). The full form falls below zero where σ > 40°, the
/// surface is dark, and both directions graze it from opposite sides; it is taken as zero there. Scattering of third and
/// higher order is left out, and the light lost by it is not put back.
///
/// Samples are a mixture of cosine-distributed and, for what grows towards grazing angles, uniform directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrenNayar {
    albedo: Spectrum,
    form: OrenNayarForm,
    /// C₁.
    facing: f32,
    /// k.
    oblique: f32,
    /// The factor of ρ²/π.
    twice: f32,
}

/// The two forms of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OrenNayarForm {
    /// With the term for light that is scattered twice.
    Full,
    /// Without that and without C₃, as most renderers have it.
    Qualitative,
}

impl OrenNayar {
    /// Facets of this albedo, whose angles have the standard deviation `sigma` in [0, π/2] radians.
    pub fn new(albedo: Spectrum, sigma: f32, form: OrenNayarForm) -> Self {
        let sigma2 = sigma * sigma;
        let rises_by = |offset: f32| sigma2 / (sigma2 + offset);
        let facing = 1.0 - 0.5 * rises_by(0.33);
        Self { albedo, form, facing, oblique: 0.45 * rises_by(0.09), twice: 0.17 * rises_by(0.13) }
    }

    /// f_s for directions above the surface.
    #[inline]
    fn value(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        // sin α sin β cos φ; the tangent of β turns into a division by cos β alone.
        let along = wo.x * wi.x + wo.y * wi.y;
        let cos_beta = wo.z.max(wi.z);
        match self.form {
            OrenNayarForm::Full => self.full(wo, wi, along),
            OrenNayarForm::Qualitative => {
                self.albedo * (INV_PI * (self.facing + self.oblique * along.max(0.0) / cos_beta))
            }
        }
    }

    #[inline]
    fn full(&self, wo: Vec3, wi: Vec3, along: f32) -> Spectrum {
        let ((cos_alpha, sin_alpha), (cos_beta, sin_beta)) = steeper_last(wo, wi);
        let sines = sin_alpha * sin_beta;
        if sines == 0.0 {
            // One direction is the normal, and azimuths have no meaning nor weight.
            return self.albedo * INV_PI * self.facing + self.albedo * self.albedo * (INV_PI * self.twice);
        }
        let cos_phi = (along / sines).clamp(-1.0, 1.0);
        let sin_phi = (wo.x * wi.y - wo.y * wi.x) / sines;
        // 1 − 2α/π and 1 − 2β/π, with their own digits at the horizon.
        let above = |cos: f32, sin: f32| FRAC_2_PI * atan2_of_positive(cos, sin);
        let (above_alpha, above_beta) = (above(cos_alpha, sin_alpha), above(cos_beta, sin_beta));
        let (a, b) = (1.0 - above_alpha, 1.0 - above_beta);
        let mut once = self.facing;
        if along >= 0.0 {
            once += self.oblique * along / cos_beta;
        } else {
            // sin α − (2β/π)³ is (1 − b³) − (1 − sin α), each without cancellation.
            let rest = above_beta * (3.0 - above_beta * (3.0 - above_beta));
            let difference = rest - cos_alpha * cos_alpha / (1.0 + sin_alpha);
            once += self.oblique * cos_phi * difference * sin_beta / cos_beta;
        }
        // 1 − |cos φ| = sin²φ / (1 + |cos φ|), and tan ((α+β)/2) = (sin α + sin β) / (cos α + cos β).
        let across = sin_phi * sin_phi / (1.0 + cos_phi.abs());
        let valley = (0.125 / 0.45) * self.oblique * (a * b) * (a * b);
        once += valley * across * (sin_alpha + sin_beta) / (cos_alpha + cos_beta);
        let twice = self.twice * (1.0 - cos_phi * b * b);
        (self.albedo * (INV_PI * once) + self.albedo * self.albedo * (INV_PI * twice)).max(Spectrum::ZERO)
    }

    /// The probability of a uniform direction. Seen from the normal the model is Lambert's and needs none.
    #[inline]
    fn uniform_pmf(&self, wo: Vec3) -> f32 {
        (1.0 - self.facing) * (1.0 - wo.z.abs())
    }

    #[inline]
    fn value_and_density(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        if !same_hemisphere(wo, wi) {
            return (Spectrum::ZERO, 0.0);
        }
        let (wo, wi) = (wo.with_z(wo.z.abs()), wi.with_z(wi.z.abs()));
        let uniform = self.uniform_pmf(wo);
        let pdf = uniform * uniform_hemisphere_pdf() + (1.0 - uniform) * cosine_hemisphere_pdf(wi.z);
        (self.value(wo, wi), pdf)
    }
}

/// (cos, sin) of α and β, the polar angles of two directions, β being the smaller one.
#[inline]
fn steeper_last(wo: Vec3, wi: Vec3) -> ((f32, f32), (f32, f32)) {
    let of = |w: Vec3| (w.z, (w.x * w.x + w.y * w.y).sqrt());
    if wo.z < wi.z { (of(wo), of(wi)) } else { (of(wi), of(wo)) }
}

impl BsdfModel for OrenNayar {
    const NAME: &'static str = "oren_nayar";
    const ABOUT: &'static str = "rough diffuse reflection, such as of clay, after Oren and Nayar";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("albedo", "albedo of the facets", 0.0, 1.0, Preset::Number(0.5)),
        Parameter::number(
            "sigma",
            "standard deviation of the facets' angle [degrees]",
            0.0,
            90.0,
            Preset::Number(20.0),
        ),
        Parameter::choice(
            "variant",
            "with light scattered twice, or the shorter fit without",
            &["full", "qualitative"],
        ),
    ];

    /// 1.051 of the full form, at σ = 18° and grazing angles, and 1.015 of the qualitative one, at σ = 11°; measured.
    const MAX_ALBEDO: f32 = 1.052;

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [albedo, sigma, variant] = arguments.all();
        let form = [OrenNayarForm::Full, OrenNayarForm::Qualitative][variant.choice()];
        Ok(Self::new(albedo.colour(), sigma.number() * (PI / 180.0), form).into())
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, lobes: Lobes, _mode: TransportMode) -> Spectrum {
        if !lobes.contains(Lobes::DIFFUSE_REFLECTION) {
            return Spectrum::ZERO;
        }
        self.value_and_density(wo, wi).0
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> f32 {
        self.value_and_density(wo, wi).1
    }

    #[inline]
    fn eval_pdf(&self, wo: Vec3, wi: Vec3, _mode: TransportMode) -> (Spectrum, f32) {
        self.value_and_density(wo, wi)
    }

    #[inline]
    fn sample(&self, wo: Vec3, uc: f32, u: Vec2, _mode: TransportMode) -> Option<BsdfSample> {
        let up = if uc < self.uniform_pmf(wo) { uniform_hemisphere(u) } else { cosine_hemisphere(u) };
        if wo.z == 0.0 || up.z == 0.0 {
            return None;
        }
        let wi = up.with_z(up.z.copysign(wo.z));
        let (f, pdf) = self.value_and_density(wo, wi);
        Some(BsdfSample { wi, weight: f * (up.z / pdf), pdf, lobe: Lobes::DIFFUSE_REFLECTION, eta: 1.0 })
    }

    #[inline]
    fn lobes(&self) -> Lobes {
        Lobes::DIFFUSE_REFLECTION
    }

    #[inline]
    fn survival(&self) -> f32 {
        survival_of(self.albedo)
    }

    fn examples() -> Vec<Self> {
        let clay = Spectrum::new(0.8, 0.5, 0.3);
        let degrees = |sigma: f32| sigma * (PI / 180.0);
        vec![
            Self::new(clay, degrees(20.0), OrenNayarForm::Full),
            Self::new(clay, degrees(20.0), OrenNayarForm::Qualitative),
            Self::new(Spectrum::ONE, degrees(18.0), OrenNayarForm::Full),
            Self::new(Spectrum::ONE, degrees(12.0), OrenNayarForm::Qualitative),
            Self::new(Spectrum::splat(0.1), degrees(90.0), OrenNayarForm::Full),
            Self::new(Spectrum::ZERO, 0.0, OrenNayarForm::Full),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    fn direction(theta: f64, phi: f64) -> Vec3 {
        vec3((theta.sin() * phi.cos()) as f32, (theta.sin() * phi.sin()) as f32, theta.cos() as f32)
    }

    /// The printed equations in angles and f64.
    fn printed(rho: f64, sigma: f64, theta_o: f64, theta_i: f64, phi: f64, form: OrenNayarForm) -> f64 {
        let s2 = sigma * sigma;
        let (alpha, beta) = (theta_o.max(theta_i), theta_o.min(theta_i));
        let c1 = 1.0 - 0.5 * s2 / (s2 + 0.33);
        let k = 0.45 * s2 / (s2 + 0.09);
        let pi = std::f64::consts::PI;
        let once = match form {
            OrenNayarForm::Qualitative => return rho / pi * (c1 + k * phi.cos().max(0.0) * alpha.sin() * beta.tan()),
            OrenNayarForm::Full => {
                let less = if phi.cos() >= 0.0 { 0.0 } else { (2.0 * beta / pi).powi(3) };
                let c2 = k * (alpha.sin() - less);
                let c3 = 0.125 * s2 / (s2 + 0.09) * (4.0 * alpha * beta / (pi * pi)).powi(2);
                c1 + phi.cos() * c2 * beta.tan() + (1.0 - phi.cos().abs()) * c3 * (0.5 * (alpha + beta)).tan()
            }
        };
        let twice = 0.17 * s2 / (s2 + 0.13) * (1.0 - phi.cos() * (2.0 * beta / pi).powi(2));
        (rho / pi * once + rho * rho / pi * twice).max(0.0)
    }

    #[test]
    fn values_are_those_of_the_printed_equations() {
        for (rho, sigma) in [(0.8, 0.35), (1.0, 1.5), (0.1, 1.0)] {
            for form in [OrenNayarForm::Full, OrenNayarForm::Qualitative] {
                let model = OrenNayar::new(Spectrum::splat(rho as f32), sigma as f32, form);
                for theta_o in [0.0, 0.3, 1.0, 1.5, 1.57] {
                    for theta_i in [0.01, 0.7, 1.2, 1.56, 1.5705] {
                        for phi in [0.0, 0.6, 1.5, 1.7, 2.5, std::f64::consts::PI] {
                            let f = model.value(direction(theta_o, 0.4), direction(theta_i, 0.4 + phi));
                            let exact = printed(rho, sigma, theta_o, theta_i, phi, form);
                            let error = (f64::from(f.max_component()) - exact).abs();
                            // Towards the horizon the rounding of the cosine is magnified by its inverse.
                            let cos = theta_o.cos().min(theta_i.cos());
                            assert!(
                                error < (2e-6 + 4e-7 / cos) * exact.max(0.1),
                                "{form:?} {rho} {sigma} {theta_o} {theta_i} {phi}: {f:?} {exact}"
                            );
                        }
                    }
                }
            }
        }
    }

    /// The largest albedo over σ and directions, of a white surface, by the trapezoidal rule in azimuth and the midpoint
    /// rule in the polar angle.
    fn largest_albedo(form: OrenNayarForm) -> f64 {
        let pi = std::f64::consts::PI;
        let (polar, azimuths) = (200, 64);
        let albedo = |sigma: f64, theta_o: f64| {
            let at = |i: i32| {
                let theta_i = 0.5 * pi * (f64::from(i) + 0.5) / f64::from(polar);
                let around = |j: i32| {
                    printed(1.0, sigma, theta_o, theta_i, pi * (f64::from(j) + 0.5) / f64::from(azimuths), form)
                };
                let mean = (0..azimuths).map(around).sum::<f64>() / f64::from(azimuths);
                mean * 2.0 * pi * theta_i.sin() * theta_i.cos() * 0.5 * pi / f64::from(polar)
            };
            (0..polar).map(at).sum::<f64>()
        };
        let sigmas = (1..=30).map(|i| f64::from(i) * 3.0_f64.to_radians());
        let thetas = [0.0, 0.5, 1.0, 1.3, 1.5, 0.5 * pi - 1e-3, 0.5 * pi - 1e-6];
        sigmas.flat_map(|sigma| thetas.map(|theta| albedo(sigma, theta))).fold(0.0, f64::max)
    }

    #[test]
    fn albedos_exceed_one_by_as_much_as_is_said() {
        for (form, exact) in [(OrenNayarForm::Full, 1.051), (OrenNayarForm::Qualitative, 1.015)] {
            let largest = largest_albedo(form);
            assert!((largest - exact).abs() < 1e-3, "{form:?}: {largest}");
        }
    }
}
