//! The tables of the MERL database, and the distribution of half vectors of one.

use super::{BsdfModel, Merl, Shared, Tables};
use crate::math::elementary::{atan2_of_positive, atan2_of_upper};
use crate::math::{Spectrum, reflect};
use crate::warp::{linear, sin_cos_turns};
use glam::{Vec2, Vec3, vec3};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

/// Bins of the polar angle of the half vector, of that of the difference, and of its azimuth.
const BINS: [usize; 3] = [90, 90, 180];
const ENTRIES: usize = BINS[0] * BINS[1] * BINS[2];
/// The header, and three planes of f64.
const BYTES: usize = 12 + 3 * 8 * ENTRIES;
/// What the entries of red, green and blue are times.
const SCALES: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];

/// A measured reflectance, as a file of the MERL database has it `[Matusik03]`.
pub struct MerlTable {
    /// f_s by half angle, difference angle and difference azimuth, the last running fastest.
    values: Vec<Spectrum>,
    pub(super) half_vectors: HalfVectors,
    /// The largest channel of the albedo for diffuse light, a probability.
    pub(super) survival: f32,
}

/// Two directions above the surface by their half vector h and their difference d `[Rusinkiewicz98]`, symmetric to the bit.
pub(super) struct HalfAngles {
    /// √(θ_h / (π/2)), the axis on which the bins of θ_h are equal.
    root_h: f32,
    one_minus_cos_h: f32,
    theta_d: f32,
    /// In [0, π].
    phi_d: f32,
    /// cos θ_d = wo·h.
    pub(super) cos_d: f32,
}

impl HalfAngles {
    /// `None` where the directions are opposite.
    #[inline]
    pub(super) fn of(wo: Vec3, wi: Vec3) -> Option<Self> {
        let (sum, difference) = (wo + wi, wi - wo);
        let length = sum.length();
        if length == 0.0 {
            return None;
        }
        let h = sum / length;
        let sin2 = h.x * h.x + h.y * h.y;
        // The difference in the frame whose z is h and whose x leans away from the normal, times sin θ_h.
        let along = h.x * difference.x + h.y * difference.y;
        let (x, y) = match sin2 > 0.0 {
            true => (h.z * along - sin2 * difference.z, h.x * difference.y - h.y * difference.x),
            false => (difference.x, difference.y),
        };
        // Exchanging the directions changes both signs, and the azimuth by π.
        let side = if y < 0.0 || (y == 0.0 && x < 0.0) { -1.0 } else { 1.0 };
        let phi_d = if x == 0.0 && y == 0.0 { 0.0 } else { atan2_of_upper(side * y, side * x) };
        Some(Self {
            root_h: (atan2_of_positive(sin2.sqrt(), h.z) * (2.0 * FRAC_1_PI)).sqrt(),
            one_minus_cos_h: sin2 / (1.0 + h.z),
            theta_d: atan2_of_positive(difference.length(), length),
            phi_d,
            cos_d: 0.5 * length,
        })
    }
}

/// Two neighbouring bins and how far a place is from the first to the second.
#[inline]
fn between(place: f32, bins: usize) -> ([usize; 2], f32) {
    let place = (place * bins as f32 - 0.5).clamp(0.0, (bins - 1) as f32);
    let below = (place as i32 as usize).min(bins - 2);
    ([below, below + 1], place - below as f32)
}

/// The same on a circle.
#[inline]
fn between_around(place: f32, bins: usize) -> ([usize; 2], f32) {
    let place = place * bins as f32 + (bins as f32 - 0.5);
    let below = place as i32 as usize;
    ([below % bins, (below + 1) % bins], place - below as f32)
}

impl MerlTable {
    /// The table in the bytes of a `.binary` file.
    ///
    /// # Errors
    ///
    /// Another size or shape, entries that are not numbers, or a table that reflects too much more than it receives.
    pub fn read(bytes: &[u8]) -> Result<Shared<Self>, String> {
        static TABLES: Tables<MerlTable> = Tables::new();
        TABLES.get(bytes, || Self::decode(bytes))
    }

