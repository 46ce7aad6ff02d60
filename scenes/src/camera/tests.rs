use super::*;
use crate::test_support::Random;
use glam::{DVec2, dvec2, dvec3};
use sampling::{vec2, vec3};
use std::f32::consts::{PI, TAU};

/// How many standard errors two means may differ by: by chance they do so once in two million comparisons.
const FAR: f64 = 5.0;

const PINHOLE: Projection = Projection::Pinhole { fov: 50.0 };
const LENS: Projection = Projection::ThinLens { fov: 50.0, lens_radius: 0.3, focus_distance: Some(2.0) };
const PARALLEL: Projection = Projection::Orthographic { extent: 3.0 };

fn settings(width: u32, height: u32) -> CameraSettings {
    CameraSettings::pinhole(dvec3(1.0, 2.0, 3.0), dvec3(0.5, 1.0, -2.0), 50.0, (width, height))
}

fn built(settings: &CameraSettings) -> Camera {
    Camera::new(settings, DVec3::ZERO).unwrap_or_else(|error| panic!("{error}"))
}

fn camera(width: u32, height: u32) -> Camera {
    built(&settings(width, height))
}

/// Every type of camera, upright and mirrored and shifted, with films of several shapes.
fn all() -> Vec<Camera> {
    let mut cameras = Vec::new();
    for projection in [PINHOLE, LENS, PARALLEL, Projection::Equirectangular] {
        for (width, height) in [(64, 64), (100, 40), (30, 90)] {
            let straight = CameraSettings { projection, ..settings(width, height) };
            cameras.push(built(&straight));
            cameras.push(built(&CameraSettings { mirrored: true, shift: dvec2(0.3, -0.2), ..straight }));
        }
    }
    cameras
}

/// The cosine that importance is weighted by, which a point without a normal has not.
fn cos_at(camera: &Camera, d: Vec3) -> f32 {
    match camera {
        Camera::Equirectangular(_) => 1.0,
        _ => camera.view().forward.dot(d),
    }
}

/// Mean and squared standard error.
fn estimate(count: u32, mut value: impl FnMut() -> f64) -> (f64, f64) {
    let (mut sum, mut squares, n) = (0.0, 0.0, f64::from(count));
    for _ in 0..count {
        let x = value();
        sum += x;
        squares += x * x;
    }
    (sum / n, (squares / n - (sum / n).powi(2)) / n)
}

