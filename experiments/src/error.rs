//! What can go wrong, and how the program ends.

use crate::export::ExportError;
use integrators::{MethodError, RenderError};
use scenes::SceneError;
use std::path::{Path, PathBuf};

/// What helps where a file cannot be written.
pub const NO_PLACE: &str = "make room there, or name a folder that is there and can be written";

/// An error in the words that the user reads: what, where, and how to mend it.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Flags or values that make no sense.
    #[error("{0}")]
    Usage(String),
    /// A fault in a file that was read.
    #[error("{}: {message}", place(file, *line))]
    File {
        /// The file.
        file: PathBuf,
        /// The line, from 1, where it is known.
        line: Option<usize>,
        /// What is wrong there, and the mend.
        message: String,
    },
    /// A folder or file that cannot be read or written.
    #[error("cannot {action} {}: {source}; {mend}", path.display())]
    Io {
        /// Such as `write`.
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
        /// What would help.
        mend: &'static str,
    },
    /// A scene that cannot be loaded.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A method that cannot be made.
    #[error(transparent)]
    Method(#[from] MethodError),
    /// A render that cannot start.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The user asked for an end by this signal before anything was complete.
    #[error("stopped before the first replicate; nothing was written")]
    Interrupted(i32),
    /// An image that cannot be written or read.
    #[error(transparent)]
    Export(#[from] ExportError),
}

fn place(file: &Path, line: Option<usize>) -> String {
    match line {
        Some(line) => format!("{}:{line}", file.display()),
        None => file.display().to_string(),
    }
}

impl Error {
    /// Flags or values that make no sense, with the mend.
    pub fn usage(message: impl Into<String>) -> Self {
        Self::Usage(message.into())
    }
}

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// All was done.
    Done,
    /// A test did not hold, or non-finite samples occurred.
    Failed,
    /// Ended early by this signal; what was complete is written.
    Interrupted(i32),
}

impl Status {
    /// The process's exit status: 0, 1, or 128 and the signal's number (130 for Ctrl-C, 143 for SIGTERM).
    pub fn code(self) -> u8 {
        match self {
            Status::Done => 0,
            Status::Failed => 1,
            Status::Interrupted(signal) => 128 + signal as u8,
        }
    }
}

/// Exit status of bad usage and bad input.
pub const BAD_INPUT: u8 = 2;

pub use scenes::nearest;

/// The sentence about an unknown name: `there is no KIND NAME; did you mean NEAREST? (KINDs: …)`.
pub fn unknown(kind: &str, name: &str, names: &[&str]) -> String {
    let meant = nearest(name, names).map(|n| format!("; did you mean `{n}`?")).unwrap_or_default();
    let kinds = match kind.strip_suffix('y') {
        Some(stem) if !stem.ends_with(['a', 'e', 'o', 'u']) => format!("{stem}ies"),
        _ => format!("{kind}s"),
    };
    format!("there is no {kind} `{name}`{meant} ({kinds}: {})", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_offered() {
        assert_eq!(nearest("Comparsion", &["furnace", "comparison", "convergence"]), Some("comparison"));
        assert_eq!(nearest("x", &[]), None);
        let message = unknown("scene", "cornel", &["cornell_box", "furnace"]);
        assert_eq!(message, "there is no scene `cornel`; did you mean `cornell_box`? (scenes: cornell_box, furnace)");
    }

    #[test]
    fn signals_become_their_customary_exit_statuses() {
        assert_eq!(Status::Interrupted(2).code(), 130);
        assert_eq!(Status::Interrupted(15).code(), 143);
    }
}
