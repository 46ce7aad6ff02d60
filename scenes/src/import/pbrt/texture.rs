//! Textures, and the numbers and colours that stand where one may.

use glam::DVec2;

use super::context::Context;
use super::parameters::Parameters;
use super::parser::{Parameter, Values};
use super::spectrum::{self, Quantity};
use crate::error::SceneError;
use crate::import::translation::{colour, quoted};
use crate::import::uv_map::UvMap;
use crate::suggest::did_you_mean;

/// Colours over a surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Texture {
    /// One colour.
    Constant([f64; 3]),
    /// An image, times a colour.
    Image { file: String, encoding: Option<&'static str>, wrap: &'static str, scale: [f64; 3], map: UvMap },
    /// Squares.
    Checkerboard { values: [[f64; 3]; 2], map: UvMap },
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

    /// What it is about everywhere.
    pub fn mean(&self) -> [f64; 3] {
        match self {
            Self::Constant(colour) => *colour,
            Self::Image { scale, .. } => scale.map(|c| 0.5 * c),
            Self::Checkerboard { values: [a, b], .. } => std::array::from_fn(|c| 0.5 * (a[c] + b[c])),
        }
    }

    /// What it is about everywhere, as a number.
    pub fn mean_number(&self) -> f64 {
        let [r, g, b] = self.mean();
        if r == g && g == b { r } else { (r + g + b) / 3.0 }
    }

    /// The greatest of its values; `None` of an image.
    pub fn greatest(&self) -> Option<f64> {
        let values = match self {
            Self::Constant(colour) => colour.as_slice(),
            Self::Checkerboard { values, .. } => values.as_flattened(),
            Self::Image { .. } => return None,
        };
        Some(values.iter().copied().fold(0.0, f64::max))
    }

    /// Each value as a function makes it; `None` of an image.
    pub fn each(&self, function: impl Fn(f64) -> f64) -> Option<Self> {
        match self {
            Self::Constant(colour) => Some(Self::Constant(colour.map(function))),
            Self::Checkerboard { values, map } => {
                Some(Self::Checkerboard { values: values.map(|value| value.map(&function)), map: *map })
            }
            Self::Image { .. } => None,
        }
    }

    /// Each value times that of a colour.
    pub fn scaled(self, by: [f64; 3]) -> Self {
        let times = |a: [f64; 3]| std::array::from_fn(|c| a[c] * by[c]);
        match self {
            Self::Constant(colour) => Self::Constant(times(colour)),
            Self::Image { file, encoding, wrap, scale, map } => {
                Self::Image { file, encoding, wrap, scale: times(scale), map }
            }
            Self::Checkerboard { values, map } => Self::Checkerboard { values: values.map(times), map },
        }
    }

    /// As TOML.
    pub fn toml(&self) -> String {
        match self {
            Self::Constant(value) => colour(*value),
            Self::Image { file, encoding, wrap, scale, map } => {
                let mut text = format!("{{ image = {}", quoted(file));
                if let Some(encoding) = encoding {
                    text += &format!(", encoding = \"{encoding}\"");
                }
                if *wrap != "repeat" {
                    text += &format!(", wrap = \"{wrap}\"");
                }
                if *scale != [1.0; 3] {
                    text += &format!(", scale = {}", colour(*scale));
                }
                text + &map.keys() + " }"
            }
            Self::Checkerboard { values: [a, b], map } => {
                format!("{{ checkerboard = [{}, {}]{} }}", colour(*a), colour(*b), map.keys())
            }
        }
    }
}

/// The parameter `name`, a number, a colour or a texture.
pub fn parameter(
    parameters: &Parameters,
    name: &str,
    quantity: Quantity,
    otherwise: f64,
    context: &mut Context,
) -> Result<Texture, SceneError> {
    match parameters.find(name) {
        None => Ok(Texture::grey(otherwise)),
        Some(parameter) => read(parameter, quantity, context),
    }
}

