//! A shard's file: replicates one after the other, as they were rendered.
//!
//! | bytes | what |
//! |---|---|
//! | 16 | `neumann shard 1` and a line feed; 1 is the format |
//! | 32 | the plan's hash |
//! | 4 | the shard's number from 1, little-endian as all that follows |
//! | 4, … | the length of what follows, and who rendered it, as JSON |
//! | | for every replicate: |
//! | 4 + 4 + 8 | unit of work, replicate, and the length of what follows |
//! | … | what [`Render::write_replicate`](integrators::Render::write_replicate) writes |
//! | 32 | BLAKE3 of these |
//! | | and at the end: |
//! | 4 + 4 | 2³² − 1, and how many replicates there are |
//! | 32 | BLAKE3 of the head and of all these hashes |
//!
//! While it grows it lies beside its place under another name, locked. Whatever ends the program, all of its replicates but the one at work can be
//! taken up; when it is whole, it is flushed to the disk and renamed.

use crate::error::Error;
use crate::result::Origin;
use integrators::state::{Stored, damaged};
use std::fs::{self, File, TryLockError};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 16] = b"neumann shard 1\n";
const HASH: usize = blake3::OUT_LEN;
/// What stands for a unit of work where there is no other replicate.
const END: u32 = u32::MAX;
/// Bytes that are hashed at once.
const BUFFER: usize = 1 << 20;
/// No name of a machine or compiler is that long.
const LONGEST_ORIGIN: usize = 1 << 16;
const MEND: &str = "make room there, or let it be written; the same command then goes on with what is complete";

/// What a shard's file begins with.
#[derive(Clone, Debug)]
pub struct Head {
    /// The plan's hash.
    pub plan: blake3::Hash,
    /// The shard's number, from 1.
    pub shard: u32,
    /// Who rendered it.
    pub origin: Origin,
}

impl Head {
    fn to_bytes(&self) -> Vec<u8> {
        let origin = serde_json::to_vec(&self.origin).unwrap_or_default();
        let mut bytes = [&MAGIC[..], self.plan.as_bytes(), &self.shard.to_le_bytes()].concat();
        bytes.extend_from_slice(&(origin.len() as u32).to_le_bytes());
        bytes.extend_from_slice(&origin);
        bytes
    }

    fn read(from: &mut dyn Read) -> io::Result<Self> {
        let (mut magic, mut plan) = ([0; MAGIC.len()], [0; HASH]);
        from.read_exact(&mut magic)?;
        from.read_exact(&mut plan)?;
        let (shard, length) = (u32::read(from)?, u32::read(from)? as usize);
        if magic != *MAGIC || length > LONGEST_ORIGIN {
            return Err(damaged("it is no shard of this format"));
        }
        let mut origin = vec![0; length];
        from.read_exact(&mut origin)?;
        let origin = serde_json::from_slice(&origin).map_err(|_| damaged("its head cannot be read"))?;
        Ok(Self { plan: blake3::Hash::from_bytes(plan), shard, origin })
    }

    /// Whether another one is of the same shard, and of numbers with the same bits.
    fn is_like(&self, other: &Self) -> bool {
        let kind = |origin: &Origin| {
            let Origin { neumann, program, machine } = origin.clone();
            (neumann, program, machine.platform, machine.kernels)
        };
        (self.plan, self.shard) == (other.plan, other.shard) && kind(&self.origin) == kind(&other.origin)
    }
}

/// A replicate in a file.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// The unit of work, as the plan counts.
    pub unit: u32,
    /// The replicate.
    pub replicate: u32,
    /// Where its bytes begin.
    pub offset: u64,
    /// How many there are.
    pub length: u64,
    hash: blake3::Hash,
}

/// A file looked through: every byte has been found to be what was written, as far as [`Contents::end`].
#[derive(Debug)]
pub struct Contents {
    /// Its head.
    pub head: Head,
    /// Its replicates.
    pub places: Vec<Place>,
    /// Where the last of them ends.
    pub end: u64,
    /// What is wrong with what comes then; `None` if the file is whole.
    pub fault: Option<String>,
}

/// Looks through a file.
///
/// # Errors
/// If its head cannot be read.
pub fn scan(path: &Path) -> io::Result<Contents> {
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut from = BufReader::with_capacity(BUFFER, file);
    let head = Head::read(&mut from)?;
    let mut contents = Contents { head, places: Vec::new(), end: from.stream_position()?, fault: None };
    let fault = loop {
        match next(&mut from, contents.end, length, &contents) {
            Ok(Some(place)) => {
                contents.end = place.offset + place.length + HASH as u64;
                contents.places.push(place);
            }
            Ok(None) => break None,
            Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => break Some("it ends too early".to_owned()),
            Err(e) => break Some(e.to_string()),
        }
    };
    contents.fault = fault;
    Ok(contents)
}

