//! Evidence about a scene: agreement of methods, sweeps of settings, and single paths traced again.

use super::{folder_with, json, neumann, refused, succeed, text};
use serde_json::Value;

#[test]
fn a_scene_is_verified_in_words_and_in_json() {
    let folder = folder_with(&[("room.toml", super::ROOM)]);
    let options =
        ["-q", "verify", "room.toml", "--size", "8x8", "--max-order", "2", "--spp", "64", "--replicates", "8"];
    let told = succeed(folder.path(), &options);
    assert!(told.contains("path – bdpt") && told.contains("No two methods differ in order 1: in each"), "{told}");
    assert!(told.contains("No method found any light in orders 0 and 2."), "{told}");
    let findings: Value = serde_json::from_str(&succeed(folder.path(), &[&options[..], &["--json"]].concat())).unwrap();
    assert_eq!((&findings[0]["holds"], &findings[0]["spp"]), (&Value::from(true), &Value::from(64)));
    let pairs = findings[0]["pairs"].as_array().unwrap();
    assert!(pairs.iter().any(|pair| pair["order"] == "1" && pair["detectable_bias"].is_f64()), "{pairs:?}");
    // The truth is one of the methods where it is known.
    let furnace =
        succeed(folder.path(), &["-q", "verify", "furnace", "--size", "4x4", "--max-order", "1", "--spp", "32"]);
    assert!(furnace.contains("bdpt – exact"), "{furnace}");
    assert!(furnace.contains("irradiance [W/m²] of orders 0 to 1 is that of the closed form by"), "{furnace}");
    let metered: Value = serde_json::from_str(&succeed(
        folder.path(),
        &["-q", "verify", "integrating_sphere", "--size", "4x4", "--max-order", "2", "--spp", "32", "--json"],
    ))
    .unwrap();
    let meters = metered[0]["meters"].as_array().unwrap();
    for method in ["path", "light", "bdpt"] {
        let own: Vec<&Value> = meters.iter().filter(|m| m["method"] == method).collect();
        assert!(own.len() == 3 && own.iter().all(|m| m["exact"].as_f64().unwrap() > 0.0), "{method}: {meters:?}");
    }
    assert_eq!(findings[0]["meters"], Value::Array(Vec::new()), "a room without a closed form");
    let stressed = succeed(folder.path(), &[&options[..], &["--stress"]].concat());
    assert!(stressed.contains("the same to the bit when it is 2^-20"), "{stressed}");
    refused(folder.path(), &["verify", "rom.toml"], &["rom.toml", "room.toml"]);
    refused(folder.path(), &["verify", "room.toml", "--spp", "100"], &["96 or 112"]);
}

#[test]
fn the_largest_contributions_of_an_experiment_can_be_traced_again() {
    let folder = folder_with(&[]);
    let options =
        ["-q", "run", "mis_heuristics", "--size", "8x8", "--spp", "4", "--replicates", "2", "--max-order", "2"];
    let scenes = [
        "--set",
        "scenes=[\"glass_caustic\"]",
        "--set",
        "path.mis=[\"power:3\", \"maximum\"]",
        "--set",
        "bdpt.mis=\"balance\"",
    ];
    succeed(folder.path(), &[&options[..], &scenes[..]].concat());
    let largest = json(folder.path(), "results/mis_heuristics/fireflies.json");
    let largest = largest.as_array().unwrap();
    let methods: Vec<&str> = largest.iter().map(|record| record["method"].as_str().unwrap()).collect();
    for label in ["path_mis_power_3", "path_mis_maximum", "bdpt"] {
        assert!(methods.contains(&label), "{label}: {methods:?}");
    }
    for record in largest.iter().step_by(7) {
        let words: Vec<&str> = record["replay"].as_str().unwrap().split_whitespace().skip(1).collect();
        let again: Value = serde_json::from_str(&succeed(folder.path(), &[&words[..], &["--json"]].concat())).unwrap();
        assert!(again.as_array().unwrap().contains(&record["path"]), "{record}");
        assert_eq!(record["path"]["order"].to_string(), record["layer"].as_str().unwrap());
    }
    let table = std::fs::read_to_string(folder.path().join("results/mis_heuristics/records.csv")).unwrap();
    let lines = std::fs::read_to_string(folder.path().join("results/mis_heuristics/records.jsonl")).unwrap();
    assert_eq!(table.lines().count(), lines.lines().count() + 1);
    assert!(lines.lines().all(|line| serde_json::from_str::<Value>(line).is_ok()));
    assert!(table.contains(",largest,"));
}

/// A point that is so bright, and so near to the floor that is looked at, that connections to it have no value in single precision.
const TOO_BRIGHT: &str = "[camera]\nposition = [0.0005, 0.001, 0]\ntarget = [0, 0, 0]\nfov = 2\nwidth = 4\nheight = 4\n\
    [materials.grey]\ntype = \"lambert\"\nalbedo = 0.9\n\
    [[shapes]]\ntype = \"quad\"\norigin = [-1, 0, 1]\nedge_u = [2, 0, 0]\nedge_v = [0, 0, -2]\nmaterial = \"grey\"\n\
    [[emitters]]\ntype = \"point\"\nposition = [0, 1e-5, 0]\nintensity = 1e30\n";

