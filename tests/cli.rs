//! The command line from outside: what it writes, what it says, and how it ends.

use neumann::export::exr::{read_layers, without_time};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

mod bad_input;
mod bench;
mod composite;
mod decompositions;
#[cfg(target_os = "linux")]
mod durable;
mod evidence;
mod figures;
mod foreign;
#[cfg(target_os = "linux")]
mod judged;
mod live;
mod records;
#[cfg(target_os = "linux")]
mod reports;
#[cfg(target_os = "linux")]
mod series;
#[cfg(target_os = "linux")]
mod shards;
mod signals;
#[cfg(target_os = "linux")]
mod submit;
#[cfg(target_os = "linux")]
mod threads;

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_neumann"));
    command.current_dir(folder).args(arguments);
    command
}

pub fn neumann(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs what must succeed; gives standard output.
pub fn succeed(folder: &Path, arguments: &[&str]) -> String {
    let output = neumann(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", text(&output.stderr));
    text(&output.stdout)
}

fn json(folder: &Path, file: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(folder.join(file)).unwrap()).unwrap()
}

/// Every file below a folder with its size.
fn files(folder: &Path) -> Vec<(String, u64)> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        if entry.file_type().unwrap().is_dir() {
            found.push((format!("{name}/"), 0));
            found.extend(files(&entry.path()).into_iter().map(|(inner, size)| (format!("{name}/{inner}"), size)));
        } else {
            found.push((name, entry.metadata().unwrap().len()));
        }
    }
    found.sort();
    found
}

pub fn folder_with(contents: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    contents.iter().for_each(|(name, text)| std::fs::write(folder.path().join(name), text).unwrap());
    folder
}

/// Bad input ends with status 2 and one message that holds all of `words`; nothing is written.
pub fn refused(folder: &Path, arguments: &[&str], words: &[&str]) {
    let before = files(folder);
    let output = neumann(folder, arguments);
    let message = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    let errors = message.lines().filter(|line| line.starts_with("error:")).count();
    assert_eq!(errors, 1, "{arguments:?}: {message}");
    assert!(!message.contains("panicked"), "{arguments:?}: {message}");
    for word in words {
        assert!(message.contains(word), "{arguments:?} should say `{word}`: {message}");
    }
    assert_eq!(files(folder), before, "{arguments:?} left something behind");
}

const ROOM: &str = r#"
[camera]
position = [0, 0, 3]
target = [0, 0, 0]
fov = 40
width = 8
height = 8
[materials.white]
type = "lambert"
albedo = 0.5
[[shapes]]
type = "quad"
origin = [-1, -1, 0]
edge_u = [2, 0, 0]
edge_v = [0, 2, 0]
material = "white"
[[emitters]]
type = "point"
position = [0, 0, 2]
intensity = 1
"#;

const EXPERIMENT: &str = "scenes = [\"furnace\"]\nspp = 8\nreplicates = 4\nmax_order = 2\nsize = [8, 8]\n\
    [[methods]]\nname = \"path\"\n[[methods]]\nname = \"bdpt\"\n\
    [convergence]\nsize = [4, 4]\ncheckpoints = [1, 2]\nreplicates = 32\n";

