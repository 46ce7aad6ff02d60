//! Closed forms against which methods are held, order by order.

use super::{Budget, Estimate, Family, measure};
use integrators::Integrator;
use sampling::{Vec2, vec2};
use scenes::{Interaction, Ray, Scene};

/// Nodes and weights of five-point Gauss–Legendre quadrature on [0, 1].
pub const GAUSS: [(f64, f64); 5] = [
    (0.046910077030668, 0.118463442528095),
    (0.230765344947158, 0.239314335249683),
    (0.5, 0.284444444444444),
    (0.769234655052842, 0.239314335249683),
    (0.953089922969332, 0.118463442528095),
];

/// What every pixel of every order should be.
pub struct Truth<'s> {
    scene: &'s Scene,
    /// `[order][pixel]`.
    pixels: Vec<Vec<f64>>,
}

impl<'s> Truth<'s> {
    /// The pixel means, by quadrature, of radiances that are smooth functions of the first hit: `orders(hit, ray)`.
    pub fn new(scene: &'s Scene, orders: impl Fn(&Interaction, &Ray) -> Vec<f64>) -> Self {
        let (width, height) = (scene.camera.width(), scene.camera.height());
        let count = (width * height) as usize;
        let mut pixels: Vec<Vec<f64>> = Vec::new();
        for pixel in 0..count {
            let (x, y) = (pixel as u32 % width, pixel as u32 / width);
            for ((u, weight_u), (v, weight_v)) in GAUSS.iter().flat_map(|a| GAUSS.iter().map(move |b| (a, b))) {
                let raster = vec2(x as f32 + *u as f32, y as f32 + *v as f32);
                let ray = scene.camera.sample_we(raster, Vec2::ZERO).ray;
                let hit = scene.intersect(&ray).expect("every pixel sees a surface");
                let radiances = orders(&hit, &ray);
                pixels.resize(radiances.len(), vec![0.0; count]);
                for (pixels, radiance) in pixels.iter_mut().zip(&radiances) {
                    pixels[pixel] += weight_u * weight_v * radiance;
                }
            }
        }
        Self { scene, pixels }
    }

    /// The scene's name.
    pub fn name(&self) -> &str {
        &self.scene.name
    }

    /// Renders, and compares every order that the method carries, over the image and over each of `columns` × `columns` blocks.
    pub fn compare(&self, family: &mut Family, label: &str, method: &dyn Integrator, budget: Budget, columns: usize) {
        let budget = budget.up_to(self.pixels.len() - 1);
        let rendered = measure(self.scene, method, &format!("{} {label}", self.scene.name), budget);
        for order in method.orders(budget.max_order) {
            let mean =
                |pixels: &[usize]| pixels.iter().map(|&p| self.pixels[order][p]).sum::<f64>() / pixels.len() as f64;
            let all: Vec<usize> = (0..self.pixels[order].len()).collect();
            let label = format!("{} {label} order {order}", self.scene.name);
            family.image(&label, rendered.image(order), Estimate::exact(mean(&all)));
            for (i, block) in rendered.blocks(columns).iter().enumerate() {
                family.block(format!("{label} block {i}"), rendered.over(order, block), Estimate::exact(mean(block)));
            }
        }
    }
}
