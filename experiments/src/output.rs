//! Where results go: checked before any ray is traced, and replaced only as a whole.

use crate::error::{Error, NO_PLACE};
use crate::manifest::MANIFEST;
use lock::Lock;
use serde::Deserialize;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

mod lock;

/// Files of ours that are no results begin like this.
pub const HIDDEN: &str = ".neumann-";
/// How a folder of unfinished files ends.
const UNFINISHED: &str = ".partial";
/// The folder of files that are complete and on their way.
const COMPLETE: &str = ".neumann-complete";

/// Whether a file's name ends so, in capitals or not.
pub fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending))
}

/// Checks that a file can be written at `path`; nothing there is changed.
///
/// # Errors
/// If its folder is missing or not writable, or `path` is a folder itself.
pub fn check_file(path: &Path) -> Result<(), Error> {
    let failed = |source: io::Error| Error::Io { action: "write", path: path.to_owned(), source, mend: NO_PLACE };
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

/// A folder of results, replaced as a whole once all files are complete.
///
/// One process at a time has it. New files are gathered in a hidden folder within it. [`Folder::commit`] declares them complete by
/// one renaming, moves them into place, the manifest last, and removes what an earlier run left and this one doesn't replace. A
/// process that is killed before leaves the old results, and one killed after that renaming leaves what the next one puts in
/// place. Files that no run wrote are never touched.
pub struct Folder {
    path: PathBuf,
    staging: PathBuf,
    created: Option<PathBuf>,
    committed: bool,
    lock: Option<Lock>,
}

/// What a folder's manifest tells of it.
#[derive(Debug, Deserialize)]
struct Listing {
    files: Vec<String>,
}

impl Listing {
    /// The files that belong to the manifest of a folder.
    fn read(folder: &Path) -> Option<Vec<String>> {
        let listing: Listing = serde_json::from_slice(&fs::read(folder.join(MANIFEST)).ok()?).ok()?;
        Some(listing.files)
    }
}

impl Folder {
    /// Gets a folder ready: creates it and its parents where they are missing, locks it, puts in place what was complete when a run
    /// was killed, and removes what was not.
    ///
    /// # Errors
    /// If it cannot be created or written, or another process has it.
    pub fn open(path: &Path) -> Result<Self, Error> {
        let failed = |source: io::Error| Error::Io { action: "write", path: path.to_owned(), source, mend: NO_PLACE };
        let created = path.ancestors().filter(|p| !p.as_os_str().is_empty() && !p.exists()).last().map(Path::to_owned);
        let staging = path.join(format!("{HIDDEN}{}{UNFINISHED}", std::process::id()));
        let mut folder = Self { path: path.to_owned(), staging, created, committed: false, lock: None };
        fs::create_dir_all(path).map_err(failed)?;
        let lock = folder.lock.insert(Lock::take(path)?);
        let alone = lock.holds();
        put_in_place(path)?;
        if alone {
            remove_unfinished(path).map_err(failed)?;
        }
        fs::create_dir_all(&folder.staging).map_err(failed)?;
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
        let failed = |source| Error::Io { action: "read", path: self.staging.clone(), source, mend: NO_PLACE };
        collect(&self.staging, "", &mut files).map_err(failed)?;
        files.sort();
        Ok(files)
    }

    /// Moves all files into place, the manifest last, which lists them, and removes those that the former manifest lists and the new
    /// one doesn't.
    ///
    /// # Errors
    /// If a file cannot be moved.
    pub fn commit(&mut self) -> Result<(), Error> {
        let complete = self.path.join(COMPLETE);
        fs::rename(&self.staging, &complete).map_err(|source| not_moved(&self.path, source))?;
        self.committed = true;
        put_in_place(&self.path)
    }
}

fn not_moved(path: &Path, source: io::Error) -> Error {
    let mend = "let it be written, and run the same command again";
    Error::Io { action: "write", path: path.to_owned(), source, mend }
}

/// Puts complete files in place, as far as that has not been done. Whatever ends it, it can be done again.
fn put_in_place(path: &Path) -> Result<(), Error> {
    let complete = path.join(COMPLETE);
    if !complete.is_dir() {
        return Ok(());
    }
    // The manifest goes last: without one, all is in place.
    if let Some(files) = Listing::read(&complete) {
        let former = Listing::read(path).unwrap_or_default();
        let files_before = files.iter().filter(|file| *file != MANIFEST && is_inside(file));
        for file in files_before.filter(|file| complete.join(file).exists()) {
            let target = path.join(file);
            let parent = target.parent().unwrap_or(path);
            let moved = fs::create_dir_all(parent).and_then(|()| fs::rename(complete.join(file), &target));
            moved.map_err(|source| not_moved(&target, source))?;
        }
        former.iter().filter(|file| !files.contains(file)).for_each(|file| remove_stale(path, file));
        fs::rename(complete.join(MANIFEST), path.join(MANIFEST)).map_err(|source| not_moved(path, source))?;
    }
    fs::remove_dir_all(&complete).map_err(|source| not_moved(&complete, source))
}

/// Whether a path leads nowhere but into the folder that it is relative to.
fn is_inside(file: &str) -> bool {
    Path::new(file).components().all(|c| matches!(c, std::path::Component::Normal(_)))
}

/// Removes a file of an earlier run, and its folder where that is empty then. What cannot be removed stays: the manifest
/// no longer names it.
fn remove_stale(folder: &Path, file: &str) {
    if !is_inside(file) {
        return;
    }
    let path = folder.join(file);
    let _ = fs::remove_file(&path);
    if let Some(parent) = path.parent().filter(|&p| p != folder) {
        let _ = fs::remove_dir(parent);
    }
}

/// Removes the unfinished files of processes that were killed.
fn remove_unfinished(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with(HIDDEN) && name.ends_with(UNFINISHED) {
            fs::remove_dir_all(entry.path())?;
        }
    }
    Ok(())
}

