//! The transport operator as a matrix: the couplings of all pairs of elements.
//!
//! Only the pairs (x, y) with y < x are kept, as `f32`, and only those that see one another: the others are their transposes, so that
//! reciprocity holds to the bit. Light is multiplied in `f64`. Rows are dealt to a fixed number of parties in turn, each of which sums
//! for itself, and the parties' sums are added in order: bits do not depend on threads.

use super::basis::Basis;
use super::mesh::{Coefficients, Mesh};
use super::visibility::visible_coupling;
use rayon::prelude::*;
use scenes::Scene;

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

/// The operator on a mesh.
pub struct Operator {
    rows: Vec<Row>,
    areas: Vec<f64>,
    basis: Basis,
}

impl Operator {
    /// Couples all elements.
    pub fn new(scene: &Scene, mesh: &Mesh, basis: Basis, rays: u32) -> Self {
        let count = mesh.elements().len();
        let row = |x: usize| match basis {
            Basis::Constant => couple_row::<1>(scene, mesh, x, rays),
            Basis::Linear => couple_row::<3>(scene, mesh, x, rays),
        };
        // The last rows are the longest.
        let mut rows: Vec<Row> = (0..count).into_par_iter().rev().map(row).collect();
        rows.reverse();
        Self { rows, areas: mesh.elements().iter().map(|element| element.panel.area).collect(), basis }
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
        let count = self.rows.len();
        let party = |party: usize| {
            let mut sums = vec![[[0.0; 3]; 3]; count];
            for x in (party..count).step_by(PARTIES) {
                match self.basis {
                    Basis::Constant => self.rows[x].apply::<1>(x, radiosity, &mut sums),
                    Basis::Linear => self.rows[x].apply::<3>(x, radiosity, &mut sums),
                }
            }
            sums
        };
        let parties: Vec<Vec<Coefficients>> = (0..PARTIES).into_par_iter().map(party).collect();
        let total = |x: usize| {
            let mut sum: Coefficients = [[0.0; 3]; 3];
            for party in &parties {
                sum.iter_mut().flatten().zip(party[x].iter().flatten()).for_each(|(sum, own)| *sum += own);
            }
            sum.map(|channels| channels.map(|c| c / self.areas[x]))
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
        let (row, other) = (&self.rows[from.max(to)], from.min(to) as u32);
        let size = self.basis.size() * self.basis.size();
        let place = row.others.binary_search(&other);
        place.map_or(0.0, |place| f64::from(row.couplings[place * size]) / self.areas[from])
    }
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
    fn apply<const B: usize>(&self, x: usize, radiosity: &[Coefficients], sums: &mut [Coefficients]) {
        let own = radiosity[x];
        let mut arrived = [[0.0; 3]; 3];
        for (&y, coupling) in self.others.iter().zip(self.couplings.chunks_exact(B * B)) {
            let (other, sent) = (&radiosity[y as usize], &mut sums[y as usize]);
            for (a, row) in coupling.chunks_exact(B).enumerate() {
                for (b, &c) in row.iter().enumerate() {
                    let c = f64::from(c);
                    for channel in 0..3 {
                        arrived[a][channel] += c * other[b][channel];
                        sent[b][channel] += c * own[a][channel];
                    }
                }
            }
        }
        sums[x].iter_mut().flatten().zip(arrived.iter().flatten()).for_each(|(sum, arrived)| *sum += arrived);
    }
}
