//! What engines are given to run an experiment's shards.

use super::shards::{PLAIN, assert_same, fails, render};
use super::*;
use std::os::unix::fs::PermissionsExt;

fn submit<'a>(engine: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["submit", "e.toml", "--out", "p", "--engine", engine][..], more].concat()
}

fn written(folder: &Path, file: &str) -> String {
    std::fs::read_to_string(folder.join("p/submit").join(file)).unwrap()
}

#[track_caller]
fn has(text: &str, lines: &[&str]) {
    lines.iter().for_each(|line| assert!(text.contains(line), "`{line}` in\n{text}"));
}

#[test]
fn an_array_and_a_merge_are_written_for_slurm_and_later_only_what_is_missing() {
    let folder = folder_with(&[("e.toml", PLAIN)]);
    fails(folder.path(), &submit("slurm", &[]), 2, &["there is no plan in p", "--shards"]);
    let said = succeed(folder.path(), &submit("slurm", &["--shards", "5", "--threads", "2", "--partition", "day"]));
    has(&said, &["5 of 5 shards", "slurm.sh, array.sbatch, merge.sbatch", "--go"]);
    let here = std::fs::canonicalize(folder.path()).unwrap();
    let at = |path: &str| here.join(path).to_string_lossy().into_owned();
    let program = env!("CARGO_BIN_EXE_neumann");
    let array = written(folder.path(), "array.sbatch");
    let run = format!("exec {program} run {} --quiet --out {} --threads 2 --shard auto\n", at("e.toml"), at("p"));
    let lines = [
        "#!/bin/sh\n#SBATCH --job-name=e\n#SBATCH --array=1-5\n",
        "#SBATCH --time=8\n#SBATCH --partition=day\n#SBATCH --cpus-per-task=2\n#SBATCH --requeue\n#SBATCH --signal=B:TERM@120\n",
        &run,
    ];
    has(&array, &lines);
    has(&written(folder.path(), "merge.sbatch"), &[&format!("exec {program} merge {} --threads 2\n", at("p"))]);
    has(
        &written(folder.path(), "slurm.sh"),
        &["sbatch --parsable --dependency=afterany:\"${array%%;*}\" ", "merge.sbatch"],
    );

    render(folder.path(), "p", [2, 3], 5);
    succeed(folder.path(), &submit("slurm", &["--minutes", "30", "--program", "/opt/neumann"]));
    let lines = ["--array=1,4-5\n", "--time=30\n", "exec /opt/neumann run "];
    has(&written(folder.path(), "array.sbatch"), &lines);
    // What shards may take is not what the merge may.
    has(&written(folder.path(), "merge.sbatch"), &["--time=8\n"]);
    let shards = folder.path().join("p/shards");
    std::fs::copy(shards.join("0002_of_0005.shard"), shards.join("copy.shard")).unwrap();
    fails(folder.path(), &submit("slurm", &[]), 1, &["duplicate: ", "copy.shard is shard 2", "remove it: rm "]);
    std::fs::remove_file(shards.join("copy.shard")).unwrap();
    fails(folder.path(), &submit("slurm", &["--seed", "4"]), 2, &["p holds another plan", "--fresh"]);
    fails(
        folder.path(),
        &submit("slurm", &["--shards", "4"]),
        2,
        &["p holds another plan (of 5 shards, not 4)", "leave out"],
    );
    render(folder.path(), "p", [1, 4, 5], 5);
    has(&succeed(folder.path(), &submit("slurm", &[])), &["all 5 shards are complete: neumann merge "]);
}

#[test]
fn a_plan_made_with_flags_is_submitted_without_them() {
    let folder = folder_with(&[("e.toml", PLAIN)]);
    let flags = ["--shards", "3", "--seed", "4"];
    succeed(folder.path(), &[&["plan", "e.toml", "--quiet", "--out", "p"][..], &flags].concat());
    let made = std::fs::read(folder.path().join("p/plan.json")).unwrap();
    for given in [&[][..], &flags[..2], &flags[2..], &flags] {
        has(&succeed(folder.path(), &submit("slurm", given)), &["3 of 3 shards"]);
    }
    fails(folder.path(), &submit("slurm", &["--seed", "5"]), 2, &["p holds another plan", "leave out the flags"]);
    assert!(std::fs::read(folder.path().join("p/plan.json")).unwrap() == made);
}

