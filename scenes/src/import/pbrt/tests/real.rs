//! Scenes that others made, where they are to be had: `NEUMANN_SCENES` names their folder.

use std::path::PathBuf;

use super::*;

fn translated(name: &str) -> Option<(Translation, PathBuf)> {
    let scenes = std::env::var_os("NEUMANN_SCENES")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes"), PathBuf::from);
    let path = scenes.join(name);
    if !path.is_file() {
        eprintln!("skipped: {} is not there; NEUMANN_SCENES names the folder", path.display());
        return None;
    }
    let folder = path.parent().unwrap().to_path_buf();
    Some((translate(&path, &folder, "a").unwrap(), folder))
}

#[test]
fn the_cornell_box_is_exact() {
    let Some((translation, folder)) = translated("cornell-box/pbrt/scene-v4.pbrt") else { return };
    assert_eq!(notes(&translation, NoteKind::Approximated), Vec::<String>::new());
    let scene = translation.read("a", &folder, None).unwrap().build(Skip::Unneeded).unwrap();
    assert_eq!((scene.counts().emitters, scene.counts().shapes), (1, 8));
    assert_eq!((scene.camera.width(), scene.camera.height(), scene.series.max_order), (64, 64, Some(4)));
    assert!(!translation.text.contains("mirrored"));
}

#[test]
fn veachs_plates_have_their_widths() {
    let Some((translation, folder)) = translated("veach-mis/pbrt/scene-v4.pbrt") else { return };
    let widths = ["alpha = 0.01\n", "alpha = 0.05\n", "alpha = 0.1\n", "alpha = 0.25\n"];
    assert!(widths.iter().all(|width| translation.text.contains(width)), "{}", translation.text);
    let scene = translation.read("a", &folder, None).unwrap().build(Skip::Unneeded).unwrap();
    assert_eq!((scene.counts().emitters, scene.counts().spheres, scene.series.max_order), (3, 3, Some(3)));
}

#[test]
fn water_and_coffee_are_read_back() {
    if let Some((translation, folder)) = translated("water-caustic/pbrt/scene-v4.pbrt") {
        let scene = translation.read("a", &folder, None).unwrap().build(Skip::Unneeded).unwrap();
        assert_eq!(scene.counts().emitters, 1);
    }
    let Some((translation, folder)) = translated("coffee/pbrt/scene-v4.pbrt") else { return };
    assert!(translation.text.contains("eta = [0.1291, 0.1246, 0.1512]"));
    let scene = translation.read("a", &folder, None).unwrap().build(Skip::Unneeded).unwrap();
    assert_eq!((scene.counts().emitters, scene.camera.width(), scene.camera.height()), (3, 800, 1000));
}
