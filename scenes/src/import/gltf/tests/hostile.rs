//! Files that are wrong: one error with file and line and mend, or a note.

use proptest::prelude::*;

use super::super::document::Document;
use super::*;

/// The error of a triangle whose file has been changed.
fn changed(change: impl Fn(&mut Value)) -> String {
    let mut fixture = Fixture::made_of(json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }));
    fixture.texture(&[[1.0; 4]]);
    change(&mut fixture.json);
    fixture.fault()
}

fn set(path: &'static str, value: Value) -> impl Fn(&mut Value) {
    move |json| match json.pointer_mut(path) {
        Some(place) => *place = value.clone(),
        None => {
            let (parent, key) = path.rsplit_once('/').unwrap();
            json.pointer_mut(parent).unwrap()[key] = value.clone();
        }
    }
}

#[test]
fn errors_name_file_line_object_and_mend() {
    let cases: [(&'static str, Value, &str); 40] = [
        ("/asset/version", json!("1.0"), "this is glTF 1.0; save it as glTF 2.0"),
        ("/asset/minVersion", json!("2.1"), "this is glTF 2.1"),
        ("/scene", json!(7), "`scene` is 7"),
        ("/scenes/0/nodes", json!([9]), "scene 0 names node 9, which is not there; the file has 1, counted from 0"),
        ("/nodes/0/mesh", json!(3), "node 0 names mesh 3, which is not there"),
        ("/nodes/0/mesh", json!(-1), "node 0 cannot be read: invalid value: integer `-1`, expected usize"),
        ("/nodes/0/mesh", json!("a"), "node 0 cannot be read: invalid type: string \"a\", expected usize"),
        ("/nodes/0/children", json!([0]), "node 0 stands in two places, or below itself; let every node"),
        ("/nodes/0/matrix", json!([1, 2]), "node 0 cannot be read: invalid length 2"),
        (
            "/nodes/0/matrix",
            json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]),
            "node 0 has a matrix that is not affine",
        ),
        ("/nodes/0/rotation", json!([0, 0, 0, 0]), "node 0 has a rotation without length"),
        ("/nodes/0/scale", json!([1e308, 1e308, 1e308]), "a.glb:1: "),
        ("/nodes/0/skin", json!(0), "node 0 names skin 0, which is not there; the file has none"),
        ("/nodes/0/camera", json!(0), "node 0 names camera 0"),
        ("/meshes/0", json!({}), "mesh 0 cannot be read: missing field `primitives`"),
        ("/meshes/0/primitives/0/mode", json!(7), "mesh 0, primitive 0, has the mode 7; give one from 0 to 6"),
        ("/meshes/0/primitives/0/attributes", json!({}), "mesh 0, primitive 0, has no `POSITION`; give its vertices"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(9), "mesh 0 names accessor 9, which is not there"),
        ("/meshes/0/primitives/0/attributes/NORMAL", json!(1), "primitive 0, has a `NORMAL` of 2 numbers each"),
        ("/meshes/0/primitives/0/material", json!(4), "mesh 0 names material 4"),
        ("/meshes/0/primitives/0/indices", json!(0), "accessor 0 has indices that are no whole numbers"),
        (
            "/accessors/0/count",
            json!(4),
            "accessor 0 needs 4 elements, 12 bytes apart from byte 0, and its view has 36",
        ),
        ("/accessors/0/count", json!(4_000_000_000u64), "accessor 0 needs 4000000000 elements"),
        ("/accessors/0/count", json!(1e30), "accessor 0 cannot be read"),
        ("/accessors/0/count", json!(18_446_744_073_709_551_615u64), "has 18446744073709551615 elements; give fewer"),
        (
            "/accessors/0/byteOffset",
            json!(18_446_744_073_709_551_615u64),
            "from byte 18446744073709551615, and its view has 36",
        ),
        ("/accessors/0/componentType", json!(5124), "accessor 0 has the component type 5124; give one of 5120"),
        ("/accessors/0/type", json!("VEC5"), "accessor 0 has the type `VEC5`; give SCALAR"),
        ("/accessors/0/bufferView", json!(99), "accessor 0 names buffer view 99"),
        ("/accessors/1/count", json!(2), "primitive 0, has 2 of `TEXCOORD_0` for 3 of `POSITION`"),
        ("/bufferViews/0/byteStride", json!(4), "has elements of 12 bytes, 4 bytes apart; give a `byteStride`"),
        (
            "/bufferViews/0/byteLength",
            json!(999_999),
            "buffer view 0 goes from byte 0 for 999999 of buffer 0, which has",
        ),
        ("/bufferViews/0/buffer", json!(1), "buffer view 0 names buffer 1"),
        ("/buffers/0/byteLength", json!(999_999), "bytes where it says 999999; give the whole of it"),
        (
            "/buffers/0/uri",
            json!("data:;base64,@@@@"),
            "buffer 0 has a data URI whose character 1 is not base64; write",
        ),
        ("/buffers/0/uri", json!("data:text/plain,abc"), "buffer 0 has a data URI that is not base64"),
        (
            "/buffers/0/uri",
            json!("../none/a.bin"),
            "buffer 0 names `../none/a.bin`, a file that is not there; it was looked for in",
        ),
        (
            "/buffers/0/uri",
            json!("https://example.org/a.bin"),
            "put the file beside the scene and name it without a scheme",
        ),
        ("/materials/0/pbrMetallicRoughness/baseColorTexture/index", json!(5), "material 0 names texture 5"),
        ("/textures/0/source", json!(5), "texture 0 names image 5"),
    ];
    for (path, value, words) in cases {
        let error = changed(set(path, value.clone()));
        assert!(error.starts_with("a.glb:1: ") && error.contains(words), "{path} = {value}\n{error}");
    }
}

