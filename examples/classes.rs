//! The table of methods, path classes and scenes in `docs/methods.md`:
//!
//! ```console
//! $ cargo run --release --example classes > docs/methods.md
//! ```
//!
//! Classes are light-path expressions, disjoint and complete; every method's images are taken apart into them, and each class is judged
//! alone: by its efficiency, 1 / (variance × seconds), in units of that of path tracing.

use integrators::lpe::Expression;
use integrators::{
    Bias, Measurement, MethodError, Methods, Orders, Part, PartSettings, PathClass, Render, RenderSettings,
};
use sampling::sampler::{Role, SamplerKind};
use scenes::{LoadOptions, Scene};
use serde_json::Value;

const SCENES: [&str; 5] = ["cornell_box", "veach_mis", "glass_caustic", "mirror_caustic", "indirect_lamp"];
const CLASSES: [(&str, &str, &str); 6] = [
    ("emitted", "CL", "what the camera sees shine"),
    ("direct", "C[DG]L", "lit by emitters themselves"),
    ("indirect", "C[DG][DG]+L", "lit by what is lit, over surfaces that are no mirrors"),
    ("caustics", "C[DG]+S+L", "lit by emitters through glass and over mirrors"),
    ("mixed", "C[DG]+S+[DG].*L", "lit through glass and over mirrors by what is lit"),
    ("mirrored", "CS.*L", "all that is seen in mirrors and through glass"),
];
const SIZE: (u32, u32) = (64, 64);
const REPLICATES: u32 = 16;
const SAMPLES: u32 = 16;
const MAX_ORDER: usize = 8;

/// What a method made of a class.
#[derive(Clone, Copy)]
struct Cell {
    mean: f64,
    efficiency: f64,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("# What each method is good for\n");
    println!(
        "Made by `cargo run --release --example classes > docs/methods.md`. Cells are efficiencies, 1 / (variance × seconds), in"
    );
    println!(
        "units of those of `path`, of {SAMPLES} samples a pixel in {REPLICATES} replicates, orders 0 to {MAX_ORDER}, {}x{} pixels;",
        SIZE.0, SIZE.1
    );
    println!(
        "beside each class stands its part of the image's light. `—`: the method does not carry the class; `exact`: without any"
    );
    println!(
        "variance; (part): it carries less than half of it; *: biased. Variances of rare paths are themselves uncertain: a factor of"
    );
    println!("two between seeds is no surprise where numbers are large.");
    println!("`radiosity`, `LD*E`, is not among them: it knows orders and no classes, and its error is its mesh's");
    println!("([radiosity.md](radiosity.md)).\n");
    for (name, expression, about) in CLASSES {
        println!("- `{name}`, `{expression}`: {about}");
    }
    let methods = Methods::standard();
    for name in SCENES {
        let scene = scenes::load(name, &LoadOptions { size: Some(SIZE), ..LoadOptions::default() })?;
        table(&scene, &methods)?;
    }
    Ok(())
}

/// Prints the table of a scene: a row a method, a column a class.
fn table(scene: &Scene, methods: &Methods) -> Result<(), Box<dyn std::error::Error>> {
    let mut rows = Vec::new();
    for entry in methods.entries() {
        if let Some(cells) = cells(scene, methods, entry.name)? {
            rows.push((entry.name, entry.expression, entry.bias, cells));
        }
    }
    let of = |method: &str| rows.iter().find(|(name, ..)| *name == method).map(|(.., cells)| cells.clone());
    let (path, all) = (of("path").unwrap_or_default(), of("bdpt").unwrap_or_default());
    let light: f64 = all.iter().map(|cell| cell.mean).sum();
    println!("\n## {}\n", scene.name);
    let columns: Vec<usize> = (0..CLASSES.len()).filter(|&i| all[i].mean > 0.0).collect();
    let heads = columns.iter().map(|&i| format!(" {} {:.2} % |", CLASSES[i].0, 100.0 * all[i].mean / light));
    println!("| Method | Carries |{}", heads.collect::<String>());
    println!("|---|---|{}", "---:|".repeat(columns.len()));
    for (name, expression, bias, cells) in &rows {
        let biased = if *bias == Bias::None { "" } else { "*" };
        let told = columns.iter().map(|&i| format!(" {} |", in_words(cells[i], path[i], all[i])));
        // A bar would end the cell, even within code.
        let expression = expression.replace('|', r"\|");
        println!("| `{name}`{biased} | `{expression}` |{}", told.collect::<String>());
    }
    Ok(())
}

fn in_words(cell: Cell, path: Cell, all: Cell) -> String {
    if cell.mean == 0.0 {
        return "—".to_owned();
    }
    let part = if cell.mean < 0.5 * all.mean { " (part)" } else { "" };
    if cell.efficiency.is_infinite() {
        return format!("exact{part}");
    }
    format!("{:.2}{part}", cell.efficiency / path.efficiency)
}

/// What a method makes of every class; `None` where it cannot render the scene or tells no classes.
fn cells(scene: &Scene, methods: &Methods, name: &'static str) -> Result<Option<Vec<Cell>>, MethodError> {
    let method = methods.build(name, &Value::Null)?;
    if !method.classifies() || method.unsupported(scene).is_some() {
        return Ok(None);
    }
    let expression = |text: &str| Expression::parse(text).expect("the classes above are expressions");
    let classes = CLASSES.map(|(name, text, _)| PathClass { name: name.to_owned(), expression: expression(text) });
    let parts = PartSettings { classes: classes.to_vec(), ..PartSettings::default() };
    let settings = RenderSettings {
        orders: Orders::up_to(MAX_ORDER),
        tail: false,
        samples_per_replicate: SAMPLES,
        seed: 0,
        sampler: SamplerKind::Independent,
        instance: name.to_owned(),
        role: Role::Estimate,
    };
    let Ok(request) = integrators::render::request(scene, &*method, &settings, &parts) else { return Ok(None) };
    let window = integrators::Window::of(scene);
    let Ok(mut render) = Render::of_request(scene, &*method, settings, window, request) else { return Ok(None) };
    (0..REPLICATES).for_each(|_| render.run_replicate(&|_| {}));
    let measurement = render.finish();
    Ok(Some(CLASSES.map(|(name, ..)| cell(&measurement, name)).to_vec()))
}

fn cell(measurement: &Measurement, class: &str) -> Cell {
    let of_class = |part: &Part| matches!(part, Part::Class { name, .. } if name == class);
    let Some((layer, _)) = measurement.parts().find(|(_, part)| of_class(part)) else {
        return Cell { mean: 0.0, efficiency: 0.0 };
    };
    let mean = |channels: [f64; 3]| channels.iter().sum::<f64>() / 3.0;
    let variance = measurement.image_variance(layer).map_or(f64::NAN, mean);
    let seconds = measurement.seconds() / f64::from(measurement.replicates);
    Cell { mean: mean(measurement.image_mean(layer)), efficiency: 1.0 / (variance * seconds) }
}
