//! Light that enters a body of a highly scattering material and leaves it elsewhere: normalised diffusion.
//!
//! A body's BSSRDF is separable \[Christensen15; PBRT3, 11.4\]:
//!
//! `S(xo, wo, xi, wi) = (1 − F(wo)) R(|xo − xi|) Sw(wi)`, with `Sw(wi) = (1 − F(wi)) / (c π)`,
//!
//! where light comes in from `wi` at `xi` and goes out along `wo` at `xo`, `F` is the Fresnel reflectance of the body's smooth
//! boundary, and `c = ∫ (1 − F) 2 cos d cos` makes the integral of `Sw` times the cosine 1. Beside it the boundary reflects `F`.
//! S is the same with its ends exchanged, so that nothing is different for importance.
//!
//! Of uniform radiance 1 around a half-space of albedo A that gives `F + (1 − F) A`: all of it where A is 1. On other shapes
//! the integral of R over the surface is not A: less over what is small or bent away, such as a sphere of radius a, where it is
//! [`cdf`](Subsurface::cdf)`(2a)` of it, and more where the surface comes back close to itself.

use crate::bsdf::{DielectricFresnel, Misfit, diffuse_transmittance, fresnel_dielectric};
use crate::math::Spectrum;
use crate::warp::INV_PI;
use std::f32::consts::PI;

/// The shortest and the longest mean free path \[m\]: between them no density leaves `f32`.
const LENGTHS: (f32, f32) = (1e-15, 1e15);

/// What light does in a body of a highly scattering material, and at its boundary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Subsurface {
    albedo: Spectrum,
    /// Probability of each channel to give the radius of a sample.
    pmf: Spectrum,
    /// s / 3l, the rate at which the profile falls in the end \[1/m\].
    rate: Spectrum,
    eta: f32,
    /// 1 / c.
    inverse_transmittance: f32,
}

impl Subsurface {
    /// A material of this surface albedo in [0, 1], the share of light that has come in which goes out again; this mean free
    /// path l > 0 \[m\]; and this index of refraction relative to what is around it.
    ///
    /// The profile's shape s is \[Christensen15, (6)\], the fit for diffuse transmission through the boundary with l the mean
    /// free path in the material: light that enters here is diffuse, since Sw is.
    ///
    /// # Errors
    ///
    /// A parameter that is not in its domain.
    pub fn new(albedo: Spectrum, mean_free_path: Spectrum, eta: f32) -> Result<Self, Misfit> {
        let all = |colour: Spectrum, (from, to)| colour.to_array().iter().all(|c| (from..=to).contains(c));
        if !all(albedo, (0.0, 1.0)) {
            return Err(Misfit::new("albedo", "keep every channel between 0 and 1"));
        }
        if !all(mean_free_path, LENGTHS) {
            let (least, most) = LENGTHS;
            return Err(Misfit::new(
                "mean_free_path",
                format!("it is a length in metres; keep every channel between {least:e} and {most:e}"),
            ));
        }
        if !(0.01..=100.0).contains(&eta) {
            return Err(Misfit::new("eta", "keep it between 0.01 and 100"));
        }
        let shape = albedo.map(|a| 1.9 - a + 3.5 * (a - 0.8) * (a - 0.8));
        let total = albedo.mean() * 3.0;
        Ok(Self {
            albedo,
            pmf: if total > 0.0 { albedo / total } else { Spectrum::ZERO },
            rate: shape / (mean_free_path * 3.0),
            eta,
            inverse_transmittance: 1.0 / diffuse_transmittance(eta),
        })
    }

    /// The same with all lengths multiplied by this, > 0.
    #[must_use]
    pub fn scaled(self, by: f32) -> Self {
        Self { rate: self.rate / by, ..self }
    }

    /// The surface albedo A, the integral of R over the plane.
    pub fn albedo(&self) -> Spectrum {
        self.albedo
    }

    /// The index of refraction relative to what is around.
    pub fn eta(&self) -> f32 {
        self.eta
    }

    /// The profile R(r) \[1/m²\], infinite at r = 0: light that has come in at one point goes out at this distance \[m\] from it.
    /// `R = A s (exp(−s r/l) + exp(−s r/3l)) / (8 π l r)` \[Christensen15, (3)\].
    pub fn reflectance(&self, r: f32) -> Spectrum {
        self.albedo * self.radial(r) / r
    }