#[test]
fn what_is_compressed_is_named() {
    for (name, words) in [
        ("KHR_draco_mesh_compression", "without compression"),
        ("EXT_meshopt_compression", "without compression"),
        ("KHR_texture_basisu", "as PNG or JPEG"),
        ("VENDOR_magic", "export the file without it"),
    ] {
        let error = changed(|json| json["extensionsRequired"] = json!([name]));
        let expected = format!("a.glb:1: the file requires the extension `{name}`, which is not read; ");
        assert!(error.starts_with(&expected) && error.ends_with(words), "{error}");
    }
    let error = changed(|json| {
        json["meshes"][0]["primitives"][0]["extensions"] = json!({ "KHR_draco_mesh_compression": {} });
        json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    });
    assert!(error.contains("mesh 0, primitive 0, is compressed by `KHR_draco_mesh_compression`"), "{error}");
    let error = changed(|json| {
        json["buffers"].as_array_mut().unwrap().push(json!({ "byteLength": 8 }));
        json["bufferViews"][0] =
            json!({ "buffer": 1, "byteLength": 8, "extensions": { "EXT_meshopt_compression": {} } });
    });
    assert!(error.contains("buffer view 0 is compressed by `EXT_meshopt_compression`"), "{error}");
    let error = changed(set("/textures/0", json!({ "extensions": { "KHR_texture_basisu": { "source": 0 } } })));
    assert!(error.contains("texture 0 has an image by `KHR_texture_basisu` alone"), "{error}");
    for (bytes, words) in [
        (&b"\xabKTX 20\xbb\r\n"[..], "image 0 is KTX2, which is not read; save"),
        (b"RIFF", "is WebP"),
        (b"", "neither PNG"),
    ] {
        let uri = format!("data:;base64,{}", base64(bytes));
        let error = changed(|json| json["images"][0] = json!({ "uri": uri }));
        assert!(error.contains(words), "{error}");
    }
    let error = changed(set("/images/0", json!({})));
    assert!(error.contains("image 0 has neither `uri` nor `bufferView`"), "{error}");
}

