use super::{Origin, read};
use crate::error::SceneError;
use crate::needs::Skip;
use crate::scene::Scene;
use std::path::Path;

mod cameras;
mod emitters;
mod groups;
mod labels;
mod shapes;
mod sides;
mod textures;

const CAMERA: &str = "[camera]\nposition = [0, 0, 3]\ntarget = [0, 0, 0]\n";
const WHITE: &str = "[materials.white]\ntype = \"lambert\"\nalbedo = 0.7\n";
const BALL: &str = "[[shapes]]\ntype = \"sphere\"\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"white\"\n";
const SKY: &str = "[[emitters]]\ntype = \"constant\"\nradiance = 1\n";

fn load(text: &str) -> Result<Scene, SceneError> {
    let origin = Origin { scene: "test", file: "test.toml", folder: Some(Path::new(".")), attachments: &[] };
    read(text, origin, None)?.build(Skip::default())
}

/// Lines 1–3 camera, 4–6 material, 7–11 ball, 12–14 sky, then what is added.
fn base(added: &str) -> String {
    format!("{CAMERA}{WHITE}{BALL}{SKY}{added}")
}

fn replaced(from: &str, to: &str) -> String {
    let text = base("");
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1)
}

#[track_caller]
fn expect(text: &str, expected: &str) {
    match load(text) {
        Ok(_) => panic!("no error, but expected: {expected}"),
        Err(error) => {
            let message = error.to_string();
            assert!(
                message.starts_with(&format!("test.toml:{expected}")),
                "{message}\ninstead of test.toml:{expected}"
            );
        }
    }
}

#[test]
fn a_whole_scene_is_read() {
    let quad = "[[shapes]]\ntype = \"quad\"\norigin = [-1, 2, -1]\nedge_u = [2, 0, 0]\nedge_v = [0, 0, 2]\nmaterial = \"white\"\nemission = [17, 12, 4]\ntwo_sided = true\nflip = true\ntransform = [{ translate = [0, 1, 0] }, { rotate = { axis = [0, 1, 0], angle = 30 } }, { scale = [1, 1, -1] }, { matrix = [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1] }]\n";
    let mesh = "[[shapes]]\ntype = \"mesh\"\nvertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\nfaces = [[0, 1, 2, 3]]\nmaterial = \"white\"\n";
    let lamp = "[[emitters]]\ntype = \"point\"\nposition = [0, 2, 0]\nintensity = [1, 2, 3]\n";
    let scene = load(&base(&format!("{quad}{mesh}{lamp}"))).unwrap();
    assert_eq!((scene.name.as_str(), scene.camera.width(), scene.camera.height()), ("test", 256, 256));
    assert_eq!(scene.emitters.len(), 3);
    let counts = scene.counts();
    assert_eq!((counts.shapes, counts.triangles, counts.spheres), (3, 4, 1));
}

#[test]
fn every_material_is_read() {
    let materials = [
        "type = \"lambert\"\nalbedo = [0.1, 0.2, 0.3]",
        "type = \"lambert\"\nalbedo = { ramp = { base = 0.5, slope = 0.4, axis = [0, 0, 1] } }",
        "type = \"mirror\"",
        "type = \"mirror\"\nreflectance = 0.9",
        "type = \"dielectric\"\neta = 1.5",
        "type = \"rough_conductor\"\nreflectance = 0.9\nroughness = 0.3",
        "type = \"rough_conductor\"\neta = [0.2, 0.9, 1.1]\nk = [3.9, 2.5, 2.1]\nalpha = 0.1",
        "type = \"rough_dielectric\"\neta = 1.5\nalpha = 0.1",
    ];
    for material in materials {
        load(&replaced("type = \"lambert\"\nalbedo = 0.7", material))
            .unwrap_or_else(|error| panic!("{material}: {error}"));
    }
}

#[test]
fn anisotropic_materials_need_both_widths() {
    let metal = |keys: &str| {
        replaced("type = \"lambert\"\nalbedo = 0.7", &format!("type = \"rough_conductor\"\nreflectance = 1\n{keys}"))
    };
    let scene = load(&metal("alpha_x = 0.1\nalpha_y = 0.3")).unwrap();
    assert!(scene.needs.tangents && scene.materials()[0].needs_derivatives());
    expect(&metal("alpha_x = 0.1"), "7: `materials.white.alpha_x` is `0.1`; give both `alpha_x` and `alpha_y`");
}

