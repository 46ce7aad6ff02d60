//! Measurements as OpenEXR files, and layered OpenEXR files read back. All that is known of the `exr` crate is here and in
//! `exr/reading.rs`.
//!
//! One single-part scanline file of 32-bit floats, ZIP-compressed, linear sRGB primaries. The channels of a layer are named
//! `layer.R`, `layer.G`, `layer.B` with exactly one dot (Nuke and Blender know no more than that), the beauty's plainly `R`,
//! `G`, `B`:
//!
//! | layer | holds |
//! |---|---|
//! | (root) | the sum of all layers traced |
//! | `order02` | that order of the Neumann series |
//! | `order02_var` | variance of the mean in `order02`: the replicates' variance divided by their number |
//! | `tail`, `tail_var` | all beyond the last order |
//! | `s02_t03` | strategy (2, 3): its share of the image |
//! | `s02_t03_raw` | what it would estimate alone |
//! | `s02_t03_weight` | (channel `Y`) the mean weight of its contributions to the pixel; 0 where it has none |
//! | `group_key`, `group_key_order02` | what a light group brings, in all and by order |
//! | `lpe_caustics` | the light of a path class |
//!
//! Each of these has its `_var`, as orders have. A reference has one of the beauty too, and `_half`s: see [`crate::reference::file`].
//!
//! The display window is the whole image, the data window the pixels that were asked for.
//!
//! Equal measurements give equal bytes, but for the value of `renderTimeSeconds`, which [`without_time`] blanks.

mod channels;
mod reading;

use super::{ExportError, write_streamed};
use crate::machine::VERSION;
use channels::Samples;
use exr::meta::attribute::Chromaticities;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, Image, IntegerBounds, Layer,
    LayerAttributes, LineOrder, SmallVec, Text, Vec2, WritableImage,
};
use integrators::Measurement;
pub use reading::{ImageLayer, LayeredImage, read_layers};
use std::collections::HashMap;
use std::io::{self, BufRead, BufReader, BufWriter, Cursor, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::str::FromStr;

/// Where a measurement comes from: what its file says about it besides the numbers.
#[derive(Clone, Debug)]
pub struct ImageMeta {
    /// The program and its version, such as `neumann 0.1.0`.
    pub software: String,
    /// The scene's name.
    pub scene: String,
    /// Hash of the scene's content.
    pub scene_hash: String,
    /// The method's name.
    pub method: String,
    /// The method's settings.
    pub settings: serde_json::Value,
    /// The sampler's name.
    pub sampler: String,
    /// The pixel filter's name.
    pub filter: String,
    /// The seed.
    pub seed: u64,
}

/// Which layers a file holds besides the beauty. The words of `--layers`: `orders`, `variance`, `strategies`, `groups`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LayerSelection {
    /// The mean of every order, and of the tail.
    pub orders: bool,
    /// The variance of those means, where there are two replicates or more.
    pub variance: bool,
    /// Every strategy, raw and weighted.
    pub strategies: bool,
    /// Every light group.
    pub groups: bool,
}

impl LayerSelection {
    /// The words of `--layers`.
    pub const NAMES: [&str; 5] = ["orders", "variance", "strategies", "groups", "beauty"];
    /// The beauty alone.
    pub const BEAUTY: Self = Self { orders: false, variance: false, strategies: false, groups: false };
    /// Everything a measurement holds.
    pub const ALL: Self = Self { orders: true, variance: true, strategies: true, groups: true };
}

impl Default for LayerSelection {
    fn default() -> Self {
        Self { orders: true, ..Self::BEAUTY }
    }
}

impl FromStr for LayerSelection {
    type Err = String;

    /// A list such as `orders,variance`; `beauty` or an empty list for the beauty alone.
    fn from_str(list: &str) -> Result<Self, String> {
        let mut selection = Self::BEAUTY;
        for word in list.split(',').map(str::trim).filter(|w| !w.is_empty()) {
            match word {
                "orders" => selection.orders = true,
                "variance" => selection.variance = true,
                "strategies" => selection.strategies = true,
                "groups" => selection.groups = true,
                "beauty" => {}
                _ => {
                    let names = Self::NAMES.join("`, `");
                    let unknown = format!("unknown layers `{word}`, expected one of `{names}`");
                    return Err(integrators::with_nearest(&unknown));
                }
            }
        }
        Ok(selection)
    }
}

