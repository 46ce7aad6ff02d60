//! The MIS weights of bidirectional paths, from sums that are carried along the subpaths.
//!
//! A path of `n` vertices, numbered from the emitter (0) to the camera (`n − 1`), is made by strategy `s` with density
//!
//! `p_s = Π_{i<s} light[i] · Π_{i≥s} camera[i]`,  `0 ≤ s < n`,
//!
//! `light[i]` and `camera[i]` being the densities with which a walk from that end generates vertex `i` from its neighbour
//! [Veach97, §10.2]. Strategy 1 chooses its emitter vertex as seen from vertex 1, with a density of its own.
//!
//! The ratio of `p_{s−1}` to `p_s` is that of the two densities of vertex `s − 1`. All but those of the two vertices on either side
//! of a connection are known before it is made; so the terms of the strategies with fewer light vertices are summed up once along the
//! light subpath, those with fewer camera vertices along the camera's, and a weight takes the same few steps however long the
//! path is [vanAntwerpen11; Georgiev12].
//!
//! Where vertices are merged as well, vertex `i` of a path may be one at which both walks ended, near one another. With `η = N π r²`,
//! the number of light subpaths times the area that is near, that happens with density `η · light[i] · p_i = η · camera[i] · p_{i+1}`
//! \[Georgiev12\]: it stands between strategies `i` and `i + 1`, and is summed up there.

mod densities;

pub use densities::{Densities, ORDERS, PerStrategy, strategies_below};

use crate::vertex::{PathVertex, Site, density_across, density_at};
use crate::walk::WalkRules;
use sampling::Vec3;
use sampling::bsdf::TransportMode;
use sampling::fault;
use sampling::mis::{Heuristic, Rivals};
use scenes::{EmitterId, Endpoint, EndpointKind, Rays, Scene, SurfacePoint};

/// What a light subpath knows of its first vertex, or a camera subpath of the emitter that it met.
#[derive(Clone, Copy, Debug)]
pub struct EmitterEnd {
    /// Whose vertex it is.
    pub emitter: EmitterId,
    /// The vertex.
    pub endpoint: Endpoint,
}

impl EmitterEnd {
    /// Density of the vertex when it is chosen as seen from a point, per area (per solid angle at an environment).
    pub fn next_event_density(&self, scene: &Scene, from: &SurfacePoint) -> f64 {
        let by_point = scene.emitter_pmf_for(self.emitter, from);
        let pmf = fault!("next_event_density_by_power", by_point, scene.emitter_pmf(self.emitter));
        let (at, p) = (&self.endpoint.at, from.p);
        match self.endpoint.kind {
            EndpointKind::Point | EndpointKind::Direction => pmf as f64,
            EndpointKind::Infinite => (pmf * scene.pdf_li(self.emitter, p, &self.endpoint, -at.ng)) as f64,
            EndpointKind::Surface => {
                let wi = (at.p - p).normalize_or_zero();
                density_at(at, pmf * scene.pdf_li(self.emitter, p, &self.endpoint, wi), p)
            }
        }
    }

    /// Density of the vertex as the start of a light subpath, and of `to` as its second vertex, if `to` is on the path.
    pub fn emission_densities(&self, scene: &Scene, to: &PathVertex) -> (f64, f64) {
        let at = &self.endpoint.at;
        let infinite = self.endpoint.kind.is_infinite();
        let d = if infinite { at.ng } else { (to.at.p - at.p).normalize_or_zero() };
        let (pdf_p, pdf_d) = scene.pdf_le(self.emitter, &self.endpoint, d);
        let next = if infinite { density_across(&to.at, pdf_d, d) } else { density_at(&to.at, pdf_d, at.p) };
        ((pdf_p * scene.emitter_pmf(self.emitter)) as f64, next)
    }

    /// Whether a walk from the camera can meet it.
    #[inline]
    fn is_hittable(&self) -> bool {
        fault!("emitter_hits_left_out_of_the_sum", !self.endpoint.kind.is_delta(), false)
    }
}

/// The strategies that a method uses, and how they share a path.
#[derive(Clone, Copy, Debug)]
pub struct Strategies {
    /// How they are weighted.
    pub mis: Heuristic,
    /// Whether light vertices are connected to the camera, strategies (s, 1).
    pub camera_connections: bool,
    /// Whether an emitter is connected straight to the camera, strategy (1, 1).
    pub emitter_to_camera: bool,
    /// Samples of every strategy that uses a light subpath, for one of the others.
    pub light_paths: f64,
    /// η \[m²\], by which merging vertices competes with connecting them; 0 where none are merged.
    pub merging: f64,
    /// How light subpaths are traced.
    pub light: WalkRules,
    /// How camera subpaths are traced.
    pub camera: WalkRules,
}

