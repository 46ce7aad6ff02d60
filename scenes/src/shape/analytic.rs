//! What is met where its equation says, without triangles.

use super::{Cylinder, Disk, Sphere};
use crate::ray::SurfacePoint;
use glam::DVec3;
use sampling::{Vec2, Vec3};

/// The parameters of a line that meets nothing: comparisons with them are false.
pub(super) const MISSED: [f64; 2] = [f64::NAN; 2];

/// A sphere, a disk or a cylinder. Only spheres come in thousands, so that the others are kept elsewhere.
#[derive(Clone, Debug)]
pub(crate) enum Analytic {
    Sphere(Sphere),
    Disk(Box<Disk>),
    Cylinder(Box<Cylinder>),
}

impl Analytic {
    /// The parameters at which a line meets it, in order, NaN where it doesn't; `inverse_length2` is 1/|direction|².
    #[inline]
    pub fn meetings(&self, origin: DVec3, direction: DVec3, inverse_length2: f64) -> [f64; 2] {
        match self {
            Self::Sphere(sphere) => sphere.meetings(origin, direction, inverse_length2),
            Self::Disk(disk) => disk.meetings(origin, direction),
            Self::Cylinder(cylinder) => cylinder.meetings(origin, direction),
        }
    }

    /// The surface point nearest to a point of the line, which is on the surface but for the errors of the line.
    #[inline]
    pub fn point(&self, origin: DVec3, direction: DVec3, t: f64) -> SurfacePoint {
        match self {
            Self::Sphere(sphere) => sphere.project(origin, direction, t),
            Self::Disk(disk) => disk.point(origin, direction, t),
            Self::Cylinder(cylinder) => cylinder.point(origin, direction, t),
        }
    }

    /// The same point before it is rounded, and the unit normal of its front.
    #[inline]
    pub fn exact_point(&self, origin: DVec3, direction: DVec3, t: f64) -> (DVec3, DVec3) {
        match self {
            Self::Sphere(sphere) => sphere.exact_point(origin, direction, t),
            Self::Disk(disk) => disk.exact_point(origin, direction, t),
            Self::Cylinder(cylinder) => cylinder.exact_point(origin, direction, t),
        }
    }

    /// A point uniform over the area.
    pub fn sample(&self, u: Vec2) -> SurfacePoint {
        match self {
            Self::Sphere(sphere) => sphere.sample_area(u).at,
            Self::Disk(disk) => disk.sample(u),
            Self::Cylinder(cylinder) => cylinder.sample(u),
        }
    }

    /// The point about which it is symmetric \[m\].
    pub fn middle(&self) -> Vec3 {
        match self {
            Self::Sphere(sphere) => sphere.center,
            Self::Disk(disk) => disk.center.as_vec3(),
            Self::Cylinder(cylinder) => cylinder.middle().as_vec3(),
        }
    }

    /// How far it reaches from its middle along an axis, to either side, in units of the axis' length.
    pub fn reach(&self, axis: Vec3) -> f32 {
        match self {
            Self::Sphere(sphere) => axis.length() * sphere.radius,
            Self::Disk(disk) => disk.reach(axis.as_dvec3()) as f32,
            Self::Cylinder(cylinder) => cylinder.reach(axis.as_dvec3()) as f32,
        }
    }

    /// The lowest and the highest coordinates, rounded outwards where they are rounded.
    pub fn extent(&self) -> (Vec3, Vec3) {
        let (middle, reach) = match self {
            Self::Sphere(sphere) => (sphere.center.as_dvec3(), DVec3::splat(sphere.radius.into())),
            Self::Disk(disk) => (disk.center, DVec3::AXES.map(|axis| disk.reach(axis)).into()),
            Self::Cylinder(cylinder) => (cylinder.middle(), DVec3::AXES.map(|axis| cylinder.reach(axis)).into()),
        };
        let down = |x: f64| if f64::from(x as f32) > x { (x as f32).next_down() } else { x as f32 };
        let (low, high) = ((middle - reach).to_array().map(down), (-middle - reach).to_array().map(down));
        (low.into(), -Vec3::from(high))
    }

    /// Two balls, or one twice, whose convex hull holds it.
    pub fn balls(&self) -> [(Vec3, f32); 2] {
        match self {
            Self::Sphere(sphere) => [(sphere.center, sphere.radius); 2],
            Self::Disk(disk) => [(disk.center.as_vec3(), disk.longest() as f32); 2],
            Self::Cylinder(cylinder) => {
                let end = cylinder.from + cylinder.axes[2] * cylinder.length;
                [cylinder.from, end].map(|end| (end.as_vec3(), cylinder.radius as f32))
            }
        }
    }
}

/// The parameters at which `|origin + t·direction|` is the radius, in order; NaN if it is nowhere.
///
/// In `f64`, with the discriminant taken from the distance between centre and line \[PBRT4, 6.8.3\], so that neither a small
/// circle far away nor an origin on it loses its digits. `inverse_length2` is 1/|direction|².
#[inline]
pub(super) fn line_and_circle(origin: DVec3, direction: DVec3, radius: f64, inverse_length2: f64) -> [f64; 2] {
    let middle = -origin.dot(direction) * inverse_length2;
    let nearest = origin + direction * middle;
    let half_chord2 = (radius * radius - nearest.length_squared()) * inverse_length2;
    if half_chord2 < 0.0 {
        return MISSED;
    }
    // The root of larger magnitude has no cancellation; the other follows from their product.
    let large = middle + half_chord2.sqrt().copysign(middle);
    let distance = origin.length();
    let product = (distance - radius) * (distance + radius) * inverse_length2;
    let small = if large == 0.0 { 0.0 } else { product / large };
    if middle < 0.0 { [large, small] } else { [small, large] }
}
