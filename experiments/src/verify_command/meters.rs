//! What methods measure of a scene with a closed form by a meter: one number for each order, rather than an image.
//!
//! The meter is a single pixel that receives light at a point, an `irradiance` camera, a little ahead of what the image shows in its
//! middle: E \[W/m²\]. Emitters and walks meet it in other ways than a pinhole, and all directions of a hemisphere count, those that no
//! pixel shows too. The closed form gives its irradiance by the same meter, with no more variance than what is seen has.

use crate::error::Error;
use crate::path_class;
use crate::statistics::multiple::sidak_level;
use crate::statistics::welch::{Sample, welch};
use crate::stop::Stop;
use crate::subject::render_settings;
use integrators::exact::NAME;
use integrators::{Bias, Integrator, Measurement, Orders, Render, RenderSettings};
use sampling::moments::Moments;
use sampling::sampler::SamplerKind;
use sampling::vec2;
use scenes::camera::Receiver;
use scenes::{CameraSettings, Projection, Scene, Skip};
use serde::Serialize;
use std::fmt::Write;

/// Samples in a replicate.
const SAMPLES: u32 = 4096;
/// The probability that any comparison of a scene raises a false alarm.
const RATE: f64 = 1e-3;
/// A relative difference that transport in `f32` may make.
const ROUNDING: f64 = 1e-5;
/// How far the meter is ahead of the surface, in radii of the scene.
const AHEAD: f64 = 1e-3;

/// An order of a method's irradiance beside the true one \[W/m²\].
#[derive(Clone, Debug, Serialize)]
pub(super) struct Metered {
    method: String,
    order: usize,
    /// Means over the channels.
    irradiance: f64,
    standard_error: f64,
    exact: f64,
    p: f64,
    pub(super) holds: bool,
}

/// Measures a scene by all these methods, if one of them is its closed form.
///
/// # Errors
/// If it cannot be loaded or rendered, or the user asks for an end.
pub(super) fn meters(
    name: &str,
    methods: &[&dyn Integrator],
    (max_order, replicates, seed): (usize, u32, u64),
    stop: &Stop,
) -> Result<Vec<Metered>, Error> {
    let Some(exact) = methods.iter().find(|method| method.name() == NAME) else { return Ok(Vec::new()) };
    let Some(scene) = scene_of_meter(name)? else { return Ok(Vec::new()) };
    let able = |method: &&&dyn Integrator| {
        let all = method.bias() == Bias::None && path_class::missing(**method, &scene).is_empty();
        all && method.name() != NAME && method.unsupported(&scene).is_none()
    };
    let measure = |method: &dyn Integrator| -> Result<Measurement, Error> {
        let orders = Orders::up_to(*method.orders(max_order).end());
        let settings = render_settings(method, orders, false, seed, SamplerKind::default());
        let mut render = Render::new(&scene, method, RenderSettings { samples_per_replicate: SAMPLES, ..settings })?;
        for _ in 0..replicates {
            render.run_replicate(&|_| {});
            stop.check()?;
        }
        Ok(render.finish())
    };
    let truth = measure(*exact)?;
    let mut found = Vec::new();
    for method in methods.iter().filter(able) {
        let measured = measure(*method)?;
        for order in 0..measured.layers.len().min(truth.layers.len()) {
            let [own, exact] = [&measured, &truth].map(|of| Sample::from(&grey(of, order)));
            let standard_error = (own.variance / f64::from(own.n)).sqrt();
            let p = welch(exact, own, ROUNDING).p;
            let (irradiance, exact) = (own.mean, exact.mean);
            let method = method.name().to_owned();
            found.push(Metered { method, order, irradiance, standard_error, exact, p, holds: true });
        }
    }
    let level = sidak_level(RATE, found.len());
    found.iter_mut().for_each(|metered| metered.holds = metered.p >= level);
    Ok(found)
}

/// The scene with a meter for a camera; `None` where the middle of its image is empty.
fn scene_of_meter(name: &str) -> Result<Option<Scene>, Error> {
    let mut builder = scenes::load::open(name, None)?;
    let build =
        |builder: scenes::SceneBuilder| builder.build(Skip::Unneeded).map_err(|e| scenes::load::placed(e, name));
    let seen = build(builder.clone())?;
    let middle = vec2(seen.camera.width() as f32, seen.camera.height() as f32) * 0.5;
    let ray = seen.camera.sample_we(middle, vec2(0.5, 0.5)).ray;
    let Some(hit) = seen.intersect(&ray) else { return Ok(None) };
    let normal = hit.point.ng.as_dvec3() * if ray.d.dot(hit.point.ng) > 0.0 { -1.0 } else { 1.0 };
    let at = hit.point.p.as_dvec3() + seen.origin + normal * AHEAD * f64::from(seen.bounds.radius);
    let settings = CameraSettings::pinhole(at, at + normal, 40.0, (1, 1));
    let projection = Projection::Irradiance(Receiver::Point);
    builder.camera(CameraSettings { projection, up: normal.any_orthogonal_vector(), ..settings });
    Ok(Some(build(builder)?))
}

fn grey(of: &Measurement, layer: usize) -> Moments {
    of.replicate_means.iter().map(|replicate| replicate[layer].iter().sum::<f64>() / 3.0).collect()
}

/// What was found, for people to read.
pub(super) fn in_words(found: &[Metered]) -> String {
    let mut text = String::new();
    for m in found.iter().filter(|metered| !metered.holds) {
        let _ = writeln!(
            text,
            "  A meter in the middle of the image: order {} of {} DIFFERS, {:.6} ± {:.1e} W/m² of irradiance, and is {:.6} (p = {:.1e}).",
            m.order, m.method, m.irradiance, m.standard_error, m.exact, m.p
        );
    }
    if text.is_empty() && !found.is_empty() {
        let mut names: Vec<&str> = found.iter().map(|metered| metered.method.as_str()).collect();
        names.dedup();
        let last = found.iter().map(|metered| metered.order).max().unwrap_or(0);
        let part = |m: &Metered| m.standard_error / m.exact.abs().max(f64::MIN_POSITIVE);
        let most = found.iter().filter(|m| m.exact != 0.0).map(part).fold(0.0, f64::max);
        let _ = writeln!(
            text,
            "  A meter in the middle of the image: the irradiance [W/m²] of orders 0 to {last} is that of the closed form by {}, with standard \
             errors of {:.2} % at the most.",
            crate::export::notation::enumerated(names.iter().map(|name| (*name).to_owned()).collect()),
            100.0 * most
        );
    }
    text
}
