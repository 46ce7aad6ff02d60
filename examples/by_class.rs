//! Does it pay to leave the path classes of one order to several methods? The table in `docs/composite.md`:
//!
//! ```console
//! $ cargo run --release --example by_class
//! ```
//!
//! Every order is divided by what is at the ends of its paths: whether the camera, and whether the light, is next to a mirror or glass. A method that is
//! left to one class walks as far as for all of them, and drops what belongs to the others: it costs what its orders cost, and has the variance of
//! its classes. Classes are assigned by pilots and judged by others, on other random numbers.

use integrators::lpe::Expression;
use integrators::render::request;
use integrators::{Integrator, Layer, Methods, Orders, PartSettings, PathClass, Render, RenderSettings, Window};
use neumann::choice::entrants;
use neumann::choice::pilot::{Entry, candidates, of_all};
use neumann::choice::search::Cost;
use neumann::statistics::covariances::Covariances;
use neumann::stop::Stop;
use sampling::moments::Moments;
use sampling::sampler::{Role, SamplerKind};
use scenes::{LoadOptions, Scene};

type Failure = Box<dyn std::error::Error>;

const SIZE: (u32, u32) = (32, 32);
const REPLICATES: u32 = 32;
const SAMPLES: u32 = 64;
const MAX_ORDER: usize = 5;
/// By how many standard errors of both a class's mean may lie below another method's.
const LACKS: f64 = 4.0;

/// A class: its order, and its expression.
struct Class {
    order: usize,
    expression: String,
}

/// What pilots find of a method's classes.
struct Found {
    label: String,
    means: Vec<(f64, f64)>,
    covariance: Vec<f64>,
    cost: Cost,
}

fn main() -> Result<(), Failure> {
    println!("| scene | best alone | a method an order | a method a class | promised | methods of classes |");
    println!("|---|---|---:|---:|---:|---|");
    let methods = Methods::standard();
    let classes = classes();
    for name in scenes::builtin::NAMES {
        let scene = scenes::load(name, &LoadOptions { size: Some(SIZE), ..LoadOptions::default() })?;
        let [first, second] = [pilots(&scene, &methods, &classes, 1)?, pilots(&scene, &methods, &classes, 2)?];
        let lacks = |m: usize, class: usize| -> bool {
            first.iter().any(|other| {
                let ((own, error), (seen, of_seen)) = (first[m].means[class], other.means[class]);
                seen - own > LACKS * (error + of_seen)
            })
        };
        let carries: Vec<Vec<bool>> =
            (0..first.len()).map(|m| (0..classes.len()).map(|class| !lacks(m, class)).collect()).collect();
        let of_one = |m: usize| burden(&first, &classes, &vec![m; classes.len()]);
        let whole = (0..first.len()).filter(|&m| carries[m].iter().all(|&c| c));
        let Some(single) = whole.min_by(|&a, &b| of_one(a).total_cmp(&of_one(b))) else { continue };
        let alone = vec![single; classes.len()];
        let by_order = assigned(&first, &classes, &carries, alone.clone(), |a, b| a.order == b.order);
        let by_class = assigned(&first, &classes, &carries, by_order.clone(), |a, b| a.expression == b.expression);
        let gain = |of: &[Found], assignment: &[usize]| {
            (burden(of, &classes, &alone) / burden(of, &classes, assignment)).powi(2)
        };
        let mut changed: Vec<String> = Vec::new();
        for (class, (&m, &before)) in classes.iter().zip(by_class.iter().zip(&by_order)) {
            if m != before {
                changed.push(format!("`{}` {}", class.expression, first[m].label));
            }
        }
        println!(
            "| `{name}` | `{}` | {:.2} | {:.2} | {:.2} | {} |",
            first[single].label,
            gain(&second, &by_order),
            gain(&second, &by_class),
            gain(&first, &by_class),
            changed.join(", ")
        );
    }
    Ok(())
}

/// All classes of all orders.
fn classes() -> Vec<Class> {
    let ends = ["S", "[DG]"];
    let mut classes = vec![Class { order: 0, expression: "CL".to_owned() }];
    classes.extend(ends.map(|end| Class { order: 1, expression: format!("C{end}L") }));
    for order in 2..=MAX_ORDER {
        for (camera, light) in ends.into_iter().flat_map(|camera| ends.map(|light| (camera, light))) {
            let between = ".".repeat(order - 2);
            classes.push(Class { order, expression: format!("C{camera}{between}{light}L") });
        }
    }
    classes
}

