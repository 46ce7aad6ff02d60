//! What the header of a PLY file declares.

use super::body::{Body, Fault};
use crate::error::SceneError;
use crate::suggest::did_you_mean;

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A type of number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

/// A type of property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

/// A property of an element.
#[derive(Debug)]
pub struct Property {
    pub name: String,
    pub kind: Kind,
}

/// A list of things that have the same properties.
#[derive(Debug)]
pub struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
    /// Where it is declared, counted from 1.
    pub line: usize,
}

/// The header.
#[derive(Debug)]
pub struct Header {
    pub format: Format,
    pub elements: Vec<Element>,
    /// Its bytes.
    pub length: usize,
}

const FORMATS: [(&str, Format); 3] = [
    ("ascii", Format::Ascii),
    ("binary_little_endian", Format::LittleEndian),
    ("binary_big_endian", Format::BigEndian),
];

const SCALARS: [(&str, Scalar); 16] = [
    ("char", Scalar::I8),
    ("uchar", Scalar::U8),
    ("short", Scalar::I16),
    ("ushort", Scalar::U16),
    ("int", Scalar::I32),
    ("uint", Scalar::U32),
    ("float", Scalar::F32),
    ("double", Scalar::F64),
    ("int8", Scalar::I8),
    ("uint8", Scalar::U8),
    ("int16", Scalar::I16),
    ("uint16", Scalar::U16),
    ("int32", Scalar::I32),
    ("uint32", Scalar::U32),
    ("float32", Scalar::F32),
    ("float64", Scalar::F64),
];

impl Scalar {
    /// Bytes of it in a binary file.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The greatest value of whole numbers.
    pub fn greatest(self) -> Option<f64> {
        match self {
            Self::I8 => Some(f64::from(i8::MAX)),
            Self::U8 => Some(f64::from(u8::MAX)),
            Self::I16 => Some(f64::from(i16::MAX)),
            Self::U16 => Some(f64::from(u16::MAX)),
            Self::I32 => Some(f64::from(i32::MAX)),
            Self::U32 => Some(f64::from(u32::MAX)),
            Self::F32 | Self::F64 => None,
        }
    }
}

impl Element {
    /// An error about all of them.
    pub fn error(&self, message: &str, mend: &str) -> SceneError {
        SceneError::invalid(format!("element `{}`: {message}", self.name), mend).at_line(self.line)
    }

    /// An error about one of them, which `body` was reading.
    pub fn fault(&self, index: u64, body: &Body, fault: Fault) -> SceneError {
        let error = SceneError::invalid(format!("{} {index}: {}", self.name, fault.message), fault.mend);
        match body.line() {
            Some(line) => error.at_line(line),
            None => error,
        }
    }
}

impl Header {
    /// Reads the header at the beginning of a file.
    pub fn read(bytes: &[u8]) -> Result<Self, SceneError> {
        let mut lines = Lines { bytes, at: 0, number: 0 };
        if lines.next().as_deref() != Some("ply") {
            return Err(SceneError::invalid("the file does not begin with `ply`", "give a PLY file"));
        }
        let mut format = None;
        let mut elements: Vec<Element> = Vec::new();
        while let Some(line) = lines.next() {
            let words: Vec<&str> = line.split_whitespace().collect();
            let bad = |message: String, mend: &str| Err(SceneError::invalid(message, mend).at_line(lines.number));
            match words[..] {
                [] | ["comment" | "obj_info", ..] => {}
                ["format", name, _] | ["format", name] => {
                    let names = FORMATS.map(|(name, _)| name);
                    let Some((_, found)) = FORMATS.iter().find(|(known, _)| *known == name) else {
                        return bad(format!("the format `{name}` is unknown"), &did_you_mean(name, &names));
                    };
                    format = Some(*found);
                }
                ["element", name, count] => {
                    let Ok(count) = count.parse() else {
                        return bad(format!("`{count}` is no number of elements"), "give a whole number");
                    };
                    let (name, properties) = (name.to_string(), Vec::new());
                    elements.push(Element { name, count, properties, line: lines.number });
                }
                ["property", ref kind @ .., name] if !kind.is_empty() => {
                    let kind = match *kind {
                        ["list", count, item] => {
                            scalar(count).and_then(|count| Ok(Kind::List { count, item: scalar(item)? }))
                        }
                        [one] => scalar(one).map(Kind::Scalar),
                        _ => return bad(format!("`{line}` declares no property"), "write `property TYPE NAME`"),
                    };
                    let kind = kind.map_err(|error| error.at_line(lines.number))?;
                    if let Kind::List { count, .. } = kind
                        && count.greatest().is_none()
                    {
                        return bad(format!("the list `{name}` is counted by a fraction"), "count it by `uchar`");
                    }
                    let Some(element) = elements.last_mut() else {
                        return bad(
                            format!("the property `{name}` belongs to no element"),
                            "declare an `element` first",
                        );
                    };
                    element.properties.push(Property { name: name.to_string(), kind });
                }
                ["end_header"] => {
                    let Some(format) = format else {
                        return bad("the header names no format".to_string(), "add `format ascii 1.0` behind `ply`");
                    };
                    return Ok(Header { format, elements, length: lines.at });
                }
                _ => {
                    let short: String = line.chars().take(40).collect();
                    return bad(format!("`{short}` is not understood"), "end the header with `end_header`");
                }
            }
        }
        Err(SceneError::invalid("the header does not end", "end it with `end_header`").at_line(lines.number))
    }
}

fn scalar(name: &str) -> Result<Scalar, SceneError> {
    let found = SCALARS.iter().find(|(known, _)| *known == name).map(|(_, scalar)| *scalar);
    found.ok_or_else(|| {
        let mend = did_you_mean(name, &SCALARS.map(|(name, _)| name));
        SceneError::invalid(format!("the type `{name}` is unknown"), mend)
    })
}

/// The lines at the beginning of a file, with their ends in any fashion.
struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
    /// That of the last line, counted from 1.
    number: usize,
}

impl Lines<'_> {
    fn next(&mut self) -> Option<String> {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r'))?;
        let both = rest[end..].starts_with(b"\r\n");
        self.at += end + if both { 2 } else { 1 };
        self.number += 1;
        Some(String::from_utf8_lossy(&rest[..end]).trim().to_string())
    }
}
