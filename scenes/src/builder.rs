//! How scenes are made: by scene files, importers, built-ins and tests alike.

mod area;
mod assemble;
mod check;
mod extent;
mod groups;
mod hash;
mod parts;
mod similar;
mod varying;

pub use crate::camera::{CameraSettings, Crop, Projection};
pub use crate::emitter::{ChoiceRule, Emission, EnvironmentImage, Falloff, Mapping, PointRule, Spot};
pub use crate::shape::{MeshData, ShapeId};
pub use groups::GroupId;
pub use similar::Similarity;

use crate::builtin;
use crate::error::SceneError;
use crate::import::translation::{Place, carried_back};
use crate::material::{Material, MaterialId};
use crate::needs::Skip;
use crate::scene::{Scene, Series};
use crate::shape::Geometry;
use crate::texture::Texture;
use glam::{DAffine3, DVec3};
use groups::{Group, Placement};
use sampling::filter::Filter;
use sampling::math::Spectrum;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

/// A scene under construction. Coordinates are `f64`; they are recentred, where the scene lies far from the origin, before
/// they are rounded to `f32`. What is wrong with the parts is told by [`SceneBuilder::build`].
#[derive(Clone, Debug)]
pub struct SceneBuilder {
    name: String,
    materials: Vec<Material>,
    material_names: Vec<MaterialName>,
    shapes: Vec<Shape>,
    groups: Vec<Group>,
    /// Those that stand in no group.
    placements: Vec<Placement>,
    /// The group that is being filled.
    open: Option<GroupId>,
    /// How many shapes and instances the open group has, or the scene itself; and the scene while a group is open.
    members: u32,
    shelved: u32,
    points: Vec<(DVec3, Spectrum)>,
    spots: Vec<Spot>,
    directionals: Vec<(DVec3, Spectrum)>,
    environments: Vec<Environment>,
    /// The labels of emitters that are no surfaces, by the list they are in and their place there; the lists in the order of a
    /// scene's emitters: points, spots, directional ones, environments.
    emitter_labels: BTreeMap<(usize, usize), Arc<str>>,
    /// The one that was added last.
    last_emitter: (usize, usize),
    choice_rule: Option<ChoiceRule>,
    point_rule: PointRule,
    camera: Option<CameraSettings>,
    notes: Vec<String>,
    series: Series,
    closed_form: Option<&'static str>,
    /// Where the lines of its text came from, if it was translated.
    places: Option<Arc<[Place]>>,
}

/// A shape as it was given.
#[derive(Clone, Debug)]
struct Shape {
    geometry: Geometry,
    material: MaterialId,
    transform: DAffine3,
    flipped: bool,
    emission: Option<Emission>,
    /// The group that it is in.
    group: Option<GroupId>,
    /// Its place there, or among those in none.
    number: u32,
    label: Option<Arc<str>>,
}

/// What rays meet which meet nothing else.
#[derive(Clone, Debug)]
enum Environment {
    /// The same radiance from everywhere.
    Constant(Spectrum),
    /// An image.
    Image(EnvironmentImage),
}

/// What messages call a material.
#[derive(Clone, Debug)]
pub(crate) struct MaterialName {
    /// Its name, or its number.
    pub name: String,
    /// Where its file speaks of it, counted from 1.
    pub line: Option<usize>,
}

impl MaterialName {
    /// An error about it, at its line.
    fn place(&self, error: SceneError) -> SceneError {
        match self.line {
            Some(line) => error.at_line(line),
            None => error,
        }
    }
}

impl fmt::Display for MaterialName {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "material `{}`", self.name)
    }
}

