//! Mitsuba's form of Disney's model.

use crate::error::SceneError;
use crate::import::mitsuba::context::Context;
use crate::import::mitsuba::material::{Description, Value};
use crate::import::mitsuba::plugin::Plugin;
use crate::import::mitsuba::spectrum::Quantity::Reflectance;
use crate::import::mitsuba::texture::{self, Texture};

/// The smallest width of Mitsuba's facets.
const LEAST_ALPHA: f64 = 1e-3;

/// `principled`, exact; `principledthin`, nearly.
pub fn describe<'a>(plugin: &Plugin<'a>, context: &mut Context<'a>) -> Result<Description, SceneError> {
    let place = plugin.place();
    if plugin.kind() == "principledthin" {
        context
            .approximate(place, "a `principledthin` is a surface of a body here, and lets no light through diffusely");
    }
    let base_color = texture::parameter(plugin, "base_color", Reflectance, 0.5, context)?;
    let mut number = |name: &str, otherwise: f64| texture::number(plugin, name, Reflectance, otherwise, context);
    let glass = number("spec_trans", 0.0)?;
    let (sheen, sheen_tint) = (number("sheen", 0.0)?, number("sheen_tint", 0.0)?);
    let roughness = match number("roughness", 0.5)? {
        Texture::Constant([roughness, ..]) => Texture::grey(roughness.max(LEAST_ALPHA.sqrt())),
        varying => varying,
    };
    let specular_tint = number("spec_tint", 0.0)?;
    let same = ["metallic", "anisotropic", "clearcoat", "clearcoat_gloss"];
    let mut keys = Vec::new();
    for name in same {
        keys.push((name, Value::from(number(name, 0.0)?)));
    }
    let flatness = number("flatness", 0.0)?;
    let is_tinted = specular_tint.number() != Some(0.0) || sheen.number() != Some(0.0);
    let eta = index(plugin)?;
    plugin.skip(&["diffuse_reflectance_sampling_rate", "main_specular_sampling_rate", "clearcoat_sampling_rate"]);
    let mut description = Description::new("principled", place).with("base_color", base_color);
    if glass.number() != Some(0.0) {
        description = description.transmitting();
    }
    description = description
        .with_all(keys)
        .with("subsurface", flatness)
        .with("specular_tint", specular_tint)
        .with("roughness", roughness)
        .with("sheen", sheen)
        .with("sheen_tint", sheen_tint)
        .with("spec_trans", glass)
        .with("eta", Value::Number(eta));
    if is_tinted {
        description = description.with("tints", Value::word("luminance"));
    }
    Ok(description.with("masking", Value::word("separable")).with("clearcoat_masking", Value::word("shadows")))
}

/// The index: `eta`, or that whose reflectance at the normal is 0.08 times `specular`, as Burley has it.
fn index(plugin: &Plugin) -> Result<f64, SceneError> {
    Ok(match (plugin.float("eta")?, plugin.float("specular")?) {
        (Some(eta), _) => eta,
        (None, specular) => 2.0 / (1.0 - (0.08 * specular.unwrap_or(0.5)).max(0.0).sqrt()) - 1.0,
    })
}
