//! Every construct: what it becomes, and that scene files may say so.

mod geometry;
mod hostile;
mod materials;
mod observers;

use std::path::Path;

use serde_json::{Value, json};
use tempfile::TempDir;

use super::translate;
use crate::builder::MeshData;
use crate::import::ply;
use crate::import::translation::{NoteKind, Translation};
use crate::needs::Skip;
use crate::texture::Image;

/// A file in the making, with one buffer.
#[derive(Clone)]
struct Fixture {
    json: Value,
    bytes: Vec<u8>,
}

impl Fixture {
    /// Nothing but an empty scene.
    fn empty() -> Self {
        let json = json!({
            "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [] }],
            "nodes": [], "meshes": [], "accessors": [], "bufferViews": [], "buffers": [{ "byteLength": 0 }],
        });
        Self { json, bytes: Vec::new() }
    }

    /// A triangle of corners (0, 0, 0), (1, 0, 0), (0, 1, 0) with more said of its primitive.
    fn triangle(more: Value) -> Self {
        let mut fixture = Self::empty();
        fixture.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        let mut primitive = json!({ "attributes": { "POSITION": 0 } });
        merge(&mut primitive, more);
        fixture.place(primitive);
        fixture
    }

    /// The triangle with a material and texture coordinates in two sets.
    fn made_of(material: Value) -> Self {
        let mut fixture = Self::triangle(json!({ "material": 0 }));
        let uvs = fixture.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 0.25]);
        let others = fixture.floats("VEC2", &[0.5, 0.5, 0.75, 0.5, 0.5, 0.75]);
        fixture.json["materials"] = json!([material]);
        fixture.attribute("TEXCOORD_0", uvs);
        fixture.attribute("TEXCOORD_1", others);
        fixture
    }

    fn attribute(&mut self, name: &str, accessor: usize) {
        self.json["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
    }

    fn push(&mut self, list: &str, item: Value) -> usize {
        let list = self.json.as_object_mut().unwrap().entry(list).or_insert(json!([])).as_array_mut().unwrap();
        list.push(item);
        list.len() - 1
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        while !self.bytes.len().is_multiple_of(4) {
            self.bytes.push(0);
        }
        let view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        self.bytes.extend(bytes);
        self.json["buffers"][0]["byteLength"] = json!(self.bytes.len());
        self.push("bufferViews", view)
    }

    fn accessor(&mut self, component: u32, shape: &str, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        self.push("accessors", json!({ "bufferView": view, "componentType": component, "type": shape, "count": count }))
    }

    fn floats(&mut self, shape: &str, numbers: &[f32]) -> usize {
        let components = match shape {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(5126, shape, numbers.len() / components, &bytes)
    }

    /// Adds a mesh of one primitive, where a node of the scene has it.
    fn place(&mut self, primitive: Value) -> usize {
        let mesh = self.push("meshes", json!({ "primitives": [primitive] }));
        self.root(json!({ "mesh": mesh }))
    }

    /// Adds a node to the scene.
    fn root(&mut self, node: Value) -> usize {
        let node = self.push("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(node));
        node
    }

    /// Adds a texture of an image in the buffer.
    fn texture(&mut self, texels: &[[f32; 4]]) -> usize {
        let image = Image::from_linear(texels.len() as u32, 1, texels.to_vec()).unwrap();
        let view = self.view(&image.repainted(|texel| texel));
        let image = self.push("images", json!({ "bufferView": view, "mimeType": "image/png" }));
        self.push("textures", json!({ "source": image }))
    }

    fn glb(&self) -> Vec<u8> {
        glb(&[(0x4E4F_534A, self.json.to_string().as_bytes()), (0x004E_4942, &self.bytes)])
    }

    fn open(&self) -> Result<Translation, String> {
        open(&folder(&[("a.glb", &self.glb())]), "a.glb")
    }

    /// Its translation, which can be read and built.
    fn translated(&self) -> Translation {
        let translation = self.open().unwrap_or_else(|error| panic!("{error}\n{}", self.json));
        let build = || translation.read("a", Path::new("."), None)?.build(Skip::Unneeded);
        build().unwrap_or_else(|error| panic!("{error}\n{}", translation.text));
        translation
    }

    fn fault(&self) -> String {
        self.open().map(|translation| translation.text).expect_err(&self.json.to_string())
    }
}

fn merge(into: &mut Value, more: Value) {
    match more {
        Value::Object(more) => more.into_iter().for_each(|(key, value)| merge(&mut into[key], value)),
        value => *into = value,
    }
}

fn glb(chunks: &[(u32, &[u8])]) -> Vec<u8> {
    let mut body = Vec::new();
    for (kind, bytes) in chunks {
        let padded = bytes.len().next_multiple_of(4);
        body.extend((padded as u32).to_le_bytes());
        body.extend(kind.to_le_bytes());
        body.extend(*bytes);
        body.resize(body.len() + padded - bytes.len(), if *kind == 0x4E4F_534A { b' ' } else { 0 });
    }
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend((body.len() as u32 + 12).to_le_bytes());
    file.extend(body);
    file
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let three = |chunk: &[u8]| {
        let bits = chunk.iter().fold(0u32, |bits, &byte| bits << 8 | u32::from(byte)) << (8 * (3 - chunk.len()));
        let digit =
            |i: usize| if i <= chunk.len() { DIGITS[(bits >> (18 - 6 * i)) as usize & 63] as char } else { '=' };
        [0, 1, 2, 3].map(digit).into_iter().collect::<String>()
    };
    bytes.chunks(3).map(three).collect()
}

fn folder(files: &[(&str, &[u8])]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
    folder
}

fn open(folder: &TempDir, name: &str) -> Result<Translation, String> {
    let here = format!("{}/", folder.path().display());
    translate(&folder.path().join(name), folder.path(), "a").map_err(|error| error.to_string().replace(&here, ""))
}

fn notes(translation: &Translation, kind: NoteKind) -> Vec<String> {
    translation.notes.iter().filter(|note| note.kind == kind).map(|note| note.text.clone()).collect()
}

fn tells(translation: &Translation, kind: NoteKind, words: &str) -> bool {
    notes(translation, kind).iter().any(|note| note.contains(words))
}

fn table(translation: &Translation) -> toml::Table {
    translation.text.parse().unwrap_or_else(|error| panic!("{error}\n{}", translation.text))
}

fn vector(value: &toml::Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_float().unwrap()).collect()
}

/// The mesh of a shape, as it is read.
fn mesh(translation: &Translation, shape: usize) -> MeshData {
    let table = table(translation);
    let file = table["shapes"][shape]["file"].as_str().unwrap();
    let attached = translation.attachments.iter().find(|attachment| attachment.name == file).unwrap();
    ply::read(&attached.bytes).unwrap().mesh
}

#[test]
fn buffers_lie_in_the_file_beside_it_or_in_its_text() {
    let fixture = Fixture::triangle(json!({}));
    let own = fixture.translated();
    let with = |uri: &str| {
        let mut fixture = fixture.clone();
        fixture.json["buffers"][0]["uri"] = json!(uri);
        serde_json::to_vec_pretty(&fixture.json).unwrap()
    };
    let data = with(&format!("data:application/octet-stream;base64,{}", base64(&fixture.bytes)));
    let files =
        [("data.gltf", data.as_slice()), ("beside.gltf", &with("parts/a%20b.bin")), ("parts/a b.bin", &fixture.bytes)];
    let folder = folder(&files);
    for name in ["data.gltf", "beside.gltf"] {
        let translation = open(&folder, name).unwrap();
        assert_eq!(translation.attachments, own.attachments, "{name}");
    }
    let mark = [b"\xef\xbb\xbf", data.as_slice()].concat();
    std::fs::write(folder.path().join("marked.gltf"), mark).unwrap();
    assert_eq!(open(&folder, "marked.gltf").unwrap().attachments, own.attachments);
}

#[test]
fn images_beside_the_file_keep_their_names() {
    let mut fixture = Fixture::made_of(json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }));
    fixture.texture(&[[1.0, 0.0, 0.0, 1.0]]);
    let image = Image::from_linear(1, 1, vec![[0.0, 1.0, 0.0, 1.0]]).unwrap().repainted(|texel| texel);
    fixture.json["images"] = json!([{ "uri": "tex/a%20b.png" }]);
    let folder = folder(&[("a.glb", &fixture.glb()), ("tex/a b.png", &image)]);
    let translation = open(&folder, "a.glb").unwrap();
    assert_eq!(table(&translation)["materials"]["material_0"]["base_color"]["image"].as_str(), Some("tex/a b.png"));
    assert_eq!(translation.attachments.len(), 1);
    translation.read("a", folder.path(), None).unwrap().build(Skip::Unneeded).unwrap();
    fixture.json["images"] = json!([{ "uri": format!("data:image/png;base64,{}", base64(&image)) }]);
    let translation = fixture.translated();
    let name = table(&translation)["materials"]["material_0"]["base_color"]["image"].as_str().unwrap().to_string();
    assert_eq!(name, "a_image001.png");
    assert_eq!(translation.attachments.iter().find(|attachment| attachment.name == name).unwrap().bytes, image);
}

