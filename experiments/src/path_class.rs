//! Path expressions such as `L.*SE` in the lecture's notation, by which methods name the light that they cannot carry.

use integrators::lpe::Expression;
use integrators::{Integrator, Layer};
use scenes::Scene;

/// The lowest order that a path of this class can have. Whatever follows the expression, which ends at the eye, is left alone; 0
/// for what is no expression, which might be anything.
pub fn least_order(class: &str) -> usize {
    let expression = class.find('E').and_then(|end| Expression::parse(&class[..=end]).ok());
    expression.map_or(0, |expression| expression.orders().0)
}

/// The light that a method loses in a scene, a class a line, each with the orders that lose it.
pub fn missing(method: &dyn Integrator, scene: &Scene) -> Vec<String> {
    let told = |class: String| match least_order(&class) {
        0 => class,
        order => format!("{class} (orders {order} and above)"),
    };
    method.missing_light(&scene.facts).into_iter().map(told).collect()
}

/// Whether a method that misses these classes carries all light of a layer; of the sum of all orders up to `max_order` for
/// `None`.
pub fn carries(missing: &[String], layer: Option<Layer>, max_order: usize) -> bool {
    let below = |bound: usize| missing.iter().all(|class| least_order(class) > bound);
    match layer {
        Some(Layer::Order(k)) => below(k),
        Some(Layer::Tail) => missing.is_empty(),
        None => below(max_order),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scatterings_that_must_be_are_counted() {
        let cases =
            [("LE", 0), ("LSE", 1), ("L.*SE: mirrors", 1), ("LS.*E from points", 1), ("L(D|S)(D|S)+E: deep", 2)];
        for (class, least) in cases.into_iter().chain([
            ("LD+S*DE", 2),
            ("paths of some kind", 0),
            ("L(D|S", 0),
            ("LX", 0),
            ("L(SD){2}E", 4),
        ]) {
            assert_eq!(least_order(class), least, "{class}");
        }
    }
}
