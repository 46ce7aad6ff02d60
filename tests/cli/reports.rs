//! `neumann report`: the page of finished results, made again from what was rendered.

use super::durable::outcome;
use super::*;
use std::path::PathBuf;

/// An experiment with all that is kept in states: images, a reference, checkpoints, integrals, what a pilot has chosen.
const WHOLE: &str = "scenes = [\"cornell_box\", \"room.toml\"]\nspp = 8\nreplicates = 4\nmax_order = 2\nsize = [8, 8]\n\
    reference = { methods = [\"path\"], spp = 16 }\nmarginal_cost = true\n\
    [[methods]]\nname = \"path\"\n[[methods]]\nname = \"composite\"\n\
    [convergence]\nsize = [4, 4]\ncheckpoints = [1, 2]\nreplicates = 32\n\
    [integrals]\nsize = [2, 2]\ncheckpoints = [4, 16]\nreplicates = 32\n";

fn finished(text: &str) -> (TempDir, PathBuf) {
    let room = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/library/veach_mis.toml")).unwrap();
    let folder = folder_with(&[("whole.toml", text), ("room.toml", &room)]);
    succeed(folder.path(), &["run", "whole.toml", "--out", "out", "--quiet"]);
    let out = folder.path().join("out");
    (folder, out)
}

/// The page, but for the folder that scenes are named with where it is made elsewhere, and for the hash of all this.
fn told(folder: &Path, out: &Path) -> String {
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    let nonce = page.split("nonce=\"").nth(1).unwrap().split('"').next().unwrap().to_owned();
    page.replace(&nonce, "").replace(&format!("{}/", folder.display()), "")
}

fn states(out: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(out.join("state")).unwrap().map(|entry| entry.unwrap().path());
    let mut states: Vec<PathBuf> = entries.filter(|path| path.extension().is_some_and(|e| e == "state")).collect();
    states.sort();
    states
}

#[test]
fn a_report_is_made_again_from_anywhere_and_nothing_else_changes() {
    let (folder, out) = finished(WHOLE);
    let page = told(folder.path(), &out);
    let before = (outcome(&out), json(&out, "manifest.json"), files(&out));
    std::fs::remove_file(out.join("report.html")).unwrap();
    std::fs::remove_dir_all(out.join("plots")).unwrap();
    // Another build has other keys, and what it has rendered is a report all the same.
    for state in states(&out) {
        let name = state.file_name().unwrap().to_str().unwrap();
        let other = format!("{}00000000.state", &name[..name.len() - "00000000.state".len()]);
        std::fs::rename(&state, state.with_file_name(other)).unwrap();
    }
    let elsewhere = folder_with(&[]);
    let said = succeed(elsewhere.path(), &["report", out.to_str().unwrap()]);
    assert!(said.contains("report.html"), "{said}");
    assert!(told(folder.path(), &out) == page, "the page is another");
    assert!(outcome(&out) == before.0 && json(&out, "manifest.json") == before.1);
    let plots =
        |files: Vec<(String, u64)>| -> Vec<_> { files.into_iter().filter(|f| f.0.starts_with("plots/")).collect() };
    assert_eq!(plots(files(&out)), plots(before.2));
}

#[test]
fn folders_that_hold_no_finished_results_are_refused() {
    let (folder, out) = finished(WHOLE);
    let refuses = |words: &[&str]| refused(folder.path(), &["report", "out"], words);
    refused(folder.path(), &["report", "gone"], &["gone is no folder", "neumann run"]);
    refused(folder.path(), &["report", "."], &["holds no results", "neumann run"]);
    // A scene that was edited is another question.
    let room = std::fs::read_to_string(folder.path().join("room.toml")).unwrap();
    std::fs::write(folder.path().join("room.toml"), room.replace("fov = ", "fov = 1")).unwrap();
    refuses(&["scene room was edited"]);
    std::fs::write(folder.path().join("room.toml"), &room).unwrap();
    // What was rendered is damaged, or gone.
    let state = states(&out).remove(0);
    let bytes = std::fs::read(&state).unwrap();
    std::fs::write(&state, &bytes[..bytes.len() - 1]).unwrap();
    refuses(&[state.file_name().unwrap().to_str().unwrap(), "neumann run"]);
    std::fs::remove_file(&state).unwrap();
    refuses(&["lacks what was rendered of", "neumann run"]);
    let manifest = std::fs::read_to_string(out.join("manifest.json")).unwrap();
    std::fs::write(out.join("manifest.json"), manifest.replace("\"complete\": true", "\"complete\": false")).unwrap();
    refuses(&["has not ended"]);
}
