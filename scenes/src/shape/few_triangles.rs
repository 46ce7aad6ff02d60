//! Meshes of few triangles as areas to sample as they are seen from a point.

use super::{Rectangle, Triangle};
use glam::DVec3;
use sampling::warp::SphericalTriangle;
use sampling::{Vec2, Vec3, fault, vec2, warp};

/// Few triangles, all sampled together by the solid angles that they fill: the density is one over their sum, whichever is met.
#[derive(Clone, Debug, PartialEq)]
pub struct FewTriangles {
    facets: Vec<Facet>,
    /// The middle of their box, and the square of the distance from it up to which points are near \[m²\].
    middle: DVec3,
    reach2: f64,
    two_sided: bool,
}

#[derive(Clone, Debug, PartialEq)]
struct Facet {
    corners: [DVec3; 3],
    /// The cross product of its edges, towards its front \[m²\].
    normal: DVec3,
    /// The least height above its plane from which it is seen, times the length of `normal` \[m³\].
    least: f64,
}

/// Few triangles as they are seen from a point.
#[derive(Debug)]
pub struct SeenTriangles<'a> {
    few: &'a FewTriangles,
    p_ref: DVec3,
    /// Solid angles up to and including each triangle \[sr\].
    cumulative: [f64; FewTriangles::MOST],
}

impl FewTriangles {
    /// More are sampled by area.
    pub const MOST: usize = 16;
    /// The thinnest that are sampled by their solid angle: ratio of the height to the longest edge.
    const THINNEST: f64 = 1.0 / 64.0;
    /// The least height above a triangle's plane, in diagonals of the box of all, and in units in the last place of coordinates: nothing is
    /// seen along its plane, where rounding decides which side it is and how large; so densities are right to 10⁻³.
    const SLANT: (f64, f64) = (1e-3, 1e3);

    /// These triangles, with the normals of their fronts; `None` if they are many, or one is too thin.
    pub fn new(triangles: &[(Triangle, Vec3)], two_sided: bool) -> Option<Self> {
        if triangles.len() > Self::MOST {
            return None;
        }
        let points = || triangles.iter().flat_map(|(triangle, _)| triangle.0).map(Vec3::as_dvec3);
        let low = points().fold(DVec3::INFINITY, DVec3::min);
        let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
        let step = f64::from(f32::EPSILON) * low.abs().max(high.abs()).max_element();
        let least_height = (Self::SLANT.0 * (high - low).length()).max(Self::SLANT.1 * step);
        let facets = triangles.iter().map(|(triangle, ng)| Facet::new(triangle, *ng, least_height));
        let facets = facets.collect::<Option<Vec<_>>>()?;
        let reach2 = (Rectangle::NEAR * 0.5).powi(2) * (high - low).length_squared();
        Some(Self { middle: 0.5 * (low + high), reach2, two_sided, facets })
    }

    /// As they are seen from a point; `None` if that is not near, or all but in the plane of one of them. Where all are dark, their
    /// solid angle is 0.
    #[inline]
    pub fn seen_from(&self, p_ref: Vec3) -> Option<SeenTriangles<'_>> {
        let p_ref = p_ref.as_dvec3();
        if (self.middle - p_ref).length_squared() > self.reach2 { None } else { self.seen_near(p_ref) }
    }

    #[inline(never)]
    fn seen_near(&self, p_ref: DVec3) -> Option<SeenTriangles<'_>> {
        let (mut cumulative, mut sum) = ([0.0; Self::MOST], 0.0);
        for (facet, cumulative) in self.facets.iter().zip(&mut cumulative) {
            let behind = (facet.corners[0] - p_ref).dot(facet.normal);
            if behind.abs() < facet.least {
                return None;
            }
            if behind < 0.0 || self.two_sided && behind > 0.0 {
                sum += facet.from(p_ref).solid_angle();
            }
            *cumulative = sum;
        }
        Some(SeenTriangles { few: self, p_ref, cumulative })
    }
}

impl Facet {
    fn new(triangle: &Triangle, ng: Vec3, least_height: f64) -> Option<Self> {
        let [p, q, r] = triangle.0.map(Vec3::as_dvec3);
        let normal = (q - p).cross(r - p);
        let longest = (q - p).length().max((r - q).length()).max((p - r).length());
        let length = normal.length();
        let normal = if normal.dot(ng.as_dvec3()) < 0.0 { -normal } else { normal };
        // What has no area fills nothing.
        let is_compact = length == 0.0 || length >= FewTriangles::THINNEST * longest * longest;
        is_compact.then_some(Facet { corners: [p, q, r], normal, least: least_height * length })
    }

    #[inline]
    fn from(&self, p_ref: DVec3) -> SphericalTriangle {
        SphericalTriangle::new(self.corners.map(|corner| corner - p_ref), self.normal)
    }
}

