//! `[materials.NAME]` of scene files.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;

use sampling::bsdf::{Argument, Arguments, Bsdf, Domain, Lambert, Misfit, Parameter, Preset};
use sampling::math::Spectrum;

use super::reader::{Line, Table, Value};
use super::textures::{Textures, read_file};
use super::{Origin, kind, subsurface};
use crate::builder::{MaterialName, SceneBuilder};
use crate::error::SceneError;
use crate::import::translation::Attachment;
use crate::material::{Blend, Material, MaterialId, Scattering, Sided, Varying};
use crate::relief::{Relief, ReliefMap};
use crate::suggest::did_you_mean;
use crate::texture::{Encoding, Texture};
use crate::tilt::Remedies;

/// The materials of a scene file by name.
pub(super) struct Materials<'a> {
    by_name: BTreeMap<&'a str, (MaterialId, Material)>,
}

impl Materials<'_> {
    /// The material that a shape names.
    pub fn named(&self, shape: &Table) -> Result<MaterialId, SceneError> {
        let value = shape.need("material", "\"white\"")?;
        let name = value.text()?;
        self.by_name.get(name).map(|(id, _)| *id).ok_or_else(|| {
            let names: Vec<&str> = self.by_name.keys().copied().collect();
            unknown(&value, name, &names)
        })
    }

    /// A material as it was given.
    pub fn given(&self, name: &str) -> Option<&Material> {
        Some(&self.by_name.get(name)?.1)
    }
}

fn unknown(value: &Value, name: &str, names: &[&str]) -> SceneError {
    if names.is_empty() {
        return value.error(format!("there are no materials; add a table `[materials.{name}]`"));
    }
    value.error(format!("there is no such material: {}", did_you_mean(name, names)))
}

/// Reads every material of a scene file.
pub(super) fn read<'a>(
    root: &Table<'a>,
    origin: &Origin,
    builder: &mut SceneBuilder,
) -> Result<Materials<'a>, SceneError> {
    let mut by_name = BTreeMap::new();
    let reader = Reader::new(root, origin.folder, origin.attachments)?;
    let mut line = Line::default();
    for (name, table) in &reader.tables {
        let material = reader.named(name, table, &mut vec![*name])?;
        let in_messages = MaterialName { name: (*name).to_owned(), line: Some(table.line_after(&mut line)) };
        by_name.insert(*name, (builder.named_material(material.clone(), in_messages), material));
    }
    Ok(Materials { by_name })
}

/// The material of this name, which may not vary; the others are read only where it names them.
pub(super) fn constant(root: &Table, name: &str) -> Result<Bsdf, SceneError> {
    let reader = Reader::new(root, Some(Path::new(".")), &[])?;
    let Some((name, table)) = reader.tables.iter().find(|(other, _)| *other == name) else {
        return Err(root.error(format!("there is no material `{name}`"), format!("add a table `[materials.{name}]`")));
    };
    match reader.named(name, table, &mut vec![*name])? {
        Material::Constant(bsdf) => Ok(bsdf),
        Material::Varying(_) => {
            let mend = "give numbers instead of textures, and no normal map, bump map or opacity";
            Err(table.error(format!("`{name}` is looked at in one point, and varies"), mend))
        }
        Material::Subsurface(_) => Err(table.error(format!("`{name}` is a body"), "name a material with a BSDF alone")),
        Material::Sided(_) => Err(table.error(format!("`{name}` has two sides"), "name what one of them is made of")),
    }
}

/// Reads materials, which may name one another.
struct Reader<'a, 'f> {
    /// In the order of the file.
    tables: Vec<(&'a str, Table<'a>)>,
    /// Where each of them is in that list.
    places: BTreeMap<&'a str, usize>,
    folder: Option<&'f Path>,
    textures: Textures<'f>,
    /// Those that have been read.
    known: RefCell<BTreeMap<&'a str, Material>>,
}

/// The most kinds of scattering of which one may be mixed, each counted as often as it occurs: all of them are asked at every hit.
const MOST_KINDS: usize = 64;
/// The most mixes within one another.
const MOST_NESTED: usize = 64;

/// What every material understands beside its model's parameters.
const COMMON: [&str; 5] = ["type", "normal_map", "bump_map", "relief", "opacity"];
/// The name of the type that has a front and a back.
const SIDED: &str = "sided";

