//! Numbers, triangles, nodes.

use super::*;
use glam::{DVec3, Vec3};

fn bytes<const N: usize, T: Copy>(numbers: &[T], bytes: fn(T) -> [u8; N]) -> Vec<u8> {
    numbers.iter().flat_map(|&x| bytes(x)).collect()
}

#[test]
fn strips_and_fans_are_triangles_that_keep_their_front() {
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.0, 2.0]];
    for (mode, expected) in
        [(4, vec![[0, 1, 2]]), (5, vec![[0, 1, 2], [1, 3, 2], [2, 3, 4]]), (6, vec![[1, 2, 0], [2, 3, 0], [3, 4, 0]])]
    {
        let mut fixture = Fixture::empty();
        let numbers: Vec<f32> = corners.iter().flat_map(|[x, y]| [*x, *y, 0.0]).collect();
        fixture.floats("VEC3", &numbers);
        fixture.place(json!({ "attributes": { "POSITION": 0 }, "mode": mode }));
        let mesh = mesh(&fixture.translated(), 0);
        let points = |t: &[u32; 3]| t.map(|i| mesh.positions[i as usize]);
        let found: Vec<[DVec3; 3]> = mesh.triangles.iter().map(points).collect();
        let point = |i: usize| DVec3::new(corners[i][0].into(), corners[i][1].into(), 0.0);
        let expected: Vec<[DVec3; 3]> = expected.into_iter().map(|t: [usize; 3]| t.map(point)).collect();
        assert_eq!(found, expected, "mode {mode}");
    }
    for mode in 0..4 {
        let mut fixture = Fixture::triangle(json!({}));
        fixture.place(json!({ "attributes": { "POSITION": 0 }, "mode": mode }));
        let translation = fixture.translated();
        assert_eq!(table(&translation)["shapes"].as_array().unwrap().len(), 1);
        assert!(tells(&translation, NoteKind::Ignored, "points and lines"));
    }
}

#[test]
fn every_kind_of_number_is_read() {
    let positions = [0, 0, 0, 1, 0, 0, 0, 1, 0];
    let with = |component: u32, normalized: bool, bytes: &[u8], stride: usize| {
        let mut fixture = Fixture::triangle(json!({ "attributes": { "POSITION": 1 } }));
        let accessor = fixture.accessor(component, "VEC3", 3, bytes);
        fixture.json["accessors"][accessor]["normalized"] = json!(normalized);
        if stride > 0 {
            let view = fixture.json["accessors"][accessor]["bufferView"].as_u64().unwrap() as usize;
            fixture.json["bufferViews"][view]["byteStride"] = json!(stride);
        }
        mesh(&fixture.translated(), 0).positions[1].x
    };
    let padded: Vec<u8> = positions.chunks(3).flat_map(|p| [p[0] as u8, p[1] as u8, p[2] as u8, 9]).collect();
    assert_eq!(with(5121, false, &padded, 4), 1.0);
    assert_eq!(with(5120, true, &padded.iter().map(|&b| b.wrapping_mul(127)).collect::<Vec<u8>>(), 4), 1.0);
    assert_eq!(with(5120, true, &padded.iter().map(|&b| b.wrapping_mul(128)).collect::<Vec<u8>>(), 4), -1.0);
    assert_eq!(with(5123, true, &bytes(&positions.map(|x: i32| x as u16 * 13107), u16::to_le_bytes), 0) as f32, 0.2);
    assert_eq!(with(5122, false, &bytes(&positions.map(|x| x as i16 * -7), i16::to_le_bytes), 0), -7.0);
    assert_eq!(with(5126, false, &bytes(&positions.map(|x| x as f32 * 2.5), f32::to_le_bytes), 0), 2.5);
    assert_eq!(with(5125, false, &bytes(&positions.map(|x| x as u32 * 70_000), u32::to_le_bytes), 0), 70_000.0);
}