impl SeenTriangles<'_> {
    /// The solid angle that they fill together \[sr\]; what lies behind others is counted, too.
    #[inline]
    pub fn solid_angle(&self) -> f64 {
        self.cumulative[self.few.facets.len() - 1]
    }

    /// A triangle, and barycentric coordinates of its second and third corner; there must be a solid angle.
    #[inline(never)]
    pub fn sample(&self, u: Vec2) -> (usize, Vec2) {
        let cumulative = &self.cumulative[..self.few.facets.len()];
        let (index, rest) = warp::choose(cumulative, u.x);
        let seen = self.few.facets[index].from(self.p_ref);
        (index, seen.sample(vec2(rest, u.y)))
    }

    /// The density [1/sr] of [`sample`](Self::sample) in directions that meet one of them that is not dark; 0 where all are.
    #[inline]
    pub fn pdf(&self) -> f32 {
        let solid_angle = fault!(
            "choice_among_triangles_forgotten",
            self.solid_angle(),
            self.solid_angle() / self.few.facets.len() as f64
        );
        if solid_angle > 0.0 { (1.0 / solid_angle) as f32 } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::vec3;

    /// A cube of edges of 2 around the origin, whose outside emits.
    fn cube(two_sided: bool) -> Option<FewTriangles> {
        FewTriangles::new(&sides(), two_sided)
    }

    fn sides() -> Vec<(Triangle, Vec3)> {
        let mut triangles = Vec::new();
        for axis in 0..3 {
            for side in [-1.0f32, 1.0] {
                let turned = |x: f32, y: f32| {
                    let p = [side, x, y];
                    vec3(p[(3 - axis) % 3], p[(4 - axis) % 3], p[(5 - axis) % 3])
                };
                let ng = turned(0.0, 0.0);
                triangles.push((Triangle([turned(-1.0, -1.0), turned(1.0, -1.0), turned(1.0, 1.0)]), ng));
                triangles.push((Triangle([turned(-1.0, -1.0), turned(1.0, 1.0), turned(-1.0, 1.0)]), ng));
            }
        }
        triangles
    }

    #[test]
    fn few_and_compact_ones_are_seen_from_near_them_and_off_their_planes() {
        let cube = cube(false).unwrap();
        let is_seen = |x: f32, y: f32, z: f32| cube.seen_from(vec3(x, y, z)).is_some();
        assert!(is_seen(0.0, 0.0, 2.0) && is_seen(0.3, 0.0, 0.0) && is_seen(3.0, 0.5, 1.01));
        assert!(!is_seen(0.0, 0.0, 4.0) && !is_seen(3.0, 0.5, 1.003) && !is_seen(0.2, 1.0, 0.4));
        let thin = Triangle([Vec3::ZERO, Vec3::X, vec3(0.5, 0.01, 0.0)]);
        assert!(FewTriangles::new(&[(thin, Vec3::Z)], false).is_none());
        assert!(FewTriangles::new(&[sides(), sides()].concat(), false).is_none());
    }

    #[test]
    fn what_faces_a_point_is_what_it_sees() {
        use std::f64::consts::PI;
        let within = |two_sided| cube(two_sided).unwrap().seen_from(vec3(0.3, -0.2, 0.1)).unwrap().solid_angle();
        assert_eq!(within(false), 0.0);
        assert!((within(true) - 4.0 * PI).abs() < 1e-12);
        // From outside, what it fills from behind is what its front fills.
        for p in [vec3(0.2, 0.3, 1.5), vec3(1.4, -1.3, 2.0)] {
            let [front, both] =
                [false, true].map(|two_sided| cube(two_sided).unwrap().seen_from(p).unwrap().solid_angle());
            assert!((both / front - 2.0).abs() < 1e-12, "{p}: {front} and {both}");
        }
    }

    #[test]
    fn each_is_chosen_by_its_solid_angle() {
        let (cube, p) = (cube(false).unwrap(), vec3(1.2, -0.3, 1.6));
        let seen = cube.seen_from(p).unwrap();
        const N: usize = 512;
        let mut counts = [0.0; 12];
        for i in 0..N * N {
            let u = vec2((i % N) as f32 + 0.5, (i / N) as f32 + 0.5) / N as f32;
            counts[seen.sample(u).0] += seen.solid_angle() / (N * N) as f64;
        }
        for ((count, facet), (_, ng)) in counts.iter().zip(&cube.facets).zip(sides()) {
            let exact = if (p - ng).dot(ng) > 0.0 { facet.from(p.as_dvec3()).solid_angle() } else { 0.0 };
            assert!((count - exact).abs() <= seen.solid_angle() / N as f64, "{ng}: {count} and {exact}");
        }
        for u in [0.0, 1.0f32.next_down()] {
            let (index, b) = seen.sample(vec2(u, u));
            assert!(counts[index] > 0.0 && b.min_element() >= 0.0 && b.element_sum() <= 1.0, "{u}: {index}, {b}");
        }
    }
}
