use std::path::{Path, PathBuf};
use std::sync::Arc;

use sampling::bsdf::Bsdf;
use tempfile::TempDir;

use super::appearance::tests::appearance;
use super::appearance::{Appearance, Images};
use super::mtl;
use super::obj::Model;
use super::translation::{Note, NoteKind};
use crate::load::{LoadOptions, load};
use crate::texture::Texture;

/// A folder with these files.
fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    folder
}

fn open(folder: &TempDir, name: &str) -> Model {
    Model::open(&folder.path().join(name)).unwrap_or_else(|error| panic!("{error}"))
}

fn fault(files: &[(&str, &str)]) -> String {
    let folder = folder(files);
    let path = folder.path().join(files[0].0);
    let Err(error) = load(path.to_str().unwrap(), &LoadOptions::default()) else { panic!("no error") };
    error.to_string().replace(folder.path().to_str().unwrap(), "")
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

#[test]
fn what_emits_is_opaque() {
    let made = appearance("Kd 0.5\nKe 1 1 1\nd 0.9");
    assert!(made.opacity.is_none() && made.emission.is_some());
    assert_eq!(made.notes, [(NoteKind::Approximated, "its opacity is left out: it emits".to_string())]);
    let obj = format!("mtllib a.mtl\n{TRIANGLE}vt 0 0\nusemtl lamp\nf 1/1 2/1 3/1\n");
    let folder = folder(&[("a.obj", obj.as_str()), ("a.mtl", "newmtl lamp\nKd 0.5\nmap_Ke k.png\nmap_d k.png\n")]);
    png(&folder, "k.png", [255, 0, 0, 51]);
    let scene = load(folder.path().join("a.obj").to_str().unwrap(), &LoadOptions::default());
    let scene = scene.unwrap_or_else(|error| panic!("{error}"));
    assert!(!scene.needs.masks && scene.emitters.len() == 1);
}

#[test]
fn a_material_may_have_no_name() {
    let obj = format!("mtllib a.mtl\n{TRIANGLE}f 1 2 3\nusemtl \nf 1 2 3\n");
    let made = |mtl: &str| {
        let folder = folder(&[("a.obj", obj.as_str()), ("a.mtl", mtl)]);
        let model = open(&folder, "a.obj");
        let albedo = |i: usize| match model.appearances[model.groups[i].appearance].1.bsdf {
            Bsdf::Lambert(lambert) => lambert.albedo.to_array()[0],
            other => panic!("{other:?}"),
        };
        assert!(load(folder.path().join("a.obj").to_str().unwrap(), &LoadOptions::default()).is_ok());
        ([albedo(0), albedo(1)], model.notes.all().iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
    };
    let (albedos, told) = made("newmtl\nKd 0.25\n");
    assert_eq!(albedos, [0.5, 0.25]);
    assert!(told.contains("a.obj:6: mapped: `usemtl` without a name means the material without a name"), "{told}");
    let (albedos, told) = made("newmtl a\nKd 0.25\n");
    assert_eq!(albedos, [0.5, 0.5]);
    assert!(told.contains("a.obj:6: approximated: there is no material ``: a matte grey stands for it"), "{told}");
}

#[test]
fn libraries_are_found_where_files_name_them_oddly() {
    let mtl = "newmtl lamp\nKe 5 5 5\n";
    let places: [(&str, &str); 6] = [
        ("lib.mtl", "lib.mtl"),
        ("sub/lib.mtl", "sub/lib.mtl"),
        ("lib.mtl", "models/CornellBox/lib.mtl"),
        ("lib.mtl", "C:\\models\\lib.mtl"),
        ("my lib.mtl", "my lib.mtl"),
        ("lib.mtl", "other.mtl lib.mtl"),
    ];
    for (file, stated) in places {
        let obj = format!("mtllib {stated}\n{TRIANGLE}usemtl lamp\nf 1 2 3\n");
        let folder = folder(&[(file, mtl), ("a.obj", &obj)]);
        let model = open(&folder, "a.obj");
        assert!(model.emits(), "mtllib {stated}: {:?}", model.notes);
        let told = |note: &&Note| note.kind != NoteKind::Mapped;
        assert!(!model.notes.all().iter().any(|note| told(&note)), "{:?}", model.notes);
    }
}

#[test]
fn what_is_missing_is_noted() {
    let obj = format!("mtllib none.mtl\n{TRIANGLE}usemtl lamp\nf 1 2 3\nl 1 2\n");
    let folder = folder(&[("a.obj", &obj)]);
    let path = folder.path().join("a.obj");
    let scene = load(path.to_str().unwrap(), &LoadOptions::default()).unwrap();
    let notes = scene.notes.join("\n");
    for expected in [
        "a.obj:1: approximated: the material library `none.mtl` was not found",
        "a.obj:5: approximated: there is no material `lamp`",
        "a.obj:7: approximated: `l` is not read (1 of them)",
        "a.obj:1: added: nothing in the file emits: it is lit by an environment of radiance 1",
        "a.obj:1: added: the file has no camera",
    ] {
        assert!(notes.contains(expected), "{expected:?} is not in\n{notes}");
    }
    assert!(scene.environment.is_some());
}

#[test]
fn polygons_attributes_and_groups() {
    let obj = "o a\nv 0 0 0\nv 2 -1 0\nv 0.5 0 0\nv 2 1 0\nvn 0 0 1\nvt 0.5 0.5\nf 1/1/1 2 3//1 4/1\ng b\nf 1 2 3\nf 1 1 2\ng empty\n";
    let folder = folder(&[("a.obj", obj)]);
    let model = open(&folder, "a.obj");
    let [a, b] = &model.groups[..] else { panic!("{} groups", model.groups.len()) };
    assert_eq!((a.name.as_str(), b.name.as_str()), ("a", "b"));
    // The dart is cut along its only inner diagonal, and the triangle without area is gone.
    assert_eq!((a.mesh.triangles.len(), b.mesh.triangles.len()), (2, 1));
    let mesh = &a.mesh;
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        0.5 * (b - a).cross(c - a).z
    };
    assert!((mesh.triangles.iter().map(area).sum::<f64>() - 0.5).abs() < 1e-12);
    assert!(mesh.triangles.iter().all(|t| area(t) > 0.0));
    for t in &mesh.triangles {
        assert!(
            t.iter().all(|&i| mesh.normals[i as usize] == sampling::Vec3::Z),
            "missing normals are those of the face"
        );
    }
    assert!(b.mesh.normals.is_empty());
}

#[test]
fn normals_say_which_side_is_the_front() {
    let obj = format!("{TRIANGLE}vn 0 0 -1\nf 1//1 2//1 3//1\n");
    let folder = folder(&[("a.obj", &obj)]);
    let model = open(&folder, "a.obj");
    let mesh = &model.groups[0].mesh;
    let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
    assert!((b - a).cross(c - a).z < 0.0);
    let told = model.notes.all()[0].to_string();
    assert!(told.contains("mapped: 1 triangles were turned to the side of their normals"), "{told}");
}

#[test]
fn bad_files_are_one_error_with_its_place() {
    assert_eq!(fault(&[("a.obj", "v 0 0 0\n")]), "/a.obj: the file holds no faces; add `f` lines");
    assert_eq!(
        fault(&[("a.obj", &format!("{TRIANGLE}f 1 1 2\n"))]),
        "/a.obj: every face of the file is without area; add faces that span an area"
    );
    let mtl =
        fault(&[("a.obj", &format!("mtllib a.mtl\n{TRIANGLE}usemtl a\nf 1 2 3\n")), ("a.mtl", "newmtl a\n\nKd red\n")]);
    assert_eq!(mtl, "/a.mtl:3: a Kd holds `red`; give a number");
    let index = fault(&[("a.obj", &format!("{TRIANGLE}f 1 2 9\n"))]);
    assert_eq!(index, "/a.obj:4: there is no vertex 9; the file defines 3, counted from 1");
}

#[test]
fn unknown_scenes_are_answered_with_the_nearest() {
    let error = |name: &str| match load(name, &LoadOptions::default()) {
        Ok(_) => panic!("no error for {name}"),
        Err(error) => error.to_string(),
    };
    assert!(error("cornel_box").starts_with("there is no scene `cornel_box`; did you mean `cornell_box`?"));
    assert!(error("qqq").starts_with("there is no scene `qqq`; valid are `cornell_box`"));
    let folder = folder(&[("bunny.obj", TRIANGLE), ("a.stl", "")]);
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    assert!(error(&path("buny.obj")).ends_with("bunny.obj`?"));
    assert!(
        error(&path("a.stl")).contains("a.stl: this kind of file is not read; scenes are read from `.toml`, `.obj`")
    );
    assert!(error(&path("none.toml")).contains("cannot read the file"));
    let empty = LoadOptions { size: Some((0, 4)), ..LoadOptions::default() };
    assert_eq!(load("furnace", &empty).err().unwrap().to_string(), "the image size 0x4 is empty; give at least 1x1");
}

/// The Cornell boxes of a folder that others made, if it is there.
fn cornell(name: &str) -> Option<PathBuf> {
    let scenes = std::env::var_os("NEUMANN_SCENES")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes"), PathBuf::from);
    let path = scenes.join("cornell-obj").join(format!("CornellBox-{name}.obj"));
    if !path.is_file() {
        eprintln!("skipped: {} is not there; NEUMANN_SCENES names the folder", path.display());
        return None;
    }
    Some(path)
}

#[test]
fn the_real_cornell_boxes_open_as_they_are() {
    for (name, triangles, expected) in [
        ("Empty-CO", 12, "Lambert"),
        ("Empty-RG", 12, "Lambert"),
        ("Empty-White", 12, "Lambert"),
        ("Mirror", 36, "Mirror"),
        ("Glass", 34, "Dielectric"),
        ("Glossy", 1112, "RoughConductor"),
    ] {
        let Some(path) = cornell(name) else { return };
        let scene = load(path.to_str().unwrap(), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(scene.counts().triangles, triangles, "{name}: {:?}", scene.notes);
        assert!(format!("{:?}", scene.materials()).contains(expected), "{name}: {:?}", scene.materials());
        assert_eq!(scene.emitters.len(), 1, "{name}");
        assert_eq!(scene.environment.is_some(), name == "Glossy", "{name}: only Glossy has no material for its lamp");
        let camera = scene.camera.position();
        assert!(
            camera.z > 1.0 && camera.x.abs() < 0.1,
            "{name}: the camera at {camera} does not look into the open side"
        );
        eprintln!("{name}: {:#?}", scene.notes);
    }
}

/// No bytes whatever make the readers panic: prefixes of a file, and files with pieces replaced.
#[test]
fn nothing_panics() {
    let mtl = "newmtl a\nKd .5\nKs 1 1 1\nNs 10\nNi 1.5\nd 0\nTf 1 1 1\nillum 7\nKe 1 2 3\nmap_Kd x\n";
    let folder = folder(&[("a.mtl", mtl)]);
    let path = folder.path().join("a.obj");
    let obj = format!(
        "mtllib a.mtl\n{TRIANGLE}v 0 0 1\nvn 0 0 1\nvt 0 0\no x\nusemtl a\nf 1/1/1 2 3//1 -1\\\n\ns 1\nf 4 3 2 1\n"
    );
    for end in 0..obj.len() {
        let _ = Model::read(&path, &obj.as_bytes()[..end]);
    }
    let mut state = 1u64;
    let mut next = |n: usize| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as usize % n
    };
    let junk =
        ["nan", "1e400", "-", "0", "/", "//", "\\", "#", "\n", "\t", "9223372036854775807", "-9223372036854775808"];
    let mut mutate = |text: &str| {
        let mut bytes = text.as_bytes().to_vec();
        for _ in 0..1 + next(3) {
            let at = next(bytes.len());
            let end = (at + next(6)).min(bytes.len());
            bytes.splice(at..end, junk[next(junk.len())].bytes());
        }
        bytes
    };
    for _ in 0..4000 {
        let _ = Model::read(&path, &mutate(&obj));
        let statements = String::from_utf8_lossy(&mutate(mtl)).into_owned();
        if let Ok(materials) = mtl::parse(&path, &statements) {
            materials.iter().for_each(|material| drop(Appearance::of(material, &mut Images::default())));
        }
    }
}

#[test]
fn scene_files_take_meshes_from_files() {
    let obj = format!("mtllib a.mtl\n{TRIANGLE}usemtl lamp\nf 1 2 3\nusemtl wall\nf 1 2 3\n");
    let mtl = "newmtl lamp\nKe 5 5 5\nnewmtl wall\nKd 0.1 0.1 0.1\n";
    let scene = |shape: &str| {
        let head =
            "[camera]\nposition = [0, 0, 3]\ntarget = [0, 0, 0]\n[materials.white]\ntype = \"lambert\"\nalbedo = 0.7\n";
        let toml = format!("{head}[[shapes]]\ntype = \"mesh\"\nfile = \"meshes/a.obj\"\n{shape}\n");
        let folder = folder(&[("scene.toml", &toml), ("meshes/a.obj", &obj), ("meshes/a.mtl", mtl)]);
        load(folder.path().join("scene.toml").to_str().unwrap(), &LoadOptions::default()).map_err(|e| e.to_string())
    };
    let own = scene("").unwrap();
    assert_eq!((own.emitters.len(), own.counts().shapes), (1, 2));
    let painted = scene("material = \"white\"\nemission = 2").unwrap();
    assert_eq!(painted.emitters.len(), 2);
    assert!(scene("material = \"white\"").unwrap().emitters.is_empty());
    assert!(scene("radius = 3").unwrap_err().contains("scene.toml:10: unknown key `radius`"));
}

/// A PNG of 2×2 texels of this colour.
fn png(folder: &TempDir, name: &str, texel: [u8; 4]) {
    image::RgbaImage::from_pixel(2, 2, image::Rgba(texel)).save(folder.path().join(name)).unwrap();
}

#[test]
fn maps_are_read_on_meshes_with_texture_coordinates() {
    let mtl = "newmtl leaf\nKd 0.5\nmap_Kd k.png\nmap_d m.png\nbump -bm 2 h.png\nKa 1\nmap_Ks s.png\n\
               newmtl lamp\nKe 2 2 2\nmap_Ke -s 2 2 k.png\nnorm n.png\nnewmtl leaf\nKd 0\n";
    let obj = format!(
        "mtllib a.mtl\n{TRIANGLE}vt 0 0\nvt 1 0\nvt 0 1\ng first\nusemtl leaf\nf 1/1 2/2 3/3\nf 1 2 3\n\
         g second\nusemtl lamp\nf 1/1 2/2 3/3\n"
    );
    let folder = folder(&[("a.obj", obj.as_str()), ("a.mtl", mtl)]);
    png(&folder, "k.png", [255, 0, 0, 255]);
    png(&folder, "m.png", [10, 20, 30, 51]);
    png(&folder, "h.png", [0, 255, 0, 255]);
    png(&folder, "n.png", [128, 128, 255, 255]);
    let model = open(&folder, "a.obj");
    let of = |name: &str| &model.appearances.iter().find(|(known, _)| known == name).unwrap().1;
    let at = |texture: &Texture| {
        let at = crate::texture::SurfaceCoordinates::of(sampling::Vec3::ZERO);
        texture.at(&at).to_array()
    };
    let (leaf, lamp) = (of("leaf"), of("lamp"));
    let near = |found: [f32; 3], known: [f32; 3]| {
        assert!(found.iter().zip(known).all(|(a, b)| (a - b).abs() < 1e-5), "{found:?}, not {known:?}");
    };
    near(at(leaf.maps.albedo.as_ref().unwrap()), [0.5, 0.0, 0.0]);
    near(at(leaf.maps.opacity.as_ref().unwrap()), [0.2; 3]);
    near(at(leaf.maps.relief.as_ref().unwrap().map.texture()), [2.0 * 0.71516; 3]);
    near(at(lamp.maps.emission.as_ref().unwrap()), [2.0, 0.0, 0.0]);
    // Two materials that name an image have one.
    let image = |texture: &Option<Texture>| match texture {
        Some(Texture::Image(texture)) => texture.image.clone(),
        other => panic!("{other:?}"),
    };
    assert!(Arc::ptr_eq(&image(&leaf.maps.albedo), &image(&lamp.maps.emission)));
    assert!(matches!(lamp.maps.relief.as_ref().unwrap().map, crate::relief::ReliefMap::Normals(_)));
    let told: Vec<String> = model.notes.all().iter().map(|note| format!("{}: {}", note.kind, note.text)).collect();
    let expected = [
        "mapped: material `leaf` becomes `lambert`",
        "ignored: `Ka` is not read",
        "approximated: material `leaf`: `map_Ks s.png` is not read",
        "mapped: material `lamp` becomes `lambert`",
        "approximated: there is more than one material `leaf`: the first holds",
    ];
    assert_eq!(told, expected);
    let scene = load(folder.path().join("a.obj").to_str().unwrap(), &LoadOptions::default()).unwrap();
    assert!(scene.needs.masks && scene.environment.is_none());
    let bare = format!("mtllib a.mtl\n{TRIANGLE}usemtl leaf\nf 1 2 3\n");
    let folder = self::folder(&[("a.obj", bare.as_str()), ("a.mtl", mtl)]);
    png(&folder, "k.png", [255, 0, 0, 255]);
    let told = open(&folder, "a.obj").notes.all().last().unwrap().to_string();
    assert!(
        told.ends_with(
            "a.obj:5: approximated: the maps of material `leaf` are left out on faces without texture coordinates"
        ),
        "{told}"
    );
    let labels = scene.labels.surfaces();
    assert!(
        labels.iter().any(|of| of == &["leaf", "first"]) && labels.iter().any(|of| of == &["lamp", "second"]),
        "{labels:?}"
    );
}
