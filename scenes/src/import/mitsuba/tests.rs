//! Every construct: what it becomes, and that scene files may say so.

mod exact;
mod found;
mod hostile;
mod materials;
mod meters;
mod real;
mod relief;

use std::path::Path;

use tempfile::TempDir;

use sampling::{Vec2, Vec3, vec2};

use super::translate;
use crate::import::translation::{NoteKind, Translation};
use crate::needs::Skip;

const SENSOR: &str = "<sensor type=\"perspective\"><float name=\"fov\" value=\"40\"/><film type=\"hdrfilm\">\
     <integer name=\"width\" value=\"16\"/><integer name=\"height\" value=\"12\"/><rfilter type=\"box\"/></film>\
     <transform name=\"to_world\"><lookat origin=\"0,0,4\" target=\"0,0,0\" up=\"0,1,0\"/></transform></sensor>";

fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn open(folder: &TempDir) -> Result<Translation, String> {
    translate(&folder.path().join("a.xml"), folder.path(), "a").map_err(|error| error.to_string())
}

/// The translation of a scene of version 3 that holds this and a sensor.
fn made_of(body: &str) -> Translation {
    made_by("3.0.0", body, &[])
}

fn made_by(version: &str, body: &str, files: &[(&str, &str)]) -> Translation {
    let text = format!("<scene version=\"{version}\">{SENSOR}\n{body}</scene>");
    let folder = folder(&[&[("a.xml", text.as_str())], files].concat());
    open(&folder).unwrap()
}

/// The error of a scene that holds this, on its second line, and a sensor.
fn fault(body: &str) -> String {
    let folder = folder(&[("a.xml", &format!("<scene version=\"3.0.0\">{SENSOR}\n{body}</scene>"))]);
    let error = open(&folder).expect_err(body);
    error.replace(&format!("{}/", folder.path().display()), "")
}

fn notes(translation: &Translation, kind: NoteKind) -> Vec<String> {
    translation.notes.iter().filter(|note| note.kind == kind).map(|note| note.text.clone()).collect()
}

#[test]
fn shapes() {
    let matrix = "<transform name=\"to_world\"><scale x=\"2\"/><translate z=\"3\"/></transform>";
    let step = "{ matrix = [2.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 3.0, 0.0, 0.0, 0.0, 1.0] }";
    let shape = |text: &str| {
        let translation = made_of(text);
        let at = translation.text.find("[[shapes]]").unwrap();
        (translation.text[at..].trim().to_string(), translation)
    };
    let tail = format!("material = \"default\"\ntransform = [{step}]");
    let (text, _) = shape(&format!("<shape type=\"rectangle\">{matrix}</shape>"));
    let quad = "origin = [-1.0, -1.0, 0.0]\nedge_u = [2.0, 0.0, 0.0]\nedge_v = [0.0, 2.0, 0.0]";
    assert_eq!(text, format!("[[shapes]]\ntype = \"quad\"\n{quad}\n{tail}"));
    let (text, _) = shape(&format!("<shape type=\"disk\">{matrix}</shape>"));
    let disk = "center = [0.0, 0.0, 0.0]\nedge_u = [1.0, 0.0, 0.0]\nedge_v = [0.0, 1.0, 0.0]";
    assert_eq!(text, format!("[[shapes]]\ntype = \"disk\"\n{disk}\n{tail}"));
    let (text, _) = shape(
        "<shape type=\"sphere\"><point name=\"center\" x=\"1\"/><float name=\"radius\" value=\"2\"/>\
                           <boolean name=\"flip_normals\" value=\"true\"/></shape>",
    );
    let ball = "center = [1.0, 0.0, 0.0]\nradius = 2.0\nmaterial = \"default\"\nflip = true";
    assert_eq!(text, format!("[[shapes]]\ntype = \"sphere\"\n{ball}"));
    let (text, _) = shape("<shape type=\"cylinder\"><point name=\"p1\" value=\"0, 2, 0\"/></shape>");
    let tube = "from = [0.0, 0.0, 0.0]\nto = [0.0, 2.0, 0.0]\nradius = 1.0\nmaterial = \"default\"";
    assert_eq!(text, format!("[[shapes]]\ntype = \"cylinder\"\n{tube}"));
    let (text, translation) = shape(&format!("<shape type=\"sphere\">{matrix}</shape>"));
    assert!(text.contains("file = \"a_mesh001.obj\""));
    assert_eq!(translation.attachments.len(), 1);
    translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
    let (text, translation) = shape("<shape type=\"hair\"/><shape type=\"cube\"/>");
    assert!(text.starts_with("[[shapes]]\ntype = \"mesh\"\nvertices = ["), "{text}");
    assert!(notes(&translation, NoteKind::Approximated)[0].contains("`hair` is not known"));
    let scene = translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
    assert_eq!(scene.counts().triangles, 12);
}

