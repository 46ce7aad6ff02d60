//! Lafortune's generalised cosine lobe.

use super::parts::{Parts, TwoParts, diffuse_share, exp_of_minus, lobes_of, scatters_in_two_parts};
use super::{Arguments, Bsdf, BsdfModel, Lobes, Misfit, Parameter, Preset, survival_of};
use crate::math::{Frame, Spectrum};
use crate::warp::{INV_PI, power_cosine_hemisphere, power_cosine_hemisphere_pdf};
use glam::{Vec2, Vec3, vec3};
use std::f32::consts::PI;

/// f_s = kd/π + ks max(0, C_x x_o x_i + C_y y_o y_i + C_z z_o z_i)ⁿ [Lafortune97, (3)], one lobe.
///
/// The lobe is that of the cosine to the power n about the direction C wo, times |C wo|ⁿ. With −C_x = −C_y = C_z it is
/// Phong's; all positive it sends light back where it comes from; with C_z smaller it lies lower than the mirror direction
/// and grows towards grazing angles; C_x ≠ C_y makes it anisotropic. For −C_x = −C_y = C_z = C its albedo at the normal is
/// ks Cⁿ 2π/(n + 2).
///
/// Nothing is normalised, as in published fits, so that arguments can create light: those are refused by the largest
/// directional albedo, which is found by quadrature when the model is made. The source sums several lobes, with coefficients
/// for each channel; here the shape is the same in all channels. Sampled by the lobe; samples below the horizon fail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lafortune {
    kd: Spectrum,
    /// ks Mⁿ, with M the largest |C|.
    ks: Spectrum,
    /// C/M.
    c: Vec3,
    n: f32,
    /// The largest directional albedo of the lobe.
    lobe_albedo: Spectrum,
    diffuse_pmf: f32,
}

impl Lafortune {
    /// The diffuse albedo in [0, 1], the scale of the lobe, its coefficients, of which C_z ≥ 0, and its exponent n ≥ 1. What is
    /// larger than [`f32`] holds is infinite.
    pub fn new(kd: Spectrum, ks: Spectrum, c: Vec3, n: f32) -> Self {
        let largest = c.abs().max_element();
        if largest == 0.0 || ks.is_zero() {
            let none = Spectrum::ZERO;
            return Self { kd, ks: none, c: Vec3::ZERO, n, lobe_albedo: none, diffuse_pmf: 1.0 };
        }
        let (ks, c) = (ks * largest.powf(n), c / largest);
        let lobe_albedo = ks * largest_albedo(c, n);
        Self { kd, ks, c, n, lobe_albedo, diffuse_pmf: diffuse_share(kd, lobe_albedo) }
    }

    /// The largest directional albedo, no less than any.
    pub fn largest_albedo(&self) -> Spectrum {
        self.kd + self.lobe_albedo
    }
}

/// The largest directional albedo of the lobe max(0, C wo·wi)ⁿ, n ≥ 1: to 2·10⁻⁴, or to rounding where none of it is
/// below the horizon.
///
/// a(v) = ∫ max(0, v·wi)ⁿ cos θ_i dwi is convex and even in the part of v = C wo that lies in the surface, so that of all
/// azimuths it is largest along the axis with the larger |C|; there the polar angle is searched.
fn largest_albedo(c: Vec3, n: f32) -> f32 {
    const NODES: usize = 128;
    const STEPS: usize = 24;
    // Cosines u to the lobe's axis, evenly in t = uⁿ⁺¹, so that uⁿ du = dt / (n + 1).
    let cosines: [f32; NODES] = std::array::from_fn(|i| ((i as f32 + 0.5) / NODES as f32).powf(1.0 / (n + 1.0)));
    let along = c.x.abs().max(c.y.abs());
    // By the root of the cosine, which is finer where the lobe dips into the surface.
    let albedo = |root: f32| {
        let cos = (root * root).min(1.0);
        let v = (along * ((1.0 - cos) * (1.0 + cos)).sqrt(), c.z * cos);
        let length = v.0.hypot(v.1);
        if length == 0.0 {
            return 0.0;
        }
        let (cos_axis, sin_axis) = (v.1 / length, v.0 / length);
        // ∫ cosⁿ cos θ over the lobe's own hemisphere is closed, and what is negative of it, below the horizon, is taken back.
        let whole = 2.0 * PI * cos_axis / (n + 2.0);
        let below = cosines.iter().map(|&u| below_horizon(cos_axis, sin_axis, u)).sum::<f32>() / NODES as f32;
        length.powf(n) * (whole + below / (n + 1.0))
    };
    let step = 1.0 / STEPS as f32;
    let (best, most) = (0..=STEPS).map(|i| i as f32 * step).fold((0.0, 0.0), |(best, most), root| {
        let here = albedo(root);
        if here > most { (root, here) } else { (best, most) }
    });
    let (mut low, mut high) = ((best - step).max(0.0), (best + step).min(1.0));
    for _ in 0..8 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if albedo(a) < albedo(b) { low = a } else { high = b }
    }
    albedo(0.5 * (low + high)).max(most)
}

