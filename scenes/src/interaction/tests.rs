use super::*;
use crate::test_support::Random;
use crate::tilt::Remedies;
use sampling::bsdf::{Dielectric, Lambert, Mirror, RoughConductor, RoughDielectric, ThinGlass};
use sampling::vec3;
use sampling::warp::uniform_sphere;

fn smooth(bsdf: Bsdf, ns: Vec3) -> Interaction {
    Interaction {
        point: SurfacePoint::on_surface(Vec3::ZERO, Vec3::Z, 0.0),
        t: 1.0,
        frame: Frame::from_z(ns.normalize()),
        normals: Normals::Smooth,
        bsdf,
        emitter: None,
        emitted: Spectrum::ZERO,
        surface: SurfaceId(0),
    }
}

fn tilted(bsdf: Bsdf, ns: Vec3, normal: Vec3, remedies: Remedies) -> Interaction {
    let normals = Normals::Tilted(Tilt { normal: normal.normalize(), remedies });
    Interaction { normals, ..smooth(bsdf, ns) }
}

/// Every way in which normals may differ: interpolated, tilted, and both.
fn all(bsdf: Bsdf) -> Vec<Interaction> {
    let mut all = vec![smooth(bsdf, vec3(0.4, -0.2, 1.0))];
    for remedies in Remedies::ALL {
        all.push(tilted(bsdf, Vec3::Z, vec3(-0.5, 0.3, 1.0), remedies));
        all.push(tilted(bsdf, vec3(0.2, 0.3, 1.0), vec3(0.8, -0.4, 1.0), remedies));
    }
    all
}

#[test]
fn importance_is_adjoint_to_radiance_whatever_the_normals() {
    // f*(wo → wi) |wi·ns| = f(wi → wo) |wo·ns| |wi·ng| / |wo·ng|, which makes K and its adjoint agree over dσ⊥ of ng.
    let mut random = Random::new(1);
    for (name, bsdf) in Bsdf::all_examples() {
        for it in all(bsdf) {
            for _ in 0..500 {
                let (wo, wi) = (random.direction(), random.direction());
                let adjoint =
                    it.eval(wo, wi, TransportMode::Importance) * wi.dot(it.ns()).abs() * wo.dot(Vec3::Z).abs();
                let direct = it.eval(wi, wo, TransportMode::Radiance) * wo.dot(it.ns()).abs() * wi.dot(Vec3::Z).abs();
                for (a, b) in adjoint.to_array().into_iter().zip(direct.to_array()) {
                    assert!((a - b).abs() <= 2e-3 * a.max(b) + 1e-7, "{name} {:?}: {wo} {wi}: {a} {b}", it.normals);
                }
            }
        }
    }
}

#[test]
fn sides_on_which_the_normals_disagree_are_dark() {
    let white = Bsdf::from(Lambert { albedo: Spectrum::ONE });
    let above = vec3(0.0, 0.1, 0.9).normalize();
    let between = vec3(-0.9, 0.0, 0.1).normalize();
    let normal = vec3(1.0, 0.0, 0.3);
    for it in [smooth(white, normal), tilted(white, Vec3::Z, normal, Remedies::NONE)] {
        for mode in [TransportMode::Radiance, TransportMode::Importance] {
            assert!(!it.eval(above, above, mode).is_zero());
            assert!(it.eval(above, between, mode).is_zero() && it.eval(between, above, mode).is_zero());
            assert_eq!(it.pdf(above, between, mode), 0.0);
            assert!(it.sample(between, 0.5, Vec2::splat(0.5), mode).is_none());
        }
    }
    // A face that turns to whoever looks is seen from there, but not lit from the other side of the surface.
    let it = tilted(white, Vec3::Z, normal, Remedies::default());
    assert!(!it.eval(between, above, TransportMode::Radiance).is_zero());
    assert!(!it.eval(above, between, TransportMode::Importance).is_zero());
    assert!(it.eval(above, between, TransportMode::Radiance).is_zero());
    let below = vec3(1.0, 0.0, -0.1).normalize();
    assert!(below.dot(normal) > 0.0 && it.eval(above, below, TransportMode::Radiance).is_zero());
}

