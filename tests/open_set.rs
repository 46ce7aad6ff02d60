//! A method from outside the framework takes part like the others: in tests, in experiments, in reports.

#[path = "../examples/own_method.rs"]
#[allow(dead_code)]
mod own_method;

use crate::support::{Budget, Family, builtin, measure, method};
use serde_json::{Value, json};

/// False-alarm rate: 0.1 %.
#[test]
fn a_method_of_ones_own_agrees_with_those_of_the_list() {
    let scene = builtin("furnace", 8);
    let own = own_method::methods().build("naive", &json!({"survival": 0.9})).unwrap();
    let [own, path] = [own, method("path")]
        .map(|method| measure(&scene, method.as_ref(), method.name(), Budget::samples(64).up_to(5)));
    let mut family = Family::new("own method");
    for order in 0..=5 {
        family.image(format!("order {order}"), own.image(order), path.image(order));
    }
    family.finish(0.9);
}

/// The example itself is a command line that knows one method more.
#[test]
fn it_is_listed_and_says_what_it_cannot_do() {
    let methods = own_method::methods();
    assert_eq!(methods.names().last(), Some(&"naive"));
    let error = methods.build("naive", &json!({"survivl": 0.5})).err().unwrap().to_string();
    assert!(error.contains("did you mean `survival`"), "{error}");
    let naive = methods.build("naive", &Value::Null).unwrap();
    let lit_by_a_point = crate::support::room("point");
    let mut builder = lit_by_a_point;
    builder.point_emitter(glam::DVec3::ZERO, sampling::math::Spectrum::ONE);
    let scene = builder.build(scenes::Skip::Unneeded).unwrap();
    assert_eq!(naive.missing_light(&scene.facts).len(), 1);
    assert!(!naive.classifies());
}
