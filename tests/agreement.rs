//! Every pair of methods on every built-in scene, order by order: Welch's t on the image and on its blocks.
//!
//! False-alarm rate: 0.1 % for each scene (Šidák over pairs, orders and blocks). Beside each scene the minimum detectable
//! bias is printed: the smallest difference of image means that the test would find with a probability of 80 %.

use crate::support::{Budget, Estimate, Family, FALSE_ALARM_RATE, builtin, grey, measure, method};
use integrators::{Integrator, Measurement};
use sampling::bsdf::{BsdfModel, Lobes};
use sampling::{Vec2, vec2};
use scenes::Scene;
use statrs::distribution::{ContinuousCDF, Normal};

/// Width and height of the images; each pixel is a block.
const SIZE: u32 = 16;

/// Blocks in which every camera ray first meets a surface without delta lobes. There, all methods carry the same paths: with
/// a pinhole, light tracing loses just those whose last scattering is by a delta lobe.
fn blocks_without_delta(scene: &Scene, m: &Measurement) -> Vec<bool> {
    let mut carried = vec![true; m.grid.count()];
    for pixel in 0..m.pixels() {
        let (x, y) = ((pixel as u32 % m.width) as f32, (pixel as u32 / m.width) as f32);
        for i in 0..32 * 32 {
            let raster = vec2(x + (i % 32) as f32 / 31.5, y + (i / 32) as f32 / 31.5);
            let hit = scene.intersect(&scene.camera.sample_we(raster, Vec2::ZERO).ray);
            if hit.is_some_and(|hit| hit.bsdf.lobes().intersects(Lobes::DELTA)) {
                carried[m.grid.block_of(pixel)] = false;
            }
        }
    }
    carried
}

/// The smallest relative difference of two image means that a test at `threshold` finds with probability 0.8.
fn detectable(a: Estimate, b: Estimate, threshold: f64) -> f64 {
    let normal = Normal::new(0.0, 1.0).unwrap();
    let quantiles = -normal.inverse_cdf(threshold / 2.0) + normal.inverse_cdf(0.8);
    quantiles * (a.error * a.error + b.error * b.error).sqrt() / a.mean.abs().max(b.mean.abs())
}

/// The estimate of the mean over the blocks that both methods carry, weighted alike.
fn over_blocks(m: &Measurement, layer: usize, carried: &[bool]) -> Estimate {
    if carried.iter().all(|&c| c) {
        return Estimate::of_image(m, layer);
    }
    let blocks: Vec<Estimate> = (0..carried.len()).filter(|&b| carried[b]).map(|b| Estimate::of_block(m, layer, b)).collect();
    let n = blocks.len() as f64;
    // Blocks of one replicate are correlated where they share light paths; adding errors is the upper bound.
    let error = blocks.iter().map(|e| e.error).sum::<f64>() / n;
    Estimate { mean: blocks.iter().map(|e| e.mean).sum::<f64>() / n, error, replicates: m.replicates }
}

fn agree(name: &str, budgets: &[(&str, u32)]) {
    let scene = builtin(name, SIZE);
    let methods: Vec<(Box<dyn Integrator>, Measurement)> = budgets
        .iter()
        .map(|&(name, samples)| {
            let method = method(name);
            let m = measure(&scene, method.as_ref(), name, Budget::samples(samples));
            (method, m)
        })
        .collect();
    let everywhere = vec![true; methods[0].1.grid.count()];
    let carried = blocks_without_delta(&scene, &methods[0].1);
    let mut family = Family::new(format!("agreement on {name}"));
    let mut pairs = Vec::new();
    for (i, (a, ma)) in methods.iter().enumerate() {
        for (b, mb) in &methods[..i] {
            let restricted = [a, b].iter().any(|m| m.name() == "light") && scene.needs.delta_lobes;
            let blocks = if restricted { &carried } else { &everywhere };
            for order in 0..=*a.orders(8).end().min(b.orders(8).end()) {
                let label = format!("{} and {} order {order}", a.name(), b.name());
                let (ea, eb) = (over_blocks(ma, order, blocks), over_blocks(mb, order, blocks));
                if grey(ma.image_mean(order)) == 0.0 && grey(mb.image_mean(order)) == 0.0 {
                    continue;
                }
                family.pair(label.clone(), ea, eb);
                pairs.push((label.clone(), ea, eb));
                for block in (0..blocks.len()).filter(|&block| blocks[block]) {
                    let pair = [ma, mb].map(|m| Estimate::of_block(m, order, block));
                    family.pair(format!("{label} block {block}"), pair[0], pair[1]);
                }
            }
        }
    }
    let threshold = 1.0 - (1.0 - FALSE_ALARM_RATE).powf(1.0 / family.len() as f64);
    for (label, a, b) in pairs {
        let z = (a.mean - b.mean) / (a.error * a.error + b.error * b.error).sqrt();
        println!("{name}: {label}: {:.5e}, z {z:+.2}, detectable {:.2} %", a.mean, 100.0 * detectable(a, b, threshold));
    }
    family.finish();
}

#[test]
fn cornell_box() {
    agree("cornell_box", &[("direct", 256), ("path", 256), ("light", 256), ("bdpt", 64)]);
}

#[test]
fn furnace() {
    agree("furnace", &[("direct", 64), ("path", 128), ("light", 128), ("bdpt", 32)]);
}

#[test]
fn integrating_sphere() {
    agree("integrating_sphere", &[("direct", 64), ("path", 128), ("light", 128), ("bdpt", 32)]);
}

#[test]
fn veach_mis() {
    agree("veach_mis", &[("direct", 256), ("path", 256), ("light", 256), ("bdpt", 64)]);
}

#[test]
fn glass_caustic() {
    agree("glass_caustic", &[("direct", 256), ("path", 512), ("light", 256), ("bdpt", 64)]);
}

#[test]
fn indirect_lamp() {
    agree("indirect_lamp", &[("direct", 256), ("path", 512), ("light", 256), ("bdpt", 64)]);
}
