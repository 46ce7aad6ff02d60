//! `[materials.NAME]` of scene files.

use std::collections::BTreeMap;

use sampling::bsdf::{Bsdf, Dielectric, Ggx, Lambert, Mirror, RoughConductor, RoughDielectric};
use sampling::math::Spectrum;

use super::kind;
use super::reader::{Table, Value};
use crate::builder::SceneBuilder;
use crate::error::SceneError;
use crate::material::{Material, MaterialId};
use crate::suggest::did_you_mean;
use crate::texture::Texture;

const ALBEDO: &str = "it must lie between 0 and 1 in every channel: a surface reflects no more than it receives";

/// The materials of a scene file by name.
pub(super) struct Materials<'a> {
    by_name: BTreeMap<&'a str, (MaterialId, Option<Texture>)>,
}

impl Materials<'_> {
    /// The material that a shape names.
    pub fn named(&self, shape: &Table) -> Result<MaterialId, SceneError> {
        let value = shape.need("material", "\"white\"")?;
        let name = value.text()?;
        let names: Vec<&str> = self.by_name.keys().copied().collect();
        match self.by_name.get(name) {
            Some(&(id, _)) => Ok(id),
            None if names.is_empty() => {
                Err(value.error(format!("there are no materials; add a table `[materials.{name}]`")))
            }
            None => Err(value.error(format!("there is no such material: {}", did_you_mean(name, &names)))),
        }
    }

    /// The albedo of a material where it is a ramp.
    pub fn ramp(&self, name: &str) -> Option<&Texture> {
        self.by_name.get(name)?.1.as_ref()
    }
}

/// Reads every material of a scene file.
pub(super) fn read<'a>(root: &Table<'a>, builder: &mut SceneBuilder) -> Result<Materials<'a>, SceneError> {
    let mut by_name = BTreeMap::new();
    if let Some(value) = root.get("materials") {
        for (name, material) in value.table()?.entries() {
            let material = read_material(&material.table()?, builder)?;
            let ramp = match material {
                Material::Lambert { albedo } => Some(albedo),
                Material::Constant(_) => None,
            };
            by_name.insert(name, (builder.material(material), ramp));
        }
    }
    Ok(Materials { by_name })
}

/// Reads one material:
///
/// - `lambert { albedo }`: a colour in 0…1 or a ramp;
/// - `mirror { reflectance = 1 }`: a perfect mirror;
/// - `dielectric { eta }`: smooth glass, `eta` the index inside over that outside;
/// - `rough_conductor { reflectance }` or `{ eta, k }`: GGX metal, by its reflectance at normal incidence or its
///   complex index;
/// - `rough_dielectric { eta }`: ground glass.
///
/// The rough ones take either `roughness` in 0…1, with α = roughness², or `alpha` itself. At 0 they are the smooth models:
/// mirror and dielectric. α is the same all round: surfaces have no tangents along which a lobe could lie.
fn read_material(table: &Table, builder: &mut SceneBuilder) -> Result<Material, SceneError> {
    Ok(match kind(table, &["lambert", "mirror", "dielectric", "rough_conductor", "rough_dielectric"])? {
        "lambert" => {
            table.allow_only(&["type", "albedo"])?;
            match texture(&table.need("albedo", "0.7")?, 1.0, ALBEDO)? {
                Texture::Constant(albedo) => Bsdf::from(Lambert { albedo }).into(),
                albedo => Material::Lambert { albedo },
            }
        }
        "mirror" => {
            table.allow_only(&["type", "reflectance"])?;
            let reflectance = match table.get("reflectance") {
                Some(value) => value.colour_in(0.0..=1.0, ALBEDO)?,
                None => Spectrum::ONE,
            };
            Bsdf::from(Mirror { reflectance }).into()
        }
        "dielectric" => {
            table.allow_only(&["type", "eta"])?;
            Bsdf::from(Dielectric { eta: index(table)? }).into()
        }
        "rough_conductor" => rough_conductor(table, builder)?.into(),
        _ => {
            table.allow_only(&["type", "eta", "roughness", "alpha"])?;
            let eta = index(table)?;
            match alpha(table)? {
                Some(alpha) => Bsdf::from(RoughDielectric::new(eta, alpha, alpha)).into(),
                None => Bsdf::from(Dielectric { eta }).into(),
            }
        }
    })
}

/// The index of refraction, inside over outside.
fn index(table: &Table) -> Result<f32, SceneError> {
    let value = table.need("eta", "1.5")?;
    Ok(value.number_in(0.01..=100.0, "an index of refraction lies between 0.01 and 100; glass has 1.5")? as f32)
}

