use super::*;
use crate::load::{LoadOptions, load};
use proptest::prelude::*;
use sampling::{vec2, vec3};
use std::path::PathBuf;

/// A unit square and a triangle over it, with all that is read, and some that is not.
const ASCII: &str = "ply
format ascii 1.0
comment made by hand
obj_info nothing
element camera 1
property list uchar float whatever
element vertex 5
property float x
property float y
property float z
property float nx
property float ny
property float nz
property float s
property float t
property uchar red
property uchar green
property uchar blue
property float quality
element face 2
property int flags
property list uchar uint vertex_index
end_header
2 0.5 0.25
0 0 0 0 0 1 0 0 255 0 0 1
1 0 0 0 0 2 1 0 0 255 0 1
1 1 0 0 0 1 1 1 0 0 255 1
0 1 0 0 0 1 0 1 188 188 188 1
0 0 1 0 0 1 0 0 0 0 0 1
7 4 0 1 2 3
7 3 0 4 1
";

fn fault(text: &str) -> String {
    match read(text.as_bytes()) {
        Ok(_) => panic!("no error for {text}"),
        Err(error) => error.in_file("a.ply").to_string(),
    }
}

/// A binary file of the same pyramid: vertices as floats, faces as the given list types.
fn binary(big: bool, ends: &str) -> Vec<u8> {
    let format = if big { "binary_big_endian" } else { "binary_little_endian" };
    let header = [
        "ply",
        &format!("format {format} 1.0"),
        "element vertex 4",
        "property double x",
        "property float y",
        "property float z",
        "property short skipped",
        "property list ushort double also_skipped",
        "element face 1",
        "property list int short vertex_indices",
        "element tristrips 1",
        "property list uint int vertex_indices",
        "end_header",
        "",
    ]
    .join(ends);
    let mut bytes = header.into_bytes();
    macro_rules! put {
        ($($value:expr),*) => {$( bytes.extend(if big { $value.to_be_bytes().to_vec() } else { $value.to_le_bytes().to_vec() }); )*};
    }
    for (x, y, z) in [(0.1f64, 0f32, 0f32), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 0.0, 1.0)] {
        put!(x, y, z, -3i16, 2u16, 0.5f64, 1e300f64);
    }
    put!(3i32, 0i16, 1i16, 2i16);
    put!(8u32, 0i32, 1i32, 2i32, 3i32, -1i32, 1i32, 2i32, 3i32);
    bytes
}

#[test]
fn what_is_declared_is_read() {
    for text in [ASCII.to_string(), ASCII.replace('\n', "\r\n"), ASCII.trim_end().to_string()] {
        let Model { mesh, notes } = read(text.as_bytes()).unwrap();
        // The last triangle's normals point to its back.
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 4, 1]]);
        assert!(notes.is_empty(), "{notes:?}");
        assert_eq!(mesh.positions[4], DVec3::Z);
        assert_eq!(mesh.normals, [vec3(0.0, 0.0, 1.0); 5]);
        assert_eq!(mesh.uvs[3], vec2(0.0, 1.0));
        assert_eq!(mesh.colours[1].to_array(), [0.0, 1.0, 0.0]);
        assert!((mesh.colours[3].to_array()[0] - 0.502_886).abs() < 1e-5, "{:?}", mesh.colours[3]);
    }
    let turned = read(ASCII.replace("7 4 0 1 2 3", "7 4 3 2 1 0").as_bytes()).unwrap();
    assert_eq!(turned.notes[0].1, "2 triangles were turned to the side of their normals");
    let longer = read(format!("{ASCII}3 0 1 2\n").as_bytes()).unwrap();
    assert_eq!(longer.notes[0].1, "7 bytes behind the last element that the header counts are left out");
    let linear = ASCII.replace("uchar red", "float red").replace("uchar green", "float green");
    let linear = read(linear.replace("uchar blue", "float blue").as_bytes()).unwrap();
    assert_eq!(linear.mesh.colours[1].to_array(), [0.0, 255.0, 0.0]);
}

