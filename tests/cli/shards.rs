//! Any division of an experiment among processes, whatever ends these, has the bits of a run in one piece.

use super::durable::{moments, outcome, start};
use super::*;
use neumann::shards::ShardPlan;
use neumann::shards::file::{Look, Place, scan};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// An experiment with all the parts that one has, of two full groups of replicates and one that is not.
const ALL: &str = "scenes = [\"cornell_box\", \"furnace\"]\nspp = 40\nreplicates = 20\nmax_order = 2\nsize = [12, 10]\n\
    sampler = [\"independent\", \"sobol\"]\nmarginal_cost = true\nmetrics = [\"mse\", \"relmse\", \"smape\", \"flip\"]\n\
    [[methods]]\nname = \"path\"\n[[methods]]\nname = \"bdpt\"\n\
    [reference]\nspp = 40\nreplicates = 10\n\
    [convergence]\nsize = [8, 8]\ncheckpoints = [1, 4]\nreplicates = 32\n\
    [integrals]\nsize = [2, 2]\ncheckpoints = [4, 16]\nreplicates = 32\n";
/// A plain one.
pub const PLAIN: &str = "scenes = [\"cornell_box\"]\nspp = 34\nreplicates = 17\nmax_order = 2\nsize = [12, 10]\n\
    [[methods]]\nname = \"path\"\n[[methods]]\nname = \"bdpt\"\n";

fn plan(folder: &Path, shards: u32, out: &str) {
    succeed(folder, &["plan", "e.toml", "--quiet", "--shards", &shards.to_string(), "--out", out]);
}

fn shard<'a>(out: &'a str, which: &'a str) -> [&'a str; 7] {
    ["run", "e.toml", "--quiet", "--out", out, "--shard", which]
}

pub fn render(folder: &Path, out: &str, shards: impl IntoIterator<Item = u32>, of: u32) {
    shards.into_iter().for_each(|i| drop(succeed(folder, &shard(out, &format!("{i}/{of}")))));
}

/// Records without times, images, and the largest contributions.
fn results(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found = outcome(folder);
    found.push(("fireflies".to_owned(), std::fs::read(folder.join("fireflies.json")).unwrap()));
    found
}

pub fn assert_same(serial: &Path, merged: &Path) {
    let [expected, found] = [serial, merged].map(results);
    let names = |of: &[(String, Vec<u8>)]| of.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&expected), names(&found));
    for (expected, found) in expected.iter().zip(&found) {
        assert!(expected == found, "{} is not that of the run in one piece", expected.0);
    }
}

fn files_of(folder: &Path, out: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder.join(out).join("shards")).unwrap().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.sort();
    paths
}

/// What a command that ends with this status says of what is wrong: one error.
pub fn fails(folder: &Path, arguments: &[&str], status: i32, words: &[&str]) -> String {
    let output = neumann(folder, arguments);
    let message = text(&output.stderr);
    assert_eq!((output.status.code(), message.matches("error:").count()), (Some(status), 1), "{message}");
    assert!(words.iter().all(|word| message.contains(word)), "{words:?} in {message}");
    message
}

#[test]
fn every_division_has_the_bits_of_a_run_in_one_piece() {
    let folder = folder_with(&[("e.toml", ALL)]);
    let at = |name: &str| folder.path().join(name);
    succeed(folder.path(), &["run", "e.toml", "--quiet", "--out", "serial", "--threads", "1"]);
    for count in [1, 3, 11] {
        let out = format!("in_{count}");
        plan(folder.path(), count, &out);
        // The last one first, and one of them twice.
        render(folder.path(), &out, (1..=count).rev(), count);
        render(folder.path(), &out, [count.div_ceil(2)], count);
        succeed(folder.path(), &["merge", &out, "--quiet"]);
        assert_same(&at("serial"), &at(&out));
    }
    // The manifest says who rendered what, and a merge may be done again.
    assert_eq!(json(&at("in_3"), "manifest.json")["shards"].as_array().unwrap().len(), 3);
    succeed(folder.path(), &["merge", "in_3", "--quiet", "--threads", "1"]);
    assert_same(&at("serial"), &at("in_3"));
}

