//! A scene and a method as the command line names them, ready for one image.

use crate::cli::{ImageArgs, MaxOrder};
use crate::config::{self, HIGHEST_ORDER};
use crate::error::Error;
use crate::source::no_scene;
use crate::statistics_file::Seconds;
use crate::{budget, settings};
use integrators::{Integrator, Methods, Orders, RenderSettings};
use sampling::sampler::{Role, SamplerKind};
use scenes::{Camera, Scene, Skip};
use std::time::Instant;

/// Samples per pixel where none are asked for.
pub const DEFAULT_SPP: u32 = 64;
/// The last order where neither the command line nor the scene names one.
pub const DEFAULT_MAX_ORDER: usize = 8;

/// What is rendered, and how; the number of samples is not known yet.
pub struct Subject {
    /// The scene.
    pub scene: Scene,
    /// The method.
    pub method: Box<dyn Integrator>,
    /// How.
    pub settings: RenderSettings,
    /// What loading took.
    pub seconds: Seconds,
}

impl Subject {
    /// Loads the scene and makes the method.
    ///
    /// # Errors
    /// If anything asked for is not there or makes no sense.
    pub fn load(args: &ImageArgs, methods: &Methods) -> Result<Self, Error> {
        check_series(args)?;
        let method = methods.build(&args.method, &settings::of_method(&args.set, &args.method)?)?;
        let sampler = config::sampler(&args.sampler)?;
        let filter = args.filter.as_deref().map(config::filter).transpose()?;
        let skip = if args.no_skip { Skip::Nothing } else { Skip::Unneeded };
        let start = Instant::now();
        let mut description =
            scenes::load::open(&args.scene, args.size).map_err(|error| no_scene(&args.scene, error))?;
        if let Some(filter) = filter {
            description.filter(filter);
        }
        let load = start.elapsed().as_secs_f64();
        let scene = description.build(skip).map_err(|error| scenes::load::placed(error, &args.scene))?;
        let seconds = Seconds { load, build: start.elapsed().as_secs_f64() - load, ..Seconds::default() };
        let orders = orders(args, &scene)?;
        // Who says which orders are wanted says so of the tail as well.
        let tail = (args.tail.is_some() && args.max_order != Some(MaxOrder::Auto))
            || (scene.series.tail && args.max_order.is_none() && args.orders.is_none());
        let settings = render_settings(&*method, orders, tail, args.seed, sampler);
        Ok(Self { scene, method, settings, seconds })
    }
}

/// The longer side of images of which means are all that is asked \[pixels\]; more would tell no more.
const LONGER_SIDE: u32 = 96;

/// Width and height of an image like a camera's that is no larger than its means need.
pub fn small_size(camera: &Camera) -> (u32, u32) {
    let scale = (f64::from(LONGER_SIDE) / f64::from(camera.width().max(camera.height()))).min(1.0);
    let scaled = |side: u32| ((f64::from(side) * scale).round() as u32).max(1);
    (scaled(camera.width()), scaled(camera.height()))
}

/// The settings of a render whose number of samples is not known yet.
pub fn render_settings(
    method: &dyn Integrator,
    orders: Orders,
    tail: bool,
    seed: u64,
    sampler: SamplerKind,
) -> RenderSettings {
    RenderSettings {
        orders,
        tail,
        samples_per_replicate: 1,
        seed,
        sampler,
        instance: budget::instance(method, sampler),
        role: Role::Estimate,
    }
}

/// Whether what is said of orders goes together.
fn check_series(args: &ImageArgs) -> Result<(), Error> {
    let auto = args.max_order == Some(MaxOrder::Auto);
    if auto && args.orders.is_some() {
        return Err(Error::usage(
            "--max-order auto chooses the orders itself; leave out --orders, or name the last order",
        ));
    }
    match args.tail {
        Some(Some(_)) if !auto => Err(Error::usage(
            "--tail takes a part of the image only with --max-order auto; add that, or leave out the number to have all orders",
        )),
        _ => Ok(()),
    }
}

fn orders(args: &ImageArgs, scene: &Scene) -> Result<Orders, Error> {
    let given = match args.max_order {
        Some(MaxOrder::Order(order)) => Some(order),
        // Until it is known which.
        Some(MaxOrder::Auto) => Some(0),
        None => scene.series.max_order,
    };
    let max_order = given.unwrap_or(DEFAULT_MAX_ORDER);
    if max_order > HIGHEST_ORDER {
        return Err(Error::usage(format!("--max-order {max_order} is above {HIGHEST_ORDER}")));
    }
    match &args.orders {
        Some(list) => Orders::parse(list, max_order).map_err(|e| Error::usage(format!("--orders: {e}"))),
        None => Ok(Orders::up_to(max_order)),
    }
}
