//! `neumann meter`: the light that falls on parts of a scene's surface and the light that leaves them, order by order.

use crate::budget;
use crate::cli::{MeterArgs, print};
use crate::error::{Error, Status};
use crate::progress::{Progress, Verbosity, while_loading};
use crate::report::numbers::{short, with_error};
use crate::statistics::means;
use crate::stop::Stop;
use integrators::flux::{Flux, Meter};
use sampling::sampler::{Role, StreamKey};
use scenes::{LoadOptions, Region, Scene, nearest};
use serde::Serialize;
use std::collections::BTreeSet;
use std::f64::consts::PI;
use std::fmt::Write;

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    scene: String,
    walks: u64,
    replicates: u32,
    invalid: u64,
    meters: Vec<Told>,
}

/// One region.
#[derive(Serialize)]
struct Told {
    region: String,
    /// \[m²\], one side; `null` where surfaces are kept once and placed many times.
    area: Option<f64>,
    orders: Vec<Row>,
    /// Of all orders measured.
    sum: Row,
}

/// Fluxes of both sides together \[W\], and divided by the area of one \[W/m²\]; and the mean radiance, over that area and all directions on a
/// side by their cosines \[W/(m²·sr)\].
#[derive(Serialize)]
struct Row {
    order: Option<usize>,
    arriving: Number,
    irradiance: Option<Number>,
    leaving: Number,
    radiosity: Option<Number>,
    radiance: Option<Number>,
}

/// Mean of channels with its standard error and 95 % interval, and the channels.
#[derive(Clone, Copy, Serialize)]
struct Number {
    value: f64,
    error: f64,
    interval: Option<(f64, f64)>,
    rgb: [f64; 3],
}

impl Number {
    fn of(replicates: &[[f64; 3]]) -> Self {
        let n = replicates.len() as f64;
        let values: Vec<f64> = replicates.iter().map(|rgb| rgb.iter().sum::<f64>() / 3.0).collect();
        let mean = means::mean(&values);
        let rgb = [0, 1, 2].map(|c| replicates.iter().map(|rgb| rgb[c]).sum::<f64>() / n);
        let moments: sampling::moments::Moments = values.into_iter().collect();
        Self { value: mean.value, error: moments.variance_of_mean().sqrt(), interval: mean.interval, rgb }
    }

    fn over(self, area: Option<f64>) -> Option<Self> {
        let area = area.filter(|area| *area > 0.0)?;
        let interval = self.interval.map(|(low, high)| (low / area, high / area));
        Some(Self { value: self.value / area, error: self.error / area, interval, rgb: self.rgb.map(|v| v / area) })
    }
}

/// Measures the regions that are asked for.
///
/// # Errors
/// If the scene cannot be loaded, or has no such surfaces.
pub fn meter(args: &MeterArgs, verbosity: Verbosity, stop: &Stop) -> Result<Status, Error> {
    let scene = while_loading(verbosity, || Ok::<_, Error>(scenes::load(&args.scene, &LoadOptions::default())?))?;
    let regions: Result<Vec<Region>, Error> = args.on.iter().map(|label| region(&scene, &args.scene, label)).collect();
    let regions = regions?;
    if scene.facts.subsurface {
        return Err(Error::usage(format!(
            "{}: light goes through bodies here (subsurface), which walks from the emitters cannot follow; an `irradiance` camera and \
             `path` can measure what falls on a surface",
            args.scene
        )));
    }
    let pool = budget::pool(args.threads)?;
    let report = pool.install(|| measure(args, &scene, &regions, verbosity, stop))?;
    let text = match args.json {
        true => serde_json::to_string_pretty(&report).unwrap_or_default() + "\n",
        false => in_words(&report),
    };
    print(&text)?;
    Ok(if report.invalid == 0 { Status::Done } else { Status::Failed })
}

