//! Parts of a scene's surface that meters measure.

use crate::emitter::EmitterId;
use crate::scene::Scene;
use crate::surface::SurfaceId;

/// All surfaces of a label or of a material.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Of each surface of the scene whether it belongs to it.
    surfaces: Vec<bool>,
    /// Of each emitter whether it is such a surface.
    emitters: Vec<bool>,
    /// Their area \[m²\], one side; `None` where one of them is kept once and placed many times.
    pub area: Option<f64>,
}

impl Region {
    /// Whether a surface belongs to it.
    #[inline]
    pub fn has(&self, surface: SurfaceId) -> bool {
        self.surfaces[surface.0 as usize]
    }

    /// Whether an emitter is one of its surfaces.
    #[inline]
    pub fn emits(&self, emitter: EmitterId) -> bool {
        self.emitters[emitter.0 as usize]
    }
}

impl Scene {
    /// The surfaces that go by a label, or whose material has this name; `None` if there are none.
    pub fn region(&self, label: &str) -> Option<Region> {
        let surfaces: Vec<bool> = self.labels.surfaces().iter().map(|names| names.iter().any(|n| n == label)).collect();
        let mine = || self.surfaces.iter().zip(&surfaces).filter(|(_, belongs)| **belongs).map(|(surface, _)| surface);
        let mut emitters = vec![false; self.emitters.len()];
        mine().filter_map(|surface| surface.emitter).for_each(|id| emitters[id.0 as usize] = true);
        let area = mine().map(|surface| surface.area).sum();
        surfaces.contains(&true).then_some(Region { surfaces, emitters, area })
    }
}
