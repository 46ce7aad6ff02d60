//! The balance heuristic on densities that are multiplied by factors, one for each strategy of an order.
//!
//! `w_s = v_s p_s / Σ_i v_i p_i`. A factor belongs to strategy *and* order, so that sums along a subpath, which paths of all orders share,
//! do not have it; a weight goes through the strategies of its own path instead, by the same ratios of densities.

use super::{EmitterEnd, Strategies, emitter_end, ratio};
use crate::vertex::PathVertex;
use sampling::Vec2;
use sampling::fault;
use scenes::Scene;

/// Factors of densities, by cell of the image, order and strategy.
#[derive(Clone, Debug)]
pub struct Factors {
    /// Edge of a cell \[pixels\].
    edge: u32,
    columns: usize,
    rows: usize,
    /// Orders below this have factors.
    orders: usize,
    /// All of them: cell by cell, in rows; of a cell order by order, and of an order by the number of light vertices. Positive and finite.
    pub values: Vec<f32>,
}

/// How many strategies the orders below one have.
pub fn strategies_below(order: usize) -> usize {
    order * (order + 3) / 2
}

impl Factors {
    /// Factors of 1 for the orders below `orders`, in square cells of this edge \[pixels\] of an image of this size.
    pub fn ones((width, height): (u32, u32), edge: u32, orders: usize) -> Self {
        let (columns, rows) = (width.div_ceil(edge) as usize, height.div_ceil(edge) as usize);
        Self { edge, columns, rows, orders, values: vec![1.0; columns * rows * strategies_below(orders)] }
    }

    /// The orders that have factors, from 0 on.
    pub fn orders(&self) -> usize {
        self.orders
    }

    /// How many a cell has.
    pub fn in_a_cell(&self) -> usize {
        strategies_below(self.orders)
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

    /// The factors of an order's strategies, by their number of light vertices, for paths through a place on the film \[pixels\].
    #[inline]
    pub fn of(&self, raster: Vec2, order: usize) -> Option<&[f32]> {
        let first = self.place(raster, order)?;
        Some(&self.values[first..first + order + 2])
    }
}

impl Strategies {
    /// [`weight_connected`](Self::weight_connected) by the balance heuristic with these factors, one for each strategy of the path's order.
    pub fn weight_connected_by(
        &self,
        factors: &[f32],
        scene: &Scene,
        light: &[PathVertex],
        camera: &[PathVertex],
        next_event: f64,
    ) -> f64 {
        let s = light.len();
        let own = f64::from(factors[s]);
        let joint = self.joint(scene, light, camera);
        let from_camera = self.longer_light(factors, (s, false), camera, (joint.to_z, joint.back_z));
        if s == 1 {
            let Some(end) = emitter_end(&light[0]) else { return 1.0 };
            let met = if end.is_hittable() { f64::from(factors[0]) * ratio(joint.to_y, next_event) } else { 0.0 };
            return own / (own + met + times(from_camera, ratio(joint.back_y, next_event)));
        }
        let from_light = self.shorter_light(factors, light, (joint.to_y, joint.back_y), next_event);
        own / (own + (from_light + from_camera) / self.light_paths)
    }

    /// [`weight_emission`](Self::weight_emission) by the balance heuristic with these factors, one for each strategy of the path's order.
    pub fn weight_emission_by(&self, factors: &[f32], scene: &Scene, camera: &[PathVertex], end: &EmitterEnd) -> f64 {
        let t = camera.len();
        let own = f64::from(factors[0]);
        let (met, before) = (&camera[t - 1], &camera[t - 2]);
        let (to_z, back_z) = end.emission_densities(scene, before);
        let by_next_event = if t == 2 { self.emitter_to_camera } else { !before.delta };
        let mut rivals = 0.0;
        if by_next_event {
            rivals = f64::from(factors[1]) * ratio(end.next_event_density(scene, &before.at), met.pdf_fwd);
        }
        if t >= 3 {
            // The strategies of two light vertices and more, as rivals of that of one if it chose its vertex as light walks do.
            let further = if t >= 4 { camera[t - 3].pdf_rev } else { 0.0 };
            let longer = self.longer_light(factors, (1, before.delta), &camera[..t - 1], (back_z, further));
            rivals += times(longer, ratio(to_z, met.pdf_fwd));
        }
        own / (own + rivals)
    }

    /// The strategies of fewer light vertices than a light subpath has, whose last two vertices have these densities from the camera's end,
    /// as rivals of its own product of densities.
    #[inline]
    fn shorter_light(&self, factors: &[f32], light: &[PathVertex], joint: (f64, f64), next_event: f64) -> f64 {
        let s = light.len();
        let (mut sum, mut product) = (0.0, 1.0);
        for i in (0..s).rev() {
            let from_camera = match s - 1 - i {
                0 => joint.0,
                1 => joint.1,
                _ => light[i].pdf_rev,
            };
            let step = ratio(from_camera, light[i].pdf_fwd);
            product = times(product, step);
            // What has no density is no rival, nor is any that would have it as a factor.
            if product == 0.0 {
                break;
            }
            // The last vertex ends its subpath: a direction it was left by belongs to longer paths.
            let delta = i < s - 1 && light[i].delta;
            let (possible, share) = match i {
                0 => (emitter_end(&light[0]).is_some_and(|end| end.is_hittable()), 1.0),
                1 => (!delta, ratio(next_event, light[0].pdf_fwd)),
                _ => (!delta && !light[i - 1].delta, self.light_paths),
            };
            if possible {
                let factor = f64::from(factors[fault!("factor_of_another_strategy", i, i + 1)]);
                sum += times(factor * share, product);
            }
        }
        sum
    }

    /// The strategies of more than `s` light vertices, as rivals of the product of densities of that of `s`. The last two vertices of its camera
    /// subpath have these densities from the light's end; `delta` is whether the last scatters by a delta lobe on this path.
    #[inline]
    fn longer_light(
        &self,
        factors: &[f32],
        (s, mut delta): (usize, bool),
        camera: &[PathVertex],
        joint: (f64, f64),
    ) -> f64 {
        let t = camera.len();
        let (mut sum, mut product) = (0.0, 1.0);
        for more in 1..t {
            let j = t - more;
            let from_light = match more {
                1 => joint.0,
                2 => joint.1,
                _ => camera[j].pdf_rev,
            };
            let step = ratio(from_light, camera[j].pdf_fwd);
            product = times(product, step);
            if product == 0.0 {
                break;
            }
            if !delta && !camera[j - 1].delta {
                sum += f64::from(factors[s + more]) * product;
            }
            delta = camera[j - 1].delta;
        }
        self.light_paths * sum
    }
}

/// A product that is 0 where either is, even if the other overflows: what cannot make the path is no rival.
#[inline]
fn times(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { 0.0 } else { a * b }
}
