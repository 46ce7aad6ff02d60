//! Textures, and the numbers and colours that stand where one may.
//!
//! Mitsuba's images have v = 0 at their upper border and ours at their lower one; its OBJ files are read with v turned over,
//! other meshes as they are. So where a texture is written depends on the shape: `turned` says that its v is 1 − ours.

use glam::{DMat4, DVec2};

use super::context::Context;
use super::observer::luminance;
use super::plugin::Plugin;
use super::spectrum::{self, Quantity};
use super::transform;
use super::xml::Element;
use crate::error::SceneError;
use crate::import::translation::{colour, quoted};
use crate::import::uv_map::UvMap;

/// Colours over a surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Texture {
    /// One colour.
    Constant([f64; 3]),
    /// An image, or its luminance, times a colour.
    Image(Image),
    /// Squares.
    Checkerboard { values: [[f64; 3]; 2], map: UvMap },
    /// Colours of a mesh's vertices.
    VertexColours,
}

/// An image over a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    file: String,
    encoding: Option<&'static str>,
    wrap: &'static str,
    grey: bool,
    scale: [f64; 3],
    map: UvMap,
}

impl Texture {
    /// A grey.
    pub fn grey(value: f64) -> Self {
        Self::Constant([value; 3])
    }

    /// Its colour, if it has but one.
    pub fn constant(&self) -> Option<[f64; 3]> {
        if let Self::Constant(colour) = self { Some(*colour) } else { None }
    }

    /// Its number, if it has but one.
    pub fn number(&self) -> Option<f64> {
        self.constant().map(luminance)
    }

    /// Its luminance.
    pub fn luminance(self) -> Self {
        let grey = |colour| [luminance(colour); 3];
        match self {
            Self::Constant(colour) => Self::Constant(grey(colour)),
            Self::Image(image) => Self::Image(Image { grey: true, ..image }),
            Self::Checkerboard { values, map } => Self::Checkerboard { values: values.map(grey), map },
            Self::VertexColours => self,
        }
    }

    /// What it is about everywhere.
    pub fn mean(&self) -> [f64; 3] {
        match self {
            Self::Constant(colour) => *colour,
            Self::Image(image) => image.scale.map(|c| 0.5 * c),
            Self::Checkerboard { values: [a, b], .. } => std::array::from_fn(|c| 0.5 * (a[c] + b[c])),
            Self::VertexColours => [0.5; 3],
        }
    }

    /// Each value times that of a colour; `None` where that cannot be said.
    pub fn scaled(self, by: [f64; 3]) -> Option<Self> {
        let times = |a: [f64; 3]| std::array::from_fn(|c| a[c] * by[c]);
        match self {
            Self::Constant(colour) => Some(Self::Constant(times(colour))),
            Self::Image(image) => Some(Self::Image(Image { scale: times(image.scale), ..image })),
            Self::Checkerboard { values, map } => Some(Self::Checkerboard { values: values.map(times), map }),
            Self::VertexColours if by == [1.0; 3] => Some(self),
            Self::VertexColours => None,
        }
    }

    /// As TOML; `turned` where the shape's v is Mitsuba's turned over.
    pub fn toml(&self, turned: bool) -> String {
        let shape = if turned { UvMap::TURNED } else { UvMap::IDENTITY };
        match self {
            Self::Constant(value) => colour(*value),
            Self::Image(image) => image.toml(shape),
            Self::Checkerboard { values: [a, b], map } => {
                format!("{{ checkerboard = [{}, {}]{} }}", colour(*a), colour(*b), shape.then(*map).keys())
            }
            Self::VertexColours => "{ vertex_colours = true }".to_string(),
        }
    }
}

impl Image {
    /// As TOML, on a shape whose coordinates are Mitsuba's by `shape`.
    fn toml(&self, shape: UvMap) -> String {
        let mut text = format!("{{ image = {}", quoted(&self.file));
        if let Some(encoding) = self.encoding {
            text += &format!(", encoding = \"{encoding}\"");
        }
        if self.wrap != "repeat" {
            text += &format!(", wrap = \"{}\"", self.wrap);
        }
        if self.grey {
            text += ", channel = \"luminance\"";
        }
        if self.scale != [1.0; 3] {
            text += &format!(", scale = {}", colour(self.scale));
        }
        text + &shape.then(self.map).then(UvMap::TURNED).keys() + " }"
    }
}

