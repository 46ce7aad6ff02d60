//! What the command line says of taking an image apart, and what is said of the strategies that came of it.

use crate::error::Error;
use crate::export::exr::LayerSelection;
use crate::export::notation::enumerated;
use integrators::lpe::Expression;
use integrators::{Measurement, PartSettings, PathClass};

/// A path class as it is typed: `NAME=EXPR`. The name is that of the image's layer.
///
/// # Errors
/// If the name cannot be that of a layer, or the expression cannot be read; the message shows where.
pub fn class(text: &str) -> Result<PathClass, String> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    let Some((name, expression)) = text.split_once('=').filter(|(name, _)| name.chars().all(allowed)) else {
        return Err("give it a name of letters, digits, `_` and `-`: caustics='CDS+L'".to_owned());
    };
    if name.is_empty() {
        return Err("the name before `=` is empty; write caustics='CDS+L'".to_owned());
    }
    let expression = Expression::parse(expression).map_err(|error| format!("\n{error}"))?;
    Ok(PathClass { name: name.to_owned(), expression })
}

/// What an image is taken apart into whose file has these layers, and layers of these classes.
///
/// # Errors
/// If two classes have one name.
pub fn settings(layers: LayerSelection, classes: &[PathClass]) -> Result<PartSettings, Error> {
    for (i, class) in classes.iter().enumerate() {
        if classes[..i].iter().any(|other| other.name == class.name) {
            return Err(Error::usage(format!("--lpe: there are two classes `{}`; rename one", class.name)));
        }
    }
    Ok(PartSettings { strategies: layers.strategies, groups: layers.groups, classes: classes.to_vec() })
}

/// What to beware of where strategies that stand alone have a variance that looks infinite.
pub fn unbounded_in_words(m: &Measurement) -> Option<String> {
    let strategies: Vec<String> = m.unbounded_strategies().iter().map(|(s, t)| format!("({s}, {t})")).collect();
    let which = match strategies.len() {
        0 => return None,
        1 => "the variance of strategy",
        _ => "the variances of strategies",
    };
    let (whose, looks) = if strategies.len() == 1 { ("its raw layer", "looks") } else { ("their raw layers", "look") };
    Some(format!(
        "{which} {}, unweighted, {looks} infinite: no error bar of {whose} can be trusted",
        enumerated(strategies)
    ))
}
