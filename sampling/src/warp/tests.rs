use super::*;
use crate::rng::Stream;
use std::f64::consts::TAU as TAU64;

const SIDE: usize = 512;

/// The centres of a SIDE × SIDE grid on the unit square.
fn grid() -> impl Iterator<Item = Vec2> {
    (0..SIDE * SIDE).map(|i| (vec2((i % SIDE) as f32, (i / SIDE) as f32) + 0.5) / SIDE as f32)
}

/// Numbers at and next to the borders of the unit square.
fn borders() -> impl Iterator<Item = Vec2> {
    let edge = [0.0, f32::MIN_POSITIVE, 5.96e-8, 0.25, 0.5_f32.next_down(), 0.5, 0.75, 1.0_f32.next_down()];
    edge.into_iter().flat_map(move |x| edge.into_iter().map(move |y| vec2(x, y)))
}

/// χ² of uniform points, warped, in cells of equal probability; z > 6 has probability 1e-7 by chance.
///
/// Too even a filling is no failure: z is bounded from above only.
fn assert_fills_evenly(name: &str, cell: impl Fn(Vec2) -> usize) {
    const CELLS: usize = 256;
    const POINTS: usize = 1 << 20;
    let mut counts = vec![0_u32; CELLS];
    let mut stream = Stream::new(0x51a7, 1);
    for _ in 0..POINTS {
        let x = stream.next_f32();
        counts[cell(vec2(x, stream.next_f32()))] += 1;
    }
    let expected = (POINTS / CELLS) as f64;
    let chi2: f64 = counts.iter().map(|&count| (f64::from(count) - expected).powi(2) / expected).sum();
    let freedom = (CELLS - 1) as f64;
    let z = (chi2 - freedom) / (2.0 * freedom).sqrt();
    assert!(z < 6.0, "{name}: z = {z}");
}

/// The cell of (t, φ) for t in [0, 1] that must be uniform and an angle that must be.
fn cell_of(t: f32, x: f32, y: f32) -> usize {
    let turns = (f64::from(y).atan2(f64::from(x)) / TAU64).rem_euclid(1.0);
    let ring = ((t * 16.0) as usize).min(15);
    ring * 16 + ((turns * 16.0) as usize).min(15)
}

#[test]
fn polynomials_are_within_their_stated_error() {
    for i in 0..=1 << 20 {
        let u = i as f32 / (1 << 20) as f32;
        let (s, c) = sin_cos_turns(u);
        let (s64, c64) = (TAU64 * f64::from(u)).sin_cos();
        assert!((f64::from(s) - s64).abs() < 2e-7 && (f64::from(c) - c64).abs() < 2e-7, "{u}: {s} {c}");
        let x = (u * 2.0 - 1.0) * FRAC_PI_4;
        let (s, c) = sin_cos_octant(x);
        let (s64, c64) = f64::from(x).sin_cos();
        assert!((f64::from(s) - s64).abs() < 1.2e-7 && (f64::from(c) - c64).abs() < 1.2e-7, "{x}: {s} {c}");
    }
    assert_eq!(sin_cos_turns(0.0), (0.0, 1.0));
    assert!(sin_cos_turns(1.0_f32.next_down()).0 < 0.0);
}

#[test]
fn discs_are_filled_evenly() {
    assert_fills_evenly("disc", |u| {
        let p = uniform_disk(u);
        cell_of(p.length_squared(), p.x, p.y)
    });
}

#[test]
fn hemispheres_spheres_and_cones_are_filled_evenly() {
    assert_fills_evenly("cosine hemisphere", |u| {
        let w = cosine_hemisphere(u);
        cell_of(1.0 - w.z * w.z, w.x, w.y)
    });
    assert_fills_evenly("uniform hemisphere", |u| {
        let w = uniform_hemisphere(u);
        cell_of(1.0 - w.z, w.x, w.y)
    });
    assert_fills_evenly("uniform sphere", |u| {
        let w = uniform_sphere(u);
        cell_of(0.5 * (1.0 - w.z), w.x, w.y)
    });
    for one_minus_cos_max in [0.01, 0.3, 1.0, 1.7, 2.0] {
        assert_fills_evenly("cone", |u| {
            let w = uniform_cone(u, one_minus_cos_max);
            cell_of((1.0 - w.z) / one_minus_cos_max, w.x, w.y)
        });
    }
}

#[test]
fn triangles_are_filled_evenly() {
    // (1 − b2)² and b0 / (b0 + b1) are independent and uniform.
    assert_fills_evenly("triangle", |u| {
        let b = uniform_triangle(u);
        let (s, t) = ((b.x + b.y) * (b.x + b.y), b.x / (b.x + b.y));
        ((s * 16.0) as usize).min(15) * 16 + ((t * 16.0) as usize).min(15)
    });
}

#[test]
fn densities_integrate_to_one() {
    let n = 4096;
    let cosine: f64 = (0..n)
        .map(|i| f64::from(cosine_hemisphere_pdf(2.0 * (i as f32 + 0.5) / n as f32 - 1.0)) * TAU64 * 2.0 / f64::from(n))
        .sum();
    assert!((cosine - 1.0).abs() < 1e-6, "{cosine}");
    assert!((f64::from(uniform_sphere_pdf()) * 2.0 * TAU64 - 1.0).abs() < 1e-6);
    assert!((f64::from(uniform_hemisphere_pdf()) * TAU64 - 1.0).abs() < 1e-6);
    assert!((f64::from(uniform_disk_pdf_area()) * TAU64 / 2.0 - 1.0).abs() < 1e-6);
    for one_minus_cos_max in [1e-12, 1e-3, 1.0, 2.0] {
        let solid_angle = TAU64 * f64::from(one_minus_cos_max);
        assert!((f64::from(uniform_cone_pdf(one_minus_cos_max)) * solid_angle - 1.0).abs() < 1e-6);
    }
    assert_eq!(uniform_triangle_pdf_area(0.25), 4.0);
}

