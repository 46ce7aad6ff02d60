//! `neumann submit`: the files by which an engine runs the shards of a plan that are not complete, and the merge.

use crate::budget;
use crate::cli::{PlanArgs, SubmitArgs, print};
use crate::error::{Error, NO_PLACE, Status};
use crate::export::write_atomically;
use crate::plan::Plan;
use crate::plan_command;
use crate::progress::Verbosity;
use crate::run_command;
use crate::shards::engines::{Engine, Task};
use crate::shards::file::Look;
use crate::shards::folder::Found;
use crate::shards::plan::{FILE, quoted};
use crate::shards::{self, Foreign, ShardPlan, Shards};
use crate::source::Source;
use crate::stop::Stop;
use integrators::Methods;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The folder of an engine's files and logs, in that of the results.
pub const FOLDER: &str = "submit";

/// Writes an engine's files, and has it run them if that is asked for. Where there is no plan it is made first.
///
/// # Errors
/// If there is no plan and none can be made, files cannot be written, or the engine is not there.
pub fn submit(args: &SubmitArgs, methods: &Methods, verbosity: Verbosity, stop: &Stop) -> Result<Status, Error> {
    args.engine.check(args)?;
    let source = Source::open(&args.experiment)?;
    let folder = args.out.clone().unwrap_or_else(|| PathBuf::from("results").join(&source.name));
    let plan = match folder.join(FILE).exists() {
        true => standing_plan(args, &folder, &source, methods)?,
        false => new_plan(args, &folder, methods, stop)?,
    };
    let folder = std::path::absolute(&folder).unwrap_or(folder);
    let missing =
        match budget::pool(args.threads)?.install(|| Shards::find(&folder, &plan, Foreign::Refused, Look::Bytes))? {
            Found::All(_) => {
                let merge = quoted(&folder.to_string_lossy());
                print(&format!("all {} shards are complete: neumann merge {merge}\n", plan.count()))?;
                return Ok(Status::Done);
            }
            Found::Faults(faults) if !faults.by_hand.is_empty() => {
                let told = faults.by_hand.join("\n");
                tell!("error: the shards in {} could not be merged, whatever is rendered\n{told}", folder.display());
                return Ok(Status::Failed);
            }
            Found::Faults(faults) => faults.missing,
        };
    let task = Task { plan: &plan, folder: &folder, program: program(args), missing: &missing, args };
    let files = args.engine.files(&task);
    let home = folder.join(FOLDER);
    let failed = |source| Error::Io { action: "write", path: home.clone(), source, mend: NO_PLACE };
    std::fs::create_dir_all(&home).map_err(failed)?;
    for (name, text) in &files {
        write_atomically(&home.join(name), text.as_bytes())?;
    }
    if !args.go {
        if verbosity == Verbosity::Normal {
            let names: Vec<&str> = files.iter().map(|(name, _)| *name).collect();
            let run = quoted(&home.join(files[0].0).to_string_lossy());
            print(&format!(
                "{} of {} shards are to be rendered; {} written to {}\nto have them rendered: sh {run} (or the same command with --go)\n",
                missing.len(),
                plan.count(),
                names.join(", "),
                home.display()
            ))?;
        }
        return Ok(Status::Done);
    }
    go(args.engine, &home.join(files[0].0))
}

/// Makes the plan.
fn new_plan(args: &SubmitArgs, folder: &Path, methods: &Methods, stop: &Stop) -> Result<ShardPlan, Error> {
    let Some(shards) = args.shards else {
        return Err(Error::usage(format!(
            "there is no plan in {}; say how many --shards it shall have",
            folder.display()
        )));
    };
    let (experiment, changes) = (args.experiment.clone(), args.changes.clone());
    let (out, threads) = (Some(folder.to_owned()), args.threads);
    let plan = PlanArgs { experiment, shards, out, changes, threads, fresh: false };
    plan_command::plan(&plan, methods, Verbosity::Quiet, stop)?;
    ShardPlan::read(folder)
}

/// The plan that is there. One that is not what flags say is refused, and one whose shards would all be refused: something that it follows
/// from was edited, or another program made it.
fn standing_plan(args: &SubmitArgs, folder: &Path, source: &Source, methods: &Methods) -> Result<ShardPlan, Error> {
    let divided = ShardPlan::read(folder)?;
    let other = |difference: String| {
        Error::usage(format!(
            "{} holds another plan ({difference}); leave out the flags to go on with it, give another folder with --out, or discard it \
             and its shards by `neumann plan` with --fresh",
            folder.display()
        ))
    };
    let (count, asked) = (divided.count(), args.shards.unwrap_or(divided.count()));
    if asked != count {
        return Err(other(format!("of {count} shards, not {asked}")));
    }
    let planned = divided.experiment()?;
    if run_command::changed(planned.clone(), &args.changes)? != planned {
        return Err(other("its experiment is not what these flags make of it".to_owned()));
    }
    divided.check_source(source)?;
    if args.program.is_none() {
        shards::check_origin(&divided, budget::pool(args.threads)?.current_num_threads(), Foreign::Refused)?;
    }
    divided.check(&mut Plan::new(&divided.source(), planned, methods)?)?;
    Ok(divided)
}

/// The program as a cluster's machines find it: where it is, or as the user says.
fn program(args: &SubmitArgs) -> String {
    let here = || std::env::current_exe().map_or("neumann".to_owned(), |path| path.to_string_lossy().into_owned());
    args.program.clone().unwrap_or_else(here)
}

/// Runs an engine's script.
fn go(engine: Engine, script: &Path) -> Result<Status, Error> {
    let tool = engine.tool();
    let paths = std::env::var_os("PATH").unwrap_or_default();
    if !std::env::split_paths(&paths).any(|folder| folder.join(tool).is_file()) {
        return Err(Error::usage(format!(
            "there is no {tool} on the PATH; run {} where there is one, or choose another --engine",
            script.display()
        )));
    }
    let status = Command::new("sh").arg(script).status();
    match status {
        Ok(status) if status.success() => Ok(Status::Done),
        Ok(status) => {
            let script = script.display();
            tell!(
                "error: {script} ended with {status}; what it says stands above, and submitting again runs what is missing then"
            );
            Ok(Status::Failed)
        }
        Err(e) => Err(Error::usage(format!("cannot start {}: {e}", script.display()))),
    }
}