#[test]
fn groups_are_kept_once_and_instances_place_them() {
    let group = "<shape type=\"shapegroup\" id=\"g\"><shape type=\"sphere\"/><shape type=\"rectangle\">\
                 <transform name=\"to_world\"><translate x=\"1\"/></transform></shape></shape>";
    let instance =
        "<shape type=\"instance\"><ref id=\"g\"/><transform name=\"to_world\"><translate y=\"5\"/></transform></shape>";
    let translation = made_of(&format!("{group}{instance}{instance}"));
    assert_eq!(translation.text.matches("[[groups.shapes]]").count(), 2);
    assert_eq!(translation.text.matches("type = \"instance\"\ngroup = \"g\"\ntransform").count(), 2);
    let scene = translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
    let counts = scene.counts();
    assert_eq!((counts.spheres, counts.triangles, counts.placed_triangles, counts.instances), (1, 2, 4, 2));
    // A group within a group, a lamp in it, and one that has nothing.
    let outer = "<shape type=\"shapegroup\" id=\"h\"><shape type=\"instance\"><ref id=\"g\"/></shape><shape type=\"instance\">\
                 <ref id=\"g\"/></shape><shape type=\"disk\"><emitter type=\"area\"/></shape></shape>\
                 <shape type=\"shapegroup\" id=\"e\"/><shape type=\"instance\"><ref id=\"e\"/></shape>";
    let translation = made_of(&format!("{outer}{group}{}{}", instance.replace("\"g\"", "\"h\""), instance));
    let noted = |kind, text: &str| notes(&translation, kind).iter().any(|note| note.contains(text));
    assert!(noted(NoteKind::Mapped, "that emits is copied") && noted(NoteKind::Approximated, "without shapes"));
    let scene = translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
    let counts = scene.counts();
    assert_eq!((counts.spheres, counts.disks, counts.instances, counts.emitters), (1, 1, 3, 1));
    let error = fault(&outer.replacen("\"g\"", "\"h\"", 1).replace("\"e\"/></shape>", "\"h\"/></shape>"));
    assert!(error.contains("contains itself"), "{error}");
}

#[test]
fn emitters() {
    let emitter = |text: &str| {
        let translation = made_of(&format!("<shape type=\"sphere\"/>{text}"));
        let at = translation.text.find("[[emitters]]").unwrap();
        translation.text[at..].trim().replace("[[emitters]]\n", "")
    };
    let at = "<transform name=\"to_world\"><lookat origin=\"0,2,0\" target=\"0,0,0\" up=\"0,0,1\"/></transform>";
    assert_eq!(
        emitter(&format!("<emitter type=\"point\"><rgb name=\"intensity\" value=\"1 2 3\"/>{at}</emitter>")),
        "type = \"point\"\nposition = [0.0, 2.0, 0.0]\nintensity = [1.0, 2.0, 3.0]"
    );
    let spot = format!("<emitter type=\"spot\"><rgb name=\"intensity\" value=\"4\"/>{at}</emitter>");
    assert_eq!(
        emitter(&spot),
        "type = \"spot\"\nposition = [0.0, 2.0, 0.0]\ntarget = [0.0, 1.0, 0.0]\nintensity = 4.0\ncutoff = 20.0\nbeam = 15.0"
    );
    let sun = "<emitter type=\"directional\"><vector name=\"direction\" x=\"0\" y=\"-2\" z=\"0\"/>\
               <rgb name=\"irradiance\" value=\"7\"/></emitter>";
    assert_eq!(emitter(sun), "type = \"directional\"\ndirection = [0.0, -1.0, 0.0]\nirradiance = 7.0");
    // White of equal energy.
    let sky = emitter("<emitter type=\"constant\"><spectrum name=\"radiance\" value=\"2\"/></emitter>");
    let table: toml::Table = sky.parse().unwrap();
    let radiance: Vec<f64> =
        table["radiance"].as_array().unwrap().iter().map(|c| c.as_float().unwrap() / 2.0).collect();
    assert!(radiance.iter().zip([1.205, 0.948, 0.909]).all(|(a, b)| (a - b).abs() < 1e-3), "{radiance:?}");
    let old = "<shape type=\"sphere\"/><emitter type=\"constant\"><spectrum name=\"radiance\" value=\"2\"/></emitter>";
    assert!(made_by("2.0.0", old, &[]).text.ends_with("radiance = 2.0\n"));
    let map = "<shape type=\"sphere\"/><emitter type=\"envmap\"><string name=\"filename\" value=\"sky.exr\"/>\
               <float name=\"scale\" value=\"3\"/></emitter>";
    let text = made_by("3.0.0", map, &[("sky.exr", "")]).text;
    let end = "type = \"environment\"\nimage = \"sky.exr\"\nmapping = \"equirectangular_to_poles\"\nscale = 3.0\n";
    assert!(text.ends_with(end), "{text}");
    let area = "<shape type=\"sphere\"><emitter type=\"area\"><rgb name=\"radiance\" value=\"5\"/></emitter></shape>";
    // What emits and has no material reflects nothing.
    assert!(made_of(area).text.ends_with("material = \"black\"\nemission = 5.0\n"));
    // Mitsuba 3.9 turns a sphere inside out that its transform mirrors.
    let mirrored = area.replace("<emitter", "<transform name=\"to_world\"><scale value=\"-1\"/></transform><emitter");
    assert!(made_of(&mirrored).text.contains("flip = true"), "{mirrored}");
    let none = made_of("<shape type=\"sphere\"/><emitter type=\"sunsky\"/>");
    assert!(notes(&none, NoteKind::Approximated)[0].contains("`sunsky` is not known"));
}

