//! Spots, directional emitters and environments with images.

use super::{ID, Mean, agree};
use crate::builder::{EnvironmentImage, SceneBuilder};
use crate::emitter::{Emitter, EndpointKind, Falloff, Mapping, Spot};
use crate::needs::Skip;
use crate::ray::Ray;
use crate::scene::Scene;
use crate::test_support::{Random, built, grey_builder};
use crate::texture::Image;
use glam::{DMat3, DQuat, DVec3, dvec3};
use sampling::math::Spectrum;
use sampling::{Vec3, vec2, vec3};
use std::f64::consts::PI;
use std::sync::Arc;

/// An environment of texels `grey(column, row)`.
pub(super) fn sky(
    size: (u32, u32),
    mapping: Mapping,
    rotation: DMat3,
    grey: impl Fn(u32, u32) -> f32,
) -> EnvironmentImage {
    let texels = (0..size.1).flat_map(|row| (0..size.0).map(move |column| (column, row)));
    let texels = texels.map(|(column, row)| [grey(column, row), 0.5 * grey(column, row), 0.1, 1.0]).collect();
    let image = Arc::new(Image::from_linear(size.0, size.1, texels).expect("a good image"));
    EnvironmentImage { image, mapping, scale: Spectrum::new(2.0, 1.0, 3.0), rotation }
}

fn turned() -> DMat3 {
    DMat3::from_quat(DQuat::from_axis_angle(dvec3(1.0, 2.0, -0.5).normalize(), 1.1))
}

/// A ball and a plate under what `add` adds.
fn scene(name: &str, add: impl FnOnce(&mut SceneBuilder)) -> Scene {
    let (mut builder, grey) = grey_builder(name);
    builder.sphere(dvec3(0.5, 0.2, 0.0), 0.4, grey);
    builder.quad(dvec3(-1.0, -0.8, -1.0), dvec3(0.0, 0.0, 2.0), dvec3(2.0, 0.0, 0.0), grey);
    add(&mut builder);
    built(builder, Skip::Unneeded)
}

/// Images of both mappings: smooth, with a sun, half black, of few texels, turned and mirrored.
fn skies() -> Vec<(&'static str, EnvironmentImage)> {
    let smooth = |column: u32, row: u32| 1.0 + 0.5 * (column as f32).sin() + 0.4 * (row as f32 * 0.7).cos();
    let sun = |column: u32, row: u32| if (column, row) == (5, 2) { 1e5 } else { 1.0 };
    let half = |column: u32, _: u32| if column < 4 { 0.0 } else { 2.0 };
    let mirrored = turned() * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
    let (round, square) = (Mapping::Equirectangular, Mapping::EqualArea);
    vec![
        ("smooth", sky((16, 8), round, DMat3::IDENTITY, smooth)),
        ("sun, turned", sky((32, 16), round, turned(), sun)),
        ("half black, mirrored", sky((8, 6), round, mirrored, half)),
        ("one texel", sky((1, 1), round, DMat3::IDENTITY, |_, _| 2.0)),
        ("smooth, to the poles", sky((16, 8), Mapping::EquirectangularToPoles, turned(), smooth)),
        ("one texel, to the poles", sky((1, 1), Mapping::EquirectangularToPoles, DMat3::IDENTITY, |_, _| 2.0)),
        ("smooth square", sky((9, 9), square, turned(), smooth)),
        ("square with a sun", sky((16, 16), square, mirrored, sun)),
        ("half black square", sky((8, 8), square, DMat3::IDENTITY, half)),
        ("square of one texel", sky((1, 1), square, DMat3::IDENTITY, |_, _| 2.0)),
    ]
}

