//! Scenes that are wrong: one error with file and line and mend, or a note.

use proptest::prelude::*;

use super::*;

#[test]
fn errors_name_file_line_and_mend() {
    let cases = [
        ("<shape type=\"sphere\">", "a.xml:2: this is not valid XML"),
        (
            "<shape type=\"sphere\"><ref id=\"whit\"/></shape><bsdf type=\"diffuse\" id=\"white\"/>",
            "a.xml:2: there is no element `whit` to refer to; did you mean `white`?",
        ),
        (
            "<shape type=\"sphere\"><float name=\"radius\" value=\"NaN\"/></shape>",
            "a.xml:2: `radius` holds `NaN`; it must be a finite number",
        ),
        ("<shape type=\"sphere\"><float name=\"radius\" value=\"1e999\"/></shape>", "a.xml:2: `radius` holds `1e999`"),
        (
            "<shape type=\"sphere\"><float name=\"radius\" value=\"-1\"/></shape>",
            "a.xml:2: the radius is -1; give one above 0",
        ),
        (
            "<shape type=\"sphere\"><float name=\"radius\" value=\"$r\"/></shape>",
            "a.xml:2: there is no parameter `$r`; add `<default",
        ),
        (
            "<emitter type=\"point\"><transform name=\"to_world\"><scale x=\"0\"/></transform></emitter>",
            "a.xml:2: the transform flattens",
        ),
        (
            "<shape type=\"sphere\"><transform name=\"to_world\"><matrix value=\"1 2 3\"/></transform></shape>",
            "a.xml:2: the matrix has 3 numbers",
        ),
        (
            "<shape type=\"sphere\"><transform name=\"to_world\"><matrix value=\"1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1\"/></transform></shape>",
            "a.xml:2: the matrix is not affine",
        ),
        (
            "<shape type=\"sphere\"><transform name=\"to_world\"><rotate angle=\"3\"/></transform></shape>",
            "a.xml:2: `rotate` has no axis",
        ),
        (
            "<shape type=\"sphere\"><transform name=\"to_world\"><lookat origin=\"1 1 1\" target=\"1 1 1\"/></transform></shape>",
            "a.xml:2: `lookat` looks at where it stands",
        ),
        ("<shape type=\"sphere\" id=\"s\"/><shape type=\"sphere\" id=\"s\"/>", "a.xml:2: there are two elements `s`"),
        (
            "<shape type=\"sphere\"><bsdf type=\"diffuse\"><texture name=\"reflectance\" type=\"scale\" id=\"t\"><ref id=\"t\"/>\
             </texture></bsdf></shape>",
            "a.xml:2: `texture scale` contains itself",
        ),
        ("<shape type=\"merge\" id=\"t\"><ref id=\"t\"/></shape>", "a.xml:2: `shape merge` contains itself"),
        ("<include filename=\"nowhere.xml\"/>", "to include; paths start at the scene's folder"),
        ("<include filename=\"a.xml\"/>", "a file includes itself: "),
        ("<shape type=\"obj\"/>", "a.xml:2: `shape obj` has no `filename`"),
        ("<shape type=\"instance\"/>", "a.xml:2: `shape instance` refers to no `shapegroup`"),
        (
            "<shape type=\"sphere\"><bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"1 2\"/></bsdf></shape>",
            "give three numbers, or one",
        ),
        (
            "<shape type=\"sphere\"><bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"500:1, 400:1\"/></bsdf></shape>",
            "the wavelengths do not grow",
        ),
        (
            "<shape type=\"sphere\"><bsdf type=\"dielectric\"><string name=\"int_ior\" value=\"bk8\"/></bsdf></shape>",
            "did you mean `bk7`?",
        ),
        (
            "<shape type=\"sphere\"><bsdf type=\"twosided\" id=\"m\"><ref id=\"m\"/></bsdf></shape>",
            "a.xml:2: `bsdf twosided` contains itself",
        ),
        (
            "<shape type=\"sphere\"><bsdf type=\"blendbsdf\"/></shape>",
            "a.xml:2: `blendbsdf` has 0 materials for 1 weights",
        ),
        ("<sensor type=\"radiancemeter\"/>", ""),
    ];
    for (body, expected) in cases {
        if expected.is_empty() {
            continue;
        }
        let error = fault(body);
        assert!(error.contains(expected), "{body}: {error}");
        assert!(!error.contains('\n'), "{error}");
    }
}

