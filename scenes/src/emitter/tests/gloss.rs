//! The choice among few emitters for light that a glossy surface scatters.

use super::distant::{sky, spots};
use crate::builder::{ChoiceRule, Emission, Mapping, SceneBuilder};
use crate::emitter::{EmitterId, Spot};
use crate::material::MaterialId;
use crate::needs::Skip;
use crate::ray::Ray;
use crate::scene::Scene;
use crate::test_support::{Random, built, bumpy_ball, grey_builder};
use glam::{DMat3, DVec3, dvec3};
use sampling::Vec3;
use sampling::bsdf::{Bsdf, Lambert, RoughConductor, RoughDielectric, RoughPlastic};
use sampling::math::Spectrum;

fn metal(alpha: f32) -> Bsdf {
    RoughConductor::from_reflectance(Spectrum::splat(0.8), alpha, alpha).into()
}

/// One of each kind, and a dark one, around a ball that is touched by one and within another's box.
fn every_kind(scale: f64, ball: impl Into<Bsdf>) -> Scene {
    let (mut builder, grey) = grey_builder("every kind");
    let material = builder.material(ball.into());
    builder.sphere(DVec3::ZERO, scale, material);
    let shining = |radiance: f32| Emission { radiance: radiance.into(), two_sided: false };
    let corner = dvec3(-0.5, 1.0, -0.5) * scale;
    for radiance in [3.0, 0.0] {
        let lamp = builder.quad(corner, DVec3::X * scale, DVec3::Z * scale, grey);
        builder.emit(lamp, shining(radiance));
    }
    let lamp = builder.sphere(dvec3(2.0, 0.5, 0.0) * scale, 0.2 * scale, grey);
    builder.emit(lamp, shining(5.0));
    let mut around = bumpy_ball(4);
    around.positions.iter_mut().for_each(|p| *p *= 3.0 * scale);
    let lamp = builder.mesh(around, grey);
    builder.emit(lamp, shining(0.1));
    let intensity = Spectrum::splat((scale * scale) as f32);
    builder.point_emitter(dvec3(-2.0, 1.0, 1.0) * scale, intensity);
    builder.spot(Spot { position: DVec3::Z * 2.0 * scale, target: DVec3::ZERO, intensity, ..spots()[0] });
    builder.directional_emitter(dvec3(1.0, -1.0, -1.0), Spectrum::splat(0.5));
    builder.environment_image(sky((8, 4), Mapping::Equirectangular, DMat3::IDENTITY, |column, _| column as f32));
    built(builder, Skip::Unneeded)
}

#[test]
fn what_is_stated_for_a_surface_is_what_is_chosen() {
    const NUMBERS: u32 = 1 << 24;
    let mut random = Random::new(93);
    for (scale, alpha) in [(1.0, 0.3_f32), (1.0, 1e-4), (1e-6, 0.02), (1e6, 0.02)] {
        let coated = RoughPlastic::new(Spectrum::splat(0.5), 1.5, alpha.max(0.01));
        for bsdf in [metal(alpha), coated.into()] {
            let scene = every_kind(scale, bsdf);
            assert_eq!(scene.choice_rule, ChoiceRule::Gloss);
            for _ in 0..100 {
                // From within the ball, too.
                let o = random.direction() * (2.0 * random.next_1d() * scale as f32);
                let Some(hit) = scene.intersect(&Ray::new(o, random.direction())) else { continue };
                let Some(odds) = scene.emitter_odds(&hit, (o - hit.point.p).normalize()) else {
                    assert!(hit.emitter.is_some(), "only lamps are grey");
                    continue;
                };
                let mut first = 0;
                for index in 0..scene.emitters.len() {
                    let id = EmitterId(index as u32);
                    let (pmf, by_power) = (odds.pmf(id), scene.emitter_pmf(id));
                    assert!(pmf >= 0.124_99 * by_power, "{index}: {pmf}, {by_power}");
                    assert_eq!(pmf > 0.0, scene.emitters[index].power() > 0.0);
                    // The first and the last of the numbers that choose it, of all that there are.
                    let next = first + (pmf * NUMBERS as f32) as u32;
                    for number in (first..next).step_by((next - first).max(2) as usize - 1) {
                        assert_eq!(odds.choose(number as f32 / NUMBERS as f32), (id, pmf));
                    }
                    first = next;
                }
                assert_eq!(first, NUMBERS);
            }
        }
    }
}

