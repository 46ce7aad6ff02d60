//! Lafortune's generalised cosine lobes.

use super::parts::{Parts, TwoParts, diffuse_share, exp_of_minus, lobes_of, scatters_in_two_parts};
use super::{Argument, Arguments, Bsdf, BsdfModel, Lobes, Misfit, Parameter, Preset, Recalled, Shared, survival_of};
use crate::math::elementary::ln;
use crate::math::{Frame, Spectrum};
use crate::warp::{INV_PI, power_cosine_hemisphere, power_cosine_hemisphere_pdf};
use glam::{Vec2, Vec3, vec3};
use std::f32::consts::PI;

/// f_s = kd/π + Σ ks max(0, C_x x_o x_i + C_y y_o y_i + C_z z_o z_i)ⁿ over up to three lobes `[Lafortune97]`.
///
/// A lobe is that of the cosine to the power n about the direction C wo, times |C wo|ⁿ. With −C_x = −C_y = C_z it is
/// Phong's; all positive it sends light back where it comes from; with C_z smaller it lies lower than the mirror direction
/// and grows towards grazing angles; C_x ≠ C_y makes it anisotropic. For −C_x = −C_y = C_z = C its albedo at the normal is
/// ks Cⁿ 2π/(n + 2).
///
/// Nothing is normalised, as in published fits, so that arguments can create light: those are refused by a bound of the
/// directional albedo, which is exact for one lobe, and for several that are largest at different angles or azimuths too
/// large by some of it. It is found by quadrature where the coefficients and exponents are first met, which may
/// therefore not vary over a surface; kd and ks may. The source has coefficients for each channel; here the shape of a lobe is
/// the same in all channels. A lobe is chosen by its largest albedo, and sampled as such; the density is that of all lobes, and
/// samples below the horizon fail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lafortune {
    kd: Spectrum,
    /// ks Mⁿ, with M the largest |C|.
    ks: [Spectrum; LOBES],
    shapes: Shared<Shapes>,
    /// The bound of the directional albedo.
    albedo: f32,
    diffuse_pmf: f32,
    /// The choice of a lobe, if not of the diffuse part; 0 of one that isn't there.
    pmfs: [f32; LOBES],
}

/// The most lobes that there can be.
const LOBES: usize = 3;

/// The coefficients C, of which C_z ≥ 0, and the exponent n ≥ 1 of a lobe.
type Coefficients = (Vec3, f32);

/// What depends on the coefficients and exponents alone.
struct Shapes([Shape; LOBES]);

/// The shape of one lobe.
struct Shape {
    /// C/M.
    c: Vec3,
    n: f32,
    /// Mⁿ; what is larger than [`f32`] holds is infinite.
    scale: f32,
    /// The largest directional albedo of max(0, C/M wo·wi)ⁿ over the directions of each cell, by their cosines' roots.
    albedos: [f32; CELLS],
    /// The largest of those.
    largest: f32,
}

/// The cells of [`Shape::albedos`].
const CELLS: usize = 32;

static SHAPES: Recalled<{ 4 * LOBES }, Shapes> = Recalled::new();

impl Lafortune {
    /// The diffuse albedo in [0, 1], and up to three lobes: the scale of each and its coefficients and exponent.
    pub fn new(kd: Spectrum, lobes: &[(Spectrum, Coefficients)]) -> Self {
        let lobe = |i: usize| lobes.get(i).copied().unwrap_or((Spectrum::ZERO, (Vec3::ZERO, 1.0)));
        let lobes: [_; LOBES] = std::array::from_fn(lobe);
        let shapes = Shapes::of(lobes.map(|(_, coefficients)| coefficients));
        let scaled = |i: usize| if lobes[i].0.is_zero() { Spectrum::ZERO } else { lobes[i].0 * shapes.0[i].scale };
        let ks: [Spectrum; LOBES] = std::array::from_fn(scaled);
        let largest: [Spectrum; LOBES] = std::array::from_fn(|i| ks[i] * shapes.0[i].largest);
        let all: Spectrum = largest.into_iter().sum();
        // As of the diffuse part: of several at least once in 16 times.
        let share =
            |albedo: Spectrum| if albedo.is_zero() { 0.0 } else { (albedo.mean() / all.mean()).max(1.0 / 16.0) };
        let shares = largest.map(share);
        let sum: f32 = shares.iter().sum();
        let pmfs = shares.map(|share| if share > 0.0 { share / sum } else { 0.0 });
        let albedo = kd.max_component().max((kd + shapes.largest_sum(&ks)).max_component());
        Self { kd, ks, shapes, albedo, diffuse_pmf: diffuse_share(kd, all), pmfs }
    }

