//! The words of pbrt's files, each with its line.

use std::borrow::Cow;
use std::path::Path;
use std::sync::Arc;

use crate::error::SceneError;
use crate::import::translation::Place;
pub(super) use crate::suggest::shown;

/// One word.
#[derive(Clone, Debug, PartialEq)]
pub enum Token<'t> {
    /// Letters without quotation marks.
    Word(&'t str),
    /// What stands between quotation marks.
    Text(Cow<'t, str>),
    /// A finite number.
    Number(f64),
    /// `[`
    Open,
    /// `]`
    Close,
}

/// What is left of a text.
pub struct Lexer<'t> {
    rest: &'t str,
    line: usize,
    file: Arc<Path>,
}

impl<'t> Lexer<'t> {
    /// Before the first word of a file.
    pub fn new(text: &'t str, file: Arc<Path>) -> Self {
        Self { rest: text.trim_start_matches('\u{feff}'), line: 1, file }
    }

    /// Where it is.
    pub fn place(&self) -> Place {
        Place { file: self.file.clone(), line: self.line }
    }

    /// The next word and its line, or nothing at the end.
    pub fn read(&mut self) -> Result<Option<(Token<'t>, usize)>, SceneError> {
        self.skip_blanks();
        let Some(first) = self.rest.chars().next() else { return Ok(None) };
        let line = self.line;
        let token = match first {
            '[' | ']' => {
                self.rest = &self.rest[1..];
                if first == '[' { Token::Open } else { Token::Close }
            }
            '"' => Token::Text(self.text()?),
            _ => {
                let ends = |c: char| c.is_whitespace() || matches!(c, '[' | ']' | '"' | '#');
                let end = self.rest.find(ends).unwrap_or(self.rest.len());
                let (word, rest) = self.rest.split_at(end);
                self.rest = rest;
                if first.is_ascii_digit() || matches!(first, '+' | '-' | '.') {
                    Token::Number(self.number(word)?)
                } else {
                    Token::Word(word)
                }
            }
        };
        Ok(Some((token, line)))
    }

    fn skip_blanks(&mut self) {
        loop {
            let trimmed = self.rest.trim_start();
            self.skip_to(self.rest.len() - trimmed.len());
            if !self.rest.starts_with('#') {
                return;
            }
            self.skip_to(self.rest.find('\n').unwrap_or(self.rest.len()));
        }
    }

    fn skip_to(&mut self, end: usize) {
        let (passed, rest) = self.rest.split_at(end);
        self.line += passed.bytes().filter(|&byte| byte == b'\n').count();
        self.rest = rest;
    }

    fn number(&self, word: &str) -> Result<f64, SceneError> {
        let found = word.parse::<f64>().ok().filter(|x| x.is_finite());
        found.ok_or_else(|| self.place().error(format!("`{}` is no number", shown(word)), "give a finite number"))
    }

    /// A text between quotation marks, which stays on its line.
    fn text(&mut self) -> Result<Cow<'t, str>, SceneError> {
        let inner = &self.rest[1..];
        let mut escaped = false;
        let mut end = None;
        for (i, c) in inner.char_indices() {
            match c {
                '\n' => break,
                _ if escaped => escaped = false,
                '\\' => escaped = true,
                '"' => {
                    end = Some(i);
                    break;
                }
                _ => {}
            }
        }
        let Some(end) = end else {
            return Err(self.place().error("a text has no end", "close its quotation marks on the same line"));
        };
        self.rest = &inner[end + 1..];
        let raw = &inner[..end];
        if !raw.contains('\\') {
            return Ok(Cow::Borrowed(raw));
        }
        let mut text = String::with_capacity(raw.len());
        let mut chars = raw.chars();
        while let Some(c) = chars.next() {
            match (c, if c == '\\' { chars.next() } else { None }) {
                ('\\', Some('n')) => text.push('\n'),
                ('\\', Some('t')) => text.push('\t'),
                ('\\', Some('r')) => text.push('\r'),
                ('\\', Some(c)) => text.push(c),
                (c, _) => text.push(c),
            }
        }
        Ok(Cow::Owned(text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tokens(text: &str) -> Result<Vec<(Token<'_>, usize)>, String> {
        let mut lexer = Lexer::new(text, Path::new("a.pbrt").into());
        let mut list = Vec::new();
        while let Some(token) = lexer.read().map_err(|error| error.to_string())? {
            list.push(token);
        }
        Ok(list)
    }

    #[test]
    fn words_know_their_lines() {
        let text = "Shape \"sphere\" # a ball\n\"float radius\"[.5 -1e2]true";
        let list = tokens(text).unwrap();
        let text = |t: &'static str| Token::Text(t.into());
        assert_eq!(
            list,
            [
                (Token::Word("Shape"), 1),
                (text("sphere"), 1),
                (text("float radius"), 2),
                (Token::Open, 2),
                (Token::Number(0.5), 2),
                (Token::Number(-100.0), 2),
                (Token::Close, 2),
                (Token::Word("true"), 2)
            ]
        );
        assert_eq!(tokens(r#""a\"b\\c""#).unwrap()[0].0, text("a\"b\\c"));
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line() {
        assert!(tokens("\n\"open\n").unwrap_err().starts_with("a.pbrt:2: a text has no end"));
        assert!(tokens("1e999").unwrap_err().starts_with("a.pbrt:1: `1e999` is no number"));
        assert!(tokens("-nan").unwrap_err().contains("`-nan` is no number"));
    }
}
