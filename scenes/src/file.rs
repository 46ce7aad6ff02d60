//! Files that a user names. Devices and pipes are none, and what is packed may not become endlessly much.

use flate2::read::MultiGzDecoder;
use std::io::{self, Read};
use std::path::Path;

/// How many times as large as it is a packed file may become. Meshes and images become some 2 to 20 times as large; what is made to fill
/// memory, 1000 times.
const MOST_TIMES: u64 = 200;
/// How large any packed file may become \[bytes\].
const ALWAYS: u64 = 1 << 26;

/// The bytes of a file.
///
/// # Errors
/// If it cannot be read, or has no end or none yet, as devices and pipes.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    check(path)?;
    std::fs::read(path)
}

/// The same, unpacked if its name ends in `.gz`.
///
/// # Errors
/// As of [`read`], and if it is not packed so, or becomes too large.
pub(crate) fn read_unpacked(path: &Path) -> io::Result<Vec<u8>> {
    if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("gz")) {
        return read(path);
    }
    let file = open(path)?;
    let (packed, mut bytes) = (file.metadata()?.len(), Vec::new());
    Unpacked::new(MultiGzDecoder::new(file), packed).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The same, as text in UTF-8.
///
/// # Errors
/// As of [`read`], and if it is no UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    check(path)?;
    std::fs::read_to_string(path)
}

/// A file to be read in part.
///
/// # Errors
/// As of [`read`].
pub fn open(path: &Path) -> io::Result<std::fs::File> {
    check(path)?;
    std::fs::File::open(path)
}

/// What unpacks bytes, and fails where they become too many.
pub(crate) struct Unpacked<R> {
    unpacker: R,
    left: u64,
}

impl<R: Read> Unpacked<R> {
    /// What is read by `unpacker`, from so many bytes.
    pub fn new(unpacker: R, packed: u64) -> Self {
        Self { unpacker, left: packed.saturating_mul(MOST_TIMES).max(ALWAYS) }
    }
}

impl<R: Read> Read for Unpacked<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.unpacker.read(buffer)?;
        let too_many = || format!("unpacked it is more than {MOST_TIMES} times as large, and more than 64 MB");
        self.left = self.left.checked_sub(count as u64).ok_or_else(|| io::Error::other(too_many()))?;
        Ok(count)
    }
}

/// Says if a path leads to nothing, or to what has no end or none yet.
pub(crate) fn check(path: &Path) -> io::Result<()> {
    let found = std::fs::metadata(path)?;
    // Of a folder the system says so itself.
    if found.is_file() || found.is_dir() {
        return Ok(());
    }
    Err(io::Error::new(io::ErrorKind::InvalidInput, "it is a device or a pipe"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_packed_may_not_fill_the_memory() {
        let unpack = |packed: u64, bytes: u64| {
            let mut unpacked = Unpacked::new(io::repeat(7).take(bytes), packed);
            io::copy(&mut unpacked, &mut io::sink()).map_err(|error| error.to_string())
        };
        let most = 200 << 20;
        assert_eq!((unpack(1, ALWAYS), unpack(1 << 20, most)), (Ok(ALWAYS), Ok(most)));
        assert!(unpack(1, ALWAYS + 1).is_err() && unpack(1 << 20, most + 1).unwrap_err().contains("200 times"));
    }

    #[test]
    #[cfg(unix)]
    fn what_has_no_end_is_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("a.toml");
        std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
        assert_eq!(read(&link).unwrap_err().to_string(), "it is a device or a pipe");
        assert!(read_text(&link).is_err() && open(&link).is_err());
        let told = crate::load::load(&link.to_string_lossy(), &Default::default()).err().unwrap().to_string();
        assert!(told.contains("a.toml: cannot read the file: it is a device or a pipe; give the path"), "{told}");
        assert!(read(folder.path()).is_err());
    }
}
