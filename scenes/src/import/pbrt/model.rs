//! Scattering models: what each of pbrt's becomes.
//!
//! The table of what is exact and what is not is in `docs/importers.md`.

use super::context::Context;
use super::material::{Description, Value};
use super::parameters::Parameters;
use super::parser::Values;
use super::spectrum::{COPPER, Quantity};
use super::texture::{self, Texture};
use crate::error::SceneError;

/// The width below which pbrt takes a surface for smooth.
const SMOOTH: f64 = 1e-3;

/// What a material without parts becomes.
pub fn describe(parameters: &Parameters, context: &mut Context) -> Result<Description, SceneError> {
    let place = &parameters.place;
    let nearest = |text: &str, context: &mut Context| {
        let kind = super::lexer::shown(&parameters.kind);
        context.approximate(place, format!("a `{kind}` {text}"));
    };
    let reflectance = |names: &[&str], otherwise: f64, context: &mut Context| match parameters.any(names) {
        Some(parameter) => texture::read(parameter, Quantity::Reflectance, context),
        None => Ok(Texture::grey(otherwise)),
    };
    Ok(match parameters.kind.as_str() {
        "diffuse" => Description::new("lambert", place).with("albedo", reflectance(&["reflectance"], 0.5, context)?),
        "matte" => {
            let albedo = reflectance(&["Kd"], 0.5, context)?;
            let sigma = texture::parameter(parameters, "sigma", Quantity::Number, 0.0, context)?;
            match sigma.constant() {
                Some([0.0, ..]) => Description::new("lambert", place).with("albedo", albedo),
                _ => Description::new("oren_nayar", place)
                    .with("albedo", albedo)
                    .with("sigma", sigma)
                    .with("variant", Value::word("qualitative")),
            }
        }
        "coateddiffuse" => {
            nearest("is a coat without thickness here, whose light within is followed without end", context);
            parameters.skip(&["thickness", "maxdepth", "nsamples", "g"]);
            if parameters.find("albedo").is_some() {
                context.approximate(place, "the medium between the layers of a coat is left out");
            }
            let albedo = reflectance(&["reflectance"], 0.5, context)?;
            coated(parameters, albedo, 0.0, Remap::Root, context)?
        }
        "plastic" | "uber" | "substrate" => {
            nearest("becomes a rough coat over a matte base, which reflects by its index alone", context);
            let albedo = reflectance(&["Kd"], if parameters.kind == "substrate" { 0.5 } else { 0.25 }, context)?;
            parameters.skip(&["Ks", "Kr", "Kt"]);
            let made = coated(parameters, albedo, 0.1, Remap::Fit, context)?;
            match parameters.find("opacity") {
                Some(opacity) => made.masked(texture::read(opacity, Quantity::Reflectance, context)?),
                None => made,
            }
        }
        "conductor" => conductor(parameters, "", 0.0, Remap::Root, context)?,
        "metal" => conductor(parameters, "", 0.01, Remap::Fit, context)?,
        "coatedconductor" => {
            nearest("has no coat here", context);
            parameters.skip(&["thickness", "maxdepth", "nsamples", "g", "albedo"]);
            parameters.skip(&["interface.roughness", "interface.uroughness", "interface.vroughness", "interface.eta"]);
            conductor(parameters, "conductor.", 0.0, Remap::Root, context)?
        }
        "mirror" => Description::new("mirror", place).with("reflectance", reflectance(&["Kr"], 0.9, context)?),
        "dielectric" => glass(parameters, Remap::Root, context)?,
        "glass" => {
            let factors = [reflectance(&["Kr"], 1.0, context)?, reflectance(&["Kt"], 1.0, context)?];
            let made = glass(parameters, Remap::Fit, context)?;
            if made.varies() && factors.iter().any(|factor| factor.constant() != Some([1.0; 3])) {
                nearest(
                    "of a roughness that varies reflects and transmits all light here: its `Kr` and `Kt` are left out",
                    context,
                );
                return Ok(made);
            }
            made.tinted(factors)
        }
        "thindielectric" => {
            Description::new("thin_glass", place).with("eta", Value::Number(index(parameters, context)?))
        }
        "diffusetransmission" => {
            let scale = parameters.float_or("scale", 1.0)?;
            let [mut reflected, mut passing] = [
                reflectance(&["reflectance"], 0.25, context)?.scaled([scale; 3]),
                reflectance(&["transmittance"], 0.25, context)?.scaled([scale; 3]),
            ];
            let sum = reflected.greatest().zip(passing.greatest()).map_or(0.0, |(a, b)| a + b);
            if sum > 1.0 {
                nearest(
                    "may create light where it reflects and lets pass more than there is: it is made darker",
                    context,
                );
                [reflected, passing] = [reflected, passing].map(|texture| texture.scaled([1.0 / sum; 3]));
            }
            Description::new("diffuse_transmission", place)
                .with("reflectance", reflected)
                .with("transmittance", passing)
        }
        "translucent" => {
            nearest("lets no light through here: it is matte", context);
            parameters.skip(&["reflect", "transmit", "roughness", "remaproughness", "Ks"]);
            Description::new("lambert", place).with("albedo", reflectance(&["Kd"], 0.25, context)?)
        }
        "interface" | "none" | "" => {
            context.interface.get_or_insert_with(|| place.clone());
            Description::new("null", place)
        }
        "subsurface" | "kdsubsurface" => {
            nearest("scatters light where it enters here: it becomes a coat over a matte base", context);
            parameters.skip(&["mfp", "sigma_a", "sigma_s", "name", "scale", "g"]);
            let albedo = reflectance(&["reflectance", "Kd"], 0.5, context)?;
            coated(parameters, albedo, 0.0, Remap::Root, context)?
        }
        "hair" | "measured" | "fourier" | "disney" => {
            nearest("has no model here, and becomes matte", context);
            Description::new("lambert", place).with("albedo", reflectance(&["reflectance", "color"], 0.5, context)?)
        }
        _ => {
            nearest("is not known, and becomes matte, of albedo 0.5", context);
            Description::new("lambert", place).with("albedo", Texture::grey(0.5))
        }
    })
}