#[test]
fn a_tilted_lambertian_face_has_the_cosine_to_its_own_normal() {
    let white = Bsdf::from(Lambert { albedo: Spectrum::ONE });
    let normal = vec3(-0.5, 0.3, 1.0).normalize();
    let (wo, wi) = (vec3(0.1, 0.2, 0.9).normalize(), vec3(-0.6, 0.5, 0.6).normalize());
    for remedies in Remedies::ALL {
        let it = tilted(white, Vec3::Z, normal, remedies);
        let frame = it.frame;
        let tilt = Tilt { normal, remedies };
        let expected = frame.to_world(normal).dot(wi) / std::f32::consts::PI * tilt.shadowing(frame.to_local(wi));
        let value = it.eval(wo, wi, TransportMode::Radiance).mean() * wi.z;
        assert!((value - expected).abs() < 1e-6, "{remedies:?}: {value} {expected}");
    }
}

#[test]
fn samples_carry_what_eval_and_pdf_say() {
    let mut random = Random::new(2);
    for (name, bsdf) in Bsdf::all_examples() {
        for it in all(bsdf) {
            for mode in [TransportMode::Radiance, TransportMode::Importance] {
                for _ in 0..100 {
                    let wo = random.direction();
                    let Some(sample) = it.sample(wo, random.next_1d(), random.next_2d(), mode) else { continue };
                    if sample.lobe.is_delta() {
                        continue;
                    }
                    let (value, pdf) = it.eval_pdf(wo, sample.wi, mode);
                    let expected = value * (sample.wi.dot(it.ns()).abs() / pdf);
                    for (a, b) in expected.to_array().into_iter().zip(sample.weight.to_array()) {
                        assert!(
                            (a - b).abs() <= 2e-2 * a.max(b) + 1e-4,
                            "{name} {mode:?} {:?}: {wo} {sample:?} {expected:?}",
                            it.normals
                        );
                    }
                    assert_eq!(pdf, it.pdf(wo, sample.wi, mode));
                    let back = it.pdf(sample.wi, wo, mode.reversed());
                    assert_eq!(it.pdfs(wo, sample.wi, mode), (pdf, back));
                    assert_eq!(value, it.eval(wo, sample.wi, mode));
                }
            }
        }
    }
}

#[test]
fn densities_integrate_to_the_share_of_samples_that_are_not_lost() {
    // 72 comparisons at 4.5 standard errors: a false alarm in 2000 runs; the quadrature adds at most 2·10⁻³.
    let (samples, side) = (40_000, 400);
    let mut random = Random::new(3);
    let rough = RoughConductor::from_reflectance(Spectrum::splat(0.8), 0.5, 0.5);
    let matte = Lambert { albedo: Spectrum::ONE };
    let cell = |i: u32| (i as f32 + 0.5) / side as f32;
    for it in [Bsdf::from(matte), rough.into()].into_iter().flat_map(all) {
        for mode in [TransportMode::Radiance, TransportMode::Importance] {
            for wo in [vec3(0.3, 0.1, 0.9).normalize(), vec3(-0.8, 0.5, -0.4).normalize()] {
                let mut draw = || it.sample(wo, random.next_1d(), random.next_2d(), mode).is_some();
                let kept = (0..samples).filter(|_| draw()).count() as f64 / f64::from(samples);
                let grid = (0..side * side).map(|i| uniform_sphere(Vec2::new(cell(i % side), cell(i / side))));
                let sum: f64 = grid.map(|wi| f64::from(it.pdf(wo, wi, mode))).sum();
                let integral = sum * 4.0 * std::f64::consts::PI / f64::from(side * side);
                let error = (kept * (1.0 - kept) / f64::from(samples)).sqrt();
                assert!(
                    (kept - integral).abs() < 4.5 * error + 2e-3,
                    "{} {mode:?} {:?} {wo}: {kept} ± {error}, {integral}",
                    it.bsdf.name(),
                    it.normals
                );
            }
        }
    }
}

