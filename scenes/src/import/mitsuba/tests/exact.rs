//! Scattering models have the values that they have in Mitsuba.
//!
//! `values.txt` holds, after every `bsdf`, rows of wo, wi and f |cos θ_i| in RGB by Mitsuba 3.9.1, variant `scalar_rgb`: of each,
//! as `bsdf` of `mi.load_string` with a `rectangle` about the z axis,
//!
//! ```text
//! si = scene.ray_intersect(mi.Ray3f([0.1, 0.3, 5], [0, 0, -1])); si.wi = wo
//! si.bsdf().eval(mi.BSDFContext(), si, wi)
//! ```

use super::*;
use crate::scene::Scene;
use sampling::bsdf::TransportMode;
use sampling::math::Spectrum;
use sampling::vec3;

/// A `bsdf`, how far its values may be off, and rows of numbers.
struct Known {
    bsdf: &'static str,
    slack: f32,
    rows: Vec<[f32; 9]>,
}

fn known() -> Vec<Known> {
    let mut all: Vec<Known> = Vec::new();
    let mut slack = 0.0;
    for line in include_str!("values.txt").lines() {
        if let Some(said) = line.strip_prefix("# within ") {
            slack = said.split(' ').next().and_then(|number| number.parse().ok()).expect("a number");
        } else if line.starts_with("<bsdf") {
            all.push(Known { bsdf: line, slack, rows: Vec::new() });
        } else if !line.starts_with('#') {
            let numbers: Vec<f32> = line.split(' ').map(|number| number.parse().expect("a number")).collect();
            let row = numbers.try_into().expect("nine numbers");
            all.last_mut().expect("a bsdf comes first").rows.push(row);
        }
    }
    all
}

fn scene_of(bsdf: &str) -> Scene {
    let translation = made_of(&format!("<shape type=\"rectangle\">{bsdf}</shape>"));
    translation.read("a", Path::new("."), None).unwrap().build(Skip::Unneeded).unwrap()
}

/// f |cos θ_i|.
fn value(scene: &Scene, wo: Vec3, wi: Vec3) -> Spectrum {
    // What is seen from behind is met from there.
    let side = 1.0_f32.copysign(wo.z);
    let hit = scene.intersect(&crate::ray::Ray::new(vec3(0.1, 0.3, 5.0 * side), vec3(0.0, 0.0, -side)));
    let it = hit.expect("a ray that meets the rectangle");
    it.eval(wo, wi, TransportMode::Radiance) * wi.dot(it.ns()).abs()
}

#[test]
fn values_are_mitsubas() {
    let mut worst = Vec::new();
    for Known { bsdf, slack, rows } in known() {
        let scene = scene_of(bsdf);
        let mut largest = 0.0_f32;
        for [ox, oy, oz, ix, iy, iz, r, g, b] in rows {
            let theirs = [r, g, b];
            let ours = value(&scene, vec3(ox, oy, oz), vec3(ix, iy, iz)).to_array();
            for (ours, theirs) in ours.into_iter().zip(theirs) {
                largest = largest.max((ours - theirs).abs() / theirs.abs().max(1e-6));
            }
        }
        println!("{largest:.2e} of {slack:.2e}: {bsdf}");
        if largest > slack {
            worst.push(format!("{largest:.2e}, not {slack:.2e}: {bsdf}"));
        }
    }
    assert!(worst.is_empty(), "{}", worst.join("\n"));
}
