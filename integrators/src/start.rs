//! Where walks start: at the camera, and at an emitter.

use crate::integrator::Pixel;
use crate::measurement::Counters;
use sampling::Vec2;
use sampling::math::Spectrum;
use sampling::sampler::{Purpose, Sampler, Subpath};
use scenes::{EmitterId, LeSample, Scene, WeSample};

/// The start of a camera walk.
#[derive(Clone, Copy, Debug)]
pub struct CameraStart {
    /// Where on the film \[pixels\].
    pub raster: Vec2,
    /// The ray, its weight and densities.
    pub sample: WeSample,
}

/// Starts a camera walk in a pixel.
#[inline]
pub fn start_camera(scene: &Scene, pixel: Pixel, sampler: &mut Sampler, counters: &mut Counters) -> CameraStart {
    sampler.start_vertex(Subpath::Camera, 0);
    let lens = if scene.needs.pinhole { Vec2::ZERO } else { sampler.get_2d(Purpose::Lens) };
    counters.camera_paths += 1;
    CameraStart { raster: pixel.raster, sample: scene.camera.sample_we(pixel.raster, lens) }
}

/// The start of a light walk.
#[derive(Clone, Copy, Debug)]
pub struct LightStart {
    /// The emitter.
    pub emitter: EmitterId,
    /// Probability with which it was chosen.
    pub pmf: f32,
    /// Its point and the ray.
    pub sample: LeSample,
}

impl LightStart {
    /// Weight of the walk on its first ray.
    #[inline]
    pub fn beta(&self) -> Spectrum {
        let LeSample { le, cos, pdf_p, pdf_d, .. } = self.sample;
        le * (cos / (self.pmf * pdf_p * pdf_d))
    }
}

/// Starts a light walk; `None` where nothing is emitted. The sampler stands at the walk's first vertex.
#[inline]
pub fn start_light(scene: &Scene, sampler: &mut Sampler, counters: &mut Counters) -> Option<LightStart> {
    let uc = if scene.needs.emitter_choice { sampler.get_1d(Purpose::EmitterChoice) } else { 0.0 };
    let (emitter, pmf) = scene.choose_emitter(uc)?;
    let u_p = sampler.get_2d(Purpose::EmitterPosition);
    let u_d = sampler.get_2d(Purpose::EmitterDirection);
    let sample = scene.sample_le(emitter, u_p, u_d)?;
    counters.light_paths += 1;
    Some(LightStart { emitter, pmf, sample })
}
