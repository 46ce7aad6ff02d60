//! `neumann merge`: the results of an experiment whose shards have been rendered, with the bits of a run in one piece.

use crate::cli::{MergeArgs, RunArgs};
use crate::error::{Error, Status};
use crate::machine::Began;
use crate::output::Folder;
use crate::plan::Plan;
use crate::progress::{Verbosity, while_loading};
use crate::shards::file::Look;
use crate::shards::folder::Found;
use crate::shards::{self, Foreign, ShardPlan, Shards};
use crate::states::States;
use crate::stop::Stop;
use crate::{budget, manifest, run_command, runner};
use integrators::Methods;
use std::path::Path;

/// If all is well at a second look.
const AGAIN: &str = "they have changed since; merge again";

/// Writes the results of a plan's shards, or says what is wrong with them.
///
/// # Errors
/// If there is no plan, or it is not this program's, or results cannot be written.
pub fn merge(args: &MergeArgs, methods: &Methods, verbosity: Verbosity, stop: &Stop) -> Result<Status, Error> {
    let began = Began::now();
    let path = &args.dir;
    let divided = ShardPlan::read(path)?;
    let pool = budget::pool(args.threads)?;
    let (threads, foreign) = (pool.current_num_threads(), Foreign::of_flag(args.allow_foreign));
    shards::check_origin(&divided, threads, foreign)?;
    let mut plan = while_loading(verbosity, || Plan::of_shards(&divided.source(), divided.experiment()?, methods))?;
    divided.check(&mut plan)?;
    let mut folder = Folder::open(path)?;
    run_command::former_results(path, &plan, args.fresh)?;
    let find = |look| pool.install(|| Shards::find(path, &divided, foreign, look));
    let shards = match find(Look::Records)? {
        Found::All(shards) => shards,
        // What else is wrong is told as well.
        Found::Faults(_) => return told(path, find(Look::Bytes)?),
    };
    let origins = shards.origins.clone();
    let mut states = States::of_shards(shards);
    // Bytes are checked as they are taken, so that they are read but once.
    let mut outcome = match pool.install(|| runner::run(&mut plan, &mut states, verbosity, stop)) {
        Ok(outcome) => outcome,
        Err(e) => {
            return match find(Look::Bytes)? {
                Found::All(_) => Err(e),
                faults => told(path, faults),
            };
        }
    };
    if let Some(signal) = stop.signal() {
        tell!("stopped early: nothing was written; the same command begins again");
        return Ok(Status::Interrupted(signal));
    }
    let renders = std::mem::take(&mut outcome.renders);
    let mut manifest = manifest::manifest(&plan, renders, threads, began, true);
    manifest.shards = origins;
    let result = run_command::compared(&plan, outcome, manifest)?;
    run_command::write_all(&mut folder, &result)?;
    run_command::tell(&result, path, verbosity)?;
    let flags = RunArgs { allow_invalid: args.allow_invalid, ..RunArgs::default() };
    Ok(run_command::status(&result, &flags, stop))
}

/// Says what is wrong with the shards.
fn told(path: &Path, found: Found) -> Result<Status, Error> {
    let faults = if let Found::Faults(faults) = found { faults.told.join("\n") } else { AGAIN.to_owned() };
    tell!("error: the shards in {} cannot be merged\n{faults}", path.display());
    Ok(Status::Failed)
}
