//! Pictures to look at: 8-bit sRGB, one tile an order. All that is known of the `png` crate is here and in the lettering.
//!
//! A tile's label states its exposure, a power of two, so that a dim order can be seen and is not mistaken for a bright one.

use super::notation::symbol;
use super::tone::Exposure;
use super::{ExportError, lettering, write_atomically};
use integrators::{Layer, Measurement};
use std::ops::Range;
use std::path::Path;

pub(super) const BACKGROUND: [u8; 3] = [18, 20, 24];
pub(super) const INK: [u8; 3] = [236, 238, 242];
pub(super) const FAINT_INK: [u8; 3] = [150, 156, 168];
/// Between tiles, and around the sheet [pixels].
const GAP: usize = 12;
/// Tiles narrower than this are enlarged by a whole factor, so that their labels fit [pixels].
const MIN_TILE: usize = 128;
const TILES_IN_ROW: usize = 5;
/// Side of the blocks whose means decide the exposure [pixels].
const BLOCK: usize = 8;

/// An 8-bit sRGB image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Red, green, blue, row by row from the top.
    pub rgb: Vec<u8>,
}

impl Picture {
    /// All pixels of one colour.
    pub fn filled(width: usize, height: usize, colour: [u8; 3]) -> Self {
        Self { width, height, rgb: colour.repeat(width * height) }
    }

    /// A layer of a measurement, or with `None` the sum of all, each `shrink × shrink` pixels averaged into one.
    pub fn of(measurement: &Measurement, layer: Option<usize>, exposure: Exposure, shrink: usize) -> Self {
        let (w, h) = (measurement.width as usize, measurement.height as usize);
        let (width, height) = (w.div_ceil(shrink), h.div_ceil(shrink));
        let mut rgb = Vec::with_capacity(width * height * 3);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let xs = x * shrink..((x + 1) * shrink).min(w);
            let ys = y * shrink..((y + 1) * shrink).min(h);
            rgb.extend(exposure.apply(block_mean(w, xs, ys, |p| pixel(measurement, layer, p))));
        }
        Self { width, height, rgb }
    }

    /// Every pixel repeated `factor × factor` times.
    pub fn enlarged(&self, factor: usize) -> Self {
        let mut rgb = Vec::with_capacity(self.rgb.len() * factor * factor);
        for row in self.rgb.chunks_exact((self.width * 3).max(1)) {
            let wide: Vec<u8> = row.chunks_exact(3).flat_map(|p| p.repeat(factor)).collect();
            (0..factor).for_each(|_| rgb.extend(&wide));
        }
        Self { width: self.width * factor, height: self.height * factor, rgb }
    }

    /// The bytes of a PNG file. Equal pictures give equal bytes.
    ///
    /// # Errors
    /// A sentence, if the picture has no pixels or more than a PNG file can have.
    pub fn encode(&self) -> Result<Vec<u8>, String> {
        self.encoded(None)
    }

    /// The same for a picture of so many pixels to an inch.
    ///
    /// # Errors
    /// Those of [`Picture::encode`].
    pub fn encode_at(&self, dpi: f32) -> Result<Vec<u8>, String> {
        let per_metre = (dpi / 0.0254).round() as u32;
        self.encoded(Some(png::PixelDimensions { xppu: per_metre, yppu: per_metre, unit: png::Unit::Meter }))
    }

    fn encoded(&self, dimensions: Option<png::PixelDimensions>) -> Result<Vec<u8>, String> {
        let [width, height] = [self.width, self.height].map(|n| u32::try_from(n).unwrap_or(u32::MAX));
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_pixel_dims(dimensions);
        encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
        let written = encoder.write_header().and_then(|mut writer| {
            writer.write_image_data(&self.rgb)?;
            writer.finish()
        });
        written.map_err(|e| e.to_string())?;
        Ok(bytes)
    }

    /// Writes a PNG file, whole or not at all.
    ///
    /// # Errors
    /// If the picture can't be encoded or the file not written.
    pub fn write(&self, path: &Path) -> Result<(), ExportError> {
        let bytes = self.encode().map_err(|reason| ExportError::Encode { path: path.to_owned(), reason })?;
        write_atomically(path, &bytes)
    }

    /// Puts a picture into this one, which has room for it there.
    pub fn paste(&mut self, picture: &Picture, x0: usize, y0: usize) {
        for (y, row) in picture.rgb.chunks_exact(picture.width * 3).enumerate() {
            let start = ((y0 + y) * self.width + x0) * 3;
            self.rgb[start..start + row.len()].copy_from_slice(row);
        }
    }

    /// Writes a line of text; what is outside is cut off.
    pub fn letter(&mut self, text: &str, x0: usize, y0: usize, ink: [u8; 3]) {
        lettering::draw(text, |x, y, coverage| self.blend(x0 + x, y0 + y, ink, coverage));
    }

    /// Lays ink over this share of a pixel, if it is inside.
    pub fn blend(&mut self, x: usize, y: usize, ink: [u8; 3], coverage: f32) {
        if x < self.width && y < self.height {
            let at = (y * self.width + x) * 3;
            for (under, over) in self.rgb[at..at + 3].iter_mut().zip(ink) {
                *under = (*under as f32 + (over as f32 - *under as f32) * coverage).round() as u8;
            }
        }
    }
}