impl<'a, 'f> Reader<'a, 'f> {
    fn new(root: &Table<'a>, folder: Option<&'f Path>, attachments: &'f [Attachment]) -> Result<Self, SceneError> {
        let entries = root.get("materials").map(|value| value.table()).transpose()?.map(|table| table.entries());
        let tables = entries.unwrap_or_default().into_iter().map(|(name, value)| Ok((name, value.table()?)));
        let tables = tables.collect::<Result<Vec<_>, SceneError>>()?;
        let places = tables.iter().enumerate().map(|(place, (name, _))| (*name, place)).collect();
        Ok(Self { tables, places, folder, textures: Textures::new(folder, attachments), known: RefCell::default() })
    }

    /// The material of this name and table, read once. `within` are the names of the materials that are being read.
    fn named(&self, name: &'a str, table: &Table<'a>, within: &mut Vec<&'a str>) -> Result<Material, SceneError> {
        if let Some(material) = self.known.borrow().get(name) {
            return Ok(material.clone());
        }
        let material = self.material(table, within)?;
        self.known.borrow_mut().insert(name, material.clone());
        Ok(material)
    }

    /// Reads one material: its `type` is the name of a model, its other keys are that model's parameters and [`COMMON`] ones.
    fn material(&self, table: &Table<'a>, within: &mut Vec<&'a str>) -> Result<Material, SceneError> {
        let names = Bsdf::MODELS.iter().map(|model| model.name).chain([subsurface::NAME, SIDED]);
        let model = match kind(table, &names.collect::<Vec<_>>())? {
            SIDED => return self.sided(table, within),
            subsurface::NAME => return subsurface::read(table, within.last().expect("what is read has a name")),
            name => Bsdf::model(name).expect("it is in the list"),
        };
        let keys: Vec<&str> = COMMON.into_iter().chain(model.parameters.iter().map(|p| p.name)).collect();
        table.allow_only(&keys)?;
        let mut arguments = Arguments::presets(model.parameters);
        let (mut textures, mut parts) = (Vec::new(), Vec::new());
        for (place, parameter) in model.parameters.iter().enumerate() {
            match self.argument(table, parameter, within)? {
                Some(Given::Constant(argument)) => arguments.set(place, argument),
                Some(Given::Texture(texture)) => textures.push((place, texture)),
                Some(Given::Part(scattering)) => parts.push((place, scattering)),
                None => {}
            }
        }
        let kinds: usize = parts.iter().map(|(_, part)| part.kinds()).sum();
        if kinds > MOST_KINDS {
            let message = format!("`{}` is mixed of {kinds} materials", table.name);
            return Err(table.error(message, format!("mix at most {MOST_KINDS}")));
        }
        let scattering = if parts.iter().all(|(_, part)| matches!(part, Scattering::Same(_))) {
            for (place, part) in parts {
                let Scattering::Same(bsdf) = part else { unreachable!("nothing varies") };
                arguments.set(place, Argument::Model(bsdf.kept()));
            }
            Scattering::new(model, arguments, textures).map_err(|misfit| misfit_error(table, &misfit))?
        } else if model.name == "mix" {
            blend(parts, textures, &arguments)
        } else {
            let value = table.get("of").expect("a part of anything but a mix is what it is of");
            return Err(value.error("it must be the name of a material of which no texture gives a parameter"));
        };
        let (relief, opacity) = (self.relief(table)?, self.opacity(table)?);
        match scattering {
            Scattering::Same(bsdf) if relief.is_none() && opacity.is_none() => Ok(bsdf.into()),
            scattering => {
                let mut varying = Varying::of(scattering);
                (varying.relief, varying.opacity) = (relief, opacity);
                Ok(varying.into())
            }
        }
    }

    /// `{ type = "sided", front, back, opacity }`: a side that is left out is black.
    fn sided(&self, table: &Table<'a>, within: &mut Vec<&'a str>) -> Result<Material, SceneError> {
        table.allow_only(&["type", "front", "back", "opacity"])?;
        let mut side = |key: &str| match table.get(key) {
            Some(value) => self.side(&value, within),
            None => Ok(Varying::of(Scattering::Same(Lambert { albedo: Spectrum::ZERO }.into()))),
        };
        let sides = [side("front")?, side("back")?];
        Ok(Sided::new(sides, self.opacity(table)?).into())
    }

