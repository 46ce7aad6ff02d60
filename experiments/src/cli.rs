//! The command line: what can be typed, and who answers it.

mod args;
mod bench_args;
mod desk_args;
mod parse;
mod shard_args;

pub use args::{
    BsdfArgs, ChangeArgs, ConvertArgs, DiffArgs, ImageArgs, LpeArgs, MeterArgs, RelightArgs, RenderArgs, ReplayArgs,
    RunArgs, SceneArgs, SpectrumArgs, VerifyArgs,
};

pub use bench_args::{
    BenchArgs, BenchKind, ErrorArgs, MeasuredArgs, SamplesArgs, ScalingArgs, ScalingPart, SkipsArgs, StartArgs,
};
pub use desk_args::{CompletionsArgs, FigureArgs, ListArgs, ListKind, ManArgs, ReportArgs};
pub use parse::MaxOrder;
pub use shard_args::{MergeArgs, PlanArgs, SubmitArgs};

use crate::error::{BAD_INPUT, Error, Status};
use crate::machine::VERSION;
use crate::progress::Verbosity;
use crate::stop::Stop;
use crate::{
    bench, bsdf, convert_command, diff_command, figure_command, list_command, lpe_command, manual_command,
    merge_command, meter_command, plan_command, relight_command, render_command, replay_command, report_command,
    run_command, scene_command, spectrum_command, submit_command, verify_command,
};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use integrators::Methods;
use std::io::Write;
use std::process::ExitCode;

/// What is shown after the help.
const EXAMPLES: &str = "Examples:
  neumann                                              the main job → results/comparison/report.html
  neumann render glass_caustic -i bdpt -o caustic.exr  one image, its orders as layers
  neumann run time_to_error --spp 16                   an experiment, in a small size
  neumann verify my_scene.toml                         do the methods agree on it?
  neumann figure results/comparison                    its plots for a paper
  neumann list scenes                                  what can be named";

/// Renders light order by order of the Neumann series, and measures which method does it best.
///
/// Without a command: `neumann run comparison`.
#[derive(Debug, Parser)]
#[command(name = "neumann", version = VERSION, max_term_width = 120, after_help = EXAMPLES)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Show no progress.
    #[arg(long, short, global = true)]
    pub quiet: bool,
}

/// What can be done.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run an experiment: methods compared in scenes, with a report. Run again, an interrupted one goes on where it was.
    Run(RunArgs),
    /// Divide an experiment into shards, each of which one machine renders with `neumann run --shard`.
    Plan(PlanArgs),
    /// Make the results of an experiment from its shards.
    Merge(MergeArgs),
    /// Write what Slurm, GNU parallel, Snakemake or Kubernetes needs to run the shards that are missing, and the merge.
    Submit(SubmitArgs),
    /// Make the report and the plots of finished results again, from what was rendered.
    Report(ReportArgs),
    /// Draw a figure for a paper, or all plots of results, as SVG, PDF and PNG.
    Figure(FigureArgs),
    /// Render one scene with one method.
    Render(RenderArgs),
    /// Trace one sample of an image again, and print its paths vertex by vertex.
    Replay(ReplayArgs),
    /// Test whether the methods agree with one another, and with the truth where it is known.
    Verify(VerifyArgs),
    /// Say what a scene holds, what it needs, and what will be skipped.
    Scene(SceneArgs),
    /// Write another program's scene (Mitsuba's .xml, .pbrt, .gltf, .glb, or .obj) as a scene file.
    Convert(ConvertArgs),
    /// Change the brightness of light groups in an image rendered with --layers groups.
    Relight(RelightArgs),
    /// Say how far one image file is from another, layer by layer.
    Diff(DiffArgs),
    /// Look at a scattering model: its parameters, albedo and pictures.
    Bsdf(BsdfArgs),
    /// Measure how much light each order carries, how fast orders fall, and what is left beyond the last.
    Spectrum(SpectrumArgs),
    /// Measure the light that falls on a surface and the light that leaves it, order by order.
    Meter(MeterArgs),
    /// Say what light-path expressions mean, and whether they are disjoint and complete.
    Lpe(LpeArgs),
    /// Measure rays, samples, skips, scaling, starting and errors against time, and whether any ray gets through closed surfaces.
    Bench(BenchArgs),
    /// List what can be named.
    List(ListArgs),
    /// Print what a shell needs to complete commands and flags.
    Completions(CompletionsArgs),
    /// Print the manual's page, or write those of all commands.
    Man(ManArgs),
}