#[test]
fn numbers_that_are_none_are_refused_where_they_are_points() {
    let with = |x: f32| {
        let mut fixture = Fixture::triangle(json!({}));
        fixture.bytes[12..16].copy_from_slice(&x.to_le_bytes());
        fixture.fault()
    };
    assert!(with(f32::NAN).contains("a.glb:1: accessor 0 has [NaN, 0, 0] as its element 1, a vertex; give finite"));
    assert!(with(f32::INFINITY).contains("as its element 1, a vertex"));
    assert!(with(1e20).contains("at most 1e15 in magnitude"));
    // Elsewhere they are counted.
    let mut fixture = Fixture::made_of(json!({}));
    let offset = fixture.json["bufferViews"][1]["byteOffset"].as_u64().unwrap() as usize;
    fixture.bytes[offset..offset + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let normals = fixture.floats("VEC3", &[f32::NAN; 9]);
    fixture.attribute("NORMAL", normals);
    assert!(tells(&fixture.translated(), NoteKind::Approximated, "1 texture coordinates that are no numbers"));
}

#[test]
fn indices_count_vertices() {
    let with = |indices: &[u8]| {
        let mut fixture = Fixture::triangle(json!({ "indices": 1 }));
        fixture.accessor(5121, "SCALAR", indices.len(), indices);
        fixture
    };
    let error = with(&[0, 1, 3]).fault();
    assert!(error.contains("accessor 1 has the index 3 at 2, of 3 vertices; count vertices from 0"), "{error}");
    assert!(with(&[0, 1, 255]).fault().contains("which would begin another strip"));
    // What is left of the last triangle is no triangle; what has no area is not there.
    with(&[0, 1, 2, 0]).translated();
    for nothing in [&[0, 1][..], &[], &[0, 0, 1]] {
        assert!(with(nothing).fault().contains("a.glb:1: the scene has no triangles"));
    }
    // One that is large and is named over and over.
    let mut fixture = Fixture::triangle(json!({}));
    fixture.json["accessors"][0]["extras"] = json!("x".repeat(10_000_000));
    fixture.json["meshes"][0]["primitives"] = json!(vec![json!({ "attributes": { "POSITION": 0 } }); 500]);
    assert!(fixture.fault().contains("accessor 0 is one read too many: 4294967296 bytes"));
    // Zeros without bytes, more than can be.
    let mut fixture = Fixture::triangle(json!({ "indices": 1 }));
    fixture.push("accessors", json!({ "componentType": 5125, "type": "SCALAR", "count": 4_000_000_000u64 }));
    let error = fixture.fault();
    assert!(error.contains("has 1333333333 triangles, with which there are more than 67108864 in all"), "{error}");
    let mut fixture = Fixture::triangle(json!({}));
    fixture.json["accessors"][0] = json!({ "componentType": 5126, "type": "VEC3", "count": 4_000_000_000u64 });
    assert!(fixture.fault().contains("more than 67108864 in all"));
}

#[test]
fn deep_and_cyclic_nodes() {
    let mut fixture = Fixture::triangle(json!({}));
    let mut nodes: Vec<Value> = (1..300_000).map(|child| json!({ "children": [child] })).collect();
    nodes.push(json!({ "mesh": 0, "translation": [1, 0, 0] }));
    fixture.json["nodes"] = json!(nodes);
    fixture.json["scenes"] = json!([{ "nodes": [0] }]);
    fixture.translated();
    nodes.truncate(1000);
    nodes.push(json!({ "children": [500] }));
    fixture.json["nodes"] = json!(nodes);
    assert!(fixture.fault().contains("node 500 stands in two places, or below itself"));
    // A circle that hangs from nothing is nowhere.
    fixture.json["nodes"] = json!([{ "children": [1] }, { "children": [0] }]);
    fixture.json.as_object_mut().unwrap().remove("scenes");
    fixture.json.as_object_mut().unwrap().remove("scene");
    assert!(fixture.fault().contains("the scene has no triangles"));
}

#[test]
fn text_that_is_no_json_is_placed() {
    let fault = |bytes: &[u8]| open(&folder(&[("a.gltf", bytes)]), "a.gltf").map(|t| t.text).unwrap_err();
    for (text, words) in [
        (&b""[..], "a.gltf:1: the JSON is not glTF 2.0: EOF while parsing a value (column 0); mend it there"),
        (b"{\n \"asset\": }", "a.gltf:2: the JSON is not glTF 2.0: expected value (column 11)"),
        (b"{}", "a.gltf:1: the JSON is not glTF 2.0: missing field `asset`"),
        (b"[]", "a.gltf:1: the JSON is not glTF 2.0: "),
        (b"{ \"asset\": { \"version\": \"2.0\" }, \"asset\": 1 }", "duplicate field `asset`"),
        (b"{\n\n\"\xff\"}", "a.gltf:3: the text is not UTF-8; save the file as UTF-8"),
        (b"{ \"asset\": { \"version\": \"2.0\" } }", "a.gltf:1: the scene has no triangles; give one with meshes"),
    ] {
        let error = fault(text);
        assert!(error.starts_with(words) || error.contains(words), "{error}");
    }
    let deep = [b"{ \"asset\": { \"version\": \"2.0\" }, \"extras\": ".to_vec(), vec![b'['; 1_000_000]].concat();
    assert!(fault(&deep).contains("EOF while parsing"));
    let lines = b"{ \"asset\": { \"version\": \"2.0\" }, \"nodes\": [\n{},\n{\n\"mesh\": []}\n] }";
    let error = fault(lines);
    assert!(error.starts_with("a.gltf:4: node 1 cannot be read: invalid type: sequence, expected usize"), "{error}");
}

#[test]
fn chunks_that_end_early_are_told() {
    let whole = Fixture::triangle(json!({})).glb();
    let fault = |bytes: &[u8]| open(&folder(&[("a.glb", bytes)]), "a.glb").map(|t| t.text).unwrap_err();
    for end in 4..whole.len() {
        let error = fault(&whole[..end]);
        assert!(error.starts_with("a.glb:1: the file "), "{end}: {error}");
    }
    let with = |at: usize, word: u32| {
        let mut bytes = whole.clone();
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        fault(&bytes)
    };
    assert!(with(4, 1).contains("this is glTF 1; save it as glTF 2.0"));
    assert!(with(8, u32::MAX).contains("where its header says 4294967295"));
    assert!(with(8, 12).contains("the file has no chunk of JSON"));
    assert!(with(12, u32::MAX).contains("the chunk at byte 12 has 4294967295 bytes, and the file"));
    assert!(with(16, 7).contains("the file has no chunk of JSON"));
}

#[test]
fn a_name_does_not_leave_its_line() {
    let mut fixture = Fixture::made_of(json!({ "name": "a\nb\u{1b}[31m", "alphaMode": "X\ny" }));
    let error = fixture.fault();
    assert!(error.contains("material 0 (`a\\nb\\u{1b}[31m`) has the `alphaMode` `X\\ny`"), "{error}");
    fixture.json["materials"][0]["alphaMode"] = json!("OPAQUE");
    fixture.translated();
    fixture.json["materials"][0]["name"] = json!("x".repeat(1_000_000));
    let translation = fixture.translated();
    assert!(translation.notes.iter().all(|note| note.text.len() < 200));
}

fn rich() -> Fixture {
    let mut fixture = Fixture::made_of(json!({
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform": { "rotation": 1, "scale": [2, 2] } } } },
        "alphaMode": "MASK", "emissiveFactor": [1, 1, 1],
        "extensions": { "KHR_materials_transmission": { "transmissionFactor": 0.5 }, "KHR_materials_volume": { "thicknessFactor": 1 } },
    }));
    fixture.texture(&[[1.0, 0.5, 0.5, 0.7], [0.0, 0.0, 1.0, 0.0]]);
    let colours = fixture.floats("VEC4", &[0.5; 12]);
    fixture.attribute("COLOR_0", colours);
    let indices = fixture.accessor(5121, "SCALAR", 3, &[0, 1, 2]);
    fixture.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    fixture.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 1, "aspectRatio": 2 } }]);
    fixture.root(json!({ "camera": 0, "children": [] }));
    fixture.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "spot", "spot": {} }] } });
    fixture.root(json!({ "extensions": { "KHR_lights_punctual": { "light": 0 } }, "scale": [2, 1, 1] }));
    fixture
}

