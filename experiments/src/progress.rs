//! A bar with the time left, on standard error and only on a terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::time::Duration;

/// Resolution of the bar.
const STEPS: u64 = 10_000;

/// Whether progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verbosity {
    /// On a terminal.
    Normal,
    /// Never.
    Quiet,
}

/// How much of all the work is done.
pub struct Progress {
    bar: ProgressBar,
    total: f64,
    done: f64,
}

impl Progress {
    /// `total` units of work, all of a cost as equal as can be.
    pub fn new(total: f64, verbosity: Verbosity) -> Self {
        let target = match verbosity {
            Verbosity::Normal => ProgressDrawTarget::stderr(),
            Verbosity::Quiet => ProgressDrawTarget::hidden(),
        };
        let bar = ProgressBar::with_draw_target(Some(STEPS), target);
        if let Ok(style) =
            ProgressStyle::with_template("{bar:32} {percent:>3} %  {elapsed} of {duration}, {eta} left  {wide_msg}")
        {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(500));
        Self { bar, total, done: 0.0 }
    }

    /// What is being done now.
    pub fn say(&self, message: String) {
        self.bar.set_message(message);
    }

    /// Does `units` of work, of which `work` reports the fraction done.
    pub fn during<T>(&mut self, units: f64, work: impl FnOnce(&(dyn Fn(f64) + Sync)) -> T) -> T {
        let (bar, done, total) = (&self.bar, self.done, self.total);
        let result = work(&|fraction: f64| bar.set_position(((done + units * fraction) / total * STEPS as f64) as u64));
        self.done += units;
        result
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
