//! Integrals of densities and values over the sphere, cut into cells where samples of the density fall.

use sampling::{Vec3, vec3};
use std::f64::consts::{PI, TAU};

/// Polar angle θ and azimuth φ.
type Angles = (f64, f64);

/// The angle below which directions in `f32` are not told apart.
const FINEST: f64 = 1e-7;

/// A rectangle of directions.
#[derive(Clone, Copy, Debug)]
struct Cell {
    theta: (f64, f64),
    phi: (f64, f64),
}

/// Polar angle and azimuth of a direction, exact near the poles and near the horizon.
fn angles(w: Vec3) -> Angles {
    let (x, y, z) = (f64::from(w.x), f64::from(w.y), f64::from(w.z));
    (x.hypot(y).atan2(z), y.atan2(x).rem_euclid(TAU))
}

impl Cell {
    /// The quartiles of these directions; `None` of none.
    fn around(samples: &[Angles]) -> Option<Self> {
        let quartiles = |of: fn(&Angles) -> f64| {
            let mut values: Vec<f64> = samples.iter().map(of).collect();
            values.sort_unstable_by(f64::total_cmp);
            (values[values.len() / 4], values[values.len() * 3 / 4])
        };
        (!samples.is_empty()).then(|| Self { theta: quartiles(|s| s.0), phi: quartiles(|s| s.1) })
    }

    fn halves_of_theta(&self, at: f64) -> [Self; 2] {
        [(self.theta.0, at), (at, self.theta.1)].map(|theta| Self { theta, ..*self })
    }

    fn halves_of_phi(&self, at: f64) -> [Self; 2] {
        [(self.phi.0, at), (at, self.phi.1)].map(|phi| Self { phi, ..*self })
    }

    fn quarters(&self) -> [Self; 4] {
        let [low, high] = self.halves_of_theta(0.5 * (self.theta.0 + self.theta.1));
        let at = 0.5 * (self.phi.0 + self.phi.1);
        let ([a, b], [c, d]) = (low.halves_of_phi(at), high.halves_of_phi(at));
        [a, b, c, d]
    }

    /// Gauss's rule of 3 × 3 points.
    fn rule<const N: usize>(&self, g: &impl Fn(Vec3) -> [f64; N]) -> [f64; N] {
        const NODES: [(f64, f64); 3] =
            [(-0.774_596_669_241_483_4, 5.0 / 18.0), (0.0, 8.0 / 18.0), (0.774_596_669_241_483_4, 5.0 / 18.0)];
        self.product(NODES, g)
    }

    /// Simpson's rule of 3 × 3 points, which has some at the border.
    fn rule_to_the_border<const N: usize>(&self, g: &impl Fn(Vec3) -> [f64; N]) -> [f64; N] {
        // The points next to the border, not on it: the horizon is a border too, and belongs to neither side.
        const NODES: [(f64, f64); 3] = [(-0.999_999, 1.0 / 6.0), (0.0, 4.0 / 6.0), (0.999_999, 1.0 / 6.0)];
        self.product(NODES, g)
    }

    /// The rule of these points and weights along both sides.
    fn product<const N: usize>(&self, nodes: [(f64, f64); 3], g: &impl Fn(Vec3) -> [f64; N]) -> [f64; N] {
        let mut sum = [0.0; N];
        let at = |(a, b): (f64, f64), node: f64| 0.5 * (a + b) + 0.5 * (b - a) * node;
        let azimuths = nodes.map(|(node, weight)| (at(self.phi, node).sin_cos(), weight));
        for (node, weight_t) in nodes {
            let (sin, cos) = at(self.theta, node).sin_cos();
            for ((sin_phi, cos_phi), weight_p) in azimuths {
                let w = vec3((sin * cos_phi) as f32, (sin * sin_phi) as f32, cos as f32);
                let weight = weight_t * weight_p * sin * (self.theta.1 - self.theta.0) * (self.phi.1 - self.phi.0);
                for (sum, value) in sum.iter_mut().zip(g(w)) {
                    *sum += weight * value;
                }
            }
        }
        sum
    }

    fn holds(&self, place: &Angles) -> bool {
        let within = |(low, high): (f64, f64), x: f64| low <= x && x < high;
        within(self.theta, place.0) && within(self.phi, place.1)
    }

    /// ∫ g dω, to an absolute error of about `tolerance` in every component, given the value of the rule.
    ///
    /// Two rules agree on nothing where both miss a lobe. So a cell is not believed to be smooth while it holds more than one
    /// of the samples: hidden in a corner, they would count. Quartering down to such a crowd, which may be thousands of times
    /// narrower than a cell that other samples have made wide, takes nothing off the depth.
    fn refine<const N: usize>(
        &self,
        whole: [f64; N],
        samples: &[Angles],
        tolerance: f64,
        depth: u32,
        g: &impl Fn(Vec3) -> [f64; N],
    ) -> [f64; N] {
        let quarters = self.quarters().map(|quarter| (quarter, quarter.rule(g)));
        let sum: [f64; N] = std::array::from_fn(|i| quarters.iter().map(|(_, part)| part[i]).sum());
        let near = |other: [f64; N], error: f64| sum.iter().zip(other).all(|(sum, other)| (sum - other).abs() < error);
        let samples: Vec<Angles> = samples.iter().copied().filter(|sample| self.holds(sample)).collect();
        // Where values jump along an edge all inner points may miss it. The other rule sees it, but is itself coarse.
        let converged = near(whole, tolerance) && near(self.rule_to_the_border(g), 30.0 * tolerance);
        let is_crowded = samples.len() > 1 && self.theta.1 - self.theta.0 > FINEST;
        if !is_crowded && (depth == 0 || converged) {
            return sum;
        }
        let (tolerance, depth) = if is_crowded { (tolerance, depth) } else { (0.5 * tolerance, depth - 1) };
        let parts = quarters.map(|(quarter, part)| quarter.refine(part, &samples, tolerance, depth, g));
        std::array::from_fn(|i| parts.iter().map(|part| part[i]).sum())
    }
}

