//! Cameras, films, filters and the length of the series.

use super::*;

fn scene(head: &str) -> toml::Table {
    let text =
        format!("{head}\nWorldBegin Shape \"sphere\" AreaLightSource \"diffuse\" Translate 0 3 0 Shape \"disk\"");
    let folder = folder(&[("a.pbrt", text.as_str())]);
    let translation = open(&folder).unwrap();
    translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap();
    table(&translation)
}

fn camera(head: &str) -> toml::Table {
    scene(head)["camera"].as_table().unwrap().clone()
}

#[test]
fn a_frame_of_a_left_hand_is_mirrored_where_it_does_not_turn_the_world_over() {
    // The Cornell box's: its z is turned over, at z = 6.8, towards −z.
    let plain = camera("Transform [ 1 -0 -0 -0 -0 1 -0 -0 -0 -0 -1 -0 -0 -1 6.8 1 ] Camera \"perspective\"");
    assert_eq!(vector(&plain["position"]), [0.0, 1.0, 6.8]);
    let (target, up) = (vector(&plain["target"]), vector(&plain["up"]));
    assert!(target[0] == 0.0 && target[1] == 1.0 && target[2] < 0.0 && up == [0.0, 1.0, 0.0], "{target:?} {up:?}");
    assert!(!plain.contains_key("mirrored"));
    // +x is on the right of an image without a transform, and +z ahead: a mirrored image of our world.
    let bare = camera("Camera \"perspective\"");
    assert_eq!((vector(&bare["target"]), bare["mirrored"].as_bool()), (vec![0.0, 0.0, 1.0], Some(true)));
    let look = camera("LookAt 0 1 6.8 0 1 0 0 1 0 Camera \"perspective\"");
    let position = vector(&look["position"]);
    assert!(position.iter().zip([0.0, 1.0, 6.8]).all(|(a, b)| (a - b).abs() < 1e-12));
    assert_eq!(look["mirrored"].as_bool(), Some(true));
    // The usual way to see a right-handed world.
    let usual = camera("Scale -1 1 1 LookAt 0 1 6.8 0 1 0 0 1 0 Camera \"perspective\"");
    assert!(!usual.contains_key("mirrored"));
}

#[test]
fn fields_of_view_lie_along_the_shorter_side() {
    let fov = |more: &str| camera(&format!("Camera \"perspective\" {more}"))["fov"].as_float().unwrap();
    assert_eq!(fov(""), 90.0);
    assert_eq!(fov("\"float fov\" 40"), 40.0);
    assert_eq!(fov("\"float halffov\" 15"), 30.0);
}

#[test]
fn windows_lenses_and_crops() {
    let film = "Film \"rgb\" \"integer xresolution\" 200 \"integer yresolution\" 100 \"float cropwindow\" [.25 .5 0 1]";
    let lens = camera(&format!(
        "Scale .5 .5 .5 Camera \"perspective\" \"float lensradius\" .1 \"float focaldistance\" 3 \
         \"float screenwindow\" [-1 3 -.5 1.5] {film}"
    ));
    assert_eq!((lens["type"].as_str(), lens["lens_radius"].as_float()), (Some("thin_lens"), Some(0.2)));
    assert_eq!((lens["focus_distance"].as_float(), vector(&lens["shift"])), (Some(6.0), vec![0.25, 0.25]));
    let whole: Vec<i64> = lens["crop"].as_array().unwrap().iter().map(|x| x.as_integer().unwrap()).collect();
    assert_eq!(whole, [50, 0, 50, 100]);
    let flat = camera(&format!("Camera \"orthographic\" \"float screenwindow\" [-4 4 -2 2] {film}"));
    assert_eq!((flat["type"].as_str(), flat["extent"].as_float()), (Some("orthographic"), Some(4.0)));
    let bounds = "Film \"rgb\" \"integer pixelbounds\" [10 20 30 50]";
    let crop = camera(&format!("Camera \"perspective\" {bounds}"))["crop"].clone();
    assert_eq!(crop.to_string(), "[10, 30, 10, 20]");
}

#[test]
fn a_spherical_camera_has_minus_x_in_its_middle() {
    let round = camera("Camera \"spherical\" \"string mapping\" \"equirectangular\"");
    assert_eq!(round["type"].as_str(), Some("equirectangular"));
    assert_eq!((vector(&round["target"]), round.get("mirrored")), (vec![-1.0, 0.0, 0.0], None));
    let mirrored = camera("Scale 1 1 -1 Camera \"spherical\" \"string mapping\" \"equirectangular\"");
    assert_eq!(mirrored["mirrored"].as_bool(), Some(true));
}

#[test]
fn filters_and_exposure() {
    let filter = |text: &str| camera(&format!("Camera \"perspective\" {text}"))["filter"].as_str().unwrap().to_string();
    assert_eq!(filter(""), "gaussian");
    assert_eq!(filter("PixelFilter \"triangle\" \"float xradius\" 1 \"float yradius\" 1"), "triangle");
    assert_eq!(filter("PixelFilter \"box\""), "box");
    let bright = scene("Camera \"perspective\" \"float shutterclose\" .5 Film \"rgb\" \"float iso\" 400");
    assert_eq!(bright["shapes"][1]["emission"].as_float(), Some(2.0));
    // Daylight of 5000 K is white on a film that is balanced for it.
    let balanced = scene("Camera \"perspective\" Film \"rgb\" \"float whitebalance\" 5000");
    let blueish = vector(&balanced["shapes"][1]["emission"]);
    assert!(blueish[0] < 0.9 && blueish[2] > 1.2, "{blueish:?}");
    let film = "Camera \"perspective\" Film \"rgb\" \"float whitebalance\" 5000 \"float iso\" 200";
    let text =
        format!("{film}\nWorldBegin AreaLightSource \"diffuse\" \"spectrum L\" \"stdillum-D50\" Shape \"sphere\"");
    let translation = open(&folder(&[("a.pbrt", text.as_str())])).unwrap();
    let white = vector(&table(&translation)["shapes"][0]["emission"]);
    assert!(white.iter().all(|c| (c - 2.0).abs() < 0.01), "{white:?}");
    assert_eq!(notes(&translation, NoteKind::Approximated).len(), 1);
}

#[test]
fn the_series_is_as_long_as_the_integrator_has_it() {
    let series = |integrator: &str| {
        let table = scene(&format!("{integrator} Camera \"perspective\""));
        (table.get("max_order").and_then(|k| k.as_integer()), table.get("tail").and_then(|tail| tail.as_bool()))
    };
    assert_eq!(series("Integrator \"path\" \"integer maxdepth\" 3"), (Some(3), None));
    assert_eq!(series("Integrator \"volpath\""), (Some(5), None));
    assert_eq!(series("Integrator \"path\" \"integer maxdepth\" 17"), (Some(17), None));
    assert_eq!(series("Integrator \"bdpt\" \"integer maxdepth\" 65"), (None, Some(true)));
    assert_eq!(series(""), (Some(5), None));
}
