//! `neumann run`: an experiment from its file to its folder of results.

use crate::cli::{ChangeArgs, RunArgs};
use crate::config::{self, Experiment, Reference, Samplers, Sizes};
use crate::error::{Error, Status};
use crate::export::exr::{ImageMeta, LayerSelection, write_measurement};
use crate::export::png::write_contact_sheet;
use crate::export::pyramid;
use crate::export::write_atomically;
use crate::live::{Display, Live};
use crate::machine::Began;
use crate::manifest::MANIFEST;
use crate::output::Folder;
use crate::plan::Plan;
use crate::progress::{Verbosity, while_loading};
use crate::result::{ExperimentResult, Manifest, SceneTruth};
use crate::runner::Outcome;
use crate::settings::Assignment;
use crate::source::Source;
use crate::states::States;
use crate::stop::Stop;
use crate::{
    agreement, budget, choice, convergence, fireflies, manifest, output, ratio, record, reference, report, runner,
    settings, shard_command, shards, states, submit_command,
};
use integrators::{Methods, Part};
use std::path::{Path, PathBuf};
pub(crate) use words::tell;

mod words;

/// Runs an experiment and writes its results.
///
/// # Errors
/// If anything asked for is impossible: found out before any ray is traced, but for a disk that fills up.
pub fn run(args: &RunArgs, methods: &Methods, verbosity: Verbosity, stop: &Stop) -> Result<Status, Error> {
    if let Some(shard) = args.shard {
        return shard_command::run(args, shard, methods, verbosity, stop);
    }
    let began = Began::now();
    let (source, experiment) = open(&args.experiment, &args.changes)?;
    let mut plan = while_loading(verbosity, || Plan::new(&source, experiment, methods))?;
    let live = args.live.as_ref().map(|address| Live::open(address.as_deref())).transpose()?;
    let path = args.out.clone().unwrap_or_else(|| PathBuf::from("results").join(&plan.name));
    let mut folder = Folder::open(&path)?;
    let former = former_results(&path, &plan, args.fresh)?;

    let pool = budget::pool(args.threads)?;
    let threads = pool.current_num_threads();
    let mut states = States::open(&path, args.save_every);
    states.create()?;
    if args.fresh {
        states.clear()?;
    }
    states.begin(&manifest::manifest(&plan, Vec::new(), threads, began, false))?;
    let mut outcome = pool.install(|| {
        runner::compose(&mut plan, methods, &mut states, verbosity, stop)?;
        runner::run(&mut plan, &mut states, Display { verbosity, live }, stop)
    })?;
    if let (Some(signal), true) = (stop.signal(), former.as_ref().is_some_and(|f| f.complete)) {
        tell!("stopped early: the complete results in {} are kept; {GO_ON}", path.display());
        return Ok(Status::Interrupted(signal));
    }
    if let (Some(signal), true) = (stop.signal(), outcome.methods.is_empty() && outcome.integrals.is_empty()) {
        tell!("stopped before any method's first replicate; {GO_ON}");
        return Ok(Status::Interrupted(signal));
    }
    let complete = stop.signal().is_none();
    let renders = std::mem::take(&mut outcome.renders);
    let result = compared(&plan, outcome, manifest::manifest(&plan, renders, threads, began, complete))?;
    write_all(&mut folder, &result).map_err(|error| {
        let kept = path.join(states::FOLDER);
        Error::usage(format!(
            "{error}; all that was rendered is kept in {}: once there is room, {GO_ON}",
            kept.display()
        ))
    })?;
    if complete {
        states.end()?;
    }
    tell(&result, &path, verbosity)?;
    if stop.signal().is_some() {
        tell!("stopped early: {} holds what was complete; {GO_ON}", path.display());
    }
    Ok(status(&result, args, stop))
}

/// What follows from what was measured.
pub(crate) fn compared(plan: &Plan, outcome: Outcome, manifest: Manifest) -> Result<ExperimentResult, Error> {
    let Outcome { methods, integrals, references, sequences, .. } = outcome;
    let (mut agreement, mut ratios) = (Vec::new(), Vec::new());
    for scene in &plan.scenes {
        let of_scene: Vec<_> = methods.iter().filter(|m| m.scene == scene.name).collect();
        agreement.extend(agreement::compare(&of_scene));
        ratios.extend(ratio::of_scene(&of_scene));
    }
    let mut fireflies = Vec::new();
    for result in &methods {
        let scene = plan.scenes.iter().find(|scene| scene.name == result.scene);
        let Some(scene) = scene else { continue };
        if let Some(planned) = plan.methods_in(scene).find(|planned| planned.label == result.label) {
            fireflies.extend(fireflies::records(plan, scene, planned, result)?);
        }
    }
    let choices = choice::gains(plan, &methods);
    let slopes = methods.iter().flat_map(convergence::slopes).collect();
    let (name, experiment) = (plan.name.clone(), plan.experiment.clone());
    Ok(ExperimentResult {
        name,
        experiment,
        methods,
        agreement,
        slopes,
        ratios,
        references,
        choices,
        sequences,
        integrals,
        fireflies,
        manifest,
    })
}