/// Runs the command line of this process with THE LIST of methods.
pub fn main() -> ExitCode {
    main_with(&Methods::standard())
}

/// The same with methods of one's own among them, which every command knows like the others.
pub fn main_with(methods: &Methods) -> ExitCode {
    let words = negative_numbers_are_values(Cli::command()).get_matches();
    let cli = Cli::from_arg_matches(&words).unwrap_or_else(|e| e.exit());
    match execute(&cli, methods) {
        Ok(status) => ExitCode::from(status.code()),
        Err(error) => {
            report(&error);
            match error {
                Error::Interrupted(signal) => ExitCode::from(Status::Interrupted(signal).code()),
                _ => ExitCode::from(BAD_INPUT),
            }
        }
    }
}

/// Has a plain number such as `-5` taken for a value, and not for a flag that there is not, so that what is said of it is what the value should be.
fn negative_numbers_are_values(command: clap::Command) -> clap::Command {
    let command = command.mut_args(|arg| arg.allow_negative_numbers(true));
    command.mut_subcommands(negative_numbers_are_values)
}

fn execute(cli: &Cli, methods: &Methods) -> Result<Status, Error> {
    let verbosity = if cli.quiet { Verbosity::Quiet } else { Verbosity::Normal };
    let signals = || Stop::on_signals().map_err(|e| Error::usage(format!("cannot listen to Ctrl-C and SIGTERM: {e}")));
    let default = Command::Run(RunArgs { experiment: "comparison".to_owned(), ..RunArgs::default() });
    match cli.command.as_ref().unwrap_or(&default) {
        Command::Run(args) => run_command::run(args, methods, verbosity, &signals()?),
        Command::Plan(args) => plan_command::plan(args, methods, verbosity, &signals()?),
        Command::Merge(args) => merge_command::merge(args, methods, verbosity, &signals()?),
        Command::Submit(args) => submit_command::submit(args, methods, verbosity, &signals()?),
        Command::Report(args) => report_command::report(args, methods, verbosity, &signals()?),
        Command::Figure(args) => figure_command::figure(args, methods, verbosity),
        Command::Render(args) => render_command::render(args, methods, verbosity, &signals()?),
        Command::Replay(args) => replay_command::replay(args, methods, verbosity),
        Command::Verify(args) => verify_command::verify(args, methods, verbosity, &signals()?),
        Command::Scene(args) => scene_command::scene(args, methods, verbosity),
        Command::Convert(args) => convert_command::convert(args),
        Command::Relight(args) => relight_command::relight(args),
        Command::Diff(args) => diff_command::diff(args),
        Command::Bsdf(args) => bsdf::bsdf(args),
        Command::Spectrum(args) => spectrum_command::spectrum(args, methods, verbosity, &signals()?),
        Command::Meter(args) => meter_command::meter(args, verbosity, &signals()?),
        Command::Lpe(args) => lpe_command::lpe(args),
        Command::Bench(args) => bench::bench(args, methods),
        Command::List(args) => list_command::list(args, methods),
        Command::Completions(args) => manual_command::completions(args),
        Command::Man(args) => manual_command::man(args),
    }
}

/// Prints an error, and the causes that its message does not tell already.
fn report(error: &Error) {
    let mut message = error.to_string();
    let mut cause = std::error::Error::source(error);
    while let Some(e) = cause {
        let text = e.to_string();
        if !message.contains(&text) {
            message = format!("{message}: {text}");
        }
        cause = e.source();
    }
    tell!("error: {message}");
}

/// Prints a command's answer. A reader that went away, such as `head`, is no error.
///
/// # Errors
/// If standard output cannot be written for another reason.
pub fn print(text: &str) -> Result<(), Error> {
    let mut out = std::io::stdout().lock();
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    match written {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::usage(format!("cannot write to standard output: {e}")))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::exr::LayerSelection;

    #[test]
    fn the_command_line_is_consistent() {
        negative_numbers_are_values(Cli::command()).debug_assert();
    }

    #[test]
    fn defaults_are_those_of_the_contract() {
        let cli = Cli::parse_from(["neumann", "render", "furnace"]);
        let Some(Command::Render(args)) = cli.command else { panic!("not a render") };
        let image = &args.image;
        assert_eq!((image.method.as_str(), image.max_order, image.replicates, image.seed), ("path", None, 4, 0));
        assert_eq!((image.spp, image.tail, args.layers), (None, None, LayerSelection::default()));
    }
}
