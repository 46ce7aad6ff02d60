//! Files, read whole.

use std::io;
use std::path::Path;

/// The bytes of a file. What has no end, or none yet, such as a device or a pipe, is an error.
pub(crate) fn read(path: &Path) -> io::Result<Vec<u8>> {
    check(path)?;
    std::fs::read(path)
}

/// The same, as text in UTF-8.
pub(crate) fn read_text(path: &Path) -> io::Result<String> {
    check(path)?;
    std::fs::read_to_string(path)
}

/// A file to be read in part.
pub(crate) fn open(path: &Path) -> io::Result<std::fs::File> {
    check(path)?;
    std::fs::File::open(path)
}

fn check(path: &Path) -> io::Result<()> {
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
