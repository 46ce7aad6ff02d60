//! What a scene asks of a method, decided once when the scene is built.

use serde::{Deserialize, Serialize};

/// Whether work that a scene doesn't need is left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Skip {
    /// Leave out what cannot contribute.
    #[default]
    Unneeded,
    /// Leave out nothing: always a tree, always a table for the choice of emitter, always the path for textures.
    Nothing,
    /// Leave out all that cannot contribute but this, so that what leaving it out saves can be measured.
    AllBut(Work),
}

impl Skip {
    /// Whether this work is left out of scenes that don't need it.
    pub fn leaves_out(self, work: Work) -> bool {
        match self {
            Self::Unneeded => true,
            Self::Nothing => false,
            Self::AllBut(kept) => kept != work,
        }
    }
}

/// Work that can be left out of a scene that doesn't need it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Work {
    /// Materials are read where they are met, also those that are the same everywhere.
    Textures,
    /// Rays ask of each surface that they find whether it is met there.
    Masks,
    /// Light subpaths are traced that no camera subpath can be connected to.
    Connections,
    /// Every hit asks whether it is at the boundary of a body.
    Subsurface,
    /// A number is drawn and a table read for the choice of an emitter.
    EmitterChoice,
    /// Camera walks go one ray farther than their last scattering, to meet emitters.
    EmitterHits,
    /// A number is drawn for the choice of a lobe.
    LobeChoice,
    /// Numbers are drawn for a place on the camera.
    CameraPoints,
    /// There is a tree above the primitives.
    Bvh,
}

impl Work {
    /// All of it.
    pub const ALL: [Self; 9] = [
        Self::Textures,
        Self::Masks,
        Self::Connections,
        Self::Subsurface,
        Self::EmitterChoice,
        Self::EmitterHits,
        Self::LobeChoice,
        Self::CameraPoints,
        Self::Bvh,
    ];

    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Textures => "textures",
            Self::Masks => "masks",
            Self::Connections => "connections",
            Self::Subsurface => "subsurface",
            Self::EmitterChoice => "emitter_choice",
            Self::EmitterHits => "emitter_hits",
            Self::LobeChoice => "lobe_choice",
            Self::CameraPoints => "camera_points",
            Self::Bvh => "bvh",
        }
    }
}

/// What a scene asks of a method.
///
/// Under [`Skip::Nothing`] every flag has the value that asks for the most work, under [`Skip::AllBut`] that of the work that is
/// kept; `emitters` and `primitives` are always the true counts.
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
    /// Whether a method does without this work here.
    pub fn skips(&self, work: Work) -> bool {
        match work {
            Work::Textures => !self.textures,
            Work::Masks => !self.masks,
            Work::Connections => !self.non_delta_lobes,
            Work::Subsurface => !self.subsurface,
            Work::EmitterChoice => !self.emitter_choice,
            Work::EmitterHits => !self.hittable_emitters,
            Work::LobeChoice => self.only_lambertian,
            Work::CameraPoints => self.pinhole,
            Work::Bvh => self.few_primitives,
        }
    }

    /// The names of what this scene lets a method leave out: an environment is no work where there is none, whatever is skipped
    /// elsewhere.
    pub fn skipped(&self) -> Vec<&'static str> {
        let environment = (!self.environment).then_some("environment");
        let work = Work::ALL.into_iter().filter(|&work| self.skips(work)).map(Work::name);
        environment.into_iter().chain(work).collect()
    }
}