#[test]
fn what_would_be_seen_and_is_left_out_is_told() {
    let told = |text: &str| {
        let notes = read(text.as_bytes()).unwrap_or_else(|error| panic!("{error}")).notes;
        assert!(notes.iter().all(|(kind, _)| *kind == NoteKind::Approximated), "{notes:?}");
        notes.into_iter().map(|(_, text)| text).collect::<Vec<_>>()
    };
    let faces = ASCII.replace("property int flags", "property uchar red");
    assert_eq!(told(&faces), ["the colours of faces are left out: give them to vertices"]);
    let wedges = ASCII.replace("property int flags", "property list uchar float texcoord");
    let wedges = wedges.replace("7 4 0 1 2 3", "2 0 0 4 0 1 2 3").replace("7 3 0 4 1", "0 3 0 4 1");
    let expected =
        ["the texture coordinates of faces, `texcoord`, are left out: give them to vertices, as `s` and `t`"];
    assert_eq!(told(&wedges), expected);
    // An alpha is told of where it is not full: every vertex of Blender's has one.
    let full = ASCII.replace("property float quality", "property float alpha");
    assert!(told(&full).is_empty());
    let clear = full.replace("1 1 0 0 0 1 1 1 0 0 255 1", "1 1 0 0 0 1 1 1 0 0 255 0.5");
    assert_eq!(told(&clear), ["the alpha of vertices is left out, which is not full of 1 of them"]);
    let bytes = full.replace("float alpha", "uchar alpha").replace(" 1\n", " 255\n");
    let bytes = bytes.replace("3 0 4 255\n", "3 0 4 1\n").replace("camera 255", "camera 1");
    assert!(told(&bytes).is_empty());
    let clear = bytes.replace("0 0 255 255", "0 0 255 254");
    assert_eq!(told(&clear).len(), 1, "{clear}");
}

#[test]
fn a_cloud_of_points_is_one_error() {
    let cloud = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
                 element face 0\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 1 1\n";
    let expected = "a.ply: the file holds no faces: it is a cloud of 2 points, which has no surface; save it as a mesh of \
                    polygons or triangle strips";
    assert_eq!(fault(cloud), expected);
}

#[test]
fn binary_files_of_both_orders_are_read() {
    for big in [false, true] {
        for ends in ["\n", "\r\n"] {
            let Model { mesh, .. } = read(&binary(big, ends)).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(mesh.positions[0], DVec3::new(0.1, 0.0, 0.0));
            assert_eq!(mesh.triangles, [[0, 1, 2], [0, 1, 2], [2, 1, 3], [1, 2, 3]]);
            assert!(mesh.normals.is_empty() && mesh.uvs.is_empty() && mesh.colours.is_empty());
        }
    }
}

#[test]
fn bad_files_are_one_error_with_its_place() {
    let replaced = |from: &str, to: &str| {
        assert!(ASCII.contains(from), "{from}");
        fault(&ASCII.replacen(from, to, 1))
    };
    let cases = [
        (fault(""), "a.ply: the file does not begin with `ply`; give a PLY file"),
        (fault("ply\nformat ascii 1.0\n"), "a.ply:2: the header does not end"),
        (replaced("ascii", "asci"), "a.ply:2: the format `asci` is unknown; did you mean `ascii`?"),
        (replaced("format ascii 1.0", "comment"), "a.ply:23: the header names no format"),
        (
            replaced("property float x", "property flaot x"),
            "a.ply:8: the type `flaot` is unknown; did you mean `float`?",
        ),
        (replaced("property float x", "property x"), "a.ply:8: `property x` is not understood"),
        (replaced("comment", "property int a\ncomment"), "a.ply:3: the property `a` belongs to no element"),
        (replaced("vertex 5", "vertex -5"), "a.ply:7: `-5` is no number of elements; give a whole number"),
        (
            replaced("vertex 5", "vertex 99999999999999"),
            "a.ply:7: element `vertex`: there are 99999999999999 of them, for which the file is too short",
        ),
        (replaced("face 2", "face 200"), "a.ply:20: element `face`: there are 200 of them, for which"),
        (replaced("face 2", "face 3"), "a.ply:31: face 2: the file ends within it; save it again, as a whole"),
        (replaced("list uchar float", "list float float"), "a.ply:6: the list `whatever` is counted by a fraction"),
        (replaced("float y", "float why"), "a.ply:7: element `vertex`: the vertices lack `x`, `y` or `z`"),
        (replaced("7 3 0 4 1", "7 3 0 5 1"), "a.ply:31: face 1: there is no vertex 5; the file has 5, counted from 0"),
        (replaced("7 3 0 4 1", "7 3 0 -1 1"), "a.ply:31: face 1: there is no vertex -1"),
        (replaced("7 3 0 4 1", "7 3 0 0.5 1"), "a.ply:31: face 1: `0.5` is no vertex; give whole numbers"),
        (replaced("7 3 0 4 1", "7 2 0 1"), "a.ply:31: face 1: it has 2 corners; a face has at least 3"),
        (replaced("7 3 0 4 1", "7 3e9 0 4 1"), "a.ply:31: face 1: the file ends within it"),
        (replaced("7 3 0 4 1", "7 -3 0 4 1"), "a.ply:31: face 1: it has a list of -3 items"),
        (replaced("1 1 0 0", "1 nan 0 0"), "a.ply:27: vertex 2: a number is not finite, or beyond 1e15"),
        (replaced("1 1 0 0", "1 1e300 0 0"), "a.ply:27: vertex 2: a number is not finite, or beyond 1e15"),
        (replaced("1 1 0 0", "1 one 0 0"), "a.ply:27: vertex 2: `one` is no number; give a number"),
        (replaced("vertex_index", "corners"), "a.ply:20: element `face`: there is no list `vertex_indices`"),
        (
            replaced("element camera 1", "element vertex 1\nproperty float x"),
            "a.ply:5: element `vertex`: the vertices lack",
        ),
        (replaced("element face 2", "element edge 2"), "a.ply: the file holds no faces: it is a cloud of 5 points"),
    ];
    for (message, expected) in cases {
        assert!(message.starts_with(expected), "{message}\ninstead of\n{expected}");
    }
    // An element without properties takes no bytes, however many there are.
    assert!(read(ASCII.replace("end_header", "element nothing 18446744073709551615\nend_header").as_bytes()).is_ok());
}

