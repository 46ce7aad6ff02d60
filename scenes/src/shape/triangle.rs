//! Triangles and parallelograms as areas to sample.

use super::margin;
use crate::ray::SurfacePoint;
use glam::DVec3;
use sampling::{Vec2, Vec3};

/// A triangle of given vertices; its front is where they run counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle(pub [Vec3; 3]);

impl Triangle {
    /// Area \[m²\], in `f64`.
    pub fn area(&self) -> f64 {
        0.5 * self.double_area_vector().length()
    }

    /// Unit normal of the front, rounded once; None for a triangle without area.
    pub fn normal(&self) -> Option<Vec3> {
        self.double_area_vector().try_normalize().map(|n| n.as_vec3())
    }

    /// The centroid.
    pub fn centroid(&self) -> Vec3 {
        let [a, b, c] = self.0.map(Vec3::as_dvec3);
        ((a + b + c) / 3.0).as_vec3()
    }

    /// What rounding in `f64` may leave of the errors of [`Triangle::point`] and of an intersection \[m\].
    pub fn residual(&self) -> f32 {
        const SHARE: f32 = 1.0 / (1u64 << 46) as f32;
        self.0.map(|v| v.abs().max_element()).into_iter().fold(0.0, f32::max) * SHARE
    }

    /// The surface point of barycentric coordinates `b` (of the vertices 1 and 2), evaluated in `f64` and rounded once.
    #[inline]
    pub fn point(&self, b: [f64; 2], ng: Vec3) -> SurfacePoint {
        let [v0, v1, v2] = self.0.map(Vec3::as_dvec3);
        let p = v0 * (1.0 - b[0] - b[1]) + v1 * b[0] + v2 * b[1];
        SurfacePoint::on_surface(p.as_vec3(), ng, self.residual())
    }

    /// The same for rays that are to leave it: off the edges, so that it is not behind what adjoins the triangle there.
    #[inline]
    pub fn point_off_edges(&self, b: [f64; 2], ng: Vec3) -> SurfacePoint {
        self.off_edges(self.point(b, ng), b)
    }

    /// `at`, the point of these barycentric coordinates, off the edges.
    #[inline]
    pub(crate) fn off_edges(&self, at: SurfacePoint, b: [f64; 2]) -> SurfacePoint {
        let moved = margin::off_edges(&self.0.map(Vec3::as_dvec3), b);
        if moved == b { at } else { self.point(moved, at.ng) }
    }

    fn double_area_vector(&self) -> DVec3 {
        let [a, b, c] = self.0.map(Vec3::as_dvec3);
        (b - a).cross(c - a)
    }
}

/// A parallelogram as the two triangles it is traced as: `corners[0]`–`corners[2]` is their shared diagonal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parallelogram {
    /// Corners in order around it.
    pub corners: [Vec3; 4],
    /// Unit normals of the fronts of the two triangles.
    pub normals: [Vec3; 2],
    /// True if the corners follow its second edge first, because its front was turned over.
    pub turned: bool,
}

impl Parallelogram {
    /// The two triangles.
    pub fn triangles(&self) -> [Triangle; 2] {
        let [a, b, c, d] = self.corners;
        [Triangle([a, b, c]), Triangle([a, c, d])]
    }

    /// The point at `u`, uniform over the area and continuous in `u`, on the triangle that a ray there would meet.
    #[inline]
    pub fn sample(&self, u: Vec2) -> SurfacePoint {
        let (triangle, b, ng) = self.part(u);
        triangle.point(b, ng)
    }

    /// `at`, the point at `u`, off the edges.
    #[inline]
    pub(crate) fn off_edges(&self, at: SurfacePoint, u: Vec2) -> SurfacePoint {
        let (triangle, b, _) = self.part(u);
        triangle.off_edges(at, b)
    }

    /// The triangle that `u` is on, the place there, and its normal.
    #[inline]
    fn part(&self, u: Vec2) -> (Triangle, [f64; 2], Vec3) {
        let (x, y) = (f64::from(u.x), f64::from(u.y));
        let [a, b, c, d] = self.corners;
        if x >= y {
            (Triangle([a, b, c]), [x - y, y], self.normals[0])
        } else {
            (Triangle([a, c, d]), [x, y - x], self.normals[1])
        }
    }
}
