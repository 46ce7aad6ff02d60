//! What an experiment leaves behind: the structs that the runner fills, and that records, plots and reports read.

use crate::choice::Choice;
use crate::config::Experiment;
use crate::fireflies::FireflyRecord;
use crate::observations::{Intervals, Judged};
use crate::reference::Truth;
use crate::statistics::slopes::Line;
use crate::statistics::{Estimate, positive};
use integrators::{Bias, Layer, Measurement};
use sampling::sampler::SamplerKind;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::sync::Arc;

pub use provenance::{Machine, Manifest, MethodRecord, Origin, Program, RenderRecord, SceneRecord};

mod provenance;

/// Everything that one experiment measured.
#[derive(Clone, Debug)]
pub struct ExperimentResult {
    /// The experiment's name, which is also its folder's.
    pub name: String,
    /// What was asked.
    pub experiment: Experiment,
    /// One entry per scene and method: scenes in order, and within a scene the methods in order.
    pub methods: Vec<MethodResult>,
    /// Every pair of methods of a scene, order by order.
    pub agreement: Vec<AgreementRow>,
    /// Fitted convergence, for every scene, method and order that has checkpoints.
    pub slopes: Vec<SlopeRow>,
    /// Every sampler against the first one, for every scene, method and order that has checkpoints.
    pub ratios: Vec<RatioRow>,
    /// What images were judged by, a scene each; empty where they were not.
    pub references: Vec<SceneTruth>,
    /// How composites were chosen, and what they have gained.
    pub choices: Vec<ChoiceRow>,
    /// What confidence sequences said at the end, where the budget was an error.
    pub sequences: Vec<SequenceRow>,
    /// Integrals of known value by every sampler, samplers in turn; empty where none were asked for.
    pub integrals: Vec<IntegralResult>,
    /// The largest contributions of every method, order by order.
    pub fireflies: Vec<FireflyRecord>,
    /// Where, when and with what it ran.
    pub manifest: Manifest,
}

impl ExperimentResult {
    /// The scenes' names, each once, in order.
    pub fn scenes(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for method in &self.methods {
            if !names.contains(&method.scene.as_str()) {
                names.push(&method.scene);
            }
        }
        names
    }

    /// The results of one scene, in the order of the experiment's methods.
    pub fn of_scene<'a>(&'a self, scene: &'a str) -> impl Iterator<Item = &'a MethodResult> {
        self.methods.iter().filter(move |m| m.scene == scene)
    }
}

/// One method in one scene.
#[derive(Clone, Debug)]
pub struct MethodResult {
    /// The scene's name, fit for a folder's name.
    pub scene: String,
    /// The method's registered name, such as `bdpt`.
    pub method: String,
    /// What tells it from the experiment's others, fit for a file's name: `bdpt`, `bdpt_power`; with the sampler where there are
    /// several.
    pub label: String,
    /// The same without the sampler.
    pub entry: String,
    /// Where its random numbers came from.
    pub sampler: SamplerKind,
    /// All of the method's settings, defaults included.
    pub settings: Value,
    /// The settings that differ from the defaults, for one column of a table: `mis=power`; empty for none.
    pub setting: String,
    /// Images, moments, counters and times.
    pub measurement: Measurement,
    /// Variance against samples: rising in samples, and for each number of samples one entry a layer, then the total.
    pub convergence: Vec<Checkpoint>,
    /// How sure its second moments are; `None` where they were not noted.
    pub intervals: Option<Intervals>,
    /// How far it is from the scene's reference, if there is one.
    pub judged: Option<Judged>,
    /// What its orders cost beside those before them; empty where that was not measured.
    pub marginal: Vec<MarginalCost>,
    /// The light that this method cannot carry here, in words; empty for none.
    pub missing_light: Vec<String>,
    /// Of each layer the radiance of single paths that it meets by chance alone; see [`crate::path_class::largest_hit`].
    pub largest_hits: Vec<[f64; 3]>,
    /// How the mean of its images stands to the truth.
    pub bias: Bias,
    /// What the scene let the render leave out.
    pub skipped: Vec<String>,
}

impl MethodResult {
    /// Its label as tables write it, with the bias that it has.
    pub fn title(&self) -> String {
        match self.bias.label() {
            Some(bias) => format!("{} ({bias})", self.label),
            None => self.label.clone(),
        }
    }

    /// The squared deviations that are noted, layer by layer, their sum last, and the seconds of the same replicates.
    fn noted(&self) -> Option<(&[Vec<f64>], &[f64])> {
        let intervals = self.intervals.as_ref()?;
        Some((&intervals.squares, &intervals.seconds))
    }