/// The parameter `name`, a number or a texture, of whose colours Mitsuba takes the luminance.
pub fn number<'a>(
    plugin: &Plugin<'a>,
    name: &str,
    quantity: Quantity,
    otherwise: f64,
    context: &mut Context<'a>,
) -> Result<Texture, SceneError> {
    parameter(plugin, name, quantity, otherwise, context).map(Texture::luminance)
}

/// The parameter `name`, a colour or a texture.
pub fn parameter<'a>(
    plugin: &Plugin<'a>,
    name: &str,
    quantity: Quantity,
    otherwise: f64,
    context: &mut Context<'a>,
) -> Result<Texture, SceneError> {
    match plugin.part(name) {
        None => Ok(Texture::grey(otherwise)),
        Some(part) => read(part, quantity, context),
    }
}

/// A colour or a texture.
pub fn read<'a>(element: &'a Element, quantity: Quantity, context: &mut Context<'a>) -> Result<Texture, SceneError> {
    if spectrum::is_colour(element) {
        return spectrum::colour(element, quantity, context).map(Texture::Constant);
    }
    if element.tag != "texture" {
        return Err(element.place.error(format!("{} is neither a colour nor a texture", element.title()), "give one"));
    }
    context.enter(element)?;
    let plugin = Plugin::new(element, context)?;
    let texture = match plugin.kind() {
        "bitmap" | "ldrtexture" | "exrtexture" => bitmap(&plugin, context)?,
        "checkerboard" => {
            let a = parameter(&plugin, "color0", quantity, 0.4, context)?.mean();
            let b = parameter(&plugin, "color1", quantity, 0.2, context)?.mean();
            Texture::Checkerboard { values: [a, b], map: uv_map(&plugin, context)? }
        }
        "mesh_attribute" | "vertexcolors" => {
            if plugin.text("name")?.is_some_and(|name| name.starts_with("face_")) {
                context.approximate(plugin.place(), "an attribute of faces is taken for the colours of vertices");
            }
            Texture::VertexColours
        }
        "scale" => scaled(&plugin, quantity, context)?,
        kind => {
            context.approximate(plugin.place(), format!("a texture `{kind}` is not known, and is taken as 0.5"));
            Texture::grey(0.5)
        }
    };
    context.mapped(
        element,
        match texture {
            Texture::Image(_) => "an `image`",
            Texture::Checkerboard { .. } => "a `checkerboard`",
            Texture::VertexColours => "`vertex_colours`",
            Texture::Constant(_) => "a colour",
        },
    );
    if texture.constant().is_none() {
        plugin.finish(context);
    }
    if matches!(texture, Texture::Image(_) | Texture::Checkerboard { .. }) {
        context.uv_textures += 1;
    }
    context.leave();
    Ok(texture)
}

/// A texture times a number.
fn scaled<'a>(plugin: &Plugin<'a>, quantity: Quantity, context: &mut Context<'a>) -> Result<Texture, SceneError> {
    let factor = match plugin.part("scale") {
        Some(part) => spectrum::colour(part, Quantity::Index, context)?,
        None => [1.0; 3],
    };
    let inner = plugin.part("value").or_else(|| plugin.tagged("texture").pop());
    let Some(inner) = inner else {
        return Err(plugin.place().error("`texture scale` holds no texture", "add one"));
    };
    let texture = read(inner, quantity, context)?;
    Ok(texture.clone().scaled(factor).unwrap_or_else(|| {
        context.approximate(plugin.place(), "the scale of vertex colours is left out");
        texture
    }))
}

