//! Radiosity: the transport operator of a diffuse scene as a matrix \[Goral84; Cohen93\].
//!
//! Irradiance is sought among the functions that are constant, or linear, on each [element](mesh) of the scene's surfaces, by Galerkin's
//! method: what an element receives from a function on another is projected onto its own functions \[Heckbert91; Zatz93\]. So the
//! operator becomes the matrix of the [couplings](form_factor) of all pairs of elements, less what is [hidden](visibility), and order
//! k is what it makes of the emission in k applications: no system is solved, and no order is a truncation of another.
//! All pairs are kept. Links between groups of elements, as in hierarchical radiosity, would be fewer, but their errors have one sign
//! in many of them at once, which orders that are measured one by one do not forgive.
//!
//! The [solution] does not depend on the view; it is made once, before the first replicate's first sample, whose time and rays
//! contain it. Camera rays look up the irradiance where they hit; what a surface emits and reflects is read exactly there.
//! The mesh is refined where an estimate of the error says so: solved on, divided at the worst elements and solved on again, until
//! there are as many elements as are asked for. Its error does not fall with the samples, but with the elements.
//!
//! Light is followed along `LD*E`. The surfaces must be flat triangles that obey Lambert's law; their two sides are elements of their own.
//! Albedo that varies is a constant on each element for the light that goes on, the mean over it.

pub mod balance;
pub mod basis;
pub mod form_factor;
pub mod mesh;
pub mod operator;
pub mod polygon;
pub mod solution;
#[cfg(test)]
mod tests;
pub mod visibility;

use crate::bias::Bias;
use crate::contribution::{Contribution, Sink, Technique};
use crate::integrator::{Estimator, Pixel, Replicate};
use crate::measurement::Counters;
use crate::request::Request;
use crate::scratch::Scratch;
use crate::start::{CameraStart, start_camera};
pub use basis::Basis;
use sampling::math::Spectrum;
use sampling::sampler::Sampler;
use scenes::{FacetHit, Needs, Scene};
use serde::{Deserialize, Serialize};
use solution::Solution;
use std::f32::consts::FRAC_1_PI;
use std::sync::{Arc, Mutex, PoisonError};

/// Elements at the most: their matrix takes 6.4 GB, or 32 of linear elements.
const MOST_ELEMENTS: u32 = 40_000;
/// Rays for a pair at the most, before those that matter get more.
const MOST_RAYS: u32 = 1024;
/// Solutions that are kept for further replicates, requests and scenes.
const KEPT: usize = 8;

/// How many elements the mesh may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u32", into = "u32")]
pub struct Elements(u32);

/// Rays between two elements that little couples; up to 128 times as many where more does, and 512 times as many from an element of mean
/// size that tell what escapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u32", into = "u32")]
pub struct Rays(u32);

/// How a mesh comes to its elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Refinement {
    /// The elements with the largest estimated errors are divided, on a solution each time.
    #[default]
    Error,
    /// The largest elements are divided.
    Even,
}

impl Elements {
    /// The number.
    pub fn number(self) -> usize {
        self.0 as usize
    }
}

impl Rays {
    /// The number.
    pub fn number(self) -> u32 {
        self.0
    }
}

impl Default for Elements {
    fn default() -> Self {
        Self(1000)
    }
}

impl Default for Rays {
    fn default() -> Self {
        Self(4)
    }
}

impl TryFrom<u32> for Elements {
    type Error = String;
    fn try_from(number: u32) -> Result<Self, String> {
        if (1..=MOST_ELEMENTS).contains(&number) {
            return Ok(Self(number));
        }
        Err(format!("{number} elements; give 1 to {MOST_ELEMENTS}, whose pairs still fit into memory"))
    }
}

impl TryFrom<u32> for Rays {
    type Error = String;
    fn try_from(number: u32) -> Result<Self, String> {
        if (1..=MOST_RAYS).contains(&number) {
            return Ok(Self(number));
        }
        Err(format!(
            "{number} rays say nothing of what stands between elements, or take too long; give 1 to {MOST_RAYS}"
        ))
    }
}

impl From<Elements> for u32 {
    fn from(elements: Elements) -> Self {
        elements.0
    }
}

impl From<Rays> for u32 {
    fn from(rays: Rays) -> Self {
        rays.0
    }
}

/// The settings of radiosity.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Radiosity {
    /// Elements, at the most.
    pub elements: Elements,
    /// The functions on each.
    pub basis: Basis,
    /// How the mesh is refined.
    pub refinement: Refinement,
    /// Rays between elements.
    pub rays: Rays,
    /// What is known of the scene at work; no setting.
    #[serde(skip)]
    solution: Option<Arc<Solution>>,
    /// Solutions that were made; no setting.
    #[serde(skip)]
    kept: Arc<Mutex<Kept>>,
}

/// Solutions, the latest first.
type Kept = Vec<(Key, Arc<Solution>)>;

/// What a solution depends on besides the settings.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Key {
    scene: String,
    max_order: usize,
    tail: bool,
}

