//! Coats over diffuse bases.

use super::{alpha, distribution};
use crate::error::SceneError;
use crate::import::mitsuba::context::Context;
use crate::import::mitsuba::index::relative_index;
use crate::import::mitsuba::material::{Description, Value};
use crate::import::mitsuba::plugin::Plugin;
use crate::import::mitsuba::spectrum::Quantity::Reflectance;
use crate::import::mitsuba::texture::{self, Texture};
use sampling::bsdf::{Beckmann, Coat, Ggx, Masking, Microfacets, Strays, diffuse_transmittance};

/// A smooth coat. What it reflects within is a fit in Mitsuba, which we take over.
pub fn smooth<'a>(plugin: &Plugin<'a>, context: &mut Context<'a>) -> Result<Description, SceneError> {
    let eta = relative_index(plugin, "polypropylene")?;
    let most = 1.0 - f64::from(diffuse_transmittance(eta as f32)) / (eta * eta);
    let within = Reflected { theirs: fitted_reflectance(1.0 / eta), most };
    coated(plugin, eta, "plastic", within, context)
}

/// A rough coat. What it reflects within is a sum over 64 angles in Mitsuba, which ends a step short; we take that over.
pub fn rough<'a>(plugin: &Plugin<'a>, context: &mut Context<'a>) -> Result<Description, SceneError> {
    let eta = relative_index(plugin, "polypropylene")?;
    let (kind, width) = (distribution(plugin, context)?, alpha(plugin, "alpha", context)?);
    let Some(width) = width.number() else {
        context.approximate(
            plugin.place(),
            "the `alpha` of a `roughplastic` is one number in Mitsuba, and is taken as its mean",
        );
        let mean = width.mean().iter().sum::<f64>() / 3.0;
        return finish(plugin, eta, (kind, mean), context);
    };
    finish(plugin, eta, (kind, width), context)
}

fn finish<'a>(
    plugin: &Plugin<'a>,
    eta: f64,
    (kind, width): (&'static str, f64),
    context: &mut Context<'a>,
) -> Result<Description, SceneError> {
    // As narrow as ours may be, or narrower: smooth to the eye.
    let least = if kind == "ggx" { Ggx::MIN_ALPHA } else { Beckmann::MIN_ALPHA };
    let alpha = (width as f32).max(least);
    if !(1.0..=10.0).contains(&eta) {
        let mend = "its index over that outside must be from 1 to 10";
        return Err(plugin.place().error(format!("a `roughplastic` has an index of {eta}"), mend));
    }
    let facets: Microfacets =
        if kind == "ggx" { Ggx::new(alpha, alpha).into() } else { Beckmann::new(alpha, alpha).into() };
    let coat = Coat { eta: eta as f32, facets, masking: Masking::Separable, strays: Strays::Lost };
    let within = Reflected { theirs: summed_reflectance(&coat), most: f64::from(coat.most_sent_back()) };
    let description = coated(plugin, eta, "rough_plastic", within, context)?;
    let keys = [("distribution", kind), ("masking", "separable"), ("strays", "lost")];
    let words = keys.map(|(key, word)| (key, Value::word(word))).to_vec();
    Ok(description.with("alpha", Value::Number(f64::from(alpha))).with_all(words))
}

/// What a coat reflects of the base's light: as Mitsuba has it, and the most there can be.
struct Reflected {
    theirs: f64,
    most: f64,
}

fn coated<'a>(
    plugin: &Plugin<'a>,
    eta: f64,
    model: &'static str,
    within: Reflected,
    context: &mut Context<'a>,
) -> Result<Description, SceneError> {
    let place = plugin.place();
    let albedo = texture::parameter(plugin, "diffuse_reflectance", Reflectance, 0.5, context)?;
    let highlight = texture::parameter(plugin, "specular_reflectance", Reflectance, 1.0, context)?;
    let is_coloured = plugin.boolean("nonlinear")?.unwrap_or(false);
    plugin.skip(&["sample_visible", "specular_sampling_weight"]);
    let reflectance = within.theirs.min(within.most);
    // How much brighter their base is than one whose coat sends back no more than there is.
    let brighter = (1.0 - reflectance) / (1.0 - within.theirs);
    let made_up = albedo.constant().map(|albedo| {
        albedo.map(|c| {
            // ρ / (1 − ρ F̄) with their F̄ is ours of another ρ; without colours, ρ / (1 − F̄).
            let reach = if is_coloured { c / (1.0 - c * within.theirs) } else { c / (1.0 - within.theirs) };
            if is_coloured { reach / (1.0 + reach * reflectance) } else { reach * (1.0 - reflectance) }
        })
    });
    let albedo = match made_up {
        _ if brighter == 1.0 => albedo,
        Some(colour) if colour.iter().all(|c| *c <= 1.0) => Texture::Constant(colour),
        _ => {
            let percent = 100.0 * (brighter - 1.0);
            let text = format!("Mitsuba's base is {percent:.2} % brighter: its coat sends back more than there is");
            context.approximate(place, text);
            albedo
        }
    };
    let description = Description::new(model, place)
        .with("albedo", albedo)
        .with("eta", Value::Number(eta))
        .with("interreflection", Value::word(if is_coloured { "coloured" } else { "white" }))
        .with("internal_reflectance", Value::Number(f64::from(reflectance as f32)));
    Ok(description.tinted(highlight, Texture::grey(1.0), context))
}

/// The share of diffuse light that an interface of this index reflects, by the fits of Egan and Hilgeman (1973) for an index below 1
/// and of d'Eon and Irving (2011) above.
fn fitted_reflectance(eta: f64) -> f64 {
    let inverse = 1.0 / eta;
    if eta < 1.0 {
        return 0.0636 * inverse + 0.6681 + eta * (0.7099 - 1.4399 * eta);
    }
    let terms = [0.919_317, -3.4793, 6.753_35, -7.809_89, 4.985_54, -1.368_81];
    terms.into_iter().rev().fold(0.0, |sum, term| sum * inverse + term)
}

/// Twice the mean of what facets reflect within, times the cosine, over 64 cosines from 0 to 1.
fn summed_reflectance(coat: &Coat) -> f64 {
    let terms = (0..64).map(|i| {
        let cos = (f64::from(i) / 63.0).max(1e-6);
        f64::from(coat.reflectance_within(cos as f32)) * cos
    });
    terms.sum::<f64>() / 32.0
}