#[test]
fn parameters_vary_where_ramps_give_them() {
    let rough = |ramp: &str| {
        replaced(
            "type = \"lambert\"\nalbedo = 0.7",
            &format!("type = \"rough_conductor\"\nreflectance = 1\nalpha = {{ ramp = {ramp} }}"),
        )
    };
    let scene = load(&rough("{ base = 0.3, slope = 0.1, axis = [0, 0, 1] }")).unwrap();
    assert!(scene.needs.textures && scene.needs.non_delta_lobes && !scene.needs.delta_lobes);
    expect(&rough("{ base = 0.3, slope = 0.5, axis = [0, 0, 1] }"), "8: the alpha ramp runs from -0.1");
}

#[test]
fn parameters_that_vary_together_are_tried_where_they_are() {
    let phong = |kd: f64| {
        let ramp =
            |base: f64, slope: f64| format!("{{ ramp = {{ base = {base}, slope = {slope}, axis = [0, 0, 1] }} }}");
        let keys = format!("type = \"phong\"\nkd = {}\nks = {}", ramp(kd, 0.3), ramp(0.5, -0.3));
        load(&replaced("type = \"lambert\"\nalbedo = 0.7", &keys))
    };
    assert!(phong(0.4).is_ok());
    assert!(phong(0.6).unwrap_err().to_string().contains("doesn't go with its other parameters"));
}

#[test]
fn what_tables_are_made_for_cannot_vary() {
    let compensated = "type = \"rough_conductor\"\nmultiple_scattering = \"compensated\"\nalpha = { ramp = { base = 0.3, slope = 0.1, axis = [0, 0, 1] } }";
    let refused = load(&replaced("type = \"lambert\"\nalbedo = 0.7", compensated)).unwrap_err().to_string();
    assert!(refused.contains("must be the same all over"), "{refused}");
}

#[test]
fn roughness_0_is_the_smooth_model() {
    let cases = [
        ("type = \"rough_conductor\"\nreflectance = 0.9\nroughness = 0", "Conductor"),
        ("type = \"rough_conductor\"\neta = 0.2\nk = 3.9\nalpha = 0", "Conductor"),
        ("type = \"rough_dielectric\"\neta = 1.5\nalpha = 0", "Dielectric"),
    ];
    for (material, expected) in cases {
        let scene = load(&replaced("type = \"lambert\"\nalbedo = 0.7", material)).unwrap();
        let made = format!("{:?}", scene.materials()[0]);
        assert!(made.starts_with(&format!("Constant({expected}(")), "{made}");
    }
}

#[test]
fn unknown_names_are_answered_with_the_nearest() {
    expect(&replaced("target", "tagret"), "3: unknown key `tagret` in `camera`; did you mean `target`?");
    expect(&base("[[emiters]]\n"), "15: unknown key `emiters` in a scene file; did you mean `emitters`?");
    expect(
        &replaced("radius = 1", "radius = 1\nradios = 1"),
        "11: unknown key `radios` in `shapes[0]`; did you mean `radius`?",
    );
    expect(
        &replaced("type = \"sphere\"", "type = \"shpere\""),
        "8: `shapes[0].type` is `\"shpere\"`; did you mean `sphere`?",
    );
    expect(
        &replaced("\"lambert\"", "\"lambertian\""),
        "5: `materials.white.type` is `\"lambertian\"`; did you mean `lambert`?",
    );
    expect(&replaced("\"constant\"", "\"const\""), "13: `emitters[0].type` is `\"const\"`; did you mean `constant`?");
    expect(
        &replaced("material = \"white\"", "material = \"wihte\""),
        "11: `shapes[0].material` is `\"wihte\"`; there is no such material: did you mean `white`?",
    );
    expect(&replaced("target", "type = \"fisheye\"\ntarget"), "3: `camera.type` is `\"fisheye\"`; valid are `pinhole`");
}