#[test]
fn as_many_shards_as_there_are_groups_and_no_more() {
    let folder = folder_with(&[("e.toml", PLAIN)]);
    // 17 replicates are three groups, of two methods.
    let arguments = ["plan", "e.toml", "--out", "p", "--shards", "7"];
    fails(folder.path(), &arguments, 2, &["6 groups of 8 replicates", "at most --shards 6"]);
    succeed(folder.path(), &["run", "e.toml", "--quiet", "--out", "serial"]);
    let said = succeed(folder.path(), &["plan", "e.toml", "--out", "p", "--shards", "6"]);
    assert!(["6 shards", "--shard 1/6", "neumann merge p"].iter().all(|word| said.contains(word)), "{said}");
    for i in 1..=6_u32 {
        let mut auto = command(folder.path(), &shard("p", "auto"));
        let (name, first) =
            [("SLURM_ARRAY_TASK_ID", 1), ("JOB_COMPLETION_INDEX", 0), ("PBS_ARRAY_INDEX", 1), ("SGE_TASK_ID", 1)]
                [i as usize % 4];
        assert!(auto.env(name, (i - 1 + first).to_string()).status().unwrap().success());
    }
    succeed(folder.path(), &["merge", "p", "--quiet"]);
    assert_same(&folder.path().join("serial"), &folder.path().join("p"));
    // Nothing is in a file but replicates: sums of three channels and three orders in 120 pixels.
    for path in files_of(folder.path(), "p") {
        let contents = scan(&path, Look::Bytes).unwrap();
        let payload = contents.places.len() as u64 * 120 * 3 * 3 * 8;
        let length = std::fs::metadata(&path).unwrap().len();
        assert!(contents.fault.is_none() && length > payload);
        let held: u64 = contents.places.iter().map(|place| place.length).sum();
        assert!(length as f64 <= 1.1 * held as f64 + 1024.0, "{length} bytes for {held}");
    }
}

#[test]
fn a_shard_that_is_killed_again_and_again_goes_on() {
    let folder = folder_with(&[("e.toml", &PLAIN.replace("spp = 34", "spp = 13600"))]);
    succeed(folder.path(), &["run", "e.toml", "--quiet", "--out", "serial"]);
    plan(folder.path(), 2, "p");
    let grown = || files_of(folder.path(), "p").iter().map(|path| std::fs::metadata(path).unwrap().len()).sum::<u64>();
    let partial = folder.path().join("p/shards/.0001_of_0002.shard.partial");
    let (mut moment, mut kept) = (moments(5), 0);
    for round in 0..6 {
        let mut child = start(folder.path(), &shard("p", "1/2"));
        let (before, patience) = (grown(), Instant::now() + Duration::from_secs(60));
        while grown() < before + 1 && child.try_wait().unwrap().is_none() && Instant::now() < patience {
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_millis(moment(30)));
        match round {
            2 | 4 => drop(Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap()),
            _ => child.kill().unwrap(),
        }
        child.wait().unwrap();
        let now = scan(&partial, Look::Bytes).map_or(0, |contents| contents.places.len());
        assert!(now >= kept, "{now} replicates are kept of {kept}");
        kept = now;
    }
    assert!((1..17).contains(&kept), "{kept} replicates survived");
    render(folder.path(), "p", [2, 1], 2);
    assert_eq!(files_of(folder.path(), "p").len(), 2, "nothing else is left there");
    succeed(folder.path(), &["merge", "p", "--quiet"]);
    assert_same(&folder.path().join("serial"), &folder.path().join("p"));
}

