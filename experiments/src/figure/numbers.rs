//! How far the images of a figure are from a reference.
//!
//! An image of results is the mean of R replicates. Where its method has no bias and carries all of the light, what is told is the error that the report has of one
//! replicate ([`crate::statistics::errors`]), and its interval, divided by R: that is the expectation for the mean of R of them.
//! Of any other method, and of any other image, it is the error that this one image happens to have, without an interval, since one
//! image tells none: `⟨(x − ref)² − v⟩`, v being the reference's own variance where its file tells it, and for the relative one the same
//! over `h² + 0.01`, h an independent half of the reference where it has one.

use super::file::Caption;
use super::images::{Image, Shown};
use crate::export::exr::LayeredImage;
use crate::metrics::RELATIVE_FLOOR;
use crate::path_class::carries;
use crate::report::numbers::short;
use integrators::{Bias, Layer, Methods};

/// A number and its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Number {
    /// The number.
    pub value: f64,
    /// Its interval, where one is known.
    pub interval: Option<(f64, f64)>,
}

/// The lines below an image; one that has nothing to say is empty.
///
/// # Errors
/// A sentence, if an error is asked for and there is no reference, or none of this size and layer.
pub fn lines(shown: &Shown, image: &Image, captions: &[Caption], methods: &Methods) -> Result<Vec<String>, String> {
    let mut lines = Vec::new();
    let attribute = |name: &str| image.file.attributes.get(name).and_then(|text| text.parse::<f64>().ok());
    for caption in captions {
        let name = match caption {
            Caption::Samples => {
                lines.push(attribute("neumann:samples").map_or(String::new(), |n| format!("{n} spp")));
                continue;
            }
            Caption::Seconds => {
                lines.push(attribute("renderTimeSeconds").map_or(String::new(), |s| format!("{} s", short(s))));
                continue;
            }
            Caption::Mse => "MSE",
            Caption::Rmse => "RMSE",
            Caption::Relmse => "relMSE",
        };
        let number = error(shown, image, *caption, methods)?;
        lines.push(number.map_or(String::new(), |number| format!("{name} {}", short(number.value))));
        let interval = number.and_then(|number| number.interval);
        lines.push(interval.map_or(String::new(), |(low, high)| format!("[{}, {}]", short(low), short(high))));
    }
    Ok(lines)
}

/// The error of an image; `None` for the reference itself.
pub fn error(shown: &Shown, image: &Image, caption: Caption, methods: &Methods) -> Result<Option<Number>, String> {
    let missing = "there is nothing to take errors against; give the row a `reference`, or results of an experiment with [reference]";
    let reference = shown.reference.as_ref().ok_or(missing)?;
    if image.file == *reference {
        return Ok(None);
    }
    let squared = match recorded(shown, image, caption, methods) {
        Some(number) => number,
        None => Number { value: direct(image, reference, caption, shown)?, interval: None },
    };
    let root = |x: f64| x.max(0.0).sqrt();
    Ok(Some(match caption {
        Caption::Rmse => {
            Number { value: root(squared.value), interval: squared.interval.map(|(low, high)| (root(low), root(high))) }
        }
        _ => squared,
    }))
}

/// What the report has found of a replicate, divided by their number, of a method without a bias that carries all of the light.
fn recorded(shown: &Shown, image: &Image, caption: Caption, methods: &Methods) -> Option<Number> {
    // Records are of the results' own reference, and of orders.
    let (told, label) = (shown.told.as_ref()?, image.method.as_ref()?);
    if shown.row.reference.is_some() || shown.row.layer.is_some() {
        return None;
    }
    let method = told.manifest.methods.iter().find(|method| method.label == *label)?;
    let built = methods.build(&method.method, &method.settings).ok()?;
    let scene = told.manifest.scenes.iter().find(|scene| scene.name == shown.scene)?;
    let (experiment, missing) = (&told.manifest.experiment, scene.missing.get(label)?);
    let layer = match (shown.row.order, experiment.tail) {
        (Some(order), _) => Some(Layer::Order(order)),
        (None, true) => Some(Layer::Tail),
        (None, false) => None,
    };
    if !matches!(built.bias(), Bias::None) || !carries(missing, layer, experiment.max_order) {
        return None;
    }
    let order = shown.row.order.map_or("total".to_owned(), |order| order.to_string());
    let quantity = if caption == Caption::Relmse { "relmse" } else { "mse" };
    let mut rows = told.of_label(&shown.scene, label);
    let row = rows.find(|row| row.order == order && row.quantity == quantity && row.channel == "all")?;
    let replicates = f64::from(row.replicates);
    let interval = row.interval().map(|(low, high)| (low / replicates, high / replicates));
    Some(Number { value: row.value / replicates, interval })
}