/// An experiment as it is found, and with the changes that flags make.
///
/// # Errors
/// If there is none, or it cannot be read or changed.
pub(crate) fn open(name_or_path: &str, changes: &ChangeArgs) -> Result<(Source, Experiment), Error> {
    let mut source = Source::open(name_or_path)?;
    let experiment = changed(source.parse()?, changes)?;
    for (key, flag) in flags(changes, &experiment) {
        source.changed_by(&key, flag);
    }
    Ok((source, experiment))
}

pub(crate) fn changed(experiment: Experiment, args: &ChangeArgs) -> Result<Experiment, Error> {
    let mut experiment = settings::change_experiment(experiment, &args.set)?;
    experiment.until = args.until.or(experiment.until);
    experiment.max_spp = args.max_spp.or(experiment.max_spp);
    // Seconds are a limit beside samples where an error is the budget, and else the other budget.
    let both = experiment.until.is_some();
    if let Some(seconds) = args.seconds {
        (experiment.seconds, experiment.spp) = (Some(seconds), experiment.spp.filter(|_| both));
    }
    if let Some(spp) = args.spp {
        (experiment.spp, experiment.seconds) = (Some(spp), experiment.seconds.filter(|_| both));
    }
    if let Some(file) = &args.reference {
        let file = std::path::absolute(file).unwrap_or_else(|_| file.clone());
        experiment.reference = Some(Reference::of_file(file.to_string_lossy().into_owned()));
    }
    if let Some((width, height)) = args.size {
        experiment.size = Some(Sizes(vec![[width, height]]));
    }
    if let Some(name) = &args.sampler {
        experiment.sampler = Samplers(vec![config::sampler(name)?]);
    }
    experiment.replicates = args.replicates.unwrap_or(experiment.replicates);
    experiment.max_order = args.max_order.unwrap_or(experiment.max_order);
    experiment.seed = args.seed.unwrap_or(experiment.seed);
    Ok(experiment)
}

/// The keys that flags change, and the flags as faults are told of them.
fn flags(args: &ChangeArgs, experiment: &Experiment) -> Vec<(String, String)> {
    let number = |key: &str, value: Option<String>| {
        let name = key.replace('_', "-");
        value.map(|value| (key.to_owned(), format!("--{name} {value}")))
    };
    let given = [
        number("seconds", args.seconds.map(|s| s.to_string())),
        number("spp", args.spp.map(|n| n.to_string())),
        number("max_spp", args.max_spp.map(|n| n.to_string())),
        number("replicates", args.replicates.map(|r| r.to_string())),
        number("max_order", args.max_order.map(|k| k.to_string())),
        args.until.map(|_| ("until".to_owned(), "--until".to_owned())),
        args.size.map(|(width, height)| ("size".to_owned(), format!("--size {width}x{height}"))),
        args.reference.as_ref().map(|file| ("reference".to_owned(), format!("--reference {}", file.display()))),
        number("sampler", args.sampler.clone()),
    ];
    let told = |set: &Assignment| {
        let keys = settings::keys(set, experiment).into_iter();
        keys.map(|key| (key, format!("--set {set}"))).collect::<Vec<_>>()
    };
    args.set.iter().flat_map(told).chain(given.into_iter().flatten()).collect()
}

/// What to do after an end before the end.
const GO_ON: &str = "the same command, without --fresh, goes on from there";

/// The manifest of an earlier run of the same configuration in this folder, which this run replaces.
pub(crate) fn former_results(path: &Path, plan: &Plan, fresh: bool) -> Result<Option<Manifest>, Error> {
    let former = former_manifest(path)?;
    if !fresh {
        check_former(path, former.as_ref(), plan)?;
    }
    Ok(former)
}

