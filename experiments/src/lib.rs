//! The program: settings, runs, statistics, exports, plots and reports. It computes no radiance itself.
//!
//! In reading order:
//!
//! - [`cli`]: the command line; [`error`]: what can go wrong, and how the program ends; [`settings`]: `--set key=value`;
//! - one file a command: [`run_command`], [`render_command`], [`replay_command`], [`verify_command`],
//!   [`scene_command`], [`convert_command`], [`diff_command`], [`list_command`],
//!   [`lpe_command`], [`plan_command`], [`shard_command`], [`merge_command`], [`submit_command`], [`mod@bsdf`], [`mod@bench`];
//! - [`config`]: experiments; [`source`]: their files; [`plan`]: an experiment made ready and checked; [`runner`]: methods interleaved, replicate
//!   by replicate; [`job`]: one of them at work; [`observations`]: what is noted of its replicates; [`mod@reference`]: what they are judged by; [`states`]: what has been rendered so far, on the disk; [`shards`]: an experiment in parts, for many machines; [`budget`]: samples, seconds,
//!   threads; [`subject`]: a scene and a method, ready for one image; [`result`]: what an experiment leaves behind;
//! - [`convergence`]: variance against samples and its slope; [`ratio`]: samplers against one another; [`integrals`]: integrals of
//!   known value, to try samplers on; [`agreement`]: do two methods have the same mean?
//!   [`path_class`]: the light that a method cannot carry; [`replay`]: one sample's paths, vertex by vertex; [`fireflies`]: those
//!   that bring most; [`stress`]: one scene in other units; [`metrics`]: how far one image is from another; [`mod@statistics`]: the intervals and tests of all of these;
//! - [`record`]: `records.csv`; [`manifest`]: where they come from; [`statistics_file`]: `--stats`; [`export`]: images; [`plot`], [`report`]:
//!   what people look at; [`output`]: where all of that goes, whole or not at all;
//! - [`machine`], [`mod@program`], [`progress`], [`live`], [`stop`]: memory and clock, the build, the bar, images while they are rendered, Ctrl-C.

/// Writes a line on standard error. That nobody reads it any more is no error.
macro_rules! tell {
    ($($argument:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($argument)*);
    }};
}

pub mod agreement;
pub mod bench;
pub mod bsdf;
pub mod budget;
pub mod choice;
pub mod cli;
pub mod config;
pub mod convergence;
pub mod convert_command;
pub mod diff_command;
pub mod error;
pub mod export;
pub mod figure;
pub mod figure_command;
pub mod fireflies;
pub mod integrals;
pub mod job;
pub mod list_command;
pub mod live;
pub mod lpe_command;
pub mod machine;
pub mod manifest;
pub mod manual_command;
pub mod merge_command;
pub mod meter_command;
pub mod metrics;
pub mod observations;
pub mod output;
pub mod parts;
pub mod path_class;
pub mod plan;
pub mod plan_command;
pub mod plot;
pub mod program;
pub mod progress;
pub mod ratio;
pub mod record;
pub mod reference;
pub mod relight_command;
pub mod render_command;
pub mod replay;
pub mod replay_command;
pub mod report;
pub mod report_command;
pub mod result;
pub mod run_command;
pub mod runner;
pub mod scene_command;
pub mod settings;
pub mod shard_command;
pub mod shards;
pub mod source;
pub mod spectrum_command;
pub mod states;
pub mod statistics;
pub mod statistics_file;
pub mod stop;
pub mod stress;
pub mod subject;
pub mod submit_command;
pub mod truncation;
pub mod verify_command;
