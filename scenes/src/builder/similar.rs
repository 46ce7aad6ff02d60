//! The same scene in another unit of length, and elsewhere.

use super::SceneBuilder;
use crate::camera::Projection;
use crate::camera::Receiver;
use crate::material::Material;
use glam::{DAffine3, DMat3, DVec3};

/// What changes a scene's coordinates, and nothing that can be seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// What lengths are multiplied by; positive.
    pub scale: f64,
    /// What is added to positions then \[m\].
    pub offset: DVec3,
}

impl Similarity {
    fn point(&self, p: DVec3) -> DVec3 {
        p * self.scale + self.offset
    }

    fn map(&self) -> DAffine3 {
        DAffine3 { matrix3: DMat3::from_diagonal(DVec3::splat(self.scale)), translation: self.offset }
    }
}

impl SceneBuilder {
    /// A scene that looks the same through its camera: all lengths are scaled, those of lenses, heights of relief and mean free paths
    /// among them, and intensities by their square, so that as much light arrives. A closed form is not known of it.
    #[must_use]
    pub fn resembling(mut self, similarity: &Similarity) -> Self {
        let map = similarity.map();
        self.shapes.iter_mut().filter(|shape| shape.group.is_none()).for_each(|s| s.transform = map * s.transform);
        self.place_by(map);
        let nearer = (similarity.scale * similarity.scale) as f32;
        for (position, intensity) in &mut self.points {
            (*position, *intensity) = (similarity.point(*position), *intensity * nearer);
        }
        for spot in &mut self.spots {
            (spot.position, spot.target) = (similarity.point(spot.position), similarity.point(spot.target));
            spot.intensity *= nearer;
        }
        if let Some(camera) = &mut self.camera {
            (camera.position, camera.target) = (similarity.point(camera.position), similarity.point(camera.target));
            camera.projection = resembling(&camera.projection, similarity.scale);
        }
        let emissions = self.shapes.iter_mut().filter_map(|shape| shape.emission.as_mut());
        emissions.for_each(|emission| emission.radiance = emission.radiance.clone().resembling(similarity));
        for material in &mut self.materials {
            if let Material::Subsurface(body) = material {
                body.subsurface = body.subsurface.scaled(similarity.scale as f32);
            }
            material.parts_mut().iter_mut().for_each(|part| part.resemble(similarity));
        }
        self.closed_form = None;
        self
    }
}

fn resembling(projection: &Projection, scale: f64) -> Projection {
    match *projection {
        Projection::ThinLens { fov, lens_radius, focus_distance } => Projection::ThinLens {
            fov,
            lens_radius: lens_radius * scale,
            focus_distance: focus_distance.map(|distance| distance * scale),
        },
        Projection::Orthographic { extent } => Projection::Orthographic { extent: extent * scale },
        Projection::Irradiance(receiver) => Projection::Irradiance(match receiver {
            Receiver::Point => Receiver::Point,
            Receiver::Rectangle(sides) => Receiver::Rectangle(sides.map(|side| side * scale)),
            Receiver::Disk(radius) => Receiver::Disk(radius * scale),
            Receiver::Sphere(radius) => Receiver::Sphere(radius * scale),
        }),
        Projection::Pinhole { .. } | Projection::Equirectangular => *projection,
    }
}

#[cfg(test)]
mod tests {
    use crate::load::open;
    use crate::needs::Skip;
    use crate::{Similarity, builtin_names};
    use glam::dvec3;

    /// What the rays of a scene's camera meet, and how far away.
    fn seen(builder: crate::SceneBuilder) -> Vec<Option<(f32, [f32; 3])>> {
        let scene = builder.build(Skip::Unneeded).unwrap();
        let rasters = (0..64).map(|i| sampling::vec2((i % 8) as f32 + 0.5, (i / 8) as f32 + 0.5));
        let look = |raster| {
            let ray = scene.camera.sample_we(raster, sampling::vec2(0.3, 0.6)).ray;
            scene.intersect(&ray).map(|hit| (hit.t, scene.le(&hit, -ray.d).to_array()))
        };
        rasters.map(look).collect()
    }

    #[test]
    fn every_built_in_scene_looks_the_same_elsewhere() {
        for name in builtin_names() {
            let here = seen(open(name, Some((8, 8))).unwrap());
            let similarity = Similarity { scale: 1e-3, offset: dvec3(100.0, -30.0, 70.0) };
            let there = seen(open(name, Some((8, 8))).unwrap().resembling(&similarity));
            let differing = here.iter().zip(&there).filter(|pair| match pair {
                (Some((a, le_a)), Some((b, le_b))) => {
                    let light = le_a.iter().zip(le_b).any(|(x, y)| (x - y).abs() > 1e-4 * x.abs());
                    (a * 1e-3 - b).abs() > 1e-5 * b || light
                }
                (a, b) => a.is_some() != b.is_some(),
            });
            // A ray at an edge may meet what is behind it.
            assert!(differing.count() <= 1, "{name}: {here:?} {there:?}");
        }
    }
}