/// The manifest of an earlier run in this folder, which has to be one for results: empty, or with some of them, or with a plan.
fn former_manifest(path: &Path) -> Result<Option<Manifest>, Error> {
    let former = manifest::read_manifest(&path.join(MANIFEST)).map(|stored| stored.manifest);
    let states = States::are_alone(path);
    let is_ours = |entry: &std::fs::DirEntry| {
        let name = entry.file_name();
        name.to_string_lossy().starts_with(output::HIDDEN)
            || (states && name == states::FOLDER)
            || [shards::FOLDER, submit_command::FOLDER].iter().any(|ours| name == *ours)
    };
    let foreign = || std::fs::read_dir(path).is_ok_and(|entries| entries.flatten().any(|entry| !is_ours(&entry)));
    if former.is_none() && !path.join(shards::plan::FILE).exists() && foreign() {
        return Err(Error::usage(format!(
            "{} holds files, but no results of neumann; give another folder with --out",
            path.display()
        )));
    }
    Ok(former)
}

/// Refuses to replace results of another configuration, and complete ones of more replicates.
fn check_former(path: &Path, former: Option<&Manifest>, plan: &Plan) -> Result<(), Error> {
    let (folder, begun) = (path.display(), States::begun(path));
    // An unfinished run was allowed to replace the results before it.
    if let Some(difference) = begun.as_ref().or(former).and_then(|last| manifest::difference(last, plan)) {
        return Err(Error::usage(format!(
            "{folder} holds results of another configuration ({difference}); replace them with --fresh, or leave them where they are and \
             write to another folder"
        )));
    }
    let same = former.filter(|f| f.complete && manifest::difference(f, plan).is_none());
    let (there, asked) = (same.map_or(0, |f| f.experiment.replicates), plan.experiment.replicates);
    if there > asked {
        return Err(Error::usage(format!(
            "{folder} holds {there} replicates, more than the {asked} asked for; ask for at least {there}, give another folder \
             with --out, or replace them with --fresh"
        )));
    }
    Ok(())
}

/// Writes all files, and puts them in place once they are complete.
pub(crate) fn write_all(folder: &mut Folder, result: &ExperimentResult) -> Result<(), Error> {
    let staging = folder.staging();
    for method in &result.methods {
        let scene_folder = staging.join(&method.scene);
        std::fs::create_dir_all(&scene_folder).map_err(|source| Error::Io {
            action: "write",
            path: scene_folder.clone(),
            source,
            mend: "check the disk",
        })?;
        let scene = result.manifest.scenes.iter().find(|s| s.name == method.scene);
        let meta = ImageMeta {
            software: format!("neumann {}", result.manifest.neumann),
            scene: method.scene.clone(),
            scene_hash: scene.map(|s| s.hash.clone()).unwrap_or_default(),
            method: method.method.clone(),
            settings: method.settings.clone(),
            sampler: method.sampler.to_string(),
            filter: scene.map(|s| s.filter.clone()).unwrap_or_default(),
            seed: result.experiment.seed,
        };
        let image = scene_folder.join(format!("{}.exr", method.label));
        write_measurement(&image, &method.measurement, &meta, LayerSelection::ALL)?;
        if method.measurement.parts.iter().any(Part::is_strategy) {
            let sheet = scene_folder.join(format!("{}_strategies.png", method.label));
            pyramid::write(&sheet, &method.measurement, &format!("{} in {}", method.label, method.scene))?;
        }
        let sheet = scene_folder.join(format!("{}.png", method.label));
        write_contact_sheet(&sheet, &method.measurement, &format!("{} in {}", method.label, method.scene))?;
    }
    for SceneTruth { scene, truth } in result.references.iter().filter(|r| !r.truth.pooled.is_empty()) {
        let hash = result.manifest.scenes.iter().find(|s| s.name == *scene).map_or("", |s| s.hash.as_str());
        reference::file::write(
            &staging.join(format!("{scene}_reference.exr")),
            truth,
            scene,
            hash,
            result.experiment.seed,
        )?;
    }
    record::write_records(staging, result)?;
    let fireflies = fireflies::in_lines(&result.fireflies);
    write_atomically(&staging.join("fireflies.json"), fireflies.as_bytes())?;
    report::write(staging, result)?;
    let mut files = folder.files()?;
    files.push(MANIFEST.to_owned());
    files.sort();
    manifest::write_manifest(&staging.join(MANIFEST), &result.manifest, files)?;
    folder.commit()
}

pub(crate) fn status(result: &ExperimentResult, args: &RunArgs, stop: &Stop) -> Status {
    let mut status = Status::Done;
    let invalid = result.methods.iter().filter(|m| m.measurement.invalid.iter().any(|&n| n > 0));
    for method in invalid.filter(|_| !args.allow_invalid) {
        let what = budget::non_finite(&method.measurement, result.experiment.seed);
        tell!("error: {} in {}: {what}", method.label, method.scene);
        status = Status::Failed;
    }
    stop.signal().map_or(status, Status::Interrupted)
}
