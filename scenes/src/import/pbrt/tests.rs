//! Every construct: what it becomes, and that scene files may say so.

mod cameras;
mod hostile;
mod real;
mod surfaces;

use std::path::Path;

use tempfile::TempDir;

use super::translate;
use crate::builder::MeshData;
use crate::import::translation::{NoteKind, Translation};
use crate::needs::Skip;
use crate::ray::Ray;
use sampling::{Vec3, vec3};

const CAMERA: &str = "LookAt 0 0 4 0 0 0 0 1 0 Camera \"perspective\" \"float fov\" 40 Film \"rgb\" \"integer xresolution\" 16 \
     \"integer yresolution\" 12 Integrator \"path\" WorldBegin";

fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    folder
}

fn open(folder: &TempDir) -> Result<Translation, String> {
    let error =
        |error: crate::error::SceneError| error.to_string().replace(&format!("{}/", folder.path().display()), "");
    translate(&folder.path().join("a.pbrt"), folder.path(), "a").map_err(error)
}

/// The translation of a scene that holds this behind a camera.
fn made_of(body: &str) -> Translation {
    made_with(body, &[])
}

fn made_with(body: &str, files: &[(&str, &str)]) -> Translation {
    let text = format!("{CAMERA}\n{body}\n");
    let folder = folder(&[&[("a.pbrt", text.as_str())], files].concat());
    open(&folder).unwrap_or_else(|error| panic!("{error}\n{body}"))
}

/// The error of a scene that holds this, on its second line, behind a camera.
fn fault(body: &str) -> String {
    let folder = folder(&[("a.pbrt", &format!("{CAMERA}\n{body}\n"))]);
    open(&folder).map(|translation| translation.text).expect_err(body)
}

fn notes(translation: &Translation, kind: NoteKind) -> Vec<String> {
    translation.notes.iter().filter(|note| note.kind == kind).map(|note| note.text.clone()).collect()
}

/// The scene's table, which a scene file may hold.
fn table(translation: &Translation) -> toml::Table {
    translation.text.parse().unwrap()
}

fn vector(value: &toml::Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_float().unwrap()).collect()
}

