//! What can be typed after commands that render nothing: they show what there is.

use clap::{Args, ValueEnum};
use clap_complete::Shell;
use std::path::PathBuf;

/// `neumann report`.
#[derive(Clone, Debug, Args)]
pub struct ReportArgs {
    /// A folder that `neumann run` has written, such as results/comparison.
    pub dir: PathBuf,
}

/// `neumann figure`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Examples:\n  neumann figure figure.toml -o figure.pdf -o figure.png\n  neumann figure results/comparison"
)]
pub struct FigureArgs {
    /// A figure's .toml file (see docs/figures.md), or a folder of results, all of whose plots are drawn.
    #[arg(value_name = "FILE.toml|DIR")]
    pub from: PathBuf,
    /// Where it goes, once for each of .svg, .pdf and .png [default: FILE.svg; of results, a folder: DIR/figures].
    #[arg(long, short, value_name = "FILE")]
    pub out: Vec<PathBuf>,
}

/// `neumann completions`.
#[derive(Clone, Debug, Args)]
#[command(
    after_help = "Examples:\n  neumann completions bash > ~/.local/share/bash-completion/completions/neumann\n  \
                  neumann completions zsh > _neumann"
)]
pub struct CompletionsArgs {
    /// The shell.
    pub shell: Shell,
}

/// `neumann man`.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:\n  neumann man | man -l -\n  neumann man --out ~/.local/share/man/man1")]
pub struct ManArgs {
    /// A folder for the pages of all commands.
    #[arg(long, short, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// `neumann list`.
#[derive(Clone, Debug, Args)]
pub struct ListArgs {
    /// What to list [default: everything].
    pub kind: Option<ListKind>,
}

/// What can be listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ListKind {
    /// Ways to estimate the orders.
    Methods,
    /// Scattering models.
    Bsdfs,
    /// Built-in scenes.
    Scenes,
    /// Built-in experiments.
    Experiments,
    /// Where random numbers come from.
    Samplers,
    /// How pixels weight the light around them.
    Filters,
}
