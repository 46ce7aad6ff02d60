mod choice;
mod distant;
mod gloss;

use super::*;
use crate::builder::{Emission, MeshData, SceneBuilder};
use crate::material::MaterialId;
use crate::needs::Skip;
use crate::scene::Scene;
use crate::test_support::{Random, built, bumpy_ball, grey_builder};
use crate::texture::{Texture, UvMap};
use glam::{DAffine3, DVec3, dvec3};
use sampling::{Vec2, vec2, vec3};
use std::f64::consts::PI;

/// Each kind of area emitter, alone in its scene.
fn emitters() -> Vec<(&'static str, Scene)> {
    type Add = fn(&mut SceneBuilder, MaterialId) -> crate::shape::ShapeId;
    let quad: Add = |b, m| b.quad(dvec3(-0.4, 0.3, 0.9), dvec3(0.7, 0.1, 0.0), dvec3(0.1, 0.6, 0.2), m);
    let sphere: Add = |b, m| b.sphere(dvec3(0.2, -0.1, 0.8), 0.5, m);
    let flipped: Add = |b, m| {
        let shape = b.sphere(dvec3(0.2, -0.1, 0.8), 1.5, m);
        b.flip(shape);
        shape
    };
    let mesh: Add = |b, m| {
        let mut ball = bumpy_ball(6);
        ball.positions.iter_mut().for_each(|p| *p = *p * 0.4 + dvec3(0.0, 0.2, 1.0));
        b.mesh(ball, m)
    };
    let facets: Add = |b, m| b.mesh(MeshData { triangles: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3]], ..tetrahedron() }, m);
    let facets_inside: Add = |b, m| {
        let mesh = b.mesh(tetrahedron(), m);
        b.flip(mesh);
        mesh
    };
    let mirrored: Add = |b, m| {
        let shape = b.mesh(one_triangle(), m);
        b.transform(shape, DAffine3::from_scale(dvec3(1.0, 1.0, -1.0)));
        shape
    };
    let ramp = Texture::Ramp {
        base: Spectrum::new(2.0, 3.0, 4.0),
        slope: Spectrum::new(0.5, -0.5, 0.2),
        axis: vec3(0.6, 0.0, 0.8),
        origin: DVec3::ZERO,
        scale: 1.0,
    };
    let ellipse: Add = |b, m| b.disk(dvec3(0.1, 0.2, 0.9), dvec3(-0.5, 0.3, 0.1), dvec3(0.1, 0.3, -0.3), m);
    let tube: Add = |b, m| b.cylinder(dvec3(0.2, -0.4, 0.7), dvec3(0.4, 0.5, 1.1), 0.3, m);
    let tube_inside: Add = |b, m| {
        let shape = b.cylinder(dvec3(0.2, -0.4, 0.7), dvec3(0.4, 0.5, 1.1), 0.5, m);
        b.flip(shape);
        shape
    };
    let mirrored_quad: Add = |b, m| {
        let shape = b.quad(dvec3(-0.4, 0.3, -0.9), dvec3(0.7, 0.1, 0.0), dvec3(0.1, 0.6, -0.2), m);
        b.transform(shape, DAffine3::from_scale(dvec3(1.0, 1.0, -1.0)));
        shape
    };
    let coloured: Add = |b, m| {
        let mut ball = bumpy_ball(6);
        ball.positions.iter_mut().for_each(|p| *p = *p * 0.4 + dvec3(0.0, 0.2, 1.0));
        ball.colours = ball.positions.iter().map(|p| Spectrum::splat(1.0 + p.x as f32)).collect();
        b.mesh(ball, m)
    };
    let board = Texture::Checkerboard {
        values: [Spectrum::splat(0.5), Spectrum::splat(3.0)],
        map: UvMap { scale: vec2(2.0, 3.0), offset: vec2(0.1, 0.2) },
    };
    let rectangle: Add = |b, m| b.quad(dvec3(-0.4, 0.3, 0.9), dvec3(0.0, 0.6, 0.8), dvec3(0.7, 0.0, 0.0), m);
    let mirrored_rectangle: Add = |b, m| {
        let shape = b.quad(dvec3(-0.4, 0.3, -0.9), dvec3(0.7, 0.0, 0.0), dvec3(0.0, 0.6, -0.8), m);
        b.transform(shape, DAffine3::from_scale(dvec3(1.0, 1.0, -1.0)));
        shape
    };
    let cases: [(&str, Add, Texture, bool); 20] = [
        ("quad", quad, 3.0.into(), false),
        ("rectangle", rectangle, ramp.clone(), false),
        ("two-sided rectangle", rectangle, 3.0.into(), true),
        ("checkered mirrored rectangle", mirrored_rectangle, board.clone(), true),
        ("two-sided quad", quad, ramp.clone(), true),
        ("sphere", sphere, ramp.clone(), false),
        ("two-sided sphere", sphere, 3.0.into(), true),
        ("sphere lit inside", flipped, ramp.clone(), false),
        ("ellipse", ellipse, ramp.clone(), false),
        ("checkered ellipse", ellipse, board.clone(), true),
        ("tube", tube, ramp.clone(), true),
        ("checkered tube inside", tube_inside, board.clone(), false),
        ("checkered sphere", sphere, board.clone(), false),
        ("checkered mirrored quad", mirrored_quad, board, true),
        ("coloured mesh", coloured, Texture::VertexColour, false),
        ("open mesh", facets, ramp.clone(), false),
        ("two-sided open mesh", facets, 3.0.into(), true),
        ("inverted mesh", facets_inside, ramp.clone(), false),
        ("mesh", mesh, ramp, false),
        ("mirrored triangle", mirrored, 3.0.into(), false),
    ];
    let build = |(name, add, radiance, two_sided): (&'static str, Add, Texture, bool)| {
        let (mut builder, grey) = grey_builder(name);
        let shape = add(&mut builder, grey);
        builder.emit(shape, Emission { radiance, two_sided });
        (name, built(builder, Skip::Unneeded))
    };
    cases.into_iter().map(build).collect()
}

