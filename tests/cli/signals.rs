//! Ctrl-C and SIGTERM, sent once the program listens to them.

use super::*;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

fn start(folder: &Path, arguments: &[&str]) -> Child {
    let child = command(folder, arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let listens = || {
        let status = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
        let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap_or("0").trim().to_owned();
        let wanted = 1 << 1 | 1 << 14;
        u64::from_str_radix(&mask, 16).unwrap() & wanted == wanted
    };
    let patience = Instant::now() + Duration::from_secs(60);
    while !listens() {
        assert!(Instant::now() < patience, "the program never listened to signals");
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

fn send(signal: &str, child: &Child) {
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
}

#[test]
fn the_replicate_at_work_is_finished_and_what_is_complete_is_written() {
    let folder = folder_with(&[("tiny.toml", EXPERIMENT)]);
    let render =
        ["render", "cornell_box", "--size", "16x16", "--spp", "4000000", "--replicates", "1000000", "-o", "a.exr"];
    for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
        let mut child = start(folder.path(), &render);
        send(signal, &child);
        assert_eq!(child.wait().unwrap().code(), Some(code));
        assert!(read_layers(&folder.path().join("a.exr")).unwrap().layer("order08").is_some());
    }
    let mut child = start(folder.path(), &["run", "tiny.toml", "--spp", "40000000", "--replicates", "1000000"]);
    send("-INT", &child);
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let manifest = json(&folder.path().join("results/tiny"), "manifest.json");
    assert_eq!(manifest["complete"].as_bool(), Some(false));
}

#[test]
fn a_second_signal_ends_at_once() {
    let folder = folder_with(&[]);
    let mut child = start(folder.path(), &["render", "cornell_box", "--spp", "4000000000", "-o", "a.exr"]);
    send("-INT", &child);
    // Two that wait are one.
    std::thread::sleep(Duration::from_millis(250));
    send("-INT", &child);
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(files(folder.path()).is_empty());
}
