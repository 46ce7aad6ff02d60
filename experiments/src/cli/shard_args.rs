//! What can be typed after the commands that divide an experiment.

use super::args::ChangeArgs;
use super::parse::{at_least, parse_threads};
use crate::shards::engines::Engine;
use clap::Args;
use std::path::PathBuf;

/// `neumann plan`.
#[derive(Clone, Debug, Args)]
pub struct PlanArgs {
    /// An experiment's name (see `neumann list experiments`) or a .toml file.
    pub experiment: String,
    /// How many shards.
    #[arg(long, value_name = "N", value_parser = at_least::<1>)]
    pub shards: u32,
    /// Folder of plan, shards and results [default: results/EXPERIMENT].
    #[arg(long, short, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// What to change.
    #[command(flatten)]
    pub changes: ChangeArgs,
    /// Threads of each shard, and of the short renders that tell what work costs [default: all cores].
    #[arg(long, value_name = "T", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// Discard another plan that the folder holds, and its shards.
    #[arg(long)]
    pub fresh: bool,
}

/// `neumann merge`.
#[derive(Clone, Debug, Args)]
pub struct MergeArgs {
    /// The folder of a plan and its shards.
    pub dir: PathBuf,
    /// Threads [default: all cores].
    #[arg(long, value_name = "T", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// Replace results of another configuration, or of more replicates, that the folder holds.
    #[arg(long)]
    pub fresh: bool,
    /// Take shards that other builds, or those for other architectures, have rendered: bits may differ.
    #[arg(long)]
    pub allow_foreign: bool,
    /// Exit with 0 even if non-finite samples occurred.
    #[arg(long)]
    pub allow_invalid: bool,
}

/// `neumann submit`.
#[derive(Clone, Debug, Args)]
pub struct SubmitArgs {
    /// An experiment's name (see `neumann list experiments`) or a .toml file.
    pub experiment: String,
    /// What runs the shards.
    #[arg(long, value_name = "ENGINE")]
    pub engine: Engine,
    /// How many shards, where there is no plan yet.
    #[arg(long, value_name = "N", value_parser = at_least::<1>)]
    pub shards: Option<u32>,
    /// Folder of plan, shards and results [default: results/EXPERIMENT].
    #[arg(long, short, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// What to change.
    #[command(flatten)]
    pub changes: ChangeArgs,
    /// Threads of each shard [default: all cores].
    #[arg(long, value_name = "T", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// Slurm's partition [default: the cluster's].
    #[arg(long, value_name = "NAME")]
    pub partition: Option<String>,
    /// The longest time that a shard may take [default: three times what short renders say, and seven minutes].
    #[arg(long, value_name = "MINUTES", value_parser = clap::value_parser!(u64).range(1..))]
    pub minutes: Option<u64>,
    /// Hosts for GNU parallel, such as a,b (: is this one) [default: this one].
    #[arg(long, value_name = "LIST")]
    pub hosts: Option<String>,
    /// Shards at once, for parallel on each host [default: 1], for kubernetes of all [default: all].
    #[arg(long, value_name = "J", value_parser = at_least::<1>)]
    pub jobs: Option<u32>,
    /// The image of Kubernetes' containers, which holds the program.
    #[arg(long, value_name = "NAME")]
    pub image: Option<String>,
    /// The persistent volume claim that Kubernetes mounts at the folder of results.
    #[arg(long, value_name = "NAME")]
    pub claim: Option<String>,
    /// The program as those machines find it [default: where this one is].
    #[arg(long, value_name = "PATH")]
    pub program: Option<String>,
    /// Have the engine run what was written.
    #[arg(long)]
    pub go: bool,
}
