//! `neumann verify`: do the methods agree with one another, and with the truth where it is known?
//!
//! Every method that can render a scene is run on random numbers of its own, and every pair is compared order by order, as
//! [`crate::agreement`] does; where a scene has a closed form, that is one of the methods. A pass says little without what it would
//! have found: so the bias that each comparison finds nine times out of ten is beside it.

use crate::agreement;
use crate::cli::{VerifyArgs, print};
use crate::config::{Experiment, MethodEntry, Sizes};
use crate::error::{Error, Status};
use crate::plan::Plan;
use crate::progress::{Progress, Verbosity, while_loading};
use crate::result::{AgreementRow, MethodResult, Verdict};
use crate::source::{Source, no_scene};
use crate::states::States;
use crate::stop::Stop;
use crate::stress::{self, Amount, Stressed};
use crate::subject::small_size;
use crate::{budget, runner};
use integrators::{Methods, composite};
use meters::Metered;
use scenes::{LoadOptions, Skip};
use serde::Serialize;
use std::collections::BTreeMap;
use words::sentence;

pub use words::in_words;

mod meters;
mod words;

/// The last order where neither the command line nor the scene names one.
const MAX_ORDER: usize = 8;

/// What was found in a scene, and what `--json` prints of it.
#[derive(Serialize)]
pub struct Findings {
    scene: String,
    methods: Vec<String>,
    /// Methods that cannot render the scene, each with the reason.
    left_out: Vec<String>,
    size: [u32; 2],
    spp: u64,
    replicates: u32,
    /// What single methods cannot carry here.
    missing_light: BTreeMap<String, Vec<String>>,
    /// What bias single methods have.
    biases: BTreeMap<String, &'static str>,
    /// Non-finite samples of each method.
    invalid: BTreeMap<String, u64>,
    pairs: Vec<Pair>,
    /// The irradiance of every order at a point, where it is known.
    meters: Vec<Metered>,
    /// What other units and places do to it; only if that was asked for.
    stress: Vec<Stressed>,
    holds: bool,
    sentence: String,
}

impl Findings {
    /// Whether nothing but differences between methods contradicts that all are right.
    pub fn is_sound(&self) -> bool {
        self.invalid.values().all(|&n| n == 0)
            && self.meters.iter().all(|row| row.holds)
            && self.stress.iter().all(|row| row.holds)
    }

    /// The comparisons that found a difference.
    pub fn differences(&self) -> impl Iterator<Item = &Pair> {
        self.pairs.iter().filter(|pair| pair.verdict == Verdict::Differ)
    }
}

/// A comparison of two methods in one order.
#[derive(Serialize)]
pub struct Pair {
    a: String,
    b: String,
    order: String,
    verdict: Verdict,
    /// The bias of the order's mean that would have been found nine times out of ten; `null` where none would.
    detectable_bias: Option<f64>,
    mean_a: f64,
    mean_b: f64,
    t: f64,
    p: f64,
    blocks: usize,
    rejected: usize,
}

impl Pair {
    /// Both methods and the order.
    pub fn name(&self) -> (&str, &str, &str) {
        (&self.a, &self.b, &self.order)
    }

    /// By how much the image means differ, and the standard error of that \[W/(m²·sr)\].
    pub fn difference(&self) -> (f64, f64) {
        let difference = self.mean_a - self.mean_b;
        (difference, if self.t == 0.0 { f64::INFINITY } else { (difference / self.t).abs() })
    }
}

/// Verifies a scene, or all built-in ones.
///
/// # Errors
/// If a scene cannot be loaded, or fewer than two methods can render it.
pub fn verify(args: &VerifyArgs, methods: &Methods, verbosity: Verbosity, stop: &Stop) -> Result<Status, Error> {
    let scenes: Vec<&str> = match &args.scene {
        Some(scene) => vec![scene],
        None => scenes::builtin_names().to_vec(),
    };
    let pool = budget::pool(args.threads)?;
    let mut all = Vec::new();
    for scene in scenes {
        let findings = pool.install(|| findings(scene, args, methods, verbosity, stop))?;
        if !args.json {
            print(&in_words(&findings))?;
        }
        all.push(findings);
        if let Some(signal) = stop.signal() {
            return Ok(Status::Interrupted(signal));
        }
    }
    if args.json {
        print(&(serde_json::to_string_pretty(&all).unwrap_or_default() + "\n"))?;
    }
    Ok(if all.iter().all(|findings| findings.holds) { Status::Done } else { Status::Failed })
}

/// What the methods make of a scene, in the current thread pool.
///
/// # Errors
/// If it cannot be loaded, or fewer than two methods can render it.
pub fn findings(
    scene: &str,
    args: &VerifyArgs,
    methods: &Methods,
    verbosity: Verbosity,
    stop: &Stop,
) -> Result<Findings, Error> {
    let (mut plan, left_out) = while_loading(verbosity, || plan(scene, args, methods))?;
    let results = runner::run(&mut plan, &mut States::none(), verbosity, stop)?.methods;
    let rows = agreement::compare(&results.iter().collect::<Vec<_>>());
    let methods: Vec<_> = plan.methods.iter().map(|planned| &*planned.method).collect();
    let meters = meters::meters(scene, &methods, (plan.experiment.max_order, args.replicates, args.seed), stop)?;
    let stress = if args.stress { stressed(scene, args, plan, &results, verbosity, stop)? } else { Vec::new() };
    Ok(gathered(&results, &rows, left_out, meters, stress))
}

