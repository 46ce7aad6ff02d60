//! What can be typed after each command.

use super::parse::{
    MaxOrder, at_least, parse_count, parse_crop, parse_max_order, parse_measured_order, parse_order, parse_pair,
    parse_part, parse_seconds, parse_seed, parse_size, parse_threads,
};
use crate::config::Until;
use crate::export::exr::LayerSelection;
use crate::parts;
use crate::relight_command::{self, Dimmer};
use crate::settings::Assignment;
use crate::shards::ShardChoice;
use clap::Args;
use integrators::{PathClass, Window};
use std::path::PathBuf;

/// Changes of an experiment. Flags that several commands share.
#[derive(Clone, Debug, Default, PartialEq, Args)]
pub struct ChangeArgs {
    /// Seconds for each method in each scene, instead of samples.
    #[arg(long, value_name = "S", conflicts_with = "spp")]
    pub seconds: Option<f64>,
    /// Samples per pixel, over all replicates.
    #[arg(long, value_name = "N", value_parser = at_least::<1>)]
    pub spp: Option<u32>,
    /// Independent images that share the samples.
    #[arg(long, value_name = "R", value_parser = at_least::<1>)]
    pub replicates: Option<u32>,
    /// Add replicates until a bound is small enough: relative_error=0.01 or detectable_bias=0.003, of the sum of all orders, or with
    /// order=all or a number behind a comma.
    #[arg(long, value_name = "TARGET")]
    pub until: Option<Until>,
    /// The most samples per pixel that --until may take; --seconds is another limit.
    #[arg(long, value_name = "N", value_parser = at_least::<1>)]
    pub max_spp: Option<u32>,
    /// Judge images by this reference, which an experiment with a section [reference] wrote.
    #[arg(long, value_name = "FILE.exr")]
    pub reference: Option<PathBuf>,
    /// Image size.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<(u32, u32)>,
    /// Last order traced one by one.
    #[arg(long, value_name = "K")]
    pub max_order: Option<usize>,
    /// Seed of all random numbers.
    #[arg(long, value_name = "S", value_parser = parse_seed)]
    pub seed: Option<u64>,
    /// Where random numbers come from (see `neumann list samplers`).
    #[arg(long, value_name = "NAME")]
    pub sampler: Option<String>,
    /// Change a key of the experiment (max_order=4) or a method's setting (bdpt.mis=power).
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<Assignment>,
}

/// `neumann run`.
#[derive(Clone, Debug, Default, Args)]
pub struct RunArgs {
    /// An experiment's name (see `neumann list experiments`) or a .toml file.
    pub experiment: String,
    /// Folder of the results [default: results/EXPERIMENT].
    #[arg(long, short, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// What to change.
    #[command(flatten)]
    pub changes: ChangeArgs,
    /// Threads [default: all cores].
    #[arg(long, value_name = "T", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// Discard what the folder holds: results of another configuration, and all that has been rendered so far. Without it, a run
    /// goes on where an interrupted or shorter one ended.
    #[arg(long)]
    pub fresh: bool,
    /// Seconds of work between saves of what has been rendered [default: 30, or more where saving takes long].
    #[arg(long, value_name = "S", value_parser = parse_seconds)]
    pub save_every: Option<f64>,
    /// Render one shard of the plan that the folder holds (see `neumann plan`): its number and how many there are, or auto, as
    /// SLURM_ARRAY_TASK_ID, JOB_COMPLETION_INDEX (from 0), PBS_ARRAY_INDEX or SGE_TASK_ID says.
    #[arg(long, value_name = "I/N")]
    pub shard: Option<ShardChoice>,
    /// Render a shard of a plan that another build, or one for another architecture, has made: bits may differ.
    #[arg(long, requires = "shard")]
    pub allow_foreign: bool,
    /// Show the image as it converges: in tev, which listens at 127.0.0.1:14158 unless said otherwise, a layer an order, or in the
    /// terminal where there is none.
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, require_equals = true, conflicts_with = "shard")]
    pub live: Option<Option<String>>,
    /// Exit with 0 even if non-finite samples occurred.
    #[arg(long)]
    pub allow_invalid: bool,
}

