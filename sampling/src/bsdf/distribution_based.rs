//! Reflection by a density of half vectors that the user draws.

use super::fresnel::schlick;
use super::half::Half;
use super::parts::{Parts, TwoParts, scatters_in_two_parts};
use super::{Arguments, Bsdf, BsdfModel, Domain, Lobes, Misfit, Parameter, Preset, Shared, Table, Tables, survival_of};
use crate::distribution::Piecewise1D;
use crate::math::elementary::atan2_of_positive;
use crate::math::{Spectrum, reflect};
use crate::warp::{linear, sin_cos_turns};
use glam::{Vec2, Vec3, vec3};
use std::f32::consts::FRAC_PI_2;

/// f_s = c p(m) F(wo·m) / (cos θ_o + cos θ_i − cos θ_o cos θ_i) with the half vector m [Ashikhmin07, section 2].
///
/// p is any density of half vectors; here it depends on θ_m alone and is drawn as numbers at equal steps of θ_m from 0° to
/// 90°, between which it is linear in cos θ_m. Their scale means nothing: ∫ p dm = 1, and c is what brings the largest
/// directional albedo with F = 1 to 1 (less a thousandth, the quadrature's error). F is Schlick's.
///
/// Half vectors are sampled by p; where they mirror below the horizon samples fail. The source's diffuse part and its
/// anisotropic p are left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistributionBased {
    reflectance: Spectrum,
    half_vectors: Shared<HalfVectors>,
}

impl DistributionBased {
    /// The reflectance at normal incidence, in [0, 1], and the density.
    pub fn new(reflectance: Spectrum, half_vectors: Shared<HalfVectors>) -> Self {
        Self { reflectance, half_vectors }
    }
}

/// A density of half vectors by their polar angle.
#[derive(Debug)]
pub struct HalfVectors {
    /// p at equal steps of θ [1/sr].
    nodes: Vec<f32>,
    /// 1 − cos θ at the nodes.
    depths: Vec<f32>,
    /// The choice of an interval between nodes.
    intervals: Piecewise1D,
    /// Of each interval, what the density of samples is over p: 1 up to the granularity of random numbers.
    ratios: Vec<f32>,
    /// c.
    scale: f32,
}

static TABLES: Tables<HalfVectors> = Tables::new();

/// Nodes below this share of the largest are taken as zero, so that no density underflows where a value does not.
const LEAST: f32 = 1e-20;

impl HalfVectors {
    /// The density that is proportional to these numbers at equal steps from 0° to 90°.
    ///
    /// # Errors
    ///
    /// Fewer than two, too many, all zero, or one that is not finite.
    pub fn read(numbers: &[f32]) -> Result<Shared<Self>, String> {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        TABLES.get(&bytes, || Self::new(numbers))
    }

    fn new(numbers: &[f32]) -> Result<Self, String> {
        let largest = numbers.iter().copied().fold(0.0, f32::max);
        if let Some(i) = numbers.iter().position(|x| !x.is_finite()) {
            return Err(format!(
                "number {} is not finite or larger than {:.1e}: give smaller ones, of which the scale means nothing",
                i + 1,
                f32::MAX
            ));
        }
        if numbers.len() < 2 || largest == 0.0 {
            return Err("give at least two numbers, of which one is positive".to_string());
        }
        let drawn = |i: usize| Some(f64::from(numbers[i] / largest)).filter(|x| *x >= f64::from(LEAST)).unwrap_or(0.0);
        let last = numbers.len() - 1;
        let depth = |i: usize| {
            let half = std::f64::consts::FRAC_PI_4 * i as f64 / last as f64;
            2.0 * half.sin() * half.sin()
        };
        // ∫ p dm over an interval, where dm = 2π d(1 − cos θ).
        let mass = |i: usize| std::f64::consts::PI * (drawn(i) + drawn(i + 1)) * (depth(i + 1) - depth(i));
        let masses: Vec<f64> = (0..last).map(mass).collect();
        let total: f64 = masses.iter().sum();
        let intervals = Piecewise1D::new(&masses).map_err(|error| error.to_string())?;
        let share = |i: usize| f64::from(intervals.pdf((i as f32 + 0.5) / last as f32)) / last as f64;
        let ratio = |i: usize| if masses[i] > 0.0 { share(i) * total / masses[i] } else { 0.0 };
        let ratios = (0..last).map(|i| ratio(i) as f32).collect();
        let nodes = (0..=last).map(|i| (drawn(i) / total) as f32).collect();
        let depths = (0..=last).map(|i| depth(i) as f32).collect();
        let mut table = Self { nodes, depths, intervals, ratios, scale: 0.0 };
        table.scale = (0.999 / table.largest_albedo()) as f32;
        Ok(table)
    }

