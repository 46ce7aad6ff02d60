//! `neumann bench`: how fast rays are followed, and whether any gets through where it should not.

mod leaks;
mod meshes;
mod rays;

use crate::cli::BenchArgs;
use crate::cli::BenchKind;
use crate::error::{Error, Status};

/// Measures what was asked for.
///
/// # Errors
/// If a scene cannot be read, or standard output not be written.
pub fn bench(args: &BenchArgs) -> Result<Status, Error> {
    match &args.kind {
        BenchKind::Rays { scenes, json } => rays::rays(scenes, *json),
        BenchKind::Leaks { rays, seed } => leaks::leaks(*rays, *seed),
    }
}
