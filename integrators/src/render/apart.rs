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
use crate::statistics::side_by_side::{Pixels, SideBySide};
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
        if self.film.sums.is_empty() {
            self.film.clear();
        }
        read_numbers(&mut self.film.sums, from)?;
        read_counts(&mut self.group, from)?;
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

    /// Takes what [`Self::write_replicate`] wrote of all replicates of the next group, full or the last one, for replicates of its own: the bits are
    /// those of taking one after the other, but no more than some pixels of each are in memory, which `look` is shown in order.
    ///
    /// # Errors
    /// If a group is at work, or the bytes are damaged or of a render of other layers, or cannot be read: the render is of no use then.
    pub fn take_replicates<R: Read + Send>(&mut self, from: &mut [R], look: &mut dyn FnMut(&Pixels)) -> io::Result<()> {
        let (layers, samples) = (self.request.film_layers(), self.settings.samples_per_replicate);
        let all = self.whole.pixels.mean.len() / (layers * 3);
        if !(1..=GROUP as usize).contains(&from.len()) || self.group.count() > 0 {
            return Err(damaged("it is of other replicates"));
        }
        let mut group = Tally::new(0, &self.grid, layers, self.request.layers().len());
        group.seconds = from.iter_mut().map(|from| f64::read(from)).collect::<io::Result<_>>()?;
        let (mut pixels, mut sums) =
            (Pixels::new(from.len(), layers, samples), SideBySide::new(self.grid, from.len(), layers));
        while pixels.read(all, from)? {
            look(&pixels);
            sums.add(&mut self.whole.pixels, &pixels);
        }
        // Each has what has been counted since the group began.
        from.iter_mut().try_for_each(|from| read_counts(&mut group, from))?;
        self.last_group = (group.seconds.len() as u32, sums.end(&mut self.whole, group, samples));
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

/// Reads what has been counted since a group began.
fn read_counts(group: &mut Tally, from: &mut dyn Read) -> io::Result<()> {
    let (counters, invalid, fireflies) = (Counters::read(from)?, <Vec<u64>>::read(from)?, Fireflies::read(from)?);
    let layers = group.invalid.len();
    if invalid.len() != layers || fireflies.layers().len() != layers {
        return Err(damaged("it is of another image"));
    }
    (group.counters, group.invalid, group.fireflies) = (counters, invalid, fireflies);
    Ok(())
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