/// Of images that nothing judges the moments of the groups after the first 32 are kept, whatever ends a process in the middle of one.
#[test]
fn of_many_replicates_moments_are_kept_and_have_the_bits_of_a_run_in_one_piece() {
    let many = PLAIN.replace("spp = 34", "spp = 16620").replace("replicates = 17", "replicates = 277");
    let folder = folder_with(&[("e.toml", &many)]);
    let at = |name: &str| folder.path().join(name);
    // First fewer of them, with a last group that is not full.
    succeed(folder.path(), &["run", "e.toml", "--quiet", "--out", "serial", "--spp", "15660", "--replicates", "261"]);
    succeed(folder.path(), &["run", "e.toml", "--quiet", "--out", "serial"]);
    plan(folder.path(), 35, "p");
    let plan = ShardPlan::read(&at("p")).unwrap();
    let in_groups = |shard: u32| plan.contents(shard).any(|(.., gathered)| gathered > 0);
    let later = (1..=35).find(|&shard| in_groups(shard)).unwrap();
    let (which, name) = (format!("{later}/35"), format!("{later:04}_of_0035.shard"));
    let partial = at(&format!("p/shards/.{name}.partial"));
    let is_begun = |place: &&Place| place.replicate >= 256 && place.gathered == 0;
    let begun = || scan(&partial, Look::Bytes).is_ok_and(|contents| contents.places.iter().any(|p| is_begun(&p)));
    let killed_within_a_group = (0..100).any(|_| {
        let mut child = start(folder.path(), &shard("p", &which));
        while !begun() && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        // It was quicker than we.
        let _ = std::fs::remove_file(at(&format!("p/shards/{name}")));
        begun()
    });
    assert!(killed_within_a_group);
    render(folder.path(), "p", (1..=35).rev(), 35);
    succeed(folder.path(), &["merge", "p", "--quiet"]);
    assert_same(&at("serial"), &at("p"));
    let places = files_of(folder.path(), "p").into_iter().flat_map(|path| scan(&path, Look::Bytes).unwrap().places);
    let places: Vec<Place> = places.collect();
    let gathered: Vec<u32> = places.iter().map(|place| place.gathered).filter(|&n| n > 0).collect();
    assert_eq!(gathered, [8, 8, 5, 8, 8, 5]);
    assert_eq!(places.iter().map(Place::replicates).sum::<u32>(), 2 * 277);
}

#[test]
fn what_sigterm_ends_is_kept_to_the_replicate() {
    let folder = folder_with(&[("e.toml", &PLAIN.replace("spp = 34", "spp = 34000"))]);
    plan(folder.path(), 1, "p");
    let mut child = start(folder.path(), &shard("p", "1/1"));
    let partial = folder.path().join("p/shards/.0001_of_0001.shard.partial");
    let held = || scan(&partial, Look::Bytes).map_or(0, |contents| contents.places.len());
    let patience = Instant::now() + Duration::from_secs(60);
    while held() < 1 {
        assert!(Instant::now() < patience && child.try_wait().unwrap().is_none(), "no replicate is kept");
        std::thread::sleep(Duration::from_millis(5));
    }
    let message = fails(folder.path(), &shard("p", "1/1"), 2, &["shard 1 is being rendered by another process"]);
    assert!(!message.contains("panic"));
    Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(143));
    let contents = scan(&partial, Look::Bytes).unwrap();
    let replicates: Vec<u32> = contents.places.iter().map(|place| place.replicate).collect();
    assert!((1..34).contains(&replicates.len()), "{replicates:?}");
    assert_eq!(contents.end, std::fs::metadata(&partial).unwrap().len(), "what is kept is whole");
}