    /// The material that a side names.
    fn side(&self, value: &Value<'a>, within: &mut Vec<&'a str>) -> Result<Varying, SceneError> {
        match self.other(value, within)? {
            Material::Constant(bsdf) => Ok(Varying::of(Scattering::Same(bsdf))),
            Material::Varying(varying) if varying.opacity.is_none() => Ok(*varying),
            Material::Varying(_) => {
                Err(value
                    .error("it must be the name of a material without opacity; give the material of both sides that"))
            }
            Material::Subsurface(_) => Err(value.error("it must be the name of a material without subsurface")),
            Material::Sided(_) => Err(value.error("it must be the name of a material that has not two sides itself")),
        }
    }

    /// `normal_map`, or `bump_map` \[m\], and the `relief` that either makes.
    fn relief(&self, table: &Table<'a>) -> Result<Option<Relief>, SceneError> {
        let map = match (table.get("normal_map"), table.get("bump_map")) {
            (None, None) => {
                let idle = table.get("relief");
                return idle
                    .map_or(Ok(None), |idle| Err(idle.error("there is no `normal_map` and no `bump_map`; add one")));
            }
            (Some(normals), None) => {
                let texture = self.textures.read(&normals, Encoding::Linear)?;
                check_normals(&normals, &texture)?;
                ReliefMap::Normals(within_domain(&normals, texture, Domain::Colour(0.0, 1.0))?)
            }
            (None, Some(heights)) => match self.number_or_texture(&heights)? {
                Texture::VertexColour => {
                    return Err(heights.error("its slope is not known from vertex colours; give an image or noise"));
                }
                texture => ReliefMap::Heights(texture),
            },
            (Some(_), Some(bump)) => return Err(bump.error("there is a `normal_map` as well; keep one of the two")),
        };
        let Some(value) = table.get("relief") else { return Ok(Some(map.into())) };
        let name = value.text()?;
        let place = Remedies::NAMES.iter().position(|known| *known == name);
        let place = place.ok_or_else(|| value.error(did_you_mean(name, &Remedies::NAMES)))?;
        Ok(Some(Relief { map, remedies: Remedies::ALL[place] }))
    }

    fn opacity(&self, table: &Table<'a>) -> Result<Option<Texture>, SceneError> {
        let Some(value) = table.get("opacity") else { return Ok(None) };
        let opacity = within_domain(&value, self.number_or_texture(&value)?, Domain::Number(0.0, 1.0))?;
        // What is opaque everywhere needs no mask.
        Ok((opacity != Texture::Constant(Spectrum::ONE)).then_some(opacity))
    }

    /// A texture, or a number that holds everywhere.
    fn number_or_texture(&self, value: &Value) -> Result<Texture, SceneError> {
        if value.is_table() {
            return self.textures.read(value, Encoding::Linear);
        }
        Ok(Texture::Constant(Spectrum::splat(value.number()? as f32)))
    }

    fn argument(
        &self,
        table: &Table<'a>,
        parameter: &Parameter,
        within: &mut Vec<&'a str>,
    ) -> Result<Option<Given>, SceneError> {
        let Some(value) = table.get(parameter.name) else {
            return match parameter.preset {
                Preset::Required(example) => table.need(parameter.name, example).map(|_| None),
                _ => Ok(None),
            };
        };
        let constant = |argument| Ok(Some(Given::Constant(argument)));
        let wrong = || value.error(format!("it must be {} ({})", parameter.domain, parameter.about));
        match parameter.domain {
            Domain::Number(..) | Domain::Colour(..) if value.is_table() => {
                let bytes =
                    if matches!(parameter.domain, Domain::Colour(..)) { Encoding::Srgb } else { Encoding::Linear };
                let texture = self.textures.read(&value, bytes)?;
                Ok(Some(Given::Texture(within_domain(&value, texture, parameter.domain)?)))
            }
            Domain::Number(..) => {
                let x = value.number()? as f32;
                if parameter.domain.holds(x) { constant(Argument::Number(x)) } else { Err(wrong()) }
            }
            Domain::Colour(..) => {
                let colour = value.colour()?;
                let holds = colour.to_array().iter().all(|channel| parameter.domain.holds(*channel));
                if holds { constant(Argument::Colour(colour)) } else { Err(wrong()) }
            }
            Domain::Choice(words) => {
                let word = value.text()?;
                let place = words.iter().position(|w| *w == word);
                constant(Argument::Choice(place.ok_or_else(|| value.error(did_you_mean(word, words)))?))
            }
            Domain::Numbers { least, read } => {
                let numbers = value.array()?.iter().map(Value::number).collect::<Result<Vec<f64>, _>>()?;
                if numbers.len() < least || numbers.iter().any(|x| *x < 0.0) {
                    return Err(wrong());
                }
                let numbers: Vec<f32> = numbers.into_iter().map(|x| x as f32).collect();
                constant(Argument::Table(read(&numbers).map_err(|mend| value.error(mend))?))
            }
            Domain::File { read } => {
                let Some(folder) = self.folder else { return Err(value.error("a built-in scene cannot name files")) };
                let path = folder.join(value.text()?);
                let bytes = read_file(&path).map_err(|mend| value.error(mend))?;
                let table = read(&bytes).map_err(|mend| value.error(format!("{}: {mend}", path.display())))?;
                constant(Argument::Table(table))
            }
            Domain::Model => Ok(Some(Given::Part(self.part(&value, within)?))),
        }
    }

