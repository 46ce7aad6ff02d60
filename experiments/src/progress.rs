//! A bar with the time left, on standard error and only on a terminal.

use crate::live::{Display, Image, Live};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use scenes::progress::Activity;
use std::time::{Duration, Instant};

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
    live: Option<Live>,
}

impl Progress {
    /// `total` units of work, all of a cost as equal as can be.
    pub fn new(total: f64, display: impl Into<Display>) -> Self {
        let Display { verbosity, live } = display.into();
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
        Self { bar, total, done: 0.0, live }
    }

    /// What is being done now.
    pub fn say(&self, message: String) {
        self.bar.set_message(message);
    }

    /// Shows an image as far as it is rendered, where images are shown: at the end, or when the next look is due.
    pub fn show(&mut self, name: &str, image: &dyn Image, end: bool) {
        let Some(live) = &mut self.live else { return };
        self.bar.suspend(|| if end { live.show(name, image) } else { live.show_when_due(name, image) });
    }

    /// So many units of work were done before.
    pub fn skip(&mut self, units: f64) {
        if units == 0.0 {
            return;
        }
        self.done += units;
        self.bar.set_position((self.done / self.total * STEPS as f64) as u64);
        // What took no time says nothing of how long the rest takes.
        self.bar.reset_eta();
    }

    /// Does `units` of work, of which `work` reports the fraction done.
    pub fn during<T>(&mut self, units: f64, work: impl FnOnce(&(dyn Fn(f64) + Sync)) -> T) -> T {
        let (bar, done, total) = (&self.bar, self.done, self.total);
        let (watched, message) = (bar.clone(), bar.message());
        let observer = move |activity: Activity, share: f64| {
            let told = if share < 1.0 {
                format!("{message}: {}, {:.0} %", doing(activity), 100.0 * share)
            } else {
                message.clone()
            };
            watched.set_message(told);
        };
        let result = scenes::progress::observed(observer, || {
            work(&|fraction: f64| bar.set_position(((done + units * fraction) / total * STEPS as f64) as u64))
        });
        self.done += units;
        result
    }
}

fn doing(activity: Activity) -> &'static str {
    match activity {
        Activity::Reading => "reading meshes",
        Activity::Building => "building the tree",
        Activity::Coupling => "coupling elements",
    }
}

/// Does `load`, and shows how far the reading of large files and the building of their trees are.
pub fn while_loading<T>(verbosity: Verbosity, load: impl FnOnce() -> T) -> T {
    /// What loads faster needs no bar.
    const PATIENCE: Duration = Duration::from_secs(1);
    let begun = Instant::now();
    let mut shown: Option<(Activity, Progress)> = None;
    let observer = move |activity: Activity, share: f64| {
        if begun.elapsed() < PATIENCE {
            return;
        }
        // What comes next may tell nothing for a while, and a full bar would seem to wait.
        if share >= 1.0 {
            shown = None;
            return;
        }
        if shown.as_ref().is_none_or(|(before, _)| *before != activity) {
            // The old bar goes before there is a new one.
            shown = None;
            let progress = Progress::new(1.0, verbosity);
            progress.say(doing(activity).to_owned());
            shown = Some((activity, progress));
        }
        if let Some((_, progress)) = &shown {
            progress.bar.set_position((share * STEPS as f64) as u64);
        }
    };
    scenes::progress::observed(observer, load)
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