#[test]
fn mappings_have_their_landmarks() {
    let round = Mapping::Equirectangular;
    for (place, d) in [
        ((0.0, 0.5), -Vec3::Z),
        ((0.25, 0.5), Vec3::X),
        ((0.5, 0.5), Vec3::Z),
        ((0.75, 0.5), -Vec3::X),
        ((0.5, 0.0), Vec3::Y),
        ((0.5, 1.0), -Vec3::Y),
    ] {
        assert!(round.direction(vec2(place.0, place.1)).distance(d) < 1e-6, "{place:?}");
    }
    let square = Mapping::EqualArea;
    for (place, d) in [
        ((0.5, 0.5), Vec3::Z),
        ((1.0, 0.5), Vec3::X),
        ((0.0, 0.5), -Vec3::X),
        ((0.5, 1.0), Vec3::Y),
        ((0.5, 0.0), -Vec3::Y),
        ((0.0, 0.0), -Vec3::Z),
        ((1.0, 1.0), -Vec3::Z),
    ] {
        assert!(square.direction(vec2(place.0, place.1)).distance(d) < 1e-6, "{place:?}");
    }
}

#[test]
fn mappings_are_undone_by_their_inverse() {
    let mut random = Random::new(80);
    for mapping in Mapping::ALL {
        for _ in 0..100_000 {
            let d = random.direction();
            let place = mapping.place(d);
            assert!(place.min_element() >= 0.0 && place.max_element() <= 1.0, "{mapping:?} {d}: {place}");
            let back = mapping.direction(place);
            assert!(back.distance(d) < 2e-6, "{mapping:?} {d}: {place}, {back}");
        }
        for d in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis, -axis]) {
            assert!(mapping.direction(mapping.place(d)).distance(d) < 1e-6, "{mapping:?} {d}");
        }
    }
}

/// Moments of the directions over a fine grid are those of the uniform sphere.
#[test]
fn the_square_has_equal_areas() {
    let n = 512;
    let mut moments = [0.0_f64; 6];
    for i in 0..n * n {
        let place = (vec2((i % n) as f32, (i / n) as f32) + 0.5) / n as f32;
        let [x, y, z] = Mapping::EqualArea.direction(place).to_array().map(f64::from);
        let values = [x * x, y * y, x.abs(), z.abs(), (x * y).abs(), z * z * z * z];
        moments.iter_mut().zip(values).for_each(|(sum, value)| *sum += value / (n * n) as f64);
    }
    let exact = [1.0 / 3.0, 1.0 / 3.0, 0.5, 0.5, 2.0 / (3.0 * PI), 0.2];
    for (moment, exact) in moments.iter().zip(exact) {
        assert!((moment - exact).abs() < 1e-4, "{moments:?}");
    }
}

#[test]
fn the_light_of_a_texel_comes_from_where_it_stands() {
    for (name, image) in skies() {
        let scene = scene(name, |builder| builder.environment_image(image.clone()));
        let (width, height) = image.image.size();
        for index in 0..(width * height) as usize {
            let at = vec2((index as u32 % width) as f32, (index as u32 / width) as f32) + 0.5;
            let row = (at.y - 0.5) / (height - 1).max(1) as f32;
            let place = match image.mapping {
                Mapping::EquirectangularToPoles => vec2(at.x / width as f32, row),
                _ => at / vec2(width as f32, height as f32),
            };
            if image.mapping == Mapping::EquirectangularToPoles && matches!(row, 0.0 | 1.0) {
                // All columns meet at a pole.
                continue;
            }
            let d = image.mapping.direction(place);
            let d = (image.rotation * d.as_dvec3()).as_vec3();
            let texel = image.image.texel(index);
            let expected = Spectrum::new(texel[0], texel[1], texel[2]) * image.scale;
            let off = (scene.environment_le(d) - expected).abs().max_component();
            // Beside a sun, what rounding takes of it counts.
            assert!(off <= 2e-5 * image.image.range().1[0], "{name} texel {index}: off by {off}");
        }
    }
}

