//! `neumann run`: an experiment from its file to its folder of results.

use crate::cli::{RunArgs, print};
use crate::config::{self, Experiment, Source};
use crate::error::{Error, Status};
use crate::export::exr::{ImageMeta, LayerSelection, write_measurement};
use crate::export::png::write_contact_sheet;
use crate::output::Folder;
use crate::plan::Plan;
use crate::progress::Verbosity;
use crate::record::{self, MANIFEST, StoredManifest};
use crate::result::{ExperimentResult, Verdict};
use crate::stop::Stop;
use crate::{agreement, budget, convergence, report, runner, settings};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Runs an experiment and writes its results.
///
/// # Errors
/// If anything asked for is impossible: found out before any ray is traced, but for a disk that fills up.
pub fn run(args: &RunArgs, verbosity: Verbosity, stop: &Stop) -> Result<Status, Error> {
    let started = SystemTime::now();
    let source = Source::open(&args.experiment)?;
    let experiment = changed(source.parse()?, args)?;
    let mut plan = Plan::new(&source, experiment)?;
    let path = args.out.clone().unwrap_or_else(|| PathBuf::from("results").join(&plan.name));
    let former = former_results(&path, &plan, args)?;
    let folder = Folder::open(&path)?;

    let pool = budget::pool(args.threads)?;
    let methods = pool.install(|| runner::run(&mut plan, verbosity, stop))?;
    if let (Some(signal), true) = (stop.signal(), former.as_ref().is_some_and(|f| f.manifest.complete)) {
        eprintln!("stopped early: the complete results in {} are kept", path.display());
        return Ok(Status::Interrupted(signal));
    }
    let mut agreements = Vec::new();
    for scene in &plan.scenes {
        let of_scene: Vec<_> = methods.iter().filter(|m| m.scene == scene.name).collect();
        agreements.extend(agreement::compare(&of_scene));
    }
    let slopes = methods.iter().flat_map(convergence::slopes).collect();
    let manifest = record::manifest(&plan, pool.current_num_threads(), started, stop.signal().is_none());
    let (name, experiment) = (plan.name.clone(), plan.experiment.clone());
    let result = ExperimentResult { name, experiment, methods, agreement: agreements, slopes, manifest };

    write_all(&folder, &plan, &result)?;
    folder.commit(&former.map(|f| f.files).unwrap_or_default(), MANIFEST)?;
    if verbosity == Verbosity::Normal {
        print(&summary(&result, &path))?;
    }
    if stop.signal().is_some() {
        eprintln!("stopped early: {} holds what was complete", path.display());
    }
    Ok(status(&result, args, stop))
}

/// The experiment with the changes that flags make.
fn changed(experiment: Experiment, args: &RunArgs) -> Result<Experiment, Error> {
    let mut experiment = settings::change_experiment(experiment, &args.set)?;
    if let Some(seconds) = args.seconds {
        (experiment.seconds, experiment.spp) = (Some(seconds), None);
    }
    if let Some(spp) = args.spp {
        (experiment.spp, experiment.seconds) = (Some(spp), None);
    }
    if let Some((width, height)) = args.size {
        experiment.size = Some([width, height]);
    }
    if let Some(name) = &args.sampler {
        experiment.sampler = config::sampler(name)?;
    }
    experiment.replicates = args.replicates.unwrap_or(experiment.replicates);
    experiment.max_order = args.max_order.unwrap_or(experiment.max_order);
    experiment.seed = args.seed.unwrap_or(experiment.seed);
    Ok(experiment)
}

/// The results of an earlier run of the same configuration in this folder, which this run replaces.
fn former_results(path: &Path, plan: &Plan, args: &RunArgs) -> Result<Option<StoredManifest>, Error> {
    // A run that was killed leaves a hidden folder of unfinished files behind, which is nobody's result.
    let is_result = |entry: &std::fs::DirEntry| !entry.file_name().to_string_lossy().starts_with(".neumann-");
    let is_empty = std::fs::read_dir(path).map_or(true, |entries| !entries.flatten().any(|entry| is_result(&entry)));
    if is_empty {
        return Ok(None);
    }
    let Some(former) = record::read_manifest(path) else {
        return Err(Error::usage(format!(
            "{} holds files, but no results of neumann; give another folder with --out",
            path.display()
        )));
    };
    if let Some(difference) = record::difference(&former.manifest, plan).filter(|_| !args.fresh) {
        return Err(Error::usage(format!(
            "{} holds results of another configuration ({difference}); give another folder with --out, or replace them \
             with --fresh",
            path.display()
        )));
    }
    Ok(Some(former))
}

fn write_all(folder: &Folder, plan: &Plan, result: &ExperimentResult) -> Result<(), Error> {
    let staging = folder.staging();
    for method in &result.methods {
        let scene_folder = staging.join(&method.scene);
        std::fs::create_dir_all(&scene_folder).map_err(|source| Error::Io {
            action: "write",
            path: scene_folder.clone(),
            source,
            mend: "check the disk",
        })?;
        let hash = plan.scenes.iter().find(|s| s.name == method.scene).map(|s| s.scene.hash.clone());
        let meta = ImageMeta {
            software: format!("neumann {}", result.manifest.neumann),
            scene: method.scene.clone(),
            scene_hash: hash.unwrap_or_default(),
            method: method.method.clone(),
            settings: method.settings.clone(),
            sampler: result.experiment.sampler.to_string(),
            seed: result.experiment.seed,
        };
        let image = scene_folder.join(format!("{}.exr", method.label));
        write_measurement(&image, &method.measurement, &meta, LayerSelection::ALL)?;
        let sheet = scene_folder.join(format!("{}.png", method.label));
        write_contact_sheet(&sheet, &method.measurement, &format!("{} in {}", method.label, method.scene))?;
    }
    record::write_records(&staging.join("records.csv"), result)?;
    report::write(staging, result)?;
    record::write_manifest(folder, &result.manifest)
}

fn status(result: &ExperimentResult, args: &RunArgs, stop: &Stop) -> Status {
    let mut status = Status::Done;
    let invalid = result.methods.iter().filter(|m| m.measurement.invalid.iter().any(|&n| n > 0));
    for method in invalid.filter(|_| !args.allow_invalid) {
        let what = budget::non_finite(&method.measurement, result.experiment.seed);
        eprintln!("error: {} in {}: {what}", method.label, method.scene);
        status = Status::Failed;
    }
    stop.signal().map_or(status, Status::Interrupted)
}

fn summary(result: &ExperimentResult, path: &Path) -> String {
    let differ = result.agreement.iter().filter(|row| row.verdict == Verdict::Differ);
    let mut text = String::new();
    for row in differ {
        text += &format!(
            "{} and {} differ in {}, order {}: {:.6e} and {:.6e}, {:.1} standard errors, {} of {} blocks\n",
            row.a,
            row.b,
            row.scene,
            row.order.label(),
            row.mean_a,
            row.mean_b,
            row.t.abs(),
            row.rejected,
            row.blocks
        );
    }
    if text.is_empty() && !result.agreement.is_empty() {
        text += "no two methods differ in any order\n";
    }
    text + &format!("{:.1} s; see {}\n", result.manifest.seconds, path.join("report.html").display())
}
