//! How often states are saved: so seldom that it costs next to nothing, and so often that little is lost.

/// Seconds of work between saves, unless saving takes longer than [`SHARE`] of it.
const EVERY: f64 = 30.0;
/// The part of the time that saving may take.
const SHARE: f64 = 0.01;

/// A clock that counts work.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    every: Option<f64>,
    /// Seconds of work since the last save.
    unsaved: f64,
    /// Seconds that it took.
    cost: f64,
}

impl Pace {
    /// Every so many seconds, whatever it costs; as often as is reasonable if None.
    pub fn new(every: Option<f64>) -> Self {
        Self { every, unsaved: 0.0, cost: 0.0 }
    }

    /// Whether it is time to save, after so many more seconds of work. If so, a new count begins.
    pub fn due(&mut self, seconds: f64) -> bool {
        self.unsaved += seconds;
        let due = self.unsaved >= self.every.unwrap_or(EVERY.max(self.cost / SHARE));
        if due {
            (self.unsaved, self.cost) = (0.0, 0.0);
        }
        due
    }

    /// A save took so many seconds.
    pub fn saved(&mut self, seconds: f64) {
        self.cost += seconds;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_saved_slowly_is_saved_seldom() {
        let mut pace = Pace::new(None);
        assert!(!pace.due(29.0) && pace.due(1.0) && !pace.due(29.0));
        [0.5, 0.5].into_iter().for_each(|seconds| pace.saved(seconds));
        assert!(!pace.due(70.0) && pace.due(1.0) && pace.due(30.0));
    }

    #[test]
    fn who_asks_for_it_has_every_replicate_saved() {
        let mut pace = Pace::new(Some(0.0));
        pace.saved(10.0);
        assert!(pace.due(0.0) && pace.due(0.001));
    }
}
