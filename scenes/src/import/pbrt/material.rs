//! Materials as they are written, and which material a shape has.

use std::rc::Rc;

use super::context::Context;
use super::model;
use super::parameters::Parameters;
use super::parser::Values;
use super::spectrum::Quantity;
use super::texture::{self, Texture};
use crate::error::SceneError;
use crate::import::translation::{Lines, Place, key, number, quoted};
use crate::import::uv_map::UvMap;
use crate::suggest::did_you_mean;
use crate::tilt::Remedies;

/// The material that directives have set.
#[derive(Clone, Debug)]
pub enum Material {
    /// What shapes have before any is set: matte, of albedo ½.
    Usual,
    /// One of `MakeNamedMaterial`, which may come later.
    Named(Rc<str>, Place),
    /// One of `Material`.
    Own(Rc<Parameters>),
}

impl Material {
    /// Whether it is said to be but a border between media.
    pub fn is_interface(&self, context: &Context) -> bool {
        match self {
            Self::Usual => false,
            Self::Named(name, _) => context.named_materials.get(&**name).is_some_and(|known| known.kind == "interface"),
            Self::Own(own) => own.kind == "interface",
        }
    }
}

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

    fn toml(&self) -> String {
        match self {
            Self::Texture(texture) => texture.toml(),
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
    /// `normal_map` or `bump_map`, and what it is.
    relief: Option<(&'static str, Texture)>,
    opacity: Option<Texture>,
    /// Factors of what is reflected and of what passes.
    tint: Option<[Texture; 2]>,
    place: Place,
}

impl Description {
    /// A model with its presets.
    pub fn new(model: &'static str, place: &Place) -> Self {
        Self { model, keys: Vec::new(), relief: None, opacity: None, tint: None, place: place.clone() }
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

    /// The same with a mask.
    pub fn masked(mut self, opacity: Texture) -> Self {
        self.opacity = Some(opacity);
        self
    }

    /// The same, of whose light these colours are left where it is reflected and where it passes.
    pub fn tinted(self, factors: [Texture; 2]) -> Self {
        let is_white = factors.iter().all(|factor| factor.constant() == Some([1.0; 3]));
        Self { tint: (!is_white).then_some(factors), ..self }
    }

    /// Whether an image gives one of its parameters.
    pub fn varies(&self) -> bool {
        self.keys.iter().any(|(_, value)| matches!(value, Value::Texture(texture) if texture.constant().is_none()))
    }

    fn write(&self, name: &str, context: &mut Context) {
        let mut lines = Lines::default();
        let mut table = |name: &str, model: &str, keys: &[(&'static str, Value)]| {
            lines.table(&self.place, format!("[materials.{}]", key(name)));
            lines.key(&self.place, "type", quoted(model));
            for (key, value) in keys {
                lines.key(&self.place, key, value.toml());
            }
        };
        if let Some([reflection, transmission]) = &self.tint {
            let whole = context.fresh_name(&format!("{name}_untinted"));
            table(&whole, self.model, &self.keys);
            let factors = [("reflection", reflection.clone().into()), ("transmission", transmission.clone().into())];
            table(name, "tinted", &[vec![("of", Value::Word(whole))], factors.to_vec()].concat());
        } else {
            table(name, self.model, &self.keys);
        }
        if let Some((kind, map)) = &self.relief {
            lines.key(&self.place, kind, map.toml());
            lines.key(&self.place, "relief", quoted(Remedies::NONE.name()));
        }
        if let Some(opacity) = &self.opacity {
            lines.key(&self.place, "opacity", opacity.toml());
        }
        context.materials.append(lines);
    }
}

/// The name of a material, written where it is first asked for; `opacity` is the mask of the shape that has it.
pub fn named(
    material: &Material,
    opacity: Option<&Texture>,
    shape: &Place,
    context: &mut Context,
) -> Result<String, SceneError> {
    let identity = match material {
        Material::Usual => "usual".to_string(),
        Material::Named(name, _) => format!("named {name}"),
        Material::Own(own) => format!("own {:p}", Rc::as_ptr(own)),
    };
    let identity = (identity, opacity.map(Texture::toml).unwrap_or_default());
    if let Some(name) = context.written.get(&identity) {
        return Ok(name.clone());
    }
    let mapped_before = context.uv_textures;
    let (wanted, mut description) = match material {
        Material::Usual => {
            ("default".to_string(), Description::new("lambert", shape).with("albedo", Texture::grey(0.5)))
        }
        Material::Named(name, place) => (name.to_string(), describe(&*found(name, place, context)?, context)?),
        Material::Own(own) => {
            let kind = if own.kind.is_empty() { "interface" } else { &own.kind };
            (format!("{kind}_line{}", own.place.line), describe(own, context)?)
        }
    };
    if let Some(opacity) = opacity {
        description = description.masked(opacity.clone());
    }
    let name = context.fresh_name(&wanted);
    description.write(&name, context);
    if context.uv_textures > mapped_before || opacity.is_some_and(|opacity| opacity.constant().is_none()) {
        context.mapped_materials.insert(name.clone());
    }
    context.written.insert(identity, name.clone());
    Ok(name)
}

fn found(name: &str, place: &Place, context: &Context) -> Result<Rc<Parameters>, SceneError> {
    let known = context.named_materials.get(name).cloned();
    known.ok_or_else(|| {
        let names: Vec<&str> = context.named_materials.keys().map(String::as_str).collect();
        let message = format!("there is no material `{}`", super::lexer::shown(name));
        place.error(message, did_you_mean(name, &names))
    })
}

/// What a material becomes.
fn describe(parameters: &Parameters, context: &mut Context) -> Result<Description, SceneError> {
    context.enter(parameters)?;
    let mut description = match parameters.kind.as_str() {
        "mix" => mix(parameters, context)?,
        _ => model::describe(parameters, context)?,
    };
    if let Some(relief) = relief(parameters, context)? {
        description.relief = Some(relief);
    }
    context.mapped(parameters, &format!("`{}`", description.model));
    parameters.skip(&["type"]);
    parameters.finish(context);
    context.leave();
    Ok(description)
}

/// `displacement` (`bumpmap` before v4) or `normalmap`.
fn relief(parameters: &Parameters, context: &mut Context) -> Result<Option<(&'static str, Texture)>, SceneError> {
    if matches!(parameters.kind.as_str(), "" | "none" | "interface" | "null") {
        return Ok(None);
    }
    let away = "faces that a map turns away from the viewer are black, where pbrt lights them from their backs";
    if let Some(name) = parameters.text("normalmap")? {
        let place = parameters.place_of("normalmap").clone();
        context.approximate(&place, away);
        let file = context.file_name(name, &place);
        let (scale, map) = ([1.0; 3], UvMap::IDENTITY);
        context.uv_textures += 1;
        let ending = file.rsplit('.').next().unwrap_or("").to_lowercase();
        let encoding = (!matches!(ending.as_str(), "exr" | "hdr" | "pfm")).then_some("linear");
        return Ok(Some(("normal_map", Texture::Image { file, encoding, wrap: "repeat", scale, map })));
    }
    let Some(heights) = parameters.any(&["displacement", "bumpmap"]) else { return Ok(None) };
    let place = heights.place.clone();
    let heights = texture::read(heights, Quantity::Number, context)?;
    if !matches!(heights, Texture::Image { .. }) {
        context.approximate(&place, "a `displacement` that is no image is left out");
        return Ok(None);
    }
    context.approximate(&place, format!("a `displacement` does not make what is curved larger; {away}"));
    Ok(Some(("bump_map", heights)))
}

/// Two materials side by side: `amount` is the share of the second, and before v4 of the first.
fn mix(parameters: &Parameters, context: &mut Context) -> Result<Description, SceneError> {
    let place = &parameters.place;
    let (names, is_old) = match (parameters.find("materials"), parameters.text("namedmaterial1")?) {
        (Some(materials), _) => match &materials.values {
            Values::Texts(texts) => (texts.clone(), false),
            Values::Numbers(_) => (Vec::new(), false),
        },
        (None, Some(first)) => {
            let second = parameters.text("namedmaterial2")?.unwrap_or_default();
            (vec![first.to_string(), second.to_string()], true)
        }
        (None, None) => (Vec::new(), false),
    };
    let [first, second] = &names[..] else {
        return Err(place.error("a `mix` has not two `materials`", "name two, such as `[ \"a\" \"b\" ]`"));
    };
    let mut amount = texture::parameter(parameters, "amount", Quantity::Number, 0.5, context)?;
    if amount.constant().is_some_and(|[r, g, b]| r != g || g != b) {
        context.approximate(place, "a colour for the `amount` of a `mix` is taken as its mean");
        amount = Texture::grey(amount.mean_number());
    }
    let amount = match amount.each(|x| if is_old { 1.0 - x } else { x }.clamp(0.0, 1.0)) {
        Some(amount) => amount,
        None if is_old => {
            context.approximate(place, "an image for the `amount` of a `mix` is taken as its mean");
            Texture::grey((1.0 - amount.mean_number()).clamp(0.0, 1.0))
        }
        None => amount,
    };
    let mut parts = Vec::new();
    for name in [first, second] {
        let mut part = describe(&*found(name, place, context)?, context)?;
        if part.relief.take().is_some() | part.opacity.take().is_some() {
            context.approximate(place, "a part of a `mix` has no masks and maps of its own: they are left out");
        }
        let name = context.fresh_name(&format!("{name}_part"));
        part.write(&name, context);
        parts.push(name);
    }
    let [first, second] = [0, 1].map(|i| Value::Word(parts[i].clone()));
    Ok(Description::new("mix", place).with("first", first).with("second", second).with("amount", amount))
}
