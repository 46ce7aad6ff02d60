//! `neumann plan`: an experiment divided into shards.

use crate::budget;
use crate::cli::{PlanArgs, print};
use crate::config::Experiment;
use crate::error::{Error, NO_PLACE, Status};
use crate::plan::Plan;
use crate::progress::{Verbosity, while_loading};
use crate::run_command;
use crate::shards::plan::FILE;
use crate::shards::{self, FOLDER, ShardPlan, probe};
use crate::stop::Stop;
use integrators::Methods;
use std::path::{Path, PathBuf};

/// Divides an experiment, and says how to go on.
///
/// # Errors
/// If the experiment cannot be run or divided, or its folder has another one.
pub fn plan(args: &PlanArgs, methods: &Methods, verbosity: Verbosity, stop: &Stop) -> Result<Status, Error> {
    let (source, experiment) = run_command::open(&args.experiment, &args.changes)?;
    let mut plan = while_loading(verbosity, || Plan::new(&source, experiment, methods))?;
    check_budget(&plan.experiment)?;
    if let Some(open) = plan.methods.iter().find(|planned| planned.is_open()) {
        return Err(Error::usage(format!(
            "the runs of {0} are chosen by pilots, whose clocks would tell every machine something else; name them: --set \
             {0}.runs=path:0-1:0.5;light:2-8:0.5, as `neumann render -i composite` tells them",
            open.entry
        )));
    }
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from("results").join(&plan.name));
    run_command::former_results(&folder, &plan, args.fresh)?;
    let pool = budget::pool(args.threads)?;
    let units = pool.install(|| probe::units(&mut plan, stop))?;
    let origin = shards::origin(pool.current_num_threads());
    let made = ShardPlan::new(&source, &plan.experiment, origin, units, args.shards)?;
    let standing = standing(&folder, &made, args)?;
    let plan = match standing {
        Some(standing) => standing,
        None => {
            write(&folder, &made)?;
            made
        }
    };
    if verbosity == Verbosity::Normal {
        print(&told(&plan, &folder))?;
    }
    Ok(Status::Done)
}

/// The number of samples must not depend on a clock, nor on what other shards render.
fn check_budget(experiment: &Experiment) -> Result<(), Error> {
    let (what, mend) = match (experiment.until.is_some(), experiment.seconds.is_some()) {
        (true, _) => ("`until`, which asks after every replicate whether there are enough", ", and leave out `until`"),
        (false, true) => ("a budget in seconds, which each machine would turn into another number of samples", ""),
        _ => return Ok(()),
    };
    Err(Error::usage(format!(
        "an experiment with {what}, cannot be divided; give a number of samples instead, --spp N{mend}"
    )))
}

/// The plan that a folder has already, if it is of the same work.
fn standing(folder: &Path, made: &ShardPlan, args: &PlanArgs) -> Result<Option<ShardPlan>, Error> {
    if args.fresh || !folder.join(FILE).exists() {
        return Ok(None);
    }
    let standing = ShardPlan::read(folder)?;
    let count = standing.count();
    let other = standing.other_question(made);
    let other = other.or_else(|| (count != made.count()).then(|| format!("of {count} shards, not {}", made.count())));
    match other {
        None => Ok(Some(standing)),
        Some(difference) => Err(Error::usage(format!(
            "{} holds another plan ({difference}); go on with it by its program and its experiment, with all the \
             flags that it was made with, or give another folder with --out, or discard it and its shards by `neumann plan` with --fresh",
            folder.display()
        ))),
    }
}

/// Writes a plan in place of another one, whose shards are removed.
fn write(folder: &Path, plan: &ShardPlan) -> Result<(), Error> {
    let shards = folder.join(FOLDER);
    let failed = |action, path: &Path, source| {
        let path = path.to_owned();
        Error::Io { action, path, source, mend: NO_PLACE }
    };
    std::fs::create_dir_all(&shards).map_err(|source| failed("write", &shards, source))?;
    // First the plan: a shard at work then finds out that its own stands no more.
    plan.write(folder)?;
    for entry in std::fs::read_dir(&shards).map_err(|source| failed("read", &shards, source))?.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.ends_with(".shard") || name.ends_with(".shard.partial") {
            std::fs::remove_file(entry.path()).map_err(|source| failed("remove", &entry.path(), source))?;
        }
    }
    Ok(())
}

fn told(plan: &ShardPlan, folder: &Path) -> String {
    let of_shards: Vec<(f64, u64)> = (1..=plan.count()).map(|shard| plan.estimate(shard)).collect();
    let ends = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, 0.0_f64, 0.0), |(low, high, sum), x| (low.min(x), high.max(x), sum + x))
    };
    let (shortest, longest, seconds) = ends(&mut of_shards.iter().map(|shard| shard.0));
    let (smallest, largest, bytes) = ends(&mut of_shards.iter().map(|shard| shard.1 as f64 / 1e6));
    let (count, command) = (plan.count(), plan.command_of_all(folder));
    format!(
        "{count} shards of {shortest:.2} to {longest:.2} s on a machine like this, {seconds:.1} s in all; files of {smallest:.1} to \
         {largest:.1} MB, {bytes:.1} MB in all\n\
         each of them, in any order: {command} --shard 1/{count} (to {count}/{count}; in an array of tasks, --shard auto)\n\
         and then: neumann merge {}\n",
        shards::plan::quoted(&folder.to_string_lossy())
    )
}
