//! The ledger of light: weights for which nothing is made or lost between elements.
//!
//! What leaves a point arrives somewhere or escapes, `∫ k(x, y) V(x, y) dy + e(x) = 1`. Cubature keeps that up to 10⁻⁵ and the rays that
//! find what is hidden up to a hundredth, whichever way. A function w on the surfaces, near 1 and of the elements' basis, makes up for it:
//! `w(x) (∫ k V w dy + e(x)) = 1`, tested with every function of the basis, and couplings are those of `w(x) k(x, y) V(x, y) w(y)`.
//! So all that leaves in an order is told to arrive or to escape, to rounding, and the swapped coupling is still the transpose. That is
//! symmetric scaling of a matrix to given sums \[Sinkhorn64\], which changes couplings in proportion, as little as can be in the sense
//! of relative entropy; thermal engineers smooth exchange areas to the same end \[Larsen86\]. It is found by Newton's method, the equations
//! of whose steps are symmetric and solved by conjugate gradients \[Knight13\].
//!
//! e is what [rays](super::visibility::escape) from all over an element find; the larger it is the more there are, so that all flux is known
//! equally well. Where no surface can hide another, couplings are better than rays, so that these only say whether there is an opening at
//! all; what it lets through is what couplings leave over.

use super::basis::{Basis, Function, corners, product};
use super::mesh::Mesh;
use super::visibility::escape;
use rayon::prelude::*;
use scenes::Scene;

/// Rows may be off by this part of what leaves.
const ERROR: f64 = 1e-9;
/// Newton's steps at the most: couplings that no weights can mend are left as they are then, and the imbalance is told.
const STEPS: usize = 20;
/// Each makes this part of what is off; so many gradients at the most.
const PART_OF_STEP: f64 = 1e-3;
const GRADIENTS: usize = 40;
/// By this part a weight changes in a step at the most.
const CHANGE: f64 = 0.5;
/// No element has less than this part of the rays that it has in the mean.
const LEAST: f64 = 0.125;
/// Where rays only tell whether there is an opening, this part of them does.
const PART_IF_CONVEX: f64 = 1.0 / 32.0;

/// What makes couplings add up.
#[derive(Clone, Debug, Default)]
pub struct Balance {
    /// w, on every element.
    pub weights: Vec<Function>,
    /// What escapes of the light that leaves by each function of an element, in units of it \[m²\]; of `w e`.
    pub escaped: Vec<Function>,
    /// Rays that it took.
    pub rays: u64,
    /// The least and the greatest sum of an element's form factors and what escapes, before there were weights.
    pub sums: [f64; 2],
    /// By how much a row is still off at the most.
    pub imbalance: f64,
}

impl Balance {
    /// Leaves couplings as they are.
    pub fn none(elements: usize) -> Self {
        let (weights, escaped) = (vec![[1.0, 0.0, 0.0]; elements], vec![[0.0; 3]; elements]);
        Self { weights, escaped, ..Self::default() }
    }

    /// Balances couplings by so many rays from the mean element: `multiply` gives what a function brings to every element \[m²\].
    pub fn new(
        scene: &Scene,
        mesh: &Mesh,
        rays: u32,
        basis: Basis,
        multiply: impl Fn(&[Function]) -> Vec<Function>,
    ) -> Self {
        let areas: Vec<f64> = mesh.elements().iter().map(|element| element.panel.area).collect();
        let mut weights = vec![[1.0, 0.0, 0.0]; areas.len()];
        let mean = areas.iter().sum::<f64>() / areas.len() as f64;
        let rays = f64::from(rays) * if mesh.is_convex() { PART_IF_CONVEX } else { 1.0 };
        let counts: Vec<u32> = areas.iter().map(|area| (rays * (area / mean).max(LEAST)).ceil() as u32).collect();
        let of_element = |element: usize| basis.nearest(escape(scene, mesh, element, counts[element]));
        let mut escaped: Vec<Function> = (0..areas.len()).into_par_iter().map(of_element).collect();
        let arriving = multiply(&weights);
        if mesh.is_convex() && escaped.iter().any(|escaped| escaped[0] > 0.0) {
            escaped = arriving.iter().zip(&areas).map(|(arriving, area)| left_over(arriving, *area)).collect();
        }
        let row = |(arriving, escaped): (&Function, &Function)| std::array::from_fn(|a| arriving[a] + escaped[a]);
        let mut rows: Vec<Function> = arriving.iter().zip(&escaped).map(row).collect();
        let shares = rows.iter().zip(&areas).map(|(row, area)| row[0] / area);
        let sums = shares.fold([f64::INFINITY, 0.0], |[low, high], share| [share.min(low), share.max(high)]);
        let off = |weights: &[Function], rows: &[Function]| -> Vec<Function> {
            (0..areas.len()).map(|i| off(&weights[i], &rows[i], areas[i])).collect()
        };
        let mut left = off(&weights, &rows);
        let before = largest_part(&left, &areas);
        let mut imbalance = before;
        for _ in 0..STEPS {
            if imbalance <= ERROR {
                break;
            }
            let changes = solved(&left, &areas, |of| products(&weights, &multiply(&products(&weights, of))));
            weights = weights.iter().zip(&changes).map(|(weight, change)| changed(weight, change)).collect();
            rows = multiply(&weights).iter().zip(&escaped).map(row).collect();
            left = off(&weights, &rows);
            imbalance = largest_part(&left, &areas);
        }
        if imbalance > before || !weights.iter().flatten().all(|weight| weight.is_finite()) {
            (weights, imbalance) = (Self::none(areas.len()).weights, before);
        }
        let escaped = products(&weights, &escaped);
        let rays = counts.iter().copied().map(u64::from).sum();
        Self { weights, escaped, rays, sums, imbalance }
    }
}

