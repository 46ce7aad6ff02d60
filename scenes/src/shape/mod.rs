//! Shapes: what surfaces are, as the builder is given them, and how points on them are sampled.

mod analytic;
mod cylinder;
mod disk;
mod few_triangles;
pub(crate) mod margin;
mod mesh;
mod rectangle;
mod sphere;
mod triangle;

pub(crate) use analytic::Analytic;
pub use cylinder::Cylinder;
pub use disk::Disk;
pub use few_triangles::{FewTriangles, SeenTriangles};
pub use mesh::MeshData;
pub(crate) use mesh::{BakedMesh, bake_mesh};
pub use rectangle::Rectangle;
pub use sphere::Sphere;
pub use triangle::{Parallelogram, Triangle};

use glam::DVec3;

/// Names a shape of a scene under construction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ShapeId(pub u32);

/// A shape as it was given, before its transform; lengths in metres.
#[derive(Clone, Debug)]
pub(crate) enum Geometry {
    /// A parallelogram; its front is where `edge_u × edge_v` points.
    Quad { origin: DVec3, edge_u: DVec3, edge_v: DVec3 },
    /// A sphere; its front is outside.
    Sphere { center: DVec3, radius: f64 },
    /// An elliptic disk with these vectors from its centre to its rim; its front is where `edge_u × edge_v` points.
    Disk { center: DVec3, edge_u: DVec3, edge_v: DVec3 },
    /// A tube without caps; its front is outside.
    Cylinder { from: DVec3, to: DVec3, radius: f64 },
    /// A triangle mesh; its front is where the vertices run counter-clockwise.
    Mesh(MeshData),
}

/// A point sampled on a shape, uniformly over its area.
#[derive(Clone, Copy, Debug)]
pub struct AreaSample {
    /// The point, its normal on the shape's front.
    pub at: crate::ray::SurfacePoint,
    /// Density per area \[1/m²\].
    pub pdf_area: f32,
}

#[cfg(test)]
mod tests;
