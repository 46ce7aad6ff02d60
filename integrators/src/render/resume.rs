//! A render that is interrupted, and goes on as if it had not been.

use super::Render;
use crate::state::{Stored, damaged};
use crate::tally::Tally;
use std::io::{self, Read, Write};

impl Render<'_> {
    /// Writes all that later replicates and the end depend on, the settings apart.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn save(&self, to: &mut dyn Write) -> io::Result<()> {
        for tally in [&self.whole, &self.group] {
            let filled = tally.count() > 0;
            u8::from(filled).write(to)?;
            if filled {
                tally.write(to)?;
            }
        }
        Ok(())
    }

    /// Takes up what [`save`](Self::save) wrote of a render of the same scene, method, settings and request: later replicates, and the
    /// measurement, have the bits of an uninterrupted run.
    ///
    /// # Errors
    /// If the bytes are damaged, or of a render of other pixels or layers; this one is then as it was.
    pub fn resume(&mut self, from: &mut dyn Read) -> io::Result<()> {
        let (whole, group) = (<Option<Tally>>::read(from)?, <Option<Tally>>::read(from)?);
        if ![&whole, &group].into_iter().flatten().all(|tally| tally.is_like(&self.whole)) {
            return Err(damaged("it is of another image"));
        }
        self.whole.clear();
        self.group.clear();
        whole.into_iter().for_each(|tally| self.whole = tally);
        group.into_iter().for_each(|tally| self.group = tally);
        Ok(())
    }
}