/// An image: which scene, by which method, of how many samples. Flags that several commands share.
#[derive(Clone, Debug, Args)]
pub struct ImageArgs {
    /// A built-in scene's name (see `neumann list scenes`) or a file: .toml, .obj, .ply, .gltf, .glb, Mitsuba's .xml, .pbrt.
    pub scene: String,
    /// The method (see `neumann list methods`).
    #[arg(long, short = 'i', value_name = "METHOD", default_value = "path")]
    pub method: String,
    /// Samples per pixel, over all replicates [default: 64].
    #[arg(long, value_name = "N", value_parser = at_least::<1>)]
    pub spp: Option<u32>,
    /// Last order traced one by one [default: the scene's, usually 8]; auto for as many as it takes to leave out no more than --tail.
    #[arg(long, value_name = "K", value_parser = parse_max_order)]
    pub max_order: Option<MaxOrder>,
    /// Only these orders, such as 0,2,4-6 [default: all up to --max-order].
    #[arg(long, value_name = "LIST")]
    pub orders: Option<String>,
    /// Estimate all beyond --max-order too; with --max-order auto, the part of the image's mean that may be left out [default: 1e-3].
    #[arg(long, value_name = "PART", value_parser = parse_part)]
    pub tail: Option<Option<f64>>,
    /// Image size [default: the scene's].
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<(u32, u32)>,
    /// Seed of all random numbers.
    #[arg(long, value_name = "S", value_parser = parse_seed, default_value_t = 0)]
    pub seed: u64,
    /// Independent images that share the samples: two or more give variances.
    #[arg(long, value_name = "R", default_value_t = 4, value_parser = at_least::<1>)]
    pub replicates: u32,
    /// How a pixel weights the light around it (see `neumann list filters`) [default: the scene's, usually box].
    #[arg(long, value_name = "NAME")]
    pub filter: Option<String>,
    /// Where random numbers come from (see `neumann list samplers`).
    #[arg(long, value_name = "NAME", default_value = "sobol")]
    pub sampler: String,
    /// Do all work, also what this scene does not need.
    #[arg(long)]
    pub no_skip: bool,
    /// Change a setting of the method: mis=power or bdpt.mis=power.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<Assignment>,
}

/// `neumann render`.
#[derive(Clone, Debug, Args)]
pub struct RenderArgs {
    /// The image.
    #[command(flatten)]
    pub image: ImageArgs,
    /// Render for about so many seconds instead; a pilot run fixes the number of samples.
    #[arg(long, value_name = "S", conflicts_with = "spp")]
    pub seconds: Option<f64>,
    /// Only these pixels of the image: column and row of the first (from 0, at the top left), width, height [default: the
    /// scene's crop, usually all].
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_crop)]
    pub crop: Option<Window>,
    /// Threads [default: all cores].
    #[arg(long, value_name = "T", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// Layers of the image besides the beauty: orders, variance, strategies, groups; or beauty for none.
    #[arg(long, value_name = "LIST", default_value = "orders")]
    pub layers: LayerSelection,
    /// A layer for the paths of a light-path expression, such as caustics='CDS+L' (see `neumann lpe`).
    #[arg(long, value_name = "NAME=EXPR", value_parser = parts::class)]
    pub lpe: Vec<PathClass>,
    /// The image file; a .png is a picture of the image alone, without layers, those of orders included, under an exposure that is
    /// said unless --quiet [default: SCENE_METHOD.exr].
    #[arg(long, short, value_name = "OUT.exr|OUT.png")]
    pub output: Option<PathBuf>,
    /// Write means, variances, counters and times as JSON.
    #[arg(long, value_name = "OUT.json")]
    pub stats: Option<PathBuf>,
    /// Show the image as it converges: in tev, which listens at 127.0.0.1:14158 unless said otherwise, a layer an order, or in the
    /// terminal where there is none.
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, require_equals = true)]
    pub live: Option<Option<String>>,
    /// Exit with 0 even if non-finite samples occurred.
    #[arg(long)]
    pub allow_invalid: bool,
}

/// `neumann replay`.
#[derive(Clone, Debug, Args)]
pub struct ReplayArgs {
    /// The image that the sample is one of, by the same flags as it was rendered with.
    #[command(flatten)]
    pub image: ImageArgs,
    /// Column and row of the pixel, from 0 at the top left.
    #[arg(long, value_name = "X,Y", value_parser = parse_pair::<u32>)]
    pub pixel: (u32, u32),
    /// Which independent image, from 0.
    #[arg(long, value_name = "R", default_value_t = 0)]
    pub replicate: u32,
    /// Which sample of the pixel in that image, from 0.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub sample: u32,
    /// Only paths of this strategy: s light vertices, t camera vertices.
    #[arg(long, value_name = "S,T", value_parser = parse_pair::<u16>)]
    pub strategy: Option<(u16, u16)>,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
}

/// `neumann verify`.
#[derive(Clone, Debug, Args)]
pub struct VerifyArgs {
    /// A built-in scene's name or a file [default: all built-in scenes].
    pub scene: Option<String>,
    /// Samples per pixel of each method, over all replicates.
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = at_least::<1>)]
    pub spp: u32,
    /// Seconds for each method, instead of samples.
    #[arg(long, value_name = "S", conflicts_with = "spp")]
    pub seconds: Option<f64>,
    /// Independent images that share the samples.
    #[arg(long, value_name = "R", default_value_t = 16, value_parser = at_least::<2>)]
    pub replicates: u32,
    /// Last order compared [default: the scene's, usually 8].
    #[arg(long, value_name = "K")]
    pub max_order: Option<usize>,
    /// Image size [default: the scene's, scaled so that the longer side has 96 pixels].
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<(u32, u32)>,
    /// Seed of all random numbers.
    #[arg(long, value_name = "S", value_parser = parse_seed, default_value_t = 0)]
    pub seed: u64,
    /// Threads [default: all cores].
    #[arg(long, value_name = "T", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// Render the scene in other units and at other places too, where it should look the same.
    #[arg(long)]
    pub stress: bool,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
}

