//! Every order of the light of a scene, on its elements.

use super::basis::{Basis, projected, restricted, value};
use super::mesh::{Coefficients, Mesh};
use super::operator::Operator;
use super::{Radiosity, Refinement};
use crate::request::Request;
use glam::DVec2;
use scenes::{Facet, Scene};

/// The part of the tail's flux that may be left out.
const TAIL_ERROR: f64 = 1e-6;
/// So many orders of the tail at the most, for scenes whose largest albedo is 1 or nearly.
const TAIL_ORDERS: usize = 1000;
/// By how much a mesh grows into the next at the most.
const GROWTH: f64 = 2.5;
/// The first mesh has this part of the elements, if error estimates are to choose among them.
const FIRST: usize = 16;

/// The irradiance of every order.
#[derive(Clone, Debug)]
pub struct Solution {
    mesh: Mesh,
    /// Of the orders from 1 on \[W/m²\].
    orders: Vec<Vec<Coefficients>>,
    /// Of all orders beyond the last, if asked for.
    tail: Option<Vec<Coefficients>>,
    /// What it took, and what it has kept of the light.
    pub report: Report,
}

/// What a solution took, and where the light went.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Elements of each mesh that was solved on, the last one included.
    pub meshes: Vec<usize>,
    /// Shadow rays, on all meshes.
    pub rays: u64,
    /// Bytes of the last mesh's matrix.
    pub bytes: u64,
    /// The least and the greatest sum of an element's form factors: 1 in a closed scene.
    pub closure: [f64; 2],
    /// The least and the greatest sum of an element's form factors and what escapes, before they were balanced.
    pub unbalanced: [f64; 2],
    /// By which part of its light an element's balance is still off at the most.
    pub imbalance: f64,
    /// By order from 0 on.
    pub flux: Vec<Flux>,
}

/// The flux of an order \[W\], the mean of the channels: what leaves the surfaces arrives or escapes, and what arrives is absorbed or leaves
/// as the next order.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flux {
    /// What leaves.
    pub leaving: f64,
    /// What of it meets no surface.
    pub escaped: f64,
    /// What of it is absorbed where it arrives.
    pub absorbed: f64,
}

impl Solution {
    /// Solves for the orders that are asked for.
    pub fn new(scene: &Scene, facets: Vec<Facet>, request: &Request, settings: &Radiosity) -> Self {
        let (mut mesh, mut report) = (Mesh::new(scene, facets), Report::default());
        let last = request.orders().max_order();
        let target = settings.elements.number();
        if settings.refinement == Refinement::Error {
            // Whole triangles say little of the error on them.
            let first = (target / FIRST).max(4 * mesh.elements().len()).min(target);
            grow_evenly(scene, &mut mesh, first);
            while mesh.elements().len() + 3 <= target && !mesh.elements().is_empty() {
                let operator = couple(scene, &mesh, settings, &mut report);
                // What is beyond order 0 may be all that is asked for.
                let orders = orders(&operator, &mesh, last.max(1));
                let count = divisions(mesh.elements().len(), target);
                let chosen = worst(&errors(&mesh, &orders, settings.basis), count);
                if chosen.is_empty() {
                    break;
                }
                mesh.divide(scene, &chosen);
            }
        }
        if settings.refinement == Refinement::Even {
            grow_evenly(scene, &mut mesh, target);
        }
        let mut operator = couple(scene, &mesh, settings, &mut report);
        let balance = operator.balance(scene, &mesh, settings.rays.number());
        (report.unbalanced, report.imbalance) = (balance.sums, balance.imbalance);
        report.rays += balance.rays;
        let orders = orders(&operator, &mesh, last);
        let tail = request.tail().then(|| tail(scene, &operator, &mesh, &orders));
        report.bytes = operator.bytes();
        let closure = operator.closure();
        report.closure = closure.iter().fold([f64::INFINITY, 0.0], |[l, h], c| [c.min(l), c.max(h)]);
        let flux = |order: usize| flux(&operator, &mesh, &radiosity(&mesh, &orders, order), &orders[order]);
        report.flux = (0..last).map(flux).collect();
        Self { mesh, orders, tail, report }
    }

    /// The elements.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// The irradiance of an order from 1 on, of every element; of the tail for orders beyond the last.
    pub fn irradiance(&self, order: usize) -> Option<&[Coefficients]> {
        self.orders.get(order.checked_sub(1)?).or(self.tail.as_ref()).map(Vec::as_slice)
    }

    /// The irradiance \[W/m²\] of an order from 1 on, or of the tail, at a point of an element.
    pub fn at(&self, order: usize, (element, at): (usize, DVec2)) -> [f64; 3] {
        self.irradiance(order).map_or([0.0; 3], |irradiance| value(&irradiance[element], at))
    }
}

/// How many elements are to be divided of so many: meshes grow by the same factor each, at most [`GROWTH`], and the last has what is wanted,
/// for each costs a matrix.
fn divisions(elements: usize, target: usize) -> usize {
    let factor = target as f64 / elements as f64;
    let meshes = (factor.ln() / GROWTH.ln()).ceil().max(1.0);
    let next = elements as f64 * factor.powf(meshes.recip());
    (((next - elements as f64) / 3.0).round() as usize).clamp(1, (target - elements) / 3)
}

fn couple(scene: &Scene, mesh: &Mesh, settings: &Radiosity, report: &mut Report) -> Operator {
    let operator = Operator::new(scene, mesh, settings.basis, settings.rays.number());
    report.meshes.push(mesh.elements().len());
    report.rays += operator.rays();
    operator
}