/// With all of its faces outwards; REFERENCES have one within it.
fn tetrahedron() -> MeshData {
    let positions = vec![dvec3(-0.5, -0.6, 1.1), dvec3(0.8, -0.4, 1.0), dvec3(0.1, 0.9, 1.2), dvec3(0.2, 0.1, 0.4)];
    MeshData { positions, triangles: vec![[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]], ..MeshData::default() }
}

fn one_triangle() -> MeshData {
    let positions = vec![dvec3(-0.4, -0.3, -0.8), dvec3(0.6, -0.2, -0.9), dvec3(0.0, 0.7, -0.7)];
    MeshData { positions, triangles: vec![[0, 2, 1]], ..MeshData::default() }
}

const ID: EmitterId = EmitterId(0);

/// Where points are lit from: near, far, inside and behind.
const REFERENCES: [Vec3; 4] = [vec3(0.0, 0.0, 0.0), vec3(0.3, 2.0, 1.0), vec3(0.25, 0.0, 0.9), vec3(-30.0, 10.0, 40.0)];

struct Mean {
    sum: f64,
    squares: f64,
    count: f64,
}

impl Mean {
    fn of(count: usize, mut value: impl FnMut() -> f64) -> Self {
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..count {
            let x = value();
            sum += x;
            squares += x * x;
        }
        Mean { sum, squares, count: count as f64 }
    }

    fn value(&self) -> f64 {
        self.sum / self.count
    }

    fn error(&self) -> f64 {
        ((self.squares / self.count - self.value() * self.value()) / self.count).max(0.0).sqrt()
    }
}

/// Each comparison fails by chance less than once in 10⁶ (5 standard errors).
#[track_caller]
fn agree(what: &str, a: &Mean, b: &Mean) {
    let (difference, error) = ((a.value() - b.value()).abs(), a.error().hypot(b.error()));
    assert!(
        difference <= 5.0 * error + 1e-5 * b.value().abs(),
        "{what}: {} and {}, error {error}",
        a.value(),
        b.value()
    );
}

