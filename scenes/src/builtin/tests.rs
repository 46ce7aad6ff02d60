use super::*;
use crate::interaction::Interaction;
use crate::load::{LoadOptions, load};
use crate::scene::Scene;
use sampling::bsdf::Bsdf;
use sampling::math::Spectrum;
use sampling::{Vec2, Vec3, vec2, vec3};

fn scene(name: &str) -> Scene {
    load(name, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// What the camera sees along a grid of rays.
fn seen(scene: &Scene) -> Vec<Option<Interaction>> {
    let raster = |i: usize| vec2((i % 16) as f32 * 16.0 + 8.5, (i / 16) as f32 * 16.0 + 8.5);
    (0..256).map(|i| scene.intersect(&scene.camera.sample_we(raster(i), Vec2::ZERO).ray)).collect()
}

#[test]
fn every_scene_builds_and_shows_something() {
    for name in NAMES {
        let scene = scene(name);
        assert_eq!((scene.name.as_str(), scene.camera.width(), scene.camera.height()), (*name, 256, 256));
        assert!(title(name).is_some_and(|title| !title.is_empty()), "{name} has no title");
        assert!(!scene.emitters.is_empty(), "{name} has no emitter");
        assert!(scene.notes.is_empty(), "{name}: {:?}", scene.notes);
        let hits = seen(&scene).into_iter().flatten().count();
        assert!(hits > 192, "{name}: most of the picture is empty, {hits} of 256 rays hit");
    }
}

/// Albedo and emission of a Lambertian hit, as the scene file made them.
fn albedo_and_emission(scene: &Scene, it: &Interaction) -> (Spectrum, Spectrum) {
    let Bsdf::Lambert(lambert) = it.bsdf else { panic!("not Lambertian: {:?}", it.bsdf) };
    (lambert.albedo, scene.le(it, it.point.ng))
}

#[track_caller]
fn assert_close(a: Spectrum, b: Spectrum) {
    let near = a.to_array().iter().zip(b.to_array()).all(|(a, b)| (a - b).abs() <= 2e-6 * (1.0 + b.abs()));
    assert!(near, "{a:?} is not {b:?}");
}

#[test]
fn the_furnace_is_the_same_everywhere() {
    let scene = scene("furnace");
    for it in seen(&scene) {
        let it = it.expect("the furnace is closed");
        let (albedo, emission) = albedo_and_emission(&scene, &it);
        let exact = |order| exact("furnace", order, it.point.p, it.point.ng).unwrap();
        assert_close(emission, exact(0));
        assert_close(albedo * emission, exact(1));
        assert_close(albedo * albedo * albedo * emission, exact(3));
    }
}

#[test]
fn the_integrating_sphere_is_what_its_closed_form_says() {
    let scene = scene("integrating_sphere");
    assert_eq!(scene.origin, glam::DVec3::ZERO);
    let (mean_albedo, mean_emission) = (Spectrum::splat(0.5), Spectrum::splat(0.3));
    for it in seen(&scene) {
        let it = it.expect("the sphere is closed");
        let (albedo, emission) = albedo_and_emission(&scene, &it);
        assert!(it.point.ng.dot(it.point.p) < 0.0, "the front is inside");
        let exact = |order| integrating_sphere(order, it.point.p);
        assert_close(emission, exact(0));
        assert_close(albedo * mean_emission, exact(1));
        assert_close(albedo * mean_albedo * mean_albedo * mean_emission, exact(3));
    }
}

/// The recursion of the rendering equation, order by order, by quadrature over the sphere.
#[test]
fn the_closed_form_of_the_sphere_solves_the_equation() {
    let n = 200;
    for order in 0..6 {
        // Points of equal area: uniform in z and in the angle about z.
        let mut mean = [0.0; 3];
        for i in 0..n {
            for j in 0..n {
                let (z, phi) =
                    ((i as f32 + 0.5) * 2.0 / n as f32 - 1.0, (j as f32 + 0.5) * std::f32::consts::TAU / n as f32);
                let r = (1.0 - z * z).sqrt();
                let value = integrating_sphere(order, vec3(r * phi.cos(), r * phi.sin(), z)).to_array();
                (0..3).for_each(|c| mean[c] += f64::from(value[c]) / f64::from(n * n));
            }
        }
        let gathered = Spectrum::from(mean.map(|m| m as f32));
        let p = vec3(0.6, 0.0, -0.8);
        let albedo = Spectrum::splat(0.5) + Spectrum::new(0.4, 0.2, -0.4) * p.z;
        assert_close(albedo * gathered, integrating_sphere(order + 1, p));
    }
}

#[test]
fn other_scenes_have_no_closed_form() {
    assert_eq!(exact("cornell_box", 0, Vec3::ZERO, Vec3::Z), None);
}

#[test]
fn the_balls_of_veach_have_equal_power() {
    let scene = scene("veach_mis");
    let powers: Vec<f64> = scene.emitters.iter().map(|emitter| emitter.power()).collect();
    assert_eq!(powers.len(), 4);
    assert!(powers.iter().all(|power| (power / powers[0] - 1.0).abs() < 0.15), "{powers:?}");
}

#[test]
fn lamps_point_the_right_way() {
    for (name, down) in [("cornell_box", -1.0), ("glass_caustic", -1.0), ("indirect_lamp", 1.0)] {
        let scene = scene(name);
        let sample = scene.sample_le(crate::EmitterId(0), vec2(0.5, 0.5), vec2(0.5, 0.5)).unwrap();
        assert!(sample.ray.d.y * down > 0.0, "{name} shines along {}", sample.ray.d);
    }
}
