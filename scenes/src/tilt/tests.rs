use super::*;
use crate::test_support::Random;

fn tilts() -> Vec<Tilt> {
    let normals = [vec3(0.1, 0.0, 1.0), vec3(-0.4, 0.3, 1.0), vec3(0.0, 1.5, 1.0), vec3(3.0, -2.0, 1.0), Vec3::Z];
    let tilt = |normal: Vec3| Remedies::ALL.map(|remedies| Tilt { normal: normal.normalize(), remedies });
    normals.into_iter().flat_map(tilt).collect()
}

#[test]
fn a_turned_face_is_seen_from_wherever_the_mapped_one_is_not() {
    let mut random = Random::new(1);
    for tilt in tilts() {
        let mut turned = 0;
        for _ in 0..2000 {
            let viewer = random.direction();
            let face = tilt.seen_from(viewer);
            turned += u32::from(face == Face::Turned);
            let sees = viewer.dot(tilt.normal_of(face)) * viewer.z > 0.0;
            assert!(sees || !tilt.remedies.turning, "{tilt:?} {viewer}");
        }
        let is_tilted = tilt.normal != Vec3::Z;
        assert_eq!(turned > 0, tilt.remedies.turning && is_tilted, "{tilt:?}");
    }
}

#[test]
fn faces_are_chosen_with_their_probabilities() {
    let mut random = Random::new(2);
    for tilt in tilts() {
        for mode in [TransportMode::Radiance, TransportMode::Importance] {
            for _ in 0..200 {
                let wo = random.direction();
                let [mapped, turned] = [Face::Mapped, Face::Turned].map(|face| tilt.probability(face, wo, mode));
                assert!((mapped + turned - 1.0).abs() < 1e-6 && mapped >= 0.0 && turned >= 0.0);
                // A face that has no light from here is not chosen, so that nothing else is lost.
                for (face, probability) in [(Face::Mapped, mapped), (Face::Turned, turned)] {
                    let lit = wo.dot(tilt.normal_of(face)) * wo.z > 0.0;
                    assert!(lit || probability == 0.0 || !tilt.remedies.turning, "{tilt:?} {wo} {mode:?}");
                }
                let n = 1000;
                let chosen = (0..n).map(|i| tilt.choose((i as f32 + 0.5) / n as f32, wo, mode));
                let (mut of_mapped, mut rests) = (0, [0.0f32; 2]);
                for (face, rest) in chosen {
                    assert!((0.0..1.0).contains(&rest));
                    of_mapped += u32::from(face == Face::Mapped);
                    rests[usize::from(face == Face::Turned)] += rest;
                }
                assert!((of_mapped as f32 / n as f32 - mapped).abs() < 2e-3, "{tilt:?} {wo} {mode:?}");
                // What is left of the number is uniform again.
                for (sum, count) in [(rests[0], of_mapped), (rests[1], n - of_mapped)] {
                    assert!(count == 0 || (sum / count as f32 - 0.5).abs() < 0.6 / count as f32 + 1e-4);
                }
            }
        }
    }
}

#[test]
fn the_share_of_the_mapped_face_is_that_of_lambertian_faces() {
    // Midpoints of 400² cells in the projected hemisphere about either normal.
    let side = 400;
    for tilt in tilts().into_iter().filter(|tilt| tilt.remedies.turning) {
        let seen = |face: Face| {
            let frame = tilt.frame(face);
            let cell = |i: u32| (i as f32 + 0.5) / side as f32;
            let directions = (0..side * side)
                .map(|i| sampling::warp::cosine_hemisphere(sampling::Vec2::new(cell(i % side), cell(i / side))))
                .map(|w| frame.to_world(w));
            directions.filter(|w| w.z > 0.0 && tilt.seen_from(*w) == face).count() as f32
        };
        let (mapped, turned) = (seen(Face::Mapped), seen(Face::Turned));
        let (share, expected) = (tilt.share_of_mapped(), mapped / (mapped + turned));
        assert!((share - expected).abs() < 5e-3, "{tilt:?}: {share} {expected}");
    }
}

#[test]
fn what_grazes_a_relief_is_shadowed() {
    let tilt = |tan: f32, remedies| Tilt { normal: vec3(tan, 0.0, 1.0).normalize(), remedies };
    let light = vec3(0.0, 3f32.sqrt(), 1.0).normalize();
    for (tan, alpha_squared) in [(0.0, 0.0), (1.0, 0.125), (2.0, 0.5), (4.0, 1.0)] {
        let expected = 2.0 / (1.0 + (1.0f32 + alpha_squared * 3.0).sqrt());
        let shadowing = tilt(tan, Remedies::default()).shadowing(light);
        assert!((shadowing - expected).abs() < 1e-6, "{tan}: {shadowing} {expected}");
        assert_eq!(tilt(tan, Remedies::NONE).shadowing(light), 1.0);
    }
    assert_eq!(tilt(4.0, Remedies::default()).shadowing(Vec3::X), 0.0);
}

#[test]
fn remedies_have_names() {
    for (name, remedies) in Remedies::NAMES.into_iter().zip(Remedies::ALL) {
        assert_eq!(remedies.name(), name);
    }
    assert_eq!(Remedies::default().name(), "turned_and_shadowed");
}
