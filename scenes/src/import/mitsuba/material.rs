//! Materials as they are written, and what is made of other materials.

mod blend;
mod usual;

pub use blend::blend;
use usual::black;
pub use usual::{null, usual};

use super::bsdf::{BLACK, Setting, describe};
use super::context::Context;
use super::plugin::Plugin;
use super::spectrum::Quantity;
use super::texture::{self, Texture};
use super::xml::Element;
use crate::error::SceneError;
use crate::import::translation::{Lines, Place, key, number, quoted};
use crate::tilt::Remedies;

/// The value of a key.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// What may vary.
    Texture(Texture),
    /// What may not.
    Number(f64),
    /// A name.
    Word(String),
}

impl Value {
    /// A name.
    pub fn word(word: &str) -> Self {
        Self::Word(word.to_string())
    }

    fn toml(&self, turned: bool) -> String {
        match self {
            Self::Texture(texture) => texture.toml(turned),
            Self::Number(x) => number(*x),
            Self::Word(word) => quoted(word),
        }
    }
}

impl From<Texture> for Value {
    fn from(texture: Texture) -> Self {
        Self::Texture(texture)
    }
}

/// A material as it will be written.
#[derive(Clone, Debug)]
pub struct Description {
    /// Its model.
    pub model: &'static str,
    /// The model's parameters.
    keys: Vec<(&'static str, Value)>,
    tint: Tint,
    relief: Option<Relief>,
    opacity: Option<Texture>,
    /// Its other side.
    behind: Behind,
    /// Whether light may go through it.
    pub transmits: bool,
    place: Place,
}

/// What tilts a material's normals.
#[derive(Clone, Debug)]
struct Relief {
    /// `normal_map` or `bump_map`.
    key: &'static str,
    map: Texture,
    remedies: Remedies,
}

/// What some of a material's light is multiplied by.
#[derive(Clone, Debug)]
enum Tint {
    None,
    /// All of it by one number: the rest is of black patches.
    Share(f64),
    /// What is reflected and what passes, but for what is diffuse.
    Colours(Box<[Texture; 2]>),
}

/// The back of a material.
#[derive(Clone, Debug)]
enum Behind {
    /// It is as the front, and its map makes a dent where that of the front rises.
    Same,
    /// It is as the front, and what a map raises rises out of it as well.
    Mirrored,
    Black,
    /// It has no back of its own.
    Other(Box<Description>),
}

impl Description {
    /// A model with its presets.
    pub fn new(model: &'static str, place: &Place) -> Self {
        let (keys, behind, place) = (Vec::new(), Behind::Same, place.clone());
        let transmits = matches!(model, "dielectric" | "thin_glass" | "rough_dielectric" | "null");
        Self { model, keys, tint: Tint::None, relief: None, opacity: None, behind, transmits, place }
    }

    /// The same, through which light may go.
    pub fn transmitting(self) -> Self {
        Self { transmits: true, ..self }
    }

    /// The same, black from behind; what reflects nothing is so anyway.
    pub fn one_sided(self) -> Self {
        let black = ("albedo", Value::Texture(Texture::grey(0.0)));
        let behind = if self.keys.contains(&black) && self.model == "lambert" { Behind::Same } else { Behind::Black };
        Self { behind, ..self }
    }

    /// The same with its front on both sides.
    pub fn two_sided(self) -> Self {
        let behind = if self.relief.is_some() && !self.transmits { Behind::Mirrored } else { Behind::Same };
        Self { behind, ..self }
    }

    /// This for a front and that for a back.
    pub fn backed(self, back: Self, context: &mut Context) -> Self {
        if self.transmits || back.transmits {
            context
                .approximate(&self.place, "of a `twosided` that light goes through the front is taken for both sides");
            return self.two_sided();
        }
        let (mut front, mut back) = (self, back.two_sided());
        if front.opacity.take().is_some() | back.opacity.take().is_some() {
            context.approximate(&front.place, "a side of a `twosided` has no mask of its own: it is left out");
        }
        front.behind = Behind::Other(Box::new(back));
        front
    }

    /// What it becomes, in a word.
    pub fn kind(&self) -> &'static str {
        if matches!(self.behind, Behind::Other(_) | Behind::Mirrored) { "sided" } else { self.model }
    }

    /// The same with a parameter more.
    pub fn with(mut self, key: &'static str, value: impl Into<Value>) -> Self {
        self.keys.push((key, value.into()));
        self
    }

