//! The gallery of all models: a page in Markdown, and the pictures it shows.

use super::{albedo, draw, incident, is_whole};
use crate::error::Error;
use crate::export::notation::enumerated;
use crate::export::write_atomically;
use sampling::bsdf::{Argument, Arguments, Bsdf, Domain, ModelEntry, Parameter, Preset};
use std::path::Path;

/// Angles at which albedos are told \[degrees\].
const ANGLES: [f32; 3] = [0.0, 60.0, 85.0];

/// Writes the gallery into a folder, which is created.
///
/// # Errors
/// If a file can't be written.
pub fn write(folder: &Path) -> Result<(), Error> {
    let by_example = Bsdf::MODELS.iter().filter(|entry| preset(entry).is_none());
    let by_example = enumerated(by_example.map(|entry| format!("`{}`", entry.name)).collect());
    let mut page = format!(
        "# Scattering models\n\n\
         Made by `neumann bsdf --gallery --out docs/bsdfs`.\n\
         Each model is shown as it is when nothing is said of its parameters: as a ball, in the plane of incidence (the radius\n\
         is the cube root of f cos θ), and over all directions (rings are delta lobes, larger for a larger share).\n\
         {by_example}, which need something said, are shown by an example.\n\
         Try others with `neumann bsdf MODEL --set parameter=value`.\n",
    );
    for entry in Bsdf::MODELS {
        let bsdf = shown(entry);
        draw(&bsdf, entry.name, folder)?;
        page += &section(entry, &bsdf);
    }
    Ok(write_atomically(&folder.join("README.md"), page.as_bytes())?)
}

/// The model as it is when nothing is said, unless something must be.
fn preset(entry: &ModelEntry) -> Option<Bsdf> {
    let preset = || (entry.from_arguments)(&Arguments::presets(entry.parameters)).ok();
    is_whole(entry).then(preset).flatten()
}

/// The model as it is when nothing is said; its first example where something must be.
fn shown(entry: &ModelEntry) -> Bsdf {
    preset(entry).unwrap_or_else(|| (entry.examples)()[0])
}

fn section(entry: &ModelEntry, bsdf: &Bsdf) -> String {
    let name = entry.name;
    let mut text = format!("\n## {name}\n\n{}.\n\n", sentence(entry.about));
    for (what, ending) in [("ball", "png"), ("polar", "svg"), ("lobes", "png")] {
        text += &format!("<img src=\"{name}_{what}.{ending}\" alt=\"{name}: {what}\" height=\"200\">\n");
    }
    if !entry.parameters.is_empty() {
        text += "\n| parameter | | domain | default |\n|---|---|---|---|\n";
    }
    for Parameter { name, about, domain, preset } in entry.parameters {
        let preset = match preset {
            Preset::Required(example) => format!("required, such as `{example}`"),
            Preset::Absent => String::new(),
            Preset::Number(x) => x.to_string(),
            Preset::Choice(word) => format!("`{word}`"),
        };
        text += &format!("| `{name}` | {about} | {domain} | {preset} |\n");
    }
    text += &format!("\n{}\n", varying(entry, bsdf));
    let albedos = ANGLES.map(|degrees| {
        let mean = albedo::directional(bsdf, incident(degrees)).mean;
        format!("{:.3} at {degrees}°", (mean[0] + mean[1] + mean[2]) / 3.0)
    });
    text += &format!("\nDirectional albedo, mean over channels: {}.\n", albedos.join(", "));
    if entry.max_albedo > 1.0 {
        let most = entry.max_albedo;
        text += &format!(
            "As published, it can reflect more than it receives: up to {most} times as much. In closed scenes the series may grow.\n"
        );
    }
    text
}

/// Which parameters textures may give: numbers and colours but those that the model holds fixed, by itself or with a word.
fn varying(entry: &ModelEntry, bsdf: &Bsdf) -> String {
    let names = |parameters: &mut dyn Iterator<Item = &'static str>| {
        parameters.map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
    };
    let numbers = || entry.parameters.iter().filter(|p| matches!(p.domain, Domain::Number(..) | Domain::Colour(..)));
    let free = |bsdf: &Bsdf| names(&mut numbers().map(|p| p.name).filter(|name| !bsdf.fixed().contains(name)));
    let usually = free(bsdf);
    if usually.is_empty() {
        return "None of its parameters may vary over a surface.".to_owned();
    }
    let mut text = format!("May vary over a surface: {usually}");
    for (place, parameter) in entry.parameters.iter().enumerate() {
        let (Domain::Choice(words), Preset::Choice(_)) = (parameter.domain, parameter.preset) else { continue };
        for (choice, word) in words.iter().enumerate() {
            let mut arguments = Arguments::presets(entry.parameters);
            arguments.set(place, Argument::Choice(choice));
            let Ok(chosen) = (entry.from_arguments)(&arguments) else { continue };
            if chosen.fixed() != bsdf.fixed() {
                let left = Some(free(&chosen)).filter(|left| !left.is_empty()).unwrap_or_else(|| "none".to_owned());
                text += &format!("; with `{} = \"{word}\"`: {left}", parameter.name);
            }
        }
    }
    text + "."
}

/// With a capital letter.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
