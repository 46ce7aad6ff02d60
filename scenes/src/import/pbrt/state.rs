//! Directives carried out one by one, with the attributes that they set.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use glam::DMat4;

use super::camera::Options;
use super::context::{Context, file_name};
use super::material::Material;
use super::names::{FreeNames, SecondNames};
use super::object::{Object, Objects};
use super::parameters::Parameters;
use super::parser::{Parameter, Parser, Statement, Values};
use super::sensor::Sensor;
use super::shape::{self, Record};
use super::{light, transform};
use crate::error::SceneError;
use crate::import::translation::{NoteKind, Place};
use crate::suggest::did_you_mean;

/// How deep attributes may be nested.
const MAX_DEPTH: usize = 1000;
/// How deep files may include one another.
const MAX_INCLUDES: usize = 32;
/// How many parameters things of a kind may have by `Attribute`.
const MOST_USUAL: usize = 256;
/// How many files may be included in all.
const MOST_FILES: usize = 10_000;

/// What attributes hold.
#[derive(Clone)]
pub struct Graphics {
    map: DMat4,
    reversed: bool,
    material: Material,
    light: Option<Rc<Parameters>>,
    /// Parameters that things of a kind have where they do not say otherwise.
    usual: Rc<BTreeMap<String, Vec<Parameter>>>,
    /// What textures are kept as that were named again.
    pub textures: Rc<SecondNames>,
    /// The same of materials.
    pub materials: Rc<SecondNames>,
}

impl Graphics {
    /// What is named again from here on is so within attributes.
    fn name_within(&mut self) {
        self.textures = SecondNames::within(&self.textures);
        self.materials = SecondNames::within(&self.materials);
    }
}

/// What was begun.
#[derive(PartialEq)]
enum Frame {
    Attribute,
    Transform,
    Object,
}

/// A scene as far as it is read.
pub struct State<'c> {
    /// What is written meanwhile.
    pub context: &'c mut Context,
    /// What stands before `WorldBegin`.
    pub options: Options,
    /// The shapes.
    pub records: Vec<Record>,
    /// What is placed many times.
    pub objects: Objects,
    /// What attributes hold now.
    pub graphics: Graphics,
    stack: Vec<(Frame, Graphics, Place)>,
    systems: BTreeMap<String, DMat4>,
    /// The object that is being read.
    object: Option<Object>,
    in_world: bool,
    open: Vec<PathBuf>,
    files: usize,
    /// Names for what is named again.
    pub names: FreeNames,
}

impl<'c> State<'c> {
    /// Before the first directive.
    pub fn new(context: &'c mut Context) -> Self {
        Self {
            context,
            options: Options { camera: None, film: None, filter: None, integrator: None },
            records: Vec::new(),
            objects: Objects::default(),
            graphics: Graphics {
                map: DMat4::IDENTITY,
                reversed: false,
                material: Material::Usual,
                light: None,
                usual: Rc::default(),
                textures: Rc::default(),
                materials: Rc::default(),
            },
            stack: Vec::new(),
            systems: BTreeMap::new(),
            object: None,
            in_world: false,
            open: Vec::new(),
            files: 0,
            names: FreeNames::default(),
        }
    }

