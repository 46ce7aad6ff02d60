//! Layered OpenEXR files, ours or another program's, read back.

use crate::export::ExportError;
use crate::machine::require_memory;
use exr::meta::header::Header;
use exr::prelude::{AttributeValue, MetaData, ReadChannels, ReadLayers, Text, Vec2, read};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;
use std::path::Path;

/// One layer of an image file.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageLayer {
    /// The layer's name; empty for the beauty.
    pub name: String,
    /// Linear red, green, blue, row by row from the top. A layer with a single channel `Y` has it in all three.
    pub pixels: Vec<[f32; 3]>,
}

/// An image file, read back.
#[derive(Clone, Debug, PartialEq)]
pub struct LayeredImage {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The layers, the beauty first, then by name.
    pub layers: Vec<ImageLayer>,
    /// Channels that belong to no layer of three colours or one luminance, such as `A` or `Z`.
    pub other_channels: Vec<String>,
    /// The attributes that are text or a number, as text.
    pub attributes: BTreeMap<String, String>,
}

impl LayeredImage {
    /// The layer of this name; the empty name is the beauty.
    pub fn layer(&self, name: &str) -> Option<&ImageLayer> {
        self.layers.iter().find(|l| l.name == name)
    }
}

/// Reads all layers of an OpenEXR file, ours or another program's (16 or 32 bits, scanlines or tiles). The parts of a
/// multi-part file count as layers under their names.
///
/// # Errors
/// If there is no such file, it is no OpenEXR file, or its parts differ in size.
pub fn read_layers(path: &Path) -> Result<LayeredImage, ExportError> {
    let format = |reason: String| ExportError::Format { path: path.to_owned(), reason };
    let bytes = scenes::file::read(path).map_err(|source| ExportError::Read { path: path.to_owned(), source })?;
    require_size(&bytes).map_err(format)?;
    let reader = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
    let image =
        reader.from_buffered(Cursor::new(bytes)).map_err(|e| format(format!("no readable OpenEXR image: {e}")))?;

    let Vec2(width, height) = image.layer_data.first().map(|l| l.size).unwrap_or_default();
    let mut channels = BTreeMap::new();
    let mut attributes = BTreeMap::new();
    for part in &image.layer_data {
        if part.size != Vec2(width, height) {
            return Err(format("its parts differ in size".to_owned()));
        }
        let part_name = part.attributes.layer_name.as_ref().map(Text::to_string).unwrap_or_default();
        for channel in &part.channel_data.list {
            let samples: Vec<f32> = channel.sample_data.values_as_f32().collect();
            if samples.len() != width * height {
                return Err(format(format!("its channel {} is subsampled", channel.name)));
            }
            channels.insert(channel_name(&part_name, &channel.name.to_string()), samples);
        }
        attributes.extend(part.attributes.other.iter().filter_map(described));
        attributes.extend(part.attributes.software_name.iter().map(|s| ("software".to_owned(), s.to_string())));
    }
    attributes.extend(image.attributes.other.iter().filter_map(described));
    let (layers, other_channels) = layers_of(channels);
    Ok(LayeredImage { width, height, layers, other_channels, attributes })
}

/// Refuses a file whose header promises more than there is memory for.
fn require_size(bytes: &[u8]) -> Result<(), String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(|error| format!("no readable OpenEXR image: {error}"))?;
    let numbers = |header: &Header| {
        header.layer_size.0 as u128 * header.layer_size.1 as u128 * header.channels.list.len() as u128
    };
    // They are kept as read, as `f32` and as colours.
    let needed = 12 * meta.headers.iter().map(numbers).sum::<u128>();
    require_memory(needed, "its image").map_err(|error| error.to_string())
}

/// A part's name counts only where its channels don't repeat it.
fn channel_name(part: &str, channel: &str) -> String {
    if part.is_empty() || channel.starts_with(&format!("{part}.")) {
        return channel.to_owned();
    }
    format!("{part}.{channel}")
}

fn described((name, value): (&Text, &AttributeValue)) -> Option<(String, String)> {
    let value = match value {
        AttributeValue::Text(t) => String::from_utf8_lossy(t.as_slice()).into_owned(),
        AttributeValue::I32(i) => i.to_string(),
        AttributeValue::F32(f) => f.to_string(),
        AttributeValue::F64(f) => f.to_string(),
        _ => return None,
    };
    Some((name.to_string(), value))
}

/// Groups channels by what stands before their last dot.
fn layers_of(mut channels: BTreeMap<String, Vec<f32>>) -> (Vec<ImageLayer>, Vec<String>) {
    let prefixes: BTreeSet<String> =
        channels.keys().map(|name| name.rfind('.').map_or(String::new(), |dot| name[..=dot].to_owned())).collect();
    let mut layers = Vec::new();
    for prefix in prefixes {
        let name = prefix.trim_end_matches('.').to_owned();
        let key = |c: &str| format!("{prefix}{c}");
        if ["R", "G", "B"].iter().all(|c| channels.contains_key(&key(c))) {
            let [r, g, b] = ["R", "G", "B"].map(|c| channels.remove(&key(c)).unwrap_or_default());
            let pixels = r.into_iter().zip(g).zip(b).map(|((r, g), b)| [r, g, b]).collect();
            layers.push(ImageLayer { name, pixels });
        } else if let Some(y) = channels.remove(&key("Y")) {
            layers.push(ImageLayer { name, pixels: y.into_iter().map(|y| [y; 3]).collect() });
        }
    }
    (layers, channels.into_keys().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_of_other_programs_are_grouped_by_what_stands_before_the_last_dot() {
        let names = ["R", "G", "B", "A", "view.diffuse.R", "view.diffuse.G", "view.diffuse.B", "depth.Y", "Z"];
        let channels = names.map(|n| (n.to_owned(), vec![1.0])).into_iter().collect();
        let (layers, others) = layers_of(channels);
        assert_eq!(layers.iter().map(|l| l.name.as_str()).collect::<Vec<_>>(), ["", "depth", "view.diffuse"]);
        assert_eq!(others, ["A", "Z"]);
    }
}