#[test]
fn missing_parts_are_named() {
    expect(
        &format!("{WHITE}{BALL}{SKY}"),
        "1: the scene has no camera; add a table `[camera]` with `position` and `target`",
    );
    expect(&format!("{CAMERA}{WHITE}{SKY}"), "1: the scene has no shapes; add a table `[[shapes]]`");
    expect("", "1: the scene has no shapes");
    expect(
        &replaced("material = \"white\"\n", ""),
        "7: `shapes[0]` lacks `material`; add for example `material = \"white\"`",
    );
    expect(&replaced("radius = 1\n", ""), "7: `shapes[0]` lacks `radius`; add for example `radius = 1`");
    expect(&replaced("type = \"sphere\"\n", ""), "7: `shapes[0]` lacks `type`; add for example `type = \"quad\"`");
    expect(
        &format!("{CAMERA}{BALL}"),
        "8: `shapes[0].material` is `\"white\"`; there are no materials; add a table `[materials.white]`",
    );
}

#[test]
fn the_wrong_kind_of_value_is_named() {
    expect(&replaced("radius = 1", "radius = \"1\""), "10: `shapes[0].radius` is `\"1\"`; it must be a number");
    expect(&replaced("[0, 0, 3]", "[0, 0]"), "2: `camera.position` is `[0, 0]`; it must be a vector: 3 numbers in [ ]");
    expect(&replaced("[0, 0, 3]", "3"), "2: `camera.position` is `3`; it must be a vector: 3 numbers in [ ]");
    expect(&replaced("[0, 0, 3]", "[0, 0, true]"), "2: `camera.position[2]` is `true`; it must be a number");
    expect(
        &replaced("0.7", "[0.7, 0.7]"),
        "6: `materials.white.albedo` is `[0.7, 0.7]`; a colour is a number or three of them, [r, g, b]",
    );
    expect(&replaced("radius = 1", "radius = 1\nflip = 1"), "11: `shapes[0].flip` is `1`; it must be true or false");
    expect(
        &replaced("[[shapes]]", "[shapes]"),
        "7: `shapes` is `[shapes]`; it must be a list of tables: write `[[shapes]]` with two brackets",
    );
    expect(&format!("materials = 3\n{CAMERA}{BALL}"), "1: `materials` is `3`; it must be a table");
    expect(&base("title = "), "15: this is not valid TOML");
    expect(&base("title 3"), "15: this is not valid TOML: key with no value, expected `=`; write `key = value`");
    expect(&base("").replace("[camera]", "[camera"), "1: this is not valid TOML: unclosed table, expected `]`; close ");
    expect(
        &base("title = abc"),
        "15: this is not valid TOML: string values must be quoted, expected literal string; write text in quotes: ",
    );
    expect(&base("title = \"a"), "15: this is not valid TOML: invalid basic string, expected `\"`; close ");
    expect(&replaced("albedo = 0.7", "albedo = 0.7\nalbedo = 0.8"), "7: this is not valid TOML: duplicate key; give ");
}

#[test]
fn numbers_that_cannot_be_are_refused() {
    expect(&replaced("radius = 1", "radius = -1"), "10: `shapes[0].radius` is `-1`; it must be above 0");
    expect(&replaced("radius = 1", "radius = nan"), "10: `shapes[0].radius` is `nan`; it must be a finite number");
    expect(&replaced("[0, 0, 3]", "[0, inf, 3]"), "2: `camera.position[1]` is `inf`; it must be a finite number");
    expect(
        &replaced("[0, 0, 3]", "[0, 1e30, 3]"),
        "2: `camera.position[1]` is `1e30`; its magnitude must be at most 1e15",
    );
    expect(&replaced("radiance = 1", "radiance = -1"), "14: `emitters[0].radiance` is `-1`; light cannot be negative");
    expect(&replaced("radiance = 1", "radiance = 0"), "14: `emitters[0].radiance` is `0`; an emitter must emit");
    expect(
        &replaced("radius = 1", "radius = 1\nemission = [1, -1, 1]"),
        "11: `shapes[0].emission` is `[1, -1, 1]`; light cannot be negative",
    );
    expect(
        &replaced("radius = 1", "radius = 1\nemission = 0"),
        "11: `shapes[0].emission` is `0`; an emitter must emit",
    );
    expect(
        &replaced("radius = 1", "radius = 1\ntwo_sided = true"),
        "7: `two_sided` says which sides emit, but there is no `emission`",
    );
    expect(
        &replaced("albedo = 0.7", "albedo = 1.4"),
        "6: `materials.white.albedo` is `1.4`; it must be a colour with channels from 0 to 1 (share of light that is reflected)",
    );
    expect(
        &replaced("type = \"lambert\"\nalbedo = 0.7", "type = \"mirror\"\nreflectance = -0.1"),
        "6: `materials.white.reflectance` is `-0.1`; it must be a colour with channels from 0 to 1 (share of light that is reflected)",
    );
    for eta in ["0", "-1.5", "nan"] {
        let text = replaced("type = \"lambert\"\nalbedo = 0.7", &format!("type = \"dielectric\"\neta = {eta}"));
        expect(&text, &format!("6: `materials.white.eta` is `{eta}`; "));
    }
    expect(&base(SKY), "15: there are two emitters of type `constant`; keep one: add up their radiances");
}