    fn decode(bytes: &[u8]) -> Result<Self, String> {
        let expected = format!("a table of {} × {} × {} has {BYTES} bytes", BINS[0], BINS[1], BINS[2]);
        let Some((header, entries)) = bytes.split_at_checked(12) else {
            return Err(format!("{} bytes are too few for a header: {expected}", bytes.len()));
        };
        let (dimensions, _) = header.as_chunks::<4>();
        let dimensions: Vec<i32> = dimensions.iter().map(|bytes| i32::from_le_bytes(*bytes)).collect();
        if dimensions.iter().zip(BINS).any(|(&dimension, bins)| dimension != bins as i32) {
            return Err(format!("the header says {dimensions:?}, not {BINS:?}: it is no isotropic table of MERL"));
        }
        if bytes.len() != BYTES {
            return Err(format!(
                "{} bytes are too {}: {expected}",
                bytes.len(),
                if bytes.len() < BYTES { "few" } else { "many" }
            ));
        }
        let mut values = vec![[0.0; 3]; ENTRIES];
        let mut measured = false;
        let (numbers, _) = entries.as_chunks::<8>();
        for (channel, plane) in numbers.chunks(ENTRIES).enumerate() {
            for (place, (value, number)) in values.iter_mut().zip(plane).enumerate() {
                let number = f64::from_le_bytes(*number);
                if !number.is_finite() {
                    return Err(format!("entry {place} of channel {channel} is {number}, and not a finite number"));
                }
                // What is not measured, as directions below the horizon, is negative.
                measured |= number >= 0.0;
                value[channel] = (number.max(0.0) * SCALES[channel]) as f32;
            }
        }
        if !measured {
            return Err("every entry is negative, which says that nothing was measured".to_string());
        }
        let values: Vec<Spectrum> = values.into_iter().map(Spectrum::from).collect();
        let half_vectors = HalfVectors::new(&values);
        let mut table = Self { values, half_vectors, survival: 1.0 };
        table.survival = table.diffuse_albedo()?;
        Ok(table)
    }

    /// The bytes of a file whose entries are the values of `f` at the centres of the bins, and −1 below the horizon.
    pub fn write(f: impl Fn(Vec3, Vec3) -> Spectrum) -> Vec<u8> {
        let mut bytes = vec![0; BYTES];
        for (bytes, bins) in bytes.chunks_mut(4).zip(BINS) {
            bytes.copy_from_slice(&(bins as i32).to_le_bytes());
        }
        for half in 0..BINS[0] {
            for difference in 0..BINS[1] {
                for (azimuth, [wo, wi]) in Self::centres(half, difference).enumerate() {
                    let mut entry = [-1.0; 3];
                    if wo.z > 0.0 && wi.z > 0.0 {
                        let values = f(wo, wi).to_array();
                        entry = std::array::from_fn(|c| f64::from(values[c]) / SCALES[c]);
                    }
                    for (channel, value) in entry.into_iter().enumerate() {
                        let place = channel * ENTRIES + (half * BINS[1] + difference) * BINS[2] + azimuth;
                        bytes[12 + 8 * place..][..8].copy_from_slice(&value.to_le_bytes());
                    }
                }
            }
        }
        bytes
    }

    /// The two directions at the centres of the bins of all azimuths.
    fn centres(half: usize, difference: usize) -> impl Iterator<Item = [Vec3; 2]> {
        let middle = |bin: usize, bins: usize| (bin as f32 + 0.5) / bins as f32;
        let (sin_h, cos_h) = (FRAC_PI_2 * middle(half, BINS[0]).powi(2)).sin_cos();
        let (sin_d, cos_d) = (FRAC_PI_2 * middle(difference, BINS[1])).sin_cos();
        (0..BINS[2]).map(move |azimuth| {
            let (sin_phi, cos_phi) = sin_cos_turns(0.5 * middle(azimuth, BINS[2]));
            [-1.0, 1.0].map(|side| {
                let (x, y) = (side * sin_d * cos_phi, side * sin_d * sin_phi);
                vec3(cos_h * x + sin_h * cos_d, y, cos_h * cos_d - sin_h * x)
            })
        })
    }

    /// f_s, linear between the centres of bins.
    #[inline]
    pub(super) fn value(&self, angles: &HalfAngles) -> Spectrum {
        let (half, x) = between(angles.root_h, BINS[0]);
        let (difference, y) = between(angles.theta_d * (2.0 * FRAC_1_PI), BINS[1]);
        let (azimuth, z) = between_around(angles.phi_d * FRAC_1_PI, BINS[2]);
        let row = |half: usize, difference: usize| {
            let start = (half * BINS[1] + difference) * BINS[2];
            let [a, b] = azimuth.map(|azimuth| self.values[start + azimuth]);
            a * (1.0 - z) + b * z
        };
        let plane = |half: usize| row(half, difference[0]) * (1.0 - y) + row(half, difference[1]) * y;
        plane(half[0]) * (1.0 - x) + plane(half[1]) * x
    }

