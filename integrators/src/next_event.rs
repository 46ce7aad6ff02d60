//! Next-event estimation: a point on an emitter, chosen as seen from a point of the scene.

use crate::reservoir::Reservoir;
use sampling::fault;
use sampling::math::Spectrum;
use sampling::mis::Heuristic;
use sampling::sampler::{Purpose, Sampler, Subpath};
use sampling::{Vec2, Vec3};
use scenes::{EmitterId, EmitterOdds, Endpoint, Interaction, Ray, Scene, SurfacePoint};
use serde::{Deserialize, Serialize};
use std::num::NonZeroU16;

/// Which techniques find the emitters that light a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Strategy {
    /// A point on an emitter.
    Emitter,
    /// A direction from the BSDF.
    Bsdf,
    /// Both, weighted by MIS.
    Mis,
}

/// A sampled emitter point.
#[derive(Clone, Copy, Debug)]
pub struct NextEvent {
    /// Whose point it is.
    pub emitter: EmitterId,
    /// The point.
    pub endpoint: Endpoint,
    /// Unit direction from the reference point to it.
    pub wi: Vec3,
    /// Incident radiance over its density, the choice among emitters included.
    pub radiance: Spectrum,
    /// Its density [1/sr] at the reference point, the choice among emitters included; of what is certain the choice alone.
    pub pdf: f32,
    /// Whether no other technique can meet it.
    pub delta: bool,
}

impl NextEvent {
    /// The ray whose being blocked makes the contribution zero.
    #[inline]
    pub fn shadow_ray(&self, from: &SurfacePoint) -> Ray {
        shadow_ray(from, &self.endpoint, self.wi)
    }
}

/// What a point makes of light that arrives from a direction.
#[derive(Clone, Copy, Debug)]
pub struct Scattered {
    /// What is scattered towards the camera [1/sr], without the cosine.
    pub f: Spectrum,
    /// The cosine.
    pub cos: f32,
    /// The density [1/sr] with which the walk itself goes on in that direction.
    pub pdf: f32,
}

/// The segment from a point to an emitter's point, in direction `wi` where that lies infinitely far.
#[inline]
pub fn shadow_ray(from: &SurfacePoint, endpoint: &Endpoint, wi: Vec3) -> Ray {
    if endpoint.kind.is_infinite() { from.spawn(wi) } else { from.segment_to(&endpoint.at) }
}

/// Chooses an emitter, by these odds or for the point, and a point on it, as seen from a point. The sampler stands at the vertex. `None` where nothing can
/// arrive.
#[inline(always)]
pub fn sample_next_event(
    scene: &Scene,
    from: &SurfacePoint,
    odds: Option<&EmitterOdds>,
    sampler: &mut Sampler,
) -> Option<NextEvent> {
    let uc = if scene.needs.emitter_choice { sampler.get_1d(Purpose::NextEmitter) } else { 0.0 };
    let (emitter, pmf) = match odds {
        Some(odds) => odds.choose(uc),
        None => scene.choose_emitter_for(from, uc)?,
    };
    let u = sampler.get_2d(Purpose::NextPosition);
    let li = scene.sample_li(emitter, from.p, u)?;
    let pdf = li.pdf * pmf;
    Some(NextEvent { emitter, endpoint: li.endpoint, wi: li.wi, radiance: li.li / pdf, pdf, delta: li.delta })
}

/// Numbers of vertices from here on are those of a sample's further light subpaths, and of further candidates, to the sampler.
pub(crate) const FURTHER: u32 = 1 << 16;

/// Emitter points of which one is connected to a camera subpath's vertex: importance resampling `[Talbot05]`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidates {
    /// The vertex's number.
    pub vertex: u32,
    /// How many there are.
    pub count: NonZeroU16,
}

impl Candidates {
    /// The one that was sampled, or one of several, chosen in proportion to what they would contribute unshadowed, and its contribution
    /// over the number of times that it is expected among as many points of its density: whatever weight depends on the path
    /// alone leaves the mean right. `contribution` may say more of a point. The sampler stands at the vertex again.
    #[inline(always)]
    pub fn choose<T>(
        self,
        scene: &Scene,
        (from, odds): (&SurfacePoint, Option<&EmitterOdds>),
        sampler: &mut Sampler,
        mut contribution: impl FnMut(&NextEvent) -> (Spectrum, T),
    ) -> Option<(NextEvent, Spectrum, T)> {
        if self.count == NonZeroU16::MIN {
            let event = sample_next_event(scene, from, odds, sampler)?;
            let (value, more) = contribution(&event);
            return Some((event, value, more));
        }
        let mut reservoir = Reservoir::new(sampler.get_1d(Purpose::NextEventChoice));
        for number in 0..self.count.get() {
            sampler.start_vertex(Subpath::Camera, self.vertex + u32::from(number) * FURTHER);
            if let Some(event) = sample_next_event(scene, from, odds, sampler) {
                let (value, more) = contribution(&event);
                reservoir.offer((event, value, more), value.luminance());
            }
        }
        sampler.start_vertex(Subpath::Camera, self.vertex);
        let ((event, value, more), inverse) = reservoir.take()?;
        Some((event, value * (inverse / f32::from(self.count.get())), more))
    }
}

/// Density [1/sr] with which [`sample_next_event`] from a point, by these odds, gives the emitting surface point that a ray along `wi` hit.
#[inline]
pub fn pdf_next_event(
    scene: &Scene,
    (from, odds): (&SurfacePoint, Option<&EmitterOdds>),
    emitter: EmitterId,
    hit: &Interaction,
    wi: Vec3,
) -> f32 {
    pmf(scene, from, odds, emitter) * scene.pdf_li(emitter, from.p, &scene.endpoint_of(hit), wi)
}

/// Density [1/sr] with which [`sample_next_event`] from a point, by these odds, gives the environment in direction `wi`.
#[inline]
pub fn pdf_next_event_environment(
    scene: &Scene,
    (from, odds): (&SurfacePoint, Option<&EmitterOdds>),
    emitter: EmitterId,
    wi: Vec3,
) -> f32 {
    pmf(scene, from, odds, emitter) * scene.pdf_li(emitter, from.p, &scene.environment_endpoint(wi), wi)
}

/// The probability that [`sample_next_event`] by these odds chooses an emitter.
#[inline]
fn pmf(scene: &Scene, from: &SurfacePoint, odds: Option<&EmitterOdds>, emitter: EmitterId) -> f32 {
    match fault!("odds_unknown_to_what_is_met", odds, None) {
        Some(odds) => odds.pmf(emitter),
        None => scene.emitter_pmf_for(emitter, from),
    }
}

/// MIS weight of a sample of the first of two techniques, by their densities [1/sr] at the same vertex.
#[inline]
pub fn weight2(heuristic: Heuristic, pdf: f32, other: f32) -> f64 {
    heuristic.weight2(pdf as f64, other as f64)
}

/// What the camera makes of radiance that arrives at its point `at` from direction `d`: importance times cosine [1/sr], and
/// where it meets the film; `None` off the film. Directions are not taken through points far off, which would round them.
#[inline]
pub fn camera_response(scene: &Scene, at: &SurfacePoint, d: Vec3) -> Option<(f32, Vec2)> {
    let (_, raster) = scene.camera.we(at, d)?;
    // All samples of a camera weigh the same: We·cos is the density of their directions, times that.
    let (_, pdf_d) = scene.camera.pdf_we(at, d);
    Some((scene.camera.weight() * pdf_d, raster))
}
