//! Whatever ends a run, at whatever moment: what stood there before is intact, and the next run goes on to the same bits.

use super::*;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// An experiment of two methods.
const PLAIN: &str = "scenes = [\"cornell_box\"]\nspp = 240\nreplicates = 12\nmax_order = 2\nsize = [20, 20]\n\
    [[methods]]\nname = \"path\"\n[[methods]]\nname = \"bdpt\"\n\
    [convergence]\nsize = [8, 8]\ncheckpoints = [1, 4]\nreplicates = 32\n";
const RUN: [&str; 5] = ["run", "plain.toml", "--quiet", "--save-every", "0.01"];
/// Replicates of both methods, those of checkpoints included.
const REPLICATES: u64 = 2 * (12 + 2 * 32);

/// One with all the parts that an experiment has.
fn full() -> String {
    let integrals = "[integrals]\nsize = [2, 2]\ncheckpoints = [4, 16]\nreplicates = 32\n";
    PLAIN.replace("[\"cornell_box\"]", "[\"cornell_box\", \"furnace\"]") + integrals
}

/// All files below a folder but those of the states and the hidden ones, with what is in them.
fn results(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let names = files(folder).into_iter().map(|(name, _)| name);
    let ours = |name: &String| !name.starts_with('.') && !name.starts_with("state/") && !name.ends_with('/');
    names.filter(ours).map(|name| (name.clone(), std::fs::read(folder.join(&name)).unwrap())).collect()
}

/// Whether a quantity follows from what was drawn alone, and not from the clock.
fn is_timeless(quantity: &str) -> bool {
    let timed = ["seconds", "efficiency", "slope_seconds", "marginal_seconds", "marginal_efficiency"];
    !timed.contains(&quantity) && !quantity.starts_with("time_to_error")
}

/// The records without what takes time, and the images without the time that they took.
pub fn outcome(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let timeless = |text: &str| {
        let rows = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let rows = rows.filter(|row| is_timeless(row[9]));
        rows.map(|row| [&row[..8], &row[9..]].concat().join(",") + "\n").collect::<String>()
    };
    let told = |(name, bytes): (String, Vec<u8>)| match name.rsplit('.').next() {
        Some("csv") => Some((name, timeless(&text(&bytes)).into_bytes())),
        Some("exr") => Some((name, without_time(&bytes))),
        _ => None,
    };
    results(folder).into_iter().filter_map(told).collect()
}

