//! The choice among emitters for a point to be lit.

use super::distant::{sky, spots};
use crate::builder::{ChoiceRule, Emission, Mapping, SceneBuilder};
use crate::emitter::{EmitterId, Spot};
use crate::needs::Skip;
use crate::ray::SurfacePoint;
use crate::scene::Scene;
use crate::test_support::{Random, built, bumpy_ball, grey_builder};
use glam::{DMat3, DVec3, dvec3};
use sampling::math::Spectrum;
use sampling::{Vec3, vec3};

/// Many emitters of every kind; some of them dark, some at the same place.
fn crowd(rule: ChoiceRule) -> Scene {
    let (mut builder, grey) = grey_builder("crowd");
    let mut random = Random::new(90);
    let mut place = || (random.direction() * 3.0 * random.next_1d()).as_dvec3();
    for i in 0..40 {
        let (origin, u, v) = (place(), place().normalize() * 0.1, place().normalize() * 0.1);
        let shape = builder.quad(origin, u, v, grey);
        let radiance = if i % 10 == 3 { 0.0 } else { 1.0 + i as f32 };
        builder.emit(shape, Emission { radiance: radiance.into(), two_sided: i % 7 == 0 });
    }
    for i in 0..5 {
        let shape = builder.sphere(place(), 0.1, grey);
        builder.emit(shape, Emission { radiance: 2.0.into(), two_sided: false });
        builder.point_emitter(if i < 3 { DVec3::X } else { place() }, Spectrum::splat(0.1));
    }
    let mut ball = bumpy_ball(4);
    ball.positions.iter_mut().for_each(|p| *p = *p * 0.3 + dvec3(0.0, 2.0, 1.0));
    let shape = builder.mesh(ball, grey);
    builder.emit(shape, Emission { radiance: 1.0.into(), two_sided: false });
    for spot in spots() {
        builder.spot(Spot { position: place(), target: place(), ..spot });
    }
    builder.emitter_choice(rule);
    builder.directional_emitter(DVec3::NEG_Y, Spectrum::splat(0.1));
    builder.environment_image(sky((8, 4), Mapping::Equirectangular, DMat3::IDENTITY, |column, _| column as f32));
    built(builder, Skip::Unneeded)
}

/// Points free and on surfaces, among the emitters and far off.
fn points() -> Vec<SurfacePoint> {
    let mut random = Random::new(91);
    let mut points = vec![SurfacePoint::free(Vec3::ZERO), SurfacePoint::free(vec3(100.0, -30.0, 5.0))];
    points.extend((0..200).map(|i| {
        let p = random.direction() * 4.0 * random.next_1d();
        if i % 2 == 0 { SurfacePoint::free(p) } else { SurfacePoint::on_surface(p, random.direction(), 1e-6) }
    }));
    points.push(SurfacePoint::on_surface(Vec3::X, Vec3::Y, 1e-6));
    points
}

#[test]
fn what_is_stated_for_a_point_is_what_is_chosen() {
    const NUMBERS: usize = 20_000;
    for rule in ChoiceRule::FOR_ANY_NUMBER {
        let scene = crowd(rule);
        assert_eq!(scene.choice_rule, rule);
        for at in points() {
            let mut counts = vec![0.0_f64; scene.emitters.len()];
            for i in 0..NUMBERS {
                let Some((id, pmf)) = scene.choose_emitter_for(&at, (i as f32 + 0.5) / NUMBERS as f32) else {
                    continue;
                };
                counts[id.0 as usize] += 1.0 / NUMBERS as f64;
                let stated = scene.emitter_pmf_for(id, &at);
                assert!((pmf / stated - 1.0).abs() < 1e-4, "{rule:?} {at:?} {id:?}: {pmf} and {stated}");
            }
            let mut sum = 0.0;
            for (index, count) in counts.iter().enumerate() {
                let pmf = f64::from(scene.emitter_pmf_for(EmitterId(index as u32), &at));
                sum += pmf;
                // Each emitter has at most a few intervals of numbers: one of the tree, two of the table.
                assert!((pmf - count).abs() < 4.0 / NUMBERS as f64 + 1e-5, "{rule:?} {at:?} {index}: {pmf}, {count}");
                assert_eq!(pmf > 0.0, scene.emitters[index].power() > 0.0);
            }
            assert!(sum < 1.0 + 1e-5, "{rule:?} {at:?}: {sum}");
        }
    }
}

/// Emitters that light a point have more of the choice than the part that is by power gives them.
#[test]
fn a_tree_forgets_no_emitter() {
    let scene = crowd(ChoiceRule::Tree);
    let mut random = Random::new(92);
    for at in points().into_iter().filter(|at| at.ng == Vec3::ZERO) {
        for index in 0..scene.emitters.len() {
            let id = EmitterId(index as u32);
            let lit = (0..20).any(|_| scene.sample_li(id, at.p, random.next_2d()).is_some_and(|s| !s.li.is_zero()));
            let more = scene.emitter_pmf_for(id, &at) > 0.125_001 * scene.emitter_pmf(id);
            assert!(more || !lit, "{at:?}: {index}, {:?}", scene.emitters[index]);
        }
    }
}

/// Of two plates of equal power, one near and one far; and of two back to back.
#[test]
fn a_tree_prefers_what_is_near_and_faces_the_point() {
    for (far, turned) in [(10.0, false), (0.0, true)] {
        let (mut builder, grey) = grey_builder("two plates");
        for (x, flipped) in [(0.0, false), (far, turned)] {
            let shape = builder.quad(dvec3(x, 0.0, 0.0), DVec3::X * 0.1, DVec3::Y * 0.1, grey);
            builder.emit(shape, Emission { radiance: 1.0.into(), two_sided: false });
            if flipped {
                builder.flip(shape);
            }
        }
        builder.emitter_choice(ChoiceRule::Tree);
        let scene = built(builder, Skip::Unneeded);
        let at = SurfacePoint::free(vec3(0.05, 0.05, 0.5));
        // An eighth is by power: half of it each.
        assert!(scene.emitter_pmf_for(EmitterId(0), &at) > 0.93, "{far} {turned}");
        assert!(scene.emitter_pmf_for(EmitterId(1), &at) < 0.07, "{far} {turned}");
    }
}

#[test]
fn many_emitters_get_a_tree_and_few_none() {
    for (count, expected) in [(1, ChoiceRule::Power), (8, ChoiceRule::Power), (9, ChoiceRule::Tree)] {
        let (mut builder, grey): (SceneBuilder, _) = grey_builder("points");
        builder.sphere(DVec3::ZERO, 1.0, grey);
        for i in 0..count {
            builder.point_emitter(dvec3(2.0, f64::from(i), 0.0), Spectrum::ONE);
        }
        assert_eq!(built(builder, Skip::Unneeded).choice_rule, expected, "{count}");
    }
}
