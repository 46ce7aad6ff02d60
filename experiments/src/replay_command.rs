//! `neumann replay`: one sample of an image, traced again.

use crate::cli::{MaxOrder, ReplayArgs, print};
use crate::config::samples_per_replicate;
use crate::error::{Error, Status};
use crate::progress::{Verbosity, while_loading};
use crate::replay::{Place, Retracing, Shown, in_words};
use crate::subject::{DEFAULT_SPP, Subject};
use integrators::contribution::Technique;
use integrators::{Methods, RenderSettings};

/// Traces a sample again and prints its contributions.
///
/// # Errors
/// If there is no such sample, or what it is a sample of cannot be rendered.
pub fn replay(args: &ReplayArgs, methods: &Methods, verbosity: Verbosity) -> Result<Status, Error> {
    let (scene, shown) = while_loading(verbosity, || contributions(args, methods))?;
    let text = match args.json {
        true => serde_json::to_string_pretty(&shown).unwrap_or_default() + "\n",
        false => described(args, &scene, &shown),
    };
    print(&text)?;
    Ok(Status::Done)
}

/// The scene's name, and the contributions asked for.
///
/// # Errors
/// Those of [`replay`].
pub fn contributions(args: &ReplayArgs, methods: &Methods) -> Result<(String, Vec<Shown>), Error> {
    let image = &args.image;
    let spp = image.spp.unwrap_or(DEFAULT_SPP);
    let samples_per_replicate = samples_per_replicate(spp, image.replicates).map_err(Error::Usage)?;
    if args.replicate >= image.replicates {
        let last = image.replicates - 1;
        return Err(Error::usage(format!("--replicate {}: there are replicates 0 to {last}", args.replicate)));
    }
    if image.max_order == Some(MaxOrder::Auto) {
        return Err(Error::usage(
            "--max-order auto: a sample is traced again with the order that was chosen; name it, as the render told it",
        ));
    }
    let Subject { scene, method, settings, .. } = Subject::load(image, methods)?;
    let settings = RenderSettings { samples_per_replicate, ..settings };
    let place = Place { replicate: args.replicate, pixel: args.pixel, sample: args.sample };
    let mut shown = Retracing::new(&scene, &*method, &settings)?.sample(place)?;
    if let Some((s, t)) = args.strategy {
        shown.retain(|shown| shown.technique == Technique::Connect { s, t });
    }
    Ok((scene.name, shown))
}

fn described(args: &ReplayArgs, scene: &str, shown: &[Shown]) -> String {
    let number = match shown.len() {
        0 => "nothing".to_owned(),
        1 => "one contribution".to_owned(),
        n => format!("{n} contributions"),
    };
    let ReplayArgs { image, pixel: (x, y), replicate, sample, .. } = args;
    let head =
        format!("{} in {scene}, replicate {replicate}, pixel {x},{y}, sample {sample}: {number}\n", image.method);
    shown.iter().fold(head, |text, shown| text + "\n" + &in_words(shown))
}
