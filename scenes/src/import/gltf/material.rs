//! Materials: which model of ours a file's is, with what it emits and where it is not there.
//!
//! The core's metallic-roughness is Disney's `principled` here. Its metal is the same, GGX with Schlick's Fresnel term of the base
//! colour; of its dielectric the highlight is by Fresnel's equations, and the diffuse part Disney's. A dielectric without
//! highlights is `lambert`.

use std::rc::Rc;

use super::appearance::Appearance;
use super::context::Context;
use super::document::Item;
use super::model::{self, Model};
use super::schema::{Kind, TextureInfo};
use super::texture::{self, Texture, UvPlan};
use super::{image, model::Surface};
use crate::error::SceneError;
use crate::import::translation::{self, Lines, Place, quoted};

/// What a mesh has that its material may be read by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Form {
    /// Whether it has texture coordinates.
    pub has_uvs: bool,
    /// The colours of its vertices.
    pub tint: Tint,
}

/// Colours of vertices, with their opacity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Tint {
    /// One for all, as the bits of its numbers.
    Same([u64; 4]),
    /// One for each.
    Varying,
}

/// A material that is written.
pub struct Written {
    /// Its name.
    pub name: String,
    /// What it emits, as TOML, and whether on both sides.
    pub emission: Option<(String, bool)>,
    /// What the colours of vertices are multiplied by that the mesh is to be written with; `None` where none are read.
    pub vertex_factor: Option<[f64; 3]>,
}

/// Where a material is described.
pub struct Source<'t> {
    /// The material.
    pub item: Item<'t>,
    /// Its line.
    pub place: Place,
    /// What it says.
    pub appearance: Appearance,
    /// What it is called.
    pub name: String,
    /// The coordinates that its textures are read by.
    pub plan: UvPlan,
    /// Whether there are any.
    pub has_uvs: bool,
}

/// What the material of this number says; without one, `by` who lacks it, the specification's own.
pub fn source<'t>(
    index: Option<usize>,
    by: &Item<'t>,
    context: &mut Context<'_, 't>,
) -> Result<Source<'t>, SceneError> {
    let document = &context.asset.document;
    let (item, mut appearance, name) = match index {
        Some(index) => {
            let item = document.item(Kind::Material, index, by)?;
            let name = item.name().unwrap_or_else(|| format!("material_{index}"));
            (item, document.parse(&item)?, name)
        }
        None => (*by, Appearance::default(), "default".to_string()),
    };
    let place = document.place_of_item(&item);
    if let Some(glossiness) = appearance.extensions.glossiness.take() {
        model::of_glossiness(&glossiness, &mut appearance);
        let text =
            "a material by specular and glossiness is taken as metallic-roughness: a dielectric of its diffuse colour";
        context.approximate(&place, text);
    }
    let plan = UvPlan::of(&appearance.textures());
    Ok(Source { item, place, appearance, name, plan, has_uvs: false })
}

/// The material on a mesh of this form, written once.
pub fn written<'t>(
    index: Option<usize>,
    mut source: Source<'t>,
    form: Form,
    context: &mut Context<'_, 't>,
) -> Result<Rc<Written>, SceneError> {
    if let Some(written) = context.written.get(&(index, form)) {
        return Ok(written.clone());
    }
    source.has_uvs = form.has_uvs;
    let written = Rc::new(write(&source, form.tint, context)?);
    context.written.insert((index, form), written.clone());
    Ok(written)
}

impl<'t> Source<'t> {
    /// A texture, if it can be read.
    pub fn picture(
        &self,
        info: Option<&TextureInfo>,
        context: &mut Context<'_, 't>,
    ) -> Result<Option<texture::Picture>, SceneError> {
        let Some(info) = info else { return Ok(None) };
        if !self.has_uvs {
            let text = "a texture on a mesh without its texture coordinates is left out";
            context.approximate(&self.place, text);
            return Ok(None);
        }
        texture::read(info, &self.plan, &self.item, context)
    }

    /// A number times a channel of a texture.
    pub fn number(
        &self,
        factor: f64,
        info: Option<&TextureInfo>,
        channel: char,
        context: &mut Context<'_, 't>,
    ) -> Result<Texture, SceneError> {
        let factor = self.share(factor, context);
        let picture = if factor > 0.0 { self.picture(info, context)? } else { None };
        Ok(match picture {
            Some(picture) => Texture::Image(picture.channel(channel).scaled([factor; 3])),
            None => Texture::grey(factor),
        })
    }

    /// A factor brought to 0 and 1.
    pub fn share(&self, factor: f64, context: &mut Context) -> f64 {
        if !(0.0..=1.0).contains(&factor) {
            context.approximate(&self.place, format!("the factor {factor} of a material is brought to 0 and 1"));
        }
        factor.clamp(0.0, 1.0)
    }
}

