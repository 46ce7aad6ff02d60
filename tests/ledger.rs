//! The ledger of light: none is lost or gained on the way, order by order and on every walk.

use crate::support::{builtin, contributions, seed};
use integrators::bdpt::Bdpt;
use integrators::flux::{Flux, Meter};
use integrators::light::Light;
use integrators::roulette::{Roulette, SubpathRoulette};
use integrators::vertex::{PathVertex, Site};
use integrators::{Contribution, Estimator, Sink, Wants};
use sampling::sampler::{Role, StreamKey};
use scenes::{Emitter, LoadOptions, Region, Scene, SurfaceId};

/// What leaves surfaces falls on surfaces or escapes, and of what falls there no more is scattered than fell; by glass
/// all of it is, on every walk, and by a furnace's wall its albedo.
#[test]
fn no_light_is_lost_or_gained_on_the_way() {
    for name in scenes::builtin_names() {
        let scene = scenes::load(name, &LoadOptions::default()).unwrap();
        let mut materials: Vec<String> = scene.labels.surfaces().iter().map(|names| names[0].clone()).collect();
        materials.sort();
        materials.dedup();
        let regions: Vec<_> = materials.iter().map(|label| scene.region(label).unwrap()).collect();
        let key = StreamKey::new(5 + seed(), "flux", Role::Estimate, 0);
        let flux = Flux::of(&scene, &regions, 6, key, 20_000);
        for (k, c) in (0..=6).flat_map(|k| (0..3).map(move |c| (k, c))) {
            let falling: f64 = flux.meters.iter().map(|meter| meter.arriving[k][c]).sum();
            let (leaving, escaped) = (flux.orders[k][c], flux.escaped[k][c]);
            assert!((falling + escaped - leaving).abs() <= 1e-9 * leaving, "{name} {k}: {falling} {escaped} {leaving}");
        }
        for ((label, meter), k) in materials.iter().zip(&flux.meters).flat_map(|m| (0..6).map(move |k| (m, k))) {
            let sum = |of: &[[f64; 3]], k: usize| of[k].iter().sum::<f64>();
            let (fell, left) = (sum(&meter.arriving, k), sum(&meter.leaving, k + 1));
            assert!(left <= fell * (1.0 + 1e-6), "{name} {label} {k}: {left} of {fell}");
            assert!(label != "glass" || (left - fell).abs() <= 1e-6 * fell, "{name} {label} {k}: {left} of {fell}");
        }
    }
}

