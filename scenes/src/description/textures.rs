//! What stands where a number or a colour may vary.

use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use sampling::math::Spectrum;
use sampling::{Vec2, vec2};

use super::reader::{Table, Value};
use crate::error::SceneError;
use crate::import::translation::Attachment;
use crate::suggest::{did_you_mean, near_file};
use crate::texture::{Channel, Encoding, Image, ImageTexture, Noise, Texture, UvMap, Wrap};

/// A file, the encoding declared for it, and the one that holds otherwise.
type Decoding = (PathBuf, Option<Encoding>, Encoding);

/// Reads textures, every image once.
pub(super) struct Textures<'f> {
    folder: Option<&'f Path>,
    attachments: BTreeMap<&'f str, &'f Attachment>,
    images: RefCell<BTreeMap<Decoding, Arc<Image>>>,
}

impl<'f> Textures<'f> {
    /// Files are looked for among the `attachments` and in `folder`; without one, there are none.
    pub fn new(folder: Option<&'f Path>, attachments: &'f [Attachment]) -> Self {
        let attachments = attachments.iter().map(|attachment| (attachment.name.as_str(), attachment)).collect();
        Self { folder, attachments, images: RefCell::default() }
    }

    /// What is in no folder, by its name.
    pub fn attached(&self, name: &str) -> Option<&'f Attachment> {
        self.attachments.get(name).copied()
    }

    /// A colour or one of
    ///
    /// - `{ image = "file", encoding = "srgb", wrap = "repeat", channel = "r", scale = 1, uv_scale = 1, uv_offset = [0, 0] }`;
    ///   the `encoding` of images of bytes is `otherwise` where it is not declared;
    /// - `{ checkerboard = [a, b], uv_scale = 1, uv_offset = [0, 0] }`;
    /// - `{ noise = { low = 0, high = 1, size = 1, octaves = 1, seed = 0 } }`;
    /// - `{ vertex_colours = true }`;
    /// - a ramp: `{ ramp = { base, slope, axis, origin = [0, 0, 0], scale = 1 } }`, `base + slope · ((p − origin)·axis / scale)`
    ///   with a unit axis, p \[m\] in the scene's coordinates.
    pub fn read(&self, value: &Value, otherwise: Encoding) -> Result<Texture, SceneError> {
        if !value.is_table() {
            return Ok(Texture::Constant(value.colour()?));
        }
        const KINDS: [&str; 5] = ["image", "checkerboard", "noise", "ramp", "vertex_colours"];
        let table = value.table()?;
        let Some(kind) = KINDS.into_iter().find(|kind| table.get(kind).is_some()) else {
            let key = table.entries().first().map_or("", |(key, _)| *key);
            return Err(value.error(did_you_mean(key, &KINDS)));
        };
        match kind {
            "image" => self.image(&table, otherwise),
            "checkerboard" => checkerboard(&table),
            "noise" => noise(&table),
            "ramp" => ramp(&table),
            _ => {
                table.allow_only(&["vertex_colours"])?;
                let value = table.need("vertex_colours", "true")?;
                if value.boolean()? {
                    Ok(Texture::VertexColour)
                } else {
                    Err(value.error("it must be true, or left out"))
                }
            }
        }
    }

    fn image(&self, table: &Table, otherwise: Encoding) -> Result<Texture, SceneError> {
        table.allow_only(&["image", "encoding", "wrap", "channel", "scale", "uv_scale", "uv_offset"])?;
        let encodings = [Encoding::Srgb, Encoding::Linear];
        let declared = choice(table, "encoding", &Encoding::NAMES)?.map(|place| encodings[place]);
        let wrap = choice(table, "wrap", &Wrap::NAMES)?.map_or(Wrap::Repeat, |place| Wrap::ALL[place]);
        let channel = choice(table, "channel", &Channel::NAMES)?.map_or(Channel::Colour, |place| Channel::NAMED[place]);
        let scale = table.get("scale").map_or(Ok(Spectrum::ONE), |scale| scale.colour())?;
        let image = self.file(&table.need("image", "\"wood.png\"")?, declared, otherwise)?;
        if let (Channel::ALPHA, false, Some(value)) = (channel, image.has_alpha(), table.get("channel")) {
            return Err(value.error("the image has no alpha; name another channel, such as `r`"));
        }
        Ok(Texture::Image(ImageTexture { image, wrap, map: uv_map(table)?, channel, scale }))
    }

    /// The image of a file; its values are decoded as `declared`, and those of images of bytes as `otherwise` without that.
    pub fn file(
        &self,
        value: &Value,
        declared: Option<Encoding>,
        otherwise: Encoding,
    ) -> Result<Arc<Image>, SceneError> {
        let Some(folder) = self.folder else { return Err(value.error("a built-in scene cannot name files")) };
        let name = value.text()?;
        let key = (folder.join(name), declared, otherwise);
        if let Some(image) = self.images.borrow().get(&key) {
            return Ok(image.clone());
        }
        let path = &key.0;
        let bytes = match self.attached(name) {
            Some(attachment) => Cow::Borrowed(attachment.bytes.as_slice()),
            None => Cow::Owned(read_file(path).map_err(|mend| value.error(mend))?),
        };
        let image = Image::decode(&bytes, declared, otherwise)
            .map_err(|mend| value.error(format!("{}: {mend}", path.display())))?;
        let image = Arc::new(image);
        self.images.borrow_mut().insert(key, image.clone());
        Ok(image)
    }
}

