//! What the weighting of `bdpt`'s strategies is worth, order by order: the table in `docs/estimators.md`.
//!
//! ```console
//! $ cargo run --release --example weights
//! ```
//!
//! Cells are the balance heuristic's variance over that of the other, with 95 % intervals: means over batches of replicates, each batch with a
//! seed of its own for all, and the error of the logarithm of their ratio by the batches' spread. Weightings take turns, batch by batch.

use integrators::{Layer, Methods, Orders, Render, RenderSettings};
use sampling::moments::Moments;
use sampling::sampler::{Role, SamplerKind};
use scenes::{LoadOptions, Scene};
use serde_json::json;

type Failure = Box<dyn std::error::Error>;

const WEIGHTINGS: [&str; 5] = ["balance", "power", "maximum", "variance_aware", "optimal"];
const SIZE: (u32, u32) = (48, 48);
const MAX_ORDER: usize = 6;
const BATCHES: u64 = 8;
const REPLICATES: u32 = 16;
const SAMPLES: u32 = 16;
/// The 97.5 % quantile of Student's distribution of 7 degrees of freedom.
const QUANTILE: f64 = 2.365;

fn main() -> Result<(), Failure> {
    let orders: Vec<String> = (0..=MAX_ORDER).map(|k| k.to_string()).collect();
    println!("| scene | `mis` | {} | sum |", orders.join(" | "));
    println!("|---|---|{}", "---:|".repeat(MAX_ORDER + 2));
    for name in ["cornell_box", "veach_mis", "glass_caustic", "mirror_caustic", "indirect_lamp"] {
        let scene = scenes::load(name, &LoadOptions { size: Some(SIZE), ..LoadOptions::default() })?;
        // By weighting and order, the sum last: moments over batches.
        let mut found = vec![vec![Moments::default(); MAX_ORDER + 2]; WEIGHTINGS.len()];
        for batch in 0..BATCHES {
            for (found, mis) in found.iter_mut().zip(WEIGHTINGS) {
                let variances = variances(&scene, mis, batch)?;
                found.iter_mut().zip(variances).for_each(|(moments, variance)| moments.push(variance));
            }
        }
        for (mis, of_mis) in WEIGHTINGS.iter().zip(&found).skip(1) {
            let cells: Vec<String> = found[0].iter().zip(of_mis).map(|(balance, own)| gain(balance, own)).collect();
            println!("| `{name}` | `{mis}` | {} |", cells.join(" | "));
        }
    }
    Ok(())
}

/// The image's variance of every order, and of their sum, in a batch.
fn variances(scene: &Scene, mis: &str, batch: u64) -> Result<Vec<f64>, Failure> {
    let method = Methods::standard().build("bdpt", &json!({"mis": mis}))?;
    let settings = RenderSettings {
        orders: Orders::up_to(MAX_ORDER),
        tail: false,
        samples_per_replicate: SAMPLES,
        seed: batch,
        sampler: SamplerKind::Independent,
        instance: mis.to_owned(),
        role: Role::Estimate,
    };
    let mut render = Render::new(scene, method.as_ref(), settings)?;
    (0..REPLICATES).for_each(|_| render.run_replicate(&|_| {}));
    let measured = render.finish();
    let of_layer = |layer: usize| -> f64 {
        (0..measured.pixels()).filter_map(|pixel| measured.variance(layer, pixel)).flatten().sum()
    };
    let mut variances: Vec<f64> = (0..=MAX_ORDER)
        .map(|k| measured.layers.iter().position(|layer| *layer == Layer::Order(k)).map_or(0.0, of_layer))
        .collect();
    let pixels = measured.pixels() as f64;
    variances.push(measured.total_variance.map_or(0.0, |variance| pixels * variance.iter().sum::<f64>()));
    Ok(variances)
}

/// The ratio of two means, with its interval.
fn gain(balance: &Moments, own: &Moments) -> String {
    if balance.mean == 0.0 || own.mean == 0.0 {
        return "—".to_owned();
    }
    let squared = |m: &Moments| m.variance_of_mean() / m.mean.powi(2);
    let (ratio, spread) = (balance.mean / own.mean, QUANTILE * (squared(balance) + squared(own)).sqrt());
    format!("{ratio:.2} [{:.2}, {:.2}]", ratio * (-spread).exp(), ratio * spread.exp())
}