/// The camera's table of a scene with this sensor.
fn camera(sensor: &str) -> toml::Table {
    let text = format!("<scene version=\"3.0.0\">{sensor}<shape type=\"sphere\"/></scene>");
    let folder = folder(&[("a.xml", text.as_str())]);
    let translation = open(&folder).unwrap();
    let told = notes(&translation, NoteKind::Approximated);
    assert!(!told.iter().any(|note| note.contains("stretches")), "{told:?}");
    let table: toml::Table = translation.text.parse().unwrap();
    table["camera"].as_table().unwrap().clone()
}

fn film(width: u32, height: u32, more: &str) -> String {
    format!(
        "<film type=\"hdrfilm\"><integer name=\"width\" value=\"{width}\"/><integer name=\"height\" value=\"{height}\"/>\
         {more}</film>"
    )
}

#[test]
fn sensors_look_along_their_z_with_x_to_the_left() {
    let seen = |to_world: &str| {
        let to_world = format!("<transform name=\"to_world\">{to_world}</transform>");
        camera(&format!("<sensor type=\"perspective\"><float name=\"fov\" value=\"40\"/>{to_world}</sensor>"))
    };
    let vector = |table: &toml::Table, key: &str| -> Vec<f64> {
        table[key].as_array().unwrap().iter().map(|x| x.as_float().unwrap()).collect()
    };
    // The Cornell box's: at z = 6.8, towards −z.
    let plain = seen("<matrix value=\"-1 0 0 0 0 1 0 1 0 0 -1 6.8 0 0 0 1\"/>");
    assert_eq!(vector(&plain, "position"), [0.0, 1.0, 6.8]);
    assert_eq!((vector(&plain, "target"), vector(&plain, "up")), (vec![0.0, 1.0, 5.8], vec![0.0, 1.0, 0.0]));
    assert!(!plain.contains_key("mirrored"));
    let look = seen("<lookat origin=\"0,1,6.8\" target=\"0,1,0\" up=\"0,1,0\"/>");
    assert_eq!(look, plain);
    let mirrored = seen("<scale x=\"-1\"/><lookat origin=\"0,1,6.8\" target=\"0,1,0\" up=\"0,1,0\"/>");
    assert_eq!(mirrored["mirrored"].as_bool(), Some(true));
    // Without an `up` it is Mitsuba's own: this is what it says of such a sensor.
    let free = vector(&seen("<lookat origin=\"1,2,3\" target=\"4,0,1\"/>"), "up");
    let expected = [0.643511, 0.237659, 0.727607];
    assert!(free.iter().zip(expected).all(|(up, expected)| (up - expected).abs() < 1e-6), "{free:?}");
}

