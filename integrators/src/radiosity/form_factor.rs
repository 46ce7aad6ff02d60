//! How much of the light that leaves one triangle arrives at another, where nothing stands between.
//!
//! The coupling of triangles X and Y is `C_ab = ∫_X ∫_Y φ_a(x) φ_b(y) k(x, y) dy dx` \[m²\], k the kernel of radiosity,
//! `cosθ_x cosθ_y / (π |x − y|²)`; `C_00 / A_X` is the form factor from X to Y \[Cohen93, 4.1\]. Swapping X and Y transposes it, which
//! is reciprocity.
//!
//! Triangles that are far from one another for their sizes are integrated over by a product of rules. What is constant on others is coupled by
//! Lambert's closed form, integrated over the smaller ([`polygon`]); of what is linear they are divided, the larger first.
//! Where they touch that would go on for ever; after some divisions the inner integral is Lambert's closed form \[Lambert1760\] for
//! the irradiance from a polygon, in which the kernel's pole is no more. What touches is halved in number by each division of an edge, so that
//! the error of the last parts counts little.

use super::basis::{Part, Rule, SIX, THREE, WHOLE, functions};
use super::polygon::{self, Polygon};
use glam::DVec3;
use std::f64::consts::PI;

/// From this ratio on of the distance of the centres to the sum of the radii, three points of each are enough.
const FAR: f64 = 4.0;
/// From this ratio on, six.
const NEAR: f64 = 1.8;
/// So often a triangle is divided that touches another, or nearly.
const DIVISIONS: u32 = 5;
/// So often one that the other's plane cuts, if it is not near.
const DIVISIONS_AT_HORIZON: u32 = 3;

/// A coupling \[m²\].
pub type Coupling<const B: usize> = [[f64; B]; B];

/// One side of a flat triangle, or of a part of one.
#[derive(Clone, Copy, Debug)]
pub struct Panel {
    /// Vertices \[m\].
    pub corners: [DVec3; 3],
    /// Unit normal on its side.
    pub normal: DVec3,
    /// Area \[m²\].
    pub area: f64,
    /// Centroid \[m\].
    pub centre: DVec3,
    /// Largest distance of a corner from there \[m\].
    pub radius: f64,
    /// Where it lies in the triangle whose functions are meant.
    pub part: Part,
}

/// On which side of a plane a panel is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    Ahead,
    Behind,
    Across,
}

impl Panel {
    /// A whole triangle.
    pub fn new(corners: [DVec3; 3], normal: DVec3) -> Self {
        Self::part(corners, normal, WHOLE)
    }

    fn part(corners: [DVec3; 3], normal: DVec3, part: Part) -> Self {
        let [a, b, c] = corners;
        let centre = (a + b + c) / 3.0;
        let radius = corners.iter().map(|p| p.distance(centre)).fold(0.0, f64::max);
        Self { corners, normal, area: 0.5 * (b - a).cross(c - a).length(), centre, radius, part }
    }

    /// The point of these coordinates.
    #[inline]
    pub fn point(&self, at: glam::DVec2) -> DVec3 {
        let [a, b, c] = self.corners;
        a + (b - a) * at.x + (c - a) * at.y
    }

    /// Its four quarters.
    pub fn quarters(&self) -> [Self; 4] {
        let [a, b, c] = self.corners;
        let (ab, bc, ca) = ((a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5);
        let corners = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]];
        std::array::from_fn(|i| Self::part(corners[i], self.normal, self.part.quarter(i)))
    }

    /// Where it is as seen from another's plane. What is so near that rounding may have put it there counts as on the plane.
    fn place(&self, other: &Self) -> Place {
        let heights = self.corners.map(|p| other.normal.dot(p - other.centre));
        let little = 1e-6 * (self.radius + other.radius + self.centre.distance(other.centre));
        let (low, high) = heights.iter().fold((0.0f64, 0.0f64), |(low, high), h| (low.min(*h), high.max(*h)));
        match (low < -little, high > little) {
            (_, false) => Place::Behind,
            (false, true) => Place::Ahead,
            (true, true) => Place::Across,
        }
    }

    #[inline]
    fn nodes<const B: usize, const N: usize>(&self, rule: &Rule<N>) -> [(DVec3, [f64; B]); N] {
        rule.map(|(at, weight)| {
            let functions = functions::<B>(self.part.point(at));
            (self.point(at), functions.map(|f| f * weight * self.area))
        })
    }
}

/// k(x, y) \[1/m²\].
#[inline]
pub fn kernel(x: DVec3, normal_x: DVec3, y: DVec3, normal_y: DVec3) -> f64 {
    let d = y - x;
    let (cos_x, cos_y, distance2) = (normal_x.dot(d), -normal_y.dot(d), d.length_squared());
    if cos_x <= 0.0 || cos_y <= 0.0 { 0.0 } else { cos_x * cos_y / (PI * distance2 * distance2) }
}

