//! What the command line says of taking an image apart.

use crate::error::Error;
use crate::export::exr::LayerSelection;
use integrators::lpe::Expression;
use integrators::{PartSettings, PathClass};

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