/// A light subpath's last vertex as merges know it; densities are per area \[1/m²\], or as it is at what is infinitely far.
#[derive(Clone, Copy, Debug)]
pub struct LightEnd {
    /// Density with which the subpath generated it.
    pdf: f64,
    /// The strategies that stop before the vertex before it, as rivals of that which stops there.
    fewer: Rivals,
    /// Density with which the subpath generated the vertex before it.
    pdf_before: f64,
    /// What makes of a density per solid angle here \[1/sr\] one of the vertex before.
    back: f64,
    /// Whether the vertex before may be merged too.
    merges_before: bool,
    /// The share of the strategy that stops before this vertex, 0 where there is none.
    share: f64,
}

/// The densities at the two vertices of a connection and the two before them, per area or as it is at what is infinitely far.
#[derive(Clone, Copy, Debug, Default)]
struct Joint {
    /// Of the light subpath's last vertex, and the one before it, from the camera's end.
    to_y: f64,
    back_y: f64,
    /// Of the camera subpath's last vertex, and the one before it, from the light's end.
    to_z: f64,
    back_z: f64,
}

impl Strategies {
    /// Sums up along a light subpath what shorter ones have against each.
    pub fn sum_light(&self, light: &mut [PathVertex], next_event: f64) {
        let mut rivals = Rivals::NONE;
        for j in 0..light.len().saturating_sub(2) {
            rivals = self.fewer_light(light, j, light[j].delta, rivals, (light[j].pdf_rev, next_event));
            light[j].rivals = rivals;
        }
    }

    /// Sums up along a camera subpath what shorter ones have against each.
    pub fn sum_camera(&self, camera: &mut [PathVertex]) {
        let mut rivals = Rivals::NONE;
        for j in 1..camera.len().saturating_sub(2) {
            rivals = self.fewer_camera(camera, j, camera[j].delta, rivals, camera[j].pdf_rev);
            camera[j].rivals = rivals;
        }
    }

    /// The strategies of at most `j` light vertices as rivals of that of `j + 1`: those of at most `j − 1` are `fewer`, and the
    /// densities from the other end are that of vertex `j` and that of vertex 0 by next-event estimation. `delta` is whether
    /// vertex `j` scatters by a delta lobe on this path.
    #[inline]
    fn fewer_light(
        &self,
        light: &[PathVertex],
        j: usize,
        delta: bool,
        fewer: Rivals,
        (pdf_rev, next_event): (f64, f64),
    ) -> Rivals {
        let rivals = self.up_to_light(light, j, delta, fewer, next_event);
        let rivals = self.mis.relative(rivals, ratio(pdf_rev, light[j].pdf_fwd));
        self.join_merge(rivals, j > 0 && !delta, pdf_rev)
    }

    /// The same strategies as rivals of that of `j` light vertices, which is one of them.
    #[inline]
    fn up_to_light(&self, light: &[PathVertex], j: usize, delta: bool, fewer: Rivals, next_event: f64) -> Rivals {
        let (possible, share) = match j {
            0 => (emitter_end(&light[0]).is_some_and(|end| end.is_hittable()), 1.0),
            1 => (!delta, ratio(next_event, light[0].pdf_fwd)),
            _ => (!delta && !light[j - 1].delta, self.light_paths),
        };
        if possible { self.mis.join(fewer, share) } else { fewer }
    }

    /// Rivals and the merge at a vertex, if it is possible, which has this density from the end where they are not.
    #[inline]
    fn join_merge(&self, rivals: Rivals, possible: bool, density: f64) -> Rivals {
        let merges = self.merging > 0.0 && possible;
        if merges {
            self.mis.join(rivals, fault!("merges_left_out_of_the_sum", self.merging, 0.0) * density)
        } else {
            rivals
        }
    }

    /// The strategies of at most `j ≥ 1` camera vertices, of which the path's other vertices are two or more, as rivals of
    /// that of `j + 1`.
    #[inline]
    fn fewer_camera(&self, camera: &[PathVertex], j: usize, delta: bool, fewer: Rivals, pdf_rev: f64) -> Rivals {
        let rivals = self.up_to_camera(camera, j, delta, fewer);
        let rivals = self.mis.relative(rivals, ratio(pdf_rev, camera[j].pdf_fwd));
        self.join_merge(rivals, !delta, pdf_rev)
    }

    /// The same strategies as rivals of that of `j` camera vertices, which is one of them.
    #[inline]
    fn up_to_camera(&self, camera: &[PathVertex], j: usize, delta: bool, fewer: Rivals) -> Rivals {
        let possible = !delta && !camera[j - 1].delta && self.stops_at(j);
        let count = fault!("light_subpaths_counted_once", self.light_paths, 1.0);
        if possible { self.mis.join(fewer, count) } else { fewer }
    }

