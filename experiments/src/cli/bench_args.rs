//! What can be typed after `neumann bench`.

use super::parse::{at_least, parse_count, parse_order, parse_seed, parse_size, parse_threads};
use crate::settings::Assignment;
use clap::{Args, Subcommand, ValueEnum};
use std::path::PathBuf;

/// `neumann bench`.
#[derive(Clone, Debug, Args)]
pub struct BenchArgs {
    /// What to measure.
    #[command(subcommand)]
    pub kind: BenchKind,
}

/// What can be measured.
#[derive(Clone, Debug, Subcommand)]
pub enum BenchKind {
    /// Rays per second on one thread, by scene and kind of ray, for each kernel that this processor can run.
    #[command(after_help = "Examples:\n  neumann bench rays\n  neumann bench rays cornell_box kitchen.obj --json")]
    Rays {
        /// Scenes by name or file [default: those of the program, and balls of a hundred to a million triangles].
        #[arg(value_name = "SCENE")]
        scenes: Vec<String>,
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Rays at edges and vertices of closed meshes from within, and on from there; the exit status is 1 if any gets out.
    #[command(after_help = "Examples:\n  neumann bench leaks\n  neumann bench leaks --rays 1e9 --seed 2")]
    Leaks {
        /// Rays for each kernel, at the least; 1e9 is a number as well.
        #[arg(long, value_name = "N", default_value = "1e7", value_parser = parse_count)]
        rays: u64,
        /// Seed of all random numbers.
        #[arg(long, value_name = "S", value_parser = parse_seed, default_value_t = 0)]
        seed: u64,
    },
    /// Processor time of a sample on one thread, by scene and method.
    #[command(
        after_help = "Examples:\n  neumann bench samples\n  neumann bench samples cornell_box -i path -i bdpt --max-order 5 --set roulette=none"
    )]
    Samples(SamplesArgs),
    /// What time depends on: threads, samples, image size, triangles.
    #[command(
        after_help = "Examples:\n  neumann bench scaling threads\n  neumann bench scaling triangles --triangles 1e7 --json"
    )]
    Scaling(ScalingArgs),
    /// Seconds from a process' start to the end of its first sample.
    #[command(after_help = "Examples:\n  neumann bench start\n  neumann bench start cornell_box --triangles 1e5")]
    Start(StartArgs),
    /// What is saved by leaving out what a scene does not need, one such skip at a time.
    #[command(after_help = "Examples:\n  neumann bench skips\n  neumann bench skips -i path --rounds 31 --json")]
    Skips(SkipsArgs),
    /// Error against processor time, by method, as plots and JSON.
    #[command(
        after_help = "Examples:\n  neumann bench error\n  neumann bench error glass_caustic -i bdpt -i vcm --reference vcm"
    )]
    Error(ErrorArgs),
}

/// By which methods, and how. Flags that several benches share.
#[derive(Clone, Debug, Args)]
pub struct MeasuredArgs {
    /// A method; give the flag once for each [default: path, light, bdpt; of samples direct, too].
    #[arg(long = "method", short = 'i', value_name = "METHOD")]
    pub methods: Vec<String>,
    /// Last order traced.
    #[arg(long, value_name = "K", default_value_t = 8, value_parser = parse_order)]
    pub max_order: usize,
    /// Where random numbers come from (see `neumann list samplers`).
    #[arg(long, value_name = "NAME", default_value = "independent")]
    pub sampler: String,
    /// Change a setting: roulette=none of all methods, bdpt.mis=power of one.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub set: Vec<Assignment>,
    /// Seed of all random numbers.
    #[arg(long, value_name = "S", value_parser = parse_seed, default_value_t = 0)]
    pub seed: u64,
    /// How often each is measured, in turn with the others.
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = at_least::<1>)]
    pub rounds: u32,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
}

/// `neumann bench samples`.
#[derive(Clone, Debug, Args)]
pub struct SamplesArgs {
    /// Scenes by name or file [default: those of the program].
    #[arg(value_name = "SCENE")]
    pub scenes: Vec<String>,
    /// The methods.
    #[command(flatten)]
    pub measured: MeasuredArgs,
    /// Image size.
    #[arg(long, value_name = "WxH", default_value = "64x64", value_parser = parse_size)]
    pub size: (u32, u32),
    /// Samples per pixel in each round.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = at_least::<1>)]
    pub spp: u32,
}

/// What time may depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ScalingPart {
    /// Threads: how well they share the work.
    Threads,
    /// Samples per pixel.
    Samples,
    /// Pixels.
    Size,
    /// Triangles, from a hundred on.
    Triangles,
}

/// `neumann bench scaling`.
#[derive(Clone, Debug, Args)]
pub struct ScalingArgs {
    /// What to vary [default: all].
    #[arg(value_name = "WHAT")]
    pub parts: Vec<ScalingPart>,
    /// The scene, by name or file, where it is not the triangles that vary.
    #[arg(long, value_name = "SCENE", default_value = "cornell_box")]
    pub scene: String,
    /// The methods.
    #[command(flatten)]
    pub measured: MeasuredArgs,
    /// Image size where it is threads that vary.
    #[arg(long, value_name = "WxH", default_value = "256x256", value_parser = parse_size)]
    pub size: (u32, u32),
    /// The most threads [default: all cores].
    #[arg(long, value_name = "T", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// The most triangles; 1e7 is a number as well.
    #[arg(long, value_name = "N", default_value = "1e6", value_parser = parse_count)]
    pub triangles: u64,
    /// Folder for plots of all but threads [default: none are drawn].
    #[arg(long, short, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// `neumann bench start`.
#[derive(Clone, Debug, Args)]
pub struct StartArgs {
    /// Scenes by name or file [default: those of the program].
    #[arg(value_name = "SCENE")]
    pub scenes: Vec<String>,
    /// Triangles of an OBJ file that is made for it, about; 1e6 is a number as well.
    #[arg(long, value_name = "N", default_value = "1e6", value_parser = parse_count)]
    pub triangles: u64,
    /// How often each is started, in turn with the others.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = at_least::<1>)]
    pub rounds: u32,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
}

/// `neumann bench skips`.
#[derive(Clone, Debug, Args)]
pub struct SkipsArgs {
    /// The methods.
    #[command(flatten)]
    pub measured: MeasuredArgs,
    /// Image size.
    #[arg(long, value_name = "WxH", default_value = "64x64", value_parser = parse_size)]
    pub size: (u32, u32),
}

/// `neumann bench error`.
#[derive(Clone, Debug, Args)]
pub struct ErrorArgs {
    /// The scene, by name or file.
    #[arg(value_name = "SCENE", default_value = "cornell_box")]
    pub scene: String,
    /// The methods; a round is an independent image at each number of samples.
    #[command(flatten)]
    pub measured: MeasuredArgs,
    /// Image size.
    #[arg(long, value_name = "WxH", default_value = "64x64", value_parser = parse_size)]
    pub size: (u32, u32),
    /// The most samples per pixel of an image; those before are halves, quarters and so on.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = at_least::<2>)]
    pub spp: u32,
    /// The method that renders the reference.
    #[arg(long, value_name = "METHOD", default_value = "bdpt")]
    pub reference: String,
    /// Samples per pixel of the reference.
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = at_least::<2>)]
    pub reference_spp: u32,
    /// Folder of the plots and of error.json.
    #[arg(long, short, value_name = "DIR", default_value = "results/bench")]
    pub out: PathBuf,
}