/// Across the borders of the square and its corners too.
#[test]
fn an_octahedral_sky_has_no_seams() {
    let mut random = Random::new(81);
    let image = sky((8, 8), Mapping::EqualArea, DMat3::IDENTITY, |column, row| ((column * 5 + row * 3) % 7) as f32);
    let scene = scene("square", |builder| builder.environment_image(image));
    for i in 0..200_000 {
        let d = if i % 2 == 0 { random.direction() } else { (random.direction() * 0.01 - Vec3::Z).normalize() };
        let near = (d + random.direction() * 1e-4).normalize();
        let step = (scene.environment_le(d) - scene.environment_le(near)).abs().max_component();
        // At most 12 from texel to texel, of which there are 8 over 2, with room for what the mapping stretches.
        assert!(step < 12.0 * 8.0 * 4.0 * 1e-4, "{d} and {near}: {step}");
    }
}

/// Five standard errors, six comparisons for each of ten skies: a false alarm in 30 000.
#[test]
fn images_are_sampled_with_their_density() {
    for (name, image) in skies() {
        let scene = scene(name, |builder| builder.environment_image(image));
        let mut random = Random::new(82);
        let whole = 4.0 * PI;
        let uniform = Mean::of(400_000, || {
            let d = random.direction();
            let (le, pdf) = (scene.environment_le(d), pdf_li(&scene, d));
            assert!(pdf > 0.0 || le.is_zero(), "{name} {d}: {le:?} is never sampled");
            whole * f64::from(pdf)
        });
        agree(&format!("{name}: density"), &uniform, &Mean { sum: 1.0, squares: 1.0, count: 1.0 });
        let light = Mean::of(400_000, || whole * f64::from(scene.environment_le(random.direction()).mean()));
        let mut differing = 0;
        let sampled = Mean::of(100_000, || {
            let sample = scene.sample_li(ID, Vec3::ZERO, random.next_2d()).expect("it is everywhere");
            assert!((sample.wi.length() - 1.0).abs() < 1e-5 && sample.pdf > 0.0 && !sample.delta);
            differing += u32::from((sample.pdf / pdf_li(&scene, sample.wi) - 1.0).abs() > 1e-5);
            f64::from(sample.li.mean() / sample.pdf)
        });
        // Rounding may take a direction across the edge of a texel.
        assert!(differing < 100, "{name}: {differing} densities differ");
        agree(&format!("{name}: light"), &sampled, &light);
        let disc = PI * f64::from(scene.bounds.radius).powi(2);
        let power = scene.emitters[0].power() / disc;
        agree(&format!("{name}: power"), &sampled, &Mean { sum: power, squares: power * power, count: 1.0 });
    }
}

fn pdf_li(scene: &Scene, d: Vec3) -> f32 {
    scene.pdf_li(ID, Vec3::ZERO, &scene.environment_endpoint(d), d)
}

/// Counts in 256 equal solid angles, each within 5.5 standard deviations of what the density says, up to the error of its
/// quadrature: a false alarm in 10 000 for all ten skies.
#[test]
fn samples_of_images_fall_where_their_density_says() {
    const SIDE: usize = 16;
    const FINE: usize = 64;
    let cell = |d: Vec3| {
        let place = (Mapping::EqualArea.place(d) * SIDE as f32).min(vec2(15.0, 15.0));
        place.y as usize * SIDE + place.x as usize
    };
    for (name, image) in skies() {
        let scene = scene(name, |builder| builder.environment_image(image));
        let n = 200_000;
        let mut expected = vec![0.0_f64; SIDE * SIDE];
        let fine = SIDE * FINE;
        for i in 0..fine * fine {
            let place = (vec2((i % fine) as f32, (i / fine) as f32) + 0.5) / fine as f32;
            let d = Mapping::EqualArea.direction(place);
            expected[cell(d)] += f64::from(pdf_li(&scene, d)) * 4.0 * PI / (fine * fine) as f64 * f64::from(n);
        }
        let mut random = Random::new(83);
        let mut counts = vec![0.0; SIDE * SIDE];
        for _ in 0..n {
            counts[cell(scene.sample_li(ID, Vec3::ZERO, random.next_2d()).expect("it is everywhere").wi)] += 1.0;
        }
        for (i, (count, expected)) in counts.iter().zip(&expected).enumerate() {
            let quadrature = expected * 4.0 / FINE as f64 + 1.0;
            let off = f64::abs(count - expected);
            assert!(off <= 5.5 * expected.sqrt() + quadrature, "{name} bin {i}: {count}, expected {expected}");
        }
    }
}