fn rough_conductor(table: &Table, builder: &mut SceneBuilder) -> Result<Bsdf, SceneError> {
    table.allow_only(&["type", "reflectance", "eta", "k", "roughness", "alpha"])?;
    let alpha = alpha(table)?;
    if let Some(value) = table.get("reflectance") {
        if table.get("eta").is_some() || table.get("k").is_some() {
            return Err(value.error("give either `reflectance`, or `eta` and `k`"));
        }
        let reflectance = value.colour_in(0.0..=1.0, ALBEDO)?;
        return Ok(match alpha {
            Some(alpha) => RoughConductor::from_reflectance(reflectance, alpha, alpha).into(),
            None => Mirror { reflectance }.into(),
        });
    }
    let positive = f32::MIN_POSITIVE..=1e3;
    let eta = table.need("eta", "[0.2, 0.9, 1.1]")?.colour_in(positive, "an index of refraction is above 0")?;
    let k = table.need("k", "[3.9, 2.5, 2.1]")?.colour_in(0.0..=1e3, "an extinction index is at least 0")?;
    Ok(match alpha {
        Some(alpha) => RoughConductor::new(eta, k, alpha, alpha).into(),
        None => {
            builder.note(format!(
                "{}: a smooth conductor reflects as a mirror of its reflectance at normal incidence, at every angle",
                table.name
            ));
            Mirror { reflectance: normal_reflectance(eta, k) }.into()
        }
    })
}

/// Fresnel reflectance of a conductor at normal incidence, ((η − 1)² + k²) / ((η + 1)² + k²).
fn normal_reflectance(eta: Spectrum, k: Spectrum) -> Spectrum {
    let one = Spectrum::ONE;
    ((eta - one) * (eta - one) + k * k) / ((eta + one) * (eta + one) + k * k)
}

/// The width of the microfacet distribution, or `None` where the surface is smooth.
fn alpha(table: &Table) -> Result<Option<f32>, SceneError> {
    let (value, alpha) = match (table.get("roughness"), table.get("alpha")) {
        (Some(_), Some(alpha)) => {
            return Err(alpha.error("give either `roughness` or `alpha`, which is roughness²"));
        }
        (Some(roughness), None) => {
            let alpha = unit(&roughness)?.powi(2);
            (roughness, alpha)
        }
        (None, Some(alpha)) => {
            let width = unit(&alpha)?;
            (alpha, width)
        }
        (None, None) => {
            return Err(table.error(format!("`{}` lacks `roughness`", table.name), "add for example `roughness = 0.3`"));
        }
    };
    if alpha == 0.0 {
        return Ok(None);
    }
    let alpha = alpha as f32;
    if alpha < Ggx::MIN_ALPHA {
        let least = if table.get("alpha").is_some() { Ggx::MIN_ALPHA } else { Ggx::MIN_ALPHA.sqrt() };
        return Err(value.error(format!("give at least {least}, or 0 for a smooth surface")));
    }
    Ok(Some(alpha))
}

fn unit(value: &Value) -> Result<f64, SceneError> {
    value.number_in(0.0..=1.0, "it lies between 0 (smooth) and 1")
}

/// A colour, or `{ ramp = { base, slope, axis, origin = [0, 0, 0], scale = 1 } }`: `base + slope · ((p − origin)·axis /
/// scale)`, with a unit axis, p \[m\] in the scene's coordinates. A constant lies in 0…`most`, as `what` says; the
/// range of a ramp depends on the shape.
pub(super) fn texture(value: &Value, most: f32, what: &str) -> Result<Texture, SceneError> {
    if !value.is_table() {
        return Ok(Texture::Constant(value.colour_in(0.0..=most, what)?));
    }
    let table = value.table()?;
    table.allow_only(&["ramp"])?;
    let ramp = table.need("ramp", "{ base = 0.5, slope = 0.4, axis = [0, 0, 1] }")?.table()?;
    ramp.allow_only(&["base", "slope", "axis", "origin", "scale"])?;
    let origin = ramp.get("origin").map(|origin| origin.vec3()).transpose()?.unwrap_or_default();
    let scale = ramp.get("scale").map(|scale| scale.positive()).transpose()?.unwrap_or(1.0);
    Ok(Texture::Ramp {
        base: ramp.need("base", "0.5")?.colour()?,
        slope: ramp.need("slope", "0.4")?.colour()?,
        axis: ramp.need("axis", "[0, 0, 1]")?.direction()?.as_vec3(),
        origin: origin.as_vec3(),
        scale: scale as f32,
    })
}
