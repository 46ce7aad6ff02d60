//! Images in OpenEXR files. All that this crate knows of the `exr` crate is here.

use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, MetaData, ReadChannels, ReadLayers, Vec2, read};
use std::collections::HashMap;
use std::io::Cursor;

/// The first bytes of every OpenEXR file.
const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
/// The most numbers of a part: all its channels are read.
const MAX_NUMBERS: usize = 1 << 30;

/// Whether these are the bytes of an OpenEXR file.
pub fn is_exr(bytes: &[u8]) -> bool {
    bytes.starts_with(&MAGIC)
}

/// A decoded file.
pub struct Decoded {
    /// Red, green, blue and alpha, row by row from the top.
    pub texels: Vec<[f32; 4]>,
    /// Whether there is an alpha.
    pub has_alpha: bool,
}

/// Width and height of the first part \[texels\].
///
/// # Errors
///
/// What is wrong with the file.
pub fn size(bytes: &[u8]) -> Result<(u32, u32), String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|error| error.to_string())?;
    for header in &meta.headers {
        let (Vec2(width, height), channels) = (header.layer_size, header.channels.list.len());
        if width.saturating_mul(height).saturating_mul(channels) > MAX_NUMBERS {
            return Err(format!(
                "it has {width}x{height} texels in {channels} channels, more than {MAX_NUMBERS} numbers"
            ));
        }
    }
    let Vec2(width, height) = meta.headers.first().ok_or("it has no parts")?.layer_size;
    let side = |side: usize| u32::try_from(side).map_err(|_| format!("it has {width}x{height} texels"));
    Ok((side(width)?, side(height)?))
}

/// The first part: its channels R, G and B, or a single one as grey, and A. Of channels in layers, those of the first that has
/// colours.
///
/// # Errors
///
/// What is wrong with the file.
pub fn decode(bytes: &[u8]) -> Result<Decoded, String> {
    let reader = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = reader.from_buffered(Cursor::new(bytes)).map_err(|error| error.to_string())?;
    let Vec2(width, height) = image.layer_data.size;
    let AnyChannels { list: channels } = image.layer_data.channel_data;
    if let Some(channel) = channels.iter().find(|channel| channel.sample_data.len() != width * height) {
        return Err(format!("its channel {} has another size than the image", channel.name));
    }
    let names: Vec<String> = channels.iter().map(|channel| channel.name.to_string()).collect();
    let Some((colours, alpha)) = chosen(&names) else {
        return Err(format!("it has neither the channels R, G and B nor one alone, but {}", names.join(", ")));
    };
    let values = |place: usize| channel_values(&channels[place]);
    let [mut r, mut g, mut b] = colours.map(values);
    let mut a = alpha.map(values);
    let texels = (0..width * height).map_while(|_| {
        let opacity = a.as_mut().map_or(Some(1.0), Iterator::next)?;
        Some([r.next()?, g.next()?, b.next()?, opacity])
    });
    Ok(Decoded { texels: texels.collect(), has_alpha: alpha.is_some() })
}

fn channel_values(channel: &AnyChannel<FlatSamples>) -> Box<dyn Iterator<Item = f32> + '_> {
    Box::new(channel.sample_data.values_as_f32())
}

/// The places of red, green and blue, and of alpha.
fn chosen(names: &[String]) -> Option<([usize; 3], Option<usize>)> {
    // Of two of a name the first counts.
    let places: HashMap<&str, usize> = names.iter().enumerate().rev().map(|(i, name)| (name.as_str(), i)).collect();
    let place = |layer: &str, channel: &str| places.get(format!("{layer}{channel}").as_str()).copied();
    let layer_of = |name: &String| name.rfind('.').map_or(0, |dot| dot + 1);
    let mut layers = std::iter::once("").chain(names.iter().map(|name| &name[..layer_of(name)]));
    let coloured = layers.find_map(|layer| {
        let colours = [place(layer, "R")?, place(layer, "G")?, place(layer, "B")?];
        Some((colours, place(layer, "A")))
    });
    coloured.or_else(|| {
        // Luminance with its chroma is half a picture.
        let has_chroma = names.iter().any(|name| name.ends_with("RY") || name.ends_with("BY"));
        let alpha = place("", "A");
        let mut others = (0..names.len()).filter(|i| Some(*i) != alpha);
        match (others.next(), others.next()) {
            (Some(only), None) if !has_chroma => Some(([only; 3], alpha)),
            _ => None,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::{Encoding, Image, LayerAttributes, SmallVec, WritableImage};

    fn file(names: &[&str]) -> Vec<u8> {
        let channel = |(i, name): (usize, &&str)| AnyChannel::new(*name, FlatSamples::F32(vec![i as f32, 10.0]));
        let channels: SmallVec<_> = names.iter().enumerate().map(channel).collect();
        let image = Image::from_encoded_channels((2, 1), Encoding::UNCOMPRESSED, AnyChannels::sort(channels));
        let _: &LayerAttributes = &image.layer_data.attributes;
        let mut bytes = Cursor::new(Vec::new());
        image.write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn colours_and_greys_are_found_among_the_channels() {
        for (names, first, has_alpha) in [
            (&["R", "G", "B"][..], [0.0, 1.0, 2.0, 1.0], false),
            (&["B", "A", "R", "G"], [2.0, 3.0, 0.0, 1.0], true),
            (&["Y"], [0.0, 0.0, 0.0, 1.0], false),
            (&["Y", "A"], [0.0, 0.0, 0.0, 1.0], true),
            (&["height.Z"], [0.0, 0.0, 0.0, 1.0], false),
            (&["depth.Z", "sky.R", "sky.G", "sky.B"], [1.0, 2.0, 3.0, 1.0], false),
        ] {
            let bytes = file(names);
            assert!(is_exr(&bytes));
            assert_eq!(size(&bytes).unwrap(), (2, 1));
            let decoded = decode(&bytes).unwrap();
            assert_eq!(
                (decoded.texels.len(), decoded.texels[0], decoded.has_alpha),
                (2, first, has_alpha),
                "{names:?}"
            );
        }
        for names in [&["R", "G"][..], &["Y", "RY", "BY"], &["X", "Y", "Z"]] {
            let error = decode(&file(names)).err().unwrap();
            assert!(error.contains("neither the channels R, G and B"), "{error}");
        }
    }

    #[test]
    fn many_channels_and_what_a_header_promises_take_no_time() {
        let names: Vec<String> = (0..30_000).map(|i| format!("layer{i:05}.Z")).collect();
        let bytes = file(&names.iter().map(String::as_str).collect::<Vec<_>>());
        assert!(decode(&bytes).err().unwrap().contains("neither the channels R, G and B"));
        let mut bytes = file(&["R", "G", "B"]);
        // Both windows, with their corners.
        let window = [0i32, 0, 1, 0].map(i32::to_le_bytes).concat();
        let wide = [0i32, 0, 40_000, 40_000].map(i32::to_le_bytes).concat();
        while let Some(at) = bytes.windows(16).position(|found| found == window) {
            bytes[at..at + 16].copy_from_slice(&wide);
        }
        assert!(size(&bytes).unwrap_err().contains("40001x40001 texels in 3 channels"));
    }

    #[test]
    fn truncated_files_are_errors() {
        let bytes = file(&["R", "G", "B"]);
        for end in 4..bytes.len() - 1 {
            assert!(decode(&bytes[..end]).is_err(), "{end} of {}", bytes.len());
        }
    }
}