/// ⟨g, K h⟩ over dσ⊥ of the geometric normal with sines for g and h, by samples from the viewer's side or from the light's, and its
/// standard error.
fn carried(it: &Interaction, mode: TransportMode, random: &mut Random, n: u32) -> (f64, f64) {
    let of_viewer = |w: Vec3| 1.5 + (3.0 * w.x + w.z).sin();
    let of_light = |w: Vec3| 1.5 + (2.0 * w.y - w.x - w.z).sin();
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..n {
        let wo = random.direction();
        let Some(sample) = it.sample(wo, random.next_1d(), random.next_2d(), mode) else { continue };
        let (viewer, light) = viewer_and_light(wo, sample.wi, mode);
        let value = f64::from(sample.weight.mean() * wo.z.abs() * of_viewer(viewer) * of_light(light));
        (sum, squares) = (sum + value, squares + value * value);
    }
    let mean = sum / f64::from(n);
    (mean, ((squares / f64::from(n) - mean * mean) / f64::from(n)).sqrt())
}

#[test]
fn samples_from_either_side_carry_the_same() {
    // 54 comparisons at 4.5 standard errors: a false alarm in 2700 runs.
    let mut random = Random::new(4);
    let (eta, reflectance) = (1.5, Spectrum::splat(0.8));
    let models: [Bsdf; 6] = [
        Mirror { reflectance }.into(),
        Dielectric { eta }.into(),
        ThinGlass { eta }.into(),
        RoughDielectric::new(eta, 0.4, 0.4).into(),
        Lambert { albedo: reflectance }.into(),
        RoughConductor::from_reflectance(reflectance, 0.3, 0.3).into(),
    ];
    for it in models.into_iter().flat_map(all) {
        let [(a, error_a), (b, error_b)] =
            [TransportMode::Radiance, TransportMode::Importance].map(|mode| carried(&it, mode, &mut random, 40_000));
        let error = error_a.hypot(error_b);
        assert!((a - b).abs() < 4.5 * error, "{} {:?}: {a} {b} ± {error}", it.bsdf.name(), it.normals);
        assert!(error < 0.05 * a, "{} {:?}: {a} ± {error}", it.bsdf.name(), it.normals);
    }
}

#[test]
fn delta_densities_are_those_of_the_way_back() {
    let mut random = Random::new(5);
    let models: [Bsdf; 2] = [Mirror { reflectance: Spectrum::ONE }.into(), Dielectric { eta: 1.5 }.into()];
    for it in models.into_iter().flat_map(all) {
        for mode in [TransportMode::Radiance, TransportMode::Importance] {
            let mut found = 0;
            for _ in 0..300 {
                let wo = random.direction();
                let Some(there) = it.sample(wo, random.next_1d(), Vec2::splat(0.5), mode) else { continue };
                let from_there = |uc: f32| it.sample(there.wi, uc, Vec2::splat(0.5), mode.reversed());
                let mut returning = (0..400).filter_map(|i| from_there((i as f32 + 0.5) / 400.0));
                let Some(back) = returning.find(|back| back.wi.distance(wo) < 1e-3) else { continue };
                let (forward, reverse) = it.delta_densities(wo, &there, mode);
                let (forward_back, reverse_back) = it.delta_densities(there.wi, &back, mode.reversed());
                // Where it refracts the two measures differ by a factor that both directions have.
                let (a, b) = (forward / reverse, reverse_back / forward_back);
                assert!((a / b - 1.0).abs() < 1e-2, "{mode:?} {:?}: {wo} {there:?}: {a} {b}", it.normals);
                found += 1;
            }
            assert!(found > 50, "{mode:?} {:?}: {found}", it.normals);
        }
    }
}