    /// r R(r) / A \[1/m\], which is finite everywhere. Over r it is the density per area \[1/m²\] of points of the plane at the
    /// distances that [`sample_radius`](Self::sample_radius) gives, and in all directions.
    #[inline]
    pub fn radial(&self, r: f32) -> Spectrum {
        let slow = (self.rate * -r).exp();
        let fast = slow * slow * slow;
        self.rate * (fast + slow) * (3.0 / (8.0 * PI))
    }

    /// The share of what goes out that does so within a distance r ≥ 0 \[m\] of where it came in, on a plane.
    pub fn cdf(&self, r: f32) -> Spectrum {
        self.rate.map(|rate| -0.25 * ((-3.0 * rate * r).exp_m1() + 3.0 * (-rate * r).exp_m1()))
    }

    /// Chooses the channel whose profile gives the radius, with the probabilities [`pmf`](Self::channel_pmf). The body must not
    /// be black.
    #[inline]
    pub fn choose_channel(&self, uc: f32) -> usize {
        let mut left = uc;
        let mut chosen = 0;
        for (channel, share) in self.pmf.to_array().into_iter().enumerate().filter(|(_, share)| *share > 0.0) {
            chosen = channel;
            if left < share {
                break;
            }
            left -= share;
        }
        chosen
    }

    /// The probability of each channel in [`choose_channel`](Self::choose_channel): its share of the albedo.
    #[inline]
    pub fn channel_pmf(&self) -> Spectrum {
        self.pmf
    }

    /// The radius \[m\] at which the channel's [`cdf`](Self::cdf) is `u`, so that it has the density 2π r R(r) / A \[1/m\].
    ///
    /// With x = exp(−s r/3l) the cdf is 1 − (x³ + 3x)/4, a cubic of one real root: x = a − 1/a, where a³ = y + √(y² + 1) and
    /// y = 2(1 − u).
    #[inline]
    pub fn sample_radius(&self, channel: usize, u: f32) -> f32 {
        let y = 2.0 * (1.0 - f64::from(u));
        let a = (y + (y * y + 1.0).sqrt()).cbrt();
        let x = a - a.recip();
        // At u = 0 the root is 1, but for rounding.
        (-x.ln()).max(0.0) as f32 / self.rate.to_array()[channel]
    }

    /// What the boundary reflects and lets through, in a direction at an angle of this cosine in (0, 1] with its normal.
    #[inline]
    pub fn boundary(&self, cos: f32) -> DielectricFresnel {
        fresnel_dielectric(cos, self.eta)
    }

    /// Sw \[1/sr\] in a direction at an angle of this cosine in (0, 1] with the normal.
    #[inline]
    pub fn entrance(&self, cos: f32) -> f32 {
        self.boundary(cos).transmitted * self.inverse_transmittance * INV_PI
    }

    /// The probability of following what the boundary reflects, and not what comes through the body: its share of both.
    #[inline]
    pub fn reflection_pmf(&self, boundary: DielectricFresnel) -> f32 {
        if boundary.reflected == 0.0 {
            return 0.0;
        }
        boundary.reflected / (boundary.reflected + boundary.transmitted * self.albedo.max_component())
    }