#[test]
fn scenes_that_are_none() {
    let alone = |text: &[u8]| {
        let folder = folder(&[]);
        std::fs::write(folder.path().join("a.xml"), text).unwrap();
        open(&folder).unwrap_err().replace(&format!("{}/", folder.path().display()), "")
    };
    assert!(alone(b"").starts_with("a.xml:1: this is not valid XML"));
    assert!(alone(b"<scene version=\"3.0.0\">\n\xff</scene>").starts_with("a.xml:2: the text is not UTF-8"));
    assert!(alone(b"<mesh/>").contains("a.xml:1: the file holds a `mesh`"));
    assert!(alone(b"<scene version=\"three\"/>").contains("a.xml:1: the version is `three`"));
    assert!(alone(b"<scene version=\"3.0.0\"/>").contains("the scene has no shape that can be read"));
    let capital = made_of(
        "<shape type=\"Rectangle\"/><integrator type=\"path\"><integer name=\"max_depth\" value=\"65\"/></integrator>",
    );
    let error = capital.read("a", Path::new("."), None).unwrap_err().to_string();
    assert!(error.contains("no shape that can be read; a shape `Rectangle` is not known"), "{error}");
    let meter = b"<scene version=\"3.0.0\"><sensor type=\"hdistant\"/></scene>";
    assert!(alone(meter).contains("a sensor `hdistant` is not supported; use `perspective`"));
    let bomb = b"<!DOCTYPE s [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;\">]><scene version=\"3.0.0\">&b;</scene>";
    assert!(alone(bomb).contains("declares a document type"), "{}", alone(bomb));
    let text = format!("<scene version=\"3.0.0\">{SENSOR}</scene>");
    let folder = folder(&[("a.xml", &text)]);
    let error = open(&folder).unwrap().read("a", folder.path(), None).unwrap_err().to_string();
    assert!(error.contains("a.xml:1: the scene has no shape that can be read; add one"), "{error}");
}

#[test]
fn a_million_nested_elements_are_one_error() {
    let depth = 1_000_000;
    let text = format!("<scene version=\"3.0.0\">{}{}</scene>", "<a>".repeat(depth), "</a>".repeat(depth));
    let folder = folder(&[("a.xml", &text)]);
    let error = open(&folder).unwrap_err();
    assert!(error.contains("nested more than 64 deep"), "{error}");
    // Those that are never closed as well.
    let folder = super::folder(&[("a.xml", &text[..text.len() / 3])]);
    assert!(open(&folder).unwrap_err().contains("not valid XML"));
}

#[test]
fn parameters_that_repeat_one_another_end() {
    let mut text = "<scene version=\"3.0.0\"><default name=\"p0\" value=\"aaaaaaaaaaaaaaaa\"/>".to_string();
    for i in 1..12 {
        let doubled = format!("$p{}", i - 1).repeat(16);
        text += &format!("<default name=\"p{i}\" value=\"{doubled}\"/>");
    }
    let folder = folder(&[("a.xml", &(text + "</scene>"))]);
    assert!(open(&folder).unwrap_err().contains("attributes grow by more than 64 MB in all"));
}

#[test]
fn the_longest_parameter_counts() {
    let text = "<scene version=\"3.0.0\"><default name=\"a\" value=\"1\"/><default name=\"a_b\" value=\"2\"/>\
                <default name=\"a_c\" value=\"3\"/><x u=\"$a $a_b $a_bb $a_\" v=\"$b\"/></scene>";
    let folder = folder(&[("a.xml", text)]);
    assert!(open(&folder).unwrap_err().contains("there is no parameter `$b`"));
    let path = folder.path().join("a.xml");
    std::fs::write(&path, text.replace(" v=\"$b\"", "")).unwrap();
    assert_eq!(super::super::xml::read(&path).unwrap().root.children[0].attribute("u"), Some("1 2 2b 1_"));
}

#[test]
fn a_million_attributes_or_includes_are_one_error() {
    let attributes: String = (0..1_000_000).map(|i| format!(" a{i}=\"\"")).collect();
    let include = |name: &str| {
        format!("<scene version=\"3.0.0\">{}</scene>", format!("<include filename=\"{name}\"/>").repeat(100))
    };
    let empty = "<scene version=\"3.0.0\"/>";
    let text = format!("<scene version=\"3.0.0\">\n<shape{attributes}/></scene>");
    let error = open(&folder(&[("a.xml", &text)])).unwrap_err();
    assert!(error.contains("a.xml:2: an element has more than 4096 attributes"), "{error}");
    let files = [("a.xml", include("b.xml")), ("b.xml", include("c.xml")), ("c.xml", include("d.xml"))];
    let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (*name, text.as_str())).collect();
    let error = open(&folder(&[&files[..], &[("d.xml", empty)]].concat())).unwrap_err();
    assert!(error.contains("b.xml:1: too many files are included"), "{error}");
}