/// By the midpoint rule over the sphere, which meets the film's border obliquely, and the poles of longitude and latitude.
#[test]
fn densities_of_directions_integrate_to_one_over_the_film() {
    const ROWS: usize = 1500;
    for camera in all().iter().filter(|camera| camera.rays() != Rays::Parallel) {
        let at = camera.sample_we(Vec2::ZERO, vec2(0.7, 0.2)).at;
        let (mut densities, mut importance) = (0.0, 0.0);
        for row in 0..ROWS {
            let z = 1.0 - (2 * row + 1) as f32 / ROWS as f32;
            for column in 0..ROWS {
                let (sin, cos) = (TAU * (column as f32 + 0.5) / ROWS as f32).sin_cos();
                let d = vec3(cos, sin, 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z;
                let (pdf_p, pdf_d) = camera.pdf_we(&at, d);
                let we = camera.we(&at, d).map_or(0.0, |(we, _)| we * cos_at(camera, d));
                densities += f64::from(pdf_d);
                importance += f64::from(we / pdf_p);
            }
        }
        let cell = f64::from(4.0 * PI) / (ROWS * ROWS) as f64;
        for integral in [densities * cell, importance * cell] {
            assert!((integral - 1.0).abs() < 3e-3, "{camera}: {integral}");
        }
    }
}

#[test]
fn what_is_sampled_is_what_is_evaluated() {
    for camera in all() {
        let (size, mut random) = (camera.raster().size(), Random::new(2));
        for _ in 0..5_000 {
            let raster = random.next_2d() * (size - 1e-3) + 5e-4;
            let sample = camera.sample_we(raster, random.next_2d());
            assert!((sample.ray.d.length() - 1.0).abs() < 1e-5 && sample.ray.o == sample.at.p && sample.weight == 1.0);
            let (pdf_p, pdf_d) = camera.pdf_we(&sample.at, sample.ray.d);
            assert!((pdf_p / sample.pdf_p - 1.0).abs() < 1e-5 && (pdf_d / sample.pdf_d - 1.0).abs() < 2e-3, "{camera}");
            if camera.rays() == Rays::Parallel {
                assert!(camera.we(&sample.at, sample.ray.d).is_none());
                continue;
            }
            let (we, back) = camera.we(&sample.at, sample.ray.d).expect("it is on the film");
            // Near a pole a place on the sphere is many longitudes.
            let slack = 2e-3 / camera_cos(&camera, sample.ray.d);
            assert!((back - raster).length() < slack, "{camera}: {back} {raster}");
            let weight = we * cos_at(&camera, sample.ray.d) / (pdf_p * pdf_d);
            assert!((weight - sample.weight).abs() < 1e-4, "{camera}: {weight}");
        }
    }
}

/// What rounding of a direction is magnified by.
fn camera_cos(camera: &Camera, d: Vec3) -> f32 {
    match camera {
        Camera::Equirectangular(camera) => (1.0 - d.dot(camera.view.up).powi(2)).max(1e-7).sqrt(),
        _ => 1.0,
    }
}

#[test]
fn connections_lead_back_along_the_rays() {
    for camera in all() {
        let (size, mut random) = (camera.raster().size(), Random::new(3));
        for _ in 0..5_000 {
            let raster = random.next_2d() * (size - 1e-3) + 5e-4;
            let u = random.next_2d();
            let sample = camera.sample_we(raster, u);
            let p = sample.ray.at(0.5 + 3.0 * random.next_1d());
            let connection = camera.sample_wi(p, u).expect("it is seen");
            let slack = 4e-3 / camera_cos(&camera, sample.ray.d);
            assert!((connection.raster - raster).length() < slack, "{camera}: {} {raster}", connection.raster);
            assert!((connection.wi + sample.ray.d).length() < 1e-5);
            assert!(connection.at.p.distance(sample.at.p) < 1e-5, "the same random numbers are the same point");
            let (distance2, cos) = (p.distance_squared(connection.at.p), cos_at(&camera, sample.ray.d));
            let pdf = match camera.rays() {
                Rays::Parallel => 1.0,
                Rays::FromPoint => distance2 / cos,
                Rays::FromLens => distance2 / cos * sample.pdf_p,
            };
            assert!((connection.pdf / pdf - 1.0).abs() < 1e-4);
            let we = match camera.rays() {
                Rays::Parallel => sample.pdf_d,
                Rays::FromPoint | Rays::FromLens => camera.we(&sample.at, sample.ray.d).expect("on the film").0,
            };
            assert!((connection.we / we - 1.0).abs() < 3e-3, "{camera}: {} {we}", connection.we);
        }
    }
}

/// What a shining patch brings, weighted by where on the film it lands: by rays from the camera, and by connections from the patch.
#[test]
fn rays_and_connections_measure_the_same() {
    const COUNT: u32 = 200_000;
    for camera in all() {
        let (view, size, mut random) = (camera.view(), camera.raster().size(), Random::new(4));
        let corner = view.position + view.forward * 0.9 - view.right * 0.3 + view.up * 0.1;
        let (u, v) = (view.right * 0.5 + view.forward * 0.4, view.up * 0.6 - view.forward * 0.2);
        let (area, normal) = (u.cross(v).length(), u.cross(v).normalize());
        let test = |raster: Vec2| f64::from((1.0 + raster.x / size.x) * (0.3 + (raster.y / size.y).powi(2)));

        let by_rays = estimate(COUNT, || {
            let raster = random.next_2d() * size;
            let ray = camera.sample_we(raster, random.next_2d()).ray;
            let t = (corner - ray.o).dot(normal) / ray.d.dot(normal);
            let across = (ray.at(t) - corner).cross(normal);
            let (a, b) = (across.dot(v) / u.cross(normal).dot(v), across.dot(u) / v.cross(normal).dot(u));
            let hit = t > 0.0 && (0.0..1.0).contains(&a) && (0.0..1.0).contains(&b);
            if hit { test(raster) } else { 0.0 }
        });
        let by_connections = estimate(COUNT, || {
            let place = random.next_2d();
            let Some(seen) = camera.sample_wi(corner + u * place.x + v * place.y, random.next_2d()) else { return 0.0 };
            test(seen.raster) * f64::from(area * seen.we * seen.wi.dot(normal).abs() / seen.pdf)
        });
        let ((a, error_a), (b, error_b)) = (by_rays, by_connections);
        let z = (a - b) / (error_a + error_b).sqrt();
        assert!(a > 0.0 && z.abs() < FAR, "{camera}: {a} by rays, {b} by connections, {z} standard errors");
    }
}

#[test]
fn images_are_upright_and_mirrored_only_if_asked() {
    for projection in [PINHOLE, LENS, PARALLEL, Projection::Equirectangular] {
        let look = |mirrored: bool, shift: DVec2, p: Vec3| {
            let (position, target) = (dvec3(0.0, 0.0, 2.0), DVec3::ZERO);
            let camera = built(&CameraSettings { position, target, projection, mirrored, shift, ..settings(200, 100) });
            camera.sample_wi(p, vec2(0.3, 0.6)).expect("it is seen").raster
        };
        let seen = |p: Vec3| look(false, DVec2::ZERO, p);
        assert!((seen(Vec3::ZERO) - vec2(100.0, 50.0)).length() < 1e-3);
        let (right, above) = (vec3(0.4, 0.0, 0.0), vec3(0.0, 0.4, 0.0));
        assert!(seen(right).x > 101.0 && seen(above).y < 49.0, "+x is to the right, +y is up");
        let mirrored = look(true, DVec2::ZERO, right);
        assert!(mirrored.distance(vec2(200.0 - seen(right).x, 50.0)) < 1e-3);
        if projection == Projection::Equirectangular {
            continue;
        }
        // A window that moves to the right and up sees the same things farther to the left and down, mirrored or not.
        let moved = look(false, dvec2(0.1, 0.2), right) - seen(right);
        assert!(moved.distance(vec2(-20.0, 20.0)) < 1e-3, "{moved}");
        assert!((look(true, dvec2(0.1, 0.2), right) - mirrored).distance(vec2(-20.0, 20.0)) < 1e-3);
    }
}

#[test]
fn fields_of_view_and_extents_span_the_shorter_side() {
    let at = |projection: Projection| CameraSettings {
        position: dvec3(0.0, 0.0, 5.0),
        target: DVec3::ZERO,
        projection,
        ..settings(200, 100)
    };
    let seen = |projection, p: Vec3| built(&at(projection)).sample_wi(p, vec2(0.5, 0.5)).map(|seen| seen.raster);
    let half = 5.0 * (25.0f32).to_radians().tan();
    for (projection, half) in [(PINHOLE, half), (PARALLEL, 1.5)] {
        assert!((seen(projection, vec3(0.0, half, 0.0) * 0.9999).expect("seen").y).abs() < 1e-2);
        assert!(seen(projection, vec3(0.0, half, 0.0) * 1.001).is_none() && seen(projection, Vec3::Z * 6.0).is_none());
    }
    let all_around = |p: Vec3| seen(Projection::Equirectangular, vec3(0.0, 0.0, 5.0) + p).expect("all is seen");
    assert!(all_around(Vec3::X).distance(vec2(150.0, 50.0)) < 1e-3, "a quarter turn to the right");
    assert!(all_around(Vec3::Y).y < 1e-3 && all_around(-Vec3::Y).y > 99.99);
    assert!([0.0, 200.0].iter().any(|x| (all_around(Vec3::Z).x - x).abs() < 1e-2), "behind");
}

#[test]
fn all_of_the_lens_sees_the_plane_of_focus_alike() {
    let camera = built(&CameraSettings { projection: LENS, ..settings(64, 48) });
    let pinhole = camera_of(PINHOLE);
    let mut random = Random::new(5);
    for _ in 0..1000 {
        let raster = random.next_2d() * vec2(64.0, 48.0);
        let [a, b] = [0, 1].map(|_| camera.sample_we(raster, random.next_2d()).ray);
        let forward = camera.view().forward;
        let focus = |ray: Ray| ray.at((2.0 - (ray.o - camera.position()).dot(forward)) / ray.d.dot(forward));
        assert!(focus(a).distance(focus(b)) < 1e-4 && a.o != b.o);
        assert!(focus(a).distance(focus(pinhole.sample_we(raster, Vec2::ZERO).ray)) < 1e-4);
        assert!(a.o.distance(camera.position()) <= 0.3001 && (a.o - camera.position()).dot(forward).abs() < 1e-5);
    }
    fn camera_of(projection: Projection) -> Camera {
        built(&CameraSettings { projection, ..settings(64, 48) })
    }
    // Where no distance is given, the target is in focus.
    let at_target = Projection::ThinLens { fov: 50.0, lens_radius: 0.3, focus_distance: None };
    let Camera::ThinLens(lens) = camera_of(at_target) else { panic!("no lens") };
    assert!((lens.focus_distance - vec3(0.5, 1.0, 5.0).length()).abs() < 1e-5);
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

/// Beyond the border of longitudes and latitudes lie the places that are the same on the sphere.
#[test]
fn places_around_a_sphere_have_images_within_the_reach_of_filters() {
    for (width, height) in [(16, 8), (5, 3), (2, 1)] {
        let filter = Filter::Gaussian;
        let settings = CameraSettings { projection: Projection::Equirectangular, filter, ..settings(width, height) };
        let camera = built(&settings);
        let (raster, mut random) = (camera.raster(), Random::new(6));
        for _ in 0..500 {
            // Any place that a filter reaches is the image of a place of the raster.
            let beyond = random.next_2d() * (raster.size() + 2.0 * filter.radius() - 1.0) - filter.radius() + 0.5;
            let d = camera.sample_we(beyond, Vec2::ZERO).ray.d;
            let (_, on) = camera.we(&SurfacePoint::free(camera.position()), d).expect("all is seen");
            assert!(on.x >= 0.0 && on.y >= 0.0 && on.x < raster.size().x && on.y < raster.size().y, "{on}");
            let slack = 1e-4 * raster.size().x / camera_cos(&camera, d);
            let images: Vec<Vec2> = raster.images(on).collect();
            let near = images.iter().filter(|image| image.distance(beyond) < slack).count();
            assert!(near >= 1, "{width}x{height}: {beyond} is not among {images:?}");
            for image in images.iter().filter(|image| image.distance(on) > 0.0) {
                let same = camera.sample_we(*image, Vec2::ZERO).ray.d;
                assert!(same.distance(d) < 1e-4, "{on} {image}: {same} {d}");
                assert!(images.iter().filter(|other| other.distance(*image) < 1e-3).count() == 1, "{image} twice");
            }
        }
        let border = Raster::new(width, height, filter, Edges::Border);
        assert_eq!(border.images(vec2(0.2, 0.1)).collect::<Vec<_>>(), [vec2(0.2, 0.1)]);
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
    for mut camera in all() {
        let before = camera.name();
        camera.set_size(7, 5);
        camera.set_filter(Filter::Mitchell);
        assert_eq!((camera.width(), camera.height(), camera.filter(), camera.name()), (7, 5, Filter::Mitchell, before));
    }
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
    for fov in [0.0, 180.0, f64::NAN] {
        let mut settings = settings(64, 64);
        settings.projection = Projection::Pinhole { fov };
        assert!(Camera::new(&settings, DVec3::ZERO).is_err_and(|error| error.to_string().contains("fov")));
    }
    bad(|s| s.width = 0, "0x64");
    bad(|s| s.position.x = f64::INFINITY, "finite");
    bad(|s| s.shift.x = f64::NAN, "shift");
    bad(|s| s.projection = Projection::Orthographic { extent: 0.0 }, "extent");
    let lens = |lens_radius, focus_distance| Projection::ThinLens { fov: 40.0, lens_radius, focus_distance };
    for (projection, word) in [(lens(0.0, None), "lens_radius"), (lens(0.1, Some(-1.0)), "focus_distance")] {
        let settings = CameraSettings { projection, ..settings(64, 64) };
        assert!(Camera::new(&settings, DVec3::ZERO).is_err_and(|error| error.to_string().contains(word)));
    }
}

#[test]
fn crops_lie_within_the_image() {
    let fault = |x, y, width, height| Crop { x, y, width, height }.fault(20, 10);
    assert_eq!(fault(0, 0, 20, 10), None);
    assert_eq!(fault(19, 9, 1, 1), None);
    for (x, y, width, height) in [(0, 0, 0, 3), (1, 0, 20, 1), (0, 9, 1, 2), (u32::MAX, 0, 2, 1)] {
        assert!(fault(x, y, width, height).is_some(), "{x} {y} {width} {height}");
    }
}