fn bitmap<'a>(plugin: &Plugin<'a>, context: &mut Context<'a>) -> Result<Texture, SceneError> {
    let Some(name) = plugin.text("filename")? else {
        return Err(plugin.place().error("`texture bitmap` has no `filename`", "name an image"));
    };
    let file = match context.find(name, plugin.place()) {
        Some(path) => context.named_from_base(&path),
        None => name.to_string(),
    };
    let raw = plugin.boolean("raw")?.unwrap_or(false) || plugin.float("gamma")? == Some(1.0);
    let ending = file.rsplit('.').next().unwrap_or("").to_lowercase();
    let encoding = match (ending.as_str(), raw) {
        ("exr" | "hdr" | "pfm" | "rgbe", _) => None,
        (_, true) => Some("linear"),
        (_, false) => Some("srgb"),
    };
    if plugin.text("filter_type")?.is_some_and(|filter| filter == "nearest") {
        context.approximate(plugin.place(), "a bitmap with `filter_type` `nearest` is bilinear");
    }
    let wrap = match plugin.text("wrap_mode")?.or(plugin.text("wrap_mode_u")?).unwrap_or("repeat") {
        "repeat" => "repeat",
        "mirror" => "mirror",
        "clamp" => "clamp",
        other => {
            context.approximate(plugin.place(), format!("the `wrap_mode` `{other}` is taken as `clamp`"));
            "clamp"
        }
    };
    if let Some(other) = plugin.text("wrap_mode_v")?.filter(|other| *other != wrap) {
        context.approximate(plugin.place(), format!("the `wrap_mode_v` `{other}` is taken as `{wrap}`, as along u"));
    }
    plugin.skip(&["format", "accel", "max_anisotropy", "cache"]);
    Ok(Texture::Image(Image { file, encoding, wrap, grey: false, scale: [1.0; 3], map: uv_map(plugin, context)? }))
}

/// `to_uv`, or `uscale`, `vscale`, `uoffset`, `voffset` of older files.
fn uv_map<'a>(plugin: &Plugin<'a>, context: &mut Context<'a>) -> Result<UvMap, SceneError> {
    let to_uv = match plugin.part("to_uv") {
        Some(part) => transform::read(part, context)?,
        None => DMat4::IDENTITY,
    };
    let scale = DVec2::new(to_uv.x_axis.x, to_uv.y_axis.y);
    let straight = to_uv.x_axis.y == 0.0 && to_uv.y_axis.x == 0.0 && scale.min_element().abs() > 0.0;
    if !straight {
        context.approximate(plugin.place(), "the rotation of a `to_uv` is left out");
    }
    let first = if straight { UvMap { scale, offset: to_uv.w_axis.truncate().truncate() } } else { UvMap::IDENTITY };
    let scale = DVec2::new(plugin.float_or("uscale", 1.0)?, plugin.float_or("vscale", 1.0)?);
    if scale.x == 0.0 || scale.y == 0.0 {
        return Err(plugin.place().error("`uscale` or `vscale` is 0", "give another number"));
    }
    let offset = DVec2::new(plugin.float_or("uoffset", 0.0)?, plugin.float_or("voffset", 0.0)?);
    Ok(first.then(UvMap { scale, offset }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_stand_upright_on_obj_files_and_are_turned_over_on_the_rest() {
        let map = UvMap { scale: DVec2::new(2.0, 3.0), offset: DVec2::new(0.0, 0.25) };
        let image = |map| {
            let file = "a.png".into();
            Texture::Image(Image { file, encoding: None, wrap: "repeat", grey: false, scale: [1.0; 3], map })
        };
        assert_eq!(image(UvMap::IDENTITY).toml(true), "{ image = \"a.png\" }");
        let turned = "{ image = \"a.png\", uv_scale = [1.0, -1.0], uv_offset = [0.0, 1.0] }";
        assert_eq!(image(UvMap::IDENTITY).toml(false), turned);
        // At Mitsuba's (u, v), here the same, the image is read at (2u, 3v + ¼) from its upper border.
        let text = "{ image = \"a.png\", uv_scale = [2.0, -3.0], uv_offset = [0.0, 0.75] }";
        assert_eq!(image(map).toml(false), text);
        // Ours is 1 − v: 1 − (3 (1 − v) + ¼).
        let text = "{ image = \"a.png\", uv_scale = [2.0, 3.0], uv_offset = [0.0, -2.25] }";
        assert_eq!(image(map).toml(true), text);
    }
}
