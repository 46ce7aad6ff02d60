//! What a file holds: the channels of its layers.

use super::{ImageLayer, LayerSelection, text};
use exr::prelude::{AnyChannel, FlatSamples, Vec2};
use integrators::{Measurement, Part, Quantity};

type Channel = AnyChannel<FlatSamples>;

/// The channels of the layers of a measurement that are asked for.
pub(super) fn of(m: &Measurement, selection: LayerSelection) -> Vec<Channel> {
    let mut channels = Channels { pixels: m.pixels(), list: Vec::new() };
    let with_variance = selection.variance && m.replicates >= 2;
    channels.colour("", &|p| m.total(p));
    for (i, layer) in m.layers.iter().enumerate() {
        let name = layer.name(m.max_order);
        if selection.orders {
            channels.colour(&name, &|p| m.mean(i, p));
        }
        if with_variance {
            channels.colour(&format!("{name}_var"), &|p| variance_of_mean(m, i, p));
        }
    }
    for (i, part) in m.parts() {
        let name = part.name(m.max_order);
        let of_weights = matches!(part, Part::Strategy { quantity: Quantity::Weights, .. });
        match of_weights {
            true => channels.luminance(&name, &|p| mean_weight(m, i, p).0),
            false => channels.colour(&name, &|p| m.mean(i, p)),
        }
        let name = format!("{name}_var");
        match of_weights {
            _ if !with_variance => {}
            true => channels.luminance(&name, &|p| mean_weight(m, i, p).1),
            false => channels.colour(&name, &|p| variance_of_mean(m, i, p)),
        }
    }
    channels.list
}

/// The channels of layers that were read.
pub(super) fn of_layers(layers: &[ImageLayer]) -> Vec<Channel> {
    let pixels = layers.first().map_or(0, |layer| layer.pixels.len());
    let mut channels = Channels { pixels, list: Vec::new() };
    for layer in layers {
        channels.colour(&layer.name, &|p| layer.pixels[p].map(f64::from));
    }
    channels.list
}

fn variance_of_mean(m: &Measurement, layer: usize, pixel: usize) -> [f64; 3] {
    m.variance(layer, pixel).unwrap_or_default().map(|v| v / f64::from(m.replicates))
}

/// The mean weight of a strategy's contributions to a pixel, the sum W of weights over the number N of contributions, and its
/// variance by the first terms of Taylor's series, `(var W − 2w cov(W, N) + w² var N) / N²`; zeros where nothing came.
fn mean_weight(m: &Measurement, layer: usize, pixel: usize) -> (f64, f64) {
    let [weights, number, _] = m.mean(layer, pixel);
    if number == 0.0 {
        return (0.0, 0.0);
    }
    let w = weights / number;
    let [of_weights, of_number, of_both] = variance_of_mean(m, layer, pixel);
    let covariance = 0.5 * (of_both - of_weights - of_number);
    // Of what has no variance, rounding may leave less than nothing.
    let variance = ((of_weights - 2.0 * w * covariance + w * w * of_number) / (number * number)).max(0.0);
    (w, variance)
}

struct Channels {
    pixels: usize,
    list: Vec<Channel>,
}

impl Channels {
    /// Adds a layer of three colours.
    fn colour(&mut self, layer: &str, value: &dyn Fn(usize) -> [f64; 3]) {
        let mut planes: [Vec<f32>; 3] = std::array::from_fn(|_| Vec::with_capacity(self.pixels));
        for pixel in 0..self.pixels {
            let v = value(pixel);
            planes.iter_mut().zip(v).for_each(|(plane, x)| plane.push(x as f32));
        }
        for (plane, c) in planes.into_iter().zip(["R", "G", "B"]) {
            self.add(if layer.is_empty() { c.to_owned() } else { format!("{layer}.{c}") }, plane);
        }
    }

    /// Adds a layer of one number, which goes by the name of luminance.
    fn luminance(&mut self, layer: &str, value: &dyn Fn(usize) -> f64) {
        self.add(format!("{layer}.Y"), (0..self.pixels).map(|pixel| value(pixel) as f32).collect());
    }

    fn add(&mut self, name: String, samples: Vec<f32>) {
        let sample_data = FlatSamples::F32(samples);
        self.list.push(AnyChannel { name: text(&name), sample_data, quantize_linearly: false, sampling: Vec2(1, 1) });
    }
}
