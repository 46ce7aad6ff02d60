//! Ctrl-C and SIGTERM: the first one asks for an end after the replicate at work, the second one ends the program at once.

use crate::error::Error;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Whether the user asked for an early end.
#[derive(Clone, Debug, Default)]
pub struct Stop {
    signal: Arc<AtomicUsize>,
}

impl Stop {
    /// Never asks for an end: for callers without a terminal.
    pub fn never() -> Self {
        Self::default()
    }

    /// Listens to Ctrl-C and SIGTERM from now on.
    ///
    /// # Errors
    /// If the system refuses the handlers.
    pub fn on_signals() -> std::io::Result<Self> {
        let stop = Self::default();
        for signal in [SIGINT, SIGTERM] {
            // Each signal's second arrival finds the flag set and ends the process; handlers run in order of registration.
            let seen = Arc::new(AtomicBool::new(false));
            flag::register_conditional_shutdown(signal, 128 + signal, Arc::clone(&seen))?;
            flag::register(signal, seen)?;
            flag::register_usize(signal, Arc::clone(&stop.signal), signal as usize)?;
        }
        stop.announce();
        Ok(stop)
    }

    /// Says what a signal does, once one has come.
    fn announce(&self) {
        let stop = self.clone();
        std::thread::spawn(move || {
            while stop.signal().is_none() {
                std::thread::sleep(std::time::Duration::from_millis(50));
            }
            tell!(
                "stopping when the replicate or pilot at work is done, and keeping what is complete; once more stops at once"
            );
        });
    }

    /// The signal that asked for the end, if any.
    pub fn signal(&self) -> Option<i32> {
        match self.signal.load(Ordering::Relaxed) {
            0 => None,
            signal => Some(signal as i32),
        }
    }

    /// For work that leaves nothing behind where it ends early.
    ///
    /// # Errors
    /// If an end was asked for.
    pub fn check(&self) -> Result<(), Error> {
        self.signal().map_or(Ok(()), |signal| Err(Error::Interrupted(signal)))
    }
}