#[test]
fn directions_are_unit_and_where_they_should_be() {
    for u in borders().chain(grid()) {
        let p = uniform_disk(u);
        assert!(p.length_squared() < 1.0 + 1e-6, "{u}");
        for (w, lowest) in [
            (cosine_hemisphere(u), 3e-4),
            (uniform_hemisphere(u), 0.0),
            (power_cosine_hemisphere(u, 0.0), 0.0),
            (power_cosine_hemisphere(u, 1e5), 0.0),
            (uniform_sphere(u), -1.0),
            (uniform_cone(u, 0.5), 0.5),
        ] {
            assert!((w.length() - 1.0).abs() < 1e-6, "{u}: {w}");
            assert!(w.z >= lowest, "{u}: {w}");
        }
        let b = uniform_triangle(u);
        assert!(b.min_element() >= 0.0 && (b.element_sum() - 1.0).abs() < 1e-6, "{u}: {b}");
    }
}

#[test]
fn cones_of_tiny_angles_keep_their_shape() {
    for sin in [1e-2_f32, 1e-4, 1e-6, 1e-9] {
        let one_minus_cos_max = one_minus_cos(sin * sin);
        let exact = {
            let sin = f64::from(sin);
            sin * sin / (1.0 + (1.0 - sin * sin).sqrt())
        };
        assert!((f64::from(one_minus_cos_max) / exact - 1.0).abs() < 3e-7, "{sin}");
        assert_fills_evenly("tiny cone", |u| {
            let w = uniform_cone(u, one_minus_cos_max);
            let r2 = (w.x / sin).powi(2) + (w.y / sin).powi(2);
            // The area of the cap is uniform in 1 − cos, which for these angles is sin²/2 to 1e-4.
            cell_of(r2, w.x, w.y)
        });
    }
}

#[test]
fn powers_of_cosines_fill_their_lobes_evenly() {
    for n in [0.0_f32, 1.0, 7.5, 1e5] {
        assert_fills_evenly("power of a cosine", |u| {
            let w = power_cosine_hemisphere(u, n);
            // 1 − cosⁿ⁺¹θ is uniform; of a narrow lobe, by way of sin²θ.
            let r2 = -(0.5 * (n + 1.0) * (-(w.x * w.x + w.y * w.y)).ln_1p()).exp_m1();
            cell_of(r2, w.x, w.y)
        });
    }
}

#[test]
fn linear_densities_have_their_shares() {
    for (a, b) in [(1.0_f32, 1.0), (0.0, 1.0), (1.0, 0.0), (3.0, 2.999_999), (1e-6, 1e6), (1e6, 1e-6)] {
        for u in (0..=64).map(|i| i as f32 / 64.0) {
            let x = f64::from(linear(u, a, b));
            let (a, b) = (f64::from(a), f64::from(b));
            let share = (a * x + 0.5 * (b - a) * x * x) / (0.5 * (a + b));
            assert!((share - f64::from(u)).abs() < 3e-7, "{a} {b} {u}: {x} {share}");
        }
    }
}

#[test]
fn turns_lead_back() {
    for i in 0..4096 {
        let u = i as f32 / 4096.0;
        let (sin, cos) = sin_cos_turns(u);
        let back = turns(sin, cos);
        assert!((0.0..1.0).contains(&back), "{back} for {u}");
        let off = (back - u).abs();
        assert!(off.min(1.0 - off) < 2e-7, "{back} for {u}");
    }
    // Just below the whole is not the whole.
    assert!(turns(-1e-30, 1.0) < 1.0 && turns(-1e-30, 1.0) > 0.999);
    assert_eq!((turns(0.0, 1.0), turns(1.0, 0.0), turns(0.0, -1.0), turns(-1.0, 0.0)), (0.0, 0.25, 0.5, 0.75));
}

#[test]
fn parts_are_chosen_by_their_sizes_and_numbers_shared_out() {
    // Sizes 1, 0, 2 and 5 of 8: the second is never chosen, and within a part the number left runs from 0 to 1.
    let cumulative = [1.0, 1.0, 3.0, 8.0];
    for i in 0..8000 {
        let u = (i as f32 + 0.5) / 8000.0;
        let (index, rest) = choose(&cumulative, u);
        let (expected, from, size) = if i < 1000 {
            (0, 0.0, 1.0)
        } else if i < 3000 {
            (2, 1.0, 2.0)
        } else {
            (3, 3.0, 5.0)
        };
        assert_eq!(index, expected, "{u}");
        assert!((rest - (8.0 * u - from) / size).abs() < 1e-5 && rest < 1.0, "{rest} for {u}");
    }
    assert_eq!(choose(&[2.0], 0.25), (0, 0.25));
    assert_eq!((choose(&cumulative, 0.0), choose(&cumulative, 0.125)), ((0, 0.0), (2, 0.0)));
}
