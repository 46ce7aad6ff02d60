//! What shapes are made of that do not say so.

use super::Description;
use crate::import::mitsuba::bsdf::BLACK;
use crate::import::mitsuba::context::Context;
use crate::import::translation::{Place, quoted};

/// The name of the black material, which is written once.
pub fn black(place: &Place, context: &mut Context) -> String {
    let key = (std::ptr::null(), false);
    if context.material_names.insert(key, BLACK.to_string()).is_none() {
        context.materials.table(place, format!("[materials.{BLACK}]"));
        context.materials.key(place, "type", quoted("lambert"));
        context.materials.key(place, "albedo", "0.0");
    }
    BLACK.to_string()
}

/// The material of shapes that have none: black where they emit, else matte, of albedo ½.
pub fn usual(place: &Place, emits: bool, context: &mut Context) -> String {
    if emits {
        return black(place, context);
    }
    let key = (std::ptr::null(), true);
    if let Some(name) = context.material_names.get(&key) {
        return name.clone();
    }
    let name = context.fresh_name("default");
    Description::new("lambert", place).one_sided().write(&name, false, context);
    context.material_names.insert(key, name.clone());
    name
}

/// What shapes around media were of before Mitsuba 2, unless they said otherwise.
pub fn null(place: &Place, context: &mut Context) -> String {
    if let Some(name) = &context.null_name {
        return name.clone();
    }
    context.null.get_or_insert_with(|| place.clone());
    let name = context.fresh_name("none");
    Description::new("null", place).write(&name, false, context);
    context.null_name.insert(name).clone()
}
