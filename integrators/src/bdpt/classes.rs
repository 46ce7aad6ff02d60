//! The classes of connected paths.

use super::join::{Connection, Join};
use crate::connect::direction;
use crate::contribution::Sink;
use crate::lpe::Classifier;
use crate::scratch::LightPath;
use crate::trail::{self, Bounce, Trail, Trails};
use crate::vertex::{PathVertex, Site};
use sampling::sampler::Subpath;
use scenes::EmitterId;

impl<S: Sink> Join<'_, S> {
    /// Follows the words of all subpaths.
    pub(super) fn follow(&mut self, classifier: &Classifier) {
        let Trails { camera, light, .. } = &mut *self.trails;
        camera.clear();
        camera.follow(classifier, Subpath::Camera, classifier.camera_start(), self.camera);
        light.clear();
        for LightPath { vertices, .. } in self.paths {
            let vertices = &self.light[vertices.clone()];
            let Site::Emitter(emitter, _) = &vertices[0].site else { continue };
            light.follow(classifier, Subpath::Light, classifier.light_start(emitter.0 as usize), vertices);
        }
    }

    /// Finds the classes of a connected path, whose subpaths scatter at their last vertices, if these are surfaces, towards one
    /// another.
    pub(super) fn classify(&mut self, classifier: &Classifier, connection: &Connection, emitter: EmitterId) {
        let &Connection { first, light, camera, .. } = connection;
        let (y, z) = (&light[light.len() - 1], &camera[camera.len() - 1]);
        let d = direction(z, y);
        let Trails { camera: from_camera, light: from_light, classes } = &mut *self.trails;
        let (camera_start, light_start) = (classifier.camera_start(), classifier.light_start(emitter.0 as usize));
        let scatter = |trail: &mut Trail, subpath, number, vertex: &PathVertex, wi, start| match &vertex.site {
            Site::Surface(hit) => {
                let bounce = Bounce { hit, wo: vertex.wo, wi, delta: false };
                trail.scatter(classifier, subpath, number, &bounce);
            }
            Site::Camera(_) | Site::Emitter(..) => trail.begin(start),
        };
        scatter(from_camera, Subpath::Camera, camera.len() - 1, z, d, camera_start);
        scatter(from_light, Subpath::Light, first + light.len() - 1, y, -d, light_start);
        trail::join(classifier, from_camera.at(from_camera.last()), from_light.at(from_light.last()), classes);
        from_camera.pop();
        from_light.pop();
    }
}
