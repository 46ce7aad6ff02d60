//! The threads of a run are the processors that it may use: its affinity, and the quota of its control group.

use super::*;
use std::path::PathBuf;

/// A control group of ours with a quota of processor time, removed when it is dropped.
struct ControlGroup(PathBuf);

impl ControlGroup {
    /// One within that of this process, of either version; `None` where none may be made.
    fn new(name: &str) -> Option<Self> {
        let own = std::fs::read_to_string("/proc/self/cgroup").ok()?;
        let of_line = |line: &str| {
            let mut parts = line.splitn(3, ':').skip(1);
            let (controllers, path) = (parts.next()?, parts.next()?.trim_start_matches('/'));
            let is_ours = controllers.is_empty() || controllers.split(',').any(|name| name == "cpu");
            let mounts = if controllers.is_empty() { vec!["", "unified"] } else { vec![controllers, "cpu"] };
            let places = mounts.into_iter().map(|mount| Path::new("/sys/fs/cgroup").join(mount).join(path));
            is_ours.then(|| places.collect::<Vec<_>>())
        };
        own.lines().filter_map(of_line).flatten().find_map(|parent| {
            let group = Self(parent.join(format!("neumann-{name}-{}", std::process::id())));
            std::fs::create_dir(&group.0).ok()?;
            group.set(2.0).then_some(group)
        })
    }

    /// So many processors' time in every 0.1 s, by the file of either version; gives whether it was taken.
    fn set(&self, processors: f64) -> bool {
        let quota = (processors * 100_000.0).round();
        // A file must not be made where there is none.
        let written = |file: &str, text: String| {
            let path = self.0.join(file);
            path.exists() && std::fs::write(path, text).is_ok()
        };
        written("cpu.max", format!("{quota} 100000"))
            || written("cpu.cfs_period_us", "100000".to_owned()) && written("cpu.cfs_quota_us", quota.to_string())
    }
}

impl Drop for ControlGroup {
    fn drop(&mut self) {
        // It is empty by now; should the system be slow to see that, an empty group does no harm.
        let _ = std::fs::remove_dir(&self.0);
    }
}

/// The threads of a render that is started by a shell's command, `"$@"`.
fn threads(folder: &Path, start: &str, more: &[&str]) -> u64 {
    let render = ["render", "furnace", "--size", "4x4", "--spp", "4", "--quiet", "--stats", "s.json"];
    let mut shell = Command::new("sh");
    shell.current_dir(folder).args(["-c", start, "sh", env!("CARGO_BIN_EXE_neumann")]).args(render).args(more);
    let output = shell.output().unwrap();
    assert!(output.status.success(), "{start}: {}", text(&output.stderr));
    json(folder, "s.json")["threads"].as_u64().unwrap()
}

#[test]
fn affinity_decides_how_many_there_are() {
    let folder = folder_with(&[]);
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let allowed = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap().trim();
    let first = allowed.split([',', '-']).next().unwrap();
    let on_one = format!("exec taskset -c {first} \"$@\"");
    assert_eq!(threads(folder.path(), &on_one, &[]), 1);
    assert_eq!(threads(folder.path(), &on_one, &["--threads", "3"]), 3, "what is asked for is obeyed");
    let all = std::thread::available_parallelism().unwrap().get() as u64;
    assert_eq!(threads(folder.path(), "exec \"$@\"", &[]), all);
}

/// Where the system lets us make a control group, as it does in many containers and for root; elsewhere this says that it looked at nothing.
#[test]
fn the_quota_of_a_control_group_decides_how_many_there_are() {
    let folder = folder_with(&[]);
    let all = std::thread::available_parallelism().unwrap().get();
    let Some(group) = ControlGroup::new("quota") else {
        println!("no control group may be made here: nothing was looked at");
        return;
    };
    let inside = format!("echo $$ > {}/cgroup.procs && exec \"$@\"", group.0.display());
    // Rounded down, but at least one, and no more than there are.
    for (quota, expected) in [(1.0, 1), (0.5, 1), (1.9, 1), (2.0, 2), (2.5, 2), (64.0, 64)] {
        assert!(group.set(quota), "a quota of {quota} in {}", group.0.display());
        assert_eq!(threads(folder.path(), &inside, &[]), expected.min(all as u64), "a quota of {quota}");
    }
    assert!(group.set(1.0));
    assert_eq!(threads(folder.path(), &inside, &["--threads", "2"]), 2, "what is asked for is obeyed");
}
