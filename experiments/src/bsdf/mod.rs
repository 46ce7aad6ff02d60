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
    let names: Vec<&str> = Bsdf::MODELS.iter().map(|model| model.name).collect();
    let entry = Bsdf::model(name).ok_or_else(|| Error::usage(unknown("model", name, &names)))?;
    let bsdf = made(entry, &args.set)?;
    let folder = args.out.clone().unwrap_or_else(|| Path::new("results/bsdfs").join(name));
    let files = draw(&bsdf, name, &folder)?;
    print(&(described(entry, &bsdf) + &files.iter().map(|file| format!("{}\n", file.display())).collect::<String>()))?;
    Ok(Status::Done)
}

/// The model with these parameters, read as a scene file reads it; materials that it names may be any model's name.
fn made(entry: &ModelEntry, set: &[Assignment]) -> Result<Bsdf, Error> {
    let mut text = format!("[materials.{0}]\ntype = \"{0}\"\n", entry.name);
    for assignment in set {
        let [key] = &assignment.path[..] else {
            return Err(Error::usage(format!(
                "--set {}: a model's parameters have plain names",
                assignment.path.join(".")
            )));
        };
        writeln!(text, "{key} = {}", assignment.value).expect("a string takes all");
    }
    for other in Bsdf::MODELS.iter().filter(|other| other.name != entry.name && is_whole(other)) {
        writeln!(text, "[materials.{0}]\ntype = \"{0}\"", other.name).expect("a string takes all");
    }
    Ok(scenes::description::read_material(&text, "--set", entry.name)?)
}

/// Whether nothing need be said of a model.
fn is_whole(entry: &ModelEntry) -> bool {
    entry.parameters.iter().all(|parameter| !matches!(parameter.preset, Preset::Required(_)))
}

fn described(entry: &ModelEntry, bsdf: &Bsdf) -> String {
    let mut text = format!("{}: {}\n\n", entry.name, entry.about);
    for Parameter { name, about, domain, preset } in entry.parameters {
        let preset = match preset {
            Preset::Required(example) => format!("required, such as {example}"),
            Preset::Absent => "optional".to_owned(),
            Preset::Number(x) => format!("default {x}"),
            Preset::Choice(word) => format!("default {word}"),
        };
        text += &format!("  {name:<16} {domain}; {preset}\n  {:<16} {about}\n", "");
    }
    text += &format!("\n{bsdf:?}\n\nangle   directional albedo (red, green, blue), ± standard error\n");
    for degrees in albedo::ANGLES {
        let albedo = albedo::directional(bsdf, incident(degrees));
        let [r, g, b] = albedo.mean;
        text += &format!("{degrees:>4}°   {r:.4} {g:.4} {b:.4}  ± {:.4}\n", albedo.error);
    }
    text
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
