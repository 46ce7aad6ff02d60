//! `neumann bench error`: how far images are from a reference, against the processor time that they took.

use super::turns::{Timed, in_turns};
use super::{tell, write_plot};
use crate::budget;
use crate::cli::ErrorArgs;
use crate::convergence::checkpoint_of_squares;
use crate::error::{Error, Status};
use crate::export::notation::brief;
use crate::export::write_atomically;
use crate::metrics::{RELATIVE_FLOOR, distances};
use crate::plot::chart::{Chart, Horizontal, Point, Series};
use crate::statistics::slopes;
use integrators::{Integrator, Methods, Render, RenderSettings};
use sampling::sampler::Role;
use scenes::{LoadOptions, Scene, Skip};
use serde::Serialize;

/// The part of the pixels that is left out of the errors without the worst.
const WORST: f64 = 0.001;

/// What errors are called, in the order of [`Judge::errors`].
const ERRORS: [(&str, &str); 4] = [
    ("mse", "mean squared error"),
    ("relmse", "relative mean squared error"),
    ("mse_without_worst", "mean squared error, the worst 0.1 % of pixels left out"),
    ("relmse_without_worst", "relative mean squared error, the worst 0.1 % of pixels left out"),
];

type Image = Vec<[f32; 3]>;

/// What was measured.
#[derive(Debug, Serialize)]
struct Report {
    scene: String,
    size: [u32; 2],
    max_order: usize,
    sampler: String,
    reference: ReferenceReport,
    rows: Vec<Row>,
    slopes: Vec<Slope>,
}

#[derive(Debug, Serialize)]
struct ReferenceReport {
    method: String,
    spp: u32,
    /// Mean squared error and relative mean squared error that it has itself, which are taken off those that it judges.
    mse: f64,
    relmse: f64,
}

/// An error of a method's images of so many samples per pixel.
#[derive(Debug, Serialize)]
struct Row {
    method: String,
    error: &'static str,
    samples: u32,
    /// Processor time of an image.
    seconds: f64,
    value: f64,
    ci_low: f64,
    ci_high: f64,
}

/// How an error falls with seconds: the line through its logarithms.
#[derive(Debug, Serialize)]
struct Slope {
    method: String,
    error: &'static str,
    slope: f64,
    ci_low: f64,
    ci_high: f64,
    #[serde(skip)]
    intercept: f64,
}

/// Renders, judges, and writes plots and JSON.
pub(super) fn errors(args: &ErrorArgs, methods: &Methods) -> Result<Status, Error> {
    let built = args.measured.build(methods, &["path", "light", "bdpt"])?;
    let scene = scenes::load(&args.scene, &LoadOptions { size: Some(args.size), skip: Skip::Unneeded })?;
    let judge = Judge::new(&scene, args, methods)?;
    let (mut rows, mut slopes) = (Vec::new(), Vec::new());
    let (times, squares) = measure(&scene, &built, &judge, args)?;
    let samples = checkpoints(args.spp);
    for (number, method) in built.iter().enumerate() {
        let of_method = number * samples.len()..(number + 1) * samples.len();
        of_errors(method.name(), &samples, &times[of_method.clone()], &squares[of_method], &mut rows, &mut slopes);
    }
    let report = Report {
        scene: scene.name.clone(),
        size: [args.size.0, args.size.1],
        max_order: args.measured.max_order,
        sampler: args.measured.sampler.clone(),
        reference: ReferenceReport {
            method: args.reference.clone(),
            spp: args.reference_spp,
            mse: judge.noise[0],
            relmse: judge.noise[1],
        },
        rows,
        slopes,
    };
    write(&report, args)?;
    tell(&report, args.measured.json, || table(&report))
}

/// Samples per pixel from 1 on, doubled until there are `most`.
fn checkpoints(most: u32) -> Vec<u32> {
    std::iter::successors(Some(1), |n: &u32| n.checked_mul(2)).take_while(|&n| n <= most).collect()
}

/// What judges images.
struct Judge {
    reference: Image,
    /// The reference with as much noise added as it has itself.
    noisy: Image,
    noise: [f64; 2],
}

