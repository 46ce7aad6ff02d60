//! Drawings as files for papers: SVG, PDF and PNG, of one size in millimetres, letters turned into outlines. All that is known of the
//! `resvg` and `svg2pdf` crates is here.
//!
//! Letters are those of the font beside this file, whatever fonts the reader's machine has: so a figure looks the same everywhere, and
//! no program that it is put into has to know the font. [`fonts/LICENSE`](https://dejavu-fonts.github.io/License.html) tells where it is
//! from.

use super::png::Picture;
use super::{ExportError, write_atomically};
use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::{self, Options, Tree, WriteOptions};
use std::path::Path;
use std::sync::Arc;

/// Pixels of a picture to an inch.
const DPI: f32 = 300.0;
/// Those that SVG counts to an inch.
const SVG_DPI: f32 = 96.0;
/// What a figure is drawn with.
const FAMILY: &str = "Neumann Sans";

/// The endings of files that a drawing can be written to.
pub const ENDINGS: [&str; 3] = ["svg", "pdf", "png"];

/// A drawing, ready to be written.
pub struct Drawing {
    tree: Tree,
}

impl Drawing {
    /// What a text of SVG draws. Its letters are of `sans-serif`, whatever family it names besides.
    ///
    /// # Errors
    /// A sentence, if it is no SVG.
    pub fn of(svg: &str) -> Result<Self, String> {
        let mut options = Options { font_family: FAMILY.to_owned(), ..Options::default() };
        let fonts = options.fontdb_mut();
        for font in
            [&include_bytes!("fonts/neumann_sans_regular.ttf")[..], include_bytes!("fonts/neumann_sans_bold.ttf")]
        {
            fonts.load_font_source(usvg::fontdb::Source::Binary(Arc::new(font)));
        }
        fonts.set_sans_serif_family(FAMILY);
        Ok(Self { tree: Tree::from_str(svg, &options).map_err(|e| e.to_string())? })
    }

    /// Writes it to a file, in the form that its ending names.
    ///
    /// # Errors
    /// If it has none of [`ENDINGS`], or cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ExportError> {
        let bytes = match path.extension().and_then(|e| e.to_str()) {
            Some("svg") => Ok(self.svg().into_bytes()),
            Some("pdf") => self.pdf(),
            Some("png") => self.png(),
            _ => Err(format!("a figure is a file in .{}", ENDINGS.join(", ."))),
        };
        write_atomically(path, &bytes.map_err(|reason| ExportError::Encode { path: path.to_owned(), reason })?)
    }

    fn svg(&self) -> String {
        // Two digits after the point are a hundredth of a pixel.
        let options = WriteOptions { coordinates_precision: 2, transforms_precision: 6, ..WriteOptions::default() };
        self.tree.to_string(&options)
    }

    fn pdf(&self) -> Result<Vec<u8>, String> {
        // Without letters, none of a font is embedded.
        let outlines = Tree::from_str(&self.svg(), &Options::default()).map_err(|e| e.to_string())?;
        let page = svg2pdf::PageOptions { dpi: SVG_DPI };
        svg2pdf::to_pdf(&outlines, svg2pdf::ConversionOptions::default(), page).map_err(|e| e.to_string())
    }

    fn png(&self) -> Result<Vec<u8>, String> {
        let (scale, size) = (DPI / SVG_DPI, self.tree.size());
        let [width, height] = [size.width(), size.height()].map(|n| (n * scale).round() as u32);
        let mut pixels = Pixmap::new(width, height).ok_or("it has no size, or is too large")?;
        pixels.fill(Color::WHITE);
        resvg::render(&self.tree, Transform::from_scale(scale, scale), &mut pixels.as_mut());
        // On white nothing shines through.
        let rgb = pixels.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
        Picture { width: width as usize, height: height as usize, rgb }.encode_at(DPI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SVG: &str = "<svg xmlns='http://www.w3.org/2000/svg' width='25.4mm' height='12.7mm' viewBox='0 0 100 50'>\
        <rect width='50' height='50' fill='#ff0000'/>\
        <text x='60' y='40' font-family='system-ui, sans-serif' font-size='30'>T²</text></svg>";

    #[test]
    fn a_picture_has_the_size_in_millimetres_and_the_colours() {
        let png = Drawing::of(SVG).unwrap().png().unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(&png)).read_info().unwrap();
        assert_eq!((reader.info().width, reader.info().height), (300, 150));
        let dots = reader.info().pixel_dims.unwrap();
        assert_eq!((dots.xppu, dots.yppu, dots.unit), (11811, 11811, png::Unit::Meter));
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut rgb).unwrap();
        let pixel = |x: usize, y: usize| &rgb[(y * 300 + x) * 3..][..3];
        assert_eq!((pixel(75, 75), pixel(290, 10)), (&[255, 0, 0][..], &[255, 255, 255][..]));
        // Letters are there, though no font of the machine was asked.
        let ink = (150..300).flat_map(|x| (0..150).map(move |y| (x, y))).filter(|&(x, y)| pixel(x, y) == [0, 0, 0]);
        assert!((500..6000).contains(&ink.count()));
    }

    #[test]
    fn letters_are_outlines_and_pages_have_the_size_of_the_drawing() {
        let drawing = Drawing::of(SVG).unwrap();
        let svg = drawing.svg();
        assert!(!svg.contains("<text") && svg.matches("<path").count() >= 2, "{svg}");
        let pdf = drawing.pdf().unwrap();
        let text = String::from_utf8_lossy(&pdf);
        assert!(
            text.starts_with("%PDF-") && text.contains("/MediaBox [0 0 72 36]") && !text.contains("/FontFile"),
            "{text}"
        );
    }

    #[test]
    fn other_endings_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let message = Drawing::of(SVG).unwrap().write(&folder.path().join("a.jpg")).unwrap_err().to_string();
        assert!(message.contains("a.jpg") && message.contains(".svg, .pdf, .png"), "{message}");
        assert!(Drawing::of("<svg").is_err());
    }
}