#[test]
fn sampling_a_connection_and_a_direction_give_the_same_light() {
    for (name, scene) in emitters() {
        for (index, &p) in REFERENCES.iter().enumerate() {
            if name == "sphere lit inside" && index == 3 {
                continue; // Too small from there for uniform directions to say anything.
            }
            let mut random = Random::new(10 + index as u64);
            // Uniform over directions where that hits; where the emitter is far, over the cone around it.
            let far = index == 3;
            let axis = (scene.bounds.center - p).normalize();
            let width = if far { 2e-3f32 } else { 2.0 };
            let solid_angle = 2.0 * PI * f64::from(width);
            let frame = sampling::math::Frame::from_z(axis);
            let by_direction = Mean::of(400_000, || {
                let d = frame.to_world(sampling::warp::uniform_cone(random.next_2d(), width));
                match scene.intersect(&Ray::new(p, d)) {
                    Some(it) => f64::from(scene.le(&it, -d).to_array()[0]) * solid_angle,
                    None => 0.0,
                }
            });
            let by_emitter = Mean::of(100_000, || match scene.sample_li(ID, p, random.next_2d()) {
                Some(sample) => {
                    let shadow = SurfacePoint::free(p).segment_to(&sample.endpoint.at);
                    if scene.occluded(&shadow) { 0.0 } else { f64::from(sample.li.to_array()[0] / sample.pdf) }
                }
                None => 0.0,
            });
            agree(&format!("{name} from {p}"), &by_emitter, &by_direction);
        }
    }
}

#[test]
fn the_density_of_a_connection_is_the_one_it_was_sampled_with() {
    for (name, scene) in emitters() {
        let mut random = Random::new(20);
        let (mut compared, mut differing) = (0, 0);
        for p in REFERENCES {
            for _ in 0..2_000 {
                let Some(sample) = scene.sample_li(ID, p, random.next_2d()) else { continue };
                let pdf = scene.pdf_li(ID, p, &sample.endpoint, sample.wi);
                assert!((pdf - sample.pdf).abs() <= 1e-3 * pdf, "{name}: {pdf} and {}", sample.pdf);
                let towards = (sample.endpoint.at.p - p).normalize();
                assert!((towards - sample.wi).length() < 1e-4, "{name}: {towards} and {}", sample.wi);
                let at = &sample.endpoint.at;
                let Emitter::Area(area) = &scene.emitters[0] else { panic!("not an area") };
                let seen = scene.intersect(&SurfacePoint::free(p).spawn(sample.wi));
                if let Some(hit) = seen.filter(|hit| hit.point.p.distance(at.p) < 1e-6 * (1.0 + sample.distance)) {
                    let (li, le) = (sample.li.mean(), scene.le(&hit, -sample.wi).mean());
                    compared += 1;
                    differing += u32::from((li - le).abs() > 1e-3 * li);
                }
                assert_eq!(sample.li, area.le(sample.li, at.ng, -sample.wi), "{name}");
            }
        }
        // Where squares meet, rounding decides.
        assert!(compared > 500 && differing <= compared / 100, "{name}: {differing} of {compared} differ");
    }
}

#[test]
fn directions_that_meet_an_emitter_have_densities_that_integrate_to_one() {
    // Only where all of the emitter is seen from the point and faces it.
    for (name, scene) in emitters() {
        let whole = [
            "quad",
            "two-sided quad",
            "two-sided rectangle",
            "checkered mirrored rectangle",
            "sphere",
            "two-sided sphere",
            "checkered ellipse",
            "checkered mirrored quad",
        ];
        if !whole.contains(&name) {
            continue;
        }
        let p = vec3(0.3, -0.2, -0.3);
        let mut random = Random::new(30);
        let integral = Mean::of(1_000_000, || {
            let d = random.direction();
            match scene.intersect(&Ray::new(p, d)) {
                Some(it) => 4.0 * PI * f64::from(scene.pdf_li(ID, p, &scene.endpoint_of(&it), d)),
                None => 0.0,
            }
        });
        let one = Mean { sum: 1.0, squares: 1.0, count: 1.0 };
        if name == "quad" && integral.value() == 0.0 {
            continue; // It faces away from the point.
        }
        agree(name, &integral, &one);
    }
}