#[test]
fn many_names_take_no_time_and_many_folders_are_refused() {
    // Materials without an `id` are called by their line, which here is one.
    let body = "<shape type=\"sphere\"><bsdf type=\"diffuse\"/></shape>".repeat(20_000);
    assert_eq!(made_of(&body).text.matches("type = \"sided\"").count(), 20_000);
    let paths: String = (0..1001).map(|i| format!("<path value=\"{i}\"/>")).collect();
    let folder = folder(&[("a.xml", &format!("<scene version=\"3.0.0\">{paths}</scene>"))]);
    (0..1001).for_each(|i| std::fs::create_dir(folder.path().join(i.to_string())).unwrap());
    let error = open(&folder).unwrap_err();
    assert!(error.contains("a.xml:1: files are to be looked for in more than 1000 folders; put more"), "{error}");
    let error = fault("<path value=\"meshes\"/>");
    assert!(
        error.starts_with("a.xml:2: there is no folder ") && error.contains("meshes to look for files in"),
        "{error}"
    );
}

#[test]
fn all_missing_files_are_named_at_once() {
    let body = "<shape type=\"obj\"><string name=\"filename\" value=\"../none.obj\"/></shape>\n\
                <shape type=\"ply\"><string name=\"filename\" value=\"/nowhere/none.ply\"/></shape>\n\
                <emitter type=\"envmap\"><string name=\"filename\" value=\"none.exr\"/></emitter>";
    let error = fault(body);
    assert!(error.starts_with("a.xml:2: 3 files are not there: `../none.obj` (line 2), "), "{error}");
    assert!(error.contains("`/nowhere/none.ply` (line 3), `none.exr` (line 4)"), "{error}");
}

#[test]
fn files_that_include_one_another_are_told_by_their_chain() {
    let include = |name: &str| format!("<scene version=\"3.0.0\">\n<include filename=\"{name}\"/></scene>");
    let folder = folder(&[("a.xml", &include("b.xml")), ("b.xml", &include("c.xml")), ("c.xml", &include("b.xml"))]);
    let error = open(&folder).unwrap_err().replace(&format!("{}/", folder.path().display()), "");
    assert!(error.starts_with("c.xml:2: a file includes itself: a.xml → b.xml → c.xml → b.xml;"), "{error}");
}

/// A scene of many constructs.
fn rich() -> String {
    format!(
        "<scene version=\"0.6.0\"><default name=\"r\" value=\"1\"/>{SENSOR}<integrator type=\"path\">\
         <integer name=\"maxDepth\" value=\"5\"/></integrator><bsdf type=\"twosided\" id=\"m\"><bsdf type=\"roughconductor\">\
         <float name=\"alpha\" value=\"0.1\"/><spectrum name=\"eta\" value=\"400:0.2, 700:1\"/><string name=\"material\" value=\"none\"/>\
         <rgb name=\"specularReflectance\" value=\"0.3\"/></bsdf></bsdf><shape type=\"sphere\"><float name=\"radius\" value=\"$r\"/>\
         <transform name=\"toWorld\"><rotate y=\"1\" angle=\"30\"/><scale value=\"2\"/><matrix value=\"1 0 0 0 1 0 0 0 1\"/></transform>\
         <ref id=\"m\"/><emitter type=\"area\"><blackbody name=\"radiance\" temperature=\"5000K\" scale=\"2\"/></emitter></shape>\
         <shape type=\"cube\"><bsdf type=\"mask\"><texture name=\"opacity\" type=\"checkerboard\"><transform name=\"to_uv\">\
         <scale x=\"3\"/></transform></texture><bsdf type=\"phong\"/></bsdf></shape><shape type=\"shapegroup\" id=\"g\">\
         <shape type=\"rectangle\"/></shape><shape type=\"instance\"><ref id=\"g\"/></shape><emitter type=\"spot\"/></scene>"
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_mutation_panics(
        edits in prop::collection::vec((any::<prop::sample::Index>(), 0usize..12, 0usize..4, any::<u8>()), 1..6)
    ) {
        const WORDS: [&str; 12] =
            ["", "<", "/>", "\"", "$", "&#0;", "-1", "NaN", "1e400", "type", "</scene>", "<ref id=\"m\"/>"];
        let mut bytes = rich().into_bytes();
        for (place, word, removed, byte) in edits {
            let at = place.index(bytes.len());
            let end = (at + removed).min(bytes.len());
            let new: Vec<u8> = if word == 0 { vec![byte] } else { WORDS[word].bytes().collect() };
            bytes.splice(at..end, new);
        }
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.xml"), &bytes).unwrap();
        if let Ok(translation) = open(&folder) {
            // The text is TOML, whatever the scene said.
            prop_assert!(translation.text.parse::<toml::Table>().is_ok(), "{}", translation.text);
            _ = translation.read("a", folder.path(), None).map(|builder| builder.build(Skip::Unneeded));
        }
    }
}
