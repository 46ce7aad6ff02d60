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

/// The answer of a bench, in JSON.
fn json(arguments: &[&str]) -> Value {
    let folder = tempfile::tempdir().unwrap();
    serde_json::from_str(&succeed(folder.path(), &[&["bench"], arguments, &["--json"]].concat())).unwrap()
}

fn numbers<'a>(rows: &'a Value, of: &'a str) -> impl Iterator<Item = f64> + 'a {
    rows.as_array().unwrap().iter().map(move |row| row.pointer(of).unwrap().as_f64().unwrap())
}

#[test]
fn samples_are_timed_by_scene_and_method() {
    let of = ["samples", "furnace", "cornell_box", "-i", "path", "-i", "bdpt", "--set", "roulette=none"];
    let few = ["--size", "16x16", "--spp", "1", "--rounds", "2", "--max-order", "3"];
    let rows = json(&[&of[..], &few].concat());
    assert_eq!(rows.as_array().unwrap().len(), 4);
    assert!(numbers(&rows, "/nanoseconds_per_sample/median").all(|ns| ns > 1.0), "{rows}");
    assert_eq!(rows[3]["settings"]["roulette"], "none");
    // A camera ray, a bounce for each of three orders, and a segment to the emitter before each.
    assert!(rows[2]["rays_per_sample"].as_f64().unwrap() <= 7.0, "{rows}");
}

#[test]
fn time_is_measured_against_what_it_may_depend_on() {
    let few = ["-i", "path", "--rounds", "1", "--max-order", "1", "--size", "32x32"];
    let found =
        json(&[&["scaling", "threads", "triangles", "--threads", "2", "--triangles", "1e3"], &few[..]].concat());
    assert_eq!(numbers(&found["threads"], "/threads").collect::<Vec<_>>(), [1.0, 2.0]);
    assert_eq!(found["threads"][0]["efficiency"]["median"], 1.0);
    assert!(numbers(&found["threads"], "/merging").all(|part| (0.0..1.0).contains(&part)), "{found}");
    assert!(numbers(&found["triangles"], "/count").all(|count| (100.0..1100.0).contains(&count)), "{found}");
    assert!(found["samples"].is_null());
}

#[test]
fn processes_are_started_and_watched() {
    let rows = json(&["start", "furnace", "--triangles", "1000", "--rounds", "1"]);
    assert_eq!((rows[0]["scene"].as_str(), rows[1]["triangles"].as_u64()), (Some("furnace"), Some(924)));
    assert!(numbers(&rows, "/seconds/median").all(|seconds| seconds > 0.0), "{rows}");
}

#[test]
fn every_skip_has_its_row() {
    let rows = json(&["skips", "-i", "bdpt", "--rounds", "1", "--max-order", "2", "--size", "8x8"]);
    let skips = [
        "none",
        "environment",
        "textures",
        "masks",
        "connections",
        "subsurface",
        "emitter_choice",
        "emitter_hits",
        "lobe_choice",
        "camera_points",
        "bvh",
        "orders but 0",
        "orders but 1",
        "orders but 3-5",
        "layer groups",
        "layer strategies",
    ];
    for skip in skips {
        assert!(rows.as_array().unwrap().iter().any(|row| row["skip"] == skip), "{skip}");
    }
    assert!(numbers(&rows, "/ratio/median").all(|ratio| ratio > 0.0));
}

#[test]
fn errors_are_plotted_against_time() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = "bench error furnace -i path --size 8x8 --spp 4 --reference-spp 64 --rounds 2 --max-order 2 --out plots --quiet";
    let table = succeed(folder.path(), &arguments.split(' ').collect::<Vec<_>>());
    assert!(table.contains("relmse_without_worst"), "{table}");
    for file in ["furnace_mse.svg", "furnace_relmse_without_worst.svg"] {
        assert!(std::fs::read_to_string(folder.path().join("plots").join(file)).unwrap().contains("<svg"), "{file}");
    }
    let report: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("plots/error.json")).unwrap()).unwrap();
    assert_eq!(report["rows"].as_array().unwrap().len(), 4 * 3, "{report}");
}

#[test]
fn what_cannot_be_measured_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    refused(folder.path(), &["bench", "leaks", "--rays", "1.5"], &["whole number", "1e9"]);
    refused(folder.path(), &["bench", "rays", "no_such_scene"], &["no_such_scene"]);
    refused(
        folder.path(),
        &["bench", "samples", "furnace", "-i", "path", "--set", "bdpt.mis=power"],
        &["`bdpt`", "path"],
    );
    refused(folder.path(), &["bench", "samples", "furnace", "-i", "pth"], &["did you mean `path`"]);
    refused(folder.path(), &["bench", "scaling", "colours"], &["threads", "triangles"]);
    refused(folder.path(), &["bench", "start", "no_such_scene", "--triangles", "100"], &["no_such_scene"]);
}

#[test]
fn help_has_examples() {
    let folder = tempfile::tempdir().unwrap();
    for kind in ["rays", "leaks", "samples", "scaling", "start", "skips", "error"] {
        assert!(succeed(folder.path(), &["bench", kind, "--help"]).contains(&format!("neumann bench {kind}")));
    }
}
