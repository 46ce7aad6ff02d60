use super::*;
use crate::bsdf::{Lambert, Mirror, RoughConductor};
use crate::rng::Stream;
use crate::warp;
use std::f32::consts::PI;

const MODE: TransportMode = TransportMode::Radiance;

fn normals() -> [Vec3; 4] {
    [vec3(0.1, 0.0, 1.0), vec3(-0.4, 0.3, 1.0), vec3(0.0, 1.5, 1.0), vec3(3.0, -2.0, 1.0)].map(Vec3::normalize)
}

fn models() -> Vec<Bsdf> {
    let reflects = |bsdf: &Bsdf| !bsdf.lobes().intersects(Lobes::TRANSMISSION);
    let mut models: Vec<Bsdf> = Bsdf::all_examples().into_iter().map(|(_, bsdf)| bsdf).filter(reflects).collect();
    // A value that moves by more than its size within the rounding of a direction cannot be compared with itself.
    models.retain(|bsdf| bsdf.lobes().is_delta() || is_broad(bsdf));
    assert!(models.len() > 20, "{}", models.len());
    models
}

fn is_broad(bsdf: &Bsdf) -> bool {
    let wo = vec3(0.3, 0.2, 0.9).normalize();
    let mirrored = vec3(-wo.x, -wo.y, wo.z);
    bsdf.pdf(wo, mirrored, MODE) < 30.0
}

fn direction(stream: &mut Stream) -> Vec3 {
    warp::uniform_sphere(Vec2::new(stream.next_f32(), stream.next_f32()))
}

/// Stratified directions of the upper hemisphere, uniform in it.
fn hemisphere(side: u32) -> impl Iterator<Item = Vec3> {
    let cell = move |i: u32| (i as f32 + 0.5) / side as f32;
    (0..side * side).map(move |i| warp::uniform_hemisphere(Vec2::new(cell(i % side), cell(i / side))))
}

#[test]
fn it_is_reciprocal_and_dark_across_the_surface() {
    let mut stream = Stream::new(1, 1);
    for bsdf in models() {
        for normal in normals() {
            let tilted = Tilted::new(&bsdf, normal);
            for _ in 0..200 {
                let (wo, wi) = (direction(&mut stream), direction(&mut stream));
                let (there, back) = (tilted.eval(wo, wi, Lobes::ALL, MODE), tilted.eval(wi, wo, Lobes::ALL, MODE));
                for (a, b) in there.to_array().into_iter().zip(back.to_array()) {
                    assert!((a - b).abs() <= 5e-3 * a.max(b) + 1e-5, "{bsdf:?} {normal} {wo} {wi}: {a} {b}");
                }
                if wo.z * wi.z < 0.0 {
                    assert!(there.is_zero() && tilted.pdf(wo, wi, MODE) == 0.0);
                }
            }
        }
    }
}

#[test]
fn untilted_it_is_the_model() {
    let bsdf = Bsdf::from(Lambert { albedo: Spectrum::splat(0.6) });
    let tilted = Tilted::new(&bsdf, Vec3::Z);
    let mut stream = Stream::new(2, 1);
    for _ in 0..1000 {
        let (wo, wi) = (direction(&mut stream), direction(&mut stream));
        let (value, expected) = (tilted.eval(wo, wi, Lobes::ALL, MODE), bsdf.eval(wo, wi, Lobes::ALL, MODE));
        assert!((value.mean() - expected.mean()).abs() < 1e-6, "{wo} {wi}: {value:?} {expected:?}");
    }
}

/// What a white Lambertian face sends out of its groove, by following light through it face by face: an independent account of
/// the same groove, in which light that goes by other ways than the three is dropped.
fn walked_albedo(normal: Vec3, wo: Vec3, walks: u32) -> (f64, f64) {
    let cos = normal.z;
    let tan = (1.0 - cos * cos).sqrt() / cos;
    let upright = -vec3(normal.x, normal.y, 0.0).normalize();
    let seen = |w: Vec3| (w.dot(normal).max(0.0) / cos, w.dot(upright).max(0.0) * tan);
    let leaves = |w: Vec3| if w.z <= 0.0 { 0.0 } else { w.z / (seen(w).0 + seen(w).1) };
    let mirrored = |w: Vec3| w - upright * (2.0 * w.dot(upright));
    let mut stream = Stream::new(3, 1);
    let mut out = 0u32;
    for _ in 0..walks {
        let (face, other) = seen(wo);
        let by_upright = stream.next_f32() * (face + other) >= face;
        let from_face = warp::cosine_hemisphere(Vec2::new(stream.next_f32(), stream.next_f32()));
        let w = Frame::from_z(normal).to_world(from_face);
        let free = stream.next_f32() < leaves(w);
        // Off the face and out; or, if it came straight to the face, by the upright face and then out.
        let last = mirrored(w);
        out += u32::from(free || (!by_upright && stream.next_f32() < leaves(last)));
    }
    let mean = f64::from(out) / f64::from(walks);
    (mean, (mean * (1.0 - mean) / f64::from(walks)).sqrt())
}

