//! Functions on a triangle: what irradiance is a sum of on an element.
//!
//! In the barycentric coordinates (s, t) of the vertices 1 and 2: `1`, `√18 (s − ⅓)` and `√24 (t − ⅓ + ½(s − ⅓))`. They are orthonormal
//! in the mean over the triangle, whatever its shape, so that the coefficients of a function f are the means of f φ.
//! A triangle is divided by the midpoints of its edges. The coordinates of each quarter are `(s, t) = at + scale · (s′, t′)`, the scale
//! being ½ or, for that in the middle, which is turned round, −½; functions of the whole are functions of the same kind on a quarter.

use glam::DVec2;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_1_SQRT_2;

/// What irradiance is on an element.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// A constant.
    Constant,
    /// A linear function, which need not go on in the next element.
    #[default]
    Linear,
}

impl Basis {
    /// Number of functions on an element.
    pub fn size(self) -> usize {
        match self {
            Self::Constant => 1,
            Self::Linear => 3,
        }
    }

    /// The function of this basis nearest to a linear one.
    pub fn nearest(self, of: Function) -> Function {
        match self {
            Self::Constant => [of[0], 0.0, 0.0],
            Self::Linear => of,
        }
    }
}

/// The first `B` functions, 1 or 3, at a point.
#[inline]
pub fn functions<const B: usize>(at: DVec2) -> [f64; B] {
    let (s, t) = (at.x - 1.0 / 3.0, at.y - 1.0 / 3.0);
    let all = [1.0, 6.0 * FRAC_1_SQRT_2 * s, 24f64.sqrt() * (t + 0.5 * s)];
    std::array::from_fn(|i| all[i])
}

/// The value of a function that has these coefficients, at most three.
#[inline]
pub fn value(coefficients: &[[f64; 3]], at: DVec2) -> [f64; 3] {
    let functions = functions::<3>(at);
    let mut sum = [0.0; 3];
    for (coefficient, function) in coefficients.iter().zip(functions) {
        sum.iter_mut().zip(coefficient).for_each(|(sum, c)| *sum += c * function);
    }
    sum
}

/// A function on an element: its coefficients, of which those after the first are zero if it is constant.
pub type Function = [f64; 3];

/// The function nearest to the product of two.
pub fn product(a: &Function, b: &Function) -> Function {
    let mut sum = [0.0; 3];
    // Exact: the integrand is of degree 3.
    for (at, weight) in SIX {
        let functions = functions::<3>(at);
        let value = |f: &Function| (0..3).map(|i| f[i] * functions[i]).sum::<f64>();
        let both = weight * value(a) * value(b);
        sum.iter_mut().zip(functions).for_each(|(sum, f)| *sum += both * f);
    }
    sum
}

/// Its values at the vertices.
pub fn corners(of: &Function) -> [f64; 3] {
    [DVec2::ZERO, DVec2::X, DVec2::Y].map(|at| (0..3).map(|i| of[i] * functions::<3>(at)[i]).sum())
}

/// Where the coordinates of a triangle's part lie in those of the triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Where its vertex 0 is.
    pub at: DVec2,
    /// What its own coordinates are multiplied by: ± a power of ½.
    pub scale: f64,
}

/// The whole.
pub const WHOLE: Part = Part { at: DVec2::ZERO, scale: 1.0 };

/// The quarters, in order: at the vertices 0, 1 and 2, and in the middle.
pub const QUARTERS: [Part; 4] = [
    Part { at: DVec2::ZERO, scale: 0.5 },
    Part { at: DVec2::new(0.5, 0.0), scale: 0.5 },
    Part { at: DVec2::new(0.0, 0.5), scale: 0.5 },
    Part { at: DVec2::new(0.5, 0.5), scale: -0.5 },
];

impl Part {
    /// The coordinates in the whole of a point of the part.
    #[inline]
    pub fn point(&self, own: DVec2) -> DVec2 {
        self.at + own * self.scale
    }

    /// A quarter of it.
    pub fn quarter(&self, quarter: usize) -> Self {
        let Part { at, scale } = QUARTERS[quarter];
        Self { at: self.point(at), scale: self.scale * scale }
    }
}

/// The quarter that has a point, and the point's coordinates there.
#[inline]
pub fn quarter_of(at: DVec2) -> (usize, DVec2) {
    let quarter = match at {
        _ if at.x + at.y <= 0.5 => 0,
        _ if at.x >= 0.5 => 1,
        _ if at.y >= 0.5 => 2,
        _ => 3,
    };
    let Part { at: from, scale } = QUARTERS[quarter];
    (quarter, (at - from) / scale)
}

