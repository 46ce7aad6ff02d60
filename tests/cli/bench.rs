//! `neumann bench`: rays per second, and rays that get out.

use super::{refused, succeed};
use serde_json::Value;

#[test]
fn rays_are_measured_by_scene_and_kind_with_every_kernel() {
    let folder = tempfile::tempdir().unwrap();
    let rows: Value =
        serde_json::from_str(&succeed(folder.path(), &["bench", "rays", "cornell_box", "--json"])).unwrap();
    let rows = rows.as_array().unwrap();
    for kind in ["primary", "bounce", "shadow"] {
        let of_kind: Vec<&Value> = rows.iter().filter(|row| row["rays"] == kind).collect();
        assert!(of_kind.iter().any(|row| row["kernel"] == "portable" && row["relative"] == 1.0), "{rows:?}");
        assert!(of_kind.iter().all(|row| row["rays_per_second"].as_f64().unwrap() > 0.0), "{rows:?}");
    }
    let table = succeed(folder.path(), &["bench", "rays", "furnace"]);
    assert!(table.contains("Mray/s") && table.contains("portable"), "{table}");
}

#[test]
fn no_ray_gets_out_of_a_closed_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let said = succeed(folder.path(), &["bench", "leaks", "--rays", "1e5", "--seed", "3"]);
    assert!(said.lines().any(|line| line.starts_with("portable: 0 of ")), "{said}");
    assert!(said.lines().all(|line| line.contains(": 0 of ")), "{said}");
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    refused(folder.path(), &["bench", "leaks", "--rays", "1.5"], &["whole number", "1e9"]);
    refused(folder.path(), &["bench", "rays", "no_such_scene"], &["no_such_scene"]);
}

#[test]
fn help_has_examples() {
    let folder = tempfile::tempdir().unwrap();
    for kind in ["rays", "leaks"] {
        assert!(succeed(folder.path(), &["bench", kind, "--help"]).contains(&format!("neumann bench {kind}")));
    }
}