impl Judge {
    /// Renders the reference, as two halves whose difference tells its noise.
    fn new(scene: &Scene, args: &ErrorArgs, methods: &Methods) -> Result<Self, Error> {
        let method = methods.build(&args.reference, &serde_json::Value::Null)?;
        let pool = budget::pool(None)?;
        let half = |seed: u64| {
            let settings = args.measured.settings(&*method, args.reference_spp / 2)?;
            let mut render = Render::new(scene, &*method, RenderSettings { seed, role: Role::Reference, ..settings })?;
            pool.install(|| render.run_replicate(&|_| {}));
            Ok::<_, Error>(image(&render))
        };
        let (a, b) = (half(args.measured.seed)?, half(args.measured.seed.wrapping_add(1))?);
        let each = |of: fn(f32, f32) -> f32| {
            a.iter().zip(&b).map(|(a, b)| std::array::from_fn(|c| of(a[c], b[c]))).collect::<Image>()
        };
        // (a − b)/2 has the variance of (a + b)/2.
        let (reference, noisy) = (each(|a, b| 0.5 * (a + b)), each(|a, _| a));
        let mut judge = Judge { reference, noisy, noise: [0.0; 2] };
        judge.noise = judge.over(&judge.noisy, 0..judge.reference.len());
        Ok(judge)
    }

    /// The errors of an image, less those of the reference at the same pixels.
    fn errors(&self, x: &Image) -> [f64; 4] {
        let all = self.over(x, 0..x.len());
        let kept = self.without_worst(x);
        let (of_kept, noise) = (self.over(x, kept.iter().copied()), self.over(&self.noisy, kept.iter().copied()));
        [all[0] - self.noise[0], all[1] - self.noise[1], of_kept[0] - noise[0], of_kept[1] - noise[1]]
    }

    /// Mean squared and relative mean squared error over some pixels.
    fn over(&self, x: &Image, pixels: impl Iterator<Item = usize> + Clone) -> [f64; 2] {
        let of = |image: &Image| pixels.clone().map(|pixel| image[pixel]).collect::<Image>();
        let found = distances("", &of(x), &of(&self.reference), None);
        [found.mse, found.relmse]
    }

    /// The pixels but those of the largest relative errors.
    fn without_worst(&self, x: &Image) -> Vec<usize> {
        let size = |&pixel: &usize| {
            let of = |c: usize| {
                let (x, reference) = (f64::from(x[pixel][c]), f64::from(self.reference[pixel][c]));
                (x - reference).powi(2) / (reference * reference + RELATIVE_FLOOR)
            };
            of(0) + of(1) + of(2)
        };
        let mut pixels: Vec<usize> = (0..x.len()).collect();
        pixels.sort_by(|a, b| size(a).total_cmp(&size(b)));
        pixels.truncate(x.len() - (x.len() as f64 * WORST).ceil() as usize);
        pixels
    }
}

/// The image of the replicate rendered last, all layers added.
fn image(render: &Render) -> Image {
    let pixels = render.window().width() as usize * render.window().height() as usize;
    let total = |pixel: usize| {
        let layers = (0..render.layers().len()).map(|layer| render.last_replicate(layer, pixel));
        layers.fold([0.0; 3], |sum, value| std::array::from_fn(|c| sum[c] + value[c])).map(|v| v as f32)
    };
    (0..pixels).map(total).collect()
}

/// Processor seconds of all methods' images, and their errors, by method and number of samples, image by image.
type Measured = (Vec<Vec<f64>>, Vec<Vec<[f64; 4]>>);

fn measure(scene: &Scene, methods: &[Box<dyn Integrator>], judge: &Judge, args: &ErrorArgs) -> Result<Measured, Error> {
    let mut list = Vec::new();
    for method in methods {
        for samples in checkpoints(args.spp) {
            let mut settings = args.measured.settings(&**method, samples)?;
            // Checkpoints are independent of one another.
            settings.instance = format!("{} {samples}", settings.instance);
            list.push(Timed::new(Render::new(scene, &**method, settings)?));
        }
    }
    let mut squares = vec![Vec::new(); list.len()];
    in_turns(&mut list, args.measured.rounds, |index, timed| squares[index].push(judge.errors(&image(&timed.render))))?;
    Ok((list.into_iter().map(|timed| timed.seconds).collect(), squares))
}

