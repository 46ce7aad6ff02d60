//! Importers of other programs' files.
//!
//! [`gltf`], [`mitsuba`] and [`pbrt`] translate scenes into scene files, in the manner of [`translation`].
//!
//! [`obj`] and [`ply`] read meshes, [`mtl`] reads material libraries, [`appearance`] decides what becomes of those,
//! [`polygon`] cuts faces into triangles, [`solid`] mends the orientation of closed bodies, [`viewpoint`] chooses a
//! camera for a file that has none.

pub mod appearance;
mod corners;
mod faces;
pub mod gltf;
mod ledger;
pub mod mitsuba;
pub mod mtl;
pub mod obj;
pub mod pbrt;
pub mod ply;
pub mod polygon;
mod smoothing;
pub mod solid;
mod source;
pub mod translation;
mod uv_map;
pub mod viewpoint;

/// Whether a transform leaves nothing of some direction, so that there is no way back.
fn flattens(map: &glam::DMat4) -> bool {
    let axes = glam::DMat3::from_mat4(*map);
    let spread = axes.x_axis.length() * axes.y_axis.length() * axes.z_axis.length();
    !spread.is_finite() || !axes.inverse().is_finite() || axes.determinant().abs() <= 1e-9 * spread
}

#[cfg(test)]
mod tests;
