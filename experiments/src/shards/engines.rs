//! What runs shards on many machines: the files that each engine takes.

use super::ShardPlan;
use super::plan::quoted;
use crate::cli::SubmitArgs;
use crate::error::Error;
use clap::ValueEnum;
use std::path::{Path, PathBuf};

/// What runs the shards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Engine {
    /// Slurm: an array of jobs, and one that merges.
    Slurm,
    /// GNU parallel: a few hosts that one may log in to, or this one.
    Parallel,
    /// Snakemake, with whatever it is set up to run jobs by.
    Snakemake,
    /// Kubernetes: an indexed job, and one that merges.
    Kubernetes,
}

/// Seconds before its limit at which a task is told to end: enough for the replicate at work.
const NOTICE: u64 = 120;
/// Minutes of the shortest limit that leaves some time before that.
const SHORTEST: u64 = NOTICE / 60 + 1;
/// Bytes a second that every merge reads: a seventh of what it took from a local disk.
const MERGED: f64 = 1e8;

/// The file that says to Snakemake that a merge is done, which would remove the report before it if that were the merge's output.
const MERGED_MARK: &str = "merged";

/// What is to be run.
pub struct Task<'a> {
    /// The plan.
    pub plan: &'a ShardPlan,
    /// Where it is; absolute.
    pub folder: &'a Path,
    /// The program.
    pub program: String,
    /// The shards that are not complete.
    pub missing: &'a [u32],
    /// What the user asks for.
    pub args: &'a SubmitArgs,
}

impl Engine {
    /// The files and what is in them: first the script that starts all.
    pub fn files(self, task: &Task) -> Vec<(&'static str, String)> {
        match self {
            Self::Slurm => slurm(task),
            Self::Parallel => vec![("parallel.sh", parallel(task))],
            Self::Snakemake => {
                let run = format!(
                    "{HEAD}{}exec snakemake --snakefile {} --cores \"${{CORES:-all}}\" --keep-going\n",
                    task.remove(),
                    task.file("Snakefile")
                );
                vec![("snakemake.sh", run), ("Snakefile", snakefile(task))]
            }
            Self::Kubernetes => kubernetes(task),
        }
    }

    /// Refuses flags that mean nothing to it, and asks for those that it needs.
    ///
    /// # Errors
    /// If there is such a flag, or one is lacking.
    pub fn check(self, args: &SubmitArgs) -> Result<(), Error> {
        use Engine::*;
        let flags: [(&str, bool, &[Self]); 6] = [
            ("--partition", args.partition.is_some(), &[Slurm]),
            ("--minutes", args.minutes.is_some(), &[Slurm, Snakemake]),
            ("--hosts", args.hosts.is_some(), &[Parallel]),
            ("--jobs", args.jobs.is_some(), &[Parallel, Kubernetes]),
            ("--image", args.image.is_some(), &[Kubernetes]),
            ("--claim", args.claim.is_some(), &[Kubernetes]),
        ];
        let name = |engine: Self| engine.to_possible_value().map_or(String::new(), |value| value.get_name().to_owned());
        if let Some((flag, _, takers)) = flags.iter().find(|(_, given, takers)| *given && !takers.contains(&self)) {
            let takers: Vec<String> = takers.iter().map(|&engine| name(engine)).collect();
            let (engine, takers) = (name(self), takers.join(" and "));
            return Err(Error::usage(format!("{flag} means nothing to {engine}, only to {takers}; leave it out")));
        }
        if self == Slurm && args.minutes.is_some_and(|minutes| minutes < SHORTEST) {
            return Err(Error::usage(format!(
                "a task is told to end {NOTICE} s before its limit, and would not begin; give it --minutes {SHORTEST} or more"
            )));
        }
        if self == Kubernetes && (args.image.is_none() || args.claim.is_none()) {
            return Err(Error::usage(
                "kubernetes needs to know what to run and where results are: give --image, a container with neumann in it, and --claim, a volume's",
            ));
        }
        Ok(())
    }

    /// The command that must be there.
    pub fn tool(self) -> &'static str {
        match self {
            Self::Slurm => "sbatch",
            Self::Parallel => "parallel",
            Self::Snakemake => "snakemake",
            Self::Kubernetes => "kubectl",
        }
    }
}

const HEAD: &str = "#!/bin/sh\n# Written by neumann submit, which writes it again for what is missing then.\nset -eu\n";