pub fn start(folder: &Path, arguments: &[&str]) -> Child {
    command(folder, arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

/// What the folder of states looks like now: a change of it is a save.
fn look(results: &Path) -> Vec<(String, Option<std::time::SystemTime>)> {
    let entries = std::fs::read_dir(results.join("state")).into_iter().flatten().flatten();
    let mut seen: Vec<_> = entries
        .filter(|e| e.path().extension().is_some_and(|x| x == "state"))
        .map(|e| (e.file_name().into_string().unwrap(), e.metadata().and_then(|m| m.modified()).ok()))
        .collect();
    seen.sort();
    seen
}

/// Lets a run go on until it has saved so often and a little longer, or has ended.
pub fn after_saves(child: &mut Child, results: &Path, saves: u64, then: Duration) {
    let (mut seen, mut count) = (look(results), 0);
    let patience = Instant::now() + Duration::from_secs(120);
    while count < saves && child.try_wait().unwrap().is_none() {
        assert!(Instant::now() < patience, "the program saves nothing");
        std::thread::sleep(Duration::from_millis(1));
        let now = look(results);
        count += u64::from(now != seen);
        seen = now;
    }
    std::thread::sleep(then);
}

/// Numbers without rhyme or reason, but the same in every run of the test.
pub fn moments(seed: u64) -> impl FnMut(u64) -> u64 {
    let mut stream = sampling::rng::Stream::new(seed, 1);
    move |below| u64::from(stream.next_u32()) % below
}

pub fn resumed(folder: &Path) -> u64 {
    json(folder, "manifest.json")["renders"].as_array().unwrap().iter().map(|r| r["resumed"].as_u64().unwrap()).sum()
}

#[test]
fn a_run_that_is_killed_again_and_again_comes_to_the_same_bits() {
    let folder = folder_with(&[("plain.toml", &full())]);
    let [whole, killed] = ["whole", "killed"].map(|name| folder.path().join(name));
    succeed(folder.path(), &[&RUN[..], &["--out", "whole", "--threads", "1"]].concat());
    let mut moment = moments(11);
    for round in 0..8 {
        let mut child = start(folder.path(), &[&RUN[..], &["--out", "killed"]].concat());
        let (saves, then) = (if round == 0 { 0 } else { 1 + moment(6) }, Duration::from_millis(moment(40)));
        after_saves(&mut child, &killed, saves, then);
        match round {
            3 => drop(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap()),
            _ => child.kill().unwrap(),
        }
        child.wait().unwrap();
    }
    succeed(folder.path(), &[&RUN[..], &["--out", "killed"]].concat());
    assert!(resumed(&killed) > 0);
    let [expected, found] = [&whole, &killed].map(|folder| outcome(folder));
    assert_eq!(found.len(), 5, "four images and the records");
    for (expected, found) in expected.iter().zip(&found) {
        assert!(expected == found, "{} and {} differ", expected.0, found.0);
    }
    let left: Vec<String> = files(&killed).into_iter().map(|(name, _)| name).collect();
    assert!(!left.iter().any(|name| name.contains(".neumann") || name.ends_with(".tmp")), "{left:?}");
    assert_eq!(left.iter().filter(|name| name.ends_with(".state")).count(), 2 * 2 * 3 + 1);
}

#[test]
fn more_replicates_later_are_one_long_run_and_the_results_stand_until_it_ends() {
    let folder = folder_with(&[("plain.toml", PLAIN)]);
    let [short, long] = ["short", "long"].map(|name| folder.path().join(name));
    let more = |out| ["run", "plain.toml", "--quiet", "--replicates", "21", "--spp", "420", "--out", out];
    succeed(folder.path(), &more("long"));
    succeed(folder.path(), &[&RUN[..], &["--out", "short"]].concat());
    let (before, more) = (results(&short), more("short"));
    for saves in [1, 2] {
        let mut child = start(folder.path(), &[&more[..], &["--save-every", "0"]].concat());
        after_saves(&mut child, &short, saves, Duration::ZERO);
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(results(&short) == before, "a run that did not end changed the results");
    }
    // What has been rendered by now cannot be made less, nor anything else.
    let fewer = [&RUN[..], &["--out", "short"]].concat();
    let refuses = |arguments: &[&str], words: &[&str]| {
        let output = neumann(folder.path(), arguments);
        let message = text(&output.stderr);
        assert_eq!((output.status.code(), message.matches("error:").count()), (Some(2), 1), "{message}");
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
        assert!(results(&short) == before);
    };
    refuses(&fewer, &["replicates of path in cornell_box", "more than the 12", "--fresh"]);
    let others = [&RUN[..], &["--out", "short", "--replicates", "24"]].concat();
    refuses(&others, &["each replicate had 20 samples, now 10", "--spp 480 --replicates 24"]);
    succeed(folder.path(), &more);
    assert!(resumed(&short) > REPLICATES);
    assert!(outcome(&short) == outcome(&long));
    refused(folder.path(), &fewer, &["21 replicates, more than the 12", "--fresh"]);
    // From the beginning again, since that is asked for.
    succeed(folder.path(), &[&fewer[..], &["--fresh"]].concat());
    assert_eq!(resumed(&short), 0);
}

#[test]
fn a_budget_in_seconds_is_divided_once() {
    let folder = folder_with(&[("plain.toml", PLAIN)]);
    let run = [&RUN[..], &["--seconds", "0.05", "--out", "r"]].concat();
    let samples = || json(folder.path(), "r/manifest.json")["renders"][0]["samples_per_replicate"].clone();
    succeed(folder.path(), &run);
    let (first, before) = (samples(), outcome(&folder.path().join("r")));
    succeed(folder.path(), &run);
    assert_eq!(samples(), first);
    assert!(outcome(&folder.path().join("r")) == before);
    assert_eq!(resumed(&folder.path().join("r")), REPLICATES);
}

#[test]
fn a_folder_has_one_run_at_a_time() {
    let folder = folder_with(&[("plain.toml", PLAIN)]);
    let run = [&RUN[..], &["--out", "r"]].concat();
    let mut first = start(folder.path(), &[&run[..], &["--spp", "12000000"]].concat());
    let patience = Instant::now() + Duration::from_secs(60);
    while !folder.path().join("r/state").exists() {
        assert!(Instant::now() < patience, "the program never began");
        std::thread::sleep(Duration::from_millis(5));
    }
    let output = neumann(folder.path(), &run);
    let message = text(&output.stderr);
    assert_eq!((output.status.code(), message.matches("error:").count()), (Some(2), 1), "{message}");
    assert!(message.contains("r is being written by another run"), "{message}");
    assert!(message.contains(&format!("process {}", first.id())), "{message}");
    first.kill().unwrap();
    first.wait().unwrap();
    succeed(folder.path(), &[&run[..], &["--fresh"]].concat());
}

/// Runs with files of at most so many kilobytes: what is longer meets the error that a full disk gives.
fn with_little_room(folder: &Path, kilobytes: u32, arguments: &[&str]) -> Output {
    let script = format!("trap '' XFSZ; ulimit -f {}; exec \"$0\" \"$@\"", 2 * kilobytes);
    let mut shell = Command::new("sh");
    shell.current_dir(folder).args(["-c", &script, env!("CARGO_BIN_EXE_neumann")]).args(arguments);
    shell.output().unwrap()
}

#[test]
fn a_disk_without_room_costs_nothing_that_was_there() {
    let folder = folder_with(&[("plain.toml", PLAIN)]);
    let [whole, full] = ["whole", "full"].map(|name| folder.path().join(name));
    let run = |out, replicates, spp| {
        ["run", "plain.toml", "--quiet", "--size", "6x6", "--out", out, "--replicates", replicates, "--spp", spp]
    };
    succeed(folder.path(), &run("whole", "15", "300"));
    succeed(folder.path(), &run("full", "12", "240"));
    let (before, more) = (files(&full), run("full", "15", "300"));
    let failed = |kilobytes: u32, words: [&str; 3]| {
        let output = with_little_room(folder.path(), kilobytes, &more);
        let message = text(&output.stderr);
        assert_eq!((output.status.code(), message.matches("error:").count()), (Some(2), 1), "{message}");
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    };
    // There is no room for a state of the images.
    failed(10, ["cornell_box-path-image", "File too large", "make room"]);
    let now: Vec<_> = files(&full).into_iter().filter(|(name, _)| name != "state/run.json").collect();
    assert!(now == before, "{now:?} {before:?}");
    let results_before = results(&full);
    // There is for the states, but not for all results.
    let largest = files(&full).iter().filter(|(name, _)| name.ends_with(".state")).map(|f| f.1).max().unwrap();
    // (A state of three replicates more is longer by some hundred bytes.)
    failed(largest as u32 / 1024 + 2, ["full", "File too large", "all that was rendered is kept"]);
    assert!(results(&full) == results_before);
    succeed(folder.path(), &more);
    assert!(outcome(&full) == outcome(&whole));
    assert_eq!(resumed(&full), REPLICATES + 2 * 3);
}

#[test]
fn an_image_without_room_leaves_the_one_before() {
    let folder = folder_with(&[]);
    let render =
        |seed| ["render", "cornell_box", "--quiet", "--size", "32x32", "--spp", "4", "--seed", seed, "-o", "image.exr"];
    succeed(folder.path(), &render("1"));
    let before = files(folder.path());
    let output = with_little_room(folder.path(), 4, &render("2"));
    let message = text(&output.stderr);
    assert_eq!((output.status.code(), message.matches("error:").count()), (Some(2), 1), "{message}");
    assert!(message.contains("image.exr") && message.contains("File too large"), "{message}");
    assert!(files(folder.path()) == before);
}

#[test]
fn a_folder_that_cannot_be_written_is_named() {
    let folder = folder_with(&[("plain.toml", PLAIN)]);
    refused(folder.path(), &[&RUN[..], &["--out", "/proc/neumann"]].concat(), &["/proc/neumann", "name a folder"]);
    let shut = folder.path().join("shut");
    std::fs::create_dir(&shut).unwrap();
    std::fs::set_permissions(&shut, std::os::unix::fs::PermissionsExt::from_mode(0o555)).unwrap();
    // Who is root may write anywhere.
    if std::fs::write(shut.join("probe"), "").is_ok() {
        println!("skipped: who runs this test may write anywhere");
    } else {
        refused(folder.path(), &[&RUN[..], &["--out", "shut"]].concat(), &["shut", "denied", "name a folder"]);
    }
}

#[test]
fn damaged_states_are_rendered_anew() {
    let folder = folder_with(&[("plain.toml", PLAIN)]);
    let run = [&RUN[..], &["--out", "r"]].concat();
    succeed(folder.path(), &run);
    let path = folder.path().join("r");
    let before = outcome(&path);
    let states: Vec<String> =
        files(&path).into_iter().map(|(name, _)| name).filter(|n| n.ends_with(".state")).collect();
    for (i, state) in states.iter().enumerate() {
        let mut bytes = std::fs::read(path.join(state)).unwrap();
        match i % 2 {
            0 => bytes.truncate(bytes.len() / 2),
            _ => bytes[100] ^= 1,
        }
        std::fs::write(path.join(state), bytes).unwrap();
    }
    let output = neumann(folder.path(), &run);
    let warnings = text(&output.stderr);
    assert_eq!((output.status.code(), warnings.matches("is damaged").count()), (Some(0), states.len()), "{warnings}");
    assert!(states.iter().all(|state| warnings.contains(state.as_str())), "{warnings}");
    assert!(outcome(&path) == before);
    assert!(!files(&path).iter().any(|(name, _)| name.ends_with(".damaged")));
}

#[test]
fn a_clock_that_went_back_changes_nothing() {
    let folder = folder_with(&[("plain.toml", PLAIN)]);
    let [whole, late] = ["whole", "late"].map(|name| folder.path().join(name));
    succeed(folder.path(), &[&RUN[..], &["--out", "whole"]].concat());
    let mut child = start(folder.path(), &[&RUN[..], &["--out", "late"]].concat());
    after_saves(&mut child, &late, 2, Duration::ZERO);
    child.kill().unwrap();
    child.wait().unwrap();
    // Whatever was written then, the lock of the run that was killed included, is of next year now.
    let next_year = std::time::SystemTime::now() + Duration::from_secs(365 * 86_400);
    let mut written = 0;
    for (name, _) in files(&late).iter().filter(|(name, _)| !name.ends_with('/')) {
        std::fs::File::options().append(true).open(late.join(name)).unwrap().set_modified(next_year).unwrap();
        written += 1;
    }
    assert!(written > 1);
    succeed(folder.path(), &[&RUN[..], &["--out", "late"]].concat());
    assert!(resumed(&late) > 0 && outcome(&late) == outcome(&whole));
}
