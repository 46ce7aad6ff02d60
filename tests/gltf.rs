//! A scene that is written as glTF shows what it showed.
//!
//! False-alarm rate: 0.1 % for the test.

use crate::support::{Budget, Family, builtin, measure, plain};
use scenes::{LoadOptions, Scene, load};
use serde_json::{Value, json};
use std::path::Path;

const SIZE: u32 = 12;

/// The Cornell box as glTF, made of its scene file: a node, a mesh and a material for each of its shapes.
fn cornell_box(folder: &Path) -> Scene {
    let file: toml::Table = include_str!("../scenes/library/cornell_box.toml").parse().unwrap();
    let (mut bytes, mut views, mut accessors) = (Vec::<u8>::new(), Vec::new(), Vec::new());
    let (mut materials, mut meshes, mut nodes) = (Vec::new(), Vec::new(), Vec::new());
    for shape in file["shapes"].as_array().unwrap() {
        let corners: Vec<f32> = triangles(shape).into_iter().flatten().map(|x| x as f32).collect();
        views.push(json!({ "buffer": 0, "byteOffset": bytes.len(), "byteLength": 4 * corners.len() }));
        bytes.extend(corners.iter().flat_map(|x| x.to_le_bytes()));
        let (view, count) = (accessors.len(), corners.len() / 3);
        accessors.push(json!({ "bufferView": view, "componentType": 5126, "type": "VEC3", "count": count }));
        materials.push(material(&file, shape));
        let primitive = json!({ "attributes": { "POSITION": view }, "material": view });
        meshes.push(json!({ "primitives": [primitive] }));
        nodes.push(json!({ "mesh": view }));
    }
    let camera = &file["camera"];
    let lens = json!({ "yfov": camera["fov"].as_float().unwrap().to_radians(), "znear": 0.1 });
    // Half a turn about y: it looks along +z.
    nodes.push(json!({ "camera": 0, "rotation": [0, 1, 0, 0], "translation": vector(&camera["position"]) }));
    let scene = json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": (0..nodes.len()).collect::<Vec<_>>() }],
        "nodes": nodes, "meshes": meshes, "materials": materials,
        "cameras": [{ "type": "perspective", "perspective": lens }],
        "accessors": accessors, "bufferViews": views,
        "buffers": [{ "uri": "box.bin", "byteLength": bytes.len() }],
    });
    std::fs::write(folder.join("box.bin"), bytes).unwrap();
    let path = folder.join("box.gltf");
    std::fs::write(&path, scene.to_string()).unwrap();
    let options = LoadOptions { size: Some((SIZE, SIZE)), ..LoadOptions::default() };
    load(path.to_str().unwrap(), &options).unwrap()
}

/// A matte material: a dielectric that reflects nothing at its surface.
fn material(file: &toml::Table, shape: &toml::Value) -> Value {
    let albedo = &file["materials"][shape["material"].as_str().unwrap()]["albedo"];
    let [r, g, b] = albedo.as_float().map_or_else(|| vector(albedo).try_into().unwrap(), |grey| [grey; 3]);
    let mut material = json!({
        "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1], "metallicFactor": 0 },
        "extensions": { "KHR_materials_specular": { "specularFactor": 0 } },
    });
    if let Some(emission) = shape.get("emission") {
        let radiance = vector(emission);
        let strength = radiance.iter().copied().fold(0.0, f64::max);
        material["emissiveFactor"] = json!(radiance.iter().map(|channel| channel / strength).collect::<Vec<_>>());
        material["extensions"]["KHR_materials_emissive_strength"] = json!({ "emissiveStrength": strength });
    }
    material
}

/// The corners of a shape's triangles.
fn triangles(shape: &toml::Value) -> Vec<[f64; 3]> {
    let faces: Vec<Vec<[f64; 3]>> = match shape["type"].as_str().unwrap() {
        "quad" => {
            let [o, u, v] = ["origin", "edge_u", "edge_v"].map(|key| vector(&shape[key]));
            let corner = |s: f64, t: f64| std::array::from_fn(|i| o[i] + s * u[i] + t * v[i]);
            vec![vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)]]
        }
        _ => {
            let vertices: Vec<[f64; 3]> =
                shape["vertices"].as_array().unwrap().iter().map(|v| vector(v).try_into().unwrap()).collect();
            let corner = |index: &toml::Value| vertices[index.as_integer().unwrap() as usize];
            let faces = shape["faces"].as_array().unwrap();
            faces.iter().map(|face| face.as_array().unwrap().iter().map(corner).collect()).collect()
        }
    };
    faces.iter().flat_map(|f| [f[0], f[1], f[2], f[0], f[2], f[3]]).collect()
}

fn vector(value: &toml::Value) -> Vec<f64> {
    let number = |x: &toml::Value| x.as_float().or(x.as_integer().map(|x| x as f64)).unwrap();
    value.as_array().unwrap().iter().map(number).collect()
}

#[test]
fn the_cornell_box_is_the_same_as_gltf() {
    let mut family = Family::new("gltf");
    let folder = tempfile::tempdir().unwrap();
    let (own, foreign) = (builtin("cornell_box", SIZE), cornell_box(folder.path()));
    let budget = Budget::samples(64).up_to(4);
    for integrator in ["path", "bdpt"] {
        let method = plain(integrator);
        let a = measure(&own, method.as_ref(), &format!("own {integrator}"), budget);
        let b = measure(&foreign, method.as_ref(), &format!("gltf {integrator}"), budget);
        for layer in method.orders(4) {
            let label = format!("{integrator} order {layer}");
            family.layer(&label, layer, 4, &a, &b);
        }
    }
    family.finish(0.8);
}
