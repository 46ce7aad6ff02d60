//! The emitters that surfaces are.

use super::parts::{Parts, Placed};
use super::varying::spread;
use crate::emitter::{AreaChart, AreaEmitter, AreaShape, Emission};
use crate::error::SceneError;
use crate::shape::{Analytic, FewTriangles, Rectangle, Triangle};
use crate::surface::Attributes;
use crate::texture::{SurfaceCoordinates, Texture};
use sampling::Vec3;
use sampling::math::Spectrum;
use std::ops::Range;

/// Points at which a radiance is looked at for its mean.
const POINTS: usize = 4096;

/// What part of its greatest value a radiance's mean is taken to be at the least: no quadrature sees all of it, and an emitter whose
/// mean is zero is never chosen.
const LEAST_MEAN: f32 = 1.0 / 4096.0;

impl Parts {
    /// The emitter of the shape that has just been placed. `ends` are values between which all of its radiance lies.
    pub(super) fn area_emitter(
        &self,
        placed: &Placed,
        emission: Emission,
        attributes: Option<&Attributes>,
        ends: &[Spectrum],
        name: &str,
    ) -> Result<AreaEmitter, SceneError> {
        let (shape, area) = (self.area_shape(placed, emission.two_sided), self.area(placed));
        if area.is_nan() || area <= 0.0 {
            return Err(SceneError::invalid(
                format!("{name} emits but has no area"),
                "give it at least one triangle with an area",
            ));
        }
        let chart = self.chart(placed, &emission.radiance, attributes).map(Box::new);
        let linear = match &emission.radiance {
            radiance @ (Texture::Constant(_) | Texture::Ramp { .. }) => {
                Some(self.mean_of_linear(placed, radiance, area))
            }
            _ => None,
        };
        let mean_radiance = linear.unwrap_or(Spectrum::ZERO);
        let mut emitter =
            AreaEmitter { shape, emission, area: area as f32, mean_radiance, points: self.point_rule, chart };
        if linear.is_none() {
            let mean = emitter.mean_over((0..POINTS).map(spread));
            emitter.mean_radiance = ends.iter().fold(mean, |mean, &end| mean.max(end * LEAST_MEAN));
        }
        Ok(emitter)
    }

    /// The area \[m²\] of the shape that has just been placed, one side.
    pub(super) fn area(&self, placed: &Placed) -> f64 {
        match placed {
            Placed::Analytic => match self.analytic.last().expect("it has just been placed") {
                Analytic::Sphere(sphere) => f64::from(sphere.area()),
                Analytic::Disk(disk) => disk.area(),
                Analytic::Cylinder(cylinder) => cylinder.area(),
            },
            Placed::Quad { range, .. } | Placed::Mesh(range) => {
                self.triangles[range.clone()].iter().map(Triangle::area).sum()
            }
        }
    }

    fn area_shape(&self, placed: &Placed, two_sided: bool) -> AreaShape {
        match placed {
            Placed::Analytic => match self.analytic.last().expect("it has just been placed") {
                Analytic::Sphere(sphere) => AreaShape::Sphere(*sphere),
                Analytic::Disk(disk) => AreaShape::Disk(disk.clone()),
                Analytic::Cylinder(cylinder) => AreaShape::Cylinder(cylinder.clone()),
            },
            Placed::Quad { quad, .. } => match Rectangle::new(quad) {
                Some(rectangle) => AreaShape::Rectangle(Box::new(rectangle)),
                None => AreaShape::Quad(*quad),
            },
            Placed::Mesh(range) => self.emitting_mesh(range.clone(), two_sided),
        }
    }

    /// The coordinates in which a radiance is read, if it is read in any.
    fn chart(&self, placed: &Placed, radiance: &Texture, attributes: Option<&Attributes>) -> Option<AreaChart> {
        if !radiance.needs_uv() && *radiance != Texture::VertexColour {
            return None;
        }
        Some(match placed {
            Placed::Analytic => AreaChart::Analytic(self.analytic_infos.last()?.chart.clone()),
            Placed::Quad { quad, .. } => AreaChart::Quad { turned: quad.turned },
            Placed::Mesh(_) => {
                let Attributes { triangles, uvs, colours, .. } = attributes?;
                let (triangles, uvs, colours) = (triangles.clone(), uvs.clone(), colours.clone());
                AreaChart::Mesh(Attributes { triangles, uvs, colours, ..Attributes::default() })
            }
        })
    }

    /// The mean of a radiance that is linear over the surface: its value in the middle of what is symmetric, and of each triangle.
    fn mean_of_linear(&self, placed: &Placed, radiance: &Texture, area: f64) -> Spectrum {
        let range = match placed {
            Placed::Analytic => {
                let middle = self.analytic.last().expect("it has just been placed").middle();
                return radiance.at(&SurfaceCoordinates::of(middle));
            }
            Placed::Quad { range, .. } | Placed::Mesh(range) => range.clone(),
        };
        let mut mean = [0.0f64; 3];
        for triangle in &self.triangles[range] {
            let share = triangle.area() / area;
            let value = radiance.at(&SurfaceCoordinates::of(triangle.centroid()));
            for (sum, value) in mean.iter_mut().zip(value.to_array()) {
                *sum += share * f64::from(value);
            }
        }
        Spectrum::from(mean.map(|value| value as f32))
    }

    fn emitting_mesh(&self, range: Range<usize>, two_sided: bool) -> AreaShape {
        let triangles: Vec<(Triangle, Vec3)> =
            range.map(|index| (self.triangles[index], self.infos[index].ng)).collect();
        let cumulative = triangles
            .iter()
            .scan(0.0, |sum, (triangle, _)| {
                *sum += triangle.area();
                Some(*sum)
            })
            .collect();
        let few = FewTriangles::new(&triangles, two_sided).map(Box::new);
        AreaShape::Mesh { triangles, cumulative, few }
    }
}