#[test]
fn light_walks_carry_the_emitted_power_and_know_their_densities() {
    for (name, scene) in emitters() {
        let mut random = Random::new(40);
        let flux = Mean::of(100_000, || {
            let Some(sample) = scene.sample_le(ID, random.next_2d(), random.next_2d()) else { return 0.0 };
            let (pdf_p, pdf_d) = scene.pdf_le(ID, &sample.endpoint, sample.ray.d);
            assert!((pdf_p / sample.pdf_p - 1.0).abs() < 1e-6, "{name}");
            assert!((pdf_d - sample.pdf_d).abs() < 1e-5, "{name}: {pdf_d} and {}", sample.pdf_d);
            let cos = sample.endpoint.at.ng.dot(sample.ray.d).abs();
            assert!((cos - sample.cos).abs() < 1e-5, "{name}");
            f64::from(sample.le.mean() * sample.cos) / (f64::from(pdf_p) * f64::from(sample.pdf_d))
        });
        let power = scene.emitters[0].power();
        agree(name, &flux, &Mean { sum: power, squares: power * power, count: 1.0 });
    }
}

#[test]
fn light_walks_start_on_the_surface_they_sample() {
    for (name, scene) in emitters() {
        let (mut random, mut missed) = (Random::new(50), 0);
        for _ in 0..2_000 {
            let Some(sample) = scene.sample_le(ID, random.next_2d(), random.next_2d()) else { continue };
            let at = sample.endpoint.at;
            if sample.cos < 0.3 {
                continue; // Along the surface something else may be in the way.
            }
            // From a little off the surface back to it.
            let back = Ray::new(at.p + sample.ray.d * 1e-3, -sample.ray.d);
            let it = scene.intersect(&back).unwrap_or_else(|| panic!("{name}: the surface is not there"));
            // In a fold of the mesh its neighbour may be nearer.
            let found = (it.t - 1e-3).abs() < 2e-6 && it.point.ng.dot(at.ng) > 0.999;
            missed += usize::from(!found);
        }
        assert!(missed <= if name.ends_with("mesh") { 20 } else { 0 }, "{name}: {missed}");
    }
}

#[test]
fn a_tiny_distant_sphere_keeps_its_solid_angle() {
    let (mut builder, grey) = grey_builder("star");
    let shape = builder.sphere(dvec3(0.0, 0.0, 1000.0), 1e-3, grey);
    builder.emit(shape, Emission { radiance: 1e6.into(), two_sided: false });
    builder.quad(dvec3(-1.0, -1.0, 0.0), DVec3::X * 2.0, DVec3::Y * 2.0, grey);
    let scene = built(builder, Skip::Unneeded);
    let mut random = Random::new(60);
    let exact = PI * 1e-12; // π r²/d²
    for _ in 0..1000 {
        let sample = scene.sample_li(ID, Vec3::ZERO, random.next_2d()).expect("it is seen");
        assert!((f64::from(sample.pdf) * exact - 1.0).abs() < 1e-4, "{}", sample.pdf);
        assert!(!scene.occluded(&SurfacePoint::free(Vec3::ZERO).segment_to(&sample.endpoint.at)));
    }
}

#[test]
fn a_point_emitter_has_the_inverse_square() {
    let (mut builder, _) = grey_builder("point");
    builder.point_emitter(dvec3(0.0, 3.0, 0.0), Spectrum::splat(9.0));
    let scene = built(builder, Skip::Unneeded);
    let sample = scene.sample_li(ID, Vec3::ZERO, Vec2::ZERO).expect("it is seen");
    assert_eq!((sample.pdf, sample.delta, sample.distance), (1.0, true, 3.0));
    assert!((sample.li.to_array()[0] - 1.0).abs() < 1e-6);
    assert_eq!(scene.pdf_li(ID, Vec3::ZERO, &sample.endpoint, sample.wi), 0.0);
    assert!(scene.needs.delta_emitters && !scene.needs.hittable_emitters);
    let walk = scene.sample_le(ID, Vec2::ZERO, vec2(0.3, 0.6)).expect("it emits everywhere");
    assert_eq!((walk.pdf_p, walk.cos), (1.0, 1.0));
    assert!((f64::from(walk.pdf_d) - 0.25 / PI).abs() < 1e-8);
    assert!((scene.emitters[0].power() - 36.0 * PI).abs() < 1e-4);
}

