//! References and what they judge, from outside: made, extended, read again, refused; and budgets that are errors.

use super::durable::{after_saves, moments, outcome, resumed, start};
use super::*;
use std::time::Duration;

/// Two methods, one of which misses orders, judged by a reference of two others.
const JUDGED: &str = "scenes = [\"cornell_box\"]\nspp = 64\nreplicates = 16\nmax_order = 2\nsize = [12, 10]\n\
    metrics = [\"mse\", \"bias2\", \"relmse\", \"smape\", \"flip\"]\n\
    [[methods]]\nname = \"direct\"\n[[methods]]\nname = \"path\"\n[reference]\nmethods = [\"path\", \"bdpt\"]\nspp = 64\nreplicates = 8\n";
const RUN: [&str; 5] = ["run", "judged.toml", "--quiet", "--save-every", "0.01"];
const REFERENCE: &str = "cornell_box_reference.exr";

/// The rows of a quantity: order, value and the interval's ends, by method.
fn rows(folder: &Path, method: &str, quantity: &str) -> Vec<(String, f64, f64, f64)> {
    let table = std::fs::read_to_string(folder.join("records.csv")).unwrap();
    let rows = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let number = |text: &str| text.parse().unwrap_or(f64::NAN);
    rows.filter(|row| row[2] == method && row[9] == quantity && row[10] == "all")
        .map(|row| (row[5].to_owned(), number(row[11]), number(row[12]), number(row[13])))
        .collect()
}

#[test]
fn a_reference_made_longer_is_one_made_at_once() {
    let folder = folder_with(&[("judged.toml", JUDGED)]);
    let [once, grown] = ["once", "grown"].map(|name| folder.path().join(name));
    let more = ["--set", "reference.spp=104", "--set", "reference.replicates=13"];
    succeed(folder.path(), &[&RUN[..], &["--out", "once"], &more].concat());
    succeed(folder.path(), &[&RUN[..], &["--out", "grown"]].concat());
    let short = std::fs::read(grown.join(REFERENCE)).unwrap();
    succeed(folder.path(), &[&RUN[..], &["--out", "grown"], &more].concat());
    // Pilots and both halves of two methods were there; images are judged anew by another reference.
    assert_eq!(resumed(&grown), 2 * 8 + 4 * 8);
    assert!(outcome(&grown) == outcome(&once));
    let long = std::fs::read(grown.join(REFERENCE)).unwrap();
    assert!(long == std::fs::read(once.join(REFERENCE)).unwrap() && long != short);
    // What has been rendered for it cannot be made less.
    let output = neumann(folder.path(), &[&RUN[..], &["--out", "grown"]].concat());
    let message = text(&output.stderr);
    assert!(
        output.status.code() == Some(2) && message.contains("for its reference, are rendered already"),
        "{message}"
    );
    assert!(message.contains("at least 13 of 8 samples") && outcome(&grown) == outcome(&once), "{message}");
}