/// ∫ max(0, −cos θ) dφ over the circle of directions at the angle of cosine `u` to an axis of this polar angle.
fn below_horizon(cos_axis: f32, sin_axis: f32, u: f32) -> f32 {
    // cos θ = a + b cos φ.
    let (a, b) = (u * cos_axis, ((1.0 - u) * (1.0 + u)).sqrt() * sin_axis);
    if a >= b {
        return 0.0;
    }
    let end = (a / b).acos();
    2.0 * (b * end.sin() - a * end)
}

impl TwoParts for Lafortune {
    #[inline]
    fn diffuse_pmf(&self, _wo: Vec3) -> f32 {
        self.diffuse_pmf
    }

    #[inline]
    fn parts(&self, wo: Vec3, wi: Vec3) -> Parts {
        let diffuse = self.kd * INV_PI;
        // Products of the two first, so that the directions may be exchanged to the bit.
        let dot = (wo * wi).dot(self.c);
        let length = (wo * self.c).length();
        if dot <= 0.0 || length == 0.0 {
            return Parts::diffuse(diffuse);
        }
        let power = |cos: f32| exp_of_minus(-self.n * cos.min(1.0).ln());
        Parts {
            diffuse,
            glossy: self.ks * power(dot),
            glossy_pdf: power_cosine_hemisphere_pdf(power(dot / length), self.n),
        }
    }

    #[inline]
    fn sample_glossy(&self, wo: Vec3, _uc: f32, u: Vec2) -> Option<Vec3> {
        let axis = (wo * self.c).try_normalize()?;
        let wi = Frame::from_z(axis).to_world(power_cosine_hemisphere(u, self.n));
        (wi.z > 0.0).then_some(wi)
    }
}