/// The sphere cut where samples of a density fall: their crowds have small cells.
///
/// A quadrature by cells then misses no lobe that is sampled, and one that is not sampled shows as a disagreement of
/// counts and density.
pub struct Cells {
    root: Node,
    leaves: Vec<Leaf>,
}

enum Node {
    Leaf(usize),
    Split { theta_or_phi: fn(&Angles) -> f64, at: f64, parts: Box<[Node; 2]> },
}

struct Leaf {
    cell: Cell,
    samples: Vec<Angles>,
}

impl Cells {
    /// The hemispheres, each halved `depth` times at medians of the samples.
    pub fn by_samples(samples: impl Iterator<Item = Vec3>, depth: u32) -> Self {
        Self::within((0.0, TAU), samples, depth)
    }

    /// The halves of the hemispheres where y is positive, as are those of the samples, likewise.
    pub fn half_by_samples(samples: impl Iterator<Item = Vec3>, depth: u32) -> Self {
        Self::within((0.0, PI), samples, depth)
    }

    fn within(phi: (f64, f64), samples: impl Iterator<Item = Vec3>, depth: u32) -> Self {
        let mut cells = Self { root: Node::Leaf(0), leaves: Vec::new() };
        let whole = Cell { theta: (0.0, PI), phi };
        let (lower, upper): (Vec<_>, Vec<_>) = samples.map(angles).partition(|s| s.0 >= 0.5 * PI);
        let halves = whole.halves_of_theta(0.5 * PI);
        let parts = Box::new([cells.split(halves[0], upper, depth), cells.split(halves[1], lower, depth)]);
        cells.root = Node::Split { theta_or_phi: |s| s.0, at: 0.5 * PI, parts };
        cells
    }

    fn split(&mut self, cell: Cell, mut samples: Vec<Angles>, depth: u32) -> Node {
        if depth == 0 || samples.len() < 32 {
            self.leaves.push(Leaf { cell, samples });
            return Node::Leaf(self.leaves.len() - 1);
        }
        let theta_or_phi: fn(&Angles) -> f64 = if depth.is_multiple_of(2) { |s| s.0 } else { |s| s.1 };
        samples.sort_unstable_by(|a, b| theta_or_phi(a).total_cmp(&theta_or_phi(b)));
        let at = theta_or_phi(&samples[samples.len() / 2]);
        let above = samples.split_off(samples.partition_point(|s| theta_or_phi(s) < at));
        let halves = if depth.is_multiple_of(2) { cell.halves_of_theta(at) } else { cell.halves_of_phi(at) };
        let parts = Box::new([self.split(halves[0], samples, depth - 1), self.split(halves[1], above, depth - 1)]);
        Node::Split { theta_or_phi, at, parts }
    }

    pub fn len(&self) -> usize {
        self.leaves.len()
    }

    /// The cell that a direction is in.
    pub fn find(&self, w: Vec3) -> usize {
        let place = angles(w);
        let mut node = &self.root;
        loop {
            match node {
                Node::Leaf(index) => return *index,
                Node::Split { theta_or_phi, at, parts } => node = &parts[usize::from(theta_or_phi(&place) >= *at)],
            }
        }
    }

    /// ∫ g dω over a cell, to an absolute error of about `tolerance` in every component.
    pub fn integrate<const N: usize>(&self, index: usize, tolerance: f64, g: impl Fn(Vec3) -> [f64; N]) -> [f64; N] {
        let Leaf { cell, samples } = &self.leaves[index];
        let core = Cell::around(samples).unwrap_or(*cell);
        let (mut thetas, phis) = (cuts(cell.theta, core.theta), cuts(cell.phi, core.phi));
        // Towards the horizon values change on the scale of the cosines.
        let horizon = (0..5).flat_map(|i| [-0.1, 0.1].map(|step| 0.5 * PI + step * 0.25_f64.powi(i)));
        thetas.extend(horizon.filter(|theta| *theta > cell.theta.0 && *theta < cell.theta.1));
        thetas.sort_unstable_by(f64::total_cmp);
        let mut sum = [0.0; N];
        for theta in thetas.windows(2) {
            for phi in phis.windows(2) {
                let part = Cell { theta: (theta[0], theta[1]), phi: (phi[0], phi[1]) };
                // Quarters from the first: a thin ridge that runs across both angles, and has no tails, may pass between the nodes
                // of a whole part and of its quarters alike.
                for quarter in part.quarters() {
                    let refined = quarter.refine(quarter.rule(&g), samples, 0.125 * tolerance, 9, &g);
                    sum.iter_mut().zip(refined).for_each(|(sum, value)| *sum += value);
                }
            }
        }
        sum
    }
}

/// Cuts of a range at the ends of its core and from there outwards in steps that double.
fn cuts((low, high): (f64, f64), core: (f64, f64)) -> Vec<f64> {
    let width = (core.1 - core.0).max(1e-9);
    let steps = || (0..).map(|i| width * (2.0_f64.powi(i) - 1.0));
    let mut cuts: Vec<f64> = steps().map(|step| core.0 - step).take_while(|x| *x > low).collect();
    cuts.push(low);
    cuts.reverse();
    cuts.extend(steps().map(|step| core.1 + step).take_while(|x| *x < high));
    cuts.push(high);
    cuts
}