/// The squared error that an image happens to have.
fn direct(image: &Image, reference: &LayeredImage, caption: Caption, shown: &Shown) -> Result<f64, String> {
    if (reference.width, reference.height) != shown.size {
        let ((w, h), LayeredImage { width, height, .. }) = (shown.size, reference);
        return Err(format!("the reference is {width}x{height}, and the images are {w}x{h}; give one of their size"));
    }
    let name = shown.row.layer_in(reference).map_err(|why| format!("the reference {why}"))?;
    let beside = |suffix: &str| reference.layer(&format!("{name}{suffix}")).map(|layer| &layer.pixels);
    let mean = reference.layer(&name).map_or(&[][..], |layer| &layer.pixels);
    let variance = beside("_var");
    let half = if name.is_empty() { reference.layer("sum_half").map(|layer| &layer.pixels) } else { beside("_half") };
    let mut sum = 0.0;
    for (p, (x, mean)) in image.pixels().iter().zip(mean).enumerate() {
        for c in 0..3 {
            let at = |layer: &Vec<[f32; 3]>| f64::from(layer[p][c]);
            let (x, mean) = (f64::from(x[c]), f64::from(mean[c]));
            // With two halves, what is judged against is the first one, whose variance is twice that of both.
            let (judge, noise, h) = match half.map(at) {
                Some(second) if caption == Caption::Relmse => {
                    (2.0 * mean - second, 2.0 * variance.map_or(0.0, at), second)
                }
                _ => (mean, variance.map_or(0.0, at), mean),
            };
            let square = (x - judge) * (x - judge) - noise;
            sum += if caption == Caption::Relmse { square / (h * h + RELATIVE_FLOOR) } else { square };
        }
    }
    Ok(sum / (3 * image.pixels().len().max(1)) as f64)
}

#[cfg(test)]
mod tests {
    use super::super::file::Row;
    use super::*;
    use crate::export::exr::ImageLayer;
    use crate::metrics::distances;
    use std::collections::BTreeMap;

    fn file(layers: &[(&str, [f32; 3])]) -> LayeredImage {
        let layers = layers.iter().map(|&(name, value)| ImageLayer { name: name.to_owned(), pixels: vec![value; 4] });
        LayeredImage {
            width: 2,
            height: 2,
            layers: layers.collect(),
            other_channels: Vec::new(),
            attributes: BTreeMap::new(),
        }
    }

    fn shown(image: LayeredImage, reference: Option<LayeredImage>) -> Shown {
        let row: Row = toml::from_str("images = [{ file = \"a.exr\" }]").unwrap();
        let image = Image { label: "a".to_owned(), method: None, file: image, layer: String::new() };
        Shown { row, images: vec![image], large: 0, reference, told: None, scene: String::new(), size: (2, 2) }
    }

    fn told(shown: &Shown, caption: Caption) -> f64 {
        error(shown, &shown.images[0], caption, &Methods::standard()).unwrap().unwrap().value
    }

    #[test]
    fn of_a_plain_reference_errors_are_those_of_diff() {
        let (x, reference) = ([2.0, 0.0, 1.0], [1.0, 0.5, 3.0]);
        let s = shown(file(&[("", x)]), Some(file(&[("", reference)])));
        let d = distances("", &[x], &[reference], None);
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        close(told(&s, Caption::Mse), d.mse);
        close(told(&s, Caption::Rmse), d.mse.sqrt());
        close(told(&s, Caption::Relmse), d.relmse);
    }

    #[test]
    fn the_noise_of_a_reference_is_taken_out_and_its_halves_stay_apart() {
        // The first half is 2 · 1 − 1.5 = 0.5, and its variance 2 · 0.1.
        let reference = file(&[("", [1.0; 3]), ("_var", [0.1; 3]), ("sum_half", [1.5; 3])]);
        let s = shown(file(&[("", [2.0; 3])]), Some(reference));
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} {b}");
        close(told(&s, Caption::Mse), 1.0 - 0.1);
        close(told(&s, Caption::Relmse), (2.25 - 0.2) / (2.25 + 0.01));
    }

    #[test]
    fn without_a_reference_or_with_another_size_there_is_no_error() {
        let message = |s: &Shown| lines(s, &s.images[0], &[Caption::Relmse], &Methods::standard()).unwrap_err();
        assert!(message(&shown(file(&[("", [1.0; 3])]), None)).contains("give the row a `reference`"));
        let mut other = file(&[("", [1.0; 3])]);
        (other.width, other.height) = (4, 1);
        assert!(message(&shown(file(&[("", [0.5; 3])]), Some(other))).contains("4x1"));
    }
}
