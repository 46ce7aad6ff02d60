//! Replicates that are rendered in one place and added up in another: the sums of an image have the bits of those made in one.
//!
//! What leaves the first place is either a replicate's film, as sums over samples, the seconds that it took, and what has been counted since its
//! group began, for the other place to take the same steps as if it had rendered the replicate itself; or the moments of a group, which are the
//! same wherever its replicates are added up.

use super::Render;
use crate::fireflies::Fireflies;
use crate::measurement::Counters;
use crate::state::{Stored, damaged};
use crate::statistics::GROUP;
use crate::tally::Tally;
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
        write_numbers(&self.film.sums, to)?;
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
        read_numbers(&mut self.film.sums, from)?;
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

    /// Adds the replicate that [`Self::run_apart`] rendered or [`Self::read_replicate`] read last to its group, which stays apart.
    pub fn gather_replicate(&mut self, seconds: f64) {
        self.group.push(&self.film, &self.grid, self.settings.samples_per_replicate, seconds);
    }

    /// Writes the group whose replicates have been gathered.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write_group(&mut self, to: &mut dyn Write) -> io::Result<()> {
        // The pixels come last, in one piece, to be read where they lie.
        let pixels = &mut self.group.pixels;
        let (mean, m2) = (std::mem::take(&mut pixels.mean), std::mem::take(&mut pixels.m2));
        let written = self.group.write(to).and_then(|()| [&mean, &m2].iter().try_for_each(|x| write_numbers(x, to)));
        (self.group.pixels.mean, self.group.pixels.m2) = (mean, m2);
        written
    }

    /// Takes what [`Self::write_group`] wrote of the next group, full or the last one, for replicates of its own; the limit is the length of it.
    ///
    /// # Errors
    /// If a group is at work, or the bytes are damaged, or of a render of other pixels or layers: nothing has been taken then. If they cannot be
    /// read: the render is of no use then.
    pub fn take_group<R: Read>(&mut self, from: &mut io::Take<R>) -> io::Result<()> {
        let group = Tally::read(from)?;
        let length = self.whole.pixels.mean.len() as u64;
        let fits = group.is_like_beside(&self.whole) && from.limit() == 2 * 8 * length;
        if !fits || !(1..=GROUP).contains(&group.count()) || self.group.count() > 0 {
            return Err(damaged("it is of another image"));
        }
        self.last_group = (group.count(), self.whole.merge_from(&group, from)?);
        Ok(())
    }
}

fn write_numbers(numbers: &[f64], to: &mut dyn Write) -> io::Result<()> {
    let mut bytes = Vec::with_capacity(8 * PIECE);
    for piece in numbers.chunks(PIECE) {
        bytes.clear();
        piece.iter().for_each(|number| bytes.extend_from_slice(&number.to_le_bytes()));
        to.write_all(&bytes)?;
    }
    Ok(())
}

fn read_numbers(numbers: &mut [f64], from: &mut dyn Read) -> io::Result<()> {
    let mut bytes = vec![0; 8 * PIECE];
    for piece in numbers.chunks_mut(PIECE) {
        let bytes = &mut bytes[..8 * piece.len()];
        from.read_exact(bytes)?;
        piece.iter_mut().zip(bytes.as_chunks::<8>().0).for_each(|(number, bytes)| *number = f64::from_le_bytes(*bytes));
    }
    Ok(())
}