#[test]
fn fields_of_view_lie_along_the_shorter_side() {
    let fov = |axis: &str, width: u32, height: u32| {
        let axis = format!("<string name=\"fov_axis\" value=\"{axis}\"/><float name=\"fov\" value=\"60\"/>");
        let table = camera(&format!("<sensor type=\"perspective\">{axis}{}</sensor>", film(width, height, "")));
        table["fov"].as_float().unwrap()
    };
    assert_eq!((fov("x", 100, 200), fov("smaller", 200, 100), fov("y", 200, 100)), (60.0, 60.0, 60.0));
    let half = |fov: f64| (0.5 * fov.to_radians()).tan();
    assert!((half(fov("x", 200, 100)) - half(60.0) / 2.0).abs() < 1e-12);
    assert!((half(fov("larger", 200, 100)) - half(60.0) / 2.0).abs() < 1e-12);
    assert!((half(fov("diagonal", 400, 300)) - half(60.0) * 0.6).abs() < 1e-12);
    let focal = camera(&format!("<sensor type=\"perspective\">{}</sensor>", film(360, 240, "")));
    assert!((half(focal["fov"].as_float().unwrap()) - 12.0 / 50.0).abs() < 1e-12);
}

#[test]
fn lenses_crops_shifts_and_filters() {
    let crop = "<integer name=\"crop_offset_x\" value=\"10\"/><integer name=\"crop_width\" value=\"20\"/>\
                <integer name=\"crop_height\" value=\"25\"/><rfilter type=\"tent\"/>";
    let lens = format!(
        "<sensor type=\"thinlens\"><float name=\"fov\" value=\"40\"/><float name=\"aperture_radius\" value=\"0.1\"/>\
         <float name=\"focus_distance\" value=\"3\"/><float name=\"principal_point_offset_x\" value=\"0.5\"/>\
         <float name=\"principal_point_offset_y\" value=\"0.5\"/>{}</sensor>",
        film(40, 50, crop)
    );
    let table = camera(&lens);
    assert_eq!((table["type"].as_str(), table["lens_radius"].as_float()), (Some("thin_lens"), Some(0.1)));
    assert_eq!((table["focus_distance"].as_float(), table["filter"].as_str()), (Some(3.0), Some("triangle")));
    let whole: Vec<i64> = table["crop"].as_array().unwrap().iter().map(|x| x.as_integer().unwrap()).collect();
    assert_eq!(whole, [10, 0, 20, 25]);
    // Half of the whole film's width and height, to the right and down, whatever the crop (as Mitsuba 3.9 has it).
    let shift: Vec<f64> = table["shift"].as_array().unwrap().iter().map(|x| x.as_float().unwrap()).collect();
    assert_eq!(shift, [0.5, -0.5]);
    for scale in ["value=\"3\"", "x=\"3\" y=\"3\""] {
        let flat = camera(&format!(
            "<sensor type=\"orthographic\"><transform name=\"to_world\"><scale {scale}/></transform>{}</sensor>",
            film(200, 100, "")
        ));
        assert_eq!((flat["type"].as_str(), flat["extent"].as_float()), (Some("orthographic"), Some(3.0)));
    }
}

#[test]
fn the_series_is_as_long_as_the_integrator_has_it() {
    let series = |integrator: &str| {
        let text = made_of(&format!("{integrator}<shape type=\"sphere\"/>")).text;
        let table: toml::Table = text.parse().unwrap();
        (table.get("max_order").and_then(|k| k.as_integer()), table.get("tail").and_then(|tail| tail.as_bool()))
    };
    let path =
        |depth: &str| format!("<integrator type=\"path\"><integer name=\"max_depth\" value=\"{depth}\"/></integrator>");
    assert_eq!(series(&path("6")), (Some(5), None));
    assert_eq!(series(&path("1")), (Some(0), None));
    assert_eq!(series(&path("-1")), (None, Some(true)));
    assert_eq!((series(&path("21")), series(&path("22"))), ((Some(20), None), (None, Some(true))));
    assert_eq!(series("<integrator type=\"direct\"/>"), (Some(1), None));
    assert_eq!(series("<integrator type=\"my_own\"/>"), (None, Some(true)));
    assert_eq!(series(&format!("<integrator type=\"aov\">{}</integrator>", path("3"))), (Some(2), None));
}