#[test]
fn indices_are_of_every_size_and_share_vertices() {
    for component in [5121, 5123, 5125] {
        let mut fixture = Fixture::empty();
        fixture.floats("VEC3", &[9.0, 9.0, 9.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
        let list = [1u32, 2, 3, 1, 3, 4, 2, 2, 3];
        let bytes = match component {
            5121 => bytes(&list, |i| [i as u8]),
            5123 => bytes(&list, |i| (i as u16).to_le_bytes()),
            _ => bytes(&list, u32::to_le_bytes),
        };
        let indices = fixture.accessor(component, "SCALAR", 9, &bytes);
        fixture.place(json!({ "attributes": { "POSITION": 0 }, "indices": indices }));
        let mesh = mesh(&fixture.translated(), 0);
        // The vertex that no face uses is not written, nor the face without area.
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.positions[3], DVec3::Y);
    }
}

#[test]
fn attributes_may_lie_between_one_another() {
    let mut fixture = Fixture::empty();
    let corner = |x: f32, y: f32, u: f32, v: f32| [x, y, 0.0, 0.0, 0.0, 1.0, u, v];
    let rows = [corner(0.0, 0.0, 0.0, 0.0), corner(1.0, 0.0, 1.0, 0.0), corner(0.0, 1.0, 0.0, 1.0)].concat();
    let view = fixture.view(&bytes(&rows, f32::to_le_bytes));
    fixture.json["bufferViews"][view]["byteStride"] = json!(32);
    for (offset, shape) in [(0, "VEC3"), (12, "VEC3"), (24, "VEC2")] {
        let accessor =
            json!({ "bufferView": view, "byteOffset": offset, "componentType": 5126, "type": shape, "count": 3 });
        fixture.push("accessors", accessor);
    }
    fixture.place(json!({ "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 } }));
    let mesh = mesh(&fixture.translated(), 0);
    assert_eq!(mesh.positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
    // v grows upwards.
    assert_eq!(mesh.uvs.iter().map(|uv| uv.to_array()).collect::<Vec<_>>(), [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0]]);
}

#[test]
fn sparse_numbers_stand_in_the_place_of_others() {
    let mut fixture = Fixture::triangle(json!({}));
    let indices = fixture.view(&bytes(&[1u16, 2], u16::to_le_bytes));
    let values = fixture.view(&bytes(&[5.0f32, 0.0, 0.0, 0.0, 7.0, 0.0], f32::to_le_bytes));
    fixture.json["accessors"][0]["sparse"] = json!({
        "count": 2, "indices": { "bufferView": indices, "componentType": 5123 }, "values": { "bufferView": values },
    });
    let moved = [DVec3::ZERO, DVec3::X * 5.0, DVec3::Y * 7.0];
    assert_eq!(mesh(&fixture.translated(), 0).positions, moved);
    // Without a view all else is 0.
    fixture.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert_eq!(mesh(&fixture.translated(), 0).positions, moved);
}

#[test]
fn nodes_stand_in_the_frames_of_those_above() {
    let mut fixture = Fixture::triangle(json!({}));
    let half = std::f64::consts::FRAC_1_SQRT_2;
    // Scaled by 2, turned by 90° about z, moved; within a frame that is moved by a matrix, column by column.
    let matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 10, 20, 30, 1];
    fixture.json["nodes"] = json!([
        { "mesh": 0, "scale": [2, 2, 2], "rotation": [0, 0, half, half], "translation": [1, 2, 3] },
        { "children": [0], "matrix": matrix },
        { "mesh": 0 },
    ]);
    fixture.json["scenes"][0]["nodes"] = json!([1]);
    let translation = fixture.translated();
    let shapes = table(&translation)["shapes"].as_array().unwrap().clone();
    assert_eq!(shapes.len(), 1, "a node of no scene is not there");
    let matrix = vector(&shapes[0]["transform"][0]["matrix"]);
    let expected = [0.0, -2.0, 0.0, 11.0, 2.0, 0.0, 0.0, 22.0, 0.0, 0.0, 2.0, 33.0];
    assert!(matrix.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{matrix:?}");
    // Without a scene all are there; a mesh is written once.
    fixture.json.as_object_mut().unwrap().remove("scenes");
    fixture.json.as_object_mut().unwrap().remove("scene");
    let translation = fixture.translated();
    let table = table(&translation);
    let shapes = table["shapes"].as_array().unwrap();
    assert_eq!(translation.attachments.len(), 1);
    assert_eq!(table["groups"][0]["shapes"].as_array().unwrap().len(), 1);
    let kinds: Vec<_> = shapes.iter().map(|shape| (shape["type"].as_str(), shape["group"].as_str())).collect();
    assert_eq!(kinds, [(Some("instance"), Some("mesh_0")); 2]);
    assert!(shapes[0].get("transform").is_some() != shapes[1].get("transform").is_some());
}

#[test]
fn a_mirrored_mesh_keeps_its_front() {
    let mut fixture = Fixture::triangle(json!({ "material": 0 }));
    fixture.json["materials"] = json!([{ "emissiveFactor": [1, 1, 1] }]);
    for (scale, front) in [([1.0, 1.0, 1.0], 1.0), ([1.0, 1.0, -1.0], -1.0), ([-1.0, 1.0, 1.0], 1.0)] {
        fixture.json["nodes"][0]["scale"] = json!(scale);
        let translation = fixture.translated();
        let scene = translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
        let origin = Vec3::new(0.25 * scale[0] as f32, 0.25, 0.0);
        let shines = |side: f32| {
            let hit =
                scene.intersect(&crate::ray::Ray::new(origin + Vec3::Z * side, Vec3::Z * -side)).expect("it is there");
            !scene.le(&hit, Vec3::Z * side).is_zero()
        };
        assert_eq!((shines(front), shines(-front)), (true, false), "{scale:?}");
    }
}

#[test]
fn flattened_meshes_are_left_out_with_a_note() {
    let mut fixture = Fixture::triangle(json!({}));
    fixture.root(json!({ "mesh": 0, "scale": [1, 0, 1] }));
    let translation = fixture.translated();
    assert_eq!(table(&translation)["shapes"].as_array().unwrap().len(), 1);
    assert!(tells(&translation, NoteKind::Approximated, "flattens"));
}

#[test]
fn a_skin_at_rest_stands_where_its_joints_have_it() {
    let mut fixture = Fixture::triangle(json!({}));
    let mut inverse = [0.0f32; 32];
    for joint in [0, 16] {
        (0..4).for_each(|i| inverse[joint + 5 * i] = 1.0);
    }
    (inverse[12], inverse[16 + 13]) = (-1.0, -2.0);
    let binds = fixture.floats("MAT4", &inverse);
    fixture.json["nodes"] = json!([
        { "mesh": 0, "skin": 0, "translation": [100, 0, 0] },
        { "translation": [1, 0, 5] }, { "translation": [0, 2, 5] },
    ]);
    fixture.json["scenes"][0]["nodes"] = json!([0, 1, 2]);
    fixture.json["skins"] = json!([{ "joints": [1, 2], "inverseBindMatrices": binds }]);
    let translation = fixture.translated();
    let matrix = vector(&table(&translation)["shapes"][0]["transform"][0]["matrix"]);
    assert_eq!([matrix[3], matrix[7], matrix[11]], [0.0, 0.0, 5.0]);
    assert!(tells(&translation, NoteKind::Ignored, "a skin at rest"));
    fixture.json["nodes"][2]["translation"] = json!([0, 3, 5]);
    assert!(tells(&fixture.translated(), NoteKind::Approximated, "a skin is left out"));
}

#[test]
fn what_is_left_out_of_meshes_is_told() {
    let mut fixture = Fixture::triangle(json!({ "attributes": { "TANGENT": 1, "_MASS": 1 }, "targets": [{}] }));
    fixture.floats("VEC4", &[1.0; 12]);
    let translation = fixture.translated();
    for words in ["`TANGENT`", "`_MASS`", "morph targets"] {
        assert!(tells(&translation, NoteKind::Ignored, words), "{words}");
    }
    fixture.json["meshes"][0]["weights"] = json!([0.5]);
    assert!(tells(&fixture.translated(), NoteKind::Approximated, "morph targets are left out"));
}