    /// The material that a mix names, which may have neither relief nor opacity.
    fn part(&self, value: &Value<'a>, within: &mut Vec<&'a str>) -> Result<Scattering, SceneError> {
        match self.other(value, within)? {
            Material::Constant(bsdf) => Ok(Scattering::Same(bsdf)),
            Material::Varying(varying) if varying.relief.is_none() && varying.opacity.is_none() => {
                Ok(varying.scattering)
            }
            Material::Varying(_) => {
                let mend = "of a material without normal map, bump map and opacity; give the mix itself those";
                Err(value.error(format!("it must be the name {mend}")))
            }
            Material::Subsurface(_) => Err(value.error("it must be the name of a material without subsurface")),
            Material::Sided(_) => {
                Err(value.error("it must be the name of a material that has not two sides; give each side a mix"))
            }
        }
    }

    /// The material that another names.
    fn other(&self, value: &Value<'a>, within: &mut Vec<&'a str>) -> Result<Material, SceneError> {
        let name = value.text()?;
        let Some((name, table)) = self.places.get(name).map(|&place| &self.tables[place]) else {
            let names: Vec<&str> = self.places.keys().copied().collect();
            return Err(unknown(value, name, &names));
        };
        if within.len() == MOST_NESTED {
            return Err(value.error(format!("mixes of mixes are nested at most {MOST_NESTED} deep")));
        }
        if within.contains(name) {
            return Err(value.error(format!("a material cannot contain itself: {} → {name}", within.join(" → "))));
        }
        within.push(name);
        let material = self.named(name, table, within)?;
        within.pop();
        Ok(material)
    }
}

/// The texture, if what is known of its values is in the domain.
fn within_domain(value: &Value, texture: Texture, domain: Domain) -> Result<Texture, SceneError> {
    let Some((low, high)) = texture.range() else { return Ok(texture) };
    let outside = |colour: &Spectrum| colour.to_array().into_iter().find(|channel| !domain.holds(*channel));
    match [low, high].iter().find_map(outside) {
        None => Ok(texture),
        Some(number) => Err(value.error(format!("it reaches {number}; keep it {domain}"))),
    }
}

/// Normals point out of the surface: a map that has none such is no normal map.
fn check_normals(value: &Value, texture: &Texture) -> Result<(), SceneError> {
    let points_inwards = |colour: &Spectrum| colour.to_array()[2] <= 0.5;
    let is_wrong = match texture {
        Texture::Checkerboard { values, .. } => values.iter().any(points_inwards),
        other => other.range().is_some_and(|(_, high)| points_inwards(&high)),
    };
    if is_wrong {
        return Err(value.error("its normals, 2c − 1 of a colour c, point into the surface; make blue more than 0.5"));
    }
    Ok(())
}

enum Given {
    Constant(Argument),
    Texture(Texture),
    /// One of the parts of a mix.
    Part(Scattering),
}

/// The mix of two parts of which one varies.
fn blend(parts: Vec<(usize, Scattering)>, textures: Vec<(usize, Texture)>, arguments: &Arguments) -> Scattering {
    let [.., amount] = arguments.all::<3>();
    let amount = match textures.into_iter().next() {
        Some((_, texture)) => texture,
        None => amount.number().into(),
    };
    let parts: Vec<Scattering> = parts.into_iter().map(|(_, part)| part).collect();
    let parts = parts.try_into().expect("a mix has two parts");
    Scattering::Blend(Box::new(Blend { parts, amount }))
}

/// What is wrong with a material whose arguments are each in their domain.
fn misfit_error(table: &Table, misfit: &Misfit) -> SceneError {
    match table.get(misfit.parameter) {
        Some(value) => value.error(&misfit.mend),
        None => table.error(format!("`{}` has no `{}`", table.name, misfit.parameter), &misfit.mend),
    }
}
