//! `neumann spectrum`: how much light each order carries in a scene, how fast orders fall, and what is left beyond the last.

use crate::budget;
use crate::cli::{SpectrumArgs, print};
use crate::error::{Error, Status};
use crate::path_class;
use crate::progress::{Progress, Verbosity, while_loading};
use crate::report::numbers::{percent, short};
use crate::statistics::Estimate;
use crate::statistics::series::{self, Series};
use crate::stop::Stop;
use crate::subject::{render_settings, small_size};
use crate::truncation::series_of;
use integrators::flux::Flux;
use integrators::{Integrator, Methods, Orders, Render, RenderSettings};
use sampling::sampler::{Role, SamplerKind, StreamKey};
use scenes::{Emitter, LoadOptions, Scene};
use serde::Serialize;
use serde_json::Value;
use std::fmt::Write;

/// What is rendered of the image; what it loses is told.
const METHOD: &str = "bdpt";

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    scene: String,
    replicates: u32,
    accuracy: f64,
    /// Flux leaving surfaces \[W\], with what it cannot exceed.
    flux: Spread,
    /// Of the flux, the estimate of the spectral radius of `T`: the root of the order after the next over an order.
    spectral_radius: Option<Radius>,
    /// Mean radiance of the image \[W/(m²·sr)\].
    image: Spread,
    /// The largest albedo, if it is known for certain.
    largest_albedo: Option<f64>,
    /// What the flux of each order cannot exceed \[W\].
    bounds: Option<Vec<f64>>,
    /// What the flux of all orders beyond the last cannot exceed \[W\].
    bound_beyond: Option<f64>,
    /// The light that the image lacks, a path class a line.
    missing_light: Vec<String>,
    invalid: u64,
}

/// A quantity of every order; estimates are a number and the ends of its 95 % interval.
#[derive(Serialize)]
struct Spread {
    orders: Vec<Row>,
    beyond: Option<Number>,
    total: Option<Number>,
    /// The lowest order beyond which no more than the accuracy is left.
    order_needed: Option<usize>,
}

#[derive(Serialize)]
struct Row {
    order: usize,
    power: Number,
    /// The next order over this one.
    ratio: Option<Number>,
    /// Root of the order after the next over this one, in the channel in which it is largest.
    root: Option<Number>,
}

#[derive(Serialize)]
struct Radius {
    /// It is of this order and the one after the next.
    order: usize,
    channel: &'static str,
    #[serde(flatten)]
    estimate: Number,
}

#[derive(Clone, Copy, Serialize)]
struct Number {
    value: f64,
    interval: Option<(f64, f64)>,
}

impl From<Estimate> for Number {
    fn from(estimate: Estimate) -> Self {
        Self { value: estimate.value, interval: estimate.interval }
    }
}

impl From<series::Radius> for Radius {
    fn from(radius: series::Radius) -> Self {
        let channel = ["red", "green", "blue"][radius.channel];
        Self { order: radius.order, channel, estimate: radius.estimate.into() }
    }
}

/// Measures a scene.
///
/// # Errors
/// If it cannot be loaded, or holds bodies that light goes through.
pub fn spectrum(args: &SpectrumArgs, methods: &Methods, verbosity: Verbosity, stop: &Stop) -> Result<Status, Error> {
    let scene = while_loading(verbosity, || load(args))?;
    let method = methods.build(METHOD, &Value::Null)?;
    if scene.facts.subsurface {
        return Err(Error::usage(format!(
            "{}: light goes through bodies here (subsurface), which walks from the emitters cannot follow; `neumann run` with several \
             max_order shows how orders fall in the image",
            args.scene
        )));
    }
    let pool = budget::pool(args.threads)?;
    let report = pool.install(|| measure(args, &scene, &*method, verbosity, stop))?;
    let text = match args.json {
        true => serde_json::to_string_pretty(&report).unwrap_or_default() + "\n",
        false => in_words(&report),
    };
    print(&text)?;
    Ok(if report.invalid == 0 { Status::Done } else { Status::Failed })
}

fn load(args: &SpectrumArgs) -> Result<Scene, Error> {
    let loaded = scenes::load(&args.scene, &LoadOptions::default())?;
    let size = small_size(&loaded.camera);
    if size == (loaded.camera.width(), loaded.camera.height()) {
        return Ok(loaded);
    }
    drop(loaded);
    Ok(scenes::load(&args.scene, &LoadOptions { size: Some(size), ..LoadOptions::default() })?)
}