#[test]
fn a_render_leaves_an_image_and_statistics_in_the_form_of_the_contract() {
    let folder = folder_with(&[]);
    let render = ["render", "furnace", "-i", "bdpt", "--size", "8x6", "--spp", "8", "--max-order", "3", "--tail"];
    let options = [
        "--seed",
        "7",
        "--set",
        "bdpt.mis=balance",
        "--set",
        "roulette=local",
        "--layers",
        "orders,variance",
        "--stats",
        "s.json",
    ];
    succeed(folder.path(), &[&render[..], &options].concat());

    let s = json(folder.path(), "s.json");
    let keys: Vec<&str> = s.as_object().unwrap().keys().map(String::as_str).collect();
    let mut expected = [
        "neumann",
        "scene",
        "method",
        "settings",
        "width",
        "height",
        "crop",
        "max_order",
        "spp",
        "replicates",
        "seed",
        "sampler",
        "filter",
        "threads",
        "seconds",
        "rays",
        "bias",
        "camera_paths",
        "light_paths",
        "connections",
        "skipped",
        "invalid",
        "orders",
        "total",
        "missing_light",
        "peak_memory_bytes",
    ];
    expected.sort_unstable();
    let mut sorted = keys.clone();
    sorted.sort_unstable();
    assert_eq!(sorted, expected);
    assert_eq!((s["width"].as_u64(), s["height"].as_u64(), s["spp"].as_u64()), (Some(8), Some(6), Some(8)));
    assert_eq!((s["method"].as_str(), s["settings"]["mis"].as_str()), (Some("bdpt"), Some("balance")));
    assert_eq!((s["seed"].as_u64(), s["sampler"].as_str()), (Some(7), Some("sobol")));
    let orders = s["orders"].as_array().unwrap();
    assert_eq!(
        orders.iter().map(|o| o["order"].clone()).collect::<Vec<_>>(),
        [0.into(), 1.into(), 2.into(), 3.into(), Value::from("tail")]
    );
    assert_eq!(s["invalid"].as_array().unwrap().len(), 5);
    assert!(orders[1]["variance"][0].is_f64() && s["total"]["mean_se"][2].is_f64());
    assert_eq!(s["camera_paths"].as_u64(), Some(8 * 6 * 8));

    let image = read_layers(&folder.path().join("furnace_bdpt.exr")).unwrap();
    let names: Vec<&str> = image.layers.iter().map(|l| l.name.as_str()).collect();
    let expected = [
        "",
        "order00",
        "order00_var",
        "order01",
        "order01_var",
        "order02",
        "order02_var",
        "order03",
        "order03_var",
        "tail",
        "tail_var",
    ];
    assert_eq!(names, expected);
    assert_eq!((image.width, image.height), (8, 6));
    for pixel in 0..48 {
        let sum: f32 = names
            .iter()
            .zip(&image.layers)
            .filter(|(n, _)| !n.is_empty() && !n.ends_with("_var"))
            .map(|(_, l)| l.pixels[pixel][1])
            .sum();
        let beauty = image.layers[0].pixels[pixel][1];
        assert!((sum - beauty).abs() <= 1e-6 * beauty, "pixel {pixel}: {sum} {beauty}");
    }
    assert_eq!(files(folder.path()).len(), 2);
}

#[test]
fn one_replicate_has_no_variance_and_orders_may_be_chosen() {
    let folder = folder_with(&[("room.toml", ROOM)]);
    let render = ["render", "room.toml", "--spp", "3", "--replicates", "1", "--orders", "1,3", "--max-order", "3"];
    succeed(folder.path(), &[&render[..], &["-o", "x.exr", "--stats", "s.json", "--quiet"]].concat());
    let s = json(folder.path(), "s.json");
    let orders = s["orders"].as_array().unwrap();
    assert_eq!(orders.iter().map(|o| o["order"].as_u64().unwrap()).collect::<Vec<_>>(), [1, 3]);
    assert!(orders[0]["variance"].is_null() && orders[0]["mean_se"].is_null() && s["total"]["variance"].is_null());
    assert!(orders[0]["mean"][0].as_f64().unwrap() > 0.0);
    let image = read_layers(&folder.path().join("x.exr")).unwrap();
    assert_eq!(image.layers.iter().map(|l| l.name.as_str()).collect::<Vec<_>>(), ["", "order01", "order03"]);
    succeed(folder.path(), &["render", "room.toml", "--spp", "4", "--layers", "beauty", "-o", "b.exr"]);
    assert_eq!(read_layers(&folder.path().join("b.exr")).unwrap().layers.len(), 1);
}