/// The pixel's mean in a layer; with `None`, in the sum of all.
fn pixel(measurement: &Measurement, layer: Option<usize>, pixel: usize) -> [f64; 3] {
    layer.map_or_else(|| measurement.total(pixel), |layer| measurement.mean(layer, pixel))
}

/// The exposure under which a layer, or with `None` the sum, can be seen; `None` where it is black. It is taken from means of
/// small blocks: of single pixels, it would be the darker the noisier they are.
pub(crate) fn exposure_of(measurement: &Measurement, layer: Option<usize>) -> Option<Exposure> {
    let (w, h) = (measurement.width as usize, measurement.height as usize);
    let blocks = (0..h).step_by(BLOCK).flat_map(|y| (0..w).step_by(BLOCK).map(move |x| (x, y)));
    let mean = |(x, y)| block_mean(w, x..(x + BLOCK).min(w), y..(y + BLOCK).min(h), |p| pixel(measurement, layer, p));
    Exposure::of(blocks.map(mean))
}

/// Mean of a rectangle of an image with so many pixels in a row.
pub(crate) fn block_mean(
    width: usize,
    xs: Range<usize>,
    ys: Range<usize>,
    value: impl Fn(usize) -> [f64; 3],
) -> [f64; 3] {
    let count = (xs.len() * ys.len()) as f64;
    let mut sum = [0.0; 3];
    for (y, x) in ys.flat_map(|y| xs.clone().map(move |x| (y, x))) {
        let value = value(y * width + x);
        (0..3).for_each(|c| sum[c] += value[c]);
    }
    sum.map(|s| s / count)
}

/// What is shown of measurements side by side: every layer that any of them has, in rising order, then `None` for the sum.
pub fn columns(measurements: &[&Measurement]) -> Vec<Option<Layer>> {
    let mut layers: Vec<Layer> = measurements.iter().flat_map(|m| m.layers.iter().copied()).collect();
    let rank = |layer: &Layer| match layer {
        Layer::Order(k) => *k,
        Layer::Tail => usize::MAX,
    };
    layers.sort_by_key(rank);
    layers.dedup();
    layers.into_iter().map(Some).chain([None]).collect()
}

/// One measurement: every order and the sum, under the title.
///
/// # Errors
/// If the file can't be written.
pub fn write_contact_sheet(path: &Path, measurement: &Measurement, title: &str) -> Result<(), ExportError> {
    contact_sheet(measurement, title).write(path)
}

/// The picture of [`write_contact_sheet`].
pub fn contact_sheet(measurement: &Measurement, title: &str) -> Picture {
    let tiles = columns(&[measurement])
        .into_iter()
        .map(|column| Tile::new(measurement, column, column_exposure(&[measurement], column)));
    let tiles: Vec<Tile> = tiles.collect();
    let rows: Vec<Row> = tiles.chunks(TILES_IN_ROW).map(|tiles| Row { heading: None, tiles: tiles.to_vec() }).collect();
    sheet(title, &rows)
}

/// Several measurements of one scene: a row each, and in a row every order and the sum; a column shares one exposure.
///
/// # Errors
/// If the file can't be written.
pub fn write_comparison_sheet(path: &Path, rows: &[(&str, &Measurement)], title: &str) -> Result<(), ExportError> {
    comparison_sheet(rows, title).write(path)
}

/// The picture of [`write_comparison_sheet`].
pub fn comparison_sheet(rows: &[(&str, &Measurement)], title: &str) -> Picture {
    let measurements: Vec<&Measurement> = rows.iter().map(|r| r.1).collect();
    let columns: Vec<_> = columns(&measurements).into_iter().map(|c| (c, column_exposure(&measurements, c))).collect();
    let rows = rows.iter().map(|&(heading, measurement)| {
        let tiles = columns.iter().map(|&(column, exposure)| Tile::new(measurement, column, exposure));
        Row { heading: Some(heading.to_owned()), tiles: tiles.collect() }
    });
    sheet(title, &rows.collect::<Vec<_>>())
}