    /// Whether there are strategies of so many camera vertices.
    #[inline]
    fn stops_at(&self, t: usize) -> bool {
        let connections = fault!("camera_connections_left_out_of_the_sum", self.camera_connections, false);
        t > 1 || fault!("camera_connections_that_are_not_made_counted", connections, true)
    }

    /// What shorter camera subpaths have against one of `t` vertices, whose last two have these densities from the light's end.
    #[inline]
    fn shorter_camera(&self, camera: &[PathVertex], to_z: f64, back_z: f64) -> Rivals {
        let Some(last) = camera.len().checked_sub(1).filter(|&j| j > 0) else { return Rivals::NONE };
        let rivals = self.before_last(camera, back_z);
        self.fewer_camera(camera, last, false, rivals, to_z)
    }

    /// The strategies of at most `t − 2` camera vertices as rivals of that of `t − 1`, for a camera subpath of `t`, of whose vertices
    /// the last but one has this density from the light's end.
    #[inline]
    fn before_last(&self, camera: &[PathVertex], back_z: f64) -> Rivals {
        let Some(j) = camera.len().checked_sub(2).filter(|&j| j > 0) else { return Rivals::NONE };
        let rivals = if j > 1 { camera[j - 1].rivals } else { Rivals::NONE };
        self.fewer_camera(camera, j, camera[j].delta, rivals, back_z)
    }

    /// What a merge must know of the subpath that ends with a light subpath's vertex `j ≥ 1`.
    pub fn light_end(&self, light: &[PathVertex], j: usize, next_event: f64) -> LightEnd {
        let (y, before) = (&light[j], &light[j - 1]);
        let fewer = if j >= 2 { light[j - 2].rivals } else { Rivals::NONE };
        let share = match j {
            1 => ratio(next_event, before.pdf_fwd),
            _ if before.delta => 0.0,
            _ => self.light_paths,
        };
        LightEnd {
            pdf: y.pdf_fwd,
            fewer: self.up_to_light(light, j - 1, before.delta, fewer, next_event),
            pdf_before: before.pdf_fwd,
            back: before.density(1.0, y.at.p),
            merges_before: j >= 2 && !before.delta,
            share,
        }
    }

    /// The weight of the path made by merging a light subpath's last vertex, which light reaches from `wi`, with a camera
    /// subpath's, whose surface stands for both.
    pub fn weight_merged(&self, end: &LightEnd, wi: Vec3, camera: &[PathVertex]) -> f64 {
        let (t, mis) = (camera.len(), self.mis);
        let z = &camera[t - 1];
        let Site::Surface(interaction) = &z.site else { return 1.0 };
        let (forward, back) = interaction.pdfs(z.wo, wi, TransportMode::Radiance);
        let back_y = end.back * f64::from(forward * self.camera.survival(interaction));
        let back_z = match t {
            3.. => camera[t - 2].density(back * self.light.survival(interaction), z.at.p),
            _ => 0.0,
        };
        let from_light =
            self.join_merge(mis.relative(end.fewer, ratio(back_y, end.pdf_before)), end.merges_before, back_y);
        let from_light = if end.share > 0.0 { mis.join(from_light, end.share) } else { from_light };
        let from_camera = self.up_to_camera(camera, t - 1, false, self.before_last(camera, back_z));
        let own = |pdf: f64| 1.0 / (self.merging * pdf);
        mis.weight(mis.merge(mis.relative(from_light, own(end.pdf)), mis.relative(from_camera, own(z.pdf_fwd))))
    }

    /// The weight of the path made by joining the last vertices of two subpaths, the light one not empty.
    ///
    /// `next_event` is the density of the emitter's vertex when it is chosen as seen from vertex 1.
    pub fn weight_connected(&self, scene: &Scene, light: &[PathVertex], camera: &[PathVertex], next_event: f64) -> f64 {
        let (s, mis) = (light.len(), self.mis);
        let joint = self.joint(scene, light, camera);
        let from_camera = self.shorter_camera(camera, joint.to_z, joint.back_z);
        if s == 1 {
            let Some(end) = emitter_end(&light[0]) else { return 1.0 };
            let met =
                if end.is_hittable() { mis.join(Rivals::NONE, ratio(joint.to_y, next_event)) } else { Rivals::NONE };
            // As the camera's rivals know it, this strategy has the density of a light subpath's first vertex.
            let from_camera = mis.relative(from_camera, ratio(joint.back_y, next_event));
            return mis.weight(mis.merge(met, from_camera));
        }
        let fewer = if s >= 3 { light[s - 3].rivals } else { Rivals::NONE };
        let fewer = self.fewer_light(light, s - 2, light[s - 2].delta, fewer, (joint.back_y, next_event));
        let from_light = self.fewer_light(light, s - 1, false, fewer, (joint.to_y, next_event));
        mis.weight(mis.relative(mis.merge(from_light, from_camera), 1.0 / self.light_paths))
    }

