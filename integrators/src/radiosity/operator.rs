//! The transport operator as a matrix: the couplings of all pairs of elements.
//!
//! Only the pairs (x, y) with y < x are kept, as `f32`, and only those that see one another: the others are their transposes, so that
//! reciprocity holds to the bit. Light is multiplied in `f64`. Rows are dealt to a fixed number of parties in turn, each of which sums
//! for itself, and the parties' sums are added in order: bits do not depend on threads. What light is multiplied by before and after makes
//! the sums of rows [right](super::balance).

use super::balance::Balance;
use super::basis::{Basis, Function, product};
use super::mesh::{Coefficients, Mesh};
use super::visibility::visible_coupling;
use rayon::prelude::*;
use scenes::Scene;
use scenes::progress::{self, Activity};

/// Rays from the mean element that tell what escapes, for every one between two that little couples.
const RAYS_OUT: u32 = 512;
/// So many rows are coupled on average before those who wait are told.
const ROWS_AT_ONCE: usize = 64;
/// Parties that sum for themselves.
const PARTIES: usize = 16;

/// The couplings of an element to those before it.
struct Row {
    /// Which.
    others: Vec<u32>,
    /// Of each, by this element's function and the other's.
    couplings: Vec<f32>,
    /// Shadow rays that it took.
    rays: u64,
}

/// What light a function on each element has, by function and channel.
type Light<const C: usize> = [[f64; C]; 3];

/// The operator on a mesh.
pub struct Operator {
    rows: Vec<Row>,
    areas: Vec<f64>,
    basis: Basis,
    balance: Balance,
}

impl Operator {
    /// Couples all elements.
    pub fn new(scene: &Scene, mesh: &Mesh, basis: Basis, rays: u32) -> Self {
        let count = mesh.elements().len();
        let row = |x: usize| match basis {
            Basis::Constant => couple_row::<1>(scene, mesh, x, rays),
            Basis::Linear => couple_row::<3>(scene, mesh, x, rays),
        };
        // The last rows are the longest: shares of as many pairs each.
        let mut rows = Vec::with_capacity(count);
        let shares = (count / ROWS_AT_ONCE).max(1);
        for share in 1..=shares {
            let end = (count as f64 * (share as f64 / shares as f64).sqrt()).round() as usize;
            rows.par_extend((rows.len()..end).into_par_iter().map(row));
            progress::report(Activity::Coupling, share as f64 / shares as f64);
        }
        let areas = mesh.elements().iter().map(|element| element.panel.area).collect();
        Self { rows, areas, basis, balance: Balance::none(count) }
    }

    /// Makes its rows add up, with what escapes.
    pub fn balance(&mut self, scene: &Scene, mesh: &Mesh, rays: u32) -> &Balance {
        self.balance = Balance::new(scene, mesh, RAYS_OUT * rays, self.basis, |functions| {
            let functions: Vec<Light<1>> = functions.iter().map(|function| function.map(|f| [f])).collect();
            self.multiply(&functions).iter().map(|light| light.map(|[f]| f)).collect()
        });
        &self.balance
    }

    /// Shadow rays that it took.
    pub fn rays(&self) -> u64 {
        self.rows.iter().map(|row| row.rays).sum()
    }

    /// Bytes of the matrix.
    pub fn bytes(&self) -> u64 {
        self.rows.iter().map(|row| 4 * (row.others.len() + row.couplings.len()) as u64).sum()
    }

    /// The irradiance \[W/m²\] that this radiosity \[W/m²\] brings to every element.
    pub fn apply(&self, radiosity: &[Coefficients]) -> Vec<Coefficients> {
        let weigh = |(light, weight): (&Coefficients, &Function)| weighted(light, weight);
        let leaving: Vec<_> = radiosity.iter().zip(&self.balance.weights).map(weigh).collect();
        let arriving = self.multiply(&leaving);
        let own = |((light, weight), area): ((&Coefficients, &Function), &f64)| {
            weighted(light, weight).map(|channels| channels.map(|c| c / area))
        };
        arriving.iter().zip(&self.balance.weights).zip(&self.areas).map(own).collect()
    }

