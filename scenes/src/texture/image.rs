//! Images as textures: PNG, JPEG, Radiance HDR and OpenEXR.

use super::{UvMap, exr};
use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use sampling::fault;
use sampling::math::Spectrum;
use sampling::{Vec2, vec2};
use std::fmt;
use std::io::Cursor;
use std::sync::Arc;

/// The longest side of an image \[texels\].
const MAX_SIDE: u32 = 32_768;
/// The most texels of an image: 4 GiB of the widest kind.
const MAX_TEXELS: u64 = 1 << 28;

/// What the numbers of an image stand for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Encoding {
    /// Colours by the transfer function of IEC 61966-2-1.
    Srgb,
    /// The values themselves.
    Linear,
}

impl Encoding {
    /// The names by which it is declared.
    pub const NAMES: [&str; 2] = ["srgb", "linear"];

    /// The value of a colour channel that is stored as `x`, in [0, 1].
    pub(crate) fn decode(self, x: f32) -> f32 {
        match self {
            Self::Linear => x,
            Self::Srgb if x <= 0.040_45 => x / 12.92,
            Self::Srgb => ((x + 0.055) / 1.055).powf(2.4),
        }
    }
}

/// What is beyond an image's borders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The image mirrored.
    Mirror,
    /// The texel at the border.
    Clamp,
}

impl Wrap {
    /// The names by which it is declared.
    pub const NAMES: [&str; 3] = ["repeat", "mirror", "clamp"];
    /// All of them, in the order of their names.
    pub const ALL: [Self; 3] = [Self::Repeat, Self::Mirror, Self::Clamp];

    /// The texel of a row of `size` that stands at place `i`.
    #[inline]
    fn place(self, i: i64, size: i64) -> usize {
        let place = match self {
            Self::Repeat => i.rem_euclid(size),
            Self::Mirror => {
                let folded = i.rem_euclid(2 * size);
                folded.min(2 * size - 1 - folded)
            }
            Self::Clamp => i.clamp(0, size - 1),
        };
        place as usize
    }
}

/// What of an image is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Channel {
    /// Red, green and blue.
    #[default]
    Colour,
    /// One of red, green, blue and alpha, as a grey.
    One(usize),
    /// The luminance of the colour, as a grey.
    Luminance,
}

impl Channel {
    /// The names of what is not the colour.
    pub const NAMES: [&str; 5] = ["r", "g", "b", "a", "luminance"];
    /// What they stand for.
    pub const NAMED: [Self; 5] = [Self::One(0), Self::One(1), Self::One(2), Self::ALPHA, Self::Luminance];
    /// How opaque a texel is.
    pub const ALPHA: Self = Self::One(3);

    #[inline]
    fn of(self, texel: [f32; 4]) -> Spectrum {
        match self {
            Self::Colour => Spectrum::new(texel[0], texel[1], texel[2]),
            Self::One(channel) => Spectrum::splat(texel[channel]),
            Self::Luminance => Spectrum::splat(Self::Colour.of(texel).luminance()),
        }
    }
}

/// A decoded image. Its rows run from top to bottom.
#[derive(Clone, PartialEq)]
pub struct Image {
    width: u32,
    height: u32,
    texels: Texels,
    /// The least and the greatest value of every channel.
    low: [f32; 4],
    high: [f32; 4],
    /// Whether the file says how opaque its texels are; else they are opaque.
    has_alpha: bool,
    /// BLAKE3 of the file and its encoding.
    hash: String,
}

#[derive(Clone, PartialEq)]
enum Texels {
    /// Bytes, and the values that they stand for in colour channels; alpha is linear.
    Bytes(Vec<[u8; 4]>, Box<[f32; 256]>),
    Floats(Vec<[f32; 4]>),
}

impl fmt::Debug for Image {
    /// Tells images apart by their hash.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}x{} {}", self.width, self.height, self.hash)
    }
}

/// Whether a file may be a TGA, which begins with no name: of a kind that there is, with a table of colours where the kind needs one, and
/// with a number of bits to a pixel that there is.
fn is_targa(bytes: &[u8]) -> bool {
    let has_kind = matches!(bytes, [_, 1, 1 | 9, ..] | [_, 0 | 1, 2 | 3 | 10 | 11, ..]);
    has_kind && bytes.get(16).is_some_and(|bits| [8, 15, 16, 24, 32].contains(bits))
}

