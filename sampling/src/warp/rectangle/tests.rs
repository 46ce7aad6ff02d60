use super::*;

/// The integral of what falls off with the distance from 0 beyond `scale`, by Gauss's rule of five points on pieces that are as long as
/// they are far off.
fn integral(f: impl Fn(f64) -> f64, [from, to]: [f64; 2], scale: f64) -> f64 {
    const POINTS: [(f64, f64); 5] = [
        (0.0, 128.0 / 225.0),
        (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
        (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let (from, to) = ((from / scale).asinh(), (to / scale).asinh());
    let pieces = ((to - from) / 0.2).ceil().max(1.0);
    let half = 0.5 * (to - from) / pieces;
    let of_piece = |i: usize| -> f64 {
        let middle = from + (2 * i + 1) as f64 * half;
        POINTS.iter().map(|(x, w)| (middle + x * half, w)).map(|(t, w)| w * f(scale * t.sinh()) * t.cosh()).sum()
    };
    half * scale * (0..pieces as usize).map(of_piece).sum::<f64>()
}

/// Solid angle per length of a strip along y at `x` [sr/m]: the integral of cos θ / r².
fn strip(x: f64, y: [f64; 2], z: f64) -> f64 {
    integral(|y| z / (x * x + y * y + z * z).powf(1.5), y, x.hypot(z))
}

fn by_quadrature(x: [f64; 2], y: [f64; 2], z: f64) -> f64 {
    integral(|x| strip(x, y, z), x, z)
}

/// Before one, over a corner, beside one edge, slanting, nearly in the plane, thin either way, far.
const CASES: [([f64; 2], [f64; 2], f64); 9] = [
    ([-0.5, 0.5], [-0.7, 0.7], 1.0),
    ([0.0, 1.0], [0.0, 2.0], 0.3),
    ([-0.2, 1.4], [0.3, 0.9], 0.05),
    ([2.0, 3.0], [-3.0, -2.0], 0.5),
    ([-3.0, -2.0], [-0.1, 0.5], 0.01),
    ([-0.5, 0.5], [-0.4, 0.6], 0.01),
    ([1.0, 1.02], [-0.5, 0.5], 0.1),
    ([-0.5, 0.5], [0.2, 0.22], 0.1),
    ([2.5, 3.5], [1.5, 2.5], 3.0),
];

#[test]
fn solid_angles_are_those_of_quadrature() {
    for (x, y, z) in CASES {
        let (found, exact) = (SphericalRectangle::new(x, y, z).solid_angle(), by_quadrature(x, y, z));
        assert!((found / exact - 1.0).abs() < 1e-9, "{x:?} {y:?} {z}: {found} and {exact}");
    }
    // A side of a cube seen from its middle is a sixth of all directions; a half space is 2π.
    let side = SphericalRectangle::new([-1.0, 1.0], [-1.0, 1.0], 1.0).solid_angle();
    assert!((side - 4.0 * std::f64::consts::PI / 6.0).abs() < 1e-14);
    let half = SphericalRectangle::new([-1e9, 1e9], [-1e9, 1e9], 1.0).solid_angle();
    assert!((half - 2.0 * std::f64::consts::PI).abs() < 1e-8);
}

#[test]
fn places_are_uniform_over_the_solid_angle() {
    let shares = [0.0, 5.96e-8, 0.1, 0.25, 0.5, 0.8, 0.999, 1.0_f32.next_down()];
    for (x, y, z) in CASES {
        let seen = SphericalRectangle::new(x, y, z);
        for u in shares.iter().flat_map(|&u| shares.map(|v| vec2(u, v))) {
            let b = seen.sample(u);
            assert!(b.min_element() >= 0.0 && b.max_element() < 1.0, "{x:?} {y:?} {z} {u}: {b}");
            let at = |share: f32, [from, to]: [f64; 2]| from + f64::from(share) * (to - from);
            let (px, py) = (at(b.x, x), at(b.y, y));
            let columns = by_quadrature([x[0], px], y, z) / seen.solid_angle();
            // A place is rounded to 2⁻²⁴ of its side, over which the solid angle is the denser the nearer the plane.
            let rounding = 6e-8 * (1.0 + (x[1] - x[0]) * strip(px, y, z) / seen.solid_angle());
            assert!((columns - f64::from(u.x)).abs() < rounding, "{x:?} {y:?} {z} {u}: {columns}");
            let whole = strip(px, y, z);
            let rows = strip(px, [y[0], py], z) / whole;
            let density = z / (px * px + py * py + z * z).powf(1.5);
            let rounding = 6e-8 * (1.0 + (y[1] - y[0]) * density / whole);
            assert!((rows - f64::from(u.y)).abs() < rounding, "{x:?} {y:?} {z} {u}: {rows}");
        }
    }
}

/// As thin, and as near to the plane, as emitters are sampled by it.
#[test]
fn the_thinnest_and_most_slanting_keep_their_shares() {
    let z = 1e-3;
    for (x, y) in [([-1.0, 1.0], [-0.015, 0.017]), ([2.0, 4.0], [0.5, 0.532]), ([-0.02, 0.012], [-5.0, -3.0])] {
        let seen = SphericalRectangle::new(x, y, z);
        let mut last = -1.0;
        for i in 0..=1000 {
            let share = f64::from(i) / 1000.0;
            let column = seen.column(share);
            let back = (filled(column, y, z) - seen.before) / seen.solid_angle();
            assert!((back - share).abs() < 2e-6, "{x:?} {y:?}: {share} became {back}");
            assert!(column > last || i == 0, "{x:?} {y:?}: {column} after {last}");
            last = column;
        }
    }
}

#[test]
fn nothing_depends_on_the_unit_of_length() {
    for (x, y, z) in CASES {
        let seen = SphericalRectangle::new(x, y, z);
        for scale in [2f64.powi(-60), 2f64.powi(60), 1e-6, 1e6] {
            let scaled = SphericalRectangle::new(x.map(|x| x * scale), y.map(|y| y * scale), z * scale);
            assert!((scaled.solid_angle() / seen.solid_angle() - 1.0).abs() < 1e-11, "{scale}");
            let u = vec2(0.3, 0.7);
            assert!(scaled.sample(u).distance(seen.sample(u)) < 1.2e-7, "{scale}");
            if scale.log2().fract() == 0.0 {
                assert_eq!(scaled.solid_angle().to_bits(), seen.solid_angle().to_bits());
            }
        }
    }
}
