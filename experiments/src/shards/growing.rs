//! A shard's file while it grows: beside its place, under another name, locked.
//!
//! Whatever ends the program, all of its replicates but the one at work can be taken up; when it is whole, it is flushed to the disk and
//! renamed. Where moments are enough, a group takes the place of its replicates once it is full; what ends the program in that moment
//! costs the group.

use super::file::{END, Head, Look, Place, read_record, scan, whole_hash};
use crate::error::Error;
use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

const MEND: &str = "make room there, or let it be written; the same command then goes on with what is complete";

/// A shard's file while it grows.
pub struct Growing {
    head: Head,
    place: PathBuf,
    beside: PathBuf,
    /// Open, and locked, for as long as this lives.
    file: File,
    places: Vec<Place>,
    end: u64,
}

/// Whether a path still leads to an open file.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let (open, there) = (file.metadata(), fs::metadata(path));
    open.is_ok_and(|open| there.is_ok_and(|there| (open.dev(), open.ino()) == (there.dev(), there.ino())))
}

/// Whether a path still leads to a file; one that is open cannot be renamed here.
#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

impl Growing {
    /// The file that will be renamed to `place`, from where a process that was ended before has left it, or a `fresh` one.
    ///
    /// # Errors
    /// If another process is at it, or it cannot be written.
    pub fn open(place: &Path, head: Head, fresh: bool) -> Result<Self, Error> {
        let name = place.file_name().unwrap_or_default().to_string_lossy();
        let beside = place.with_file_name(format!(".{name}.partial"));
        let folder = place.parent().unwrap_or(Path::new("."));
        fs::create_dir_all(folder).map_err(|source| failed("write", folder, source))?;
        let file = loop {
            let opened = File::options().read(true).write(true).create(true).truncate(false).open(&beside);
            let file = opened.map_err(|source| failed("write", &beside, source))?;
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => {
                    let shard = head.shard;
                    return Err(Error::usage(format!(
                        "shard {shard} is being rendered by another process; wait until it ends"
                    )));
                }
                Err(TryLockError::Error(e)) if e.kind() != io::ErrorKind::Unsupported => {
                    return Err(failed("write", &beside, e));
                }
                _ => {}
            }
            // Who had it before may have renamed it between its opening here and its locking.
            if is_at(&file, &beside) {
                break file;
            }
        };
        let mut growing = Self { head, place: place.to_owned(), beside, file, places: Vec::new(), end: 0 };
        if fresh {
            growing.file.set_len(0).map_err(|source| failed("write", &growing.beside, source))?;
        }
        growing.take_up().map_err(|source| failed("write", &growing.beside, source))?;
        Ok(growing)
    }

    /// Finds what is complete, and cuts off what is not.
    fn take_up(&mut self) -> io::Result<()> {
        let contents = scan(&self.beside, Look::Bytes).ok().filter(|contents| contents.head.is_like(&self.head));
        if let Some(contents) = contents {
            (self.head, self.places, self.end) = (contents.head, contents.places, contents.end);
            self.file.set_len(self.end)?;
            self.file.seek(SeekFrom::End(0))?;
            return Ok(());
        }
        let head = self.head.to_bytes();
        self.file.set_len(0)?;
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(&head)?;
        self.end = head.len() as u64;
        Ok(())
    }

    /// The records that are complete.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// Appends a record of unit, first replicate, and 0 or how many have been added up.
    ///
    /// # Errors
    /// If it cannot be written; those before are intact then.
    pub fn append(&mut self, content: (u32, u32, u32), bytes: &[u8]) -> Result<(), Error> {
        let place = Place::of(content, self.end, bytes);
        let parts = [&place.head()[..], bytes, place.hash.as_bytes()];
        let written = parts.into_iter().try_for_each(|part| self.file.write_all(part));
        written.map_err(|source| failed("write", &self.beside, source))?;
        self.places.push(place);
        self.end = place.end();
        Ok(())
    }

    /// Puts a record of so many replicates in the place of their own, which come last.
    ///
    /// # Errors
    /// If it cannot be written; those before the group are intact then.
    pub fn gather(&mut self, replicates: u32, bytes: &[u8]) -> Result<(), Error> {
        let first = self.places.len().saturating_sub(replicates as usize);
        let Some(&Place { unit, replicate, offset, .. }) = self.places.get(first) else { return Ok(()) };
        self.places.truncate(first);
        self.end = offset - Place::HEAD;
        let back = self.file.seek(SeekFrom::Start(self.end));
        back.map_err(|source| failed("write", &self.beside, source))?;
        self.append((unit, replicate, replicates), bytes)?;
        self.file.set_len(self.end).map_err(|source| failed("write", &self.beside, source))
    }

    /// Reads a record that is complete.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn read(&self, place: &Place, read: impl FnOnce(&mut dyn Read) -> io::Result<()>) -> Result<(), Error> {
        let mut bytes = Vec::new();
        let opened = File::open(&self.beside).and_then(|mut file| read_record(&mut file, place, &mut bytes));
        let taken = opened.and_then(|()| read(&mut bytes.as_slice()));
        taken.map_err(|source| failed("read", &self.beside, source))
    }

    /// Has what is complete outlast a loss of power.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn flush(&mut self) -> Result<(), Error> {
        self.file.sync_all().map_err(|source| failed("write", &self.beside, source))
    }

    /// Puts the whole file in its place.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(mut self) -> Result<(), Error> {
        let hash = whole_hash(&self.head, &self.places);
        let count = self.places.len() as u32;
        let end = [&END.to_le_bytes()[..], &count.to_le_bytes(), hash.as_bytes()].concat();
        let written = self.file.write_all(&end).and_then(|()| self.file.sync_all());
        let placed = written.and_then(|()| fs::rename(&self.beside, &self.place));
        placed.map_err(|source| failed("write", &self.place, source))?;
        // The file is complete; that its name lasts is for the folder to say, where the system lets it.
        let _ = File::open(self.place.parent().unwrap_or(Path::new("."))).and_then(|folder| folder.sync_all());
        Ok(())
    }
}