impl Image {
    /// Decodes the bytes of a file; without `declared`, bytes are decoded as `otherwise` says, and floats are linear.
    ///
    /// # Errors
    ///
    /// What is wrong, and how to mend it.
    pub fn decode(bytes: &[u8], declared: Option<Encoding>, otherwise: Encoding) -> Result<Self, String> {
        if exr::is_exr(bytes) {
            return Self::decode_exr(bytes, declared);
        }
        let reader = || {
            let reader = ImageReader::new(Cursor::new(bytes));
            let mut reader = reader.with_guessed_format().expect("reading memory doesn't fail");
            if reader.format().is_none() && is_targa(bytes) {
                reader.set_format(ImageFormat::Tga);
            }
            reader
        };
        let (width, height) = reader().into_dimensions().map_err(unreadable)?;
        check_size(width, height)?;
        let mut reader = reader();
        if reader.format() == Some(ImageFormat::Jpeg) && !has_end_of_jpeg(bytes) {
            return Err("it ends before its image does; give a whole JPEG".into());
        }
        // The size has been checked; what is left is a decoder's own working memory.
        let mut limits = Limits::no_limits();
        limits.max_alloc = Some(16 * MAX_TEXELS * 2);
        reader.limits(limits);
        let decoded = reader.decode().map_err(unreadable)?;
        let has_alpha = decoded.color().has_alpha();
        let is_float = matches!(decoded, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
        if is_float {
            check_linear(declared)?;
        }
        let encoding = declared.unwrap_or(if is_float { Encoding::Linear } else { otherwise });
        let texels = match decoded {
            DynamicImage::ImageLuma8(_)
            | DynamicImage::ImageLumaA8(_)
            | DynamicImage::ImageRgb8(_)
            | DynamicImage::ImageRgba8(_) => {
                let table = std::array::from_fn(|byte| encoding.decode(byte as f32 / 255.0));
                Texels::Bytes(decoded.to_rgba8().pixels().map(|pixel| pixel.0).collect(), Box::new(table))
            }
            other => {
                let decode = |[r, g, b, a]: [f32; 4]| [encoding.decode(r), encoding.decode(g), encoding.decode(b), a];
                Texels::Floats(other.to_rgba32f().pixels().map(|pixel| decode(pixel.0)).collect())
            }
        };
        Ok(Self { has_alpha, ..Self::of_texels(width, height, texels, hash_of(bytes, encoding))? })
    }

    fn decode_exr(bytes: &[u8], declared: Option<Encoding>) -> Result<Self, String> {
        let (width, height) = exr::size(bytes).map_err(unreadable)?;
        check_size(width, height)?;
        check_linear(declared)?;
        let decoded = exr::decode(bytes).map_err(unreadable)?;
        let image = Self::of_texels(width, height, Texels::Floats(decoded.texels), hash_of(bytes, Encoding::Linear))?;
        Ok(Self { has_alpha: decoded.has_alpha, ..image })
    }

    /// An image of linear values: red, green, blue and alpha, row by row from the top.
    ///
    /// # Errors
    ///
    /// If there is no texel, one too few or too many, or one that is not finite.
    pub fn from_linear(width: u32, height: u32, texels: Vec<[f32; 4]>) -> Result<Self, String> {
        if texels.len() as u64 != u64::from(width) * u64::from(height) {
            return Err(format!("it has {} texels instead of {width}x{height}", texels.len()));
        }
        let bytes: Vec<u8> = texels.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        let hash = format!("{width} {}", blake3::hash(&bytes).to_hex());
        Self::of_texels(width, height, Texels::Floats(texels), hash)
    }

    fn of_texels(width: u32, height: u32, texels: Texels, hash: String) -> Result<Self, String> {
        if width == 0 || height == 0 {
            return Err(format!("it has {width}x{height} texels; give an image with at least one"));
        }
        let (low, high) = ([f32::INFINITY; 4], [f32::NEG_INFINITY; 4]);
        let mut image = Self { width, height, texels, low, high, has_alpha: true, hash };
        for index in 0..width as usize * height as usize {
            let texel = image.texel(index);
            if texel.iter().any(|value| !value.is_finite()) {
                let (x, y) = (index % width as usize, index / width as usize);
                return Err(format!("its texel in column {x}, row {y} is not finite; mend the image"));
            }
            image.low = std::array::from_fn(|i| image.low[i].min(texel[i]));
            image.high = std::array::from_fn(|i| image.high[i].max(texel[i]));
        }
        Ok(image)
    }

    /// Width and height \[texels\].
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Whether the file says how opaque its texels are; else they are opaque.
    pub fn has_alpha(&self) -> bool {
        self.has_alpha
    }

    /// The least and the greatest value of red, green, blue and alpha.
    pub(crate) fn range(&self) -> ([f32; 4], [f32; 4]) {
        (self.low, self.high)
    }

    /// The image with other texels, as an 8-bit PNG.
    pub(crate) fn repainted(&self, paint: impl Fn([f32; 4]) -> [f32; 4]) -> Vec<u8> {
        let byte = |x: f32| (x * 255.0 + 0.5) as u8;
        let texel = |x, y| image::Rgba(paint(self.texel(y as usize * self.width as usize + x as usize)).map(byte));
        let mut bytes = Vec::new();
        image::RgbaImage::from_fn(self.width, self.height, texel)
            .write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png)
            .expect("writing to memory doesn't fail");
        bytes
    }

    /// Red, green, blue and alpha of a texel; its index counts row by row from the top.
    #[inline]
    pub(crate) fn texel(&self, index: usize) -> [f32; 4] {
        match &self.texels {
            Texels::Bytes(texels, table) => {
                let [r, g, b, a] = texels[index];
                let [r, g, b] = [r, g, b].map(|byte| table[usize::from(byte)]);
                [r, g, b, f32::from(a) * (1.0 / 255.0)]
            }
            Texels::Floats(texels) => texels[index],
        }
    }