/// What arriving light leaves over of an area, if it leaves over any.
fn left_over(arriving: &Function, area: f64) -> Function {
    let [mean, s, t] = *arriving;
    if mean < area { [area - mean, -s, -t] } else { [0.0; 3] }
}

/// How far a weight times a row is from 1 \[m²\]; not at all where the row is nothing, which no weight mends and no light meets.
fn off(weight: &Function, row: &Function, area: f64) -> Function {
    if row[0] <= 0.0 {
        return [0.0; 3];
    }
    let [mean, s, t] = product(weight, row);
    [mean - area, s, t]
}

/// The largest that is off, as a part.
fn largest_part(off: &[Function], areas: &[f64]) -> f64 {
    let of_element = |(off, area): (&Function, &f64)| off.iter().fold(0.0, |most: f64, off| most.max(off.abs() / area));
    off.iter().zip(areas).map(of_element).fold(0.0, f64::max)
}

fn products(a: &[Function], b: &[Function]) -> Vec<Function> {
    a.iter().zip(b).map(|(a, b)| product(a, b)).collect()
}

/// A weight less this part of itself, or as much of that as a step may change.
fn changed(weight: &Function, part: &Function) -> Function {
    let largest = corners(part).into_iter().fold(CHANGE, |most, at| most.max(at.abs()));
    let change = product(weight, part);
    std::array::from_fn(|a| weight[a] - change[a] * CHANGE / largest)
}

/// The parts p of the weights w that are too much: `(A + W K W) p` is what is off, with A the areas. By conjugate gradients, with A to
/// precondition them \[Hestenes52\].
fn solved(off: &[Function], areas: &[f64], exchanged: impl Fn(&[Function]) -> Vec<Function>) -> Vec<Function> {
    let by_area =
        |of: &[Function]| -> Vec<Function> { of.iter().zip(areas).map(|(f, area)| f.map(|f| f / area)).collect() };
    let dot = |a: &[Function], b: &[Function]| -> f64 {
        a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum()
    };
    let add = |to: &mut [Function], by: f64, of: &[Function]| {
        to.iter_mut().flatten().zip(of.iter().flatten()).for_each(|(to, of)| *to += by * of);
    };
    let (mut parts, mut left) = (vec![[0.0; 3]; off.len()], off.to_vec());
    let mut direction = by_area(&left);
    let mut size = dot(&left, &direction);
    let enough = size * PART_OF_STEP * PART_OF_STEP;
    for _ in 0..GRADIENTS {
        let mut made = exchanged(&direction);
        let own: Vec<Function> = direction.iter().zip(areas).map(|(f, area)| f.map(|f| f * area)).collect();
        add(&mut made, 1.0, &own);
        let curvature = dot(&direction, &made);
        if size <= enough || curvature <= 0.0 {
            break;
        }
        add(&mut parts, size / curvature, &direction);
        add(&mut left, -size / curvature, &made);
        let steepest = by_area(&left);
        let next = dot(&left, &steepest);
        let turned = next / size;
        direction =
            direction.iter().zip(&steepest).map(|(d, s)| std::array::from_fn(|a| s[a] + turned * d[a])).collect();
        size = next;
    }
    parts
}
