//! `neumann bsdf`: a scattering model looked at by itself.
//!
//! [`albedo`] is how much it reflects, [`polar`] its values in the plane of incidence, [`lobes`] all its directions,
//! [`ball`] what it looks like; [`gallery`] is all of that for every model.

pub mod albedo;
pub mod ball;
pub mod gallery;
pub mod lobes;
pub mod polar;

use crate::cli::{BsdfArgs, print};
use crate::error::{Error, Status, unknown};
use crate::export::write_atomically;
use crate::settings::Assignment;
use sampling::bsdf::{Bsdf, Lobes, ModelEntry, Parameter, Preset};
use sampling::{Vec3, vec3};
use scenes::SceneError;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Angles of incidence that are drawn \[degrees\].
const INCIDENCE: [f32; 4] = [0.0, 30.0, 60.0, 80.0];

/// Prints what a model is and how much it reflects, and draws it; or writes the gallery of all models.
///
/// # Errors
/// An unknown model or parameter, a value out of its domain, a folder that can't be written.
pub fn bsdf(args: &BsdfArgs) -> Result<Status, Error> {
    if args.gallery {
        let folder = args.out.clone().unwrap_or_else(|| PathBuf::from("results/bsdfs"));
        gallery::write(&folder)?;
        print(&format!("{}\n", folder.join("README.md").display()))?;
        return Ok(Status::Done);
    }
    let Some(name) = &args.model else {
        return Err(Error::usage("name a model (see `neumann list bsdfs`), or give --gallery for all of them"));
    };
    let names = || Bsdf::MODELS.iter().map(|model| model.name).collect::<Vec<_>>();
    let entry = Bsdf::model(name).ok_or_else(|| Error::usage(unknown("model", name, &names())))?;
    let bsdf = made(entry, &args.set)?;
    let folder = args.out.clone().unwrap_or_else(|| Path::new("results/bsdfs").join(name));
    let files = draw(&bsdf, name, &folder)?;
    print(
        &(described(entry, &args.set, &bsdf)
            + &files.iter().map(|file| format!("{}\n", file.display())).collect::<String>()),
    )?;
    Ok(Status::Done)
}

/// The model with these parameters, read as a scene file reads it; materials that it names may be any model's name.
fn made(entry: &ModelEntry, set: &[Assignment]) -> Result<Bsdf, Error> {
    let mut text = format!("[materials.{0}]\ntype = \"{0}\"\n", entry.name);
    for assignment in set {
        let [key] = &assignment.path[..] else {
            return Err(Error::usage(format!("--set {assignment}: a model's parameters have plain names")));
        };
        writeln!(text, "{key} = {}", assignment.value).expect("a string takes all");
    }
    for other in Bsdf::MODELS.iter().filter(|other| other.name != entry.name && is_whole(other)) {
        writeln!(text, "[materials.{0}]\ntype = \"{0}\"", other.name).expect("a string takes all");
    }
    let made = scenes::description::read_material(&text, "", entry.name);
    made.map_err(|error| Error::usage(told_of(error, entry.name, set)))
}

/// What is wrong with a model, told of the `--set` that is at fault, if one alone is.
fn told_of(error: SceneError, model: &str, set: &[Assignment]) -> String {
    let SceneError::Invalid { line, message, mend, .. } = error else { return error.to_string() };
    // The place in a file that there isn't.
    let table = format!("materials.{model}");
    let message = message.replace(&format!("{table}."), "").replace(&table, model);
    // The parameters stand in the lines after the name and the type.
    match line.and_then(|line| set.get(line.checked_sub(3)?)) {
        Some(assignment) => format!("--set {assignment}: {message}; {mend}"),
        None => format!("{model}: {message}; {mend}"),
    }
}

/// Whether nothing need be said of a model.
fn is_whole(entry: &ModelEntry) -> bool {
    entry.parameters.iter().all(|parameter| !matches!(parameter.preset, Preset::Required(_)))
}

fn described(entry: &ModelEntry, set: &[Assignment], bsdf: &Bsdf) -> String {
    let mut text = format!("{}: {}\n\n", entry.name, entry.about);
    for Parameter { name, about, domain, preset } in entry.parameters {
        let given = set.iter().rev().find(|assignment| assignment.path == [*name]);
        let preset = match preset {
            Preset::Required(example) => format!("required, such as {example}"),
            Preset::Absent => "optional".to_owned(),
            Preset::Number(x) => format!("default {x}"),
            Preset::Choice(word) => format!("default {word}"),
        };
        let given = given.map(|assignment| format!("; here {}", assignment.value)).unwrap_or_default();
        text += &format!("  {name:<19} {domain}; {preset}{given}\n  {:<19} {about}\n", "");
    }
    if bsdf.name() != entry.name {
        text += &format!("\nWith these parameters it is `{}`.\n", bsdf.name());
    }
    text += &format!(
        "\nscatters by {}\n\nangle   directional albedo (red, green, blue), ± standard error\n",
        kinds(bsdf.lobes())
    );
    for degrees in albedo::ANGLES {
        let albedo = albedo::directional(bsdf, incident(degrees));
        let [r, g, b] = albedo.mean;
        text += &format!("{degrees:>4}°   {r:.4} {g:.4} {b:.4}  ± {:.4}\n", albedo.error);
    }
    text
}

/// The kinds of scattering in words.
fn kinds(lobes: Lobes) -> String {
    let names = [
        (Lobes::DIFFUSE_REFLECTION, "diffuse reflection"),
        (Lobes::GLOSSY_REFLECTION, "glossy reflection"),
        (Lobes::DELTA_REFLECTION, "mirror reflection"),
        (Lobes::DIFFUSE_TRANSMISSION, "diffuse transmission"),
        (Lobes::GLOSSY_TRANSMISSION, "glossy transmission"),
        (Lobes::DELTA_TRANSMISSION, "clear transmission"),
    ];
    let there = names.into_iter().filter(|(kind, _)| lobes.contains(*kind)).map(|(_, name)| name);
    there.collect::<Vec<_>>().join(", ")
}

/// Writes the pictures of a model and says where they are.
fn draw(bsdf: &Bsdf, name: &str, folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let failed =
        |source| Error::Io { action: "write", path: folder.to_owned(), source, mend: "name another with --out" };
    std::fs::create_dir_all(folder).map_err(failed)?;
    let file = |what: &str| folder.join(format!("{name}_{what}"));
    let (polar, lobes, ball) = (file("polar.svg"), file("lobes.png"), file("ball.png"));
    write_atomically(&polar, polar::svg(bsdf, name).as_bytes())?;
    lobes::picture(bsdf).write(&lobes)?;
    ball::picture(bsdf)?.write(&ball)?;
    Ok(vec![polar, lobes, ball])
}

/// The direction at this angle from the normal, on the side of negative x, so that mirrored light goes to positive x.
fn incident(degrees: f32) -> Vec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    vec3(-sin, 0.0, cos)
}

/// Whether some light passes through.
fn transmits(bsdf: &Bsdf) -> bool {
    bsdf.lobes().intersects(Lobes::TRANSMISSION)
}
