//! What a method's settings choose between has the same mean: strategies, heuristics, techniques left out.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over pairs, orders and blocks).

use crate::support::{Entry, agree, lambert, room, shining};
use glam::{DVec3, dvec3};
use sampling::bsdf::{Bsdf, RoughConductor};
use sampling::math::Spectrum;
use scenes::{Scene, Skip};
use serde_json::json;

/// A room under a large lamp, which sampled directions find too, with a ball of rough metal.
fn scene() -> Scene {
    let mut builder = room("large lamp");
    let black = builder.material(lambert(0.0));
    let metal = builder.material(Bsdf::from(RoughConductor::from_reflectance(Spectrum::new(0.9, 0.7, 0.4), 0.3, 0.3)));
    builder.sphere(dvec3(0.3, -0.5, 0.1), 0.5, metal);
    let lamp = builder.quad(dvec3(-0.7, 0.95, -0.7), DVec3::X * 1.4, DVec3::Z * 1.4, black);
    builder.emit(lamp, shining(1.0));
    builder.build(Skip::Unneeded).unwrap()
}

#[test]
fn strategies_of_direct_lighting() {
    let entry = |label, settings| Entry::new("direct", 64).with(label, settings).by_night(4);
    let entries = [
        entry("mis by power", json!({})),
        entry("mis by balance", json!({"mis": "balance"})),
        entry("emitter", json!({"strategy": "emitter"})),
        entry("bsdf", json!({"strategy": "bsdf"})),
    ];
    agree("strategies of direct lighting", &scene(), 1, &entries, 0.99);
}

#[test]
fn techniques_of_path_tracing() {
    let entry = |label, settings| Entry::new("path", 48).with(label, settings).by_night(3);
    let entries = [
        entry("mis by power", json!({"roulette": "none"})),
        entry("mis by balance", json!({"roulette": "none", "mis": "balance"})),
        entry("no next event", json!({"roulette": "none", "strategy": "bsdf"})),
        entry("next event alone", json!({"roulette": "none", "strategy": "emitter"})),
        entry("emitter points chosen from four", json!({"roulette": "none", "next_event_candidates": 4})),
    ];
    agree("techniques of path tracing", &scene(), 5, &entries, 0.99);
}

#[test]
fn weights_of_bidirectional_path_tracing() {
    let entry = |label, settings| Entry::new("bdpt", 12).with(label, settings).by_night(4);
    let entries = [
        entry("mis by power", json!({"roulette": "none"})),
        entry("mis by balance", json!({"roulette": "none", "mis": "balance"})),
        entry("mis by the maximum", json!({"roulette": "none", "mis": "maximum"})),
        entry("mis by variances", json!({"roulette": "none", "mis": "variance_aware"})),
        entry("optimal mis", json!({"roulette": "none", "mis": "optimal"})),
        entry("no emitter to camera", json!({"roulette": "none", "emitter_to_camera": false})),
        entry("nothing to camera", json!({"roulette": "none", "camera_connections": false})),
        entry("local roulette", json!({"roulette": "local"})),
        entry("roulette by throughput", json!({"roulette": "throughput", "roulette_start": 1})),
    ];
    agree("weights of bidirectional path tracing", &scene(), 5, &entries, 0.99);
}

#[test]
fn connections_of_bidirectional_path_tracing() {
    let entry = |label, settings| Entry::new("bdpt", 24).with(label, settings).by_night(5);
    let entries = [
        entry("every connection", json!({"roulette": "none"})),
        entry("several light subpaths", json!({"roulette": "none", "light_paths": 3})),
        entry("emitter points chosen from four", json!({"roulette": "none", "next_event_candidates": 4})),
        entry("roulette on connections", json!({"roulette": "none", "connections": "roulette"})),
        entry("one connection chosen", json!({"roulette": "none", "connections": "resampled", "light_paths": 2})),
    ];
    agree("connections of bidirectional path tracing", &scene(), 4, &entries, 0.99);
}