impl Radiosity {
    /// The solution, made now unless it was before; `None` where the scene has none.
    pub fn solve(&self, scene: &Scene, request: &Request) -> Option<Arc<Solution>> {
        let key = Key { scene: scene.hash.clone(), max_order: request.orders().max_order(), tail: request.tail() };
        // Not held during the work: a thread that waits for its parts may be given another's.
        let found = {
            let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
            kept.iter().find(|(of, _)| *of == key).map(|(_, solution)| solution.clone())
        };
        if found.is_some() {
            return found;
        }
        let solution = Arc::new(Solution::new(scene, scene.facets()?, request, self));
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.truncate(KEPT - 1);
        kept.insert(0, (key, solution.clone()));
        Some(solution)
    }
}

impl Estimator for Radiosity {
    const ITERATES: bool = true;

    fn expression(&self) -> &'static str {
        "LD*E"
    }

    fn bias(&self) -> Bias {
        Bias::Mesh
    }

    fn makes(&self, technique: Technique) -> bool {
        matches!(technique, Technique::Whole { .. })
    }

    fn unsupported(&self, scene: &Scene) -> Option<String> {
        let facts = &scene.facts;
        if !facts.only_lambertian {
            let other = scene.material_where(|material| !material.is_lambertian()).unwrap_or_default();
            return Some(format!(
                "the material `{other}` does more than scatter by Lambert's law, and a radiosity knows no directions; use path or bdpt, or \
                 make the material lambert"
            ));
        }
        if facts.masks {
            let other = scene.material_where(|material| material.is_masked()).unwrap_or_default();
            return Some(format!(
                "the material `{other}` has an opacity, and its elements are met everywhere; use path or bdpt"
            ));
        }
        if facts.environment || facts.delta_emitters {
            return Some(
                "it is lit by a point, a spot, a direction or the sky, and only surfaces are elements; use path or bdpt, or let a \
                 surface shine"
                    .to_owned(),
            );
        }
        let Some(facets) = scene.facets() else {
            return Some(
                "it has surfaces that are no flat triangles (spheres, disks, cylinders, instances, or meshes with vertex normals); use path \
                 or bdpt, or give them as meshes without normals"
                    .to_owned(),
            );
        };
        let (most, given) = (2 * facets.len(), self.elements.number());
        (most > given).then(|| {
            let mend = if most <= MOST_ELEMENTS as usize {
                format!("set elements to {most} or more, or use path")
            } else {
                "use path or bdpt".to_owned()
            };
            format!(
                "its {} triangles have {most} sides, more than the {given} elements that the mesh may have; {mend}",
                facets.len()
            )
        })
    }

    fn unsupported_request(&self, _: &Request) -> Option<String> {
        None
    }

    fn missing_light(&self, _: &Needs) -> Vec<String> {
        Vec::new()
    }

    fn splats(&self) -> bool {
        false
    }

    fn bytes(&self, _: u64, _: &Request) -> u64 {
        let (elements, functions) = (u64::from(self.elements.0), self.basis.size() as u64);
        elements * elements / 2 * 4 * (functions * functions + 1)
    }

    fn prepare(&self, _: &Scene, _: &Request, _: &Replicate) -> Option<Self> {
        Some(self.clone())
    }

    fn iterate(&mut self, scene: &Scene, request: &Request, replicate: &Replicate, number: u32) -> Counters {
        if self.solution.is_none() {
            self.solution = self.solve(scene, request);
        }
        // Once a render, whoever made the solution: another render, or this one before it was interrupted.
        let counted = self.solution.as_ref().filter(|_| replicate.number == 0 && number == 0);
        Counters { shadow: counted.map_or(0, |solution| solution.report.rays), ..Counters::default() }
    }

    fn estimate<S: Sink>(
        &self,
        scene: &Scene,
        request: &Request,
        pixel: Pixel,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        out: &mut S,
    ) {
        let Some(solution) = &self.solution else { return };
        let CameraStart { raster, sample } = start_camera(scene, pixel, sampler, &mut scratch.counters);
        scratch.counters.closest += 1;
        let Some(FacetHit { facet, b, interaction: it }) = scene.intersect_facet(&sample.ray) else { return };
        let mut add = |order: usize, radiance: Spectrum| {
            let technique = Technique::Whole { order: u16::try_from(order).unwrap_or(u16::MAX) };
            out.add(Contribution::new(raster, technique, radiance * sample.weight, 1.0));
        };
        if request.wants(0) {
            add(0, scene.le(&it, -sample.ray.d));
        }
        let back = sample.ray.d.dot(it.point.ng) > 0.0;
        let Some(place) = solution.mesh().find(facet, back, b.as_dvec2()) else { return };
        let reflected = mesh::albedo(&it) * FRAC_1_PI;
        let beyond = request.tail().then(|| request.orders().max_order() + 1);
        for order in request.orders().iter().filter(|&order| order > 0).chain(beyond) {
            let [red, green, blue] = solution.at(order, place).map(|channel| channel as f32);
            add(order, reflected * Spectrum::new(red, green, blue));
        }
    }
}