    /// p at a half vector, and the density of samples there [1/sr].
    #[inline(always)]
    fn at(&self, m: Vec3) -> (f32, f32) {
        let sin2 = m.x * m.x + m.y * m.y;
        let last = self.ratios.len();
        let place = atan2_of_positive(sin2.sqrt(), m.z) * (last as f32 / FRAC_PI_2);
        let i = (place as usize).min(last - 1);
        let depth = sin2 / (1.0 + m.z);
        let t = ((depth - self.depths[i]) / (self.depths[i + 1] - self.depths[i])).clamp(0.0, 1.0);
        let p = self.nodes[i] + t * (self.nodes[i + 1] - self.nodes[i]);
        (p, p * self.ratios[i])
    }

    /// A half vector.
    #[inline(always)]
    fn sample(&self, u: Vec2) -> Vec3 {
        let (x, _, i) = self.intervals.sample(u.y);
        let v = (x * self.ratios.len() as f32 - i as f32).clamp(0.0, 1.0);
        let t = linear(v, self.nodes[i], self.nodes[i + 1]);
        let depth = self.depths[i] + t * (self.depths[i + 1] - self.depths[i]);
        let sin = (depth * (2.0 - depth)).max(0.0).sqrt();
        let (sin_phi, cos_phi) = sin_cos_turns(u.x);
        vec3(sin * cos_phi, sin * sin_phi, 1.0 - depth)
    }

    /// The largest directional albedo with c = F = 1, to 10⁻³, by quadrature over half vectors.
    fn largest_albedo(&self) -> f64 {
        const COSINES: usize = 48;
        // Squares of even steps, which are finer towards the horizon.
        let cosines = (0..=COSINES).map(|i| (i as f64 / COSINES as f64).powi(2));
        cosines.map(|cos| self.albedo(cos)).fold(0.0, f64::max)
    }

    /// ∫ p(m) cos θ_i / (cos θ_o + cos θ_i − cos θ_o cos θ_i) 4 wo·m dm over the m that mirror above the horizon.
    fn albedo(&self, cos_o: f64) -> f64 {
        const AZIMUTHS: usize = 64;
        let last = self.ratios.len();
        let points = (256 / last).max(1);
        let sin_o = (1.0 - cos_o * cos_o).sqrt();
        let azimuths: Vec<f64> =
            (0..AZIMUTHS).map(|j| (std::f64::consts::PI * (j as f64 + 0.5) / AZIMUTHS as f64).cos()).collect();
        let mut sum = 0.0;
        for i in (0..last).filter(|i| self.ratios[*i] > 0.0) {
            let [low, high, p_low, p_high] =
                [self.depths[i], self.depths[i + 1], self.nodes[i], self.nodes[i + 1]].map(f64::from);
            for k in 0..points {
                let t = (k as f64 + 0.5) / points as f64;
                let depth = low + t * (high - low);
                let (cos_m, sin_m) = (1.0 - depth, (depth * (2.0 - depth)).sqrt());
                let kernel = |cos_phi: &f64| {
                    let o_m = cos_o * cos_m + sin_o * sin_m * cos_phi;
                    let cos_i = 2.0 * o_m * cos_m - cos_o;
                    if cos_i <= 0.0 { 0.0 } else { cos_i * 4.0 * o_m / (cos_o + cos_i - cos_o * cos_i) }
                };
                let around = azimuths.iter().map(kernel).sum::<f64>() / AZIMUTHS as f64;
                let ring = std::f64::consts::TAU * (high - low) / points as f64;
                sum += (p_low + t * (p_high - p_low)) * ring * around;
            }
        }
        sum
    }
}

