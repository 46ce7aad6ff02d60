//! Scenes of other programs: rendered as they are, described, and converted.

use super::*;

const SCENE: &str = r#"<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="4"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="40"/>
        <transform name="to_world"><lookat origin="0, 1, 5" target="0, 0.5, 0" up="0, 1, 0"/></transform>
        <film type="hdrfilm">
            <integer name="width" value="12"/><integer name="height" value="8"/><rfilter type="box"/>
        </film>
    </sensor>
    <bsdf type="twosided" id="white"><bsdf type="diffuse"/></bsdf>
    <shape type="rectangle">
        <transform name="to_world"><rotate x="1" angle="-90"/><scale value="3"/></transform>
        <ref id="white"/>
    </shape>
    <shape type="sphere">
        <transform name="to_world"><scale x="1" y="0.5" z="1"/><translate y="0.5"/></transform>
        <ref id="white"/>
    </shape>
    <emitter type="point"><rgb name="intensity" value="9"/><point name="position" x="1" y="3" z="2"/></emitter>
</scene>
"#;

#[test]
fn a_scene_renders_to_the_same_bits_as_it_is_and_converted() {
    let folder = folder_with(&[("room.xml", SCENE)]);
    std::fs::create_dir(folder.path().join("out")).unwrap();
    let text = succeed(folder.path(), &["convert", "room.xml", "-o", "out/room.toml"]);
    assert!(text.contains("1 files beside it") && text.contains("becomes a mesh"), "{text}");
    let render = |scene: &str, name: &str| {
        let (image, stats) = (format!("{name}.exr"), format!("{name}.json"));
        succeed(folder.path(), &["render", scene, "--spp", "4", "-o", &image, "--stats", &stats]);
        let stats = json(folder.path(), &stats);
        (stats["orders"].clone(), stats["max_order"].clone())
    };
    let (foreign, own) = (render("room.xml", "a"), render("out/room.toml", "b"));
    assert_eq!(foreign, own);
    // `max_depth` 4 is the scene's own last order, 3.
    assert_eq!(foreign.1, 3);
    let stats = succeed(folder.path(), &["render", "room.xml", "--spp", "4", "--max-order", "1", "-o", "c.exr"]);
    assert!(stats.contains("approximated: a sphere that its transform stretches becomes a mesh"), "{stats}");
    // Again, over what it wrote itself, and not over what others wrote.
    succeed(folder.path(), &["convert", "room.xml", "-o", "out/room.toml"]);
    std::fs::write(folder.path().join("out/room_mesh001.obj"), "mine").unwrap();
    refused(
        folder.path(),
        &["convert", "room.xml", "-o", "out/room.toml"],
        &["room_mesh001.obj", "was not made by neumann"],
    );
}

#[test]
fn what_was_approximated_is_told_and_may_be_an_error() {
    let folder = folder_with(&[("room.xml", SCENE), ("ball.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")]);
    let text = succeed(folder.path(), &["scene", "room.xml"]);
    for words in ["room.xml:11: mapped: `shape rectangle` becomes `quad`", "room.xml:2: ignored: the integrator `path`"]
    {
        assert!(text.contains(words), "{text}");
    }
    let output = neumann(folder.path(), &["scene", "room.xml", "--strict"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(super::text(&output.stderr).contains("(approximations: 1)"));
    let clean = SCENE.replace("y=\"0.5\" z=\"1\"", "y=\"1\" z=\"1\"");
    std::fs::write(folder.path().join("clean.xml"), clean).unwrap();
    succeed(folder.path(), &["scene", "clean.xml", "--strict"]);
    refused(folder.path(), &["convert", "a.toml", "-o", "b.toml"], &["scene file already"]);
    refused(folder.path(), &["convert", "room.xml", "-o", "b.xml"], &["call it b.toml"]);
    refused(folder.path(), &["convert", "rom.xml", "-o", "b.toml"], &["did you mean `room.xml`"]);
    succeed(folder.path(), &["convert", "ball.obj", "-o", "ball.toml"]);
    succeed(folder.path(), &["scene", "ball.toml"]);
}

const MODEL: &str = r#"{
  "asset": { "version": "2.0" },
  "nodes": [{ "mesh": 0 }, { "mesh": 0, "translation": [-2, 0.5, -1] }, { "mesh": 0, "scale": [1, -1, 1] }],
  "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "material": 0 }] }],
  "materials": [{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "metallicFactor": 0 } }],
  "textures": [{ "source": 0 }],
  "images": [{ "uri": "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==" }],
  "accessors": [
    { "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3 },
    { "bufferView": 0, "byteOffset": 36, "componentType": 5126, "type": "VEC2", "count": 3 }
  ],
  "bufferViews": [{ "buffer": 0, "byteLength": 60 }],
  "buffers": [{ "byteLength": 60, "uri": "data:;base64,AAAAAAAAAAAAAAAAAAAAQAAAAAAAAAAAAAAAAAAAAEAAAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/" }]
}"#;

#[test]
fn what_a_gltf_file_holds_is_written_beside_its_scene_file() {
    let folder = folder_with(&[("model.gltf", MODEL)]);
    std::fs::create_dir(folder.path().join("out")).unwrap();
    let text = succeed(folder.path(), &["convert", "model.gltf", "-o", "out/model.toml"]);
    assert!(text.contains("2 files beside it") && text.contains("becomes `principled`"), "{text}");
    let render = |scene: &str, name: &str| {
        let (image, stats) = (format!("{name}.exr"), format!("{name}.json"));
        let settings = ["--spp", "4", "--size", "12x8", "--max-order", "2"];
        succeed(folder.path(), &[&["render", scene, "-o", &image, "--stats", &stats], &settings[..]].concat());
        json(folder.path(), &stats)["orders"].clone()
    };
    assert_eq!(render("model.gltf", "a"), render("out/model.toml", "b"));
    // Again, over what it wrote itself, and not over another image.
    succeed(folder.path(), &["convert", "model.gltf", "-o", "out/model.toml"]);
    std::fs::write(folder.path().join("out/model_image001.png"), "mine").unwrap();
    let words = ["model_image001.png", "was not made by neumann"];
    refused(folder.path(), &["convert", "model.gltf", "-o", "out/model.toml"], &words);
    refused(folder.path(), &["scene", "model.glb"], &["did you mean", "model.gltf"]);
}
