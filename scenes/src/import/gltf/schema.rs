//! What the objects of a file may say, as the specification names it; what is not here is not read.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::value::RawValue;

/// The lists of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// How numbers lie in a view.
    Accessor,
    /// Bytes.
    Buffer,
    /// A part of a buffer.
    BufferView,
    /// A camera.
    Camera,
    /// An image.
    Image,
    /// A light of `KHR_lights_punctual`.
    Light,
    /// A material.
    Material,
    /// A mesh.
    Mesh,
    /// A node.
    Node,
    /// How an image is read.
    Sampler,
    /// A scene.
    Scene,
    /// What moves a mesh.
    Skin,
    /// An image with its sampler.
    Texture,
}

impl Kind {
    /// What messages call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Accessor => "accessor",
            Self::Buffer => "buffer",
            Self::BufferView => "buffer view",
            Self::Camera => "camera",
            Self::Image => "image",
            Self::Light => "light",
            Self::Material => "material",
            Self::Mesh => "mesh",
            Self::Node => "node",
            Self::Sampler => "sampler",
            Self::Scene => "scene",
            Self::Skin => "skin",
            Self::Texture => "texture",
        }
    }
}

type List<'t> = Vec<&'t RawValue>;

/// A file.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Root<'t> {
    pub asset: Asset,
    pub scene: Option<usize>,
    #[serde(default)]
    pub extensions_used: Vec<String>,
    #[serde(default)]
    pub extensions_required: Vec<String>,
    #[serde(borrow, default)]
    accessors: List<'t>,
    #[serde(borrow, default)]
    buffers: List<'t>,
    #[serde(borrow, default)]
    buffer_views: List<'t>,
    #[serde(borrow, default)]
    cameras: List<'t>,
    #[serde(borrow, default)]
    images: List<'t>,
    #[serde(borrow, default)]
    materials: List<'t>,
    #[serde(borrow, default)]
    meshes: List<'t>,
    #[serde(borrow, default)]
    nodes: List<'t>,
    #[serde(borrow, default)]
    samplers: List<'t>,
    #[serde(borrow, default)]
    scenes: List<'t>,
    #[serde(borrow, default)]
    skins: List<'t>,
    #[serde(borrow, default)]
    textures: List<'t>,
    #[serde(default)]
    pub animations: Vec<IgnoredAny>,
    #[serde(borrow, default)]
    extensions: RootExtensions<'t>,
}

#[derive(Default, Deserialize)]
struct RootExtensions<'t> {
    #[serde(rename = "KHR_lights_punctual", borrow)]
    lights: Option<Lights<'t>>,
}

#[derive(Deserialize)]
struct Lights<'t> {
    #[serde(borrow, default)]
    lights: List<'t>,
}

