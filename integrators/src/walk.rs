//! Random walks that store their vertices: the subpaths of bidirectional methods.

use crate::measurement::Counters;
use crate::roulette::SubpathRoulette;
use crate::vertex::PathVertex;
use sampling::Vec3;
use sampling::bsdf::{Lobes, TransportMode};
use sampling::fault;
use sampling::math::Spectrum;
use sampling::sampler::{Purpose, Sampler, Subpath};
use scenes::{Interaction, Ray, Scene};

/// How a subpath is traced.
#[derive(Clone, Copy, Debug)]
pub struct WalkRules {
    /// From which end, and so what it carries.
    pub subpath: Subpath,
    /// How it ends.
    pub roulette: SubpathRoulette,
    /// The number of scatterings from which roulette by throughput is played.
    pub roulette_start: usize,
    /// Highest survival probability of roulette; 1 where walks have a last vertex anyway.
    pub cap: f32,
    /// The number of vertices at which it stops; `None` for no such number.
    pub max_vertices: Option<usize>,
    /// The sampler's number of its first vertex.
    pub first_number: u32,
    /// Where it stops besides.
    pub stop: Stop,
}

/// Where a walk stops that could go on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stop {
    /// Nowhere.
    #[default]
    Nowhere,
    /// At surfaces with diffuse lobes, which it leaves by delta lobes alone.
    Diffuse,
}

impl WalkRules {
    /// What the walk carries.
    #[inline]
    pub fn mode(&self) -> TransportMode {
        match self.subpath {
            Subpath::Camera => TransportMode::Radiance,
            Subpath::Light => TransportMode::Importance,
        }
    }

    /// Whether one more vertex may follow so many.
    #[inline]
    pub fn has_room(&self, vertices: usize) -> bool {
        self.max_vertices.is_none_or(|max| vertices < fault!("walks_end_in_silence", max, max.min(5)))
    }

    /// Survival probability, as part of the densities, of roulette at a surface.
    #[inline]
    pub fn survival(&self, interaction: &Interaction) -> f32 {
        match self.roulette {
            SubpathRoulette::None | SubpathRoulette::Throughput => 1.0,
            SubpathRoulette::Local => self.roulette.survival(interaction.bsdf.survival(), self.cap),
        }
    }
}

/// Where a walk leaves its first vertex.
#[derive(Clone, Copy, Debug)]
pub struct Departure {
    /// The ray.
    pub ray: Ray,
    /// Weight of the walk on it.
    pub beta: Spectrum,
    /// Density of its direction [1/sr]; where the first vertex is infinitely far, of its position across it [1/m²].
    pub pdf: f32,
}

/// Extends a subpath, whose first vertex is there already, until it escapes, is absorbed or has no room.
///
/// The subpath begins at vertex `first` of the list. One from the camera that escapes to an environment ends with a vertex for it.
pub fn walk(
    scene: &Scene,
    rules: &WalkRules,
    start: Departure,
    sampler: &mut Sampler,
    counters: &mut Counters,
    vertices: &mut Vec<PathVertex>,
    first: usize,
) {
    let Departure { mut ray, mut beta, mut pdf } = start;
    // What has become of what the walk started with: the part of its weight that roulette looks at.
    let mut throughput = Spectrum::ONE;
    while rules.has_room(vertices.len() - first) {
        counters.closest += 1;
        let before = vertices.len() - 1;
        let met = scene.intersect(&ray);
        let Some(hit) = &met else {
            if fault!("sky_left_out_of_subpaths", rules.subpath == Subpath::Camera, false) {
                vertices.extend(PathVertex::of_environment(scene, ray.d, beta, pdf));
            }
            return;
        };
        push_surface(vertices, hit, ray.d, beta, pdf);
        let index = vertices.len() - 1 - first;
        if !rules.has_room(index + 1) {
            return;
        }
        let Some(next) = scatter(scene, rules, hit, -ray.d, index, sampler, counters) else { return };
        vertices[before].pdf_rev = vertices[before].density(next.pdf_rev, hit.point.p);
        vertices[before + 1].delta = next.delta;
        (ray, pdf) = (hit.point.spawn(next.wi), next.pdf_fwd);
        beta *= next.weight;
        if rules.roulette == SubpathRoulette::Throughput {
            throughput *= next.weight;
            let roulette = rules.roulette.by_throughput();
            let survived =
                roulette.survive(throughput, index, rules.roulette_start, || sampler.get_1d(Purpose::Roulette));
            let Some(factor) = survived else { return };
            throughput *= factor;
            beta *= factor;
        }
    }
}

/// Adds the surface that a walk has met. A function of its own, since only so is the surface copied but once.
#[inline(never)]
fn push_surface(vertices: &mut Vec<PathVertex>, hit: &Interaction, d: Vec3, beta: Spectrum, pdf: f32) {
    let vertex = PathVertex::of_surface(hit, d, beta, pdf, &vertices[vertices.len() - 1]);
    vertices.push(vertex);
}

/// One scattering of a walk.
struct Scattered {
    wi: Vec3,
    weight: Spectrum,
    delta: bool,
    /// Density of `wi` [1/sr].
    pdf_fwd: f32,
    /// Density of `wo` [1/sr] for a walk that comes from `wi`.
    pdf_rev: f32,
}

/// Samples the next direction, or ends the walk. Roulette is in the densities of both directions.
#[inline]
fn scatter(
    scene: &Scene,
    rules: &WalkRules,
    hit: &Interaction,
    wo: Vec3,
    index: usize,
    sampler: &mut Sampler,
    counters: &mut Counters,
) -> Option<Scattered> {
    sampler.start_vertex(rules.subpath, rules.first_number + index as u32);
    let survival = rules.survival(hit);
    if survival < 1.0 && sampler.get_1d(Purpose::Roulette) >= survival {
        return None;
    }
    let uc = if !scene.needs.only_lambertian { sampler.get_1d(Purpose::Lobe) } else { 0.0 };
    let u = sampler.get_2d(Purpose::Direction);
    counters.bsdf_samples += 1;
    let sample = hit.sample(wo, uc, u, rules.mode())?;
    let stops = rules.stop == Stop::Diffuse && hit.bsdf.lobes().intersects(Lobes::DIFFUSE) && !sample.lobe.is_delta();
    if sample.weight.is_zero() || stops {
        return None;
    }
    let delta = fault!("delta_taken_for_connectable", sample.lobe.is_delta(), false);
    let (pdf_fwd, pdf_rev) = if delta {
        hit.delta_densities(wo, &sample, rules.mode())
    } else {
        (sample.pdf, hit.pdf(sample.wi, wo, rules.mode().reversed()))
    };
    Some(Scattered {
        wi: sample.wi,
        weight: sample.weight / survival,
        delta,
        pdf_fwd: pdf_fwd * survival,
        pdf_rev: pdf_rev * fault!("roulette_in_one_density_only", survival, 1.0),
    })
}