    /// The values at a place, bilinear between the centres of texels; the unit square is the image, its origin at the bottom left.
    #[inline]
    fn bilinear(&self, place: Vec2, wrap: Wrap) -> [f32; 4] {
        let ([a, b, c, d], f) = self.around(place, wrap);
        let row = |left: f32, right: f32| left * (1.0 - f.x) + right * f.x;
        std::array::from_fn(|i| row(a[i], b[i]) * (1.0 - f.y) + row(c[i], d[i]) * f.y)
    }

    /// How those values grow to the right and upwards, per side of the image. At the centre of a texel, where slopes meet, it is that
    /// of the texels to its right and below.
    fn slope(&self, place: Vec2, wrap: Wrap) -> [[f32; 4]; 2] {
        let ([a, b, c, d], f) = self.around(place, wrap);
        let (width, height) = (self.width as f32, self.height as f32);
        let right = |i: usize| ((b[i] - a[i]) * (1.0 - f.y) + (d[i] - c[i]) * f.y) * width;
        let up = |i: usize| ((a[i] - c[i]) * (1.0 - f.x) + (b[i] - d[i]) * f.x) * height;
        [std::array::from_fn(right), std::array::from_fn(up)]
    }

    /// The four texels whose centres are around a place, upper left and right and lower left and right, and how far it is from the
    /// first to the right and down.
    #[inline]
    fn around(&self, place: Vec2, wrap: Wrap) -> ([[f32; 4]; 4], Vec2) {
        let (width, height) = (i64::from(self.width), i64::from(self.height));
        let x = place.x * width as f32 - 0.5;
        let y = fault!("image_upside_down", 1.0 - place.y, place.y) * height as f32 - 0.5;
        let (left, top) = (x.floor(), y.floor());
        let columns = [left as i64, (left as i64).saturating_add(1)].map(|i| wrap.place(i, width));
        let rows = [top as i64, (top as i64).saturating_add(1)].map(|i| wrap.place(i, height) * self.width as usize);
        let [a, b] = [rows[0] + columns[0], rows[0] + columns[1]].map(|index| self.texel(index));
        let [c, d] = [rows[1] + columns[0], rows[1] + columns[1]].map(|index| self.texel(index));
        ([a, b, c, d], vec2(x - left, y - top))
    }
}

fn unreadable(error: impl fmt::Display) -> String {
    format!("it cannot be read as an image: {error}; give a whole PNG, JPEG, HDR or EXR, of grey or RGB")
}

fn hash_of(bytes: &[u8], encoding: Encoding) -> String {
    format!("{encoding:?} {}", blake3::hash(bytes).to_hex())
}

fn check_size(width: u32, height: u32) -> Result<(), String> {
    if width <= MAX_SIDE && height <= MAX_SIDE && u64::from(width) * u64::from(height) <= MAX_TEXELS {
        return Ok(());
    }
    Err(format!("it has {width}x{height} texels; make it at most {MAX_SIDE} a side and {MAX_TEXELS} in all"))
}

/// Refuses to decode floats by a transfer function.
fn check_linear(declared: Option<Encoding>) -> Result<(), String> {
    match declared {
        Some(Encoding::Srgb) => Err("its values are linear by its format; leave `encoding` out".into()),
        _ => Ok(()),
    }
}

/// Whether the last scan of a JPEG is followed by the marker of the end. Decoders make up what is missing.
fn has_end_of_jpeg(bytes: &[u8]) -> bool {
    let last = |marker: [u8; 2]| bytes.windows(2).rposition(|pair| pair == marker);
    last([0xff, 0xd9]) > last([0xff, 0xda])
}

/// An image over texture coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageTexture {
    /// The image.
    pub image: Arc<Image>,
    /// What is beyond its borders.
    pub wrap: Wrap,
    /// Where it lies.
    pub map: UvMap,
    /// What is read of it.
    pub channel: Channel,
    /// What its values are multiplied by.
    pub scale: Spectrum,
}

impl ImageTexture {
    /// The value at texture coordinates.
    #[inline]
    pub fn at(&self, uv: Vec2) -> Spectrum {
        self.channel.of(self.image.bilinear(self.map.at(uv), self.wrap)) * self.scale
    }

    /// The least and the greatest value of every channel.
    pub fn range(&self) -> (Spectrum, Spectrum) {
        let [a, b] = [self.image.low, self.image.high].map(|texel| self.channel.of(texel) * self.scale);
        (super::min(a, b), a.max(b))
    }

    /// How the mean of its channels grows along u and v.
    pub fn slope(&self, uv: Vec2) -> Vec2 {
        let [u, v] =
            self.image.slope(self.map.at(uv), self.wrap).map(|texel| (self.channel.of(texel) * self.scale).mean());
        vec2(u, v) * self.map.scale
    }
}

#[cfg(test)]
mod tests;