/// A number, a colour, or the texture that is named.
pub fn read(parameter: &Parameter, quantity: Quantity, context: &mut Context) -> Result<Texture, SceneError> {
    if parameter.kind != "texture" {
        return spectrum::colour(parameter, quantity, context).map(Texture::Constant);
    }
    let Values::Texts(texts) = &parameter.values else {
        return Err(parameter.place.error(format!("`{}` names no texture", parameter.name), "name one"));
    };
    let name = texts.first().map_or("", String::as_str);
    // Numbers and colours have names of their own; what is asked for decides which is looked for first.
    let (first, second) = match quantity {
        Quantity::Number => (&context.float_textures, &context.colour_textures),
        _ => (&context.colour_textures, &context.float_textures),
    };
    let Some(texture) = first.get(name).or_else(|| second.get(name)).cloned() else {
        let names: Vec<&str> = first.keys().chain(second.keys()).map(String::as_str).collect();
        let message = format!("there is no texture `{}`", super::lexer::shown(name));
        return Err(parameter.place.error(message, did_you_mean(name, &names)));
    };
    made_of(&texture, quantity, context)
}

fn made_of(texture: &Parameters, quantity: Quantity, context: &mut Context) -> Result<Texture, SceneError> {
    context.enter(texture)?;
    let mut part = |name: &str, otherwise: f64| parameter(texture, name, quantity, otherwise, context);
    let (made, what) = match texture.kind.as_str() {
        "constant" => (part("value", 1.0)?, "a colour"),
        "scale" => {
            let (a, b) = match texture.find("tex1") {
                // v3 calls the two alike.
                Some(_) => (part("tex1", 1.0)?, part("tex2", 1.0)?),
                None => (part("tex", 1.0)?, part("scale", 1.0)?),
            };
            let product = match (a.constant(), b.constant()) {
                (_, Some(factor)) => a.scaled(factor),
                (Some(factor), None) => b.scaled(factor),
                (None, None) => {
                    context.approximate(&texture.place, "of two textures that are multiplied one is taken as its mean");
                    let factor = b.mean();
                    a.scaled(factor)
                }
            };
            (product, "a texture times a colour")
        }
        "mix" | "directionmix" => {
            let (a, b) = (part("tex1", 0.0)?, part("tex2", 1.0)?);
            let amount = parameter(texture, "amount", Quantity::Number, 0.5, context)?;
            if a.constant().is_none() || b.constant().is_none() || amount.constant().is_none() || texture.kind != "mix"
            {
                context.approximate(&texture.place, "a mix of textures is taken as the mean of them");
            }
            texture.skip(&["dir"]);
            let (a, b, t) = (a.mean(), b.mean(), amount.mean_number().clamp(0.0, 1.0));
            (Texture::Constant(std::array::from_fn(|c| a[c] + (b[c] - a[c]) * t)), "a colour")
        }
        "checkerboard" => {
            let (a, b) = (part("tex1", 1.0)?, part("tex2", 0.0)?);
            if a.constant().is_none() || b.constant().is_none() {
                context.approximate(&texture.place, "a texture of a `checkerboard` is taken as its mean");
            }
            if texture.integer("dimension")? == Some(3) {
                context.approximate(&texture.place, "a `checkerboard` of three dimensions is taken as its mean");
                (
                    Texture::Checkerboard { values: [a.mean(), b.mean()], map: UvMap::IDENTITY }.mean_texture(),
                    "a colour",
                )
            } else {
                texture.skip(&["aamode", "dimension"]);
                let map = uv_map(texture, context)?;
                // Theirs are 1 wide, ours ½.
                let map = UvMap { scale: 0.5 * map.scale, offset: 0.5 * map.offset };
                (Texture::Checkerboard { values: [a.mean(), b.mean()], map }, "a `checkerboard`")
            }
        }
        "imagemap" => (image(texture, context)?, "an `image`"),
        kind => {
            let kind = super::lexer::shown(kind);
            context.approximate(&texture.place, format!("a texture `{kind}` is not known, and is taken as 0.5"));
            context.leave();
            return Ok(Texture::grey(0.5));
        }
    };
    if made.constant().is_none() {
        context.uv_textures += 1;
    }
    context.mapped(texture, what);
    texture.finish(context);
    context.leave();
    Ok(bounded(made, quantity, texture, context))
}

