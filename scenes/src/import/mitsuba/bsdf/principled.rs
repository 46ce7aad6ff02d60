//! Mitsuba's form of Disney's model.

use crate::error::SceneError;
use crate::import::mitsuba::context::Context;
use crate::import::mitsuba::material::{Description, Value};
use crate::import::mitsuba::observer::luminance;
use crate::import::mitsuba::plugin::Plugin;
use crate::import::mitsuba::spectrum::Quantity::Reflectance;
use crate::import::mitsuba::texture::{self, Texture};

/// The smallest width of Mitsuba's facets.
const LEAST_ALPHA: f64 = 1e-3;

/// `principled`, exact but for tints; `principledthin`, nearly.
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
    if specular_tint.number() != Some(0.0) {
        // Blue has the least luminance.
        let gain = base_color.constant().map_or(1.0 / 0.072_169, largest_over_luminance);
        let text =
            format!("a `spec_tint` has a largest channel of 1: Mitsuba's highlight is up to {gain:.1} times as bright");
        context.approximate(place, text);
    }
    let (sheen, sheen_tint) = cloth([sheen, sheen_tint], &base_color, &glass, plugin, context);
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
    Ok(description.with("masking", Value::word("separable")).with("clearcoat_masking", Value::word("shadows")))
}

/// The index: `eta`, or that whose reflectance at the normal is 0.08 times `specular`, as Burley has it.
fn index(plugin: &Plugin) -> Result<f64, SceneError> {
    Ok(match (plugin.float("eta")?, plugin.float("specular")?) {
        (Some(eta), _) => eta,
        (None, specular) => 2.0 / (1.0 - (0.08 * specular.unwrap_or(0.5)).max(0.0).sqrt()) - 1.0,
    })
}

/// The largest channel of a colour over its luminance.
fn largest_over_luminance([r, g, b]: [f64; 3]) -> f64 {
    let luminance = luminance([r, g, b]);
    if luminance > 0.0 { r.max(g).max(b) / luminance } else { 1.0 }
}

/// Sheen and its tint. Mitsuba's tint has a luminance of 1, ours a largest channel of 1; and its sheen stays where there is glass. So
/// theirs is s (1 − u + u k h) with the hue h and its largest channel over its luminance, k: ours with other s and u.
fn cloth<'a>(
    [sheen, tint]: [Texture; 2],
    base_color: &Texture,
    glass: &Texture,
    plugin: &Plugin<'a>,
    context: &mut Context<'a>,
) -> (Texture, Texture) {
    if sheen.number() == Some(0.0) {
        return (sheen, tint);
    }
    let numbers = (sheen.number(), tint.number(), glass.number());
    let known = match (numbers, base_color.constant()) {
        ((Some(sheen), Some(0.0), Some(glass)), _) => Some((sheen, 0.0, glass)),
        ((Some(sheen), Some(tint), Some(glass)), Some(base)) => {
            let gain = largest_over_luminance(base);
            Some((sheen * (1.0 - tint + gain * tint), gain * tint / (1.0 - tint + gain * tint), glass))
        }
        _ => None,
    };
    let Some((strength, tint_here, glass)) = known else {
        if tint.number() != Some(0.0) || glass.number() != Some(0.0) {
            let text = "a `sheen` with a tint of a base that varies has a largest channel of 1 rather than a luminance";
            context.approximate(plugin.place(), text);
        }
        return (sheen, tint);
    };
    // All of it is lost where all is glass.
    let strength = if glass < 1.0 { strength / (1.0 - glass) } else { 0.0 };
    if strength > 1.0 {
        let text = format!("a `sheen` that is {strength:.2} at its brightest channel is taken as 1");
        context.approximate(plugin.place(), text);
    }
    (Texture::grey(strength.min(1.0)), Texture::grey(tint_here))
}