    /// A bound of the directional albedo in the largest channel: of no lobe or one, the largest itself.
    pub fn largest_albedo(&self) -> f32 {
        self.albedo
    }

    /// The lobes that are there: ks Mⁿ, the shape, and the probability of each.
    #[inline(always)]
    fn lobes_there(&self) -> impl Iterator<Item = (Spectrum, &Shape, f32)> {
        let lobes = self.ks.iter().zip(&self.shapes.0).zip(&self.pmfs);
        lobes.filter(|(_, pmf)| **pmf > 0.0).map(|((ks, shape), pmf)| (*ks, shape, *pmf))
    }
}

impl Shapes {
    fn of(lobes: [Coefficients; LOBES]) -> Shared<Self> {
        let mut numbers = [0.0; 4 * LOBES];
        for (numbers, (c, n)) in numbers.chunks_exact_mut(4).zip(lobes) {
            numbers.copy_from_slice(&[c.x, c.y, c.z, n]);
        }
        SHAPES.get(numbers, || Self(lobes.map(|(c, n)| Shape::new(c, n))))
    }

    /// Σ ks times the albedo of the lobe, at most, in the cell in which this is largest; each channel by itself.
    #[inline]
    fn largest_sum(&self, ks: &[Spectrum; LOBES]) -> Spectrum {
        let [a, b, c] = &self.0;
        let sums = (0..CELLS).map(|i| ks[0] * a.albedos[i] + ks[1] * b.albedos[i] + ks[2] * c.albedos[i]);
        sums.fold(Spectrum::ZERO, Spectrum::max)
    }
}

impl Shape {
    fn new(c: Vec3, n: f32) -> Self {
        let largest = c.abs().max_element();
        if largest == 0.0 {
            return Self { c, n, scale: 0.0, albedos: [0.0; CELLS], largest: 0.0 };
        }
        let c = c / largest;
        let albedos = albedos(c, n);
        Self { c, n, scale: largest.powf(n), albedos, largest: albedos.into_iter().fold(0.0, f32::max) }
    }
}

/// The largest directional albedo of the lobe max(0, C wo·wi)ⁿ, n ≥ 1, in each cell: to 2·10⁻⁴, for n of thousands 10⁻³, or to
/// rounding where none of it is below the horizon.
///
/// a(v) = ∫ max(0, v·wi)ⁿ cos θ_i dwi is convex and even in the part of v = C wo that lies in the surface, so that of all
/// azimuths it is largest along the axis with the larger |C|; there polar angles are tried.
fn albedos(c: Vec3, n: f32) -> [f32; CELLS] {
    const NODES: usize = 128;
    const STEPS: usize = 16;
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
    std::array::from_fn(|cell| {
        let root = |step: usize| (cell * STEPS + step) as f32 / (CELLS * STEPS) as f32;
        (0..=STEPS).map(|step| albedo(root(step))).fold(0.0, f32::max)
    })
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
    #[inline(always)]
    fn diffuse_pmf(&self, _wo: Vec3) -> f32 {
        self.diffuse_pmf
    }

    #[inline(always)]
    fn parts(&self, wo: Vec3, wi: Vec3) -> Parts {
        let mut parts = Parts::diffuse(self.kd * INV_PI);
        // Products of the two first, so that the directions may be exchanged to the bit.
        let products = wo * wi;
        for (ks, &Shape { c, n, .. }, pmf) in self.lobes_there() {
            let (dot, length) = (products.dot(c), (wo * c).length());
            if dot <= 0.0 || length == 0.0 {
                continue;
            }
            let power = |cos: f32| exp_of_minus(-n * ln(cos.min(1.0)));
            parts.glossy += ks * power(dot);
            parts.glossy_pdf += pmf * power_cosine_hemisphere_pdf(power(dot / length), n);
        }
        parts
    }

    #[inline(always)]
    fn sample_glossy(&self, wo: Vec3, uc: f32, u: Vec2) -> Option<Vec3> {
        let mut rest = uc;
        let mut chosen = None;
        for (_, shape, pmf) in self.lobes_there() {
            chosen = Some(shape);
            if rest < pmf {
                break;
            }
            rest -= pmf;
        }
        let Shape { c, n, .. } = chosen?;
        let axis = (wo * *c).try_normalize()?;
        let wi = Frame::from_z(axis).to_world(power_cosine_hemisphere(u, *n));
        (wi.z > 0.0).then_some(wi)
    }
}