    /// The same with parameters more.
    pub fn with_all(mut self, keys: Vec<(&'static str, Value)>) -> Self {
        self.keys.extend(keys);
        self
    }

    /// The same, of whose light that is not diffuse `reflection` is left of what is reflected and `transmission` of what passes.
    pub fn tinted(mut self, reflection: Texture, transmission: Texture, context: &mut Context) -> Self {
        let factors = [reflection, transmission];
        if factors.iter().all(|factor| factor.constant() == Some([1.0; 3])) {
            return self;
        }
        let varies = |(_, value): &(_, Value)| matches!(value, Value::Texture(texture) if texture.constant().is_none());
        if !self.keys.iter().any(varies) {
            self.tint = Tint::Colours(factors.into());
            return self;
        }
        let is_same = !self.transmits || factors[0] == factors[1];
        let grey = is_same && factors[0].constant().is_some_and(|[r, g, b]| r == g && g == b);
        let is_coat = matches!(self.model, "plastic" | "rough_plastic");
        if is_coat {
            let text =
                "a `specular_reflectance` over a base that varies is taken as 1: the highlight is that much brighter";
            context.approximate(&self.place, text);
            return self;
        }
        if !grey {
            let text = "the colours of what a material that varies reflects and transmits are taken as their mean";
            context.approximate(&self.place, text);
        }
        let [reflected, passing] = factors.map(|factor| factor.mean().iter().sum::<f64>() / 3.0);
        self.tint = Tint::Share(if self.transmits { 0.5 * (reflected + passing) } else { reflected });
        self
    }

    /// The same without what may not be in a part of a mix.
    fn for_mix(mut self, context: &mut Context) -> Self {
        let behind = if let Behind::Other(back) = &mut self.behind { back.relief.take() } else { None };
        if self.relief.take().is_some() | self.opacity.take().is_some() | behind.is_some() {
            context.approximate(&self.place, "a part of a blend has no masks and maps of its own: they are left out");
        }
        if matches!(self.behind, Behind::Mirrored) {
            self.behind = Behind::Same;
        }
        self
    }

    /// Tilts its normals.
    fn raise(&mut self, relief: Option<Relief>, context: &mut Context) {
        if let (Behind::Other(back), Some(front)) = (&mut self.behind, &relief) {
            // The map is that of the whole surface, and makes a dent of the back where it raises the front.
            back.relief = match front.map.clone().scaled([-1.0; 3]) {
                Some(map) if front.key == "bump_map" => Some(Relief { map, ..front.clone() }),
                _ => {
                    let text = "a `normalmap` of a `twosided` of two materials is taken for that of either side";
                    context.approximate(&self.place, text);
                    Some(front.clone())
                }
            };
        }
        if matches!(self.behind, Behind::Mirrored) {
            self.behind = Behind::Same;
        }
        self.relief = relief;
    }

    /// Writes it under this name.
    fn write(&self, name: &str, turned: bool, context: &mut Context) {
        let front = match self.behind {
            Behind::Same => return self.write_side(name, self.opacity.as_ref(), turned, context),
            _ => context.fresh_name(&format!("{name}_front")),
        };
        self.write_side(&front, None, turned, context);
        let back = match &self.behind {
            Behind::Same | Behind::Mirrored => Some(front.clone()),
            Behind::Black => None,
            Behind::Other(back) => {
                let name = context.fresh_name(&format!("{name}_back"));
                back.write_side(&name, None, turned, context);
                Some(name)
            }
        };
        let sides = [("front", Some(front)), ("back", back)];
        let sides: Vec<_> = sides.into_iter().filter_map(|(key, side)| Some((key, Value::Word(side?)))).collect();
        let mut lines = Lines::default();
        lines.table(&self.place, format!("[materials.{}]", key(name)));
        write_keys(&mut lines, &self.place, "sided", &sides, turned);
        if let Some(opacity) = &self.opacity {
            lines.key(&self.place, "opacity", opacity.toml(turned));
        }
        context.materials.append(lines);
    }

    /// Writes one side of it, or both if they are the same.
    fn write_side(&self, name: &str, opacity: Option<&Texture>, turned: bool, context: &mut Context) {
        let mut lines = Lines::default();
        let header = |name: &str| format!("[materials.{}]", key(name));
        let (mut model, mut keys) = (self.model, self.keys.clone());
        if !matches!(self.tint, Tint::None) {
            let whole = context.fresh_name(&format!("{name}_untinted"));
            lines.table(&self.place, header(&whole));
            write_keys(&mut lines, &self.place, model, &keys, turned);
            (model, keys) = self.over(whole, context);
        }
        lines.table(&self.place, header(name));
        write_keys(&mut lines, &self.place, model, &keys, turned);
        if let Some(Relief { key, map, remedies }) = &self.relief {
            lines.key(&self.place, key, map.toml(turned));
            if *remedies != Remedies::default() {
                lines.key(&self.place, "relief", quoted(remedies.name()));
            }
        }
        if let Some(opacity) = opacity {
            lines.key(&self.place, "opacity", opacity.toml(turned));
        }
        context.materials.append(lines);
    }
}

impl Description {
    /// What is made of the material `whole` by the tint: a model and its keys.
    fn over(&self, whole: String, context: &mut Context) -> (&'static str, Vec<(&'static str, Value)>) {
        match &self.tint {
            Tint::None => unreachable!("it is tinted"),
            Tint::Share(share) => {
                black(&self.place, context);
                let (first, second) = (("first", Value::Word(whole)), ("second", Value::word(BLACK)));
                ("mix", vec![first, second, ("amount", Value::Number(1.0 - share))])
            }
            Tint::Colours(factors) => {
                let names = ["reflection", "transmission"].into_iter().zip(factors.iter().cloned());
                let given = names.filter(|(_, factor)| factor.constant() != Some([1.0; 3]));
                let of = ("of", Value::Word(whole));
                ("tinted", [of].into_iter().chain(given.map(|(name, factor)| (name, factor.into()))).collect())
            }
        }
    }
}

