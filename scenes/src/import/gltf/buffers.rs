//! Bytes: of files beside the scene's, of data URIs, of a `.glb`.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::document::{Document, Item};
use super::schema::{Buffer, BufferView, Kind};
use crate::error::SceneError;
use crate::suggest::shown;

/// What the objects of a file name, with their bytes.
pub struct Asset<'t> {
    /// The JSON.
    pub document: Document<'t>,
    buffers: Vec<Bytes<'t>>,
    /// The folder of the file.
    folder: PathBuf,
}

/// Bytes that several buffers may share.
#[derive(Clone)]
enum Bytes<'t> {
    Of(&'t [u8]),
    Own(Rc<[u8]>),
}

impl Bytes<'_> {
    fn get(&self) -> &[u8] {
        match self {
            Self::Of(bytes) => bytes,
            Self::Own(bytes) => bytes,
        }
    }
}

/// A part of a buffer.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// Its bytes.
    pub bytes: &'a [u8],
    /// From one element to the next, if it is said.
    pub stride: Option<usize>,
}

impl<'t> Asset<'t> {
    /// Reads all buffers; `binary` is that of a `.glb`.
    pub fn open(document: Document<'t>, folder: &Path, binary: Option<&'t [u8]>) -> Result<Self, SceneError> {
        let mut asset = Self { document, buffers: Vec::new(), folder: folder.to_path_buf() };
        let mut known: HashMap<String, Bytes<'t>> = HashMap::new();
        for item in asset.document.all(Kind::Buffer) {
            let bytes = asset.buffer(&item, binary, &mut known)?;
            asset.buffers.push(bytes);
        }
        Ok(asset)
    }

    fn buffer(
        &self,
        item: &Item<'t>,
        binary: Option<&'t [u8]>,
        known: &mut HashMap<String, Bytes<'t>>,
    ) -> Result<Bytes<'t>, SceneError> {
        let document = &self.document;
        let buffer: Buffer = document.parse(item)?;
        let bytes = match (&buffer.uri, binary) {
            (None, Some(binary)) if item.index() == 0 => Bytes::Of(binary),
            // Of buffers that only an extension fills it is told where their views are used.
            (None, _) => return Ok(Bytes::Of(&[])),
            (Some(uri), _) => match known.get(uri) {
                Some(bytes) => bytes.clone(),
                None => {
                    let bytes = Bytes::Own(self.resource(item, uri)?.into_owned().into());
                    known.insert(uri.clone(), bytes.clone());
                    bytes
                }
            },
        };
        if bytes.get().len() < buffer.byte_length {
            let message = format!("has {} bytes where it says {}", bytes.get().len(), buffer.byte_length);
            return Err(document.error(item, message, "give the whole of it, as it was exported"));
        }
        Ok(bytes)
    }

    /// The bytes that a URI names, or holds.
    pub fn resource(&self, item: &Item, uri: &str) -> Result<Cow<'t, [u8]>, SceneError> {
        if let Some(data) = data_uri(uri) {
            return data
                .map(Cow::Owned)
                .map_err(|message| self.document.error(item, message, "write the bytes of the data URI as base64"));
        }
        let path = self.path(item, uri)?;
        let unreadable = |error: std::io::Error| {
            let message = format!("names {}, which cannot be read: {error}", path.display());
            self.document.error(item, message, "make the file readable")
        };
        crate::file::read(&path).map(Cow::Owned).map_err(unreadable)
    }

    /// Where the file is that a URI names, from the folder of the scene.
    pub fn path(&self, item: &Item, uri: &str) -> Result<PathBuf, SceneError> {
        let name = percent_decoded(uri);
        let has_scheme =
            uri.find(':').is_some_and(|end| end > 1 && uri[..end].bytes().all(|b| b.is_ascii_alphanumeric()));
        for name in [name.as_str(), uri] {
            let path = self.folder.join(name.replace('\\', "/"));
            if !has_scheme && !name.contains('\0') && path.is_file() {
                return Ok(path);
            }
        }
        let folder = if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder };
        let mend = if has_scheme {
            "put the file beside the scene and name it without a scheme".to_string()
        } else {
            format!("it was looked for in {}", folder.display())
        };
        Err(self.document.error(item, format!("names `{}`, a file that is not there", shown(uri)), mend))
    }

    /// The view of this number.
    pub fn view(&self, index: usize, by: &Item<'t>) -> Result<View<'_>, SceneError> {
        let document = &self.document;
        let item = document.item(Kind::BufferView, index, by)?;
        let view: BufferView = document.parse(&item)?;
        document.item(Kind::Buffer, view.buffer, &item)?;
        let bytes = self.buffers[view.buffer].get();
        let end = view.byte_offset.checked_add(view.byte_length).filter(|&end| end <= bytes.len());
        if let (Some(extension), true) =
            (view.extensions.keys().find(|name| name.ends_with("meshopt_compression")), bytes.is_empty())
        {
            let message = format!("is compressed by `{extension}`, which is not read");
            return Err(document.error(&item, message, "export the file without compression"));
        }
        let Some(end) = end else {
            let (from, length) = (view.byte_offset, view.byte_length);
            let message =
                format!("goes from byte {from} for {length} of buffer {}, which has {}", view.buffer, bytes.len());
            return Err(document.error(&item, message, "keep it within the buffer"));
        };
        Ok(View { bytes: &bytes[view.byte_offset..end], stride: view.byte_stride })
    }
}