/// Whatever the nodes below say; what is hidden still carries the camera.
#[test]
fn hidden_nodes_are_left_out_with_all_below() {
    let mut fixture = Fixture::triangle(json!({}));
    fixture.json["extensionsRequired"] = json!(["KHR_node_visibility"]);
    fixture.json["extensionsUsed"] = json!(["KHR_node_visibility", "KHR_lights_punctual"]);
    fixture.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point" }] } });
    fixture.json["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.1 } }]);
    let visibility = |visible: bool| json!({ "KHR_node_visibility": { "visible": visible } });
    let first = fixture.json["nodes"].as_array().unwrap().len();
    fixture.root(json!({ "mesh": 0, "children": [first + 1, first + 2, first + 3], "extensions": visibility(false) }));
    fixture.push("nodes", json!({ "mesh": 0, "extensions": visibility(true) }));
    fixture.push("nodes", json!({ "extensions": { "KHR_lights_punctual": { "light": 0 } } }));
    fixture.push("nodes", json!({ "camera": 0 }));
    fixture.root(json!({ "mesh": 0, "translation": [3, 0, 0], "extensions": { "KHR_node_visibility": {} } }));
    let translation = fixture.translated();
    let written = table(&translation);
    // The triangle's own node, and the one that says nothing.
    assert_eq!(written["shapes"].as_array().unwrap().len(), 2, "{written}");
    // Of emitters there is only the environment that is added; the camera is the file's.
    assert_eq!(written["emitters"].as_array().unwrap().len(), 1);
    assert!(!tells(&translation, NoteKind::Added, "no camera"));
    assert!(tells(&translation, NoteKind::Mapped, "what `KHR_node_visibility` hides is left out"));
    assert!(!tells(&translation, NoteKind::Ignored, "KHR_node_visibility"));
    for node in fixture.json["nodes"].as_array_mut().unwrap() {
        node["extensions"] = visibility(false);
    }
    assert!(fixture.fault().contains("the scene has no triangles"));
}

#[test]
fn notes_name_their_objects_and_lines() {
    let mut fixture = Fixture::made_of(json!({ "name": "skin", "occlusionTexture": { "index": 0 } }));
    fixture.json["animations"] = json!([{}]);
    fixture.json["extensionsUsed"] = json!(["VENDOR_magic"]);
    fixture.push("scenes", json!({ "nodes": [] }));
    let text = serde_json::to_string_pretty(&fixture.json).unwrap();
    let folder = folder(&[
        ("a.gltf", text.replace("\"byteLength\": 84", "\"byteLength\": 84, \"uri\": \"a.bin\"").as_bytes()),
        ("a.bin", &fixture.bytes),
    ]);
    let translation = open(&folder, "a.gltf").unwrap();
    let line = 1 + text[..text.find("\"skin\"").unwrap()].matches('\n').count();
    let note = translation.notes.iter().find(|note| note.text.contains("occlusionTexture")).unwrap();
    assert!(note.place.line.abs_diff(line) <= 1, "{note}");
    for (kind, words) in [
        (NoteKind::Ignored, "animations"),
        (NoteKind::Ignored, "`VENDOR_magic`"),
        (NoteKind::Ignored, "other scenes"),
        (NoteKind::Added, "no camera"),
        (NoteKind::Added, "nothing in the file emits"),
    ] {
        assert!(tells(&translation, kind, words), "{words}: {:?}", translation.notes);
    }
    assert!(tells(&translation, NoteKind::Mapped, "material 0 (`skin`) becomes `principled`"));
    assert!(tells(&translation, NoteKind::Mapped, "mesh 0, primitive 0 becomes a `mesh`"));
}
