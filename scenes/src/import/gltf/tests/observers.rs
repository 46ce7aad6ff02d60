//! Lights and cameras.

use super::*;

fn lit(light: Value, node: Value) -> Fixture {
    let mut fixture = Fixture::triangle(json!({}));
    fixture.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [light] } });
    let mut node = node;
    node["extensions"] = json!({ "KHR_lights_punctual": { "light": 0 } });
    fixture.root(node);
    fixture
}

#[test]
fn candela_and_lux_are_watts() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let down = json!({ "translation": [0, 2, 0], "rotation": [-half, 0, 0, half], "scale": [3, 3, 3] });
    let emitter = |light: Value| table(&lit(light, down.clone()).translated())["emitters"][0].clone();
    let sun = emitter(json!({ "type": "directional", "color": [1, 0.5, 0.25], "intensity": 4 }));
    assert_eq!((sun["type"].as_str(), vector(&sun["irradiance"])), (Some("directional"), vec![4.0, 2.0, 1.0]));
    let direction = vector(&sun["direction"]);
    assert!((direction[1] + 1.0).abs() < 1e-12 && direction[2].abs() < 1e-12, "{direction:?}");
    let point = emitter(json!({ "type": "point", "intensity": 7 }));
    assert_eq!((point["intensity"].as_float(), vector(&point["position"])), (Some(7.0), vec![0.0, 2.0, 0.0]));
    let angle = std::f64::consts::FRAC_PI_6;
    let spot = emitter(json!({ "type": "spot", "spot": { "outerConeAngle": angle, "innerConeAngle": angle / 2.0 } }));
    let degrees = |key: &str| spot[key].as_float().unwrap();
    assert!((degrees("cutoff") - 30.0).abs() < 1e-9 && (degrees("beam") - 15.0).abs() < 1e-9);
    assert_eq!((spot["falloff"].as_str(), spot["intensity"].as_float()), (Some("smooth"), Some(1.0)));
    let target = vector(&spot["target"]);
    assert!(target.iter().all(|x| x.abs() < 1e-12), "{target:?}");
}

#[test]
fn lights_that_are_dark_or_end_are_told() {
    let dark = lit(json!({ "type": "point", "intensity": 0 }), json!({})).translated();
    assert!(tells(&dark, NoteKind::Ignored, "a light of intensity 0"));
    assert_eq!(table(&dark)["emitters"][0]["type"].as_str(), Some("constant"));
    let near = lit(json!({ "type": "point", "range": 3 }), json!({})).translated();
    assert!(tells(&near, NoteKind::Approximated, "`range`"));
    for (light, words) in [
        (json!({ "type": "area" }), "light 0 has the type `area`; give directional, point or spot"),
        (json!({ "type": "spot" }), "light 0 is a spot without `spot`"),
        (json!({ "type": "spot", "spot": { "innerConeAngle": 1.0 } }), "light 0 has cones of 57.2"),
        (json!({ "type": "spot", "spot": { "outerConeAngle": 3.0 } }), "light 0 has cones of 0 and 171.8"),
        (json!({ "type": "point", "intensity": -1 }), "light 0 has a negative colour"),
        (json!({ "type": "point", "color": [1, 2] }), "light 0 cannot be read: invalid length 2"),
    ] {
        let error = lit(light, json!({})).fault();
        assert!(error.contains(words), "{error}");
    }
}

fn seen_by(camera: Value, node: Value) -> Fixture {
    let mut fixture = Fixture::triangle(json!({}));
    fixture.json["cameras"] = json!([camera]);
    let mut node = node;
    node["camera"] = json!(0);
    fixture.root(node);
    fixture
}