#[test]
fn defaults_includes_references_and_aliases() {
    let main = format!(
        "<scene version=\"3.0.0\"><default name=\"r\" value=\"2\"/><default name=\"radius\" value=\"3\"/>\
         <default name=\"r\" value=\"9\"/>{SENSOR}<include filename=\"sub/parts.xml\"/><alias id=\"m\" as=\"n\"/>\
         <shape type=\"sphere\"><float name=\"radius\" value=\"$radius\"/><ref id=\"n\"/></shape>\
         <shape type=\"sphere\"><float name=\"radius\" value=\"$r.5\"/><ref name=\"bsdf\" id=\"m\"/></shape></scene>"
    );
    let folder = folder(&[("a.xml", &main)]);
    std::fs::create_dir(folder.path().join("sub")).unwrap();
    let parts = "<scene version=\"0.6.0\"><bsdf type=\"diffuse\" id=\"m\"><texture name=\"reflectance\" type=\"bitmap\">\
                 <string name=\"filename\" value=\"wood.png\"/><string name=\"wrapMode\" value=\"clamp\"/></texture></bsdf></scene>";
    std::fs::write(folder.path().join("sub/parts.xml"), parts).unwrap();
    std::fs::write(folder.path().join("sub/wood.png"), "").unwrap();
    let text = open(&folder).unwrap().text;
    assert!(text.contains("albedo = { image = \"sub/wood.png\", encoding = \"srgb\", wrap = \"clamp\" }"), "{text}");
    assert!(
        text.contains("radius = 3.0\nmaterial = \"m\"") && text.contains("radius = 2.5\nmaterial = \"m\""),
        "{text}"
    );
    assert_eq!(text.matches("[materials.").count(), 2, "its front and itself");
}

#[test]
fn what_nobody_asked_for_is_told_once() {
    let odd = "<shape type=\"sphere\"><float name=\"raduis\" value=\"3\"/></shape>";
    let translation = made_of(&format!("{odd}\n{odd}"));
    let ignored: Vec<String> = translation
        .notes
        .iter()
        .filter(|note| note.text.contains("raduis"))
        .map(|note| format!("{}: {} ({})", note.place.line, note.text, note.count))
        .collect();
    let text = "2: `raduis` of `shape sphere` is not known, and is left out: did you mean `radius`? (2)";
    assert_eq!(ignored, [text]);
    let twice = "<shape type=\"sphere\"><float name=\"radius\" value=\"1\"/><float name=\"radius\" value=\"2\"/>\
                 <bsdf type=\"diffuse\"/><bsdf type=\"plastic\"/></shape>";
    let told = notes(&made_of(twice), NoteKind::Approximated);
    assert!(
        told.iter().any(|note| note.contains("more than one `radius` in `shape sphere`: the last holds")),
        "{told:?}"
    );
    assert!(told.iter().any(|note| note.contains("`bsdf plastic` is the second of `shape sphere`")), "{told:?}");
    let medium = "<shape type=\"sphere\"><medium name=\"interior\" type=\"homogeneous\"/></shape>";
    let told = notes(&made_of(medium), NoteKind::Approximated).concat();
    assert!(told.contains("`medium homogeneous` is left out: light goes through it as through a vacuum"), "{told}");
    // What holds one, and nothing else, was a border between media before Mitsuba 2.
    assert!(made_of(medium).text.contains("material = \"default\""));
    let old =
        made_by("0.6.0", &format!("{medium}<shape type=\"disk\"><emitter type=\"area\"/></shape>{medium}"), &[]).text;
    let materials: Vec<&str> = old.lines().filter(|line| line.starts_with("material = ")).collect();
    assert_eq!(materials, ["material = \"none\"", "material = \"black\"", "material = \"none\""]);
    assert_eq!(old.matches("type = \"null\"").count(), 1);
}

#[test]
fn meshes_without_normals_are_smooth_where_that_shows() {
    let flat = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let roof = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nf 1 2 3\nf 2 4 3\n";
    let files = [("flat.obj", flat), ("roof.obj", roof)];
    let mesh = |name: &str, more: &str| {
        let shape = format!("<shape type=\"obj\"><string name=\"filename\" value=\"{name}\"/>{more}</shape>");
        made_by("3.0.0", &shape, &files)
    };
    assert!(mesh("flat.obj", "").attachments.is_empty());
    assert!(mesh("roof.obj", "<boolean name=\"face_normals\" value=\"true\"/>").attachments.is_empty());
    let smooth = mesh("roof.obj", "");
    assert_eq!(String::from_utf8_lossy(&smooth.attachments[0].bytes).matches("vn ").count(), 4);
    assert!(smooth.text.contains("file = \"a_mesh001.obj\""));
    smooth.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
    // Without normals, the front is where corners turn after the transform.
    let mirror = "<transform name=\"to_world\"><scale x=\"-1\"/></transform>";
    assert!(mesh("flat.obj", mirror).text.contains("flip = true"));
}

