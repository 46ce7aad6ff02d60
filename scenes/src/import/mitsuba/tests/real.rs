//! Scenes that others made, where they are to be had: `NEUMANN_SCENES` names their folder.

use std::path::PathBuf;

use super::*;

fn scene(name: &str) -> Option<PathBuf> {
    let scenes = std::env::var_os("NEUMANN_SCENES")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes"), PathBuf::from);
    let path = scenes.join(name);
    if !path.is_file() {
        eprintln!("skipped: {} is not there; NEUMANN_SCENES names the folder", path.display());
        return None;
    }
    Some(path)
}

fn translated(name: &str) -> Option<(Translation, PathBuf)> {
    let path = scene(name)?;
    let folder = path.parent().unwrap().to_path_buf();
    Some((translate(&path, &folder, "a").unwrap(), folder))
}

#[test]
fn the_cornell_box_is_exact_but_for_nothing() {
    let Some((translation, folder)) = translated("cornell-box/mitsuba/scene_v3.xml") else { return };
    // Of 65 orders the rest is without end.
    let approximated = notes(&translation, NoteKind::Approximated);
    assert_eq!(approximated, ["a `max_depth` of 65 is rendered as a series without end"]);
    let scene = translation.read("a", &folder, None).unwrap().build(Skip::Unneeded).unwrap();
    assert_eq!((scene.counts().emitters, scene.counts().shapes), (1, 8));
    assert_eq!((scene.camera.width(), scene.camera.height()), (1024, 1024));
}

#[test]
fn veachs_plates_keep_their_factor() {
    let Some((translation, folder)) = translated("veach-mis/mitsuba/scene_v3.xml") else { return };
    assert_eq!(notes(&translation, NoteKind::Approximated).len(), 1, "{:?}", translation.notes);
    assert_eq!(translation.text.matches("reflection = 0.3\n").count(), 4);
    let scene = translation.read("a", &folder, None).unwrap().build(Skip::Unneeded).unwrap();
    assert_eq!((scene.counts().emitters, scene.counts().spheres), (3, 3));
    assert_eq!(scene.series.max_order, Some(2));
}

#[test]
fn the_dialect_of_mitsuba_0_is_read() {
    let Some((translation, folder)) = translated("lajolla-cbox/cbox.xml") else { return };
    let scene = translation.read("a", &folder, None).unwrap().build(Skip::Unneeded).unwrap();
    assert_eq!((scene.counts().shapes, scene.counts().emitters), (8, 1));
    let table: toml::Table = translation.text.parse().unwrap();
    let albedo = |name: &str| -> Vec<f64> {
        table["materials"][format!("{name}_front")]["albedo"]
            .as_array()
            .unwrap()
            .iter()
            .map(|c| c.as_float().unwrap())
            .collect()
    };
    let (red, green) = (albedo("red"), albedo("green"));
    // The walls as Mitsuba 0.6 has them under light of equal energy, over the white of that light; daylight moves them a little.
    let near = |found: &[f64], known: [f64; 3]| found.iter().zip(known).all(|(a, b)| (a - b).abs() < 0.03);
    assert!(near(&red, [0.473, 0.045, 0.049]) && near(&green, [0.087, 0.399, 0.084]), "{red:?} {green:?}");
    let Some((translation, folder)) = translated("lajolla-veach-mi/mi.xml") else { return };
    let scene = translation.read("a", &folder, None).unwrap().build(Skip::Unneeded).unwrap();
    assert_eq!((scene.counts().spheres, scene.counts().emitters), (5, 5));
}

#[test]
fn the_scenes_of_ignis_are_translated() {
    for name in
        ["emissive-plane-scale", "emissive-plane", "env", "multilight", "plane", "point", "room", "sphere-light"]
    {
        let Some((translation, _)) = translated(&format!("ignis-eval/mitsuba/{name}.xml")) else { return };
        let table: toml::Table = translation.text.parse().unwrap();
        assert_eq!(table["camera"]["filter"].as_str(), Some("box"), "{name}");
        let order = if matches!(name, "env" | "plane") { 5 } else { 3 };
        assert_eq!(table["max_order"].as_integer(), Some(order), "{name}");
        let approximated = notes(&translation, NoteKind::Approximated);
        assert!(approximated.is_empty(), "{name}: {approximated:?}");
    }
}
