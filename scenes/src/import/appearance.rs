//! The rule by which an MTL material becomes one of ours.
//!
//! MTL describes highlights, not scattering, and programs fill it in differently; the rule takes the physical reading
//! where there is one. With Kd and Ks the means over their channels, the first that applies:
//!
//! 1. **Glass**: `illum` 6 or 7 (refraction); or `illum` 4 or 9 (transparency) with an opacity < 1 or a `Tf` above 0;
//!    or `d` < ½. A smooth dielectric of index `Ni` (1.5 where it is missing). `Ns` and `Tf` don't matter: a filter
//!    other than white is noted.
//! 2. **Mirror**: what would be a metal, with Kd < 0.05, and `illum` 5, or `Ns` ≥ 1000, or `illum` 3 or 8 without `Ns`. Reflectance
//!    `Ks`.
//! 3. **Metal**: Ks > Kd and either Kd < 0.05, or `illum` 3, 5 or 8 (mirrors), or Kd + Ks > 1 without an `Ns` of 0: the two
//!    cannot both hold there, and the stronger does. Not with `illum` 0 or 1 (no highlights), nor with a `map_Kd` unless `illum`
//!    says a mirror. A GGX conductor of reflectance `Ks` and α = √(2 / (`Ns` + 2)), the width at which its highlight is as
//!    sharp as Blinn's \[Walter07\].
//! 4. **Matte**: Lambert of albedo `Kd`, or 0.5 where neither Kd nor Ks is stated. So is what exporters write of everything, Ks
//!    of ½ beside any Kd that is not black, as by Blender, or of 1 with an `Ns` of 0 beside such a Kd, as by MeshLab.
//!
//! Where both Kd and Ks are above 0, one is left out, and a note says so. Reflectances above 1 become 1, noted
//! as well. `Ke` emits. The opacity is `d`, or 1 − `Tr` where there is no `d`; but a `Tr` of 1 is what MeshLab and others write of
//! what is opaque, and makes nothing clear unless `illum` is 4, 6, 7 or 9. What is neither glass nor emits is met as far as the opacity
//! says; of what emits it is left out, noted.
//!
//! Meshes with texture coordinates have the maps too: `map_Kd` of what is matte, times `Kd`, or alone where that is 0; `map_Ke`
//! likewise; `map_d` as the opacity, by its alpha if it has one; `map_Bump` or `bump` as heights, times `-bm`; `norm` as normals. Numbers
//! are the luminance of colours unless `-imfchan` names a channel.

use sampling::bsdf::{Bsdf, Dielectric, Ggx, Lambert, Mirror, RoughConductor};
use sampling::math::Spectrum;
use sampling::vec2;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::mtl::{Map, Statements};
use super::translation::NoteKind;
use crate::builder::Emission;
use crate::material::{Material, Scattering, Varying};
use crate::relief::{Relief, ReliefMap};
use crate::texture::{Channel, Encoding, Image, ImageTexture, Texture, UvMap, Wrap};

/// Kd below which nothing is matte beside its highlight.
const BLACK: f64 = 0.05;

/// A material made of MTL statements.
#[derive(Clone, Debug)]
pub struct Appearance {
    /// How it scatters, without maps.
    pub bsdf: Bsdf,
    /// How much of what meets it is met, if not all is.
    pub opacity: Option<f32>,
    /// Emitted radiance \[W/(m²·sr)\], if it emits, without maps.
    pub emission: Option<Spectrum>,
    /// What meshes with texture coordinates have in place of these.
    pub maps: Maps,
    /// What was approximated or left out.
    pub notes: Vec<(NoteKind, String)>,
}

/// What images give.
#[derive(Clone, Debug, Default)]
pub struct Maps {
    /// The albedo of what is matte.
    pub albedo: Option<Texture>,
    /// Emitted radiance \[W/(m²·sr)\].
    pub emission: Option<Texture>,
    /// The share of what is met.
    pub opacity: Option<Texture>,
    /// Heights or normals.
    pub relief: Option<Relief>,
}

impl Appearance {
    /// What stands for a material that is missing: matte, of albedo 0.5.
    pub fn missing() -> Self {
        let bsdf = Lambert { albedo: Spectrum::splat(0.5) }.into();
        Self { bsdf, opacity: None, emission: None, maps: Maps::default(), notes: Vec::new() }
    }

