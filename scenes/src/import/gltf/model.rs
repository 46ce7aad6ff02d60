//! How a file's materials scatter: the choice of a model and its parameters.

use super::appearance::{Appearance, SpecularGlossiness};
use super::context::Context;
use super::material::Source;
use super::texture::Texture;
use crate::error::SceneError;

/// How rough thin glass may be before it is told that it is taken as smooth.
const SMOOTH: f64 = 0.1;
/// From how bright on a base colour is taken as white.
const WHITE: f64 = 0.95;

/// A model of ours with its parameters.
pub struct Model {
    /// Its name.
    pub kind: &'static str,
    /// Its parameters.
    pub keys: Vec<(&'static str, Texture)>,
    /// Of a mix, what is mixed.
    pub parts: Vec<Model>,
    /// Whether light goes through it.
    pub transmits: bool,
}

impl Model {
    fn new(kind: &'static str, keys: Vec<(&'static str, Texture)>) -> Self {
        Self { kind, keys, parts: Vec::new(), transmits: false }
    }

    fn clear(kind: &'static str, keys: Vec<(&'static str, Texture)>) -> Self {
        Self { transmits: true, ..Self::new(kind, keys) }
    }

    /// One that scatters nothing.
    pub fn black() -> Self {
        Self::new("lambert", vec![("albedo", Texture::grey(0.0))])
    }
}

/// A metallic-roughness material.
pub struct Surface<'a, 't> {
    /// Where it is described.
    pub source: &'a Source<'t>,
    /// Its base colour.
    pub base: Texture,
}

