//! Scattering models: what each of Mitsuba's becomes.
//!
//! The table of what is exact and what is not is in `docs/importers.md`.

mod plastic;
mod principled;

use super::context::Context;
use super::index::relative_index;
use super::material::{Description, Value};
use super::metals;
use super::plugin::Plugin;
use super::spectrum::Quantity::{self, Index, Reflectance};
use super::texture::{self, Texture};
use super::xml::Element;
use crate::error::SceneError;

/// A model that reflects nothing: what is mixed with another to dim it.
pub const BLACK: &str = "black";

/// What surrounds a model.
#[derive(Clone, Copy)]
pub struct Setting<'n> {
    /// The name that the material will have.
    pub name: &'n str,
    /// Whether v of the shape is Mitsuba's turned over.
    pub turned: bool,
}

/// What a `bsdf` becomes.
pub fn describe<'a>(
    element: &'a Element,
    setting: Setting,
    context: &mut Context<'a>,
) -> Result<Description, SceneError> {
    context.enter(element)?;
    if element.tag != "bsdf" {
        return Err(element.place.error(format!("{} is no material", element.title()), "refer to a `bsdf`"));
    }
    let plugin = Plugin::new(element, context)?;
    let description = match plugin.kind() {
        "twosided" => two_sided(&plugin, setting, context)?,
        "mask" | "bumpmap" | "bump" | "normalmap" => super::material::layered(&plugin, setting, context)?,
        "coating" | "roughcoating" => uncoated(&plugin, setting, context)?,
        "blendbsdf" | "mixturebsdf" => super::material::blend(&plugin, setting, context)?,
        _ => model(&plugin, context)?,
    };
    context.mapped(element, &format!("`{}`", description.kind()));
    plugin.finish(context);
    context.leave();
    Ok(description)
}

/// What is under a coat.
fn uncoated<'a>(plugin: &Plugin<'a>, setting: Setting, context: &mut Context<'a>) -> Result<Description, SceneError> {
    let Some(inner) = plugin.tagged("bsdf").pop() else {
        return Err(plugin.place().error(format!("`{}` holds no material", plugin.kind()), "add a `bsdf`"));
    };
    let coat = ["thickness", "sigma_a", "int_ior", "ext_ior", "alpha", "distribution", "specular_reflectance"];
    plugin.skip(&coat);
    context.approximate(
        plugin.place(),
        format!("the coat of a `{}` is left out: what is under it is kept", plugin.kind()),
    );
    describe(inner, setting, context)
}

fn two_sided<'a>(plugin: &Plugin<'a>, setting: Setting, context: &mut Context<'a>) -> Result<Description, SceneError> {
    let sides = plugin.tagged("bsdf");
    match sides[..] {
        [] => Err(plugin.place().error("`twosided` holds no material", "add a `bsdf`")),
        [both] => Ok(describe(both, setting, context)?.two_sided()),
        [front, back, ..] => {
            let front = describe(front, setting, context)?;
            let name = &format!("{}_back", setting.name);
            let back = describe(back, Setting { name, ..setting }, context)?;
            Ok(front.backed(back, context))
        }
    }
}

/// A model that holds no other. Without `twosided` those that reflect alone are black from behind.
fn model<'a>(plugin: &Plugin<'a>, context: &mut Context<'a>) -> Result<Description, SceneError> {
    let description = both_sides(plugin, context)?;
    Ok(match plugin.kind() {
        "diffuse" | "lambertian" | "roughdiffuse" | "conductor" | "roughconductor" | "plastic" | "roughplastic"
        | "phong" | "ward" => description.one_sided(),
        "principled" if !description.transmits => description.one_sided(),
        _ => description,
    })
}