    /// Whether light passes through it.
    pub fn transmits(&self) -> bool {
        matches!(self.bsdf, Bsdf::Dielectric(_) | Bsdf::RoughDielectric(_))
    }

    /// Whether it has maps of how it scatters.
    pub fn is_mapped(&self) -> bool {
        self.maps.albedo.is_some() || self.maps.opacity.is_some() || self.maps.relief.is_some()
    }

    /// The material of a mesh.
    pub fn material(&self, has_uvs: bool) -> Material {
        let none = Maps::default();
        let maps = if has_uvs { &self.maps } else { &none };
        let opacity = maps.opacity.clone().or(self.opacity.map(Texture::from));
        if maps.albedo.is_none() && maps.relief.is_none() && opacity.is_none() {
            return self.bsdf.into();
        }
        let scattering = match &maps.albedo {
            Some(albedo) => Scattering::lambert(albedo.clone()),
            None => Scattering::Same(self.bsdf),
        };
        let mut varying = Varying::of(scattering);
        (varying.relief, varying.opacity) = (maps.relief.clone(), opacity);
        varying.into()
    }

    /// What a mesh emits.
    pub fn emitted(&self, has_uvs: bool) -> Option<Emission> {
        let map = self.maps.emission.clone().filter(|_| has_uvs);
        map.or(self.emission.map(Texture::Constant)).map(|radiance| Emission { radiance, two_sided: false })
    }

    /// Applies the rule.
    pub fn of(stated: &Statements, images: &mut Images) -> Self {
        let mut told = Told::default();
        let bsdf = scattering(stated, &mut told);
        for (keyword, rest) in &stated.ignored {
            match keyword.as_str() {
                // The ambient colour has no meaning where light is transported.
                "Ka" | "map_Ka" => told.0.push((NoteKind::Ignored, format!("`{keyword}` is not read"))),
                _ => told.approximated(format!("`{keyword} {rest}` is not read")),
            }
        }
        let share = opacity(stated, &mut told);
        let mut opacity = share.filter(|share| !is_glass(stated) && *share < 1.0).map(|share| share.max(0.0) as f32);
        let emission = stated.emission.map(spectrum).filter(|emission| !emission.is_zero());
        let mut maps = maps(stated, &bsdf, images, &mut told);
        if (emission.is_some() || maps.emission.is_some()) && (opacity.is_some() || maps.opacity.is_some()) {
            told.approximated("its opacity is left out: it emits");
            (opacity, maps.opacity) = (None, None);
        }
        Self { bsdf, opacity, emission, maps, notes: told.0 }
    }
}

/// What is to be told of a material.
#[derive(Default)]
struct Told(Vec<(NoteKind, String)>);

impl Told {
    fn approximated(&mut self, text: impl Into<String>) {
        self.0.push((NoteKind::Approximated, text.into()));
    }
}

fn maps(stated: &Statements, bsdf: &Bsdf, images: &mut Images, told: &mut Told) -> Maps {
    let mut maps = Maps::default();
    let mut open = |keyword: &str, map: &Option<Map>, reading: Reading| -> Option<Texture> {
        let map = map.as_ref()?;
        if !map.ignored.is_empty() {
            told.approximated(format!("the options `{}` of its {keyword} are not read", map.ignored));
        }
        let left_out = |message| told.approximated(format!("its {keyword} `{}` is left out: {message}", map.file));
        texture(map, reading, images).map_err(left_out).ok()
    };
    let alone = |colour: Spectrum| if colour.is_zero() { Spectrum::ONE } else { colour };
    let matte = if let Bsdf::Lambert(lambert) = bsdf { Some(alone(lambert.albedo)) } else { None };
    if let Some(scale) = matte {
        maps.albedo = open("map_Kd", &stated.diffuse_map, Reading::Share(scale));
    }
    let emitted = stated.emission.map_or(Spectrum::ONE, |colour| alone(spectrum(colour)));
    maps.emission = open("map_Ke", &stated.emission_map, Reading::Colour(emitted));
    if !is_glass(stated) {
        maps.opacity = open("map_d", &stated.opacity_map, Reading::Opacity);
    }
    let heights = open("map_Bump", &stated.bump_map, Reading::Heights).map(ReliefMap::Heights);
    let normals = open("norm", &stated.normal_map, Reading::Normals).map(ReliefMap::Normals);
    if heights.is_some() && normals.is_some() {
        told.approximated("of its map_Bump and its norm only the latter is kept");
    }
    maps.relief = normals.or(heights).map(Relief::from);
    if let (None, Some(map)) = (matte, &stated.diffuse_map) {
        told.approximated(format!(
            "its map_Kd `{}` is left out: it is {}",
            map.file,
            if is_glass(stated) { "glass" } else { "a metal" }
        ));
    }
    if let (true, Some(map)) = (is_glass(stated), &stated.opacity_map) {
        told.approximated(format!("its map_d `{}` is not read: it is glass", map.file));
    }
    maps
}