fn write_keys(lines: &mut Lines, place: &Place, model: &str, keys: &[(&'static str, Value)], turned: bool) {
    lines.key(place, "type", quoted(model));
    for (key, value) in keys {
        lines.key(place, key, value.toml(turned));
    }
}

/// The name of the material that a `bsdf` becomes, written where it is first asked for; `turned` where the shape's v is
/// Mitsuba's turned over.
pub fn named<'a>(element: &'a Element, turned: bool, context: &mut Context<'a>) -> Result<String, SceneError> {
    let key = (std::ptr::from_ref(element), turned);
    if let Some(name) = context.material_names.get(&key) {
        return Ok(name.clone());
    }
    let own = element.attribute("id").map(str::to_string);
    let name = context.fresh_name(&own.unwrap_or_else(|| format!("{}_line{}", element.kind(), element.place.line)));
    let setting = Setting { name: &name, turned };
    let before = context.uv_textures;
    describe(element, setting, context)?.write(&name, turned, context);
    if context.uv_textures > before {
        context.mapped_materials.insert(name.clone());
    }
    context.material_names.insert(key, name.clone());
    Ok(name)
}

/// A material with a mask or a map over it.
pub fn layered<'a>(
    plugin: &Plugin<'a>,
    setting: Setting,
    context: &mut Context<'a>,
) -> Result<Description, SceneError> {
    let place = plugin.place();
    let own = match plugin.kind() {
        "mask" => Some(texture::number(plugin, "opacity", Quantity::Reflectance, 0.5, context)?),
        _ => {
            let named = ["normalmap", "texture", "bumpmap"]
                .into_iter()
                .find_map(|name| plugin.part(name).filter(|part| part.tag == "texture"));
            let map = named.or_else(|| plugin.tagged("texture").pop());
            map.map(|map| texture::read(map, Quantity::Index, context)).transpose()?
        }
    };
    let Some(inner) = plugin.tagged("bsdf").first().copied() else {
        return Err(place.error(format!("`{}` holds no material", plugin.kind()), "add a `bsdf`"));
    };
    let Some(own) = own else {
        return Err(place.error(format!("`{}` holds no texture", plugin.kind()), "add one"));
    };
    let mut description = describe(inner, setting, context)?;
    let scale = plugin.float_or("scale", 1.0)?;
    if plugin.kind() == "mask" {
        context.mask.get_or_insert_with(|| place.clone());
    }
    match plugin.kind() {
        "mask" if description.opacity.is_some() => {
            context.approximate(place, "of two masks one over the other only the outer is kept");
            description.opacity = Some(own);
        }
        "mask" => description.opacity = Some(own),
        kind => {
            if description.relief.is_some() {
                context.approximate(place, "of two maps one over the other only the outer is kept");
            }
            let remedies = Remedies {
                turning: plugin.boolean("flip_invalid_normals")?.unwrap_or(true),
                shadowing: plugin.boolean("use_shadowing_function")?.unwrap_or(true),
            };
            let relief = match kind {
                "normalmap" => Some(("normal_map", own)),
                _ => match own.luminance().scaled([scale; 3]) {
                    Some(heights) if heights.constant().is_none() => Some(("bump_map", heights)),
                    _ => None,
                },
            };
            description.raise(relief.map(|(key, map)| Relief { key, map, remedies }), context);
        }
    }
    Ok(description)
}
