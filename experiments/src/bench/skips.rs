//! `neumann bench skips`: what is saved by leaving work out that a scene, or what is asked for, does not need.
//!
//! Both sides of a pair have the same random numbers and so the same paths, but for what is left out.

use super::meshes::{Light, room};
use super::tell;
use super::turns::{Middle, Timed, in_turns};
use crate::cli::SkipsArgs;
use crate::error::{Error, Status};
use integrators::render::request;
use integrators::{Integrator, Methods, Orders, PartSettings, Render, RenderSettings, Window};
use sampling::bsdf::{Lambert, Mirror};
use sampling::math::Spectrum;
use scenes::{Scene, SceneBuilder, Skip, Work};
use serde::Serialize;

/// Samples per pixel in each round.
const SAMPLES: u32 = 4;
/// Scenes of the program that, with two rooms, need little in different ways.
const SCENES: [&str; 5] = ["cornell_box", "furnace", "veach_mis", "glass_caustic", "integrating_sphere"];

/// What was measured of a skip.
#[derive(Clone, Debug, Serialize)]
struct Row {
    skip: String,
    scene: String,
    method: String,
    /// The time of what does not skip it, relative to that of what does, each round by itself.
    ratio: Middle,
}

/// What is rendered on one side of a pair.
struct Side<'a> {
    scene: &'a Scene,
    orders: Orders,
    parts: PartSettings,
}

/// Measures, and prints a table or JSON.
pub(super) fn skips(args: &SkipsArgs, methods: &Methods) -> Result<Status, Error> {
    let built = args.measured.build(methods, &["path", "light", "bdpt"])?;
    let mut rows = Vec::new();
    for builder in builders(args)? {
        of_scene(&builder, &built, args, &mut rows)?;
    }
    of_requests(&built, args, &mut rows)?;
    tell(&rows, args.measured.json, || table(&rows))
}

fn builders(args: &SkipsArgs) -> Result<Vec<SceneBuilder>, Error> {
    let mut builders =
        SCENES.iter().map(|name| scenes::load::open(name, Some(args.size))).collect::<Result<Vec<_>, _>>()?;
    let half = Spectrum::splat(0.5);
    builders.push(room("point in a room", Lambert { albedo: half }.into(), Light::Point, args.size));
    builders.push(room("mirrors", Mirror { reflectance: half }.into(), Light::Lamp, args.size));
    Ok(builders)
}

/// All that the scene does not need.
fn of_scene(
    builder: &SceneBuilder,
    methods: &[Box<dyn Integrator>],
    args: &SkipsArgs,
    rows: &mut Vec<Row>,
) -> Result<(), Error> {
    let lean = builder.clone().build(Skip::Unneeded)?;
    let mut kept: Vec<(&str, Scene)> = vec![("none", lean.clone())];
    for work in Work::ALL.into_iter().filter(|&work| lean.needs.skips(work)) {
        kept.push((work.name(), builder.clone().build(Skip::AllBut(work))?));
    }
    if lean.environment.is_none() {
        // What is not there is not asked; so it is compared with what is there, and black.
        let mut builder = builder.clone();
        builder.environment(Spectrum::ZERO);
        kept.push(("environment", builder.build(Skip::Unneeded)?));
    }
    let all = || Orders::up_to(args.measured.max_order);
    for (name, full) in &kept {
        let side = |scene| Side { scene, orders: all(), parts: PartSettings::default() };
        pair(name, &side(&lean), &side(full), methods, args, rows)?;
    }
    Ok(())
}

/// Orders and layers that are not asked for.
fn of_requests(methods: &[Box<dyn Integrator>], args: &SkipsArgs, rows: &mut Vec<Row>) -> Result<(), Error> {
    let scene = &scenes::load::open(SCENES[0], Some(args.size))?.build(Skip::Unneeded)?;
    let plain = |orders| Side { scene, orders, parts: PartSettings::default() };
    for (name, some, all) in [("orders but 0", "0", 8), ("orders but 1", "1", 8), ("orders but 3-5", "3-5", 5)] {
        let some = Orders::parse(some, all).map_err(Error::Usage)?;
        pair(name, &plain(some), &plain(Orders::up_to(all)), methods, args, rows)?;
    }
    let orders = || Orders::up_to(args.measured.max_order);
    for (name, parts) in [
        ("layer groups", PartSettings { groups: true, ..PartSettings::default() }),
        ("layer strategies", PartSettings { strategies: true, ..PartSettings::default() }),
    ] {
        pair(name, &plain(orders()), &Side { scene, orders: orders(), parts }, methods, args, rows)?;
    }
    Ok(())
}

fn pair(
    skip: &str,
    lean: &Side,
    full: &Side,
    methods: &[Box<dyn Integrator>],
    args: &SkipsArgs,
    rows: &mut Vec<Row>,
) -> Result<(), Error> {
    let carries = |method: &dyn Integrator| lean.orders.clone().within(method.orders(lean.orders.max_order()));
    for method in methods.iter().filter(|method| carries(&***method).iter().next().is_some()) {
        let sides = [lean, full].map(|side| timed(side, &**method, args));
        let mut sides = sides.into_iter().collect::<Result<Vec<_>, _>>()?;
        in_turns(&mut sides, args.measured.rounds, |_, _| {})?;
        rows.push(Row {
            skip: skip.to_owned(),
            scene: lean.scene.name.clone(),
            method: method.name().to_owned(),
            ratio: sides[1].relative_to(&sides[0]),
        });
    }
    Ok(())
}

fn timed<'a>(side: &Side<'a>, method: &'a dyn Integrator, args: &SkipsArgs) -> Result<Timed<'a>, Error> {
    let Side { scene, orders, parts } = side;
    let settings = RenderSettings { orders: orders.clone(), ..args.measured.settings(method, SAMPLES)? };
    let request = request(scene, method, &settings, parts)?;
    let window = Window::whole(scene.camera.width(), scene.camera.height());
    Ok(Timed::new(Render::of_request(scene, method, settings, window, request)?))
}

fn table(rows: &[Row]) -> String {
    let header =
        format!("{:<18} {:<18} {:<10} {:>12} {:>7} {:>7}\n", "skip", "scene", "method", "time without", "from", "to");
    let line = |row: &Row| {
        let Row { skip, scene, method, ratio: Middle { median, low, high } } = row;
        format!("{skip:<18} {scene:<18} {method:<10} {median:>12.3} {low:>7.3} {high:>7.3}\n")
    };
    header + &rows.iter().map(line).collect::<String>()
}
