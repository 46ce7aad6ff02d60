//! What of a coupling is lost because something stands between.
//!
//! Segments between points of the two elements, spread by a sequence of low discrepancy over the four coordinates, ask the scene. What they find
//! is taken off the coupling as it is without obstacles, `C_ab − C_00 · Σ φ_a φ_b k (1 − V) / Σ k`: where nothing stands between, nothing
//! of the closed form is lost.
//! How many there are follows from the coupling, in proportion to the larger form factor, and not from what they find: an estimate that
//! stops early where all agree leans to the side on which they agree. Nor does it depend on the light, so that light adds up. Every pair has its own shift of the sequence, so that errors of different pairs
//! have nothing to do with one another, and the mean over the pairs is right.

use super::basis::{Function, functions};
use super::form_factor::{Coupling, Panel, coupling, kernel};
use super::mesh::{Mesh, surface_point};
use glam::DVec2;
use sampling::fault;
use sampling::math::Frame;
use sampling::rng::{mix2, unit_f32};
use sampling::vec2;
use sampling::warp::cosine_hemisphere;
use scenes::Scene;

/// A form factor that takes as many rays again as one of nearly 0.
const SHARE: f64 = 0.0005;
/// So many times as many, at most.
const MOST: u32 = 64;
/// The same for a pair of quarters.
const MOST_OF_QUARTERS: u32 = 8;
/// Elements nearer to one another than this, in units of the sum of their radii, are looked at by pairs of quarters: over
/// the whole of them the kernel has a peak that few rays find.
const CLOSE: f64 = 1.0;

/// The generalised golden ratio in four dimensions, the root of `g⁵ = g + 1`, to the powers −1 to −4.
const STEPS: [f64; 4] = [0.856_674_883_854_502_9, 0.733_891_856_627_1, 0.628_706_721_023_3, 0.538_597_254_172_7];

/// What makes an element's rays other numbers than those of its pairs.
const ESCAPE: u64 = u64::MAX;

/// The coupling of two elements less what is hidden of it, found by so many rays where little is coupled, and the number of rays; `None`
/// where neither faces the other.
pub fn visible_coupling<const B: usize>(
    scene: &Scene,
    mesh: &Mesh,
    (x, y): (usize, usize),
    rays: u32,
) -> Option<(Coupling<B>, u64)> {
    let [of_x, of_y] = [x, y].map(|element| &mesh.elements()[element].panel);
    if mesh.is_convex() {
        return Some((coupling(of_x, of_y)?, 0));
    }
    let shift = mix2(x as u64, y as u64);
    let look = |of_x: &Panel, of_y: &Panel, shift: u64, most: u32| {
        let mut coupling: Coupling<B> = coupling(of_x, of_y)?;
        let largest = coupling[0][0] / of_x.area.min(of_y.area);
        let segments =
            Segments { scene, mesh, elements: (x, y), shift, count: rays * (1 + (largest / SHARE) as u32).min(most) };
        segments.take_off_hidden(of_x, of_y, &mut coupling);
        Some((coupling, u64::from(segments.count)))
    };
    if of_x.centre.distance(of_y.centre) > CLOSE * (of_x.radius + of_y.radius) {
        return look(of_x, of_y, shift, MOST);
    }
    let (xs, ys) = (of_x.quarters(), of_y.quarters());
    let mut sum: Option<(Coupling<B>, u64)> = None;
    for (number, (i, j)) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))).enumerate() {
        let Some((part, rays)) = look(&xs[i], &ys[j], mix2(shift, number as u64), MOST_OF_QUARTERS) else { continue };
        let (all, count) = sum.get_or_insert(([[0.0; B]; B], 0));
        all.iter_mut().flatten().zip(part.iter().flatten()).for_each(|(all, part)| *all += part);
        *count += rays;
    }
    sum
}

/// Segments between points of two elements.
struct Segments<'a> {
    scene: &'a Scene,
    mesh: &'a Mesh,
    elements: (usize, usize),
    /// What shifts the sequence.
    shift: u64,
    count: u32,
}

impl Segments<'_> {
    /// Takes off what is hidden between parts of the elements.
    fn take_off_hidden<const B: usize>(&self, of_x: &Panel, of_y: &Panel, coupling: &mut Coupling<B>) {
        let [x, y] = [self.elements.0, self.elements.1].map(|element| &self.mesh.elements()[element]);
        let (mut all, mut hidden, mut any) = (0.0, [[0.0; B]; B], false);
        let shift = shift(self.shift);
        for number in 0..self.count {
            let u = spread(&shift, number);
            let (s, t) = (of_x.part.point(on_triangle(u[0], u[1])), of_y.part.point(on_triangle(u[2], u[3])));
            let k = kernel(x.panel.point(s), x.panel.normal, y.panel.point(t), y.panel.normal);
            all += k;
            if k == 0.0 {
                continue;
            }
            let from = surface_point(self.mesh.facet(x), x, s);
            let is_hidden = self.scene.occluded(&from.segment_to(&surface_point(self.mesh.facet(y), y, t)));
            if !fault!("hidden_taken_for_seen", is_hidden, false) {
                continue;
            }
            any = true;
            let (f, g) = (functions::<B>(s), functions::<B>(t));
            for (row, f) in hidden.iter_mut().zip(f) {
                row.iter_mut().zip(g).for_each(|(sum, g)| *sum += f * g * k);
            }
        }
        if any {
            let scale = coupling[0][0] / all;
            let sums = coupling.iter_mut().flatten().zip(hidden.iter().flatten());
            sums.for_each(|(coupling, hidden)| *coupling -= hidden * scale);
        }
    }
}

/// What of the light that leaves an element by each of its functions meets no surface \[m²\], by so many rays: their origins are spread
/// over the element and their directions by Lambert's law, both by one sequence of low discrepancy.
pub fn escape(scene: &Scene, mesh: &Mesh, element: usize, rays: u32) -> Function {
    let of = &mesh.elements()[element];
    let (frame, weight) = (Frame::from_z(of.panel.normal.as_vec3()), of.panel.area / f64::from(rays));
    let shift = shift(mix2(element as u64, ESCAPE));
    let mut sum = [0.0; 3];
    for number in 0..rays {
        let [a, b, c, d] = spread(&shift, number);
        let at = on_triangle(a, b);
        let towards = frame.to_world(cosine_hemisphere(vec2(c as f32, d as f32)));
        if !scene.occluded(&surface_point(mesh.facet(of), of, at).spawn(towards)) {
            sum.iter_mut().zip(functions::<3>(at)).for_each(|(sum, f)| *sum += weight * f);
        }
    }
    sum
}

/// Where a sequence begins.
fn shift(seed: u64) -> [f64; 4] {
    std::array::from_fn(|i| f64::from(unit_f32((mix2(seed, i as u64) >> 32) as u32)))
}

/// A point of it.
#[inline]
fn spread(shift: &[f64; 4], number: u32) -> [f64; 4] {
    std::array::from_fn(|i| (shift[i] + f64::from(number) * STEPS[i]).fract())
}

/// A point of the unit square as coordinates on a triangle: both halves of the square are laid onto it \[Heitz19\].
fn on_triangle(u: f64, v: f64) -> DVec2 {
    if v > u { DVec2::new(0.5 * u, v - 0.5 * u) } else { DVec2::new(u - 0.5 * v, 0.5 * v) }
}