/// `neumann scene`.
#[derive(Clone, Debug, Args)]
pub struct SceneArgs {
    /// A built-in scene's name or a file.
    pub scene: String,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
    /// Exit with 2 if the importer approximated anything.
    #[arg(long)]
    pub strict: bool,
}

/// `neumann convert`.
#[derive(Clone, Debug, Args)]
pub struct ConvertArgs {
    /// The scene: Mitsuba's .xml, .pbrt, .gltf, .glb, or .obj.
    pub scene: String,
    /// The scene file to write; meshes that have no file of their own are written beside it.
    #[arg(long, short, value_name = "SCENE.toml")]
    pub output: PathBuf,
}

/// `neumann relight`.
#[derive(Clone, Debug, Args)]
pub struct RelightArgs {
    /// The image, rendered with `--layers orders,groups`.
    pub image: PathBuf,
    /// By what to multiply the light of a group: a number, or one each for red, green and blue. Other groups stay as they are.
    #[arg(value_name = "GROUP=FACTOR", required = true, value_parser = relight_command::dimmer)]
    pub groups: Vec<Dimmer>,
    /// The image to write.
    #[arg(long, short, value_name = "OUT.exr")]
    pub output: PathBuf,
}

/// `neumann diff`.
#[derive(Clone, Debug, Args)]
pub struct DiffArgs {
    /// The image to judge.
    pub a: PathBuf,
    /// The reference.
    pub b: PathBuf,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
}

/// `neumann bsdf`.
#[derive(Clone, Debug, Args)]
pub struct BsdfArgs {
    /// The model's name (see `neumann list bsdfs`).
    #[arg(required_unless_present = "gallery")]
    pub model: Option<String>,
    /// Set a parameter of the model: alpha=0.2 or albedo=[0.8,0.2,0.1].
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<Assignment>,
    /// Folder of the pictures [default: results/bsdfs/MODEL].
    #[arg(long, short, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// All models as they are by default, on one page [default folder: results/bsdfs].
    #[arg(long, conflicts_with_all = ["model", "set"])]
    pub gallery: bool,
}

/// `neumann spectrum`.
#[derive(Clone, Debug, Args)]
pub struct SpectrumArgs {
    /// A built-in scene's name or a file.
    pub scene: String,
    /// Last order measured, 7 or more.
    #[arg(long, value_name = "K", default_value_t = 32, value_parser = parse_measured_order)]
    pub max_order: usize,
    /// The part of all light that may be left out, by which the number of orders needed is told.
    #[arg(long, value_name = "PART", default_value_t = 1e-3, value_parser = parse_part)]
    pub accuracy: f64,
    /// Walks from the emitters, for the flux.
    #[arg(long, value_name = "N", default_value = "1e6", value_parser = parse_count)]
    pub paths: u64,
    /// Samples per pixel, for the image.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = at_least::<1>)]
    pub spp: u32,
    /// Independent replicates that share walks and samples, 8 or more.
    #[arg(long, value_name = "R", default_value_t = 16, value_parser = at_least::<8>)]
    pub replicates: u32,
    /// Seed of all random numbers.
    #[arg(long, value_name = "S", value_parser = parse_seed, default_value_t = 0)]
    pub seed: u64,
    /// Threads [default: all cores].
    #[arg(long, value_name = "T", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
}

/// `neumann meter`.
#[derive(Clone, Debug, Args)]
pub struct MeterArgs {
    /// A built-in scene's name or a file.
    pub scene: String,
    /// What to measure: surfaces of this label, or of the material of this name (see `neumann scene`).
    #[arg(long, required = true, value_name = "LABEL")]
    pub on: Vec<String>,
    /// Last order measured.
    #[arg(long, value_name = "K", default_value_t = 8, value_parser = parse_order)]
    pub max_order: usize,
    /// Walks from the emitters.
    #[arg(long, value_name = "N", default_value = "1e6", value_parser = parse_count)]
    pub paths: u64,
    /// Independent replicates that share them, 4 or more.
    #[arg(long, value_name = "R", default_value_t = 16, value_parser = at_least::<4>)]
    pub replicates: u32,
    /// Seed of all random numbers.
    #[arg(long, value_name = "S", value_parser = parse_seed, default_value_t = 0)]
    pub seed: u64,
    /// Threads [default: all cores].
    #[arg(long, value_name = "T", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
}

/// `neumann lpe`.
#[derive(Clone, Debug, Args)]
pub struct LpeArgs {
    /// Expressions such as 'CD+S+L' (see docs/light_path_expressions.md), each with a name if you like: NAME=EXPR.
    #[arg(required = true, value_name = "EXPR")]
    pub expressions: Vec<String>,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
}