impl SceneBuilder {
    /// An empty scene.
    pub fn new(name: &str) -> Self {
        SceneBuilder {
            name: name.to_owned(),
            materials: Vec::new(),
            material_names: Vec::new(),
            shapes: Vec::new(),
            groups: Vec::new(),
            placements: Vec::new(),
            open: None,
            members: 0,
            shelved: 0,
            points: Vec::new(),
            spots: Vec::new(),
            directionals: Vec::new(),
            environments: Vec::new(),
            emitter_labels: BTreeMap::new(),
            last_emitter: (0, 0),
            choice_rule: None,
            point_rule: PointRule::default(),
            camera: None,
            notes: Vec::new(),
            series: Series::default(),
            closed_form: None,
            places: None,
        }
    }

    /// Adds a material.
    pub fn material(&mut self, material: impl Into<Material>) -> MaterialId {
        let name = MaterialName { name: self.materials.len().to_string(), line: None };
        self.named_material(material, name)
    }

    /// Adds a material that messages call by its name.
    pub(crate) fn named_material(&mut self, material: impl Into<Material>, name: MaterialName) -> MaterialId {
        self.materials.push(material.into());
        self.material_names.push(name);
        MaterialId((self.materials.len() - 1) as u32)
    }

    /// Adds a parallelogram with one corner at `origin`; its front is where `edge_u × edge_v` points.
    pub fn quad(&mut self, origin: DVec3, edge_u: DVec3, edge_v: DVec3, material: MaterialId) -> ShapeId {
        self.shape(Geometry::Quad { origin, edge_u, edge_v }, material)
    }

    /// Adds a sphere; its front is outside.
    pub fn sphere(&mut self, center: DVec3, radius: f64, material: MaterialId) -> ShapeId {
        self.shape(Geometry::Sphere { center, radius }, material)
    }

    /// Adds an elliptic disk with these vectors from its centre to its rim; its front is where `edge_u × edge_v` points.
    pub fn disk(&mut self, center: DVec3, edge_u: DVec3, edge_v: DVec3, material: MaterialId) -> ShapeId {
        self.shape(Geometry::Disk { center, edge_u, edge_v }, material)
    }

    /// Adds a tube between the middles of its ends, without caps; its front is outside.
    pub fn cylinder(&mut self, from: DVec3, to: DVec3, radius: f64, material: MaterialId) -> ShapeId {
        self.shape(Geometry::Cylinder { from, to, radius }, material)
    }

    /// Adds a triangle mesh; its front is where its vertices run counter-clockwise.
    pub fn mesh(&mut self, mesh: MeshData, material: MaterialId) -> ShapeId {
        self.shape(Geometry::Mesh(mesh), material)
    }

    fn shape(&mut self, geometry: Geometry, material: MaterialId) -> ShapeId {
        let transform = DAffine3::IDENTITY;
        let (group, number) = (self.open, self.members);
        self.members += 1;
        self.shapes.push(Shape {
            geometry,
            material,
            transform,
            flipped: false,
            emission: None,
            group,
            number,
            label: None,
        });
        ShapeId((self.shapes.len() - 1) as u32)
    }

    /// Transforms a shape, after what it was transformed by before: any affine map for quads, disks and meshes, a
    /// similarity for spheres and cylinders. The front becomes the image of the front, mirrored or not.
    pub fn transform(&mut self, shape: ShapeId, transform: DAffine3) {
        let shape = &mut self.shapes[shape.0 as usize];
        shape.transform = transform * shape.transform;
    }

    /// The least and the greatest value of any channel of a texture over a shape, as it is transformed now; None where that is
    /// decided by the instances of its group.
    pub(crate) fn range(&self, shape: ShapeId, texture: &Texture) -> Option<(f32, f32)> {
        let shape = &self.shapes[shape.0 as usize];
        let placed_later = shape.group.is_some() && matches!(texture, Texture::Ramp { .. });
        (!placed_later).then(|| shape.range(texture))
    }

    /// Turns a shape's front over.
    pub fn flip(&mut self, shape: ShapeId) {
        let shape = &mut self.shapes[shape.0 as usize];
        shape.flipped = !shape.flipped;
    }

