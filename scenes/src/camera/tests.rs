use super::*;
use crate::test_support::Random;
use glam::dvec3;
use sampling::{vec2, vec3};

fn settings(width: u32, height: u32) -> CameraSettings {
    CameraSettings {
        position: dvec3(1.0, 2.0, 3.0),
        target: dvec3(0.5, 1.0, -2.0),
        up: DVec3::Y,
        fov: 50.0,
        width,
        height,
        filter: sampling::filter::Filter::Box,
    }
}

fn camera(width: u32, height: u32) -> Camera {
    Camera::new(&settings(width, height), DVec3::ZERO).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn importance_is_normalised_over_the_film() {
    for (width, height) in [(64, 64), (100, 40), (30, 90)] {
        let camera = camera(width, height);
        let mut random = Random::new(1);
        // ∫ We cosθ dω by uniform directions in the hemisphere around the view; 5 standard errors.
        let (mut sum, mut squares, count) = (0.0f64, 0.0f64, 400_000);
        let at = SurfacePoint::free(camera.position());
        let forward = camera.sample_we(vec2(width as f32, height as f32) * 0.5, Vec2::ZERO).ray.d;
        for _ in 0..count {
            let mut d = random.direction();
            if d.dot(forward) < 0.0 {
                d = -d;
            }
            let value =
                camera.we(&at, d).map_or(0.0, |(we, _)| f64::from(we * d.dot(forward)) * 2.0 * std::f64::consts::PI);
            sum += value;
            squares += value * value;
        }
        let mean = sum / f64::from(count);
        let error = ((squares / f64::from(count) - mean * mean) / f64::from(count)).sqrt();
        assert!((mean - 1.0).abs() < 5.0 * error, "{width}x{height}: {mean} ± {error}");
    }
}

#[test]
fn what_is_sampled_is_what_is_evaluated() {
    for (width, height) in [(64, 64), (100, 40), (30, 90)] {
        let camera = camera(width, height);
        let mut random = Random::new(2);
        for _ in 0..10_000 {
            let raster = random.next_2d() * vec2(width as f32 - 1e-3, height as f32 - 1e-3) + 5e-4;
            let sample = camera.sample_we(raster, Vec2::ZERO);
            let (we, back) = camera.we(&sample.at, sample.ray.d).expect("it is on the film");
            assert!((back - raster).length() < 1e-3, "{back} {raster}");
            let (pdf_p, pdf_d) = camera.pdf_we(&sample.at, sample.ray.d);
            assert!(pdf_p == sample.pdf_p && (pdf_d / sample.pdf_d - 1.0).abs() < 1e-5);
            // We·cosθ / (pdf_p·pdf_d) is the weight.
            let center = camera.sample_we(vec2(width as f32, height as f32) * 0.5, Vec2::ZERO).ray.d;
            assert!((we * center.dot(sample.ray.d) / (pdf_p * pdf_d) - sample.weight).abs() < 1e-4);

            let p = sample.ray.at(0.5 + 3.0 * random.next_1d());
            let connection = camera.sample_wi(p, Vec2::ZERO).expect("it is seen");
            assert!((connection.raster - raster).length() < 2e-3);
            assert!((connection.we / we - 1.0).abs() < 1e-4);
            assert!((connection.wi + sample.ray.d).length() < 1e-5);
            let (distance2, cos) = (p.distance_squared(connection.at.p), center.dot(sample.ray.d));
            assert!((connection.pdf * cos / distance2 - 1.0).abs() < 1e-4);
        }
    }
}

#[test]
fn the_image_is_upright_and_not_mirrored() {
    let settings = CameraSettings { position: dvec3(0.0, 0.0, 5.0), target: DVec3::ZERO, ..settings(200, 100) };
    let camera = Camera::new(&settings, DVec3::ZERO).unwrap_or_else(|error| panic!("{error}"));
    let seen = |p: Vec3| camera.sample_wi(p, Vec2::ZERO).map(|sample| sample.raster);
    let middle = seen(Vec3::ZERO).expect("the target is seen");
    assert!((middle - vec2(100.0, 50.0)).length() < 1e-3);
    assert!(seen(vec3(1.0, 0.0, 0.0)).expect("seen").x > 101.0, "+x is to the right");
    assert!(seen(vec3(0.0, 1.0, 0.0)).expect("seen").y < 49.0, "+y is up");
    // The field of view spans the shorter side.
    let edge = 5.0 * 25f32.to_radians().tan();
    assert!(seen(vec3(0.0, edge * 0.999, 0.0)).is_some() && seen(vec3(0.0, edge * 1.001, 0.0)).is_none());
    assert!(seen(vec3(1.99 * edge, 0.0, 0.0)).is_some() && seen(vec3(2.01 * edge, 0.0, 0.0)).is_none());
    assert!(seen(vec3(0.0, 0.0, 6.0)).is_none(), "behind the camera");
}

#[test]
fn the_raster_is_half_open() {
    let camera = camera(64, 48);
    let at = SurfacePoint::free(camera.position());
    let through = |x: f32, y: f32| camera.we(&at, camera.sample_we(vec2(x, y), Vec2::ZERO).ray.d);
    for (x, y, on) in
        [(-0.01, 5.0, false), (0.01, 5.0, true), (63.99, 5.0, true), (64.01, 5.0, false), (5.0, 48.01, false)]
    {
        assert_eq!(through(x, y).is_some(), on, "{x}, {y}");
    }
}

#[test]
fn a_size_that_is_set_keeps_the_field_of_view() {
    let mut camera = camera(64, 64);
    camera.set_size(200, 100);
    assert_eq!((camera.width(), camera.height()), (200, 100));
    let corner = camera.sample_we(vec2(100.0, 0.0), Vec2::ZERO).ray.d;
    let middle = camera.sample_we(vec2(100.0, 50.0), Vec2::ZERO).ray.d;
    assert!((corner.dot(middle).acos().to_degrees() - 25.0).abs() < 1e-3);
}

#[test]
fn degenerate_settings_are_errors_that_say_so() {
    let bad = |change: fn(&mut CameraSettings), word: &str| {
        let mut settings = settings(64, 64);
        change(&mut settings);
        match Camera::new(&settings, DVec3::ZERO) {
            Ok(_) => panic!("{word} was accepted"),
            Err(error) => assert!(error.to_string().contains(word), "{error}"),
        }
    };
    bad(|s| s.target = s.position, "target");
    bad(|s| s.up = s.target - s.position, "up");
    bad(|s| s.up = DVec3::ZERO, "up");
    bad(|s| s.fov = 0.0, "fov");
    bad(|s| s.fov = 180.0, "fov");
    bad(|s| s.fov = f64::NAN, "fov");
    bad(|s| s.width = 0, "0x64");
    bad(|s| s.position.x = f64::INFINITY, "finite");
}
