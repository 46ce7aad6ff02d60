//! The records of one unit of work as a stream, in order: while some bytes are added up, the next are read and hashed.

use super::file::{PIECE, Place, Record};
use crate::error::Error;
use integrators::state::damaged;
use std::fs::File;
use std::io::{self, Read};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

/// Pieces in memory at once: a few megabytes, so that neither side waits for the other's single steps.
const HELD: usize = 16;
const MEND: &str = "remove it, and run its shard again";

/// What takes a record and all of its bytes, and says whether there shall be more. That the bytes are what was written is known when all are taken.
pub type Take<'a> = dyn FnMut(&Place, &mut io::Take<&mut dyn Read>) -> io::Result<ControlFlow<()>> + 'a;

/// Reads records, each given by the number of its file, and has them taken in order until there are no more or `take` breaks.
///
/// # Errors
/// If a record cannot be read or taken, some of it is left, or its hash does not fit: some of it may have been taken then, and all before it.
pub fn records(files: &[PathBuf], records: &[(usize, Place)], take: &mut Take) -> Result<(), Error> {
    thread::scope(|scope| {
        let (full, filled) = channel();
        let (empty, emptied) = channel();
        (0..HELD).for_each(|_| drop(empty.send(vec![0; PIECE])));
        // Ends early where who takes them has gone.
        scope.spawn(move || read(files, records, &full, &emptied));
        let mut pieces = Pieces { filled, empty, piece: Vec::new(), taken: 0, ended: false };
        for &(file, ref place) in records {
            let failed = |source| Error::Io { action: "read", path: files[file].clone(), source, mend: MEND };
            let from: &mut dyn Read = &mut pieces;
            let mut bytes = from.take(place.length);
            let taken = take(place, &mut bytes).map_err(failed)?;
            if bytes.limit() > 0 {
                return Err(failed(damaged("it is longer than it should be")));
            }
            pieces.end().map_err(failed)?;
            if taken.is_break() {
                break;
            }
        }
        Ok(())
    })
}

/// What has been read: a piece of a record, or nothing at its end, if its hash fits.
type Filled = io::Result<Option<Vec<u8>>>;

/// Reads records piece by piece, until they end or one cannot be read.
fn read(files: &[PathBuf], records: &[(usize, Place)], full: &Sender<Filled>, emptied: &Receiver<Vec<u8>>) {
    let mut open = None;
    for &(file, ref place) in records {
        let read = read_one(files, (file, place), &mut open, full, emptied);
        let failed = read.is_err();
        if full.send(read.map(|()| None)).is_err() || failed {
            return;
        }
    }
}

/// Reads a record from a file that may be open already.
fn read_one(
    files: &[PathBuf],
    (file, place): (usize, &Place),
    open: &mut Option<(usize, File)>,
    full: &Sender<Filled>,
    emptied: &Receiver<Vec<u8>>,
) -> io::Result<()> {
    let opened = match open {
        Some((opened, handle)) if *opened == file => handle,
        _ => &mut open.insert((file, File::open(&files[file])?)).1,
    };
    let gone = || io::Error::from(io::ErrorKind::BrokenPipe);
    let mut record = Record::begin(opened, place)?;
    let mut left = place.length;
    while left > 0 {
        let mut piece = emptied.recv().map_err(|_| gone())?;
        piece.resize(left.min(PIECE as u64) as usize, 0);
        record.fill(&mut piece)?;
        left -= piece.len() as u64;
        full.send(Ok(Some(piece))).map_err(|_| gone())?;
    }
    record.end()
}

/// The bytes of one record after the other.
struct Pieces {
    filled: Receiver<Filled>,
    empty: Sender<Vec<u8>>,
    piece: Vec<u8>,
    /// How much of the piece has been taken.
    taken: usize,
    /// Whether the record has no more.
    ended: bool,
}

impl Pieces {
    /// Goes on to the next piece of the record, if there is one.
    fn next(&mut self) -> io::Result<()> {
        let next = self.filled.recv().map_err(|_| io::Error::from(io::ErrorKind::UnexpectedEof))??;
        self.ended = next.is_none();
        self.taken = 0;
        let piece = std::mem::replace(&mut self.piece, next.unwrap_or_default());
        if piece.capacity() > 0 {
            // The last ones are not waited for.
            let _ = self.empty.send(piece);
        }
        Ok(())
    }

    /// Waits for what the hash of a record that has been taken says, and goes on to the next one.
    fn end(&mut self) -> io::Result<()> {
        while !self.ended {
            self.next()?;
        }
        self.ended = false;
        Ok(())
    }
}

impl Read for Pieces {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.taken == self.piece.len() && !self.ended {
            self.next()?;
        }
        let rest = &self.piece[self.taken..];
        let length = rest.len().min(buffer.len());
        buffer[..length].copy_from_slice(&rest[..length]);
        self.taken += length;
        Ok(length)
    }
}
