//! Shapes, acceleration, materials, emitters, cameras and scene files of neumann.
//!
//! A scene is where light is emitted, scattered and measured. This crate answers an integrator's questions about it: where
//! does this ray end, is anything between these points, what does this surface do, what arrives from this emitter and how
//! likely was it sampled. It *knows nothing of integrators*: it never follows a path.
//!
//! # Conventions
//!
//! Those of [`sampling`], and:
//!
//! - **World space** throughout; directions point away from the surface. `ng` is a surface's own front normal, never turned
//!   towards the viewer, `ns` the shading normal on the same side.
//! - **Rays** run over the open interval (0, `t_max`). Their origins are moved off surfaces by the error of the very point
//!   they leave, so that scenes may have any size.
//! - **Emitters and cameras** are one idea seen from both ends: `le`/`we`, `sample_li`/`sample_wi`, `sample_le`/`sample_we`,
//!   each with its densities.
//! - **Lengths** in metres, angles of files in degrees.
//!
//! # Modules, in reading order
//!
//! 1. [`ray`]: rays, segments, and points that they can leave.
//! 2. [`scene`] and [`interaction`]: the questions an integrator asks.
//! 3. [`emitter`] and [`camera`]: the two ends of a path.
//! 4. [`material`], [`texture`], [`relief`] and [`tilt`]: what surfaces do; [`subsurface`]: what goes on beneath them.
//! 5. [`shape`] and `accel`: where surfaces are.
//! 6. [`builder`] and [`needs`]: how a scene is made, and what it doesn't need.
//! 7. [`mod@load`], [`description`], [`import`] and [`builtin`]: scenes by name or path, scene files, other formats, and the
//!    scenes that come with the program; [`progress`] tells how far that is.
//! 8. [`mod@file`]: files that a user names; [`error`]: what can be wrong with a scene.

mod accel;
pub mod builder;
pub mod builtin;
pub mod camera;
pub mod description;
pub mod emitter;
pub mod error;
pub mod file;
pub mod import;
pub mod interaction;
pub mod labels;
pub mod load;
pub mod material;
pub mod needs;
pub mod progress;
pub mod ray;
pub mod region;
pub mod relief;
pub mod scene;
pub mod shape;
pub mod subsurface;
mod suggest;
pub use suggest::nearest;
mod surface;
#[cfg(test)]
mod test_support;
pub mod texture;
pub mod tilt;

pub use accel::Kernel;
pub use builder::{
    CameraSettings, ChoiceRule, Emission, EnvironmentImage, Falloff, GroupId, Mapping, MeshData, PointRule,
    SceneBuilder, ShapeId, Similarity, Spot,
};
pub use camera::{Camera, Crop, Projection, Rays, WeSample, WiSample};
pub use emitter::{Emitter, EmitterId, EmitterOdds, Endpoint, EndpointKind, LeSample, LiSample};
pub use error::SceneError;
pub use interaction::Interaction;
pub use labels::{Labels, LightGroup};
pub use load::{LoadOptions, builtin_names, load};
pub use material::{Material, MaterialId};
pub use needs::{Needs, Skip, Work};
pub use ray::{Ray, SurfacePoint};
pub use region::Region;
pub use relief::Relief;
pub use scene::{Facet, FacetHit, Scene};
pub use subsurface::Body;
pub use surface::SurfaceId;
pub use texture::Texture;
pub use tilt::{Remedies, Tilt};
