//! Scenes that are wrong: one error with file and line and mend, or a note.

use proptest::prelude::*;

use super::*;

#[test]
fn errors_name_file_line_and_mend() {
    let mesh = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0]";
    let cases = [
        ("Shap \"sphere\"".to_string(), "a.pbrt:2: there is no directive `Shap`; did you mean `Shape`?"),
        ("Shape \"sphere".into(), "a.pbrt:2: a text has no end"),
        ("Shape sphere".into(), "a.pbrt:2: `Shape` lacks a name"),
        ("42".into(), "a.pbrt:2: the number 42 stands where a directive should"),
        ("Translate 1 2".into(), "a.pbrt:2: `Translate` has an end where it needs 3 numbers"),
        ("Transform [ 1 0 ]".into(), "a.pbrt:2: `Transform` has `]` where it needs 16 numbers"),
        ("Transform [ 1 0 0 1 0 1 0 0 0 0 1 0 0 0 0 1 ]".into(), "a.pbrt:2: `Transform` is not affine"),
        ("Option \"seed\"".into(), "a.pbrt:2: an `Option` lacks its value"),
        ("Option seed 7".into(), "a.pbrt:2: an `Option` lacks its name"),
        ("Rotate 3 0 0 0".into(), "a.pbrt:2: `Rotate` has no axis"),
        ("LookAt 0 0 0 0 0 0 0 1 0".into(), "a.pbrt:2: `LookAt` looks at where it stands"),
        ("LookAt 0 0 0 0 1 0 0 1 0".into(), "a.pbrt:2: `LookAt` looks along its `up`"),
        ("Translate 1e999 0 0".into(), "a.pbrt:2: `1e999` is no number"),
        ("Translate nan 0 0".into(), "a.pbrt:2: `Translate` has `nan`"),
        ("AttributeEnd".into(), "a.pbrt:2: `AttributeEnd` ends nothing"),
        ("AttributeBegin TransformEnd".into(), "a.pbrt:2: `TransformEnd` ends what something else began at"),
        ("AttributeBegin".into(), "a.pbrt:2: `AttributeBegin` is never ended; add `AttributeEnd`"),
        ("ObjectBegin \"a\" ObjectBegin \"b\"".into(), "a.pbrt:2: an object begins within another"),
        ("ObjectInstance \"a\"".into(), "a.pbrt:2: there is no object `a`"),
        ("ObjectBegin \"a\" ObjectInstance \"a\" ObjectEnd".into(), "an instance stands within an object"),
        ("CoordSysTransform \"wrold\"".into(), "a.pbrt:2: there is no coordinate system `wrold`; did you mean `world`?"),
        ("WorldBegin".into(), "a.pbrt:2: the world begins a second time"),
        ("Include \"a.pbrt\"".into(), "a.pbrt:2: a file includes itself: a.pbrt → a.pbrt"),
        ("NamedMaterial \"whit\" MakeNamedMaterial \"white\" \"string type\" \"diffuse\" Shape \"sphere\"".into(), "did you mean `white`?"),
        ("MakeNamedMaterial \"m\"".into(), "a.pbrt:2: a material has no `type`"),
        ("MakeNamedMaterial \"m\" \"string type\" \"mix\" \"string materials\" [\"m\" \"m\"] NamedMaterial \"m\" Shape \"sphere\"".into(), "contains itself"),
        ("Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"sphere\"".into(), "a.pbrt:2: there is no texture `t`"),
        ("Texture \"t\" \"spectrum\" \"scale\" \"texture tex\" \"t\" Material \"diffuse\" \"texture reflectance\" \"t\" Shape \"sphere\"".into(), "contains itself"),
        ("Texture \"t\" \"flaot\" \"constant\"".into(), "a.pbrt:2: a texture is of `flaot`"),
        ("Shape \"sphere\" \"float radius\" -1".into(), "a.pbrt:2: `radius` is -1; give a number above 0"),
        ("Shape \"sphere\" \"float radius\" []".into(), "a.pbrt:2: `radius` is not one number"),
        ("Shape \"sphere\" \"float radius\" [1 \"a\"]".into(), "a.pbrt:2: `radius` has numbers and texts"),
        ("Shape \"sphere\" \"float radius\" [1 2".into(), "a.pbrt:2: the parameter `radius` has no end"),
        ("Shape \"sphere\" \"radius\" 1".into(), "a.pbrt:2: `radius` is no parameter"),
        ("Shape \"sphere\" \"flaot radius\" 1".into(), "did you mean `float`?"),
        (format!("{mesh} \"integer indices\" [0 1 3]"), "a.pbrt:2: the index 3 is of none of 3 vertices"),
        (format!("{mesh} \"integer indices\" [0 1 -1]"), "a.pbrt:2: the index -1 is of none of 3 vertices"),
        (format!("{mesh} \"integer indices\" [0 1]"), "a.pbrt:2: there are 2 indices"),
        (format!("{mesh} \"normal N\" [0 0 1]"), "a.pbrt:2: there are 1 normals for 3 vertices"),
        (format!("{mesh} \"point2 uv\" [0 0 1]"), "there are 3 numbers of texture coordinates for 3 vertices"),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1]".into(), "a.pbrt:2: `P` has 4 numbers, which are no points"),
        ("Shape \"plymesh\"".into(), "a.pbrt:2: a `plymesh` has no `filename`"),
        ("LightSource \"point\" \"blackbody I\" 3".into(), "a.pbrt:2: the temperature is 3 K"),
        ("LightSource \"point\" \"spectrum I\" [400 1 300 1]".into(), "no list of pairs by growing wavelength"),
        ("Material \"conductor\" \"spectrum eta\" \"metal-Ag-etta\" Shape \"sphere\"".into(), "did you mean `metal-Ag-eta`?"),
        ("Attribute \"shap\" \"float radius\" 1".into(), "did you mean `shape`?"),
    ];
    for (body, words) in cases {
        let error = fault(&body);
        assert!(error.contains(words), "{body}\n{error}");
    }
}

