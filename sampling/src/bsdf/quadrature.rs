//! One-dimensional integrals for tables, by Gauss's rule.

/// Nodes and weights of Gauss's rule of five points on [0, 1].
pub const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668_0, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_2),
    (0.5, 0.284_444_444_444_444_4),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_2),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];

/// ∫ f over [from, to], cut into equal panels.
pub fn integrate(from: f64, to: f64, panels: usize, mut f: impl FnMut(f64) -> f64) -> f64 {
    let width = (to - from) / panels as f64;
    let mut sum = 0.0;
    for panel in 0..panels {
        for (node, weight) in GAUSS {
            sum += weight * f(from + width * (panel as f64 + node));
        }
    }
    sum * width
}

/// The same, with nodes that crowd towards both ends: for an `f` with layers or roots there.
pub fn integrate_towards_ends(from: f64, to: f64, panels: usize, mut f: impl FnMut(f64) -> f64) -> f64 {
    integrate(0.0, 1.0, panels, |s| {
        let slope = 6.0 * s * (1.0 - s);
        slope * f(from + (to - from) * (s * s * (3.0 - 2.0 * s)))
    }) * (to - from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_and_layers_are_integrated() {
        assert!((integrate(0.0, 2.0, 1, |x| x.powi(9)) - 102.4).abs() < 1e-10);
        assert!((integrate_towards_ends(0.0, 1.0, 8, f64::sqrt) - 2.0 / 3.0).abs() < 1e-6);
    }
}