#[test]
fn a_budget_in_seconds_is_kept_roughly_and_recorded_in_samples() {
    let folder = folder_with(&[]);
    succeed(folder.path(), &["render", "furnace", "--size", "4x4", "--seconds", "0.2", "--stats", "s.json"]);
    let s = json(folder.path(), "s.json");
    let spp = s["spp"].as_u64().unwrap();
    assert!(spp >= 4 && spp.is_multiple_of(4), "{spp} samples");
    // A machine busy with other tests may take several times as long as the pilot run promised.
    assert!(s["seconds"]["render"].as_f64().unwrap() < 20.0);
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let folder = folder_with(&[]);
    for method in ["direct", "path", "light", "bdpt"] {
        let run = |threads: &str| {
            let render =
                ["render", "cornell_box", "-i", method, "--size", "33x19", "--spp", "8", "--layers", "orders,variance"];
            succeed(
                folder.path(),
                &[&render[..], &["--threads", threads, "-o", "a.exr", "--stats", "s.json"]].concat(),
            );
            let stats = json(folder.path(), "s.json");
            assert_eq!(stats["threads"].to_string(), threads);
            let statistics =
                [&stats["orders"], &stats["total"], &stats["rays"], &stats["connections"]].map(Value::to_string);
            (without_time(&std::fs::read(folder.path().join("a.exr")).unwrap()), statistics)
        };
        assert!(run("1") == run("2"), "{method} depends on the number of threads");
    }
}

#[test]
fn lists_hold_every_name() {
    let folder = folder_with(&[]);
    let names = |kind: &str| -> Vec<String> {
        let listed = succeed(folder.path(), &["list", kind]);
        listed.lines().filter_map(|line| line.split_whitespace().next().map(str::to_owned)).collect()
    };
    assert_eq!(names("methods"), integrators::Methods::standard().names());
    assert_eq!(names("scenes"), scenes::builtin_names());
    let models: Vec<&str> = sampling::bsdf::Bsdf::MODELS.iter().map(|model| model.name).collect();
    assert_eq!(names("bsdfs"), models);
    let samplers: Vec<String> = sampling::sampler::SamplerKind::ALL.iter().map(ToString::to_string).collect();
    assert_eq!(names("samplers"), samplers);
    assert!(names("experiments").contains(&"comparison".to_owned()));
    let all = succeed(folder.path(), &["list"]);
    assert!(["methods", "scenes", "cornell_box", "lambert", "bdpt"].iter().all(|word| all.contains(word)));
}

#[test]
fn a_model_is_told_and_drawn() {
    let folder = folder_with(&[]);
    let told = succeed(
        folder.path(),
        &["bsdf", "rough_conductor", "--set", "alpha_x=0.05", "--set", "alpha_y=0.4", "-o", "x"],
    );
    assert!(
        ["directional albedo", "here 0.05", "scatters by glossy reflection"].iter().all(|w| told.contains(w)),
        "{told}"
    );
    let written: Vec<String> = files(&folder.path().join("x")).into_iter().map(|(name, _)| name).collect();
    assert_eq!(written, ["rough_conductor_ball.png", "rough_conductor_lobes.png", "rough_conductor_polar.svg"]);
}

#[test]
fn a_scene_is_described_in_words_and_in_json() {
    let folder = folder_with(&[]);
    let words = succeed(folder.path(), &["scene", "glass_caustic"]);
    assert!(
        ["delta lobes", "skipped", "camera             pinhole"].iter().all(|part| words.contains(part)),
        "{words}"
    );
    let described: Value =
        serde_json::from_str(&succeed(folder.path(), &["scene", "glass_caustic", "--json"])).unwrap();
    assert_eq!(described["needs"]["delta_lobes"], Value::Bool(true));
    let misses = described["methods"].as_array().unwrap().iter().find(|m| m["method"] == "light").unwrap();
    assert!(!misses["missing_light"].as_array().unwrap().is_empty());
}

