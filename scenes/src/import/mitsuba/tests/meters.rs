//! Sensors of a single pixel.

use super::*;

fn refused(scene: &str) -> String {
    let folder = folder(&[("a.xml", &format!("<scene version=\"3.0.0\">{scene}</scene>"))]);
    translate(&folder.path().join("a.xml"), folder.path(), "a").unwrap_err().to_string()
}

fn metered(scene: &str) -> Translation {
    let folder = folder(&[("a.xml", &format!("<scene version=\"3.0.0\">{scene}</scene>"))]);
    translate(&folder.path().join("a.xml"), folder.path(), "a").unwrap()
}

fn list(camera: &toml::Table, key: &str) -> Vec<f64> {
    camera[key].as_array().unwrap().iter().map(|x| x.as_float().unwrap()).collect()
}

const ONE: &str =
    "<film type=\"hdrfilm\"><integer name=\"width\" value=\"1\"/><integer name=\"height\" value=\"1\"/></film>";

#[test]
fn a_radiance_meter_is_one_ray() {
    let direct =
        "<point name=\"origin\" x=\"1\" y=\"2\" z=\"3\"/><vector name=\"direction\" x=\"0\" y=\"0\" z=\"-2\"/>";
    let lookat = "<transform name=\"to_world\"><lookat origin=\"1,2,3\" target=\"1,2,0\" up=\"0,1,0\"/></transform>";
    for stands in [direct, lookat] {
        let translation = metered(&format!(
            "<sensor type=\"radiancemeter\">{stands}{ONE}</sensor><shape type=\"sphere\"/><emitter type=\"constant\"/>"
        ));
        assert!(notes(&translation, NoteKind::Approximated)[0].contains("`light` shows nothing"));
        let scene = translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
        assert_eq!((scene.camera.width(), scene.camera.height(), scene.camera.name()), (1, 1, "orthographic"));
        let rays = [(0.01, 0.3), (0.97, 0.6)].map(|(x, y)| scene.camera.sample_we(vec2(x, y), Vec2::ZERO).ray);
        assert!(rays[0].o == rays[1].o && rays[0].d == rays[1].d && (rays[0].d + Vec3::Z).length() < 1e-6);
    }
    let wide = ONE.replace("\"1\"", "\"64\"");
    let text = refused(&format!("<sensor type=\"radiancemeter\">{wide}</sensor>"));
    assert!(text.contains("`width`") && text.contains("one pixel"), "{text}");
    let text = refused("<sensor type=\"radiancemeter\"><point name=\"origin\" x=\"1\"/></sensor>");
    assert!(text.contains("`origin`") && text.contains("give both"), "{text}");
}

#[test]
fn an_irradiance_meter_is_the_shape_that_holds_it() {
    let camera = |shape: &str, inside: &str| {
        let text = metered(&format!(
            "<shape type=\"{shape}\">{inside}<sensor type=\"irradiancemeter\">{ONE}</sensor></shape><emitter type=\"constant\"/>"
        ))
        .text;
        let table: toml::Table = text.parse().unwrap();
        table["camera"].as_table().unwrap().clone()
    };
    let placed = "<transform name=\"to_world\"><scale x=\"2\" y=\"3\"/><translate z=\"5\"/></transform>";
    let rectangle = camera("rectangle", placed);
    assert_eq!(rectangle["type"].as_str(), Some("irradiance"));
    assert_eq!((list(&rectangle, "rectangle"), list(&rectangle, "target")), (vec![4.0, 6.0], vec![0.0, 0.0, 6.0]));
    let turned = camera("rectangle", &format!("{placed}<boolean name=\"flip_normals\" value=\"true\"/>"));
    assert_eq!(list(&turned, "target"), [0.0, 0.0, 4.0]);
    // A map that mirrors along x leaves the normal of a rectangle where it was.
    let mirrored = camera("rectangle", "<transform name=\"to_world\"><scale x=\"-1\"/></transform>");
    assert_eq!(list(&mirrored, "target"), [0.0, 0.0, 1.0]);
    let disk = camera("disk", "<transform name=\"to_world\"><scale value=\"0.5\"/></transform>");
    assert_eq!(disk["disk"].as_float(), Some(0.5));
    let sphere =
        camera("sphere", "<float name=\"radius\" value=\"2\"/><point name=\"center\" x=\"1\" y=\"0\" z=\"0\"/>");
    assert_eq!((sphere["sphere"].as_float(), list(&sphere, "position")), (Some(2.0), vec![1.0, 0.0, 0.0]));
    let on = |shape: &str, inside: &str| {
        refused(&format!("<shape type=\"{shape}\">{inside}<sensor type=\"irradiancemeter\">{ONE}</sensor></shape>"))
    };
    assert!(on("cube", "").contains("a `rectangle`, a `disk` or a `sphere`"));
    assert!(on("disk", placed).contains("stretched"), "{}", on("disk", placed));
}