fn write<'t>(source: &Source<'t>, tint: Tint, context: &mut Context<'_, 't>) -> Result<Written, SceneError> {
    let (place, appearance) = (&source.place, &source.appearance);
    let same = match tint {
        Tint::Same(bits) => Some(bits.map(f64::from_bits)),
        Tint::Varying => None,
    };
    let [r, g, b, alpha] = appearance.pbr.base_color_factor;
    let tint = same.unwrap_or([1.0; 4]);
    let factor = [r * tint[0], g * tint[1], b * tint[2]].map(|channel| source.share(channel, context));
    let picture = source.picture(appearance.pbr.base_color_texture.as_ref(), context)?;
    let mut vertex_factor = None;
    let base = match picture {
        Some(picture) => {
            if same.is_none() {
                context.approximate(place, "colours of vertices are left out where an image is the base colour");
            }
            Texture::Image(picture.scaled(factor))
        }
        None if same.is_none() => {
            vertex_factor = Some(factor);
            Texture::VertexColours
        }
        None => Texture::Constant(factor),
    };
    let opacity = opacity(source, alpha * tint[3], same.is_none(), context)?;
    let is_unlit = appearance.extensions.unlit.is_some();
    let emission = if is_unlit { unlit(source, &base, context)? } else { emission(source, context)? };
    let emits = emission.is_some();
    if emits && opacity.is_some() {
        context.approximate(place, "the opacity of what emits is left out");
    }
    let opacity = opacity.filter(|_| !emits);
    let surface = Surface { source, base };
    let model = if is_unlit { Model::black() } else { surface.model(context)? };
    let relief = if is_unlit { None } else { relief(source, context)? };
    if appearance.occlusion_texture.is_some() {
        context.ignore(place, "an `occlusionTexture`: light finds its own shadows");
    }
    for name in appearance.extensions.others.keys() {
        context.approximate(place, format!("`{}` of materials is left out", crate::suggest::shown(name)));
    }
    if !appearance.double_sided && opacity.is_none() && !model.transmits {
        context.approximate(place, "a material that is not `doubleSided` is seen from behind as well");
    }
    let name = context.fresh_name(&source.name);
    let parts = model.parts.iter().enumerate().map(|(i, part)| {
        let part_name = context.fresh_name(&format!("{}_part{}", source.name, i + 1));
        (part_name, part)
    });
    let parts: Vec<(String, &Model)> = parts.collect();
    let names: Vec<String> = parts.iter().map(|(name, _)| name.clone()).collect();
    let mut lines = Lines::default();
    for (name, part) in &parts {
        table(name, part, &[], place, &mut lines);
    }
    table(&name, &model, &names, place, &mut lines);
    if let Some(relief) = relief {
        lines.key(place, "normal_map", relief.toml());
    }
    if let Some(opacity) = opacity {
        lines.key(place, "opacity", opacity.toml());
    }
    context.materials.append(lines);
    let title =
        if source.item.title().starts_with("material") { source.item.title() } else { "the usual material".into() };
    context.mapped(place, format!("{title} becomes `{}`", model.kind));
    Ok(Written { name, emission: emission.map(|emission| (emission.toml(), appearance.double_sided)), vertex_factor })
}

fn table(name: &str, model: &Model, parts: &[String], place: &Place, lines: &mut Lines) {
    lines.table(place, format!("[materials.{}]", translation::key(name)));
    lines.key(place, "type", quoted(model.kind));
    for (key, part) in ["first", "second"].into_iter().zip(parts) {
        lines.key(place, key, quoted(part));
    }
    for (key, value) in &model.keys {
        lines.key(place, key, value.toml());
    }
}

