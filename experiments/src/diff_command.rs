//! `neumann diff`: how far one image file is from another, layer by layer.

use crate::cli::{DiffArgs, print};
use crate::error::{Error, Status};
use crate::export::exr::{LayeredImage, read_layers};
use crate::metrics::{Distances, distances};
use std::fmt::Write;

/// What `--json` prints.
#[derive(serde::Serialize)]
struct Report {
    a: String,
    b: String,
    layers: Vec<Distances>,
    only_in_a: Vec<String>,
    only_in_b: Vec<String>,
}

/// Compares the layers that both files hold.
///
/// # Errors
/// If a file cannot be read, or the sizes differ.
pub fn diff(args: &DiffArgs) -> Result<Status, Error> {
    let (a, b) = (read_layers(&args.a)?, read_layers(&args.b)?);
    if (a.width, a.height) != (b.width, b.height) {
        return Err(Error::usage(format!(
            "{} is {}x{} and {} is {}x{}; images of the same size are needed, see --size",
            args.a.display(),
            a.width,
            a.height,
            args.b.display(),
            b.width,
            b.height
        )));
    }
    let report = Report {
        a: args.a.display().to_string(),
        b: args.b.display().to_string(),
        layers: common(&a, &b),
        only_in_a: missing(&a, &b),
        only_in_b: missing(&b, &a),
    };
    if report.layers.is_empty() {
        return Err(Error::usage(format!("{} and {} have no layer of three colours in common", report.a, report.b)));
    }
    print(&if args.json { to_json(&report) } else { table(&report) })?;
    Ok(Status::Done)
}

/// Layers of variances are no images to be compared: they tell what the images' noise is. Nor are the halves of references.
fn is_variance(name: &str) -> bool {
    name.ends_with("_var") || name.ends_with("_half")
}

fn common(a: &LayeredImage, b: &LayeredImage) -> Vec<Distances> {
    let images = a.layers.iter().filter(|layer| !is_variance(&layer.name));
    let pairs = images.filter_map(|layer| Some((layer, b.layer(&layer.name)?)));
    pairs
        .map(|(x, reference)| {
            let name = format!("{}_var", x.name);
            let variances = a.layer(&name).zip(b.layer(&name)).map(|(a, b)| (&*a.pixels, &*b.pixels));
            distances(&x.name, &x.pixels, &reference.pixels, variances)
        })
        .collect()
}

fn missing(a: &LayeredImage, b: &LayeredImage) -> Vec<String> {
    let names = a.layers.iter().map(|layer| layer.name.clone());
    names.filter(|name| !is_variance(name) && b.layer(name).is_none()).collect()
}

fn to_json(report: &Report) -> String {
    serde_json::to_string_pretty(report).unwrap_or_default() + "\n"
}

fn table(report: &Report) -> String {
    let mut text = format!(
        "{:<12} {:>12} {:>12} {:>9} {:>12} {:>12} {:>12} {:>10} {:>12}\n",
        "layer", "mse", "relmse", "smape", "mean a", "mean b", "bias", "bias/mean", "noise"
    );
    let optional = |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.4e}"));
    for d in &report.layers {
        let name = if d.layer.is_empty() { "beauty" } else { &d.layer };
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{name:<12} {:>12.5e} {:>12.5e} {:>9.6} {:>12.5e} {:>12.5e} {:>12.4e} {:>10} {:>12}",
            d.mse,
            d.relmse,
            d.smape,
            d.mean,
            d.reference_mean,
            d.bias,
            d.relative_bias.map_or("-".to_owned(), |v| format!("{:.4} %", 100.0 * v)),
            optional(d.noise)
        );
        if d.non_finite > 0 {
            let _ = writeln!(text, "{name:<12} {} pixels are not finite and were left out", d.non_finite);
        }
    }
    for (names, file) in [(&report.only_in_a, &report.a), (&report.only_in_b, &report.b)] {
        if !names.is_empty() {
            let _ = writeln!(text, "only in {file}: {}", names.join(", "));
        }
    }
    text
}
