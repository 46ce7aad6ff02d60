//! What a state is of.

use crate::machine::{VERSION, machine};
use crate::plan::{PlannedMethod, PlannedScene};
use crate::program::program;
use integrators::{PartSettings, RenderSettings, Window};

/// How many digits of a key are in a file's name.
const KEY_IN_NAME: usize = 8;

/// What a state is of: its file's name, and the hash of all that its numbers follow from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unit {
    pub(super) name: String,
    pub(super) file: String,
    pub(super) key: blake3::Hash,
}

impl Unit {
    /// A unit of work of this name, whose numbers follow from this program and `origin`.
    pub fn new(name: &str, origin: &str) -> Self {
        let machine = machine(0);
        let key = format!("{VERSION} {:?}\n{} {}\n{name}\n{origin}", program(), machine.platform, machine.kernels);
        let key = blake3::hash(key.as_bytes());
        Self { name: name.to_owned(), file: format!("{name}-{}.state", &key.to_hex()[..KEY_IN_NAME]), key }
    }

    /// A method at work in a scene whose camera has its size by now, to make `what` of it: images taken apart like this, or a
    /// checkpoint's. What is noted of them follows from `judged_by` too.
    pub fn of_render(
        scene: &PlannedScene,
        planned: &PlannedMethod,
        settings: &RenderSettings,
        parts: &PartSettings,
        (what, judged_by): (&str, &str),
    ) -> Self {
        let origin = format!("{}\n{judged_by}", origin(scene, planned, settings, parts));
        let name = format!("{}-{}-{what}", scene.name, planned.label);
        Self::new(&name, &origin)
    }

    /// Whether a state's file is of a unit of this name.
    pub(super) fn is_of(&self, file: &str) -> bool {
        let rest = file.strip_prefix(&self.name).and_then(|rest| rest.strip_prefix('-'));
        let key = rest.and_then(|rest| rest.strip_suffix(".state"));
        key.is_some_and(|key| key.len() == KEY_IN_NAME && key.bytes().all(|b| b.is_ascii_hexdigit()))
    }

    /// The hash of all that its numbers follow from.
    pub fn key(&self) -> String {
        self.key.to_hex().to_string()
    }
}

/// All that the images of a method in a scene follow from, the program apart.
pub fn origin(
    scene: &PlannedScene,
    planned: &PlannedMethod,
    settings: &RenderSettings,
    parts: &PartSettings,
) -> String {
    // The scene's hash knows nothing of its pixels.
    let (width, height) = (scene.scene.camera.width(), scene.scene.camera.height());
    let pixels = format!("{width}x{height} {:?}", Window::of(&scene.scene));
    let method = format!("{} {}", planned.method.name(), planned.method.settings());
    format!("{} {pixels}\n{method}\n{settings:?}\n{parts:?}", scene.scene.hash)
}
