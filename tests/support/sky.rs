//! A sky for tests.

use glam::{DMat3, DQuat, dvec3};
use sampling::math::Spectrum;
use scenes::texture::Image;
use scenes::{EnvironmentImage, Mapping};
use std::sync::Arc;

/// A coloured sky of about radiance 1 with a spot of `sun` in one texel, seen from the room in front and above; turned, and black
/// in some of its texels.
pub fn sky(mapping: Mapping, sun: f32) -> EnvironmentImage {
    let (width, height) = if mapping == Mapping::EqualArea { (16, 16) } else { (24, 12) };
    let rotation = DMat3::from_quat(DQuat::from_axis_angle(dvec3(0.3, 1.0, -0.2).normalize(), 0.7));
    // Into the room and down on the floor: the front of the room looks along +z.
    let towards = rotation.transpose() * dvec3(0.25, 0.55, 1.0).normalize();
    let at = mapping.place(towards.as_vec3());
    let (sun_column, sun_row) = ((at.x * width as f32) as u32, (at.y * height as f32) as u32);
    let texels = (0..height).flat_map(|row| (0..width).map(move |column| (column, row))).map(|(column, row)| {
        if (column, row) == (sun_column, sun_row) {
            return [sun, 0.9 * sun, 0.8 * sun, 1.0];
        }
        let wave = 1.0 + 0.6 * (column as f32 * 1.3).sin() + 0.3 * (row as f32 * 2.1).cos();
        let dark = (column + 2 * row) % 7 == 0;
        if dark { [0.0, 0.0, 0.0, 1.0] } else { [wave, 0.8, 2.0 - wave, 1.0].map(|x: f32| x.max(0.0)) }
    });
    let image = Arc::new(Image::from_linear(width, height, texels.collect()).unwrap());
    EnvironmentImage { image, mapping, scale: Spectrum::splat(0.8), rotation }
}
