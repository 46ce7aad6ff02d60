//! What leaves the program: [`exr`] for measurements with all their layers, [`png`] for pictures to look at (with [`tone`],
//! from light to screen, and [`pyramid`], the sheet of strategies), [`markup`] for SVG and HTML, [`vector`] for drawings in papers; [`notation`] says how orders are written.
//!
//! Every file is written under a temporary name in the folder where it belongs, flushed to the disk and renamed, so that a
//! reader, or a machine that loses power, finds either the old file or the whole new one.

pub mod exr;
mod lettering;
pub mod markup;
pub mod notation;
pub mod png;
pub mod pyramid;
#[cfg(test)]
pub(crate) mod testing;
pub mod tone;
pub mod vector;

use crate::error::NO_PLACE;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// What can go wrong with a file.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A file or folder can't be written.
    #[error("cannot write {path}: {source}; {mend}", mend = NO_PLACE)]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file can't be read.
    #[error("cannot read {path}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file is no image of the kind expected.
    #[error("cannot read {path}: {reason}")]
    Format {
        /// The file.
        path: PathBuf,
        /// What was found, or what was expected.
        reason: String,
    },
    /// An image can't be encoded.
    #[error("cannot encode {path}: {reason}")]
    Encode {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

/// Writes a file so that it appears whole or not at all.
///
/// # Errors
/// [`ExportError::Write`] if the folder is missing or not writable, or the disk is full; what was there before is then intact.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    let written = write_streamed(path, |file| file.write_all(bytes));
    written.map_err(|source| ExportError::Write { path: path.to_owned(), source })
}

/// The same for a file that `write` writes piece by piece, and may read again.
///
/// # Errors
/// Those of `write`, and those of [`write_atomically`].
pub fn write_streamed(path: &Path, write: impl FnOnce(&mut File) -> std::io::Result<()>) -> std::io::Result<()> {
    let temporary = temporary_beside(path);
    let written = write_and_sync(&temporary, write).and_then(|()| std::fs::rename(&temporary, path));
    if written.is_err() {
        // The first error is the one to report; a temporary file that can't be removed either adds nothing to it.
        let _ = std::fs::remove_file(&temporary);
        return written;
    }
    sync_folder(path);
    Ok(())
}

fn write_and_sync(path: &Path, write: impl FnOnce(&mut File) -> std::io::Result<()>) -> std::io::Result<()> {
    let mut file = File::options().read(true).write(true).create(true).truncate(true).open(path)?;
    write(&mut file)?;
    file.sync_all()
}

/// The rename itself lasts once the folder is on the disk. Not every system lets a folder be opened for that, and the file
/// is complete in any case, so a failure here is no error.
fn sync_folder(path: &Path) {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let _ = File::open(folder).and_then(|f| f.sync_all());
}

fn temporary_beside(path: &Path) -> PathBuf {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}-{count}.tmp", std::process::id()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_and_leaves_nothing_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_atomically(&path, b"old").unwrap();
        write_atomically(&path, b"new").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_failed_write_names_the_file_and_keeps_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("no/such/folder/a.txt");
        assert!(write_atomically(&missing, b"x").unwrap_err().to_string().contains("a.txt"));

        // A folder that isn't empty can't be replaced by a file: the rename fails after the temporary file was written.
        let taken = folder.path().join("taken");
        std::fs::create_dir(&taken).unwrap();
        std::fs::write(taken.join("kept"), b"kept").unwrap();
        assert!(write_atomically(&taken, b"x").is_err());
        assert_eq!(std::fs::read(taken.join("kept")).unwrap(), b"kept");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