/// The bytes of a file, or what is wrong, with the nearest name in its folder.
pub(super) fn read_file(path: &Path) -> Result<Vec<u8>, String> {
    crate::file::read(path).map_err(|error| {
        let near = near_file(path);
        format!("cannot read {}: {error}; {near}paths start at the scene file's folder", path.display())
    })
}

fn ramp(table: &Table) -> Result<Texture, SceneError> {
    table.allow_only(&["ramp"])?;
    let ramp = table.need("ramp", "{ base = 0.5, slope = 0.4, axis = [0, 0, 1] }")?.table()?;
    ramp.allow_only(&["base", "slope", "axis", "origin", "scale"])?;
    let origin = ramp.get("origin").map(|origin| origin.vec3()).transpose()?.unwrap_or_default();
    let scale = ramp.get("scale").map(|scale| scale.positive()).transpose()?.unwrap_or(1.0);
    Ok(Texture::Ramp {
        base: ramp.need("base", "0.5")?.colour()?,
        slope: ramp.need("slope", "0.4")?.colour()?,
        axis: ramp.need("axis", "[0, 0, 1]")?.direction()?.as_vec3(),
        origin,
        scale: scale as f32,
    })
}

fn checkerboard(table: &Table) -> Result<Texture, SceneError> {
    table.allow_only(&["checkerboard", "uv_scale", "uv_offset"])?;
    let value = table.need("checkerboard", "[0.2, 0.8]")?;
    let [a, b] = &value.array()?[..] else { return Err(value.error("it must be two colours: [a, b]")) };
    Ok(Texture::Checkerboard { values: [a.colour()?, b.colour()?], map: uv_map(table)? })
}

fn noise(table: &Table) -> Result<Texture, SceneError> {
    table.allow_only(&["noise"])?;
    let noise = table.need("noise", "{ low = 0.2, high = 0.8, size = 0.1 }")?.table()?;
    noise.allow_only(&["low", "high", "size", "octaves", "seed"])?;
    let octaves = match noise.get("octaves") {
        None => 1,
        Some(value) => match value.whole()? {
            octaves if (1..=i64::from(Noise::MAX_OCTAVES)).contains(&octaves) => octaves as u32,
            _ => return Err(value.error(format!("it must be from 1 to {}", Noise::MAX_OCTAVES))),
        },
    };
    Ok(Texture::Noise(Noise {
        low: noise.get("low").map_or(Ok(Spectrum::ZERO), |low| low.colour())?,
        high: noise.get("high").map_or(Ok(Spectrum::ONE), |high| high.colour())?,
        size: noise.need("size", "0.1")?.positive()? as f32,
        octaves,
        seed: noise.get("seed").map_or(Ok(0), |seed| seed.whole())? as u64,
        origin: DVec3::ZERO,
    }))
}

/// `uv_scale`, a number or two, and `uv_offset`.
fn uv_map(table: &Table) -> Result<UvMap, SceneError> {
    let two = |value: &Value| -> Result<Vec2, SceneError> {
        let xy = value.numbers(2, "a pair")?;
        Ok(vec2(xy[0] as f32, xy[1] as f32))
    };
    let scale = match table.get("uv_scale") {
        None => Vec2::ONE,
        Some(value) if value.is_array() => two(&value)?,
        Some(value) => Vec2::splat(value.coordinate()? as f32),
    };
    if let (true, Some(value)) = (scale.x == 0.0 || scale.y == 0.0, table.get("uv_scale")) {
        return Err(value.error("it is 0; give how often the pattern is repeated: any other number"));
    }
    let offset = table.get("uv_offset").map_or(Ok(Vec2::ZERO), |value| two(&value))?;
    Ok(UvMap { scale, offset })
}

/// The place of a word in `names`.
pub(super) fn choice(table: &Table, key: &str, names: &[&str]) -> Result<Option<usize>, SceneError> {
    let Some(value) = table.get(key) else { return Ok(None) };
    let word = value.text()?;
    let place = names.iter().position(|name| *name == word);
    place.map(Some).ok_or_else(|| value.error(did_you_mean(word, names)))
}