fn measure(
    args: &SpectrumArgs,
    scene: &Scene,
    method: &dyn Integrator,
    verbosity: Verbosity,
    stop: &Stop,
) -> Result<Report, Error> {
    let (last, replicates) = (args.max_order, args.replicates);
    let walks = args.paths.div_ceil(u64::from(replicates));
    let mut progress = Progress::new(2.0 * f64::from(replicates), verbosity);
    let mut flux = Vec::new();
    let mut invalid = 0;
    progress.say(format!("flux in {}", scene.name));
    for replicate in 0..replicates {
        let key = StreamKey::new(args.seed, "flux", Role::Estimate, replicate);
        let found = progress.during(1.0, |_| Flux::of(scene, &[], last, key, walks));
        invalid += found.invalid.iter().sum::<u64>();
        flux.push(found.orders);
        stop.check()?;
    }
    progress.say(format!("{METHOD} in {}", scene.name));
    let settings = render_settings(method, Orders::up_to(last), false, args.seed, SamplerKind::Independent);
    let samples_per_replicate = args.spp.div_ceil(replicates);
    let mut render = Render::new(scene, method, RenderSettings { samples_per_replicate, ..settings })?;
    for _ in 0..replicates {
        progress.during(1.0, |report| render.run_replicate(report));
        stop.check()?;
    }
    let image = render.finish();
    invalid += image.invalid.iter().sum::<u64>();
    let (flux, image) = (Series::new(flux), series_of(&image));
    let albedo = scene.largest_albedo().map(|albedo| f64::from(albedo.max_component()));
    // Of what varies over a surface the power is a mean of many points, and not certain.
    let varies = |emitter: &Emitter| matches!(emitter, Emitter::Area(area) if !area.emission.radiance.is_constant());
    let albedo = albedo.filter(|_| !scene.emitters.iter().any(varies));
    let emitted: f64 = scene.emitters.iter().map(Emitter::power).sum();
    let bound = |k: usize| albedo.map(|rho| rho.powi(k as i32) * emitted);
    let beyond = albedo.map(|rho| rho.powi(last as i32 + 1) * emitted / (1.0 - rho));
    Ok(Report {
        scene: scene.name.clone(),
        replicates,
        accuracy: args.accuracy,
        spectral_radius: flux.radius().map(Radius::from),
        flux: Spread::of(&flux, args.accuracy),
        image: Spread::of(&image, args.accuracy),
        largest_albedo: albedo,
        bounds: (0..=last).map(bound).collect(),
        bound_beyond: beyond.filter(|bound| bound.is_finite()),
        missing_light: path_class::missing(method, scene),
        invalid,
    })
}

impl Spread {
    fn of(series: &Series, accuracy: f64) -> Self {
        let last = series.last();
        let row = |order: usize| Row {
            order,
            power: series.power(order).into(),
            ratio: (order < last).then(|| series.ratio(order)).flatten().map(Number::from),
            root: (order + 2 <= last).then(|| series.largest_root(order)).flatten().map(|root| root.estimate.into()),
        };
        Self {
            orders: (0..=last).map(row).collect(),
            beyond: series.beyond(last).map(Number::from),
            total: series.total().map(Number::from),
            order_needed: series.order_for(accuracy),
        }
    }
}

fn with_interval(number: Option<Number>, unit: &str) -> String {
    match number {
        None => "not known".to_owned(),
        Some(Number { value: 0.0, .. }) => "none found".to_owned(),
        Some(Number { value, interval: Some((low, high)) }) => {
            format!("{}{unit} ({} to {})", short(value), short(low), short(high))
        }
        Some(Number { value, interval: None }) => format!("{}{unit}", short(value)),
    }
}

fn in_words(report: &Report) -> String {
    let last = report.flux.orders.len() - 1;
    let mut text = format!("{}, orders 0 to {last}, {} replicates\n", report.scene, report.replicates);
    text += "  order      flux [W]      next     root    at most         image      next     root\n";
    for (k, (flux, image)) in report.flux.orders.iter().zip(&report.image.orders).enumerate() {
        let bound = report.bounds.as_ref().map_or("none".to_owned(), |bounds| short(bounds[k]));
        let cells = [&flux.ratio, &flux.root, &image.ratio, &image.root]
            .map(|cell| cell.map_or(String::new(), |n| format!("{:.4}", n.value)));
        let [a, b, c, d] = cells;
        let _ = writeln!(
            text,
            "  {k:>5} {:>13} {a:>9} {b:>8} {bound:>10} {:>13} {c:>9} {d:>8}",
            short(flux.power.value),
            short(image.power.value)
        );
    }
    for (name, spread, unit) in [("flux", &report.flux, " W"), ("image", &report.image, "")] {
        let _ = writeln!(text, "  {name}: {}", told(spread, unit, last, report.accuracy));
    }
    let radius = report.spectral_radius.as_ref().map_or("none: nothing is scattered twice".to_owned(), |radius| {
        let (from, to) = (radius.order, radius.order + 2);
        format!(
            "at least about {}, by orders {from} and {to} in {}",
            with_interval(Some(radius.estimate), ""),
            radius.channel
        )
    });
    let _ = writeln!(text, "  spectral radius of T: {radius}");
    let bound = match (report.bound_beyond, report.largest_albedo) {
        (Some(bound), Some(albedo)) => {
            format!("{} W, since no surface scatters more than {} of the light", short(bound), percent(albedo))
        }
        _ => "none: some albedo, or the power of some emitter, is not known for certain".to_owned(),
    };
    let _ = writeln!(text, "  bound of the flux beyond order {last}: {bound}");
    for missing in &report.missing_light {
        let _ = writeln!(text, "  the image is of {METHOD}, which cannot carry here: {missing}");
    }
    if report.invalid > 0 {
        let _ = writeln!(text, "  non-finite samples were left out: {}", report.invalid);
    }
    text
}

fn told(spread: &Spread, unit: &str, last: usize, accuracy: f64) -> String {
    let needed = match spread.order_needed {
        Some(order) => format!("orders 0 to {order} have all but {}", percent(accuracy)),
        None => format!("all but {} of it needs more than {last} orders, or more samples to tell", percent(accuracy)),
    };
    format!(
        "all orders {}, beyond order {last} {}; {needed}",
        with_interval(spread.total, unit),
        with_interval(spread.beyond, unit)
    )
}