impl Task<'_> {
    fn threads(&self) -> String {
        self.args.threads.map_or(String::new(), |threads| format!(" --threads {threads}"))
    }

    /// The command that renders a shard.
    fn shard(&self, which: &str) -> String {
        let experiment = match &self.plan.path {
            Some(path) => quoted(&path.to_string_lossy()),
            None => self.plan.name.clone(),
        };
        let (program, folder) = (quoted(&self.program), quoted(&self.folder.to_string_lossy()));
        format!("{program} run {experiment} --quiet --out {folder}{} --shard {which}", self.threads())
    }

    fn merge(&self) -> String {
        format!("{} merge {}{}", quoted(&self.program), quoted(&self.folder.to_string_lossy()), self.threads())
    }

    /// The command that removes shards that are there and have to be rendered, and the mark of a merge before, since Snakemake goes by
    /// which files are there.
    fn remove(&self) -> String {
        let files = self.missing.iter().map(|&shard| self.plan.file(self.folder, shard)).filter(|file| file.exists());
        let files: String = files.map(|file| quoted(&file.to_string_lossy()) + " ").collect();
        format!("rm -f {files}{}\n", self.file(MERGED_MARK))
    }

    /// Where a file of the engine's is.
    fn place(&self, name: &str) -> PathBuf {
        self.folder.join(crate::submit_command::FOLDER).join(name)
    }

    /// The same, quoted.
    fn file(&self, name: &str) -> String {
        quoted(&self.place(name).to_string_lossy())
    }

    /// Minutes that no shard exceeds on machines that are not slower than a third of the one that made the plan.
    fn minutes(&self) -> u64 {
        let longest = self.missing.iter().map(|&shard| self.plan.estimate(shard).0).fold(0.0, f64::max);
        self.args.minutes.unwrap_or(minutes(3.0 * longest))
    }

    /// Minutes that the merge does not exceed where it reads [`MERGED`] bytes a second.
    fn merge_minutes(&self) -> u64 {
        let bytes: u64 = (1..=self.plan.count()).map(|shard| self.plan.estimate(shard).1).sum();
        minutes(bytes as f64 / MERGED)
    }
}

/// Minutes of a limit, by the seconds of work: with time to start, and notice of the end.
fn minutes(seconds: f64) -> u64 {
    ((seconds + 300.0 + NOTICE as f64) / 60.0).ceil() as u64
}

/// Numbers as ranges: `1-3,7`.
fn ranges(numbers: &[u32]) -> String {
    let mut ranges: Vec<(u32, u32)> = Vec::new();
    for &n in numbers {
        match ranges.last_mut() {
            Some((_, last)) if *last + 1 == n => *last = n,
            _ => ranges.push((n, n)),
        }
    }
    let told =
        ranges.iter().map(|&(first, last)| if first == last { first.to_string() } else { format!("{first}-{last}") });
    told.collect::<Vec<_>>().join(",")
}

fn slurm(task: &Task) -> Vec<(&'static str, String)> {
    let Task { plan, missing, args, .. } = task;
    let name = quoted(&plan.name);
    let partition = args.partition.as_ref().map_or(String::new(), |name| format!("#SBATCH --partition={name}\n"));
    let processors = args.threads.map_or(String::new(), |threads| format!("#SBATCH --cpus-per-task={threads}\n"));
    let array = format!(
        "#!/bin/sh\n#SBATCH --job-name={name}\n#SBATCH --array={}\n#SBATCH --output={}\n#SBATCH --time={}\n{partition}{processors}\
         #SBATCH --requeue\n#SBATCH --signal=B:TERM@{NOTICE}\n\
         # SIGTERM ends a shard after the replicate at work, which is kept; whatever ends it, it goes on from there.\n\
         exec {}\n",
        ranges(missing),
        task.file("shard_%a.log"),
        task.minutes(),
        task.shard("auto")
    );
    let merge = format!(
        "#!/bin/sh\n#SBATCH --job-name={name}-merge\n#SBATCH --output={}\n#SBATCH --time={}\n{partition}{processors}\
         # Says which shards are missing, if any are: neumann submit then runs these again.\nexec {}\n",
        task.file("merge.log"),
        task.merge_minutes(),
        task.merge()
    );
    // A task that is killed must not keep the merge from saying what is missing.
    let submit = format!(
        "{HEAD}array=$(sbatch --parsable {})\nmerge=$(sbatch --parsable --dependency=afterany:\"${{array%%;*}}\" {})\n\
         echo \"array $array, merge $merge\"\n",
        task.file("array.sbatch"),
        task.file("merge.sbatch")
    );
    vec![("slurm.sh", submit), ("array.sbatch", array), ("merge.sbatch", merge)]
}