    /// The weight of the path that a camera subpath makes alone, its last vertex being on an emitter.
    pub fn weight_emission(&self, scene: &Scene, camera: &[PathVertex], end: &EmitterEnd) -> f64 {
        let (t, mis) = (camera.len(), self.mis);
        let (met, before) = (&camera[t - 1], &camera[t - 2]);
        let (to_z, back_z) = end.emission_densities(scene, before);
        // Strategy 1 has a density of its own for the emitter's vertex; those of two light vertices and more follow.
        let by_next_event = if t == 2 { self.emitter_to_camera } else { !before.delta };
        let mut rivals = Rivals::NONE;
        if by_next_event {
            rivals = mis.join(rivals, ratio(end.next_event_density(scene, &before.at), met.pdf_fwd));
        }
        if t >= 3 {
            let fewer = if t >= 4 { camera[t - 3].rivals } else { Rivals::NONE };
            let fewer = self.fewer_camera(camera, t - 2, before.delta, fewer, back_z);
            rivals = mis.merge(rivals, mis.relative(fewer, ratio(to_z, met.pdf_fwd)));
        }
        mis.weight(rivals)
    }

    /// The densities around a connection. Where the light subpath is one vertex, `back_y` is its density as a light walk's start.
    fn joint(&self, scene: &Scene, light: &[PathVertex], camera: &[PathVertex]) -> Joint {
        let (s, t) = (light.len(), camera.len());
        let (y, z) = (&light[s - 1], &camera[t - 1]);
        let to_y = direction(z, y);
        let mut joint = Joint::default();
        match &y.site {
            Site::Emitter(emitter, endpoint) => {
                let end = EmitterEnd { emitter: *emitter, endpoint: *endpoint };
                (joint.back_y, joint.to_z) = end.emission_densities(scene, z);
            }
            Site::Surface(interaction) => {
                let survival = self.light.survival(interaction);
                let (forward, back) = interaction.pdfs(y.wo, -to_y, TransportMode::Importance);
                joint.to_z = z.density(forward * survival, y.at.p);
                joint.back_y = light[s - 2].density(back * survival, y.at.p);
            }
            Site::Camera(_) => {}
        }
        match &z.site {
            Site::Camera(rays) => joint.to_y = camera_density(scene, *rays, z, y, to_y),
            Site::Surface(interaction) => {
                let survival = self.camera.survival(interaction);
                let (forward, back) = interaction.pdfs(z.wo, to_y, TransportMode::Radiance);
                joint.to_y = y.density(forward * survival, z.at.p);
                if t >= 3 {
                    joint.back_z = camera[t - 2].density(back * survival, z.at.p);
                }
            }
            Site::Emitter(..) => {}
        }
        joint
    }
}

/// A density over another. Both are 0 where a surface is seen exactly edge-on, by rounding: what has no density is no rival.
#[inline]
fn ratio(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b }
}

/// The unit direction from a camera subpath's last vertex to a light subpath's.
#[inline]
pub fn direction(z: &PathVertex, y: &PathVertex) -> Vec3 {
    match (y.is_infinite(), z.is_infinite()) {
        (true, _) => -y.at.ng,
        (false, true) => z.at.ng,
        (false, false) => (y.at.p - z.at.p).normalize_or_zero(),
    }
}

/// Density of a vertex that the camera sees in direction `to_y`.
fn camera_density(scene: &Scene, rays: Rays, camera: &PathVertex, y: &PathVertex, to_y: Vec3) -> f64 {
    let (_, pdf) = scene.camera.pdf_we(&camera.at, to_y);
    match rays {
        Rays::FromPoint | Rays::FromLens => y.density(pdf, camera.at.p),
        Rays::Parallel => {
            fault!("parallel_rays_taken_for_diverging", density_across(&y.at, pdf, to_y), y.density(pdf, camera.at.p))
        }
    }
}

/// The emitter that a subpath starts from.
#[inline]
fn emitter_end(vertex: &PathVertex) -> Option<EmitterEnd> {
    match &vertex.site {
        Site::Emitter(emitter, endpoint) => Some(EmitterEnd { emitter: *emitter, endpoint: *endpoint }),
        _ => None,
    }
}
