//! The densities of a bidirectional path under every strategy, and the MIS weight they give: the plain sum over all strategies.
//!
//! A path of `n` vertices, numbered from the emitter (0) to the camera (`n − 1`), is made by strategy `s` with density
//!
//! `p_s = Π_{i<s} light[i] · Π_{i≥s} camera[i]`,  `0 ≤ s < n`,
//!
//! `light[i]` and `camera[i]` being the densities with which a walk from that end generates vertex `i` from its neighbour
//! [Veach97, §10.2]. Strategy 1 chooses its emitter vertex as seen from vertex 1, with a density of its own.

use integrators::connect::EmitterEnd;
use integrators::vertex::{PathVertex, Site, density_across};
use integrators::walk::WalkRules;
use sampling::bsdf::TransportMode;
use sampling::mis::{Heuristic, Rivals};
use scenes::{Rays, Scene};

/// A path's densities, from both ends.
#[derive(Clone, Debug, Default)]
pub struct PathDensities {
    /// Density of vertex `i` from the light's end.
    pub light: Vec<f64>,
    /// Density of vertex `i` from the camera's end; that of the camera itself, which all strategies choose alike, is not used.
    pub camera: Vec<f64>,
    /// Whether a connection may end at vertex `i` of this path: it did not scatter by a delta lobe.
    pub connectable: Vec<bool>,
    /// Density of vertex 0 when it is chosen as seen from vertex 1.
    pub next_event: f64,
    /// Whether a walk from the camera can meet vertex 0.
    pub hittable: bool,
    /// Light subpaths for one camera subpath.
    pub light_paths: f64,
    /// Whether light vertices are connected to the camera (the strategy of one camera vertex).
    pub camera_connections: bool,
    /// Whether an emitter is connected straight to the camera (strategy 1 of paths of two vertices).
    pub emitter_to_camera: bool,
    /// What every strategy's density counts by; 1 where there is none.
    pub factors: Vec<f64>,
}

impl PathDensities {
    /// Sets the densities of the path made by joining the last vertices of two subpaths, the light one not empty.
    ///
    /// `next_event` is the density of the emitter's vertex when it is chosen as seen from vertex 1.
    pub fn set_connected(
        &mut self,
        scene: &Scene,
        rules: (&WalkRules, &WalkRules),
        light: &[PathVertex],
        camera: &[PathVertex],
        next_event: f64,
    ) {
        let (light_rules, camera_rules) = rules;
        let (s, t) = (light.len(), camera.len());
        self.copy_subpaths(light, camera);
        let (y, z) = (&light[s - 1], &camera[t - 1]);
        let to_y = match (y.is_infinite(), z.is_infinite()) {
            (true, _) => -y.at.ng,
            (false, true) => z.at.ng,
            (false, false) => (y.at.p - z.at.p).normalize_or_zero(),
        };
        self.next_event = next_event;
        match &y.site {
            Site::Emitter(emitter, endpoint) => {
                let end = EmitterEnd { emitter: *emitter, endpoint: *endpoint };
                (self.light[0], self.light[1]) = end.emission_densities(scene, z);
                self.hittable = !endpoint.kind.is_delta();
            }
            Site::Surface(interaction) => {
                let survival = light_rules.survival(interaction);
                let forward = interaction.pdf(y.wo, -to_y, TransportMode::Importance);
                self.light[s] = z.density(forward * survival, y.at.p);
                let back = interaction.pdf(-to_y, y.wo, TransportMode::Radiance);
                self.camera[s - 2] = light[s - 2].density(back * survival, y.at.p);
                self.hittable = !matches!(&light[0].site, Site::Emitter(_, endpoint) if endpoint.kind.is_delta());
            }
            Site::Camera(_) => {}
        }
        match &z.site {
            Site::Camera(rays) => {
                let (_, pdf) = scene.camera.pdf_we(&z.at, to_y);
                self.camera[s - 1] = match rays {
                    Rays::FromPoint | Rays::FromLens => y.density(pdf, z.at.p),
                    Rays::Parallel => density_across(&y.at, pdf, to_y),
                };
            }
            Site::Surface(interaction) => {
                let survival = camera_rules.survival(interaction);
                let forward = interaction.pdf(z.wo, to_y, TransportMode::Radiance);
                self.camera[s - 1] = y.density(forward * survival, z.at.p);
                if t >= 3 {
                    let back = interaction.pdf(to_y, z.wo, TransportMode::Importance);
                    self.light[s + 1] = camera[t - 2].density(back * survival, z.at.p);
                }
            }
            Site::Emitter(..) => {}
        }
    }

    /// Sets the densities of the path that a camera subpath makes alone, its last vertex being on an emitter.
    pub fn set_emission(&mut self, scene: &Scene, camera: &[PathVertex], end: &EmitterEnd) {
        self.copy_subpaths(&[], camera);
        let before = &camera[camera.len() - 2];
        (self.light[0], self.light[1]) = end.emission_densities(scene, before);
        self.next_event = end.next_event_density(scene, &before.at);
        self.hittable = true;
    }

    /// Copies what the subpaths know; what depends on how they are joined is left to be set.
    fn copy_subpaths(&mut self, light: &[PathVertex], camera: &[PathVertex]) {
        self.light.clear();
        self.camera.clear();
        self.connectable.clear();
        for y in light {
            self.light.push(y.pdf_fwd);
            self.camera.push(y.pdf_rev);
            self.connectable.push(!y.delta);
        }
        for z in camera.iter().rev() {
            self.light.push(z.pdf_rev);
            self.camera.push(z.pdf_fwd);
            self.connectable.push(!z.delta);
        }
        // The vertices that are joined end their subpaths: a direction they were left by belongs to longer paths.
        let s = light.len();
        self.connectable[s] = true;
        if s > 0 {
            self.connectable[s - 1] = true;
        }
    }

    /// Number of vertices.
    fn len(&self) -> usize {
        self.light.len()
    }

    /// Whether strategy `s` can make the path.
    pub fn is_possible(&self, s: usize) -> bool {
        match s {
            0 => self.hittable,
            1 if self.len() == 2 => self.emitter_to_camera,
            s if s == self.len() - 1 && !self.camera_connections => false,
            _ => self.connectable[s - 1] && self.connectable[s],
        }
    }

    /// What strategy `s` has beyond the product of densities: strategy 1 chooses its emitter vertex its own way, several light
    /// subpaths are several samples, and there may be factors.
    fn factor(&self, s: usize) -> f64 {
        let own = match s {
            0 => 1.0,
            1 => self.next_event / self.light[0],
            _ => self.light_paths,
        };
        own * self.factors.get(s).unwrap_or(&1.0)
    }

    /// MIS weight of the strategy `s` that made the path.
    pub fn weight(&self, s: usize, heuristic: Heuristic) -> f64 {
        let own = self.factor(s);
        let mut rivals = Rivals::NONE;
        let mut ratio = 1.0;
        for i in (0..s).rev() {
            ratio *= self.camera[i] / self.light[i];
            if self.is_possible(i) {
                rivals = heuristic.join(rivals, ratio * self.factor(i) / own);
            }
        }
        ratio = 1.0;
        for i in s..self.len() - 1 {
            ratio *= self.light[i] / self.camera[i];
            if self.is_possible(i + 1) {
                rivals = heuristic.join(rivals, ratio * self.factor(i + 1) / own);
            }
        }
        heuristic.weight(rivals)
    }
}