/// Writes a measurement, whole or not at all.
///
/// # Errors
/// If the file can't be encoded or written.
pub fn write_measurement(
    path: &Path,
    measurement: &Measurement,
    meta: &ImageMeta,
    selection: LayerSelection,
) -> Result<(), ExportError> {
    let written = write_streamed(path, |file| encode_to(file, measurement, meta, selection));
    written.map_err(|source| not_written(path, source))
}

/// Writes layers that were read and changed, whole or not at all, with the attributes that they came with.
///
/// # Errors
/// If the file can't be encoded or written.
pub fn write_layers(path: &Path, image: &LayeredImage) -> Result<(), ExportError> {
    let size = (image.width, image.height);
    let other = image.attributes.iter().map(|(name, value)| (text(name), AttributeValue::Text(text(value)))).collect();
    let software_name = Some(text(&format!("neumann {VERSION}")));
    let attributes = LayerAttributes { software_name, other, ..LayerAttributes::default() };
    let channels = channels::of_layers(&image.layers);
    let written = write_streamed(path, |file| encode_channels(file, size, size, attributes, channels));
    written.map_err(|source| not_written(path, source))
}

/// The error about a file that could not be encoded or written.
fn not_written(path: &Path, source: io::Error) -> ExportError {
    let path = path.to_owned();
    match source.kind() {
        io::ErrorKind::InvalidInput => ExportError::Encode { path, reason: source.to_string() },
        _ => ExportError::Write { path, source },
    }
}

/// A measurement as the bytes of its file.
pub(crate) fn encode(
    measurement: &Measurement,
    meta: &ImageMeta,
    selection: LayerSelection,
) -> Result<Vec<u8>, String> {
    let mut bytes = Cursor::new(Vec::new());
    encode_to(&mut bytes, measurement, meta, selection).map_err(|e| e.to_string())?;
    Ok(bytes.into_inner())
}

fn encode_to(
    to: &mut (impl Read + Write + Seek),
    measurement: &Measurement,
    meta: &ImageMeta,
    selection: LayerSelection,
) -> io::Result<()> {
    let size = (measurement.width as usize, measurement.height as usize);
    let (width, height) = measurement.image_size;
    let display = (width as usize, height as usize);
    encode_channels(to, size, display, layer_attributes(measurement, meta), channels::of(measurement, selection))
}

/// Writes a file of so many pixels of an image that has so many, of which few lines are in memory at once.
fn encode_channels(
    to: &mut (impl Read + Write + Seek),
    (width, height): (usize, usize),
    display: (usize, usize),
    attributes: LayerAttributes,
    channels: Vec<AnyChannel<Samples>>,
) -> io::Result<()> {
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let channels = AnyChannels::sort(SmallVec::from_vec(channels));
    let mut image = Image::from_layer(Layer::new(Vec2(width, height), attributes, encoding, channels));
    image.attributes.display_window = IntegerBounds::from_dimensions(display);
    image.attributes.chromaticities = Some(Chromaticities {
        red: Vec2(0.64, 0.33),
        green: Vec2(0.30, 0.60),
        blue: Vec2(0.15, 0.06),
        white: Vec2(0.3127, 0.3290),
    });
    let written = image.write().to_buffered(BufWriter::new(&mut *to));
    written.map_err(|e| match e {
        exr::error::Error::Io(e) => e,
        e => io::Error::new(io::ErrorKind::InvalidInput, e.to_string()),
    })?;
    sort_attributes(to)
}

