//! What a file holds: the channels of its layers, whose samples are worked out line by line as they are written.

use super::{ImageLayer, LayerSelection, text};
use exr::block::lines::LineRefMut;
use exr::image::write::samples::{SamplesWriter, WritableSamples};
use exr::math::RoundingMode;
use exr::meta::attribute::{LevelMode, SampleType};
use exr::meta::header::Header;
use exr::prelude::{AnyChannel, Vec2};
use integrators::{Measurement, Part, Quantity};

type Channel<'m> = AnyChannel<Samples<'m>>;

/// The samples of a channel, by pixel.
pub(super) struct Samples<'m>(Box<dyn Fn(usize) -> f64 + Sync + 'm>);

impl<'s> WritableSamples<'s> for Samples<'_> {
    type Writer = Lines<'s>;

    fn sample_type(&self) -> SampleType {
        SampleType::F32
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&'s self, header: &Header) -> Lines<'s> {
        Lines { width: header.layer_size.width(), value: &*self.0 }
    }
}

/// The lines of a channel.
pub(super) struct Lines<'s> {
    width: usize,
    value: &'s (dyn Fn(usize) -> f64 + Sync),
}

impl SamplesWriter for Lines<'_> {
    fn extract_line(&self, line: LineRefMut<'_>) {
        let first = line.location.position.y() * self.width + line.location.position.x();
        line.write_samples(|i| (self.value)(first + i) as f32).expect("a line has room for its samples");
    }
}

/// The channels of the layers of a measurement that are asked for.
pub(super) fn of(m: &Measurement, selection: LayerSelection) -> Vec<Channel<'_>> {
    let mut channels = Channels { list: Vec::new() };
    let with_variance = selection.variance && m.replicates >= 2;
    channels.colour("", |p| m.total(p));
    for (i, layer) in m.layers.iter().enumerate() {
        let name = layer.name(m.max_order);
        if selection.orders {
            channels.colour(&name, move |p| m.mean(i, p));
        }
        if with_variance {
            channels.colour(&format!("{name}_var"), move |p| variance_of_mean(m, i, p));
        }
    }
    for (i, part) in m.parts() {
        let name = part.name(m.max_order);
        let of_weights = matches!(part, Part::Strategy { quantity: Quantity::Weights, .. });
        match of_weights {
            true => channels.luminance(&name, move |p| mean_weight(m, i, p).0),
            false => channels.colour(&name, move |p| m.mean(i, p)),
        }
        let name = format!("{name}_var");
        match of_weights {
            _ if !with_variance => {}
            true => channels.luminance(&name, move |p| mean_weight(m, i, p).1),
            false => channels.colour(&name, move |p| variance_of_mean(m, i, p)),
        }
    }
    channels.list
}

/// The channels of layers that were read.
pub(super) fn of_layers(layers: &[ImageLayer]) -> Vec<Channel<'_>> {
    let mut channels = Channels { list: Vec::new() };
    for layer in layers {
        channels.colour(&layer.name, |p| layer.pixels[p].map(f64::from));
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

struct Channels<'m> {
    list: Vec<Channel<'m>>,
}

impl<'m> Channels<'m> {
    /// Adds a layer of three colours.
    fn colour(&mut self, layer: &str, value: impl Fn(usize) -> [f64; 3] + Copy + Sync + 'm) {
        for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
            let name = if layer.is_empty() { name.to_owned() } else { format!("{layer}.{name}") };
            self.add(&name, move |pixel| value(pixel)[c]);
        }
    }

    /// Adds a layer of one number, which goes by the name of luminance.
    fn luminance(&mut self, layer: &str, value: impl Fn(usize) -> f64 + Sync + 'm) {
        self.add(&format!("{layer}.Y"), value);
    }

    fn add(&mut self, name: &str, value: impl Fn(usize) -> f64 + Sync + 'm) {
        let sample_data = Samples(Box::new(value));
        self.list.push(AnyChannel { name: text(name), sample_data, quantize_linearly: false, sampling: Vec2(1, 1) });
    }
}