#[test]
fn what_stands_before_the_world_is_told() {
    for (text, words) in [
        ("Camera \"perspective\"", "a.pbrt:1: the scene has no world"),
        ("\nShape \"sphere\"", "a.pbrt:2: `Shape` stands before `WorldBegin`"),
        ("WorldBegin Shape \"sphere\"", "a.pbrt:1: the scene has no camera"),
        ("Camera \"perspective\" \"float fov\" 180\nWorldBegin", "a.pbrt:1: the field of view is 180 degrees"),
        (
            "Camera \"perspective\"\nFilm \"rgb\" \"integer xresolution\" 0\nWorldBegin",
            "a.pbrt:2: the film's `xresolution` is 0",
        ),
        (
            "Camera \"perspective\"\nFilm \"rgb\" \"float cropwindow\" [1 1 0 1]\nWorldBegin",
            "a.pbrt:2: the film's crop holds no pixel",
        ),
        (
            "Camera \"perspective\"\nFilm \"rgb\" \"float iso\" 0\nWorldBegin",
            "a.pbrt:2: the film multiplies light by 0",
        ),
        ("Camera \"fisheye\"\nWorldBegin", "a camera `fisheye` is not supported"),
    ] {
        let folder = folder(&[("a.pbrt", text)]);
        let error = open(&folder).map(|translation| translation.text).expect_err(text);
        assert!(error.contains(words), "{text}\n{error}");
    }
}

#[test]
fn missing_files_are_told_of_at_once() {
    let body = "Shape \"plymesh\" \"string filename\" \"one.ply\"\nInclude \"two.pbrt\"\nLightSource \"infinite\" \"string filename\" \"sky.exr\"";
    let error = fault(body);
    assert!(
        error.starts_with(
            "a.pbrt:2: 3 files are not there: `one.ply` (line 2), `two.pbrt` (line 3), `sky.exr` (line 4)"
        ),
        "{error}"
    );
}

#[test]
fn attributes_are_bounded_and_materials_without_names_take_no_time() {
    let body: String = (0..257).map(|i| format!("Attribute \"shape\" \"float x{i}\" 1\n")).collect();
    assert!(fault(&body).starts_with("a.pbrt:258: more than 256 attributes are set of `shape`; set fewer"));
    let body = "Material \"diffuse\" Shape \"sphere\" ".repeat(20_000);
    let folder = folder(&[("a.pbrt", &format!("{CAMERA}\n{body}"))]);
    assert_eq!(open(&folder).unwrap().text.matches("[materials.").count(), 20_000);
}

#[test]
fn circles_of_files_are_told_with_all_of_them() {
    let text = format!("{CAMERA}\nInclude \"b.pbrt\"");
    let folder = folder(&[("a.pbrt", &text), ("b.pbrt", "\nInclude \"c.pbrt\""), ("c.pbrt", "Include \"b.pbrt\"")]);
    let error = open(&folder).map(|translation| translation.text).unwrap_err();
    assert!(error.contains("c.pbrt:1: a file includes itself: b.pbrt → c.pbrt → b.pbrt"), "{error}");
}