/// The parameters of a lobe.
macro_rules! lobe {
    ($ks:literal, $scale:expr, $cx:literal, $cy:literal, $cz:literal, $n:literal) => {
        [
            Parameter::colour($ks, "scale of the lobe", 0.0, 1e4, Preset::Number($scale)),
            Parameter::number($cx, "coefficient along the tangent; -1 of a mirror", -4.0, 4.0, Preset::Number(-1.0)),
            Parameter::number($cy, "coefficient across the tangent; -1 of a mirror", -4.0, 4.0, Preset::Number(-1.0)),
            Parameter::number($cz, "coefficient along the normal", 0.0, 4.0, Preset::Number(1.0)),
            Parameter::number($n, "exponent of the lobe", 1.0, 1e4, Preset::Number(20.0)),
        ]
    };
}

impl BsdfModel for Lafortune {
    const NAME: &'static str = "lafortune";
    const ABOUT: &'static str = "Lafortune's generalised cosine lobes: off-specular, retro-reflecting or Phong's";
    const PARAMETERS: &'static [Parameter] = &{
        let [ks, cx, cy, cz, n] = lobe!("ks", 1.0, "cx", "cy", "cz", "n");
        let [ks2, cx2, cy2, cz2, n2] = lobe!("ks2", 0.0, "cx2", "cy2", "cz2", "n2");
        let [ks3, cx3, cy3, cz3, n3] = lobe!("ks3", 0.0, "cx3", "cy3", "cz3", "n3");
        let kd = Parameter::colour("kd", "albedo of the diffuse part", 0.0, 1.0, Preset::Number(0.3));
        [kd, ks, cx, cy, cz, n, ks2, cx2, cy2, cz2, n2, ks3, cx3, cy3, cz3, n3]
    };

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [kd, lobes @ ..] = arguments.all::<{ 1 + 5 * LOBES }>();
        let lobe = |i: usize| {
            let [ks, cx, cy, cz, n]: [Argument; 5] = std::array::from_fn(|k| lobes[5 * i + k]);
            (ks.colour(), (vec3(cx.number(), cy.number(), cz.number()), n.number()))
        };
        let model = Self::new(kd.colour(), &std::array::from_fn::<_, LOBES, _>(lobe));
        let albedo = model.largest_albedo();
        if albedo <= 1.0 + 1e-4 {
            return Ok(model.into());
        }
        let mend = "give smaller ones, or a smaller `kd`, or coefficients nearer to 0";
        Err(Misfit::new("ks", format!("with these the albedo is up to {albedo:.4}, which creates light: {mend}")))
    }

    fn fixed(&self) -> &'static [&'static str] {
        &["cx", "cy", "cz", "n", "cx2", "cy2", "cz2", "n2", "cx3", "cy3", "cz3", "n3"]
    }

    fn is_anisotropic(&self) -> bool {
        self.lobes_there().any(|(_, shape, _)| shape.c.x != shape.c.y)
    }

    scatters_in_two_parts!();

    #[inline]
    fn lobes(&self) -> Lobes {
        lobes_of(self.kd, self.ks.into_iter().sum())
    }

    #[inline]
    fn survival(&self) -> f32 {
        survival_of(Spectrum::splat(self.albedo))
    }

    fn examples() -> Vec<Self> {
        let mirroring = (vec3(-1.0, -1.0, 1.0), 20.0);
        // ks that brings the largest albedo of the lobe to a share.
        let scaled = |share: f32, c: Vec3, n: f32| {
            let largest = Self::new(Spectrum::ZERO, &[(Spectrum::ONE, (c, n))]).largest_albedo();
            (Spectrum::splat(share / largest), (c, n))
        };
        let bounded = |kd: f32, share: f32, c: Vec3, n: f32| Self::new(Spectrum::splat(kd), &[scaled(share, c, n)]);
        vec![
            Self::new(Spectrum::new(0.3, 0.2, 0.1), &[(Spectrum::ONE, mirroring)]),
            bounded(0.2, 0.799, vec3(-1.05, -1.05, 0.9), 15.0),
            bounded(0.0, 0.999, vec3(0.9, 0.9, 0.7), 5.0),
            bounded(0.3, 0.7, vec3(-0.8, 0.4, 0.9), 8.0),
            bounded(0.0, 1.0, vec3(-1.0, -1.0, 1.0), 1e4),
            bounded(0.0, 0.999, vec3(-1.0, -1.0, 0.0), 1.0),
            Self::new(Spectrum::ZERO, &[(Spectrum::ZERO, mirroring)]),
            // Mirroring, retro-reflecting and off-specular; one of them faint, one in a channel alone.
            Self::new(
                Spectrum::new(0.1, 0.2, 0.1),
                &[
                    scaled(0.4, vec3(-1.0, -1.0, 0.98), 40.0),
                    scaled(0.005, vec3(0.9, 0.9, 0.9), 10.0),
                    (Spectrum::new(0.5, 0.0, 0.0), (vec3(-1.0, -0.7, 0.6), 4.0)),
                ],
            ),
            Self::new(
                Spectrum::ZERO,
                &[
                    (Spectrum::ZERO, mirroring),
                    scaled(0.5, vec3(-1.0, -1.0, 1.0), 300.0),
                    scaled(0.49, vec3(-1.1, -1.1, 1.0), 3.0),
                ],
            ),
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
            let lobe = Lafortune::new(Spectrum::ZERO, &[(Spectrum::ONE, (vec3(-1.0, -1.0, 1.0), n))]);
            let exact = 2.0 * PI / (n + 2.0);
            let largest = lobe.largest_albedo();
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
            let lobe = Lafortune::new(Spectrum::ZERO, &[(Spectrum::ONE, (c, n))]);
            let largest = lobe.largest_albedo();
            let found = (1..=40).map(|i| albedo(lobe, (i as f32 / 40.0).powi(2))).fold(0.0, f64::max);
            let relative = found / f64::from(largest);
            // Where it is anisotropic the azimuth here is not the one of the largest.
            let least = if c.x == c.y { 0.995 } else { 0.3 };
            assert!((least..1.001).contains(&relative), "{c} {n}: {found} of {largest}");
        }
    }

    #[test]
    fn the_bound_of_several_lobes_is_near_their_largest_albedo() {
        let grey = |ks: f32, c: Vec3, n: f32| (Spectrum::splat(ks), (c, n));
        let lobes = [
            grey(1.0, vec3(-1.0, -1.0, 0.98), 40.0),
            grey(0.1, vec3(0.9, 0.9, 0.9), 10.0),
            grey(0.3, vec3(-1.1, -1.1, 1.0), 3.0),
        ];
        let several = Lafortune::new(Spectrum::splat(0.1), &lobes);
        let found = (1..=40).map(|i| albedo(several, (i as f32 / 40.0).powi(2))).fold(0.0, f64::max);
        let bound = f64::from(several.largest_albedo());
        assert!(found < 1.001 * bound && found > 0.97 * bound, "{found} {bound}");
    }

    #[test]
    fn a_sum_is_that_of_its_lobes() {
        let lobes = [
            (Spectrum::splat(0.5), (vec3(-1.0, -1.0, 0.9), 12.0)),
            (Spectrum::new(0.1, 0.2, 0.3), (vec3(0.8, 0.8, 0.8), 3.0)),
            (Spectrum::splat(0.2), (vec3(-1.2, -0.5, 0.4), 2.0)),
        ];
        let all = Lafortune::new(Spectrum::splat(0.1), &lobes);
        let f = |model: &Lafortune, wo, wi| model.eval(wo, wi, Lobes::ALL, crate::bsdf::TransportMode::Radiance);
        for wo in [vec3(0.6, 0.0, 0.8), vec3(0.48, -0.64, 0.6)] {
            for wi in [vec3(-0.6, 0.0, 0.8), vec3(0.0, 0.8, 0.6), vec3(0.6, 0.0, 0.8)] {
                let single = |lobe| f(&Lafortune::new(Spectrum::ZERO, &[lobe]), wo, wi);
                let sum: Spectrum = lobes.map(single).into_iter().sum();
                let error = (f(&all, wo, wi) - sum - Spectrum::splat(0.1 * INV_PI)).abs().max_component();
                assert!(error < 1e-6, "{wo} {wi}: {error}");
            }
        }
    }

    #[test]
    fn arguments_that_create_light_are_refused() {
        let with_scale = |ks: f32| {
            let mut arguments = Arguments::presets(Lafortune::PARAMETERS);
            arguments.set(1, Argument::Colour(Spectrum::splat(ks)));
            Lafortune::from_arguments(&arguments)
        };
        // 0.3 + ks 2π/22.
        assert!(with_scale(2.45).is_ok());
        assert!(with_scale(2.46).is_err_and(|misfit| misfit.mend.contains("1.00")));
    }
}