    /// The weight of what comes through the body, but for R and Sw: (1 − F) over the probability of following it, in the
    /// form that keeps its digits where that is small. The body must not be black.
    #[inline]
    pub fn passage_weight(&self, boundary: DielectricFresnel) -> f32 {
        let largest = self.albedo.max_component();
        (boundary.reflected + boundary.transmitted * largest) / largest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn examples() -> Vec<Subsurface> {
        [
            (Spectrum::new(0.83, 0.79, 0.75), Spectrum::new(2e-3, 1e-3, 5e-4), 1.3),
            (Spectrum::ONE, Spectrum::splat(1.0), 1.5),
            (Spectrum::new(0.0, 0.1, 1.0), Spectrum::new(1e-15, 3.0, 1e15), 1.0),
            (Spectrum::splat(0.5), Spectrum::splat(10.0), 0.8),
        ]
        .map(|(albedo, length, eta)| Subsurface::new(albedo, length, eta).unwrap())
        .to_vec()
    }

    #[test]
    fn the_profile_integrates_to_the_albedo_and_its_cdf_is_its_integral() {
        for body in examples() {
            for channel in 0..3 {
                let (albedo, rate) = (f64::from(body.albedo.to_array()[channel]), body.rate.to_array()[channel]);
                const NODES: u32 = 40_000;
                let (end, mut sum) = (40.0 / rate, 0.0);
                for i in 0..NODES {
                    let r = end * (i as f32 + 0.5) / NODES as f32;
                    let width = f64::from(end) / f64::from(NODES);
                    sum += f64::from(body.reflectance(r).to_array()[channel])
                        * std::f64::consts::TAU
                        * f64::from(r)
                        * width;
                    if i % 4000 == 3999 {
                        let r = end * (i + 1) as f32 / NODES as f32;
                        let cdf = albedo * f64::from(body.cdf(r).to_array()[channel]);
                        assert!((sum - cdf).abs() <= 1e-5 * albedo, "{body:?} {channel} {r}: {sum} {cdf}");
                    }
                }
                assert!((sum - albedo).abs() <= 1e-5 * albedo, "{body:?} {channel}: {sum}");
            }
        }
    }

    #[test]
    fn radii_invert_the_cdf() {
        for body in examples() {
            for channel in 0..3 {
                for i in 0..=1000 {
                    let u = (i as f32 / 1000.0).min(1.0f32.next_down());
                    let r = body.sample_radius(channel, u);
                    let back = body.cdf(r).to_array()[channel];
                    assert!(r.is_finite() && r >= 0.0 && (back - u).abs() < 3e-7, "{body:?} {channel} {u}: {r} {back}");
                }
            }
        }
    }

    #[test]
    fn channels_are_chosen_by_their_albedo_and_never_a_black_one() {
        for body in examples() {
            let pmf = body.channel_pmf().to_array();
            assert!((pmf.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            let mut counts = [0; 3];
            (0..10_000).for_each(|i| counts[body.choose_channel((i as f32 + 0.5) / 10_000.0)] += 1);
            for (count, share) in counts.iter().zip(pmf) {
                assert!((*count as f32 / 10_000.0 - share).abs() < 2e-4, "{counts:?} {pmf:?}");
            }
            assert!(pmf[body.choose_channel(1.0f32.next_down())] > 0.0);
        }
    }

    #[test]
    fn what_enters_is_all_that_the_boundary_lets_through() {
        for eta in [0.1f32, 0.8, 1.0, 1.001, 1.3, 1.5, 2.4, 50.0] {
            let body = Subsurface::new(Spectrum::ONE, Spectrum::ONE, eta).unwrap();
            const NODES: u32 = 100_000;
            let from = if eta < 1.0 { (1.0 - f64::from(eta * eta)).sqrt() } else { 0.0 };
            let sum: f64 = (0..NODES)
                .map(|i| {
                    // Cosines that go as x² from where light begins to enter put nodes where F is steep.
                    let x = (f64::from(i) + 0.5) / f64::from(NODES);
                    let cos = from + (1.0 - from) * x * x;
                    std::f64::consts::TAU * cos * 2.0 * x * (1.0 - from) * f64::from(body.entrance(cos as f32))
                })
                .sum();
            assert!((sum / f64::from(NODES) - 1.0).abs() < 2e-5, "{eta}: {}", sum / f64::from(NODES));
        }
    }

    #[test]
    fn the_choice_and_its_weights_account_for_all_light() {
        for body in examples() {
            for cos in [1.0f32, 0.3, 1e-3] {
                let boundary = body.boundary(cos);
                let pmf = body.reflection_pmf(boundary);
                let through = (1.0 - f64::from(pmf)) * f64::from(body.passage_weight(boundary));
                assert!((through - f64::from(boundary.transmitted)).abs() < 1e-6, "{body:?} {cos}");
            }
        }
    }

    #[test]
    fn bad_parameters_are_named() {
        let named = |albedo, length, eta| {
            Subsurface::new(Spectrum::splat(albedo), Spectrum::splat(length), eta).unwrap_err().parameter
        };
        assert_eq!(named(1.1, 1.0, 1.5), "albedo");
        assert_eq!(named(f32::NAN, 1.0, 1.5), "albedo");
        assert_eq!(named(0.5, 0.0, 1.5), "mean_free_path");
        assert_eq!(named(0.5, f32::INFINITY, 1.5), "mean_free_path");
        assert_eq!(named(0.5, 1.0, 0.0), "eta");
    }
}