/// How a roughness becomes a width.
#[derive(Clone, Copy)]
enum Remap {
    /// v4: its square root.
    Root,
    /// v3: a polynomial in its logarithm.
    Fit,
}

impl Remap {
    fn alpha(self, roughness: f64) -> f64 {
        match self {
            Self::Root => roughness.max(0.0).sqrt(),
            Self::Fit => {
                let x = roughness.max(1e-3).ln();
                1.621_42 + 0.819_955 * x + 0.173_4 * x * x + 0.017_120_1 * x.powi(3) + 0.000_640_711 * x.powi(4)
            }
        }
    }
}

/// α along u and v; `None` where the surface is smooth. The parameters' names begin with `prefix`.
fn widths(
    parameters: &Parameters,
    prefix: &str,
    otherwise: f64,
    remap: Remap,
    context: &mut Context,
) -> Result<Option<[Texture; 2]>, SceneError> {
    let place = &parameters.place;
    let remaps = parameters.boolean("remaproughness")?.unwrap_or(true);
    let both = texture::parameter(parameters, &format!("{prefix}roughness"), Quantity::Number, otherwise, context)?;
    let mut one = |name: &str| -> Result<Texture, SceneError> {
        let own = match parameters.find(&format!("{prefix}{name}")) {
            Some(own) => texture::read(own, Quantity::Number, context)?,
            None => both.clone(),
        };
        let found = match own.each(|x| if remaps { remap.alpha(x) } else { x.max(0.0) }) {
            Some(found) => found,
            None if remaps => {
                context.approximate(place, "an image for a roughness that is remapped is taken as its mean");
                Texture::grey(remap.alpha(own.mean_number()))
            }
            None => own,
        };
        match found.each(|x| x.min(1.0)) {
            Some(inside) if inside != found => {
                context.approximate(place, "a roughness above 1 is taken as 1");
                Ok(inside)
            }
            _ => Ok(found),
        }
    };
    let found = [one("uroughness")?, one("vroughness")?];
    let smooth = |texture: &Texture| texture.constant().is_some_and(|[alpha, ..]| alpha < SMOOTH);
    // v3 takes only glass for smooth, and only where 0 is written: its polynomial is 0.047 there.
    let is_glass = parameters.kind == "glass";
    let is_zero = |name: &str| match parameters.find(&format!("{prefix}{name}")) {
        Some(own) => own.values == Values::Numbers(vec![0.0]),
        None => both.constant() == Some([0.0; 3]),
    };
    let written_smooth = matches!(remap, Remap::Fit) && is_glass && is_zero("uroughness") && is_zero("vroughness");
    Ok((!found.iter().all(smooth) && !written_smooth).then_some(found))
}