/// Standard attributes where there is one, ours prefixed `neumann:`; no name longer than the 31 bytes that every reader takes.
/// `samplesPerPixel` is left out where the number exceeds the attribute's 32 bits; `neumann:samples` always has it.
fn layer_attributes(measurement: &Measurement, meta: &ImageMeta) -> LayerAttributes {
    let mut other = HashMap::new();
    let mut add = |name: &str, value: AttributeValue| {
        debug_assert!(name.len() <= 31, "attribute name too long: {name}");
        other.insert(text(name), value);
    };
    if let Ok(samples) = i32::try_from(measurement.samples()) {
        add("samplesPerPixel", AttributeValue::I32(samples));
    }
    add(TIME_ATTRIBUTE, AttributeValue::F32(measurement.seconds() as f32));
    let replicates = measurement.replicates.to_string();
    for (name, value) in [
        ("neumann:scene", meta.scene.as_str()),
        ("neumann:scene_hash", &meta.scene_hash),
        ("neumann:method", &meta.method),
        ("neumann:settings", &meta.settings.to_string()),
        ("neumann:sampler", &meta.sampler),
        ("neumann:filter", &meta.filter),
        ("neumann:seed", &meta.seed.to_string()),
        ("neumann:samples", &measurement.samples().to_string()),
        ("neumann:replicates", &replicates),
        ("neumann:max_order", &measurement.max_order.to_string()),
    ] {
        add(name, AttributeValue::Text(text(value)));
    }
    let (x, y) = measurement.origin;
    let layer_position = Vec2(x as i32, y as i32);
    LayerAttributes { software_name: Some(text(&meta.software)), layer_position, other, ..LayerAttributes::default() }
}

/// OpenEXR's strings are bytes; ours are UTF-8, as its specification recommends.
fn text(s: &str) -> Text {
    Text::from_slice_unchecked(s.as_bytes())
}

const TIME_ATTRIBUTE: &str = "renderTimeSeconds";

/// The same file with `renderTimeSeconds` set to zero, which is all that may differ between two files of the same measurement.
pub fn without_time(exr: &[u8]) -> Vec<u8> {
    let mut bytes = exr.to_vec();
    let key = [TIME_ATTRIBUTE.as_bytes(), b"\0float\0\x04\0\0\0"].concat();
    if let Some(at) = bytes.windows(key.len()).position(|w| w == key) {
        bytes[at + key.len()..][..4].fill(0);
    }
    bytes
}

/// Sorts the header's attributes by name, as the reference implementation writes them; the `exr` crate leaves them in the
/// order of a hash map, which is another in every process.
///
/// The header of a single-part file is magic number and version (8 bytes), then for each attribute name, NUL, type, NUL, length (`i32`), value;
/// then NUL.
fn sort_attributes(file: &mut (impl Read + Write + Seek)) -> io::Result<()> {
    let start = SeekFrom::Start(8);
    file.seek(start)?;
    let mut from = BufReader::new(&mut *file);
    let mut attributes = Vec::new();
    loop {
        let mut attribute = Vec::new();
        from.read_until(0, &mut attribute)?;
        if attribute == [0] {
            break;
        }
        from.read_until(0, &mut attribute)?;
        let mut length = [0; 4];
        from.read_exact(&mut length)?;
        attribute.extend(length);
        let length = u64::try_from(i32::from_le_bytes(length)).map_err(|_| unexpected())?;
        if from.by_ref().take(length).read_to_end(&mut attribute)? as u64 != length {
            return Err(unexpected());
        }
        attributes.push(attribute);
    }
    attributes.sort();
    file.seek(start)?;
    file.write_all(&attributes.concat())
}

/// The error about a header that is not as the specification has it.
fn unexpected() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, "the header written is not as expected")
}

#[cfg(test)]
mod tests {
    use super::super::testing::measurement;
    use super::*;

    fn meta() -> ImageMeta {
        ImageMeta {
            software: "neumann 0.1.0".to_owned(),
            scene: "<b>\"ünï\" \u{202e}".to_owned(),
            scene_hash: "12ab".to_owned(),
            method: "path".to_owned(),
            settings: serde_json::json!({"mis": "power"}),
            sampler: "independent".to_owned(),
            filter: "box".to_owned(),
            seed: u64::MAX,
        }
    }

