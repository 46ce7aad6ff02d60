//! Replicates that are rendered in one place and added up in another: the sums of an image have the bits of those made in one.
//!
//! What leaves the first place is a replicate's film, as sums over samples, the seconds that it took, and what has been counted since its group
//! began. Nothing is added up there, so that the other place takes the same steps as if it had rendered the replicates itself.

use super::Render;
use crate::fireflies::Fireflies;
use crate::measurement::Counters;
use crate::state::{Stored, damaged};
use crate::statistics::GROUP;
use std::io::{self, Read, Write};

/// Numbers that are turned into bytes at once.
const PIECE: usize = 1 << 13;

impl Render<'_> {
    /// Renders a replicate of this number and adds it to nothing; gives the seconds that it took. The replicates of a group follow one another,
    /// from its first, or from one that [`Self::read_replicate`] gave.
    pub fn run_apart(&mut self, number: u32, progress: &(dyn Fn(f64) + Sync)) -> f64 {
        if number.is_multiple_of(GROUP) {
            self.group.clear();
        }
        self.trace(number, progress)
    }

    /// Writes the replicate rendered last, which took so many seconds.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write_replicate(&self, seconds: f64, to: &mut dyn Write) -> io::Result<()> {
        seconds.write(to)?;
        let mut bytes = Vec::with_capacity(8 * PIECE);
        for sums in self.film.sums.chunks(PIECE) {
            bytes.clear();
            sums.iter().for_each(|sum| bytes.extend_from_slice(&sum.to_le_bytes()));
            to.write_all(&bytes)?;
        }
        self.group.counters.write(to)?;
        self.group.invalid.write(to)?;
        self.group.fireflies.write(to)
    }

    /// Reads what [`Self::write_replicate`] wrote of a render of the same scene, method, settings and request, for the replicate that follows in its
    /// group to go on from there; gives the seconds that it took.
    ///
    /// # Errors
    /// If the bytes are damaged, or of a render of other layers.
    pub fn read_replicate(&mut self, from: &mut dyn Read) -> io::Result<f64> {
        let seconds = f64::read(from)?;
        let mut bytes = vec![0; 8 * PIECE];
        for sums in self.film.sums.chunks_mut(PIECE) {
            let bytes = &mut bytes[..8 * sums.len()];
            from.read_exact(bytes)?;
            let numbers =
                bytes.chunks_exact(8).map(|b| f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]));
            sums.iter_mut().zip(numbers).for_each(|(sum, number)| *sum = number);
        }
        let (counters, invalid) = (Counters::read(from)?, <Vec<u64>>::read(from)?);
        let fireflies = Fireflies::read(from)?;
        let layers = self.group.invalid.len();
        if invalid.len() != layers || fireflies.layers().len() != layers {
            return Err(damaged("it is of another image"));
        }
        (self.group.counters, self.group.invalid, self.group.fireflies) = (counters, invalid, fireflies);
        Ok(seconds)
    }

    /// Takes what [`Self::write_replicate`] wrote of the next replicate for a replicate of its own.
    ///
    /// # Errors
    /// Those of [`Self::read_replicate`].
    pub fn take_replicate(&mut self, from: &mut dyn Read) -> io::Result<()> {
        let seconds = self.read_replicate(from)?;
        self.add_replicate(seconds);
        Ok(())
    }
}