fn parallel(task: &Task) -> String {
    let Task { plan, missing, args, .. } = task;
    let hosts = args.hosts.as_ref().map_or(String::new(), |hosts| format!(" --sshlogin {}", quoted(hosts)));
    let numbers: Vec<String> = missing.iter().map(ToString::to_string).collect();
    let shard = task.shard(&format!("{{}}/{}", plan.count()));
    // One at a time on each host where nothing else is asked for, since every one of them takes all cores.
    format!(
        "{HEAD}parallel --jobs {}{hosts} --retries 3 --joblog {} {} ::: {} || true\nexec {}\n",
        args.jobs.unwrap_or(1),
        task.file("joblog"),
        quoted(&shard),
        numbers.join(" "),
        task.merge()
    )
}

/// Text as JSON, YAML and Python write it.
fn string(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn snakefile(task: &Task) -> String {
    let (folder, count) = (task.folder.to_string_lossy(), task.plan.count());
    let command = |text: &str| string(text).replace('{', "{{").replace('}', "}}");
    let name = string(&format!("_of_{count:04}.shard"));
    let (shards, merged) = (string(&format!("{folder}/shards/")), string(&task.place(MERGED_MARK).to_string_lossy()));
    let shard = command(&task.shard(""));
    let (shard, merge) = (shard.trim_end_matches('"'), command(&task.merge()));
    let (last, minutes) = (count + 1, task.minutes());
    let threads = task.args.threads.map_or("workflow.cores".to_owned(), |threads| threads.to_string());
    format!(
        "# Written by neumann submit. Snakemake runs the shards whose files are not there.\n\
         SHARDS = [f\"{{i:04}}\" for i in range(1, {last})]\n\n\
         rule all:\n    input: {merged}\n\n\
         rule merge:\n    input: expand({shards} + \"{{shard}}\" + {name}, shard=SHARDS)\n    output: touch({merged})\n    \
         shell: {merge}\n\n\
         rule shard:\n    output: {shards} + \"{{shard}}\" + {name}\n    wildcard_constraints: shard=\"[0-9]+\"\n    \
         params: number=lambda wildcards: int(wildcards.shard)\n    threads: {threads}\n    \
         resources: runtime={minutes}\n    retries: 3\n    shell: {shard}{{params.number}}/{count}\"\n"
    )
}

fn kubernetes(task: &Task) -> Vec<(&'static str, String)> {
    let Task { plan, args, .. } = task;
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
    let name: String = plan.name.chars().map(plain).collect();
    let (image, claim) = (args.image.as_deref().unwrap_or_default(), args.claim.as_deref().unwrap_or_default());
    let folder = string(&task.folder.to_string_lossy());
    let job = |suffix: &str, kind: &str, command: &str| {
        let command = string(&format!("exec {command}"));
        format!(
            "# Written by neumann submit.\napiVersion: batch/v1\nkind: Job\nmetadata:\n  name: neumann-{name}-{suffix}\nspec:\n{kind}  \
             template:\n    spec:\n      restartPolicy: Never\n      terminationGracePeriodSeconds: {NOTICE}\n      containers:\n        \
             - name: neumann\n          image: {image}\n          command: [\"sh\", \"-c\", {command}]\n          volumeMounts:\n            \
             - name: results\n              mountPath: {folder}\n      volumes:\n        - name: results\n          \
             persistentVolumeClaim:\n            claimName: {claim}\n"
        )
    };
    let count = plan.count();
    // Which indices run cannot be chosen; a shard that is complete ends at once.
    let indexed = format!(
        "  completionMode: Indexed\n  completions: {count}\n  parallelism: {}\n  backoffLimitPerIndex: 3\n  \
         maxFailedIndexes: {count}\n",
        args.jobs.unwrap_or(count).min(count)
    );
    let ended = "{.status.completionTime}{.status.conditions[?(@.type==\"Failed\")].type}";
    let (shards, merge) = (task.file("shards.yaml"), task.file("merge.yaml"));
    let script = format!(
        "{HEAD}kubectl replace --force -f {shards}\n\
         until [ -n \"$(kubectl get job neumann-{name}-shards -o jsonpath='{ended}')\" ]; do sleep 10; done\n\
         kubectl replace --force -f {merge}\n"
    );
    vec![
        ("kubernetes.sh", script),
        ("shards.yaml", job("shards", &indexed, &task.shard("auto"))),
        ("merge.yaml", job("merge", "  backoffLimit: 0\n", &task.merge())),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_told_as_ranges() {
        assert_eq!(ranges(&[1, 2, 3, 7, 9, 10]), "1-3,7,9-10");
        assert_eq!(ranges(&[4]), "4");
    }
}