/// The irradiance of orders 1 to `last`.
fn orders(operator: &Operator, mesh: &Mesh, last: usize) -> Vec<Vec<Coefficients>> {
    let mut orders = Vec::with_capacity(last);
    for order in 0..last {
        orders.push(operator.apply(&radiosity(mesh, &orders, order)));
    }
    orders
}

/// What leaves the elements in an order: what they emit, or what they reflect of that order's irradiance.
fn radiosity(mesh: &Mesh, irradiance: &[Vec<Coefficients>], order: usize) -> Vec<Coefficients> {
    match order.checked_sub(1) {
        None => mesh.elements().iter().map(|element| element.emitted).collect(),
        Some(before) => reflected(mesh, &irradiance[before]),
    }
}

fn reflected(mesh: &Mesh, irradiance: &[Coefficients]) -> Vec<Coefficients> {
    let both = mesh.elements().iter().zip(irradiance);
    both.map(|(element, irradiance)| {
        irradiance.map(|of_function| std::array::from_fn(|channel| element.albedo[channel] * of_function[channel]))
    })
    .collect()
}

/// Adds orders until what is left, at most `Φ ρ / (1 − ρ)` with ρ the largest albedo, is a small part of the sum.
fn tail(scene: &Scene, operator: &Operator, mesh: &Mesh, orders: &[Vec<Coefficients>]) -> Vec<Coefficients> {
    let largest = mesh.elements().iter().flat_map(|element| element.albedo).fold(0.0, f64::max);
    let largest = scene.largest_albedo().map_or(largest, |albedo| f64::from(albedo.max_component()));
    let mut sum = vec![[[0.0; 3]; 3]; mesh.elements().len()];
    let mut leaving = radiosity(mesh, orders, orders.len());
    for _ in 0..TAIL_ORDERS {
        let arriving = operator.apply(&leaving);
        sum.iter_mut().flatten().flatten().zip(arriving.iter().flatten().flatten()).for_each(|(sum, own)| *sum += own);
        let arrived = power(mesh, &sum);
        leaving = reflected(mesh, &arriving);
        if power(mesh, &leaving) <= TAIL_ERROR * arrived * (1.0 - largest) {
            break;
        }
    }
    sum
}

/// The integral of a function over all elements, the mean of the channels.
fn power(mesh: &Mesh, values: &[Coefficients]) -> f64 {
    let of = |(element, values): (&super::mesh::Element, &Coefficients)| {
        element.panel.area * values[0].iter().sum::<f64>() / 3.0
    };
    mesh.elements().iter().zip(values).map(of).sum()
}

/// Where what leaves goes, if this is what arrives.
fn flux(operator: &Operator, mesh: &Mesh, leaving: &[Coefficients], arriving: &[Coefficients]) -> Flux {
    let [left, arrived, goes_on] = [leaving, arriving, &reflected(mesh, arriving)].map(|values| power(mesh, values));
    let escaped = operator.escaped(leaving).iter().sum::<f64>() / 3.0;
    Flux { leaving: left, escaped, absorbed: arrived - goes_on }
}

/// Divides the largest elements until there are so many.
fn grow_evenly(scene: &Scene, mesh: &mut Mesh, target: usize) {
    while mesh.elements().len() + 3 <= target {
        let count = (target - mesh.elements().len()) / 3;
        let areas: Vec<f64> = mesh.elements().iter().map(|element| element.panel.area).collect();
        let largest = areas.iter().copied().fold(0.0, f64::max);
        // What is a good deal smaller than the largest has time until those are as small.
        let size = |area: f64| if area > 0.3 * largest { area } else { 0.0 };
        let chosen = worst(&areas.into_iter().map(size).collect::<Vec<_>>(), count);
        if chosen.is_empty() {
            break;
        }
        mesh.divide(scene, &chosen);
    }
}

/// The numbers of the elements with the largest values, but none of value zero.
fn worst(values: &[f64], count: usize) -> Vec<u32> {
    let mut order: Vec<u32> = (0..values.len() as u32).filter(|&i| values[i as usize] > 0.0).collect();
    order.sort_by(|&a, &b| values[b as usize].total_cmp(&values[a as usize]).then(a.cmp(&b)));
    order.truncate(count);
    order
}

/// An estimate of the error on each element \[W²/m²\]: the square, over its area, of what the sum of all orders' radiosity there has beyond the
/// nearest function of the basis on the triangle that the element is a quarter of.
fn errors(mesh: &Mesh, orders: &[Vec<Coefficients>], basis: Basis) -> Vec<f64> {
    let seen: Vec<[f64; 3]> = (0..mesh.elements().len())
        .map(|element| {
            let albedo = mesh.elements()[element].albedo;
            let grey = |channels: [f64; 3]| (0..3).map(|c| albedo[c] * channels[c]).sum::<f64>() / 3.0;
            let of_function = |a: usize| orders.iter().map(|order| grey(order[element][a])).sum();
            [of_function(0), of_function(1), of_function(2)]
        })
        .collect();
    let gathered = mesh.gathered(|element| seen[element], |quarters| basis.nearest(projected(quarters)));
    let error = |element: usize| {
        let around = match gathered.around(element) {
            Some((whole, quarter)) => restricted(whole, quarter),
            None => [seen[element][0] * f64::from(u8::from(basis == Basis::Linear)), 0.0, 0.0],
        };
        let squares = seen[element].iter().zip(around).map(|(own, around)| (own - around).powi(2));
        mesh.elements()[element].panel.area * squares.sum::<f64>()
    };
    (0..mesh.elements().len()).map(error).collect()
}