    /// Its efficiency over another's for the sum of all layers, or for one by its place in each; `None` where the two have other
    /// numbers of replicates, or what their intervals rest on was not noted.
    pub fn efficiency_over(&self, other: &Self, places: Option<(usize, usize)>) -> Option<Estimate> {
        let ((own, own_seconds), (others, others_seconds)) = (self.noted()?, other.noted()?);
        let (a, b) = match places {
            Some((a, b)) => (own.get(a)?, others.get(b)?),
            None => (own.last()?, others.last()?),
        };
        let noted = [a.len(), own_seconds.len(), others_seconds.len()].iter().all(|&n| n == b.len());
        noted.then(|| positive::efficiency_ratio((a, own_seconds), (b, others_seconds), 5))
    }
}

/// What an order costs beside those before it.
#[derive(Clone, Debug)]
pub struct MarginalCost {
    /// The order.
    pub order: Layer,
    /// By how much longer a replicate takes with it \[s\].
    pub seconds: Estimate,
    /// `1 / (variance · seconds)` with these; `None` where it takes no more time that could be measured.
    pub efficiency: Option<Estimate>,
}

/// What a scene's images were judged by.
#[derive(Clone, Debug)]
pub struct SceneTruth {
    /// The scene's name.
    pub scene: String,
    /// Its reference.
    pub truth: Arc<Truth>,
}

/// A composite in a scene: how it was chosen, and what it has gained.
#[derive(Clone, Debug)]
pub struct ChoiceRow {
    /// The scene's name.
    pub scene: String,
    /// The composite's label.
    pub label: String,
    /// Its runs, and what was predicted.
    pub choice: Choice,
    /// What it has gained; `None` where the experiment has no other method that carries all of the light.
    pub gain: Option<Gain>,
    /// The measured variance of one sample of each run's orders, the composite's, image and channel mean.
    pub variances: Vec<f64>,
}

/// A composite's efficiency on the image's sum over that of the best other method of its experiment.
#[derive(Clone, Debug)]
pub struct Gain {
    /// Which one that is.
    pub over: String,
    /// The ratio.
    pub ratio: Estimate,
    /// The ratio where the pilots' time counts as well.
    pub with_pilots: f64,
}

/// What a budget without a number of samples goes by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// The largest relative error that an image mean may have.
    RelativeError,
    /// The relative bias between two methods that would be found nine times out of ten.
    DetectableBias,
}

/// A bound that holds at whatever time one looks, with all others of its scene.
#[derive(Clone, Debug)]
pub struct SequenceRow {
    /// The scene's name.
    pub scene: String,
    /// The method's label.
    pub label: String,
    /// That of the method it is compared with.
    pub other: Option<String>,
    /// The layer; `None` for the sum of all.
    pub order: Option<Layer>,
    /// What is bounded.
    pub target: Target,
    /// The bound after the last replicate.
    pub bound: f64,
    /// What it was to fall below.
    pub asked: f64,
    /// Whether two methods were found to differ.
    pub differ: Option<bool>,
    /// Replicates of each.
    pub replicates: u32,
}

/// The variance of one replicate at one number of samples, for one layer or for the sum of all.
#[derive(Clone, Debug)]
pub struct Checkpoint {
    /// Samples per pixel of each replicate.
    pub samples: u32,
    /// Independent images measured.
    pub replicates: u32,
    /// Mean wall time of one replicate \[s\], of all layers together.
    pub seconds: f64,
    /// Those of the replicates of `replicate_variances`, one by one; empty where they were not measured apart.
    pub replicate_seconds: Vec<f64>,
    /// The layer; `None` for the sum of all.
    pub order: Option<Layer>,
    /// Image mean, channel mean of the variance of one replicate's pixel.
    pub variance: f64,
    /// 95 % bootstrap interval of `variance`.
    pub ci: (f64, f64),
    /// Image mean, channel mean.
    pub mean: f64,
    /// What each replicate but the first adds to `variance`, which is their mean: see [`crate::convergence::Deviations`].
    pub replicate_variances: Vec<f64>,
}

/// A straight line through log variance against log samples.
#[derive(Clone, Debug)]
pub struct SlopeRow {
    /// The scene's name.
    pub scene: String,
    /// The method's label.
    pub label: String,
    /// The layer; `None` for the sum of all.
    pub order: Option<Layer>,
    /// The slope: −1 for independent samples.
    pub slope: f64,
    /// Its 95 % bootstrap interval.
    pub ci: (f64, f64),
    /// Natural log of the fitted variance at one sample.
    pub intercept: f64,
    /// Checkpoints fitted.
    pub points: usize,
    /// The same line against seconds.
    pub on_seconds: Option<Line>,
}

