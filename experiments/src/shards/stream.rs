//! The records of one unit of work as a stream, in order: while one is added up, the next is read and checked.

use super::file::{Place, read_record};
use crate::error::Error;
use std::fs::File;
use std::io;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{channel, sync_channel};
use std::thread;

/// Records in memory at once: the one that is taken and the one that is read.
const HELD: usize = 2;
const MEND: &str = "remove it, and run its shard again";

/// What takes a record and its bytes, and says whether there shall be more.
pub type Take<'a> = dyn FnMut(&Place, &[u8]) -> io::Result<ControlFlow<()>> + 'a;

/// Reads records, each given by the number of its file, and has them taken in order until there are no more or `take` breaks.
///
/// # Errors
/// If a record cannot be read or taken, or its hash does not fit; all before it have been taken then.
pub fn records(files: &[PathBuf], records: &[(usize, Place)], take: &mut Take) -> Result<(), Error> {
    thread::scope(|scope| {
        let (full, filled) = sync_channel(0);
        let (empty, emptied) = channel();
        (0..HELD).for_each(|_| drop(empty.send(Vec::new())));
        scope.spawn(move || {
            let mut open = None;
            // Who takes them may have gone.
            for (&(file, ref place), mut bytes) in records.iter().zip(emptied) {
                let read = read((file, &files[file]), place, &mut open, &mut bytes);
                let failed = read.is_err();
                if full.send((file, read.map(|()| (place, bytes)))).is_err() || failed {
                    return;
                }
            }
        });
        for (file, record) in filled {
            let failed = |source| Error::Io { action: "read", path: files[file].clone(), source, mend: MEND };
            let (place, bytes) = record.map_err(failed)?;
            if take(place, &bytes).map_err(failed)?.is_break() {
                break;
            }
            // The last ones are not waited for.
            let _ = empty.send(bytes);
        }
        Ok(())
    })
}

/// Reads a record from a file that may be open already.
fn read(
    (number, path): (usize, &Path),
    place: &Place,
    open: &mut Option<(usize, File)>,
    bytes: &mut Vec<u8>,
) -> io::Result<()> {
    let file = match open {
        Some((opened, file)) if *opened == number => file,
        _ => &mut open.insert((number, File::open(path)?)).1,
    };
    read_record(file, place, bytes)
}
