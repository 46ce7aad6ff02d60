//! The rule by which an MTL material becomes one of ours.
//!
//! MTL describes highlights, not scattering, and programs fill it in differently; the rule takes the physical reading
//! where there is one. With Kd and Ks the means over their channels, the first that applies:
//!
//! 1. **Glass**: `illum` 6 or 7 (refraction); or `illum` 4 or 9 (transparency) with opacity `d` < 1 or a `Tf` above 0;
//!    or `d` < ½. A smooth dielectric of index `Ni` (1.5 where it is missing). `Ns` and `Tf` don't matter: a filter
//!    other than white is noted.
//! 2. **Mirror**: Ks > Kd with Kd < 0.05, and `illum` 5, or `Ns` ≥ 1000, or `illum` 3 or 8 without `Ns`. Reflectance
//!    `Ks`.
//! 3. **Metal**: Ks > Kd, unless `illum` is 0 or 1 (no highlights). A GGX conductor of reflectance `Ks` and α = √(2 /
//!    (`Ns` + 2)), the width at which its highlight is as sharp as Blinn's \[Walter07\].
//! 4. **Matte**: Lambert of albedo `Kd`, or 0.5 where neither Kd nor Ks is stated.
//!
//! Where both Kd and Ks are above 0, the weaker is left out, and a note says so. Reflectances above 1 become 1, noted
//! as well. `Ke` emits. The image `map_Kd` of what is matte is multiplied by `Kd`, or stands alone where that is 0.

use sampling::bsdf::{Bsdf, Dielectric, Ggx, Lambert, Mirror, RoughConductor};
use sampling::math::Spectrum;
use std::path::Path;
use std::sync::Arc;

use super::mtl::Statements;
use crate::material::Material;
use crate::texture::{Channel, Encoding, Image, ImageTexture, Texture, UvMap, Wrap};

/// A material made of MTL statements.
#[derive(Clone, Debug)]
pub struct Appearance {
    /// How it scatters; where there is a map, on meshes that lack texture coordinates.
    pub bsdf: Bsdf,
    /// How it scatters where its map is read.
    pub mapped: Option<Material>,
    /// Emitted radiance \[W/(m²·sr)\], if it emits.
    pub emission: Option<Spectrum>,
    /// What was approximated or left out.
    pub notes: Vec<String>,
}

impl Appearance {
    /// What stands for a material that is missing: matte, of albedo 0.5.
    pub fn missing() -> Self {
        Appearance {
            bsdf: Lambert { albedo: Spectrum::splat(0.5) }.into(),
            mapped: None,
            emission: None,
            notes: Vec::new(),
        }
    }

    /// Whether light passes through it.
    pub fn transmits(&self) -> bool {
        matches!(self.bsdf, Bsdf::Dielectric(_) | Bsdf::RoughDielectric(_))
    }

    /// Applies the rule; images are looked for in `folder`.
    pub fn of(stated: &Statements, folder: &Path) -> Self {
        let mut notes = Vec::new();
        let bsdf = scattering(stated, &mut notes);
        for (keyword, rest) in &stated.ignored {
            notes.push(format!("`{keyword} {rest}` is not read"));
        }
        let mapped = stated.diffuse_map.as_ref().and_then(|file| match &bsdf {
            Bsdf::Lambert(lambert) => {
                let scale = if lambert.albedo.is_zero() { Spectrum::ONE } else { lambert.albedo };
                match image(&folder.join(file.replace('\\', "/")), scale) {
                    Ok(texture) => Some(Material::lambert(texture)),
                    Err(message) => {
                        notes.push(format!("its map_Kd `{file}` is left out: {message}"));
                        None
                    }
                }
            }
            _ => {
                notes.push(format!("its map_Kd `{file}` is not read: it is not matte"));
                None
            }
        });
        let emission = stated.emission.map(spectrum).filter(|emission| !emission.is_zero());
        Appearance { bsdf, mapped, emission, notes }
    }
}