#[test]
fn missing_corrupt_duplicate_and_foreign_shards_are_told_with_the_mend() {
    let folder = folder_with(&[("e.toml", PLAIN)]);
    plan(folder.path(), 4, "p");
    let merge = ["merge", "p"];
    let told =
        fails(folder.path(), &merge, 1, &["missing: shard 1; run neumann run", "missing: shard 4", "--shard 4/4"]);
    assert_eq!(told.lines().count(), 5, "{told}");
    render(folder.path(), "p", 1..=4, 4);
    let before = files(&folder.path().join("p"));
    let path = |i: u32| folder.path().join(format!("p/shards/000{i}_of_0004.shard"));
    let bytes = std::fs::read(path(2)).unwrap();

    std::fs::copy(path(1), folder.path().join("p/shards/copy.shard")).unwrap();
    std::fs::write(path(2), &bytes[..bytes.len() - 40]).unwrap();
    std::fs::remove_file(path(3)).unwrap();
    // Of another plan of the same experiment.
    plan(folder.path(), 3, "q");
    render(folder.path(), "q", [2], 3);
    std::fs::copy(folder.path().join("q/shards/0002_of_0003.shard"), folder.path().join("p/shards/other.shard"))
        .unwrap();
    let words = [
        "corrupt: p/shards/0002_of_0004.shard (it ends too early); run neumann run",
        "--shard 2/4",
        "duplicate: p/shards/copy.shard is shard 1 like p/shards/0001_of_0004.shard; remove it: rm p/shards/copy.shard",
        "foreign: p/shards/other.shard is of another plan; remove it: rm p/shards/other.shard",
        "missing: shard 3; run neumann run",
    ];
    let told = fails(folder.path(), &merge, 1, &words);
    assert_eq!(told.lines().count(), 5, "{told}");
    assert!(!folder.path().join("p/report.html").exists());

    ["copy", "other"]
        .iter()
        .for_each(|name| std::fs::remove_file(folder.path().join(format!("p/shards/{name}.shard"))).unwrap());
    // In a replicate, in the hash of all, in what files begin with, and in the hash of the plan.
    for at in [bytes.len() / 2, bytes.len() - 1, 5, 20] {
        let mut flipped = bytes.clone();
        flipped[at] ^= 1;
        std::fs::write(path(2), flipped).unwrap();
        fails(folder.path(), &merge, 1, &["corrupt: p/shards/0002_of_0004.shard", "--shard 2/4"]);
    }
    // What is corrupt or missing is rendered again, and nothing else.
    render(folder.path(), "p", [2, 3], 4);
    assert_eq!(files(&folder.path().join("p")), before);
    // What a cluster leaves beside them is in no one's way.
    std::fs::write(folder.path().join("p/slurm-1.out"), "").unwrap();
    succeed(folder.path(), &["merge", "p", "--quiet"]);
}

#[test]
fn a_merge_replaces_other_results_where_that_is_said() {
    let folder = folder_with(&[("e.toml", PLAIN)]);
    succeed(folder.path(), &["run", "e.toml", "--quiet", "--out", "p", "--seed", "7"]);
    succeed(folder.path(), &["plan", "e.toml", "--quiet", "--out", "p", "--shards", "2", "--fresh"]);
    render(folder.path(), "p", 1..=2, 2);
    fails(folder.path(), &["merge", "p"], 2, &["p holds results of another configuration (seed", "--fresh"]);
    succeed(folder.path(), &["merge", "p", "--quiet", "--fresh"]);
    succeed(folder.path(), &["run", "e.toml", "--quiet", "--out", "serial"]);
    assert_same(&folder.path().join("serial"), &folder.path().join("p"));
}