/// A method with one sampler against the same method with the experiment's first one, at the most samples measured.
#[derive(Clone, Debug)]
pub struct RatioRow {
    /// The scene's name.
    pub scene: String,
    /// The method's label.
    pub label: String,
    /// The label of the same method with the first sampler.
    pub baseline: String,
    /// The layer; `None` for the sum of all.
    pub order: Option<Layer>,
    /// Samples per pixel of each replicate.
    pub samples: u32,
    /// Its root mean squared error over the baseline's: below 1, it is the better one.
    pub ratio: f64,
    /// The ratio's 95 % bootstrap interval, replicates drawn in pairs.
    pub ci: (f64, f64),
}

/// One integral of known value by one sampler.
#[derive(Clone, Debug)]
pub struct IntegralResult {
    /// Its name.
    pub integral: String,
    /// How many numbers it depends on.
    pub dimension: usize,
    /// Where they came from.
    pub sampler: SamplerKind,
    /// Its value.
    pub exact: f64,
    /// Mean squared errors against samples, rising; their `variance` is about the known value.
    pub points: Vec<Checkpoint>,
    /// For each of them, the p-value of Student's test that the mean over replicates is the known value.
    pub p: Vec<f64>,
    /// The line through them.
    pub slope: Option<Line>,
}

/// Two methods of a scene, compared in one layer.
#[derive(Clone, Debug)]
pub struct AgreementRow {
    /// The scene's name.
    pub scene: String,
    /// The first method's label.
    pub a: String,
    /// The second method's label.
    pub b: String,
    /// The layer.
    pub order: Layer,
    /// Image mean of the first, mean of channels.
    pub mean_a: f64,
    /// Image mean of the second, mean of channels.
    pub mean_b: f64,
    /// `(mean_b − mean_a)` in standard errors; 0 where neither has any variance and both are equal to rounding.
    pub t: f64,
    /// Two-sided p-value of `t` (Welch), not corrected for the number of tests.
    pub p: f64,
    /// Pixel blocks tested, times three channels.
    pub blocks: usize,
    /// Of these, how many differ at the false discovery rate; none unless it is found that any does.
    pub rejected: usize,
    /// The p-value of whether any block differs (Simes), adjusted for the number of all pairs and layers of the scene (Benjamini–Hochberg).
    pub smallest_adjusted_p: f64,
    /// The bias of the image mean, relative to it, that this test finds with a probability of 90 %; infinite for an empty order.
    pub detectable_bias: f64,
    /// The relative bias, of one sign, that paths may hide which one of the methods meets by chance alone: in those that it meets
    /// regularly `detectable_bias` would have been found.
    pub hidden_bias: f64,
    /// The method that may lack paths which it meets by chance alone, where nothing can be decided for that reason.
    pub lacking: Option<String>,
    /// What follows.
    pub verdict: Verdict,
    /// The tests of all blocks, row by row of the image, red first, then green, then blue.
    pub tests: Vec<BlockTest>,
    /// Blocks in a row.
    pub columns: usize,
}

/// Two methods compared in a block of pixels and a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockTest {
    /// Difference of the means, second less first, in standard errors.
    pub t: f32,
    /// Two-sided p-value (Welch).
    pub p: f32,
    /// Whether anything varies, so that p-values are uniform where the means are the same.
    pub varies: bool,
}

/// The outcome of one comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// No difference was found; one as large as the row's `detectable_bias` would probably have been.
    Agree,
    /// Neither has any variance, and they are equal up to rounding.
    Equal,
    /// They differ.
    Differ,
    /// Too few contributions arrived to decide anything, or what the lower mean lacks may be paths that are met by chance alone.
    Inconclusive,
    /// One of them cannot carry all the light of this scene, so nothing follows.
    Incomparable,
    /// One of them is biased, so that they may well differ.
    Biased,
}

impl Verdict {
    /// Whether the comparison is of means that should be equal.
    pub fn is_judged(self) -> bool {
        !matches!(self, Verdict::Incomparable | Verdict::Biased)
    }

    /// As records and tables write it.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Agree => "agree",
            Verdict::Equal => "equal",
            Verdict::Differ => "differ",
            Verdict::Inconclusive => "inconclusive",
            Verdict::Incomparable => "incomparable",
            Verdict::Biased => "biased",
        }
    }
}