fn failed(action: &'static str, path: &Path, source: io::Error) -> Error {
    Error::Io { action, path: path.to_owned(), source, mend: MEND }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shards::file::Contents;

    fn head(shard: u32) -> Head {
        Head { plan: blake3::hash(b"plan"), shard, origin: crate::shards::origin(1) }
    }

    fn bytes(replicate: u32) -> Vec<u8> {
        (0..1000 + replicate).map(|i| (i * 7 + replicate) as u8).collect()
    }

    fn grown(place: &Path, replicates: std::ops::Range<u32>) -> Growing {
        let mut growing = Growing::open(place, head(1), false).unwrap();
        replicates.for_each(|replicate| growing.append((4, replicate, 0), &bytes(replicate)).unwrap());
        growing
    }

    #[test]
    fn a_file_that_goes_on_later_has_the_bytes_of_one_made_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let [whole, later] = ["a.shard", "b.shard"].map(|name| folder.path().join(name));
        grown(&whole, 0..5).finish().unwrap();
        drop(grown(&later, 0..3));
        let beside = folder.path().join(".b.shard.partial");
        let length = std::fs::metadata(&beside).unwrap().len();
        // Killed while it wrote the third.
        File::options().write(true).open(&beside).unwrap().set_len(length - 1).unwrap();
        let growing = Growing::open(&later, head(1), false).unwrap();
        assert_eq!(growing.places().iter().map(|place| place.replicate).collect::<Vec<_>>(), [0, 1]);
        let mut read = Vec::new();
        growing.read(&growing.places()[1], |from| from.read_to_end(&mut read).map(drop)).unwrap();
        assert_eq!(read, bytes(1));
        assert!(Growing::open(&later, head(1), false).err().unwrap().to_string().contains("another process"));
        drop(growing);
        grown(&later, 2..5).finish().unwrap();
        assert!(std::fs::read(&whole).unwrap() == std::fs::read(&later).unwrap());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
        // What is left of another shard is not taken up.
        drop(grown(&later, 0..3));
        assert!(Growing::open(&later, head(2), false).unwrap().places().is_empty());
    }

    #[test]
    fn a_group_takes_the_place_of_its_replicates() {
        let folder = tempfile::tempdir().unwrap();
        let [place, other] = ["a.shard", "b.shard"].map(|name| folder.path().join(name));
        let mut growing = grown(&place, 0..5);
        growing.gather(3, b"moments").unwrap();
        growing.append((4, 5, 0), &bytes(5)).unwrap();
        drop(growing);
        let growing = Growing::open(&place, head(1), false).unwrap();
        let contents: Vec<_> = growing.places().iter().map(Place::content).collect();
        assert_eq!(contents, [(4, 0, 0), (4, 1, 0), (4, 2, 3), (4, 5, 0)]);
        assert_eq!(growing.places()[2].replicates(), 3);
        growing.finish().unwrap();
        let [bytes_read, records] = [Look::Bytes, Look::Records].map(|look| scan(&place, look).unwrap());
        assert!(bytes_read.fault.is_none() && records.fault.is_none());
        let mut held = Vec::new();
        read_record(&mut File::open(&place).unwrap(), &records.places[2], &mut held).unwrap();
        assert_eq!(held, b"moments");
        // Killed while the group was written: its replicates are gone, those before are not.
        let mut growing = grown(&other, 0..5);
        growing.gather(3, b"moments").unwrap();
        let end = growing.places()[2].end();
        drop(growing);
        let beside = folder.path().join(".b.shard.partial");
        File::options().write(true).open(&beside).unwrap().set_len(end - 1).unwrap();
        assert_eq!(Growing::open(&other, head(1), false).unwrap().places().len(), 2);
    }

    #[test]
    fn records_that_are_skipped_are_checked_when_they_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("a.shard");
        grown(&place, 0..3).finish().unwrap();
        let whole = std::fs::read(&place).unwrap();
        let records = scan(&place, Look::Records).unwrap().places;
        let fits = |bytes: &[u8]| {
            std::fs::write(&place, bytes).unwrap();
            let contents = scan(&place, Look::Records);
            let Ok(Contents { places, fault: None, .. }) = contents else { return false };
            let mut file = File::open(&place).unwrap();
            places.iter().all(|place| read_record(&mut file, place, &mut Vec::new()).is_ok())
        };
        assert!(fits(&whole) && records.len() == 3);
        for at in (0..whole.len()).step_by(11) {
            let mut bytes = whole.clone();
            bytes[at] ^= 4;
            assert!(!fits(&bytes), "byte {at}");
        }
        std::fs::write(&place, [&b"neumann shard 1\n"[..], &whole[16..]].concat()).unwrap();
        assert!(scan(&place, Look::Records).unwrap_err().to_string().contains("other versions"));
    }

    #[test]
    fn every_byte_that_changes_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("a.shard");
        grown(&place, 0..3).finish().unwrap();
        let whole = std::fs::read(&place).unwrap();
        let is_whole = |bytes: &[u8]| {
            std::fs::write(&place, bytes).unwrap();
            scan(&place, Look::Bytes).is_ok_and(|contents| contents.fault.is_none())
        };
        assert!(is_whole(&whole));
        for at in (0..whole.len()).step_by(13).chain([whole.len() - 1]) {
            let mut bytes = whole.clone();
            bytes[at] ^= 1;
            assert!(!is_whole(&bytes), "byte {at}");
            assert!(!is_whole(&whole[..at]), "{at} bytes");
        }
        assert!(!is_whole(&[&whole[..], b"x"].concat()));
    }
}