/// The exposure that all methods' images of a layer share.
pub fn column_exposure(measurements: &[&Measurement], column: Option<Layer>) -> Option<Exposure> {
    Exposure::middle(measurements.iter().map(|m| {
        let layer = layer_index(m, column)?;
        exposure_of(m, layer)
    }))
}

/// Where a column is found in a measurement: `Some(None)` is the sum, `None` that it isn't there.
pub fn layer_index(measurement: &Measurement, column: Option<Layer>) -> Option<Option<usize>> {
    match column {
        None => Some(None),
        Some(layer) => measurement.layers.iter().position(|&l| l == layer).map(Some),
    }
}

#[derive(Clone)]
struct Tile {
    label: String,
    note: String,
    picture: Picture,
}

impl Tile {
    /// A layer that the measurement lacks leaves its place empty.
    fn new(measurement: &Measurement, column: Option<Layer>, exposure: Option<Exposure>) -> Self {
        let factor = MIN_TILE.div_ceil((measurement.width as usize).max(1));
        let picture = match layer_index(measurement, column) {
            Some(layer) => Picture::of(measurement, layer, exposure.unwrap_or_default(), 1),
            None => Picture::filled(measurement.width as usize, measurement.height as usize, BACKGROUND),
        };
        let note = exposure.map_or("no light".to_owned(), |e| e.to_string());
        Self { label: symbol(column), note, picture: picture.enlarged(factor) }
    }
}

struct Row {
    heading: Option<String>,
    tiles: Vec<Tile>,
}

impl Row {
    fn width(&self) -> usize {
        self.tiles.iter().map(|t| t.picture.width + GAP).sum::<usize>() + GAP
    }

    fn tile_height(&self) -> usize {
        self.tiles.iter().map(|t| t.picture.height).max().unwrap_or(0)
    }

    /// Heading, labels, tiles and the gap below.
    fn height(&self) -> usize {
        let lines = if self.heading.is_some() { 2 } else { 1 };
        lines * lettering::LINE + self.tile_height() + GAP
    }
}

fn sheet(title: &str, rows: &[Row]) -> Picture {
    let width = rows.iter().map(Row::width).max().unwrap_or(2 * GAP);
    let height = 2 * GAP + lettering::LINE + rows.iter().map(Row::height).sum::<usize>();
    let mut sheet = Picture::filled(width, height, BACKGROUND);
    sheet.letter(&lettering::fitted(title, width - 2 * GAP), GAP, GAP, INK);
    let mut y = 2 * GAP + lettering::LINE;
    for row in rows {
        let mut x = GAP;
        let mut labels = y;
        if let Some(heading) = &row.heading {
            sheet.letter(&lettering::fitted(heading, width - 2 * GAP), GAP, y, INK);
            labels += lettering::LINE;
        }
        for tile in &row.tiles {
            sheet.letter(&tile.label, x, labels, INK);
            let note_x = x + tile.picture.width.saturating_sub(lettering::width(&tile.note));
            sheet.letter(&tile.note, note_x, labels, FAINT_INK);
            sheet.paste(&tile.picture, x, labels + lettering::LINE);
            x += tile.picture.width + GAP;
        }
        y += row.height();
    }
    sheet
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_survive_their_file_to_the_bit() {
        let mut picture = Picture::filled(5, 3, [1, 2, 3]);
        picture.rgb[7] = 200;
        let bytes = picture.encode().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut rgb).unwrap();
        assert_eq!(rgb, picture.rgb);
        assert!(reader.info().srgb.is_some());
        assert!(Picture::filled(0, 0, [0; 3]).encode().is_err());
    }

    #[test]
    fn enlarging_repeats_pixels() {
        let picture = Picture { width: 2, height: 1, rgb: vec![1, 1, 1, 9, 9, 9] };
        let large = picture.enlarged(2);
        assert_eq!((large.width, large.height), (4, 2));
        assert_eq!(large.rgb, [[1; 6], [9; 6], [1; 6], [9; 6]].concat());
    }

    #[test]
    fn a_sheet_has_room_for_the_title_and_cuts_it_where_it_has_not() {
        let tile = Tile { label: "TE".into(), note: "×2".into(), picture: Picture::filled(128, 10, [9; 3]) };
        let row = Row { heading: Some("<script>".into()), tiles: vec![tile.clone(), tile] };
        let sheet = sheet(&"name ".repeat(2000), &[row]);
        assert_eq!((sheet.width, sheet.height), (3 * GAP + 256, 3 * GAP + 3 * lettering::LINE + 10));
    }
}
