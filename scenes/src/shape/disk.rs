//! The analytic disk, round or elliptic.

use super::analytic::MISSED;
use crate::ray::SurfacePoint;
use crate::relief::Derivatives;
use glam::{DVec2, DVec3};
use sampling::{Vec2, Vec3, warp};
use std::f64::consts::PI;

/// An elliptic disk: `center + x·edge_u + y·edge_v` for `x² + y² ≤ 1`; its front is where `edge_u × edge_v` points, unless it is
/// flipped.
///
/// It is kept in `f64`, so that it meets a cylinder of the same rim without a gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disk {
    /// Centre \[m\].
    pub center: DVec3,
    /// From the centre to the rim \[m\].
    pub edge_u: DVec3,
    /// From the centre to the rim \[m\].
    pub edge_v: DVec3,
    /// True if its front is where `edge_v × edge_u` points.
    pub flipped: bool,
    /// `edge_u × edge_v` \[m²\].
    across: DVec3,
    /// Whose products with an offset from the centre in the plane are its x and y \[1/m\].
    duals: [DVec3; 2],
    /// What rounding in `f64` may leave of the error of a point \[m\].
    residual: f32,
}

impl Disk {
    /// The disk of these edges; None if they span no area.
    pub fn new(center: DVec3, edge_u: DVec3, edge_v: DVec3, flipped: bool) -> Option<Self> {
        const SHARE: f64 = 1.0 / (1u64 << 46) as f64;
        let across = edge_u.cross(edge_v);
        if across.length().is_nan() || across.length() <= 1e-12 * edge_u.length() * edge_v.length() {
            return None;
        }
        let inverse = across.length_squared().recip();
        let duals = [edge_v.cross(across) * inverse, across.cross(edge_u) * inverse];
        let largest = center.abs().max_element() + edge_u.abs().max_element() + edge_v.abs().max_element();
        let residual = (largest * SHARE) as f32;
        duals[0].is_finite().then_some(Disk { center, edge_u, edge_v, flipped, across, duals, residual })
    }

    /// Surface area \[m²\], one side.
    pub fn area(&self) -> f64 {
        PI * self.across.length()
    }

    /// The parameters at which a line meets it, NaN for none: there is one at most.
    #[inline]
    pub fn meetings(&self, origin: DVec3, direction: DVec3) -> [f64; 2] {
        let t = (self.center - origin).dot(self.across) / direction.dot(self.across);
        // Written so that the NaN of a line in the plane misses.
        if self.place(origin + direction * t).length_squared() <= 1.0 { [t, f64::NAN] } else { MISSED }
    }

    /// The surface point nearest to a point of the line, which is on the disk but for the errors of the line.
    #[inline]
    pub fn point(&self, origin: DVec3, direction: DVec3, t: f64) -> SurfacePoint {
        self.point_at(self.place(origin + direction * t))
    }

    /// The same point before it is rounded, and the unit normal of its front.
    #[inline]
    pub(crate) fn exact_point(&self, origin: DVec3, direction: DVec3, t: f64) -> (DVec3, DVec3) {
        self.exactly_at(self.place(origin + direction * t))
    }

    /// The point at `u`, uniform over the area.
    #[inline]
    pub fn sample(&self, u: Vec2) -> SurfacePoint {
        self.point_at(warp::uniform_disk(u).as_dvec2())
    }

    /// The texture coordinates of a point: its distance from the centre as a share of the rim's, and the angle from `edge_u`
    /// towards `edge_v` over 2π, in [0, 1).
    pub fn uv(&self, p: Vec3) -> Vec2 {
        let at = self.place(p.as_dvec3());
        Vec2::new(at.length().min(1.0) as f32, warp::turns(at.y as f32, at.x as f32))
    }

    /// How a point moves with its texture coordinates; zero along v at the centre.
    pub(crate) fn derivatives(&self, p: Vec3) -> Derivatives {
        let at = self.place(p.as_dvec3());
        let outwards = at.normalize_or(DVec2::X);
        let dpdu = self.edge_u * outwards.x + self.edge_v * outwards.y;
        let dpdv = (self.edge_v * at.x - self.edge_u * at.y) * (2.0 * PI);
        Derivatives { dpdu: dpdu.as_vec3(), dpdv: dpdv.as_vec3() }
    }

    /// How far it reaches from its centre along an axis, as long as that is: the support of the ellipse.
    pub fn reach(&self, axis: DVec3) -> f64 {
        axis.dot(self.edge_u).hypot(axis.dot(self.edge_v))
    }

    /// Distance from the centre to the farthest point of the rim \[m\]: the largest singular value of the two edges.
    pub fn longest(&self) -> f64 {
        let (uu, vv, uv) = (self.edge_u.length_squared(), self.edge_v.length_squared(), self.edge_u.dot(self.edge_v));
        (0.5 * (uu + vv + (uu - vv).hypot(2.0 * uv))).sqrt()
    }

    #[inline]
    fn place(&self, p: DVec3) -> DVec2 {
        let offset = p - self.center;
        DVec2::new(offset.dot(self.duals[0]), offset.dot(self.duals[1]))
    }

    #[inline]
    fn point_at(&self, at: DVec2) -> SurfacePoint {
        let (p, front) = self.exactly_at(at);
        SurfacePoint::on_surface(p.as_vec3(), front.as_vec3(), self.residual)
    }

    #[inline]
    fn exactly_at(&self, at: DVec2) -> (DVec3, DVec3) {
        let front = if self.flipped { -self.across } else { self.across };
        (self.center + self.edge_u * at.x + self.edge_v * at.y, front.normalize())
    }

    /// What rounding in `f64` may leave of the error of a point \[m\].
    pub(crate) fn residual(&self) -> f32 {
        self.residual
    }
}
