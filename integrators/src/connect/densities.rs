//! The densities of all strategies of one path, one by one, and weights that need them so.
//!
//! What a pilot has found of a strategy belongs to an order too, so that sums along a subpath, which paths of all orders share, do not have it; a
//! weight goes through the strategies of its own path instead, by the same ratios of densities.

use super::{EmitterEnd, Strategies, emitter_end, ratio};
use crate::vertex::PathVertex;
use sampling::Vec2;
use sampling::fault;
use scenes::Scene;

/// Orders from here on are weighted by their densities alone: what pilots find grows with the square of the last order.
pub const ORDERS: usize = 17;

/// Paths that bring less than this have no control variates.
const LEAST: f64 = 1e-30;

/// A number of every strategy, by cell of the image and order.
#[derive(Clone, Debug)]
pub struct PerStrategy {
    /// Edge of a cell \[pixels\].
    edge: u32,
    columns: usize,
    rows: usize,
    /// Orders below this have numbers.
    orders: usize,
    /// All of them: cell by cell, in rows; of a cell order by order, and of an order by the number of light vertices. Finite.
    pub values: Vec<f32>,
}

/// How many strategies the orders below one have.
pub fn strategies_below(order: usize) -> usize {
    order * (order + 3) / 2
}

impl PerStrategy {
    /// The same number everywhere, for the orders below `orders`, at most [`ORDERS`], in square cells of this edge \[pixels\] of an image of this size.
    pub fn all(value: f32, (width, height): (u32, u32), edge: u32, orders: usize) -> Self {
        let (columns, rows) = (width.div_ceil(edge) as usize, height.div_ceil(edge) as usize);
        let orders = orders.min(ORDERS);
        Self { edge, columns, rows, orders, values: vec![value; columns * rows * strategies_below(orders)] }
    }

    /// The orders that have numbers, from 0 on.
    pub fn orders(&self) -> usize {
        self.orders
    }

    /// How many a cell has.
    pub fn in_a_cell(&self) -> usize {
        strategies_below(self.orders)
    }

    /// All cells.
    pub fn cells(&self) -> usize {
        self.columns * self.rows
    }

    /// Cells in a row of the image.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Where among the values those of an order begin, for paths through a place on the film \[pixels\]; `None` where the order has none.
    /// Places off the film count to the nearest cell.
    #[inline]
    pub fn place(&self, raster: Vec2, order: usize) -> Option<usize> {
        if order >= self.orders {
            return None;
        }
        let at = raster / self.edge as f32;
        let cell = (at.y as usize).min(self.rows - 1) * self.columns + (at.x as usize).min(self.columns - 1);
        Some(cell * strategies_below(self.orders) + strategies_below(order))
    }

    /// The numbers of an order's strategies, by their number of light vertices, for paths through a place on the film \[pixels\].
    #[inline]
    pub fn of(&self, raster: Vec2, order: usize) -> Option<&[f32]> {
        let first = self.place(raster, order)?;
        Some(&self.values[first..first + order + 2])
    }
}

/// The densities of a path's strategies times their numbers of samples, relative to that of the strategy that made it; 0 for one that cannot.
#[derive(Clone, Copy, Debug)]
pub struct Densities {
    values: [f64; ORDERS + 1],
    /// The strategy that made the path, and how many there are: one more than vertices before the last.
    own: usize,
    count: usize,
}

impl Densities {
    fn new(own: usize, count: usize) -> Self {
        let mut values = [0.0; ORDERS + 1];
        values[own] = 1.0;
        Self { values, own, count }
    }

    /// By the number of light vertices.
    #[inline]
    fn values(&self) -> &[f64] {
        &self.values[..self.count]
    }

    /// The weight by the balance heuristic on densities times `factors`, one for each strategy: `v_s p_s / Σ_i v_i p_i`.
    #[inline]
    pub fn weight_by_factors(&self, factors: &[f32]) -> f64 {
        let sum: f64 = self.values().iter().zip(factors).map(|(&p, &factor)| times(f64::from(factor), p)).sum();
        f64::from(factors[fault!("factor_of_another_strategy", self.own, self.own.saturating_sub(1))]) / sum
    }

    /// The weight by the balance heuristic and control variates: with `α` of each strategy, `p_s / Σ_i p_i + (α_s − ᾱ) / C`, C being the `luminance` of
    /// what the strategy contributes alone and ᾱ the mean of the α by their densities.
    ///
    /// Since `Σ_s p_s (α_s − ᾱ) = 0` and C is in inverse proportion to `p_s`, weights sum to one, whatever α are; those that make the variance
    /// least are the optimal weights of \[Kondapaneni19\].
    #[inline]
    pub fn weight_by_controls(&self, controls: &[f32], luminance: f64) -> f64 {
        let share = 1.0 / self.sum();
        let mean: f64 =
            self.values().iter().zip(controls).map(|(p, &control)| p * f64::from(control)).sum::<f64>() * share;
        let excess = f64::from(controls[self.own]) - fault!("controls_without_their_mean", mean, 0.0);
        // What the balance heuristic brings is the same by all strategies, so that they agree on what is too little to be divided by.
        if luminance * share > LEAST { share + excess / luminance } else { share }
    }

