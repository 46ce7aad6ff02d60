//! The bytes of a state's file.

use integrators::state::{Stored, damaged};
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::Path;

const HEAD: &[u8; 16] = b"neumann state 1\n";
const HASH: usize = blake3::OUT_LEN;
/// Bytes that are hashed, read and written at once.
const BUFFER: usize = 1 << 20;

/// Writes a state of this key and so many replicates.
pub(super) fn write_state(
    file: &mut File,
    (key, replicates): (&blake3::Hash, u32),
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut body = BufWriter::with_capacity(BUFFER, Hashed { inner: file, hasher: blake3::Hasher::new() });
    body.write_all(HEAD)?;
    body.write_all(key.as_bytes())?;
    replicates.write(&mut body)?;
    write(&mut body)?;
    let Hashed { inner, hasher } = body.into_inner()?;
    inner.write_all(hasher.finalize().as_bytes())
}

/// Reads a state, once all of its bytes have been found to be what was written.
pub(super) fn read_state<T>(
    path: &Path,
    key: Option<&blake3::Hash>,
    read: impl FnOnce(&mut dyn Read) -> io::Result<T>,
) -> io::Result<T> {
    let file = File::open(path)?;
    let length = file.metadata()?.len().checked_sub(HASH as u64).ok_or_else(|| damaged("it ends too early"))?;
    let mut hasher = blake3::Hasher::new();
    io::copy(&mut (&file).take(length), &mut hasher)?;
    let mut hash = [0; HASH];
    (&file).read_exact(&mut hash)?;
    if hasher.finalize() != blake3::Hash::from_bytes(hash) {
        return Err(damaged("its hash does not fit its bytes"));
    }
    let mut body = BufReader::with_capacity(BUFFER, File::open(path)?).take(length);
    read_head(&mut body, key)?;
    let state = read(&mut body)?;
    match body.limit() {
        0 => Ok(state),
        _ => Err(damaged("it is longer than it should be")),
    }
}

/// Reads what stands before a unit's own bytes, of this key or, with `None`, of any; gives the number of replicates.
pub(super) fn read_head(from: &mut dyn Read, key: Option<&blake3::Hash>) -> io::Result<u32> {
    let (mut head, mut found) = ([0; HEAD.len()], [0; HASH]);
    from.read_exact(&mut head)?;
    from.read_exact(&mut found)?;
    if head != *HEAD || key.is_some_and(|key| found != *key.as_bytes()) {
        return Err(damaged("it is no state of this format and key"));
    }
    u32::read(from)
}

/// Passes bytes on, and hashes them.
struct Hashed<'a> {
    inner: &'a mut File,
    hasher: blake3::Hasher,
}

impl Write for Hashed<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.inner.write(bytes)?;
        self.hasher.update(&bytes[..written]);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}
