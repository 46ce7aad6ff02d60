//! How far shapes reach, as they were given and transformed, and what textures are over them.

use super::Shape;
use super::check::similarity_scale;
use crate::shape::Geometry;
use crate::texture::{SurfaceCoordinates, Texture};
use glam::DVec3;
use rayon::prelude::*;
use sampling::Vec3;

/// What a shape fills at the most.
enum Reach {
    /// The convex hull of some points.
    Points(Vec<DVec3>),
    /// What is symmetric about a point: a ball, an ellipsoid or an ellipse of these half axes, and a rod along both of its ends.
    Symmetric { middle: DVec3, half_axes: [DVec3; 3], rod: DVec3 },
}

impl Reach {
    /// How far from the middle along an axis, in units of the axis' length.
    fn along(half_axes: &[DVec3; 3], rod: DVec3, axis: DVec3) -> f64 {
        DVec3::from_array(half_axes.map(|half| half.dot(axis))).length() + rod.dot(axis).abs()
    }
}

impl Shape {
    /// The lowest and the highest coordinates \[m\].
    pub(super) fn extent(&self) -> (DVec3, DVec3) {
        let nothing = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let union = |(low, high): (DVec3, DVec3), (l, h): (DVec3, DVec3)| (low.min(l), high.max(h));
        if let Geometry::Mesh(mesh) = &self.geometry {
            let place = |p: &DVec3| self.transform.transform_point3(*p);
            return mesh.positions.par_iter().map(place).map(|p| (p, p)).reduce(|| nothing, union);
        }
        match self.reach() {
            Reach::Points(points) => points.into_iter().map(|p| (p, p)).fold(nothing, union),
            Reach::Symmetric { middle, half_axes, rod } => {
                let reach = DVec3::from_array(DVec3::AXES.map(|axis| Reach::along(&half_axes, rod, axis)));
                (middle - reach, middle + reach)
            }
        }
    }

    /// The least and the greatest value of any channel of a texture over the shape.
    pub(super) fn range(&self, texture: &Texture) -> (f32, f32) {
        let of = |values: &mut dyn Iterator<Item = f32>| {
            values.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
        };
        if texture.range().is_some() {
            return texture.range_around(Vec3::ZERO, |_| 0.0);
        }
        if let (Texture::VertexColour, Geometry::Mesh(mesh)) = (texture, &self.geometry) {
            return of(&mut mesh.colours.iter().flat_map(|colour| colour.to_array()));
        }
        match self.reach() {
            // A ramp is linear, so that its ends are at corners.
            Reach::Points(points) => {
                let at = |p: &DVec3| texture.at(&SurfaceCoordinates::of(p.as_vec3())).to_array();
                of(&mut points.iter().flat_map(at))
            }
            Reach::Symmetric { middle, half_axes, rod } => {
                texture.range_around(middle.as_vec3(), |axis| Reach::along(&half_axes, rod, axis.as_dvec3()) as f32)
            }
        }
    }

    fn reach(&self) -> Reach {
        let place = |p: DVec3| self.transform.transform_point3(p);
        let turn = |v: DVec3| self.transform.transform_vector3(v);
        match &self.geometry {
            &Geometry::Quad { origin, edge_u, edge_v } => {
                let corners = [origin, origin + edge_u, origin + edge_v, origin + edge_u + edge_v];
                Reach::Points(corners.map(place).to_vec())
            }
            &Geometry::Sphere { center, radius } => {
                let radius = radius * similarity_scale(&self.transform.matrix3).unwrap_or(1.0);
                let half_axes = DVec3::AXES.map(|axis| axis * radius);
                Reach::Symmetric { middle: place(center), half_axes, rod: DVec3::ZERO }
            }
            &Geometry::Disk { center, edge_u, edge_v } => {
                let half_axes = [turn(edge_u), turn(edge_v), DVec3::ZERO];
                Reach::Symmetric { middle: place(center), half_axes, rod: DVec3::ZERO }
            }
            &Geometry::Cylinder { from, to, radius } => {
                let (x, y) = (to - from).normalize_or(DVec3::Z).any_orthonormal_pair();
                let half_axes = [turn(x * radius), turn(y * radius), DVec3::ZERO];
                Reach::Symmetric { middle: place((from + to) / 2.0), half_axes, rod: turn((to - from) / 2.0) }
            }
            Geometry::Mesh(mesh) => Reach::Points(mesh.positions.iter().map(|&p| place(p)).collect()),
        }
    }
}