#[test]
fn serialized_meshes_become_files() {
    let folder = folder(&[]);
    std::fs::write(folder.path().join("m.serialized"), super::serialized::tests::file()).unwrap();
    let shape = "<shape type=\"serialized\"><string name=\"filename\" value=\"m.serialized\"/>\
                 <integer name=\"shape_index\" value=\"1\"/></shape>";
    std::fs::write(folder.path().join("a.xml"), format!("<scene version=\"3.0.0\">{SENSOR}{shape}</scene>")).unwrap();
    let translation = open(&folder).unwrap();
    let text = String::from_utf8_lossy(&translation.attachments[0].bytes);
    assert!(text.contains("v 1.0 0.0 5.0"), "{text}");
    translation.read("a", folder.path(), None).unwrap().build(Skip::Unneeded).unwrap();
}

#[test]
fn an_error_of_the_scene_is_told_of_the_foreign_line() {
    let folder = folder(&[(
        "a.xml",
        &format!(
            "<scene version=\"3.0.0\">{SENSOR}\n\n<shape type=\"sphere\">\n<bsdf type=\"dielectric\">\n<float name=\"int_ior\" value=\"1000\"/></bsdf></shape></scene>"
        ),
    )]);
    let translation = open(&folder).unwrap();
    let error = translation.read("a", folder.path(), None).unwrap_err().to_string();
    assert!(error.contains("a.xml:4: `materials.dielectric_line4.eta` is"), "{error}");
}

#[test]
fn a_scene_without_a_sensor_gets_one_that_shows_it() {
    let scene = |body: &str| open(&folder(&[("a.xml", &format!("<scene version=\"3.0.0\">{body}</scene>"))])).unwrap();
    let box_and_ball = "<shape type=\"cube\"><transform name=\"to_world\"><scale x=\"1\" y=\"2\" z=\"0.5\"/>\
                        <translate x=\"3\" y=\"1\" z=\"5\"/></transform></shape>\
                        <shape type=\"sphere\"><point name=\"center\" x=\"0\" y=\"0\" z=\"4\"/></shape>";
    let translation = scene(box_and_ball);
    // From (-1, -1, 3) to (4, 3, 5.5): 5 wide, and 2.5 / tan 22.5° away.
    let camera = translation.text.parse::<toml::Table>().unwrap()["camera"].clone();
    let position: Vec<f64> = camera["position"].as_array().unwrap().iter().map(|x| x.as_float().unwrap()).collect();
    let away = 3.0 - 2.5 / 22.5_f64.to_radians().tan();
    assert!(position.iter().zip([1.5, 1.0, away]).all(|(a, b)| (a - b).abs() < 1e-12), "{position:?}");
    let added = notes(&translation, NoteKind::Added);
    assert!(
        added[0].contains("it is lit by an environment") && added[1].contains("the file has no sensor"),
        "{added:?}"
    );
    let built = translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
    let seen = (0..96).filter(|i| {
        let raster = vec2((i % 12) as f32 + 0.5, (i / 12) as f32 + 0.5) * 64.0;
        built.intersect(&built.camera.sample_we(raster, vec2(0.5, 0.5)).ray).is_some()
    });
    assert!(seen.count() > 20 && built.environment.is_some());
    // What has a lamp keeps it, and what stands in groups counts.
    let lit = scene(
        "<shape type=\"shapegroup\" id=\"g\"><shape type=\"sphere\"/></shape>\
                     <shape type=\"instance\"><ref id=\"g\"/><transform name=\"to_world\"><translate x=\"9\"/></transform></shape>\
                     <emitter type=\"point\"><point name=\"position\" x=\"0\" y=\"5\" z=\"0\"/></emitter>",
    );
    assert_eq!(notes(&lit, NoteKind::Added).len(), 1);
    assert_eq!(lit.text.parse::<toml::Table>().unwrap()["camera"]["position"][0].as_float(), Some(9.0));
}
