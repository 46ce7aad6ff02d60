//! A shard's file: records one after the other, each of a replicate or of a group of them.
//!
//! | bytes | what |
//! |---|---|
//! | 16 | `neumann shard 2` and a line feed; 2 is the format |
//! | 32 | the plan's hash |
//! | 4 | the shard's number from 1, little-endian as all that follows |
//! | 4, … | the length of what follows, and who rendered it, as JSON |
//! | | for every record: |
//! | 4 + 4 + 4 + 8 | unit of work, its first replicate, 0 or how many have been added up, and the length of what follows |
//! | … | what [`Render::write_replicate`](integrators::Render::write_replicate) writes, or [`Render::write_group`](integrators::Render::write_group) |
//! | 32 | BLAKE3 of these |
//! | | and at the end: |
//! | 4 + 4 | 2³² − 1, and how many records there are |
//! | 32 | BLAKE3 of the head and of all these hashes |

use crate::result::Origin;
use integrators::state::{Stored, damaged};
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

const MAGIC: &[u8; 16] = b"neumann shard 2\n";
/// What files of all formats begin with.
const KIND: &[u8] = b"neumann shard ";
/// Bytes of a hash.
pub(super) const HASH: usize = blake3::OUT_LEN;
/// What stands for a unit of work where there is no other record.
pub(super) const END: u32 = u32::MAX;
/// Bytes that are hashed at once.
const BUFFER: usize = 1 << 20;
/// Bytes that are read and hashed at once where they are kept: what a processor's own cache holds of them.
pub(super) const PIECE: usize = 1 << 18;
/// Bytes read at once where records are skipped.
const SKIPPED: usize = 1 << 8;
/// No name of a machine or compiler is that long.
const LONGEST_ORIGIN: usize = 1 << 16;

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
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let origin = serde_json::to_vec(&self.origin).unwrap_or_default();
        let mut bytes = [&MAGIC[..], self.plan.as_bytes(), &self.shard.to_le_bytes()].concat();
        bytes.extend_from_slice(&(origin.len() as u32).to_le_bytes());
        bytes.extend_from_slice(&origin);
        bytes
    }

    fn read(from: &mut dyn Read) -> io::Result<Self> {
        let (mut magic, mut plan) = ([0; MAGIC.len()], [0; HASH]);
        from.read_exact(&mut magic)?;
        if magic != *MAGIC && magic.starts_with(KIND) {
            return Err(damaged("it is of a format that other versions of neumann write"));
        }
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
    pub(super) fn is_like(&self, other: &Self) -> bool {
        let kind = |origin: &Origin| {
            let Origin { neumann, program, machine } = origin.clone();
            (neumann, program, machine.platform, machine.kernels)
        };
        (self.plan, self.shard) == (other.plan, other.shard) && kind(&self.origin) == kind(&other.origin)
    }
}

/// A record in a file.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// The unit of work, as the plan counts.
    pub unit: u32,
    /// The replicate, or the first of a group.
    pub replicate: u32,
    /// 0 for a replicate by itself; of replicates that have been added up, how many they are.
    pub gathered: u32,
    /// Where its bytes begin.
    pub offset: u64,
    /// How many there are.
    pub length: u64,
    pub(super) hash: blake3::Hash,
}

impl Place {
    /// Bytes before those of a record.
    pub(super) const HEAD: u64 = 20;

    /// The record that begins at `start` and holds these bytes.
    pub(super) fn of((unit, replicate, gathered): (u32, u32, u32), start: u64, bytes: &[u8]) -> Self {
        let (offset, length) = (start + Self::HEAD, bytes.len() as u64);
        let mut place = Self { unit, replicate, gathered, offset, length, hash: blake3::Hash::from_bytes([0; HASH]) };
        place.hash = place.begun_hash().update(bytes).finalize();
        place
    }

    /// Replicates in it.
    pub fn replicates(&self) -> u32 {
        self.gathered.max(1)
    }

    /// Unit, first replicate, and how many have been added up.
    pub fn content(&self) -> (u32, u32, u32) {
        (self.unit, self.replicate, self.gathered)
    }

    /// Where the next one begins.
    pub(super) fn end(&self) -> u64 {
        self.offset + self.length + HASH as u64
    }

    pub(super) fn head(&self) -> Vec<u8> {
        let numbers = [self.unit, self.replicate, self.gathered].map(u32::to_le_bytes);
        [numbers.as_flattened(), &self.length.to_le_bytes()].concat()
    }