fn both_sides<'a>(plugin: &Plugin<'a>, context: &mut Context<'a>) -> Result<Description, SceneError> {
    let place = plugin.place();
    let mut parameter = |names: &[&str], otherwise: f64, quantity: Quantity| {
        let name = names.iter().copied().find(|name| plugin.part(name).is_some()).unwrap_or(names[0]);
        texture::parameter(plugin, name, quantity, otherwise, context)
    };
    Ok(match plugin.kind() {
        "diffuse" | "lambertian" => {
            let albedo = parameter(&["reflectance", "diffuse_reflectance"], 0.5, Reflectance)?;
            Description::new("lambert", place).with("albedo", albedo)
        }
        "roughdiffuse" => {
            let albedo = parameter(&["reflectance", "diffuse_reflectance"], 0.5, Reflectance)?;
            let alpha = plugin.float_or("alpha", 0.2)?;
            let variant = if plugin.boolean("use_fast_approx")? == Some(true) { "qualitative" } else { "full" };
            // An α of Beckmann's is √2 times the standard deviation of a slope, which is taken for that of the angle.
            let mut sigma = (alpha / std::f64::consts::SQRT_2).to_degrees();
            if sigma > 90.0 {
                context.approximate(
                    place,
                    "an `alpha` of `roughdiffuse` beyond a standard deviation of 90 degrees is 90 degrees",
                );
                sigma = 90.0;
            }
            let description = Description::new("oren_nayar", place).with("albedo", albedo);
            description.with("sigma", Value::Number(sigma)).with("variant", Value::word(variant))
        }
        "conductor" => conductor(plugin, None, context)?,
        "roughconductor" => {
            let facets = facets(plugin, context)?;
            conductor(plugin, Some(facets), context)?
        }
        "dielectric" => glass(plugin, "dielectric", context)?,
        "thindielectric" => glass(plugin, "thin_glass", context)?,
        "roughdielectric" => {
            let facets = facets(plugin, context)?;
            glass(plugin, "rough_dielectric", context)?.with_all(facets)
        }
        "plastic" => plastic::smooth(plugin, context)?,
        "roughplastic" => plastic::rough(plugin, context)?,
        "phong" | "ward" => glossy(plugin, context)?,
        "principled" | "principledthin" => principled::describe(plugin, context)?,
        "difftrans" => {
            let passing = parameter(&["transmittance"], 0.5, Reflectance)?;
            Description::new("diffuse_transmission", place)
                .with("reflectance", texture::Texture::grey(0.0))
                .with("transmittance", passing)
        }
        "null" => {
            context.null.get_or_insert_with(|| place.clone());
            Description::new("null", place)
        }
        kind => {
            context.approximate(place, format!("a `{kind}` is not known, and becomes matte, of albedo 0.5"));
            Description::new("lambert", place)
        }
    })
}

/// What scatters as microfacets: its keys of roughness.
fn facets<'a>(plugin: &Plugin<'a>, context: &mut Context<'a>) -> Result<Vec<(&'static str, Value)>, SceneError> {
    let distribution = distribution(plugin, context)?;
    let mut keys = vec![("distribution", Value::word(distribution)), ("masking", Value::word("separable"))];
    if plugin.part("alpha_u").is_some() || plugin.part("alpha_v").is_some() {
        keys.push(("alpha_x", alpha(plugin, "alpha_u", context)?.into()));
        keys.push(("alpha_y", alpha(plugin, "alpha_v", context)?.into()));
    } else {
        keys.push(("alpha", alpha(plugin, "alpha", context)?.into()));
    }
    Ok(keys)
}

/// The distribution of facets.
fn distribution<'a>(plugin: &Plugin<'a>, context: &mut Context<'a>) -> Result<&'static str, SceneError> {
    let place = plugin.place();
    let distribution = match plugin.text("distribution")?.unwrap_or("beckmann") {
        "ggx" => "ggx",
        "beckmann" => "beckmann",
        other => {
            context.approximate(place, format!("the `distribution` `{other}` is taken as `beckmann`"));
            "beckmann"
        }
    };
    if distribution == "beckmann" {
        context.approximate(place, "what facets of `beckmann` hide is exact here, and up to 0.32 % off in Mitsuba");
    }
    plugin.skip(&["sample_visible"]);
    Ok(distribution)
}

/// A width of facets, at most 1.
fn alpha<'a>(plugin: &Plugin<'a>, name: &str, context: &mut Context<'a>) -> Result<Texture, SceneError> {
    let alpha = texture::number(plugin, name, Index, 0.1, context)?;
    match alpha.number() {
        Some(width) if width > 1.0 => {
            context.approximate(plugin.place(), format!("an `{name}` above 1 is taken as 1"));
            Ok(Texture::grey(1.0))
        }
        Some(width) => Ok(Texture::grey(width)),
        None => Ok(alpha),
    }
}

