//! Integrals over the sphere of directions by a grid that is fine where samples are.

use crate::bsdf::quadrature::GAUSS;
use glam::{DVec3, Vec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Two integrands at once: a density, and a value times the cosine.
pub type Two = [f64; 2];

/// Directions between two polar angles and two azimuths.
#[derive(Clone, Copy, Debug)]
struct Cell {
    polar: [f64; 2],
    azimuth: [f64; 2],
}

/// Cells that cover the sphere, those of a bin in a row.
#[derive(Debug)]
pub struct Cells {
    cells: Vec<(Cell, usize)>,
    bins: Vec<Cell>,
}

/// The polar angle and the azimuth of a direction.
fn angles(w: Vec3) -> [f64; 2] {
    let w: DVec3 = w.as_dvec3();
    [w.x.hypot(w.y).atan2(w.z), w.y.atan2(w.x)]
}

impl Cell {
    fn holds(&self, [polar, azimuth]: [f64; 2]) -> bool {
        let within = |x: f64, [from, to]: [f64; 2]| from <= x && x < to;
        within(polar, self.polar) && within(azimuth, self.azimuth)
    }

    /// The two halves, cut across the longer side.
    fn halves(&self) -> [Self; 2] {
        let middle = |[from, to]: [f64; 2]| 0.5 * (from + to);
        let (polar, azimuth) = (middle(self.polar), middle(self.azimuth));
        if self.polar[1] - self.polar[0] > (self.azimuth[1] - self.azimuth[0]) * polar.sin() {
            let part = |polar| Self { polar, ..*self };
            return [part([self.polar[0], polar]), part([polar, self.polar[1]])];
        }
        let part = |azimuth| Self { azimuth, ..*self };
        [part([self.azimuth[0], azimuth]), part([azimuth, self.azimuth[1]])]
    }

    /// The integral by Gauss's rule.
    fn rule(&self, f: &impl Fn(Vec3) -> Two) -> Two {
        let (width, height) = (self.azimuth[1] - self.azimuth[0], self.polar[1] - self.polar[0]);
        let mut sum = [0.0; 2];
        for (x, by_polar) in GAUSS {
            let (sin, cos) = (self.polar[0] + height * x).sin_cos();
            for (y, by_azimuth) in GAUSS {
                let (sin_phi, cos_phi) = (self.azimuth[0] + width * y).sin_cos();
                let values = f(DVec3::new(sin * cos_phi, sin * sin_phi, cos).as_vec3());
                for (sum, value) in sum.iter_mut().zip(values) {
                    *sum += by_polar * by_azimuth * sin * value * width * height;
                }
            }
        }
        sum
    }

    /// The integral, cut until halves add up to the whole.
    fn integral(&self, f: &impl Fn(Vec3) -> Two, whole: Two, depth: u32) -> Two {
        let halves = self.halves();
        let parts = halves.map(|half| half.rule(f));
        let sum: Two = std::array::from_fn(|k| parts[0][k] + parts[1][k]);
        if depth == 0 || (0..2).all(|k| (sum[k] - whole[k]).abs() < 1e-5) {
            return sum;
        }
        let parts: [Two; 2] = std::array::from_fn(|i| halves[i].integral(f, parts[i], depth - 1));
        std::array::from_fn(|k| parts[0][k] + parts[1][k])
    }
}

impl Cells {
    /// Cells that hold one of these directions each, or none, and bins of a share of them.
    pub fn by(directions: &[Vec3]) -> Self {
        let mut cells = Self { cells: Vec::new(), bins: Vec::new() };
        for polar in [[0.0, FRAC_PI_2], [FRAC_PI_2, PI]] {
            // The last azimuth is that of a half turn, too.
            let all = Cell { polar, azimuth: [-PI, PI.next_up()] };
            let within = directions.iter().map(|w| angles(*w)).filter(|a| all.holds(*a)).collect();
            cells.cut(all, within, directions.len() / 16, None, 24);
        }
        cells
    }

    fn cut(&mut self, cell: Cell, within: Vec<[f64; 2]>, most: usize, bin: Option<usize>, depth: u32) {
        let bin = bin.or_else(|| {
            (within.len() <= most || depth == 0).then(|| {
                self.bins.push(cell);
                self.bins.len() - 1
            })
        });
        let is_small = cell.polar[1] - cell.polar[0] < 0.8;
        if let Some(bin) = bin.filter(|_| depth == 0 || (within.len() <= 1 && is_small)) {
            self.cells.push((cell, bin));
            return;
        }
        for half in cell.halves() {
            self.cut(half, within.iter().copied().filter(|a| half.holds(*a)).collect(), most, bin, depth - 1);
        }
    }

    /// How many bins there are.
    pub fn bins(&self) -> usize {
        self.bins.len()
    }

    /// The bin of a direction.
    pub fn bin(&self, w: Vec3) -> usize {
        let angles = angles(w);
        self.bins.iter().position(|bin| bin.holds(angles)).unwrap_or(0)
    }

    /// The integrals over each bin, to some 10⁻⁴ of 1.
    pub fn integrals(&self, f: impl Fn(Vec3) -> Two) -> Vec<Two> {
        let mut sums = vec![[0.0; 2]; self.bins.len()];
        for (cell, bin) in &self.cells {
            let integral = cell.integral(&f, cell.rule(&f), 10);
            (0..2).for_each(|k| sums[*bin][k] += integral[k]);
        }
        sums
    }
}

#[test]
fn a_lobe_is_integrated_in_whole_and_by_bins() {
    // ∫ cosⁿ over a hemisphere about any axis is 2π / (n + 1).
    let (axis, n) = (DVec3::new(0.48, -0.6, 0.64).as_vec3(), 200);
    let around = |i: u32| {
        let (sin, cos) = (f64::from(i) * 2.4).sin_cos();
        let radius = 0.15 * (f64::from(i) / 64.0).sqrt();
        (axis.as_dvec3() + radius * DVec3::new(cos, sin, 0.3 * sin)).normalize().as_vec3()
    };
    let cells = Cells::by(&(0..64).map(around).collect::<Vec<_>>());
    let lobe = |w: Vec3| f64::from(axis.dot(w).max(0.0)).powi(n);
    let sums = cells.integrals(|w| [lobe(w), 1.0]);
    let [of_lobe, of_one] = [0, 1].map(|k| sums.iter().map(|sum| sum[k]).sum::<f64>());
    assert!((of_lobe / (2.0 * PI / f64::from(n + 1)) - 1.0).abs() < 1e-3, "{of_lobe}");
    assert!((of_one - 4.0 * PI).abs() < 1e-4, "{of_one}");
    let bin = cells.bin(axis);
    assert!(sums[bin][0] > 0.0 && sums[bin][0] < 0.6 * of_lobe && cells.bins() > 8, "{:?}", sums[bin]);
}