pub(super) fn spots() -> Vec<Spot> {
    let (position, target) = (dvec3(0.3, 2.0, 0.4), dvec3(0.1, 0.0, -0.2));
    let intensity = Spectrum::new(3.0, 2.0, 1.0);
    let mut spots = Vec::new();
    for falloff in Falloff::ALL {
        for (cutoff, beam) in [(40.0, 25.0), (20.0, 20.0), (180.0, 0.0), (100.0, 10.0), (0.05, 0.01)] {
            let [cutoff, beam] = [cutoff, beam].map(f64::to_radians);
            spots.push(Spot { position, target, intensity, cutoff, beam, falloff });
        }
    }
    spots
}

#[test]
fn a_spot_has_the_power_of_its_quadrature() {
    for given in spots() {
        let scene = scene("spot", |builder| builder.spot(given));
        let Emitter::Spot(spot) = scene.emitters[0] else { panic!("not a spot") };
        let frame = sampling::math::Frame::from_z(spot.axis);
        let n = 20_000;
        let step = given.cutoff / f64::from(n);
        let power: f64 = (0..n)
            .map(|i| {
                let (sine, cosine) = (step * (f64::from(i) + 0.5)).sin_cos();
                let d = frame.to_world(vec3(sine as f32, 0.0, cosine as f32));
                f64::from(spot.intensity(d).mean()) * 2.0 * PI * sine * step
            })
            .sum();
        let exact = scene.emitters[0].power();
        assert!((power / exact - 1.0).abs() < 3e-4, "{given:?}: {power} and {exact}");
        let mut random = Random::new(84);
        let flux = Mean::of(100_000, || {
            let walk = scene.sample_le(ID, random.next_2d(), random.next_2d()).expect("it emits");
            let pdf_d = scene.pdf_le(ID, &walk.endpoint, walk.ray.d).1;
            assert!(pdf_d == walk.pdf_d || walk.le.mean() < 0.01 || given.beam == given.cutoff, "{given:?}");
            f64::from(walk.le.mean()) / f64::from(walk.pdf_d)
        });
        agree(&format!("{given:?}"), &flux, &Mean { sum: exact, squares: exact * exact, count: 1.0 });
        assert!(scene.needs.delta_emitters && !scene.needs.hittable_emitters && !scene.needs.environment);
    }
}

#[test]
fn a_spot_is_dark_beyond_its_cutoff() {
    let given = Spot { falloff: Falloff::Linear, ..spots()[0] };
    let scene = scene("spot", |builder| builder.spot(given));
    let axis = (given.target - given.position).normalize();
    let across = axis.any_orthonormal_vector();
    for (degrees, share) in [(0.0, 1.0), (24.9, 1.0), (32.5, 0.5), (36.25, 0.25), (40.1, 0.0), (120.0, 0.0)] {
        let (sine, cosine) = f64::to_radians(degrees).sin_cos();
        let p = (given.position + (axis * cosine + across * sine) * 2.0).as_vec3();
        let li = scene.sample_li(ID, p, vec2(0.5, 0.5)).map_or(0.0, |sample| {
            assert_eq!((sample.pdf, sample.delta, sample.endpoint.kind), (1.0, true, EndpointKind::Point));
            sample.li.to_array()[0]
        });
        assert!((li - 0.75 * share).abs() < 1e-5, "{degrees}: {li}");
    }
}

