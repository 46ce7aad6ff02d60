//! Path expressions such as `L.*SE` in the lecture's notation, by which methods name the light that they cannot carry.

use integrators::lpe::{loses, told};
use integrators::{Integrator, Layer, Technique};
use scenes::Scene;

/// The light that a method loses in a scene, a class a line, each with the orders that lose it.
pub fn missing(method: &dyn Integrator, scene: &Scene) -> Vec<String> {
    method.missing_light(&scene.facts).iter().map(|class| told(class)).collect()
}

/// Whether a method that misses these classes carries all light of a layer; of the sum of all orders up to `max_order` for
/// `None`.
pub fn carries(missing: &[String], layer: Option<Layer>, max_order: usize) -> bool {
    let has = |layer: Layer| !missing.iter().any(|class| loses(class, layer));
    layer.map_or_else(|| (0..=max_order).map(Layer::Order).all(has), has)
}

/// The radiance, channel by channel, that a single path of this layer may bring which the method meets by chance alone, at most, as often as its sample counts.
///
/// Those are paths whose walk from the camera hits an emitter where no connection would have found the same path: what the camera
/// sees shine, what it sees shine in mirrors and through glass, or everything where the method has no connections. As small as the
/// emitter is, so rare are they, and a method that has met none yet shows no sign of it, neither in its mean nor in its variance.
/// Zero where there are no such paths; infinite where samples depend on one another, so that nothing is known of how many were looked at.
pub fn largest_hit(method: &dyn Integrator, scene: &Scene, layer: Layer) -> [f64; 3] {
    let order = match layer {
        Layer::Order(order) => order,
        // Whatever holds of an order above the first holds of all.
        Layer::Tail => 2,
    };
    let makes = |s: usize| method.makes(Technique::Connect { s: s as u16, t: (order + 2 - s) as u16 });
    let connects = (1..=order + 1).any(makes);
    if !makes(0) || (connects && (order == 0 || !scene.facts.delta_lobes)) {
        return [0.0; 3];
    }
    if !method.samples_are_independent() {
        return [f64::INFINITY; 3];
    }
    scene.brightest().to_array().map(|radiance| f64::from(radiance) * method.counts())
}

/// The same of all of a measurement's layers.
pub fn largest_hits(method: &dyn Integrator, scene: &Scene, layers: &[Layer]) -> Vec<[f64; 3]> {
    layers.iter().map(|&layer| largest_hit(method, scene, layer)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn emitters_are_hit_by_chance_where_no_connection_finds_the_same_path() {
        let methods = integrators::Methods::standard();
        let hit = |scene: &str, method: &str, settings: serde_json::Value, layer: Layer| {
            let scene = scenes::load(scene, &scenes::LoadOptions::default()).unwrap();
            let hit = largest_hit(&*methods.build(method, &settings).unwrap(), &scene, layer);
            assert!(hit == [0.0; 3] || hit == scene.brightest().to_array().map(f64::from), "{hit:?}");
            hit != [0.0; 3]
        };
        let (default, order) = (|| serde_json::json!({}), Layer::Order);
        let of_bsdf = serde_json::json!({"strategy": "bsdf"});
        assert!(hit("cornell_box", "path", default(), order(0)));
        assert!(
            !hit("cornell_box", "path", default(), order(1)) && !hit("cornell_box", "path", default(), Layer::Tail)
        );
        assert!(hit("cornell_box", "path", of_bsdf, order(1)));
        assert!(!hit("cornell_box", "bdpt", default(), order(0)) && !hit("cornell_box", "light", default(), order(0)));
        for method in ["path", "bdpt"] {
            assert!(
                hit("glass_caustic", method, default(), order(1))
                    && hit("glass_caustic", method, default(), Layer::Tail)
            );
        }
        assert!(
            !hit("glass_caustic", "light", default(), order(2)) && !hit("cornell_box", "exact", default(), order(0))
        );
    }
}