    /// The directional albedo at a cosine, by half vectors at the middles of bins.
    fn albedo(&self, cos: f32) -> Spectrum {
        const AZIMUTHS: usize = 64;
        let wo = vec3(((1.0 - cos) * (1.0 + cos)).sqrt(), 0.0, cos);
        let mut sum = Spectrum::ZERO;
        for half in 0..BINS[0] {
            let root = (half as f32 + 0.5) / BINS[0] as f32;
            let (sin, cos_h) = (FRAC_PI_2 * root * root).sin_cos();
            // sin θ dθ dφ, with dθ = π root droot.
            let size = sin * PI * root / BINS[0] as f32 * (TAU / AZIMUTHS as f32);
            for azimuth in 0..AZIMUTHS {
                let (sin_phi, cos_phi) = sin_cos_turns((azimuth as f32 + 0.5) / AZIMUTHS as f32);
                let h = vec3(sin * cos_phi, sin * sin_phi, cos_h);
                let wi = reflect(wo, h);
                if wi.z > 0.0 && wo.dot(h) > 0.0 {
                    let value = HalfAngles::of(wo, wi).map_or(Spectrum::ZERO, |angles| self.value(&angles));
                    sum += value * (wi.z * 4.0 * wo.dot(h) * size);
                }
            }
        }
        sum
    }

    /// The largest channel of the albedo for diffuse light, as a probability of survival.
    fn diffuse_albedo(&self) -> Result<f32, String> {
        const ANGLES: usize = 24;
        let mut mean = Spectrum::ZERO;
        for i in 0..ANGLES {
            let theta = FRAC_PI_2 * (i as f32 + 0.5) / ANGLES as f32;
            let (sin, cos) = theta.sin_cos();
            let albedo = self.albedo(cos);
            let (largest, most) = (albedo.max_component(), Merl::MAX_ALBEDO);
            if largest > most {
                let degrees = theta.to_degrees();
                return Err(format!(
                    "it reflects {largest:.2} of the light at {degrees:.0}°, where {most} is the most allowed"
                ));
            }
            mean += albedo * (2.0 * sin * cos * FRAC_PI_2 / ANGLES as f32);
        }
        Ok(super::survival_of(mean))
    }
}

/// A density of half vectors about the normal: linear in 1 − cos θ_h between the edges of the table's bins.
pub(super) struct HalfVectors {
    /// 1 − cos θ_h at the edges.
    edges: [f32; BINS[0] + 1],
    /// The density there [1/sr].
    densities: [f32; BINS[0] + 1],
    /// The probability of all before each edge.
    below: [f32; BINS[0] + 1],
}

impl HalfVectors {
    /// The mean over differences of what an ideal density would be, f cos θ_i dwi/dh, by luminance.
    fn new(values: &[Spectrum]) -> Self {
        let edges: [f64; BINS[0] + 1] = std::array::from_fn(|i| {
            let theta = std::f64::consts::FRAC_PI_2 * (i as f64 / BINS[0] as f64).powi(2);
            2.0 * (0.5 * theta).sin().powi(2)
        });
        let means: Vec<f64> = (0..BINS[0]).map(|half| mean_over_differences(values, half)).collect();
        // A black table is sampled too; any density will do.
        let black = means.iter().all(|mean| *mean == 0.0);
        let mean = |half: usize| if black { 1.0 } else { means[half.min(BINS[0] - 1)] };
        let densities: [f64; BINS[0] + 1] = std::array::from_fn(|i| 0.5 * (mean(i.saturating_sub(1)) + mean(i)));
        let mut below = [0.0; BINS[0] + 1];
        for i in 0..BINS[0] {
            let size = std::f64::consts::TAU * (edges[i + 1] - edges[i]);
            below[i + 1] = below[i] + size * 0.5 * (densities[i] + densities[i + 1]);
        }
        let whole = below[BINS[0]];
        Self {
            edges: edges.map(|edge| edge as f32),
            densities: densities.map(|density| (density / whole) as f32),
            below: below.map(|below| (below / whole) as f32),
        }
    }

    /// The density [1/sr].
    #[inline]
    pub(super) fn pdf(&self, angles: &HalfAngles) -> f32 {
        let bin = ((angles.root_h * BINS[0] as f32) as i32 as usize).min(BINS[0] - 1);
        let (low, high) = (self.edges[bin], self.edges[bin + 1]);
        let x = ((angles.one_minus_cos_h - low) / (high - low)).clamp(0.0, 1.0);
        self.densities[bin] + x * (self.densities[bin + 1] - self.densities[bin])
    }