/// What other units and places do to a scene, by the methods that were compared and a quarter of their samples.
fn stressed(
    scene: &str,
    args: &VerifyArgs,
    plan: Plan,
    results: &[MethodResult],
    verbosity: Verbosity,
    stop: &Stop,
) -> Result<Vec<Stressed>, Error> {
    let Some(first) = results.first() else { return Ok(Vec::new()) };
    let samples = first.measurement.samples_per_replicate.div_ceil(4);
    let max_order = plan.experiment.max_order;
    // A closed form is not known of a scene that was changed.
    let methods: Vec<_> =
        plan.methods.into_iter().map(|p| p.method).filter(|m| m.name() != integrators::exact::NAME).collect();
    drop(plan.scenes);
    let subject = stress::Subject {
        scene,
        size: (first.measurement.width, first.measurement.height),
        methods: &methods,
        max_order,
        seed: args.seed,
        amount: Amount { samples, replicates: args.replicates },
    };
    let mut progress = Progress::new(subject.work(), verbosity);
    subject.stress(&mut progress, stop)
}

/// The experiment that this is: every method that can render the scene, with its defaults.
fn plan(scene: &str, args: &VerifyArgs, methods: &Methods) -> Result<(Plan, Vec<String>), Error> {
    let loaded = scenes::load(scene, &LoadOptions { size: None, skip: Skip::Unneeded })
        .map_err(|error| no_scene(scene, error))?;
    let (mut able, mut left_out) = (Vec::new(), Vec::new());
    // A composite has nothing but its parts, which are here themselves.
    for name in methods.names().into_iter().filter(|name| *name != composite::NAME) {
        match methods.build(name, &serde_json::Value::Null)?.unsupported(&loaded) {
            None => able.push(MethodEntry { name: name.to_owned(), label: None, settings: toml::Table::new() }),
            Some(reason) => left_out.push(format!("{name}: {reason}")),
        }
    }
    if able.len() < 2 {
        return Err(Error::usage(format!(
            "{scene}: only one method can render it, so there is nothing to compare it with; {}",
            left_out.join("; ")
        )));
    }
    let (width, height) = args.size.unwrap_or_else(|| small_size(&loaded.camera));
    let experiment = Experiment {
        title: String::new(),
        description: String::new(),
        scenes: vec![scene.to_owned()],
        methods: able,
        max_order: args.max_order.or(loaded.series.max_order).unwrap_or(MAX_ORDER),
        tail: false,
        spp: args.seconds.is_none().then_some(args.spp),
        seconds: args.seconds,
        replicates: args.replicates,
        until: None,
        max_spp: None,
        seed: args.seed,
        sampler: Default::default(),
        size: Some(Sizes(vec![[width, height]])),
        layers: Vec::new(),
        lpe: BTreeMap::new(),
        reference: None,
        metrics: Vec::new(),
        time_to_error: Vec::new(),
        marginal_cost: false,
        convergence: None,
        integrals: None,
    };
    drop(loaded);
    Ok((Plan::new(&Source::of_command("verify"), experiment, methods)?, left_out))
}

fn gathered(
    results: &[MethodResult],
    rows: &[AgreementRow],
    left_out: Vec<String>,
    meters: Vec<Metered>,
    stress: Vec<Stressed>,
) -> Findings {
    let pairs: Vec<Pair> = rows.iter().map(pair).collect();
    let named = |value: &dyn Fn(&MethodResult) -> Option<Vec<String>>| {
        results.iter().filter_map(|r| Some((r.label.clone(), value(r)?))).collect::<BTreeMap<_, _>>()
    };
    let invalid: BTreeMap<String, u64> =
        results.iter().map(|r| (r.label.clone(), r.measurement.invalid.iter().sum())).collect();
    let first = results.first();
    let mut findings = Findings {
        scene: first.map(|r| r.scene.clone()).unwrap_or_default(),
        methods: results.iter().map(|r| r.label.clone()).collect(),
        left_out,
        size: first.map_or([0, 0], |r| [r.measurement.width, r.measurement.height]),
        spp: first.map_or(0, |r| r.measurement.samples()),
        replicates: first.map_or(0, |r| r.measurement.replicates),
        missing_light: named(&|r| (!r.missing_light.is_empty()).then(|| r.missing_light.clone())),
        biases: results.iter().filter_map(|r| Some((r.label.clone(), r.bias.label()?))).collect(),
        sentence: sentence(rows, &invalid),
        invalid,
        pairs,
        meters,
        stress,
        holds: false,
    };
    findings.holds = findings.is_sound() && findings.differences().next().is_none();
    findings
}

fn pair(row: &AgreementRow) -> Pair {
    Pair {
        a: row.a.clone(),
        b: row.b.clone(),
        order: row.order.label(),
        verdict: row.verdict,
        detectable_bias: row.detectable_bias.is_finite().then_some(row.detectable_bias),
        mean_a: row.mean_a,
        mean_b: row.mean_b,
        t: row.t,
        p: row.p,
        blocks: row.blocks,
        rejected: row.rejected,
    }
}
