//! Images: files beside the scene, and what is embedded in it.

use std::borrow::Cow;
use std::rc::Rc;

use super::context::Context;
use super::document::Item;
use super::schema::{self, Kind};
use crate::error::SceneError;
use crate::texture::{Encoding, Image};

/// What is known of an image.
pub struct Facts {
    /// Whether it says how opaque its texels are.
    pub has_alpha: bool,
    /// The greatest value of every channel, undecoded.
    pub greatest: [f32; 4],
}

/// By what an image is known: its first bytes.
const FORMATS: [(&[u8], Format); 6] = [
    (b"\x89PNG", Format::Read("png")),
    (b"\xff\xd8\xff", Format::Read("jpg")),
    (b"\x76\x2f\x31\x01", Format::Read("exr")),
    (b"#?", Format::Read("hdr")),
    (b"\xabKTX 20", Format::Unread("KTX2")),
    (b"RIFF", Format::Unread("WebP")),
];

#[derive(Clone, Copy)]
enum Format {
    /// By its ending.
    Read(&'static str),
    /// By its name.
    Unread(&'static str),
}

/// How the text names an image; one that is embedded is kept.
pub fn file<'t>(index: usize, by: &Item<'t>, context: &mut Context<'_, 't>) -> Result<String, SceneError> {
    if let Some(name) = context.images.get(&index) {
        return Ok(name.clone());
    }
    let asset = context.asset;
    let item = asset.document.item(Kind::Image, index, by)?;
    let image: schema::Image = asset.document.parse(&item)?;
    let bytes = bytes(index, by, context)?;
    // Several views of the same bytes are one image.
    let key = (bytes.as_ptr() as usize, bytes.len());
    let borrowed = matches!(bytes, Cow::Borrowed(_));
    if let Some(name) = context.embedded.get(&key).filter(|_| borrowed) {
        let name = name.clone();
        context.images.insert(index, name.clone());
        return Ok(name);
    }
    let ending = match FORMATS.into_iter().find(|(begin, _)| bytes.starts_with(begin)) {
        Some((_, Format::Read(ending))) => ending,
        Some((_, Format::Unread(name))) => {
            return Err(asset.document.error(&item, format!("is {name}, which is not read"), "save it as PNG or JPEG"));
        }
        None => return Err(asset.document.error(&item, "is neither PNG nor JPEG", "save it as one of these")),
    };
    let name = match image.uri.as_deref().filter(|uri| !is_data(uri)) {
        Some(uri) => context.named_from_base(&asset.path(&item, uri)?),
        None => context.attach("image", ending, bytes.into_owned()),
    };
    if borrowed {
        context.embedded.insert(key, name.clone());
    }
    context.images.insert(index, name.clone());
    Ok(name)
}

fn is_data(uri: &str) -> bool {
    uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

fn bytes<'a, 't>(index: usize, by: &Item<'t>, context: &Context<'a, 't>) -> Result<Cow<'a, [u8]>, SceneError> {
    let asset = context.asset;
    let item = asset.document.item(Kind::Image, index, by)?;
    let image: schema::Image = asset.document.parse(&item)?;
    match (&image.uri, image.buffer_view) {
        (Some(uri), _) => asset.resource(&item, uri),
        (None, Some(view)) => Ok(Cow::Borrowed(asset.view(view, &item)?.bytes)),
        (None, None) => {
            Err(asset.document.error(&item, "has neither `uri` nor `bufferView`", "say where its bytes are"))
        }
    }
}

fn decoded<'t>(index: usize, by: &Item<'t>, context: &Context<'_, 't>) -> Result<Image, SceneError> {
    let bytes = bytes(index, by, context)?;
    Image::decode(&bytes, None, Encoding::Linear).map_err(|mend| {
        let document = &context.asset.document;
        match document.item(Kind::Image, index, by) {
            Ok(item) => document.error(&item, "is not whole", mend),
            Err(error) => error,
        }
    })
}

/// What is known of an image.
pub fn facts<'t>(index: usize, by: &Item<'t>, context: &mut Context<'_, 't>) -> Result<Rc<Facts>, SceneError> {
    let name = file(index, by, context)?;
    if let Some(facts) = context.facts.get(&name) {
        return Ok(facts.clone());
    }
    let image = decoded(index, by, context)?;
    let facts = Rc::new(Facts { has_alpha: image.has_alpha(), greatest: image.range().1 });
    context.facts.insert(name, facts.clone());
    Ok(facts)
}

/// The name of an image with other texels, of which `what` tells what was done.
pub fn repainted<'t>(
    index: usize,
    by: &Item<'t>,
    (kind, what): (&str, String),
    paint: impl Fn([f32; 4]) -> [f32; 4],
    context: &mut Context<'_, 't>,
) -> Result<String, SceneError> {
    let key = (file(index, by, context)?, format!("{kind} {what}"));
    if let Some(name) = context.repainted.get(&key) {
        return Ok(name.clone());
    }
    let image = decoded(index, by, context)?;
    let (width, height) = image.size();
    context.asset.document.spend(by, 4 * width as usize * height as usize)?;
    let bytes = image.repainted(paint);
    let name = context.attach(kind, "png", bytes);
    context.repainted.insert(key, name.clone());
    Ok(name)
}