    fn written(measurement: &Measurement, selection: LayerSelection) -> LayeredImage {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write_measurement(&path, measurement, &meta(), selection).unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        read_layers(&path).unwrap()
    }

    #[test]
    fn every_layer_survives_its_file_to_the_bit() {
        let m = measurement("path", 3, true);
        let image = written(&m, LayerSelection::ALL);
        assert_eq!((image.width, image.height), (11, 9));
        let names: Vec<&str> = image.layers.iter().map(|l| l.name.as_str()).collect();
        let expected =
            ["", "order00", "order00_var", "order01", "order01_var", "order02", "order02_var", "tail", "tail_var"];
        assert_eq!(names, expected);
        assert!(image.other_channels.is_empty());
        let to_f32 = |v: [f64; 3]| v.map(|x| x as f32);
        for p in 0..m.pixels() {
            assert_eq!(image.layers[0].pixels[p], to_f32(m.total(p)));
            for layer in 0..4 {
                assert_eq!(image.layers[1 + 2 * layer].pixels[p], to_f32(m.mean(layer, p)));
                let of_mean = m.variance(layer, p).unwrap().map(|v| v * (1.0 / 3.0));
                assert_eq!(image.layers[2 + 2 * layer].pixels[p], to_f32(of_mean));
            }
        }
    }

    #[test]
    fn the_header_says_where_the_image_comes_from() {
        let attributes = written(&measurement("path", 3, false), LayerSelection::default()).attributes;
        let expected = [
            ("software", "neumann 0.1.0"),
            ("samplesPerPixel", "6"),
            ("neumann:scene", "<b>\"ünï\" \u{202e}"),
            ("neumann:scene_hash", "12ab"),
            ("neumann:settings", r#"{"mis":"power"}"#),
            ("neumann:sampler", "independent"),
            ("neumann:filter", "box"),
            ("neumann:seed", "18446744073709551615"),
            ("neumann:replicates", "3"),
        ];
        for (name, value) in expected {
            assert_eq!(attributes.get(name).map(String::as_str), Some(value), "{name}");
        }
        assert!(attributes.contains_key(TIME_ATTRIBUTE) && attributes.keys().all(|name| name.len() <= 31));
    }

    #[test]
    fn layers_are_left_out_where_they_are_not_asked_for_or_not_known() {
        let names = |replicates, selection| -> Vec<String> {
            let image = written(&measurement("path", replicates, false), selection);
            image.layers.into_iter().map(|l| l.name).collect()
        };
        assert_eq!(names(2, LayerSelection::BEAUTY), [""]);
        assert_eq!(names(1, LayerSelection::ALL), ["", "order00", "order01", "order02"]);
        assert_eq!("orders, variance,strategies,groups".parse(), Ok(LayerSelection::ALL));
        assert!("depth".parse::<LayerSelection>().unwrap_err().contains("`depth`"));
    }

    #[test]
    fn equal_measurements_give_equal_files_but_for_the_time() {
        let mut other = measurement("path", 2, false);
        let [first, second] =
            [&measurement("path", 2, false), &other].map(|m| encode(m, &meta(), LayerSelection::ALL).unwrap());
        assert_eq!(without_time(&first), without_time(&second));
        other.replicate_seconds[0] += 1.0;
        let later = encode(&other, &meta(), LayerSelection::ALL).unwrap();
        assert!(later != second && without_time(&later) == without_time(&second));
    }

    #[test]
    fn what_is_no_image_is_an_error_that_names_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        assert!(read_layers(&path).unwrap_err().to_string().contains("a.exr"));
        let whole = encode(&measurement("path", 2, false), &meta(), LayerSelection::ALL).unwrap();
        for bytes in [&b"not an image"[..], b"", &whole[..whole.len() / 2], &whole[..20]] {
            std::fs::write(&path, bytes).unwrap();
            assert!(read_layers(&path).unwrap_err().to_string().contains("a.exr"));
        }
    }
}
