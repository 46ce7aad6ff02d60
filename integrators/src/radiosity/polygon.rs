//! Constants on triangles that are near one another: what is cut off by a horizon is clipped, what shines is Lambert's closed form.
//!
//! The irradiance from a polygon is a sum over its edges \[Lambert1760; Arvo94\], so that of the coupling's four dimensions two are left:
//! the smaller triangle is integrated over by cubature. Along its plane that function is smooth but where the polygon's edges are near, other than
//! those in the plane itself, so that parts are divided there and nowhere else.

use super::basis::SIX;
use super::form_factor::Panel;
use glam::DVec3;
use std::f64::consts::PI;

/// Parts nearer to an edge than this, in units of their radius, are divided.
const CLEAR: f64 = 2.0;
/// So often.
const DIVISIONS: u32 = 6;
/// Corners of a triangle that a plane has clipped, at the most.
const MOST: usize = 4;

/// A convex polygon.
#[derive(Clone, Copy, Debug)]
pub struct Polygon {
    corners: [DVec3; MOST],
    count: usize,
}

impl Polygon {
    /// The part of a triangle ahead of a plane through a point.
    fn ahead(triangle: &[DVec3; 3], through: DVec3, normal: DVec3) -> Self {
        let heights = triangle.map(|corner| normal.dot(corner - through));
        let mut part = Self { corners: [DVec3::ZERO; MOST], count: 0 };
        for i in 0..3 {
            let j = (i + 1) % 3;
            if heights[i] >= 0.0 {
                part.push(triangle[i]);
            }
            if heights[i] * heights[j] < 0.0 {
                part.push(triangle[i].lerp(triangle[j], heights[i] / (heights[i] - heights[j])));
            }
        }
        part
    }

    fn push(&mut self, corner: DVec3) {
        self.corners[self.count] = corner;
        self.count += 1;
    }

    fn edges(&self) -> impl Iterator<Item = (DVec3, DVec3)> + '_ {
        (0..self.count).map(|i| (self.corners[i], self.corners[(i + 1) % self.count]))
    }

    /// The irradiance at a point whose plane it lies ahead of, if it shines that way with radiosity 1: `Σ Θ_i n·Γ_i / 2π` over the edges, Θ the
    /// angle that an edge is seen at, Γ the unit normal of the plane through it and the point \[Lambert1760; Arvo94\].
    #[inline]
    pub fn irradiance(&self, p: DVec3, normal: DVec3) -> f64 {
        let of_edge = |(v, w): (DVec3, DVec3)| {
            let (v, w) = (v - p, w - p);
            let across = v.cross(w);
            let sine = across.length();
            if sine == 0.0 { 0.0 } else { normal.dot(across) / sine * sine.atan2(v.dot(w)) }
        };
        self.edges().map(of_edge).sum::<f64>().abs() / (2.0 * PI)
    }
}

impl From<&[DVec3; 3]> for Polygon {
    fn from(&[a, b, c]: &[DVec3; 3]) -> Self {
        Self { corners: [a, b, c, c], count: 3 }
    }
}

/// The coupling \[m²\] of what is constant on two panels.
pub fn coupling(x: &Panel, y: &Panel) -> f64 {
    let (over, from) = if x.radius <= y.radius { (x, y) } else { (y, x) };
    let seen = Polygon::ahead(&over.corners, from.centre, from.normal);
    let shining = Polygon::ahead(&from.corners, over.centre, over.normal);
    let mut edges = [(DVec3::ZERO, DVec3::ZERO); MOST];
    let mut count = 0;
    // From along an edge in its own plane, irradiance is smooth but at the edge's ends, which are the next edges' too.
    let little = 1e-6 * (over.radius + from.radius);
    let in_plane = |p: DVec3| over.normal.dot(p - over.centre) <= little;
    for edge in shining.edges().filter(|(v, w)| !(in_plane(*v) && in_plane(*w))) {
        edges[count] = edge;
        count += 1;
    }
    let inner = Inner { shining, edges: &edges[..count], normal: over.normal };
    let [first, ..] = seen.corners;
    (2..seen.count).map(|i| inner.over(&[first, seen.corners[i - 1], seen.corners[i]], DIVISIONS)).sum()
}

/// What is integrated over parts of a triangle.
struct Inner<'a> {
    shining: Polygon,
    /// Where it is not smooth.
    edges: &'a [(DVec3, DVec3)],
    normal: DVec3,
}

impl Inner<'_> {
    /// The integral over a triangle that may still be divided so often.
    fn over(&self, &[a, b, c]: &[DVec3; 3], left: u32) -> f64 {
        let centre = (a + b + c) / 3.0;
        let radius2 = [a, b, c].map(|corner| corner.distance_squared(centre)).into_iter().fold(0.0, f64::max);
        let is_near = |(v, w): &(DVec3, DVec3)| distance_squared(centre, *v, *w) < CLEAR * CLEAR * radius2;
        if left > 0 && self.edges.iter().any(is_near) {
            let (ab, bc, ca) = ((a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5);
            return [[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]]
                .iter()
                .map(|part| self.over(part, left - 1))
                .sum();
        }
        let area = 0.5 * (b - a).cross(c - a).length();
        let at = |(at, weight): (glam::DVec2, f64)| {
            weight * self.shining.irradiance(a + (b - a) * at.x + (c - a) * at.y, self.normal)
        };
        area * SIX.map(at).iter().sum::<f64>()
    }
}

/// Of a point from a segment.
fn distance_squared(p: DVec3, v: DVec3, w: DVec3) -> f64 {
    let (along, to) = (w - v, p - v);
    let length2 = along.length_squared();
    let at = if length2 > 0.0 { (to.dot(along) / length2).clamp(0.0, 1.0) } else { 0.0 };
    to.distance_squared(along * at)
}
