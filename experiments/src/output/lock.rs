//! One run at a time in a folder of results.

use crate::error::{Error, NO_PLACE};
use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// The file that is locked.
const FILE: &str = ".neumann-lock";

/// A folder's lock. The system releases it when the process ends, however it ends.
pub struct Lock {
    path: PathBuf,
    /// Open, and locked, for as long as this lives. None where the file system knows no locks.
    _file: Option<File>,
}

impl Lock {
    /// Locks a folder.
    ///
    /// # Errors
    /// If another process has it, or the folder cannot be written.
    pub fn take(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(FILE);
        let failed = |source| Error::Io { action: "write", path: folder.to_owned(), source, mend: NO_PLACE };
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
        let mine = format!("{} {since}\n", std::process::id());
        loop {
            let mut file =
                File::options().read(true).write(true).create(true).truncate(false).open(&path).map_err(failed)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Err(Error::usage(in_use(folder, &path))),
                Err(TryLockError::Error(e)) if e.kind() == io::ErrorKind::Unsupported => {
                    tell!("warning: {} is on a file system without locks; have one run at a time", folder.display());
                    return Ok(Self { path, _file: None });
                }
                Err(TryLockError::Error(e)) => return Err(failed(e)),
            }
            file.set_len(0).and_then(|()| file.write_all(mine.as_bytes())).map_err(failed)?;
            // Who had it before may have removed the file between its opening here and its locking: then it locks nothing.
            let lost = match fs::read_to_string(&path) {
                Ok(text) => text != mine,
                Err(e) => e.kind() == io::ErrorKind::NotFound,
            };
            if !lost {
                return Ok(Self { path, _file: Some(file) });
            }
        }
    }

    /// Whether it keeps others out.
    pub fn holds(&self) -> bool {
        self._file.is_some()
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // A file that stays is no lock.
        let _ = fs::remove_file(&self.path);
    }
}

fn in_use(folder: &Path, lock: &Path) -> String {
    let text = fs::read_to_string(lock).unwrap_or_default();
    let process = text.split(' ').next().filter(|id| !id.is_empty()).map(|id| format!(" (process {id})"));
    format!(
        "{} is being written by another run{}; wait until it ends, or give another folder with --out",
        folder.display(),
        process.unwrap_or_default()
    )
}