/// The image of a reflectance, times its colour.
fn image(path: &Path, scale: Spectrum) -> Result<Texture, String> {
    let bytes = crate::file::read(path).map_err(|error| error.to_string())?;
    let image = Arc::new(Image::decode(&bytes, None, Encoding::Srgb)?);
    let (map, wrap, channel) = (UvMap::default(), Wrap::Repeat, Channel::Colour);
    let texture = ImageTexture { image, wrap, map, channel, scale };
    if texture.range().1.max_component() > 1.0 {
        return Err("it reaches more than 1".to_string());
    }
    Ok(Texture::Image(texture))
}

fn scattering(stated: &Statements, notes: &mut Vec<String>) -> Bsdf {
    if is_glass(stated) {
        return glass(stated, notes);
    }
    if stated.opacity.is_some_and(|opacity| opacity < 1.0) {
        notes.push("it is partly transparent (d < 1), and is taken as opaque".to_string());
    }
    let diffuse = stated.diffuse.unwrap_or(if stated.specular.is_some() { [0.0; 3] } else { [0.5; 3] });
    let specular = stated.specular.unwrap_or([0.0; 3]);
    let (kd, ks) = (mean(diffuse), mean(specular));
    let highlights = !matches!(stated.illumination, Some(0 | 1));
    if !highlights || ks <= kd {
        if highlights && ks > 0.0 {
            notes.push("Kd and Ks are both above 0: the weaker, Ks, is left out".to_string());
        }
        return Lambert { albedo: reflectance("Kd", diffuse, notes) }.into();
    }
    if kd > 0.0 {
        notes.push("Kd and Ks are both above 0: the weaker, Kd, is left out".to_string());
    }
    let reflectance = reflectance("Ks", specular, notes);
    let sharp = stated.exponent.is_some_and(|exponent| exponent >= 1000.0);
    let traced = match stated.illumination {
        Some(5) => true,
        Some(3 | 8) => stated.exponent.is_none(),
        _ => false,
    };
    if kd < 0.05 && (sharp || traced) {
        return Mirror { reflectance }.into();
    }
    let alpha = (2.0 / (stated.exponent.unwrap_or(10.0).max(0.0) + 2.0)).sqrt() as f32;
    let alpha = alpha.max(Ggx::MIN_ALPHA);
    notes.push(format!("its highlight of exponent Ns becomes that of a GGX conductor of alpha {alpha:.3}"));
    RoughConductor::from_reflectance(reflectance, alpha, alpha).into()
}

fn is_glass(stated: &Statements) -> bool {
    let opacity = stated.opacity.unwrap_or(1.0);
    let filtered = stated.filter.is_some_and(|filter| mean(filter) > 0.0);
    match stated.illumination {
        Some(6 | 7) => true,
        Some(4 | 9) => opacity < 1.0 || filtered,
        _ => opacity < 0.5,
    }
}

fn glass(stated: &Statements, notes: &mut Vec<String>) -> Bsdf {
    let eta = match stated.index {
        Some(index) if index >= 0.01 => index as f32,
        Some(index) => {
            notes.push(format!("its index Ni of {index} cannot be, and is taken as 1.5"));
            1.5
        }
        None => {
            notes.push("it is glass without an index Ni, which is taken as 1.5".to_string());
            1.5
        }
    };
    if stated.filter.is_some_and(|filter| filter != [1.0; 3] && filter != [0.0; 3]) {
        notes.push("its transmission filter Tf is taken as white".to_string());
    }
    if stated.opacity.is_some_and(|opacity| opacity > 0.0 && opacity < 1.0) {
        notes.push("it is partly opaque (d > 0), and is taken as clear".to_string());
    }
    Dielectric { eta }.into()
}

fn reflectance(keyword: &str, channels: [f64; 3], notes: &mut Vec<String>) -> Spectrum {
    if channels.iter().any(|&channel| channel > 1.0) {
        notes.push(format!("its {keyword} is above 1, and is taken as 1"));
    }
    spectrum(channels.map(|channel| channel.min(1.0)))
}

fn mean(channels: [f64; 3]) -> f64 {
    channels.iter().sum::<f64>() / 3.0
}

fn spectrum(channels: [f64; 3]) -> Spectrum {
    Spectrum::from(channels.map(|channel| channel as f32))
}