impl TwoParts for DistributionBased {
    #[inline(always)]
    fn diffuse_pmf(&self, _wo: Vec3) -> f32 {
        0.0
    }

    #[inline(always)]
    fn parts(&self, wo: Vec3, wi: Vec3) -> Parts {
        let Some(half) = Half::of(wo, wi) else { return Parts::diffuse(Spectrum::ZERO) };
        let (p, pdf) = self.half_vectors.at(half.m);
        let fresnel = self.reflectance + (Spectrum::ONE - self.reflectance) * schlick(half.cos);
        Parts {
            diffuse: Spectrum::ZERO,
            glossy: fresnel * (self.half_vectors.scale * p / (wo.z + wi.z - wo.z * wi.z)),
            // dm/dwi = 1 / (4 wo·m).
            glossy_pdf: 0.25 * pdf / half.cos,
        }
    }

    #[inline(always)]
    fn sample_glossy(&self, wo: Vec3, _uc: f32, u: Vec2) -> Option<Vec3> {
        let m = self.half_vectors.sample(u);
        let wi = reflect(wo, m);
        (wo.dot(m) > 0.0 && wi.z > 0.0).then_some(wi)
    }
}

impl BsdfModel for DistributionBased {
    const NAME: &'static str = "distribution_based";
    const ABOUT: &'static str = "a highlight whose density of half vectors is drawn by the user";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter {
            name: "half_vectors",
            about: "densities of half vectors at equal steps of their angle from 0 to 90 degrees",
            domain: Domain::Numbers { least: 2, read: |numbers| HalfVectors::read(numbers).map(Table::HalfVectors) },
            preset: Preset::Required("[1, 0.5, 0.1, 0, 0, 0, 0, 0, 0, 0]"),
        },
        Parameter::colour("reflectance", "share of light reflected at normal incidence", 0.0, 1.0, Preset::Number(0.5)),
    ];

    fn from_arguments(arguments: &Arguments) -> Result<Bsdf, Misfit> {
        let [half_vectors, reflectance] = arguments.all();
        let Table::HalfVectors(half_vectors) = half_vectors.table() else { panic!("not a density of half vectors") };
        Ok(Self::new(reflectance.colour(), half_vectors).into())
    }

    scatters_in_two_parts!();

    #[inline]
    fn lobes(&self) -> Lobes {
        Lobes::GLOSSY_REFLECTION
    }

    #[inline]
    fn survival(&self) -> f32 {
        survival_of(self.reflectance)
    }

    fn examples() -> Vec<Self> {
        let drawn = |numbers: &[f32]| HalfVectors::read(numbers).expect("numbers that make a density");
        let lobe: Vec<f32> = (0..91).map(|i| (-(i as f32 / 12.0).powi(2)).exp()).collect();
        let ring: Vec<f32> = (0..10).map(|i| if i == 3 { 1.0 } else { 0.0 }).collect();
        let spike: Vec<f32> = (0..181).map(|i| if i == 0 { 1.0 } else { 0.0 }).collect();
        vec![
            Self::new(Spectrum::new(0.9, 0.6, 0.3), drawn(&lobe)),
            Self::new(Spectrum::ONE, drawn(&[1.0, 1.0])),
            Self::new(Spectrum::ONE, drawn(&ring)),
            Self::new(Spectrum::ONE, drawn(&spike)),
            Self::new(Spectrum::ZERO, drawn(&[0.0, 0.0, 1.0])),
        ]
    }
}
