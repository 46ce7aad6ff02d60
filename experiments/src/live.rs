//! Images while they are rendered: in `tev`'s window, a layer an order, or in the terminal where there is no `tev`.
//!
//! An image is shown after a replicate, as the mean of those that are complete, and takes no more than a tenth of the time.

mod terminal;
mod tev;

use crate::error::Error;
use crate::progress::Verbosity;
use integrators::{Layer, Render};
use std::time::{Duration, Instant};
use terminal::Terminal;
use tev::Tev;

pub use tev::ADDRESS;

/// The least time between two looks at one image.
const PAUSE: Duration = Duration::from_millis(100);
/// The time between two looks, in times of what one takes.
const SHARE: u32 = 9;
/// Where `tev` is to be had.
const SOURCE: &str = "https://github.com/Tom94/tev/releases";

/// What is shown of work that goes on.
pub struct Display {
    /// Whether there is a bar.
    pub verbosity: Verbosity,
    /// Where images are shown, if they are.
    pub live: Option<Live>,
}

impl From<Verbosity> for Display {
    fn from(verbosity: Verbosity) -> Self {
        Self { verbosity, live: None }
    }
}

/// The image of the replicates that are complete.
pub trait Image {
    /// Pixels in a row, and rows.
    fn size(&self) -> (u32, u32);
    /// The names of its layers, in order.
    fn layers(&self) -> Vec<String>;
    /// A pixel of a layer, linear.
    fn pixel(&self, layer: usize, pixel: usize) -> [f64; 3];

    /// A pixel of the sum of all layers.
    fn sum(&self, layers: usize, pixel: usize) -> [f64; 3] {
        (0..layers).map(|layer| self.pixel(layer, pixel)).fold([0.0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]])
    }
}

impl Image for Render<'_> {
    fn size(&self) -> (u32, u32) {
        (self.window().width(), self.window().height())
    }

    fn layers(&self) -> Vec<String> {
        let max_order = self.settings().orders.max_order();
        Render::layers(self).iter().map(|layer: &Layer| layer.name(max_order)).collect()
    }

    fn pixel(&self, layer: usize, pixel: usize) -> [f64; 3] {
        self.mean(layer, pixel)
    }
}

/// Where images are shown while they are rendered.
pub struct Live {
    screen: Screen,
    /// When an image was shown last, and how long that took.
    last: Option<(Instant, Duration)>,
}

enum Screen {
    Tev(Tev),
    Terminal(Terminal),
    /// The window was closed; there is nothing to show images in.
    Gone,
}

impl Live {
    /// Finds `tev` at an address, or at its usual one, or else a terminal.
    ///
    /// # Errors
    /// If there is none of them: what was asked for would not be seen.
    pub fn open(address: Option<&str>) -> Result<Self, Error> {
        let screen = match (Tev::connect(address.unwrap_or(ADDRESS)), address) {
            (Ok(tev), _) => Screen::Tev(tev),
            (Err(why), Some(address)) => {
                return Err(Error::usage(format!(
                    "--live={address}: no tev answers there ({why}); start it with --hostname={address} ({SOURCE}), or say --live \
                     alone for a preview in the terminal"
                )));
            }
            (Err(why), None) => match Terminal::open() {
                Some(terminal) => {
                    tell!("no tev at {ADDRESS} ({SOURCE}): the image is shown here");
                    Screen::Terminal(terminal)
                }
                None => {
                    return Err(Error::usage(format!(
                        "--live: no tev answers at {ADDRESS} ({why}), and standard error is no terminal with colours; start tev \
                         ({SOURCE}), say where it listens with --live=HOST:PORT, or leave --live out"
                    )));
                }
            },
        };
        Ok(Self { screen, last: None })
    }

    /// Shows an image, unless one was shown so shortly before that work would wait for it.
    pub fn show_when_due(&mut self, name: &str, image: &dyn Image) {
        if self.last.is_none_or(|(when, took)| when.elapsed() >= PAUSE.max(took * SHARE)) {
            self.show(name, image);
        }
    }

    /// Shows an image under a name; where that cannot be done any longer, says so once, and work goes on without.
    pub fn show(&mut self, name: &str, image: &dyn Image) {
        let begun = Instant::now();
        let shown = match &mut self.screen {
            Screen::Tev(tev) => tev.show(name, image),
            Screen::Terminal(terminal) => terminal.show(name, image),
            Screen::Gone => Ok(()),
        };
        if let Err(why) = shown {
            tell!("the image is no longer shown ({why}); rendering goes on");
            self.screen = Screen::Gone;
        }
        self.last = Some((Instant::now(), begun.elapsed()));
    }
}