impl<'t> Surface<'_, 't> {
    /// The model that it becomes.
    pub fn model(&self, context: &mut Context<'_, 't>) -> Result<Model, SceneError> {
        let (source, pbr) = (self.source, &self.source.appearance.pbr);
        let both = pbr.metallic_roughness_texture.as_ref();
        let metallic = source.number(pbr.metallic_factor, both, 'b', context)?;
        let roughness = source.number(pbr.roughness_factor, both, 'g', context)?;
        let through = match &source.appearance.extensions.transmission {
            Some(transmission) => {
                let texture = transmission.transmission_texture.as_ref();
                source.number(transmission.transmission_factor, texture, 'r', context)?
            }
            None => Texture::grey(0.0),
        };
        let is_metal = metallic.constant() == Some([1.0; 3]);
        if is_metal || through.constant() == Some([0.0; 3]) {
            return self.opaque(metallic, roughness, context);
        }
        let is_thin = source.appearance.extensions.volume.as_ref().is_none_or(|volume| volume.thickness_factor <= 0.0);
        if is_thin {
            self.thin(metallic, roughness, through, context)
        } else {
            self.solid(metallic, roughness, through, context)
        }
    }

    /// What light does not go through.
    fn opaque(
        &self,
        metallic: Texture,
        roughness: Texture,
        context: &mut Context<'_, 't>,
    ) -> Result<Model, SceneError> {
        let (source, extensions) = (self.source, &self.source.appearance.extensions);
        let is_dielectric = metallic.constant() == Some([0.0; 3]);
        let has_layers = extensions.clearcoat.as_ref().is_some_and(|coat| coat.clearcoat_factor > 0.0)
            || extensions.sheen.as_ref().is_some_and(|sheen| sheen.sheen_color_factor != [0.0; 3]);
        let is_matte = extensions
            .specular
            .as_ref()
            .is_some_and(|specular| specular.specular_factor == 0.0 && specular.specular_texture.is_none());
        if is_dielectric && is_matte && !has_layers {
            return Ok(Model::new("lambert", vec![("albedo", self.base.clone())]));
        }
        if metallic.constant() != Some([1.0; 3]) {
            context
                .approximate(&source.place, "metallic-roughness becomes `principled`, whose diffuse part is Disney's");
        }
        let eta = if metallic.constant() == Some([1.0; 3]) { 1.5 } else { self.eta(true, context) };
        let mut keys = vec![("base_color", self.base.clone()), ("metallic", metallic), ("roughness", roughness)];
        if eta != 1.5 {
            keys.push(("eta", Texture::grey(eta)));
        }
        self.layers(&mut keys, context)?;
        Ok(Model::new("principled", keys))
    }

    /// Index of refraction; where `dimmed`, that which reflects as much at the normal as `KHR_materials_specular` says.
    fn eta(&self, dimmed: bool, context: &mut Context) -> f64 {
        let (source, extensions) = (self.source, &self.source.appearance.extensions);
        let ior = extensions.ior.as_ref().map_or(1.5, |ior| ior.ior);
        let ior = if ior < 0.01 || ior > 100.0 {
            context.approximate(&source.place, format!("the index of refraction {ior} is taken as 1.5"));
            1.5
        } else {
            ior
        };
        let Some(specular) = &extensions.specular else { return ior };
        if specular.specular_texture.is_some() || specular.specular_color_texture.is_some() {
            context.approximate(&source.place, "the textures of `KHR_materials_specular` are left out");
        }
        let [r, g, b] = specular.specular_color_factor;
        let share = specular.specular_factor * (r + g + b) / 3.0;
        if !dimmed || share == 1.0 && r == g && g == b {
            return ior;
        }
        let text = "`KHR_materials_specular` is the index of refraction that reflects as much at the normal";
        context.approximate(&source.place, text);
        let reflected = (((ior - 1.0) / (ior + 1.0)).powi(2) * share.max(0.0)).clamp(0.0, 0.96);
        (1.0 + reflected.sqrt()) / (1.0 - reflected.sqrt())
    }

    /// Clear coat and sheen.
    fn layers(&self, keys: &mut Vec<(&'static str, Texture)>, context: &mut Context<'_, 't>) -> Result<(), SceneError> {
        let (source, extensions) = (self.source, &self.source.appearance.extensions);
        if let Some(coat) = extensions.clearcoat.as_ref().filter(|coat| coat.clearcoat_factor > 0.0) {
            let text = "`KHR_materials_clearcoat` is Disney's clear coat, which is dimmer and dims nothing beneath";
            context.approximate(&source.place, text);
            if coat.clearcoat_roughness_texture.is_some() || coat.clearcoat_normal_texture.is_some() {
                let text = "the textures of a clear coat's roughness and normals are left out";
                context.approximate(&source.place, text);
            }
            let strength = source.number(coat.clearcoat_factor, coat.clearcoat_texture.as_ref(), 'r', context)?;
            // Disney's α runs from 0.1 to 0.001 as the gloss grows.
            let alpha = coat.clearcoat_roughness_factor.powi(2);
            let gloss = ((0.1 - alpha) / (0.1 - 0.001)).clamp(0.0, 1.0);
            keys.extend([("clearcoat", strength), ("clearcoat_gloss", Texture::grey(gloss))]);
        }
        if let Some(sheen) = extensions.sheen.as_ref().filter(|sheen| sheen.sheen_color_factor != [0.0; 3]) {
            context.approximate(&source.place, "`KHR_materials_sheen` is Disney's sheen, white and as strong");
            if sheen.sheen_color_texture.is_some() {
                context.approximate(&source.place, "the texture of a sheen is left out");
            }
            let strength = sheen.sheen_color_factor.into_iter().fold(0.0, f64::max);
            let strength = source.share(strength, context);
            keys.extend([("sheen", Texture::grey(strength)), ("sheen_tint", Texture::grey(0.0))]);
        }
        Ok(())
    }

    /// A thin wall: light goes straight on.
    fn thin(
        &self,
        metallic: Texture,
        roughness: Texture,
        through: Texture,
        context: &mut Context<'_, 't>,
    ) -> Result<Model, SceneError> {
        let place = &self.source.place;
        if roughness.constant().is_none_or(|[roughness, ..]| roughness > SMOOTH) {
            context.approximate(place, "a thin wall is clear, however rough it is");
        }
        let is_white = self.base.constant().is_some_and(|colour| colour.iter().all(|&channel| channel >= WHITE));
        let wall = if is_white {
            context
                .approximate(place, "a thin wall of glass becomes `thin_glass`, which reflects on both of its sides");
            Model::clear("thin_glass", vec![("eta", Texture::grey(self.eta(false, context)))])
        } else {
            context.approximate(place, "a thin wall with a hue becomes `null` of its colour, and reflects nothing");
            Model::clear("null", vec![("transmittance", self.base.clone())])
        };
        let dielectric = metallic.constant().map(|[metal, ..]| 1.0 - metal);
        if through.constant() == Some([1.0; 3]) && dielectric == Some(1.0) {
            return Ok(wall);
        }
        if dielectric.is_none() {
            context.approximate(place, "a texture of metal on a thin wall does not dim what goes through");
        }
        let amount = match (through, dielectric) {
            (Texture::Constant([share, ..]), Some(dielectric)) => Texture::grey(share * dielectric),
            (through, _) => through,
        };
        let rest = self.opaque(metallic, roughness, context)?;
        let keys = vec![("amount", amount)];
        Ok(Model { kind: "mix", keys, parts: vec![rest, wall], transmits: true })
    }

    /// A body that bends light.
    fn solid(
        &self,
        metallic: Texture,
        roughness: Texture,
        through: Texture,
        context: &mut Context<'_, 't>,
    ) -> Result<Model, SceneError> {
        let place = &self.source.place;
        let eta = Texture::grey(self.eta(false, context));
        let absorption = self.absorption();
        let base = match (&self.base, absorption) {
            (base, [1.0, 1.0, 1.0]) => base.clone(),
            (Texture::Constant(base), absorption) => {
                let text = "the absorption within a volume becomes the colour of its surface, by its thickness";
                context.approximate(place, text);
                Texture::Constant(std::array::from_fn(|c| base[c] * absorption[c]))
            }
            (base, _) => {
                context.approximate(place, "the absorption within a volume is left out");
                base.clone()
            }
        };
        let is_glass = through.constant() == Some([1.0; 3]) && metallic.constant() == Some([0.0; 3]);
        if is_glass && base.constant() == Some([1.0; 3]) {
            return Ok(match roughness.constant() {
                Some([0.0, ..]) => Model::clear("dielectric", vec![("eta", eta)]),
                _ => Model::clear("rough_dielectric", vec![("eta", eta), ("roughness", roughness)]),
            });
        }
        let text = "metallic-roughness with transmission becomes `principled`, whose colour is in part that of each way through";
        context.approximate(place, text);
        let mut keys = vec![
            ("base_color", base),
            ("metallic", metallic),
            ("roughness", roughness),
            ("eta", eta),
            ("spec_trans", through),
        ];
        self.layers(&mut keys, context)?;
        Ok(Model::clear("principled", keys))
    }

    /// What is left of light after the thickness of a volume.
    fn absorption(&self) -> [f64; 3] {
        let Some(volume) = &self.source.appearance.extensions.volume else { return [1.0; 3] };
        let Some(distance) = volume.attenuation_distance.filter(|&distance| distance > 0.0) else { return [1.0; 3] };
        volume.attenuation_color.map(|channel| channel.clamp(0.0, 1.0).powf(volume.thickness_factor / distance))
    }
}

/// Writes specular-glossiness as metallic-roughness: a dielectric that reflects as much at the normal.
pub fn of_glossiness(glossiness: &SpecularGlossiness, appearance: &mut Appearance) {
    let pbr = &mut appearance.pbr;
    pbr.base_color_factor = glossiness.diffuse_factor;
    pbr.base_color_texture = glossiness.diffuse_texture;
    pbr.metallic_factor = 0.0;
    pbr.roughness_factor = 1.0 - glossiness.glossiness_factor;
    pbr.metallic_roughness_texture = None;
    let [r, g, b] = glossiness.specular_factor;
    // What reflects more is a metal, which its diffuse colour says nothing of.
    let reflected = ((r + g + b) / 3.0).clamp(0.0, 0.25);
    if glossiness.specular_glossiness_texture.is_none() {
        let ior = (1.0 + reflected.sqrt()) / (1.0 - reflected.sqrt());
        appearance.extensions.ior = Some(super::appearance::Ior { ior });
    } else {
        pbr.roughness_factor = pbr.roughness_factor.max(0.5);
    }
}
