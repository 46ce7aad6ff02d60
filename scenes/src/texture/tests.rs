use super::*;
use crate::test_support::ramp_z;
use sampling::vec3;

fn at(texture: &Texture, p: Vec3, uv: Vec2) -> f32 {
    texture.at(&SurfaceCoordinates { p, uv, colour: Spectrum::splat(0.25) }).mean()
}

#[test]
fn a_ramp_is_linear_and_bounded_by_its_range() {
    let ramp = ramp_z(Spectrum::splat(0.5), Spectrum::splat(0.4));
    assert!((at(&ramp, vec3(9.0, 9.0, 0.5), Vec2::ZERO) - 0.7).abs() < 1e-6);
    let (low, high) = ramp.range_around(Vec3::ZERO, |axis| axis.length());
    assert!((low - 0.1).abs() < 1e-6 && (high - 0.9).abs() < 1e-6);
}

#[test]
fn recentring_moves_ramps_and_noise_with_the_scene() {
    let noise =
        Noise { low: Spectrum::ZERO, high: Spectrum::ONE, size: 0.3, octaves: 3, seed: 1, origin: glam::DVec3::ZERO };
    for texture in [ramp_z(Spectrum::ZERO, Spectrum::ONE), Texture::Noise(noise)] {
        let moved = texture.clone().recentred(glam::dvec3(0.0, 0.0, 5.0));
        let p = vec3(0.1, 0.2, 2.0);
        assert!((at(&texture, p + vec3(0.0, 0.0, 5.0), Vec2::ZERO) - at(&moved, p, Vec2::ZERO)).abs() < 1e-5);
    }
}

#[test]
fn a_checkerboard_alternates_on_both_sides_of_the_origin() {
    let values = [Spectrum::ZERO, Spectrum::ONE];
    let board = Texture::Checkerboard { values, map: UvMap { scale: Vec2::splat(2.0), ..UvMap::default() } };
    for (u, v, expected) in [(0.1, 0.1, 0.0), (0.3, 0.1, 1.0), (0.3, 0.3, 0.0), (-0.1, 0.1, 1.0), (-0.1, -0.1, 0.0)] {
        assert_eq!(at(&board, Vec3::ZERO, vec2(u, v)), expected, "{u} {v}");
    }
    assert_eq!(at(&Texture::VertexColour, Vec3::ZERO, Vec2::ZERO), 0.25);
}

#[test]
fn noise_is_smooth_bounded_and_of_both_signs() {
    for octaves in [1, 4] {
        let noise =
            Noise { low: Spectrum::ZERO, high: Spectrum::ONE, size: 0.5, octaves, seed: 7, origin: glam::DVec3::ZERO };
        let mut sum = 0.0;
        let (mut low, mut high) = (1.0f32, 0.0f32);
        for i in 0..100_000 {
            let p = vec3((i % 317) as f32, (i % 1009) as f32, (i % 97) as f32) * 0.0371 - 5.0;
            let value = noise.at(p).mean();
            assert!((0.0..=1.0).contains(&value), "{p}: {value}");
            let near = noise.at(p + vec3(1e-4, -1e-4, 1e-4)).mean();
            assert!((value - near).abs() < 0.01, "{p}: {value} {near}");
            (sum, low, high) = (sum + f64::from(value), low.min(value), high.max(value));
        }
        let mean = sum / 100_000.0;
        assert!((mean - 0.5).abs() < 0.02 && low < 0.3 && high > 0.7, "{mean} {low} {high}");
    }
}
