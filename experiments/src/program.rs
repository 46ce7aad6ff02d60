//! Which program this is: numbers that another one rendered are not this one's.

use crate::result::Program;
use std::sync::OnceLock;

/// What is known of the program at work, beside its version.
///
/// The version names the sources of neumann alone; a program with methods of its own differs from it in its file's hash.
pub fn program() -> &'static Program {
    static PROGRAM: OnceLock<Program> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        // Where the program's own file cannot be read, its version has to do.
        let bytes = std::env::current_exe().and_then(std::fs::read).ok();
        Program {
            compiler: env!("NEUMANN_COMPILER").to_owned(),
            target: env!("NEUMANN_TARGET").to_owned(),
            profile: env!("NEUMANN_PROFILE").to_owned(),
            features: env!("NEUMANN_FEATURES").to_owned(),
            hash: bytes.map(|bytes| blake3::hash(&bytes).to_hex().to_string()).unwrap_or_default(),
        }
    })
}