#[test]
fn roughness_has_its_bounds() {
    let rough = |keys: &str| {
        replaced("type = \"lambert\"\nalbedo = 0.7", &format!("type = \"rough_conductor\"\nreflectance = 1\n{keys}"))
    };
    expect(&rough("roughness = 1.5"), "7: `materials.white.roughness` is `1.5`; it must be a number from 0 to 1");
    expect(&rough("roughness = -0.1"), "7: `materials.white.roughness` is `-0.1`; it must be a number from 0 to 1");
    expect(&rough("alpha = 2"), "7: `materials.white.alpha` is `2`; it must be a number from 0 to 1");
    expect(&rough("alpha = [0.1, 0.2]"), "7: `materials.white.alpha` is `[0.1, 0.2]`; it must be a number");
    expect(
        &rough("alpha = 0.1\nroughness = 0.1"),
        "8: `materials.white.roughness` is `0.1`; give either `roughness`, or `alpha`",
    );
    expect(
        &rough("alpha = 0.1\neta = 2"),
        "6: `materials.white.reflectance` is `1`; give either `reflectance`, or `metal`, or both `eta` and `k`",
    );
}

#[test]
fn ramps_stay_in_their_range_over_the_shape() {
    let steep = "albedo = { ramp = { base = 0.5, slope = 0.6, axis = [0, 0, 2] } }";
    expect(&replaced("albedo = 0.7", steep), "7: the albedo ramp runs from -0.1");
    let falling = "radius = 1\nemission = { ramp = { base = 0.5, slope = 1, axis = [1, 0, 0] } }";
    expect(&replaced("radius = 1", falling), "7: the emission ramp falls to -0.5 over this shape");
    let scaled =
        "radius = 1\ntransform = [{ scale = 0.5 }]\nemission = { ramp = { base = 0.5, slope = 1, axis = [1, 0, 0] } }";
    load(&replaced("radius = 1", scaled)).unwrap();
    let axis = "albedo = { ramp = { base = 0.5, slope = 0.6, axis = [0, 0, 0] } }";
    expect(
        &replaced("albedo = 0.7", axis),
        "6: `materials.white.albedo.ramp.axis` is `[0, 0, 0]`; it must not be zero",
    );
    let scale = "albedo = { ramp = { base = 0.5, slope = 0.1, axis = [0, 0, 1], scale = 0 } }";
    expect(&replaced("albedo = 0.7", scale), "6: `materials.white.albedo.ramp.scale` is `0`; it must be above 0");
}

#[test]
fn transforms_keep_volume_and_spheres() {
    let with = |steps: &str| replaced("radius = 1", &format!("radius = 1\ntransform = {steps}"));
    expect(&with("[{ scale = 0 }]"), "11: `shapes[0].transform` is `[{ scale = 0 }]`; it flattens the shape");
    expect(
        &with("[{ scale = [1, 2, 1] }]"),
        "11: `shapes[0].transform` is `[{ scale = [1, 2, 1] }]`; a sphere must stay a sphere",
    );
    expect(&with("[{ turn = 1 }]"), "11: unknown key `turn` in `shapes[0].transform[0]`");
    expect(
        &with("[{ scale = 1, translate = [0, 0, 0] }]"),
        "11: `shapes[0].transform[0]` is `{ scale = 1, translate = [0, 0, 0] }`; a step has exactly one key",
    );
    expect(
        &with("[{ matrix = [1, 2] }]"),
        "11: `shapes[0].transform[0].matrix` is `[1, 2]`; it must be a matrix, row by row: 12 or 16 numbers in [ ]",
    );
    expect(&with("[{ matrix = [1,0,0,0,0,1,0,0,0,0,1,0,0,0,1,1] }]"), "11: `shapes[0].transform[0].matrix` is");
    expect(
        &with("[{ rotate = { axis = [0, 0, 0], angle = 3 } }]"),
        "11: `shapes[0].transform[0].rotate.axis` is `[0, 0, 0]`; it must not be zero",
    );
}

