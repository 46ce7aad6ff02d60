//! `neumann bench scaling`: what time depends on.

use super::meshes::ball_in_a_room;
use super::turns::{Middle, in_turns};
use super::{tell, write_plot};
use crate::cli::{ScalingArgs, ScalingPart};
use crate::error::{Error, Status};
use crate::machine::resident_memory;
use crate::plot::chart::{Chart, Horizontal, Point, Series};
use integrators::{Integrator, Methods};
use scenes::{LoadOptions, Scene, Skip};
use serde::Serialize;
use std::path::Path;
use std::time::Instant;

mod threads;

/// Samples per pixel of which the time is compared, at [`SIZE`].
const SAMPLES: [u32; 4] = [1, 4, 16, 64];
/// Image sides that are compared, at one sample per pixel \[pixels\].
const SIDES: [u32; 6] = [32, 64, 128, 256, 512, 1024];
/// Image size where it does not vary.
const SIZE: (u32, u32) = (64, 64);
/// Rows of the bumpy balls: about 10², 10³, … 10⁷ triangles.
const BALLS: [usize; 6] = [8, 23, 71, 224, 708, 2237];

/// What was measured.
#[derive(Debug, Default, Serialize)]
struct Scaling {
    #[serde(skip_serializing_if = "Vec::is_empty")]
    threads: Vec<threads::Row>,
    /// By samples per pixel.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    samples: Vec<Row>,
    /// By pixels.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    size: Vec<Row>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    triangles: Vec<TrianglesRow>,
}

/// Time of a sample of a method, by how much there is of something.
#[derive(Clone, Debug, Serialize)]
struct Row {
    method: String,
    count: u64,
    nanoseconds_per_sample: Middle,
}

/// Time of a sample in a scene of so many triangles, and what the scene takes.
#[derive(Clone, Debug, Serialize)]
struct TrianglesRow {
    #[serde(flatten)]
    time: Row,
    /// Seconds (wall time) from a mesh to a scene.
    build_seconds: f64,
    /// By how much the memory of the process has grown since before there was a mesh; unknown on some systems, and of small scenes.
    bytes_per_triangle: Option<f64>,
}

/// Measures, and prints tables or JSON.
pub(super) fn scaling(args: &ScalingArgs, methods: &Methods) -> Result<Status, Error> {
    let built = args.measured.build(methods, &["path", "light", "bdpt"])?;
    let asked = |part| args.parts.is_empty() || args.parts.contains(&part);
    let load = |size| scenes::load(&args.scene, &LoadOptions { size: Some(size), skip: Skip::Unneeded });
    let mut found = Scaling::default();
    // First, while the memory is that of nothing else.
    if asked(ScalingPart::Triangles) {
        for n in BALLS.into_iter().filter(|&n| n == BALLS[0] || 2 * n * (n - 1) <= args.triangles as usize * 11 / 10) {
            found.triangles.extend(by_triangles(n, &built, args)?);
        }
    }
    if asked(ScalingPart::Threads) {
        found.threads = threads::by_threads(&load(args.size)?, &built, args)?;
    }
    if asked(ScalingPart::Samples) {
        let scene = load(SIZE)?;
        let variants = SAMPLES.map(|samples| (u64::from(samples), &scene, samples));
        found.samples = by_count(&variants, &built, args)?;
    }
    if asked(ScalingPart::Size) {
        let scenes = SIDES.map(|side| load((side, side))).into_iter().collect::<Result<Vec<_>, _>>()?;
        let pixels = |scene: &Scene| u64::from(scene.camera.width()) * u64::from(scene.camera.height());
        let variants: Vec<_> = scenes.iter().map(|scene| (pixels(scene), scene, 1)).collect();
        found.size = by_count(&variants, &built, args)?;
    }
    if let Some(folder) = &args.out {
        draw(&found, folder)?;
    }
    tell(&found, args.measured.json, || tables(&found))
}

