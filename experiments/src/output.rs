//! Where results go: checked before any ray is traced, and replaced only as a whole.

use crate::error::Error;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

const MEND: &str = "name a place where files can be written";

/// Checks that a file can be written at `path`; nothing there is changed.
///
/// # Errors
/// If its folder is missing or not writable, or `path` is a folder itself.
pub fn check_file(path: &Path) -> Result<(), Error> {
    let failed = |source: io::Error| Error::Io { action: "write", path: path.to_owned(), source, mend: MEND };
    if path.is_dir() || path.file_name().is_none() {
        return Err(failed(io::Error::other("it is a folder, not a file")));
    }
    if path.exists() && !path.is_file() {
        return Err(failed(io::Error::other("it is no regular file, and would be replaced by one")));
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    probe(folder).map_err(failed)
}

/// Creates and removes a file in a folder.
fn probe(folder: &Path) -> io::Result<()> {
    let probe = folder.join(format!(".neumann-{}.tmp", std::process::id()));
    fs::File::create_new(&probe)?;
    fs::remove_file(probe)
}

/// A folder of results, replaced file by file once all files are complete.
///
/// New files are gathered in a folder beside their destination. [`Folder::commit`] renames them into place, the manifest
/// last, and removes what an earlier run left and this one doesn't replace; files that no run wrote are never touched.
pub struct Folder {
    path: PathBuf,
    staging: PathBuf,
    created: Option<PathBuf>,
    committed: bool,
}

impl Folder {
    /// Gets a folder ready, and creates it and its parents where they are missing.
    ///
    /// # Errors
    /// If it cannot be created or written.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let failed = |source: io::Error| Error::Io { action: "write", path: path.to_owned(), source, mend: MEND };
        let created = path.ancestors().filter(|p| !p.as_os_str().is_empty() && !p.exists()).last().map(Path::to_owned);
        let staging = path.join(format!(".neumann-{}.partial", std::process::id()));
        let folder = Self { path: path.to_owned(), staging, created, committed: false };
        // What a process of the same number left when it was killed.
        if folder.staging.exists() {
            fs::remove_dir_all(&folder.staging).map_err(failed)?;
        }
        fs::create_dir_all(&folder.staging).map_err(failed)?;
        probe(&folder.staging).map_err(failed)?;
        Ok(folder)
    }

    /// Where to write files until they are complete.
    pub fn staging(&self) -> &Path {
        &self.staging
    }

    /// The files written so far, relative to the folder, in order.
    ///
    /// # Errors
    /// If a folder cannot be read.
    pub fn files(&self) -> Result<Vec<String>, Error> {
        let mut files = Vec::new();
        let failed = |source| Error::Io { action: "read", path: self.staging.clone(), source, mend: MEND };
        collect(&self.staging, "", &mut files).map_err(failed)?;
        files.sort();
        Ok(files)
    }

    /// Moves all files into place, `last` at the end, and removes those of `former` that are not among them.
    ///
    /// # Errors
    /// If a file cannot be moved.
    pub fn commit(mut self, former: &[String], last: &str) -> Result<(), Error> {
        let mut files = self.files()?;
        files.sort_by_key(|file| file == last);
        for file in &files {
            let target = self.path.join(file);
            let parent = target.parent().unwrap_or(&self.path).to_owned();
            let moved = fs::create_dir_all(parent).and_then(|()| fs::rename(self.staging.join(file), &target));
            moved.map_err(|source| Error::Io { action: "write", path: target, source, mend: MEND })?;
        }
        self.committed = true;
        for stale in former.iter().filter(|file| !files.contains(file)) {
            self.remove_stale(stale);
        }
        Ok(())
    }

    /// Removes a file of an earlier run, and its folder where that is empty then. What cannot be removed stays: the manifest
    /// no longer names it.
    fn remove_stale(&self, file: &str) {
        let inside = Path::new(file).components().all(|c| matches!(c, std::path::Component::Normal(_)));
        if !inside {
            return;
        }
        let path = self.path.join(file);
        let _ = fs::remove_file(&path);
        if let Some(parent) = path.parent().filter(|&p| p != self.path) {
            let _ = fs::remove_dir(parent);
        }
    }
}

impl Drop for Folder {
    /// Removes the staging folder, and the folders that were created for nothing.
    fn drop(&mut self) {
        // Nothing is left to be reported when cleaning up fails: the first error, if any, is on its way already.
        let _ = fs::remove_dir_all(&self.staging);
        let Some(top) = self.created.as_deref().filter(|_| !self.committed) else { return };
        for folder in self.path.ancestors() {
            let _ = fs::remove_dir(folder);
            if folder == top {
                return;
            }
        }
    }
}

fn collect(folder: &Path, prefix: &str, files: &mut Vec<String>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        match entry.file_type()?.is_dir() {
            true => collect(&entry.path(), &format!("{name}/"), files)?,
            false => files.push(name),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut files = Vec::new();
        collect(folder, "", &mut files).unwrap();
        files.sort();
        files
    }

    #[test]
    fn a_file_that_cannot_be_written_is_found_out_beforehand() {
        let folder = tempfile::tempdir().unwrap();
        assert!(check_file(&folder.path().join("a.exr")).is_ok());
        assert!(check_file(&folder.path().join("missing/a.exr")).is_err());
        let message = check_file(folder.path()).unwrap_err().to_string();
        assert!(message.contains("folder") && message.contains(folder.path().to_str().unwrap()), "{message}");
        assert!(names(folder.path()).is_empty());
    }

    #[test]
    fn results_are_replaced_and_strangers_kept() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("results/x");
        let run = |files: &[&str], former: &[String]| {
            let folder = Folder::open(&path).unwrap();
            for file in files {
                let file = folder.staging().join(file);
                fs::create_dir_all(file.parent().unwrap()).unwrap();
                fs::write(file, "x").unwrap();
            }
            folder.commit(former, "manifest.json").unwrap();
        };
        run(&["manifest.json", "a/old.exr", "both.csv"], &[]);
        fs::write(path.join("mine.txt"), "kept").unwrap();
        run(
            &["manifest.json", "both.csv", "b/new.exr"],
            &["a/old.exr".into(), "both.csv".into(), "../../escape".into()],
        );
        assert_eq!(names(&path), ["b/new.exr", "both.csv", "manifest.json", "mine.txt"]);
        assert!(!path.join("a").exists());
    }

    #[test]
    fn a_run_that_fails_leaves_nothing() {
        let home = tempfile::tempdir().unwrap();
        drop(Folder::open(&home.path().join("results/x")).unwrap());
        assert!(fs::read_dir(home.path()).unwrap().next().is_none());
    }
}