#[test]
fn meshes_are_checked() {
    let mesh =
        |body: &str| replaced("type = \"sphere\"\ncenter = [0, 0, 0]\nradius = 1", &format!("type = \"mesh\"\n{body}"));
    let corners = "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\n";
    expect(
        &mesh(&format!("{corners}faces = [[0, 1, 3]]")),
        "10: `shapes[0].faces[0][2]` is `3`; the mesh has 3 vertices, counted from 0",
    );
    expect(
        &mesh(&format!("{corners}faces = [[0, 1, -1]]")),
        "10: `shapes[0].faces[0][2]` is `-1`; the mesh has 3 vertices, counted from 0",
    );
    expect(
        &mesh(&format!("{corners}faces = [[0, 1]]")),
        "10: `shapes[0].faces[0]` is `[0, 1]`; a face has at least 3 vertices",
    );
    expect(&mesh(&format!("{corners}faces = []")), "10: `shapes[0].faces` is `[]`; a mesh needs at least one face");
    expect(
        &mesh(&format!("{corners}faces = [[0, 1, 1.5]]")),
        "10: `shapes[0].faces[0][2]` is `1.5`; it must be a whole number",
    );
    expect(
        &mesh("faces = [[0, 1, 2]]"),
        "7: a mesh has neither `file` nor `vertices`; add `file = \"mesh.obj\"`, or `vertices` and `faces`",
    );
    expect(&mesh("file = \"nowhere.obj\""), "9: `shapes[0].file` is `\"nowhere.obj\"`; there is no file ./nowhere.obj");
    expect(
        &mesh("file = \"mesh.stl\""),
        "9: `shapes[0].file` is `\"mesh.stl\"`; meshes are read from .obj and .ply files",
    );
    let quad = "type = \"quad\"\norigin = [0, 0, 0]\nedge_u = [1, 0, 0]\nedge_v = [2, 0, 0]";
    let text = replaced("type = \"sphere\"\ncenter = [0, 0, 0]\nradius = 1", quad);
    expect(&text, "11: `shapes[0].edge_v` is `[2, 0, 0]`; `edge_u` and `edge_v` must span an area");
}

#[test]
fn cameras_are_checked() {
    expect(
        &replaced("target = [0, 0, 0]", "target = [0, 0, 3]"),
        "3: `camera.target` is `[0, 0, 3]`; it must differ from the camera's `position`",
    );
    expect(
        &replaced("target = [0, 0, 0]", "target = [0, 0, 0]\nup = [0, 0, 1]"),
        "1: the camera looks along its `up`, [0, 0, 1]",
    );
    for (key, value) in [("fov", "0"), ("fov", "180"), ("width", "0"), ("height", "-3"), ("width", "1000000")] {
        let text = replaced("target = [0, 0, 0]", &format!("target = [0, 0, 0]\n{key} = {value}"));
        expect(&text, &format!("4: `camera.{key}` is `{value}`; "));
    }
    let large = "target = [0, 0, 0]\nwidth = 60000\nheight = 60000";
    expect(&replaced("target = [0, 0, 0]", large), "1: the image size 60000x60000 is too large");
}

/// No text whatever makes the reader panic: prefixes of a scene, and scenes with bytes replaced.
#[test]
fn nothing_panics() {
    let whole = base(
        "[[shapes]]\ntype = \"mesh\"\nvertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0]]\nfaces = [[0, 1, 2]]\nmaterial = \"white\"\n",
    );
    for end in 0..whole.len() {
        let _ = load(&whole[..end]);
    }
    let mut state = 1u64;
    let mut next = |n: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % n
    };
    let junk = [
        "nan",
        "-inf",
        "1e308",
        "-1",
        "0",
        "[]",
        "{}",
        "\"\"",
        "[[",
        "9999999999999999999",
        "true",
        "=",
        "\n",
        "é",
        ".",
    ];
    for _ in 0..4000 {
        let mut text = whole.clone();
        for _ in 0..1 + next(3) {
            let (mut at, mut end) = (next(text.len()), next(6));
            while !text.is_char_boundary(at) {
                at -= 1;
            }
            end = (at + end).min(text.len());
            while !text.is_char_boundary(end) {
                end += 1;
            }
            text.replace_range(at..end, junk[next(junk.len())]);
        }
        let _ = load(&text);
    }
}