impl Drop for Folder {
    /// Removes the staging folder, and the folders that were created for nothing.
    fn drop(&mut self) {
        // Nothing is left to be reported when cleaning up fails: the first error, if any, is on its way already.
        let _ = fs::remove_dir_all(&self.staging);
        drop(self.lock.take());
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

    /// Writes files with the manifest that lists them, and itself.
    fn fill(folder: &Path, files: &[&str]) {
        let listed = [files, &[MANIFEST]].concat();
        let manifest = serde_json::json!({ "files": listed }).to_string();
        for (file, text) in files.iter().map(|file| (*file, "new")).chain([(MANIFEST, manifest.as_str())]) {
            let file = folder.join(file);
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, text).unwrap();
        }
    }

    fn run(path: &Path, files: &[&str]) {
        let mut folder = Folder::open(path).unwrap();
        fill(folder.staging(), files);
        folder.commit().unwrap();
    }

    #[test]
    fn results_are_replaced_and_strangers_kept() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("results/x");
        run(&path, &["a/old.exr", "both.csv"]);
        fs::write(path.join("mine.txt"), "kept").unwrap();
        fs::write(home.path().join("results/escape"), "kept").unwrap();
        let listed = fs::read_to_string(path.join(MANIFEST)).unwrap();
        fs::write(path.join(MANIFEST), listed.replace("[\"", "[\"../escape\",\"")).unwrap();
        run(&path, &["both.csv", "b/new.exr"]);
        assert_eq!(names(&path), ["b/new.exr", "both.csv", "manifest.json", "mine.txt"]);
        assert!(!path.join("a").exists() && home.path().join("results/escape").exists());
    }

    #[test]
    fn what_was_complete_is_put_in_place_after_a_kill_and_what_was_not_is_removed() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("x");
        run(&path, &["a/old.exr", "both.csv"]);
        fs::write(path.join("both.csv"), "old").unwrap();
        // Killed while it wrote.
        fs::create_dir(path.join(".neumann-77.partial")).unwrap();
        fs::write(path.join(".neumann-77.partial/both.csv"), "half").unwrap();
        drop(Folder::open(&path).unwrap());
        assert_eq!(names(&path), ["a/old.exr", "both.csv", "manifest.json"]);
        assert_eq!(fs::read_to_string(path.join("both.csv")).unwrap(), "old");
        // Killed while it moved: with every number of files that may have been moved by then.
        for moved in [&[][..], &["both.csv"], &["both.csv", "b/new.exr"], &["both.csv", "b/new.exr", MANIFEST]] {
            let complete = path.join(COMPLETE);
            fill(&complete, &["both.csv", "b/new.exr"]);
            fs::create_dir_all(path.join("b")).unwrap();
            moved.iter().for_each(|file| fs::rename(complete.join(file), path.join(file)).unwrap());
            drop(Folder::open(&path).unwrap());
            let left = names(&path);
            assert_eq!(left, ["b/new.exr", "both.csv", "manifest.json"], "{moved:?}");
            assert_eq!(fs::read_to_string(path.join("both.csv")).unwrap(), "new");
        }
    }

    #[test]
    fn a_folder_has_one_owner_at_a_time() {
        let home = tempfile::tempdir().unwrap();
        let path = home.path().join("x");
        let folder = Folder::open(&path).unwrap();
        let message = Folder::open(&path).err().unwrap().to_string();
        let id = format!("process {})", std::process::id());
        assert!(message.contains(&id) && message.contains(path.to_str().unwrap()), "{message}");
        drop(folder);
        run(&path, &["a.csv"]);
        assert_eq!(names(&path), ["a.csv", "manifest.json"]);
    }

    #[test]
    fn a_run_that_fails_leaves_nothing() {
        let home = tempfile::tempdir().unwrap();
        drop(Folder::open(&home.path().join("results/x")).unwrap());
        assert!(fs::read_dir(home.path()).unwrap().next().is_none());
    }
}