/// What is known of every method by pilots of this number.
fn pilots(scene: &Scene, methods: &Methods, classes: &[Class], number: u32) -> Result<Vec<Found>, Failure> {
    let settings = RenderSettings {
        orders: Orders::up_to(MAX_ORDER),
        tail: false,
        samples_per_replicate: SAMPLES,
        seed: 0,
        sampler: SamplerKind::Independent,
        instance: String::new(),
        role: Role::Pilot,
    };
    let layers: Vec<Layer> = (0..=MAX_ORDER).map(Layer::Order).collect();
    let part = entrants(scene, methods, &mut Vec::new())?;
    let entries: Vec<Entry> = part.iter().map(|(run, m)| Entry::new(scene, run, &**m, &settings, &layers)).collect();
    let timed = of_all(scene, &entries, &layers, (number, SAMPLES, REPLICATES), &Stop::never())?;
    let costs = candidates(scene, &entries, &timed, &layers, &Stop::never())?;
    let mut found = Vec::new();
    for ((entry, (run, method)), candidate) in entries.iter().zip(&part).zip(costs) {
        let settings = entry.of_layers(&layers, 10 + number, SAMPLES);
        let (means, covariance) = measured(scene, &**method, settings, classes)?;
        found.push(Found { label: run.label(), means, covariance, cost: candidate.cost });
    }
    Ok(found)
}

/// Image means of classes with their standard errors, and the covariances of one sample.
type Measured = (Vec<(f64, f64)>, Vec<f64>);

/// What a method's images say of the classes.
fn measured(
    scene: &Scene,
    method: &dyn Integrator,
    settings: RenderSettings,
    classes: &[Class],
) -> Result<Measured, Failure> {
    let class = |(i, class): (usize, &Class)| {
        Ok(PathClass { name: format!("class{i}"), expression: Expression::parse(&class.expression)? })
    };
    let asked = PartSettings {
        classes: classes.iter().enumerate().map(class).collect::<Result<_, Failure>>()?,
        ..PartSettings::default()
    };
    let request = request(scene, method, &settings, &asked)?;
    let series = request.layers().len();
    let window = Window::whole(SIZE.0, SIZE.1);
    let mut render = Render::of_request(scene, method, settings, window, request)?;
    let pixels = (SIZE.0 * SIZE.1) as usize;
    let mut covariances = Covariances::new(pixels, classes.len());
    let mut moments = vec![Moments::default(); classes.len()];
    for _ in 0..REPLICATES {
        render.run_replicate(&|_| {});
        covariances.push(|class, pixel| render.last_replicate(series + class, pixel));
        for (class, moments) in moments.iter_mut().enumerate() {
            let sum: f64 =
                (0..pixels).map(|pixel| render.last_replicate(series + class, pixel).iter().sum::<f64>()).sum();
            moments.push(sum / (3 * pixels) as f64);
        }
    }
    let count = classes.len();
    let entry = |at: usize| covariances.value(at / count, at % count) * f64::from(SAMPLES);
    let means = moments.iter().map(|m| (m.mean, m.variance_of_mean().sqrt())).collect();
    Ok((means, (0..count * count).map(entry).collect()))
}

/// The sum over methods of the root of variance times seconds.
fn burden(found: &[Found], classes: &[Class], assignment: &[usize]) -> f64 {
    let of = |(m, found): (usize, &Found)| {
        let own: Vec<usize> = (0..classes.len()).filter(|&class| assignment[class] == m).collect();
        if own.is_empty() {
            return 0.0;
        }
        let pairs = own.iter().flat_map(|&i| own.iter().map(move |&j| i * classes.len() + j));
        let variance: f64 = pairs.map(|at| found.covariance[at]).sum();
        let mut orders: Vec<usize> = own.iter().map(|&class| classes[class].order).collect();
        orders.dedup();
        (variance.max(0.0) * found.cost.of(&orders)).sqrt()
    };
    found.iter().enumerate().map(of).sum()
}

/// Goes down from an assignment by giving classes that belong together, or all of them in a range of orders, to another method.
fn assigned(
    found: &[Found],
    classes: &[Class],
    carries: &[Vec<bool>],
    mut assignment: Vec<usize>,
    together: impl Fn(&Class, &Class) -> bool,
) -> Vec<usize> {
    let mut least = burden(found, classes, &assignment);
    loop {
        let mut better = None;
        for (m, carries) in carries.iter().enumerate() {
            for (first, last) in (0..classes.len()).flat_map(|i| (i..classes.len()).map(move |j| (i, j))) {
                for ends_alike in [false, true] {
                    let end = |class: &Class| class.expression.chars().filter(|c| *c != '.').collect::<String>();
                    let mut changed = assignment.clone();
                    for class in first..=last {
                        let alike = !ends_alike || end(&classes[class]) == end(&classes[first]);
                        if alike || together(&classes[class], &classes[first]) {
                            changed[class] = m;
                        }
                    }
                    let whole = (0..classes.len()).all(|a| {
                        (0..classes.len()).all(|b| !together(&classes[a], &classes[b]) || changed[a] == changed[b])
                    });
                    let able = (0..classes.len()).all(|class| changed[class] != m || carries[class]);
                    if !(whole && able) {
                        continue;
                    }
                    let burden = burden(found, classes, &changed);
                    if burden < least * (1.0 - 1e-12) {
                        (least, better) = (burden, Some(changed));
                    }
                }
            }
        }
        match better {
            Some(changed) => assignment = changed,
            None => return assignment,
        }
    }
}
