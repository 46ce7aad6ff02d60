//! Indices of refraction by the names that Mitsuba gives them.

use super::plugin::{Plugin, finite};
use crate::error::SceneError;
use crate::suggest::did_you_mean;

/// Indices of refraction of transparent materials.
const TRANSPARENT: [(&str, f64); 24] = [
    ("vacuum", 1.0),
    ("helium", 1.000_036),
    ("hydrogen", 1.000_132),
    ("air", 1.000_277),
    ("carbon dioxide", 1.000_45),
    ("water", 1.333),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.520_45),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.47),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.575),
    ("diamond", 2.419),
    ("glass", 1.5),
];

/// `int_ior` over `ext_ior`, each a number or a name; `inside` is the name of the first where it is missing.
pub fn relative_index<'a>(plugin: &Plugin<'a>, inside: &str) -> Result<f64, SceneError> {
    let index = |name: &str, otherwise: &str| {
        let text = plugin.text(name)?.unwrap_or(otherwise);
        if text.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '.' | '+' | '-')) {
            let value = finite(text, name, plugin.place())?;
            return match value > 0.0 {
                true => Ok(value),
                false => Err(plugin.place().error(format!("`{name}` is {value}"), "it must be above 0")),
            };
        }
        let names: Vec<&str> = TRANSPARENT.iter().map(|(name, _)| *name).collect();
        let found = TRANSPARENT.iter().find(|(known, _)| known.eq_ignore_ascii_case(text));
        found.map(|(_, index)| *index).ok_or_else(|| {
            plugin
                .place()
                .error(format!("`{name}` is `{text}`"), format!("give a number, or {}", did_you_mean(text, &names)))
        })
    };
    Ok(index("int_ior", inside)? / index("ext_ior", "air")?)
}