impl Texture {
    fn mean_texture(&self) -> Self {
        Self::Constant(self.mean())
    }
}

/// What reflects has no values above 1.
fn bounded(made: Texture, quantity: Quantity, texture: &Parameters, context: &mut Context) -> Texture {
    if quantity != Quantity::Reflectance {
        return made;
    }
    let inside = made.each(|x| x.clamp(0.0, 1.0));
    match inside {
        Some(inside) if inside != made => {
            context.approximate(&texture.place, "a colour whose channels are not from 0 to 1 is brought there");
            inside
        }
        _ => made,
    }
}

fn image(texture: &Parameters, context: &mut Context) -> Result<Texture, SceneError> {
    let Some(name) = texture.text("filename")? else {
        return Err(texture.place.error(format!("{} has no `filename`", texture.title()), "name an image"));
    };
    let file = context.file_name(name, texture.place_of("filename"));
    let ending = file.rsplit('.').next().unwrap_or("").to_lowercase();
    let asked = match (texture.text("encoding")?, texture.boolean("gamma")?) {
        (Some("linear"), _) | (None, Some(false)) => "linear",
        (Some("sRGB" | "srgb") | None, _) => "srgb",
        (Some(_), _) => {
            context.approximate(&texture.place, "an `encoding` by a power is taken as sRGB");
            "srgb"
        }
    };
    let encoding = if matches!(ending.as_str(), "exr" | "hdr" | "pfm") { None } else { Some(asked) };
    let wrap = match texture.text("wrap")?.unwrap_or("repeat") {
        "repeat" => "repeat",
        "clamp" => "clamp",
        other => {
            let other = super::lexer::shown(other);
            context.approximate(&texture.place, format!("the `wrap` `{other}` is taken as `clamp`"));
            "clamp"
        }
    };
    if texture.boolean("invert")? == Some(true) {
        context.approximate(&texture.place, "`invert` of an image is left out");
    }
    if texture.text("filter")? == Some("point") {
        context.approximate(&texture.place, "an image with the `filter` `point` is bilinear");
    }
    texture.skip(&["maxanisotropy", "trilinear"]);
    let scale = texture.float_or("scale", 1.0)?;
    Ok(Texture::Image { file, encoding, wrap, scale: [scale; 3], map: uv_map(texture, context)? })
}

/// `su`, `sv` (`uscale`, `vscale` before v4) and `du`, `dv` (`udelta`, `vdelta`).
fn uv_map(texture: &Parameters, context: &mut Context) -> Result<UvMap, SceneError> {
    if let Some(mapping) = texture.text("mapping")?.filter(|mapping| *mapping != "uv") {
        let mapping = super::lexer::shown(mapping);
        context.approximate(&texture.place, format!("the `mapping` `{mapping}` is taken as `uv`"));
        texture.skip(&["v1", "v2"]);
    }
    let number = |names: &[&str], otherwise: f64| match texture.any(names) {
        Some(parameter) => super::parameters::number(parameter),
        None => Ok(otherwise),
    };
    let scale = DVec2::new(number(&["uscale", "su"], 1.0)?, number(&["vscale", "sv"], 1.0)?);
    let offset = DVec2::new(number(&["udelta", "du"], 0.0)?, number(&["vdelta", "dv"], 0.0)?);
    if scale.x == 0.0 || scale.y == 0.0 {
        return Err(texture.place.error("a texture's scale is 0", "give another number"));
    }
    Ok(UvMap { scale, offset })
}