/// The rows and slopes of a method, error by error.
fn of_errors(
    method: &str,
    samples: &[u32],
    times: &[Vec<f64>],
    squares: &[Vec<[f64; 4]>],
    rows: &mut Vec<Row>,
    slopes: &mut Vec<Slope>,
) {
    for (e, (error, _)) in ERRORS.into_iter().enumerate() {
        let squares: Vec<Vec<f64>> =
            squares.iter().map(|images| images.iter().map(|image| image[e]).collect()).collect();
        for ((&samples, times), squares) in samples.iter().zip(times).zip(&squares) {
            let seconds = times.iter().sum::<f64>() / times.len() as f64;
            let point = checkpoint_of_squares(samples, seconds, 0.0, squares.clone());
            let (value, (ci_low, ci_high)) = (point.variance, point.ci);
            rows.push(Row { method: method.to_owned(), error, samples, seconds, value, ci_low, ci_high });
        }
        let points = samples.iter().zip(times).zip(&squares);
        let points: Vec<slopes::Point> = points
            .map(|((&samples, seconds), squares)| slopes::Point { samples: f64::from(samples), squares, seconds })
            .collect();
        if let Some(line) = slopes::line(&points, e as u64) {
            let (slope, intercept, (ci_low, ci_high)) = (line.slope, line.intercept, line.ci);
            slopes.push(Slope { method: method.to_owned(), error, slope, ci_low, ci_high, intercept });
        }
    }
}

/// Writes plots and JSON.
fn write(report: &Report, args: &ErrorArgs) -> Result<(), Error> {
    for (error, words) in ERRORS {
        let name = format!("{}_{error}", budget::file_name(&report.scene));
        write_plot(&args.out, &name, &chart(report, error, words))?;
    }
    let json = serde_json::to_string_pretty(report).unwrap_or_default() + "\n";
    write_atomically(&args.out.join("error.json"), json.as_bytes())?;
    Ok(())
}

fn chart(report: &Report, error: &str, words: &str) -> Chart {
    let mut methods: Vec<&str> = report.rows.iter().map(|row| row.method.as_str()).collect();
    methods.dedup();
    let series = methods.into_iter().enumerate().map(|(colour, method)| {
        let points = report.rows.iter().filter(|row| row.method == method && row.error == error);
        let slope = report.slopes.iter().find(|slope| slope.method == method && slope.error == error);
        Series {
            name: method.to_owned(),
            label: slope.map_or(method.to_owned(), |slope| format!("{method} {:.2}", slope.slope)),
            colour,
            points: points
                .map(|row| Point { x: row.seconds, y: row.value, interval: Some((row.ci_low, row.ci_high)) })
                .collect(),
            fit: slope.map(|slope| (slope.slope, slope.intercept)),
        }
    });
    Chart {
        title: brief(&report.scene.replace('_', " ")),
        horizontal: Horizontal::Log("seconds of a processor".to_owned()),
        vertical: words.to_owned(),
        series: series.collect(),
    }
}

fn table(report: &Report) -> String {
    let header = format!(
        "{:<10} {:<22} {:>8} {:>10} {:>11} {:>11} {:>11}\n",
        "method", "error", "samples", "seconds", "value", "from", "to"
    );
    let line = |row: &Row| {
        let Row { method, error, samples, seconds, value, ci_low, ci_high } = row;
        format!(
            "{method:<10} {error:<22} {samples:>8} {seconds:>10.4} {value:>11.3e} {ci_low:>11.3e} {ci_high:>11.3e}\n"
        )
    };
    let rows = report.rows.iter().map(line).collect::<String>();
    let slope = |slope: &Slope| {
        let Slope { method, error, slope, ci_low, ci_high, .. } = slope;
        format!(
            "{method:<10} {error:<22} falls with seconds to the power {slope:.2}, from {ci_low:.2} to {ci_high:.2}\n"
        )
    };
    header + &rows + &report.slopes.iter().map(slope).collect::<String>()
}
