//! What the materials of a file may say, core and extensions.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::schema::{TextureInfo, one, white};

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Appearance {
    pub alpha_mode: Option<String>,
    pub alpha_cutoff: Option<f64>,
    #[serde(default)]
    pub double_sided: bool,
    #[serde(default)]
    pub emissive_factor: [f64; 3],
    pub emissive_texture: Option<TextureInfo>,
    pub normal_texture: Option<TextureInfo>,
    pub occlusion_texture: Option<IgnoredAny>,
    #[serde(default, rename = "pbrMetallicRoughness")]
    pub pbr: MetallicRoughness,
    #[serde(default)]
    pub extensions: Extensions,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub struct MetallicRoughness {
    pub base_color_factor: [f64; 4],
    pub base_color_texture: Option<TextureInfo>,
    pub metallic_factor: f64,
    pub roughness_factor: f64,
    pub metallic_roughness_texture: Option<TextureInfo>,
}

impl Default for MetallicRoughness {
    fn default() -> Self {
        Self {
            base_color_factor: [1.0; 4],
            base_color_texture: None,
            metallic_factor: 1.0,
            roughness_factor: 1.0,
            metallic_roughness_texture: None,
        }
    }
}

#[derive(Default, Deserialize)]
pub struct Extensions {
    #[serde(rename = "KHR_materials_unlit")]
    pub unlit: Option<IgnoredAny>,
    #[serde(rename = "KHR_materials_emissive_strength")]
    pub emissive_strength: Option<EmissiveStrength>,
    #[serde(rename = "KHR_materials_ior")]
    pub ior: Option<Ior>,
    #[serde(rename = "KHR_materials_specular")]
    pub specular: Option<Specular>,
    #[serde(rename = "KHR_materials_transmission")]
    pub transmission: Option<Transmission>,
    #[serde(rename = "KHR_materials_volume")]
    pub volume: Option<Volume>,
    #[serde(rename = "KHR_materials_clearcoat")]
    pub clearcoat: Option<Clearcoat>,
    #[serde(rename = "KHR_materials_sheen")]
    pub sheen: Option<Sheen>,
    #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
    pub glossiness: Option<SpecularGlossiness>,
    /// Those that are not read.
    #[serde(flatten)]
    pub others: BTreeMap<String, IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct EmissiveStrength {
    #[serde(default = "one")]
    pub emissive_strength: f64,
}

#[derive(Deserialize)]
pub struct Ior {
    #[serde(default = "glass")]
    pub ior: f64,
}

fn glass() -> f64 {
    1.5
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Specular {
    #[serde(default = "one")]
    pub specular_factor: f64,
    pub specular_texture: Option<IgnoredAny>,
    #[serde(default = "white")]
    pub specular_color_factor: [f64; 3],
    pub specular_color_texture: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Transmission {
    #[serde(default)]
    pub transmission_factor: f64,
    pub transmission_texture: Option<TextureInfo>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Volume {
    #[serde(default)]
    pub thickness_factor: f64,
    pub attenuation_distance: Option<f64>,
    #[serde(default = "white")]
    pub attenuation_color: [f64; 3],
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Clearcoat {
    #[serde(default)]
    pub clearcoat_factor: f64,
    pub clearcoat_texture: Option<TextureInfo>,
    #[serde(default)]
    pub clearcoat_roughness_factor: f64,
    pub clearcoat_roughness_texture: Option<IgnoredAny>,
    pub clearcoat_normal_texture: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Sheen {
    #[serde(default)]
    pub sheen_color_factor: [f64; 3],
    pub sheen_color_texture: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct SpecularGlossiness {
    #[serde(default = "opaque")]
    pub diffuse_factor: [f64; 4],
    pub diffuse_texture: Option<TextureInfo>,
    #[serde(default = "white")]
    pub specular_factor: [f64; 3],
    #[serde(default = "one")]
    pub glossiness_factor: f64,
    pub specular_glossiness_texture: Option<IgnoredAny>,
}

fn opaque() -> [f64; 4] {
    [1.0; 4]
}

impl Appearance {
    /// The textures by whose coordinates a mesh is written, the first first.
    pub fn textures(&self) -> Vec<TextureInfo> {
        let Extensions { transmission, clearcoat, .. } = &self.extensions;
        let list = [
            self.pbr.base_color_texture,
            self.normal_texture,
            self.pbr.metallic_roughness_texture,
            self.emissive_texture,
            transmission.as_ref().and_then(|transmission| transmission.transmission_texture),
            clearcoat.as_ref().and_then(|clearcoat| clearcoat.clearcoat_texture),
        ];
        list.into_iter().flatten().collect()
    }
}
