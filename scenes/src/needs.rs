//! What a scene asks of a method, decided once when the scene is built.

use serde::{Deserialize, Serialize};

/// Whether work that a scene doesn't need is left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Skip {
    /// Leave out what cannot contribute.
    #[default]
    Unneeded,
    /// Leave out nothing: always a tree, always a table for the choice of emitter, always the path for textures.
    Nothing,
}

/// What a scene asks of a method.
///
/// Under [`Skip::Nothing`] every flag has the value that asks for the most work; `emitters` and `primitives` are always the
/// true counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Needs {
    /// What was left out when the scene was built.
    pub skip: Skip,
    /// Light arrives from infinity out of all directions.
    pub environment: bool,
    /// Some material or emission varies over its surface.
    pub textures: bool,
    /// Some material is anisotropic or has relief, so that surfaces need tangents.
    pub tangents: bool,
    /// Some material is not met everywhere, so that rays may pass surfaces.
    pub masks: bool,
    /// Some surface has a Dirac part.
    pub delta_lobes: bool,
    /// Some surface has a part that isn't Dirac, so that connections can contribute.
    pub non_delta_lobes: bool,
    /// Some surface bounds a body that light goes through, so that it leaves elsewhere than it came in.
    pub subsurface: bool,
    /// Every surface is Lambertian.
    pub only_lambertian: bool,
    /// Number of emitters.
    pub emitters: usize,
    /// The choice among emitters is open: more than one of them has power.
    pub emitter_choice: bool,
    /// Some emitter can be met by a ray: an area emitter or the environment.
    pub hittable_emitters: bool,
    /// Some emitter is a point, a spot or a direction, so that no ray meets it.
    pub delta_emitters: bool,
    /// So few primitives that a list is searched instead of a tree.
    pub few_primitives: bool,
    /// The rays of the camera leave from one point, so that no place on it is to be sampled.
    pub pinhole: bool,
    /// Number of triangles and spheres.
    pub primitives: usize,
}

impl Needs {
    /// The names of what this scene lets a method leave out.
    pub fn skipped(&self) -> Vec<&'static str> {
        if self.skip == Skip::Nothing {
            return Vec::new();
        }
        let candidates = [
            ("environment", !self.environment),
            ("textures", !self.textures),
            ("tangents", !self.tangents),
            ("masks", !self.masks),
            ("delta_lobes", !self.delta_lobes),
            ("connections", !self.non_delta_lobes),
            ("subsurface", !self.subsurface),
            ("emitter_choice", !self.emitter_choice),
            ("emitter_hits", !self.hittable_emitters),
            ("delta_emitters", !self.delta_emitters),
            ("camera_points", self.pinhole),
            ("bvh", self.few_primitives),
        ];
        candidates.iter().filter(|(_, unneeded)| *unneeded).map(|(name, _)| *name).collect()
    }
}
