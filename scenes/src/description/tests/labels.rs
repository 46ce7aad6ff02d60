use super::{CAMERA, WHITE, load};
use crate::labels::UNLABELLED;

/// Lines 1–3 camera, 4–6 material; the label is in line 9.
fn text(label: &str) -> String {
    let ball = format!(
        "[[shapes]]\ntype = \"sphere\"\nlabel = {label}\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"white\"\n"
    );
    let lamp = "emission = [1, 1, 1]\n";
    let other = "[[shapes]]\ntype = \"sphere\"\ncenter = [3, 0, 0]\nradius = 1\nmaterial = \"white\"\n";
    let point = "[[emitters]]\ntype = \"point\"\nposition = [0, 5, 0]\nintensity = 1\n";
    let sun = "[[emitters]]\ntype = \"directional\"\nlabel = \"key\"\ndirection = [0, -1, 0]\nirradiance = 1\n";
    format!("{CAMERA}{WHITE}{ball}{lamp}{other}{point}{sun}")
}

#[test]
fn surfaces_go_by_materials_and_labels_and_emitters_of_one_label_are_a_group() {
    let scene = load(&text("\"key\"")).unwrap();
    assert_eq!(scene.labels.surfaces(), [vec!["white", "key"], vec!["white"]]);
    let groups: Vec<_> = scene.labels.groups().into_iter().map(|group| (group.name, group.emitters.len())).collect();
    assert_eq!(groups, [("key".to_owned(), 2), (UNLABELLED.to_owned(), 1)]);
}

#[test]
fn labels_that_cannot_be_shown_are_refused() {
    for bad in ["\"\"", "3", "\"a\\nb\""] {
        let error = load(&text(bad)).err().unwrap().to_string();
        assert!(error.contains("test.toml:9") && error.contains("label"), "{error}");
    }
}
