use super::*;
use crate::warp::uniform_hemisphere;
use glam::{vec2, vec3};

/// The largest channel of the directional albedo, the mean weight of stratified samples.
fn albedo(model: &Principled, cos: f32) -> f64 {
    const SIDE: u32 = 32;
    let wo = vec3((1.0 - cos * cos).sqrt(), 0.0, cos);
    let choices = 31;
    let (mut sum, golden) = (Spectrum::ZERO, 0.618_034_f32);
    for i in 0..SIDE * SIDE {
        let u = vec2((i % SIDE) as f32 + 0.5, (i / SIDE) as f32 + 0.5) / SIDE as f32;
        for c in 0..choices {
            let uc = ((c as f32 + 0.5) / choices as f32 + golden * i as f32 / choices as f32).fract();
            let sample = model.sample(wo, uc, u, TransportMode::Importance);
            sum += sample.map_or(Spectrum::ZERO, |s| s.weight) / (choices * SIDE * SIDE) as f32;
        }
    }
    f64::from(sum.max_component())
}

/// White surfaces of this index.
fn white(eta: f32) -> PrincipledSettings {
    PrincipledSettings { base_color: Spectrum::ONE, eta, ..Default::default() }
}

/// The largest albedo of such surfaces, over the other parameters and the angles at which it may be largest.
fn largest_albedo(of: PrincipledSettings) -> f64 {
    let mut largest = 0.0_f64;
    for (roughness, subsurface, gain, clearcoat_gloss) in [0.0, 0.6, 1.0]
        .into_iter()
        .flat_map(|r| [0.0, 1.0].map(|s| (r, s)))
        .flat_map(|(r, s)| [(0.0, 1.0), (1.0, 0.0), (1.0, 1.0)].map(|(gain, gloss)| (r, s, gain, gloss)))
    {
        let (sheen, clearcoat) = (gain, gain);
        let model =
            Principled::new(PrincipledSettings { roughness, subsurface, sheen, clearcoat, clearcoat_gloss, ..of });
        for cos in [1.0, 0.5, 0.2, 0.1, 0.05, 0.01, 1e-3, 1e-4] {
            largest = largest.max(albedo(&model, cos));
        }
    }
    largest
}

#[test]
fn the_sum_of_lobes_exceeds_one_by_no_more_than_is_said() {
    let (usual, extreme) = (largest_albedo(white(1.5)), largest_albedo(white(0.01)));
    println!("{usual} {extreme}");
    assert!(usual > 1.5 && usual < 2.0, "{usual}");
    assert!(extreme > 2.6 && extreme < 2.75, "{extreme}");
    // Of the colour with the least luminance.
    let blue = PrincipledSettings {
        base_color: Spectrum::new(0.0, 0.0, 1.0),
        specular_tint: 1.0,
        sheen_tint: 1.0,
        tints: Tints::Luminance,
        ..white(1.5)
    };
    let usual = largest_albedo(blue);
    let extreme = [0.01, 100.0].map(|eta| largest_albedo(PrincipledSettings { eta, ..blue }));
    println!("{usual} {extreme:?}");
    let extreme = extreme[0].max(extreme[1]);
    assert!(usual < extreme && extreme > 15.0 && extreme < f64::from(Principled::MAX_ALBEDO), "{extreme}");
}

#[test]
fn the_clearcoat_is_normalised_and_sampled_by_its_density() {
    const SIDE: u32 = 1024;
    for alpha in [0.1, 0.03] {
        let (mut exact, mut sampled) = ([0.0_f64; 3], [0.0_f64; 3]);
        for i in 0..SIDE * SIDE {
            let u = (vec2((i % SIDE) as f32, (i / SIDE) as f32) + 0.5) / SIDE as f32;
            let m = uniform_hemisphere(u);
            let s = sample_gtr1(alpha, u);
            let density = gtr1(alpha, m) * m.z * std::f32::consts::TAU;
            for (k, g) in [|_: Vec3| 1.0, |m: Vec3| m.z * m.z, |m: Vec3| m.x * m.x].into_iter().enumerate() {
                exact[k] += f64::from(g(m) * density) / f64::from(SIDE * SIDE);
                sampled[k] += f64::from(g(s)) / f64::from(SIDE * SIDE);
            }
        }
        for (exact, sampled) in exact.iter().zip(sampled) {
            assert!((exact - sampled).abs() < 2e-3, "{alpha}: {exact} {sampled}");
        }
    }
}
