//! The two kinds of file: JSON alone, and a `.glb` with JSON and bytes in chunks.

use std::path::Path;

use crate::error::SceneError;

/// The first bytes of a `.glb`.
const MAGIC: &[u8] = b"glTF";
const JSON: u32 = 0x4E4F_534A;
const BINARY: u32 = 0x004E_4942;

/// A file's parts.
#[derive(Debug)]
pub struct Container<'a> {
    /// Its JSON.
    pub text: &'a str,
    /// Its bytes, if it has any.
    pub binary: Option<&'a [u8]>,
}

impl<'a> Container<'a> {
    /// Takes the bytes of the file at `path` apart.
    pub fn read(path: &Path, bytes: &'a [u8]) -> Result<Self, SceneError> {
        let wrong = |message: String| {
            SceneError::invalid(message, "give the whole file, as it was exported").in_file(path).at_line(1)
        };
        if !bytes.starts_with(MAGIC) {
            let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
            return Ok(Self { text: text(path, bytes)?, binary: None });
        }
        let word =
            |at: usize| bytes.get(at..at + 4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]));
        let (Some(version), Some(length)) = (word(4), word(8)) else {
            return Err(wrong(format!("the file ends after {} bytes, within its header", bytes.len())));
        };
        if version != 2 {
            let error = SceneError::invalid(format!("this is glTF {version}"), "save it as glTF 2.0");
            return Err(error.in_file(path).at_line(1));
        }
        let length = length as usize;
        if length > bytes.len() {
            return Err(wrong(format!("the file has {} bytes where its header says {length}", bytes.len())));
        }
        let (mut json, mut binary, mut at) = (None, None, 12);
        while at + 8 <= length {
            let (Some(size), Some(kind)) = (word(at), word(at + 4)) else { break };
            let begin = at + 8;
            let Some(chunk) = begin.checked_add(size as usize).and_then(|end| bytes[..length].get(begin..end)) else {
                let left = length - begin;
                return Err(wrong(format!("the chunk at byte {at} has {size} bytes, and the file {left} more")));
            };
            match kind {
                JSON if json.is_none() => json = Some(chunk),
                BINARY if binary.is_none() => binary = Some(chunk),
                // Other chunks are those of extensions.
                _ => {}
            }
            at = begin + size as usize;
        }
        let Some(json) = json else { return Err(wrong("the file has no chunk of JSON".to_string())) };
        Ok(Self { text: text(path, json)?, binary })
    }
}

fn text<'a>(path: &Path, bytes: &'a [u8]) -> Result<&'a str, SceneError> {
    std::str::from_utf8(bytes).map_err(|error| {
        let line = 1 + bytes[..error.valid_up_to()].iter().filter(|&&byte| byte == b'\n').count();
        SceneError::invalid("the text is not UTF-8", "save the file as UTF-8").in_file(path).at_line(line)
    })
}