/// A file of these bytes is read, or refused with its place.
fn survives(bytes: &[u8]) {
    let folder = folder(&[("a.glb", bytes)]);
    let placed = |error: String| assert!(error.starts_with("a.glb:"), "{error}");
    match open(&folder, "a.glb") {
        Err(error) => placed(error),
        Ok(translation) => {
            // What is wrong with a text is told of the file as well.
            let size = Some((16, 16));
            let built = translation.read("a", folder.path(), size).and_then(|builder| builder.build(Skip::Unneeded));
            if let Err(error) = built {
                _ = error.to_string();
            }
        }
    }
}

#[test]
fn the_whole_of_it_is_read() {
    rich().translated();
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn bytes_that_are_changed_do_no_harm(changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut bytes = rich().glb();
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        survives(&bytes);
    }

    #[test]
    fn digits_that_are_changed_do_no_harm(changes in proptest::collection::vec((any::<prop::sample::Index>(), 0..10u8), 1..4)) {
        let mut bytes = rich().glb();
        let digits: Vec<usize> = (20..bytes.len()).filter(|&i| bytes[i].is_ascii_digit()).collect();
        for (at, digit) in changes {
            let at = digits[at.index(digits.len())];
            bytes[at] = b'0' + digit;
        }
        survives(&bytes);
    }

    #[test]
    fn parts_that_are_cut_out_do_no_harm(from in any::<prop::sample::Index>(), length in 1..40usize) {
        let bytes = rich().glb();
        let from = from.index(bytes.len());
        let end = (from + length).min(bytes.len());
        survives(&[&bytes[..from], &bytes[end..]].concat());
    }
}