    /// Labels a shape: what light-path expressions call it, and its light group if it emits.
    pub fn label(&mut self, shape: ShapeId, label: &str) {
        self.shapes[shape.0 as usize].label = Some(label.into());
    }

    /// Whether nothing emits so far.
    pub(crate) fn is_dark(&self) -> bool {
        let others = [self.points.len(), self.spots.len(), self.directionals.len(), self.environments.len()];
        others == [0; 4] && self.shapes.iter().all(|shape| shape.emission.is_none())
    }

    /// Makes a shape emit.
    pub fn emit(&mut self, shape: ShapeId, emission: Emission) {
        self.shapes[shape.0 as usize].emission = Some(emission);
    }

    /// Adds a point emitter of this radiant intensity \[W/sr\].
    pub fn point_emitter(&mut self, position: DVec3, intensity: Spectrum) {
        self.last_emitter = (0, self.points.len());
        self.points.push((position, intensity));
    }

    /// Lets light of this radiance \[W/(m²·sr)\] arrive from all directions.
    pub fn environment(&mut self, radiance: Spectrum) {
        self.last_emitter = (3, self.environments.len());
        self.environments.push(Environment::Constant(radiance));
    }

    /// Lets the light of an image arrive from all directions.
    pub fn environment_image(&mut self, image: EnvironmentImage) {
        self.last_emitter = (3, self.environments.len());
        self.environments.push(Environment::Image(image));
    }

    /// Adds a spot.
    pub fn spot(&mut self, spot: Spot) {
        self.last_emitter = (1, self.spots.len());
        self.spots.push(spot);
    }

    /// Adds light that flies in a direction, of this irradiance across it \[W/m²\].
    pub fn directional_emitter(&mut self, direction: DVec3, irradiance: Spectrum) {
        self.last_emitter = (2, self.directionals.len());
        self.directionals.push((direction, irradiance));
    }

    /// Labels the emitter, one that is no surface, that was added last. Emitters of one label are a light group.
    pub fn label_emitter(&mut self, label: &str) {
        self.emitter_labels.insert(self.last_emitter, label.into());
    }

    /// Says how next-event estimation chooses among emitters, which otherwise depends on how many there are.
    pub fn emitter_choice(&mut self, rule: ChoiceRule) {
        self.choice_rule = Some(rule);
    }

    /// Says how next-event estimation places points on surfaces that emit.
    pub fn emitter_points(&mut self, rule: PointRule) {
        self.point_rule = rule;
    }

    /// Places the camera.
    pub fn camera(&mut self, settings: CameraSettings) {
        self.camera = Some(settings);
    }

    /// Gives the pixels of the camera, once it is placed, another filter.
    pub fn filter(&mut self, filter: Filter) {
        self.camera = self.camera.map(|settings| CameraSettings { filter, ..settings });
    }

    /// Notes what was approximated or left out.
    pub fn note(&mut self, text: String) {
        self.notes.push(text);
    }

    /// Says that it is the built-in scene of this name, whose orders may have closed forms.
    pub(crate) fn built_in(&mut self, name: &str) {
        self.closed_form = builtin::NAMES.iter().copied().find(|known| *known == name);
    }

    /// Says how much of the series is rendered unless something else is asked for.
    pub fn series(&mut self, series: Series) {
        self.series = series;
    }

    /// Says where the lines of the text came from that it was read from: what is wrong with one is told of that place.
    pub(crate) fn came_from(&mut self, places: Arc<[Place]>) {
        self.places = Some(places);
    }

    /// Builds the scene, or says what is wrong with it.
    pub fn build(self, skip: Skip) -> Result<Scene, SceneError> {
        let places = self.places.clone();
        check::check(&self).and_then(|()| assemble::assemble(self, skip)).map_err(|error| match (&error, places) {
            (SceneError::Invalid { file: None, .. }, Some(places)) => carried_back(error, &places),
            _ => error,
        })
    }
}

#[cfg(test)]
mod tests;