/// The coupling of two panels; `None` where neither faces the other.
pub fn coupling<const B: usize>(x: &Panel, y: &Panel) -> Option<Coupling<B>> {
    let (x_seen, y_seen) = (x.place(y), y.place(x));
    if x_seen == Place::Behind || y_seen == Place::Behind {
        return None;
    }
    let mut sum = [[0.0; B]; B];
    let is_far = x.centre.distance(y.centre) > NEAR * (x.radius + y.radius);
    if B == 1 && !(is_far && x_seen == Place::Ahead && y_seen == Place::Ahead) {
        sum[0][0] = polygon::coupling(x, y);
    } else {
        add(x, y, (DIVISIONS, DIVISIONS), &mut sum);
    }
    Some(sum)
}

/// Adds the coupling of two panels that may still be divided so often.
fn add<const B: usize>(x: &Panel, y: &Panel, left: (u32, u32), sum: &mut Coupling<B>) {
    let (x_seen, y_seen) = (x.place(y), y.place(x));
    if x_seen == Place::Behind || y_seen == Place::Behind {
        return;
    }
    let ratio = x.centre.distance(y.centre) / (x.radius + y.radius);
    // What is cut by a horizon is divided there before all else: the kernel has a kink on it.
    let most = if ratio > NEAR { DIVISIONS_AT_HORIZON } else { DIVISIONS };
    let is_cut = |seen: Place, left: u32| seen == Place::Across && DIVISIONS - left < most;
    let (cut_x, cut_y) = (is_cut(x_seen, left.0), is_cut(y_seen, left.1));
    let done = left.0 == 0 && left.1 == 0;
    if !cut_x && !cut_y {
        match ratio {
            _ if ratio > FAR => return add_product(x, y, &THREE, sum),
            _ if ratio > NEAR => return add_product(x, y, &SIX, sum),
            _ if done => return add_last(x, y, [x_seen, y_seen], sum),
            _ => {}
        }
    }
    let larger_x = left.1 == 0 || (left.0 > 0 && x.radius >= y.radius);
    let divides_x = if cut_x == cut_y { larger_x } else { cut_x };
    if divides_x {
        x.quarters().iter().for_each(|x| add(x, y, (left.0 - 1, left.1), sum));
    } else {
        y.quarters().iter().for_each(|y| add(x, y, (left.0, left.1 - 1), sum));
    }
}

#[inline]
fn add_product<const B: usize, const N: usize>(x: &Panel, y: &Panel, rule: &Rule<N>, sum: &mut Coupling<B>) {
    let (xs, ys) = (x.nodes::<B, N>(rule), y.nodes::<B, N>(rule));
    for (p, of_x) in &xs {
        let mut inner = [0.0; B];
        for (q, of_y) in &ys {
            let k = kernel(*p, x.normal, *q, y.normal);
            inner.iter_mut().zip(of_y).for_each(|(inner, f)| *inner += k * f);
        }
        for (row, f) in sum.iter_mut().zip(of_x) {
            row.iter_mut().zip(inner).for_each(|(sum, inner)| *sum += f * inner);
        }
    }
}

/// Parts that touch: the mean of both ways to integrate over one by six points and over the other in closed form, or that way for which
/// the other is not cut by a horizon.
fn add_last<const B: usize>(x: &Panel, y: &Panel, seen: [Place; 2], sum: &mut Coupling<B>) {
    let [over_y, over_x] = match seen.map(|place| place == Place::Ahead) {
        [false, false] => return add_product(x, y, &SIX, sum),
        [true, true] => [0.5, 0.5],
        [true, false] => [1.0, 0.0],
        [false, true] => [0.0, 1.0],
    };
    // Functions of what is integrated in closed form are taken to be those at its middle.
    let middle = |panel: &Panel| functions::<B>(panel.part.point(glam::DVec2::splat(1.0 / 3.0)));
    if over_x > 0.0 {
        let y_middle = middle(y);
        for (p, of_x) in x.nodes::<B, 6>(&SIX) {
            let from_y = over_x * irradiance(p, x.normal, y);
            for (row, f) in sum.iter_mut().zip(of_x) {
                row.iter_mut().zip(y_middle).for_each(|(sum, g)| *sum += f * g * from_y);
            }
        }
    }
    if over_y > 0.0 {
        let x_middle = middle(x);
        for (q, of_y) in y.nodes::<B, 6>(&SIX) {
            let from_x = over_y * irradiance(q, y.normal, x);
            for (row, f) in sum.iter_mut().zip(x_middle) {
                row.iter_mut().zip(of_y).for_each(|(sum, g)| *sum += f * g * from_x);
            }
        }
    }
}

/// The irradiance at a point from a panel of radiosity 1 that lies ahead of its plane.
pub fn irradiance(p: DVec3, normal: DVec3, panel: &Panel) -> f64 {
    if panel.normal.dot(p - panel.centre) <= 0.0 { 0.0 } else { Polygon::from(&panel.corners).irradiance(p, normal) }
}
