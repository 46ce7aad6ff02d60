//! What is known of a group of emitters from afar: where they are, where they shine, and how strongly.

use super::{AreaShape, Emitter};
use crate::ray::SurfacePoint;
use crate::shape::Analytic;
use sampling::{Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// Margin of angles that are compared, for rounding \[rad\].
const MARGIN: f32 = 1e-3;

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

/// The same, ready to be asked what a point has of it.
#[derive(Clone, Debug)]
pub(super) struct Outline {
    pub middle: Vec3,
    /// Half the diagonal of its box, squared.
    pub reach2: f32,
    axis: Vec3,
    /// Sine and cosine of the cone of normals.
    normals: [f32; 2],
    /// Cosine of the angle beyond which it is dark.
    cos_emission: f32,
    pub strength: f32,
}

impl Outline {
    pub fn of(bounds: &Bounds) -> Self {
        let Cone { axis, normals, emission } = bounds.cone;
        Self {
            middle: bounds.middle(),
            reach2: 0.25 * (bounds.high - bounds.low).length_squared(),
            axis,
            normals: normals.sin_cos().into(),
            cos_emission: (emission + MARGIN).cos(),
            strength: bounds.strength,
        }
    }

    /// About the greatest irradiance that it may bring to a point, over the strongest emitter's strength \[Conty18, 4.2\]: its
    /// strength over the squared distance, times the cosine at the emitters where they face the point best, and that at the
    /// point, whichever side of its surface is lit.
    #[inline]
    pub fn importance(&self, at: &SurfacePoint) -> f32 {
        let to_point = at.p - self.middle;
        let distance2 = to_point.length_squared();
        let strength = self.strength / distance2.max(self.reach2).max(1e-30);
        if distance2 <= self.reach2 {
            return strength;
        }
        let w = to_point / distance2.sqrt();
        // What the box fills of the view.
        let sin2 = self.reach2 / distance2;
        let wide = [sin2.sqrt(), (1.0 - sin2).sqrt()];
        let off_axis = angle(self.axis.dot(w));
        let nearest = less(less(off_axis, self.normals), wide);
        if nearest[1] <= self.cos_emission {
            return 0.0;
        }
        let received = if at.ng == Vec3::ZERO { 1.0 } else { less(angle(at.ng.dot(w).abs()), wide)[1] };
        strength * nearest[1].max(0.0) * received.max(0.0)
    }

    /// The direction from a point to within a ball around it that is nearest to another one.
    #[inline]
    pub fn direction_nearest(&self, p: Vec3, to: Vec3) -> Vec3 {
        let to_middle = self.middle - p;
        let distance2 = to_middle.length_squared();
        if distance2 <= self.reach2 {
            return to;
        }
        let towards = to_middle / distance2.sqrt();
        let (cos, sin2) = (towards.dot(to), self.reach2 / distance2);
        if cos > 0.0 && 1.0 - cos * cos <= sin2 {
            return to;
        }
        let aside = (to - cos * towards).normalize_or_zero();
        towards * (1.0 - sin2).sqrt() + aside * sin2.sqrt()
    }
}

/// The greatest strength of emitters, by which those of all are divided: units are the user's.
pub(super) fn strongest<'e>(emitters: impl Iterator<Item = &'e Emitter>) -> f64 {
    let all = Cone { axis: Vec3::Z, normals: 0.0, emission: 0.0 };
    emitters.map(|emitter| strength(emitter, &all)).fold(0.0, f64::max)
}

/// The strength of an emitter: exactly for points and spots; for areas what their power would be of along the normal if they
/// shone as evenly as their normals do.
fn strength(emitter: &Emitter, cone: &Cone) -> f64 {
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

/// Sine and cosine of the angle in [0, π] that has this cosine.
#[inline]
fn angle(cosine: f32) -> [f32; 2] {
    let cosine = cosine.clamp(-1.0, 1.0);
    [(1.0 - cosine * cosine).sqrt(), cosine]
}

/// Sine and cosine of max(a − b, 0), of angles in [0, π] by theirs.
#[inline]
fn less(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    if a[1] >= b[1] {
        return [0.0, 1.0];
    }
    [a[0] * b[1] - a[1] * b[0], a[1] * b[1] + a[0] * b[0]]
}
