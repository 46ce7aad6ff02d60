//! Methods that learn, mutate or solve, where others have their sweeps.

use super::lamps::seen_from_a_wall;
use super::materials::enclosure_of;
use super::places::distorted_enclosures;
use super::shapes::{ball_in_a_furnace, walls_of_slivers};
use super::{ALBEDO, EMITTED, is_a_furnace};
use crate::support::{Budget, Family, measure, method_with};
use scenes::Scene;
use serde_json::json;

/// Furnaces at the ends of other sweeps, and their albedos.
fn rooms() -> impl Iterator<Item = (String, Scene, f32)> {
    let seen = [(false, 0.0), (true, 1e-6)].map(|(corner, distance)| {
        let place = if corner { "corner" } else { "wall" };
        (format!("{place} at {distance:e}"), seen_from_a_wall(distance, corner), ALBEDO)
    });
    let painted = [1e-6, 1.0 - 1e-6].map(|albedo| (format!("albedo {albedo}"), enclosure_of(albedo, 8), albedo));
    seen.into_iter().chain(painted)
}

/// What is unbiased finds every order of every furnace.
#[test]
fn what_learns_or_mutates_finds_furnaces() {
    let balls = [1e-6, 1e6].map(|radius| {
        (format!("ball of {radius:e}"), ball_in_a_furnace(radius, 1e-5, 2.0 * radius + 1.0, None), ALBEDO)
    });
    let distorted = distorted_enclosures().map(|(label, scene)| (label.to_owned(), scene, ALBEDO));
    let slivers = [("slivers".to_owned(), walls_of_slivers(100), ALBEDO)];
    let mut family = Family::new("learning and mutating");
    for (label, scene, albedo) in rooms().chain(distorted).chain(balls).chain(slivers) {
        is_a_furnace(
            &mut family,
            &scene,
            &label,
            &["guided", "coherent", "coherent_bdpt", "pssmlt", "mmlt"],
            8,
            (albedo, EMITTED),
        );
    }
    // Chains find little of high orders where they are few.
    family.finish(0.8);
}

/// What solves finds every order of every furnace but for rounding, because the rows of its matrix add up. Where elements are long and thin
/// their couplings take it minutes to hours: distorted furnaces are left out.
#[test]
fn what_solves_finds_furnaces() {
    let radiosity = method_with("radiosity", json!({"elements": 100}));
    for (label, scene, albedo) in rooms() {
        let budget = Budget { samples: 1, replicates: 2, ..Budget::samples(1).up_to(4) };
        let rendered = measure(&scene, radiosity.as_ref(), &label, budget);
        for order in 0..=4 {
            let exact = f64::from(EMITTED) * f64::from(albedo).powi(order);
            let mean = rendered.image(order as usize).mean;
            assert!((mean / exact - 1.0).abs() < 1e-6, "{label}, order {order}: {mean} for {exact}");
        }
    }
}