/// The replicate that begins here; `None` at the end of a file that is whole.
fn next(from: &mut BufReader<File>, start: u64, length: u64, before: &Contents) -> io::Result<Option<Place>> {
    let (unit, replicate) = (u32::read(from)?, u32::read(from)?);
    if unit == END {
        let mut hash = [0; HASH];
        from.read_exact(&mut hash)?;
        let is_whole = replicate as usize == before.places.len()
            && whole_hash(&before.head, &before.places) == blake3::Hash::from_bytes(hash)
            && from.stream_position()? == length;
        return if is_whole { Ok(None) } else { Err(damaged("its hash does not fit its bytes")) };
    }
    let place_length = u64::read(from)?;
    let offset = start + 16;
    if place_length > length.saturating_sub(offset + HASH as u64) {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    let mut hasher = begun_hash(unit, replicate, place_length);
    hasher.update_reader(from.by_ref().take(place_length))?;
    let (found, mut hash) = (hasher.finalize(), [0; HASH]);
    from.read_exact(&mut hash)?;
    if found != blake3::Hash::from_bytes(hash) {
        return Err(damaged("a hash in it does not fit its bytes"));
    }
    Ok(Some(Place { unit, replicate, offset, length: place_length, hash: found }))
}

fn begun_hash(unit: u32, replicate: u32, length: u64) -> blake3::Hasher {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&unit.to_le_bytes()).update(&replicate.to_le_bytes()).update(&length.to_le_bytes());
    hasher
}

fn whole_hash(head: &Head, places: &[Place]) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&head.to_bytes());
    for place in places {
        hasher.update(place.hash.as_bytes());
    }
    hasher.finalize()
}

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
        let contents = scan(&self.beside).ok().filter(|contents| contents.head.is_like(&self.head));
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

    /// The replicates that are complete.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// Appends a replicate.
    ///
    /// # Errors
    /// If it cannot be written; those before are intact then.
    pub fn push(&mut self, unit: u32, replicate: u32, bytes: &[u8]) -> Result<(), Error> {
        let length = bytes.len() as u64;
        let hash = begun_hash(unit, replicate, length).update(bytes).finalize();
        let start = [&unit.to_le_bytes()[..], &replicate.to_le_bytes(), &length.to_le_bytes()].concat();
        let written = [&start[..], bytes, hash.as_bytes()].into_iter().try_for_each(|part| self.file.write_all(part));
        written.map_err(|source| failed("write", &self.beside, source))?;
        self.places.push(Place { unit, replicate, offset: self.end + start.len() as u64, length, hash });
        self.end += start.len() as u64 + length + HASH as u64;
        Ok(())
    }

    /// Reads a replicate that is complete.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn read<T>(&self, place: &Place, read: impl FnOnce(&mut dyn Read) -> io::Result<T>) -> Result<T, Error> {
        read_place(&self.beside, place, read).map_err(|source| failed("read", &self.beside, source))
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

/// Reads a replicate from a file.
///
/// # Errors
/// If it cannot be read, or `read` leaves some of it.
pub fn read_place<T>(path: &Path, place: &Place, read: impl FnOnce(&mut dyn Read) -> io::Result<T>) -> io::Result<T> {
    let mut file = File::open(path)?;
    file.seek(SeekFrom::Start(place.offset))?;
    let mut from = BufReader::with_capacity(BUFFER, file).take(place.length);
    let value = read(&mut from)?;
    if from.limit() > 0 { Err(damaged("it is longer than it should be")) } else { Ok(value) }
}

fn failed(action: &'static str, path: &Path, source: io::Error) -> Error {
    Error::Io { action, path: path.to_owned(), source, mend: MEND }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(shard: u32) -> Head {
        Head { plan: blake3::hash(b"plan"), shard, origin: crate::shards::origin(1) }
    }

    fn bytes(replicate: u32) -> Vec<u8> {
        (0..1000 + replicate).map(|i| (i * 7 + replicate) as u8).collect()
    }

    fn grown(place: &Path, replicates: std::ops::Range<u32>) -> Growing {
        let mut growing = Growing::open(place, head(1), false).unwrap();
        replicates.for_each(|replicate| growing.push(4, replicate, &bytes(replicate)).unwrap());
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
        growing.read(&growing.places()[1], |from| from.read_to_end(&mut read)).unwrap();
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
    fn every_byte_that_changes_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("a.shard");
        grown(&place, 0..3).finish().unwrap();
        let whole = std::fs::read(&place).unwrap();
        let is_whole = |bytes: &[u8]| {
            std::fs::write(&place, bytes).unwrap();
            scan(&place).is_ok_and(|contents| contents.fault.is_none())
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
