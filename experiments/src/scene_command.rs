//! `neumann scene`: what a scene holds, what it needs, what will be skipped, and what its importer approximated.

use crate::choice;
use crate::cli::{SceneArgs, print};
use crate::error::{Error, Status};
use crate::path_class;
use crate::progress::{Verbosity, while_loading};
use crate::source::no_scene;
use crate::subject::{DEFAULT_MAX_ORDER, render_settings};
use integrators::composite::Composite;
use integrators::{Methods, Orders};
use sampling::sampler::SamplerKind;
use scenes::import::translation::{Note, NoteKind};
use scenes::{Crop, Needs, Scene, Skip};
use std::collections::BTreeSet;
use std::fmt::Write;

/// What `--json` prints.
#[derive(serde::Serialize)]
struct Report<'a> {
    scene: &'a str,
    hash: &'a str,
    width: u32,
    height: u32,
    /// The light groups, and how many emitters each has.
    light_groups: Vec<(String, usize)>,
    /// What light-path expressions may call surfaces.
    labels: Vec<String>,
    emitter_choice: &'a str,
    emitter_points: &'a str,
    camera: String,
    crop: Option<[u32; 4]>,
    needs: &'a Needs,
    instances: Instances,
    skipped: Vec<&'static str>,
    methods: Vec<Support>,
    /// What the importer found, and what it became.
    mapped: Vec<String>,
    notes: &'a [String],
}

/// What is kept once and placed many times.
#[derive(serde::Serialize)]
struct Instances {
    /// Instances of groups.
    count: usize,
    /// Triangles that are kept.
    triangles_kept: usize,
    /// Triangles that rays meet, those of a group once for each of its instances.
    triangles_placed: u64,
}

/// What a method can do in the scene.
#[derive(serde::Serialize)]
struct Support {
    method: &'static str,
    /// What it carries, as a light-path expression.
    carries: String,
    /// The bias that it has, if any.
    bias: Option<&'static str>,
    unsupported: Option<String>,
    missing_light: Vec<String>,
}

/// Describes a scene.
///
/// # Errors
/// If the scene cannot be loaded.
pub fn scene(args: &SceneArgs, registry: &Methods, verbosity: Verbosity) -> Result<Status, Error> {
    let (scene, found) = while_loading(verbosity, || {
        let (builder, found) =
            scenes::load::open_with_notes(&args.scene, None).map_err(|error| no_scene(&args.scene, error))?;
        let built = builder.build(Skip::Unneeded);
        built.map(|scene| (scene, found)).map_err(|error| Error::from(scenes::load::placed(error, &args.scene)))
    })?;
    let report = describe(&scene, &found, registry)?;
    let text = match args.json {
        true => serde_json::to_string_pretty(&report).unwrap_or_default() + "\n",
        false => in_words(&report),
    };
    print(&text)?;
    // Of a translation it is known which notes matter; all others tell of what was approximated.
    let harmless = found.iter().filter(|note| matches!(note.kind, NoteKind::Ignored | NoteKind::Added)).count();
    let approximated = scene.notes.len() - harmless;
    if args.strict && approximated > 0 {
        let message = format!("{}: not all is as it was (approximations: {approximated})", args.scene);
        return Err(Error::usage(format!("{message}; mend them in the scene, or leave out --strict")));
    }
    Ok(Status::Done)
}