    /// The derivatives of `α_s − ᾱ` by every α, added up: 1 by the strategy's own, less the shares by density.
    pub fn add_controls(&self, to: &mut [f64]) {
        let share = 1.0 / self.sum();
        if share > 0.0 {
            to.iter_mut().zip(self.values()).for_each(|(to, p)| *to -= p * share);
            to[self.own] += 1.0;
        }
    }

    fn sum(&self) -> f64 {
        self.values().iter().sum()
    }
}

impl Strategies {
    /// The densities of the path made by joining the last vertices of two subpaths, the light one not empty, of an order below [`ORDERS`].
    ///
    /// `next_event` is the density of the emitter's vertex when it is chosen as seen from vertex 1.
    pub fn densities_connected(
        &self,
        scene: &Scene,
        light: &[PathVertex],
        camera: &[PathVertex],
        next_event: f64,
    ) -> Densities {
        let s = light.len();
        let mut densities = Densities::new(s, s + camera.len());
        let joint = self.joint(scene, light, camera);
        if s == 1 {
            let Some(end) = emitter_end(&light[0]) else { return densities };
            if end.is_hittable() {
                densities.values[0] = ratio(joint.to_y, next_event);
            }
            // As longer light subpaths know it, this strategy has the density of a light subpath's first vertex.
            let scale = times(self.light_paths, ratio(joint.back_y, next_event));
            self.longer_light(&mut densities, (1, false), scale, camera, (joint.to_z, joint.back_z));
        } else {
            self.shorter_light(&mut densities, light, (joint.to_y, joint.back_y), next_event);
            self.longer_light(&mut densities, (s, false), 1.0, camera, (joint.to_z, joint.back_z));
        }
        densities
    }

    /// The densities of the path that a camera subpath makes alone, its last vertex being on an emitter, of an order below [`ORDERS`].
    pub fn densities_emission(&self, scene: &Scene, camera: &[PathVertex], end: &EmitterEnd) -> Densities {
        let t = camera.len();
        let mut densities = Densities::new(0, t);
        let (met, before) = (&camera[t - 1], &camera[t - 2]);
        let (to_z, back_z) = end.emission_densities(scene, before);
        let by_next_event = if t == 2 { self.emitter_to_camera } else { !before.delta };
        if by_next_event {
            densities.values[1] = ratio(end.next_event_density(scene, &before.at), met.pdf_fwd);
        }
        if t >= 3 {
            // The strategies of two light vertices and more, as rivals of that of one if it chose its vertex as light walks do.
            let further = if t >= 4 { camera[t - 3].pdf_rev } else { 0.0 };
            let scale = times(self.light_paths, ratio(to_z, met.pdf_fwd));
            self.longer_light(&mut densities, (1, before.delta), scale, &camera[..t - 1], (back_z, further));
        }
        densities
    }

    /// The strategies of fewer light vertices than a light subpath has, whose last two vertices have these densities from the camera's end.
    #[inline]
    fn shorter_light(&self, densities: &mut Densities, light: &[PathVertex], joint: (f64, f64), next_event: f64) {
        let s = light.len();
        let mut product = 1.0;
        for i in (0..s).rev() {
            let step = ratio(beyond(joint, s - 1 - i, &light[i]), light[i].pdf_fwd);
            product = times(product, step);
            // What has no density is no rival, nor is any that would have it as a factor.
            if product == 0.0 {
                break;
            }
            // The last vertex ends its subpath: a direction it was left by belongs to longer paths.
            let delta = i < s - 1 && light[i].delta;
            let (possible, share) = match i {
                0 => (emitter_end(&light[0]).is_some_and(|end| end.is_hittable()), 1.0 / self.light_paths),
                1 => (!delta, ratio(next_event, light[0].pdf_fwd) / self.light_paths),
                _ => (!delta && !light[i - 1].delta, 1.0),
            };
            if possible {
                densities.values[i] = times(share, product);
            }
        }
    }

    /// The strategies of more than `s` light vertices, times `scale`. The last two vertices of the camera subpath of that of `s` have these densities
    /// from the light's end; `delta` is whether the last scatters by a delta lobe on this path.
    #[inline]
    fn longer_light(
        &self,
        densities: &mut Densities,
        (s, mut delta): (usize, bool),
        scale: f64,
        camera: &[PathVertex],
        joint: (f64, f64),
    ) {
        let t = camera.len();
        let mut product = 1.0;
        for more in 1..t {
            let j = t - more;
            let step = ratio(beyond(joint, more - 1, &camera[j]), camera[j].pdf_fwd);
            product = times(product, step);
            if product == 0.0 {
                break;
            }
            if !delta && !camera[j - 1].delta && self.stops_at(j) {
                densities.values[s + more] = times(scale, product);
            }
            delta = camera[j - 1].delta;
        }
    }
}

/// The density from the other end of the vertex that comes so many before a subpath's last: those of the last two are known by the connection alone.
#[inline]
fn beyond(joint: (f64, f64), before_last: usize, vertex: &PathVertex) -> f64 {
    match before_last {
        0 => joint.0,
        1 => joint.1,
        _ => vertex.pdf_rev,
    }
}

/// A product that is 0 where either is, even if the other overflows: what cannot make the path is no rival.
#[inline]
fn times(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { 0.0 } else { a * b }
}
