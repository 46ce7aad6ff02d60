//! Composites from outside: chosen by `run` and `render`, kept, and had again by naming their runs.

use super::*;

const SMALL: [&str; 9] =
    ["run", "best_per_order", "--set", "scenes=[\"cornell_box\"]", "--size", "24x24", "--spp", "64", "--replicates=8"];

#[test]
fn the_ready_experiment_says_who_does_what_and_what_that_has_gained() {
    let folder = tempfile::tempdir().unwrap();
    let told = succeed(folder.path(), &[&SMALL[..], &["--out", "r"]].concat());
    assert!(
        told.contains("cornell_box, composite: ") && told.contains("predicted") && told.contains("measured"),
        "{told}"
    );
    let records = std::fs::read_to_string(folder.path().join("r/records.csv")).unwrap();
    let quantities = |name: &str| records.lines().filter(|line| line.contains(name)).count();
    assert_eq!([",gain,", ",gain_predicted,", ",gain_with_pilots,"].map(quantities), [1, 1, 1]);
    assert!(quantities(",chosen:") >= 9, "an order has no run");
    let report = std::fs::read_to_string(folder.path().join("r/report.html")).unwrap();
    assert!(report.contains("The best method for every order") && report.contains("who does which orders"));
    // More replicates are of the same runs, whatever a pilot would choose today.
    let runs = |records: &str| -> Vec<String> {
        let of = |line: &str| line.split(',').find(|cell| cell.contains("runs=")).unwrap_or_default().to_owned();
        let mut all: Vec<String> = records.lines().filter(|line| line.contains("composite")).map(of).collect();
        all.dedup();
        all
    };
    let more = SMALL.map(|argument| match argument {
        "64" => "128",
        "--replicates=8" => "--replicates=16",
        other => other,
    });
    succeed(folder.path(), &[&more[..], &["--out", "r"]].concat());
    let later = std::fs::read_to_string(folder.path().join("r/records.csv")).unwrap();
    assert_eq!(runs(&records), runs(&later));
}

#[test]
fn a_render_tells_its_runs_and_the_same_runs_have_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let image = ["render", "veach_mis", "-i", "composite", "--size", "24x16", "--spp", "32", "--max-order", "3", "-o"];
    let told = succeed(folder.path(), &[&image[..], &["a.exr"]].concat());
    let runs = told.split('\'').find(|part| part.starts_with("runs=")).unwrap_or_else(|| panic!("{told}")).to_owned();
    succeed(folder.path(), &[&image[..], &["b.exr", "--set", &runs]].concat());
    let pixels = |name: &str| read_layers(&folder.path().join(name)).unwrap().layer("").unwrap().pixels.clone();
    assert!(pixels("a.exr") == pixels("b.exr"));
}

#[test]
fn what_cannot_be_composed_is_refused_with_the_mend() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |arguments: &[&str]| {
        let output = neumann(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
        text(&output.stderr)
    };
    let render = ["render", "cornell_box", "-i", "composite", "--size", "8x8", "--spp", "4"];
    let with = |runs: &str| refused(&[&render[..], &["--set", &format!("runs={runs}")]].concat());
    assert!(with("path:0-3:1").contains("no run estimates order 4"));
    assert!(with("path:0-8:1;vcm:0:1").contains("vcm cannot be a part"));
    assert!(with("path").contains("METHOD:ORDERS:SHARE"));
    assert!(refused(&[&render[..], &["--max-order", "auto"]].concat()).contains("name the last one"));
    // What no method carries is told of all orders at once.
    let glass = format!(
        "{FLOOR}[materials.glass]\ntype = \"dielectric\"\neta = 1.5\n[[shapes]]\ntype = \"sphere\"\ncenter = [0, 0, 0.5]\nradius = 0.3\n\
         material = \"glass\"\n[[emitters]]\ntype = \"point\"\nposition = [0, 0.5, 2]\nintensity = 1\n"
    );
    std::fs::write(folder.path().join("glass.toml"), glass).unwrap();
    let told = refused(&["render", "glass.toml", "-i", "composite", "--max-order", "4"]);
    assert!(told.contains("carries all light of order 1 to 4") && told.contains("LS.*E"), "{told}");
}

const FLOOR: &str = "[camera]\nposition = [0, 0, 3]\ntarget = [0, 0, 0]\nwidth = 8\nheight = 8\n[materials.grey]\ntype = \"lambert\"\nalbedo = 0.5\n\
                     [[shapes]]\ntype = \"quad\"\norigin = [-1, -1, 0]\nedge_u = [2, 0, 0]\nedge_v = [0, 2, 0]\nmaterial = \"grey\"\n";

/// Where nothing emits, nothing is gained: no number is told that is none.
#[test]
fn in_the_dark_no_gain_is_told() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("dark.toml"), FLOOR).unwrap();
    let experiment = ["run", "best_per_order", "--set", "scenes=[\"dark.toml\"]", "--set", METHODS];
    let size = ["--spp", "16", "--replicates", "4", "--max-order", "2", "--out", "out"];
    let output = neumann(folder.path(), &[&experiment[..], &size[..]].concat());
    let told = text(&output.stdout);
    assert!(output.status.success() && told.contains("dark, composite: ") && !told.contains("NaN"), "{told}");
    assert!(!std::fs::read_to_string(folder.path().join("out/records.csv")).unwrap().contains("gain"));
}

const METHODS: &str = "methods=[{name=\"composite\"},{name=\"light\"}]";
