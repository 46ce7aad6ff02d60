//! Emitters: what emits light. They mirror the cameras: `le`, `sample_li`, `sample_le` and their densities.
//!
//! A light path ends in an [`Endpoint`]. Next-event estimation samples it given the point to be lit (`sample_li`, one density
//! per solid angle there); light walks sample it by itself, position and direction apart (`sample_le`, two densities).

mod area;
mod bounds;
mod choice;
mod directional;
mod environment;
mod gloss;
mod image;
mod mapping;
mod point;
mod spot;
mod tree;

pub(crate) use area::AreaChart;
pub use area::{AreaEmitter, AreaShape, Emission, PointRule};
pub use choice::ChoiceRule;
pub(crate) use choice::{EmitterChoice, NextEventChoice};
pub use directional::DirectionalEmitter;
pub use environment::ConstantEnvironment;
pub use gloss::EmitterOdds;
pub(crate) use gloss::is_asked;
pub use image::{EnvironmentImage, ImageEnvironment};
pub use mapping::Mapping;
pub use point::PointEmitter;
pub use spot::{Falloff, Spot, SpotEmitter};

use crate::ray::{Ray, SurfacePoint};
use sampling::Vec3;
use sampling::math::Spectrum;
use std::sync::Arc;

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
    /// Light arriving from an infinitely distant sphere that bears an image.
    Image(Arc<ImageEnvironment>),
    /// A point that emits into a cone.
    Spot(SpotEmitter),
    /// Light flying in one direction.
    Directional(DirectionalEmitter),
}

impl Emitter {
    /// Emitted power \[W\], the mean of the channels.
    pub fn power(&self) -> f64 {
        match self {
            Emitter::Area(area) => area.power(),
            Emitter::Point(point) => point.power(),
            Emitter::Environment(environment) => environment.power(),
            Emitter::Image(image) => image.power(),
            Emitter::Spot(spot) => spot.power(),
            Emitter::Directional(directional) => directional.power(),
        }
    }

    /// The largest radiance that a ray which meets it may bring, channel by channel; of a texture that follows the surface the mean;
    /// zero if no ray can meet it.
    pub fn brightest(&self) -> Spectrum {
        match self {
            Emitter::Area(area) => area.emission.radiance.range().map_or(area.mean_radiance, |(_, most)| most),
            Emitter::Environment(environment) => environment.radiance,
            Emitter::Image(image) => image.brightest(),
            Emitter::Point(_) | Emitter::Spot(_) | Emitter::Directional(_) => Spectrum::ZERO,
        }
    }

    /// True if no ray can meet it.
    pub fn is_delta(&self) -> bool {
        matches!(self, Emitter::Point(_) | Emitter::Spot(_) | Emitter::Directional(_))
    }

    /// True if it lies infinitely far.
    pub fn is_distant(&self) -> bool {
        self.is_environment() || matches!(self, Emitter::Directional(_))
    }

    /// True if it lights the scene from infinitely far, wherever rays end.
    pub fn is_environment(&self) -> bool {
        matches!(self, Emitter::Environment(_) | Emitter::Image(_))
    }
}

/// What kind of thing a light path ends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndpointKind {
    /// A point of an emitting surface.
    Surface,
    /// A point or a spot; its position is certain.
    Point,
    /// A direction of the environment: `at.ng` is the direction of flight into the scene, and distances to `at.p` mean nothing.
    Infinite,
    /// The direction of a directional emitter, which is certain; `at` is as for `Infinite`.
    Direction,
}

impl EndpointKind {
    /// Whether it lies infinitely far, so that densities of it are per solid angle and those of its walks' positions per area
    /// across them.
    #[inline]
    pub fn is_infinite(self) -> bool {
        matches!(self, EndpointKind::Infinite | EndpointKind::Direction)
    }

    /// Whether it is certain once its emitter is chosen, so that no ray meets it.
    #[inline]
    pub fn is_delta(self) -> bool {
        matches!(self, EndpointKind::Point | EndpointKind::Direction)
    }
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
    /// Distance to the emitter \[m\]; infinite for what lies infinitely far.
    pub distance: f32,
    /// Radiance arriving along the connection if nothing is in its way; I/d² for a point or a spot, and the irradiance for a
    /// directional emitter.
    pub li: Spectrum,
    /// Density at the reference point \[1/sr\]; 1 for what is certain.
    pub pdf: f32,
    /// True if the endpoint is certain, so that no other technique can find it.
    pub delta: bool,
}

/// The start of a light walk.
#[derive(Clone, Copy, Debug)]
pub struct LeSample {
    /// The light end of the path.
    pub endpoint: Endpoint,
    /// The ray that leaves it.
    pub ray: Ray,
    /// Emitted radiance along the ray; the intensity \[W/sr\] of a point or a spot, the irradiance \[W/m²\] of a directional
    /// emitter.
    pub le: Spectrum,
    /// Density of the position \[1/m²\]; of the direction \[1/sr\] for an environment; 1 for what is certain.
    pub pdf_p: f32,
    /// Density of the direction \[1/sr\]; of the position on the disc across the scene \[1/m²\] for what lies infinitely far.
    pub pdf_d: f32,
    /// |cosθ| at the emitter; 1 off surfaces.
    pub cos: f32,
}

#[cfg(test)]
mod tests;