fn as_keys([x, y]: [Texture; 2]) -> Vec<(&'static str, Value)> {
    if x == y { vec![("alpha", x.into())] } else { vec![("alpha_x", x.into()), ("alpha_y", y.into())] }
}

/// The index of refraction of what is beyond the surface.
fn index(parameters: &Parameters, context: &mut Context) -> Result<f64, SceneError> {
    let Some(eta) = parameters.any(&["eta", "index"]) else { return Ok(1.5) };
    let texture = texture::read(eta, Quantity::Number, context)?;
    match texture.constant() {
        Some([r, g, b]) if r == g && g == b => {}
        _ => context.approximate(&eta.place, "an index of refraction that varies is taken as its mean"),
    }
    Ok(texture.mean_number())
}

fn glass(parameters: &Parameters, remap: Remap, context: &mut Context) -> Result<Description, SceneError> {
    let eta = Value::Number(index(parameters, context)?);
    Ok(match widths(parameters, "", 0.0, remap, context)? {
        None => Description::new("dielectric", &parameters.place).with("eta", eta),
        Some(alpha) => {
            let rough = Description::new("rough_dielectric", &parameters.place).with("eta", eta);
            rough.with("masking", Value::word("correlated_throughout")).with_all(as_keys(alpha))
        }
    })
}

fn coated(
    parameters: &Parameters,
    albedo: Texture,
    otherwise: f64,
    remap: Remap,
    context: &mut Context,
) -> Result<Description, SceneError> {
    let place = &parameters.place;
    let eta = Value::Number(index(parameters, context)?);
    let Some([x, y]) = widths(parameters, "", otherwise, remap, context)? else {
        return Ok(Description::new("plastic", place).with("albedo", albedo).with("eta", eta));
    };
    let alpha = if x == y {
        x
    } else {
        context.approximate(place, "a rough coat has one roughness, the geometric mean of the two");
        Texture::grey((x.mean_number() * y.mean_number()).sqrt())
    };
    Ok(Description::new("rough_plastic", place).with("albedo", albedo).with("eta", eta).with("alpha", alpha))
}

fn conductor(
    parameters: &Parameters,
    prefix: &str,
    otherwise: f64,
    remap: Remap,
    context: &mut Context,
) -> Result<Description, SceneError> {
    let place = &parameters.place;
    let bare = match widths(parameters, prefix, otherwise, remap, context)? {
        None => Description::new("conductor", place),
        Some(alpha) => Description::new("rough_conductor", place).with_all(as_keys(alpha)),
    };
    if let Some(reflectance) = parameters.find("reflectance") {
        let at_normal = texture::read(reflectance, Quantity::Reflectance, context)?;
        // As pbrt has it: an index of 1, and the extinction that makes up for it.
        let extinction = |r: f64| 2.0 * (r.min(0.9999) / (1.0 - r.min(0.9999))).sqrt();
        return Ok(match at_normal.each(extinction) {
            Some(k) => bare.with("eta", Texture::grey(1.0)).with("k", k),
            None => {
                context.approximate(place, "an image for a `conductor`'s `reflectance` has another Fresnel curve");
                bare.with("reflectance", at_normal)
            }
        });
    }
    let (eta, k) = (format!("{prefix}eta"), format!("{prefix}k"));
    let (eta, k) = (parameters.find(&eta), parameters.find(&k));
    let mut part = |parameter: Option<&_>, copper: [f64; 3]| match parameter {
        Some(parameter) => texture::read(parameter, Quantity::Number, context),
        None => Ok(Texture::Constant(copper)),
    };
    let (eta, k) = (part(eta, COPPER[0])?, part(k, COPPER[1])?);
    Ok(bare.with("eta", eta).with("k", k))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roughnesses_become_widths_as_each_version_has_it() {
        assert_eq!(Remap::Root.alpha(0.25), 0.5);
        // v3's fit meets some 0.14 at 0.01 and 1.62 at 1.
        assert!((Remap::Fit.alpha(1.0) - 1.62142).abs() < 1e-12);
        assert!((Remap::Fit.alpha(0.01) - 0.1389).abs() < 1e-3, "{}", Remap::Fit.alpha(0.01));
    }
}