#[test]
fn numbers_that_would_have_other_bits_are_refused_or_allowed() {
    let folder = folder_with(&[("e.toml", PLAIN)]);
    plan(folder.path(), 2, "p");
    render(folder.path(), "p", 1..=2, 2);
    succeed(folder.path(), &["run", "e.toml", "--quiet", "--out", "serial"]);
    let place = folder.path().join("p/shards/0002_of_0002.shard");
    let whole = std::fs::read(&place).unwrap();
    forge(&place, "\"kernels\":\"", "\"kernels\":\"other_");
    let words = [
        "foreign: p/shards/0002_of_0002.shard was rendered by",
        "with other_",
        "neumann merge p --allow-foreign",
        "--shard 2/2",
    ];
    fails(folder.path(), &["merge", "p"], 1, &words);
    succeed(folder.path(), &["merge", "p", "--quiet", "--allow-foreign"]);
    assert_same(&folder.path().join("serial"), &folder.path().join("p"));
    // Another version is none of ours, whatever the flag says.
    std::fs::write(&place, &whole).unwrap();
    forge(&place, "\"neumann\":\"", "\"neumann\":\"9.");
    fails(folder.path(), &["merge", "p", "--allow-foreign"], 1, &["foreign:", "neumann 9."]);
    std::fs::write(&place, &whole).unwrap();

    // A plan by another program.
    let file = folder.path().join("p/plan.json");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replacen("\"neumann\": \"", "\"neumann\": \"9.", 1)).unwrap();
    fails(folder.path(), &["merge", "p"], 2, &["plan.json: it is damaged", "--fresh"]);
    std::fs::write(&file, &text[..100]).unwrap();
    fails(folder.path(), &shard("p", "1/2"), 2, &["plan.json: it is damaged", "--fresh"]);
}

/// Changes the head of a shard's file so that all hashes fit.
fn forge(path: &Path, from: &str, to: &str) {
    let contents = scan(path, Look::Bytes).unwrap();
    let bytes = std::fs::read(path).unwrap();
    let length = u32::from_le_bytes(bytes[52..56].try_into().unwrap()) as usize;
    let origin = String::from_utf8(bytes[56..56 + length].to_vec()).unwrap();
    let forged = origin.replacen(from, to, 1);
    assert_ne!(forged, origin);
    let head = [&bytes[..52], &(forged.len() as u32).to_le_bytes(), forged.as_bytes()].concat();
    let body = &bytes[56 + length..contents.end as usize];
    let mut hasher = blake3::Hasher::new();
    hasher.update(&head);
    for place in &contents.places {
        let end = (place.offset + place.length) as usize;
        hasher.update(&bytes[end..end + 32]);
    }
    let end = &bytes[contents.end as usize..][..8];
    std::fs::write(path, [&head[..], body, end, hasher.finalize().as_bytes()].concat()).unwrap();
}

#[test]
fn a_plan_stands_until_it_is_discarded() {
    let folder = folder_with(&[("e.toml", PLAIN)]);
    fails(folder.path(), &shard("p", "1/2"), 2, &["p/plan.json", "neumann plan EXPERIMENT --shards N --out DIR"]);
    fails(folder.path(), &["merge", "p"], 2, &["p/plan.json", "neumann plan"]);
    plan(folder.path(), 2, "p");
    fails(folder.path(), &["report", "p"], 2, &["p holds a plan", "not merged", "neumann merge"]);
    let first = std::fs::read(folder.path().join("p/plan.json")).unwrap();
    plan(folder.path(), 2, "p");
    assert!(std::fs::read(folder.path().join("p/plan.json")).unwrap() == first, "the same plan is not made again");
    let planned = |more: &[&'static str], words: &[&str]| {
        let arguments = [&["plan", "e.toml", "--quiet", "--out", "p"][..], more].concat();
        fails(folder.path(), &arguments, 2, words);
    };
    planned(&["--shards", "3"], &["p holds another plan (of 2 shards, not 3)", "--out", "--fresh"]);
    planned(&["--shards", "2", "--seed", "4"], &["p holds another plan (of another experiment", "--fresh"]);
    planned(&["--shards", "2", "--seconds", "3"], &["cannot be divided", "--spp N"]);
    planned(
        &["--shards", "2", "--until", "relative_error=0.1", "--max-spp", "99"],
        &["cannot be divided", "--spp N", "leave out `until`"],
    );

    fails(folder.path(), &shard("p", "3/2"), 2, &["from 1 to 2"]);
    fails(folder.path(), &shard("p", "1/3"), 2, &["the plan has 2 shards, not 3"]);
    fails(folder.path(), &shard("p", "auto"), 2, &["SLURM_ARRAY_TASK_ID", "--shard 1/2"]);
    let flags = [&shard("p", "1/2")[..], &["--spp", "17"]].concat();
    fails(folder.path(), &flags, 2, &["give flags that change it to `neumann plan`"]);
    render(folder.path(), "p", [1], 2);
    let edited = PLAIN.replace("max_order = 2", "max_order = 3");
    std::fs::write(folder.path().join("e.toml"), &edited).unwrap();
    fails(folder.path(), &shard("p", "2/2"), 2, &["e.toml", "not what the plan was made of", "--fresh"]);
    // What was rendered for a plan goes with it.
    succeed(folder.path(), &["plan", "e.toml", "--quiet", "--out", "p", "--shards", "2", "--fresh"]);
    assert!(files_of(folder.path(), "p").is_empty());
    render(folder.path(), "p", 1..=2, 2);
    succeed(folder.path(), &["merge", "p", "--quiet"]);
    succeed(folder.path(), &["run", "e.toml", "--quiet", "--out", "serial"]);
    assert_same(&folder.path().join("serial"), &folder.path().join("p"));
}