#[test]
fn a_file_opens_as_a_scene_and_in_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    std::fs::write(&path, ASCII).unwrap();
    let scene = load(path.to_str().unwrap(), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.counts().triangles, 3);
    assert!(scene.environment.is_some() && scene.needs.textures);
    let toml = "[camera]\nposition = [0, 0, 3]\ntarget = [0, 0, 0]\n[materials.white]\ntype = \"lambert\"\nalbedo = 0.7\n\
                [[shapes]]\ntype = \"mesh\"\nfile = \"a.ply\"\nmaterial = \"white\"\nemission = { vertex_colours = true }\n";
    let file = folder.path().join("scene.toml");
    std::fs::write(&file, toml).unwrap();
    let scene = load(file.to_str().unwrap(), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((scene.counts().triangles, scene.emitters.len()), (3, 1));
    std::fs::write(&file, toml.replace("material = \"white\"\n", "")).unwrap();
    let message = load(file.to_str().unwrap(), &LoadOptions::default()).err().unwrap().to_string();
    assert!(message.contains("lacks `material`"), "{message}");
    std::fs::write(&path, "ply\nformat ascii 1.0\nelement x\n").unwrap();
    let message = load(path.to_str().unwrap(), &LoadOptions::default()).err().unwrap().to_string();
    assert!(message.contains("a.ply:3: `element x` is not understood"), "{message}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    /// No bytes whatever make the reader panic, or take more memory than they could fill.
    #[test]
    fn random_bytes_do_not_panic(bytes in prop::collection::vec(any::<u8>(), 0..400), valid in any::<bool>()) {
        let head = b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
            element face 5\nproperty list char int vertex_index\nend_header\n";
        let bytes = if valid { [&head[..], &bytes[..]].concat() } else { bytes };
        let _ = read(&bytes);
    }

    #[test]
    fn broken_files_do_not_panic(
        kind in 0..3,
        cuts in prop::collection::vec((any::<prop::sample::Index>(), 0..6usize, prop::collection::vec(any::<u8>(), 0..6)), 1..4),
        digits in any::<bool>(),
    ) {
        let mut bytes = match kind {
            0 => ASCII.as_bytes().to_vec(),
            1 => binary(false, "\n"),
            _ => binary(true, "\r\n"),
        };
        for (at, length, junk) in cuts {
            let at = at.index(bytes.len());
            let end = (at + length).min(bytes.len());
            bytes.splice(at..end, junk.into_iter().map(|byte| if digits { b'0' + byte % 10 } else { byte }));
        }
        let _ = read(&bytes);
    }
}

/// The meshes that came with a scene of others, if they are there.
fn meshes(scene: &str) -> Vec<PathBuf> {
    let scenes = std::env::var_os("NEUMANN_SCENES")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes"), PathBuf::from);
    let folder = scenes.join(scene).join("pbrt/models");
    let Ok(entries) = std::fs::read_dir(&folder) else {
        eprintln!("skipped: {} is not there; NEUMANN_SCENES names the folder", folder.display());
        return Vec::new();
    };
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    files.retain(|path| path.extension().is_some_and(|ending| ending == "ply"));
    files.sort();
    files
}

/// Of these files the headers say how many triangles there are: each has three corners.
#[test]
fn real_files_are_read_whole() {
    for (scene, expected) in [("coffee", 235_265), ("water-caustic", 103_451)] {
        let files = meshes(scene);
        let mut total = 0;
        for path in &files {
            let bytes = std::fs::read(path).unwrap();
            let declared: usize = Header::read(&bytes)
                .unwrap()
                .elements
                .iter()
                .filter(|element| element.name == "face")
                .map(|element| element.count as usize)
                .sum();
            let model = open(path).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(model.mesh.triangles.len(), declared, "{}", path.display());
            total += declared;
        }
        assert!(files.is_empty() || total == expected, "{scene}: {total}");
    }
}
