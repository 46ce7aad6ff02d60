//! What is refused, and in which words.

use super::*;
use crate::cli::{folder_with, refused, succeed};
use crate::support::ALL;

#[test]
fn methods_that_cannot_follow_light_through_bodies_say_so() {
    let scene = half_space(GREEN, DVec3::ZERO, Skip::Unneeded);
    for name in ALL.into_iter().chain(["adaptive", "coherent", "adaptive_bdpt", "coherent_bdpt"]) {
        let method = method(name);
        let error = Render::new(&scene, method.as_ref(), settings(1, SamplerKind::Independent)).err();
        if ["path", "adaptive", "coherent"].contains(&name) {
            assert!(error.is_none() && method.carries_subsurface());
            continue;
        }
        let message = error.expect(name).to_string();
        for word in [name, "`stuff`", "subsurface", "use a method that can (path, adaptive, guided, coherent, pssmlt)"]
        {
            assert!(message.contains(word), "{name}: `{word}` in {message}");
        }
    }
    // A material that no shape has is in nobody's way.
    let mut builder = SceneBuilder::new("unused");
    builder.material(GREEN.material());
    let grey = builder.material(crate::support::lambert(0.5));
    floor(&mut builder, DVec3::ZERO, grey);
    builder.environment(Spectrum::ONE);
    builder.camera(camera(dvec3(0.3, 1.0, 1.7), DVec3::ZERO, 50.0, SIZE));
    let scene = builder.build(Skip::Unneeded).unwrap();
    assert!(!scene.needs.subsurface);
    for name in ALL {
        assert_eq!(method(name).unsupported(&scene), None, "{name}");
    }
}

const WAX: &str = r#"
[camera]
position = [0, 0, 3]
target = [0, 0, 0]
width = 8
height = 8
[materials.wax]
type = "subsurface"
albedo = 0.8
mean_free_path = 0.1
[[shapes]]
type = "sphere"
center = [0, 0, 0]
radius = 1
material = "wax"
[[emitters]]
type = "constant"
radiance = 1
"#;

#[test]
fn the_program_ends_with_one_message() {
    let hot = WAX.replace("albedo = 0.8", "albedo = [0.8, 1.8, 0.8]");
    let folder = folder_with(&[("wax.toml", WAX), ("hot.toml", &hot)]);
    let cases: [(&[&str], &str); 3] = [
        (&["render", "wax.toml", "-i", "bdpt"], "bdpt cannot render this scene: the material `wax` lets light through"),
        (&["run", "comparison", "--set", "scenes=[\"wax.toml\"]"], "cannot render wax: the material `wax` lets light"),
        (
            &["render", "hot.toml"],
            "hot.toml:9: `materials.wax.albedo` is `[0.8, 1.8, 0.8]`; keep every channel between",
        ),
    ];
    for (arguments, expected) in cases {
        refused(folder.path(), arguments, &[expected]);
    }
    succeed(folder.path(), &["render", "wax.toml", "-i", "path", "--spp", "4", "-q"]);
}