#[test]
fn what_is_written_is_run_where_the_engine_is_there() {
    let folder = folder_with(&[("e.toml", PLAIN)]);
    let tools = folder.path().join("tools");
    std::fs::create_dir(&tools).unwrap();
    let go = |shards: &str| {
        let mut go = command(folder.path(), &submit("slurm", &["--shards", shards, "--threads", "1", "--go"]));
        let system = ["/usr/bin", "/bin"].join(":");
        go.env("PATH", format!("{}:{system}", tools.display())).output().unwrap()
    };
    let message = text(&go("3").stderr);
    if !std::env::split_paths("/usr/bin:/bin").any(|path| path.join("sbatch").is_file()) {
        assert!(message.contains("there is no sbatch on the PATH") && message.contains("--engine"), "{message}");
    }
    let path = tools.join("sbatch");
    let install = |script: &str| {
        std::fs::write(&path, script).unwrap();
        std::fs::set_permissions(&path, PermissionsExt::from_mode(0o755)).unwrap();
    };
    install("#!/bin/sh\nexit 3\n");
    let failed = go("3");
    let message = text(&failed.stderr);
    assert!(failed.status.code() == Some(1) && message.contains("slurm.sh ended with exit status: 3"), "{message}");
    // A Slurm that runs every task at once, and kills the second one of the first array.
    let sbatch = "#!/bin/sh\nfor last; do :; done\necho \"$@\" >> log\ncase $last in */array.sbatch)\n\
        for i in $(sed -n 's/#SBATCH --array=//p' $last | sed 's/1-3/1 2 3/'); do\n\
        if [ $i = 2 ] && [ ! -e killed ]; then touch killed; else SLURM_ARRAY_TASK_ID=$i sh $last || exit 1; fi; done; echo 17;;\n\
        *) sh $last > said 2>&1 || true; echo 18;; esac\n";
    install(sbatch);
    let output = go("3");
    assert!(output.status.success() && text(&output.stdout).contains("array 17, merge 18"), "{}", text(&output.stderr));
    let said = |folder: &Path| std::fs::read_to_string(folder.join("said")).unwrap();
    has(&said(folder.path()), &["missing: shard 2; run "]);
    assert!(go("3").status.success());
    has(&said(folder.path()), &["report.html"]);
    let log = std::fs::read_to_string(folder.path().join("log")).unwrap();
    assert_eq!(log.matches("--dependency=afterany:17").count(), 2, "{log}");
    succeed(folder.path(), &["run", "e.toml", "--quiet", "--out", "serial"]);
    assert_same(&folder.path().join("serial"), &folder.path().join("p"));
}

#[test]
fn the_other_engines_are_given_the_same_commands() {
    let folder = folder_with(&[("e.toml", PLAIN)]);
    succeed(folder.path(), &submit("parallel", &["--shards", "4", "--hosts", "a,b", "--program", "neumann"]));
    render(folder.path(), "p", [3], 4);
    succeed(folder.path(), &submit("parallel", &["--hosts", "a,b", "--program", "neumann"]));
    let script = written(folder.path(), "parallel.sh");
    has(
        &script,
        &["parallel --jobs 1 --sshlogin a,b --retries 3 ", "--shard {}/4' ::: 1 2 4 || true\n", "exec neumann merge "],
    );
    // What is there and corrupt is removed for an engine that goes by what is there.
    let third = folder.path().join("p/shards/0003_of_0004.shard");
    let whole = std::fs::read(&third).unwrap();
    std::fs::write(&third, &whole[1..]).unwrap();
    succeed(folder.path(), &submit("snakemake", &["--threads", "2"]));
    let run = written(folder.path(), "snakemake.sh");
    assert!(run.contains("rm -f ") && run.contains("0003_of_0004.shard ") && !run.contains("0001_of"), "{run}");
    has(&written(folder.path(), "Snakefile"), &["threads: 2\n"]);
    std::fs::write(&third, &whole).unwrap();
    succeed(folder.path(), &submit("snakemake", &[]));
    let run = written(folder.path(), "snakemake.sh");
    assert!(run.contains("submit/merged\n") && !run.contains(".shard"), "{run}");
    let rules = ["rule all:", "_of_0004.shard\"", "range(1, 5)", "--shard {params.number}/4\"", "retries: 3", "merge "];
    has(&written(folder.path(), "Snakefile"), &rules);
    let volume = ["--image", "lab/neumann:1", "--claim", "results", "--jobs", "2", "--program", "neumann"];
    succeed(folder.path(), &submit("kubernetes", &volume));
    for given in [&volume[..2], &volume[2..4]] {
        refused(folder.path(), &submit("kubernetes", given), &["--image", "--claim"]);
    }
    let lines = [
        "kind: Job\n",
        "completionMode: Indexed\n  completions: 4\n  parallelism: 2\n  backoffLimitPerIndex: 3\n",
        "image: lab/neumann:1\n",
        "claimName: results\n",
        "exec neumann run ",
        "--shard auto\"]\n",
    ];
    has(&written(folder.path(), "shards.yaml"), &lines);
    has(&written(folder.path(), "merge.yaml"), &["backoffLimit: 0\n", "exec neumann merge "]);
    refused(folder.path(), &submit("parallel", &["--minutes", "9"]), &["--minutes means nothing to parallel", "slurm"]);
    refused(folder.path(), &submit("slurm", &["--jobs", "2"]), &["--jobs", "only to parallel and kubernetes"]);
    refused(folder.path(), &submit("slurm", &["--minutes", "2"]), &["120 s before its limit", "--minutes 3"]);
    refused(folder.path(), &submit("condor", &[]), &["slurm", "parallel", "snakemake", "kubernetes"]);
}