/// Draws the time of a sample against what it may depend on.
fn draw(found: &Scaling, folder: &Path) -> Result<(), Error> {
    let of_triangles: Vec<Row> = found.triangles.iter().map(|row| row.time.clone()).collect();
    for (file, what, rows) in [
        ("scaling_samples", "samples per pixel", &found.samples),
        ("scaling_size", "pixels", &found.size),
        ("scaling_triangles", "triangles", &of_triangles),
    ] {
        if !rows.is_empty() {
            write_plot(folder, file, &chart(what, rows))?;
        }
    }
    Ok(())
}

fn chart(what: &str, rows: &[Row]) -> Chart {
    let mut methods: Vec<&str> = rows.iter().map(|row| row.method.as_str()).collect();
    methods.sort();
    methods.dedup();
    let series = methods.into_iter().enumerate().map(|(colour, method)| {
        let points = rows.iter().filter(|row| row.method == method).map(|row| {
            let Middle { median, low, high } = row.nanoseconds_per_sample;
            Point { x: row.count as f64, y: median, interval: Some((low, high)) }
        });
        Series { name: method.to_owned(), label: method.to_owned(), colour, points: points.collect(), fit: None }
    });
    Chart {
        title: format!("Time of a sample by {what}"),
        horizontal: Horizontal::Log(what.to_owned()),
        vertical: "processor time of a sample [ns]".to_owned(),
        series: series.collect(),
    }
}

/// Each method in scenes with samples per pixel, whose count of something is told; all counts in turn.
fn by_count(
    variants: &[(u64, &Scene, u32)],
    methods: &[Box<dyn Integrator>],
    args: &ScalingArgs,
) -> Result<Vec<Row>, Error> {
    let mut rows = Vec::new();
    for method in methods {
        let timed = variants.iter().map(|&(_, scene, samples)| args.measured.timed(scene, &**method, samples));
        let mut list = timed.collect::<Result<Vec<_>, Error>>()?;
        in_turns(&mut list, args.measured.rounds, |_, _| {})?;
        rows.extend(variants.iter().zip(&list).map(|(&(count, ..), timed)| Row {
            method: method.name().to_owned(),
            count,
            nanoseconds_per_sample: timed.nanoseconds(),
        }));
    }
    Ok(rows)
}

fn by_triangles(n: usize, methods: &[Box<dyn Integrator>], args: &ScalingArgs) -> Result<Vec<TrianglesRow>, Error> {
    let (before, start) = (resident_memory(), Instant::now());
    let scene = ball_in_a_room(n, SIZE)?;
    let build_seconds = start.elapsed().as_secs_f64();
    let triangles = scene.counts().triangles as u64;
    let grown = before.and_then(|before| resident_memory()?.checked_sub(before));
    // A page of memory more or less is much for few.
    let bytes_per_triangle = grown.filter(|_| triangles >= 100_000).map(|bytes| bytes as f64 / triangles as f64);
    let rows = by_count(&[(triangles, &scene, 4)], methods, args)?;
    Ok(rows.into_iter().map(|time| TrianglesRow { time, build_seconds, bytes_per_triangle }).collect())
}

fn tables(found: &Scaling) -> String {
    let mut text = String::new();
    if !found.threads.is_empty() {
        text += &threads::table(&found.threads);
    }
    for (what, rows) in [("samples per pixel", &found.samples), ("pixels", &found.size)] {
        if !rows.is_empty() {
            text += &format!("{:<10} {what:>18} {:>10} {:>10} {:>10}\n", "method", "ns/sample", "from", "to");
            text.extend(rows.iter().map(|row| line(row) + "\n"));
        }
    }
    if !found.triangles.is_empty() {
        text += &format!(
            "{:<10} {:>18} {:>10} {:>10} {:>10} {:>9} {:>15}\n",
            "method", "triangles", "ns/sample", "from", "to", "build [s]", "bytes/triangle"
        );
        text.extend(found.triangles.iter().map(|row| {
            let bytes = row.bytes_per_triangle.map_or("-".to_owned(), |bytes| format!("{bytes:.0}"));
            format!("{} {:>9.3} {bytes:>15}\n", line(&row.time), row.build_seconds)
        }));
    }
    text
}

fn line(row: &Row) -> String {
    let Middle { median, low, high } = row.nanoseconds_per_sample;
    format!("{:<10} {:>18} {median:>10.0} {low:>10.0} {high:>10.0}", row.method, row.count)
}