#[test]
fn a_judged_run_that_is_killed_comes_to_the_same_bits_whenever_it_stops() {
    let until = "until = { order = \"all\", relative_error = 0.1 }\nmax_spp = 256\n";
    let folder = folder_with(&[("judged.toml", &format!("{until}{JUDGED}"))]);
    let [whole, killed] = ["whole", "killed"].map(|name| folder.path().join(name));
    succeed(folder.path(), &[&RUN[..], &["--out", "whole", "--threads", "1"]].concat());
    let mut moment = moments(5);
    for _ in 0..6 {
        let mut child = start(folder.path(), &[&RUN[..], &["--out", "killed"]].concat());
        after_saves(&mut child, &killed, 1 + moment(8), Duration::from_millis(moment(30)));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    succeed(folder.path(), &[&RUN[..], &["--out", "killed"]].concat());
    assert!(resumed(&killed) > 0);
    assert!(outcome(&whole) == outcome(&killed));
    // Whoever has not reached the target has all samples, and whoever has would not have needed fewer by much.
    for method in ["direct", "path"] {
        let bounds = rows(&whole, method, "sequential_error");
        assert_eq!(bounds.len(), if method == "direct" { 2 } else { 3 });
        let renders = json(&whole, "manifest.json")["renders"].clone();
        let of = |r: &&Value| r["label"] == method && r["what"] == "image";
        let replicates = renders.as_array().unwrap().iter().find(of).unwrap()["replicates"].as_u64().unwrap();
        let reached = bounds.iter().all(|row| row.1 <= 0.1);
        assert!(reached || replicates == 64, "{method}: {replicates} {bounds:?}");
        assert!(replicates >= 16);
    }
}

#[test]
fn a_reference_that_does_not_fit_is_refused_and_one_that_does_judges_alike() {
    let folder = folder_with(&[("judged.toml", JUDGED)]);
    succeed(folder.path(), &[&RUN[..], &["--out", "made"]].concat());
    succeed(folder.path(), &["-q", "render", "cornell_box", "--size", "12x10", "--spp", "8", "-o", "plain.exr"]);
    let file = format!("made/{REFERENCE}");
    let run = |rest: &[&'static str], file: &str| -> Vec<String> {
        let all = [&RUN[..], rest].concat();
        all.into_iter().map(str::to_owned).chain(["--out", "read", "--reference", file].map(str::to_owned)).collect()
    };
    let refuses = |rest: &[&'static str], file: &str, words: &[&str]| {
        let arguments = run(rest, file);
        refused(folder.path(), &arguments.iter().map(String::as_str).collect::<Vec<_>>(), words);
    };
    refuses(&["--size", "10x10"], &file, &[REFERENCE, "12x10", "10x10", "--size 12x10"]);
    refuses(&["--set", "scenes=[\"veach_mis\"]"], &file, &["is of cornell_box", "veach_mis"]);
    refuses(&["--max-order", "3"], &file, &["orders 0 to 2", "max_order = 2"]);
    refuses(&["--set", "tail=true"], &file, &["the tail", "tail = false"]);
    refuses(&[], "plain.exr", &["plain.exr", "no reference", "[reference]"]);
    refuses(&[], "gone.exr", &["gone.exr"]);
    let arguments = run(&[], &file);
    succeed(folder.path(), &arguments.iter().map(String::as_str).collect::<Vec<_>>());
    for (method, quantity) in
        [("path", "mse"), ("path", "bias2"), ("direct", "relmse"), ("path", "smape"), ("path", "flip")]
    {
        let [made, read] = ["made", "read"].map(|name| rows(&folder.path().join(name), method, quantity));
        assert_eq!(made.len(), if method == "direct" { 3 } else { 4 });
        // All that differs is that files have 32 bits a number.
        let scale = rows(&folder.path().join("made"), method, "mse")[0].1.max(made[0].1.abs());
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-5 * scale.max(a.abs());
        for (a, b) in made.iter().zip(&read) {
            assert!(a.0 == b.0 && near(a.1, b.1) && near(a.2, b.2) && near(a.3, b.3), "{quantity}: {a:?} {b:?}");
        }
    }
    // What it is for others: an image with the variance of each layer.
    let diff = succeed(folder.path(), &["diff", "plain.exr", &file]);
    assert!(diff.contains("order02") && !diff.contains("_half"), "{diff}");
}

/// Of many references with other seeds, the squared differences are on average what their own variances say: Student's test over pairs,
/// of an order and of the sum, which has a variance of its own; false-alarm rate 2·10⁻⁴.
#[test]
fn references_know_their_own_noise() {
    const PAIRS: usize = 8;
    let folder = folder_with(&[(
        "judged.toml",
        &JUDGED.replace("[12, 10]", "[8, 8]").replace("spp = 64\nreplicates = 16", "spp = 2\nreplicates = 2"),
    )]);
    let references: Vec<_> = (0..2 * PAIRS)
        .map(|seed| {
            let (seed, out) = (seed.to_string(), format!("r{seed}"));
            succeed(folder.path(), &["-q", "run", "judged.toml", "--seed", &seed, "--out", &out]);
            read_layers(&folder.path().join(out).join(REFERENCE)).unwrap()
        })
        .collect();
    for layer in ["order02", ""] {
        let excess = |pair: &[neumann::export::exr::LayeredImage]| {
            let of = |i: usize, name: &str| pair[i].layer(name).unwrap().pixels.as_flattened().to_vec();
            let variance = format!("{layer}_var");
            let noise: f32 = (0..2).flat_map(|i| of(i, &variance)).sum();
            let square: f32 = of(0, layer).iter().zip(of(1, layer)).map(|(a, b)| (a - b).powi(2)).sum();
            f64::from((square - noise) / noise)
        };
        let moments: sampling::moments::Moments = references.chunks(2).map(excess).collect();
        let t = moments.mean / moments.variance_of_mean().sqrt();
        // Student's quantile of 7 degrees of freedom at 5·10⁻⁵ on either side.
        println!("{layer:?}: squared differences exceed their noise by {:.3}, t = {t:.2}", moments.mean);
        assert!(t.abs() < 8.0, "{layer:?}: {moments:?}");
    }
}

/// Three methods are rendered until every pair of them would show a bias of that size.
#[test]
fn a_budget_can_be_the_bias_that_every_pair_would_show() {
    let methods = ["path", "light", "bdpt"].map(|name| format!("[[methods]]\nname = \"{name}\"\n")).concat();
    let experiment = "scenes = [\"cornell_box\"]\nspp = 64\nreplicates = 16\nmax_order = 2\nsize = [12, 10]\nmax_spp = 4096\n\
        until = { order = 1, detectable_bias = 0.1 }\n";
    let folder = folder_with(&[("biases.toml", &format!("{experiment}{methods}"))]);
    let run = ["run", "biases.toml", "--quiet", "--out"];
    succeed(folder.path(), &[&run[..], &["once", "--threads", "1"]].concat());
    let once = folder.path().join("once");
    let table = std::fs::read_to_string(once.join("records.csv")).unwrap();
    let bounds: Vec<Vec<&str>> = table
        .lines()
        .map(|line| line.split(',').collect())
        .filter(|row: &Vec<&str>| row[9] == "sequential_bias")
        .collect();
    assert_eq!(bounds.len(), 3, "{bounds:?}");
    let renders = json(&once, "manifest.json")["renders"].clone();
    let image = |r: &&Value| r["what"] == "image";
    let replicates: Vec<u64> =
        renders.as_array().unwrap().iter().filter(image).map(|r| r["replicates"].as_u64().unwrap()).collect();
    let samples = 64 / 16;
    assert!(replicates.len() == 3 && replicates.iter().all(|&n| n >= 16 && n * samples < 4096), "{replicates:?}");
    for bound in &bounds {
        let value: f64 = bound[11].parse().unwrap();
        assert!(value > 0.0 && value <= 0.1, "{bound:?}");
    }
    // Looser is there already; tighter goes on, and comes to what it would have come to at once.
    let tighter = ["--until", "detectable_bias=0.08,order=1"];
    succeed(folder.path(), &[&run[..], &["once"], &tighter].concat());
    succeed(folder.path(), &[&run[..], &["tight"], &tighter].concat());
    assert!(outcome(&once) == outcome(&folder.path().join("tight")) && resumed(&once) > 0);
}
