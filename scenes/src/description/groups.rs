//! `[[groups]]` of scene files, and the shapes of type `instance`.

use std::collections::BTreeMap;

use glam::DAffine3;

use super::reader::{Line, Table, Value};
use super::shapes::{Shapes, no_shapes};
use super::{tables, transform};
use crate::builder::{GroupId, SceneBuilder};
use crate::error::SceneError;
use crate::suggest::did_you_mean;

/// The groups of a scene file, by name.
#[derive(Default)]
pub(super) struct Groups<'a> {
    /// All of them; without a number those that have not been read.
    by_name: BTreeMap<&'a str, Option<GroupId>>,
    /// The name of the one that is being read.
    current: Option<&'a str>,
}

/// Reads the groups: each has a `name` and shapes, `[[groups.shapes]]`, among them instances of groups that were named before.
pub(super) fn read<'a>(
    root: &Table<'a>,
    shapes: &mut Shapes<'a, '_>,
    builder: &mut SceneBuilder,
) -> Result<(), SceneError> {
    let groups = tables(root, "groups")?;
    let mut names = Vec::with_capacity(groups.len());
    for table in &groups {
        let value = table.need("name", "\"tree\"")?;
        let name = value.text()?;
        if shapes.groups.by_name.insert(name, None).is_some() {
            return Err(value.error("there is a group of this name already; give it another"));
        }
        names.push(name);
    }
    let mut line = Line::default();
    for (table, name) in groups.iter().zip(names) {
        table.allow_only(&["name", "shapes"])?;
        let members = tables(table, "shapes")?;
        if members.is_empty() {
            return Err(no_shapes(table, &format!("the group `{name}` is empty"), "[[groups.shapes]]"));
        }
        let group = builder.begin_group_at(name, Some(table.line_after(&mut line)));
        shapes.groups.current = Some(name);
        shapes.read_list(&members, builder)?;
        builder.end_group();
        shapes.groups.by_name.insert(name, Some(group));
    }
    shapes.groups.current = None;
    Ok(())
}

impl Groups<'_> {
    /// Reads `instance { group, transform }`.
    pub fn instance(&self, table: &Table, line: usize, builder: &mut SceneBuilder) -> Result<(), SceneError> {
        table.allow_only(&["type", "group", "transform"])?;
        let value = table.need("group", "\"tree\"")?;
        let group = self.named(&value)?;
        let transform = table.get("transform").map_or(Ok(DAffine3::IDENTITY), |value| transform::read(&value))?;
        builder.instance_at(group, transform, Some(line));
        Ok(())
    }

    fn named(&self, value: &Value) -> Result<GroupId, SceneError> {
        let name = value.text()?;
        match self.by_name.get(name) {
            Some(Some(group)) => return Ok(*group),
            Some(None) if self.current == Some(name) => {
                return Err(value.error("a group cannot contain itself; take this instance out"));
            }
            Some(None) => {
                return Err(value.error("a group may hold only groups that stand before it; move that one up"));
            }
            None => {}
        }
        let names: Vec<&str> =
            self.by_name.iter().filter(|(_, group)| group.is_some()).map(|(known, _)| *known).collect();
        if names.is_empty() {
            return Err(value.error(format!("there is no such group; add `[[groups]]` with `name = \"{name}\"`")));
        }
        Err(value.error(format!("there is no such group: {}", did_you_mean(name, &names))))
    }
}