/// However little power the first and the last of them have, as many numbers choose them as is said.
#[test]
fn emitters_of_hardly_any_power_are_chosen_as_often_as_is_stated() {
    let (mut builder, _) = grey_builder("weak and strong");
    let material = builder.material(metal(0.1));
    builder.sphere(DVec3::ZERO, 1.0, material);
    for (x, intensity) in [(-2.0, 1e-12), (0.0, 1.0), (2.0, 1e-12)] {
        builder.point_emitter(dvec3(x, 0.0, 3.0), Spectrum::splat(intensity));
    }
    builder.environment(Spectrum::splat(1e-12));
    let scene = built(builder, Skip::Unneeded);
    let hit = scene.intersect(&Ray::new(Vec3::Z * 2.0, -Vec3::Z)).unwrap();
    let odds = scene.emitter_odds(&hit, Vec3::Z).unwrap();
    let least = 1.0 / (1 << 24) as f32;
    let pmfs = [0, 1, 2, 3].map(|id| odds.pmf(EmitterId(id)));
    assert_eq!(pmfs, [least, 1.0 - 3.0 * least, least, least]);
    for (uc, id) in [(0.0, 0), (least, 1), (1.0 - 3.0 * least, 1), (1.0 - 2.0 * least, 2), (1.0 - least, 3)] {
        assert_eq!(odds.choose(uc), (EmitterId(id), pmfs[id as usize]), "{uc}");
    }
}

/// Two balls of the same size and radiance above a floor, of which who looks from (1, 1, 1) to the origin sees the left one mirrored there.
fn two_balls(floor: impl FnOnce(&mut SceneBuilder) -> MaterialId) -> Scene {
    let (mut builder, grey) = grey_builder("two balls");
    let floor = floor(&mut builder);
    builder.quad(dvec3(-5.0, 0.0, 5.0), DVec3::X * 10.0, DVec3::Z * -10.0, floor);
    for x in [-1.0, 1.0] {
        let ball = builder.sphere(dvec3(x, 1.0, -1.0), 0.2, grey);
        builder.emit(ball, Emission { radiance: 1.0.into(), two_sided: false });
    }
    built(builder, Skip::Unneeded)
}

#[test]
fn gloss_prefers_what_it_mirrors() {
    let odds = |scene: &Scene| {
        let hit = scene.intersect(&Ray::new(Vec3::ONE, -Vec3::ONE.normalize())).unwrap();
        scene.emitter_odds(&hit, Vec3::ONE.normalize())
    };
    for alpha in [0.001, 0.02, 0.1] {
        let odds = odds(&two_balls(|builder| builder.material(metal(alpha)))).unwrap();
        // An eighth is by power: half of it each.
        assert!(odds.pmf(EmitterId(0)) > 0.92, "{alpha}: {odds:?}");
    }
    // What is diffuse, and what lets light through, has no say, and makes no rule of it.
    let others = [Bsdf::from(Lambert { albedo: Spectrum::splat(0.5) }), RoughDielectric::new(1.5, 0.1, 0.1).into()];
    for floor in others {
        let scene = two_balls(|builder| builder.material(floor));
        assert_eq!(scene.choice_rule, ChoiceRule::Power);
        assert!(odds(&scene).is_none());
    }
}

#[test]
fn gloss_is_not_for_many() {
    let (mut builder, grey) = grey_builder("points");
    builder.sphere(DVec3::ZERO, 1.0, grey);
    (0..9).for_each(|i| builder.point_emitter(dvec3(2.0, f64::from(i), 0.0), Spectrum::ONE));
    builder.emitter_choice(ChoiceRule::Gloss);
    let error = builder.build(Skip::Unneeded).unwrap_err().to_string();
    assert!(error.contains("8 at most, and there are 9") && error.contains("emitter_choice = \"tree\""), "{error}");
}
