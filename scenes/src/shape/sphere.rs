//! The analytic sphere.

use super::AreaSample;
use super::analytic::line_and_circle;
use crate::ray::{SurfacePoint, UNIT_ROUNDOFF, rounding};
use glam::DVec3;
use sampling::math::Frame;
use sampling::{Vec2, Vec3, vec3, warp};
use std::f32::consts::PI;

/// A sphere; its front is outside unless it is flipped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre \[m\].
    pub center: Vec3,
    /// Radius \[m\], positive.
    pub radius: f32,
    /// True if its front is the inside.
    pub flipped: bool,
}

/// A direction sampled towards a sphere from outside it.
#[derive(Clone, Copy, Debug)]
pub struct ConeSample {
    /// The point of the sphere in that direction.
    pub at: SurfacePoint,
    /// Unit direction from the reference point.
    pub wi: Vec3,
    /// Distance from the reference point \[m\].
    pub distance: f32,
    /// Density \[1/sr\].
    pub pdf: f32,
}

impl Sphere {
    /// Surface area \[m²\].
    #[inline]
    pub fn area(&self) -> f32 {
        4.0 * PI * self.radius * self.radius
    }

    /// The parameters where a line enters and leaves the sphere, in order, NaN if it misses; `inverse_length2` is 1/|direction|².
    #[inline]
    pub fn meetings(&self, origin: DVec3, direction: DVec3, inverse_length2: f64) -> [f64; 2] {
        line_and_circle(origin - self.center.as_dvec3(), direction, f64::from(self.radius), inverse_length2)
    }

    /// The surface point nearest to a point of the line, which is on the sphere but for the errors of the line.
    #[inline]
    pub fn project(&self, origin: DVec3, direction: DVec3, t: f64) -> SurfacePoint {
        let (p, front) = self.exact_point(origin, direction, t);
        SurfacePoint::on_surface(p.as_vec3(), front.as_vec3(), self.residual())
    }

    /// The same point before it is rounded, and the unit normal of its front.
    #[inline]
    pub(crate) fn exact_point(&self, origin: DVec3, direction: DVec3, t: f64) -> (DVec3, DVec3) {
        let center = self.center.as_dvec3();
        let outwards = (origin - center + direction * t).normalize();
        (center + outwards * f64::from(self.radius), if self.flipped { -outwards } else { outwards })
    }

    /// What rounding in `f64` leaves of the error of a point \[m\]: far less than this.
    #[inline]
    fn residual(&self) -> f32 {
        self.radius * UNIT_ROUNDOFF
    }

    /// A point uniform over the area.
    #[inline]
    pub fn sample_area(&self, u: Vec2) -> AreaSample {
        let outwards = warp::uniform_sphere(u);
        AreaSample { at: self.point_towards(outwards), pdf_area: 1.0 / self.area() }
    }

    /// A direction uniform over the cone that the sphere fills, seen from outside \[PBRT4, 6.2.4\]; None from inside.
    #[inline]
    pub fn sample_cone(&self, p_ref: Vec3, u: Vec2) -> Option<ConeSample> {
        let cone = self.cone(p_ref)?;
        let local = warp::uniform_cone(u, cone.versine);
        let axis = (self.center - p_ref).as_dvec3().normalize().as_vec3();
        let frame = Frame::from_z(axis);
        // The normal of the near one of the two points in that direction, from angles alone: its place minus the centre
        // would lose all digits of a small sphere far away. sinγ = (d/r) sinθ is the angle at which the point is seen.
        let ratio = cone.distance / self.radius;
        let sin2 = local.x * local.x + local.y * local.y;
        let cos_seen = (1.0 - ratio * ratio * sin2).max(0.0).sqrt();
        let lateral = ratio * local.z - cos_seen;
        let along = cos_seen * local.z + ratio * sin2;
        let outwards = frame.to_world(vec3(local.x * lateral, local.y * lateral, -along));
        let (at, wi) = (self.point_towards(outwards), frame.to_world(local));
        Some(ConeSample { at, wi, distance: at.p.distance(p_ref), pdf: cone.pdf() })
    }

    /// The density of [`Sphere::sample_cone`] for directions that meet the sphere \[1/sr\]; None from inside.
    #[inline]
    pub fn pdf_cone(&self, p_ref: Vec3) -> Option<f32> {
        self.cone(p_ref).map(|cone| cone.pdf())
    }

    /// None from inside, and from points that may be inside but for their rounding: its own surface, seen from either side.
    #[inline]
    fn cone(&self, p_ref: Vec3) -> Option<Cone> {
        let distance2 = p_ref.as_dvec3().distance_squared(self.center.as_dvec3());
        let reach = f64::from(self.radius + rounding(p_ref) + rounding(Vec3::splat(self.radius)));
        if distance2 <= reach * reach {
            return None;
        }
        let radius2 = f64::from(self.radius) * f64::from(self.radius);
        let sin2 = radius2 / distance2;
        // Without the cancellation of 1 − √(1 − sin²), for spheres that look small.
        let versine = sin2 / (1.0 + (1.0 - sin2).sqrt());
        Some(Cone { distance: distance2.sqrt() as f32, versine: versine as f32 })
    }

    #[inline]
    fn point_towards(&self, outwards: Vec3) -> SurfacePoint {
        let exact = outwards.as_dvec3().normalize();
        let p = self.center.as_dvec3() + exact * f64::from(self.radius);
        self.point(p.as_vec3(), exact.as_vec3())
    }

    #[inline]
    fn point(&self, p: Vec3, outwards: Vec3) -> SurfacePoint {
        let ng = if self.flipped { -outwards } else { outwards };
        SurfacePoint::on_surface(p, ng, self.residual())
    }
}

struct Cone {
    distance: f32,
    /// 1 − cos of the half angle.
    versine: f32,
}

impl Cone {
    #[inline]
    fn pdf(&self) -> f32 {
        warp::uniform_cone_pdf(self.versine)
    }
}
