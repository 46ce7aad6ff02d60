//! Images as they are decoded and read.

use super::*;

/// A PNG of 2×2 texels: black, red; white, and a transparent middle grey.
fn png() -> Vec<u8> {
    let mut image = image::RgbaImage::new(2, 2);
    for (x, y, texel) in
        [(0, 0, [0, 0, 0, 255]), (1, 0, [255, 0, 0, 255]), (0, 1, [255; 4]), (1, 1, [128, 128, 128, 0])]
    {
        image.put_pixel(x, y, image::Rgba(texel));
    }
    let mut bytes = Vec::new();
    image.write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::Png).unwrap();
    bytes
}

/// Every format of bytes gives the same texels; a TGA has no name at its beginning.
#[test]
fn formats_of_bytes_are_read_alike() {
    let texels = image::RgbImage::from_fn(3, 2, |x, y| image::Rgb([90 * x as u8, 200 * y as u8, 30]));
    let decode = |format: image::ImageFormat| {
        let mut bytes = Vec::new();
        texels.write_to(&mut Cursor::new(&mut bytes), format).unwrap();
        let image = Image::decode(&bytes, None, Encoding::Srgb).unwrap_or_else(|error| panic!("{format:?}: {error}"));
        (image.size(), (0..6).map(|i| image.texel(i)).collect::<Vec<_>>())
    };
    let png = decode(image::ImageFormat::Png);
    assert!((png.1[1][0] - Encoding::Srgb.decode(90.0 / 255.0)).abs() < 1e-6, "{png:?}");
    for format in [image::ImageFormat::Bmp, image::ImageFormat::Tga] {
        assert_eq!(decode(format), png, "{format:?}");
    }
}

fn texture(encoding: Encoding, wrap: Wrap, channel: Channel) -> ImageTexture {
    let image = Arc::new(Image::decode(&png(), None, encoding).unwrap());
    ImageTexture { image, wrap, map: UvMap::default(), channel, scale: Spectrum::ONE }
}

#[test]
fn the_origin_is_at_the_bottom_left_and_centres_have_their_texels() {
    let linear = texture(Encoding::Linear, Wrap::Repeat, Channel::Colour);
    assert_eq!(linear.at(vec2(0.25, 0.75)).to_array(), [0.0; 3]);
    assert_eq!(linear.at(vec2(0.75, 0.75)).to_array(), [1.0, 0.0, 0.0]);
    assert_eq!(linear.at(vec2(0.25, 0.25)).to_array(), [1.0; 3]);
    assert!((linear.at(vec2(0.5, 0.75)).to_array()[0] - 0.5).abs() < 1e-6);
    let srgb = texture(Encoding::Srgb, Wrap::Repeat, Channel::Colour);
    assert!((srgb.at(vec2(0.75, 0.25)).to_array()[0] - 0.215_861).abs() < 1e-5);
    let alpha = texture(Encoding::Srgb, Wrap::Repeat, Channel::ALPHA);
    assert_eq!(alpha.at(vec2(0.75, 0.25)).to_array(), [0.0; 3]);
    assert_eq!(alpha.range(), (Spectrum::ZERO, Spectrum::ONE));
}

#[test]
fn borders_are_wrapped_as_declared() {
    // Row of the red texel: to its right comes black again, itself mirrored, or itself.
    for (wrap, expected) in [(Wrap::Repeat, 0.0), (Wrap::Mirror, 1.0), (Wrap::Clamp, 1.0)] {
        let texture = texture(Encoding::Linear, wrap, Channel::Colour);
        assert_eq!(texture.at(vec2(1.25, 0.75)).to_array()[0], expected, "{wrap:?}");
    }
    for (wrap, expected) in [(Wrap::Repeat, 1.0), (Wrap::Mirror, 0.0), (Wrap::Clamp, 1.0)] {
        let texture = texture(Encoding::Linear, wrap, Channel::Colour);
        assert_eq!(texture.at(vec2(1.75, 0.75)).to_array()[0], expected, "{wrap:?}");
    }
}

#[test]
fn bad_images_are_told() {
    let truncated = &png()[..40];
    for (bytes, expected) in
        [(&b"no image"[..], "it cannot be read as an image"), (truncated, "it cannot be read as an image")]
    {
        let message = Image::decode(bytes, None, Encoding::Srgb).unwrap_err();
        assert!(message.starts_with(expected), "{message}");
    }
    let mut jpeg = Vec::new();
    let noisy = image::RgbImage::from_fn(64, 64, |x, y| image::Rgb([(x * y) as u8, (x * 7) as u8, (y * 31) as u8]));
    noisy.write_to(&mut Cursor::new(&mut jpeg), image::ImageFormat::Jpeg).unwrap();
    assert!(!Image::decode(&jpeg, None, Encoding::Srgb).unwrap().has_alpha());
    let half = &jpeg[..jpeg.len() * 2 / 3];
    assert!(Image::decode(half, None, Encoding::Srgb).unwrap_err().contains("give a whole JPEG"));
    let mut enormous = Vec::new();
    let row = image::GrayImage::new(MAX_SIDE + 1, 1);
    row.write_to(&mut Cursor::new(&mut enormous), image::ImageFormat::Png).unwrap();
    assert!(Image::decode(&enormous, None, Encoding::Srgb).unwrap_err().contains("32769x1 texels; make it at most"));
    let hdr = image::Rgb32FImage::from_pixel(2, 1, image::Rgb([0.5, 2.0, 1.0]));
    let mut bytes = Vec::new();
    hdr.write_to(&mut Cursor::new(&mut bytes), image::ImageFormat::Hdr).unwrap();
    assert!(Image::decode(&bytes, Some(Encoding::Srgb), Encoding::Srgb).unwrap_err().contains("linear"));
    let image = Image::decode(&bytes, None, Encoding::Srgb).unwrap();
    assert!((image.high[1] - 2.0).abs() < 0.02, "{:?}", image.high);
}