/// The bytes of a data URI; `None` where the URI is another.
fn data_uri(uri: &str) -> Option<Result<Vec<u8>, String>> {
    let scheme = uri.get(..5)?;
    if !scheme.eq_ignore_ascii_case("data:") {
        return None;
    }
    let Some((head, data)) = uri[5..].split_once(',') else {
        return Some(Err("has a data URI without a comma".to_string()));
    };
    if !head.trim_end().ends_with(";base64") {
        return Some(Err("has a data URI that is not base64".to_string()));
    }
    Some(base64(data.as_bytes()).map_err(|at| format!("has a data URI whose character {} is not base64", at + 1)))
}

/// Decodes base64 [RFC 4648, section 4], with or without its padding; an error is the place of a character that does not belong.
fn base64(text: &[u8]) -> Result<Vec<u8>, usize> {
    let padding = text.iter().rev().take_while(|&&byte| byte == b'=').count();
    let body = &text[..text.len() - padding];
    if padding > 2 || body.len() % 4 == 1 {
        return Err(body.len());
    }
    let mut bytes = Vec::with_capacity(body.len() / 4 * 3 + 2);
    let (mut bits, mut held) = (0u32, 0);
    for (at, &byte) in body.iter().enumerate() {
        let six = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return Err(at),
        };
        bits = bits << 6 | u32::from(six);
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held) as u8);
        }
    }
    Ok(bytes)
}

/// A URI with its `%20` and the like as what they stand for.
fn percent_decoded(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, after @ ..] = rest {
        let digits = after.get(..2).and_then(|digits| std::str::from_utf8(digits).ok());
        let code = digits.filter(|d| d.bytes().all(|b| b.is_ascii_hexdigit())).map(|d| u8::from_str_radix(d, 16));
        match (first, code) {
            (b'%', Some(Ok(byte))) => {
                bytes.push(byte);
                rest = &after[2..];
            }
            _ => {
                bytes.push(*first);
                rest = after;
            }
        }
    }
    String::from_utf8(bytes).unwrap_or_else(|_| uri.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_decoded_with_and_without_padding() {
        for (text, bytes) in [
            ("", &b""[..]),
            ("TQ==", b"M"),
            ("TQ", b"M"),
            ("TWE=", b"Ma"),
            ("TWFu", b"Man"),
            ("-_+/", &[0xfb, 0xff, 0xbf]),
        ] {
            assert_eq!(base64(text.as_bytes()), Ok(bytes.to_vec()), "{text}");
        }
        for (text, at) in [("T", 1), ("TW F", 2), ("TQ===", 2), ("=TWF", 0), ("TWFué", 4)] {
            assert_eq!(base64(text.as_bytes()), Err(at), "{text}");
        }
    }

    #[test]
    fn uris() {
        assert_eq!(percent_decoded("a%20b%c3%A9.bin"), "a bé.bin");
        assert_eq!(percent_decoded("100%.bin"), "100%.bin");
        assert_eq!(percent_decoded("%ff"), "%ff");
        assert_eq!(data_uri("DATA:application/octet-stream;base64,TWFu"), Some(Ok(b"Man".to_vec())));
        assert_eq!(data_uri("a.bin"), None);
        assert_eq!(data_uri("é.bin"), None);
        assert!(data_uri("data:text/plain,hello").unwrap().is_err());
    }
}