/// What an image stands for.
#[derive(Clone, Copy)]
enum Reading {
    /// A colour, times another, at most 1.
    Share(Spectrum),
    /// A colour, times another.
    Colour(Spectrum),
    /// The share of what is met.
    Opacity,
    /// Heights.
    Heights,
    /// Normals.
    Normals,
}

/// The images that the materials of a file name, each read once.
#[derive(Debug, Default)]
pub struct Images {
    folder: PathBuf,
    known: BTreeMap<(PathBuf, Encoding), Result<Arc<Image>, String>>,
}

impl Images {
    /// They are looked for in `folder`.
    pub fn within(folder: &Path) -> Self {
        Self { folder: folder.to_path_buf(), known: BTreeMap::new() }
    }

    fn get(&mut self, file: &str, encoding: Encoding) -> Result<Arc<Image>, String> {
        let path = self.folder.join(file.replace('\\', "/"));
        let read = |path: &Path| {
            let bytes = crate::file::read(path).map_err(|error| error.to_string())?;
            Image::decode(&bytes, None, encoding).map(Arc::new)
        };
        self.known.entry((path, encoding)).or_insert_with_key(|(path, _)| read(path)).clone()
    }
}

fn texture(map: &Map, reading: Reading, images: &mut Images) -> Result<Texture, String> {
    let encoding =
        if matches!(reading, Reading::Share(_) | Reading::Colour(_)) { Encoding::Srgb } else { Encoding::Linear };
    let image = images.get(&map.file, encoding)?;
    let named = map.channel.and_then(|channel| match channel {
        'r' => Some(Channel::One(0)),
        'g' => Some(Channel::One(1)),
        'b' => Some(Channel::One(2)),
        'm' => Some(Channel::ALPHA),
        'l' => Some(Channel::Luminance),
        _ => None,
    });
    let (channel, scale) = match reading {
        Reading::Share(scale) | Reading::Colour(scale) => (named.unwrap_or(Channel::Colour), scale),
        Reading::Opacity if image.has_alpha() => (named.unwrap_or(Channel::ALPHA), Spectrum::ONE),
        Reading::Opacity => (named.unwrap_or(Channel::Luminance), Spectrum::ONE),
        Reading::Heights => (named.unwrap_or(Channel::Luminance), Spectrum::splat(map.multiplier as f32)),
        Reading::Normals => (Channel::Colour, Spectrum::ONE),
    };
    let [scale_uv, offset] = [map.scale, map.offset].map(|[u, v]| vec2(u as f32, v as f32));
    let wrap = if map.clamped { Wrap::Clamp } else { Wrap::Repeat };
    let texture = ImageTexture { image, wrap, map: UvMap { scale: scale_uv, offset }, channel, scale };
    let (low, high) = texture.range();
    match reading {
        Reading::Share(_) | Reading::Opacity if high.max_component() > 1.0 => Err("it reaches more than 1".to_string()),
        Reading::Normals if high.to_array()[2] <= 0.5 => Err("all of its normals point inwards".to_string()),
        _ if low.to_array().iter().any(|x| *x < 0.0) && !matches!(reading, Reading::Heights) => {
            Err("it reaches less than 0".to_string())
        }
        _ => Ok(Texture::Image(texture)),
    }
}