impl<'t> Root<'t> {
    /// The list of a kind.
    pub fn list(&self, kind: Kind) -> &[&'t RawValue] {
        match kind {
            Kind::Accessor => &self.accessors,
            Kind::Buffer => &self.buffers,
            Kind::BufferView => &self.buffer_views,
            Kind::Camera => &self.cameras,
            Kind::Image => &self.images,
            Kind::Light => self.extensions.lights.as_ref().map_or(&[], |lights| &lights.lights),
            Kind::Material => &self.materials,
            Kind::Mesh => &self.meshes,
            Kind::Node => &self.nodes,
            Kind::Sampler => &self.samplers,
            Kind::Scene => &self.scenes,
            Kind::Skin => &self.skins,
            Kind::Texture => &self.textures,
        }
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Asset {
    pub version: String,
    pub min_version: Option<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Buffer {
    pub byte_length: usize,
    pub uri: Option<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct BufferView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: Option<usize>,
    #[serde(default)]
    pub extensions: BTreeMap<String, IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Accessor {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: usize,
    #[serde(rename = "type")]
    pub shape: String,
    pub sparse: Option<Sparse>,
}

#[derive(Deserialize)]
pub struct Sparse {
    pub count: usize,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct SparseIndices {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct SparseValues {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: usize,
}

#[derive(Deserialize)]
pub struct Mesh<'t> {
    #[serde(borrow)]
    pub primitives: Vec<&'t RawValue>,
    #[serde(default)]
    pub weights: Vec<f64>,
}

#[derive(Deserialize)]
pub struct Primitive {
    pub attributes: BTreeMap<String, usize>,
    pub indices: Option<usize>,
    pub material: Option<usize>,
    #[serde(default = "triangles")]
    pub mode: u32,
    #[serde(default)]
    pub targets: Vec<IgnoredAny>,
    #[serde(default)]
    pub extensions: BTreeMap<String, IgnoredAny>,
}

fn triangles() -> u32 {
    4
}

#[derive(Deserialize)]
pub struct Scene {
    #[serde(default)]
    pub nodes: Vec<usize>,
}

#[derive(Deserialize)]
pub struct Node {
    pub camera: Option<usize>,
    #[serde(default)]
    pub children: Vec<usize>,
    pub matrix: Option<[f64; 16]>,
    pub mesh: Option<usize>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    pub skin: Option<usize>,
    pub translation: Option<[f64; 3]>,
    #[serde(default)]
    pub weights: Vec<f64>,
    #[serde(default)]
    pub extensions: NodeExtensions,
}

#[derive(Default, Deserialize)]
pub struct NodeExtensions {
    #[serde(rename = "KHR_lights_punctual")]
    pub light: Option<NodeLight>,
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub instancing: Option<IgnoredAny>,
    #[serde(rename = "KHR_node_visibility")]
    pub visibility: Option<NodeVisibility>,
}

#[derive(Deserialize)]
pub struct NodeVisibility {
    pub visible: Option<bool>,
}

#[derive(Deserialize)]
pub struct NodeLight {
    pub light: usize,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Skin {
    pub inverse_bind_matrices: Option<usize>,
    pub joints: Vec<usize>,
}

#[derive(Deserialize)]
pub struct Camera {
    #[serde(rename = "type")]
    pub kind: String,
    pub perspective: Option<Perspective>,
    pub orthographic: Option<Orthographic>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Perspective {
    pub aspect_ratio: Option<f64>,
    pub yfov: f64,
}

#[derive(Deserialize)]
pub struct Orthographic {
    pub xmag: f64,
    pub ymag: f64,
}

#[derive(Deserialize)]
pub struct Light {
    #[serde(rename = "type")]
    pub kind: String,
    #[serde(default = "white")]
    pub color: [f64; 3],
    #[serde(default = "one")]
    pub intensity: f64,
    pub range: Option<f64>,
    pub spot: Option<Cone>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Cone {
    #[serde(default)]
    pub inner_cone_angle: f64,
    #[serde(default = "eighth")]
    pub outer_cone_angle: f64,
}

fn eighth() -> f64 {
    std::f64::consts::FRAC_PI_4
}

/// The usual factor of colours.
pub fn white() -> [f64; 3] {
    [1.0; 3]
}

/// The usual factor of numbers.
pub fn one() -> f64 {
    1.0
}

#[derive(Deserialize)]
pub struct Texture {
    pub sampler: Option<usize>,
    pub source: Option<usize>,
    #[serde(default)]
    pub extensions: BTreeMap<String, IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Sampler {
    pub mag_filter: Option<u32>,
    #[serde(default = "repeat")]
    pub wrap_s: u32,
    #[serde(default = "repeat")]
    pub wrap_t: u32,
}

fn repeat() -> u32 {
    10497
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Image {
    pub uri: Option<String>,
    pub buffer_view: Option<usize>,
}

/// Which texture, and by which coordinates.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct TextureInfo {
    pub index: usize,
    #[serde(default)]
    pub tex_coord: u32,
    /// Of a normal map.
    #[serde(default = "one")]
    pub scale: f64,
    #[serde(default)]
    pub extensions: TextureInfoExtensions,
}

#[derive(Clone, Copy, Debug, Default, Deserialize)]
pub struct TextureInfoExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub transform: Option<TextureTransform>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct TextureTransform {
    #[serde(default)]
    pub offset: [f64; 2],
    #[serde(default)]
    pub rotation: f64,
    #[serde(default = "unscaled")]
    pub scale: [f64; 2],
    pub tex_coord: Option<u32>,
}

fn unscaled() -> [f64; 2] {
    [1.0; 2]
}