    /// A half vector.
    #[inline]
    pub(super) fn sample(&self, u: Vec2) -> Vec3 {
        let bin = (self.below.partition_point(|below| *below <= u.y) - 1).min(BINS[0] - 1);
        let share = (u.y - self.below[bin]) / (self.below[bin + 1] - self.below[bin]);
        let x = linear(share, self.densities[bin], self.densities[bin + 1]);
        let one_minus_cos = self.edges[bin] + x * (self.edges[bin + 1] - self.edges[bin]);
        let sin = (one_minus_cos * (2.0 - one_minus_cos)).sqrt();
        let (sin_phi, cos_phi) = sin_cos_turns(u.x);
        vec3(sin * cos_phi, sin * sin_phi, 1.0 - one_minus_cos)
    }
}

/// The mean of f cos θ_i cos θ_d over the differences at a half angle.
fn mean_over_differences(values: &[Spectrum], half: usize) -> f64 {
    let cos_h = (FRAC_PI_2 * ((half as f32 + 0.5) / BINS[0] as f32).powi(2)).cos();
    let mut sum = 0.0;
    for difference in 0..BINS[1] {
        let (sin_d, cos_d) = (FRAC_PI_2 * (difference as f32 + 0.5) / BINS[1] as f32).sin_cos();
        let start = (half * BINS[1] + difference) * BINS[2];
        let row = &values[start..start + BINS[2]];
        let luminance: f64 = row.iter().map(|value| f64::from(value.luminance())).sum();
        // The two directions, of which either may be wi, have the mean cosine cos θ_h cos θ_d.
        sum += luminance * f64::from(cos_h * cos_d * cos_d * sin_d);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::{Bsdf, Lambert, Lobes, RoughConductor, TransportMode};
    use crate::warp::cosine_hemisphere;
    use glam::vec2;

    #[test]
    fn files_that_are_none_are_refused_with_the_reason() {
        let refused = |bytes: &[u8]| MerlTable::read(bytes).map(|_| ()).expect_err("refused");
        assert_eq!(refused(b"BRDF"), "4 bytes are too few for a header: a table of 90 × 90 × 180 has 34992012 bytes");
        let mut bytes = vec![0; 100];
        for (bytes, bins) in bytes.chunks_mut(4).zip([90_i32, 90, 360]) {
            bytes.copy_from_slice(&bins.to_le_bytes());
        }
        assert!(refused(&bytes).contains("[90, 90, 360]"));
        bytes[8..12].copy_from_slice(&180_i32.to_le_bytes());
        assert_eq!(refused(&bytes), "100 bytes are too few: a table of 90 × 90 × 180 has 34992012 bytes");
        let empty = refused(&MerlTable::write(|_, _| Spectrum::splat(-1.0)));
        assert!(empty.contains("nothing was measured"), "{empty}");
        let glaring = refused(&MerlTable::write(|_, _| Spectrum::ONE));
        assert!(glaring.contains("reflects 3.1"), "{glaring}");
    }

    /// Bins are known at their centres; on a line what lies beyond the last ones is as they are, on a circle the last is next to the first.
    #[test]
    fn places_lie_between_the_centres_of_bins() {
        const BINS: usize = 8;
        let centre = |i: usize, part: f32| (i as f32 + 0.5 + part) / BINS as f32;
        for part in [0.0, 0.25, 0.5, 0.75] {
            for i in 0..BINS - 1 {
                assert_eq!(between(centre(i, part), BINS), ([i, i + 1], part));
                assert_eq!(between_around(centre(i, part), BINS), ([i, i + 1], part));
            }
        }
        for (place, share) in [(centre(7, 0.0), 0.0), (centre(7, 0.25), 0.25), (0.0, 0.5), (centre(0, -0.25), 0.75)] {
            assert_eq!(between_around(place, BINS), ([7, 0], share), "{place}");
        }
        for place in [centre(7, 0.0), centre(7, 0.25), 1.0] {
            assert_eq!(between(place, BINS), ([6, 7], 1.0), "{place}");
        }
        assert_eq!(between(0.0, BINS), ([0, 1], 0.0));
    }

    #[test]
    fn a_table_is_what_it_was_made_from() {
        let metal = RoughConductor::from_reflectance(Spectrum::new(0.9, 0.6, 0.3), 0.4, 0.4);
        let bytes = MerlTable::write(|wo, wi| metal.eval(wo, wi, Lobes::ALL, TransportMode::Radiance));
        let table = MerlTable::read(&bytes).expect("a table");
        for i in 0..4096 {
            let [wo, wi] = [(0.754_877, 0.569_84), (0.438_579, 0.322_18)]
                .map(|(a, b)| cosine_hemisphere(vec2((a * i as f32).fract(), (b * i as f32).fract())));
            if wo.z.min(wi.z) < 0.2 {
                continue;
            }
            let angles = HalfAngles::of(wo, wi).expect("directions that are not opposite");
            let exact = metal.eval(wo, wi, Lobes::ALL, TransportMode::Radiance);
            let error = (table.value(&angles) - exact).abs().max_component();
            assert!(error < 0.01 * exact.max_component(), "{wo} {wi}: {exact:?} and {:?}", table.value(&angles));
            assert_eq!(HalfAngles::of(wi, wo).map(|back| table.value(&back)), Some(table.value(&angles)));
        }
    }

    #[test]
    fn bins_are_where_the_files_have_them() {
        // Mirror configuration at 45°: half angle 0 and difference angle 45°; retro-reflection at 45° the other way round.
        let at = |w: Vec3, v: Vec3| HalfAngles::of(w, v).expect("not opposite");
        let (w, mirrored) = (vec3(0.6, 0.0, 0.8), vec3(-0.6, 0.0, 0.8));
        let angle = 0.6_f32.asin();
        let (mirror, retro) = (at(w, mirrored), at(w, w));
        assert!(mirror.root_h == 0.0 && (mirror.theta_d - angle).abs() < 1e-6);
        assert!((retro.root_h.powi(2) * FRAC_PI_2 - angle).abs() < 1e-6 && retro.theta_d == 0.0);
        for (half, difference) in [(0, 3), (1, 80), (17, 44), (60, 5), (89, 0)] {
            for (azimuth, [wo, wi]) in MerlTable::centres(half, difference).enumerate() {
                let angles = at(wo, wi);
                let places = [angles.root_h * 90.0, angles.theta_d / FRAC_PI_2 * 90.0, angles.phi_d / PI * 180.0];
                assert_eq!(places.map(|place| place as usize), [half, difference, azimuth], "{places:?}");
            }
        }
    }

    #[test]
    fn black_tables_are_sampled_and_white_ones_are_white() {
        let black = Merl::new(MerlTable::read(&MerlTable::write(|_, _| Spectrum::ZERO)).expect("a table"));
        let wo = vec3(0.6, 0.0, 0.8);
        let sample = black.sample(wo, 0.9, vec2(0.3, 0.1), TransportMode::Radiance).expect("a sample");
        assert!(sample.weight.is_zero() && sample.pdf > 0.0);
        let white = Bsdf::from(Lambert { albedo: Spectrum::ONE });
        let bytes = MerlTable::write(|wo, wi| white.eval(wo, wi, Lobes::ALL, TransportMode::Radiance));
        let table = MerlTable::read(&bytes).expect("a table");
        for cos in [1.0, 0.7, 0.4] {
            let albedo = table.albedo(cos).mean();
            assert!((albedo - 1.0).abs() < 0.02, "{cos}: {albedo}");
        }
    }

    #[test]
    fn albedos_are_those_of_what_it_was_made_from() {
        let rho = Spectrum::new(0.2, 0.8, 0.5);
        let matt = Bsdf::from(Lambert { albedo: rho });
        let bytes = MerlTable::write(|wo, wi| matt.eval(wo, wi, Lobes::ALL, TransportMode::Radiance));
        let table = MerlTable::read(&bytes).expect("a table");
        for cos in [1.0, 0.9, 0.7, 0.5] {
            let error = (table.albedo(cos) - rho).abs().max_component();
            assert!(error < 0.01, "{cos}: {error}");
        }
        assert!((table.survival - 0.8).abs() < 0.005, "{}", table.survival);
    }

    /// Of D cos θ_h of a rough metal half is within tan θ_h = α; of what is sampled, too, but for the steps of the table and for shadows.
    #[test]
    fn half_vectors_gather_where_the_lobe_is() {
        for alpha in [0.1, 0.25, 0.6] {
            let metal = RoughConductor::from_reflectance(Spectrum::splat(0.9), alpha, alpha);
            let bytes = MerlTable::write(|wo, wi| metal.eval(wo, wi, Lobes::ALL, TransportMode::Radiance));
            let table = MerlTable::read(&bytes).expect("a table");
            let median = table.half_vectors.sample(vec2(0.3, 0.5));
            let tan = median.truncate().length() / median.z;
            assert!((tan / alpha - 1.06).abs() < 0.05, "{alpha}: {tan}");
        }
    }
}