#[test]
fn attributes_nest_and_transforms_come_back() {
    let text = "AttributeBegin Translate 1 0 0 Material \"diffuse\" \"rgb reflectance\" [ .1 .2 .3 ] TransformBegin Scale 2 2 2 \
                ReverseOrientation Shape \"sphere\" TransformEnd Shape \"sphere\" AttributeEnd Shape \"sphere\" \"float radius\" 3";
    let translation = made_of(text);
    let table = table(&translation);
    let shapes = table["shapes"].as_array().unwrap();
    let matrix = |i: usize| shapes[i].get("transform").map(|steps| vector(&steps.as_array().unwrap()[0]["matrix"]));
    assert_eq!(matrix(0).unwrap(), [2.0, 0.0, 0.0, 1.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    assert_eq!(matrix(1).unwrap()[..4], [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(matrix(2), None);
    // What is set within a transform's frame stays.
    let flipped: Vec<bool> = shapes.iter().map(|shape| shape.get("flip").is_some()).collect();
    assert_eq!(flipped, [true, true, false]);
    assert_eq!(shapes[2]["material"].as_str(), Some("default"));
    assert_eq!(vector(&table["materials"]["diffuse_line2"]["albedo"]), [0.1, 0.2, 0.3]);
    translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
}

#[test]
fn every_transform_is_column_by_column_and_the_last_is_first() {
    let matrix = |text: &str| {
        let table = table(&made_of(&format!("{text} Shape \"disk\"")));
        vector(&table["shapes"][0]["transform"][0]["matrix"])
    };
    let plain = matrix("Transform [ 1 0 0 0 0 1 0 0 0 0 1 0 5 6 7 1 ]");
    assert_eq!([plain[3], plain[7], plain[11]], [5.0, 6.0, 7.0]);
    assert_eq!(
        matrix("Translate 1 2 3 ConcatTransform [ 2 0 0 0 0 2 0 0 0 0 2 0 1 0 0 1 ]")[..4],
        [2.0, 0.0, 0.0, 2.0]
    );
    let turned = matrix("Rotate 90 0 0 1");
    assert!((turned[1] + 1.0).abs() < 1e-12 && (turned[4] - 1.0).abs() < 1e-12);
    let named = "Translate 1 2 3 CoordinateSystem \"here\" Identity Scale 9 9 9 CoordSysTransform \"here\"";
    assert_eq!(matrix(named)[3], 1.0);
    // The camera's frame stands where the camera does.
    assert!((matrix("CoordSysTransform \"camera\"")[11] - 4.0).abs() < 1e-12);
}

#[test]
fn objects_become_groups_and_emit_nothing() {
    let text = "ObjectBegin \"ball\" Translate 1 0 0 AreaLightSource \"diffuse\" Shape \"sphere\" Shape \"disk\" ObjectEnd \
                Translate 0 5 0 ObjectInstance \"ball\" Scale 2 2 2 ObjectInstance \"ball\"";
    let translation = made_of(text);
    let table = table(&translation);
    let shapes = table["shapes"].as_array().unwrap();
    assert_eq!(shapes.len(), 2);
    let matrix = vector(&shapes[1]["transform"][0]["matrix"]);
    assert_eq!([matrix[0], matrix[3], matrix[7]], [2.0, 0.0, 5.0]);
    let members = table["groups"][0]["shapes"].as_array().unwrap();
    assert_eq!((members.len(), shapes[1]["group"].as_str()), (2, table["groups"][0]["name"].as_str()));
    let scene = translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
    assert_eq!((scene.counts().spheres, scene.counts().disks, scene.counts().instances), (1, 1, 2));
    let hit = scene.intersect(&Ray::new(vec3(2.0, 20.0, 0.0), -Vec3::Y)).unwrap();
    assert!((hit.point.p.y - 7.0).abs() < 1e-5, "the larger ball, at (2, 5, 0), is met at {}", hit.point.p);
    assert!(!translation.text.contains("emission"));
    assert!(notes(&translation, NoteKind::Approximated).iter().any(|note| note.contains("do not emit")));
}

#[test]
fn attributes_hold_where_nothing_is_said() {
    let text = "Attribute \"shape\" \"float radius\" 3 \"float zmin\" -9 Shape \"sphere\" Shape \"sphere\" \"float radius\" 2 \
                Attribute \"shape\" \"float radius\" 4 Shape \"disk\"";
    let table = table(&made_of(text));
    let radii: Vec<f64> = (0..2).map(|i| table["shapes"][i]["radius"].as_float().unwrap()).collect();
    assert_eq!(radii, [3.0, 2.0]);
    assert_eq!(vector(&table["shapes"][2]["edge_u"]), [4.0, 0.0, 0.0]);
}

#[test]
fn included_files_are_found_from_their_own_folder() {
    let files = [
        ("parts/b.pbrt", "Translate 1 0 0 Material \"diffuse\" Include \"c.pbrt\""),
        ("parts/c.pbrt", "Shape \"sphere\""),
        ("d.pbrt", "Translate 7 0 0 Shape \"sphere\""),
    ];
    let translation = made_with("Import \"d.pbrt\" Include \"parts/b.pbrt\" Shape \"disk\"", &files);
    let table = table(&translation);
    let x: Vec<f64> = (0..3).map(|i| vector(&table["shapes"][i]["transform"][0]["matrix"])[3]).collect();
    // What a file that is imported sets ends with it.
    assert_eq!(x, [7.0, 1.0, 1.0]);
    let place = translation.places.iter().find(|place| place.file.ends_with("c.pbrt"));
    assert_eq!(place.map(|place| place.line), Some(1));
}

#[test]
fn emitters() {
    let emitter = |text: &str| {
        let translation = made_of(&format!("Shape \"sphere\" {text}"));
        translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
        table(&translation)["emitters"][0].clone()
    };
    let point =
        emitter("Translate 1 0 0 LightSource \"point\" \"rgb I\" [2 2 2] \"float scale\" 3 \"point3 from\" [0 1 0]");
    assert_eq!((point["type"].as_str(), point["intensity"].as_float()), (Some("point"), Some(6.0)));
    assert_eq!(vector(&point["position"]), [1.0, 1.0, 0.0]);
    let lamp = emitter("LightSource \"point\" \"float power\" 100");
    assert!((lamp["intensity"].as_float().unwrap() - 100.0 / (4.0 * std::f64::consts::PI)).abs() < 1e-9);
    let spot =
        emitter("LightSource \"spot\" \"float coneangle\" 40 \"float conedeltaangle\" 10 \"point3 to\" [0 -1 0]");
    assert_eq!((spot["cutoff"].as_float(), spot["beam"].as_float()), (Some(40.0), Some(30.0)));
    assert_eq!((spot["falloff"].as_str(), vector(&spot["target"])), (Some("smooth"), vec![0.0, -1.0, 0.0]));
    let sun = emitter("LightSource \"distant\" \"point3 from\" [0 2 0] \"point3 to\" [0 0 0] \"float illuminance\" 5");
    assert_eq!((vector(&sun["direction"]), sun["irradiance"].as_float()), (vec![0.0, -1.0, 0.0], Some(5.0)));
    // Whatever the value of a constant spectrum, its luminance is 1.
    let sky = emitter("LightSource \"infinite\" \"spectrum L\" [ 200 5 900 5 ] \"float scale\" 2");
    let radiance = vector(&sky["radiance"]);
    assert!(radiance.iter().zip([2.41, 1.896, 1.818]).all(|(a, b)| (a - b).abs() < 0.04), "{radiance:?}");
    let grey = emitter("LightSource \"infinite\" \"rgb L\" [.5 .5 .5]");
    assert_eq!(grey["radiance"].as_float(), Some(0.5));
}

#[test]
fn environments_have_equal_areas_since_the_fourth_version() {
    let files = [("sky.exr", "")];
    let body =
        |name: &str| format!("Scale -1 1 1 Rotate 90 1 0 0 LightSource \"infinite\" \"string {name}\" \"sky.exr\"");
    let new = table(&made_with(&body("filename"), &files))["emitters"][0].clone();
    assert_eq!((new["mapping"].as_str(), new["image"].as_str()), (Some("equal_area"), Some("sky.exr")));
    let turn = vector(&new["transform"][0]["matrix"]);
    assert!((turn[0] + 1.0).abs() < 1e-12 && (turn[6] + 1.0).abs() < 1e-12, "{turn:?}");
    let old =
        table(&made_with("LightSource \"infinite\" \"string mapname\" \"sky.exr\"", &files))["emitters"][0].clone();
    assert!(old.get("mapping").is_none());
    let turn = vector(&old["transform"][0]["matrix"]);
    // Our +y, the upper edge, is v3's +z; our centre, +z, its −x.
    assert_eq!([turn[9], turn[2], turn[4]], [1.0, -1.0, 1.0]);
}

#[test]
fn surfaces_emit_on_one_side_or_two() {
    let shape = |text: &str| {
        let translation = made_of(&format!("AreaLightSource \"diffuse\" {text}"));
        translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
        table(&translation)["shapes"][0].clone()
    };
    let plain = shape("\"rgb L\" [17 12 4] Shape \"sphere\"");
    assert_eq!((vector(&plain["emission"]), plain.get("two_sided")), (vec![17.0, 12.0, 4.0], None));
    let both = shape("\"rgb L\" [1 1 1] \"float scale\" 2 \"bool twosided\" true Shape \"sphere\"");
    assert_eq!((both["emission"].as_float(), both["two_sided"].as_bool()), (Some(2.0), Some(true)));
    let power = shape("\"float power\" 10 Scale 2 2 2 Shape \"disk\"");
    let radiance = 10.0 / (4.0 * std::f64::consts::PI.powi(2));
    assert!((power["emission"].as_float().unwrap() - radiance).abs() < 1e-9);
    let mesh = "Scale 3 1 1 Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]";
    let power = shape(&format!("\"float power\" 3 {mesh}"));
    assert!((power["emission"].as_float().unwrap() - 2.0 / std::f64::consts::PI).abs() < 1e-9);
}

const BARE: &str = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]";

/// Before v4 a name of a texture or material may be given again, for what comes after it within the same attributes.
#[test]
fn names_that_are_given_again_hold_from_there_on() {
    let texture =
        |value: f64| format!("Texture \"t\" \"spectrum\" \"constant\" \"rgb value\" [{value} {value} {value}]");
    let shape = "Material \"matte\" \"texture Kd\" \"t\" Shape \"sphere\"";
    let text = format!(
        "{} AttributeBegin {} {shape} AttributeEnd {shape} {} {shape}\n\
         Texture \"t\" \"float\" \"constant\" \"float value\" 0.75 {shape}",
        texture(0.25),
        texture(0.5),
        texture(0.125)
    );
    let translation = made_of(&text);
    assert!(notes(&translation, NoteKind::Approximated).is_empty(), "{:?}", translation.notes);
    let table = table(&translation);
    let albedo =
        |shape: &toml::Value| table["materials"][shape["material"].as_str().unwrap()]["albedo"].as_float().unwrap();
    let albedos: Vec<f64> = table["shapes"].as_array().unwrap().iter().map(albedo).collect();
    assert_eq!(albedos, [0.5, 0.25, 0.125, 0.125]);

    let material = |value: f64| {
        format!("MakeNamedMaterial \"m\" \"string type\" \"diffuse\" \"rgb reflectance\" [{value} {value} {value}]")
    };
    let shape = "NamedMaterial \"m\" Shape \"sphere\"";
    let table = self::table(&made_of(&format!("{} {shape} {} {shape}", material(0.25), material(0.5))));
    let albedo =
        |shape: &toml::Value| table["materials"][shape["material"].as_str().unwrap()]["albedo"].as_float().unwrap();
    let albedos: Vec<f64> = table["shapes"].as_array().unwrap().iter().map(albedo).collect();
    assert_eq!(albedos, [0.25, 0.5]);
}

#[test]
fn triangles_without_texture_coordinates_have_pbrts() {
    let checks = "Texture \"t\" \"spectrum\" \"checkerboard\" Material \"diffuse\" \"texture reflectance\" \"t\"";
    let corners = |text: &str| table(&made_of(text))["shapes"][0].get("corner_uvs").map(ToString::to_string);
    let mapped = format!("{checks} {BARE}");
    assert_eq!(corners(&mapped).as_deref(), Some("[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]"));
    assert_eq!(corners(&format!("{mapped} \"point2 uv\" [0 0 1 0 0 1]")), None);
    assert_eq!(corners(BARE), None);
    made_of(&mapped).read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
    let positions = vec![glam::DVec3::ZERO, glam::DVec3::X, glam::DVec3::Y, glam::DVec3::ONE];
    let mesh = MeshData { positions, triangles: vec![[0, 1, 2], [2, 1, 3]], ..MeshData::default() };
    let uvs = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]].map(sampling::Vec2::from);
    let own = mesh.with_corner_uvs(uvs);
    assert_eq!((own.uvs.clone(), own.triangles.clone()), (uvs.repeat(2), vec![[0, 1, 2], [3, 4, 5]]));
    assert_eq!(own.positions[3..], [glam::DVec3::Y, glam::DVec3::X, glam::DVec3::ONE]);
    assert_eq!(own.clone().with_corner_uvs([sampling::Vec2::ZERO; 3]).uvs, own.uvs);
}

#[test]
fn what_a_transform_flattens_is_left_out() {
    let flat = format!("AttributeBegin Scale 1 0 1 AttributeBegin AttributeEnd AttributeEnd {BARE}");
    assert!(notes(&made_of(&flat), NoteKind::Approximated).is_empty());
    let flat = made_of(&format!("{BARE} Transform [ 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 1 ] Shape \"sphere\""));
    assert_eq!(notes(&flat, NoteKind::Approximated), ["a shape that its transform flattens is left out"]);
    assert_eq!(table(&flat)["shapes"].as_array().unwrap().len(), 1);
}

#[test]
fn options_need_no_type_and_filters_have_two_radii() {
    for option in ["\"seed\" 42", "\"disablepixeljitter\" true", "\"string msereferenceimage\" [ \"a\" ]"] {
        assert!(notes(&made_of(&format!("Option {option}\n{BARE}")), NoteKind::Approximated).is_empty());
    }
    let filter = "PixelFilter \"gaussian\" \"float xradius\" 2 \"float yradius\" 2";
    let text = format!("{filter}\n{CAMERA}\n{BARE}");
    let told = notes(&open(&folder(&[("a.pbrt", &text)])).unwrap(), NoteKind::Approximated).concat();
    assert!(told.contains("has other parameters than our `gaussian`") && !told.contains("yradius"), "{told}");
}

#[test]
fn interfaces_do_not_emit_and_amounts_may_have_colours() {
    let text = format!("Material \"interface\" AreaLightSource \"diffuse\" {BARE}");
    assert!(table(&made_of(&text))["shapes"][0].get("emission").is_none());
    let part = |name: &str| format!("MakeNamedMaterial \"{name}\" \"string type\" \"matte\"");
    let mix =
        "Material \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" \"rgb amount\" [.1 .2 .6]";
    let translation = made_of(&format!("{} {} {mix} {BARE}", part("a"), part("b")));
    let amount = table(&translation)["materials"]["mix_line2"]["amount"].as_float().unwrap();
    assert!((amount - 0.7).abs() < 1e-12, "{amount}");
    assert!(notes(&translation, NoteKind::Approximated).concat().contains("is taken as its mean"));
}

#[test]
fn packed_files_are_included() {
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    std::io::Write::write_all(&mut packer, BARE.as_bytes()).unwrap();
    let folder = folder(&[("a.pbrt", &format!("{CAMERA}\nInclude \"b.pbrt.gz\"\n"))]);
    std::fs::write(folder.path().join("b.pbrt.gz"), packer.finish().unwrap()).unwrap();
    assert_eq!(table(&open(&folder).unwrap())["shapes"].as_array().unwrap().len(), 1);
}
