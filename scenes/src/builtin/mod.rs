//! The scenes that come with the program, embedded from `library/`, and the closed forms of those that have one.

mod exact;

pub use exact::{exact, integrating_sphere};

/// Every built-in scene: name and scene file. This is the list.
const SCENES: &[(&str, &str)] = &[
    ("cornell_box", include_str!("../../library/cornell_box.toml")),
    ("furnace", include_str!("../../library/furnace.toml")),
    ("integrating_sphere", include_str!("../../library/integrating_sphere.toml")),
    ("veach_mis", include_str!("../../library/veach_mis.toml")),
    ("glass_caustic", include_str!("../../library/glass_caustic.toml")),
    ("mirror_caustic", include_str!("../../library/mirror_caustic.toml")),
    ("indirect_lamp", include_str!("../../library/indirect_lamp.toml")),
];

/// The names of the built-in scenes.
pub const NAMES: &[&str] = &names();

const fn names() -> [&'static str; SCENES.len()] {
    let mut names = [""; SCENES.len()];
    let mut i = 0;
    while i < SCENES.len() {
        names[i] = SCENES[i].0;
        i += 1;
    }
    names
}

/// The scene file of a built-in scene.
pub fn source(name: &str) -> Option<&'static str> {
    SCENES.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
}

/// The title of a built-in scene.
pub fn title(name: &str) -> Option<String> {
    crate::description::title(source(name)?)
}

#[cfg(test)]
mod tests;
