//! The hash by which results know their scene.

use super::parts::Kept;
use crate::accel::Instance;
use crate::camera::Camera;
use crate::emitter::{ChoiceRule, Emitter, EmitterId, PointRule};
use crate::material::Material;
use crate::shape::{Analytic, Triangle};
use crate::surface::{AnalyticInfo, Attributes, Surface, TriangleInfo};
use std::fmt::Debug;

/// Everything an image depends on.
pub(super) struct Content<'a> {
    pub triangles: &'a [Triangle],
    pub infos: &'a [TriangleInfo],
    pub analytic: &'a [Analytic],
    pub analytic_infos: &'a [AnalyticInfo],
    pub kept: &'a [Kept],
    pub instances: &'a [Instance],
    pub surfaces: &'a [Surface],
    pub attributes: &'a [Attributes],
    pub materials: &'a [Material],
    pub emitters: &'a [Emitter],
    pub environment: Option<EmitterId>,
    pub camera: &'a Camera,
}

/// The BLAKE3 hash of a scene's content and of how its emitters are sampled, in hexadecimal digits. Floats count by their bits.
pub(super) fn hash(content: &Content, choice_rule: ChoiceRule, point_rule: PointRule) -> String {
    let mut hasher = Writer { hasher: blake3::Hasher::new(), buffer: Vec::with_capacity(BUFFER) };
    hasher.section("triangles", content.triangles.len());
    for triangle in content.triangles {
        triangle.0.iter().for_each(|v| hasher.floats(v.to_array()));
    }
    hasher.section("surfaces of triangles", content.infos.len());
    content.infos.iter().for_each(|info| hasher.bytes(&info.surface.to_le_bytes()));
    hasher.section("attributes", content.attributes.len());
    for attributes in content.attributes {
        hasher.section("first", attributes.first as usize);
        attributes.triangles.iter().flatten().for_each(|&vertex| hasher.bytes(&vertex.to_le_bytes()));
        hasher.section("normals", attributes.normals.len());
        attributes.normals.iter().for_each(|n| hasher.floats(n.to_array()));
        hasher.section("uvs", attributes.uvs.len());
        attributes.uvs.iter().for_each(|uv| hasher.floats(uv.to_array()));
        hasher.section("colours", attributes.colours.len());
        attributes.colours.iter().for_each(|colour| hasher.floats(colour.to_array()));
    }
    hasher.listing("spheres", content.analytic);
    hasher.listing("surfaces of spheres", content.analytic_infos);
    if !content.instances.is_empty() {
        hasher.section("groups", content.kept.len());
        content.kept.iter().for_each(|Kept { triangles, analytic, .. }| {
            [triangles.start, analytic.start].iter().for_each(|start| hasher.bytes(&(*start as u64).to_le_bytes()));
        });
        hasher.section("instances", content.instances.len());
        for instance in content.instances {
            hasher.bytes(&instance.prototype.to_le_bytes());
            let numbers = instance.to_world.to_cols_array();
            numbers.iter().for_each(|number| hasher.bytes(&number.to_bits().to_le_bytes()));
        }
    }
    hasher.listing("surfaces", content.surfaces);
    hasher.listing("materials", content.materials);
    hasher.section("emitters", content.emitters.len());
    for emitter in content.emitters {
        match emitter {
            // The triangles have been counted already.
            Emitter::Area(area) => hasher.listing("area", std::slice::from_ref(&area.emission)),
            other => hasher.listing("other", std::slice::from_ref(other)),
        }
    }
    hasher.listing("environment", content.environment.as_slice());
    // The same scene at another resolution is the same scene.
    let mut camera = *content.camera;
    camera.set_size(1, 1);
    hasher.listing("camera", &[camera]);
    if choice_rule != ChoiceRule::Power {
        hasher.listing("emitter choice", &[choice_rule]);
    }
    if point_rule != PointRule::SolidAngle {
        hasher.listing("emitter points", &[point_rule]);
    }
    hasher.finish()
}

const BUFFER: usize = 1 << 16;

/// Collects small pieces before they are hashed, which is far faster.
struct Writer {
    hasher: blake3::Hasher,
    buffer: Vec<u8>,
}

impl Writer {
    fn bytes(&mut self, bytes: &[u8]) {
        if self.buffer.len() + bytes.len() > BUFFER {
            self.hasher.update(&self.buffer);
            self.buffer.clear();
        }
        self.buffer.extend_from_slice(bytes);
    }

    fn floats<const N: usize>(&mut self, values: [f32; N]) {
        values.iter().for_each(|value| self.bytes(&value.to_bits().to_le_bytes()));
    }

    fn section(&mut self, name: &str, count: usize) {
        self.bytes(format!("{name} {count};").as_bytes());
    }

    /// Small things count by how they are printed, which tells all floats apart.
    fn listing<T: Debug>(&mut self, name: &str, values: &[T]) {
        self.section(name, values.len());
        values.iter().for_each(|value| self.bytes(format!("{value:?};").as_bytes()));
    }

    fn finish(mut self) -> String {
        self.hasher.update(&self.buffer);
        self.hasher.finalize().to_hex().to_string()
    }
}