/// Light walks bring a plate the flux that connections from its points say. Five standard errors: a false alarm in 100 000.
#[test]
fn walks_and_connections_describe_the_same_light() {
    let direction = dvec3(0.3, -1.0, 0.2);
    let mut cases: Vec<(String, Scene)> = vec![(
        "directional".into(),
        scene("directional", |builder| builder.directional_emitter(direction, Spectrum::new(3.0, 2.0, 1.0))),
    )];
    cases.extend(skies().into_iter().map(|(name, image)| (name.into(), scene(name, |b| b.environment_image(image)))));
    let spots = spots().into_iter().filter(|spot| spot.cutoff > 0.1);
    cases.extend(spots.map(|spot| (format!("{spot:?}"), scene("spot", |builder| builder.spot(spot)))));
    for (name, scene) in cases {
        let mut random = Random::new(85);
        let on_plate = |p: Vec3| (p.y + 0.8).abs() < 1e-5;
        let walked = Mean::of(400_000, || {
            let walk = scene.sample_le(ID, random.next_2d(), random.next_2d()).expect("it emits");
            match scene.intersect(&walk.ray) {
                Some(hit) if on_plate(hit.point.p) && walk.ray.d.y < 0.0 => {
                    f64::from(walk.le.mean()) / (f64::from(walk.pdf_p) * f64::from(walk.pdf_d))
                }
                _ => 0.0,
            }
        });
        let connected = Mean::of(200_000, || {
            let u = random.next_2d();
            let p = vec3(2.0 * u.x - 1.0, -0.8, 2.0 * u.y - 1.0);
            let Some(sample) = scene.sample_li(ID, p, random.next_2d()) else { return 0.0 };
            let at = crate::ray::SurfacePoint::on_surface(p, Vec3::Y, 1e-6);
            let infinite = sample.endpoint.kind.is_infinite();
            assert_eq!(infinite, sample.distance.is_infinite());
            let ray = if infinite { at.spawn(sample.wi) } else { at.segment_to(&sample.endpoint.at) };
            if sample.wi.y <= 0.0 || scene.occluded(&ray) {
                return 0.0;
            }
            4.0 * f64::from(sample.li.mean() * sample.wi.y / sample.pdf)
        });
        agree(&name, &walked, &connected);
    }
}

#[test]
fn parallel_light_has_one_direction() {
    let d = dvec3(0.3, -1.0, 0.2);
    let scene = scene("directional", |builder| builder.directional_emitter(d, Spectrum::splat(2.0)));
    let unit = d.normalize().as_vec3();
    let mut random = Random::new(86);
    for _ in 0..1000 {
        let walk = scene.sample_le(ID, random.next_2d(), random.next_2d()).expect("it emits");
        assert_eq!((walk.ray.d, walk.endpoint.kind, walk.endpoint.at.ng), (unit, EndpointKind::Direction, unit));
        assert_eq!(scene.pdf_le(ID, &walk.endpoint, unit), (walk.pdf_p, walk.pdf_d));
        // It starts outside of all that there is.
        let back = Ray::new(walk.ray.o, -unit);
        assert!(!scene.occluded(&back));
    }
    let sample = scene.sample_li(ID, Vec3::ZERO, vec2(0.1, 0.2)).expect("it lights all");
    assert_eq!((sample.wi, sample.li, sample.pdf, sample.delta), (-unit, Spectrum::splat(2.0), 1.0, true));
    assert_eq!(scene.pdf_li(ID, Vec3::ZERO, &sample.endpoint, sample.wi), 0.0);
    assert!(scene.needs.delta_emitters && !scene.needs.hittable_emitters && !scene.needs.environment);
    let disc = PI * f64::from(scene.bounds.radius).powi(2);
    assert!((scene.emitters[0].power() / (2.0 * disc) - 1.0).abs() < 1e-6);
}