fn scattering(stated: &Statements, told: &mut Told) -> Bsdf {
    if is_glass(stated) {
        return glass(stated, told);
    }
    let diffuse = stated.diffuse.unwrap_or(if stated.specular.is_some() { [0.0; 3] } else { [0.5; 3] });
    let specular = stated.specular.unwrap_or([0.0; 3]);
    let (kd, ks) = (mean(diffuse), mean(specular));
    if !is_metal(stated, kd, ks) {
        if !matches!(stated.illumination, Some(0 | 1)) && ks > 0.0 && (kd > 0.0 || stated.diffuse_map.is_some()) {
            told.approximated("Kd and Ks are both above 0: the highlight, Ks, is left out");
        }
        return Lambert { albedo: reflectance("Kd", diffuse, told) }.into();
    }
    if kd > 0.0 {
        told.approximated("Kd and Ks are both above 0: the weaker, Kd, is left out");
    }
    let reflectance = reflectance("Ks", specular, told);
    let sharp = stated.exponent.is_some_and(|exponent| exponent >= 1000.0);
    let traced = match stated.illumination {
        Some(5) => true,
        Some(3 | 8) => stated.exponent.is_none(),
        _ => false,
    };
    if kd < BLACK && (sharp || traced) {
        return Mirror { reflectance }.into();
    }
    let alpha = (2.0 / (stated.exponent.unwrap_or(10.0).max(0.0) + 2.0)).sqrt() as f32;
    let alpha = alpha.max(Ggx::MIN_ALPHA);
    told.approximated(format!("its highlight of exponent Ns becomes that of a GGX conductor of alpha {alpha:.3}"));
    RoughConductor::from_reflectance(reflectance, alpha, alpha).into()
}

/// Whether it is a mirror or a metal: what is matte beside its highlight stays matte where it can.
fn is_metal(stated: &Statements, kd: f64, ks: f64) -> bool {
    let mirrors = matches!(stated.illumination, Some(3 | 5 | 8));
    let highlights = !matches!(stated.illumination, Some(0 | 1));
    let too_much = kd + ks > 1.0 && stated.exponent.is_none_or(|exponent| exponent > 0.0);
    ks > kd && highlights && (mirrors || (stated.diffuse_map.is_none() && (kd < BLACK || too_much)))
}

/// Whether its `illum` says that light goes through it.
fn says_transparent(stated: &Statements) -> bool {
    matches!(stated.illumination, Some(4 | 6 | 7 | 9))
}

/// How much of what meets it is met, if it says so.
fn opacity(stated: &Statements, told: &mut Told) -> Option<f64> {
    if stated.opacity.is_some() {
        return stated.opacity;
    }
    let transparency = stated.transparency?;
    if transparency >= 1.0 && !says_transparent(stated) {
        told.approximated(
            "its Tr of 1, without d and without an illum of glass, is taken for opaque, as many programs mean it",
        );
        return None;
    }
    Some(1.0 - transparency)
}

fn is_glass(stated: &Statements) -> bool {
    let filtered = stated.filter.is_some_and(|filter| mean(filter) > 0.0);
    let stated_opacity = stated.opacity.or(stated.transparency.map(|transparency| 1.0 - transparency));
    match stated.illumination {
        Some(6 | 7) => true,
        Some(4 | 9) => stated_opacity.unwrap_or(1.0) < 1.0 || filtered,
        _ => stated.opacity.is_some_and(|opacity| opacity < 0.5),
    }
}

fn glass(stated: &Statements, told: &mut Told) -> Bsdf {
    let eta = match stated.index {
        Some(index) if index >= 0.01 => index as f32,
        Some(index) => {
            told.approximated(format!("its index Ni of {index} cannot be, and is taken as 1.5"));
            1.5
        }
        None => {
            told.approximated("it is glass without an index Ni, which is taken as 1.5");
            1.5
        }
    };
    if stated.filter.is_some_and(|filter| filter != [1.0; 3] && filter != [0.0; 3]) {
        told.approximated("its transmission filter Tf is taken as white");
    }
    let opacity = stated.opacity.or(stated.transparency.map(|transparency| 1.0 - transparency));
    if opacity.is_some_and(|opacity| opacity > 0.0 && opacity < 1.0) {
        told.approximated("it is partly opaque (d > 0), and is taken as clear");
    }
    Dielectric { eta }.into()
}

fn reflectance(keyword: &str, channels: [f64; 3], told: &mut Told) -> Spectrum {
    if channels.iter().any(|&channel| channel > 1.0) {
        told.approximated(format!("its {keyword} is above 1, and is taken as 1"));
    }
    spectrum(channels.map(|channel| channel.min(1.0)))
}

fn mean(channels: [f64; 3]) -> f64 {
    channels.iter().sum::<f64>() / 3.0
}

fn spectrum(channels: [f64; 3]) -> Spectrum {
    Spectrum::from(channels.map(|channel| channel as f32))
}

#[cfg(test)]
pub(super) mod tests;
