//! What is known of a group of emitters from afar: where they are, where they shine, and how strongly.

use super::{AreaShape, Emitter};
use crate::shape::Analytic;
use sampling::{Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// A cone around the normals of emitters, and how far from a normal they shine \[Conty18, 4.1\].
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    /// Unit axis.
    pub axis: Vec3,
    /// All normals lie within this angle of it \[rad\]; π for all directions.
    pub normals: f32,
    /// All light lies within this angle of a normal \[rad\], at most π/2.
    pub emission: f32,
}

impl Cone {
    /// Light in all directions.
    const ALL: Self = Self { axis: Vec3::Z, normals: PI, emission: FRAC_PI_2 };

    /// A cone around both.
    fn union(self, other: Self) -> Self {
        let (a, b) = if self.normals >= other.normals { (self, other) } else { (other, self) };
        let emission = a.emission.max(b.emission);
        let between = a.axis.angle_between(b.axis);
        if (between + b.normals).min(PI) <= a.normals {
            return Self { emission, ..a };
        }
        let normals = 0.5 * (a.normals + between + b.normals);
        let pole = a.axis.cross(b.axis);
        let Some(pole) = pole.try_normalize().filter(|_| normals < PI) else { return Self { emission, ..Self::ALL } };
        let axis = glam::Quat::from_axis_angle(pole, normals - a.normals) * a.axis;
        Self { axis: axis.normalize(), normals, emission }
    }

    /// ∫ of the cosine to the nearest normal over all directions that it may shine to \[Conty18, (1)\].
    fn measure(&self) -> f32 {
        let (o, w) = (self.normals, (self.normals + self.emission).min(PI));
        let (sine, cosine) = o.sin_cos();
        2.0 * PI * (1.0 - cosine) + FRAC_PI_2 * (2.0 * w * sine - (o - 2.0 * w).cos() - 2.0 * o * sine + cosine)
    }
}

/// A box around emitters, a cone around where they shine, and their strength.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub low: Vec3,
    pub high: Vec3,
    pub cone: Cone,
    /// Radiant intensity along the normal, at most, the mean of the channels \[W/sr\]; relative to whatever is asked.
    pub strength: f32,
}

impl Bounds {
    /// Of an emitter of this strength relative to `unit`; None if it lies infinitely far.
    pub fn of(emitter: &Emitter, unit: f64) -> Option<Self> {
        let (points, cone): (Vec<Vec3>, Cone) = match emitter {
            Emitter::Point(point) => (vec![point.position], Cone::ALL),
            Emitter::Spot(spot) if spot.cutoff > FRAC_PI_2 => (vec![spot.position], Cone::ALL),
            Emitter::Spot(spot) => {
                let emission = spot.cutoff - spot.beam;
                (vec![spot.position], Cone { axis: spot.axis, normals: spot.beam, emission })
            }
            Emitter::Area(area) => {
                let (points, normals) = match &area.shape {
                    AreaShape::Quad(quad) => (quad.corners.to_vec(), quad.normals.to_vec()),
                    AreaShape::Rectangle(rectangle) => {
                        (rectangle.quad.corners.to_vec(), rectangle.quad.normals.to_vec())
                    }
                    AreaShape::Sphere(sphere) => (ends(&Analytic::Sphere(*sphere)), vec![]),
                    AreaShape::Disk(disk) => (ends(&Analytic::Disk(disk.clone())), vec![disk.sample(Vec2::ZERO).ng]),
                    AreaShape::Cylinder(cylinder) => (ends(&Analytic::Cylinder(cylinder.clone())), vec![]),
                    AreaShape::Mesh { triangles, .. } => (
                        triangles.iter().flat_map(|(triangle, _)| triangle.0).collect(),
                        triangles.iter().map(|(_, normal)| *normal).collect(),
                    ),
                };
                (points, if area.emission.two_sided { Cone::ALL } else { around(&normals) })
            }
            Emitter::Environment(_) | Emitter::Image(_) | Emitter::Directional(_) => return None,
        };
        let low = points.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let high = points.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        let strength = (strength(emitter, &cone) / unit) as f32;
        Some(Self { low, high, cone, strength })
    }

    pub fn union(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            cone: self.cone.union(other.cone),
            strength: self.strength + other.strength,
        }
    }

    /// What a split is judged by: the strength times how widely it is spread over places and directions \[Conty18, 4.3\].
    pub fn cost(&self) -> f32 {
        let [x, y, z] = (self.high - self.low).to_array();
        self.strength * self.cone.measure() * (x * y + y * z + z * x)
    }

    pub fn middle(&self) -> Vec3 {
        0.5 * (self.low + self.high)
    }
}

/// The strength of an emitter: exactly for points and spots; for areas what their power would be of along the normal if they
/// shone as evenly as their normals do.
pub(super) fn strength(emitter: &Emitter, cone: &Cone) -> f64 {
    match emitter {
        Emitter::Point(point) => f64::from(point.intensity.mean()),
        Emitter::Spot(spot) => f64::from(spot.intensity.mean()),
        // π sr for a plane, 4π sr for a ball.
        other => other.power() / (f64::from(PI) * (1.0 + 1.5 * (1.0 - f64::from(cone.normals.cos())))),
    }
}

/// Two corners of a box around it.
fn ends(surface: &Analytic) -> Vec<Vec3> {
    let (low, high) = surface.extent();
    vec![low, high]
}

/// A cone around these normals of surfaces.
fn around(normals: &[Vec3]) -> Cone {
    let Some(axis) = normals.iter().sum::<Vec3>().try_normalize() else { return Cone::ALL };
    let widest = normals.iter().map(|normal| normal.angle_between(axis)).fold(0.0, f32::max);
    // With room for rounding.
    let normals = widest + 1e-3;
    if normals >= FRAC_PI_2 { Cone::ALL } else { Cone { axis, normals, emission: FRAC_PI_2 } }
}
