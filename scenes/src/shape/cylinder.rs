//! The analytic cylinder: an open tube.

use super::analytic::{MISSED, line_and_circle};
use crate::ray::SurfacePoint;
use crate::relief::Derivatives;
use glam::DVec3;
use sampling::{Vec2, Vec3, warp};
use std::f64::consts::PI;

/// A tube without caps; its front is outside unless it is flipped.
///
/// It is kept in `f64`, so that it meets a disk of the same rim without a gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// The middle of one end \[m\].
    pub from: DVec3,
    /// Unit and perpendicular: where the angle is zero, where it is a quarter turn, and along the tube, away from `from`.
    pub axes: [DVec3; 3],
    /// Length \[m\].
    pub length: f64,
    /// Radius \[m\].
    pub radius: f64,
    /// True if its front is the inside.
    pub flipped: bool,
}

impl Cylinder {
    /// Surface area \[m²\], one side.
    pub fn area(&self) -> f64 {
        2.0 * PI * self.radius * self.length
    }

    /// The parameters at which a line enters and leaves it, NaN for what it doesn't.
    #[inline]
    pub fn meetings(&self, origin: DVec3, direction: DVec3) -> [f64; 2] {
        let [.., along] = self.axes;
        let offset = origin - self.from;
        let (height, rise) = (offset.dot(along), direction.dot(along));
        let (offset, direction) = (offset - along * height, direction - along * rise);
        let roots = line_and_circle(offset, direction, self.radius, direction.length_squared().recip());
        let [enters, leaves] = roots.map(|t| (0.0..=self.length).contains(&(height + rise * t)));
        [if enters { roots[0] } else { MISSED[0] }, if leaves { roots[1] } else { MISSED[1] }]
    }

    /// The surface point nearest to a point of the line, which is on the tube but for the errors of the line.
    #[inline]
    pub fn point(&self, origin: DVec3, direction: DVec3, t: f64) -> SurfacePoint {
        let (p, front) = self.exact_point(origin, direction, t);
        SurfacePoint::on_surface(p.as_vec3(), front.as_vec3(), self.residual())
    }

    /// The same point before it is rounded, and the unit normal of its front.
    #[inline]
    pub(crate) fn exact_point(&self, origin: DVec3, direction: DVec3, t: f64) -> (DVec3, DVec3) {
        let offset = origin - self.from + direction * t;
        let height = offset.dot(self.axes[2]);
        self.exactly_at((offset - self.axes[2] * height).normalize(), height.clamp(0.0, self.length))
    }

    /// The point at `u`, uniform over the area: the angle and the height.
    #[inline]
    pub fn sample(&self, u: Vec2) -> SurfacePoint {
        let (sin, cos) = warp::sin_cos_turns(u.x);
        let outwards = self.axes[0] * f64::from(cos) + self.axes[1] * f64::from(sin);
        self.point_at(outwards.normalize(), f64::from(u.y) * self.length)
    }

    /// The texture coordinates of a point: the angle over 2π in [0, 1), and the height as a share of the length.
    pub fn uv(&self, p: Vec3) -> Vec2 {
        let [x, y, z] = self.axes.map(|axis| axis.dot(p.as_dvec3() - self.from));
        Vec2::new(warp::turns(y as f32, x as f32), (z / self.length).clamp(0.0, 1.0) as f32)
    }

    /// How a point moves with its texture coordinates.
    pub(crate) fn derivatives(&self, p: Vec3) -> Derivatives {
        let [x, y, _] = self.axes.map(|axis| axis.dot(p.as_dvec3() - self.from));
        let turning = (self.axes[1] * x - self.axes[0] * y) * (2.0 * PI);
        Derivatives { dpdu: turning.as_vec3(), dpdv: (self.axes[2] * self.length).as_vec3() }
    }

    /// Its middle \[m\].
    pub fn middle(&self) -> DVec3 {
        self.from + self.axes[2] * (0.5 * self.length)
    }

    /// How far it reaches from its middle along an axis, as long as that is.
    pub fn reach(&self, axis: DVec3) -> f64 {
        let [x, y, z] = self.axes.map(|own| own.dot(axis));
        self.radius * x.hypot(y) + 0.5 * self.length * z.abs()
    }

    #[inline]
    fn point_at(&self, outwards: DVec3, height: f64) -> SurfacePoint {
        let (p, front) = self.exactly_at(outwards, height);
        SurfacePoint::on_surface(p.as_vec3(), front.as_vec3(), self.residual())
    }

    #[inline]
    fn exactly_at(&self, outwards: DVec3, height: f64) -> (DVec3, DVec3) {
        let p = self.from + self.axes[2] * height + outwards * self.radius;
        (p, if self.flipped { -outwards } else { outwards })
    }

    /// What rounding in `f64` may leave of the error of a point \[m\].
    #[inline]
    pub(crate) fn residual(&self) -> f32 {
        const SHARE: f64 = 1.0 / (1u64 << 46) as f64;
        ((self.from.abs().max_element() + self.length + self.radius) * SHARE) as f32
    }
}