fn region(scene: &Scene, name: &str, label: &str) -> Result<Region, Error> {
    if let Some(region) = scene.region(label) {
        return Ok(region);
    }
    let known: BTreeSet<String> = scene.labels.surfaces().concat().into_iter().collect();
    let known: Vec<&str> = known.iter().map(String::as_str).collect();
    let near = nearest(label, &known).map_or(String::new(), |near| format!("; did you mean `{near}`?"));
    let all = known.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    Err(Error::usage(format!("{name}: no surface goes by `{label}`{near} (surfaces and materials: {all})")))
}

fn measure(
    args: &MeterArgs,
    scene: &Scene,
    regions: &[Region],
    verbosity: Verbosity,
    stop: &Stop,
) -> Result<Report, Error> {
    let walks = args.paths.div_ceil(u64::from(args.replicates));
    let mut progress = Progress::new(f64::from(args.replicates), verbosity);
    progress.say(format!("flux in {}", scene.name));
    let mut replicates = Vec::new();
    for replicate in 0..args.replicates {
        let key = StreamKey::new(args.seed, "flux", Role::Estimate, replicate);
        replicates.push(progress.during(1.0, |_| Flux::of(scene, regions, args.max_order, key, walks)));
        stop.check()?;
    }
    let told = |i: usize| {
        let row = |order: Option<usize>| {
            let of = |flux: fn(&Meter) -> &[[f64; 3]]| -> Number {
                let value = |replicate: &Flux| {
                    let orders = flux(&replicate.meters[i]);
                    let sum = |c: usize| orders.iter().map(|rgb| rgb[c]).sum();
                    order.map_or([sum(0), sum(1), sum(2)], |k| orders[k])
                };
                Number::of(&replicates.iter().map(value).collect::<Vec<_>>())
            };
            let (arriving, leaving) = (of(|meter| &meter.arriving), of(|meter| &meter.leaving));
            let area = regions[i].area;
            let (irradiance, radiosity) = (arriving.over(area), leaving.over(area));
            // All directions on a side, by their cosines, are π sr.
            let radiance = leaving.over(area.map(|area| PI * area));
            Row { order, arriving, irradiance, leaving, radiosity, radiance }
        };
        let orders = (0..=args.max_order).map(|k| row(Some(k))).collect();
        Told { region: args.on[i].clone(), area: regions[i].area, orders, sum: row(None) }
    };
    Ok(Report {
        scene: scene.name.clone(),
        walks: walks * u64::from(args.replicates),
        replicates: args.replicates,
        invalid: replicates.iter().flat_map(|flux| &flux.invalid).sum(),
        meters: (0..regions.len()).map(told).collect(),
    })
}

/// With its error, if that is more than rounding.
fn told(number: Number) -> String {
    if number.error > 1e-6 * number.value { with_error(number.value, Some(number.error)) } else { short(number.value) }
}

fn in_words(report: &Report) -> String {
    let mut text = format!("{}, {} walks in {} replicates\n", report.scene, report.walks, report.replicates);
    for meter in &report.meters {
        let area = meter
            .area
            .map_or("placed many times".to_owned(), |area| format!("{} m² a side, both sides together", short(area)));
        let _ = writeln!(text, "\n  {}, {area}", meter.region);
        // What falls on both sides together, by the area of one.
        let heads = ["arriving [W]", "irradiance [W/m²]", "leaving [W]", "radiosity [W/m²]", "radiance [W/(m²·sr)]"];
        let _ = writeln!(text, "  order{}", heads.map(|head| format!("{head:>23}")).concat());
        for row in meter.orders.iter().chain([&meter.sum]) {
            let order = row.order.map_or("all".to_owned(), |order| order.to_string());
            let cells = [Some(row.arriving), row.irradiance, Some(row.leaving), row.radiosity, row.radiance];
            let cell = |number: Option<Number>| number.map_or("—".to_owned(), told);
            let _ = writeln!(text, "  {order:>5}{}", cells.map(|number| format!("  {:>21}", cell(number))).concat());
        }
    }
    if report.invalid > 0 {
        let _ = writeln!(text, "\n  non-finite samples were left out: {}", report.invalid);
    }
    text
}