fn conductor<'a>(
    plugin: &Plugin<'a>,
    facets: Option<Vec<(&'static str, Value)>>,
    context: &mut Context<'a>,
) -> Result<Description, SceneError> {
    let model = if facets.is_some() { "rough_conductor" } else { "conductor" };
    let place = plugin.place();
    let factor = texture::parameter(plugin, "specular_reflectance", Reflectance, 1.0, context)?;
    let has_index = plugin.part("eta").is_some() || plugin.part("k").is_some();
    let usual = if plugin.element.version < 2 { "Cu" } else { "none" };
    let material = plugin.text("material")?.unwrap_or(if has_index { "none" } else { usual });
    let bare = Description::new(model, place).with_all(facets.unwrap_or_default());
    if material == "none" && !has_index {
        // An ideal mirror, whose factor is its reflectance.
        if model == "conductor" {
            return Ok(Description::new("mirror", place).with("reflectance", factor));
        }
        return Ok(bare.with("reflectance", Texture::grey(1.0)).tinted(factor, Texture::grey(1.0), context));
    }
    let (eta, k) = match material {
        "none" => (
            texture::parameter(plugin, "eta", Index, 0.0, context)?,
            texture::parameter(plugin, "k", Index, 1.0, context)?,
        ),
        name => metals::index(plugin, name, context).map(Texture::Constant).into(),
    };
    let outside = if plugin.part("ext_eta").is_some() { relative_index_of_outside(plugin)? } else { 1.0 };
    let by_outside = [1.0 / outside; 3];
    let within = |texture: Texture, low: f64| match texture.scaled(by_outside) {
        Some(Texture::Constant(index)) => Texture::Constant(index.map(|c| c.max(low))),
        other => other.unwrap_or(Texture::grey(1.0)),
    };
    let (eta, k) = (within(eta, 1e-3), within(k, 0.0));
    Ok(bare.with("eta", eta).with("k", k).tinted(factor, Texture::grey(1.0), context))
}

fn relative_index_of_outside(plugin: &Plugin) -> Result<f64, SceneError> {
    match plugin.float("ext_eta") {
        Ok(Some(outside)) if outside > 0.0 => Ok(outside),
        _ => Err(plugin.place().error("`ext_eta` is no index", "give a number above 0")),
    }
}

fn glass<'a>(plugin: &Plugin<'a>, model: &'static str, context: &mut Context<'a>) -> Result<Description, SceneError> {
    let eta = relative_index(plugin, "bk7")?;
    let description = Description::new(model, plugin.place()).with("eta", Value::Number(eta));
    let reflected = texture::parameter(plugin, "specular_reflectance", Reflectance, 1.0, context)?;
    let transmitted = texture::parameter(plugin, "specular_transmittance", Reflectance, 1.0, context)?;
    Ok(description.tinted(reflected, transmitted, context))
}

/// Phong's and Ward's models of Mitsuba 0.
fn glossy<'a>(plugin: &Plugin<'a>, context: &mut Context<'a>) -> Result<Description, SceneError> {
    let place = plugin.place();
    let mut kd = texture::parameter(plugin, "diffuse_reflectance", Reflectance, 0.5, context)?;
    let mut ks = texture::parameter(plugin, "specular_reflectance", Reflectance, 0.2, context)?;
    if let (Some(d), Some(s)) = (kd.constant(), ks.constant()) {
        let most = (0..3).map(|c| d[c] + s[c]).fold(0.0, f64::max);
        if most > 1.0 {
            context.approximate(place, "diffuse and specular reflectances of more than 1 in all are scaled down");
            (kd, ks) = (Texture::Constant(d.map(|c| c / most)), Texture::Constant(s.map(|c| c / most)));
        }
    }
    plugin.skip(&["specular_sampling_weight"]);
    if plugin.kind() == "phong" {
        let n = texture::number(plugin, "exponent", Index, 30.0, context)?;
        return Ok(Description::new("phong", place).with("kd", kd).with("ks", ks).with("n", n));
    }
    if let Some(variant @ ("ward" | "ward-duer")) = plugin.text("variant")? {
        context.approximate(place, format!("the variant `{variant}` of a `ward` is taken as `balanced`"));
    }
    let (x, y) = match plugin.part("alpha") {
        Some(_) => (alpha(plugin, "alpha", context)?, alpha(plugin, "alpha", context)?),
        None => (alpha(plugin, "alpha_u", context)?, alpha(plugin, "alpha_v", context)?),
    };
    Ok(Description::new("ward", place).with("kd", kd).with("ks", ks).with("alpha_x", x).with("alpha_y", y))
}