#[test]
fn its_albedo_is_that_of_a_walk_in_the_groove() {
    // 16 comparisons at 4.5 standard errors: a false alarm in 10 000 runs; the quadrature adds at most 10⁻³.
    let bsdf = Bsdf::from(Lambert { albedo: Spectrum::ONE });
    for normal in normals() {
        let tilted = Tilted::new(&bsdf, normal);
        for wo in [vec3(0.0, 0.0, 1.0), vec3(0.9, 0.1, 0.3), vec3(-0.9, 0.3, 0.1), vec3(0.2, -0.7, 0.6)] {
            let wo = wo.normalize();
            let side = 400;
            let sum: f64 =
                hemisphere(side).map(|wi| f64::from(tilted.eval(wo, wi, Lobes::ALL, MODE).mean() * wi.z)).sum();
            let albedo = sum * 2.0 * f64::from(PI) / f64::from(side * side);
            let (walked, error) = walked_albedo(normal, wo, 200_000);
            assert!((albedo - walked).abs() < 4.5 * error + 1e-3, "{normal} {wo}: {albedo} {walked} ± {error}");
        }
    }
}

#[test]
fn the_density_is_that_of_its_samples() {
    // Means of 1/pdf·g over samples against the integral of g, g = cos: 5 standard errors, 12 comparisons: 1 in 150 000.
    let rough = Bsdf::from(RoughConductor::from_reflectance(Spectrum::splat(0.8), 0.5, 0.5));
    let lambert = Bsdf::from(Lambert { albedo: Spectrum::ONE });
    for bsdf in [rough, lambert] {
        for normal in normals().into_iter().take(3) {
            let tilted = Tilted::new(&bsdf, normal);
            for wo in [vec3(0.3, 0.1, 0.9).normalize(), vec3(-0.8, 0.5, -0.4).normalize()] {
                let mut stream = Stream::new(4, 1);
                let n = 200_000;
                let (mut sum, mut squares) = (0.0f64, 0.0f64);
                for _ in 0..n {
                    let uc = stream.next_f32();
                    let u = Vec2::new(stream.next_f32(), stream.next_f32());
                    let weight = tilted.sample(wo, uc, u, MODE).map_or(0.0, |sample| {
                        assert!(sample.wi.z * wo.z > 0.0 && sample.weight.is_finite());
                        f64::from(sample.weight.mean())
                    });
                    (sum, squares) = (sum + weight, squares + weight * weight);
                }
                let mean = sum / f64::from(n);
                let error = ((squares / f64::from(n) - mean * mean) / f64::from(n)).sqrt();
                let side = 600;
                let turned = if wo.z < 0.0 { -1.0 } else { 1.0 };
                let albedo: f64 = hemisphere(side)
                    .map(|wi| vec3(wi.x, wi.y, wi.z * turned))
                    .map(|wi| f64::from(tilted.eval(wo, wi, Lobes::ALL, MODE).mean() * wi.z.abs()))
                    .sum::<f64>()
                    * 2.0
                    * f64::from(PI)
                    / f64::from(side * side);
                assert!(
                    (mean - albedo).abs() < 5.0 * error + 1e-3,
                    "{bsdf:?} {normal} {wo}: {mean} ± {error}, {albedo}"
                );
            }
        }
    }
}

#[test]
fn a_mirror_reflects_no_more_than_it_receives() {
    let mirror = Bsdf::from(Mirror { reflectance: Spectrum::ONE });
    for normal in normals() {
        let tilted = Tilted::new(&mirror, normal);
        for wo in hemisphere(12) {
            let ways = [Way::Face, Way::FaceThenUpright, Way::UprightThenFace];
            let mut from = 0.0;
            let reflected: f32 = ways
                .into_iter()
                .map(|way| {
                    let width = tilted.probability(way);
                    let uc = from + width / 2.0;
                    from += width;
                    tilted.sample(wo, uc, Vec2::splat(0.5), MODE).map_or(0.0, |s| s.weight.mean() * width)
                })
                .sum();
            assert!(reflected < 1.0 + 1e-5, "{normal} {wo}: {reflected}");
        }
    }
}

#[test]
fn a_mirror_reflects_what_the_smoothest_metals_do() {
    let mean_albedo = |bsdf: &Bsdf, normal: Vec3| {
        let tilted = Tilted::new(bsdf, normal);
        let mut stream = Stream::new(5, 1);
        let n = 200_000;
        let sum: f64 = (0..n)
            .map(|_| {
                let [a, b, uc, x, y] = std::array::from_fn(|_| stream.next_f32());
                let wo = crate::warp::cosine_hemisphere(Vec2::new(a, b));
                tilted.sample(wo, uc, Vec2::new(x, y), MODE).map_or(0.0, |s| f64::from(s.weight.mean()))
            })
            .sum();
        sum / f64::from(n)
    };
    let mirror = Bsdf::from(Mirror { reflectance: Spectrum::ONE });
    let metal = Bsdf::from(RoughConductor::from_reflectance(Spectrum::ONE, 1e-3, 1e-3));
    for normal in normals() {
        let [smooth, rough] = [&mirror, &metal].map(|bsdf| mean_albedo(bsdf, normal));
        // By the same random numbers, so that only the metal's width tells them apart.
        assert!((smooth - rough).abs() < 0.01 * smooth && smooth > 0.01, "{normal}: {smooth} {rough}");
    }
}
