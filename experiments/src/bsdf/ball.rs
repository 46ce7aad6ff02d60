//! What a model looks like: a ball of it on a chequered floor, under a lamp and a pale sky.

use super::Error;
use crate::budget;
use crate::export::png::Picture;
use crate::export::tone::Exposure;
use crate::subject::render_settings;
use glam::{DAffine3, DVec3, dvec3};
use integrators::{Methods, Orders, Render, RenderSettings};
use sampling::Spectrum;
use sampling::bsdf::{Bsdf, Lambert};
use sampling::sampler::SamplerKind;
use scenes::{CameraSettings, Emission, MeshData, Scene, SceneBuilder, Skip};

const SIDE: u32 = 200;
const SAMPLES: u32 = 144;
const MAX_ORDER: usize = 10;

/// A ball of the model.
///
/// # Errors
/// None that a user could mend.
pub fn picture(bsdf: &Bsdf) -> Result<Picture, Error> {
    let scene = scene(bsdf)?;
    let method = Methods::standard().build("path", &serde_json::json!({}))?;
    let settings = RenderSettings {
        samples_per_replicate: SAMPLES,
        ..render_settings(&*method, Orders::up_to(MAX_ORDER), true, 0, SamplerKind::Stratified)
    };
    let pool = budget::pool(None)?;
    let measurement = pool.install(|| -> Result<_, Error> {
        let mut render = Render::new(&scene, &*method, settings)?;
        render.run_replicate(&|_| {});
        Ok(render.finish())
    })?;
    Ok(Picture::of(&measurement, None, Exposure::default(), 1))
}

fn scene(bsdf: &Bsdf) -> Result<Scene, Error> {
    let mut builder = SceneBuilder::new("a ball");
    let material = builder.material(*bsdf);
    let ball = builder.sphere(DVec3::ZERO, 1.0, material);
    // Its poles above and below, so that what is brushed is brushed around it.
    builder.transform(ball, DAffine3::from_rotation_x(-std::f64::consts::FRAC_PI_2));
    for (parity, albedo) in [(0, 0.6), (1, 0.15)] {
        let tiles = builder.material(Bsdf::from(Lambert { albedo: Spectrum::splat(albedo) }));
        builder.mesh(chequers(parity), tiles);
    }
    let black = builder.material(Bsdf::from(Lambert { albedo: Spectrum::ZERO }));
    let lamp = builder.quad(dvec3(-3.2, 4.0, 1.0), dvec3(0.0, 0.9, 1.8), dvec3(1.8, 0.0, 0.0), black);
    builder.flip(lamp);
    builder.emit(lamp, Emission { radiance: Spectrum::new(14.0, 13.0, 11.5).into(), two_sided: true });
    builder.environment(Spectrum::new(0.30, 0.33, 0.38));
    builder.camera(CameraSettings::pinhole(dvec3(0.0, 1.1, 5.2), dvec3(0.0, -0.1, 0.0), 28.0, (SIDE, SIDE)));
    Ok(builder.build(Skip::Unneeded)?)
}

/// Every second tile of the floor.
fn chequers(parity: i32) -> MeshData {
    let mut mesh = MeshData::default();
    let tiles = (-8..8).flat_map(|i| (-8..8).map(move |k| (i, k))).filter(|(i, k)| (i + k) & 1 == parity);
    for (i, k) in tiles {
        let first = mesh.positions.len() as u32;
        let corners = [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(a, b)| dvec3((i + a) as f64, -1.0, (k + b) as f64) * 0.75);
        mesh.positions.extend(corners.map(|corner| corner.with_y(-1.0)));
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    mesh
}
