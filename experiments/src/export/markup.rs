//! A writer of HTML and SVG in which a name cannot become markup: all text and every attribute's value is escaped, elements
//! close themselves, and only words of the program's own source are taken as they are.

use std::fmt::{self, Display, Write};

/// Attributes of an element: names from the source, values of any kind, escaped.
pub type Attributes<'a> = &'a [(&'static str, &'a dyn Display)];

/// A piece of HTML or SVG.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Markup {
    text: String,
}

impl Markup {
    /// An element with content.
    pub fn element(&mut self, tag: &'static str, attributes: Attributes, content: impl FnOnce(&mut Self)) {
        self.open(tag, attributes);
        self.text.push('>');
        content(self);
        self.text.push_str("</");
        self.text.push_str(tag);
        self.text.push('>');
    }

    /// An element that holds text alone.
    pub fn line(&mut self, tag: &'static str, attributes: Attributes, text: impl Display) {
        self.element(tag, attributes, |m| m.text(text));
    }

    /// An element without content, such as `img` or `path`.
    pub fn leaf(&mut self, tag: &'static str, attributes: Attributes) {
        self.open(tag, attributes);
        self.text.push_str("/>");
    }

    /// Text, escaped.
    pub fn text(&mut self, text: impl Display) {
        write!(Escaped(&mut self.text), "{text}").expect("writing to a string succeeds");
    }

    /// Words of the program's source, as they are.
    pub fn verbatim(&mut self, source: &'static str) {
        self.text.push_str(source);
    }

    /// Another piece.
    pub fn append(&mut self, other: &Markup) {
        self.text.push_str(&other.text);
    }

    /// Another piece, much larger than this one, which takes no memory besides its own.
    pub fn append_large(&mut self, other: Markup) {
        let before = std::mem::replace(&mut self.text, other.text);
        self.text.insert_str(0, &before);
    }

    /// All that was written.
    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// The same, of a piece that ends here.
    pub fn into_string(self) -> String {
        self.text
    }

    fn open(&mut self, tag: &'static str, attributes: Attributes) {
        self.text.push('<');
        self.text.push_str(tag);
        for (name, value) in attributes {
            self.text.push(' ');
            self.text.push_str(name);
            self.text.push_str("=\"");
            self.text(value);
            self.text.push('"');
        }
    }
}

/// Replaces what has a meaning in HTML or XML, and the control characters that neither may hold.
struct Escaped<'a>(&'a mut String);

impl fmt::Write for Escaped<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for c in text.chars() {
            match c {
                '&' => self.0.push_str("&amp;"),
                '<' => self.0.push_str("&lt;"),
                '>' => self.0.push_str("&gt;"),
                '"' => self.0.push_str("&quot;"),
                '\'' => self.0.push_str("&#39;"),
                '\n' | '\t' => self.0.push(c),
                c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => self.0.push(char::REPLACEMENT_CHARACTER),
                c => self.0.push(c),
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_text_wherever_they_stand() {
        let hostile = "</td><script>alert('x')</script>\"onload=\"y&\0";
        let mut m = Markup::default();
        m.line("td", &[("title", &hostile)], hostile);
        let escaped = "&lt;/td&gt;&lt;script&gt;alert(&#39;x&#39;)&lt;/script&gt;&quot;onload=&quot;y&amp;\u{fffd}";
        assert_eq!(m.as_str(), format!("<td title=\"{escaped}\">{escaped}</td>"));
    }

    #[test]
    fn a_large_piece_stands_where_a_small_one_would() {
        let [mut small, mut large, mut piece] = [0, 1, 2].map(|_| Markup::default());
        piece.line("p", &[], "a");
        for m in [&mut small, &mut large] {
            m.text("before");
        }
        small.append(&piece);
        large.append_large(piece);
        assert_eq!(small, large);
    }
}