    fn begun_hash(&self) -> blake3::Hasher {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&self.head());
        hasher
    }
}

/// How closely a file is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// Every byte is read, and has to fit its hash.
    Bytes,
    /// The records' own bytes are skipped: they are checked when they are read. All else is looked at, their hashes included.
    Records,
}

/// A file looked through: all that was looked at has been found to be what was written, as far as [`Contents::end`].
#[derive(Debug)]
pub struct Contents {
    /// Its head.
    pub head: Head,
    /// Its records.
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
pub fn scan(path: &Path, look: Look) -> io::Result<Contents> {
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    let buffer = if look == Look::Bytes { BUFFER } else { SKIPPED };
    let mut from = BufReader::with_capacity(buffer, file);
    let head = Head::read(&mut from)?;
    let mut contents = Contents { head, places: Vec::new(), end: from.stream_position()?, fault: None };
    let fault = loop {
        match next(&mut from, look, length, &contents) {
            Ok(Some(place)) => {
                contents.end = place.end();
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

/// The record that begins where those before end; `None` at the end of a file that is whole.
fn next(from: &mut BufReader<File>, look: Look, length: u64, before: &Contents) -> io::Result<Option<Place>> {
    let (unit, replicate) = (u32::read(from)?, u32::read(from)?);
    let mut hash = [0; HASH];
    if unit == END {
        from.read_exact(&mut hash)?;
        let is_whole = replicate as usize == before.places.len()
            && whole_hash(&before.head, &before.places) == blake3::Hash::from_bytes(hash)
            && from.stream_position()? == length;
        return if is_whole { Ok(None) } else { Err(damaged("its hash does not fit its bytes")) };
    }
    let (gathered, place_length, offset) = (u32::read(from)?, u64::read(from)?, before.end + Place::HEAD);
    if place_length > length.saturating_sub(offset + HASH as u64) {
        return Err(io::ErrorKind::UnexpectedEof.into());
    }
    let hash_of_nothing = blake3::Hash::from_bytes(hash);
    let mut place = Place { unit, replicate, gathered, offset, length: place_length, hash: hash_of_nothing };
    let mut hasher = place.begun_hash();
    match look {
        Look::Bytes => drop(hasher.update_reader(from.by_ref().take(place_length))?),
        Look::Records => from.seek_relative(place_length as i64)?,
    }
    from.read_exact(&mut hash)?;
    place.hash = blake3::Hash::from_bytes(hash);
    if look == Look::Bytes && hasher.finalize() != place.hash {
        return Err(misfit());
    }
    Ok(Some(place))
}

fn misfit() -> io::Error {
    damaged("a hash in it does not fit its bytes")
}

pub(super) fn whole_hash(head: &Head, places: &[Place]) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&head.to_bytes());
    for place in places {
        hasher.update(place.hash.as_bytes());
    }
    hasher.finalize()
}

/// Reads a record from its file into `bytes`, which have been found then to be what was written.
///
/// # Errors
/// If it cannot be read, or its hash does not fit.
pub fn read_record(file: &mut File, place: &Place, bytes: &mut Vec<u8>) -> io::Result<()> {
    let length = usize::try_from(place.length).map_err(|_| damaged("a length beyond all memory"))?;
    bytes.resize(length, 0);
    let mut record = Record::begin(file, place)?;
    bytes.chunks_mut(PIECE).try_for_each(|piece| record.read_exact(piece))?;
    record.end()
}

/// A record that is read piece by piece.
pub(super) struct Record<'f> {
    file: &'f mut File,
    hasher: blake3::Hasher,
    hash: blake3::Hash,
    left: u64,
}

impl Read for Record<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let length = self.file.take(self.left).read(buffer)?;
        self.hasher.update(&buffer[..length]);
        self.left -= length as u64;
        Ok(length)
    }
}

impl<'f> Record<'f> {
    /// Before the first of its bytes.
    pub(super) fn begin(file: &'f mut File, place: &Place) -> io::Result<Self> {
        file.seek(SeekFrom::Start(place.offset))?;
        Ok(Self { file, hasher: place.begun_hash(), hash: place.hash, left: place.length })
    }

    /// Whether all of its bytes, read by now, are what was written.
    pub(super) fn end(self) -> io::Result<()> {
        if self.hasher.finalize() == self.hash { Ok(()) } else { Err(misfit()) }
    }
}
