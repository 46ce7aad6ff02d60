//! What surfaces and emitters go by: in light-path expressions, and as light groups.

use crate::builder::MaterialName;
use crate::emitter::EmitterId;
use crate::surface::Surface;
use std::sync::Arc;

/// The light group of the emitters that have no label.
pub const UNLABELLED: &str = "unlabelled";

/// The labels of a scene's surfaces and emitters.
#[derive(Clone, Debug, Default)]
pub struct Labels {
    /// Of each surface its own, if it has one.
    surfaces: Vec<Option<Arc<str>>>,
    /// Of each surface its material's.
    materials: Vec<Arc<str>>,
    /// Of each emitter.
    emitters: Vec<Option<Arc<str>>>,
}

impl Labels {
    /// Adds a surface, and its emitter if it emits.
    pub(crate) fn add_surface(&mut self, label: Option<Arc<str>>, emits: bool) {
        if emits {
            self.emitters.push(label.clone());
        }
        self.surfaces.push(label);
    }

    /// Adds an emitter that is no surface.
    pub(crate) fn add_emitter(&mut self, label: Option<Arc<str>>) {
        self.emitters.push(label);
    }

    /// Lets surfaces go by their materials' names too.
    pub(crate) fn name_materials(&mut self, surfaces: &[Surface], names: &[MaterialName]) {
        let names: Vec<Arc<str>> = names.iter().map(|name| name.name.as_str().into()).collect();
        self.materials = surfaces.iter().map(|surface| names[surface.material.0 as usize].clone()).collect();
    }

    /// What each surface goes by: its material, and its own label if it has one. A [`SurfaceId`](crate::SurfaceId) is a place in this
    /// list.
    pub fn surfaces(&self) -> Vec<Vec<String>> {
        let both = self.materials.iter().zip(&self.surfaces);
        both.map(|(material, own)| [material].into_iter().chain(own).map(|label| label.to_string()).collect()).collect()
    }

    /// What each emitter goes by, if anything. An [`EmitterId`] is a place in this list.
    pub fn emitters(&self) -> Vec<Vec<String>> {
        self.emitters.iter().map(|label| label.iter().map(|label| label.to_string()).collect()).collect()
    }

    /// The light groups, in the order of their first emitters: emitters of one label, and those without one.
    pub fn groups(&self) -> Vec<LightGroup> {
        let mut groups: Vec<LightGroup> = Vec::new();
        for (index, label) in self.emitters.iter().enumerate() {
            let name = label.as_deref().unwrap_or(UNLABELLED);
            let emitter = EmitterId(index as u32);
            match groups.iter_mut().find(|group| group.name == name) {
                Some(group) => group.emitters.push(emitter),
                None => groups.push(LightGroup { name: name.to_owned(), emitters: vec![emitter] }),
            }
        }
        groups
    }
}

/// Emitters that are dimmed together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LightGroup {
    /// Their label.
    pub name: String,
    /// They themselves.
    pub emitters: Vec<EmitterId>,
}