#[test]
fn what_is_not_finite_is_counted_kept_and_told() {
    let folder = folder_with(&[("bright.toml", TOO_BRIGHT)]);
    let budget = ["-q", "render", "bright.toml", "--spp", "8", "--max-order", "2", "-o", "a.exr", "--stats", "a.json"];
    let counted = |method: &str, options: &[&str]| {
        let output = neumann(folder.path(), &[&budget[..], &["-i", method], options].concat());
        let stats: Value = json(folder.path(), "a.json");
        let invalid: Vec<u64> = stats["invalid"].as_array().unwrap().iter().map(|n| n.as_u64().unwrap()).collect();
        (output.status.code(), text(&output.stderr), invalid)
    };
    for method in ["direct", "path", "light", "bdpt"] {
        let (status, told, invalid) = counted(method, &[]);
        assert!(invalid[1] > 0 && invalid[0] == 0 && invalid.get(2).is_none_or(|n| *n == 0), "{method}: {invalid:?}");
        assert_eq!(status, Some(1), "{method}: {told}");
        for word in [&format!("{} in order 1", invalid[1])[..], "non-finite", "--seed 0", "--allow-invalid"] {
            assert!(told.contains(word), "{method}: {told}");
        }
        let stats: Value = json(folder.path(), "a.json");
        let means = stats["orders"].as_array().unwrap().iter().chain([&stats["total"]]).map(|layer| &layer["mean"]);
        assert!(means.flat_map(|mean| mean.as_array().unwrap()).all(Value::is_f64), "{method}: {stats}");
        assert_eq!(counted(method, &["--allow-invalid"]), (Some(0), String::new(), invalid), "{method}");
    }
    // An experiment goes on, tells it in its status and report, and keeps what shows each again.
    let run = ["-q", "run", "comparison", "--set", "scenes=[\"bright.toml\"]", "--spp", "8", "--replicates", "2"];
    let run = [&run[..], &["--max-order", "2", "--out", "out"]].concat();
    assert_eq!(neumann(folder.path(), &run).status.code(), Some(1));
    let page = std::fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("non-finite samples, which are left out of every sum"));
    let kept = json(folder.path(), "out/fireflies.json");
    let kept = kept.as_array().unwrap().iter().find(|f| f["method"] == "bdpt" && f["size"].is_null()).unwrap();
    let replay: Vec<&str> = kept["replay"].as_str().unwrap().split(' ').skip(1).collect();
    let paths = succeed(folder.path(), &replay);
    assert!(paths.contains("inf") || paths.contains("NaN"), "{paths}");
    succeed(folder.path(), &[&run[..], &["--allow-invalid"]].concat());
}

#[test]
fn a_sample_that_is_not_there_cannot_be_replayed() {
    let folder = folder_with(&[]);
    let of = |rest: &[&'static str]| [&["replay", "cornell_box"], rest].concat();
    refused(folder.path(), &of(&["--pixel", "256,0"]), &["256,0", "256x256"]);
    refused(folder.path(), &of(&["--pixel", "0,0", "--sample", "16"]), &["--sample 16", "16 samples", "0 to 15"]);
    refused(folder.path(), &of(&["--pixel", "0,0", "--replicate", "4"]), &["--replicate 4", "0 to 3"]);
    assert!(text(&neumann(folder.path(), &of(&["--pixel", "0"])).stderr).contains("12,40"));
}

#[test]
fn an_experiment_may_take_its_images_apart() {
    let folder = folder_with(&[]);
    let options =
        ["-q", "run", "light_vs_path", "--size", "8x8", "--spp", "4", "--replicates", "2", "--max-order", "2"];
    let parts = ["scenes=[\"glass_caustic\"]", "layers=[\"strategies\", \"groups\"]", "lpe={caustics=\"C[DG]S+L\"}"];
    let parts: Vec<&str> = parts.iter().flat_map(|part| ["--set", part]).collect();
    succeed(folder.path(), &[&options[..], &parts[..]].concat());
    let results = folder.path().join("results/light_vs_path");
    let image = neumann::export::exr::read_layers(&results.join("glass_caustic/bdpt.exr")).unwrap();
    for layer in ["s02_t02_raw", "s02_t02_weight", "lpe_caustics_var", "order02"] {
        assert!(image.layer(layer).is_some(), "{layer}");
    }
    assert!(results.join("glass_caustic/bdpt_strategies.png").is_file());
    let table = std::fs::read_to_string(results.join("records.csv")).unwrap();
    assert!(table.contains(",lpe_caustics,") && table.contains(",s01_t02_raw,"));
    let refused_with = |change: &str, words: &[&str]| {
        let arguments = [&options[..], &["--out", "elsewhere", "--set", change]].concat();
        refused(folder.path(), &arguments, words);
    };
    refused_with("layers=[\"strategys\"]", &["did you mean `strategies`"]);
    refused_with("lpe={x=\"C[D\"}", &["lpe", "^"]);
}
