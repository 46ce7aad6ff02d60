//! Light on one spot of a half-space, and how it spreads.

use super::*;
use sampling::vec3;

/// How far the emitter is above the floor [m].
const HEIGHT: f64 = 0.005;
/// The distances at which radiance is tabulated [m].
const FARTHEST: f64 = 0.2;
const ENTRIES: usize = 600;

/// The radiant exitance that a point emitter of intensity 1 close above the origin makes at distances of 0 to [`FARTHEST`], of the
/// channels' mean, for what the boundary lets through at once: ∫ R(|xo − xi|) T(θi) cos θi / (d² c π) dxi · π.
///
/// In polar coordinates about xo the density R loses its pole: r R(r) is smooth.
fn exitances(stuff: Stuff) -> Vec<f64> {
    let transmittance = f64::from(sampling::bsdf::diffuse_transmittance(stuff.eta as f32));
    let entering = |x: f64, y: f64| {
        let d2 = x * x + y * y + HEIGHT * HEIGHT;
        let cos = HEIGHT / d2.sqrt();
        (1.0 - stuff.reflected(cos)) * cos / (d2 * transmittance)
    };
    let (step, angles) = (0.2 * HEIGHT, 256);
    let radii: Vec<f64> = (0..700).map(|i| (i as f64 + 0.5) * step).collect();
    let profile: Vec<f64> = radii
        .iter()
        .map(|&r| {
            (0..3).map(|channel| stuff.reflectance(channel, r)).sum::<f64>() / 3.0 * r * step * TAU / angles as f64
        })
        .collect();
    (0..=ENTRIES)
        .map(|entry| {
            let x = FARTHEST * entry as f64 / ENTRIES as f64;
            let ring = |(r, weight): (&f64, &f64)| {
                // By symmetry, half of the circle.
                let half = (0..angles / 2).map(|k| {
                    let angle = TAU * (k as f64 + 0.5) / angles as f64;
                    entering(x + r * angle.cos(), r * angle.sin())
                });
                2.0 * weight * half.sum::<f64>()
            };
            radii.iter().zip(&profile).map(ring).sum()
        })
        .collect()
}

/// What a spot of light makes of its surroundings is the profile R, blurred by the spot's width.
#[test]
fn a_spot_of_light_spreads_as_the_profile_says() {
    let stuff = Stuff { albedo: [0.7, 0.9, 0.5], mean_free_path: [0.02, 0.03, 0.04], eta: 1.3 };
    let exitances = exitances(stuff);
    let mut builder = SceneBuilder::new("searchlight");
    let material = builder.material(stuff.material());
    floor(&mut builder, DVec3::ZERO, material);
    builder.point_emitter(dvec3(0.0, HEIGHT, 0.0), Spectrum::ONE);
    // The image is 0.08 wide, from 0.01 beside the spot on.
    builder.camera(camera(dvec3(0.05, 1.0, 0.04), dvec3(0.05, 0.0, 0.04), 4.58, SIZE));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let truth = Truth::new(&scene, |hit, ray| {
        let place = f64::from((hit.point.p + scene.origin.as_vec3()).reject_from(vec3(0.0, 1.0, 0.0)).length());
        let position = place / FARTHEST * ENTRIES as f64;
        let (entry, part) = (position as usize, position.fract());
        let exitance = exitances[entry] * (1.0 - part) + exitances[entry + 1] * part;
        vec![0.0, (1.0 - stuff.reflected(cos_seen(hit, ray))) * exitance / PI, 0.0]
    });
    let mut family = Family::new("searchlight");
    truth.compare(&mut family, "path", method("path").as_ref(), Budget::samples(1024), 4);
    family.finish(0.9);
}
