//! What can be wrong with an expression or a set of them.

use super::{MAX_EXPRESSIONS, MAX_NAMES};

/// What is wrong with an expression, shown with a caret under the place.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}\n  {excerpt}\n  {:column$}^", "")]
pub struct ParseError {
    message: String,
    /// What surrounds the place, on one line.
    excerpt: String,
    /// Of the place in the excerpt, as a terminal shows it, from 0.
    column: usize,
}

/// Characters of the expression that are shown on either side of a fault.
const CONTEXT: usize = 50;

impl ParseError {
    /// A fault at a byte of the text.
    pub(super) fn new(text: &str, at: usize, message: impl Into<String>) -> Self {
        let (before, after) = text.split_at(at);
        let start = before.char_indices().rev().nth(CONTEXT - 1).map_or(0, |(i, _)| i);
        let end = after.char_indices().nth(CONTEXT).map_or(after.len(), |(i, _)| i);
        let mut excerpt = String::from(if start > 0 { "…" } else { "" });
        excerpt.extend(before[start..].chars().map(visible));
        let column = excerpt.chars().map(columns).sum();
        excerpt.extend(after[..end].chars().map(visible));
        excerpt.push_str(if end < after.len() { "…" } else { "" });
        Self { message: message.into(), excerpt: excerpt.trim_end().to_owned(), column }
    }

    /// What is wrong and how to mend it, without the place.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The column of a terminal, from 0, in which the fault would stand if the text began in the first; counted in the part
    /// that is shown where the text is long.
    pub fn column(&self) -> usize {
        self.column
    }
}

fn visible(c: char) -> char {
    if c.is_control() || c.is_whitespace() { ' ' } else { c }
}

/// The columns that a character takes in a terminal: none for marks above others, two for East Asian characters and pictures
/// (Unicode Standard Annex 11, by blocks).
fn columns(c: char) -> usize {
    match u32::from(c) {
        0x0300..=0x036F | 0x200B..=0x200F | 0x20D0..=0x20FF | 0xFE00..=0xFE0F | 0xFE20..=0xFE2F => 0,
        0x1100..=0x115F | 0x2E80..=0xA4CF | 0xAC00..=0xD7A3 | 0xF900..=0xFAFF | 0xFE30..=0xFE6F => 2,
        0xFF00..=0xFF60 | 0xFFE0..=0xFFE6 | 0x1F300..=0x1FAFF | 0x20000..=0x3FFFD => 2,
        _ => 1,
    }
}

/// Why a set of expressions cannot be used together.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LpeError {
    /// More expressions than bits.
    #[error("there are {0} expressions; at most {max} can be told apart at once, so use fewer", max = MAX_EXPRESSIONS)]
    Expressions(usize),
    /// More names than bits.
    #[error("the expressions mention {0} names; at most {max} can be told apart at once, so use fewer", max = MAX_NAMES)]
    Names(usize),
    /// Something grew beyond its bound.
    #[error(
        "these expressions need more than {limit} {what}; use smaller repetitions, or fewer expressions or names at once"
    )]
    TooLarge {
        /// What grew, in the plural.
        what: &'static str,
        /// Its bound.
        limit: usize,
    },
}
