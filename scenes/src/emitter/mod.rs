//! Emitters: what emits light. They mirror the cameras: `le`, `sample_li`, `sample_le` and their densities.
//!
//! A light path ends in an [`Endpoint`]. Next-event estimation samples it given the point to be lit (`sample_li`, one density
//! per solid angle there); light walks sample it by itself, position and direction apart (`sample_le`, two densities).

mod area;
mod choice;
mod environment;
mod point;

pub(crate) use area::AreaChart;
pub use area::{AreaEmitter, AreaShape, Emission};
pub(crate) use choice::EmitterChoice;
pub use environment::ConstantEnvironment;
pub use point::PointEmitter;

use crate::ray::{Ray, SurfacePoint};
use sampling::Vec3;
use sampling::math::Spectrum;

/// Names an emitter of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct EmitterId(pub u32);

/// Anything that emits light.
#[derive(Clone, Debug)]
pub enum Emitter {
    /// A surface that emits.
    Area(AreaEmitter),
    /// A point that emits evenly in all directions.
    Point(PointEmitter),
    /// Light arriving evenly from all directions of an infinitely distant sphere.
    Environment(ConstantEnvironment),
}

impl Emitter {
    /// Emitted power \[W\], the mean of the channels.
    pub fn power(&self) -> f64 {
        match self {
            Emitter::Area(area) => area.power(),
            Emitter::Point(point) => point.power(),
            Emitter::Environment(environment) => environment.power(),
        }
    }

    /// True if no ray can meet it.
    pub fn is_delta(&self) -> bool {
        matches!(self, Emitter::Point(_))
    }
}

/// What kind of thing a light path ends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndpointKind {
    /// A point of an emitting surface.
    Surface,
    /// A point emitter; its position is certain.
    Point,
    /// A direction of the environment: `at.ng` is the direction of flight into the scene, and distances to `at.p` mean nothing.
    Infinite,
}

/// The light end of a path.
#[derive(Clone, Copy, Debug)]
pub struct Endpoint {
    /// Where it is.
    pub at: SurfacePoint,
    /// What it is.
    pub kind: EndpointKind,
}

/// An endpoint sampled for a point to be lit.
#[derive(Clone, Copy, Debug)]
pub struct LiSample {
    /// The light end of the connection.
    pub endpoint: Endpoint,
    /// Unit direction from the reference point to the emitter.
    pub wi: Vec3,
    /// Distance to the emitter \[m\]; infinite for an environment.
    pub distance: f32,
    /// Radiance arriving along the connection if nothing is in its way; I/d² for a point emitter.
    pub li: Spectrum,
    /// Density at the reference point \[1/sr\]; 1 for a delta position.
    pub pdf: f32,
    /// True if the position is certain, so that no other technique can find it.
    pub delta: bool,
}

/// The start of a light walk.
#[derive(Clone, Copy, Debug)]
pub struct LeSample {
    /// The light end of the path.
    pub endpoint: Endpoint,
    /// The ray that leaves it.
    pub ray: Ray,
    /// Emitted radiance along the ray; the intensity \[W/sr\] for a point emitter.
    pub le: Spectrum,
    /// Density of the position \[1/m²\]; of the direction \[1/sr\] for an environment; 1 for a point emitter.
    pub pdf_p: f32,
    /// Density of the direction \[1/sr\]; of the position on the disc across the scene \[1/m²\] for an environment.
    pub pdf_d: f32,
    /// |cosθ| at the emitter; 1 for a point emitter and an environment.
    pub cos: f32,
}

#[cfg(test)]
mod tests;
