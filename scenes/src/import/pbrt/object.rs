//! Objects: shapes that are kept once, and their instances.

use std::collections::BTreeMap;

use glam::DMat4;

use super::context::Context;
use super::shape::{self, Record};
use crate::error::SceneError;
use crate::import::mitsuba::transform::steps;
use crate::import::translation::{Lines, MEMBER, NoteKind, Place, SHAPE};
use crate::suggest::did_you_mean;

/// How many instances there may be: each is a table of the text.
const MOST_INSTANCES: usize = 500_000;

/// Shapes that are placed many times.
pub struct Object {
    /// Its name.
    pub name: String,
    /// Its shapes.
    pub records: Vec<Record>,
    /// Its line.
    pub place: Place,
}

/// An object, somewhere.
struct Instance {
    /// Its place in the list.
    object: usize,
    /// From the object's frame to the world.
    transform: DMat4,
    place: Place,
}

/// All objects, and where they are.
#[derive(Default)]
pub struct Objects {
    /// Several may have had one name.
    list: Vec<Object>,
    /// Their places in the list, by name: the last of a name.
    by_name: BTreeMap<String, usize>,
    instances: Vec<Instance>,
}

impl Objects {
    /// Adds an object that has been read.
    pub fn add(&mut self, object: Object) {
        self.by_name.insert(object.name.clone(), self.list.len());
        self.list.push(object);
    }

    /// Places an object.
    pub fn instance(
        &mut self,
        name: &str,
        transform: DMat4,
        place: &Place,
        context: &mut Context,
    ) -> Result<(), SceneError> {
        let Some(&object) = self.by_name.get(name) else {
            let names: Vec<&str> = self.by_name.keys().map(String::as_str).collect();
            let message = format!("there is no object `{}`", super::lexer::shown(name));
            return Err(place.error(message, did_you_mean(name, &names)));
        };
        if self.list[object].records.is_empty() {
            context.note(NoteKind::Ignored, place, "an instance of an object without shapes");
            return Ok(());
        }
        if self.instances.len() >= MOST_INSTANCES {
            let message = format!("there are more than {MOST_INSTANCES} instances");
            return Err(place.error(message, "put more into an object, and place fewer"));
        }
        context.note(NoteKind::Mapped, place, "`ObjectInstance` becomes `instance`");
        self.instances.push(Instance { object, transform, place: place.clone() });
        Ok(())
    }

    /// Writes the instances, and returns the groups that they place.
    pub fn write(&self, context: &mut Context) -> Result<Lines, SceneError> {
        let mut groups = Lines::default();
        let mut names: Vec<Option<String>> = vec![None; self.list.len()];
        for Instance { object: index, transform, place } in &self.instances {
            let name = match names[*index].take() {
                Some(name) => name,
                None => {
                    let object = &self.list[*index];
                    let mut members = Lines::default();
                    for record in &object.records {
                        members.append(shape::written(record, MEMBER, context)?);
                    }
                    let name = context.fresh_name(&object.name);
                    groups.group(&object.place, &name, members);
                    name
                }
            };
            context.shapes.instance(place, SHAPE, &name, steps(&[*transform]));
            names[*index] = Some(name);
        }
        Ok(groups)
    }
}
