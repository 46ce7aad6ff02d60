//! Which program this is: numbers that another one rendered are not this one's.

use crate::result::Program;
use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::OnceLock;

/// What is known of the program at work, beside its version.
///
/// The version names the sources of neumann alone; a program with methods of its own differs from it in its file's hash.
pub fn program() -> &'static Program {
    static PROGRAM: OnceLock<Program> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        // Where the program's own file cannot be read, its version has to do.
        let hash = std::env::current_exe().and_then(|path| hash_of(&path)).unwrap_or_default();
        Program {
            compiler: env!("NEUMANN_COMPILER").to_owned(),
            target: env!("NEUMANN_TARGET").to_owned(),
            profile: env!("NEUMANN_PROFILE").to_owned(),
            features: env!("NEUMANN_FEATURES").to_owned(),
            hash,
        }
    })
}

/// The hash of a file, of which little is in memory at once.
fn hash_of(path: &Path) -> io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(File::open(path)?)?;
    Ok(hasher.finalize().to_hex().to_string())
}