#[test]
fn cameras_look_along_minus_z() {
    let camera = |camera: Value, node: Value| table(&seen_by(camera, node).translated())["camera"].clone();
    let wide = json!({ "type": "perspective", "perspective": { "yfov": 1.0, "aspectRatio": 1.5, "znear": 0.1 } });
    let plain = camera(wide.clone(), json!({ "translation": [0, 0, 5] }));
    assert_eq!((vector(&plain["position"]), vector(&plain["target"])), (vec![0.0, 0.0, 5.0], vec![0.0, 0.0, 0.0]));
    assert_eq!((plain["width"].as_integer(), plain["height"].as_integer()), (Some(384), Some(256)));
    assert!((plain["fov"].as_float().unwrap() - 1f64.to_degrees()).abs() < 1e-12);
    // Ours spans the shorter side.
    let high = json!({ "type": "perspective", "perspective": { "yfov": 1.0, "aspectRatio": 0.5 } });
    let high = camera(high, json!({}));
    let expected = 2.0 * (0.5 * 0.5f64.tan()).atan().to_degrees();
    assert!((high["fov"].as_float().unwrap() - expected).abs() < 1e-12);
    assert_eq!((high["width"].as_integer(), high["height"].as_integer()), (Some(256), Some(512)));
    // Turned over about z by a scale, it is mirrored; +y is up.
    let turned = camera(wide, json!({ "scale": [-2, 2, 2], "rotation": [0, 1, 0, 0] }));
    assert_eq!(turned["mirrored"].as_bool(), Some(true));
    assert!((vector(&turned["target"])[2] - 1.0).abs() < 1e-12 && vector(&turned["up"])[1] == 1.0);
    let film = json!({ "type": "orthographic", "orthographic": { "xmag": 2, "ymag": 1, "znear": 0, "zfar": 9 } });
    let film = camera(film, json!({}));
    assert_eq!((film["type"].as_str(), film["extent"].as_float()), (Some("orthographic"), Some(2.0)));
    assert_eq!(film["width"].as_integer(), Some(512));
}

#[test]
fn the_first_camera_is_taken_and_without_one_the_meshes_are_shown() {
    let lens = json!({ "type": "perspective", "perspective": { "yfov": 1.0 } });
    let mut fixture = seen_by(lens.clone(), json!({ "translation": [0, 0, 5] }));
    fixture.push("cameras", lens);
    fixture.root(json!({ "camera": 1, "translation": [0, 0, 9] }));
    let translation = fixture.translated();
    assert_eq!(vector(&table(&translation)["camera"]["position"])[2], 5.0);
    assert!(tells(&translation, NoteKind::Ignored, "other cameras than the first"));
    let mut alone = Fixture::triangle(json!({}));
    alone.json["nodes"][0]["translation"] = json!([10, 0, 0]);
    let camera = table(&alone.translated())["camera"].clone();
    assert_eq!(vector(&camera["target"]), [10.5, 0.5, 0.0]);
    assert!(vector(&camera["position"])[2] > 1.0);
}

#[test]
fn cameras_that_see_nothing_are_refused() {
    for (camera, words) in [
        (
            json!({ "type": "perspective", "perspective": { "yfov": 4 } }),
            "camera 0 has a `yfov` of 4; give one above 0",
        ),
        (json!({ "type": "perspective" }), "camera 0 is of type `perspective`, which it does not describe"),
        (json!({ "type": "perspective", "perspective": { "yfov": 1, "aspectRatio": 0 } }), "0 times as wide as high"),
        (json!({ "type": "orthographic", "orthographic": { "xmag": 0, "ymag": 0 } }), "NaN times as wide as high"),
        (json!({ "type": "perspective", "perspective": {} }), "camera 0 cannot be read: missing field `yfov`"),
    ] {
        let error = seen_by(camera, json!({})).fault();
        assert!(error.starts_with("a.glb:1: ") && error.contains(words), "{error}");
    }
    let lens = json!({ "type": "perspective", "perspective": { "yfov": 1.0 } });
    assert!(seen_by(lens, json!({ "scale": [0, 0, 0] })).fault().contains("node 1 has a camera and no direction"));
}