/// What a surface is labelled, and its albedo.
type Surface = (&'static str, [f64; 3]);

/// Scenes whose surfaces are sampled by what they scatter, and those surfaces: Lambert's, mirrors and glass.
fn rooms() -> [(Scene, Vec<Surface>); 5] {
    let (white, red, green) =
        (("white", [0.725, 0.71, 0.68]), ("red", [0.63, 0.065, 0.05]), ("green", [0.14, 0.45, 0.091]));
    let rooms: [(&str, &[Surface]); 5] = [
        ("cornell_box", &[white, red, green, ("lamp", [0.78; 3])]),
        ("furnace", &[("glow", [0.8, 0.65, 0.5])]),
        ("glass_caustic", &[white, red, green, ("lamp", [0.78; 3]), ("glass", [1.0; 3]), ("mirror", [0.95; 3])]),
        ("mirror_caustic", &[white, red, green, ("lamp", [0.5; 3]), ("glass", [1.0; 3]), ("mirror", [0.9; 3])]),
        ("indirect_lamp", &[white, red, green, ("lamp", [0.78; 3]), ("shade", [0.5; 3])]),
    ];
    rooms.map(|(name, surfaces)| (builtin(name, 16), surfaces.to_vec()))
}

fn power(scene: &Scene) -> f64 {
    scene.emitters.iter().map(Emitter::power).sum()
}

/// Fails unless walks start with this power, all of what is emitted, in the mean of the channels.
fn starts_with(power: f64, emitted: [f64; 3], name: &str) {
    let mean = emitted.iter().sum::<f64>() / 3.0;
    assert!((mean / power - 1.0).abs() < 1e-5, "{name}: {mean} of {power}");
}

/// Fails unless what was emitted is what these parts sum to, but for rounding.
fn adds_up(emitted: f64, parts: &[f64], name: &str) {
    assert!((emitted - parts.iter().sum::<f64>()).abs() <= 3e-6 * emitted, "{name}: {emitted} in {parts:?}");
}

/// On every single walk from the emitters, whatever its length: what was emitted, which is all of their power on each, is what surfaces have
/// absorbed by the albedos of the scene's file, what has escaped, and what is carried on. To rounding, because Lambertian surfaces, mirrors
/// and glass are sampled by what they scatter.
#[test]
fn every_walk_keeps_its_ledger() {
    const LAST: usize = 8;
    const WALKS: u32 = 20_000;
    for (scene, surfaces) in rooms() {
        let name = &scene.name;
        let regions: Vec<Region> = surfaces.iter().map(|(label, _)| scene.region(label).unwrap()).collect();
        let (mut escapes, mut absorptions) = (0, 0);
        for walk in 0..WALKS {
            let flux = Flux::of(&scene, &regions, LAST, StreamKey::new(6 + seed(), "ledger", Role::Estimate, walk), 1);
            let emitted = flux.orders[0];
            starts_with(power(&scene), emitted, name);
            for c in 0..3 {
                let absorbed_by = |(meter, (_, albedo)): (&Meter, &Surface)| {
                    meter.arriving[..LAST].iter().map(|arriving| (1.0 - albedo[c]) * arriving[c]).sum::<f64>()
                };
                let absorbed: f64 = flux.meters.iter().zip(&surfaces).map(absorbed_by).sum();
                let escaped: f64 = flux.escaped.iter().map(|escaped| escaped[c]).sum();
                let carried = flux.orders[LAST][c] - flux.escaped[LAST][c];
                adds_up(emitted[c], &[absorbed, escaped, carried], name);
                escapes += u32::from(escaped > 0.0);
                absorptions += u32::from(absorbed > 0.0);
            }
        }
        assert!(absorptions > 2 * WALKS && (escapes > 0) == (name != "furnace"), "{name}: {absorptions} {escapes}");
    }
}

/// The light subpaths of contributions: what arrives at each surface, and which that is.
#[derive(Default)]
struct Subpaths(Vec<Vec<([f64; 3], SurfaceId)>>);

impl Sink for Subpaths {
    const WANTS: Wants = Wants { vertices: true, ..Wants::NOTHING };

    fn add(&mut self, c: Contribution) {
        let of_vertex = |vertex: &PathVertex| match &vertex.site {
            Site::Surface(hit) => Some((vertex.beta.to_array().map(f64::from), hit.surface)),
            _ => None,
        };
        self.0.push(c.path.light.iter().filter_map(of_vertex).collect());
    }
}

fn subpaths(scene: &Scene, method: &impl Estimator) -> Vec<Vec<([f64; 3], SurfaceId)>> {
    let mut found = Subpaths::default();
    contributions(scene, method, 8, (StreamKey::new(7 + seed(), "ledger", Role::Estimate, 0), 64), &mut found);
    found.0
}

/// So does every light subpath of what `light` and `bdpt` contribute, as it was connected: what was emitted is what surfaces before its last
/// have absorbed, and what arrives there.
#[test]
fn light_subpaths_keep_the_ledger() {
    let light = Light { roulette: Roulette::None, ..Light::default() };
    let bdpt = Bdpt { roulette: SubpathRoulette::None, ..Bdpt::default() };
    for (scene, surfaces) in rooms() {
        let name = &scene.name;
        let regions: Vec<(Region, [f64; 3])> =
            surfaces.iter().map(|&(label, albedo)| (scene.region(label).unwrap(), albedo)).collect();
        let albedo = |surface: SurfaceId| regions.iter().find(|(region, _)| region.has(surface)).unwrap().1;
        let mut longest = 0;
        for subpath in subpaths(&scene, &light).iter().chain(&subpaths(&scene, &bdpt)) {
            let (Some(&(emitted, _)), Some(&(carried, _))) = (subpath.first(), subpath.last()) else { continue };
            starts_with(power(&scene), emitted, name);
            for c in 0..3 {
                let before = &subpath[..subpath.len() - 1];
                let absorbed = before.iter().map(|&(arriving, at)| (1.0 - albedo(at)[c]) * arriving[c]).sum();
                adds_up(emitted[c], &[absorbed, carried[c]], name);
            }
            longest = longest.max(subpath.len());
        }
        assert!(longest >= 8, "{name}: {longest}");
    }
}