    /// What of this radiosity \[W/m²\] escapes, by channel \[W\]; known once it is balanced.
    pub fn escaped(&self, radiosity: &[Coefficients]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (light, escaped) in radiosity.iter().zip(&self.balance.escaped) {
            for (of_function, escaped) in light.iter().zip(escaped) {
                sum.iter_mut().zip(of_function).for_each(|(sum, c)| *sum += c * escaped);
            }
        }
        sum
    }

    /// The couplings' matrix times a vector.
    fn multiply<const C: usize>(&self, light: &[Light<C>]) -> Vec<Light<C>> {
        let count = self.rows.len();
        let party = |party: usize| {
            let mut sums = vec![[[0.0; C]; 3]; count];
            for x in (party..count).step_by(PARTIES) {
                match self.basis {
                    Basis::Constant => self.rows[x].apply::<1, C>(x, light, &mut sums),
                    Basis::Linear => self.rows[x].apply::<3, C>(x, light, &mut sums),
                }
            }
            sums
        };
        let parties: Vec<Vec<Light<C>>> = (0..PARTIES).into_par_iter().map(party).collect();
        let total = |x: usize| {
            let mut sum: Light<C> = [[0.0; C]; 3];
            for party in &parties {
                sum.iter_mut().flatten().zip(party[x].iter().flatten()).for_each(|(sum, own)| *sum += own);
            }
            sum
        };
        (0..count).into_par_iter().map(total).collect()
    }

    /// How much of its light each element sends to others: the sum of its form factors, 1 in a closed scene.
    pub fn closure(&self) -> Vec<f64> {
        let one = vec![[[1.0; 3], [0.0; 3], [0.0; 3]]; self.rows.len()];
        self.apply(&one).iter().map(|irradiance| irradiance[0][0]).collect()
    }

    /// The form factor from one element to another.
    pub fn form_factor(&self, from: usize, to: usize) -> f64 {
        let (high, low) = (from.max(to), from.min(to));
        let (row, size) = (&self.rows[high], self.basis.size());
        let Ok(place) = row.others.binary_search(&(low as u32)) else { return 0.0 };
        let coupling = row.couplings.chunks_exact(size * size).nth(place).unwrap_or_default();
        let weights = &self.balance.weights;
        let pair = |a: usize, b: usize| weights[high][a] * f64::from(coupling[a * size + b]) * weights[low][b];
        (0..size).flat_map(|a| (0..size).map(move |b| (a, b))).map(|(a, b)| pair(a, b)).sum::<f64>() / self.areas[from]
    }
}

/// Light times a function, channel by channel.
fn weighted(light: &Coefficients, weight: &Function) -> Coefficients {
    let channels: [Function; 3] = std::array::from_fn(|c| product(&light.map(|of_function| of_function[c]), weight));
    std::array::from_fn(|a| channels.map(|function| function[a]))
}

fn couple_row<const B: usize>(scene: &Scene, mesh: &Mesh, x: usize, rays: u32) -> Row {
    let mut row = Row { others: Vec::new(), couplings: Vec::new(), rays: 0 };
    for y in 0..x {
        let Some((coupling, rays)) = visible_coupling::<B>(scene, mesh, (x, y), rays) else { continue };
        row.rays += rays;
        if coupling.iter().flatten().any(|c| *c as f32 != 0.0) {
            row.others.push(y as u32);
            row.couplings.extend(coupling.iter().flatten().map(|c| *c as f32));
        }
    }
    row.others.shrink_to_fit();
    row.couplings.shrink_to_fit();
    row
}

impl Row {
    /// Adds what passes between the element `x` and those of the row, both ways.
    fn apply<const B: usize, const C: usize>(&self, x: usize, light: &[Light<C>], sums: &mut [Light<C>]) {
        let own = light[x];
        let mut arrived = [[0.0; C]; 3];
        for (&y, coupling) in self.others.iter().zip(self.couplings.chunks_exact(B * B)) {
            let (other, sent) = (&light[y as usize], &mut sums[y as usize]);
            for (a, row) in coupling.chunks_exact(B).enumerate() {
                for (b, &c) in row.iter().enumerate() {
                    let c = f64::from(c);
                    for channel in 0..C {
                        arrived[a][channel] += c * other[b][channel];
                        sent[b][channel] += c * own[a][channel];
                    }
                }
            }
        }
        sums[x].iter_mut().flatten().zip(arrived.iter().flatten()).for_each(|(sum, arrived)| *sum += arrived);
    }
}
