//! What can be wrong with a scene, told with its place and its mend.

use std::path::{Path, PathBuf};

/// Why a scene could not be loaded or built.
///
/// Every variant says what is wrong and how to mend it; where a file is at fault, which one and, if known, the line.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// What a scene says cannot be: a bad value, a missing or unknown part.
    #[error("{}{message}; {mend}", place(file.as_deref(), *line))]
    Invalid {
        /// The file at fault, if the scene came from one.
        file: Option<PathBuf>,
        /// The line in the file, counted from 1, if known.
        line: Option<usize>,
        /// What is wrong.
        message: String,
        /// What to do about it.
        mend: String,
    },
    /// A file cannot be read.
    #[error("{}cannot read the file: {source}; {mend}", place(Some(file.as_path()), *line))]
    Unreadable {
        /// The file at fault.
        file: PathBuf,
        /// The line at which reading stopped, counted from 1, if known.
        line: Option<usize>,
        /// What the system said.
        source: std::io::Error,
        /// What to do about it.
        mend: String,
    },
    /// There is no scene of that name.
    #[error("there is no scene `{name}`; {mend}")]
    Unknown {
        /// What was asked for.
        name: String,
        /// What to do about it, with the nearest valid name.
        mend: String,
    },
}

impl SceneError {
    /// An invalid scene, not yet tied to a file.
    pub fn invalid(message: impl Into<String>, mend: impl Into<String>) -> Self {
        SceneError::Invalid { file: None, line: None, message: message.into(), mend: mend.into() }
    }

    /// A file that cannot be read.
    pub fn unreadable(file: impl Into<PathBuf>, source: std::io::Error, mend: impl Into<String>) -> Self {
        SceneError::Unreadable { file: file.into(), line: None, source, mend: mend.into() }
    }

    /// The same error, placed in a file; a place already known is kept.
    pub fn in_file(mut self, path: impl AsRef<Path>) -> Self {
        if let SceneError::Invalid { file: file @ None, .. } = &mut self {
            *file = Some(path.as_ref().to_path_buf());
        }
        self
    }

    /// The same error, placed at a line (counted from 1); a line already known is kept.
    pub fn at_line(mut self, number: usize) -> Self {
        if let SceneError::Invalid { line: line @ None, .. } | SceneError::Unreadable { line: line @ None, .. } =
            &mut self
        {
            *line = Some(number);
        }
        self
    }
}

fn place(file: Option<&Path>, line: Option<usize>) -> String {
    match (file, line) {
        (Some(file), Some(line)) => format!("{}:{line}: ", file.display()),
        (Some(file), None) => format!("{}: ", file.display()),
        (None, Some(line)) => format!("line {line}: "),
        (None, None) => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_names_its_place_and_its_mend() {
        let error = SceneError::invalid("the radius is -1", "give a positive radius").in_file("a.toml").at_line(3);
        assert_eq!(error.to_string(), "a.toml:3: the radius is -1; give a positive radius");
        let again = error.in_file("b.toml").at_line(9);
        assert!(again.to_string().starts_with("a.toml:3"), "{again}");
    }
}