impl BsdfModel for Lafortune {
    const NAME: &'static str = "lafortune";
    const ABOUT: &'static str = "Lafortune's generalised cosine lobe: off-specular, retro-reflecting or Phong's";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::colour("kd", "albedo of the diffuse part", 0.0, 1.0, Preset::Number(0.3)),
        Parameter::colour("ks", "scale of the lobe", 0.0, 1e4, Preset::Number(1.0)),
        Parameter::number("cx", "coefficient along the tangent; -1 of a mirror", -4.0, 4.0, Preset::Number(-1.0)),
        Parameter::number("cy", "coefficient across the tangent; -1 of a mirror", -4.0, 4.0, Preset::Number(-1.0)),
        Parameter::number("cz", "coefficient along the normal", 0.0, 4.0, Preset::Number(1.0)),
        Parameter::number("n", "exponent of the lobe", 1.0, 1e4, Preset::Number(20.0)),
    ];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [kd, ks, cx, cy, cz, n] = arguments.all();
        let c = vec3(cx.number(), cy.number(), cz.number());
        let model = Self::new(kd.colour(), ks.colour(), c, n.number());
        let albedo = model.largest_albedo().max_component();
        if albedo <= 1.0 + 1e-4 {
            return Ok(model.into());
        }
        let mend = "give smaller ones, or a smaller `kd`, or coefficients nearer to 0";
        Err(Misfit::new("ks", format!("with these the albedo is up to {albedo:.4}, which creates light: {mend}")))
    }

    fn is_anisotropic(&self) -> bool {
        self.c.x != self.c.y
    }

    scatters_in_two_parts!();

    #[inline]
    fn lobes(&self) -> Lobes {
        lobes_of(self.kd, self.ks)
    }

    #[inline]
    fn survival(&self) -> f32 {
        survival_of(self.largest_albedo())
    }

    fn examples() -> Vec<Self> {
        let bounded = |kd: f32, ks: f32, c: Vec3, n: f32| {
            let lobe = Self::new(Spectrum::ZERO, Spectrum::ONE, c, n).largest_albedo().max_component();
            Self::new(Spectrum::splat(kd), Spectrum::splat(ks / lobe), c, n)
        };
        vec![
            Self::new(Spectrum::new(0.3, 0.2, 0.1), Spectrum::splat(1.0), vec3(-1.0, -1.0, 1.0), 20.0),
            bounded(0.2, 0.799, vec3(-1.05, -1.05, 0.9), 15.0),
            bounded(0.0, 0.999, vec3(0.9, 0.9, 0.7), 5.0),
            bounded(0.3, 0.7, vec3(-0.8, 0.4, 0.9), 8.0),
            bounded(0.0, 1.0, vec3(-1.0, -1.0, 1.0), 1e4),
            bounded(0.0, 0.999, vec3(-1.0, -1.0, 0.0), 1.0),
            Self::new(Spectrum::ZERO, Spectrum::ZERO, vec3(-1.0, -1.0, 1.0), 20.0),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::albedo::albedo;

    #[test]
    fn the_lobe_of_phong_has_its_closed_form() {
        for n in [1.0, 5.0, 20.0, 1e4] {
            let lobe = Lafortune::new(Spectrum::ZERO, Spectrum::ONE, vec3(-1.0, -1.0, 1.0), n);
            let exact = 2.0 * PI / (n + 2.0);
            let largest = lobe.largest_albedo().max_component();
            assert!((largest / exact - 1.0).abs() < 1e-4, "{n}: {largest} {exact}");
        }
    }

    #[test]
    fn no_albedo_is_larger_than_the_largest() {
        for (c, n) in [
            (vec3(-1.05, -1.05, 0.9), 15.0),
            (vec3(0.9, 0.9, 0.7), 5.0),
            (vec3(-0.8, 0.4, 0.9), 8.0),
            (vec3(0.3, 1.0, 0.2), 2.0),
            (vec3(-1.0, -1.0, 0.0), 1.0),
            (vec3(-1.01, -1.01, 1.0), 1000.0),
        ] {
            let lobe = Lafortune::new(Spectrum::ZERO, Spectrum::ONE, c, n);
            let largest = lobe.largest_albedo().max_component();
            let found = (1..=40).map(|i| albedo(lobe, (i as f32 / 40.0).powi(2))).fold(0.0, f64::max);
            let relative = found / f64::from(largest);
            // Where it is anisotropic the azimuth here is not the one of the largest.
            let least = if c.x == c.y { 0.995 } else { 0.3 };
            assert!((least..1.001).contains(&relative), "{c} {n}: {found} of {largest}");
        }
    }

    #[test]
    fn arguments_that_create_light_are_refused() {
        let with_scale = |ks: f32| {
            let mut arguments = Arguments::presets(Lafortune::PARAMETERS);
            arguments.set(1, super::super::Argument::Colour(Spectrum::splat(ks)));
            Lafortune::from_arguments(&arguments)
        };
        // 0.3 + ks 2π/22.
        assert!(with_scale(2.45).is_ok());
        assert!(with_scale(2.46).is_err_and(|misfit| misfit.mend.contains("1.00")));
    }
}