#[test]
fn a_plan_that_is_changed_under_a_running_shard_takes_nothing_of_it() {
    let folder = folder_with(&[("e.toml", &PLAIN.replace("spp = 34", "spp = 34000")), ("room.toml", ROOM)]);
    plan(folder.path(), 2, "p");
    let mut child = command(folder.path(), &shard("p", "1/2")).stderr(std::process::Stdio::piped()).spawn().unwrap();
    let partial = folder.path().join("p/shards/.0001_of_0002.shard.partial");
    let patience = Instant::now() + Duration::from_secs(60);
    while !partial.exists() {
        assert!(Instant::now() < patience, "the shard never began");
        std::thread::sleep(Duration::from_millis(1));
    }
    let again = ["plan", "e.toml", "--quiet", "--out", "p", "--shards", "3", "--spp", "34", "--fresh"];
    succeed(folder.path(), &again);
    child.wait().unwrap();
    let mut message = String::new();
    std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut message).unwrap();
    assert!(message.contains("another plan was made in p while this shard was rendered"), "{message}");
    assert!(files_of(folder.path(), "p").is_empty());
    // Nor does a scene that was edited in the meantime slip in.
    std::fs::write(folder.path().join("e.toml"), PLAIN.replace("cornell_box", "room.toml")).unwrap();
    plan(folder.path(), 2, "q");
    std::fs::write(folder.path().join("room.toml"), ROOM.replace("albedo = 0.5", "albedo = 0.6")).unwrap();
    fails(folder.path(), &shard("q", "1/2"), 2, &["edited since the plan was made", "room"]);
    fails(folder.path(), &["merge", "q"], 2, &["edited since the plan was made"]);
}

#[test]
fn a_disk_without_room_costs_no_replicate() {
    let folder = folder_with(&[("e.toml", PLAIN)]);
    plan(folder.path(), 1, "p");
    let script = "trap '' XFSZ; ulimit -f 80; exec \"$0\" \"$@\"";
    let mut shell = Command::new("sh");
    shell.current_dir(folder.path()).args(["-c", script, env!("CARGO_BIN_EXE_neumann")]);
    let output = shell.args(shard("p", "1/1")).output().unwrap();
    let message = text(&output.stderr);
    assert_eq!((output.status.code(), message.matches("error:").count()), (Some(2), 1), "{message}");
    assert!(message.contains("shard.partial") && message.contains("make room there"), "{message}");
    let kept = scan(&folder.path().join("p/shards/.0001_of_0001.shard.partial"), Look::Bytes).unwrap().places.len();
    assert!(kept > 0, "what was complete is kept");
    render(folder.path(), "p", [1], 1);
    succeed(folder.path(), &["merge", "p", "--quiet"]);
    succeed(folder.path(), &["run", "e.toml", "--quiet", "--out", "serial"]);
    assert_same(&folder.path().join("serial"), &folder.path().join("p"));
}
