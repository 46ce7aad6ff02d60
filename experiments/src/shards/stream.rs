//! The records of one unit of work as a stream, in order: while some bytes are added up, the next are read and hashed. Replicates of a group may be
//! taken side by side.

use super::file::{PIECE, Place, Record};
use crate::error::Error;
use integrators::state::damaged;
use integrators::statistics::GROUP;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::slice;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

/// Pieces in memory at once: a few megabytes, so that neither side waits for the other's single steps.
const HELD: usize = 16;
const MEND: &str = "remove it, and run its shard again";

/// The bytes of a record.
pub type Bytes<'a> = io::Take<&'a mut (dyn Read + Send)>;

/// What takes a record, or those that are to be taken side by side, with all of their bytes, and says whether there shall be more. That the bytes
/// are what was written is known when all are taken.
pub type Take<'a> = dyn FnMut(&[Place], &mut [Bytes]) -> io::Result<ControlFlow<()>> + 'a;

/// How replicates that are kept one by one are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Taken {
    /// One after the other.
    InTurn,
    /// Those of a group at once, some bytes of each in turn.
    SideBySide,
}

/// Reads records, each given by the number of its file, and has them taken in order until there are no more or `take` breaks.
///
/// # Errors
/// If a record cannot be read or taken, some of it is left, or its hash does not fit: some of it may have been taken then, and all before it.
pub fn records(files: &[PathBuf], records: &[(usize, Place)], taken: Taken, take: &mut Take) -> Result<(), Error> {
    let single = records.iter().take_while(|(_, place)| taken == Taken::SideBySide && place.gathered == 0).count();
    let (single, others) = records.split_at(single);
    for group in single.chunk_by(|a, b| a.1.replicate / GROUP == b.1.replicate / GROUP) {
        let failed = |source| failed(&files[group[0].0], source);
        if side_by_side(files, group, take).map_err(failed)?.is_break() {
            return Ok(());
        }
    }
    in_turn(files, others, take)
}

fn failed(path: &Path, source: io::Error) -> Error {
    Error::Io { action: "read", path: path.to_owned(), source, mend: MEND }
}

/// What takes a record shall take all of it.
fn all_taken(bytes: &Bytes) -> io::Result<()> {
    if bytes.limit() > 0 { Err(damaged("it is longer than it should be")) } else { Ok(()) }
}

/// Has the records of a group, which one file holds, taken at once. Each is read through an opening of its own, so that the system reads ahead in it.
fn side_by_side(files: &[PathBuf], group: &[(usize, Place)], take: &mut Take) -> io::Result<ControlFlow<()>> {
    let places: Vec<Place> = group.iter().map(|&(_, place)| place).collect();
    let mut opened: Vec<File> = group.iter().map(|&(file, _)| File::open(&files[file])).collect::<io::Result<_>>()?;
    let begun = opened.iter_mut().zip(&places).map(|(file, place)| Record::begin(file, place).map(BufReader::new));
    let mut records: Vec<_> = begun.collect::<io::Result<_>>()?;
    let from = records.iter_mut().zip(&places).map(|(record, place)| {
        let from: &mut (dyn Read + Send) = record;
        from.take(place.length)
    });
    let mut bytes: Vec<Bytes> = from.collect();
    let taken = take(&places, &mut bytes)?;
    bytes.iter().try_for_each(all_taken)?;
    drop(bytes);
    records.into_iter().try_for_each(|record| record.into_inner().end())?;
    Ok(taken)
}

/// Has records taken one after the other, of which the next is read meanwhile.
fn in_turn(files: &[PathBuf], records: &[(usize, Place)], take: &mut Take) -> Result<(), Error> {
    thread::scope(|scope| {
        let (full, filled) = channel();
        let (empty, emptied) = channel();
        (0..HELD).for_each(|_| drop(empty.send(vec![0; PIECE])));
        // Ends early where who takes them has gone.
        scope.spawn(move || read(files, records, &full, &emptied));
        let mut pieces = Pieces { filled, empty, piece: Vec::new(), taken: 0, ended: false };
        for &(file, ref place) in records {
            let failed = |source| failed(&files[file], source);
            let from: &mut (dyn Read + Send) = &mut pieces;
            let mut bytes = from.take(place.length);
            let taken = take(slice::from_ref(place), slice::from_mut(&mut bytes)).map_err(failed)?;
            all_taken(&bytes).map_err(failed)?;
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
        record.read_exact(&mut piece)?;
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
