//! Textures: images over texture coordinates.
//!
//! A file's v grows downwards in its images, ours upwards: meshes are written with 1 − v, so that images stand upright and normal
//! maps are what they are here. Of all that is read over a mesh one set of coordinates is kept, that of the first texture of its
//! material; where that texture is turned, by `KHR_texture_transform`, so are the coordinates themselves, since a texture of
//! ours may be scaled and moved alone.

use glam::{DMat3, DVec2, DVec3};

use super::context::Context;
use super::document::Item;
use super::image;
use super::schema::{Kind, Sampler, TextureInfo};
use crate::error::SceneError;
use crate::import::translation::{colour, numbers, quoted};

/// The least that a pattern is scaled by: a scale of 0 shows one texel everywhere.
const LEAST_SCALE: f64 = 1e-9;

/// Colours or numbers over a surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Texture {
    /// The same everywhere.
    Constant([f64; 3]),
    /// An image.
    Image(Picture),
    /// The colours of a mesh's vertices.
    VertexColours,
}

/// An image, times a colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// How the text names it.
    pub file: String,
    wrap: &'static str,
    /// The only channel that is read.
    pub channel: Option<char>,
    scale: [f64; 3],
    uv_scale: DVec2,
    uv_offset: DVec2,
}

/// What the texture coordinates of a mesh are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvPlan {
    /// The file's set.
    pub set: u32,
    /// From the set, with v turned upwards, to what is written.
    map: DMat3,
}

impl UvPlan {
    /// Of a material that reads these textures.
    pub fn of(textures: &[TextureInfo]) -> Self {
        let Some(first) = textures.first() else { return Self { set: 0, map: DMat3::IDENTITY } };
        let map = map_of(first);
        let usable = map.is_finite() && map.determinant().abs() > 1e-12;
        Self { set: set_of(first), map: if usable && !is_straight(&map) { map } else { DMat3::IDENTITY } }
    }

    /// What is written of the file's coordinates.
    pub fn apply(&self, [u, v]: [f64; 2]) -> DVec2 {
        self.map.transform_point2(DVec2::new(u, 1.0 - v))
    }
}

/// The set of coordinates that a texture is read by.
fn set_of(info: &TextureInfo) -> u32 {
    info.extensions.transform.and_then(|transform| transform.tex_coord).unwrap_or(info.tex_coord)
}

/// `KHR_texture_transform` as a map of coordinates whose v grows upwards: offset · rotation · scale between two turns of v.
/// Where v grows downwards, a counter-clockwise rotation takes (1, 0) to (cos, −sin).
fn map_of(info: &TextureInfo) -> DMat3 {
    let Some(transform) = info.extensions.transform else { return DMat3::IDENTITY };
    let (sin, cos) = transform.rotation.sin_cos();
    let column = |x: f64, y: f64| DVec3::new(x, y, 0.0);
    let rotation = DMat3::from_cols(column(cos, -sin), column(sin, cos), DVec3::Z);
    let over = DMat3::from_cols(DVec3::X, DVec3::NEG_Y, DVec3::new(0.0, 1.0, 1.0));
    let (offset, scale) = (DVec2::from(transform.offset), DVec2::from(transform.scale));
    over * DMat3::from_translation(offset) * rotation * DMat3::from_scale(scale) * over
}

/// Whether a map scales and moves alone.
fn is_straight(map: &DMat3) -> bool {
    map.x_axis.y.abs() <= 1e-9 * map.x_axis.x.abs() && map.y_axis.x.abs() <= 1e-9 * map.y_axis.y.abs()
}