#[test]
fn names_that_are_not_known_are_told_with_their_line() {
    let text = json!({
        "asset": { "version": "2.0", "extras": { "any": { "thing": 1 } } },
        "extensionsUsed": ["KHR_materials_clearcoat", "MY_own"],
        "materials": [{
            "pbrMetallicRoughness": { "baseColorFactr": [1, 0, 0, 1] },
            "baseColorFactor": [1, 0, 0, 1],
            "extensions": { "KHR_materials_clearcoat": { "clearCoatFactor": 1.0 }, "MY_own": { "zzz": 1 } },
        }],
        "animations": [{ "samplers": [{ "input": 0 }] }],
        "node\n": [],
    });
    // One line for each key.
    let text = serde_json::to_string_pretty(&text).unwrap();
    let line =
        |key: &str| text.lines().position(|line| line.trim_start().starts_with(&format!("\"{key}\""))).unwrap() + 1;
    let document = Document::read(Path::new("a.gltf"), &text).unwrap();
    let mut found: Vec<_> = document.unknown().map(|(place, unknown)| (place.line, unknown.key.to_string())).collect();
    found.sort();
    let mut expected =
        ["baseColorFactr", "baseColorFactor", "clearCoatFactor"].map(|key| (line(key), key.to_string())).to_vec();
    // What is written with escapes is told of the file.
    expected.push((1, "node\n".to_string()));
    expected.sort();
    assert_eq!(found, expected);

    let mut fixture = Fixture::made_of(json!({ "pbrMetallicRoughness": { "baseColorFactr": [1, 0, 0, 1] } }));
    fixture.json["nodes"][0]["scal"] = json!([1, 1, 1]);
    let notes = fixture.translated().notes;
    let told: Vec<String> =
        notes.iter().map(|note| note.to_string()).filter(|note| note.contains("not known")).collect();
    let expected = [
        "a.glb:1: approximated: `baseColorFactr` of `pbrMetallicRoughness` is not known, and is left out: did you mean `baseColorFactor`?",
        "a.glb:1: approximated: `scal` of `nodes` is not known, and is left out: did you mean `scale`?",
    ];
    assert_eq!(told.len(), 2, "{told:?}");
    expected.iter().for_each(|text| assert!(told.iter().any(|told| told.ends_with(text)), "{told:?}"));
}