#[test]
fn the_environment_lights_a_ball_evenly_from_either_end() {
    let (mut builder, grey) = grey_builder("sky");
    builder.sphere(dvec3(0.5, 0.0, 0.0), 0.7, grey);
    builder.quad(dvec3(-1.0, -1.0, -1.0), dvec3(0.5, 0.0, 0.0), dvec3(0.0, 0.5, 0.0), grey);
    builder.environment(Spectrum::splat(2.0));
    let scene = built(builder, Skip::Unneeded);
    let id = scene.environment.expect("there is one");
    let mut random = Random::new(70);
    // The flux that light walks bring to the ball is π·radiance times its area.
    let flux = Mean::of(200_000, || {
        let walk = scene.sample_le(id, random.next_2d(), random.next_2d()).expect("it emits everywhere");
        assert_eq!(scene.pdf_le(id, &walk.endpoint, walk.ray.d), (walk.pdf_p, walk.pdf_d));
        assert!(walk.endpoint.at.ng.dot(walk.ray.d) > 0.999_99);
        match scene.intersect(&walk.ray) {
            Some(it) if it.point.p.distance(vec3(0.5, 0.0, 0.0)) < 0.701 => {
                f64::from(walk.le.mean()) / (f64::from(walk.pdf_p) * f64::from(walk.pdf_d))
            }
            _ => 0.0,
        }
    });
    // The quad shades the ball a little; what reaches it otherwise is counted by rays that leave it.
    let seen = Mean::of(200_000, || {
        let n = random.direction();
        let at = SurfacePoint::on_surface(vec3(0.5, 0.0, 0.0) + n * 0.7, n, 1e-6);
        let local = sampling::warp::cosine_hemisphere(random.next_2d());
        let d = sampling::math::Frame::from_z(n).to_world(local);
        let area = 4.0 * PI * 0.49;
        if scene.occluded(&at.spawn(d)) { 0.0 } else { PI * area * f64::from(scene.environment_le(d).mean()) }
    });
    agree("flux", &flux, &seen);
    let endpoint = scene.environment_endpoint(Vec3::Y);
    assert_eq!((endpoint.kind, endpoint.at.ng), (EndpointKind::Infinite, -Vec3::Y));
    let sample = scene.sample_li(id, Vec3::ZERO, vec2(0.2, 0.3)).expect("it is everywhere");
    assert_eq!(scene.pdf_li(id, Vec3::ZERO, &sample.endpoint, sample.wi), sample.pdf);
    assert!(sample.distance.is_infinite());
}

#[test]
fn emitters_are_chosen_by_power_and_dark_ones_never() {
    for skip in [Skip::Unneeded, Skip::Nothing] {
        let (mut builder, grey) = grey_builder("three");
        for (x, radiance) in [(0.0, 1.0), (2.0, 0.0), (4.0, 3.0)] {
            let shape = builder.quad(dvec3(x, 0.0, 0.0), DVec3::X, DVec3::Y, grey);
            builder.emit(shape, Emission { radiance: radiance.into(), two_sided: false });
        }
        let scene = built(builder, skip);
        let pmf: Vec<f32> = (0..3).map(|i| scene.emitter_pmf(EmitterId(i))).collect();
        assert!((pmf[0] - 0.25).abs() < 1e-5 && pmf[1] == 0.0 && (pmf[2] - 0.75).abs() < 1e-5, "{pmf:?}");
        for i in 0..1000 {
            let (id, probability) = scene.choose_emitter(i as f32 / 1000.0).expect("something emits");
            assert_eq!(probability, scene.emitter_pmf(id));
            assert_ne!(id, EmitterId(1));
        }
    }
}

#[test]
fn a_scene_without_light_has_nothing_to_choose() {
    for skip in [Skip::Unneeded, Skip::Nothing] {
        let (mut builder, grey) = grey_builder("dark");
        builder.sphere(DVec3::ZERO, 1.0, grey);
        assert!(built(builder.clone(), skip).choose_emitter(0.5).is_none());
        let shape = builder.sphere(DVec3::X * 3.0, 1.0, grey);
        builder.emit(shape, Emission { radiance: 0.0.into(), two_sided: false });
        let scene = built(builder, skip);
        assert!(scene.choose_emitter(0.5).is_none());
        assert_eq!(scene.emitter_pmf(ID), 0.0);
    }
}