fn describe<'a>(scene: &'a Scene, found: &[Note], registry: &Methods) -> Result<Report<'a>, Error> {
    let mut methods = Vec::new();
    for entry in registry.entries() {
        let method = registry.build(entry.name, &serde_json::Value::Null)?;
        let mut unsupported = method.unsupported(scene);
        if Composite::is_open(&*method) {
            let orders = Orders::up_to(DEFAULT_MAX_ORDER);
            let settings = render_settings(&*method, orders, false, 0, SamplerKind::default());
            unsupported = choice::check(scene, registry, &settings).err().map(|e| e.to_string());
        }
        methods.push(Support {
            method: entry.name,
            carries: method.expression().to_owned(),
            bias: method.bias().label(),
            unsupported,
            missing_light: path_class::missing(&*method, scene),
        });
    }
    let counts = scene.counts();
    Ok(Report {
        scene: &scene.name,
        hash: &scene.hash,
        width: scene.camera.width(),
        height: scene.camera.height(),
        light_groups: scene.labels.groups().into_iter().map(|group| (group.name, group.emitters.len())).collect(),
        labels: scene.labels.surfaces().concat().into_iter().collect::<BTreeSet<_>>().into_iter().collect(),
        emitter_choice: scene.choice_rule.name(),
        emitter_points: scene.point_rule.name(),
        camera: scene.camera.to_string(),
        crop: scene.crop.map(|Crop { x, y, width, height }| [x, y, width, height]),
        needs: &scene.needs,
        instances: Instances {
            count: counts.instances,
            triangles_kept: counts.triangles,
            triangles_placed: counts.placed_triangles,
        },
        skipped: scene.needs.skipped(),
        methods,
        mapped: found.iter().filter(|note| note.kind == NoteKind::Mapped).map(Note::to_string).collect(),
        notes: &scene.notes,
    })
}

/// The first of some names, and how many more there are.
fn listed(names: impl ExactSizeIterator<Item = String>) -> String {
    const SHOWN: usize = 12;
    let more = names.len().saturating_sub(SHOWN);
    let shown = names.take(SHOWN).collect::<Vec<_>>().join(", ");
    match more {
        0 if shown.is_empty() => "none".to_owned(),
        0 => shown,
        _ => format!("{shown}, and {more} more"),
    }
}

fn instances(instances: &Instances) -> String {
    match instances.count {
        0 => "none".to_owned(),
        count => format!("{count}; {} triangles kept, {} placed", instances.triangles_kept, instances.triangles_placed),
    }
}

fn in_words(report: &Report) -> String {
    let needs = report.needs;
    let yes = |flag: bool| if flag { "yes" } else { "no" };
    let rows = [
        ("size", format!("{}x{}", report.width, report.height)),
        (
            "crop",
            report.crop.map_or("none".to_owned(), |[x, y, width, height]| format!("{width}x{height} at {x}, {y}")),
        ),
        ("camera", report.camera.clone()),
        ("primitives", needs.primitives.to_string()),
        ("instances", instances(&report.instances)),
        ("emitters", needs.emitters.to_string()),
        ("light groups", listed(report.light_groups.iter().map(|(name, count)| format!("{name} ({count})")))),
        ("labels", listed(report.labels.iter().cloned())),
        ("emitter choice", report.emitter_choice.to_owned()),
        ("emitter points", report.emitter_points.to_owned()),
        ("environment", yes(needs.environment).to_owned()),
        ("textures", yes(needs.textures).to_owned()),
        ("masks", yes(needs.masks).to_owned()),
        ("subsurface", yes(needs.subsurface).to_owned()),
        ("delta lobes", yes(needs.delta_lobes).to_owned()),
        ("delta emitters", yes(needs.delta_emitters).to_owned()),
        ("hittable emitters", yes(needs.hittable_emitters).to_owned()),
        ("skipped", if report.skipped.is_empty() { "nothing".to_owned() } else { report.skipped.join(", ") }),
        ("hash", report.hash.to_owned()),
    ];
    let mut text = format!("{}\n", report.scene);
    // Writing to a string cannot fail.
    for (key, value) in rows {
        let _ = writeln!(text, "  {key:<18} {value}");
    }
    for support in &report.methods {
        let verdict = match (&support.unsupported, support.missing_light.as_slice()) {
            (Some(reason), _) => format!("cannot render it: {reason}"),
            (None, []) => "carries all its light".to_owned(),
            (None, missing) => format!("carries {}, misses {}", support.carries, missing.join("; ")),
        };
        let bias = support.bias.map_or(String::new(), |bias| format!("; {bias}"));
        let _ = writeln!(text, "  {:<18} {verdict}{bias}", support.method);
    }
    for note in &report.mapped {
        let _ = writeln!(text, "  {note}");
    }
    for note in report.notes {
        let _ = writeln!(text, "  note: {note}");
    }
    text
}
