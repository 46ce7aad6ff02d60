use super::*;
use crate::rng::Stream;
use crate::warp::SphericalRectangle;
use glam::{dvec3, vec2};
use std::f64::consts::PI;

fn seen(corners: [DVec3; 3]) -> SphericalTriangle {
    let [p, q, r] = corners;
    SphericalTriangle::new(corners, (q - p).cross(r - p))
}

/// Its place of these barycentric coordinates.
fn place([p, q, r]: [DVec3; 3], b: Vec2) -> DVec3 {
    let b = b.as_dvec2();
    p * (1.0 - b.x - b.y) + q * b.x + r * b.y
}

/// Above its middle, beside it, over a corner, slanting, nearly in the plane, all around, thin, and the other way round.
const CASES: [[DVec3; 3]; 8] = [
    [dvec3(-1.0, -0.5, 1.0), dvec3(1.0, -0.6, 1.0), dvec3(0.1, 0.9, 1.0)],
    [dvec3(2.0, 0.5, 1.0), dvec3(3.0, 0.5, 1.2), dvec3(2.3, 1.9, 0.7)],
    [dvec3(0.0, 0.0, 0.3), dvec3(1.0, 0.0, 0.3), dvec3(0.0, 2.0, 0.3)],
    [dvec3(0.4, 0.1, 0.05), dvec3(1.5, 0.1, 1.0), dvec3(0.3, 1.2, 0.2)],
    [dvec3(0.5, -0.2, 0.002), dvec3(1.5, 0.1, 0.002), dvec3(0.4, 0.9, 0.002)],
    [dvec3(-1.0, -0.8, 0.01), dvec3(1.0, -0.9, 0.01), dvec3(0.1, 1.2, 0.01)],
    [dvec3(-1.0, 0.3, 0.4), dvec3(1.0, 0.31, 0.4), dvec3(0.9, 0.33, 0.42)],
    [dvec3(1.0, -0.6, -1.0), dvec3(-1.0, -0.5, -1.0), dvec3(0.1, 0.9, -1.0)],
];

#[test]
fn known_solid_angles() {
    let octant = seen([DVec3::X * 2.0, DVec3::Y * 0.1, DVec3::Z * 7.0]).solid_angle();
    assert!((octant - PI / 2.0).abs() < 1e-15, "{octant}");
    // Half of a cube's side, from its middle.
    let half = seen([dvec3(-1.0, -1.0, 1.0), dvec3(1.0, -1.0, 1.0), dvec3(1.0, 1.0, 1.0)]).solid_angle();
    assert!((half - PI / 3.0).abs() < 1e-15, "{half}");
    let plane = seen([dvec3(-2e9, -1e9, 1.0), dvec3(2e9, -1e9, 1.0), dvec3(0.0, 1e9, 1.0)]).solid_angle();
    assert!((plane - 2.0 * PI).abs() < 1e-8, "{plane}");
}

#[test]
fn two_are_a_rectangle() {
    for (x, y, z) in [([-0.5, 0.5], [-0.7, 0.7], 1.0), ([2.0, 3.0], [-3.0, -2.0], 0.5), ([-0.2, 1.4], [0.3, 0.9], 1e-3)]
    {
        let corner = |i: usize, j: usize| dvec3(x[i], y[j], z);
        let halves = [[corner(0, 0), corner(1, 0), corner(1, 1)], [corner(0, 0), corner(1, 1), corner(0, 1)]];
        let (sum, whole) =
            (halves.map(|half| seen(half).solid_angle()).iter().sum::<f64>(), SphericalRectangle::new(x, y, z));
        assert!((sum / whole.solid_angle() - 1.0).abs() < 1e-12, "{x:?} {y:?} {z}: {sum}");
    }
}

/// What lies between the first corner, the second and where `u.x` leads has that share; what lies along the arcs has that of `u.y`.
#[test]
fn shares_of_the_solid_angle_are_the_random_numbers() {
    let numbers = [0.0, 5.96e-8, 0.1, 0.25, 0.5, 0.8, 0.999, 1.0_f32.next_down()];
    for corners in CASES {
        let triangle = seen(corners);
        let [p, q, _] = corners;
        for u in numbers.iter().flat_map(|&u| numbers.map(|v| vec2(u, v))) {
            let b = triangle.sample(u);
            assert!(b.min_element() >= 0.0 && b.x + b.y <= 1.0, "{corners:?} {u}: {b}");
            let far = triangle.on_the_far_side(f64::from(u.x));
            let share = seen([p, q, far]).solid_angle() / triangle.solid_angle();
            assert!((share - f64::from(u.x)).abs() < 1e-10, "{corners:?} {u}: {share}");
            let [d, second] = [place(corners, b), q].map(DVec3::normalize);
            let versines = (d - second).length_squared() / (far - second).length_squared();
            // A place is rounded to 2⁻²⁴ of the edges, which are seen the larger the nearer.
            let rounding = 2e-7 * (q.length() + corners[2].length()) / place(corners, b).length().min(q.length());
            assert!(
                (versines - f64::from(u.y)).abs() < rounding * 10.0 / (far - second).length(),
                "{corners:?} {u}: {versines}"
            );
        }
    }
}

/// Of places that are met by chance, as many lie in each of its 64 similar parts as its solid angle says: within five standard deviations, of
/// 512 counts one in 3000 such families is beyond by chance.
#[test]
fn places_are_uniform_over_the_solid_angle() {
    const N: usize = 1 << 18;
    let mut random = Stream::new(3, 0);
    for corners in CASES {
        let triangle = seen(corners);
        let mut counts = [0.0_f64; 128];
        for _ in 0..N {
            let b = 8.0 * triangle.sample(vec2(random.next_f32(), random.next_f32()));
            let (x, y) = (b.x.min(7.0) as usize, b.y.min(7.0) as usize);
            counts[(y * 8 + x) * 2 + usize::from(b.x.fract() + b.y.fract() > 1.0)] += 1.0;
        }
        for (i, count) in counts.iter().enumerate() {
            let (x, y, upper) = ((i / 2 % 8) as f32, (i / 16) as f32, i % 2 == 1);
            if x + y + f32::from(u8::from(upper)) >= 8.0 {
                assert!(*count < 3.0, "{corners:?}: {count} of the other half");
                continue;
            }
            let at = |i: f32, j: f32| place(corners, vec2(x + i, y + j) / 8.0);
            let part = if upper {
                [at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]
            } else {
                [at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)]
            };
            let share = seen(part).solid_angle() / triangle.solid_angle();
            let expected = N as f64 * share;
            assert!(
                (count - expected).abs() <= 5.0 * (expected * (1.0 - share)).sqrt(),
                "{corners:?}, {i}: {count} and {expected}"
            );
        }
    }
}

#[test]
fn nothing_depends_on_the_unit_of_length() {
    for corners in CASES {
        let triangle = seen(corners);
        for scale in [2f64.powi(-60), 2f64.powi(60), 1e-6, 1e6] {
            let scaled = seen(corners.map(|corner| corner * scale));
            assert!((scaled.solid_angle() / triangle.solid_angle() - 1.0).abs() < 1e-12, "{scale}");
            assert!(scaled.sample(vec2(0.3, 0.7)).distance(triangle.sample(vec2(0.3, 0.7))) < 1.2e-7, "{scale}");
        }
    }
}