/// The texture of a material, `item`, over the coordinates of `plan`; `None`, and a note, where it is read by others.
pub fn read<'t>(
    info: &TextureInfo,
    plan: &UvPlan,
    item: &Item<'t>,
    context: &mut Context<'_, 't>,
) -> Result<Option<Picture>, SceneError> {
    let document = &context.asset.document;
    let place = document.place_of_item(item);
    if set_of(info) != plan.set {
        context.approximate(&place, "a texture by another set of coordinates than its material's first is left out");
        return Ok(None);
    }
    let source = source(info, item, context)?;
    let (texture, by) = texture_of(info, item, context)?;
    let sampler = match texture.sampler {
        Some(sampler) => {
            let sampler = document.item(Kind::Sampler, sampler, &by)?;
            document.parse(&sampler)?
        }
        None => Sampler { mag_filter: None, wrap_s: 10497, wrap_t: 10497 },
    };
    let file = image::file(source, &by, context)?;
    if sampler.wrap_s != sampler.wrap_t {
        context.approximate(&place, "a sampler's `wrapT` is taken as its `wrapS`");
    }
    if sampler.mag_filter == Some(9728) {
        context.approximate(&place, "a sampler's nearest texel is taken as bilinear");
    }
    let wrap = match sampler.wrap_s {
        33071 => "clamp",
        33648 => "mirror",
        _ => "repeat",
    };
    let whole = map_of(info) * plan.map.inverse();
    if !is_straight(&whole) {
        context.approximate(&place, "a texture that is turned otherwise than its material's first is not turned");
    }
    let raw = [whole.x_axis.x, whole.y_axis.y];
    let [x, y] = raw.map(|scale| if scale.abs() < LEAST_SCALE { LEAST_SCALE } else { scale });
    Ok(Some(Picture {
        file,
        wrap,
        channel: None,
        scale: [1.0; 3],
        uv_scale: tidy(DVec2::new(x, y)),
        uv_offset: tidy(whole.z_axis.truncate()),
    }))
}

/// Without what rounding leaves beside whole numbers.
fn tidy(v: DVec2) -> DVec2 {
    let tidied = |x: f64| if (x - x.round()).abs() < 1e-12 { x.round() + 0.0 } else { x };
    DVec2::new(tidied(v.x), tidied(v.y))
}

fn texture_of<'t>(
    info: &TextureInfo,
    item: &Item<'t>,
    context: &Context<'_, 't>,
) -> Result<(super::schema::Texture, Item<'t>), SceneError> {
    let document = &context.asset.document;
    let by = document.item(Kind::Texture, info.index, item)?;
    Ok((document.parse(&by)?, by))
}

/// The number of a texture's image.
pub fn source<'t>(info: &TextureInfo, item: &Item<'t>, context: &Context<'_, 't>) -> Result<usize, SceneError> {
    let (texture, by) = texture_of(info, item, context)?;
    let document = &context.asset.document;
    if let Some(source) = texture.source {
        document.item(Kind::Image, source, &by)?;
        return Ok(source);
    }
    let message = match texture.extensions.keys().next() {
        Some(name) => format!("has an image by `{}` alone, which is not read", crate::suggest::shown(name)),
        None => "has no image".to_string(),
    };
    Err(document.error(&by, message, "give it a PNG or JPEG as its `source`"))
}

impl Picture {
    /// One channel of the image alone.
    pub fn channel(self, channel: char) -> Self {
        Self { channel: Some(channel), ..self }
    }

    /// The image times a colour.
    pub fn scaled(self, scale: [f64; 3]) -> Self {
        Self { scale, ..self }
    }

    /// Another image in its place.
    pub fn of(self, file: String) -> Self {
        Self { file, ..self }
    }
}

impl Texture {
    /// A number that is the same everywhere.
    pub fn grey(value: f64) -> Self {
        Self::Constant([value; 3])
    }

    /// Its colour, if it has but one.
    pub fn constant(&self) -> Option<[f64; 3]> {
        if let Self::Constant(colour) = self { Some(*colour) } else { None }
    }

    /// As TOML.
    pub fn toml(&self) -> String {
        match self {
            Self::Constant(value) => colour(*value),
            Self::VertexColours => "{ vertex_colours = true }".to_string(),
            Self::Image(picture) => {
                let mut text = format!("{{ image = {}", quoted(&picture.file));
                if let Some(channel) = picture.channel {
                    text += &format!(", channel = \"{channel}\"");
                }
                if picture.wrap != "repeat" {
                    text += &format!(", wrap = \"{}\"", picture.wrap);
                }
                if picture.scale != [1.0; 3] {
                    text += &format!(", scale = {}", colour(picture.scale));
                }
                if picture.uv_scale != DVec2::ONE {
                    text += &format!(", uv_scale = {}", numbers(&picture.uv_scale.to_array()));
                }
                if picture.uv_offset != DVec2::ZERO {
                    text += &format!(", uv_offset = {}", numbers(&picture.uv_offset.to_array()));
                }
                text + " }"
            }
        }
    }
}