#[test]
fn images_are_compared_layer_by_layer() {
    let folder = folder_with(&[("not.exr", "nothing")]);
    let render = |file: &str, seed: &str, size: &str| {
        let arguments = ["render", "cornell_box", "--max-order", "2", "--layers", "orders,variance", "--spp", "4"];
        succeed(folder.path(), &[&arguments[..], &["--size", size, "--seed", seed, "-o", file]].concat());
    };
    render("a.exr", "1", "8x8");
    render("b.exr", "2", "8x8");
    render("c.exr", "1", "8x4");
    let compare =
        |b: &str| -> Value { serde_json::from_str(&succeed(folder.path(), &["diff", "a.exr", b, "--json"])).unwrap() };
    let same = compare("a.exr");
    let layers = same["layers"].as_array().unwrap();
    assert_eq!(
        layers.iter().map(|l| l["layer"].as_str().unwrap()).collect::<Vec<_>>(),
        ["", "order00", "order01", "order02"]
    );
    assert!(layers.iter().all(|l| l["mse"] == 0.0 && l["bias"] == 0.0));
    let other = &compare("b.exr")["layers"][2];
    let (mse, noise) = (other["mse"].as_f64().unwrap(), other["noise"].as_f64().unwrap());
    assert!(mse > 0.0 && mse < 20.0 * noise, "{other}");
    assert!(succeed(folder.path(), &["diff", "a.exr", "b.exr"]).contains("order02"));
    refused(folder.path(), &["diff", "a.exr", "c.exr"], &["8x8", "8x4"]);
    refused(folder.path(), &["diff", "a.exr", "not.exr"], &["not.exr"]);
    refused(folder.path(), &["diff", "a.exr", "gone.exr"], &["gone.exr"]);
}

#[test]
fn a_crop_is_a_part_of_the_image_and_says_so() {
    let folder = folder_with(&[]);
    let render = [
        "render",
        "furnace",
        "-i",
        "light",
        "--size",
        "12x9",
        "--spp",
        "4",
        "--max-order",
        "1",
        "--filter",
        "mitchell",
    ];
    succeed(folder.path(), &[&render[..], &["-o", "whole.exr"]].concat());
    succeed(folder.path(), &[&render[..], &["-o", "part.exr", "--crop", "3,2,7,5", "--stats", "s.json"]].concat());
    let [whole, part] = ["whole.exr", "part.exr"].map(|name| read_layers(&folder.path().join(name)).unwrap());
    assert_eq!((part.width, part.height), (7, 5));
    for (a, b) in whole.layers.iter().zip(&part.layers) {
        for (i, pixel) in b.pixels.iter().enumerate() {
            assert_eq!(*pixel, a.pixels[(i / 7 + 2) * 12 + i % 7 + 3], "{} {i}", a.name);
        }
    }
    assert_eq!(part.attributes.get("neumann:filter").map(String::as_str), Some("mitchell"));
    let s = json(folder.path(), "s.json");
    assert_eq!((s["crop"].to_string().as_str(), s["filter"].as_str()), ("[3,2,7,5]", Some("mitchell")));
    // The windows of the header: an attribute is its name, its type, its length, and here four numbers.
    let bytes = std::fs::read(folder.path().join("part.exr")).unwrap();
    let window = |name: &str| {
        let key = [name.as_bytes(), b"\0box2i\0\x10\0\0\0"].concat();
        let at = bytes.windows(key.len()).position(|w| w == key).unwrap() + key.len();
        bytes[at..at + 16].chunks(4).map(|b| i32::from_le_bytes(b.try_into().unwrap())).collect::<Vec<_>>()
    };
    assert_eq!((window("dataWindow"), window("displayWindow")), (vec![3, 2, 9, 6], vec![0, 0, 11, 8]));
}

#[test]
fn results_of_another_configuration_are_kept_unless_told_otherwise() {
    let folder = folder_with(&[("tiny.toml", EXPERIMENT)]);
    let run = ["run", "tiny.toml", "--out", "r", "--set", "convergence.checkpoints=[1]"];
    succeed(folder.path(), &run);
    std::fs::write(folder.path().join("r/notes.txt"), "mine").unwrap();
    succeed(folder.path(), &run);
    let other = [&run[..], &["--seed", "1", "--set", "methods=[{name=\"path\"}]"]].concat();
    refused(folder.path(), &other, &["--fresh", "methods was"]);
    succeed(folder.path(), &[&other[..], &["--fresh"]].concat());
    let left: Vec<String> = files(&folder.path().join("r")).into_iter().map(|(name, _)| name).collect();
    assert!(left.contains(&"notes.txt".to_owned()) && left.contains(&"furnace/path.exr".to_owned()), "{left:?}");
    assert!(!left.contains(&"furnace/bdpt.exr".to_owned()), "{left:?}");
}