#[test]
fn a_million_begins_are_refused() {
    let error = fault(&"AttributeBegin\n".repeat(1_000_000));
    assert!(error.starts_with("a.pbrt:1002: attributes are nested more than 1000 deep"), "{error}");
    assert!(fault(&"[".repeat(1_000_000)).starts_with("a.pbrt:2: `[` stands where a directive should"));
    let list = format!("Shape \"sphere\" \"float radius\" {}", "[".repeat(1_000_000));
    assert!(fault(&list).starts_with("a.pbrt:2: `[` stands where a value of `radius` should"));
}

#[test]
fn instances_are_bounded() {
    let object = "ObjectBegin \"o\" Shape \"sphere\" ObjectEnd";
    let error = fault(&format!("{object}\n{}", "ObjectInstance \"o\"\n".repeat(500_001)));
    assert!(error.contains("more than 500000 instances"), "{error}");
}

#[test]
fn text_of_other_encodings_is_refused_with_its_line() {
    let folder = folder(&[]);
    std::fs::write(folder.path().join("a.pbrt"), b"# one\n# \xff\n").unwrap();
    let error = open(&folder).map(|translation| translation.text).unwrap_err();
    assert_eq!(error, "a.pbrt:2: the text is not UTF-8; save the file as UTF-8");
}

#[test]
fn an_error_of_the_scene_is_told_of_the_foreign_line() {
    let folder =
        folder(&[("a.pbrt", &format!("{CAMERA}\n\nMaterial \"dielectric\" \"float eta\" 1000\nShape \"sphere\""))]);
    let error = open(&folder).unwrap().read("a", folder.path(), None).unwrap_err().to_string();
    assert!(error.contains("a.pbrt:3: `materials.dielectric_line3.eta` is"), "{error}");
}

const WORDS: [&str; 34] = [
    "AttributeBegin",
    "AttributeEnd",
    "Shape",
    "Material",
    "\"sphere\"",
    "\"trianglemesh\"",
    "\"diffuse\"",
    "\"float radius\"",
    "[",
    "]",
    "1",
    "-2",
    "0",
    "1e30",
    "true",
    "\"mix\"",
    "\"string materials\"",
    "Transform",
    "Scale",
    "LightSource",
    "\"spot\"",
    "\"point3 P\"",
    "\"integer indices\"",
    "ObjectBegin",
    "ObjectEnd",
    "ObjectInstance",
    "Texture",
    "\"float\"",
    "\"checkerboard\"",
    "NamedMaterial",
    "Include",
    "\"a.pbrt\"",
    "WorldBegin",
    "#",
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn no_words_in_any_order_panic(words in prop::collection::vec(0..WORDS.len(), 0..40)) {
        let body: Vec<&str> = words.into_iter().map(|i| WORDS[i]).collect();
        let folder = folder(&[("a.pbrt", &format!("{CAMERA}\n{}\n", body.join(" ")))]);
        if let Ok(translation) = open(&folder) {
            _ = translation.read("a", folder.path(), None);
        }
    }

    #[test]
    fn no_bytes_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let folder = folder(&[]);
        std::fs::write(folder.path().join("a.pbrt"), bytes).unwrap();
        _ = open(&folder);
    }

    #[test]
    fn no_numbers_panic(numbers in prop::collection::vec(prop::num::f64::ANY, 16), kind in 0..8usize) {
        let n: Vec<String> = numbers.iter().map(|x| format!("{x:e}")).collect();
        let body = match kind {
            0 => format!("Transform [ {} ] Shape \"sphere\"", n.join(" ")),
            1 => format!("Scale {} {} {} Shape \"cylinder\"", n[0], n[1], n[2]),
            2 => format!("Shape \"sphere\" \"float radius\" {}", n[0]),
            3 => format!("Shape \"bilinearmesh\" \"point3 P\" [ {} ]", n[..12].join(" ")),
            4 => format!("LookAt {} Shape \"disk\"", n[..9].join(" ")),
            5 => format!("Shape \"sphere\" LightSource \"spot\" \"float coneangle\" {} \"float conedeltaangle\" {}", n[0], n[1]),
            6 => format!("Material \"conductor\" \"float roughness\" {} \"rgb reflectance\" [{} {} {}] Shape \"sphere\"", n[0], n[1], n[2], n[3]),
            _ => format!("AreaLightSource \"diffuse\" \"float power\" {} \"blackbody L\" {} Shape \"disk\"", n[0], n[1]),
        };
        let folder = folder(&[("a.pbrt", &format!("{CAMERA}\n{body}\n"))]);
        if let Ok(translation) = open(&folder) {
            _ = translation.read("a", folder.path(), None).map(|builder| builder.build(Skip::Unneeded));
        }
    }
}