/// The linear function nearest to one that is linear on each quarter: `quarters` has the coefficients there.
pub fn projected(quarters: [[f64; 3]; 4]) -> [f64; 3] {
    let mut whole = [0.0; 3];
    for (part, own) in QUARTERS.iter().zip(quarters) {
        let centre = functions::<3>(part.point(DVec2::splat(1.0 / 3.0)));
        whole[0] += 0.25 * own[0];
        (1..3).for_each(|a| whole[a] += 0.25 * (centre[a] * own[0] + part.scale * own[a]));
    }
    whole
}

/// The coefficients of a linear function on a quarter.
pub fn restricted(whole: [f64; 3], quarter: usize) -> [f64; 3] {
    let part = &QUARTERS[quarter];
    let centre = functions::<3>(part.point(DVec2::splat(1.0 / 3.0)));
    [whole[0] + whole[1] * centre[1] + whole[2] * centre[2], part.scale * whole[1], part.scale * whole[2]]
}

/// Points of a triangle and their weights, which sum to one.
pub type Rule<const N: usize> = [(DVec2, f64); N];

/// Exact for polynomials of degree 2.
pub const THREE: Rule<3> = {
    const NEAR: f64 = 1.0 / 6.0;
    const FAR: f64 = 2.0 / 3.0;
    const WEIGHT: f64 = 1.0 / 3.0;
    [(DVec2::new(NEAR, NEAR), WEIGHT), (DVec2::new(FAR, NEAR), WEIGHT), (DVec2::new(NEAR, FAR), WEIGHT)]
};

/// Exact for polynomials of degree 4 \[Dunavant85\].
pub const SIX: Rule<6> = {
    const A: f64 = 0.445_948_490_915_965;
    const B: f64 = 0.091_576_213_509_771;
    const OF_A: f64 = 0.223_381_589_678_011;
    const OF_B: f64 = 1.0 / 3.0 - OF_A;
    [
        (DVec2::new(A, A), OF_A),
        (DVec2::new(1.0 - 2.0 * A, A), OF_A),
        (DVec2::new(A, 1.0 - 2.0 * A), OF_A),
        (DVec2::new(B, B), OF_B),
        (DVec2::new(1.0 - 2.0 * B, B), OF_B),
        (DVec2::new(B, 1.0 - 2.0 * B), OF_B),
    ]
};

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean over the triangle of `s^m t^n` is `2 m! n! / (m + n + 2)!`.
    #[test]
    fn rules_are_exact_to_their_degrees() {
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        for (rule, degree) in [(THREE.as_slice(), 2), (SIX.as_slice(), 4)] {
            for (m, n) in (0..=degree).flat_map(|m| (0..=degree - m).map(move |n| (m, n))) {
                let mean: f64 = rule.iter().map(|(at, weight)| weight * at.x.powi(m) * at.y.powi(n)).sum();
                let exact = 2.0 * factorial(m) * factorial(n) / factorial(m + n + 2);
                assert!((mean - exact).abs() < 1e-12, "s^{m} t^{n}: {mean} {exact}");
            }
        }
    }

    #[test]
    fn functions_are_orthonormal() {
        for (a, b) in (0..3).flat_map(|a| (0..3).map(move |b| (a, b))) {
            let product = |at: DVec2| functions::<3>(at)[a] * functions::<3>(at)[b];
            let mean: f64 = SIX.iter().map(|(at, weight)| weight * product(*at)).sum();
            assert!((mean - f64::from(a == b)).abs() < 1e-12, "{a} {b}: {mean}");
        }
    }

    /// A linear function is the same on its quarters, and is found again from them.
    #[test]
    fn quarters_make_up_the_whole() {
        let whole = [0.7, -0.3, 1.9];
        let own = [0, 1, 2, 3].map(|quarter| restricted(whole, quarter));
        projected(own).iter().zip(whole).for_each(|(a, b)| assert!((a - b).abs() < 1e-12));
        for (i, j) in (0..20).flat_map(|i| (0..20 - i).map(move |j| (i, j))) {
            let at = DVec2::new(f64::from(i), f64::from(j)) / 20.0 + 0.01;
            let (quarter, inside) = quarter_of(at);
            let grey = |c: [f64; 3]| c.map(|c| [c; 3]);
            let [a, b] = [value(&grey(whole), at), value(&grey(own[quarter]), inside)].map(|v| v[0]);
            assert!((a - b).abs() < 1e-12 && inside.min_element() > -1e-12 && inside.x + inside.y < 1.0 + 0.05);
        }
    }
}