    /// Carries out a file; `named_at` is where it is included, if it is.
    pub fn file(&mut self, path: &Path, named_at: Option<&Place>) -> Result<(), SceneError> {
        let wrong = |message: String, mend: &str| match named_at {
            Some(place) => place.error(message, mend),
            None => SceneError::invalid(message, mend).in_file(path),
        };
        let whole = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        if let Some(first) = self.open.iter().position(|open| *open == whole) {
            let chain: Vec<String> = self.open[first..].iter().map(|path| file_name(path)).collect();
            let message = format!("a file includes itself: {} → {}", chain.join(" → "), file_name(&whole));
            return Err(wrong(message, "take one of the `Include`s out"));
        }
        self.files += 1;
        if self.open.len() >= MAX_INCLUDES || self.files > MOST_FILES {
            return Err(wrong("too many files are included".to_string(), "put their text together"));
        }
        let bytes = crate::file::read_unpacked(path)
            .map_err(|error| SceneError::unreadable(path, error, "give the path of a .pbrt file"))?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
            let line = 1 + valid.iter().filter(|&&byte| byte == b'\n').count();
            SceneError::invalid("the text is not UTF-8", "save the file as UTF-8").in_file(path).at_line(line)
        })?;
        self.open.push(whole);
        let mut parser = Parser::new(&text, path.into());
        while let Some(statement) = parser.statement()? {
            self.carry_out(statement)?;
        }
        self.open.pop();
        Ok(())
    }

    /// Ends the scene.
    pub fn finish(&mut self, root: &Place) -> Result<(), SceneError> {
        if let Some((frame, _, place)) = self.stack.pop() {
            let (begun, end) = match frame {
                Frame::Attribute => ("AttributeBegin", "AttributeEnd"),
                Frame::Transform => ("TransformBegin", "TransformEnd"),
                Frame::Object => ("ObjectBegin", "ObjectEnd"),
            };
            return Err(place.error(format!("`{begun}` is never ended"), format!("add `{end}`")));
        }
        if !self.in_world {
            return Err(root.error("the scene has no world", "add `WorldBegin` before its lights and shapes"));
        }
        Ok(())
    }

    fn carry_out(&mut self, statement: Statement) -> Result<(), SceneError> {
        let place = statement.place.clone();
        match statement.name {
            "Identity" => self.graphics.map = DMat4::IDENTITY,
            "Translate" | "Scale" | "Rotate" | "LookAt" | "ConcatTransform" => {
                self.graphics.map *= transform::read(&statement)?;
                transform::check(&self.graphics.map, &statement)?;
            }
            "Transform" => self.graphics.map = transform::read(&statement)?,
            "CoordinateSystem" => {
                self.systems.insert(statement.texts[0].clone(), self.graphics.map);
            }
            "CoordSysTransform" => self.graphics.map = self.system(&statement)?,
            "ReverseOrientation" => self.graphics.reversed = !self.graphics.reversed,
            "AttributeBegin" => self.begin(Frame::Attribute, place)?,
            "AttributeEnd" => self.end(Frame::Attribute, &statement)?,
            "TransformBegin" => self.begin(Frame::Transform, place)?,
            "TransformEnd" => self.end(Frame::Transform, &statement)?,
            "ObjectBegin" => {
                if self.object.is_some() {
                    return Err(place.error("an object begins within another", "end that one by `ObjectEnd` first"));
                }
                self.begin(Frame::Object, place.clone())?;
                self.object = Some(Object { name: statement.texts[0].clone(), records: Vec::new(), place });
            }
            "ObjectEnd" => {
                self.end(Frame::Object, &statement)?;
                if let Some(object) = self.object.take() {
                    self.objects.add(object);
                }
            }
            "ObjectInstance" => self.instance(&statement)?,
            "WorldBegin" => self.world(&place)?,
            "WorldEnd" => {}
            "Include" | "Import" => self.include(&statement)?,
            "NamedMaterial" => {
                let name = &statement.texts[0];
                let name = self.graphics.materials.get(name).unwrap_or(name);
                self.graphics.material = Material::Named(name.as_str().into(), place);
            }
            "Camera" if crate::import::flattens(&self.graphics.map) => {
                return Err(place.error("the transform flattens the camera", "let every direction keep some length"));
            }
            "Camera" => {
                // It stands where its frame leads to; lights and shapes may name that frame.
                self.systems.insert("camera".to_string(), self.graphics.map.inverse());
                let map = self.graphics.map;
                self.options.camera = Some((self.parameters("", statement), map));
            }
            "Film" => self.options.film = Some(self.parameters("", statement)),
            "PixelFilter" => self.options.filter = Some(self.parameters("", statement)),
            "Integrator" | "SurfaceIntegrator" => self.options.integrator = Some(self.parameters("", statement)),
            "Sampler" => {
                let text = "a `Sampler`: samples are asked for when a scene is rendered";
                self.context.note(NoteKind::Ignored, &place, text);
            }
            "Attribute" => self.attribute(statement)?,
            "ActiveTransform" | "TransformTimes" => {
                self.context.approximate(&place, "motion is left out: of two transforms the last holds");
            }
            "ColorSpace" if statement.texts[0] == "srgb" => {}
            "ColorSpace" => {
                self.context.approximate(&place, "colours of another `ColorSpace` are taken as sRGB's");
            }
            "MakeNamedMedium" | "MediumInterface" => {
                self.context.approximate(&place, "media are left out: light passes through them unhindered");
            }
            "MakeNamedMaterial" => self.named_material(statement)?,
            "Material" => {
                self.graphics.material = Material::Own(Rc::new(self.parameters("material", statement)));
            }
            "Texture" => self.texture(statement)?,
            "AreaLightSource" => self.graphics.light = Some(Rc::new(self.parameters("light", statement))),
            "LightSource" => {
                self.needs_world(&statement)?;
                if self.is_flattened("a light", &place) {
                    return Ok(());
                }
                let parameters = self.parameters("light", statement);
                light::write(&parameters, &self.graphics.map, self.context)?;
            }
            "Shape" => self.shape(statement)?,
            name => self.context.note(NoteKind::Ignored, &place, format!("`{name}`, which changes no light")),
        }
        Ok(())
    }

    /// A directive's parameters, with those that `Attribute` has set for things of its kind.
    pub fn parameters(&self, target: &str, mut statement: Statement) -> Parameters {
        let kind = if statement.texts.is_empty() { String::new() } else { statement.texts.swap_remove(0) };
        let mut list = statement.parameters;
        list.extend(self.graphics.usual.get(target).into_iter().flatten().cloned());
        for Parameter { kind, name, values, .. } in &mut list {
            let renamed = match (kind.as_str(), name.as_str()) {
                ("texture", _) => &self.graphics.textures,
                ("string", "materials" | "namedmaterial1" | "namedmaterial2") => &self.graphics.materials,
                _ => continue,
            };
            if let Values::Texts(names) = values {
                names.iter_mut().for_each(|name| renamed.get(name).into_iter().for_each(|kept| name.clone_from(kept)));
            }
        }
        Parameters::new(statement.name, kind, statement.place, list)
    }

    fn begin(&mut self, frame: Frame, place: Place) -> Result<(), SceneError> {
        if self.stack.len() >= MAX_DEPTH {
            return Err(place.error(format!("attributes are nested more than {MAX_DEPTH} deep"), "nest them less"));
        }
        let mut outer = self.graphics.clone();
        if frame == Frame::Transform {
            // Its names are those around it; what is kept twice would be copied at each new one.
            (outer.textures, outer.materials) = Default::default();
        } else {
            self.graphics.name_within();
        }
        self.stack.push((frame, outer, place));
        Ok(())
    }

    fn end(&mut self, frame: Frame, statement: &Statement) -> Result<(), SceneError> {
        let name = statement.name;
        match self.stack.pop() {
            // A transform alone comes back; what else was set within stays.
            Some((begun, graphics, _)) if begun == frame => {
                if frame == Frame::Transform {
                    self.graphics.map = graphics.map;
                } else {
                    self.graphics = graphics;
                }
                Ok(())
            }
            Some((_, _, begun)) => {
                let message = format!("`{name}` ends what something else began at {begun}");
                Err(statement.place.error(message, "end what was begun last first"))
            }
            None => Err(statement.place.error(format!("`{name}` ends nothing"), "take it out")),
        }
    }

    fn system(&self, statement: &Statement) -> Result<DMat4, SceneError> {
        let name = &statement.texts[0];
        self.systems.get(name).copied().ok_or_else(|| {
            let names: Vec<&str> = self.systems.keys().map(String::as_str).collect();
            let message = format!("there is no coordinate system `{}`", super::lexer::shown(name));
            statement.place.error(message, did_you_mean(name, &names))
        })
    }

    fn world(&mut self, place: &Place) -> Result<(), SceneError> {
        if std::mem::replace(&mut self.in_world, true) {
            return Err(place.error("the world begins a second time", "keep one `WorldBegin`"));
        }
        self.graphics.map = DMat4::IDENTITY;
        self.systems.insert("world".to_string(), DMat4::IDENTITY);
        self.context.sensor = Sensor::read(&self.options, self.context)?;
        Ok(())
    }

    fn needs_world(&self, statement: &Statement) -> Result<(), SceneError> {
        if self.in_world {
            return Ok(());
        }
        let message = format!("`{}` stands before `WorldBegin`", statement.name);
        Err(statement.place.error(message, "move it behind"))
    }

    fn include(&mut self, statement: &Statement) -> Result<(), SceneError> {
        let Some(path) = self.context.find(&statement.texts[0], &statement.place) else { return Ok(()) };
        let before = (statement.name == "Import").then(|| self.graphics.clone());
        if before.is_some() {
            self.graphics.name_within();
        }
        self.file(&path, Some(&statement.place))?;
        if let Some(before) = before {
            self.graphics = before;
        }
        Ok(())
    }

    fn attribute(&mut self, statement: Statement) -> Result<(), SceneError> {
        let target = &statement.texts[0];
        let targets = ["shape", "light", "material", "medium", "texture"];
        if !targets.contains(&target.as_str()) {
            let message = format!("there are no attributes of `{}`", super::lexer::shown(target));
            return Err(statement.place.error(message, did_you_mean(target, &targets)));
        }
        // The last that is said of a name holds.
        let list = Rc::make_mut(&mut self.graphics.usual).entry(target.clone()).or_default();
        for parameter in statement.parameters {
            list.retain(|other| other.name != parameter.name);
            if list.len() >= MOST_USUAL {
                let message = format!("more than {MOST_USUAL} attributes are set of `{target}`");
                return Err(parameter.place.error(message, "set fewer"));
            }
            list.push(parameter);
        }
        Ok(())
    }

    fn shape(&mut self, statement: Statement) -> Result<(), SceneError> {
        self.needs_world(&statement)?;
        let parameters = self.parameters("shape", statement);
        let place = parameters.place.clone();
        if self.is_flattened("a shape", &place) {
            return Ok(());
        }
        let light = self.graphics.light.clone();
        let light = if light.is_some() && self.object.is_some() {
            self.context.approximate(&place, "shapes of objects do not emit, as in pbrt");
            None
        } else {
            light
        };
        let has_power = light.as_ref().is_some_and(|light| light.find("power").is_some());
        let alpha = parameters.find("alpha").cloned();
        let Some(geometry) = shape::read(&parameters, has_power, self.context)? else { return Ok(()) };
        let record = Record {
            geometry: Rc::new(geometry),
            transform: self.graphics.map,
            reversed: self.graphics.reversed,
            material: self.graphics.material.clone(),
            alpha,
            light,
            place,
        };
        match &mut self.object {
            Some(object) => object.records.push(record),
            None => self.records.push(record),
        }
        Ok(())
    }

    fn instance(&mut self, statement: &Statement) -> Result<(), SceneError> {
        let (name, place) = (&statement.texts[0], &statement.place);
        if self.object.is_some() {
            return Err(place.error("an instance stands within an object", "end the object by `ObjectEnd` first"));
        }
        if self.is_flattened("an instance", place) {
            return Ok(());
        }
        self.objects.instance(name, self.graphics.map, place, self.context)
    }

    /// Whether the transform leaves nothing of what stands here, which is told.
    fn is_flattened(&mut self, what: &str, place: &Place) -> bool {
        let flattened = crate::import::flattens(&self.graphics.map);
        if flattened {
            self.context.approximate(place, format!("{what} that its transform flattens is left out"));
        }
        flattened
    }
}