/// Where the material is not there; `None` where it is all there.
fn opacity<'t>(
    source: &Source<'t>,
    factor: f64,
    varies: bool,
    context: &mut Context<'_, 't>,
) -> Result<Option<Texture>, SceneError> {
    let (place, appearance) = (&source.place, &source.appearance);
    let cutoff = match appearance.alpha_mode.as_deref() {
        None | Some("OPAQUE") => return Ok(None),
        Some("BLEND") => None,
        Some("MASK") => Some(appearance.alpha_cutoff.unwrap_or(0.5)),
        Some(other) => {
            let message = format!("has the `alphaMode` `{}`", crate::suggest::shown(other));
            return Err(context.asset.document.error(&source.item, message, "give OPAQUE, MASK or BLEND"));
        }
    };
    if varies {
        context.approximate(place, "the opacity of vertices is left out");
    }
    let factor = source.share(factor, context);
    let info = appearance.pbr.base_color_texture.as_ref();
    let picture = source.picture(info, context)?;
    let Some((picture, info)) = picture.zip(info) else {
        let there = cutoff.map_or(factor, |cutoff| if factor >= cutoff { 1.0 } else { 0.0 });
        return Ok((there < 1.0).then(|| Texture::grey(there)));
    };
    let index = texture::source(info, &source.item, context)?;
    let has_alpha = image::facts(index, &source.item, context)?.has_alpha;
    let Some(cutoff) = cutoff else {
        return Ok(match has_alpha {
            true => Some(Texture::Image(picture.channel('a').scaled([factor; 3]))),
            false => (factor < 1.0).then(|| Texture::grey(factor)),
        });
    };
    if !has_alpha {
        return Ok((factor < cutoff).then(|| Texture::grey(0.0)));
    }
    context.approximate(place, "a mask is cut at its `alphaCutoff` texel by texel");
    let paint = |texel: [f32; 4]| {
        let there = if factor * f64::from(texel[3]) >= cutoff { 1.0 } else { 0.0 };
        [there, there, there, 1.0]
    };
    let what = ("mask", format!("{factor} {cutoff}"));
    let file = image::repainted(index, &source.item, what, paint, context)?;
    Ok(Some(Texture::Image(picture.of(file).channel('r'))))
}

/// What an unlit material shows: its base colour, whatever light there is.
fn unlit<'t>(
    source: &Source<'t>,
    base: &Texture,
    context: &mut Context<'_, 't>,
) -> Result<Option<Texture>, SceneError> {
    context.approximate(&source.place, "an unlit material is black and emits its base colour, which lights others");
    let shines = match (base, &source.appearance.pbr.base_color_texture) {
        (Texture::Constant(colour), _) => colour.iter().any(|&channel| channel > 0.0),
        (Texture::Image(_), Some(info)) => shines(source, info, context)?,
        _ => true,
    };
    Ok(shines.then(|| base.clone()))
}

/// Whether an image is anywhere other than black.
fn shines<'t>(source: &Source<'t>, info: &TextureInfo, context: &mut Context<'_, 't>) -> Result<bool, SceneError> {
    let index = texture::source(info, &source.item, context)?;
    let greatest = image::facts(index, &source.item, context)?.greatest;
    Ok(greatest[..3].iter().any(|&channel| channel > 0.0))
}

/// What a material emits [W/(m²·sr)]: a nit is taken as one.
fn emission<'t>(source: &Source<'t>, context: &mut Context<'_, 't>) -> Result<Option<Texture>, SceneError> {
    let appearance = &source.appearance;
    let strength = appearance.extensions.emissive_strength.as_ref().map_or(1.0, |emission| emission.emissive_strength);
    let factor = appearance.emissive_factor.map(|channel| (channel * strength).max(0.0));
    if factor == [0.0; 3] {
        return Ok(None);
    }
    let Some(info) = &appearance.emissive_texture else { return Ok(Some(Texture::Constant(factor))) };
    if !shines(source, info, context)? {
        context.ignore(&source.place, "an `emissiveTexture` that is black");
        return Ok(None);
    }
    let picture = source.picture(Some(info), context)?;
    Ok(Some(picture.map_or(Texture::Constant(factor), |picture| Texture::Image(picture.scaled(factor)))))
}

/// The map of normals.
fn relief<'t>(source: &Source<'t>, context: &mut Context<'_, 't>) -> Result<Option<Texture>, SceneError> {
    let Some(info) = &source.appearance.normal_texture else { return Ok(None) };
    let Some(picture) = source.picture(Some(info), context)? else { return Ok(None) };
    let index = texture::source(info, &source.item, context)?;
    if image::facts(index, &source.item, context)?.greatest[2] <= 0.5 {
        context.approximate(&source.place, "a `normalTexture` whose normals all point inwards is left out");
        return Ok(None);
    }
    if info.scale == 1.0 {
        return Ok(Some(Texture::Image(picture)));
    }
    let tilted = |[r, g, b, _]: [f32; 4]| {
        let normal = glam::Vec3::new(r, g, b) * 2.0 - 1.0;
        let scale = info.scale as f32;
        let normal = (normal * glam::Vec3::new(scale, scale, 1.0)).normalize_or(glam::Vec3::Z);
        let [r, g, b] = (normal * 0.5 + 0.5).to_array();
        [r, g, b, 1.0]
    };
    let file = image::repainted(index, &source.item, ("normals", info.scale.to_string()), tilted, context)?;
    Ok(Some(Texture::Image(picture.of(file))))
}
