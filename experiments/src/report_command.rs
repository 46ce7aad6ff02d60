//! `neumann report`: the report and the plots of finished results, made again.

use crate::budget;
use crate::cli::{ReportArgs, print};
use crate::error::{Error, Status};
use crate::manifest::{self, MANIFEST, StoredManifest};
use crate::output::Folder;
use crate::plan::Plan;
use crate::progress::{Verbosity, while_loading};
use crate::shards::plan::FILE;
use crate::source::Source;
use crate::states::States;
use crate::stop::Stop;
use crate::{report, run_command, runner};
use integrators::Methods;
use std::path::Path;

/// Writes report and plots again from what was rendered. Images, records and what the manifest tells of the run stay as they are.
///
/// # Errors
/// If the folder holds no finished results, one of its scenes was edited since, or what was rendered is not kept any more.
pub fn report(args: &ReportArgs, methods: &Methods, verbosity: Verbosity, stop: &Stop) -> Result<Status, Error> {
    let path = &args.dir;
    let StoredManifest { manifest, mut files } = finished(path)?;
    // Results of earlier versions have the name of their folder.
    let folder_name = || path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let name = Some(manifest.name.clone()).filter(|name| !name.is_empty()).unwrap_or_else(folder_name);
    let source = Source::known(&name, manifest.file.clone(), "");
    let mut plan = while_loading(verbosity, || Plan::new(&source, manifest.experiment.clone(), methods))?;
    if let Some(difference) = manifest::difference(&manifest, &plan) {
        return Err(Error::usage(format!(
            "{} holds results of something else ({difference}); undo that, or run the experiment again",
            path.display()
        )));
    }
    let mut states = States::finished(path);
    let pool = budget::pool(None)?;
    let mut folder = Folder::open(path)?;
    let mut outcome = pool.install(|| {
        runner::compose(&mut plan, methods, &mut states, verbosity, stop)?;
        runner::run(&mut plan, &mut states, verbosity, stop)
    })?;
    if let Some(signal) = stop.signal() {
        return Err(Error::Interrupted(signal));
    }
    outcome.renders.clear();
    let result = run_command::compared(&plan, outcome, manifest)?;
    report::write(folder.staging(), &result)?;
    files.extend(folder.files()?);
    files.sort();
    files.dedup();
    manifest::write_manifest(&folder.staging().join(MANIFEST), &result.manifest, files)?;
    folder.commit()?;
    if verbosity == Verbosity::Normal {
        print(&format!("{}\n", path.join("report.html").display()))?;
    }
    Ok(Status::Done)
}

/// The manifest of finished results that were rendered here.
fn finished(path: &Path) -> Result<StoredManifest, Error> {
    let refused = |why: &str| Err(Error::usage(format!("{} {why}", path.display())));
    let Some(stored) = manifest::read_manifest(&path.join(MANIFEST)) else {
        return match path.is_dir() {
            true if path.join(FILE).exists() => refused(
                "holds a plan whose shards are not merged; `neumann merge` of that folder writes results and report",
            ),
            true => refused("holds no results of neumann; give a folder that `neumann run` has written"),
            false => refused("is no folder; give one that `neumann run` has written, such as results/comparison"),
        };
    };
    if !stored.manifest.complete || States::begun(path).is_some() {
        return refused(
            "holds results of a run that has not ended; the same `neumann run` goes on, and writes its report",
        );
    }
    if !stored.manifest.shards.is_empty() && path.join(FILE).exists() {
        return refused(
            "holds results of shards, which have what a report is made of; `neumann merge` of that folder writes it again \
             while they are there",
        );
    }
    Ok(stored)
}
