//! The vertices that bidirectional methods store.

use sampling::Vec3;
use sampling::math::Spectrum;
use sampling::mis::Rivals;
use scenes::{EmitterId, Endpoint, Interaction, Rays, Scene, SurfacePoint};

/// What stands at a vertex.
#[derive(Clone, Copy, Debug)]
pub enum Site {
    /// The camera.
    Camera(Rays),
    /// An emitter's point where a light subpath starts, or the environment where a camera subpath escapes to.
    Emitter(EmitterId, Endpoint),
    /// A surface (which may emit).
    Surface(Interaction),
}

/// A vertex of a subpath.
///
/// Densities are per area [1/m²], or per solid angle [1/sr] at an environment, of generating *this* vertex.
#[derive(Clone, Copy, Debug)]
pub struct PathVertex {
    /// What stands here.
    pub site: Site,
    /// Where.
    pub at: SurfacePoint,
    /// Towards the vertex before this one in its subpath; zero at the first.
    pub wo: Vec3,
    /// Product of f·cos/pdf (and of what was emitted) up to here.
    pub beta: Spectrum,
    /// Density with which its own subpath generated it.
    pub pdf_fwd: f64,
    /// Density with which a subpath from the other end would generate it, coming over the next vertex; set by the walk
    /// once it has scattered at the next vertex.
    pub pdf_rev: f64,
    /// Whether the walk left by a delta lobe, so that no connection to this vertex could have made the path.
    pub delta: bool,
    /// What the strategies whose subpath from this end stops before this vertex have against that which stops with it; summed
    /// up once the subpath is whole, see [`Strategies`](crate::connect::Strategies).
    pub rivals: Rivals,
}

impl PathVertex {
    /// A subpath's first vertex, whose densities are still to be set.
    #[inline]
    pub fn first(site: Site, at: SurfacePoint, beta: Spectrum) -> Self {
        Self { site, at, wo: Vec3::ZERO, beta, pdf_fwd: 0.0, pdf_rev: 0.0, delta: false, rivals: Rivals::NONE }
    }

    /// The camera's point, where importance starts.
    #[inline]
    pub fn of_camera(scene: &Scene, at: SurfacePoint, beta: f32) -> Self {
        Self { pdf_fwd: 1.0, ..Self::first(Site::Camera(scene.camera.rays()), at, Spectrum::splat(beta)) }
    }

    /// An emitter's point, sampled as seen from another vertex.
    #[inline]
    pub fn of_emitter(emitter: EmitterId, endpoint: Endpoint) -> Self {
        Self::first(Site::Emitter(emitter, endpoint), endpoint.at, Spectrum::ONE)
    }

    /// A surface that a walk of weight `beta` met coming along `d`, by a density of that direction at the vertex before it.
    #[inline]
    pub fn of_surface(hit: &Interaction, d: Vec3, beta: Spectrum, pdf: f32, before: &PathVertex) -> Self {
        let pdf_fwd = match before.is_infinite() {
            true => density_across(&hit.point, pdf, d),
            false => density_at(&hit.point, pdf, before.at.p),
        };
        Self { wo: -d, pdf_fwd, ..Self::first(Site::Surface(*hit), hit.point, beta) }
    }

    /// The environment, where a walk from the camera escaped along `d`.
    #[inline]
    pub fn of_environment(scene: &Scene, d: Vec3, beta: Spectrum, pdf: f32) -> Option<Self> {
        let (emitter, endpoint) = (scene.environment?, scene.environment_endpoint(d));
        Some(Self { wo: -d, pdf_fwd: pdf as f64, beta, ..Self::of_emitter(emitter, endpoint) })
    }

    /// Whether it is an emitter or a camera at no place; `at.ng` is the direction of flight from it then.
    #[inline]
    pub fn is_infinite(&self) -> bool {
        match &self.site {
            Site::Emitter(_, endpoint) => endpoint.kind.is_infinite(),
            Site::Camera(rays) => *rays == Rays::Parallel,
            Site::Surface(_) => false,
        }
    }

    /// Whether a connection may end here: it scatters, emits or measures into more than single directions.
    #[inline]
    pub fn is_connectable(&self) -> bool {
        match &self.site {
            Site::Camera(_) | Site::Emitter(..) => true,
            Site::Surface(interaction) => interaction.is_connectable(),
        }
    }

    /// A density per solid angle at `from` as one of generating this vertex: per area, or as it is at an environment.
    #[inline]
    pub fn density(&self, pdf: f32, from: Vec3) -> f64 {
        if self.is_infinite() { pdf as f64 } else { density_at(&self.at, pdf, from) }
    }
}

/// A density per area across the unit direction `d` as one per area at `at` [1/m²].
#[inline]
pub fn density_across(at: &SurfacePoint, pdf: f32, d: Vec3) -> f64 {
    pdf as f64 * at.ng.dot(d).abs() as f64
}

/// A density per solid angle at `from` [1/sr] as one per area at `at` [1/m²]. Off surfaces the density per area facing `from`.
#[inline]
pub fn density_at(at: &SurfacePoint, pdf: f32, from: Vec3) -> f64 {
    let d = at.p - from;
    let distance_squared = d.length_squared();
    let cos = if at.ng == Vec3::ZERO { 1.0 } else { at.ng.dot(d).abs() / distance_squared.sqrt() };
    pdf as f64 * cos as f64 / distance_squared as f64
}
